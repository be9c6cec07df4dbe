r"""The force models: their parameters to (a*, lambda) of the amplitude equation and back, curves, identification.

Heaving, per unit length (Eq. 9):

.. math:: f = \rho U^2 D \{Y_1[\dot y/U - \varepsilon\,\mathrm{sign}\,\dot y] + Y_2\,y/D\}

and its torsional twin (Eq. 12).  Averaged over a cycle, with s = Ut/D and beta = B/D for torsion, 1 for heaving,

.. math:: \frac{1}{a}\frac{da}{ds} = -K_0\xi_s + \frac{m_r \beta Y_1}{2} - \frac{2 m_r Y_1 \varepsilon}{\pi K a}

(Eq. 10, whose dot is d/ds and not d/dt as the text has it).  So :math:`\lambda_s = K_0\xi_s - m_r\beta Y_1/2` and
:math:`a^* = -2 m_r Y_1\varepsilon/(\pi K \lambda_s)`.  A stable amplitude at every damping needs Y1 < 0
and epsilon > 0; with both of the other sign there is one above a least damping.
"""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import BoolArray, FloatArray
from scruton.dynamics.scruton_number import floats
from scruton.dynamics.setting import Setting


def _per_s(setting: Setting) -> FloatArray:
    """Seconds per unit of dimensionless time s = Ut/D."""
    return floats(setting.depth) / floats(setting.wind_speed)


def force_parameters(a_star: ArrayLike, lam: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Y1 and epsilon of Eq. (9) or (12) from the stable amplitude and the relaxation rate [1/s].

    Returns
    -------
    Y1, epsilon : arrays, broadcast
    """
    lam_s = floats(lam) * _per_s(setting)
    Y1 = 2.0 / (setting.mass_ratio * setting.beta) * (setting.K0 * floats(setting.damping_ratio) - lam_s)
    Y1_epsilon = -np.pi * setting.K * lam_s * floats(a_star) / (2.0 * setting.mass_ratio)
    return Y1, Y1_epsilon / Y1


def relaxation(Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Stable amplitude and relaxation rate [1/s] from Y1 and epsilon: the inverse of `force_parameters`."""
    lam_s = setting.K0 * floats(setting.damping_ratio) - setting.mass_ratio * setting.beta * floats(Y1) / 2.0
    a_star = -2.0 * setting.mass_ratio * floats(Y1) * floats(epsilon) / (np.pi * setting.K * lam_s)
    return a_star, lam_s / _per_s(setting)


def ehsan_scanlan_parameters(a_star: ArrayLike, lam: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Y1 and epsilon of Ehsan and Scanlan's force, rho U^2 D Y1 (1 - epsilon y^2/D^2) y'/U, from (a*, lambda).

    They are other quantities than those of Eq. (9): this epsilon is of the order of 1000.
    """
    sigma = 0.5 * floats(lam) * _per_s(setting)
    K0_xi = setting.K0 * floats(setting.damping_ratio)
    m_beta = setting.mass_ratio * setting.beta
    Y1 = 2.0 * (sigma + K0_xi) / m_beta
    return Y1, 4.0 / np.square(floats(a_star)) * (1.0 - 2.0 * K0_xi / (m_beta * Y1))


def ehsan_scanlan_relaxation(Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> tuple[FloatArray, FloatArray]:
    """Stable amplitude and relaxation rate [1/s] under Ehsan and Scanlan's force; amplitude 0 where it is stable."""
    K0_xi = setting.K0 * floats(setting.damping_ratio)
    m_beta_Y1 = setting.mass_ratio * setting.beta * floats(Y1)
    sigma = 0.5 * m_beta_Y1 - K0_xi
    a_star = 2.0 / np.sqrt(floats(epsilon)) * np.sqrt(np.maximum(1.0 - 2.0 * K0_xi / m_beta_Y1, 0.0))
    return a_star, 2.0 * sigma / _per_s(setting)


def stiffness_parameter(setting: Setting) -> FloatArray:
    """Y2 = (K0^2 - K^2)/m_r from the change of frequency in the wind (Eq. 20; m_r is mu_r for torsion)."""
    return (np.square(setting.K0) - np.square(setting.K)) / setting.mass_ratio


def aerodynamic_damping(a: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """Aerodynamic damping ratio at amplitude a (Eq. 15 and its torsional twin); negative where the wind drives."""
    m_r, K = setting.mass_ratio, setting.K
    linear = -m_r * setting.beta * floats(Y1) / (2.0 * K)
    return linear + 2.0 * m_r * floats(Y1) * floats(epsilon) / (np.pi * K**2 * floats(a))


def total_damping(a: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """Total damping ratio at amplitude a (Eq. 14): its zero crossing is the stable amplitude."""
    structural = setting.K0 * floats(setting.damping_ratio) / setting.K
    return structural + aerodynamic_damping(a, Y1, epsilon, setting)


def is_stable(Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> BoolArray:
    """Whether the fixed point of Eq. (10) exists (a* > 0) and attracts (d xi_total/da > 0 there, section 4.2)."""
    a_star, _ = relaxation(Y1, epsilon, setting)
    slope = -2.0 * setting.mass_ratio * floats(Y1) * floats(epsilon)  # of Eq. (14), times pi K^2 a^2
    return np.isfinite(a_star) & (a_star > 0.0) & (slope > 0.0)


def _bracket(scruton_number: ArrayLike, Y1: ArrayLike, setting: Setting) -> FloatArray:
    """1 - (B/D) K0 Sc/(2 pi Y1); for torsion without B/D, since Sc is made with B^3 D."""
    return 1.0 - setting.scruton_side * setting.K0 * floats(scruton_number) / (2.0 * np.pi * floats(Y1))


def stable_amplitude(scruton_number: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """A/D (Eq. 11) or rad (its torsional twin, with 1/beta = D/B in front) at a Scruton number.

    Negative Scruton numbers are allowed: they have no physical meaning but show the trend, as the paper draws it.
    """
    front = 4.0 * floats(epsilon) / (np.pi * setting.K * setting.beta)
    return front / _bracket(scruton_number, Y1, setting)


def reciprocal_amplitude(scruton_number: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """D/A (Eq. 13) or 1/A_alpha [1/rad]: linear in the Scruton number."""
    return 1.0 / stable_amplitude(scruton_number, Y1, epsilon, setting)


def ehsan_scanlan_amplitude(
    scruton_number: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting
) -> FloatArray:
    """A/D (Eq. 21) or rad under Ehsan and Scanlan's force; zero where the vibration dies."""
    return 2.0 / np.sqrt(floats(epsilon)) * np.sqrt(np.maximum(_bracket(scruton_number, Y1, setting), 0.0))


def Y1_epsilon_from_damping(amplitude: ArrayLike, aerodynamic_damping: ArrayLike, setting: Setting) -> float:
    """Y1 epsilon from the slope of aerodynamic damping against 1/a (Eq. 16).

    The printed equation has Y1 epsilon on its right-hand side too; that one must not be there:
    Y1 epsilon = pi K^2/(2 m_r) d xi_aero/d(1/a).
    """
    slope = np.polyfit(1.0 / floats(amplitude), floats(aerodynamic_damping), 1)[0]
    return float(np.pi * setting.K**2 / (2.0 * setting.mass_ratio) * slope)


def Y1_epsilon_from_griffin(slope: ArrayLike, setting: Setting) -> FloatArray:
    """Y1 epsilon from d(D/A)/dSc, or d(1/A_alpha)/dSc [1/rad] (Eq. 17): -(K K0/8) (B/D)/slope.

    B/D stands in the torsional twin too.
    """
    return -setting.K * setting.K0 * setting.side_ratio / (8.0 * floats(slope))


def Y1_from_amplitude(Y1_epsilon: ArrayLike, a_star: ArrayLike, setting: Setting) -> FloatArray:
    """Y1 from the stable amplitude (Eq. 18)."""
    first = 8.0 * floats(Y1_epsilon) / (setting.beta * setting.K * floats(a_star))
    return (first + setting.scruton_side * setting.K0 * setting.scruton_number) / (2.0 * np.pi)


def epsilon_from_amplitude(Y1_epsilon: ArrayLike, a_star: ArrayLike, setting: Setting) -> FloatArray:
    """Epsilon from the stable amplitude (Eq. 19)."""
    linear = setting.scruton_side * setting.K0 * setting.scruton_number / (2.0 * np.pi * floats(Y1_epsilon))
    return 1.0 / (linear + 4.0 / (np.pi * setting.K * setting.beta * floats(a_star)))
