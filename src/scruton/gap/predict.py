"""Stable amplitudes that a hypothesis predicts: of a test, at another Scruton number, and for the bridge."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.limit_cycle import limit_cycle_amplitude, transferred
from scruton.dynamics.reading import readings
from scruton.gap.data import GapData
from scruton.gap.hypothesis import Hypothesis


def stable_amplitude(
    hypothesis: Hypothesis,
    u: FloatArray,
    record: int,
    *,
    scruton_number: float | None = None,
    bridge: bool = False,
    reading: bool = False,
) -> FloatArray:
    """Stable amplitude that a hypothesis gives a test of the campaign.

    Parameters
    ----------
    hypothesis : Hypothesis
    u : (W, d) array
        Coordinates, one row a draw.
    record : int
        A record in wind of that test, by its number in the layout.
    scruton_number : float, optional
        At this Scruton number, by other structural damping in the same rig and wind, in place of the rig's own.
        Another rig's damping is given so, too; an error of the rig's own stated damping goes with that damping.
    bridge : bool
        Without friction, gain and all else that does not go to a bridge: see `dynamics.limit_cycle.transferred`.
    reading : bool
        As the sensor reads it, gain and saturation included.

    Returns
    -------
    (W,) array
        A/D or rad; 0 where the motion dies out, inf where it grows without end.
    """
    data = hypothesis.data
    table = hypothesis.table(u)[:, record]
    if scruton_number is not None:
        table[:, Term.STRUCTURAL] = data.layout.omega[record] * damping_at(data, record, scruton_number)
    if bridge:
        table = transferred(table)
    found = limit_cycle_amplitude(table, data.channels.knots, data.layout.reference_amplitude)
    if reading:
        found = np.where(np.isfinite(found) & (found > 0.0), readings(table, found), found)
    return found


def damping_at(data: GapData, record: int, scruton_number: float) -> float:
    """Structural damping ratio that gives the rig of a record in wind this Scruton number."""
    layout = data.layout
    return float(scruton_number * data.nominal_damping[record] / layout.scruton_number[record])
