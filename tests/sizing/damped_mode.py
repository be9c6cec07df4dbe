r"""One mode of a bridge in a lock-in wind with tuned mass dampers on it, integrated in time.

The mode has the equation of `scruton.simulate.equation` and carries dampers with relative displacements r_i:

.. math:: \ddot\eta + 2\xi\omega_0\dot\eta + \omega_0^2\eta = \mathrm{wind}(\eta, \dot\eta)
   + \sum \mu_i (2\zeta_i\omega_i\dot r_i + \omega_i^2 r_i), \qquad
   \ddot r_i + 2\zeta_i\omega_i\dot r_i + \omega_i^2 r_i = -\ddot\eta .

Neither the harmonic form of the vibration nor one frequency is assumed: it is there to check formulae that assume both.
So are the eigenvalues of mode and dampers, by which the added damping of `response` can be told as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.simulate import Truth
from scruton.simulate.equation import STEPS_PER_CYCLE
from scruton.sizing.tmd import Response, TunedMass, check_detuning, ratios_of, respond


@dataclass(frozen=True)
class LimitCycle:
    """What a vibration has settled to.

    Attributes
    ----------
    amplitude : float
        Half of the range of the mode over its last cycles, A/D or rad.
    frequency : float
        Over the mode's own with the stiffness of the wind.
    strokes : (dampers,) array
        Half of the range of each relative displacement over `amplitude`.
    unsteadiness : float
        Range of the peaks over their mean: near zero in a limit cycle, large where it beats or still moves.
    """

    amplitude: float
    frequency: float
    strokes: FloatArray
    unsteadiness: float


def simulate_damped(
    truth: Truth,
    *,
    mass_ratios: Sequence[float],
    frequency_ratios: Sequence[float],
    damping_ratios: Sequence[float],
    cycles: float,
    start: ArrayLike,
    samples_per_cycle: int = 40,
) -> tuple[FloatArray, FloatArray]:
    """Integrate a mode and its dampers from a given state.

    Parameters
    ----------
    truth : Truth
        The mode and the force on it; vortex shedding is left out.
    mass_ratios, frequency_ratios, damping_ratios : sequence of float
        Of each damper; the frequency over the mode's with the stiffness of the wind.
    cycles : float
        Length in cycles of the mode.
    start : (2, dampers + 1) array
        Displacements of the mode (A/D or rad) and of each damper relative to it, and their velocities over the mode's
        circular frequency.
    samples_per_cycle : int

    Returns
    -------
    time : (N,) array
        s.
    displacement : (dampers + 1, N) array
        The mode and each damper relative to it.

    Raises
    ------
    ValueError
        If lengths differ, or a ratio or length is not positive.
    """
    mu, ratio, zeta = (np.array(values, dtype=float) for values in (mass_ratios, frequency_ratios, damping_ratios))
    state = np.array(start, dtype=float)
    if not (mu.shape == ratio.shape == zeta.shape and state.shape == (2, mu.size + 1)):
        raise ValueError("every damper has a mass ratio, a frequency ratio, a damping ratio and a start")
    if not (np.all(mu > 0) and np.all(ratio > 0) and np.all(zeta > 0) and cycles > 0 and samples_per_cycle > 1):
        raise ValueError("ratios and the number of cycles must be positive, with two samples per cycle or more")
    omega = truth.omega
    substeps = int(np.ceil(STEPS_PER_CYCLE / samples_per_cycle))
    interval = 2.0 * np.pi / (omega * samples_per_cycle)
    displacement = np.empty((mu.size + 1, int(cycles * samples_per_cycle) + 1))
    state[1] *= omega
    _integrate(
        displacement, state, interval / substeps, substeps,
        omega**2, 2.0 * truth.damping_ratio * 2.0 * np.pi * truth.frequency,
        0.0 if truth.still else truth.pressure * truth.Y1, 0.0 if truth.still else truth.passage,
        truth.epsilon, int(truth.force == "ehsan-scanlan"),
        mu, (omega * ratio) ** 2, 2.0 * zeta * omega * ratio,
    )  # fmt: skip
    times: FloatArray = np.linspace(0.0, interval * (displacement.shape[1] - 1), displacement.shape[1])
    return times, displacement


def limit_cycle(displacement: FloatArray, *, samples_per_cycle: int = 40, cycles: int = 40) -> LimitCycle:
    """Read amplitude, frequency and strokes off the last cycles of what `simulate_damped` returns.

    Peaks and crossings are interpolated between samples.
    """
    tail = displacement[:, -cycles * samples_per_cycle :]
    peaks = [_peaks(row) for row in tail]
    mode = tail[0]
    up = np.flatnonzero((mode[:-1] < 0.0) & (mode[1:] >= 0.0))
    crossings = up - mode[up] / (mode[up + 1] - mode[up])
    period = (crossings[-1] - crossings[0]) / (crossings.size - 1)
    amplitude = float(np.mean(peaks[0]))
    return LimitCycle(
        amplitude,
        float(samples_per_cycle / period),
        np.array([np.mean(peak) for peak in peaks[1:]]) / amplitude,
        float(np.ptp(peaks[0]) / amplitude),
    )


def response(dampers: Sequence[TunedMass], detuning: ArrayLike = 0.0) -> Response:
    """`respond` for the same dampers at every detuning, (...): the true frequency is 1 + detuning times the nominal."""
    error = check_detuning(detuning)
    mu, f, zeta = ratios_of(dampers)
    found = respond(mu, f / (1.0 + error.ravel()), zeta)
    return Response(
        found.added_damping.reshape(error.shape),
        found.frequency.reshape(error.shape),
        found.stroke.reshape(len(dampers), *error.shape),
    )


def minimum_modal_damping(
    dampers: Sequence[TunedMass], structural_damping: float, detuning: ArrayLike = 0.0
) -> FloatArray:
    """Least damping ratio among the eigenvalues of mode and dampers, 1 where none oscillates; detuning as `response`.

    The structural damping is that of the mode without dampers; negative for a mode that the wind drives.
    """
    error = check_detuning(detuning)
    mu, f, zeta = ratios_of(dampers)
    f = f / (1.0 + error.ravel())
    count = len(dampers)
    spring, dashpot = f.T**2, 2.0 * zeta.T * f.T  # (draws, dampers)
    # State: mode, strokes, and their rates.  A stroke is relative, so the mode's acceleration drives it.
    stiffness, damping = np.zeros((2, error.size, count + 1, count + 1))
    stiffness[:, 0, 0], damping[:, 0, 0] = 1.0, 2.0 * structural_damping
    stiffness[:, 0, 1:], damping[:, 0, 1:] = -mu.T * spring, -mu.T * dashpot
    for matrix, diagonal in ((stiffness, spring), (damping, dashpot)):
        matrix[:, 1:, :] -= matrix[:, :1, :]
        matrix[:, range(1, count + 1), range(1, count + 1)] += diagonal
    state = np.zeros((error.size, 2 * count + 2, 2 * count + 2))
    state[:, : count + 1, count + 1 :] = np.eye(count + 1)
    state[:, count + 1 :, : count + 1], state[:, count + 1 :, count + 1 :] = -stiffness, -damping
    values = np.linalg.eigvals(state)
    damping_ratios = np.where(values.imag != 0.0, -values.real / np.abs(values), 1.0)
    return np.asarray(damping_ratios.min(axis=1).reshape(error.shape))


def _peaks(signal: FloatArray) -> FloatArray:
    """Size of every extremum, by a parabola through three samples."""
    x = np.abs(signal)
    k = 1 + np.flatnonzero((x[1:-1] >= x[:-2]) & (x[1:-1] > x[2:]))
    slope, bend = 0.5 * (x[k + 1] - x[k - 1]), x[k + 1] - 2.0 * x[k] + x[k - 1]
    peaks: FloatArray = x[k] - 0.5 * slope**2 / bend
    return peaks


@njit(cache=True)
def _rates(rate, state, side, k, c, wind, d, eps, force, mu, ks, cs):  # type: ignore[no-untyped-def]
    """Rates of displacements and velocities; `side` is the sign of the mode's velocity, held over a step."""
    x, v = state[0, 0], state[1, 0]
    a = -k * x - c * v
    if force == 0:
        a += wind * (d * v - eps * side)
    else:
        a += wind * (1.0 - eps * x * x) * d * v
    for i in range(mu.size):
        a += mu[i] * (cs[i] * state[1, i + 1] + ks[i] * state[0, i + 1])
    rate[0, 0], rate[1, 0] = v, a
    for i in range(mu.size):
        rate[0, i + 1] = state[1, i + 1]
        rate[1, i + 1] = -a - cs[i] * state[1, i + 1] - ks[i] * state[0, i + 1]


@njit(cache=True)
def _move(new, state, h, rate):  # type: ignore[no-untyped-def]
    """State + h rate, in a loop: array expressions take numba seconds to compile."""
    for i in range(state.shape[0]):
        for j in range(state.shape[1]):
            new[i, j] = state[i, j] + h * rate[i, j]


@njit(cache=True)
def _rk4(new, state, h, side, k, c, wind, d, eps, force, mu, ks, cs, rate, mid, total):  # type: ignore[no-untyped-def]
    _rates(rate, state, side, k, c, wind, d, eps, force, mu, ks, cs)
    _move(total, rate, 0.0, rate)
    for weight, part in ((2.0, 0.5), (2.0, 0.5), (1.0, 1.0)):
        _move(mid, state, part * h, rate)
        _rates(rate, mid, side, k, c, wind, d, eps, force, mu, ks, cs)
        _move(total, total, weight, rate)
    _move(new, state, h / 6.0, total)


@njit(cache=True)
def _integrate(out, state, h, substeps, k, c, wind, d, eps, force, mu, ks, cs):  # type: ignore[no-untyped-def]
    """Runge-Kutta; a step in which the mode's velocity changes sign, where the force jumps, is split there."""
    new, between, rate = np.empty_like(state), np.empty_like(state), np.empty_like(state)
    mid, total = np.empty_like(state), np.empty_like(state)
    out[:, 0] = state[0]
    for n in range(1, out.shape[1]):
        for _ in range(substeps):
            v = state[1, 0]
            side = np.sign(v) if v != 0.0 else np.sign(-state[0, 0])
            _rk4(new, state, h, side, k, c, wind, d, eps, force, mu, ks, cs, rate, mid, total)
            if force == 0 and new[1, 0] * side < 0.0:
                part = h * v / (v - new[1, 0])
                _rk4(between, state, part, side, k, c, wind, d, eps, force, mu, ks, cs, rate, mid, total)
                _rates(rate, between, side, k, c, wind, d, eps, force, mu, ks, cs)
                if rate[1, 0] != 0.0:
                    part = min(max(part - between[1, 0] / rate[1, 0], 0.0), h)
                _rk4(between, state, part, side, k, c, wind, d, eps, force, mu, ks, cs, rate, mid, total)
                between[1, 0] = 0.0
                _rk4(new, between, h - part, -side, k, c, wind, d, eps, force, mu, ks, cs, rate, mid, total)
            _move(state, new, 0.0, new)
        out[:, n] = state[0]
