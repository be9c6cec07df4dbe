"""Which uncertainty matters: Sobol' shares of the variance of the damping that is needed, and of the amplitude."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.sizing.model import SOURCES, ModeModel

POINTS = 1 << 12


@dataclass(frozen=True)
class Share:
    """What one source contributes to a variance.

    Attributes
    ----------
    source : str
    first, total : float
        First-order index (alone), and total index (with all its interactions).
    """

    source: str
    first: float
    total: float


def shares(
    model: ModeModel, limit: float, *, added: float = 0.0, seed: int = 0, points: int = POINTS
) -> dict[str, tuple[Share, ...]]:
    """Sobol' indices, by quantity ("needed", "amplitude" with `added` damping), the largest total first.

    The section's posterior is one source: its amplitude and relaxation are correlated and cannot be told apart.
    An amplitude beyond ten times the limit counts as ten times.
    """

    def needed(u: FloatArray) -> FloatArray:
        return np.clip(model.draws(u).needed(limit), -1.0, 1.0)

    def amplitude(u: FloatArray) -> FloatArray:
        return np.minimum(model.draws(u).amplitude(added), 10.0 * limit)

    return {
        "needed": sobol_shares(model, needed, seed, points),
        "amplitude": sobol_shares(model, amplitude, seed, points),
    }


def sobol_shares(
    model: ModeModel, function: Callable[[FloatArray], FloatArray], seed: int, points: int
) -> tuple[Share, ...]:
    """Sobol' indices of a function of the unit cube."""
    from scipy.stats import sobol_indices, uniform

    sources = model.uncertain()
    fixed = np.full(len(SOURCES), 0.5)
    if len(sources) == 1:
        return (Share(SOURCES[sources[0]], 1.0, 1.0),)

    def of(rows: FloatArray) -> FloatArray:
        flat = rows.reshape(len(sources), -1)
        u = np.tile(fixed, (flat.shape[1], 1))
        u[:, list(sources)] = np.clip(flat.T, 1e-9, 1.0 - 1e-9)
        return function(u).reshape(1, *rows.shape[1:])

    cube: Any = [uniform()] * len(sources)
    indices = sobol_indices(func=of, n=points, dists=cube, rng=np.random.default_rng([seed, 0x50B0]))
    rows = [
        Share(SOURCES[source], float(first), float(total))
        for source, first, total in zip(sources, indices.first_order.ravel(), indices.total_order.ravel(), strict=True)
    ]
    if not all(np.isfinite([row.first, row.total]).all() for row in rows):
        # the same in every draw: there is no variance to share
        rows = [Share(row.source, 0.0, 0.0) for row in rows]
    return tuple(sorted(rows, key=lambda row: -row.total))
