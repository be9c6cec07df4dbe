"""Clipping: samples piled up at the largest reading."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.sampling import quantum_of, run_lengths
from scruton.envelope.thresholds import CROWDED, RUN, TOP
from scruton.envelope.types import Cycles
from scruton.envelope.windows import cut


def clipped_side(time: FloatArray, response: FloatArray, cycles: Cycles) -> str:
    """Say where a record is clipped: "above", "below", "above and below", or "" where it is not.

    Two signs are looked for, in the cycles that reach the extreme: the extreme reading repeated in a row, more
    often than rounding explains, and a top that holds far more samples than a sine's (a sensor that saturates softly).
    """
    offset = float(np.mean(response))
    sides = [
        word for word, sign in (("above", 1.0), ("below", -1.0)) if _piled_up(time, sign * (response - offset), cycles)
    ]
    return " and ".join(sides)


def _piled_up(time: FloatArray, y: FloatArray, cycles: Cycles) -> bool:
    windows = cut(time, cycles.reference_frequency)
    top = float(np.max(y))
    if top <= 0.0 or len(windows.number) == 0:
        return False
    per_cycle = np.median(windows.stop - windows.first)
    at_top = y >= top - 1e-9 * top
    # a rounded sine, too, repeats its largest reading, as long as it stays within half a quantum of it
    honest = per_cycle / np.pi * np.sqrt(2.0 * min(quantum_of(y), top) / top)
    if np.max(run_lengths(at_top)) >= max(RUN, 1.3 * honest + 2.0):
        return True
    stops = np.stack([windows.first, windows.stop], axis=1).ravel()
    padded = np.append(y, -np.inf)
    highest = np.maximum.reduceat(padded, stops)[::2]
    reach = highest > top * (1.0 - 0.25 * TOP)
    if np.count_nonzero(reach) < 3:
        return False
    crowd = np.add.reduceat(np.append(y > top * (1.0 - TOP), False).astype(float), stops)[::2]
    share = np.sum(crowd[reach]) / np.sum((windows.stop - windows.first)[reach])
    return bool(share > CROWDED * np.arccos(1.0 - TOP) / np.pi)
