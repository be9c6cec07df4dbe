"""Diagnoses to beat: each from a campaign's envelopes alone, none with a model of what the scatter does to them.

Each takes a case's folder and gives the fields of gap.json that it can: run them as
`run_challenge(folder, Execution(out), BASELINES[name])` and score them as any other.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter
from scipy.special import logsumexp
from scipy.stats import chi2

from scruton.arrays import FloatArray
from scruton.calibrate.thresholds import CHI_SQUARE_BINS, CHI_SQUARE_LEVEL, CYCLES_OF_A_BIN, SPARSE_COEFFICIENT
from scruton.campaign import load_campaign
from scruton.gap.data import load_gap

_POWERS = (0, 1, 2, 3, 5)
_EVALUATIONS, _TOLERANCE = 50, 1e-5
_STEP = 1e-5  # of a parameter, for the slopes
_FLOOR = 1e-3


@dataclass(frozen=True, eq=False)
class Envelopes:
    """What a baseline sees: one entry a record (R), or a rig where that is said."""

    time: tuple[FloatArray, ...]  # s
    amplitude: tuple[FloatArray, ...]  # over the middle test's last ones
    rig: np.ndarray
    direction: np.ndarray  # 1 growth, -1 decay, 0 otherwise
    wind: np.ndarray  # bool
    omega: FloatArray  # rad/s
    aero: FloatArray  # linear aerodynamic damping and drive over those of the middle test, for one Y1 and epsilon
    drive: FloatArray
    velocity: FloatArray  # reduced velocity less the mean, over half its range; zero where it does not differ
    damping: FloatArray  # of the rigs, as stated
    damping_sd: FloatArray  # relative

    @property
    def rate(self) -> float:
        """A relaxation rate to measure others by [1/s]: the damping of a typical rig, twice."""
        return float(2.0 * np.median(self.omega) * np.median(self.damping))


def load_envelopes(folder: Path) -> Envelopes:
    """Load a campaign and demodulate it; damping that is not stated is left to 0.4 per cent, give or take all of it."""
    data = load_gap(load_campaign(folder))
    layout = data.layout
    wind = layout.wind
    cycles = [data.cycles[name] for name in layout.records]
    scale = float(np.median(cycles[data.middle].amplitude[-10:])) if data.middle >= 0 else float(layout.largest.max())
    speed = np.where(wind, layout.reduced_velocity, np.nan)
    spread = np.ptp(speed[wind]) / 2.0 if wind.any() else 0.0
    place = (speed - np.mean(speed[wind])) / spread if spread > 0.0 else np.zeros(len(wind))
    return Envelopes(
        time=tuple(record.time - record.time[0] for record in cycles),
        amplitude=tuple(record.amplitude / scale for record in cycles),
        rig=layout.rig,
        direction=layout.direction,
        wind=wind,
        omega=layout.omega,
        aero=data.aero_ratio,
        drive=data.drive_ratio,
        velocity=np.where(wind, place, 0.0),
        damping=np.where(np.isfinite(data.damping), data.damping, 0.004),
        damping_sd=data.damping_sd,
    )


def bic(folder: Path) -> dict[str, Any]:
    r"""BIC of least-squares fits to the envelopes, as if their errors were independent; knows no `unknown`.

    The amplitude equation of every candidate, with a over the middle test's stable amplitude, and structural damping
    :math:`\xi_i (1 + \delta_i)`, is

    .. math:: \dot a = -[\omega \xi_i (1 + \delta_i) + \alpha_r g] a + \beta_r h + \text{(what a candidate adds)}

    Of the catalogue it lacks `stiffness_nonlinearity` and `vortex_shedding_forcing`.
    """
    e = load_envelopes(folder)
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
        extra = np.full(candidate.size, level if candidate.reading else candidate.start)
        u, squares = _fit(e, candidate, np.r_[null, extra], noise)
        count = u.size - (len(e.damping) if candidate.believed else 0)
        criterion = float(size * np.log(squares / size) + count * np.log(size))
        best[candidate.effect] = min(best.get(candidate.effect, np.inf), criterion)
    logs = np.array([-0.5 * value for value in best.values()])
    probability = dict(zip(best, np.exp(logs - logsumexp(logs)).tolist(), strict=True))
    return _gap(max(probability, key=probability.__getitem__), probability)


def sparse(folder: Path) -> dict[str, Any]:
    """Sparse regression of da/dt on 1, a, a^2, a^3, a^5, in still air and in wind (STLSQ: Brunton et al., PNAS 2016).

    A constant in still air is friction, a power structural nonlinearity, a linear part beyond the stated damping an
    error of that; powers in wind are aerodynamic nonlinearity. The strongest has it; no probability.
    """
    e = load_envelopes(folder)
    # Largest coefficient of each effect at a = 1 over the relaxation rate there, after thresholding.
    rows, values = [], []
    for r, (t, a) in enumerate(zip(e.time, e.amplitude, strict=True)):
        window = min(11, (t.size - 1) // 2 * 2 + 1)
        if window < 5:
            continue
        smooth = savgol_filter(a, window, 2)
        slope = savgol_filter(a, window, 2, deriv=1, delta=float(np.median(np.diff(t))))
        library = np.stack([smooth**k for k in _POWERS], axis=1)
        scale = np.array([e.drive[r], *[e.aero[r]] * (len(_POWERS) - 1)]) if e.wind[r] else np.zeros(len(_POWERS))
        inner = slice(window // 2, t.size - window // 2)
        rows.append(np.hstack([library, library * scale])[inner])
        values.append((slope + e.omega[r] * e.damping[e.rig[r]] * smooth)[inner])
    X, y = np.vstack(rows), np.concatenate(values)
    n = len(_POWERS)
    drive, linear = n, n + 1  # in wind: the null model itself
    law = np.isin(np.arange(2 * n), (drive, linear))
    active = np.any(X != 0.0, axis=0)
    for _ in range(10):
        c = np.zeros(2 * n)
        c[active] = np.linalg.lstsq(X[:, active], y, rcond=None)[0]
        rate = max(abs(float(c[drive])), e.rate)  # n = -1: the drive at the stable amplitude is the relaxation rate
        keep = active & ((np.abs(c) >= SPARSE_COEFFICIENT * rate) | law)
        if np.array_equal(keep, active):
            break
        active = keep
    still, wind = np.split(np.abs(c) / rate, 2)
    groups = {
        "coulomb_friction": still[:1],
        "structural_damping_error": still[1:2],
        "structural_damping_nonlinearity": still[2:],
        "aerodynamic_damping_nonlinearity": wind[2:],
    }
    size = {name: float(group.max()) for name, group in groups.items()}
    name = max(size, key=size.__getitem__)
    return _gap(name if size[name] > 0.0 else "none", {})


def chi_square(folder: Path) -> dict[str, Any]:
    """Chi-square of the null model against the binned damping curves: `none` or `unknown`, no probability."""
    e = load_envelopes(folder)
    rigs = len(e.damping)
    rows, values = [], []
    for r, (t, a) in enumerate(zip(e.time, e.amplitude, strict=True)):
        # In stretches of a record: amplitude, damping rate -d ln a/dt from cycle to cycle, and its standard error.
        decrement = -np.diff(np.log(np.maximum(a, 1e-9))) / np.diff(t)
        for part in np.array_split(np.arange(decrement.size), min(CHI_SQUARE_BINS, max(decrement.size // 5, 1))):
            if part.size < CYCLES_OF_A_BIN:
                continue
            se = max(float(decrement[part].std(ddof=1)) / np.sqrt(part.size), 1e-9)
            # The law has a part in 1/a: its mean is that of 1/a.
            x, y = float(1.0 / np.mean(1.0 / a[part])), float(decrement[part].mean())
            row = np.zeros(rigs + 2)
            row[e.rig[r]] = e.omega[r] * e.damping[e.rig[r]]
            if e.wind[r]:
                row[rigs:] = e.aero[r], -e.drive[r] / x
            rows.append(row / se)
            values.append((y - row[e.rig[r]]) / se)
    prior = np.hstack([np.diag(1.0 / e.damping_sd), np.zeros((rigs, 2))])
    X, y = np.vstack([*rows, prior]), np.r_[values, np.zeros(rigs)]
    if not e.wind.any():
        X = X[:, :rigs]
    misfit = float(np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2))
    return _gap("unknown" if chi2.sf(misfit, len(values) - X.shape[1] + rigs) < CHI_SQUARE_LEVEL else "none", {})


def _gap(verdict: str, probability: dict[str, float]) -> dict[str, Any]:
    groups = [] if verdict in ("none", "unknown") else [[verdict]]
    return {
        "format": 1, "verdict": verdict, "also": [], "probability": probability, "indistinguishable": groups,
        "where": [], "shrink": {}, "effects": {}, "advice": [],
    }  # fmt: skip


class State(NamedTuple):
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
    if rigs > 2:
        table.append(
            Candidate("setting_dependence", lambda s, c: (c @ of_rig[:, 1:].T) * (s.drive - s.aero * s.a), rigs - 1)
        )
    return tuple(table)


def _fit(e: Envelopes, candidate: Candidate, start: FloatArray, noise: float) -> tuple[FloatArray, float]:
    """Least squares; returns the parameters and the sum of squares, that of the stated damping with it."""
    rigs, records = len(e.damping), len(e.time)
    releases = slice(rigs + 2, rigs + 2 + records)  # parameters that move a record of their own alone
    shared = np.delete(np.arange(start.size), releases)
    amplitude = _columns(e.amplitude)
    inside = _columns(np.ones(t.size) for t in e.time) > 0.0
    owner = np.nonzero(inside)[1]
    steps = _columns(np.diff(t, prepend=t[0]) for t in e.time)
    positions = _columns(t / max(t[-1], 1e-9) - 0.5 for t in e.time)
    weight = noise / e.damping_sd if candidate.believed else np.full(rigs, 1e-6)

    def residuals(u: FloatArray) -> FloatArray:
        """(P, n) of (P, parameters)."""
        misfit = (_path(e, candidate, steps, positions, u) - amplitude)[:, inside]
        return np.concatenate([misfit, u[:, :rigs] * weight], axis=1)

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


def _columns(rows: Iterable[FloatArray]) -> FloatArray:
    """The cycles of all records side by side: (cycles, R), the shorter ones filled up."""
    each = list(rows)
    longest = max(row.size for row in each)
    return np.stack([np.pad(row, (0, longest - row.size)) for row in each], axis=1)


def _path(e: Envelopes, candidate: Candidate, steps: FloatArray, positions: FloatArray, u: FloatArray) -> FloatArray:
    """Readings of (P, parameters): (P, cycles, R), by the midpoint rule over steps and positions, (cycles, R)."""
    rigs, records = len(e.damping), len(e.time)
    structural = (e.omega * e.damping[e.rig]) * (1.0 + u[:, :rigs][:, e.rig])
    aero = u[:, rigs, None] * e.rate * e.aero
    drive = u[:, rigs + 1, None] * e.rate * e.drive
    a, extra = np.exp(np.clip(u[:, rigs + 2 : rigs + 2 + records], -20.0, 7.0)), u[:, rigs + 2 + records :]
    path = np.empty((len(u), *steps.shape))
    path[:, 0] = a

    def rate(x: FloatArray, place: FloatArray) -> FloatArray:
        total: FloatArray = -(structural + aero) * x + drive + candidate.term(State(x, place, aero, drive), extra)
        return total

    with np.errstate(all="ignore"):
        for k in range(1, len(steps)):
            h, place = steps[k], positions[k]
            middle = np.clip(a + 0.5 * h * rate(a, place), _FLOOR, 1e3)
            a = np.clip(a + h * rate(middle, place), _FLOOR, 1e3)
            path[:, k] = a
        if candidate.reading:
            level = np.maximum(extra[:, :1, None], 1e-2)
            path /= (1.0 + (path / level) ** 12) ** (1.0 / 12.0)
    return path


BASELINES = {"bic": bic, "sparse": sparse, "chi-square": chi_square}
