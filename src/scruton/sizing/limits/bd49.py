"""BD 49/01, Design Rules for Aerodynamic Effects on Bridges: the dynamic sensitivity parameter K_D."""

from math import inf

from scruton.campaign.units import Dimension
from scruton.sizing.limits.rule import Rule, of_edge

COMFORT_SPEED = 20.0  # m/s, of V_cr: in a faster wind nobody walks (3.1.3, note 2)

# Table 1: motion by K_D up to so many mm/s^2.  The table prints ranges with gaps between them (2 to 3, 5 to 10): what
# lies in a gap is named after both neighbours.
CLASSES = {
    "only just perceptible": 1.0,
    "acceptable": 2.0,
    "acceptable to tolerable": 3.0,
    "tolerable": 5.0,
    "tolerable to unpleasant": 10.0,
    "unpleasant": 30.0,
    "pedestrian discomfort possible": inf,
}

# Table 1: static load alpha [%] over K_D [mm/s^2], the upper bound by class of bridge; and up to what it is neglected.
LOAD, LOAD_SIMPLY_SUPPORTED = 0.4, 2.5
NEGLIGIBLE_LOAD = 4.0


def critical_speed(frequency: float, width: float, depth: float) -> float:
    """Critical wind speed for vortex excitation V_cr [m/s] (2.1.1.2), the lower of the two that types of deck have.

    That is of trusses and plate girders (types 2, 5 and 6), with the whole width in the place of the effective one:
    6.5 f d up to b/d = 5, f d (0.7 b/d + 3) from there, 10 f d from b/d = 10 on.
    """
    return frequency * depth * min(max(6.5, 0.7 * width / depth + 3.0), 10.0)


def motion_class(kd: float) -> str:
    """Class of Table 1 that K_D [mm/s^2] is in."""
    return next(name for name, top in CLASSES.items() if kd <= top)


def static_load(kd: float, *, simply_supported: bool = False) -> float:
    """Equivalent static load alpha [%], an upper bound; negligible below 4 to 5 %.

    Parameters
    ----------
    kd : float
        [mm/s^2].
    simply_supported : bool
        A simply supported highway bridge, or a concrete footbridge.
    """
    return (LOAD_SIMPLY_SUPPORTED if simply_supported else LOAD) * kd


def _fast(frequency: float, width: float, depth: float) -> str:
    speed = critical_speed(frequency, width, depth)
    if speed < COMFORT_SPEED:
        return ""
    return f"it is asked for only where V_cr lies below {COMFORT_SPEED:g} m/s, and here V_cr is {speed:.3g} m/s or more"


def _reading(kd: float) -> str:
    load, simple = static_load(kd), static_load(kd, simply_supported=True)
    small = ", negligible" if load < NEGLIGIBLE_LOAD else ""
    return (
        f"K_D = {kd:.3g} mm/s^2, {motion_class(kd)} (Table 1); static load alpha = {load:.3g} %{small} "
        f"({simple:.3g} % for simply supported highway bridges and concrete footbridges)"
    )


RULES = (
    Rule(
        "kd",
        "BD 49/01: K_D = f^2 y at most 30 mm/s^2, the top of \"unpleasant\" (torsion: at the edge)",
        "BD 49/01 (Highways Agency, 2001), 3.1.3 and Table 1: above 30 mm/s^2, at a critical speed below 20 m/s, it "
        "asks for analysis",
        "Classes, load alpha and V_cr were read in a public copy whose Table 1 has lost its lines: confirm its ranges, "
        "and the clause in CD 363, which superseded BD 49/01. 30 mm/s^2 (0.12 g) is where pedestrians complain, not "
        'what a new bridge is designed to: that is "kd: acceptable" or "kd: tolerable".',
        30.0,
        Dimension("K_D = f^2 y, an acceleration over 4 pi^2", "mm/s^2", 30.0),
        of_edge(lambda f, kd: 1e-3 * kd / f**2),
        _fast,
        {name: kd for name, kd in CLASSES.items() if kd < inf},
        _reading,
    ),
)  # fmt: skip
