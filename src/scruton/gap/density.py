"""Joint density of whole records under parameters that other records settled."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import Channels
from scruton.gap.data import GapData
from scruton.gap.hypothesis import Hypothesis, Weighed

_LOG_2PI = float(np.log(2.0 * np.pi))
_LIKE_OTHERS = 0.2  # sd of ln(scatter) of a test about that of the others
_ITERATIONS = 40
_IMPERFECTIONS = ("bend", "third")
_OWN = ("detuning", "reading", "scatter", "phase_scatter", *_IMPERFECTIONS)


def only(channels: Channels, records: np.ndarray) -> Channels:
    """The cycles of some records, (R,) of bool, numbered as before."""
    inside = records[channels.record]
    return Channels(**{k: v if k == "knots" else v[inside] for k, v in vars(channels).items()})


def given(hypothesis: Hypothesis, records: np.ndarray) -> Hypothesis:
    """The same hypothesis, with the same coordinates, told by the cycles of some records alone."""
    data = hypothesis.bare.data
    part: GapData = replace(data, channels=only(data.channels, records))
    return Hypothesis(replace(hypothesis.bare, data=part), hypothesis.variants)


@dataclass(frozen=True, eq=False)
class Knowledge:
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


def learn(full: Weighed, records: np.ndarray) -> Knowledge:
    """What some records, (R,) of bool, tell of the coordinates, for the records that are left out.

    Coordinates that they do not tell keep their priors, and so do small imperfections, which one setting need not
    share with another.  A test without a record among them scatters like the others, to within 20 per cent.  Where
    all records in wind of a rig are left out, so is the damping ratio that was stated for it.
    """
    hypothesis = full.hypothesis
    found = given(hypothesis, records).fit(full.mode)
    stated = _stated(hypothesis, ~records)
    # The statements, N(0, sd^2), leave the fit: N(0, 1) takes their place.
    precision = np.linalg.inv(found.covariance)
    pull = precision @ found.mode
    for at, sd in stated.items():
        precision[at, at] += 1.0 - 1.0 / sd**2
    covariance = np.linalg.inv(precision)
    return _apart(Knowledge(hypothesis, covariance @ pull, covariance, full.mode, found.mode, stated), ~records)


def settled_by(full: Weighed, left_out: np.ndarray) -> Knowledge:
    """All coordinates as all records settle them, but for what belongs to the records left out alone."""
    nothing = np.zeros_like(full.covariance)
    stated = _stated(full.hypothesis, left_out)
    return _apart(Knowledge(full.hypothesis, full.mode, nothing, full.mode, full.mode, stated), left_out)


def _stated(hypothesis: Hypothesis, left_out: np.ndarray) -> dict[int, float]:
    """Coordinate and standard deviation of the stated damping of rigs all of whose records in wind are left out."""
    data = hypothesis.bare.data
    layout = data.layout
    found = {}
    members = next(p.members for p in hypothesis.parameters if p.name == "damping")
    for j in np.unique(members[left_out]):
        wind = layout.wind & (members == j)
        sd = float(data.damping_sd[layout.rig[members == j][0]])
        if wind.any() and left_out[wind].all() and sd < 1.0:
            found[hypothesis.places["damping"].start + int(j)] = sd
    return found


def _apart(known: Knowledge, left_out: np.ndarray) -> Knowledge:
    """Give the records left out a detuning, reading, imperfections and scatter of their own."""
    hypothesis = known.hypothesis
    location, scale = hypothesis.prior
    mean, covariance = known.mean.copy(), known.covariance.copy()
    for one in hypothesis.parameters:
        if one.name not in _OWN:
            continue
        for j in range(one.size):
            mine, at = one.members == j, hypothesis.places[one.name].start + j
            if (one.name in _IMPERFECTIONS and left_out[mine].any()) or left_out[mine].all():
                mean[at] = location[at]
                covariance[at, :] = covariance[:, at] = 0.0
                covariance[at, at] = scale[at] ** 2
    return _like_others(replace(known, mean=mean, covariance=covariance), ~left_out)


def _like_others(known: Knowledge, records: np.ndarray) -> Knowledge:
    hypothesis = known.hypothesis
    wind = hypothesis.bare.data.layout.wind
    mean, covariance = known.mean.copy(), known.covariance.copy()
    for one in hypothesis.parameters:
        if one.name not in ("scatter", "phase_scatter"):
            continue
        where = hypothesis.places[one.name].start
        groups = [one.members == j for j in range(one.size)]
        told = [where + j for j, g in enumerate(groups) if wind[g].all() and records[g].any()]
        untold = [where + j for j, g in enumerate(groups) if wind[g].all() and not records[g].any()]
        if not told:
            continue
        for at in untold:
            mean[at] = mean[told].mean()
            covariance[at, :] = covariance[:, at] = 0.0
            covariance[at, at] = _LIKE_OTHERS**2 * (1.0 + 1.0 / len(told))
    return replace(known, mean=mean, covariance=covariance)


@dataclass(frozen=True, eq=False)
class Scored:
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

    def __init__(self, known: Knowledge, records: np.ndarray) -> None:
        self.part = given(known.hypothesis, records)
        self.blocks = [self.part._blocks[r] for r in np.flatnonzero(records)]
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
        v, s = self.part.innovations(u)
        with np.errstate(all="ignore"):
            like = -0.5 * np.sum(v * v / s + np.log(s) + _LOG_2PI, axis=1)
        away = u[:, self.inside] - self.mean
        total = like - 0.5 * np.einsum("wi,ij,wj->w", away, self.precision, away) + self._statement(u)
        return np.where(np.isfinite(total), total, -np.inf)

    def _statement(self, u: FloatArray) -> FloatArray:
        """Log density of the stated damping, (W,)."""
        z = u[:, self.at_stated] / self.stated_sd
        density: FloatArray = -0.5 * np.sum(z * z + 2.0 * np.log(self.stated_sd) + _LOG_2PI, axis=1)
        return density

    def scores(self, u: FloatArray) -> tuple[float, FloatArray, FloatArray, FloatArray]:
        """Its logarithm, gradient (free,), the records' information (k, k), and their log likelihoods."""
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
        return value, gradient[self.free] - pull, fisher, np.array(likes)


def density(known: Knowledge, records: np.ndarray) -> Scored:
    """Log density of all cycles of some records jointly, their coordinates integrated over what is known of them.

    Laplace's method in the coordinates that are not known exactly: the integrand is climbed by Fisher scoring with
    the normal distribution of the coordinates as its prior.

    Parameters
    ----------
    known : Knowledge
    records : (R,) array of bool
    """
    integrand = _Integrand(known, records)
    inside = integrand.inside
    free = np.ix_(integrand.free, integrand.free)
    first = np.array([known.mean, known.mean])
    first[1, inside] = known.start[inside]
    u = first[int(np.argmax(integrand.values(first)))]
    value, gradient, fisher, likes = integrand.scores(u)
    mu = 0.0
    for _ in range(_ITERATIONS):
        curvature = fisher[free] + integrand.precision
        ridge = np.diag(np.diag(curvature))
        steps = [np.linalg.solve(curvature + m * ridge, gradient) for m in (mu, 10.0 * mu + 0.3, 100.0 * mu + 10.0)]
        trials = np.repeat(u[None], 4, axis=0)
        trials[:, inside] += np.array([*steps, 0.3 * steps[0]])
        total = integrand.values(trials)
        best = int(np.argmax(total))
        gain = total[best] - value
        if not gain > 0.0:
            if mu > 1e3:
                break
            mu = 100.0 * mu + 30.0
            continue
        u, mu = trials[best], (0.0, 0.1 * mu, mu, mu)[best]
        value, gradient, fisher, likes = integrand.scores(u)
        if gain < 2e-3:
            break
    learnt = 0.5 * (integrand.log_prior + float(np.linalg.slogdet(fisher[free] + integrand.precision)[1]))
    shares = np.full(len(records), np.nan)
    shares[records] = likes + (value - learnt - likes.sum()) / likes.size
    return Scored(value - learnt, shares, integrand.where, u, fisher, learnt)


def parameters_spent(known: Knowledge, scored: Scored, covariance: FloatArray) -> float:
    """Effective number of parameters that records have had fitted to them, their own integrated out.

    Parameters
    ----------
    known : Knowledge
        With which the records were scored.
    scored : Scored
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
