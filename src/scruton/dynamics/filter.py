r"""The plain filter: any law, by its drift alone; slow and obvious, the yardstick of the compiled fast ones.

The state equation is that of `scruton.dynamics.likelihood`.  Over a cycle the amplitude and the first and second
derivative of the flow in the amplitude at its start (slope and curvature) are integrated by Runge-Kutta:

.. math:: \dot a = f(a), \qquad \dot\phi = f'\phi, \qquad \dot\chi = f''\phi^2 + f'\chi .

The fast filters take the same steps with the flow in closed form (the n-family), or in fewer steps (with effects).
"""

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.laws.law import Law
from scruton.dynamics.moments import moments_along, noise_drift
from scruton.dynamics.thresholds import PLAIN_FLOOR

_STEPS = 8  # of Runge-Kutta in half a cycle
_STEP = 1e-4  # relative, of the difference that gives f''


def innovations_of(
    law: Law,
    data: EnvelopeData,
    parameters: FloatArray,
    q: FloatArray,
    r: FloatArray,
    *,
    initial_sd: float = 1.0,
    rows: np.ndarray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """One-step prediction errors under any law, and their variances.

    Parameters
    ----------
    law : Law
    data : EnvelopeData
    parameters : (W, P) array, or (W, R, P)
        Of the law; with `rows` each cycle has its own of R sets.
    q, r : (W,) arrays
        Process noise [amplitude per sqrt(s)], and the factor on the cycles' standard errors.
    initial_sd : float
        Standard deviation of the normal prior, mean 0, of each record's initial amplitude.
    rows : (N,) array of int, optional
        Set of parameters of every cycle.

    Returns
    -------
    innovation, variance : (N, W) arrays
        As `scruton.dynamics.likelihood.innovations` gives them, and `pointwise_log_likelihood` takes them.

    Notes
    -----
    It is compiled anew for each law and process, which takes some seconds: numba keeps no function that takes another.
    """
    innovation, variance = (np.empty((data.size, len(parameters))) for _ in range(2))
    rows = np.zeros(data.size, dtype=np.intp) if rows is None else rows
    sets = np.ascontiguousarray(parameters if parameters.ndim == 3 else parameters[:, None])
    floor = -np.inf if law.linear else PLAIN_FLOOR * float(np.max(data.amplitude, initial=0.0))
    _plain(
        law.drift, law.linear, data.amplitude, data.standard_error, data.gap, data.period, rows,
        sets, q, r, initial_sd**2, floor, innovation, variance,
    )  # fmt: skip
    return innovation, variance


@njit(error_model="numpy")
def _rates(law, c, a, slope, bend):  # type: ignore[no-untyped-def]
    f, d = law(a, c)
    step = _STEP * abs(a) + 1e-300
    second = (law(a + step, c)[1] - law(a - step, c)[1]) / (2.0 * step)
    return f, d * slope, second * slope * slope + d * bend


@njit(error_model="numpy")
def _flow(law, c, a, slope, bend, dt, steps):  # type: ignore[no-untyped-def]
    """Amplitude, slope and curvature of the flow after dt."""
    h = dt / steps
    for _ in range(steps):
        a1, s1, b1 = _rates(law, c, a, slope, bend)
        a2, s2, b2 = _rates(law, c, a + 0.5 * h * a1, slope + 0.5 * h * s1, bend + 0.5 * h * b1)
        a3, s3, b3 = _rates(law, c, a + 0.5 * h * a2, slope + 0.5 * h * s2, bend + 0.5 * h * b2)
        a4, s4, b4 = _rates(law, c, a + h * a3, slope + h * s3, bend + h * b3)
        a += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        slope += h / 6.0 * (s1 + 2.0 * s2 + 2.0 * s3 + s4)
        bend += h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
    return a, slope, bend


@njit(error_model="numpy")
def _advance(law, linear, c, m, p, q2, dt, steps):  # type: ignore[no-untyped-def]
    """Mean and variance of the state after dt without observation."""
    end, phi, bend = _flow(law, c, m, 1.0, 0.0, dt, steps)
    e, _, _ = moments_along(phi, dt)
    if not linear:
        end += noise_drift(m, p, q2, dt) + 0.5 * p * bend * _trust(m, p)
    return end, phi * phi * p + q2 * e


@njit(error_model="numpy")
def _trust(m, p):  # type: ignore[no-untyped-def]
    """How far the flow's curvature at the mean may be trusted: less where the amplitude is lost in its variance."""
    return min(1.0, m / (3.0 * np.sqrt(p) + 1e-300))


@njit(error_model="numpy")
def _plain(  # type: ignore[no-untyped-def]
    law, linear, y, se, gap, period, rows, parameters, q, r, p0, floor, innovation, variance
):
    for w in range(q.size):
        m, p, q2 = 0.0, p0, q[w] * q[w]
        for k in range(y.size):
            c, dt, noise = parameters[w, rows[k]], period[k], r[w] * se[k]
            r2 = noise * noise
            if gap[k] < 0.0:
                m, p = 0.0, p0
                if not linear:
                    # A diffuse state cannot be linearised: the first cycle fixes the state at its middle.
                    innovation[k, w], variance[k, w] = y[k], p0 + r2
                    gain = p0 / (p0 + r2)
                    m, p = _advance(law, linear, c, max(gain * y[k], floor), gain * r2, q2, 0.5 * dt, _STEPS)
                    continue
            elif gap[k] > 0.0:
                steps = 2 * _STEPS * int(np.ceil(gap[k] / dt))
                m, p = _advance(law, linear, c, max(m, floor), p, q2, gap[k], steps)
            m = max(m, floor)
            middle, phi_middle, bend_middle = _flow(law, c, m, 1.0, 0.0, 0.5 * dt, _STEPS)
            end, phi, bend = _flow(law, c, middle, phi_middle, bend_middle, 0.5 * dt, _STEPS)
            mean, drift = (m + 4.0 * middle + end) / 6.0, 0.0
            if not linear:
                drift = noise_drift(m, p, q2, dt)
                half = 0.5 * p * _trust(m, p)
                mean += half * (4.0 * bend_middle + bend) / 6.0 + 0.5 * drift
                drift += half * bend
            weight = (1.0 + 4.0 * phi_middle + phi) / 6.0
            q_end, q_cross, q_mean = moments_along(phi, dt)
            s = weight * weight * p + q2 * q_mean + r2
            cross = phi * weight * p + q2 * q_cross
            v = y[k] - mean
            m = end + drift + cross / s * v
            p = phi * phi * p + q2 * q_end - cross * cross / s
            innovation[k, w], variance[k, w] = v, s
