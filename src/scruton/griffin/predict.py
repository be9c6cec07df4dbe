"""Predictive stable amplitude at a design Scruton number."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import FloatArray, Quantity
from scruton.errors import InputError
from scruton.griffin.bands import INTERVALS, X_TRUSTED, griffin_draws, index_draws, quantiles
from scruton.griffin.posterior import (
    chosen_rig,
    draws_of,
    law_of,
    peak_names,
    rig_mass_damping_draws,
    test_names,
    unit_of,
)

if TYPE_CHECKING:
    import xarray as xr


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
    law_n : float
        Exponent of the law.
    rig : str
        Whose mass and air link Sc and damping ratio.
    extrapolation_indices : mapping
        Median x = (Sc' - Sc)/Sc_lambda from each test used.
    weights : mapping
        Weight of each test used.
    discrepancy_sd : float
        Standard deviation of ln(amplitude) between settings.
    flags : tuple of str
        What the reader must know before trusting the numbers.
    """

    scruton_number: float
    damping_ratio: float
    unit: str
    draws: FloatArray
    law_n: float
    rig: str
    extrapolation_indices: Mapping[str, float]
    weights: Mapping[str, float]
    discrepancy_sd: float
    flags: tuple[str, ...]

    @property
    def extrapolation_index(self) -> float:
        """Median x from the nearest test: laws agree for |x| < 0.2 and part beyond 0.3."""
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

    def to_json(self) -> dict[str, Any]:
        """One entry of the list "predictions" that `scruton predict --json` writes.

        A number that does not exist (an upper bound where no amplitude is stable) is null.
        """
        return {
            "sc": _number(self.scruton_number),
            "damping_ratio": _number(self.damping_ratio),
            "amplitude": {
                "unit": self.unit,
                "median": _number(self.median),
                "mean": _number(self.mean),
                "sd": _number(self.sd),
                "interval": {f"{p:.2f}": [_number(one) for one in self.interval(p)] for p in INTERVALS},
            },
            "rig": self.rig,
            "law_n": self.law_n,
            "extrapolation_index": _number(self.extrapolation_index),
            "discrepancy_sd": self.discrepancy_sd,
            "probability_no_vibration": self.dies,
            "fraction_unbounded": self.unbounded,
            "weights": dict(self.weights),
            "flags": list(self.flags),
        }


def predict(
    tree: "xr.DataTree",
    *,
    scruton_number: float | None = None,
    damping_ratio: float | Quantity | None = None,
    rig: str | None = None,
    law_n: float | None = None,
    discrepancy_sd: float,
    seed: int = 0,
    tests: Sequence[str] | None = None,
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
        Exponent of the law that carries the tests to the design; the fitted one if left out.
    discrepancy_sd : float
        Standard deviation sigma_d of ln(amplitude) between a test's prediction and another setting's measurement.
    seed : int
        Seed of the discrepancy and of an uncertain design damping ratio; predictions of one seed share them, so that
        differences between designs are not noise.
    tests : sequence of str, optional
        Predict from these tests instead of all peak tests.

    Raises
    ------
    InputError
        If there is no test in wind, the rig has none, or the design is not one number that makes sense.

    Notes
    -----
    The peak tests share one Griffin curve. Each test lies off it by a factor exp(sigma_d/sqrt(2) z_j), and so does the
    new setting, so that one test misses another setting by sigma_d in all. With J equally informative tests

        var ln A' = sigma_d^2/(2 J) + sigma_d^2/2,

    and posterior uncertainty v_j of ln A'_j on top: the tests are weighed by 1/(v_j + sigma_d^2/2). Where some tests
    say that vibration dies (or that no amplitude is stable), as many draws die as these tests have weight.
    """
    if not test_names(tree):
        raise InputError("posterior", "", "no test in wind", "a fit of at least one test: still air says nothing of it")
    if (scruton_number is None) == (damping_ratio is None):
        raise InputError("prediction", "", "no design or two", "either scruton_number or damping_ratio")
    if seed < 0:
        raise InputError("prediction", "seed", str(seed), "a whole number, zero or more")
    if not discrepancy_sd >= 0.0:
        raise InputError("prediction", "discrepancy_sd", repr(discrepancy_sd), "a number, zero or more")
    name = chosen_rig(tree, rig)
    n = law_of(tree) if law_n is None else float(law_n)
    factor = rig_mass_damping_draws(tree, name)
    if scruton_number is not None:
        if not np.isfinite(scruton_number):
            raise InputError("prediction", "scruton_number", repr(scruton_number), "a finite number such as 30")
        sc = np.full(len(factor), float(scruton_number))
        xi = float(scruton_number / np.median(factor))
    else:
        assert damping_ratio is not None
        design = damping_ratio if isinstance(damping_ratio, Quantity) else Quantity(float(damping_ratio))
        # a stream of its own: the discrepancy of a design is the same however its damping is stated
        xi_draws = _damping_draws(design, len(factor), _stream(seed, "design damping"))
        sc, xi = xi_draws * factor, float(np.median(xi_draws))
    tests = peak_names(tree) if tests is None else tuple(tests)
    draws, weights = predictive_draws(tree, sc[:, None], law_n=n, discrepancy_sd=discrepancy_sd, seed=seed, tests=tests)
    indices = {test: float(np.median(index_draws(tree, sc[:, None], test))) for test in tests}
    found = Prediction(
        float(np.median(sc)), xi, unit_of(tree), draws[:, 0], n, name, indices,
        dict(zip(tests, map(float, weights[:, 0]), strict=True)), discrepancy_sd, (),
    )  # fmt: skip
    return Prediction(**(vars(found) | {"flags": _flags(found)}))


def predictive_draws(
    tree: "xr.DataTree",
    scruton_numbers: FloatArray | Sequence[float],
    *,
    law_n: float | None = None,
    discrepancy_sd: float,
    seed: int = 0,
    tests: Sequence[str] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Predictive stable amplitudes from all peak tests together, with the discrepancy between settings.

    Parameters
    ----------
    tree : xarray.DataTree
    scruton_numbers : (n_sc,) array, or (S, n_sc) where the design is uncertain
    law_n, discrepancy_sd, seed, tests
        As of `predict`.

    Returns
    -------
    draws : (S, n_sc) array
        Amplitudes; the columns share their discrepancies, so each row is one whole Griffin curve.
    weights : (J, n_sc) array
        Weight of each peak test.
    """
    grid = np.asarray(scruton_numbers, dtype=float)
    used = peak_names(tree) if tests is None else tests
    single = np.stack([griffin_draws(tree, grid, test, law_n=law_n)[0] for test in used])
    return pool(single, discrepancy_sd, _stream(seed, "discrepancy"))


def cross_predictions(tree: "xr.DataTree", *, discrepancy_sd: float, seed: int = 0) -> dict[str, Prediction]:
    """Predict every peak test at its own median Scruton number from the other peak tests alone.

    Returns
    -------
    dict of str to Prediction
        By test; empty where there are fewer than two peak tests. What a test itself found, or what was measured,
        should lie in the 90 % interval nine times in ten: if it does not, `discrepancy_sd` is too small.
    """
    peaks = peak_names(tree)
    return {
        test: predict(
            tree,
            scruton_number=float(np.median(draws_of(tree, "scruton_number", test))),
            discrepancy_sd=discrepancy_sd,
            seed=seed,
            tests=[other for other in peaks if other != test],
        )
        for test in peaks
        if len(peaks) > 1
    }


def pool(single: FloatArray, discrepancy_sd: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Pool the predictions (J, S, n) of J tests into predictive draws (S, n) and weights (J, n); see `predict`."""
    count, size, width = single.shape
    each = discrepancy_sd / np.sqrt(2.0)
    z: FloatArray = rng.standard_normal((count + 1, size))
    u = np.asarray(rng.random(size), dtype=np.float64)
    alive = np.isfinite(single) & (single > 0.0)
    log = np.log(np.where(alive, single, 1.0))
    weights = _weights(log, alive, each)
    # (J, S, n): the weight that a test has among those that give this draw an amplitude
    share = weights[:, None, :] * alive
    total = share.sum(axis=0)
    shifted = (log + each * z[:count, :, None]) * share
    with np.errstate(divide="ignore", invalid="ignore"):
        amplitude = np.exp(shifted.sum(axis=0) / total + each * z[count, :, None])
    dead, unbounded = ((weights[:, None, :] * where).sum(axis=0) for where in (single == 0.0, np.isinf(single)))
    vote = np.broadcast_to(u[:, None], (size, width))
    found = np.select([vote < dead, vote < dead + unbounded, total <= 0.0], [0.0, np.inf, 0.0], amplitude)
    return np.asarray(found), weights


def _stream(seed: int, purpose: str) -> np.random.Generator:
    """Random numbers of their own for each purpose, which nothing else that starts from the same seed shares."""
    return np.random.default_rng([seed, zlib.crc32(f"griffin: {purpose}".encode())])


def _weights(log: FloatArray, alive: np.ndarray, each: float) -> FloatArray:
    """Precision weights of the tests at every Scruton number, (J, n), that sum to one."""
    number = np.maximum(alive.sum(axis=1), 1)
    mean = (log * alive).sum(axis=1) / number
    variance = (((log - mean[:, None, :]) * alive) ** 2).sum(axis=1) / number
    precision = 1.0 / np.maximum(variance + each**2, 1e-12)
    return np.asarray(precision / precision.sum(axis=0))


def _damping_draws(design: Quantity, size: int, rng: np.random.Generator) -> FloatArray:
    if not 0.0 < design.mean < 1.0 or (design.sd is not None and not design.sd >= 0.0):
        raise InputError(
            "prediction",
            "damping_ratio",
            f"{design.mean} +/- {design.sd}",
            'a ratio between 0 and 1, "0.003 +/- 0.001"',
        )
    if not design.sd:
        return np.full(size, design.mean)
    log_variance = np.log1p((design.sd / design.mean) ** 2)
    return np.asarray(design.mean * np.exp(np.sqrt(log_variance) * rng.standard_normal(size) - 0.5 * log_variance))


def _flags(one: Prediction) -> tuple[str, ...]:
    flags = []
    place = f"Sc = {one.scruton_number:.4g}"
    if abs(one.extrapolation_index) > X_TRUSTED:
        flags.append(
            f"{place}: extrapolation index x = {one.extrapolation_index:.2f} from the nearest test; beyond "
            f"|x| = {X_TRUSTED:g} laws of aerodynamic damping part, and the interval holds under n = {one.law_n:g} only"
        )
    if one.scruton_number < 0.0:
        flags.append(f"{place}: a negative Scruton number has no physical meaning; it shows the trend only")
    if one.dies > 0.0:
        flags.append(f"{place}: no vibration in {one.dies:.1%} of the draws; they are counted as zero amplitude")
    if one.unbounded > 0.0:
        flags.append(
            f"{place}: no stable amplitude in {one.unbounded:.1%} of the draws; they are counted as infinitely large"
        )
    return tuple(flags)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
