"""How a wake oscillator answers a section that moves with a given amplitude: the van der Pol equation, integrated."""

import numpy as np
from numba import njit


def in_phase(amplitude: float, omega: float, damping: float, coupling: float, frequency: float) -> float:
    """Component of the wake variable in phase with the section's velocity, once locked.

    Parameters
    ----------
    amplitude : float
        Of the section, A/D or rad.
    omega : float
        Its circular frequency [rad/s].
    damping, coupling, frequency : float
        e, A, and w/omega of q'' + e w (q^2 - 1) q' + w^2 q = A x''.
    """
    return float(_in_phase(amplitude, damping, coupling, frequency))


@njit(cache=True)
def _in_phase(a, e, coupling, w):  # type: ignore[no-untyped-def]
    """Time in radians of the section's motion x = a cos t; semi-implicit steps, mean over the last cycles."""
    steps, cycles, averaged = 2000, 400, 40
    h = 2.0 * np.pi / steps
    q, p, total = 0.0, -2.0, 0.0
    for i in range(cycles * steps):
        t = (i + 0.5) * h
        p += h * (-coupling * a * np.cos(t) - e * w * (q * q - 1.0) * p - w * w * q)
        q += h * p
        if i >= (cycles - averaged) * steps:
            total += -np.sin(t) * q
    return 2.0 * total / (averaged * steps)
