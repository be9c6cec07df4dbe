"""What this room reads from the tree of a fit: draws by test, peak tests, and whose mass a rig has."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.infer.joint import joint_draws

if TYPE_CHECKING:
    import xarray as xr


def names_of(values: "xr.DataTree | xr.DataArray") -> list[str]:
    """Names along a coordinate, or in a variable."""
    return [str(name) for name in values.to_numpy()]


def test_names(tree: "xr.DataTree") -> tuple[str, ...]:
    """Names of the tests in wind, in the campaign's order; empty for a still-air campaign."""
    return tuple(names_of(tree["posterior"]["test"])) if "posterior" in tree else ()


def peak_names(tree: "xr.DataTree") -> tuple[str, ...]:
    """Names of the peak tests, which share one Griffin curve; all tests where none is marked."""
    names = test_names(tree)
    peak = [name for name in names if bool(tree["constant_data"]["peak"].sel(test=name))]
    return tuple(peak) or names


def draws_of(tree: "xr.DataTree", name: str, test: str) -> FloatArray:
    """Draws of one parameter of one test, (S,), chain after chain.

    Raises
    ------
    InputError
        If the tree holds no such test.
    """
    known = test_names(tree)
    if test not in known:
        raise InputError("posterior", "test", f"'{test}'", f"one of: {', '.join(known) or 'none, still air only'}")
    return np.asarray(tree["posterior"][name].sel(test=test).to_numpy(), dtype=float).reshape(-1)


def printed_draws(tree: "xr.DataTree", test: str) -> dict[str, FloatArray]:
    """Draws of what is printed of a test, (S,) each by name, and of the exponent n.

    Of a peak test those of the joint posterior that predicts, laws mixed by their weights; of others those of its own.
    """
    joint = joint_draws(tree)
    if test in joint.tests:
        return {**joint.tests[test], "n": joint.shared["n"]}
    own = {str(name): draws_of(tree, str(name), test) for name in tree["posterior"].data_vars}
    return own | {"n": exponent_draws(tree, test)}


def amplitude_range(tree: "xr.DataTree", test: str) -> tuple[float, float]:
    """Lowest and highest amplitude that a test has seen: of its transients, its stable amplitude among them."""
    constant, stable = tree["constant_data"], float(np.median(draws_of(tree, "a_star", test)))
    ends = [float(constant[name].sel(test=test)) for name in ("transient_low", "transient_high") if name in constant]
    return float(np.nanmin([stable, *ends])), float(np.nanmax([stable, *ends]))


def motion_of(tree: "xr.DataTree") -> Motion:
    """Heaving or torsional."""
    return Motion(str(tree["constant_data"]["motion"].to_numpy()))


def exponent_draws(tree: "xr.DataTree", test: str) -> FloatArray:
    """Draws of the exponent n that a test's posterior was sampled under, (S,): the reference law's unless free."""
    if "law_exponent" in tree["posterior"]:
        return draws_of(tree, "law_exponent", test)
    return np.full(draws_of(tree, "a_star", test).shape, float(tree["constant_data"]["law_n"]))


def unit_of(tree: "xr.DataTree") -> str:
    """Unit of amplitudes: A/D or rad."""
    return "A/D" if motion_of(tree) is Motion.HEAVING else "rad"


def chosen_rig(tree: "xr.DataTree", rig: str | None) -> str:
    """Name of the rig meant: the first that hung in the wind where none is named.

    Raises
    ------
    InputError
        If the named rig has no test: its mass in the wind is not known then.
    """
    used = names_of(tree["constant_data"]["rig"])
    order = names_of(tree["rig_posterior"]["rig"]) if "rig_posterior" in tree else used
    in_wind = [name for name in dict.fromkeys([*order, *used]) if name in used]
    if rig is not None and rig not in in_wind:
        raise InputError("posterior", "rig", f"'{rig}'", f"a rig with a test in wind, one of: {', '.join(in_wind)}")
    return rig or in_wind[0]


def mass_damping_draws(tree: "xr.DataTree", test: str) -> FloatArray:
    """Draws of Scruton number per unit of damping ratio, 4 pi m/(rho B D) or 4 pi J/(rho B^3 D), (S,)."""
    return draws_of(tree, "scruton_number", test) / draws_of(tree, "damping_ratio", test)


def rig_mass_damping_draws(tree: "xr.DataTree", rig: str) -> FloatArray:
    """The same for a rig, in the air of its first test, (S,)."""
    data = tree["constant_data"]
    return mass_damping_draws(tree, names_of(data["test"])[names_of(data["rig"]).index(rig)])
