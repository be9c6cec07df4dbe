"""How the phase of an oscillation wanders: the spectrum of a dphi from cycle to cycle."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.types import Cycles


def periodogram(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Periodogram of evenly spaced values about their mean, at the Fourier frequencies between 0 and pi.

    Returns
    -------
    angle, power : ((N-1)//2,) arrays
        Radians per step; squared modulus over N, whose mean for white noise is the variance.
    """
    n = x.size
    inside = slice(1, (n - 1) // 2 + 1)
    power = np.abs(np.fft.rfft(x - x.mean())) ** 2 / max(n, 1)
    return 2.0 * np.pi * np.arange(n)[inside] / max(n, 1), power[inside]


def unbroken(cycles: Cycles) -> slice:
    """Longest run of cycles without a gap."""
    steps = np.diff(cycles.time) * cycles.reference_frequency
    edges = np.r_[0, np.flatnonzero(steps > 1.25) + 1, cycles.time.size]
    longest = int(np.argmax(np.diff(edges)))
    return slice(int(edges[longest]), int(edges[longest + 1]))


def phase_steps(cycles: Cycles) -> FloatArray:
    r"""Turn of every cycle against the one before, times the amplitude, without the mean frequency, (n-1,).

    Broad-band forcing of intensity q moves the amplitude by q dW and the phase by :math:`a\,d\varphi = q\,dW'`, so
    that these steps have the unit and the intensity of the amplitude's noise, but nothing pulls the phase back.

    Parameters
    ----------
    cycles : Cycles
        Without a gap.
    """
    step = np.diff(cycles.phase)
    moving = 0.5 * (cycles.amplitude[1:] + cycles.amplitude[:-1])
    return moving * (step - float(np.average(step, weights=np.maximum(moving, 0.0) ** 2)))


def step_spectrum(angle: FloatArray, period: float, standard_error: float) -> tuple[FloatArray, FloatArray]:
    """Expected periodogram of `phase_steps`: q^2 times the first array plus the second.

    A demodulated phase is the mean over its cycle, so that steps of a random walk share half a cycle with their
    neighbours; an error of a phase enters two steps with opposite signs.

    Parameters
    ----------
    angle : (M,) array
        Radians per cycle.
    period : float
        Of one cycle [s].
    standard_error : float
        Root mean square of the cycles' standard errors (A/D or rad).
    """
    swing = 1.0 - np.cos(angle)
    return period * (1.0 - swing / 3.0), 2.0 * standard_error**2 * swing
