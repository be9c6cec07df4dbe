"""Joint predictive density of whole records, under what other records tell of the parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import Channels
from scruton.gap.data import GapData
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.thresholds import SCATTER_LIKE_OTHERS
from scruton.stats.fisher_scoring import climb

_LOG_2PI = float(np.log(2.0 * np.pi))
_ITERATIONS = 40
_IMPERFECTIONS = ("stiffness", "third")  # that one setting need not share with another
_OWN = ("detuning", "gain", "scatter", "phase_scatter", *_IMPERFECTIONS)


def only(channels: Channels, records: np.ndarray) -> Channels:
    """The cycles of some records, (R,) of bool, numbered as before."""
    return channels.keep(records[channels.record])


def restricted(hypothesis: Hypothesis, records: np.ndarray) -> Hypothesis:
    """The same hypothesis, with the same coordinates, told by the cycles of some records alone."""
    data = hypothesis.data
    part: GapData = replace(data, channels=only(data.channels, records))
    return Hypothesis(replace(hypothesis.null, data=part), hypothesis.variants)


@dataclass(frozen=True, eq=False)
class NormalPosterior:
    """A normal distribution of a hypothesis' coordinates, from some records.

    Attributes
    ----------
    hypothesis : Hypothesis
        With the cycles of all records.
    mean : (d,) array
    covariance : (d, d) array
    start : (d,) array
        From where optima are sought: of what has many.
    optimum : (d,) array
        Of the fit to those records and all that was stated.
    stated : dict
        Relative errors of stated damping that are scored with the records: standard deviation by coordinate.
    """

    hypothesis: Hypothesis
    mean: FloatArray
    covariance: FloatArray
    start: FloatArray
    optimum: FloatArray
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
    data = hypothesis.data
    layout = data.layout
    found = {}
    members = layout.by_rig()
    for j in np.unique(members[left_out]):
        wind = layout.wind & (members == j)
        sd = float(data.damping_sd[layout.rig[members == j][0]])
        if wind.any() and left_out[wind].all() and sd < 1.0:
            found[hypothesis.slices[None, "damping"].start + int(j)] = sd
    return found


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
        for at, mine in enumerate(groups, first):
            if (imperfect and left_out[mine].any()) or left_out[mine].all():
                free(at, location[at], scale[at] ** 2)
        if parameter.name in ("scatter", "phase_scatter"):
            seen = [at for at, mine in enumerate(groups, first) if wind[mine].all() and not left_out[mine].all()]
            unseen = [at for at, mine in enumerate(groups, first) if wind[mine].all() and left_out[mine].all()]
            for at in unseen if seen else []:
                free(at, mean[seen].mean(), SCATTER_LIKE_OTHERS**2 * (1.0 + 1.0 / len(seen)))
    return replace(known, mean=mean, covariance=covariance)


@dataclass(frozen=True, eq=False)
class RecordDensity:
    """Joint log density of some records, where its integrand peaks, and the Fisher information there.

    Attributes
    ----------
    value : float
        Natural logarithm, all channels.
    shares : (R,) array
        What each record contributes to it: its likelihood at the peak, and an equal part of the rest. NaN for others.
    where : (k,) array of int
        Coordinates that the records depend on.
    at : (d,) array
        Coordinates at the peak.
    information : (k, k) array
        Of the records alone.
    learnt : float
        What the density falls short of that at known coordinates, on average, were the hypothesis right: half the
        logarithm of the determinant of posterior over prior precision.
    """

    value: float
    shares: FloatArray
    where: np.ndarray
    at: FloatArray
    information: FloatArray
    learnt: float


class _Integrand:
    """Likelihood of some records times the normal distribution of the coordinates that are not known exactly."""

    def __init__(self, known: NormalPosterior, records: np.ndarray) -> None:
        self.part = restricted(known.hypothesis, records)
        self.blocks = [self.part.blocks[r] for r in np.flatnonzero(records)]
        self.where = np.unique(np.concatenate([where for _, _, where in self.blocks]))
        self.free = known.covariance[self.where, self.where] > 0.0
        self.inside = self.where[self.free]
        self.mean = known.mean[self.inside]
        self.at_stated = np.array(sorted(set(known.stated) & set(self.where.tolist())), dtype=np.intp)
        self.stated_sd = np.array([known.stated[int(i)] for i in self.at_stated])
        prior = known.covariance[np.ix_(self.inside, self.inside)]
        self.precision = np.linalg.inv(prior)
        self.log_prior = float(np.linalg.slogdet(prior)[1])

    def values(self, u: FloatArray) -> FloatArray:
        """Its logarithm, (W,), without the normal distribution's constant."""
        like = self.part.log_likelihood(u)
        away = u[:, self.inside] - self.mean
        total = like - 0.5 * np.einsum("wi,ij,wj->w", away, self.precision, away) + self._statement(u)
        return np.where(np.isfinite(total), total, -np.inf)

    def _statement(self, u: FloatArray) -> FloatArray:
        """Log density of the stated damping, (W,)."""
        z = u[:, self.at_stated] / self.stated_sd
        density: FloatArray = -0.5 * np.sum(z * z + 2.0 * np.log(self.stated_sd) + _LOG_2PI, axis=1)
        return density

    def scores(self, u: FloatArray) -> tuple[float, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Its logarithm, gradient and curvature (free,), the records' information (k, k), their log likelihoods."""
        v, log_s, jv, js = self.part.derivatives(u)
        w = np.exp(-log_s)
        gradient, fisher = np.zeros(self.where.size), np.zeros((self.where.size, self.where.size))
        likes = []
        for cycles, rows, where in self.blocks:
            place = np.searchsorted(self.where, where)
            a, b = jv[np.ix_(rows, cycles)], js[np.ix_(rows, cycles)]
            gradient[place] -= a @ (v * w)[cycles] + 0.5 * b @ (1.0 - v * v * w)[cycles]
            fisher[np.ix_(place, place)] += (a * w[cycles]) @ a.T + 0.5 * b @ b.T
            likes.append(-0.5 * float(np.sum((v * v * w + log_s)[cycles] + _LOG_2PI)))
        place = np.searchsorted(self.where, self.at_stated)
        gradient[place] -= u[self.at_stated] / self.stated_sd**2
        fisher[place, place] += 1.0 / self.stated_sd**2
        away = u[self.inside] - self.mean
        pull = self.precision @ away
        value = float(np.sum(likes)) - 0.5 * float(away @ pull) + float(self._statement(u[None])[0])
        curvature = fisher[np.ix_(self.free, self.free)] + self.precision
        return value, gradient[self.free] - pull, curvature, fisher, np.array(likes)


def density(known: NormalPosterior, records: np.ndarray) -> RecordDensity:
    """Log density of all cycles of some records jointly, their coordinates integrated over what is known of them.

    Laplace's method in the coordinates that are not known exactly: the integrand is climbed by Fisher scoring with
    the normal distribution of the coordinates as its prior.

    Parameters
    ----------
    known : NormalPosterior
    records : (R,) array of bool
    """
    integrand = _Integrand(known, records)
    inside = integrand.inside
    free = np.ix_(integrand.free, integrand.free)
    starts = np.array([known.mean, known.mean])
    starts[1, inside] = known.start[inside]
    u, (value, _, _, fisher, likes) = climb(
        integrand.scores, integrand.values, starts[int(np.argmax(integrand.values(starts)))],
        free=inside, tolerance=2e-3, iterations=_ITERATIONS, cautious=False,
    )  # fmt: skip
    learnt = 0.5 * (integrand.log_prior + float(np.linalg.slogdet(fisher[free] + integrand.precision)[1]))
    shares = np.full(len(records), np.nan)
    shares[records] = likes + (value - learnt - likes.sum()) / likes.size
    return RecordDensity(value - learnt, shares, integrand.where, u, fisher, learnt)


def parameters_spent(known: NormalPosterior, scored: RecordDensity, covariance: FloatArray) -> float:
    """Effective number of parameters that records have had fitted to them, their own integrated out.

    Parameters
    ----------
    known : NormalPosterior
        With which the records were scored.
    scored : RecordDensity
    covariance : (d, d) array
        Of all coordinates, from all records.
    """
    where, fisher = scored.where, scored.information
    mine = known.covariance[where, where] > 0.0
    prior = known.covariance[np.ix_(where[mine], where[mine])]
    cross = fisher[np.ix_(~mine, mine)]
    inner = fisher[np.ix_(mine, mine)] + np.linalg.inv(prior)
    profiled = fisher[np.ix_(~mine, ~mine)] - cross @ np.linalg.solve(inner, cross.T)
    return float(np.sum(profiled * covariance[np.ix_(where[~mine], where[~mine])]))
