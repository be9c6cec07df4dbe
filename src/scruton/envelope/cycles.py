"""The envelope that feeds inference: amplitude, phase and standard error of every cycle."""

import numpy as np

from scruton.arrays import ComplexArray, FloatArray
from scruton.envelope.band import line_noise
from scruton.envelope.frequency import dominant_frequency
from scruton.envelope.offset import wandering_offset
from scruton.envelope.sampling import quantum_of, sampling
from scruton.envelope.thresholds import (
    BENT,
    MOST_HARMONICS,
    OFFSET_SHARE,
    SECOND_HARMONIC,
    THIRD_HARMONIC,
    WANDERS,
)
from scruton.envelope.tracking import Track, box_sum, follow
from scruton.envelope.types import Cycles
from scruton.envelope.windows import CycleFit, Windows, cut, fit_cycles
from scruton.errors import InputError

_NEIGHBOURHOOD = 8  # cycles on either side that share one level of noise
_PASSES = 3  # regressions that carry the local rate; each leaves about a tenth of the error of the one before


def demodulate(
    time: FloatArray,
    response: FloatArray,
    frequency: float | None = None,
    *,
    near: float | None = None,
    band: tuple[float, float] | None = None,
    name: str = "record",
) -> Cycles:
    """Amplitude, phase and standard error of every cycle, by least squares.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, strictly increasing, and y/D or rotation [rad]. Steps may be slightly unequal; a cycle that a gap
        touches is left out.
    frequency : float, optional
        Reference frequency [Hz]; by default the record's own, weighted by the squared amplitude.
    near : float, optional
        Where the record's own frequency is looked for first [Hz]; see `dominant_frequency`.
    band : (low, high), optional
        Edges [Hz] of the band that the record was filtered to: its noise is measured there (`line_noise`).
    name : str, optional
        The record's file, for error messages.

    Returns
    -------
    Cycles
        One estimate per cycle, in the response's unit.

    Raises
    ------
    InputError
        If the response is constant or shows no oscillation, or has fewer than five cycles or six samples per cycle.

    Notes
    -----
    Each cycle is regressed on [cos, sin, 1] and, from ten samples per cycle, a second harmonic; where the wave is bent,
    by a sensor that saturates or a spring, on a third one, which would leak into the first. A first pass finds
    the local frequency, growth and drift of the offset; in the second the regressors carry them, so that the
    amplitude is that at mid-cycle however fast it grows or the frequency wanders.

    The length of the complex amplitude, |z|, is too large by sigma^2/2a (Rice). So z is projected on the direction
    of its neighbours, itself left out, extrapolated along the tracked phase: linear in the noise, unbiased, and
    sometimes negative where the motion is below the noise. Above 30 standard errors |z| itself is taken, so that
    true jitter of the phase costs nothing. Windows do not overlap: white noise leaves neighbours uncorrelated.

    The standard error is from the residual of eight cycles on either side, as for white noise, times one factor for
    the record: the noise at the response's frequency is estimated as the geometric mean of that at half and at twice
    of it, seen in second differences of the offset and of the second harmonic from cycle to cycle. The factor
    stays at 1 unless the record shows otherwise. Rounding to a coarse quantum q adds its own part, since it repeats
    from cycle to cycle: the fundamental of a rounded sine is off by some (2/pi^2) q (q/a)^0.5, unless noise
    blurs the steps.  Of a record that was filtered to a band the residual is small whatever the noise: there the noise
    at the line is read off the spectrum on both sides of it.
    """
    _refuse_unusable(time, response, frequency, name)
    reference = dominant_frequency(time, response, near) if frequency is None else frequency
    if not np.isfinite(reference):
        raise InputError(name, "", "no line in the spectrum", "a record that oscillates")
    response = response - np.mean(response)
    windows = _cut(time, reference, name)
    hidden = 0.0 if band is None else line_noise(time, response, band, reference) ** 2
    if frequency is None:
        fit = fit_cycles(time, response, windows)
        advance = _track(windows, fit, hidden).rate[windows.number].imag
        power = np.abs(fit.z) ** 2
        reference *= 1.0 + float(np.sum(power * advance) / np.sum(power)) / (2.0 * np.pi)
        windows = _cut(time, reference, name)
    number = windows.number
    samples = len(time) / ((time[-1] - time[0]) * reference)
    fit, track = _regressed(time, response, windows, samples, hidden)
    quantum = quantum_of(response)
    sigma2 = np.maximum(_local_variance(fit, hidden), quantum**2 / 12.0 + np.finfo(float).tiny)
    colour = 1.0
    if band is None:
        low, high = _log_colours(fit, track.phase[number], sigma2, number)
        share = 0.5
        # Of an offset that wanders the sine of a cycle takes up more than its cosine, and not what the next one does.
        if low - high > WANDERS and (offset := wandering_offset(time, response, reference)) is not None:
            fit, track = _regressed(time, response - offset, windows, samples, hidden)
            share = OFFSET_SHARE
        colour = float(np.clip(np.exp(share * low + (1.0 - share) * high), 0.1, 1e6))
    direction, smooth_phase = track.direction[number], track.phase[number]
    amplitude = (fit.z * np.conj(direction)).real
    c, s = direction.real, direction.imag
    unit_variance = c * c * fit.cov_rr + 2.0 * c * s * fit.cov_ri + s * s * fit.cov_ii
    variance = sigma2 * unit_variance * colour
    error = np.sqrt(variance + staircase(amplitude, sigma2, quantum))
    if not _oscillates(fit.z, smooth_phase, error):
        raise InputError(name, "", "no oscillation that stands out from the noise", "a record that oscillates")
    phase = smooth_phase + np.angle(fit.z * np.exp(-1j * smooth_phase))
    local, local_error = _local_frequency(number, phase, amplitude, error, reference)
    return Cycles(
        time=windows.middle,
        amplitude=amplitude,
        standard_error=error,
        phase=phase,
        frequency=local,
        frequency_error=local_error,
        reference_frequency=float(reference),
        noise_sd=float(np.sqrt(max(np.sum(fit.squares) / np.sum(fit.freedom), hidden))),
    )


def _regressed(
    time: FloatArray, response: FloatArray, windows: Windows, samples: float, hidden: float
) -> tuple[CycleFit, Track]:
    """Regression of every cycle with the local rate and the drift of the offset carried, and the track of its phase."""
    number, reference = windows.number, windows.frequency
    fit = fit_cycles(time, response, windows)
    track, harmonics = _track(windows, fit, hidden), 2 if samples >= SECOND_HARMONIC else 1
    for _ in range(_PASSES):
        rate = track.rate[number] * reference
        drift = _offset_slope(fit.offset, number, int(number[-1]) + 1) * reference
        fit = fit_cycles(time, response, windows, rate=rate, drift=drift, harmonics=harmonics)
        track = _track(windows, fit, hidden)
    if samples >= THIRD_HARMONIC:
        bent = fit_cycles(time, response, windows, rate=rate, drift=drift, harmonics=3)
        if _third_of(bent) > BENT:
            count = min(int(samples / 4.0), MOST_HARMONICS)
            fit = fit_cycles(time, response, windows, rate=rate, drift=drift, harmonics=count)
            track = _track(windows, fit, hidden)
    return fit, track


def _refuse_unusable(time: FloatArray, response: FloatArray, frequency: float | None, name: str) -> None:
    if len(time) != len(response) or len(time) < 30:
        raise InputError(name, "", f"{len(response)} samples", "at least 30 samples, six to each of five cycles")
    if not (np.all(np.isfinite(response)) and np.all(np.isfinite(time))):
        raise InputError(name, "", "values that are not finite", "numbers only")
    if np.any(np.diff(time) <= 0.0):
        raise InputError(name, "time", "time that does not increase", "strictly increasing time")
    if np.ptp(response) == 0.0:
        raise InputError(name, "", f"a constant signal ({response[0]:g})", "a record that oscillates")
    if frequency is not None and not frequency > 0.0:
        raise InputError(name, "frequency", f"{frequency:g} Hz", "a positive frequency")


def _cut(time: FloatArray, frequency: float, name: str) -> Windows:
    step = sampling(time).step
    per_cycle = 1.0 / (frequency * step)
    if per_cycle < 5.999:
        raise InputError(name, "", f"{min(per_cycle, 5.9):.1f} samples per cycle at {frequency:.4g} Hz",
                         "at least six samples per cycle")  # fmt: skip
    cycles = float(time[-1] - time[0]) * frequency
    if cycles > 5.0 * len(time) + 1e6:
        raise InputError(name, "time", f"{cycles:.3g} cycles in {len(time)} samples", "a record without such gaps")
    windows = cut(time, frequency)
    if len(windows.number) < 5:
        raise InputError(name, "", f"{len(windows.number)} whole cycles at {frequency:.4g} Hz",
                         "at least five whole cycles")  # fmt: skip
    return windows


def _third_of(fit: CycleFit) -> float:
    """Third harmonic over the first, of all cycles together, less what noise makes of it."""
    size = np.abs(fit.z)
    in_step = fit.third * np.conj(fit.z / np.maximum(size, 1e-300)) ** 3
    noise = 4.0 * np.sqrt(np.sum(np.square(np.abs(in_step) * size)))
    return float((np.abs(np.sum(in_step * size)) - noise) / np.sum(size**2))


def _track(windows: Windows, fit: CycleFit, hidden: float) -> Track:
    """Follow the phase on the unbroken grid of cycles, where missing cycles count nothing."""
    grid = int(windows.number[-1]) + 1
    z, variance, present = np.zeros(grid, dtype=complex), np.zeros(grid), np.zeros(grid, dtype=bool)
    z[windows.number], present[windows.number] = fit.z, True
    variance[windows.number] = _local_variance(fit, hidden) * 0.5 * (fit.cov_rr + fit.cov_ii)
    return follow(z, variance, present)


def _local_variance(fit: CycleFit, hidden: float) -> FloatArray:
    """Variance of the noise about each cycle from its residuals, and at least the one that they cannot show."""
    return np.maximum(box_sum(fit.squares, _NEIGHBOURHOOD) / box_sum(fit.freedom, _NEIGHBOURHOOD), hidden)


def _offset_slope(offset: FloatArray, number: np.ndarray, grid: int) -> FloatArray:
    """Slope of the offset per cycle, from a line through five cycles."""
    full = np.interp(np.arange(grid), number, offset)
    if len(full) < 5:
        return np.zeros(len(number))
    padded = np.pad(full, 2, mode="reflect", reflect_type="odd")
    slope = np.convolve(padded, np.array([2.0, 1.0, 0.0, -1.0, -2.0]) / 10.0, mode="valid")
    return np.asarray(slope[number])


def _log_colours(fit: CycleFit, phase: FloatArray, sigma2: FloatArray, number: np.ndarray) -> tuple[float, float]:
    """Logarithms of the noise's power below and above the response's frequency, over that of white noise alike.

    White noise has the same residual. Both are 0 unless the record shows otherwise.
    """
    triple = (number[2:] - number[:-2]) == 2
    if np.count_nonzero(triple) < 8:
        return 0.0, 0.0

    def ratio(x: ComplexArray | FloatArray, unit: FloatArray, median: float) -> float:
        difference = x[2:] - 2.0 * x[1:-1] + x[:-2]
        expected = (sigma2 * unit)[1:-1] * 6.0
        return float(np.median((np.abs(difference) ** 2 / expected)[triple])) / median

    # medians of chi-square with one degree of freedom, and with two, over their means
    low = ratio(fit.offset, fit.cov_offset, 0.4549)
    high = ratio(fit.second * np.exp(-2j * phase), fit.cov_second, 0.6931) if np.any(fit.second) else 1.0
    if not (low > 0.0 and high > 0.0):
        return 0.0, 0.0
    below, above = float(np.log(low)), float(np.log(high))
    scatter2 = 3.5 / np.count_nonzero(triple)  # of their mean under white noise
    shrink = max(0.0, 1.0 - 4.0 * scatter2 / max((0.5 * (below + above)) ** 2, 1e-300))
    return shrink * below, shrink * above


def staircase(amplitude: FloatArray, sigma2: FloatArray, quantum: float) -> FloatArray:
    """Variance of the amplitude of a rounded sine, (N,): leading Bessel term of the staircase, blurred by noise.

    `sigma2` is the variance of single readings, their rounding included.
    """
    if quantum == 0.0:
        return np.zeros_like(amplitude)
    steps = np.maximum(np.abs(amplitude) / quantum, 0.25)
    blur = np.exp(-4.0 * np.pi**2 * np.maximum(sigma2 / quantum**2 - 1.0 / 12.0, 0.0))
    return quantum**2 * blur * 2.0 / (np.pi**4 * steps)


def misread(response: FloatArray, cycles: Cycles) -> float:
    """What the steps of its readings, where no noise blurs them, leave the usual amplitude of a record off by at most.

    Of itself; alike in cycles of one amplitude.
    """
    usual = float(np.median(cycles.amplitude))
    variance = staircase(np.array([usual]), np.array([cycles.noise_sd**2]), quantum_of(response))
    return float(np.sqrt(2.0 * variance[0])) / max(usual, np.finfo(float).tiny)


def _oscillates(z: ComplexArray, phase: FloatArray, error: FloatArray) -> bool:
    """True where some stretch of the record stands out: no noise reaches nine standard errors of its mean."""
    steady, variance = z * np.exp(-1j * phase), error**2
    half = 1
    while half < 2 * len(z):
        if np.any(np.abs(box_sum(steady, half)) > 9.0 * np.sqrt(np.maximum(box_sum(variance, half), 0.0))):
            return True
        half *= 4
    return False


def _local_frequency(
    number: np.ndarray, phase: FloatArray, amplitude: FloatArray, error: FloatArray, reference: float
) -> tuple[FloatArray, FloatArray]:
    """Frequency of each cycle from a line through the phases of five, weighted by their precision."""
    n = len(number)
    weight = np.clip((amplitude / error) ** 2, 1e-6, 1e100)  # a stretch of zeros has no noise at all
    sums = np.zeros((5, n))
    for shift in range(-2, 3):
        shifted = np.arange(n) + shift
        inside = (shifted >= 0) & (shifted < n)
        at = np.clip(shifted, 0, n - 1)
        x = (number[at] - number).astype(float)
        inside &= np.abs(x) <= 2
        w = np.where(inside, weight[at], 0.0)
        y = phase[at] - phase
        sums += w * np.stack([np.ones(n), x, x * x, y, x * y])
    s0, s1, s2, sy, sxy = sums
    spread = s2 - s1 * s1 / s0
    known = spread > 0.0
    safe = np.where(known, spread, 1.0)
    per_cycle = np.where(known, (sxy - s1 * sy / s0) / safe, 0.0)
    relative = np.where(known, 1.0 / np.sqrt(safe), np.inf) / (2.0 * np.pi)
    return reference * (1.0 + per_cycle / (2.0 * np.pi)), reference * np.minimum(relative, 1.0)
