r"""The force models: from their parameters to (a*, lambda) of the amplitude equation and back.

Heaving, per unit length (Eq. 9):

.. math:: f = \rho U^2 D \{Y_1[\dot y/U - \varepsilon\,\mathrm{sign}\,\dot y] + Y_2\,y/D\}

and its torsional twin (Eq. 12).  Averaged over a cycle, with s = Ut/D and beta = B/D for torsion, 1 for heaving,

.. math:: \frac{1}{a}\frac{da}{ds} = -K_0\xi_s + \frac{m_r \beta Y_1}{2} - \frac{2 m_r Y_1 \varepsilon}{\pi K a}

(Eq. 10, whose dot is d/ds and not d/dt as the text has it).  So :math:`\lambda_s = K_0\xi_s - m_r\beta Y_1/2` and
:math:`a^* = -2 m_r Y_1\varepsilon/(\pi K \lambda_s)`.  A stable amplitude needs Y1 < 0 and epsilon > 0.
"""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.dynamics.setting import Setting


def _per_s(setting: Setting) -> FloatArray:
    """Seconds per unit of dimensionless time s = Ut/D."""
    return np.asarray(setting.depth, dtype=np.float64) / np.asarray(setting.wind_speed, dtype=np.float64)


def force_parameters(a_star: ArrayLike, lam: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Y1 and epsilon of Eq. (9) or (12) from the stable amplitude and the relaxation rate [1/s].

    Returns
    -------
    Y1, epsilon : arrays, broadcast
    """
    lam_s = np.asarray(lam) * _per_s(setting)
    Y1 = 2.0 / (setting.mass_ratio * setting.beta) * (setting.K0 * np.asarray(setting.damping_ratio) - lam_s)
    Y1_epsilon = -np.pi * setting.K * lam_s * np.asarray(a_star) / (2.0 * setting.mass_ratio)
    return Y1, Y1_epsilon / Y1


def relaxation(Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Stable amplitude and relaxation rate [1/s] from Y1 and epsilon: the inverse of `force_parameters`."""
    lam_s = setting.K0 * np.asarray(setting.damping_ratio) - setting.mass_ratio * setting.beta * np.asarray(Y1) / 2.0
    a_star = -2.0 * setting.mass_ratio * np.asarray(Y1) * np.asarray(epsilon) / (np.pi * setting.K * lam_s)
    return a_star, lam_s / _per_s(setting)


def ehsan_scanlan_parameters(a_star: ArrayLike, lam: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Y1 and epsilon of Ehsan and Scanlan's force, rho U^2 D Y1 (1 - epsilon y^2/D^2) y'/U, from (a*, lambda).

    They are other quantities than those of Eq. (9): this epsilon is of the order of 1000.
    """
    sigma = 0.5 * np.asarray(lam) * _per_s(setting)
    K0_xi = setting.K0 * np.asarray(setting.damping_ratio)
    m_beta = setting.mass_ratio * setting.beta
    Y1 = 2.0 * (sigma + K0_xi) / m_beta
    return Y1, 4.0 / np.square(np.asarray(a_star)) * (1.0 - 2.0 * K0_xi / (m_beta * Y1))


def ehsan_scanlan_relaxation(Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Stable amplitude and relaxation rate [1/s] under Ehsan and Scanlan's force; amplitude 0 where it is stable."""
    K0_xi = setting.K0 * np.asarray(setting.damping_ratio)
    m_beta_Y1 = setting.mass_ratio * setting.beta * np.asarray(Y1)
    sigma = 0.5 * m_beta_Y1 - K0_xi
    a_star = 2.0 / np.sqrt(np.asarray(epsilon)) * np.sqrt(np.maximum(1.0 - 2.0 * K0_xi / m_beta_Y1, 0.0))
    return a_star, 2.0 * sigma / _per_s(setting)


def stiffness_parameter(setting: Setting) -> FloatArray:
    """Y2 = (K0^2 - K^2)/m_r from the change of frequency in the wind (Eq. 20; m_r is mu_r for torsion)."""
    difference: FloatArray = (np.square(setting.K0) - np.square(setting.K)) / setting.mass_ratio
    return difference


def aerodynamic_damping(a: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """Aerodynamic damping ratio at amplitude a (Eq. 15 and its torsional twin); negative where the wind drives."""
    m_r, K = setting.mass_ratio, setting.K
    linear = -m_r * setting.beta * np.asarray(Y1) / (2.0 * K)
    damping: FloatArray = linear + 2.0 * m_r * np.asarray(Y1) * np.asarray(epsilon) / (np.pi * K**2 * np.asarray(a))
    return damping


def total_damping(a: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """Total damping ratio at amplitude a (Eq. 14): its zero crossing is the stable amplitude."""
    structural = setting.K0 * np.asarray(setting.damping_ratio) / setting.K
    total: FloatArray = structural + aerodynamic_damping(a, Y1, epsilon, setting)
    return total


def is_stable(Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> np.ndarray:
    """Whether the fixed point of Eq. (10) exists (a* > 0) and attracts (d xi_total/da > 0 there, section 4.2)."""
    a_star, _ = relaxation(Y1, epsilon, setting)
    slope = -2.0 * setting.mass_ratio * np.asarray(Y1) * np.asarray(epsilon)  # of Eq. (14), times pi K^2 a^2
    stable: np.ndarray = np.isfinite(a_star) & (a_star > 0.0) & (slope > 0.0)
    return stable
