"""Identification of Y1 and epsilon as the paper does it: Eqs. (16) to (19) and their torsional twins."""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.dynamics.setting import Setting


def Y1_epsilon_from_damping(amplitude: ArrayLike, aerodynamic_damping: ArrayLike, setting: Setting) -> float:
    """Y1 epsilon from the slope of aerodynamic damping against 1/a (Eq. 16).

    The printed equation has Y1 epsilon on its right-hand side too; that one must not be there:
    Y1 epsilon = pi K^2/(2 m_r) d xi_aero/d(1/a).
    """
    slope = np.polyfit(1.0 / np.asarray(amplitude), np.asarray(aerodynamic_damping), 1)[0]
    return float(np.pi * setting.K**2 / (2.0 * setting.mass_ratio) * slope)


def Y1_epsilon_from_griffin(slope: ArrayLike, setting: Setting) -> FloatArray:
    """Y1 epsilon from d(D/A)/dSc, or d(1/A_alpha)/dSc [1/rad] (Eq. 17): -(K K0/8) (B/D)/slope.

    B/D stands in the torsional twin too.
    """
    product: FloatArray = -setting.K * setting.K0 * setting.side_ratio / (8.0 * np.asarray(slope))
    return product


def Y1_from_amplitude(Y1_epsilon: ArrayLike, a_star: ArrayLike, setting: Setting) -> FloatArray:
    """Y1 from the stable amplitude (Eq. 18)."""
    first = 8.0 * np.asarray(Y1_epsilon) / (setting.beta * setting.K * np.asarray(a_star))
    Y1: FloatArray = (first + setting.scruton_side * setting.K0 * setting.scruton_number) / (2.0 * np.pi)
    return Y1


def epsilon_from_amplitude(Y1_epsilon: ArrayLike, a_star: ArrayLike, setting: Setting) -> FloatArray:
    """Epsilon from the stable amplitude (Eq. 19)."""
    linear = setting.scruton_side * setting.K0 * setting.scruton_number / (2.0 * np.pi * np.asarray(Y1_epsilon))
    epsilon: FloatArray = 1.0 / (linear + 4.0 / (np.pi * setting.K * setting.beta * np.asarray(a_star)))
    return epsilon
