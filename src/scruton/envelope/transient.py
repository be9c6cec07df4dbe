"""The paper's own amplitude once a cycle: Eqs. (2) and (3), their noise floor taken off, with a standard error."""

from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.amplitude import amplitude as transient_amplitude
from scruton.envelope.amplitude import detrend, velocity
from scruton.envelope.cycles import demodulate
from scruton.envelope.sampling import equal_steps, sampling
from scruton.envelope.thresholds import SECOND_HARMONIC
from scruton.envelope.tracking import box_sum
from scruton.envelope.types import Cycles
from scruton.envelope.windows import cut

_ROUGH = 26118.0 / 130.0**2  # sum of the squared autocorrelations of what Eq. (2) makes of white noise
_ENDS = 100.0 / 576.0 / np.pi**2  # sum of the squared weights of the samples at both ends, over those of a cycle
_BURIED = 0.9  # of tau: the root of a smaller mean square errs by 0.53 tau^(1/2), whatever the motion


def front_end_cycles(
    time: FloatArray,
    response: FloatArray,
    *,
    near: float | None = None,
    band: tuple[float, float] | None = None,
    name: str = "record",
) -> Cycles:
    r"""Amplitude of every cycle by Eqs. (2) and (3), in place of the regression of `demodulate`.

    Parameters
    ----------
    time, response : (N,) array
        Seconds, strictly increasing, and y/D or rotation [rad].
    near : float, optional
        Where the record's frequency is looked for first [Hz].
    band : (low, high), optional
        Edges [Hz] of the band that the record was filtered to.
    name : str, optional
        The record's file, for error messages.

    Returns
    -------
    Cycles
        Those of `demodulate` with another amplitude, zero where the motion is lost in the noise, and its standard
        error.

    Raises
    ------
    InputError
        As `demodulate`.

    Notes
    -----
    The mean of :math:`A_i^2 = y_i^2 + (\dot y_i/\omega)^2` over a cycle of m samples exceeds the squared amplitude by
    the noise of both terms, :math:`\nu^2 = \sigma^2 + \sigma_v^2`; for white noise of the sensor
    :math:`\sigma_v^2 = 130\,\sigma^2/(12\,\omega\Delta t)^2`.  Both are measured, as what a sine leaves of y and of
    its derivative over the whole record, and taken off.  So is the gain of Eq. (2), which makes a sine slower by
    :math:`(\omega\Delta t)^4/30`.  Of noise that a band from l to h holds, as strong as white noise of variance s there
    (`line_noise`), they are :math:`2s(h-l)\Delta t` and that times the mean of :math:`(\nu/f)^2`; then m is
    2(h - l)/f, the number of values that do not depend on each other, and no end differs from the rest.

    For white noise the error of a is that of a regression, s, but for the two ends of the cycle, where the
    differences of Eq. (2) do not cancel (:math:`\varphi` is the phase there), and for the noise's own square:

    .. math:: s_a^2 = s^2\left(1 + \frac{100\,m}{576\,\pi^2}\sin^2\varphi\right) + \frac{\tau^2}{4a^2},
       \qquad \tau^2 = \frac2m\left(\sigma^4 + 2\sigma^2\sigma_v^2 + 1.545\,\sigma_v^4\right).
    """
    cycles = demodulate(time, response, near=near, band=band, name=name)
    frequency, steps = cycles.reference_frequency, sampling(time)
    even, motion = (time, response) if steps.uniform else equal_steps(time, response, steps)
    motion = detrend(even, motion, frequency)
    step = float(even[-1] - even[0]) / (len(even) - 1)
    turn = 2.0 * np.pi * frequency * step
    omega = (8.0 * np.sin(turn) - np.sin(2.0 * turn)) / (6.0 * step)  # as Eq. (2) sees it
    squared = np.square(transient_amplitude(motion, step, omega))
    squared[:2], squared[-2:] = squared[2], squared[-3]  # one-sided differences there
    windows = cut(time, frequency)
    total = np.concatenate([[0.0], np.cumsum(squared if steps.uniform else np.interp(time, even, squared))])
    samples = (windows.stop - windows.first).astype(float)
    noise, free, rough, at_ends = cycles.noise_sd**2, samples, _ROUGH, _ENDS
    if band is None:
        rate_noise = _rate_noise(even, velocity(motion, step) / omega, frequency, noise, name)
    else:
        low, high = band
        noise *= 2.0 * (high - low) * step
        rate_noise = noise * (high**3 - low**3) / (3.0 * (high - low) * frequency**2)
        free, rough, at_ends = np.full_like(samples, 2.0 * (high - low) / frequency), 1.0, 0.0
    net = (total[windows.stop] - total[windows.first]) / samples - noise - rate_noise
    tau = np.sqrt(2.0 / free * (noise**2 + 2.0 * noise * rate_noise + rough * rate_noise**2))
    around = box_sum(net, 2) / box_sum(np.ones_like(net), 2)  # an error that leans on its own noise makes slopes lean
    ends = 1.0 + at_ends * samples * np.sin(cycles.phase) ** 2
    variance = cycles.standard_error**2 * ends + tau**2 / (4.0 * np.maximum(around, _BURIED * tau))
    return replace(cycles, amplitude=np.sqrt(np.maximum(net, 0.0)), standard_error=np.sqrt(variance))


def _rate_noise(time: FloatArray, rate: FloatArray, frequency: float, noise: float, name: str) -> float:
    """Variance of the noise of Eq. (2) over omega, from what a sine leaves of it.

    The noise of a derivative lies at high frequencies, so that a regression takes from it what it takes from the
    noise of y, times the squared frequency: as good as nothing at zero, 1 at f and 4 at 2 f, by two columns each.
    """
    samples = 1.0 / (frequency * float(time[1] - time[0]))
    columns, taken = (5.0, 10.0) if samples >= SECOND_HARMONIC else (3.0, 2.0)
    residual = demodulate(time, rate, frequency, name=name).noise_sd ** 2
    return residual * (1.0 - columns / samples) + taken * noise / samples
