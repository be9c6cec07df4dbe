"""What no record in wind can show, and what it would do to the bridge: invisible is not harmless."""

from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Extent, Parameter, Scope, Variant
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.limit_cycle import limit_cycle_amplitude, transferred
from scruton.gap.diagnosis import Diagnosis
from scruton.gap.thresholds import BOUND_SIGMAS, INVISIBLE_FRICTION, INVISIBLE_GAIN, UNKNOWN_MASS


def invisible(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """List what records in wind cannot show, with a bound on the error of the bridge's stable amplitude.

    The bridge is taken at the middle Scruton number of the campaign.  Friction alike in every rig has the form of a
    smaller epsilon, and an error of damping common to all that of a smaller Y1: still-air decays show them; where
    there are some, the bound is what those leave.  A gain of all channels alike and the mass are shown by no record.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    list of dict
        `name`; `text`; `bound`: of the relative error of the bridge's stable amplitude, in per cent.
    """
    data = diagnosis.data
    if data.middle < 0:
        return []
    layout, r = data.layout, data.middle
    row = transferred(diagnosis.final.table[r])
    a = _settled(diagnosis, row)
    rate, still = layout.reference_rate, bool(np.any(~layout.wind))
    shown = "; bounded by the still-air decays here" if still else "; a free decay in still air of every rig shows it"
    mass = float(np.sqrt(np.mean(data.mass_sd[layout.wind] ** 2))) or UNKNOWN_MASS

    friction = _seen(diagnosis, int(Term.FRICTION), rate * layout.reference_amplitude, INVISIBLE_FRICTION)
    with_friction = row.copy()
    with_friction[Term.DRIVE] += friction * rate * layout.reference_amplitude
    sd = float(np.max(np.where(data.damping_sd < 1.0, data.damping_sd, 0.1)))
    offset = BOUND_SIGMAS * sd * row[Term.STRUCTURAL] / rate
    damping = _seen(diagnosis, int(Term.STRUCTURAL), rate, offset)
    misjudged = row.copy()
    misjudged[Term.AERO] -= damping * rate
    heavier = row.copy()
    heavier[[int(Term.AERO), int(Term.DRIVE), int(Term.AERO_LINEAR), int(Term.AERO_SQUARE), int(Term.AERO_FOURTH)]] *= (
        1.0 + BOUND_SIGMAS * mass
    )

    def percent(table: FloatArray) -> float:
        moved = _settled(diagnosis, table)
        return round(100.0 * abs(moved / a - 1.0), 2) if a > 0.0 and np.isfinite(moved) else float("inf")

    entries = [
        ("friction_everywhere", percent(with_friction),
         f"Dry friction alike in every rig looks like a smaller epsilon{shown}. Friction of {friction:.1%} of the "
         "relaxation damping would make a bridge without it move more by {}"),
        ("damping_constant", percent(misjudged),
         f"An error of the structural damping common to all rigs looks like another Y1{shown}. One of {damping:.1%} of "
         "the relaxation damping would change the bridge's amplitude by {}"),
        ("gain_common", round(100.0 * INVISIBLE_GAIN, 2),
         f"A gain of all channels alike scales every amplitude: {INVISIBLE_GAIN:.0%} would change the bridge's "
         "amplitude by {}; a static calibration shows it"),
        ("mass", percent(heavier),
         f"The mass ratio stands beside Y1 in every equation: an error of {BOUND_SIGMAS * mass:.1%} would change the "
         "bridge's amplitude by {}; added mass of known size shows it"),
    ]  # fmt: skip
    return [{"name": n, "text": text.format(f"{bound:.2g} %"), "bound": bound} for n, bound, text in entries]


def _settled(diagnosis: Diagnosis, row: FloatArray) -> float:
    data = diagnosis.data
    return float(limit_cycle_amplitude(row[None], data.channels.knots, data.layout.reference_amplitude)[0])


def _seen(diagnosis: Diagnosis, term: int, unit: float, prior: float) -> float:
    """How large a coefficient common to all records may be, over its unit: as the prior says, or as records leave."""
    layout = diagnosis.data.layout
    scope = Scope(Extent.EVERYWHERE, layout.everywhere())

    def apply(table: FloatArray, values: Any, _layout: Any) -> None:
        table[:, :, term] += values["size"] * unit

    probe = Variant("probe", (Parameter("size", 0.0, max(prior, 1e-9), scope.members),), apply, scope)
    hypothesis = diagnosis.final.hypothesis.extended(probe)
    _, _, fisher = hypothesis.scores(np.append(diagnosis.final.mode, 0.0))
    # Of the whole coefficient: an effect that was found shares it with the probe.
    at = np.append(diagnosis.final.mode, 0.0)
    step = 1e-5 * hypothesis.prior[1]
    whole = hypothesis.table(np.concatenate([at[None], at + np.diag(step)]))[:, :, term].mean(axis=1) / unit
    slope = (whole[1:] - whole[0]) / step
    return min(prior, BOUND_SIGMAS * float(np.sqrt(slope @ np.linalg.solve(fisher, slope))))
