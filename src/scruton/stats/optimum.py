"""The optimum of a posterior and the Student-t there: the start of every ensemble."""

import numpy as np
from scipy.optimize import minimize

from scruton.arrays import FloatArray, IntArray
from scruton.stats.posterior import Posterior
from scruton.stats.student_t import StudentT
from scruton.stats.thresholds import WIDEN


class ImpossibleError(ValueError):
    """No point of the prior has a finite likelihood."""


STEEPEST = 1e4  # curvature, where half a nat is lost in one step of a coordinate
AT_ONCE = 4096  # points of a posterior that are computed side by side: of 40 rigs, 12 MB of coordinates
STEP = 1e-4  # of the finite differences, in units of the search's own scale


def find_optimum(posterior: Posterior, rng: np.random.Generator, guesses: int = 256, starts: int = 3) -> StudentT:
    """Search for the optimum from the best of many guesses and describe the posterior there.

    Parameters
    ----------
    rng : Generator
        Chooses the guesses: each ensemble has its own, so that ensembles that meet have found the same optimum.
    guesses, starts : int
        Points looked at, and how many of the best are climbed from.

    Raises
    ------
    ImpossibleError
        If no guess has a finite posterior.
    """
    u = posterior.guesses(rng, guesses)
    value = posterior.log_prob(u)
    if not np.isfinite(value).any():
        raise ImpossibleError(
            "no point of the prior has a finite likelihood: the record contradicts the model card's priors"
        )
    scale = np.array([prior.scale for prior in posterior.priors])
    order = np.argsort(-value)[:starts]
    best, best_value = u[order[0]], value[order[0]]
    steps = np.minimum(u[np.isfinite(value)].std(axis=0) + 1e-3 * scale, scale)  # guesses lie as near as is known
    for start in u[order]:
        climbed = _climb(posterior, start, steps)
        height = float(posterior.log_prob(climbed[None])[0])
        if height > best_value:
            best, best_value = climbed, height
    centre, cholesky = _laplace(posterior, best, scale)
    return StudentT(centre, cholesky * WIDEN)


def laplace_log_evidence(posterior: Posterior, rng: np.random.Generator) -> float:
    """Log evidence by Laplace's approximation at the optimum; -inf where no guess has a finite posterior.

    The prior mass of the joint constraint, of order one, is left out.
    """
    try:
        peak = find_optimum(posterior, rng)
    except ValueError:
        return -np.inf
    log_det = float(np.log(np.diag(peak.cholesky) / WIDEN).sum())
    return float(posterior.log_prob(peak.centre[None])[0] + 0.5 * peak.centre.size * np.log(2.0 * np.pi) + log_det)


def _climb(posterior: Posterior, start: FloatArray, scale: FloatArray) -> FloatArray:
    def objective(z: FloatArray) -> tuple[float, FloatArray]:
        """Value and central-difference gradient in one vectorised call."""
        d = z.size
        points = np.concatenate([z[None], z + STEP * np.eye(d), z - STEP * np.eye(d)]) * scale
        value = np.nan_to_num(-posterior.log_prob(points), nan=1e12, posinf=1e12)
        return float(value[0]), (value[1 : d + 1] - value[d + 1 :]) / (2 * STEP)

    result = minimize(objective, start / scale, jac=True, method="BFGS", options={"gtol": 1e-2, "maxiter": 200})
    end: FloatArray = result.x * scale
    return end if np.isfinite(posterior.log_prob(end[None])[0]) else start


def _laplace(posterior: Posterior, u: FloatArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Refine the optimum by Newton steps; the Cholesky factor of the covariance is from the Hessian by differences."""
    d = u.size
    first, second = _pairs(posterior, d)
    row = 1 + 4 * np.arange(first.size)
    signs = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
    for _ in range(3):
        step = _steps(posterior, u, scale)
        offsets = np.zeros((1 + 4 * first.size, d))
        for k, (of_first, of_second) in enumerate(signs):
            offsets[row + k, first] += of_first * step[first]
            offsets[row + k, second] += of_second * step[second]
        value = np.concatenate([posterior.log_prob(u + 0.5 * part) for part in _parts(offsets)])
        top = value[0]
        value = np.where(np.isfinite(value), value, top - 50.0)
        pp, pm, mp, mm = value[1:].reshape(-1, 4).T
        # In units of the step: i == j moves by a whole one, i != j by half of each.
        hessian, gradient = np.zeros((d, d)), np.empty(d)
        hessian[first, second] = hessian[second, first] = pp - pm - mp + mm
        same = first == second
        gradient[first[same]] = 0.5 * (pp - mm)[same]
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


def _pairs(posterior: Posterior, d: int) -> tuple[IntArray, IntArray]:
    """Pairs of coordinates, each and itself among them, whose mixed derivative need not be zero: linear in the sets."""
    owner = np.full(d, -1)
    for k, members in enumerate(posterior.apart):
        owner[members] = k
    first, second = np.triu_indices(d)
    met = (owner[first] == owner[second]) | (owner[first] < 0) | (owner[second] < 0)
    return first[met], second[met]


def _parts(rows: FloatArray) -> list[FloatArray]:
    """Rows in parts of what is computed at once: a posterior keeps many numbers of each."""
    return np.array_split(rows, -(-len(rows) // AT_ONCE))


def _steps(posterior: Posterior, u: FloatArray, scale: FloatArray) -> FloatArray:
    """Find, for every coordinate by itself, the step that costs half a nat: the scale of the finite differences."""
    d = u.size
    top = posterior.log_prob(u[None])[0]
    step = 1e-2 * scale
    for _ in range(12):
        points = np.concatenate([u + np.diag(step), u - np.diag(step)])
        value = posterior.log_prob(points)
        cost = top - 0.5 * (value[:d] + value[d:])
        # Half a nat at the step; a cost of zero or less asks for a longer step, an infinite one for a shorter.
        cost = np.clip(np.nan_to_num(cost, nan=1e3, posinf=1e3), 5e-3, 1e3)
        factor = np.clip(np.sqrt(0.5 / cost), 0.05, 10.0)
        step = np.minimum(step * factor, scale)
        if np.abs(np.log(factor)).max() < 0.3:
            break
    return np.asarray(step)
