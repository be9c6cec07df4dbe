r"""A hypothesis - the null model with some effects in it - and its Laplace evidence by Fisher scoring.

All records depend on a hypothesis through innovations v and variances S of the filter.  Their derivatives J are taken
by forward differences from the point itself, whose pass of the filter they share; a parameter that has one value per
rig, test or record is moved in all of them at once, since records do not share it.  The Fisher information
J'J/S + (dS)'(dS)/2S^2 plus the prior's precision is positive, whatever the point; it is the curvature of Laplace's
approximation, too.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Parameter, Variant
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.extended import channel_innovations
from scruton.dynamics.limit_cycle import limit_cycle_amplitude, transferred
from scruton.dynamics.reading import readings
from scruton.gap.blocks import Block, blocks, by_channel
from scruton.gap.data import GapData
from scruton.gap.null_model import NullModel
from scruton.gap.thresholds import LOST
from scruton.stats.fisher_scoring import climb, inverse
from scruton.stats.student_t import StudentT
from scruton.stats.thresholds import WIDEN

_STEP = 1e-4
_FREEDOM = 8.0  # degrees of freedom of proposals
_CHUNK = 100  # points whose filters run side by side
_LOG_2PI = float(np.log(2.0 * np.pi))
_LOST_OR_NOT = np.errstate(all="ignore")  # where the filter loses its way nothing is finite, and that is told by it


@dataclass(frozen=True, eq=False)
class FittedHypothesis:
    """A hypothesis at its optimum.

    Attributes
    ----------
    mode : (d,) array
        Sampled coordinates.
    covariance : (d, d) array
        Of Laplace's approximation.
    log_likelihood, log_prior, log_evidence : float
    """

    hypothesis: "Hypothesis"
    mode: FloatArray
    covariance: FloatArray
    log_likelihood: float
    log_prior: float
    log_evidence: float

    @property
    def is_lost(self) -> bool:
        """Whether its evidence is no number."""
        return self.log_evidence <= LOST

    def value(self, name: str, variant: int | None = None) -> tuple[FloatArray, FloatArray]:
        """Mode and standard deviation of a parameter in its sampled coordinate, (members,) each."""
        where = self.hypothesis.slices[variant, name]
        return self.mode[where], np.sqrt(np.diag(self.covariance))[where]

    @property
    def table(self) -> FloatArray:
        """Coefficients at the optimum, (R, COLUMNS)."""
        table: FloatArray = self.hypothesis.table(self.mode[None])[0]
        return table

    def proposal(self) -> StudentT:
        """Laplace's approximation a little wider, with heavier tails: what draws of the posterior start from."""
        return StudentT(self.mode, np.linalg.cholesky(self.covariance) * WIDEN, _FREEDOM)

    def with_variants(
        self, *variants: Variant, start: Mapping[str, FloatArray] | None = None, iterations: int = 40,
        enough: float = 0.0,
    ) -> "FittedHypothesis":  # fmt: skip
        """Add variants and fit from this optimum, the last one's parameters from `start` (zero by default)."""
        larger = self.hypothesis.extended(*variants)
        return larger.fit(larger.start_from(self.mode, start or {}), iterations=iterations, enough=enough)

    def slopes(
        self, function: Callable[[FloatArray], FloatArray], fraction: float, at: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """A function of the table of coefficients at the optimum, and its slopes by central differences.

        Parameters
        ----------
        function : callable
            (W, ...) from tables (W, R, COLUMNS).
        fraction : float
            Of a coordinate's standard deviation, that a step is.
        at : (k,) array of int, optional
            Coordinates; all by default.

        Returns
        -------
        value : (...) array
        slopes : (k, ...) array
        """
        where = np.arange(self.mode.size) if at is None else at
        step = fraction * np.sqrt(np.diag(self.covariance))[where]
        moves = np.zeros((where.size, self.mode.size))
        moves[np.arange(where.size), where] = step
        points = np.concatenate([self.mode[None], self.mode + moves, self.mode - moves])
        values = function(self.hypothesis.table(points))
        up, down = values[1 : where.size + 1], values[where.size + 1 :]
        return values[0], (up - down) / (2.0 * step.reshape((-1,) + (1,) * (up.ndim - 1)))


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The null model and some variants of effects."""

    null: NullModel
    variants: tuple[Variant, ...] = ()

    @property
    def data(self) -> GapData:
        """What it is fitted to."""
        return self.null.data

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, those of variants with the place of their variant as owner."""
        owned = [replace(p, owner=i) for i, variant in enumerate(self.variants) for p in variant.parameters]
        return (*self.null.parameters, *owned)

    @cached_property
    def slices(self) -> dict[tuple[int | None, str], slice]:
        """Where each parameter, by its key, stands in the vector of coordinates."""
        slices, start = {}, 0
        for parameter in self.parameters:
            slices[parameter.key] = slice(start, start + parameter.size)
            start += parameter.size
        return slices

    @cached_property
    def places(self) -> np.ndarray:
        """Coordinate of every parameter that each record takes, (P, R); -1: none."""
        starts = [(p.members, self.slices[p.key].start) for p in self.parameters]
        return np.array([np.where(members >= 0, start + members, -1) for members, start in starts])

    @cached_property
    def size(self) -> int:
        """Number of coordinates."""
        return sum(parameter.size for parameter in self.parameters)

    def _of_each(self, name: str) -> np.ndarray:
        """A property of the parameters by coordinate, (d,)."""
        return np.concatenate([np.broadcast_to(getattr(p, name), p.size) for p in self.parameters])

    @cached_property
    def prior(self) -> tuple[FloatArray, FloatArray]:
        """Locations and scales, (d,) each."""
        return self._of_each("location"), self._of_each("scale")

    @cached_property
    def _logarithmic(self) -> np.ndarray:
        """Whether each coordinate is a logarithm, (d,) of bool."""
        return self._of_each("log")

    @cached_property
    def positive(self) -> np.ndarray:
        """Whether the prior of each coordinate is cut at zero, (d,) of bool."""
        return self._of_each("positive")

    def start(self) -> FloatArray:
        """The prior's centre, (d,); of variants, where their search begins."""
        u = self.prior[0].copy()
        for parameter in self.parameters:
            if parameter.owner is not None and not parameter.log:
                u[self.slices[parameter.key]] = parameter.starts[0]
        return u

    def table(self, u: FloatArray) -> FloatArray:
        """Coefficients, (W, R, COLUMNS), from coordinates (W, d)."""
        values: dict[int | None, dict[str, FloatArray]] = {owner: {} for owner in (None, *range(len(self.variants)))}
        natural = np.where(self._logarithmic, np.exp(np.clip(u, -60.0, 60.0)), u)
        natural = np.append(natural, np.zeros((len(u), 1)), axis=1)
        for parameter, of_records in zip(self.parameters, natural.T[self.places], strict=True):
            values[parameter.owner][parameter.name] = of_records.T
        table = self.null.table(values[None])
        for i, variant in enumerate(self.variants):
            variant.apply(table, values[i], self.data.layout)
        return table

    @property
    def seen(self) -> float:
        """Log likelihood ratio of what no channel holds, over the null model [nats]."""
        return sum(variant.seen for variant in self.variants)

    def innovations(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Innovations and variances, (W, 3 N) each."""
        return channel_innovations(self.data.channels, self.table(u))

    def log_prior(self, u: FloatArray) -> FloatArray:
        """Normalised log prior density, (W,)."""
        location, scale = self.prior
        z = (u - location) / scale
        density: FloatArray = -0.5 * np.sum(z * z, axis=1) - np.log(scale).sum() - 0.5 * scale.size * _LOG_2PI
        return density

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """Log likelihood, (W,), not finite where the filter fails."""
        v, s = self.innovations(u)
        with np.errstate(all="ignore"):
            return np.asarray(-0.5 * np.sum(v * v / s + np.log(s) + _LOG_2PI, axis=1))

    def log_prob(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log likelihood and log prior, (W,) each."""
        like = self.log_likelihood(u)
        return np.where(np.isfinite(like), like, -np.inf), self.log_prior(u)

    def log_density(self, u: FloatArray) -> FloatArray:
        """Log likelihood, with all that is seen, and prior at points (N, d), (N,).

        Priors that are cut at zero have twice their density.
        """
        parts = [sum(self.log_prob(u[i : i + _CHUNK])) for i in range(0, len(u), _CHUNK)]
        inside = (u[:, self.positive] > 0.0).all(axis=1)
        constant = np.count_nonzero(self.positive) * np.log(2.0) + self.seen
        return np.where(inside, np.concatenate(parts) + constant, -np.inf)

    def inside(self, u: FloatArray) -> FloatArray:
        """Points (N, d) moved to where every prior that is cut at zero has density."""
        return np.where(self.positive, np.abs(u) + 1e-6, u)

    def derivatives(self, u: FloatArray) -> tuple[FloatArray, FloatArray, list[tuple[FloatArray, FloatArray]]]:
        """Innovations and variances at a point, (3 N,) each, and their derivatives, by record.

        Of each record those of innovations and of log variances by the parameters that it takes, (k, 3 n) each.
        """
        v, s = self.innovations(np.concatenate([u[None], u + self._moves]))
        widths, told = self._moves.sum(axis=0), []
        for block in self.blocks:
            per_step, count = 1.0 / widths[block.where, None, None], block.rows.size
            a, b = (by_channel(values)[..., block.cycles] for values in (v, s))
            of_v, of_s = (a[block.rows + 1] - a[0]) * per_step, (b[block.rows + 1] / b[0] - 1.0) * per_step
            told.append((of_v.reshape(count, -1), of_s.reshape(count, -1)))
        return v[0], s[0], told

    @cached_property
    def _moves(self) -> FloatArray:
        """Steps of the differences by parameter, of all that it is to rigs, tests or records at once, (P, d)."""
        moves = np.zeros((len(self.parameters), self.size))
        for row, where in zip(moves, self.slices.values(), strict=True):
            row[where] = self.prior[1][where] * _STEP
        return moves

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Every record's."""
        return blocks(self.places, self.data.channels.record)

    def add_scores(
        self, u: FloatArray, gradient: FloatArray, fisher: FloatArray, *, deaf: int | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Add what the records tell to a gradient (d,) and an information (d, d), one of the three channels not heard.

        Returns innovations, log variances and inverse variances at the point, (3 N,) each.
        """
        v, s, told = self.derivatives(u)
        weight = 1.0 / s
        root = np.sqrt(weight)
        pull, spread = v * root, 0.5 * (1.0 - v * v * weight)
        for block, (a, b) in zip(self.blocks, told, strict=True):
            if deaf is not None:
                by_channel(a)[:, deaf] = by_channel(b)[:, deaf] = 0.0
            a *= block.of(root)
            gradient[block.where] -= a @ block.of(pull) + b @ block.of(spread)
            fisher[block.square] += a @ a.T + 0.5 * (b @ b.T)
        return v, np.log(s), weight

    @_LOST_OR_NOT
    def scores(self, u: FloatArray, *, deaf: int | None = None) -> tuple[float, FloatArray, FloatArray]:
        """Log posterior, gradient (d,) and Fisher information with the prior's precision (d, d).

        Gradient and information are those of the other two where one of the three channels is not heard.
        """
        location, scale = self.prior
        gradient, fisher = -(u - location) / scale**2, np.diag(1.0 / scale**2)
        v, log_s, weight = self.add_scores(u, gradient, fisher, deaf=deaf)
        value = -0.5 * float(np.sum(v * (v * weight) + log_s + _LOG_2PI)) + float(self.log_prior(u[None])[0])
        return value, gradient, fisher

    def fit(self, start: FloatArray | None = None, *, iterations: int = 40, enough: float = 0.0) -> FittedHypothesis:
        """Climb to the optimum and apply Laplace's approximation there.

        Parameters
        ----------
        start : (d,) array, optional
            The centre of the prior by default.
        iterations, enough : int and float
            At most so many steps; none where a full one foretells a gain of less than so many nats.
        """
        location, scale = self.prior

        def log_prob(points: FloatArray) -> FloatArray:
            return np.asarray(sum(self.log_prob(points)))

        # where the filter loses its way nothing leads on
        first = self.start() if start is None or not np.isfinite(log_prob(start[None])[0]) else start.copy()
        for _ in range(2):
            u, (_, _, fisher) = climb(
                self.scores, log_prob, first, iterations=iterations, enough=enough,
                limit=lambda u: np.where(self._logarithmic, 1.5, 5.0 * scale + np.abs(u - location)),
            )  # fmt: skip
            if np.array_equal(first := self._upright(u), u):
                break
        return self.laplace(u, fisher)

    def _upright(self, u: FloatArray) -> FloatArray:
        """The same point, with forces that came out less than none as what they are: of half a turn later, (d,)."""
        u = u.copy()
        for i, variant in enumerate(self.variants):
            size, phase = (next((p for p in variant.parameters if p.name == name), None) for name in ("size", "phase"))
            if size is not None and size.positive and phase is not None:
                at = self.slices[i, "size"]
                less = (size.members >= 0) & (u[at][size.members] < 0.0)
                turned = self.slices[i, "phase"].start + np.unique(phase.members[less])
                u[turned] -= np.copysign(np.pi, u[turned])
                u[at] = np.abs(u[at])
        return u

    @_LOST_OR_NOT
    def laplace(self, u: FloatArray, fisher: FloatArray) -> FittedHypothesis:
        """Evidence from the optimum and the curvature there; a prior cut at zero counts by the posterior above it.

        Where the optimum lies below that zero the normal approximation has to hold as far as zero: the evidence is no
        more than what it is from the posterior there.
        """
        like, prior = (float(x[0]) for x in self.log_prob(u[None]))
        covariance = inverse(fisher, self.prior[1])
        evidence = like + self.seen + prior + 0.5 * u.size * _LOG_2PI - 0.5 * float(np.linalg.slogdet(fisher)[1])
        sd = np.sqrt(np.diag(covariance))
        for where in (self.slices[p.key] for p in self.parameters if p.positive):
            evidence += float(np.sum(np.log(2.0) + log_ndtr(u[where] / sd[where])))
        if (below := np.flatnonzero(self.positive & (u < 0.0))).size:
            pull = np.linalg.solve(covariance[np.ix_(below, below)], -u[below])
            there, prior_there = (float(x[0]) for x in self.log_prob((u + covariance[:, below] @ pull)[None]))
            evidence += min(there + prior_there - 0.5 * float(u[below] @ pull) - (like + prior), 0.0)
        return FittedHypothesis(self, u, covariance, like, prior, evidence if np.isfinite(evidence) else LOST)

    def extended(self, *more: Variant) -> "Hypothesis":
        """Add variants."""
        return Hypothesis(self.null, (*self.variants, *more))

    def start_from(self, base: FloatArray, start: Mapping[str, FloatArray]) -> FloatArray:
        """Coordinates that continue those of a smaller hypothesis, the last variant's parameters at `start`."""
        u = np.concatenate([base, np.zeros(self.size - base.size)])
        for name, values in start.items():
            u[self.slices[len(self.variants) - 1, name]] = values
        return u

    def stable_amplitude(
        self,
        u: FloatArray,
        record: int,
        *,
        scruton_number: float | None = None,
        bridge: bool = False,
        reading: bool = False,
    ) -> FloatArray:
        """Stable amplitude of a test of the campaign.

        Parameters
        ----------
        u : (W, d) array
            Coordinates, one row a draw.
        record : int
            A record in wind of that test, by its number in the layout.
        scruton_number : float, optional
            At this Scruton number, by other structural damping in the same rig and wind, in place of the rig's own.
            Another rig's damping is given so, too; an error of the rig's own stated damping goes with that damping.
        bridge : bool
            Without friction, gain and all else that does not go to a bridge: see `dynamics.limit_cycle.transferred`.
        reading : bool
            As the sensor reads it, gain and saturation included.

        Returns
        -------
        (W,) array
            A/D or rad; 0 where the motion dies out, inf where it grows without end.
        """
        data, layout = self.data, self.data.layout
        table = self.table(u)[:, record]
        if scruton_number is not None:
            damping = float(scruton_number * data.nominal_damping[record] / layout.scruton_number[record])
            table[:, Term.STRUCTURAL] = layout.omega[record] * damping
        if bridge:
            table = transferred(table)
        amplitude = limit_cycle_amplitude(table, data.channels.knots, layout.reference_amplitude)
        if reading:
            return np.where(np.isfinite(amplitude) & (amplitude > 0.0), readings(table, amplitude), amplitude)
        return amplitude
