"""Still-air ring-downs: natural frequency, and structural damping as a constant and against amplitude."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.thresholds import FEWEST_CYCLES, VISIBLE
from scruton.envelope.types import Cycles
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown

_BANDWIDTH = 0.35  # of the smooth damping curve, in ln A: an octave is 0.69
_CURVE = 40  # points of the smooth damping curve


@dataclass(frozen=True)
class DampingBand:
    """Structural damping in one band of amplitude: mean over the plucks that reach it.

    `sd` is the standard deviation between plucks, or for a single one that of its own regression.
    """

    lower: float
    upper: float
    damping_ratio: float
    sd: float
    plucks: int


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class RingDown:
    """What still-air plucks of one rig say; amplitudes in A/D or rad.

    Attributes
    ----------
    frequency, frequency_sd : float
        Natural frequency f0 [Hz], mean over plucks, and the standard error of that mean.
    damping_ratio, damping_ratio_sd : float
        Structural damping xi_s as one constant over the whole decay, and its standard error.
    bands : tuple of DampingBand
        Damping by octave of amplitude, largest first.
    curve_amplitude, curve_damping_ratio, curve_sd : (G,) array
        Smooth damping against amplitude (ascending), over an octave or so at a time.
    """

    frequency: float
    frequency_sd: float
    damping_ratio: float
    damping_ratio_sd: float
    bands: tuple[DampingBand, ...]
    curve_amplitude: FloatArray
    curve_damping_ratio: FloatArray
    curve_sd: FloatArray

    def structural_damping(self, amplitude: FloatArray) -> FloatArray:
        """xi_s(A) for Eq. (6): the smooth curve, held constant beyond its ends."""
        a = np.maximum(np.asarray(amplitude, dtype=float), np.finfo(float).tiny)
        xi: FloatArray = np.interp(np.log(a), np.log(self.curve_amplitude), self.curve_damping_ratio)
        return xi


@dataclass(frozen=True, eq=False)
class _Pluck:
    """The usable stretch of one ring-down: time, ln amplitude, its variance, phase, angular frequency."""

    time: FloatArray
    log_amplitude: FloatArray
    variance: FloatArray
    phase: FloatArray
    omega: FloatArray
    phase_known: bool


def ring_down(plucks: Sequence[Cycles], *, edges: FloatArray | None = None, name: str = "ring-down") -> RingDown:
    """Natural frequency and structural damping from one or several ring-downs of a rig.

    Parameters
    ----------
    plucks : sequence of Cycles
        One for each pluck, from `demodulate` or `cycles_from_envelope`.
    edges : (m + 1,) array, optional
        Ascending edges of the amplitude bands; by default octaves down from the largest amplitude.
    name : str, optional
        The rig, for error messages.

    Raises
    ------
    InputError
        If no pluck has four cycles above the noise.

    Notes
    -----
    Each pluck starts at its largest amplitude, less the first cycles if they depart from the decay that follows (the
    release itself), and ends where it has sunk to four standard errors. The logarithm of the amplitude is
    regressed on time with weights from the standard errors and from the scatter about the line itself, so that the few
    largest amplitudes of a clean record do not decide alone. Where several plucks scatter more than their
    regressions say, the scatter is believed.
    """
    cut = [(_usable(c), c.reference_frequency) for c in plucks]
    cut = [(p, f) for p, f in cut if len(p.time) >= FEWEST_CYCLES]
    usable, references = [p for p, _ in cut], np.array([f for _, f in cut])
    if not usable:
        raise InputError(name, "", "no ring-down with four cycles above the noise", "a pluck in still air")
    fits = np.array([_line(p.time, -p.log_amplitude, p.variance) for p in usable])
    mean_omega = np.array([np.average(p.omega, weights=1.0 / p.variance) for p in usable])
    turns = np.array([_line(p.time, p.phase, p.variance) if p.phase_known else (0.0, np.inf) for p in usable])
    frequency, damping = references + turns[:, 0] / (2.0 * np.pi), fits[:, 0] / mean_omega
    f0, f0_sd = _pool(frequency, turns[:, 1] / (2.0 * np.pi))
    xi, xi_sd = _pool(damping, fits[:, 1] / mean_omega)
    return RingDown(f0, f0_sd, xi, xi_sd, _bands(usable, edges), *_curve(usable))


def _usable(cycles: Cycles) -> _Pluck:
    """Cut a pluck to its decay: from the largest amplitude, without the release, down to the noise."""
    a, error = cycles.amplitude, cycles.standard_error
    begin = int(np.argmax(a))
    sunk = np.flatnonzero(_smooth(a[begin:]) < VISIBLE * error[begin:])
    stop = begin + int(sunk[0]) if len(sunk) else len(a)
    begin += _release(cycles.time[begin:stop], a[begin:stop], error[begin:stop])
    part = slice(begin, stop)
    # weights from the smoothed amplitude: a weight that goes with its own noise makes the slope lean
    log_a = np.log(np.maximum(a[part], 0.5 * error[part]))
    variance = (error[part] / np.exp(_smooth(log_a))) ** 2
    return _Pluck(
        time=cycles.time[part],
        log_amplitude=log_a + 0.5 * variance,  # the mean logarithm of a noisy amplitude is too small by this
        variance=variance,
        phase=cycles.phase[part],
        omega=2.0 * np.pi * cycles.frequency[part],
        phase_known=bool(np.all(np.isfinite(cycles.frequency_error))),
    )


def _release(time: FloatArray, a: FloatArray, error: FloatArray) -> int:
    """Number of leading cycles, three at most, that the following decay does not lead back to."""
    if len(a) < 16:
        return 0
    ahead = slice(3, 3 + max(12, len(a) // 4))
    log_a = np.log(np.maximum(a, 0.5 * error))
    curve = np.polynomial.Polynomial.fit(time[ahead], log_a[ahead], 2)
    scatter = float(np.std(log_a[ahead] - curve(time[ahead])))
    # a parabola led back over three cycles is about three times less certain than its points
    limit = 4.0 * np.sqrt((3.0 * scatter) ** 2 + (error[:3] / a[:3]) ** 2)
    off = np.flatnonzero(np.abs(log_a[:3] - curve(time[:3])) > limit)
    return int(off[-1]) + 1 if len(off) else 0


def weighted_line(x: FloatArray, y: FloatArray, weights: FloatArray) -> tuple[float, float, FloatArray]:
    """Slope of y against x by weighted least squares, the weighted sum of squares of x about its mean, residuals."""
    dx = x - np.average(x, weights=weights)
    spread = float(np.sum(weights * dx * dx))
    slope = float(np.sum(weights * dx * y)) / spread
    return slope, spread, y - np.average(y, weights=weights) - slope * dx


def _line(x: FloatArray, y: FloatArray, variance: FloatArray) -> tuple[float, float]:
    """Slope of a line and its standard error; scatter beyond `variance` counts equally for all points."""
    extra = 0.0
    for _ in range(5):
        w = 1.0 / (variance + extra + 1e-30)
        slope, spread, residual = weighted_line(x, y, w)
        extra = max(0.0, float(np.average(residual**2, weights=w) - np.average(variance, weights=w)))
    chi2 = float(np.sum(w * residual**2)) / max(1, len(x) - 2)
    # residuals that follow each other (curvature, beating) leave fewer independent points
    standard = residual * np.sqrt(w)
    lag1 = float(np.sum(standard[1:] * standard[:-1]) / max(float(np.sum(standard**2)), 1e-300))
    inflate = (1.0 + max(lag1, 0.0)) / (1.0 - min(max(lag1, 0.0), 0.95))
    return slope, float(np.sqrt(max(chi2, 1.0) * inflate / spread))


def _pool(values: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Mean over plucks and its standard error: from regressions or from scatter between plucks, the larger."""
    n = len(values)
    within = float(np.mean(errors**2))
    between = float(np.var(values, ddof=1)) if n > 1 else 0.0
    return float(np.mean(values)), float(np.sqrt(max(within, between) / n))


def _smooth(y: FloatArray) -> FloatArray:
    """Means of five, fewer at the ends."""
    if len(y) == 0:
        return y
    kernel = np.ones(min(5, len(y)))
    return np.convolve(y, kernel, mode="same") / np.convolve(np.ones(len(y)), kernel, mode="same")


def _bands(plucks: Sequence[_Pluck], edges: FloatArray | None) -> tuple[DampingBand, ...]:
    smooth = [_smooth(p.log_amplitude) for p in plucks]
    if edges is None:
        top = max(float(np.exp(s[0])) for s in smooth) * 1.0001
        bottom = min(float(np.exp(s[-1])) for s in smooth)
        count = max(1, int(np.ceil(np.log2(top / bottom))))
        edges = top * 2.0 ** -np.arange(count, -1, -1.0)
    bands = []
    for lower, upper in zip(edges[-2::-1], edges[:0:-1], strict=True):
        slopes = []
        for p, s in zip(plucks, smooth, strict=True):
            inside = np.flatnonzero((s >= np.log(lower)) & (s < np.log(upper)))
            if len(inside) < FEWEST_CYCLES:
                continue
            part = slice(inside[0], inside[-1] + 1)
            slope, error = _line(p.time[part], -p.log_amplitude[part], p.variance[part])
            slopes.append((slope / np.mean(p.omega[part]), error / np.mean(p.omega[part])))
        if slopes:
            xi, error = np.array(slopes).T
            sd = float(np.std(xi, ddof=1)) if len(xi) > 1 else float(error[0])
            bands.append(DampingBand(float(lower), float(upper), float(np.mean(xi)), sd, len(xi)))
    return tuple(bands)


def _weights(p: _Pluck) -> FloatArray:
    """Precision of ln a with a floor of half a per cent, so that no few cycles decide alone."""
    return 1.0 / (p.variance + 0.005**2)


def _curve(plucks: Sequence[_Pluck]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Damping at amplitudes A spaced evenly in ln A, from a window of ln a about each.

    In the window the damping is a line in ln a, so that -ln a = c + xi x + kappa integral (ln a - ln A) dx with x the
    angle turned: xi and kappa are common to the plucks, c is each pluck's own. A damping that varies across the window,
    or a window that the ends of the record cut off, then leaves no bias to first order.
    """
    smooth = [_smooth(p.log_amplitude) for p in plucks]
    low, high = min(float(np.min(s)) for s in smooth), max(float(np.max(s)) for s in smooth)
    grid = np.linspace(low, high, _CURVE)
    normal, right, pieces = np.zeros((_CURVE, 2, 2)), np.zeros((_CURVE, 2)), []
    for p, s in zip(plucks, smooth, strict=True):
        w = np.exp(-0.5 * ((s - grid[:, None]) / _BANDWIDTH) ** 2) * _weights(p) + 1e-300
        # angle turned rather than time, so that the slope is a damping ratio whatever the frequency does
        step = np.diff(p.time) * 0.5 * (p.omega[1:] + p.omega[:-1])
        angle = np.append(0.0, np.cumsum(step))
        area = np.append(0.0, np.cumsum(step * 0.5 * (p.log_amplitude[1:] + p.log_amplitude[:-1])))
        x = np.stack(np.broadcast_arrays(angle, area - grid[:, None] * angle), axis=-1)
        total = np.sum(w, axis=1)[:, None]
        x = x - (np.einsum("gn,gnj->gj", w, x) / total)[:, None, :]
        y = -p.log_amplitude + (w @ p.log_amplitude)[:, None] / total
        normal += np.einsum("gn,gni,gnj->gij", w, x, x)
        right += np.einsum("gn,gni,gn->gi", w, x, y)
        pieces.append((w, x, y))
    # a record of hardly more than one window cannot tell kappa: a weak pull to zero settles it
    normal[:, 1, 1] *= 1.0 + 1e-3
    inverse = np.linalg.pinv(normal, rcond=1e-9, hermitian=True)
    slope = np.einsum("gij,gj->gi", inverse, right)
    meat = np.zeros((_CURVE, 2, 2))
    for w, x, y in pieces:
        score = (w * (y - np.einsum("gni,gi->gn", x, slope)))[:, :, None] * x
        meat += np.einsum("gni,gnj->gij", score, score)
    variance = np.einsum("gi,gij,gj->g", inverse[:, 0], meat, inverse[:, 0])
    good = np.isfinite(slope[:, 0]) & (normal[:, 0, 0] > 1e-12 * np.max(normal[:, 0, 0]))
    return np.exp(grid[good]), slope[good, 0], np.sqrt(variance[good])
