"""Joint predictive density of whole records, under what other records tell of the parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.thresholds import SCATTER_LIKE_OTHERS
from scruton.stats.fisher_scoring import climb, solved

_LOG_2PI = float(np.log(2.0 * np.pi))
_ITERATIONS = 40
_IMPERFECTIONS = ("stiffness", "third")  # that one setting need not share with another
# What the wind does to one setting as to another; it blurs the reading, too.
_SCATTER = (
    *("scatter", "phase_scatter", "noise", "record_noise", "correlation", "phase_correlation"),
    *("gust_scatter", "gust_time"),
)
_OWN = ("detuning", "frequency_trend", "gain", "set_point_scatter", *_SCATTER, *_IMPERFECTIONS)


def told_by(hypothesis: Hypothesis, cycles: np.ndarray) -> Hypothesis:
    """The same hypothesis, with the same coordinates, told by some cycles alone, (N,) of bool."""
    part = replace(hypothesis.data, channels=hypothesis.data.channels.keep(cycles))
    return Hypothesis(replace(hypothesis.null, data=part), hypothesis.variants)


def restricted(hypothesis: Hypothesis, records: np.ndarray) -> Hypothesis:
    """The same, told by all cycles of some records alone, (R,) of bool."""
    return told_by(hypothesis, records[hypothesis.data.channels.record])


@dataclass(frozen=True, eq=False)
class NormalPosterior:
    """A normal distribution of a hypothesis' coordinates, from some records."""

    hypothesis: Hypothesis  # with the cycles of all records
    mean: FloatArray  # (d,)
    covariance: FloatArray  # (d, d)
    start: FloatArray  # (d,): from where optima are sought, of what has many
    optimum: FloatArray  # (d,): of the fit to those records and all that was stated
    # Relative errors of stated damping that are scored with the records: standard deviation by coordinate.
    stated: Mapping[int, float]


def posterior_without(full: FittedHypothesis, left_out: np.ndarray) -> NormalPosterior:
    """What the other records tell of the coordinates, for those left out, (R,) of bool.

    Coordinates that they do not tell keep their priors, and so do small imperfections, which one setting need not
    share with another.  A test without a record among them scatters like the others, to within 20 per cent.  Where
    all records in wind of a rig are left out, so is the damping ratio that was stated for it.
    """
    hypothesis = full.hypothesis
    rest = restricted(hypothesis, ~left_out).fit(full.mode)
    stated = _stated(hypothesis, left_out)
    # The statements, N(0, sd^2), leave the fit: N(0, 1) takes their place.
    precision = np.linalg.inv(rest.covariance)
    pull = precision @ rest.mode
    for at, sd in stated.items():
        precision[at, at] += 1.0 - 1.0 / sd**2
    covariance = np.linalg.inv(precision)
    return _with_own(NormalPosterior(hypothesis, covariance @ pull, covariance, full.mode, rest.mode, stated), left_out)


def posterior_at_mode(full: FittedHypothesis, left_out: np.ndarray) -> NormalPosterior:
    """All coordinates fixed where all records put them, but for what belongs to the records left out alone."""
    nothing = np.zeros_like(full.covariance)
    stated = _stated(full.hypothesis, left_out)
    return _with_own(NormalPosterior(full.hypothesis, full.mode, nothing, full.mode, full.mode, stated), left_out)


def _stated(hypothesis: Hypothesis, left_out: np.ndarray) -> dict[int, float]:
    """Coordinate and standard deviation of the stated damping of rigs all of whose records in wind are left out."""
    data, layout = hypothesis.data, hypothesis.data.layout
    stated = {}
    members = layout.by_rig()
    for j in np.unique(members[left_out]):
        wind = layout.wind & (members == j)
        sd = float(data.damping_sd[layout.rig[members == j][0]])
        if wind.any() and left_out[wind].all() and sd < 1.0:
            stated[hypothesis.slices[None, "damping"].start + int(j)] = sd
    return stated


def _with_own(known: NormalPosterior, left_out: np.ndarray) -> NormalPosterior:
    """Give the records left out a detuning, reading, imperfections and scatter of their own."""
    hypothesis = known.hypothesis
    location, scale = hypothesis.prior
    wind = hypothesis.data.layout.wind
    mean, covariance = known.mean.copy(), known.covariance.copy()

    def free(at: int, centre: float, variance: float) -> None:
        mean[at] = centre
        covariance[at, :] = covariance[:, at] = 0.0
        covariance[at, at] = variance

    for parameter in hypothesis.null.parameters:
        if parameter.name not in _OWN:
            continue
        first = hypothesis.slices[parameter.key].start
        groups = [parameter.members == j for j in range(parameter.size)]
        imperfect = parameter.name in _IMPERFECTIONS
        for at, members in enumerate(groups, first):
            if (imperfect and left_out[members].any()) or left_out[members].all():
                free(at, location[at], scale[at] ** 2)
        if parameter.name in _SCATTER:
            in_wind = [(at, left_out[members].all()) for at, members in enumerate(groups, first) if wind[members].all()]
            seen = [at for at, out in in_wind if not out]
            for at in [at for at, out in in_wind if out] if seen else []:
                free(at, mean[seen].mean(), SCATTER_LIKE_OTHERS**2 * (1.0 + 1.0 / len(seen)))
    return replace(known, mean=mean, covariance=covariance)


@dataclass(frozen=True, eq=False)
class RecordDensity:
    """Joint log density of some records, where its integrand peaks, and the Fisher information there."""

    value: float  # natural logarithm, all channels
    # What each record contributes, (R,): its likelihood at the peak, and an equal part of the rest; NaN for others.
    shares: FloatArray
    where: np.ndarray  # (k,): coordinates that the records depend on
    at: FloatArray  # (d,): coordinates at the peak
    information: FloatArray  # (k, k): of the records alone
    # What the density falls short of that at known coordinates, on average, were the hypothesis right: half the
    # logarithm of the determinant of posterior over prior precision.
    learnt: float


def density(known: NormalPosterior, records: np.ndarray) -> RecordDensity:
    """Log density of all cycles of some records, (R,) of bool, jointly, coordinates integrated over what is known.

    Laplace's method in the coordinates that are not known exactly: the integrand is climbed by Fisher scoring with
    the normal distribution of the coordinates as its prior.
    """
    part = restricted(known.hypothesis, records)
    blocks = [part.blocks[r] for r in np.flatnonzero(records)]
    where = np.unique(np.concatenate([block.where for block in blocks]))
    free = known.covariance[where, where] > 0.0
    inside, of_free = where[free], np.ix_(free, free)
    prior = known.covariance[np.ix_(inside, inside)]
    precision = np.linalg.inv(prior)
    at_stated = np.array(sorted(set(known.stated) & set(where.tolist())), dtype=np.intp)
    stated_sd = np.array([known.stated[int(i)] for i in at_stated])

    def statement(u: FloatArray) -> FloatArray:
        """Log density of the stated damping, (W,)."""
        z = u[:, at_stated] / stated_sd
        return np.asarray(-0.5 * np.sum(z * z + 2.0 * np.log(stated_sd) + _LOG_2PI, axis=1))

    def values(u: FloatArray) -> FloatArray:
        """Logarithm of the integrand, (W,), without the normal distribution's constant."""
        away = u[:, inside] - known.mean[inside]
        total = part.log_likelihood(u) - 0.5 * np.einsum("wi,ij,wj->w", away, precision, away) + statement(u)
        return np.where(np.isfinite(total), total, -np.inf)

    def scores(u: FloatArray) -> tuple[float, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Its logarithm, gradient and curvature (free,), the records' information (k, k), their log likelihoods."""
        gradient, fisher = np.zeros(u.size), np.zeros((u.size, u.size))
        v, log_s, weight = part.add_scores(u, gradient, fisher)
        misfit = v * v * weight + log_s
        likes = np.array([-0.5 * float(np.sum(block.of(misfit) + _LOG_2PI)) for block in blocks])
        gradient[at_stated] -= u[at_stated] / stated_sd**2
        fisher[at_stated, at_stated] += 1.0 / stated_sd**2
        away = u[inside] - known.mean[inside]
        pull = precision @ away
        value = float(np.sum(likes)) - 0.5 * float(away @ pull) + float(statement(u[None])[0])
        fisher = fisher[np.ix_(where, where)]
        return value, gradient[inside] - pull, fisher[of_free] + precision, fisher, likes

    starts = np.array([known.mean, known.mean])
    starts[1, inside] = known.start[inside]
    u, (value, _, curvature, fisher, likes) = climb(
        scores, values, starts[int(np.argmax(values(starts)))],
        free=inside, tolerance=2e-3, iterations=_ITERATIONS,
    )  # fmt: skip
    learnt = 0.5 * (float(np.linalg.slogdet(prior)[1]) + float(np.linalg.slogdet(curvature)[1]))
    shares = np.full(len(records), np.nan)
    shares[records] = likes + (value - learnt - likes.sum()) / likes.size
    return RecordDensity(value - learnt, shares, where, u, fisher, learnt)


def parameters_spent(known: NormalPosterior, scored: RecordDensity, covariance: FloatArray) -> float:
    """Effective number of parameters that records, scored with `known`, have had fitted to them.

    Their own are integrated out; `covariance`, (d, d), is that of all coordinates from all records.
    """
    where, fisher = scored.where, scored.information
    free = known.covariance[where, where] > 0.0
    prior = known.covariance[np.ix_(where[free], where[free])]
    cross = fisher[np.ix_(~free, free)]
    inner = fisher[np.ix_(free, free)] + np.linalg.inv(prior)
    profiled = fisher[np.ix_(~free, ~free)] - cross @ solved(inner, cross.T)
    return float(np.sum(profiled * covariance[np.ix_(where[~free], where[~free])]))
