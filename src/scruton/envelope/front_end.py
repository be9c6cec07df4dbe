"""The paper's procedure as it stands: one transient record to a Griffin curve, steps (3) to (8)."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Record
from scruton.envelope.amplitude import amplitude as transient_amplitude
from scruton.envelope.amplitude import band_pass as filter_band
from scruton.envelope.amplitude import detrend
from scruton.envelope.damping import GriffinCurve, StructuralDamping, aerodynamic_damping, griffin_curve, total_damping
from scruton.envelope.sampling import equal_steps, sampling
from scruton.envelope.trial import TrialFit, TrialFunction, trial_function
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown

_STORED = 20_000  # points that a FrontEnd keeps of a long record


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class FrontEnd:
    """What Eqs. (2) to (8) make of one record; amplitudes in A/D or rad.

    Attributes
    ----------
    time : (M,) array
        Times [s] of everything below; a long record is thinned to some 20,000 of them.
    amplitude : (M,) array
        Transient amplitude, Eq. (3).
    trial : TrialFit
        The fitted trial function, Eq. (4) or another.
    smooth_amplitude : (M,) array
        The trial function at `time`.
    residual_sd : float
        Standard deviation of the transient amplitude about the trial function, over the whole record.
    total_damping, aerodynamic_damping : (M,) array
        Eqs. (5) and (6).
    griffin : GriffinCurve
        Step (8) with Eq. (7) or (8); the Scruton number keeps its sign.
    """

    time: FloatArray
    amplitude: FloatArray
    trial: TrialFit
    smooth_amplitude: FloatArray
    residual_sd: float
    total_damping: FloatArray
    aerodynamic_damping: FloatArray
    griffin: GriffinCurve


def front_end(
    record: Record,
    *,
    frequency: float,
    still_air_frequency: float,
    damping_ratio: StructuralDamping,
    mass_damping_factor: float,
    trial: str | TrialFunction = "second-order exponential",
    band_pass: tuple[float, float] | None = None,
) -> FrontEnd:
    """Run steps (3) to (8) on one record.

    Parameters
    ----------
    record : Record
        y/D or rotation [rad]; of an amplitude that was extracted elsewhere steps (3) and (4) are left out.
    frequency, still_air_frequency : float
        f in the wind and f0 in still air [Hz].
    damping_ratio : float or callable
        Structural damping ratio xi_s, or xi_s(A) of the amplitude.
    mass_damping_factor : float
        4 pi m/(rho B D), or 4 pi J/(rho B^3 D): the Scruton number per unit of damping ratio.
    trial : str or TrialFunction, optional
        Smoothing of step (5), by name (see `trial_function`) or as an object.
    band_pass : (low, high), optional
        Edges of a band-pass in multiples of `frequency`, before Eq. (2); (0.6, 1.4) is a good choice. Not part
        of the paper's procedure, hence off.

    Raises
    ------
    InputError
        If the record is too short to differentiate or to fit.

    Notes
    -----
    Eq. (2) wants equal steps: a record whose steps vary is first interpolated to equal ones, and amplitudes
    inside gaps are left out.
    """
    time, response = record.time, record.response
    omega, still_air_omega = 2.0 * np.pi * frequency, 2.0 * np.pi * still_air_frequency
    if len(time) < 16 or (time[-1] - time[0]) * frequency < 2.0:
        raise InputError(record.name, "", f"{len(time)} samples over {(time[-1] - time[0]) * frequency:.1f} cycles",
                         "a record of at least 16 samples and two cycles")  # fmt: skip
    if record.is_envelope:
        a = response
    else:
        steps = sampling(time)
        if not steps.uniform:
            time, response = equal_steps(time, response, steps)
        motion = detrend(time, response, frequency)
        if band_pass is not None:
            motion = filter_band(motion, steps.step, band_pass[0] * frequency, band_pass[1] * frequency)
        a = transient_amplitude(motion, float(time[-1] - time[0]) / (len(time) - 1), omega)
        del motion
        for begin, end in steps.gaps:
            keep = (time < begin - 2.0 * steps.step) | (time > end + 2.0 * steps.step)
            time, a = time[keep], a[keep]
    form = trial_function(trial) if isinstance(trial, str) else trial
    fit = form.fit(time, a)
    residual_sd = _residual_sd(fit, time, a)
    thin = slice(None, None, -(-len(time) // _STORED))
    time, a = time[thin].copy(), a[thin].copy()
    smooth = fit.value(time)
    total = total_damping(smooth, fit.derivative(time), omega)
    aero = aerodynamic_damping(total, smooth, damping_ratio, omega, still_air_omega)
    griffin = griffin_curve(aero, smooth, mass_damping_factor, omega, still_air_omega)
    return FrontEnd(time, a, fit, smooth, residual_sd, total, aero, griffin)


def _residual_sd(fit: TrialFit, time: FloatArray, a: FloatArray) -> float:
    """Root mean square about the fit, a block at a time so that a long record costs no memory."""
    block = 65536
    total = sum(
        float(np.sum((a[i : i + block] - fit.value(time[i : i + block])) ** 2)) for i in range(0, len(a), block)
    )
    return float(np.sqrt(total / len(a)))
