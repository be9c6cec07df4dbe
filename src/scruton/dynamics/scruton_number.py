r"""Scruton numbers under every definition in use, and conversion between them.

They are all a mass ratio times a damping ratio and differ by constants and by the area that the mass is compared
with.  Written for heaving, with m* = 4m/(pi rho D^2) where the paper's introduction uses it:

=================== ============================================= =====================================
name                definition                                    source
=================== ============================================= =====================================
paper               4 pi m xi/(rho B D); torsion: J_m, B^3 D      Eqs. (7), (8); Hansen (2013)
scruton             pi m* xi/2 = 2 m xi/(rho D^2)                 Scruton (1963), Zdravkovich (1982)
stability           K_s = pi^2 m* xi = 4 pi m xi/(rho D^2)        Vickery and Watkins (1964)
skop-griffin        S_G = 2 pi^3 St^2 m* xi                       Skop and Griffin (1973), Skop (1974)
mass-damping        m* xi                                         Khalak and Williamson (1999)
eurocode            2 delta m/(rho D^2), delta = 2 pi xi          EN 1991-1-4, annex E
=================== ============================================= =====================================

Hansen's definition is printed without the damping ratio in the paper's introduction; it is meant with it.  The
Eurocode compares with the square of the cross-wind dimension, not with B D: its number is B/D times the paper's.
Scruton's differs from the stability parameter by a factor 2 pi.
"""

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray

DEFINITIONS = ("paper", "scruton", "stability", "skop-griffin", "mass-damping", "eurocode")


def floats(value: ArrayLike) -> FloatArray:
    """Numbers as the equations take them."""
    return np.asarray(value, dtype=np.float64)


def factor(
    definition: str, *, mass: ArrayLike, air_density: ArrayLike, width: ArrayLike, depth: ArrayLike,
    torsional: bool = False, strouhal: float | None = None,
) -> FloatArray:  # fmt: skip
    """Scruton number per unit of damping ratio.

    Parameters
    ----------
    definition : str
        One of `DEFINITIONS`.
    mass : array_like
        m [kg/m], or J_m [kg m^2/m] for torsion.
    air_density, width, depth : array_like
        rho [kg/m^3], B and D [m].
    torsional : bool
        Only the paper's definition has a torsional form.
    strouhal : float, optional
        St, for Skop and Griffin's.

    Raises
    ------
    ValueError
        Unknown definition, no Strouhal number where one is needed, or torsion where it is not defined.
    """
    if definition not in DEFINITIONS:
        raise ValueError(f"unknown definition of the Scruton number '{definition}'; one of {', '.join(DEFINITIONS)}")
    m, rho, B, D = (floats(value) for value in (mass, air_density, width, depth))
    if torsional and definition != "paper":
        raise ValueError(f"the definition '{definition}' has no torsional form; 'paper' has one (Eq. 8)")
    if definition == "paper":
        return 4.0 * np.pi * m / (rho * ((B**3 if torsional else B) * D))
    m_star = 4.0 * m / (np.pi * rho * D**2)
    if definition == "skop-griffin":
        if strouhal is None or not strouhal > 0:
            raise ValueError("the Skop-Griffin parameter needs a Strouhal number > 0")
        return 2.0 * np.pi**3 * strouhal**2 * m_star
    return {"scruton": np.pi / 2.0, "stability": np.pi**2, "mass-damping": 1.0, "eurocode": np.pi**2}[
        definition
    ] * m_star


def scruton_number(
    damping_ratio: ArrayLike, definition: str = "paper", *, mass: ArrayLike, air_density: ArrayLike,
    width: ArrayLike, depth: ArrayLike, torsional: bool = False, strouhal: float | None = None,
) -> FloatArray:  # fmt: skip
    """Scruton number of a damping ratio; see `factor` for the arguments."""
    per_unit = factor(
        definition, mass=mass, air_density=air_density, width=width, depth=depth, torsional=torsional, strouhal=strouhal
    )
    return per_unit * floats(damping_ratio)


def damping_ratio(
    number: ArrayLike, definition: str = "paper", *, mass: ArrayLike, air_density: ArrayLike,
    width: ArrayLike, depth: ArrayLike, torsional: bool = False, strouhal: float | None = None,
) -> FloatArray:  # fmt: skip
    """Damping ratio that a Scruton number stands for; see `factor` for the arguments."""
    per_unit = factor(
        definition, mass=mass, air_density=air_density, width=width, depth=depth, torsional=torsional, strouhal=strouhal
    )
    return floats(number) / per_unit


def convert(
    number: ArrayLike, source: str, target: str, *, width: ArrayLike = 1.0, depth: ArrayLike = 1.0,
    strouhal: float | None = None,
) -> FloatArray:  # fmt: skip
    """Turn a Scruton number of one definition into that of another (heaving)."""
    body = {"mass": 1.0, "air_density": 1.0, "width": width, "depth": depth, "strouhal": strouhal}
    ratio = factor(target, **body) / factor(source, **body)  # type: ignore[arg-type]
    return floats(number) * ratio
