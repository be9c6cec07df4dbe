"""What codes say the amplitude is: lines to compare a measured Griffin curve with, none of them a limit.

All of them in the Scruton number of this program, Sc = 4 pi m xi/(rho B D) (heaving), 4 pi J xi/(rho B^3 D) (torsion),
and as A/D, or rad in torsion.  A logarithmic decrement delta is 2 pi xi.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi, sqrt

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion

UNIFORM = 1.0 / (4.0 * pi)  # K of EN 1991-1-4 (E.9) of a mode of one amplitude along the span, as a section model has
LARGEST_CORRELATION = 0.6  # K_w, (E.8): no part of a span counts for more
LATERAL_FORCE = 1.1  # c_lat,0 of rectangles with d/b from 0.5 to 10, Table E.2
RECTANGLES = (0.5, 10.0)  # d/b
SQUARES = (0.75, 1.33)  # d/b near enough to a square for its constants; judgement
SQUARE = (0.04, 6.0, 0.4)  # C_c, K_a,max and a_L of the square section, Table E.6
LEAST_FORCE = 0.5  # c = 3 (k + h phi)/d of BD 49/01 without edge members: it is not taken for less


@dataclass(frozen=True)
class Comparison:
    """Amplitude by one code.

    Attributes
    ----------
    name, clause : str
        As a legend has it, and where it stands with what was taken for the section.
    confirm : str
        What is not confirmed in the code's own text; empty where nothing is open.
    amplitude : callable
        Scruton numbers above zero, (N,) -> amplitude, (N,): A/D, or rad in torsion.
    """

    name: str
    clause: str
    confirm: str
    amplitude: Callable[[FloatArray], FloatArray]


def en_scruton_number(scruton_number: FloatArray, width: float, depth: float) -> FloatArray:
    """2 delta m/(rho b^2) of EN 1991-1-4 (E.4): its b is the depth across the wind."""
    return np.asarray(scruton_number) * (width / depth)


def en_approach_1(
    scruton_number: FloatArray,
    width: float,
    depth: float,
    strouhal: float,
    *,
    mode_factor: float = UNIFORM,
) -> FloatArray:
    """Largest amplitude y/b = K K_w c_lat/(St^2 Sc), with K_w and c_lat at their largest: EN 1991-1-4 E.1.5.2, (E.7).

    Parameters
    ----------
    scruton_number : (N,) array
        Of this program, above zero.
    strouhal : float
        f D/U where vortices resonate.
    mode_factor : float
        K.
    """
    factor = mode_factor * LARGEST_CORRELATION * LATERAL_FORCE / strouhal**2
    return factor / en_scruton_number(scruton_number, width, depth)


def en_approach_2(
    scruton_number: FloatArray,
    width: float,
    depth: float,
    strouhal: float,
    *,
    mass_ratio: float = 0.0,
    slenderness: float = 1.0,
    constants: tuple[float, float, float] = SQUARE,
) -> FloatArray:
    """Largest amplitude y/b = k_p sigma/b: EN 1991-1-4 E.1.5.3, (E.13) to (E.17).

    (sigma/b)^2 = c1 + sqrt(c1^2 + c2), c1 = a_L^2/2 (1 - Sc/(4 pi K_a)), c2 = rho b^2/m a_L^2/K_a C_c^2/St^4 b/h.

    Parameters
    ----------
    scruton_number : (N,) array
        Of this program, above zero.
    mass_ratio, slenderness : float
        rho b^2/m, and h/b; without a mass ratio the wake of the body at rest does nothing, and the amplitude is that of
        lock-in alone.
    constants : (float, float, float)
        C_c, K_a and a_L: Table E.6 has those of circular and square sections.
    """
    force, damping, ceiling = constants
    locked = en_scruton_number(scruton_number, width, depth) / (4.0 * pi * damping)
    c1 = 0.5 * ceiling**2 * (1.0 - locked)
    c2 = mass_ratio * ceiling**2 / damping * force**2 / strouhal**4 / slenderness
    peak = sqrt(2.0) * (1.0 + 1.2 * np.arctan(0.75 * locked**4))
    return np.asarray(peak * np.sqrt(c1 + np.sqrt(c1**2 + c2)))


def japanese_handbook(scruton_number: FloatArray, width: float, depth: float, *, shape: float = 1.0) -> FloatArray:
    """Heaving amplitude h/D in smooth flow, h = E_h B/(m_r delta), E_h = 0.065 beta (B/D)^-1, m_r = m/(rho B^2).

    Parameters
    ----------
    scruton_number : (N,) array
        Above zero.
    shape : float
        beta: 2 for girders with vertical webs, 1 for others.
    """
    return 0.13 * shape * (width / depth) / np.asarray(scruton_number)


def bd49(motion: Motion, scruton_number: FloatArray, width: float, depth: float) -> FloatArray:
    """Amplitude A/D, or rotation [rad], by BD 49/01 3.1.2 with the least c.

    Heaving y = c b^0.5 d^2.5 rho/(4 m delta), torsion at the edge of the deck y = c b^1.5 d^3.5 rho/(8 m r^2 delta).

    Parameters
    ----------
    scruton_number : (N,) array
        Above zero.
    """
    power = 0.5 if motion is Motion.HEAVING else 2.5
    return np.asarray(LEAST_FORCE * (depth / width) ** power / (2.0 * np.asarray(scruton_number)))


def comparisons(motion: Motion, width: float, depth: float, strouhal: float) -> tuple[Comparison, ...]:
    """Amplitudes of all codes that speak of such a section.

    Parameters
    ----------
    strouhal : float
        f D/U of the peak tests.
    """
    ratio, heaving, deck = width / depth, motion is Motion.HEAVING, width >= depth
    of_bd49 = Comparison(
        "BD 49/01",
        f"BD 49/01 3.1.2 with c = {LEAST_FORCE:g}, the least",
        "read in a public copy",
        partial(bd49, motion, width=width, depth=depth),
    )
    approach_1 = Comparison(
        "EN 1991-1-4, approach 1",
        f"EN 1991-1-4 E.1.5.2 of a rectangle in a uniform mode, K_w = {LARGEST_CORRELATION:g}, St = f D/U of the peak "
        f"tests, {strouhal:.3f}",
        "",
        partial(en_approach_1, width=width, depth=depth, strouhal=strouhal),
    )
    approach_2 = Comparison(
        "EN 1991-1-4, approach 2",
        "EN 1991-1-4 E.1.5.3, for cantilevers, of a square section in lock-in",
        "the fourth power in (E.17) is lost in the copy that was read",
        partial(en_approach_2, width=width, depth=depth, strouhal=strouhal),
    )
    handbook = [
        Comparison(
            f"Japanese handbook, {webs}",
            f"the Japanese wind-resistant design handbook with beta = {shape:g} ({webs}), smooth flow",
            "read in a handbook of bridge engineering",
            partial(japanese_handbook, width=width, depth=depth, shape=shape),
        )
        for shape, webs in ((1.0, "inclined webs"), (2.0, "vertical webs"))
    ]
    return (
        *([of_bd49] if deck else []),
        *([approach_1] if heaving and RECTANGLES[0] <= ratio <= RECTANGLES[1] else []),
        *([approach_2] if heaving and SQUARES[0] <= ratio <= SQUARES[1] else []),
        *(handbook if heaving and deck else []),
    )
