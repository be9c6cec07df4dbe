r"""What moved the posterior: the prior, the still-air records, the records in wind, and which of them.

Power scaling (Kallioinen et al., Statistics and Computing 34, 57, 2024) raises one factor of the posterior to a power
near one and asks how far each parameter's distribution moves: by the cumulative Jensen-Shannon distance, per doubling
of the power.  Records are left out by importance weights, smoothed by a Pareto distribution whose shape k says whether
the weights can be trusted (Vehtari et al., JMLR 25, 2024).
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.infer.cards import ModelCard
from scruton.infer.joint import FORCES
from scruton.infer.models import NOISE
from scruton.infer.result_schema import EXAMINED_LIKELIHOOD
from scruton.infer.thresholds import BARELY_MOVED, NOT_MOVED, SENSITIVE, TRUSTED_KHAT
from scruton.stats import pareto

if TYPE_CHECKING:
    import xarray as xr

ALPHAS = (0.99, 1.01)
_ORDERS = 8  # in which weights that have nothing to do with a parameter are tried on it
CONFLICT, WEAK, STILL_AIR, FINE = "prior-data conflict", "weak likelihood", "from still air", "-"
STEADY = "(steady records)"
# Parameters of a test beside the coordinates that have a prior of their own.
SCALED = ("a_star", "relaxation_rate", "Y1", "epsilon", "damping_ratio")
PRIOR_OF = {"a_star": "stable_amplitude", "relaxation_rate": "relaxation_ratio"}
PRIOR_OF |= {name: name for name in (*NOISE, "damping_ratio", "law_exponent")}
# Parameters of the campaign model, and the priors of the card that they have.
SHARED_PRIOR = {
    "reference_amplitude": "stable_amplitude",
    "reference_relaxation": "relaxation_ratio",
    "discrepancy_amplitude": "discrepancy_amplitude",
    "discrepancy_relaxation": "discrepancy_relaxation",
}


@dataclass(frozen=True)
class Scaling:
    """How far one parameter's posterior follows a factor that is raised to a power.

    Attributes
    ----------
    test, parameter : str
    prior, still_air, likelihood : float
        Sensitivity to the card's priors of amplitude, relaxation and n together, to the prior of the damping ratio,
        which is what the records in still air say, and to the records in wind.  NaN where the fit does not hold what it
        takes.
    diagnosis : str
    noise : float
        Sensitivity to the priors that are meant to speak, of noise and discrepancies: shown, and no doubt.
    """

    test: str
    parameter: str
    prior: float
    still_air: float
    likelihood: float
    diagnosis: str
    noise: float = float("nan")


@dataclass(frozen=True)
class Moved:
    """How much narrower than its prior a parameter's posterior is, in the coordinate in which it is sampled.

    Attributes
    ----------
    test : str
        Empty for the campaign model.
    parameter : str
    prior_sd, posterior_sd, ratio : float
        Standard deviations, of the logarithm for positive parameters, and posterior over prior.
    verdict : str
    """

    test: str
    parameter: str
    prior_sd: float
    posterior_sd: float
    ratio: float
    verdict: str


@dataclass(frozen=True)
class Influence:
    """How far the posterior of one parameter moves when one record is left out.

    Attributes
    ----------
    test, record, parameter : str
    shift : float
        Of the mean of the logarithm, in standard deviations of the posterior with all records.
    widening : float
        Standard deviation without the record over that with it.
    z : float
        Disagreement of the record with the others: the shift over what its information would explain; NaN where the
        record adds too little to tell.
    khat : float
        Shape of the weights' tail; above `TRUSTED_KHAT` the reweighting cannot tell what a refit would.
    """

    test: str
    record: str
    parameter: str
    shift: float
    widening: float
    z: float
    khat: float

    @property
    def trusted(self) -> bool:
        """Whether reweighting tells what a refit would."""
        return bool(self.khat <= TRUSTED_KHAT)


Band = tuple[float, float, float]  # median, and both ends of a 90 % interval, or their Monte Carlo standard errors


@dataclass(frozen=True)
class PredictionSensitivity:
    """How far one predicted stable amplitude follows what the card says of a parameter.

    Attributes
    ----------
    where : str
        Why it is predicted there.
    scruton_number : float
    source : str
        "tau", "kappa" or "law weights".
    distance : float
        Cumulative Jensen-Shannon distance that the predictive draws move per doubling of the power of that prior,
        beyond chance.
    median : float
        Of the prediction.
    low, high : float
        Its 90 % interval.
    halved, doubled : (float, float, float)
        The same where the prior's median (of the laws: the odds of the leading one) is halved and doubled.
    errors, halved_errors, doubled_errors : (float, float, float)
        Monte Carlo standard errors of these medians and of both ends; NaN where an end may be infinite.
    """

    where: str
    scruton_number: float
    source: str
    distance: float
    median: float
    low: float
    high: float
    halved: Band
    doubled: Band
    errors: Band
    halved_errors: Band
    doubled_errors: Band


def power_scaling(tree: "xr.DataTree") -> tuple[Scaling, ...]:
    """Sensitivity of every test's parameters in the model that predicts; empty where the fit does not hold it.

    Notes
    -----
    Priors of amplitude, relaxation and exponent are scaled together, and those of noise and discrepancies, whose part
    it is to say how wide a posterior is.  What joins a test to the curve that all share is the model's, and stays.
    """
    if "examined" not in tree:
        return ()
    group, scalings = tree["examined"].to_dataset(), []
    for test in _tests(tree):
        own = group.sel(test=test)
        weights = [scaled_weights(_flat(own[name])) for name in ("lp_prior", "lp_still_air", "lp_records")]
        meant = scaled_weights(_flat(own["lp_noise"]))
        for name in (parameter for parameter in SCALED if parameter in own):
            draws = _flat(own[name])
            verdict = diagnose(*(beyond_chance(draws, pair) for pair in weights))
            prior, still_air, records = (sensitivity(draws, pair) for pair in weights)
            scalings.append(Scaling(test, name, prior, still_air, records, verdict, sensitivity(draws, meant)))
    return tuple(scalings)


def diagnose(prior: float, still_air: float, likelihood: float) -> str:
    """Say what the sensitivities, beyond chance, mean by the threshold 0.05."""
    if not np.isfinite([prior, still_air, likelihood]).all():
        return "cannot be told"
    if prior >= SENSITIVE:
        return CONFLICT if likelihood >= SENSITIVE else WEAK
    if likelihood < SENSITIVE <= still_air:
        return STILL_AIR
    return FINE


def scaled_weights(log_density: FloatArray, *, tail: bool = True) -> tuple[FloatArray, FloatArray] | None:
    """Weights of the draws at the lower and at the upper power; None where the factor is flat, and scaling it idle.

    A density of a few values, such as that of laws, has no `tail` to smooth.
    """
    if not np.isfinite(log_density).all():
        return (np.full_like(log_density, np.nan),) * 2
    if float(np.ptp(log_density)) <= 1e-10 * max(1.0, float(np.abs(log_density).max())):
        return None  # a uniform prior has no tail to smooth
    pair = []
    for alpha in ALPHAS:
        log_weights = (alpha - 1.0) * log_density
        with suppress(ValueError):  # tails without any spread: unsmoothed weights are as good
            log_weights = pareto.scaled(log_density, alpha) if tail else log_weights
        weights = np.exp(log_weights - log_weights.max())
        pair.append(weights / weights.sum())
    return pair[0], pair[1]


def sensitivity(draws: FloatArray, weights: tuple[FloatArray, FloatArray] | None) -> float:
    """Cumulative Jensen-Shannon distance that the draws move per doubling of the power; 0 for a flat factor."""
    if weights is None or float(np.ptp(draws)) == 0.0:
        return 0.0
    order = np.argsort(draws)
    return _sensitivity(np.diff(draws[order]), np.stack(weights)[:, order])


def _sensitivity(steps: FloatArray, weights: FloatArray) -> float:
    """`sensitivity` from the steps between ordered draws, (N - 1,), and their weights, (2, N)."""
    distance = _moved_by(steps, weights)
    return float(0.5 * (distance[1] / np.log2(ALPHAS[1]) - distance[0] / np.log2(ALPHAS[0])))


def _moved_by(steps: FloatArray, weights: FloatArray) -> FloatArray:
    """Cumulative Jensen-Shannon distance of weighted draws from the same unweighted, the larger of both directions."""
    n = weights.shape[1]
    p = np.linspace(1.0 / n, 1.0 - 1.0 / n, n - 1)
    q = np.cumsum(weights / weights.sum(axis=1, keepdims=True), axis=1)[:, :-1]
    squares = []
    for a, b in ((p, q), (1.0 - p, 1.0 - q)):  # from below, and from above
        middle, log_a, log_b = (
            np.log2(x, out=np.zeros_like(x), where=x > 0.0) for x in (0.5 * (a + b), np.asarray(a), np.asarray(b))
        )
        of_a, of_b = float(a @ steps), b @ steps
        excess = (of_b - of_a) * (0.5 / np.log(2.0))
        there = np.maximum((a * (log_a - middle)) @ steps + excess, 0.0)
        back = np.maximum((b * (log_b - middle)) @ steps - excess, 0.0)
        squares.append((there + back) / (of_a + of_b))
    return np.asarray(np.sqrt(np.maximum(*squares)))


def beyond_chance(draws: FloatArray, weights: tuple[FloatArray, FloatArray] | None) -> float:
    """`sensitivity` less, in quadrature, what the same weights give in any other order: so many draws tell no less."""
    if weights is None or float(np.ptp(draws)) == 0.0:
        return 0.0
    rng, order, both = np.random.default_rng(0), np.argsort(draws), np.stack(weights)
    steps, place = np.diff(draws[order]), np.empty(draws.size, dtype=np.intp)
    chance = []
    for _ in range(_ORDERS):
        place[rng.permutation(draws.size)] = np.arange(draws.size)  # where each draw is put
        chance.append(_sensitivity(steps, both[:, place[order]]))
    found = _sensitivity(steps, both[:, order])
    return float(np.sqrt(np.maximum(found**2 - np.mean(np.square(chance)), 0.0)))


def identifiability(tree: "xr.DataTree") -> tuple[Moved, ...]:
    """Posterior over prior standard deviation of every parameter of every test; empty without prior draws."""
    if "prior" not in tree or "examined" not in tree:
        return ()
    posterior, prior = tree["examined"].to_dataset(), tree["prior"]
    rows = []
    for test in _tests(tree):
        names = [parameter for parameter in (*PRIOR_OF, *FORCES) if parameter in posterior]
        names = [name for name in names if name in FORCES or PRIOR_OF[name] in prior.data_vars]
        forces = prior_forces(tree, test) if "Y1" in names else {}
        for name in names:
            before = forces[name] if name in FORCES else _flat(prior[PRIOR_OF[name]].sel(test=test))
            pair = (before, _flat(posterior[name].sel(test=test)))
            # In the sampled coordinate: of the logarithm but for the exponent of the law.
            sds = [float((draws if name == "law_exponent" else np.log(np.abs(draws))).std()) for draws in pair]
            rows.append(moved(test, name, *sds))
    return tuple(rows)


def moved(test: str, parameter: str, prior_sd: float, posterior_sd: float) -> Moved:
    """Put the two standard deviations beside each other and say what they mean."""
    ratio = posterior_sd / prior_sd if prior_sd > 0.0 else float("nan")
    verdict = FINE
    if ratio > BARELY_MOVED:
        verdict = "not moved by the data" if ratio > NOT_MOVED else "barely moved by the data"
    if parameter == "damping_ratio":
        verdict = STILL_AIR if ratio > BARELY_MOVED else "moved by the records in wind"
    return Moved(test, parameter, prior_sd, posterior_sd, ratio, verdict)


def prior_forces(tree: "xr.DataTree", test: str) -> dict[str, FloatArray]:
    """Y1 and epsilon that the prior means at a test's setting, under the paper's law."""
    from scruton.dynamics import Setting, force_parameters

    constant, prior = tree["constant_data"].to_dataset(), tree["prior"]
    a_star, ratio, damping = (
        _flat(prior[name].sel(test=test)) for name in ("stable_amplitude", "relaxation_ratio", "damping_ratio")
    )
    names = ("mass", "air_density", "wind_speed", "frequency", "wind_frequency")
    at = {name: float(constant[name].sel(test=test)) for name in names}
    size = float(constant["width"]), float(constant["depth"])
    setting = Setting(Motion(str(constant["motion"].item())), *size, damping_ratio=damping, **at)
    y1, epsilon = force_parameters(a_star, 2.0 * np.pi * at["frequency"] * ratio, setting)
    return {"Y1": y1, "epsilon": epsilon}


def campaign_identifiability(tree: "xr.DataTree", card: ModelCard) -> tuple[Moved, ...]:
    """Posterior over prior standard deviation of the shared curve and of the discrepancies, in the leading law."""
    if "campaign_posterior" not in tree or "examined" not in tree:
        return ()
    group = tree["campaign_posterior"].sel(law=tree["examined"].attrs["law"])
    motion = Motion(str(tree["constant_data"]["motion"].item()))
    return tuple(
        moved("", name, card.prior(prior, motion).scale, float(np.log(_flat(group[name])).std()))
        for name, prior in SHARED_PRIOR.items()
    )


def influences(tree: "xr.DataTree") -> tuple[Influence, ...]:
    """Every record of every test left out by reweighting; a test's only record cannot be, and is not among them.

    Notes
    -----
    Records of a test are independent given its parameters, so that the weight of a draw is one over the record's joint
    density, the product of the conditional densities of its cycles.  Steady records have one density together.
    """
    if EXAMINED_LIKELIHOOD not in tree or "examined" not in tree:
        return ()
    pointwise = tree[EXAMINED_LIKELIHOOD]["amplitude"].transpose("chain", "draw", "cycle")
    constant, posterior = tree["constant_data"], tree["examined"]
    of_test, of_record = (constant[key].to_numpy().astype(str) for key in ("record_test", "record"))
    at = {"chain": pointwise["chain"], "draw": pointwise["draw"]}
    rows: list[Influence] = []
    for test in _tests(tree):
        in_test = of_test == test
        densities = {
            name: pointwise.to_numpy()[..., in_test & (of_record == name)].sum(axis=-1).reshape(-1)
            for name in dict.fromkeys(of_record[in_test].tolist())
        }
        steady = _flat(tree[EXAMINED_LIKELIHOOD]["steady"].sel(test=test))
        if densities and float(np.ptp(steady)) > 1e-6:
            densities[STEADY] = steady
        if len(densities) < 2:
            continue
        draws = {name: np.log(_flat(posterior[name].sel(test=test).sel(at))) for name in ("a_star", "relaxation_rate")}
        for record, density in densities.items():
            rows += [replace(influence, test=test) for influence in left_out(record, density, draws)]
    return tuple(rows)


def left_out(record: str, log_density: FloatArray, draws: Mapping[str, FloatArray]) -> list[Influence]:
    """Move of every parameter when the factor with this log density, (S,), is taken out of the posterior."""
    try:
        log_weights, khat = pareto.smoothed(-log_density)
    except ValueError:  # a tail of one draw, many times over: no weight of it can be trusted
        log_weights, khat = -log_density, np.inf
    weights = np.exp(np.asarray(log_weights) - np.max(log_weights))
    weights /= weights.sum()
    rows = []
    for name, values in draws.items():
        mean, sd = float(values.mean()), float(values.std())
        without = float(weights @ values)
        widening = float(np.sqrt(weights @ (values - without) ** 2)) / sd
        shift = (without - mean) / sd
        # With and without are jointly normal: the difference has the difference of the variances (Hausman, 1978).
        z = shift / np.sqrt(widening**2 - 1.0) if widening > 1.1 else float("nan")
        rows.append(Influence("", record, name, shift, widening, float(z), float(khat)))
    return rows


def _tests(tree: "xr.DataTree") -> Sequence[str]:
    return [str(name) for name in tree["examined"]["test"].to_numpy()]


def _flat(array: Any) -> FloatArray:
    return np.asarray(array.to_numpy(), dtype=float).reshape(-1)
