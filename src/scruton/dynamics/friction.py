r"""Dahl's friction over a cycle: a force that builds up over a displacement is in part a spring.

.. math:: \frac{dz}{dx} = \frac{1 - z\,\mathrm{sgn}\,\dot x}{s}

for the force over its largest value. On the loop of amplitude a, with r = a/s, its first harmonic is
:math:`\tfrac{4}{\pi}(1 - \tanh r/r)` against the velocity and :math:`2 (1 + \tanh r)\, e^{-r} I_1(r)` with the
displacement: a damping, and a rise of the frequency by :math:`\tfrac{\pi F}{2\omega a}(1 + \tanh r)\, e^{-r} I_1(r)`
where the first takes :math:`F (1 - \tanh r/r)` from the amplitude in unit time.
"""

import numpy as np

from scruton.compiled import njit


@njit(cache=True)
def hysteresis(r):  # type: ignore[no-untyped-def]
    """Loss over that of sudden friction at an amplitude, over the displacement of build-up, and its slope."""
    if r < 0.02:
        return r * r / 3.0, 2.0 * r / 3.0
    t = np.tanh(r)
    return 1.0 - t / r, (t / r - 1.0 + t * t) / r


@njit(cache=True)
def at_speed(a, power, hump, place):  # type: ignore[no-untyped-def]
    r"""Factor on friction that goes with a power of the speed, or is less at speed than at rest, and its slope.

    Averaged over a cycle both go with the amplitude a: of :math:`F (1 + h\,e^{-(v/v_h)^2})` it is near to
    :math:`F (1 + h/(1 + (a/a_h)^2))`.
    """
    factor = a**power
    slope = power * factor / a
    if hump != 0.0:
        x = a / place
        left = 1.0 / (1.0 + x * x)
        slope = slope * (1.0 + hump * left) - factor * hump * 2.0 * x * left * left / place
        factor *= 1.0 + hump * left
    return factor, slope


@njit(cache=True)
def stiffening(a, strength, width):  # type: ignore[no-untyped-def]
    """Rise of the frequency at amplitude a, over itself, by a strength pi F/(2 omega) that builds up over a width."""
    return strength / a * spring(a / width)


@njit(cache=True)
def spring(r):  # type: ignore[no-untyped-def]
    """(1 + tanh r) exp(-r) I_1(r), to 1e-6 (Abramowitz and Stegun 9.8.3 and 9.8.4)."""
    if r < 3.75:
        u = r * r / 14.0625
        series = 0.02658733 + u * (0.00301532 + u * 0.00032411)
        series = 0.5 + u * (0.87890594 + u * (0.51498869 + u * (0.15084934 + u * series)))
        return (1.0 + np.tanh(r)) * np.exp(-r) * r * series
    u = 3.75 / r
    series = -0.01031555 + u * (0.02282967 + u * (-0.02895312 + u * (0.01787654 - u * 0.00420059)))
    series = 0.39894228 + u * (-0.03988024 + u * (-0.00362018 + u * (0.00163801 + u * series)))
    return (1.0 + np.tanh(r)) * series / np.sqrt(r)
