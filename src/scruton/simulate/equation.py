r"""The full equation of motion of a section in its rig, with everything that `Disturbances` adds, integrated in time.

Heaving, with eta = y/D (Eq. 9 of the Griffin-plot paper on the right):

.. math:: \ddot\eta + 2\xi\omega_0\dot\eta + \omega_0^2\eta = \frac{\rho U^2}{m}
   \{Y_1[D\dot\eta/U - \varepsilon\,\mathrm{sign}\,\dot\eta] + Y_2\eta + C\sin(\omega_{vs}t + \psi)\} + w(t)

and for torsion (Eq. 12) alpha in place of eta, J in place of m, rho U^2 B^2 in front and B alpha'/U in the bracket.
Ehsan and Scanlan's force has (1 - epsilon eta^2) D eta'/U in the bracket instead, the force "power" of `Truth` a power
of the velocity.  w is broad-band turbulence: white
near the resonance.

Nothing here is averaged over a cycle: that approximation is what the simulator is there to check.  What varies within
a cycle is integrated; the running amplitude sqrt(x^2 + (v/omega)^2) and the schedules in time are held over a step, a
hundred-and-twentieth of a cycle.
"""

from collections import namedtuple

import numpy as np

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.simulate.disturbances import COHERENCE_FORMS, FRICTION_FORMS, Disturbances
from scruton.simulate.thresholds import LAGGED, LEAST_WIND
from scruton.simulate.truth import FORCES, Truth

STEPS_PER_CYCLE = 120


# Every number that the forces need, in the order of `Truth` and `Disturbances`; see there.
Terms = namedtuple(
    "Terms",
    "w0 omega xi pressure passage Y1 epsilon Y2 form exponent shedding shedding_omega shedding_phase friction dahl "
    "friction_scale quadratic_drag displacement_drag k2 k3 xxv vvv xv xxxxv coherence coherence_form memory bump_rate "
    "bump_amplitude bump_width wake_share wake_gain wake_damping wake_coupling wake_omega jumps",
)


def terms(truth: Truth, d: Disturbances) -> Terms:
    """Put a rig in its wind and what disturbs it into one row of numbers."""
    still = truth.still
    wind = 0.0 if still else 1.0
    return Terms(
        2.0 * np.pi * truth.frequency, truth.omega, truth.damping_ratio,
        0.0 if still else truth.pressure, 1.0 if still else truth.passage, truth.Y1, truth.epsilon, truth.Y2,
        float(FORCES.index(truth.force)), truth.exponent, truth.shedding, 2.0 * np.pi * truth.shedding_frequency,
        truth.shedding_phase, d.friction, float(FRICTION_FORMS.index(d.friction_form)), d.friction_scale,
        d.quadratic_drag, d.displacement_drag, d.linear_stiffness_slope, d.cubic_stiffness,
        wind * d.aero_xxv, wind * d.aero_vvv, wind * d.aero_xv, wind * d.aero_xxxxv,
        d.coherence_amplitude, float(COHERENCE_FORMS.index(d.coherence_form)), d.memory_time,
        d.bump_rate if d.bump_in_still_air else wind * d.bump_rate, d.bump_amplitude, d.bump_width,
        d.wake_share, wind * d.wake_gain, d.wake_damping, d.wake_coupling, truth.omega * d.wake_frequency,
        # The other forces by themselves are smooth where the velocity changes sign.
        float(truth.force == "paper" or not d.off),
    )  # fmt: skip


def mean_rate(truth: Truth, disturbances: Disturbances, amplitude: FloatArray) -> FloatArray:
    """Rate of the amplitude [per s] that the work of all forces over one harmonic cycle gives, (N,).

    It scales severities and tells stable amplitudes; the integration does not use it. What has a past (memory, a wake
    oscillator, schedules in time) is left out.

    Parameters
    ----------
    truth : Truth
    disturbances : Disturbances
    amplitude : (N,) array
        A/D or rad, > 0.
    """
    return np.asarray(_mean_rate(terms(truth, disturbances), np.atleast_1d(np.asarray(amplitude, dtype=np.float64))))


@njit(cache=True)
def _second_term(amplitude, lagged, drive, k):  # type: ignore[no-untyped-def]
    """What is left of the force's second term: coherence, memory, lock-in, and what the wake took over."""
    left = drive * (1.0 - k.wake_share)
    if k.coherence > 0.0:
        u = amplitude / k.coherence
        if k.coherence_form == 0.0:
            left *= -np.expm1(-u)
        elif k.coherence_form == 1.0:
            left *= np.tanh(u)
        else:
            left *= u / np.sqrt(1.0 + u * u)
    if k.memory > 0.0 and lagged > 0.0:
        left *= min(max(amplitude / lagged, LAGGED[0]), LAGGED[1])
    return left


@njit(cache=True)
def _dahl(z, moved, side, scale):  # type: ignore[no-untyped-def]
    """Dahl's state after a displacement in one direction: exact."""
    return side + (z - side) * np.exp(-abs(moved) / scale)


@njit(cache=True)
def _acceleration(t, x, v, side, z, x0, q, left, bump, gust, k):  # type: ignore[no-untyped-def]
    """Acceleration; `side` is the sign of the velocity, `left` the factor of the force's second term, `bump` a rate."""
    total = -2.0 * k.xi * k.w0 * v - k.w0 * k.w0 * x * (1.0 + k.k2 * abs(x) + k.k3 * x * x)
    total -= (k.quadratic_drag * abs(v) + k.displacement_drag * x * x + 2.0 * bump) * v
    if k.friction > 0.0:
        if k.dahl == 0.0:
            total -= k.friction * np.tanh(v / k.friction_scale)
        else:
            total -= k.friction * _dahl(z, x - x0, side, k.friction_scale)
    if k.pressure > 0.0:
        wind = k.pressure * gust * gust
        if k.form == 0.0:
            total += wind * k.Y1 * (k.passage / gust * v - k.epsilon * left * side)
        elif k.form == 2.0:
            if v != 0.0:
                log = np.log(abs(v) / k.omega)
                grown = log if k.exponent == 0.0 else np.expm1(k.exponent * log) / k.exponent
                total += wind * k.Y1 * (1.0 - k.epsilon * left * grown) * k.passage / gust * v
        else:
            total += wind * k.Y1 * (1.0 - k.epsilon * left * x * x) * k.passage / gust * v
        total += wind * (k.Y2 * x + k.shedding * np.sin(k.shedding_omega * t + k.shedding_phase))
        total -= gust * (k.xxv * x * x + k.vvv * v * v + k.xv * abs(x) + k.xxxxv * x * x * x * x) * v
        total += gust * gust * k.wake_gain * q
    return total


@njit(cache=True)
def _wake(q, qv, acceleration, gust, k):  # type: ignore[no-untyped-def]
    if k.wake_gain == 0.0:
        return 0.0
    w = k.wake_omega * gust
    return k.wake_coupling * acceleration - k.wake_damping * w * (q * q - 1.0) * qv - w * w * q


@njit(cache=True)
def _rk4(t, x, v, q, qv, h, side, z, left, bump, gust, k):  # type: ignore[no-untyped-def]
    a1 = _acceleration(t, x, v, side, z, x, q, left, bump, gust, k)
    b1 = _wake(q, qv, a1, gust, k)
    x2, v2, q2, qv2 = x + 0.5 * h * v, v + 0.5 * h * a1, q + 0.5 * h * qv, qv + 0.5 * h * b1
    a2 = _acceleration(t + 0.5 * h, x2, v2, side, z, x, q2, left, bump, gust, k)
    b2 = _wake(q2, qv2, a2, gust, k)
    x3, v3, q3, qv3 = x + 0.5 * h * v2, v + 0.5 * h * a2, q + 0.5 * h * qv2, qv + 0.5 * h * b2
    a3 = _acceleration(t + 0.5 * h, x3, v3, side, z, x, q3, left, bump, gust, k)
    b3 = _wake(q3, qv3, a3, gust, k)
    x4, v4, q4, qv4 = x + h * v3, v + h * a3, q + h * qv3, qv + h * b3
    a4 = _acceleration(t + h, x4, v4, side, z, x, q4, left, bump, gust, k)
    b4 = _wake(q4, qv4, a4, gust, k)
    x1 = x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
    v1 = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    q1 = q + h / 6.0 * (qv + 2.0 * qv2 + 2.0 * qv3 + qv4)
    qv1 = qv + h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
    return x1, v1, q1, qv1


@njit(cache=True)
def _bump(amplitude, k):  # type: ignore[no-untyped-def]
    if k.bump_rate == 0.0:
        return 0.0
    u = (amplitude - k.bump_amplitude) / k.bump_width
    return k.bump_rate * np.exp(-0.5 * u * u)


@njit(cache=True)
def integrate(  # type: ignore[no-untyped-def]
    out, start, h, substeps, k, kick, intensity, gust_time, noise, speed, drive, rate
):
    """Runge-Kutta between sign changes of the velocity, where the force jumps; a kick after each step.

    Into `out`, (N,); `start` has displacement, velocity and gust, `k` are the `terms`, `speed`, `drive` and `rate` the
    schedules, `noise` (2, steps) or (2, 0).
    """
    x, v = start[0], start[1]
    out[0] = x
    # A square is a product: numba makes of x ** 2 one or a call of pow, whichever function it compiled first.
    quadrature = v / k.omega
    amplitude = lagged = np.sqrt(x * x + quadrature * quadrature)
    q, qv = 0.0, 0.0
    if k.wake_gain != 0.0:
        # The wake starts locked: in phase with the velocity, at the amplitude of its own cycle.
        phase = np.arctan2(-v / k.omega, x)
        q, qv = -2.0 * np.sin(phase), -2.0 * k.omega * np.cos(phase)
    t, n, wind, z = 0.0, 0, start[2], 0.0
    forget = np.exp(-h / gust_time)
    fresh = intensity * np.sqrt(1.0 - forget * forget)
    keep = np.exp(-h / k.memory) if k.memory > 0.0 else 0.0
    root = kick * np.sqrt(h)
    for i in range(1, out.size):
        for _ in range(substeps):
            gust = max(speed[i] + wind, LEAST_WIND)
            quadrature = v / k.omega
            amplitude = np.sqrt(x * x + quadrature * quadrature)
            left = _second_term(amplitude, lagged, drive[i], k)
            bump = _bump(amplitude, k) + rate[i]
            # At rest the jump has no side: the spring decides where the motion goes.
            side = np.sign(v) if v != 0.0 else np.sign(-x)
            x1, v1, q1, qv1 = _rk4(t, x, v, q, qv, h, side, z, left, bump, gust, k)
            if k.jumps and v1 * side < 0.0:
                # Split the step where the velocity crosses zero: secant, then one refinement.
                part = h * v / (v - v1)
                xm, vm, qm, qvm = _rk4(t, x, v, q, qv, part, side, z, left, bump, gust, k)
                zm = _dahl(z, xm - x, side, k.friction_scale)
                slope = _acceleration(t + part, xm, vm, side, zm, xm, qm, left, bump, gust, k)
                if slope != 0.0:
                    part = min(max(part - vm / slope, 0.0), h)
                xm, vm, qm, qvm = _rk4(t, x, v, q, qv, part, side, z, left, bump, gust, k)
                z = _dahl(z, xm - x, side, k.friction_scale)
                x1, v1, q1, qv1 = _rk4(t + part, xm, 0.0, qm, qvm, h - part, -side, z, left, bump, gust, k)
                z = _dahl(z, x1 - xm, -side, k.friction_scale)
            else:
                z = _dahl(z, x1 - x, side, k.friction_scale)
            x, v, q, qv = x1, v1, q1, qv1
            lagged = amplitude + (lagged - amplitude) * keep
            t += h
            if noise.shape[1] > 0:
                v += root * noise[0, n]
                wind = forget * wind + fresh * noise[1, n]
                n += 1
        out[i] = x


@njit(cache=True)
def _mean_rate(k, amplitudes):  # type: ignore[no-untyped-def]
    out = np.empty(amplitudes.size)
    points = 1440
    for j in range(amplitudes.size):
        a = amplitudes[j]
        left = _second_term(a, a, 1.0, k)
        bump = _bump(a, k)
        work, z, before = 0.0, 0.0, a
        # The first half cycle only brings the friction's state onto its loop.
        for i in range(points + points // 2):
            angle = 2.0 * np.pi * (i + 0.5) / points
            x, v = a * np.cos(angle), -a * k.omega * np.sin(angle)
            side = np.sign(v)
            z = _dahl(z, x - before, side, k.friction_scale)
            before = x
            if i >= points // 2:
                force = _acceleration(0.0, x, v, side, z, x, 0.0, left, bump, 1.0, k)
                work += force * v / points
        out[j] = work / (k.omega * k.omega * a)
    return out
