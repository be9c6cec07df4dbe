r"""A hypothesis - the bare model with some effects in it - and its Laplace evidence by Fisher scoring.

All records depend on a hypothesis through innovations v and variances S of the filter.  Their derivatives J are taken
by central differences; a parameter that has one value per rig, test or record is moved in all of them at once, since
records do not share it.  The Fisher information J'J/S + (dS)'(dS)/2S^2 plus the prior's precision is positive, whatever
the point, so that scoring with a damped step climbs from anywhere; it is the curvature of Laplace's approximation, too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import Channels
from scruton.dynamics.effects.terms import Parameter, Variant
from scruton.dynamics.extended import channel_innovations
from scruton.gap.bare import BareModel

_STEP = 1e-4
_LOG_2PI = float(np.log(2.0 * np.pi))
_DAMPING = (1.0, 0.3, 0.05)


@dataclass(frozen=True, eq=False)
class Weighed:
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

    def value(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Mode and standard deviation of a parameter in its sampled coordinate, (members,) each."""
        where = self.hypothesis.places[name]
        return self.mode[where], np.sqrt(np.diag(self.covariance))[where]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The bare model and some variants of effects."""

    bare: BareModel
    variants: tuple[Variant, ...] = ()

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, those of variants renamed by their order."""
        renamed = [
            Parameter(f"{i}:{p.name}", p.location, p.scale, p.members, p.log, p.positive, p.unit, p.starts)
            for i, variant in enumerate(self.variants)
            for p in variant.parameters
        ]
        return (*self._bare_parameters, *renamed)

    @cached_property
    def _bare_parameters(self) -> tuple[Parameter, ...]:
        return self.bare.parameters

    @cached_property
    def places(self) -> dict[str, slice]:
        """Slice of each parameter in the vector."""
        found, start = {}, 0
        for one in self.parameters:
            found[one.name] = slice(start, start + one.size)
            start += one.size
        return found

    @cached_property
    def size(self) -> int:
        """Number of coordinates."""
        return sum(one.size for one in self.parameters)

    @cached_property
    def prior(self) -> tuple[FloatArray, FloatArray]:
        """Locations and scales, (d,) each."""
        location, scale = [], []
        data = self.bare.data
        for one in self.parameters:
            centre = np.full(one.size, one.location)
            width = np.full(one.size, one.scale)
            if one.name == "damping":
                width = np.array([data.damping_sd[data.layout.rig[one.members == j][0]] for j in range(one.size)])
            elif one.name == "mass":
                width = np.array([max(data.mass_sd[one.members == j][0], 1e-6) for j in range(one.size)])
            elif one.name in ("scatter", "phase_scatter"):
                # In still air nothing pushes the amplitude about but draughts.
                still = np.array([not data.layout.wind[one.members == j].any() for j in range(one.size)])
                centre = np.where(still, np.log(3e-4), centre)
            location.append(centre)
            scale.append(width)
        return np.concatenate(location), np.concatenate(scale)

    @cached_property
    def _logarithmic(self) -> np.ndarray:
        return np.concatenate([np.full(one.size, one.log) for one in self.parameters])

    def start(self) -> FloatArray:
        """The prior's centre, (d,)."""
        found = self.prior[0].copy()
        for one in self.parameters:
            if one.name[0].isdigit() and not one.log:
                found[self.places[one.name]] = one.starts[0]
        return found

    def table(self, u: FloatArray) -> FloatArray:
        """Coefficients, (W, R, COLUMNS), from coordinates (W, d)."""
        values = {}
        for one in self.parameters:
            part = u[:, self.places[one.name]]
            natural = np.exp(np.clip(part, -60.0, 60.0)) if one.log else part
            padded = np.concatenate([natural, np.zeros((len(u), 1))], axis=1)
            values[one.name] = padded[:, one.members]
        table = self.bare.table(values)
        layout = self.bare.data.layout
        for i, variant in enumerate(self.variants):
            mine = {p.name: values[f"{i}:{p.name}"] for p in variant.parameters}
            variant.apply(table, mine, layout)
        return table

    def innovations(self, u: FloatArray, data: Channels | None = None) -> tuple[FloatArray, FloatArray]:
        """Innovations and variances, (W, 3 N) each."""
        return channel_innovations(self.bare.data.channels if data is None else data, self.table(u))

    def log_prior(self, u: FloatArray) -> FloatArray:
        """Normalised log prior density, (W,)."""
        location, scale = self.prior
        z = (u - location) / scale
        density: FloatArray = -0.5 * np.sum(z * z, axis=1) - np.log(scale).sum() - 0.5 * scale.size * _LOG_2PI
        return density

    def log_prob(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log likelihood and log prior, (W,) each."""
        v, s = self.innovations(u)
        with np.errstate(all="ignore"):
            like = -0.5 * np.sum(v * v / s + np.log(s) + _LOG_2PI, axis=1)
        return np.where(np.isfinite(like), like, -np.inf), self.log_prior(u)

    def derivatives(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Innovations and log variances at a point, (3 N,) each, and derivatives by parameter, (P, 3 N) each.

        Row i holds, for every cycle, the derivative in that value of parameter i which the cycle's record takes.
        """
        scale = self.prior[1] * _STEP
        moves = np.zeros((len(self.parameters), self.size))
        width = np.empty((len(self.parameters), len(self.bare.data.layout.records)))
        for i, one in enumerate(self.parameters):
            own = scale[self.places[one.name]]
            moves[i, self.places[one.name]] = own
            width[i] = 2.0 * np.r_[own, 1.0][one.members]
        v, s = self.innovations(np.concatenate([u[None], u + moves, u - moves]))
        count = len(self.parameters)
        s = np.log(s)
        width = width[:, np.tile(self.bare.data.channels.record, 3)]
        jv, js = (v[1 : count + 1] - v[count + 1 :]) / width, (s[1 : count + 1] - s[count + 1 :]) / width
        return v[0], s[0], jv, js

    @cached_property
    def _blocks(self) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]:
        """For every record: its cycles in all channels, the parameters that it takes, and their coordinates."""
        record, size = self.bare.data.channels.record, self.bare.data.channels.size
        found = []
        for r in range(len(self.bare.data.layout.records)):
            cycles = np.flatnonzero(record == r)
            rows = np.array([i for i, one in enumerate(self.parameters) if one.members[r] >= 0])
            where = np.array([self.places[self.parameters[i].name].start + self.parameters[i].members[r] for i in rows])
            found.append((np.concatenate([cycles, cycles + size, cycles + 2 * size]), rows, where))
        return tuple(found)

    def scores(self, u: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Log posterior, gradient (d,) and Fisher information with the prior's precision (d, d)."""
        v, log_s, jv, js = self.derivatives(u)
        location, scale = self.prior
        weight = np.exp(-log_s)
        gradient = -(u - location) / scale**2
        fisher = np.diag(1.0 / scale**2)
        pull, spread = v * weight, 1.0 - v * v * weight
        for cycles, rows, where in self._blocks:
            a, b = jv[np.ix_(rows, cycles)], js[np.ix_(rows, cycles)]
            gradient[where] -= a @ pull[cycles] + 0.5 * b @ spread[cycles]
            fisher[np.ix_(where, where)] += (a * weight[cycles]) @ a.T + 0.5 * b @ b.T
        value = -0.5 * float(np.sum(v * pull + log_s + _LOG_2PI)) + float(self.log_prior(u[None])[0])
        return value, gradient, fisher

    def fit(self, start: FloatArray | None = None, *, iterations: int = 40) -> Weighed:
        """Climb to the optimum and apply Laplace's approximation there.

        Parameters
        ----------
        start : (d,) array, optional
            The centre of the prior by default.
        iterations : int
            At most so many steps.
        """
        u = self.start() if start is None else start.copy()
        value, gradient, fisher = self.scores(u)
        mu = 0.0
        for _ in range(iterations):
            diagonal = np.diag(np.diag(fisher))
            steps = [np.linalg.solve(fisher + m * diagonal, gradient) for m in (mu, 10.0 * mu + 0.3, 100.0 * mu + 10.0)]
            limit = np.where(self._logarithmic, 1.5, 5.0 * self.prior[1] + np.abs(u - self.prior[0]))
            steps = [np.clip(s, -limit, limit) for s in steps]
            trials = u + np.array([*steps, 0.3 * steps[0], 0.05 * steps[2]])
            like, prior = self.log_prob(trials)
            total = like + prior
            best = int(np.argmax(total))
            gain = total[best] - value
            if not gain > 0.0:
                if mu > 1e3:
                    break
                mu = 100.0 * mu + 30.0
                continue
            u = trials[best]
            mu = (0.0, 0.1 * mu, mu, mu, 10.0 * mu + 1.0)[best]
            value, gradient, fisher = self.scores(u)
            if gain < 5e-3:
                break
        return self.laplace(u, fisher)

    def laplace(self, u: FloatArray, fisher: FloatArray) -> Weighed:
        """Evidence from the optimum and the curvature there."""
        like, prior = (float(x[0]) for x in self.log_prob(u[None]))
        covariance = np.linalg.inv(fisher)
        _, logdet = np.linalg.slogdet(fisher)
        evidence = like + prior + 0.5 * u.size * _LOG_2PI - 0.5 * float(logdet)
        sd = np.sqrt(np.diag(covariance))
        for one in self.parameters:
            if one.positive:
                where = self.places[one.name]
                evidence += float(np.sum(np.log(2.0) + log_ndtr(u[where] / sd[where])))
        return Weighed(self, u, covariance, like, prior, evidence)

    def extended(self, *more: Variant) -> "Hypothesis":
        """Add variants."""
        return Hypothesis(self.bare, (*self.variants, *more))

    def start_from(self, base: FloatArray, start: Mapping[str, FloatArray]) -> FloatArray:
        """Coordinates that continue those of a smaller hypothesis, the last variant's parameters at `start`."""
        found = np.concatenate([base, np.zeros(self.size - base.size)])
        last = len(self.variants) - 1
        for name, values in start.items():
            found[self.places[f"{last}:{name}"]] = values
        return found
