"""The optimum of a posterior and the Student-t there: the start of every ensemble."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scruton.arrays import FloatArray, IntArray
from scruton.stats.posterior import Posterior
from scruton.stats.student_t import StudentT
from scruton.stats.thresholds import GIVES_UP, SAME_OPTIMUM, WIDEN, WORTH_A_START


class ImpossibleError(ValueError):
    """No point of the prior has a finite likelihood."""


_IMPOSSIBLE = "no point of the prior has a finite likelihood: the record contradicts the model card's priors"
GUESSES, STARTS = 256, 3  # points looked at in each search, and how many of the best are climbed from
STEEPEST = 1e4  # curvature, where half a nat is lost in one step of a coordinate
AT_ONCE = 4096  # points of a posterior that are computed side by side: of 40 rigs, 12 MB of coordinates
STEP = 1e-4  # of the finite differences, in units of the search's own scale
FLAT = 1e-2  # slope in those units at which a search ends: less than a hundredth of a nat from the top
SHORTEST, LONGEST = 1e-6, 5.0  # step in those units at which it ends, too, and that no step exceeds
MOST_TRIALS = 400  # steps tried in one search
STALLED, PATIENCE = 1e-3, 25  # nats that so many steps have to gain: what gains less is at the top, or on its rim


def find_optimum(posterior: Posterior, rng: np.random.Generator, wanted: float = -np.inf) -> StudentT:
    """Search for the optimum from the best of many guesses and describe the posterior there; see `find_optima`."""
    return find_optima(posterior, [rng], wanted)[0]


def find_optima(posterior: Posterior, rngs: Sequence[np.random.Generator], wanted: float = -np.inf) -> list[StudentT]:
    """Search for the optimum several times, each time from guesses of its own, and describe the posterior there.

    The searches know nothing of each other, but their points are computed side by side.  Where one came upon another
    optimum besides, not much lower than the best, that is its result: a mode that no ensemble starts from may be missed
    by all of them.

    Parameters
    ----------
    rngs : sequence of Generator
        Choose the guesses: each ensemble has its own, so that ensembles that meet have found the same optimum.
    wanted : float
        A log posterior below which the optimum is of no use, so that a search may be given up.

    Raises
    ------
    ImpossibleError
        If no guess of a search, or no end of any, has a finite posterior.
    """
    scale = np.array([prior.scale for prior in posterior.priors])
    points, steps = [], []
    for rng in rngs:
        u = posterior.guesses(rng, GUESSES)
        value = posterior.log_prob(u)
        if not np.isfinite(value).any():
            raise ImpossibleError(_IMPOSSIBLE)
        points.append(u[np.argsort(-value)[:STARTS]])
        # guesses lie as near as is known
        steps.append(np.minimum(u[np.isfinite(value)].std(axis=0) + 1e-3 * scale, scale))
    scales = np.repeat(steps, [len(p) for p in points], axis=0)
    ends = climb_side_by_side(posterior, np.concatenate(points), scales, wanted)
    height = posterior.log_prob(ends)
    if not np.isfinite(height).any():  # where a filter all but loses its way, rounding decides whether it does
        raise ImpossibleError(_IMPOSSIBLE)
    found: list[StudentT] = []
    first = 0
    for part in points:
        own = np.arange(first, first + len(part))
        best = own[np.argmax(height[own])]
        others = [i for i in own if height[i] > height.max() - WORTH_A_START and _elsewhere(ends[i], found)]
        centre, cholesky = _laplace(posterior, ends[max(others, key=height.__getitem__, default=best)], scale)
        found.append(StudentT(centre, cholesky * WIDEN))
        first += len(part)
    return found


def _elsewhere(u: FloatArray, found: Sequence[StudentT]) -> bool:
    """Whether a point is at none of these optima."""
    return all(one.distance(u[None])[0] > SAME_OPTIMUM**2 for one in found)


class Laplace(NamedTuple):
    """Log evidence by Laplace's approximation, and the log posterior at the optimum; -inf where there is none."""

    log_evidence: float = -np.inf
    top: float = -np.inf


def laplace_log_evidence(posterior: Posterior, rng: np.random.Generator, wanted: float = -np.inf) -> Laplace:
    """Log evidence by Laplace's approximation at the optimum, which may be given up where it lies below `wanted`.

    The prior mass of the joint constraint, of order one, is left out.
    """
    try:
        peak = find_optimum(posterior, rng, wanted)
    except ValueError:
        return Laplace()
    log_det = float(np.log(np.diag(peak.cholesky) / WIDEN).sum())
    top = float(posterior.log_prob(peak.centre[None])[0])
    return Laplace(top + 0.5 * peak.centre.size * np.log(2.0 * np.pi) + log_det, top)


def climb_side_by_side(
    posterior: Posterior, starts: FloatArray, scale: FloatArray, wanted: float = -np.inf
) -> FloatArray:
    """Climb from several points at once, each by itself, by the BFGS method on central differences.

    Parameters
    ----------
    starts, scale : (K, d) arrays
        Where to begin, of finite posterior, and the units of the search there.
    wanted : float
        A log posterior below which an end is of no use.

    Returns
    -------
    (K, d) array
        Where no component of the gradient exceeds `FLAT`, no step along the search's direction gains any more, many
        steps have gained next to nothing, or too little of what lacks to what is wanted.
    """
    count, d = starts.shape
    z, inverse = starts / scale, np.zeros((count, d, d))
    directions = _Directions(posterior)
    value, gradient, bend = _slopes(posterior, directions, z, scale)
    way, anew = np.empty((count, d)), np.zeros(count, dtype=bool)

    def begin(at: IntArray) -> None:
        """Trust nothing but the second derivatives here."""
        inverse[at] = np.eye(d) / np.maximum(bend[at], 1.0)[:, None, :]
        way[at] = -np.einsum("kij,kj->ki", inverse[at], gradient[at])
        anew[at] = True

    begin(np.arange(count))
    length = np.minimum(1.0, 1.0 / np.maximum(np.linalg.norm(way, axis=1), 1e-300))
    going = np.abs(gradient).max(axis=1) > FLAT
    mark, waited = value.copy(), np.zeros(count, dtype=int)  # what was last gained on, and steps since
    for _ in range(MOST_TRIALS):
        at = np.flatnonzero(going)
        if not at.size:
            break
        length[at] = np.minimum(length[at], LONGEST / np.maximum(np.abs(way[at]).max(axis=1), 1e-300))
        step = length[at, None] * way[at]
        slope = np.einsum("ki,ki->k", gradient[at], step)
        trial, there, bent_there = _slopes(posterior, directions, z[at] + step, scale[at])
        down = slope < 0.0  # not where differences across a wall have spoiled the curvature
        good = down & (trial <= value[at] + 1e-4 * slope)
        # where it failed, to the lowest point of the parabola through what is known
        bent = np.maximum(trial - value[at] - slope, np.maximum(np.abs(slope), 1e-300))
        shorter = np.maximum(-0.5 * slope / bent, 0.1)
        length[at] *= np.where(good, 1.0, shorter)
        stuck = at[~good & (~down | (np.abs(step).max(axis=1) < SHORTEST))]
        going[stuck[anew[stuck]]] = False
        begin(stuck)
        length[stuck] = 1.0
        moved, change, turned = at[good], step[good], there[good] - gradient[at[good]]
        z[moved], value[moved], gradient[moved] = z[moved] + change, trial[good], there[good]
        bend[moved], anew[moved] = bent_there[good], False
        _learn(inverse, moved, change, turned)
        way[moved] = -np.einsum("kij,kj->ki", inverse[moved], gradient[moved])
        length[moved] = 1.0
        going[moved] = np.abs(gradient[moved]).max(axis=1) > FLAT
        worth = np.maximum(STALLED, GIVES_UP * (value[at] + wanted))  # of what it lacks
        gained = value[at] < mark[at] - worth
        mark[at[gained]] = value[at[gained]]
        waited[at] = np.where(gained, 0, waited[at] + 1)
        going[at[waited[at] >= PATIENCE]] = False
    return z * scale


def _learn(inverse: FloatArray, at: IntArray, step: FloatArray, turned: FloatArray) -> None:
    """Update inverse curvatures by what the gradient turned along a step; where it bends the wrong way, not at all."""
    bend = np.einsum("ki,ki->k", step, turned)
    bent = bend > 1e-8 * np.linalg.norm(turned, axis=1) * np.linalg.norm(step, axis=1)
    at, step, turned, bend = at[bent], step[bent], turned[bent], bend[bent]
    pulled = np.einsum("kij,kj->ki", inverse[at], turned)
    stretch = (1.0 + np.einsum("ki,ki->k", turned, pulled) / bend) / bend
    cross = pulled[:, :, None] * step[:, None, :] / bend[:, None, None]
    inverse[at] += stretch[:, None, None] * step[:, :, None] * step[:, None, :] - cross - cross.swapaxes(1, 2)


class _Directions:
    """Directions of differences: of sets that are apart one coordinate each moves at once, and each set says its part.

    So the number of points does not grow with that of the sets.

    Attributes
    ----------
    along : (C, d) array of bool
        Coordinates that move in each direction: first those of no set, one by one.
    of : (d,) array
        The direction of each coordinate.
    part : (d,) array
        The column of `Posterior.log_parts` that knows it.
    """

    def __init__(self, posterior: Posterior) -> None:
        d = len(posterior.priors)
        self.part = np.zeros(d, dtype=int)
        for k, members in enumerate(posterior.apart, 1):
            self.part[members] = k
        shared = np.flatnonzero(self.part == 0)
        self.of = np.empty(d, dtype=int)
        for first, members in ((0, shared), *((shared.size, members) for members in posterior.apart)):
            self.of[members] = first + np.arange(members.size)
        self.along = self.of == np.arange(self.of.max() + 1)[:, None]

    def __len__(self) -> int:
        return len(self.along)

    def own(self, parts: FloatArray) -> FloatArray:
        """Of parts (..., C, 1 + sets) of points along each direction, that which knows each coordinate, (..., d)."""
        return np.asarray(parts[..., self.of, self.part])


def _slopes(
    posterior: Posterior, directions: _Directions, z: FloatArray, scale: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Minus the log posterior at points (K, d) in units of `scale`, (K,), its gradient and second derivatives, (K, d).

    By central differences.
    """
    (count, d), c = z.shape, len(directions)
    offsets = STEP * np.concatenate([np.zeros((1, d)), directions.along, -1.0 * directions.along])
    points = ((z[:, None, :] + offsets) * scale[:, None, :]).reshape(-1, d)
    value = np.concatenate([posterior.log_parts(part) for part in _in_portions(points)])
    value = np.nan_to_num(-value, nan=1e12, posinf=1e12).reshape(count, 2 * c + 1, -1)
    here, up, down = value[:, 0], directions.own(value[:, 1 : c + 1]), directions.own(value[:, c + 1 :])
    return here[:, 0], (up - down) / (2.0 * STEP), (up + down - 2.0 * here[:, directions.part]) / STEP**2


def _laplace(posterior: Posterior, u: FloatArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Refine the optimum by Newton steps; the Cholesky factor of the covariance is from the Hessian by differences."""
    directions = _Directions(posterior)
    for _ in range(3):
        step = _steps(posterior, directions, u, scale)
        top, gradient, hessian = _hessian(posterior, directions, u, step)
        curvature, axes = np.linalg.eigh(-hessian)
        # No direction is wider than the prior, none far steeper than the steps along the coordinates found.
        curvature = np.clip(curvature, np.square(axes.T * (step / scale)).sum(axis=1), STEEPEST)
        trial = u + (axes / curvature) @ axes.T @ gradient * step
        gain = posterior.log_prob(trial[None])[0] - top
        if not gain > 1e-3:
            break
        u = trial
    # By QR, which no condition of the matrix brings down.
    triangle = np.linalg.qr((axes / np.sqrt(curvature)).T, mode="r")
    return u, step[:, None] * (triangle * np.sign(np.diag(triangle))[:, None]).T


def _hessian(
    posterior: Posterior, directions: _Directions, u: FloatArray, step: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Log posterior at one point, its gradient (d,) and Hessian (d, d) in units of the step, by central differences."""
    first, second = np.triu_indices(len(directions))
    moves = 0.5 * step * directions.along
    corners = [a * moves[first] + b * moves[second] for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    points = u + np.concatenate([np.zeros((1, u.size)), *corners])
    value = np.concatenate([posterior.log_parts(part) for part in _in_portions(points)])
    top = value[0]
    value = np.where(np.isfinite(value), value, top - 50.0)
    pp, pm, mp, mm = value[1:].reshape(4, first.size, -1)
    # A coordinate with itself moves by a whole step, with another each by half of one.
    mixed = np.zeros((len(directions), len(directions), top.size))
    mixed[first, second] = mixed[second, first] = pp - pm - mp + mm
    slope = 0.5 * (pp - mm)[first == second]
    # What two coordinates have to do with each other is known by the set of either, but not by two sets.
    row, column = directions.part[:, None], directions.part
    known = np.maximum(row, column)
    met = (row == column) | (row == 0) | (column == 0)
    hessian = np.where(met, mixed[directions.of[:, None], directions.of, known], 0.0)
    return float(top[0]), directions.own(slope), hessian


def _in_portions(rows: FloatArray) -> list[FloatArray]:
    """Rows in portions of what is computed at once: a posterior keeps many numbers of each."""
    return np.array_split(rows, -(-len(rows) // AT_ONCE))


def _steps(posterior: Posterior, directions: _Directions, u: FloatArray, scale: FloatArray) -> FloatArray:
    """Find, for every coordinate by itself, the step that costs half a nat: the scale of the finite differences."""
    top = posterior.log_parts(u[None])[0, directions.part]
    step = 1e-2 * scale
    for _ in range(12):
        moves = step * directions.along
        up, down = (directions.own(posterior.log_parts(u + sign * moves)) for sign in (1.0, -1.0))
        cost = top - 0.5 * (up + down)
        # Half a nat at the step; a cost of zero or less asks for a longer step, an infinite one for a shorter.
        cost = np.clip(np.nan_to_num(cost, nan=1e3, posinf=1e3), 5e-3, 1e3)
        factor = np.clip(np.sqrt(0.5 / cost), 0.05, 10.0)
        step = np.minimum(step * factor, scale)
        if np.abs(np.log(factor)).max() < 0.3:
            break
    return np.asarray(step)
