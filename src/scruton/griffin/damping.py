"""Damping ratio against amplitude, draw by draw: of the law with its departure, and of the trial function."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray, thin
from scruton.dynamics import rate as amplitude_rate
from scruton.dynamics.departure import COLUMNS, relative_drift
from scruton.envelope.damping import aerodynamic_damping, total_damping
from scruton.griffin.bands import trial_griffin_draws
from scruton.griffin.posterior import amplitude_range, draws_of, mass_damping_draws, printed_draws

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.results import Fit

GRID = 121
_DRAWS = 1000


def amplitude_grid(fit: "Fit", test: str) -> FloatArray:
    """Amplitudes that the test's transients went through, evenly spaced in the logarithm."""
    low, high = amplitude_range(fit.tree, test)
    stable = float(np.median(printed_draws(fit.tree, test)["a_star"]))
    # the noise floor of a growth is no amplitude
    low = max(low, 0.1 * stable)
    return np.geomspace(min(low, 0.9 * stable), max(high, 1.1 * stable), GRID)


def _printed(tree: "xr.DataTree", test: str) -> tuple[dict[str, FloatArray], FloatArray]:
    """At most 1000 draws of what is printed of a test, (S, 1) each, and the columns of its departure, (S, 1, COLUMNS).

    Of a fit that holds no departure, from a version that knew of none, the law alone.
    """
    printed = printed_draws(tree, test)
    kept = thin(printed["a_star"].size, _DRAWS)
    theta = np.zeros((kept.size, COLUMNS))
    if "departure" in tree:
        departure = tree["departure"].to_dataset().sel(test=test)
        kept, theta = departure["draw_number"].to_numpy(), departure["column"].to_numpy()
        if "rate_ratio" in departure:
            printed["relaxation_rate"] = printed["relaxation_rate"].copy()
            printed["relaxation_rate"][kept] *= departure["rate_ratio"].to_numpy()
    return {name: draws[kept, None] for name, draws in printed.items()}, theta[:, None]


def total_draws(tree: "xr.DataTree", test: str, amplitude: FloatArray) -> FloatArray:
    """Draws of the total damping ratio at `amplitude` (n,): Eq. (5) on the law and the departure from it; (S, n)."""
    return _total(tree, test, amplitude, *_printed(tree, test))


def _total(
    tree: "xr.DataTree", test: str, amplitude: FloatArray, printed: dict[str, FloatArray], theta: FloatArray
) -> FloatArray:
    a_star, rate, n = (printed[key] for key in ("a_star", "relaxation_rate", "n"))
    omega = 2 * np.pi * float(tree["constant_data"]["wind_frequency"].sel(test=test))
    drift = amplitude_rate(amplitude, a_star, rate, n) * relative_drift(amplitude / a_star, theta)
    return total_damping(amplitude, drift, omega)


def aerodynamic_draws(tree: "xr.DataTree", test: str, amplitude: FloatArray) -> FloatArray:
    """Draws of the aerodynamic damping ratio at `amplitude` (n,), Eq. (6) on the same; (S, n)."""
    printed, theta = _printed(tree, test)
    total, constant = _total(tree, test, amplitude, printed, theta), tree["constant_data"]
    omega, omega0 = (2 * np.pi * float(constant[key].sel(test=test)) for key in ("wind_frequency", "frequency"))
    return aerodynamic_damping(total, amplitude, partial(_structural, tree, test, printed), omega, omega0)


def _structural(tree: "xr.DataTree", test: str, printed: dict[str, FloatArray], amplitude: FloatArray) -> FloatArray:
    """Draws of xi_s(A), (S, n): one constant a draw, but where ring-downs show that it varies."""
    damping = printed["damping_ratio"]
    if "departure" not in tree or "structural_damping" not in tree["departure"]:
        return damping
    known = tree["departure"].to_dataset().sel(test=test)
    at, curve = known["structural_amplitude"].to_numpy(), known["structural_damping"].to_numpy()
    if np.isnan(at).any():
        return damping
    return np.asarray(damping * np.interp(amplitude, at, curve) / np.interp(printed["a_star"], at, curve))


def trial_draws(fit: "Fit", record: str, test: str) -> tuple[FloatArray, FloatArray]:
    """Amplitudes that a record went through (n,), and draws of the aerodynamic damping there by Eq. (4), (S, n).

    The Griffin curve of every draw is read the other way round: what damping an amplitude would be stable under,
    with the opposite sign. NaN where a draw does not reach; amplitudes that few draws reach are left out.
    """
    tree, curve = fit.tree, fit.front_ends[record].griffin.scruton_number
    constant = tree["constant_data"]
    turn = float(constant["frequency"].sel(test=test)) / float(constant["wind_frequency"].sel(test=test))
    factor = float(np.median(mass_damping_draws(tree, test)))
    low, high = float(np.nanmin(curve)), float(np.nanmax(curve))
    margin = 0.3 * (high - low)
    # dense near the stable amplitude, where damping hardly changes, and far out at small amplitude
    middle = float(np.median(draws_of(tree, "scruton_number", test)))
    steps = np.geomspace(1e-3, 1.0, GRID)
    sc = np.concatenate(
        [middle - (middle - low + margin) * steps[::-1], [middle], middle + (high - middle + margin) * steps]
    )
    amplitudes = trial_griffin_draws(tree, sc, record)
    damping = -sc * turn / factor
    grid = amplitude_grid(fit, test)
    draws = np.full((len(amplitudes), GRID), np.nan)
    for row, amplitude in zip(draws, amplitudes, strict=True):
        good = np.flatnonzero(np.isfinite(amplitude))
        order = good[np.argsort(amplitude[good], kind="stable")]
        if order.size > 1:
            row[:] = np.interp(grid, amplitude[order], damping[order], left=np.nan, right=np.nan)
    samples = constant["record"].to_numpy().astype(str) == record
    seen = tree["observed_data"]["amplitude"].to_numpy()[samples]
    reached = (np.isfinite(draws).mean(axis=0) > 0.9) & (grid >= seen.min()) & (grid <= seen.max())
    return grid[reached], draws[:, reached]
