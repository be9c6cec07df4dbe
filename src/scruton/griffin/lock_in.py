"""Stable amplitude against reduced velocity at any Scruton number, from the tests at all wind speeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.griffin.bands import INTERVALS, quantiles
from scruton.griffin.curves import stream
from scruton.griffin.posterior import names_of, unit_of
from scruton.griffin.thresholds import X_TRUSTED
from scruton.infer.smooth import log_ratio

if TYPE_CHECKING:
    import xarray as xr

POINTS = 61  # of a band


@dataclass(frozen=True, eq=False)
class LockInBand:
    """Predictive band of the stable amplitude against reduced velocity at one Scruton number.

    Attributes
    ----------
    velocity : (n,) array
        U/(f0 D) with the still-air frequency.
    median : (n,) array
        As of `GriffinBand`, and so are `intervals` and `unit`; NaN beyond what the tests reach.
    extrapolated : (n,) array of bool
        Beyond the outermost test, or |x| > 0.3 from the nearest tested Scruton number.
    """

    scruton_number: float
    velocity: FloatArray
    median: FloatArray
    intervals: Mapping[float, FloatArray]
    unit: str
    extrapolated: np.ndarray


def has_speeds(tree: "xr.DataTree") -> bool:
    """Whether the fit has tests or sweeps at enough wind speeds."""
    return "speeds" in tree


def lock_in_velocities(tree: "xr.DataTree", rig: str | None = None) -> FloatArray:
    """Reduced velocities worth drawing, (n_v,): half a length beyond the tests, not past one outside lock-in.

    Raises
    ------
    InputError
        If the fit has no tests at three wind speeds, or there is no such rig.
    """
    return np.linspace(*_range(tree, rig), POINTS)


def lock_in_draws(
    tree: "xr.DataTree",
    scruton_number: float,
    velocities: FloatArray | Sequence[float] | None = None,
    *,
    rig: str | None = None,
    seed: int = 0,
) -> FloatArray:
    """Predictive stable amplitudes of a new setting against reduced velocity.

    Parameters
    ----------
    tree : xarray.DataTree
        With the group `speeds`.
    scruton_number : float
        Sc of the setting.
    velocities : (n_v,) array, optional
        U/(f0 D); those of `lock_in_velocities` if left out.
    rig : str, optional
        A tested rig, whose lock-in sits where its tests put it; a new rig's may sit elsewhere.
    seed : int
        Of the discrepancy and of a new rig's shift; settings of one seed share them.

    Returns
    -------
    draws : (S, n_v) array
        A/D or rad: zero where vibration dies, inf where no amplitude is stable, NaN beyond the speeds worth drawing.
        A row is one setting: its discrepancy exp(tau z) is the same at all speeds.

    Raises
    ------
    InputError
        If the fit has no tests at three wind speeds, the Scruton number is not finite, or there is no such rig.

    Notes
    -----
    A'(v) = A(v') (1 - n x)^(1/n) exp(tau z) with v' = v exp(s_v delta), x = (Sc' - Sc_ref)/(G(v') - n Sc_ref).
    """
    group = _group(tree)
    if not np.isfinite(scruton_number):
        raise InputError("prediction", "scruton_number", repr(scruton_number), "a finite number such as 30")
    v = lock_in_velocities(tree, rig) if velocities is None else np.asarray(velocities, dtype=float)
    z, new = stream(seed, "lock-in").standard_normal((2, group.sizes["draw"]))
    if rig is None:
        shift = _flat(group, "scale_shift") * new
    else:
        shift = _flat(group, "shift").reshape(-1, group.sizes["rig"])[:, _rig(tree, rig)]
    f, h = _at(group, v * np.exp(shift)[:, None])
    n, reference = float(group.attrs["law_n"]), float(group.attrs["reference_scruton_number"])
    discrepancy = (_flat(group, "discrepancy_amplitude") * z)[:, None]
    draws: FloatArray = np.exp(f + log_ratio(h, np.asarray(float(scruton_number)), reference, n) + discrepancy)
    low, high = _range(tree, rig)
    return np.where((v < low * (1 - 1e-9)) | (v > high * (1 + 1e-9)), np.nan, draws)


def lock_in_band(
    tree: "xr.DataTree",
    scruton_number: float,
    velocities: FloatArray | Sequence[float] | None = None,
    *,
    rig: str | None = None,
    seed: int = 0,
) -> LockInBand:
    """Summarise `lock_in_draws`, with the same parameters, into a band."""
    group = _group(tree)
    v = lock_in_velocities(tree, rig) if velocities is None else np.asarray(velocities, dtype=float)
    draws = lock_in_draws(tree, scruton_number, v, rig=rig, seed=seed)
    known = ~np.isnan(draws[0])

    def at(*probability: float) -> FloatArray:
        points = np.full((len(probability), v.size), np.nan)
        points[:, known] = quantiles(draws[:, known], probability)
        return points

    beyond = (v < group.attrs["tested_low"] * (1 - 1e-9)) | (v > group.attrs["tested_high"] * (1 + 1e-9))
    # The median extrapolation index from the nearest tested Scruton number at each speed.
    tested = group["point_scruton_number"].to_numpy()
    nearest = float(tested[np.argmin(np.abs(tested - scruton_number))])
    _, h = _at(group, np.broadcast_to(v, (group.sizes["draw"], v.size)))
    relaxation = np.median(np.exp(h) - float(group.attrs["law_n"]) * nearest, axis=0)
    with np.errstate(divide="ignore"):
        x = np.nan_to_num((scruton_number - nearest) / np.maximum(relaxation, 0.0), nan=0.0)
    intervals = MappingProxyType({p: at(0.5 - p / 2, 0.5 + p / 2) for p in INTERVALS})
    far = beyond | (np.abs(x) > X_TRUSTED)
    return LockInBand(float(scruton_number), v, at(0.5)[0], intervals, unit_of(tree), far)


def _rig(tree: "xr.DataTree", rig: str) -> int:
    known = names_of(_group(tree)["rig"])
    if rig not in known:
        raise InputError("posterior", "rig", f"'{rig}'", f"a rig with tests within lock-in, one of: {', '.join(known)}")
    return known.index(rig)


def _range(tree: "xr.DataTree", rig: str | None) -> tuple[float, float]:
    group = _group(tree)
    if rig is None:
        return float(group.attrs["drawn_low"]), float(group.attrs["drawn_high"])
    low, high = (float(group[key].to_numpy()[_rig(tree, rig)]) for key in ("rig_low", "rig_high"))
    return low, high


def _at(group: Any, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Draws of (ln A, ln G), interpolated at speeds (S, n_v) of their own; held at the ends of the grid."""
    grid = _flat(group, "velocity")
    place = np.clip((v - grid[0]) / (grid[1] - grid[0]), 0.0, grid.size - 1.0)
    i = np.minimum(place.astype(int), grid.size - 2)
    first, second = (
        (1.0 - (place - i)) * np.take_along_axis(ln, i, axis=1) + (place - i) * np.take_along_axis(ln, i + 1, axis=1)
        for ln in (_flat(group, key).reshape(-1, grid.size) for key in ("ln_amplitude", "ln_relaxation"))
    )
    return first, second


def _flat(group: Any, key: str) -> FloatArray:
    return np.asarray(group[key].to_numpy(), dtype=float).reshape(-1)


def _group(tree: "xr.DataTree") -> Any:
    if not has_speeds(tree):
        raise InputError(
            "posterior", "speeds", "no amplitude against reduced velocity",
            "tests or sweeps within lock-in at three reduced velocities or more",
        )  # fmt: skip
    return tree["speeds"]
