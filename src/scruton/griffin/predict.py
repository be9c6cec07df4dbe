"""Predictive stable amplitude at a design Scruton number, laws weighed, with the discrepancy between settings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Quantity
from scruton.documents import as_json
from scruton.dynamics.laws import amplitude_ratio
from scruton.errors import InputError
from scruton.griffin.bands import INTERVALS, given_grid, quantiles
from scruton.griffin.coverage import coverage_of
from scruton.griffin.curves import SharedCurve, shared_curve, starts, stream, what_if
from scruton.griffin.discrepancy import STATED, one_rig, with_discrepancy
from scruton.griffin.posterior import (
    chosen_rig,
    draws_of,
    exponent_draws,
    peak_names,
    rig_mass_damping_draws,
    test_names,
    unit_of,
)
from scruton.griffin.remarks import of_the_damping, of_the_design, prior_speaks, unsettled_laws
from scruton.infer.joint import curve_remark, doubted_remark
from scruton.shown import shown
from scruton.stats.convergence import by_chain, monte_carlo_error

if TYPE_CHECKING:
    import xarray as xr


def _facts(one: "Prediction") -> Mapping[str, object]:
    low, high = one.interval(0.90)
    return {
        "scruton_number": f"{one.scruton_number:.4g}", "median": f"{one.median:.4g} {one.unit}",
        "interval90": f"{low:.4g} .. {high:.4g} {one.unit}", "dies": f"{one.dies:.1%}", "flags": len(one.flags),
    }  # fmt: skip


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Prediction:
    """Predictive stable amplitude at one design setting.

    Attributes
    ----------
    scruton_number, damping_ratio : float
        Design Sc and structural damping ratio; the median where one is uncertain.
    unit : str
        "A/D" or "rad".
    draws : (S,) array
        Predictive draws: zero where vibration dies, inf where no amplitude is stable.
    laws : mapping
        Weight of each law that the draws come from, by its label ("n=-1").
    rig : str
        Whose mass and air link Sc and damping ratio.
    extrapolation_indices : mapping
        Median x = (Sc' - Sc)/Sc_lambda from each peak test, by the laws that predict.
    discrepancy_sd : float
        Median standard deviation of ln(amplitude) of this setting about the shared curve.
    flags : tuple of str
        What the reader must know before trusting the numbers.
    chains : int
        Markov chains that the draws come from, one after the other.
    covered_by : int
        Peak tests whose transients run through the median amplitude of the curve.
    at_discrepancy : mapping
        From one rig: draws where tau is known to be so much, by tau.
    measured_weight : float
        Median weight of the measured damping beside the laws: 0 at a tested setting, and where no transient went.
    """

    scruton_number: float
    damping_ratio: float
    unit: str
    draws: FloatArray
    laws: Mapping[str, float]
    rig: str
    extrapolation_indices: Mapping[str, float]
    discrepancy_sd: float
    flags: tuple[str, ...]
    chains: int = 1
    covered_by: int = 1
    at_discrepancy: Mapping[float, FloatArray] = field(default_factory=dict)
    measured_weight: float = 0.0

    @property
    def extrapolation_index(self) -> float:
        """Median x from the nearest test: laws agree to 8 % for |x| < 0.2 and part beyond 0.3."""
        return min(self.extrapolation_indices.values(), key=abs)

    @property
    def median(self) -> float:
        """Median of the draws."""
        return float(quantiles(self.draws, [0.5])[0])

    @property
    def mean(self) -> float:
        """Mean of the draws; inf where some are."""
        return float(self.draws.mean())

    @property
    def sd(self) -> float:
        """Standard deviation of the draws; inf where some are."""
        return float(self.draws.std()) if np.isfinite(self.draws).all() else float("inf")

    @property
    def measured(self) -> str:
        """The weight of the measured damping beside the laws, in words; empty where it rounds to none."""
        weight = f"{self.measured_weight:.0%}"
        return "" if weight == "0%" else f"beside them the measured damping has a weight of {weight}"

    @property
    def dies(self) -> float:
        """Probability that there is no vibration."""
        return float(np.mean(self.draws == 0.0))

    @property
    def unbounded(self) -> float:
        """Fraction of draws in which no amplitude is stable."""
        return float(np.mean(~np.isfinite(self.draws)))

    def interval(self, probability: float) -> tuple[float, float]:
        """Equal-tailed interval of this probability."""
        low, high = quantiles(self.draws, [0.5 - probability / 2, 0.5 + probability / 2])
        return float(low), float(high)

    def error(self, probability: float) -> float:
        """Monte Carlo standard error of this quantile."""
        return monte_carlo_error(by_chain(self.draws, self.chains), probability)

    @property
    def dies_error(self) -> float:
        """Monte Carlo standard error of the probability that there is no vibration."""
        return monte_carlo_error(by_chain((self.draws == 0.0).astype(float), self.chains))

    def to_json(self) -> dict[str, Any]:
        """One entry of the list "predictions" that `scruton predict --json` writes.

        A number that does not exist (an upper bound where no amplitude is stable) is null.
        """
        amplitude = {key: getattr(self, key) for key in ("unit", "median", "mean", "sd")}
        stated = {f"{tau:.2f}": replace(self, draws=draws)._told() for tau, draws in self.at_discrepancy.items()}
        content: dict[str, Any] = as_json(
            {
                "sc": self.scruton_number,
                "damping_ratio": self.damping_ratio,
                "amplitude": amplitude | self._told(),
                **({"at_discrepancy": stated} if stated else {}),
                **{key: getattr(self, key) for key in ("rig", "laws", "measured_weight")},
                **{key: getattr(self, key) for key in ("extrapolation_index", "discrepancy_sd")},
                "amplitude_coverage": {"tests": self.covered_by, "of": len(self.extrapolation_indices)},
                "probability_no_vibration": self.dies,
                "probability_no_vibration_mcse": self.dies_error,
                "fraction_unbounded": self.unbounded,
                "flags": self.flags,
            }
        )
        return content

    def _told(self) -> dict[str, Any]:
        """Median and intervals of the draws, each with its Monte Carlo standard errors."""
        interval = {f"{p:.2f}": self.interval(p) for p in INTERVALS}
        errors = {f"{p:.2f}": [self.error(0.5 - p / 2), self.error(0.5 + p / 2)] for p in INTERVALS}
        return {"median": self.median, "interval": interval, "mcse": {"median": self.error(0.5), "interval": errors}}


def predict(
    tree: "xr.DataTree",
    *,
    scruton_number: float | None = None,
    damping_ratio: float | Quantity | None = None,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
) -> Prediction:
    """Predict the stable amplitude at a design Scruton number, or at a design damping ratio.

    Parameters
    ----------
    tree : xarray.DataTree
        Posterior of a fit with at least one test in wind.
    scruton_number : float, optional
        Design Sc; either this or `damping_ratio`.
    damping_ratio : float or Quantity, optional
        Design structural damping ratio; with an `sd` it is lognormal with that mean and standard deviation.
    rig : str, optional
        Whose mass and air turn a damping ratio into Sc and back; the first rig in wind if left out.
    law_n : float, optional
        Predict under this law alone. One that was not fitted starts from the test nearest to the design, with the
        stable amplitude and the relaxation that the fit found there.
    seed : int
        Seed of the new setting's discrepancy, of the choice between laws and of an uncertain design damping ratio;
        predictions of one seed share them, so that differences between designs are not noise.

    Raises
    ------
    InputError
        If there is no test in wind, the rig has none, or the design is not one number that makes sense.

    Notes
    -----
    The new setting lies off the curve that the peak tests share by a factor exp(tau z), as they do, with a tau that
    grows with the distance from what was tested (`scruton.griffin.coverage`).  Away from there the curve is led by the
    damping that transients showed, too (`SharedCurve.setting`).
    """
    if not test_names(tree):
        raise InputError("posterior", "", "no test in wind", "a fit of at least one test: still air says nothing of it")
    if (scruton_number is None) == (damping_ratio is None):
        raise InputError("prediction", "", "no design or two", "either scruton_number or damping_ratio")
    if seed < 0:
        raise InputError("prediction", "seed", str(seed), "a whole number, zero or more")
    name = chosen_rig(tree, rig)
    factor = rig_mass_damping_draws(tree, name)
    if scruton_number is not None:
        stated = _one_number(scruton_number, "scruton_number", "a finite number such as 30")
        sc = np.full(len(factor), stated)
        xi = float(stated / np.median(factor))
    else:
        assert damping_ratio is not None
        wanted = 'a ratio between 0 and 1, "0.003 +/- 0.001"'
        design = (
            damping_ratio
            if isinstance(damping_ratio, Quantity)
            else Quantity(_one_number(damping_ratio, "damping_ratio", wanted))
        )
        if not 0.0 < design.mean < 1.0 or (design.sd is not None and not design.sd >= 0.0):
            raise InputError("prediction", "damping_ratio", f"{design.mean} +/- {design.sd}", wanted)
        # a stream of its own: the discrepancy of a design is the same however its damping is stated
        xi_draws = design.draw(stream(seed, "design damping"), len(factor))
        sc, xi = xi_draws * factor, float(np.median(xi_draws))
    near, asked = float(np.median(sc)), what_if(tree, law_n)
    curve = shared_curve(tree, law_n=law_n, near=near, seed=seed)
    # A short run may have kept another number of draws of the rig than of the curve.
    sc_of_all = np.resize(sc, curve.n.size)[:, None]
    by_laws = curve.at(sc_of_all)
    setting = curve.setting(sc_of_all, by_laws)
    draws = (by_laws * np.exp(setting.off(_deviates(curve, seed))))[:, 0]
    assert curve.coverage is not None
    if asked:
        indices = {start.test: float(start.index(near)) for start in starts(tree)}
    else:
        tested = {test: np.median(draws_of(tree, "scruton_number", test)) for test in peak_names(tree)}
        indices = {test: float(np.median(curve.index(sc_of_all, number))) for test, number in tested.items()}
    prediction = Prediction(
        float(np.median(sc)), xi, unit_of(tree), draws, curve.laws, name, indices,
        float(np.median(setting.spread)), (), int(tree["campaign_posterior"].sizes["chain"]),
        curve.coverage.tests_at(float(np.median(by_laws * np.exp(setting.shift)))),
        measured_weight=float(np.median(setting.weight)),
    )  # fmt: skip
    at_discrepancy = {}
    for tau in STATED if one_rig(tree) else ():
        known = with_discrepancy(tree, tau)
        at_discrepancy[tau] = predictive_draws(known, sc_of_all, law_n=law_n, seed=seed)[:, 0]
    remarks = (
        *asked,
        *of_the_design(prediction),
        *of_the_damping(damping_ratio),
        *prior_speaks(tree),
        *curve_remark(tree),
        *doubted_remark(tree),
        *unsettled_laws(tree, curve.laws),
    )
    return replace(prediction, flags=remarks, at_discrepancy=at_discrepancy)


def _one_number(value: object, field: str, wanted: str) -> float:
    """A design as one finite number; InputError for what is none, or several."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number):
        raise InputError("prediction", field, repr(value), f"{wanted}; of several, one call each")
    return number


def predictive_draws(
    tree: "xr.DataTree", scruton_numbers: FloatArray | Sequence[float], *, law_n: float | None = None, seed: int = 0
) -> FloatArray:
    """Predictive stable amplitudes of a new setting, from all peak tests together.

    `scruton_numbers` is (n_sc,), or (S, n_sc) where the design is uncertain; the rest as of `predict`.

    Returns
    -------
    (S, n_sc) array
        Amplitudes: zero where vibration dies, inf where no amplitude is stable. The columns share their discrepancy,
        so each row is one whole Griffin curve.
    """
    sc = given_grid(scruton_numbers)
    curve = shared_curve(tree, law_n=law_n, seed=seed)
    z = _deviates(curve, seed)
    if not what_if(tree, law_n):
        return curve.predictive(sc, z)
    # It starts from the nearest test.
    middle = np.median(np.atleast_2d(sc), axis=0)
    nearest = np.argmin([np.abs(start.index(middle)) for start in starts(tree)], axis=0)
    draws = np.empty((z.size, nearest.size))
    for test in np.unique(nearest):
        there = nearest == test
        start = shared_curve(tree, law_n=law_n, near=float(middle[there][0]), seed=seed)
        draws[:, there] = start.predictive(sc[..., there], z)
    return draws


def _deviates(curve: SharedCurve, seed: int) -> FloatArray:
    """How far a new setting lies off the curve, standardised, (S,): predictions of one seed share it."""
    return stream(seed, "discrepancy").standard_normal(curve.n.size)


def single_draws(
    tree: "xr.DataTree", scruton_numbers: FloatArray | Sequence[float], test: str, *, seed: int = 0
) -> FloatArray:
    """Predictive stable amplitudes of a new setting from one test's own posterior under the reference law.

    The campaign model with that test alone: its amplitude and its strength of the wind, G = Sc_lambda + max(n, 0) Sc,
    each lie off the shared curve by their discrepancy, and the new setting's amplitude again.  Arguments and result as
    of `predictive_draws`.
    """
    group = tree["campaign_posterior"]
    n = exponent_draws(tree, test)
    tested, relaxation = (draws_of(tree, name, test) for name in ("scruton_number", "relaxation_scruton_number"))
    tau, kappa = (
        np.resize(np.asarray(group[name].isel(law=0).to_numpy(), dtype=float), tested.shape)
        for name in ("discrepancy_amplitude", "discrepancy_relaxation")
    )
    z = stream(seed, "single test").standard_normal((3, len(tested)))
    at_zero = np.maximum(n, 0.0) * tested
    shared = (relaxation + at_zero) * np.exp(-kappa * z[0]) - at_zero
    x = (np.atleast_1d(np.asarray(scruton_numbers, dtype=float)) - tested[:, None]) / shared[:, None]
    # For n > 0 the wind may be too weak for a vibration at the tested setting: such a draw says that it dies beyond.
    ratio = np.where(shared[:, None] > 0.0, amplitude_ratio(x, n[:, None]), np.where(x < 0.0, 0.0, np.inf))
    curve = draws_of(tree, "a_star", test)[:, None] * ratio
    growth = coverage_of(tree, [test]).growth(x, curve)
    return np.asarray(curve * np.exp(tau[:, None] * (z[1][:, None] - z[2][:, None] * growth)))
