"""Where the phase of a record slips from one cycle to the next, as no motion of one mode does."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from scruton.envelope import thresholds
from scruton.envelope.types import Cycles


@dataclass(frozen=True)
class Slip:
    """A sudden turn of the phase: of samples that were lost, pieces that were joined, or a knock.

    Attributes
    ----------
    time : float
        Between the two cycles [s].
    cycles : float
        By how much of a cycle; positive where time is missing.
    sd : float
        By how much noise and turbulence turn the phase there, from cycle to cycle.
    """

    time: float
    cycles: float
    sd: float


def phase_slip(cycles: Cycles) -> Slip | None:
    """The surest slip of a record, where there is one.

    Notes
    -----
    What turns the phase of an amplitude A by an angle is a motion of that angle times A: the usual one is told by the
    median over the record, so that what is natural at the small amplitudes that a growth begins with is no slip.
    """
    if cycles.amplitude.size < thresholds.FEWEST_FOR_SLIPS:
        return None
    turn = (np.diff(cycles.phase) + np.pi) % (2.0 * np.pi) - np.pi
    beside = np.pad(turn, thresholds.SLIP_BESIDE, constant_values=np.nan)
    away = turn - np.nanmedian(sliding_window_view(beside, 2 * thresholds.SLIP_BESIDE + 1), axis=1)
    amplitude = np.minimum(cycles.amplitude[:-1], cycles.amplitude[1:])
    noise = float(np.median(cycles.standard_error))
    next_to = np.diff(cycles.time) * cycles.reference_frequency < thresholds.GAP
    seen = next_to & (amplitude > thresholds.STANDS_OUT_OF_NOISE * noise)
    if not seen.any():
        return None
    moved = np.hypot(np.sqrt(2.0) * noise, float(np.median(np.abs(away[seen]) * amplitude[seen])) / 0.6745)
    sd = np.maximum(moved / np.maximum(amplitude, noise), thresholds.SLIP_SD)
    at = int(np.argmax(np.where(seen, np.abs(away) / sd, 0.0)))
    if abs(away[at]) < max(thresholds.SLIP, thresholds.SLIP_SIGMAS * sd[at]):
        return None
    turns = 2.0 * np.pi
    return Slip(float(cycles.time[at : at + 2].mean()), float(away[at]) / turns, float(sd[at]) / turns)
