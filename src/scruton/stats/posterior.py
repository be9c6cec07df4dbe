"""What is sampled: coordinates and priors by name, and a log likelihood over an array of walkers."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from scruton.arrays import FloatArray, IntArray
from scruton.stats.priors import Prior

_LOG_2PI = float(np.log(2.0 * np.pi))


class Block(NamedTuple):
    """Coordinates that are sampled together, and those of the others on which they depend.

    `part` is the column of `Posterior.log_parts` that knows them.  Blocks that follow each other, each with a part of
    its own, are moved at once; the whole is that of a block that moves by itself, so many `times` in a row.  Where it
    has one member, coordinates that lie about that may be `carried`: they move by as much, and keep their distances.
    A block without which the others find everything, only more slowly, may be moved by `chance`.  One is `unread` whose
    members the records are not read for: the likelihoods stay as they are.
    """

    members: IntArray
    given: IntArray
    part: int = 0
    times: int = 1
    carried: IntArray = np.arange(0)
    chance: float = 1.0
    unread: bool = False


class Values:
    """Coordinates by name: `values["damping_ratio"]` is a view of its column (...), or of its columns (..., members).

    Assigning to a name writes into the array.  Made by `Coordinates.of`.
    """

    def __init__(self, u: FloatArray, columns: Mapping[str, int | slice]) -> None:
        self._u, self._columns = u, columns

    def __getitem__(self, name: str) -> FloatArray:
        column: FloatArray = self._u[..., self._columns[name]]
        return column

    def __setitem__(self, name: str, value: FloatArray) -> None:
        self._u[..., self._columns[name]] = value


class Coordinates(dict[str, int | slice]):
    """Where each parameter stands among the sampled coordinates, in the order given.

    Parameters
    ----------
    members : mapping
        By name, the number of members of a parameter that has one coordinate for each of them (a rig, a test, a
        record), which stand side by side; None for a parameter with a single coordinate.
    start : int
        Column of the first parameter.

    Examples
    --------
    >>> layout = Coordinates({"stable_amplitude": None, "damping": 3})
    >>> layout["stable_amplitude"], layout["damping"], layout.size
    (0, slice(1, 4, None), 4)
    """

    def __init__(self, members: Mapping[str, int | None], start: int = 0) -> None:
        super().__init__()
        self.start = self.stop = start
        for name, count in members.items():
            self[name] = self.stop if count is None else slice(self.stop, self.stop + count)
            self.stop += 1 if count is None else count

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.stop - self.start

    def of(self, u: FloatArray) -> Values:
        """Coordinates by name, from an array with them on its last axis."""
        return Values(u, self)


class Posterior(ABC):
    """A log posterior over sampled coordinates u, (W, d), vectorised over walkers."""

    priors: tuple[Prior, ...]

    @cached_property
    def _normal_priors(self) -> tuple[FloatArray, FloatArray, float] | None:
        """Locations, scales and log normalisation where every prior is normal in its sampled coordinate."""
        if any(prior.family.endswith("uniform") for prior in self.priors):
            return None
        location, scale = (np.array([getattr(prior, key) for prior in self.priors]) for key in ("location", "scale"))
        return location, scale, float(-np.log(scale).sum() - 0.5 * scale.size * np.log(2.0 * np.pi))

    def log_prior(self, u: FloatArray) -> FloatArray:
        """Log prior density without the joint constraint, (W,)."""
        if self._normal_priors is None:
            return np.asarray(self.log_prior_terms(u).sum(axis=1))
        location, scale, constant = self._normal_priors
        z = (u - location) / scale
        return np.asarray(constant - 0.5 * np.einsum("ij,ij->i", z, z))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the columns."""
        return tuple(prior.name for prior in self.priors)

    @cached_property
    def coordinates(self) -> Coordinates:
        """Where each parameter stands among the columns: one for each prior unless a model has vectors."""
        return Coordinates(dict.fromkeys(self.names))

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Coordinates that are sampled together, given the others; by default all are at once."""
        return (Block(np.arange(len(self.priors)), np.arange(0)),)

    def named(self, u: FloatArray) -> Values:
        """Coordinates by name, from an array with them on its last axis."""
        return self.coordinates.of(u)

    def prior(self, name: str) -> Prior:
        """Prior of a parameter by its name."""
        return self.priors[self.names.index(name)]

    @property
    def apart(self) -> tuple[IntArray, ...]:
        """Sets of coordinates that, given those in none of the sets, are independent of each other; none by default.

        A model that has them says what each is worth: `log_parts`.
        """
        return ()

    def log_parts(self, u: FloatArray) -> FloatArray:
        """Log posterior, and what of it the coordinates of each set of `apart` have a say in, (W, 1 + sets).

        What the first column is -inf for may lie in one set alone: the columns of the others then say what they are
        worth, unless it is what they share that is impossible.
        """
        return self.log_prob(u)[:, None]

    def assess(self, u: FloatArray, told: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """`log_parts`, and the log likelihood of each set of `apart`, (W, sets), as far as the model tells them.

        Where walkers have moved in what is `unread` alone, what it said of them before is `told`.
        """
        parts = self.log_parts(u)
        return parts, np.zeros((len(u), parts.shape[1] - 1))

    @abstractmethod
    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """Log likelihood, (W,)."""

    def inside(self, u: FloatArray) -> np.ndarray:
        """Whether each walker satisfies the joint constraint of the model, (W,) of bool."""
        return np.ones(len(u), dtype=bool)

    def log_prior_terms(self, u: FloatArray) -> FloatArray:
        """Log prior of every parameter, (W, d)."""
        if self._normal_priors is None:
            return np.stack([prior.log_density(u[:, i]) for i, prior in enumerate(self.priors)], axis=1)
        location, scale, _ = self._normal_priors
        z = (u - location) / scale
        return np.asarray(-0.5 * (z * z + _LOG_2PI) - np.log(scale))

    def log_prob(self, u: FloatArray) -> FloatArray:
        """Log posterior up to a constant, (W,); -inf outside the support, never NaN."""
        total = self.log_prior(u)
        alive = np.isfinite(total) & self.inside(u)
        if not alive.all():
            total[~alive] = -np.inf
            if not alive.any():
                return total
        like = np.full_like(total, -np.inf)
        with np.errstate(all="ignore"):
            like[alive] = self.log_likelihood(u if alive.all() else u[alive])
        total += np.where(np.isfinite(like), like, -np.inf)
        return total

    def prior_sample(self, rng: np.random.Generator, size: int) -> tuple[FloatArray, np.ndarray]:
        """Draws from the prior, (size, d), and whether each lies within the constraint, (size,) of bool."""
        u = np.stack([prior.draw(rng, size) for prior in self.priors], axis=1)
        return u, self.inside(u)

    def prior_draws(self, rng: np.random.Generator, size: int) -> FloatArray:
        """Draws from the prior within the constraint, (size, d)."""
        kept: list[FloatArray] = []
        count = 0
        while count < size:
            u, inside = self.prior_sample(rng, size)
            kept.append(u[inside])
            count += len(kept[-1])
        return np.concatenate(kept)[:size]

    def guesses(self, rng: np.random.Generator, size: int) -> FloatArray:
        """Starting points of the search for the optimum, (size, d): the prior's unless the model knows better."""
        return self.prior_draws(rng, size)

    def natural(self, u: FloatArray) -> dict[str, FloatArray]:
        """Parameters in their own units, by name, from coordinates with the parameters on the last axis."""
        return {prior.name: prior.from_sampled(u[..., i]) for i, prior in enumerate(self.priors)}
