"""Tests at other speeds of a rig: what they say of peak tests that differ, and whether they are one model with them."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Effect
from scruton.dynamics.effects.aerodynamic import each_its_own
from scruton.gap.attribute import weigh
from scruton.gap.further_record import in_layout_of, transplanted
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.search import Place
from scruton.gap.thresholds import AHEAD_NATS, SPEED_TOLERANCE

DRIFT, SETTING = "reduced_velocity_drift", "setting_dependence"


def weighed_at_other_speeds(place: Place, effects: Sequence[Effect], *, workers: int) -> dict[str, float]:
    r"""Log evidence over none of the two effects that differ between tests, tests at other speeds read, too.

    A test at another speed either follows the hypothesis, to within a tolerance, or has a :math:`Y_1` and an
    :math:`\varepsilon` of its own; these are as probable.  It follows none where they are those of the peaks, a setting
    where they are those of its rig's peak, a drift where they are what the drift says at its :math:`U/(fD)`: the
    evidence is

    .. math:: \ln\tfrac12\left(Z_\mathrm{follows} + Z_\mathrm{own}\right)

    and a lock-in range where the amplitude rises and falls, as it does without any gap, speaks for neither effect.

    The unknown says nothing of a test that it was not found in, so that they lift neither above it where it leads them
    both by the peak tests.

    Parameters
    ----------
    place : Place
        With the other effects that were found in its base.
    effects : sequence of Effect
        Of these the two are weighed.
    workers : int
        Threads.

    Returns
    -------
    dict
        Nats, by name, of those that the peak tests give any support; empty where there are no such tests.
    """
    old = place.base.hypothesis
    if (data := old.data.at_other_speeds) is None:
        return {}
    acting = {name for name, one in place.candidates.items() if one.best is not None}
    asked = [effect for effect in effects if effect.name in {DRIFT, SETTING} & acting]
    tests = set(data.layout.test.tolist()) - set(old.data.layout.test.tolist())
    evidence: dict[str, list[float]] = {name: [] for name in ("", *(effect.name for effect in asked))}
    base = in_layout_of(data, old)
    start, _ = transplanted(old, base, place.base.mode, place.base.covariance)
    for tolerance in (SPEED_TOLERANCE, None) if asked else ():
        own = base.extended(each_its_own(data.layout, tests, tolerance))
        fit = own.fit(own.start_from(start, {}))
        evidence[""].append(fit.log_evidence)
        for name, one in weigh(fit, asked, workers=workers).items():
            evidence[name].append(one.log_evidence)
    total = {name: float(logsumexp(both)) for name, both in evidence.items() if both}
    return _not_above_the_unknown({name: total[name] - total[""] for name in total if name}, place.gains)


def _not_above_the_unknown(told: Mapping[str, float], gains: Mapping[str, float]) -> dict[str, float]:
    """What was told, by name; lowered to what the peak tests gain where these have the unknown well ahead."""
    own = max((gains[name] for name in told), default=np.inf)
    ahead = gains.get(UNKNOWN.name, -np.inf) > own + AHEAD_NATS
    over = max(max(told.values(), default=0.0) - own, 0.0) if ahead else 0.0
    return {name: value - over for name, value in told.items()}


def one_law_holds(alike: FittedHypothesis, others: Collection[int]) -> bool:
    """Whether the tests of one rig at speeds beside its peak's, by number, are of one law with that.

    They are where one pair of aerodynamic parameters, which is what is given, or one that changes smoothly with the
    reduced velocity (of either half the prior), to within a tolerance, has more evidence than a pair of every speed's
    own.
    """
    layout = alike.hypothesis.data.layout
    near, own = (alike.with_variants(each_its_own(layout, others, wide)) for wide in (SPEED_TOLERANCE, None))
    smooth = weigh(near, [CATALOGUE[DRIFT]])[DRIFT].log_evidence
    return bool(np.logaddexp(near.log_evidence, smooth) - np.log(2.0) > own.log_evidence)
