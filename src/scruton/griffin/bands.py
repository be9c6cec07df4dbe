"""Credible bands of the Griffin curve, from the posterior of the law and from that of the trial function."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.laws import amplitude_ratio, extrapolation_index
from scruton.envelope.damping import aerodynamic_damping, griffin_curve, total_damping
from scruton.errors import InputError
from scruton.griffin.curves import portions, shared_curve
from scruton.griffin.posterior import draws_of, exponent_draws, mass_damping_draws, names_of, peak_names, unit_of
from scruton.griffin.thresholds import ENOUGH_DRAWS, X_TRUSTED
from scruton.shown import shown

if TYPE_CHECKING:
    import xarray as xr

INTERVALS = (0.50, 0.90, 0.95)
_BEYOND = 0.5  # the trial function is drawn, dashed, for this part of the record's length before and after it
_TIMES = 400
_TRIAL_DRAWS = 1000
_AT_A_TIME = 64  # Scruton numbers of a band: of 8,192 draws a whole figure's take 130 MB on the way


def _facts(one: "GriffinBand") -> Mapping[str, object]:
    low, high = one.scruton_number[[0, -1]] if one.scruton_number.size else (np.nan, np.nan)
    return {
        "label": one.label,
        "scruton_number": f"{low:.4g} .. {high:.4g}",
        "points": one.median.size,
        "unit": one.unit,
    }


@shown(_facts)
@dataclass(frozen=True, eq=False)
class GriffinBand:
    """Credible band of the stable amplitude against the Scruton number.

    Attributes
    ----------
    scruton_number : (n,) array
        Sc; negative values are kept: there the air would have to be met by negative structural damping.
    median : (n,) array
        Stable amplitude (or its reciprocal): zero where vibration dies, inf where no amplitude is stable, NaN
        where too few draws say anything.
    intervals : mapping
        Equal-tailed intervals by probability (0.50, 0.90, 0.95), each a (2, n) array.
    unit : str
        "A/D" or "rad"; "D/A" or "1/rad" for the reciprocal.
    label : str
        The test or record that it comes from.
    extrapolated : (n,) array of bool
        |x| > 0.3 by the laws that predict.
    """

    scruton_number: FloatArray
    median: FloatArray
    intervals: Mapping[float, FloatArray]
    unit: str
    label: str
    extrapolated: np.ndarray

    def reciprocal(self) -> "GriffinBand":
        """The same band as D/A (or 1/rad), in which the paper's law is a straight line."""
        units = {"A/D": "D/A", "D/A": "A/D", "rad": "1/rad", "1/rad": "rad"}
        with np.errstate(divide="ignore"):
            intervals = MappingProxyType({p: 1.0 / ends[::-1] for p, ends in self.intervals.items()})
            return replace(self, median=1.0 / self.median, intervals=intervals, unit=units[self.unit])


def index_draws(tree: "xr.DataTree", scruton_numbers: FloatArray, test: str) -> FloatArray:
    """Draws of the extrapolation index x = (Sc' - Sc)/Sc_lambda by what one test says alone, (S, n_sc).

    `scruton_numbers` is (n_sc,), or (S, n_sc) where the design Scruton number is itself uncertain.
    """
    sc, relaxation = (draws_of(tree, name, test)[:, None] for name in ("scruton_number", "relaxation_scruton_number"))
    return extrapolation_index(np.atleast_1d(scruton_numbers), sc, relaxation)


def predicting_index(tree: "xr.DataTree", scruton_numbers: FloatArray, test: str) -> FloatArray:
    """Median extrapolation index from one test by the laws that predict, as a prediction has it, (n_sc,).

    By the test's own law where a tree holds no posterior of the campaign.
    """
    if "campaign_posterior" not in tree:
        return np.asarray(np.median(index_draws(tree, scruton_numbers, test), axis=0))
    tested = float(np.median(draws_of(tree, "scruton_number", test)))
    curve = shared_curve(tree)
    return np.array([float(np.median(curve.index(sc, tested))) for sc in scruton_numbers])


def given_grid(scruton_numbers: FloatArray | Sequence[float]) -> FloatArray:
    """Scruton numbers as an array; InputError where there are none, of which a curve would say nothing but NaN."""
    grid = np.atleast_1d(np.asarray(scruton_numbers, dtype=float))
    if not grid.size:
        raise InputError("scruton_numbers", "", "no number", "one or more")
    return grid


def griffin_draws(
    tree: "xr.DataTree",
    scruton_numbers: FloatArray | Sequence[float],
    test: str | None = None,
    *,
    law_n: float | None = None,
) -> FloatArray:
    """Stable amplitudes that one test's posterior predicts at other Scruton numbers.

    Parameters
    ----------
    tree : xarray.DataTree
        Posterior of a fit.
    scruton_numbers : (n_sc,) array, or (S, n_sc)
        Sc'; negative values are allowed.
    test : str, optional
        The first peak test if left out.
    law_n : float, optional
        Exponent of the law that carries the posterior to other Scruton numbers; the fitted one if left out.

    Returns
    -------
    (S, n_sc) array
        A/D or rad; zero where vibration dies, inf where no amplitude is stable.

    Raises
    ------
    InputError
        If there is no such test, or no Scruton number.

    Notes
    -----
    A'(Sc') = a_star (1 - n x)^(1/n) with x = (Sc' - Sc)/Sc_lambda and Sc_lambda = Sc lambda/(omega0 xi_s), the
    Scruton number that one relaxation rate is worth; for n = -1 this is Eq. (11).
    """
    grid = given_grid(scruton_numbers)
    name = peak_names(tree)[0] if test is None else test
    n = exponent_draws(tree, name)[:, None] if law_n is None else law_n
    return np.asarray(draws_of(tree, "a_star", name)[:, None] * amplitude_ratio(index_draws(tree, grid, name), n))


def band(
    scruton_numbers: FloatArray, draws: FloatArray, unit: str, label: str, extrapolated: np.ndarray | None = None
) -> GriffinBand:
    """Summarise draws (S, n) at `scruton_numbers` (n,) into a band; NaN draws say nothing and are left out."""
    return _band(scruton_numbers, _points(draws), unit, label, extrapolated)


def band_along(
    scruton_numbers: FloatArray,
    draws_at: Callable[[FloatArray], FloatArray],
    unit: str,
    label: str,
    extrapolated: np.ndarray | None = None,
) -> GriffinBand:
    """The same of draws that are computed for some of the Scruton numbers (k,) at a time, (S, k), and let go."""
    some = portions(len(scruton_numbers), _AT_A_TIME)
    points = np.concatenate([_points(draws_at(scruton_numbers[part])) for part in some], axis=1)
    return _band(scruton_numbers, points, unit, label, extrapolated)


def _points(draws: FloatArray) -> FloatArray:
    """Median of draws (S, n), and both ends of each of `INTERVALS`, (1 + 2 intervals, n)."""
    probability = [0.5, *(0.5 + side * p / 2 for p in INTERVALS for side in (-1, 1))]
    points, finite = np.full((len(probability), draws.shape[1]), np.nan), np.isfinite(draws).all(axis=0)
    if finite.any():  # the common case, all columns at once
        points[:, finite] = quantiles(draws[:, finite], probability)
    known = ~np.isnan(draws)
    for i in np.flatnonzero(~finite & (known.mean(axis=0) >= ENOUGH_DRAWS)):
        points[:, i] = quantiles(draws[known[:, i], i], probability)
    return points


def _band(
    scruton_numbers: FloatArray, points: FloatArray, unit: str, label: str, extrapolated: np.ndarray | None
) -> GriffinBand:
    outside = np.zeros(len(scruton_numbers), dtype=bool) if extrapolated is None else extrapolated
    intervals = MappingProxyType({p: points[2 * k + 1 : 2 * k + 3] for k, p in enumerate(INTERVALS)})
    return GriffinBand(np.asarray(scruton_numbers, dtype=float), points[0], intervals, unit, label, outside)


def quantiles(draws: FloatArray, probability: Sequence[float]) -> FloatArray:
    """Quantiles of draws that may hold inf: no interpolation then, which would turn inf into NaN."""
    method: Literal["linear", "inverted_cdf"] = "linear" if np.isfinite(draws).all() else "inverted_cdf"
    return np.asarray(np.quantile(draws, probability, axis=0, method=method))


def griffin_band(
    tree: "xr.DataTree",
    scruton_numbers: FloatArray | Sequence[float],
    test: str | None = None,
    *,
    law_n: float | None = None,
) -> GriffinBand:
    """Credible band of the Griffin curve from one test; parameters as of `griffin_draws`."""
    grid = given_grid(scruton_numbers)
    name = peak_names(tree)[0] if test is None else test
    x = predicting_index(tree, grid, name)
    draws_at = partial(griffin_draws, tree, test=name, law_n=law_n)
    return band_along(grid, draws_at, unit_of(tree), name, np.abs(x) > X_TRUSTED)


def trial_griffin_draws(tree: "xr.DataTree", scruton_numbers: FloatArray | Sequence[float], record: str) -> FloatArray:
    """Griffin curve of the paper's procedure, one for every draw of the trial function's constants.

    Parameters
    ----------
    tree, scruton_numbers
        As of `griffin_draws`.
    record : str
        Name of a growth or decay record.

    Returns
    -------
    (S, n_sc) array
        Amplitude (A/D or rad) at each Scruton number, of at most 1000 draws; NaN where a curve does not reach it.

    Raises
    ------
    InputError
        If no trial function was fitted to such a record, or there is no Scruton number.

    Notes
    -----
    Eq. (4) gives A(t), Eq. (5) the total and Eq. (6) the aerodynamic damping, and xi_s = -xi_aero omega/omega0,
    with its sign, is what would make that amplitude stable; Eqs. (7) and (8) turn it into Sc.
    """
    group = tree.get("trial_function")
    known = [] if group is None else names_of(group["record"])
    if group is None or record not in known:
        raise InputError("posterior", "record", f"'{record}'", f"one of: {', '.join(known) or 'none was fitted'}")
    constant = tree["constant_data"]
    samples = constant["record"].to_numpy().astype(str) == record
    time = constant["time"].to_numpy()[samples]
    test = str(constant["record_test"].to_numpy()[samples][0])
    constants = {name: group[name].sel(record=record).to_numpy().reshape(-1) for name in "abcd"}
    size = min(len(draws) for draws in (constants["a"], draws_of(tree, "damping_ratio", test)))
    pick = np.unique(np.linspace(0, size - 1, min(size, _TRIAL_DRAWS)).astype(int))
    a, b, c, d = (constants[name][pick, None] for name in "abcd")
    length = time[-1] - time[0]
    t = np.linspace(-_BEYOND * length, (1.0 + _BEYOND) * length, _TIMES)
    slow, fast = a * np.exp(b * t), c * np.exp(d * t)
    amplitude, rate = slow + fast, b * slow + d * fast

    omega, omega0 = (2.0 * np.pi * float(constant[k].sel(test=test)) for k in ("wind_frequency", "frequency"))
    xi_s = draws_of(tree, "damping_ratio", test)[pick, None]
    aero = aerodynamic_damping(total_damping(amplitude, rate, omega), amplitude, lambda _: xi_s, omega, omega0)
    curve = griffin_curve(aero, amplitude, 1.0, omega, omega0)
    sc = mass_damping_draws(tree, test)[pick, None] * curve.scruton_number
    grid = given_grid(scruton_numbers)
    return np.stack([_read(grid, numbers, values) for numbers, values in zip(sc, amplitude, strict=True)])


def _read(grid: FloatArray, scruton_number: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Amplitude at each Sc of the grid along one curve, NaN beyond its ends.

    Interpolated in 1/A, which is linear in Sc under the paper's law: chords of A itself would lie above the curve.
    """
    good = np.isfinite(scruton_number) & (amplitude > 0.0)
    if good.sum() < 2:
        return np.full(grid.shape, np.nan)
    order = np.argsort(scruton_number[good], kind="stable")
    reciprocal = 1.0 / amplitude[good][order]
    return 1.0 / np.interp(grid, scruton_number[good][order], reciprocal, left=np.nan, right=np.nan)
