"""Following phase, frequency and growth from cycle to cycle, through noise as through strong motion.

Everything here averages over as few cycles as give a direction that can be relied on: one cycle where the motion
stands far above the noise, hundreds where it has sunk into it.
"""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import BoolArray, ComplexArray, FloatArray
from scruton.envelope.thresholds import CLEAR, RELIABLE


@dataclass(frozen=True, eq=False)
class Track:
    """What is known of each cycle from its neighbours, (K,) arrays on the unbroken grid of cycles.

    `phase` is smooth, against the reference [rad]; `direction`, a unit vector along the response, is independent of the
    cycle's own noise unless the motion is far above it; `rate` is growth plus i times turn [rad], per cycle.
    """

    phase: FloatArray
    direction: ComplexArray
    rate: ComplexArray


def box_sum[A: (FloatArray, ComplexArray)](x: A, half: int) -> A:
    """Sum over `half` neighbours on both sides and the element itself, cut off at the ends."""
    n = len(x)
    total = np.concatenate([np.zeros(1, dtype=x.dtype), np.cumsum(x)])
    i = np.arange(n)
    result: A = total[np.minimum(i + half + 1, n)] - total[np.maximum(i - half, 0)]
    return result


def _widths(n: int) -> list[int]:
    """Powers of two below n, and n."""
    return [*(2**k for k in range((n - 1).bit_length())), n]


def _path(z: ComplexArray, variance: FloatArray) -> FloatArray:
    """A smooth phase [rad] that turns as the response does, found where the motion is strong first.

    At each width of averaging, cycles whose average stands out get their phase from it; the others are
    interpolated, or extrapolated with the frequency at the end of what is known, which is what keeps the next, wider
    average coherent. Where nothing stands out the reference frequency stands.

    What is returned is the running sum of slopes over many times the width of averaging: its differences between
    neighbours carry next to nothing of their noise, so that turning by it leaves them independent.
    """
    n = len(z)
    width = np.full(n, n)
    phase, known = np.zeros(n), np.zeros(n, dtype=bool)
    for half in _widths(n):
        average = box_sum(z * np.exp(-1j * phase), half)
        new = ~known & (np.abs(average) > RELIABLE * np.sqrt(box_sum(variance, half))) & (np.abs(average) > 0.0)
        phase[new] += np.angle(average[new])
        width[new] = 4 * half
        known |= new
        at = np.flatnonzero(known)
        if len(at) == 0:
            continue
        values = np.unwrap(phase[at])
        phase = np.interp(np.arange(n), at, values)
        reach = max(16, 4 * half)
        for end, far in ((0, min(reach, len(at) - 1)), (-1, -1 - min(reach, len(at) - 1))):
            span = abs(float(at[end] - at[far]))
            # a frequency seen over less than one average is hardly known: lean to the reference
            slope = (values[end] - values[far]) / (at[end] - at[far]) / (1.0 + (2 * half / span) ** 2) if span else 0.0
            outside = slice(0, at[0]) if end == 0 else slice(at[-1] + 1, n)
            phase[outside] = values[end] + slope * (np.arange(n)[outside] - at[end])
        if known.all():
            break
    low, high = np.maximum(np.arange(n) - width, 0), np.minimum(np.arange(n) + width, n - 1)
    return np.cumsum((phase[high] - phase[low]) / (high - low))


def _neighbours(z: ComplexArray, variance: FloatArray, present: BoolArray) -> tuple[ComplexArray, ComplexArray]:
    """Direction of each cycle from the fewest neighbours that show one, and the complex rate there."""
    n = len(z)
    direction, rate = np.ones(n, dtype=complex), np.zeros(n, dtype=complex)
    near = np.abs(box_sum(z, 1)) ** 2
    clear = present & (near >= CLEAR**2 * box_sum(variance, 1)) & (np.abs(z) ** 2 >= CLEAR**2 * variance)
    direction[clear] = z[clear]
    slope = _log_slope(z)
    usable = clear & np.isfinite(slope)
    rate[usable] = slope[usable]
    open_ = ~clear
    unset = ~usable
    for half in _widths(n):
        if not (open_.any() or unset.any()):
            break
        total, noise = box_sum(z, half), np.maximum(box_sum(variance, half) - variance, 0.0)
        others = total - z
        reliable = (np.abs(others) ** 2 >= RELIABLE**2 * noise) & (np.abs(others) > 0.0)
        if half == n:
            reliable[:] = np.abs(others) > 0.0
        done = open_ & reliable
        direction[done] = others[done]
        open_ &= ~done
        slope = _log_slope(total)
        done = unset & reliable & np.isfinite(slope)
        rate[done] = slope[done]
        unset &= ~done
    length = np.abs(direction)
    return np.where(length > 0.0, direction / np.maximum(length, np.finfo(float).tiny), 1.0), rate


def _log_slope(z: ComplexArray) -> ComplexArray:
    """Central (at the ends one-sided) difference of log z from cycle to cycle; not finite where z is zero."""
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.log(z[1:] / z[:-1])
    known = np.isfinite(step)
    step[~known] = 0.0
    total, count = np.zeros_like(z), np.zeros(len(z))
    total[:-1] += step
    total[1:] += step
    count[:-1] += known
    count[1:] += known
    # beside a gap, as at the ends, one side is enough
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)


def follow(z: ComplexArray, variance: FloatArray, present: BoolArray) -> Track:
    """Follow the phase of cycle amplitudes z against the reference frequency, (K,), that lie in noise.

    `variance` is that of the real (or imaginary) part; where the cycle is not `present` both are 0.
    """
    path = _path(z, variance)
    direction, rate = _neighbours(z * np.exp(-1j * path), variance, present)
    rate = np.clip(rate.real, -1.0, 1.0) + 1j * (rate.imag + np.gradient(path))
    return Track(path + np.unwrap(np.angle(direction)), direction * np.exp(1j * path), rate)
