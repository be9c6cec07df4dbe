"""What no record in wind can show, with a bound on what it would do to the bridge."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Extent, Parameter, Scope, Variant, add
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.limit_cycle import limit_cycle_amplitude, transferred
from scruton.gap import thresholds
from scruton.gap.diagnosis import Diagnosis
from scruton.gap.thresholds import BOUND_SIGMAS


def invisible(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """List what records in wind cannot show, with a bound on the error of the bridge's stable amplitude.

    The bridge is taken at the middle Scruton number of the campaign.  Friction alike in every rig has the form of a
    smaller epsilon, and an error of damping common to all that of a smaller Y1: still-air decays show them; where
    there are some, the bound is what those leave.  A gain of all channels alike and the mass are shown by no record.

    Returns
    -------
    list of dict
        `name`; `text`; `bound`: of the relative error of the bridge's stable amplitude, in per cent.
    """
    data, layout, r = diagnosis.data, diagnosis.data.layout, diagnosis.data.middle
    if r < 0:
        return []
    row = transferred(diagnosis.final.table[r])
    rate, level = layout.reference_rate, layout.reference_amplitude
    mass = float(np.sqrt(np.mean(data.mass_sd[layout.wind] ** 2))) or thresholds.UNKNOWN_MASS
    friction = _seen(diagnosis, Term.FRICTION, rate * level, thresholds.INVISIBLE_FRICTION)
    sd = float(np.max(np.where(data.damping_sd < 1.0, data.damping_sd, 0.1)))
    damping = _seen(diagnosis, Term.STRUCTURAL, rate, BOUND_SIGMAS * sd * row[Term.STRUCTURAL] / rate)
    aerodynamic = [Term.AERO, Term.DRIVE, Term.AERO_LINEAR, Term.AERO_SQUARE, Term.AERO_FOURTH]

    def settled(terms: Sequence[Term] = (), factor: float = 1.0, added: float = 0.0) -> float:
        """Stable amplitude with some coefficients changed."""
        moved = row[None].copy()
        moved[:, list(terms)] = moved[:, list(terms)] * factor + added
        return float(limit_cycle_amplitude(moved, data.channels.knots, level)[0])

    a = settled()

    def percent(moved: float) -> float:
        return round(100.0 * abs(moved / a - 1.0), 2) if a > 0.0 and np.isfinite(moved) else float("inf")

    def share(fraction: float) -> str:
        return f"{100.0 * fraction:.2g} %"

    gain = thresholds.INVISIBLE_GAIN
    shown = "; a free decay in still air of every rig shows it"
    if np.any(~layout.wind):
        shown = "; bounded by the still-air decays here"
    entries = [
        ("friction_everywhere", percent(settled([Term.DRIVE], added=friction * rate * level)),
         f"Dry friction alike in every rig looks like a smaller epsilon{shown}. Friction of {share(friction)} of "
         "the relaxation damping would make a bridge without it move more by {}"),
        ("damping_constant", percent(settled([Term.AERO], added=-damping * rate)),
         f"An error of the structural damping common to all rigs looks like another Y1{shown}. One of {share(damping)} "
         "of the relaxation damping would change the bridge's amplitude by {}"),
        ("gain_common", round(100.0 * gain, 2),
         f"A gain of all channels alike scales every amplitude: {share(gain)} would change the bridge's "
         "amplitude by {}; a static calibration shows it"),
        ("mass", percent(settled(aerodynamic, 1.0 + BOUND_SIGMAS * mass)),
         f"The mass ratio stands beside Y1 in every equation: an error of {share(BOUND_SIGMAS * mass)} would change "
         "the bridge's amplitude by {}; added mass of known size shows it"),
    ]  # fmt: skip
    return [{"name": n, "text": text.format(f"{bound:.2g} %"), "bound": bound} for n, bound, text in entries]


def _seen(diagnosis: Diagnosis, term: Term, unit: float, prior: float) -> float:
    """How large a coefficient common to all records may be, over its unit: as the prior says, or as records leave."""
    scope = Scope(Extent.EVERYWHERE, diagnosis.data.layout.everywhere())

    def apply(table: FloatArray, values: Any, _layout: Any) -> None:
        add(table, term, values["size"] * unit)

    probe = Variant("probe", (Parameter("size", 0.0, max(prior, 1e-9), scope.members),), apply, scope)
    hypothesis = diagnosis.final.hypothesis.extended(probe)
    at = np.append(diagnosis.final.mode, 0.0)
    _, _, fisher = hypothesis.scores(at)
    # Of the whole coefficient: an effect that was found shares it with the probe.
    step = 1e-5 * hypothesis.prior[1]
    whole = hypothesis.table(np.concatenate([at[None], at + np.diag(step)]))[:, :, term].mean(axis=1) / unit
    slope = (whole[1:] - whole[0]) / step
    return min(prior, BOUND_SIGMAS * float(np.sqrt(slope @ np.linalg.solve(fisher, slope))))
