"""Damping against amplitude, and the Griffin curve built from it: Eqs. (5) to (8) of the paper."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.shown import fields_in_brief, shown

StructuralDamping = float | Callable[[FloatArray], FloatArray]
"""A structural damping ratio xi_s: one number, or a function of the amplitude (A/D or rad)."""


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class GriffinCurve:
    """Stable amplitude against Scruton number, as step (8) constructs it from one transient.

    Attributes
    ----------
    scruton_number : (n,) array
        Sc; negative where the aerodynamic damping is positive, that is, beyond the amplitude at Sc = 0.
    amplitude : (n,) array
        Amplitude (A/D or rad) that is stable at that Scruton number.
    """

    scruton_number: FloatArray
    amplitude: FloatArray


def total_damping(amplitude: FloatArray, amplitude_rate: FloatArray, omega: float) -> FloatArray:
    """Total damping ratio from the smoothed amplitude and its rate: Eq. (5).

    Parameters
    ----------
    amplitude, amplitude_rate : (n,) array
        Smoothed amplitude and its derivative with respect to time [1/s].
    omega : float
        Circular frequency in the wind [rad/s].

    Returns
    -------
    (n,) array
        xi_total; NaN where the smoothed amplitude is not positive (a polynomial may cross zero).
    """
    positive = np.where(amplitude > 0.0, amplitude, np.nan)
    return -amplitude_rate / (omega * positive)


def aerodynamic_damping(
    total: FloatArray, amplitude: FloatArray, structural: StructuralDamping, omega: float, still_air_omega: float
) -> FloatArray:
    """Aerodynamic damping ratio, total less structural: Eq. (6).

    Parameters
    ----------
    total, amplitude : (n,) array
        xi_total of Eq. (5), and the amplitude it belongs to.
    structural : float or callable
        xi_s, or xi_s(A) where it is known to vary with amplitude (the paper, 3.4, point 6).
    omega, still_air_omega : float
        Circular frequency in the wind and in still air [rad/s].

    Returns
    -------
    (n,) array
        xi_aero, as a ratio to critical damping at `omega`.
    """
    xi_s = structural(amplitude) if callable(structural) else structural
    return total - xi_s * (still_air_omega / omega)


def griffin_curve(
    aerodynamic: FloatArray, amplitude: FloatArray, mass_damping_factor: float, omega: float, still_air_omega: float
) -> GriffinCurve:
    """Read every transient amplitude as a stable one: step (8) with Eqs. (7) and (8).

    Parameters
    ----------
    aerodynamic, amplitude : (n,) array
        xi_aero of Eq. (6), and the amplitude it belongs to.
    mass_damping_factor : float
        Scruton number per unit of damping ratio: 4 pi m/(rho B D) heaving, 4 pi J/(rho B^3 D) torsional.
    omega, still_air_omega : float
        Circular frequency in the wind and in still air [rad/s].

    Notes
    -----
    A transient amplitude would be stable under the structural damping that makes Eq. (6) vanish,
    xi_s = -xi_aero omega/omega0. The paper writes |xi_aero|, which leaves out the frequency ratio and folds
    the branch of negative Scruton numbers onto the positive one; here the sign is kept.
    """
    xi_s = -aerodynamic * (omega / still_air_omega)
    return GriffinCurve(mass_damping_factor * xi_s, amplitude)
