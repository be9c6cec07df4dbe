"""Stable amplitude against Scruton number in closed form: Eqs. (11), (13), (21) and their torsional twins."""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.dynamics.setting import Setting


def _bracket(scruton_number: ArrayLike, Y1: ArrayLike, setting: Setting) -> FloatArray:
    """1 - (B/D) K0 Sc/(2 pi Y1); for torsion without B/D, since Sc is made with B^3 D."""
    bracket: FloatArray = 1.0 - setting.scruton_side * setting.K0 * np.asarray(scruton_number) / (
        2.0 * np.pi * np.asarray(Y1)
    )
    return bracket


def stable_amplitude(scruton_number: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """A/D (Eq. 11) or rad (its torsional twin, with 1/beta = D/B in front) at a Scruton number.

    Negative Scruton numbers are allowed: they have no physical meaning but show the trend, as the paper draws it.
    """
    front = 4.0 * np.asarray(epsilon) / (np.pi * setting.K * setting.beta)
    amplitude: FloatArray = front / _bracket(scruton_number, Y1, setting)
    return amplitude


def reciprocal_amplitude(scruton_number: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting) -> FloatArray:
    """D/A (Eq. 13) or 1/A_alpha [1/rad]: linear in the Scruton number."""
    return 1.0 / stable_amplitude(scruton_number, Y1, epsilon, setting)


def ehsan_scanlan_amplitude(
    scruton_number: ArrayLike, Y1: ArrayLike, epsilon: ArrayLike, setting: Setting
) -> FloatArray:
    """A/D (Eq. 21) or rad under Ehsan and Scanlan's force; zero where the vibration dies."""
    amplitude: FloatArray = (
        2.0 / np.sqrt(np.asarray(epsilon)) * np.sqrt(np.maximum(_bracket(scruton_number, Y1, setting), 0.0))
    )
    return amplitude
