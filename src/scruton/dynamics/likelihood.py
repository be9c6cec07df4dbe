r"""The state-space likelihood of an envelope: O(N), compiled, many walkers side by side.

The amplitude of a record is a state, not a curve plus white noise.  Turbulence pushes it about and it
relaxes at its own rate; the sensor adds noise on top:

.. math:: da = f(a)\,dt + q\,dW, \qquad y_k = \frac1T\int_{t_k-T/2}^{t_k+T/2} a\,dt + r\,s_k\,e_k

with the amplitude equation of the n-family, :math:`f(a) = (\lambda/n)\,a\,[1-(a/a^*)^n]`.  A demodulated
amplitude is the mean over its cycle, so the observation shares the process noise of that cycle with the state
at its end.  For the paper's law (n = -1) the equation is linear and the filter is exact.  For the other laws it
is linearised along the filtered mean; there the SDE carries the drift :math:`q^2/2a` that broad-band
forcing induces, which matters only at small amplitude.  The initial state has a normal prior and is integrated out.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.envelope.types import Cycles

# In kernels a square is written x * x: numba makes a product of x ** 2 or a call of pow, whichever function it happened
# to compile first, and the last bit differs.

_LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class EnvelopeData:
    """The envelopes of several records, end to end, as the filter reads them.

    Attributes
    ----------
    amplitude, standard_error : (N,) arrays
        One value per cycle, in A/D or rad.
    gap : (N,) array
        Time between the end of the cycle before and the start of this one [s], 0 for adjacent cycles,
        negative at the first cycle of a record.
    period : (N,) array
        Duration of the cycle that the amplitude is the mean of [s].
    time : (N,) array
        Middle of each cycle [s].
    record : (N,) array of str
        Name of the record that the cycle belongs to.
    """

    amplitude: FloatArray
    standard_error: FloatArray
    gap: FloatArray
    period: FloatArray
    time: FloatArray
    record: np.ndarray

    @classmethod
    def join(cls, cycles: dict[str, Cycles]) -> "EnvelopeData":
        """Put the envelopes of several records end to end; keys are the records' names."""
        parts = [(name, one) for name, one in cycles.items() if one.time.size]
        if not parts:
            empty = np.empty(0)
            return cls(empty, empty, empty, empty, empty, np.empty(0, dtype=str))
        gaps, periods = [], []
        for _, one in parts:
            period = 1.0 / one.reference_frequency
            steps = np.diff(one.time) - period
            # Rounding of the time stamps is no gap: only a missing cycle is.
            gaps.append(np.r_[-1.0, np.where(steps > 0.25 * period, steps, 0.0)])
            periods.append(np.full(one.time.size, period))
        return cls(
            amplitude=np.concatenate([one.amplitude for _, one in parts]),
            standard_error=np.concatenate([one.standard_error for _, one in parts]),
            gap=np.concatenate(gaps),
            period=np.concatenate(periods),
            time=np.concatenate([one.time for _, one in parts]),
            record=np.concatenate([np.full(one.time.size, name) for name, one in parts]),
        )

    def without(self, record: str) -> "EnvelopeData":
        """Leave one record out."""
        keep = self.record != record
        return EnvelopeData(**{name: value[keep] for name, value in vars(self).items()})

    @property
    def size(self) -> int:
        """Number of cycles."""
        return int(self.amplitude.size)


@njit(cache=True, inline="always")
def _mean_weight(lam, dt):  # type: ignore[no-untyped-def]
    """(1 - exp(-lam dt)) / (lam dt): weight of the state at the start in the mean over an interval."""
    x = lam * dt
    return -np.expm1(-x) / x if abs(x) > 1e-8 else 1.0 - 0.5 * x


@njit(cache=True, inline="always")
def _noise_moments(lam, dt):  # type: ignore[no-untyped-def]
    """Covariance of (state at the end, mean over the interval) for unit q: exact for the linear equation.

    Series for small lam dt, where the closed forms cancel (they lose all digits below about 1e-5).
    """
    x = lam * dt
    if abs(x) < 1e-2:
        q_end = dt * (1.0 + x * (-1.0 + x * (2.0 / 3.0 - x / 3.0)))
        q_cross = dt * (0.5 + x * (-0.5 + x * (7.0 / 24.0 - x / 8.0)))
        q_mean = dt * (1.0 / 3.0 + x * (-0.25 + x * (7.0 / 60.0 - x / 24.0)))
        return q_end, q_cross, q_mean
    one = -np.expm1(-x)
    two = -np.expm1(-2.0 * x)
    q_end = two / (2.0 * lam)
    q_cross = one * one / (2.0 * lam * x)
    q_mean = (dt - 2.0 * one / lam + two / (2.0 * lam)) / (x * x)
    return q_end, q_cross, q_mean


@njit(cache=True, inline="always")
def _moments_along(slope, dt):  # type: ignore[no-untyped-def]
    """`_noise_moments` for the local rate -ln(slope)/dt of a flow; logarithms cost more than a series near 1."""
    x = 1.0 - slope
    if abs(x) < 0.05:
        x = x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * (0.2 + x / 6.0)))))
    else:
        x = -np.log(max(slope, 1e-300))
    if abs(x) < 0.06:
        q_end = dt * (1.0 + x * (-1.0 + x * (2.0 / 3.0 + x * (-1.0 / 3.0 + x * (2.0 / 15.0 - x * 2.0 / 45.0)))))
        q_cross = dt * (0.5 + x * (-0.5 + x * (7.0 / 24.0 + x * (-0.125 + x * (31.0 / 720.0 - x / 80.0)))))
        q_mean = dt * (1.0 / 3.0 + x * (-0.25 + x * (7.0 / 60.0 + x * (-1.0 / 24.0 + x * (31.0 / 2520.0 - x / 320.0)))))
        return q_end, q_cross, q_mean
    return _noise_moments(x / dt, dt)


@njit(cache=True, fastmath=True, error_model="numpy")
def _linear_filter(y, se, gap, period, a_star, lam, q, r, m0, p0, log_like):  # type: ignore[no-untyped-def]
    """Exact log likelihood for n = -1; all walkers in the inner loop, so that it vectorises."""
    n_walkers = a_star.size
    d = np.empty(n_walkers)  # deviation of the filtered mean from a_star
    p = np.empty(n_walkers)
    phi = np.empty(n_walkers)
    weight = np.empty(n_walkers)
    q_end = np.empty(n_walkers)
    q_cross = np.empty(n_walkers)
    q_mean = np.empty(n_walkers)
    r2 = r * r
    quad = np.zeros(n_walkers)
    prod = np.ones(n_walkers)
    log_like[:] = 0.0
    last = -1.0
    for k in range(y.size):
        if period[k] != last:
            last = period[k]
            for w in range(n_walkers):
                phi[w] = np.exp(-lam[w] * last)
                weight[w] = _mean_weight(lam[w], last)
                e, c, z = _noise_moments(lam[w], last)
                q2 = q[w] * q[w]
                q_end[w], q_cross[w], q_mean[w] = q2 * e, q2 * c, q2 * z
        if gap[k] < 0.0:
            for w in range(n_walkers):
                d[w] = m0 - a_star[w]
                p[w] = p0
        elif gap[k] > 0.0:
            for w in range(n_walkers):
                f = np.exp(-lam[w] * gap[k])
                e, _, _ = _noise_moments(lam[w], gap[k])
                d[w] *= f
                p[w] = f * f * p[w] + q[w] * q[w] * e
        s2 = se[k] * se[k]
        yk = y[k]
        for w in range(n_walkers):
            s = weight[w] * weight[w] * p[w] + q_mean[w] + r2[w] * s2
            cross = phi[w] * weight[w] * p[w] + q_cross[w]
            v = yk - a_star[w] - weight[w] * d[w]
            inv = 1.0 / s
            gain = cross * inv
            d[w] = phi[w] * d[w] + gain * v
            p[w] = phi[w] * phi[w] * p[w] + q_end[w] - gain * cross
            quad[w] += v * v * inv
            prod[w] *= s
        if k % 8 == 7:  # one logarithm for eight cycles; eight variances cannot underflow
            for w in range(n_walkers):
                log_like[w] -= 0.5 * np.log(prod[w])
                prod[w] = 1.0
    for w in range(n_walkers):
        log_like[w] -= 0.5 * (np.log(prod[w]) + quad[w] + y.size * _LOG_2PI)


@njit(cache=True, inline="always")
def _flow(a, a_star, decay, n):  # type: ignore[no-untyped-def]
    """Closed form of the amplitude equation over a time with exp(-lambda t) = `decay`, and its derivative in a."""
    if n == -1.0:
        return a_star + (a - a_star) * decay, decay
    a = max(a, 1e-6 * a_star)  # the other laws live on a > 0; the filtered mean may stray below
    if n == 2.0:
        start = a_star / a
        end = a_star / np.sqrt(1.0 + (start * start - 1.0) * decay)
        ratio = end / a
        return end, ratio * ratio * ratio * decay
    if n == 1.0:
        end = a_star / (1.0 + (a_star / a - 1.0) * decay)
        ratio = end / a
        return end, ratio * ratio * decay
    deviation = np.log(a / a_star)
    if n == 0.0:
        end = a_star * np.exp(deviation * decay)
        return end, end / a * decay
    shape = np.expm1(-n * deviation) * decay
    if shape <= -1.0:  # n < 0 and far below: the state has no real image; hold it at the floor
        return 1e-6 * a_star, decay
    log_end = -np.log1p(shape) / n
    return a_star * np.exp(log_end), np.exp((n + 1.0) * (log_end - deviation)) * decay


@njit(cache=True, inline="always")
def _curvature(a, end, slope, n, p):  # type: ignore[no-untyped-def]
    """Half the second derivative of the flow times the variance: what linearising the mean leaves out."""
    a = max(a, 3.0 * np.sqrt(p), 1e-300)
    return 0.5 * p * (n + 1.0) * slope * (slope / max(end, 1e-300) - 1.0 / a)


@njit(cache=True, inline="always")
def _noise_drift(a, p, q2, dt):  # type: ignore[no-untyped-def]
    """Drift q^2/2a that broad-band forcing induces, bounded where the amplitude is lost in its variance."""
    return 0.5 * q2 * dt * a / (a * a + p + 1e-300)


@njit(cache=True, inline="always")
def _advance(m, p, a_star, lam, q2, n, dt):  # type: ignore[no-untyped-def]
    """Mean and variance of the state after dt without observation (linearised unless n = -1)."""
    end, slope = _flow(m, a_star, np.exp(-lam * dt), n)
    e, _, _ = _moments_along(slope, dt)
    if n != -1.0:
        end += _noise_drift(m, p, q2, dt) + _curvature(m, end, slope, n, p)
    return end, slope * slope * p + q2 * e


@njit(cache=True, error_model="numpy")
def _filter(y, se, gap, period, a_star, lam, q, r, n, m0, p0, innovation, variance):  # type: ignore[no-untyped-def]
    """Innovations and their variances, (N, W), for any law: the plain form, one walker after another."""
    for w in range(a_star.size):
        m, p, q2 = m0, p0, q[w] * q[w]
        dt, decay, decay_middle = -1.0, 1.0, 1.0
        for k in range(y.size):
            noise = r[w] * se[k]
            r2 = noise * noise
            if period[k] != dt:
                dt = period[k]
                decay_middle = np.exp(-0.5 * lam[w] * dt)
                decay = decay_middle * decay_middle
            if gap[k] < 0.0:
                m, p = m0, p0
                if n[w] != -1.0:
                    # A diffuse state cannot be linearised: the first cycle fixes the state at its start.
                    innovation[k, w] = y[k] - m0
                    variance[k, w] = p0 + r2
                    gain = p0 / (p0 + r2)
                    m = m0 + gain * (y[k] - m0)
                    m, p = _advance(m, gain * r2, a_star[w], lam[w], q2, n[w], 0.5 * dt)
                    continue
            elif gap[k] > 0.0:
                m, p = _advance(m, p, a_star[w], lam[w], q2, n[w], gap[k])
            end, phi = _flow(m, a_star[w], decay, n[w])
            if n[w] == -1.0:
                weight = _mean_weight(lam[w], dt)
                mean = a_star[w] + weight * (m - a_star[w])
                e, c, z = _noise_moments(lam[w], dt)
            else:
                # The mean over the cycle by Simpson's rule; curvature of the flow to second order.
                middle, phi_middle = _flow(m, a_star[w], decay_middle, n[w])
                drift = _noise_drift(m, p, q2, dt)
                bend = _curvature(m, end, phi, n[w], p)
                mean = (m + 4.0 * middle + end + 4.0 * _curvature(m, middle, phi_middle, n[w], p) + bend) / 6.0
                mean += 0.5 * drift
                end += drift + bend
                weight = (1.0 + 4.0 * phi_middle + phi) / 6.0
                e, c, z = _moments_along(phi, dt)
            s = weight * weight * p + q2 * z + r2
            cross = phi * weight * p + q2 * c
            v = y[k] - mean
            m = end + cross / s * v
            p = phi * phi * p + q2 * e - cross * cross / s
            innovation[k, w] = v
            variance[k, w] = s


@njit(cache=True, inline="always")
def _short_moments(x, dt):  # type: ignore[no-untyped-def]
    """`_noise_moments` as series in x = lambda dt, to 1e-9 for abs(x) < 0.36: no branch, so that loops vectorise."""
    y = -2.0 * x
    y4 = y * y * y * y
    g2 = 1.0 + y / 2 * (1.0 + y / 3 * (1.0 + y / 4 * (1.0 + y / 5 * (1.0 + y / 6 * (1.0 + y / 7 * (1.0 + y / 8))))))
    g2 += y4 * y4 / 362880.0 * (1.0 + y / 10 * (1.0 + y / 11))
    x = -x
    x3 = x * x * x
    g = 1.0 + x / 2 * (1.0 + x / 3 * (1.0 + x / 4 * (1.0 + x / 5 * (1.0 + x / 6 * (1.0 + x / 7 * (1.0 + x / 8))))))
    q_mean = 1.0 / 3.0 + x * (0.25 + x * (7.0 / 60.0 + x * (1.0 / 24.0 + x * (31.0 / 2520.0 + x * (1.0 / 320.0)))))
    q_mean += x3 * x3 * (127.0 / 181440.0 + x * (17.0 / 120960.0 + x * (73.0 / 2851200.0)))
    return dt * g2, dt * 0.5 * g * g, dt * q_mean


@njit(cache=True, inline="always")
def _near_one(u):  # type: ignore[no-untyped-def]
    """-ln(1 - u) to 1e-8 for abs(u) < 0.3, without a branch."""
    u = u / (2.0 - u)
    v = u * u
    return 2.0 * u * (1.0 + v * (1.0 / 3.0 + v * (0.2 + v * (1.0 / 7.0 + v * (1.0 / 9.0)))))


@njit(cache=True, inline="always")
def _near_zero(u):  # type: ignore[no-untyped-def]
    """exp(u) to 1e-10 for abs(u) < 0.5, without a branch."""
    u *= 0.25
    e = 1.0 + u * (1.0 + u / 2 * (1.0 + u / 3 * (1.0 + u / 4 * (1.0 + u / 5 * (1.0 + u / 6 * (1.0 + u / 7))))))
    e *= e
    return e * e


@njit(cache=True, fastmath=True, error_model="numpy")
def _curved_filter(y, se, gap, period, a_star, lam, q, r, n, m0, p0, log_like):  # type: ignore[no-untyped-def]
    """Log likelihood for one law n != -1: `_filter` with all walkers in the inner loops, which vectorise."""
    size = a_star.size
    inverse_star = 1.0 / a_star
    q2 = q * q
    r2 = r * r
    m, p, decay, decay_middle = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    power, ratio, ratio_middle = np.empty(size), np.empty(size), np.empty(size)
    level = np.zeros(size)  # ln(m/a*), kept up to date for n = 0
    stale = True
    back, back_middle, x = np.empty(size), np.empty(size), np.empty(size)
    q_end, q_cross, q_mean = np.empty(size), np.empty(size), np.empty(size)
    quad, prod = np.zeros(size), np.ones(size)
    log_like[:] = 0.0
    dt = -1.0
    for k in range(y.size):
        if period[k] != dt:
            dt = period[k]
            for w in range(size):
                decay_middle[w] = np.exp(-0.5 * lam[w] * dt)
                decay[w] = decay_middle[w] * decay_middle[w]
        yk, s2 = y[k], se[k] * se[k]
        if gap[k] != 0.0:
            stale = True
        if gap[k] < 0.0:
            for w in range(size):
                s = p0 + r2[w] * s2
                gain = p0 / s
                start = m0 + gain * (yk - m0)
                m[w], p[w] = _advance(start, gain * r2[w] * s2, a_star[w], lam[w], q2[w], n, 0.5 * dt)
                quad[w] += (yk - m0) * (yk - m0) / s
                prod[w] *= s
        else:
            if gap[k] > 0.0:
                for w in range(size):
                    m[w], p[w] = _advance(m[w], p[w], a_star[w], lam[w], q2[w], n, gap[k])
            # The flow is a -> a B^(-1/n), B = E + (a/a*)^n (1 - E), E = exp(-lambda dt); its slope E B^(-1/n - 1).
            if n == 2.0:
                for w in range(size):
                    rel = max(m[w] * inverse_star[w], 1e-6)
                    power[w] = rel * rel
                for w in range(size):
                    back[w] = 1.0 / (decay[w] + power[w] * (1.0 - decay[w]))
                    back_middle[w] = 1.0 / (decay_middle[w] + power[w] * (1.0 - decay_middle[w]))
                    ratio[w], ratio_middle[w] = np.sqrt(back[w]), np.sqrt(back_middle[w])
            elif n == 1.0:
                for w in range(size):
                    rel = max(m[w] * inverse_star[w], 1e-6)
                    back[w] = 1.0 / (decay[w] + rel * (1.0 - decay[w]))
                    back_middle[w] = 1.0 / (decay_middle[w] + rel * (1.0 - decay_middle[w]))
                    ratio[w], ratio_middle[w] = back[w], back_middle[w]
            elif n == 0.0:
                largest = 0.0
                for w in range(size):
                    if stale or m[w] * inverse_star[w] < 1e-5:
                        level[w] = np.log(max(m[w] * inverse_star[w], 1e-6))
                    largest = max(largest, abs(level[w] * (1.0 - decay[w])))
                if largest < 0.5:
                    for w in range(size):
                        ratio[w] = _near_zero(-level[w] * (1.0 - decay[w]))
                        ratio_middle[w] = _near_zero(-level[w] * (1.0 - decay_middle[w]))
                else:
                    for w in range(size):
                        ratio[w] = np.exp(-level[w] * (1.0 - decay[w]))
                        ratio_middle[w] = np.exp(-level[w] * (1.0 - decay_middle[w]))
                back[:] = 1.0
                back_middle[:] = 1.0
            else:
                for w in range(size):
                    rel = max(m[w] * inverse_star[w], 1e-6)
                    end, phi = _flow(rel, 1.0, decay[w], n)
                    middle, phi_middle = _flow(rel, 1.0, decay_middle[w], n)
                    ratio[w], ratio_middle[w] = end / rel, middle / rel
                    back[w] = phi / (ratio[w] * decay[w])
                    back_middle[w] = phi_middle / (ratio_middle[w] * decay_middle[w])
            largest = 0.0
            for w in range(size):
                # -ln(slope) by a series, and how far it may be trusted
                u = 1.0 - ratio[w] * back[w] * decay[w]
                largest = max(largest, abs(u))
                x[w] = _near_one(u)
            if largest < 0.3:
                for w in range(size):
                    q_end[w], q_cross[w], q_mean[w] = _short_moments(x[w], dt)
            else:
                for w in range(size):
                    q_end[w], q_cross[w], q_mean[w] = _moments_along(ratio[w] * back[w] * decay[w], dt)
            for w in range(size):
                pw = p[w]
                a = max(m[w], 1e-6 * a_star[w])
                inverse = 1.0 / a
                # `_curvature` with slope/end written out
                far = 1.0 / max(m[w], 3.0 * np.sqrt(pw), 1e-300)
                phi, phi_middle = ratio[w] * back[w] * decay[w], ratio_middle[w] * back_middle[w] * decay_middle[w]
                half = 0.5 * pw * (n + 1.0)
                bend = half * phi * (back[w] * decay[w] * inverse - far)
                bend_middle = half * phi_middle * (back_middle[w] * decay_middle[w] * inverse - far)
                drift = 0.5 * q2[w] * dt * m[w] / (m[w] * m[w] + pw + 1e-300)
                end = a * ratio[w]
                power[w] = end
                mean = (m[w] + 4.0 * (a * ratio_middle[w] + bend_middle) + end + bend) * (1.0 / 6.0) + 0.5 * drift
                weight = (1.0 + 4.0 * phi_middle + phi) * (1.0 / 6.0)
                s = weight * weight * pw + q2[w] * q_mean[w] + r2[w] * s2
                cross = phi * weight * pw + q2[w] * q_cross[w]
                v = yk - mean
                inverse = 1.0 / s
                gain = cross * inverse
                m[w] = end + drift + bend + gain * v
                p[w] = phi * phi * pw + q2[w] * q_end[w] - gain * cross
                quad[w] += v * v * inverse
                prod[w] *= s
            if n == 0.0:
                largest = 0.0
                for w in range(size):
                    end = max(power[w], 1e-300)
                    u = 1.0 - m[w] / end
                    largest = max(largest, abs(u))
                    level[w] = level[w] * decay[w] - _near_one(u)
                stale = largest > 0.3
        if k % 8 == 7:
            for w in range(size):
                log_like[w] -= 0.5 * np.log(prod[w])
                prod[w] = 1.0
    for w in range(size):
        log_like[w] -= 0.5 * (np.log(prod[w]) + quad[w] + y.size * _LOG_2PI)


def innovations(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    *,
    n: float | FloatArray = -1.0,
    initial_sd: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """One-step prediction errors of the filter and their variances.

    Parameters
    ----------
    data : EnvelopeData
    a_star, lam, q, r : (W,) arrays
        Stable amplitude (A/D or rad), relaxation rate [1/s], process noise [amplitude per sqrt(s)], and
        the factor on the cycles' standard errors.
    n : float or (W,) array
        The law: -1 is the paper's.
    initial_sd : float
        Standard deviation of the normal prior, mean 0, of each record's initial amplitude.

    Returns
    -------
    innovation, variance : (N, W) arrays
    """
    shape = (data.size, np.size(a_star))
    innovation, variance = np.empty(shape), np.empty(shape)
    _filter(
        data.amplitude, data.standard_error, data.gap, data.period,
        *_walkers(a_star, lam, q, r, np.broadcast_to(n, shape[1:])), 0.0, initial_sd**2, innovation, variance,
    )  # fmt: skip
    return innovation, variance


def pointwise_log_likelihood(innovation: FloatArray, variance: FloatArray) -> FloatArray:
    """Conditional log density of every cycle given those before it, same shape as the arguments."""
    terms: FloatArray = -0.5 * (innovation**2 / variance + np.log(variance) + _LOG_2PI)
    return terms


def log_likelihood(
    data: EnvelopeData,
    a_star: FloatArray,
    lam: FloatArray,
    q: FloatArray,
    r: FloatArray,
    *,
    n: float | FloatArray = -1.0,
    initial_sd: float = 1.0,
) -> FloatArray:
    """Joint log density of all cycles of all records, (W,); see `innovations` for the arguments."""
    out = np.empty(np.size(a_star))
    exponents = np.broadcast_to(np.asarray(n, dtype=np.float64), out.shape)
    if out.size and np.any(exponents != exponents[0]):  # n is free: every walker has a law of its own
        terms = pointwise_log_likelihood(*innovations(data, a_star, lam, q, r, n=n, initial_sd=initial_sd))
        total: FloatArray = terms.sum(axis=0)
        return total
    walkers = _walkers(a_star, lam, q, r)
    arrays = (data.amplitude, data.standard_error, data.gap, data.period)
    if np.all(exponents == -1.0):
        _linear_filter(*arrays, *walkers, 0.0, initial_sd**2, out)
    else:
        _curved_filter(*arrays, *walkers, float(exponents[0]), 0.0, initial_sd**2, out)
    return out


def _walkers(*parameters: FloatArray) -> list[FloatArray]:
    return [np.ascontiguousarray(np.atleast_1d(one), dtype=np.float64) for one in parameters]


@njit(cache=True, fastmath=True, error_model="numpy")
def _trial_filter(y, se, gap, period, a, b, c, d, sd, rate, r, log_like):  # type: ignore[no-untyped-def]
    """Log likelihood of one record: Eq. (4) + stationary Ornstein-Uhlenbeck residual + sensor noise."""
    for w in range(sd.size):
        var = sd[w] * sd[w]
        x, p, total, prod = 0.0, var, 0.0, 1.0
        first, second = a[w], c[w]
        forget, grow_first, grow_second, last = 0.0, 0.0, 0.0, -1.0
        for k in range(y.size):
            if k > 0:
                step = gap[k] + 0.5 * (period[k] + period[k - 1])
                if step != last:
                    last = step
                    forget = np.exp(-rate[w] * step)
                    grow_first, grow_second = np.exp(b[w] * step), np.exp(d[w] * step)
                first *= grow_first
                second *= grow_second
                x *= forget
                p = var + forget * forget * (p - var)
            noise = r[w] * se[k]
            s = p + noise * noise
            v = y[k] - first - second - x
            total += v * v / s + _LOG_2PI
            prod *= s
            if k % 8 == 7:
                total += np.log(prod)
                prod = 1.0
            gain = p / s
            x += gain * v
            p *= 1.0 - gain
        log_like[w] = -0.5 * (total + np.log(prod))


def trial_log_likelihood(
    data: EnvelopeData, constants: tuple[FloatArray, ...], sd: FloatArray, rate: FloatArray, r: FloatArray
) -> FloatArray:
    """Log density of the envelope of one record about the second-order exponential, (W,).

    Parameters
    ----------
    data : EnvelopeData
        Of a single record.
    constants : four (W,) arrays
        a, b, c, d of Eq. (4), in A/D or rad and 1/s; time from the first cycle.
    sd, rate, r : (W,) arrays
        Standard deviation and rate [1/s] of the correlated residual; factor on the standard errors.
    """
    out = np.empty(np.size(sd))
    _trial_filter(
        data.amplitude, data.standard_error, data.gap, data.period,
        *_walkers(*constants, sd, rate, r), out,
    )  # fmt: skip
    return out
