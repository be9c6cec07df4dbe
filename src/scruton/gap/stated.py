"""The damping that is stated of the rigs: what their ring-downs say of it, and how far it is believed."""

from collections.abc import Sequence

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.quantity import Quantity
from scruton.dynamics.cycles import EnvelopeData
from scruton.envelope import Cycles

_CARD = 0.5  # rigs: as how many the model card's standard deviation counts beside the ring-downs of the others


def damping_sd(stated: Sequence[Quantity | None], shown: FloatArray, usual: float) -> FloatArray:
    """Relative standard deviation of the damping ratio that is stated of every rig, (rigs,); 1 where none is.

    Where a statement has none of its own it is the `usual` one of the model card, or less: what the ring-downs of the
    other rigs, `shown` (rigs,), have the statements of this laboratory be off by.
    """
    off = np.full(len(stated), np.nan)
    for i, ratio in enumerate(stated):
        if ratio is not None and ratio.sd is None:
            off[i] = shown[i] / ratio.mean - 1.0
    found = np.ones(len(stated))
    for i, ratio in enumerate(stated):
        others = np.delete(off, i)
        proved = np.sqrt((_CARD * usual**2 + np.nansum(others**2)) / (_CARD + np.count_nonzero(np.isfinite(others))))
        if ratio is not None:
            found[i] = max(min(usual, float(proved)) if ratio.sd is None else ratio.relative_sd, 1e-4)
    return found


def rung_down(decays: Sequence[Cycles], frequency: float) -> float:
    """Damping ratio of a rig by the first and last cycles of its decays in still air; NaN without any."""
    rates = []
    for decay in decays:
        seen = clear(decay)
        if np.count_nonzero(seen) > 2:
            t, a = decay.time[seen], decay.amplitude[seen]
            rates.append(np.log(a[0] / a[-1]) / (t[-1] - t[0]) / (2.0 * np.pi * frequency))
    return max(float(np.median(rates)), 1e-5) if rates else np.nan


def clear(cycles: Cycles | EnvelopeData) -> np.ndarray:
    """Which cycles' amplitudes can be told from noise."""
    return np.asarray(cycles.amplitude > 5.0 * cycles.standard_error)
