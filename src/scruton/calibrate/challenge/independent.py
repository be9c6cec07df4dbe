r"""The amplitude equation of every candidate by least squares on the envelopes, as if their errors were independent.

With a over the middle test's stable amplitude, and structural damping :math:`\xi_i (1 + \delta_i)`,

.. math:: \dot a = -[\omega \xi_i (1 + \delta_i) + \alpha_r g] a + \beta_r h + \text{(what a candidate adds)}
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.envelopes import Envelopes

_STEPS, _TOLERANCE = 25, 1e-5
_FLOOR = 1e-3
_FAR = 1e6  # a residual that is out of hand


@dataclass(frozen=True, eq=False)
class State:
    """What a candidate's term may depend on: (P, R) arrays but for the (R,) ones of `envelopes`."""

    a: FloatArray
    place: FloatArray  # (R,): of the time in the record, -1/2 to 1/2
    aero: FloatArray  # linear aerodynamic rate
    drive: FloatArray
    envelopes: Envelopes


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
    """The bare equation, and a handful of effects, some in more than one form."""
    rigs, rate = len(e.damping), e.rate
    of_rig = np.eye(rigs)[e.rig]  # (R, rigs)
    in_wind = np.eye(len(e.wind))[:, e.wind]  # (R, winds)

    def power(k: int, wind: bool) -> Term:
        return lambda s, c: -c[:, :1] * rate * s.a**k * (e.aero if wind else 1.0)

    def coherence(s: State, c: FloatArray) -> FloatArray:
        return s.drive * (np.tanh(s.a / np.maximum(c[:, :1], 1e-3)) - 1.0)

    found = [
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
        found += [
            Candidate("coulomb_friction", lambda s, c: -(c @ of_rig.T) * rate, rigs),
            Candidate("reduced_velocity_drift", lambda s, c: c[:, :1] * e.velocity * (s.drive - s.aero * s.a), 1),
            Candidate(
                "reduced_velocity_drift",
                lambda s, c: e.velocity * (c[:, :1] * s.drive - c[:, 1:] * s.aero * s.a), 2,
            ),
            Candidate("sensor_gain_error", lambda s, c: s.drive * (c @ of_rig[:, 1:].T), rigs - 1),
        ]  # fmt: skip
    return tuple(found)


def criteria(e: Envelopes) -> dict[str, float]:
    """BIC of every effect, in its best form; errors independent, of one unknown variance."""
    table = candidates(e)
    free = Candidate("none", table[0].term, 0, believed=False)
    start = np.r_[np.zeros(len(e.damping)), 1.0, 2.0, [np.log(max(a[:3].mean(), _FLOOR)) for a in e.amplitude]]
    base, squares = _fit(e, free, start, 0.0)
    size = sum(a.size for a in e.amplitude)
    noise = np.sqrt(squares / size)
    bare, _ = _fit(e, table[0], base, noise)
    found: dict[str, float] = {}
    for one in table:
        own = np.full(one.size, max(float(a.max()) for a in e.amplitude) * 1.05 if one.reading else one.start)
        u, squares = _fit(e, one, np.r_[bare, own], noise)
        count = u.size - (len(e.damping) if one.believed else 0)
        bic = size * np.log(squares / size) + count * np.log(size)
        found[one.effect] = min(found.get(one.effect, np.inf), float(bic))
    return found


def _fit(e: Envelopes, one: Candidate, start: FloatArray, noise: float) -> tuple[FloatArray, float]:
    """Levenberg-Marquardt; returns the parameters and the sum of squares, that of the stated damping with it."""
    rigs, records = len(e.damping), len(e.time)
    shared = np.r_[np.arange(rigs + 2), np.arange(rigs + 2 + records, start.size)]
    grid = _Grid.of(e)
    weight = noise / e.damping_sd if one.believed else np.full(rigs, 1e-6)

    def residuals(u: FloatArray) -> FloatArray:
        """(P, n) of (P, parameters)."""
        path = grid.solve(e, one, u)
        return np.concatenate([(path - grid.amplitude)[:, grid.inside], u[:, :rigs] * weight], axis=1)

    u, damp = start.copy(), 1e-3
    r = residuals(u[None])[0]
    owner = np.broadcast_to(np.arange(records), grid.inside.shape)[grid.inside]
    for _ in range(_STEPS):
        step = 1e-5
        tries = np.repeat(u[None], shared.size + 1, axis=0)
        tries[np.arange(shared.size), shared] += step
        tries[-1, rigs + 2 : rigs + 2 + records] += step
        change = (residuals(tries) - r) / step
        J = np.zeros((r.size, u.size))
        J[:, shared] = change[:-1].T
        J[np.arange(owner.size), rigs + 2 + owner] = change[-1, : owner.size]
        H, g = J.T @ J, J.T @ r
        for _ in range(8):
            trial = u - np.linalg.solve(H + damp * np.diag(np.diag(H) + 1e-9), g)
            new = residuals(trial[None])[0]
            if np.abs(new).max() < _FAR and new @ new < r @ r:  # false for NaN, too
                break
            damp *= 8.0
        else:
            break
        gain = 1.0 - (new @ new) / (r @ r)
        u, r, damp = trial, new, damp / 5.0
        if gain < _TOLERANCE:
            break
    return u, float(r @ r)


@dataclass(frozen=True, eq=False)
class _Grid:
    """The cycles of all records side by side: (cycles, R), the shorter ones filled up."""

    step: FloatArray
    place: FloatArray
    amplitude: FloatArray
    inside: np.ndarray

    @classmethod
    def of(cls, e: Envelopes) -> "_Grid":
        longest, records = max(t.size for t in e.time), len(e.time)
        step, place, amplitude = (np.zeros((longest, records)) for _ in range(3))
        inside = np.zeros((longest, records), dtype=bool)
        for r, (t, a) in enumerate(zip(e.time, e.amplitude, strict=True)):
            step[1 : t.size, r] = np.diff(t)
            place[: t.size, r] = t / max(t[-1], 1e-9) - 0.5
            amplitude[: a.size, r], inside[: a.size, r] = a, True
        return cls(step, place, amplitude, inside)

    def solve(self, e: Envelopes, one: Candidate, u: FloatArray) -> FloatArray:
        """Readings of (P, parameters): (P, cycles, R), by the midpoint rule from cycle to cycle."""
        rigs, records = len(e.damping), len(e.time)
        structural = (e.omega * e.damping[e.rig]) * (1.0 + u[:, :rigs][:, e.rig])
        aero = u[:, rigs, None] * e.rate * e.aero
        drive = u[:, rigs + 1, None] * e.rate * e.drive
        a, own = np.exp(np.clip(u[:, rigs + 2 : rigs + 2 + records], -20.0, 7.0)), u[:, rigs + 2 + records :]
        path = np.empty((len(u), *self.step.shape))
        path[:, 0] = a

        def rate(x: FloatArray, place: FloatArray) -> FloatArray:
            total: FloatArray = -(structural + aero) * x + drive + one.term(State(x, place, aero, drive, e), own)
            return total

        with np.errstate(all="ignore"):
            for k in range(1, len(self.step)):
                h, place = self.step[k], self.place[k]
                middle = np.clip(a + 0.5 * h * rate(a, place), _FLOOR, 1e3)
                a = np.clip(a + h * rate(middle, place), _FLOOR, 1e3)
                path[:, k] = a
            if one.reading:
                level = np.maximum(own[:, :1, None], 1e-2)
                path /= (1.0 + (path / level) ** 12) ** (1.0 / 12.0)
        return path
