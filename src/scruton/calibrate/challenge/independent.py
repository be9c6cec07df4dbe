r"""The amplitude equation of every candidate by least squares on the envelopes, as if their errors were independent.

With a over the middle test's stable amplitude, and structural damping :math:`\xi_i (1 + \delta_i)`,

.. math:: \dot a = -[\omega \xi_i (1 + \delta_i) + \alpha_r g] a + \beta_r h + \text{(what a candidate adds)}
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.envelopes import Envelopes

_EVALUATIONS, _TOLERANCE = 50, 1e-5
_STEP = 1e-5  # of a parameter, for the slopes
_FLOOR = 1e-3


@dataclass(frozen=True, eq=False)
class State:
    """What a candidate's term may depend on, (P, R) arrays."""

    a: FloatArray
    place: FloatArray  # (R,): of the time in the record, -1/2 to 1/2
    aero: FloatArray  # linear aerodynamic rate
    drive: FloatArray


Term = Callable[[State, FloatArray], FloatArray]  # (P, K) own parameters to (P, R) rates


@dataclass(frozen=True)
class Candidate:
    """One amplitude equation: `size` own parameters that start at `start`, and whether stated damping is believed."""

    effect: str
    term: Term
    size: int
    start: float = 0.0
    believed: bool = True
    reading: bool = False  # the first parameter is the level at which the reading is clipped


def candidates(e: Envelopes) -> tuple[Candidate, ...]:
    """The null model, and a handful of effects, some in more than one form."""
    rigs, rate = len(e.damping), e.rate
    of_rig = np.eye(rigs)[e.rig]  # (R, rigs)
    in_wind = np.eye(len(e.wind))[:, e.wind]  # (R, winds)

    def power(k: int, wind: bool) -> Term:
        return lambda s, c: -c[:, :1] * rate * s.a**k * (e.aero if wind else 1.0)

    def coherence(s: State, c: FloatArray) -> FloatArray:
        return s.drive * (np.tanh(s.a / np.maximum(c[:, :1], 1e-3)) - 1.0)

    table = [
        Candidate("none", lambda s, c: 0.0 * s.a, 0),
        Candidate("coulomb_friction", lambda s, c: -c[:, :1] * rate + 0.0 * s.a, 1),
        Candidate("structural_damping_nonlinearity", power(2, False), 1),
        Candidate("structural_damping_nonlinearity", power(3, False), 1),
        Candidate("structural_damping_error", lambda s, c: 0.0 * s.a, 0, believed=False),
        Candidate("aerodynamic_damping_nonlinearity", power(2, True), 1),
        Candidate("aerodynamic_damping_nonlinearity", power(3, True), 1),
        Candidate("spanwise_coherence_loss", coherence, 1, 0.15),
        Candidate("fluid_memory", lambda s, c: -c[:, :1] * rate * e.direction * s.a, 1),
        Candidate("wind_speed_drift", lambda s, c: s.drive * s.place * (c @ in_wind.T), int(e.wind.sum())),
        Candidate("sensor_clipping", lambda s, c: 0.0 * s.a, 1, 1.0, reading=True),
    ]
    if rigs > 1:
        table += [
            Candidate("coulomb_friction", lambda s, c: -(c @ of_rig.T) * rate, rigs),
            Candidate("reduced_velocity_drift", lambda s, c: c[:, :1] * e.velocity * (s.drive - s.aero * s.a), 1),
            Candidate(
                "reduced_velocity_drift",
                lambda s, c: e.velocity * (c[:, :1] * s.drive - c[:, 1:] * s.aero * s.a), 2,
            ),
            Candidate("sensor_gain_error", lambda s, c: s.drive * (c @ of_rig[:, 1:].T), rigs - 1),
        ]  # fmt: skip
    return tuple(table)


def criteria(e: Envelopes) -> dict[str, float]:
    """BIC of every effect, in its best form; errors independent, of one unknown variance."""
    table = candidates(e)
    free = Candidate("none", table[0].term, 0, believed=False)
    start = np.r_[np.zeros(len(e.damping)), 1.0, 2.0, [np.log(max(a[:3].mean(), _FLOOR)) for a in e.amplitude]]
    base, squares = _fit(e, free, start, 0.0)
    size = sum(a.size for a in e.amplitude)
    noise = np.sqrt(squares / size)
    null, _ = _fit(e, table[0], base, noise)
    best: dict[str, float] = {}
    for candidate in table:
        level = max(float(a.max()) for a in e.amplitude) * 1.05
        own = np.full(candidate.size, level if candidate.reading else candidate.start)
        u, squares = _fit(e, candidate, np.r_[null, own], noise)
        count = u.size - (len(e.damping) if candidate.believed else 0)
        bic = float(size * np.log(squares / size) + count * np.log(size))
        best[candidate.effect] = min(best.get(candidate.effect, np.inf), bic)
    return best


def _fit(e: Envelopes, candidate: Candidate, start: FloatArray, noise: float) -> tuple[FloatArray, float]:
    """Least squares; returns the parameters and the sum of squares, that of the stated damping with it."""
    rigs, records = len(e.damping), len(e.time)
    releases = slice(rigs + 2, rigs + 2 + records)  # parameters that move a record of their own alone
    shared = np.delete(np.arange(start.size), releases)
    grid = _Grid.of(e)
    owner = np.nonzero(grid.inside)[1]
    weight = noise / e.damping_sd if candidate.believed else np.full(rigs, 1e-6)

    def residuals(u: FloatArray) -> FloatArray:
        """(P, n) of (P, parameters)."""
        path = grid.solve(e, candidate, u)
        return np.concatenate([(path - grid.amplitude)[:, grid.inside], u[:, :rigs] * weight], axis=1)

    def jacobian(u: FloatArray) -> FloatArray:
        tries = np.repeat(u[None], shared.size + 2, axis=0)
        tries[np.arange(shared.size), shared] += _STEP
        tries[-2, releases] += _STEP
        r = residuals(tries)
        change = (r[:-1] - r[-1]) / _STEP
        J = np.zeros((r.shape[1], u.size))
        J[:, shared] = change[:-1].T
        J[np.arange(owner.size), releases.start + owner] = change[-1, : owner.size]
        return J

    fit = least_squares(  # type: ignore[call-overload]
        lambda u: residuals(u[None])[0], start, jacobian, x_scale="jac", ftol=_TOLERANCE, max_nfev=_EVALUATIONS
    )
    return fit.x, 2.0 * float(fit.cost)


@dataclass(frozen=True, eq=False)
class _Grid:
    """The cycles of all records side by side: (cycles, R), the shorter ones filled up."""

    step: FloatArray
    place: FloatArray
    amplitude: FloatArray
    inside: np.ndarray

    @classmethod
    def of(cls, e: Envelopes) -> "_Grid":
        def columns(rows: Iterable[FloatArray]) -> FloatArray:
            return np.stack([np.pad(row, (0, longest - row.size)) for row in rows], axis=1)

        longest = max(t.size for t in e.time)
        return cls(
            columns(np.diff(t, prepend=t[0]) for t in e.time),
            columns(t / max(t[-1], 1e-9) - 0.5 for t in e.time),
            columns(e.amplitude),
            columns(np.ones(t.size) for t in e.time) > 0.0,
        )

    def solve(self, e: Envelopes, candidate: Candidate, u: FloatArray) -> FloatArray:
        """Readings of (P, parameters): (P, cycles, R), by the midpoint rule from cycle to cycle."""
        rigs, records = len(e.damping), len(e.time)
        structural = (e.omega * e.damping[e.rig]) * (1.0 + u[:, :rigs][:, e.rig])
        aero = u[:, rigs, None] * e.rate * e.aero
        drive = u[:, rigs + 1, None] * e.rate * e.drive
        a, own = np.exp(np.clip(u[:, rigs + 2 : rigs + 2 + records], -20.0, 7.0)), u[:, rigs + 2 + records :]
        path = np.empty((len(u), *self.step.shape))
        path[:, 0] = a

        def rate(x: FloatArray, place: FloatArray) -> FloatArray:
            total: FloatArray = -(structural + aero) * x + drive + candidate.term(State(x, place, aero, drive), own)
            return total

        with np.errstate(all="ignore"):
            for k in range(1, len(self.step)):
                h, place = self.step[k], self.place[k]
                middle = np.clip(a + 0.5 * h * rate(a, place), _FLOOR, 1e3)
                a = np.clip(a + h * rate(middle, place), _FLOOR, 1e3)
                path[:, k] = a
            if candidate.reading:
                level = np.maximum(own[:, :1, None], 1e-2)
                path /= (1.0 + (path / level) ** 12) ** (1.0 / 12.0)
        return path
