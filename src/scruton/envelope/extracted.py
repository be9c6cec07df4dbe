"""The envelope of a record that was extracted elsewhere: one amplitude a cycle."""

import numpy as np

from scruton.arrays import FloatArray, IntArray
from scruton.envelope.sampling import quantum_of
from scruton.envelope.thresholds import COARSE_ENVELOPE, FEWEST_LEFT, MOST_ROUNDED, ROUNDED_LEAST, ROUNDED_SIGMAS
from scruton.envelope.types import Cycles
from scruton.errors import InputError


def cycles_from_envelope(time: FloatArray, amplitude: FloatArray, frequency: float, *, name: str = "record") -> Cycles:
    """One value per cycle of an envelope that was extracted elsewhere.

    Parameters
    ----------
    time, amplitude : (N,) array
        Seconds, and the amplitude (A/D or rad).
    frequency : float
        Frequency of the oscillation [Hz], which an envelope does not tell.
    name : str, optional
        The record's file, for error messages.

    Returns
    -------
    Cycles
        The mean over every cycle that holds samples of the line through them; an envelope that is hardly finer than one
        sample per cycle is taken as it stands. Of a finer one the cycle at either end is left out, which a filter has
        rounded as a rule, and up to two more that leave its course. `phase` is zero, `frequency` is `frequency`,
        `frequency_error` is infinite.

    Raises
    ------
    InputError
        If there are fewer than five values.

    Notes
    -----
    The standard error is one number for the record, from a_k - (a_{k-1} a_{k+1})^0.5: an exponential growth or decay
    leaves nothing in it, noise leaves (3/2)^0.5 of its standard deviation. The scatter is taken robustly (median), and
    not below the rounding of the file. Noise that the extraction has smoothed away cannot be seen: then the standard
    error is too small, and turbulence counts as noise, which makes it too large.
    """
    if np.any(~np.isfinite(amplitude)) or len(time) < 5 or frequency <= 0.0:
        raise InputError(name, "amplitude", f"{len(time)} values", "at least five finite values of an envelope")
    t, a, counts = _by_cycle(time, amplitude, frequency)
    if len(t) < 5:
        raise InputError(name, "amplitude", f"{len(t)} cycles", "an envelope of at least five cycles")
    before, after = np.maximum(a[:-2], 0.0), np.maximum(a[2:], 0.0)
    middle = np.sqrt(before * after)
    lever = np.where(middle > 0.0, (before**2 + after**2) / np.maximum(4.0 * middle**2, 1e-300), np.inf)
    scatter = float(np.median(np.abs(a[1:-1] - middle) / np.sqrt(1.0 + lever)) / 0.6745)
    largest = float(np.max(np.abs(a)))
    error = max(scatter, quantum_of(amplitude) / np.sqrt(12.0), 1e-9 * largest, np.finfo(float).tiny)
    if np.median(counts) > 1 and len(a) > FEWEST_LEFT:
        left = slice(_rounded(a, error), len(a) - _rounded(a[::-1], error))
        t, a = t[left], a[left]
    n = len(t)
    return Cycles(
        time=t,
        amplitude=a,
        standard_error=np.full(n, error),
        phase=np.zeros(n),
        frequency=np.full(n, float(frequency)),
        frequency_error=np.full(n, np.inf),
        reference_frequency=float(frequency),
        noise_sd=error * float(np.sqrt(np.median(counts))),
    )


def _by_cycle(time: FloatArray, amplitude: FloatArray, frequency: float) -> tuple[FloatArray, FloatArray, IntArray]:
    """Middle and mean of the cycles of an envelope that hold samples, and how many, (N,) each.

    The mean is that of the line through the samples over just one cycle. An envelope read off crests and troughs, or
    left by a filter, ripples at the frequency of the motion or twice that: what a mean of two samples takes out, one of
    three would leave.
    """
    step = float(np.median(np.diff(time)))
    first = time[0] - 0.5 * step
    if step * frequency > COARSE_ENVELOPE:
        cycle = np.floor((time - time[0]) * frequency * (1.0 + 1e-9)).astype(np.intp)
        starts = np.flatnonzero(np.diff(cycle, prepend=-1))
        counts = np.diff(starts, append=len(time))
        return np.add.reduceat(time, starts) / counts, np.add.reduceat(amplitude, starts) / counts, counts
    last = time[-1] + 0.5 * step
    count = int((last - first) * frequency * (1.0 + 1e-9))
    edges = first + np.arange(count + 1) / frequency
    places = np.union1d(time, edges)
    # half a step beyond the samples as the line goes
    ends = 1.5 * amplitude[[0, -1]] - 0.5 * amplitude[[1, -2]]
    values = np.interp(places, np.r_[first, time, last], np.r_[ends[0], amplitude, ends[1]])
    area = np.r_[0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(places))]
    means = np.diff(area[np.searchsorted(places, edges)]) * frequency
    counts = np.bincount(np.floor((time - first) * frequency).astype(np.intp), minlength=count)[:count]
    held = counts > 0
    return (0.5 * (edges[1:] + edges[:-1]))[held], means[held], counts[held]


def _rounded(amplitude: FloatArray, error: float) -> int:
    """How many cycles at the beginning of an envelope the ends of a filter have rounded: one, or up to where it bends.

    Its course further in is exponential or a parabola, whichever a cycle is nearer to.
    """
    found = 1
    for i in range(1, min(MOST_ROUNDED, len(amplitude) - FEWEST_LEFT)):
        here, one, two, three = amplitude[i : i + 4]
        courses = [(3.0 * (one - two) + three, np.sqrt(20.0))]
        if min(one, two) > 0.0:
            slope = one / two
            courses.append((one * slope, np.sqrt(1.0 + 4.0 * slope**2 + slope**4)))
        least = ROUNDED_LEAST * abs(one)
        off = [abs(here - course) > max(ROUNDED_SIGMAS * error * lever, least) for course, lever in courses]
        found = i + 1 if all(off) else found
    return found
