"""The likelihoods at fixed points on fixed series.

The one place among the goldens that knows where a function lives: after a move, only the imports below change.
"""

from typing import Any

import numpy as np

from scruton.campaign import load_campaign
from scruton.dynamics.cycles import Channels, EnvelopeData
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.extended import channel_innovations
from scruton.dynamics.likelihood import innovations, log_likelihood, pointwise_log_likelihood
from scruton.dynamics.trial_filter import trial_log_likelihood
from scruton.envelope.types import Cycles
from scruton.gap.data import load_gap
from scruton.gap.density import density, posterior_at_mode
from scruton.gap.hypothesis import Hypothesis
from scruton.gap.null_model import null_model
from scruton.infer.smooth import Observations, SpeedPoint, SpeedPosterior
from scruton.infer.steady import gust_log_odds, phase_noise, steady_posterior
from scruton.stats.priors import Prior
from tests.goldens.capture import Room
from tests.goldens.others import simulated

PERIOD, A_STAR, RATE, ERROR = 0.125, 0.05, 0.3, 0.0008
PARAMETERS = ("stable_amplitude", "relaxation_ratio", "amplitude_scatter", "noise_factor", "damping_ratio")
POINTS, CYCLES = 10, 90
LAWS = (-1.0, -0.5, 0.0, 1.0, 2.0, 3.0)


def wobble(size: int, start: int = 0) -> np.ndarray:
    """A rule in place of noise: numbers between -1 and 1 that repeat nowhere, from no generator."""
    return 2.0 * (((np.arange(size) + 1.0 + start) * 0.6180339887498949) % 1.0) - 1.0


def around(centre: float, spread: float, which: int) -> np.ndarray:
    """Points about a value, on a logarithmic scale."""
    return np.asarray(centre * np.exp(spread * wobble(POINTS, 17 * which)))


def series(a_star: float = A_STAR) -> np.ndarray:
    """A decay, then a growth, each 45 cycles, with some scatter."""
    t = PERIOD * np.arange(CYCLES // 2)
    decay, growth = 0.06 * np.exp(-RATE * t), -0.045 * np.exp(-RATE * t)
    return np.asarray(a_star + np.r_[decay, growth] + 0.0015 * wobble(CYCLES))


def envelope(first: int = 0, last: int = CYCLES, a_star: float = A_STAR) -> EnvelopeData:
    """The series as two records, with two gaps."""
    gap = np.zeros(CYCLES)
    gap[[0, CYCLES // 2]] = -1.0
    gap[20], gap[70] = 2 * PERIOD, 0.7
    cut = slice(first, last)
    return EnvelopeData(
        series(a_star)[cut], ERROR * (1.0 + 0.3 * wobble(CYCLES, 5))[cut], gap[cut], np.full(CYCLES, PERIOD)[cut],
        (PERIOD * np.arange(CYCLES))[cut], np.repeat(["decay", "growth"], CYCLES // 2)[cut],
    )  # fmt: skip


def state_space() -> dict[str, Any]:
    """Every law: the fast filter, the plain one, a law of its own for every walker, and still air."""
    theta = tuple(around(c, 0.4, i) for i, c in enumerate((A_STAR, RATE, 0.003, 1.0)))
    found: dict[str, Any] = {}
    for n in LAWS:
        v, s = innovations(envelope(), *theta, n=n, initial_sd=0.3)
        plain = pointwise_log_likelihood(v, s)
        found[f"n={n:g}"] = {
            "log likelihood": log_likelihood(envelope(), *theta, n=n, initial_sd=0.3).tolist(),
            "plain": plain.sum(axis=0).tolist(),
            "innovations": v[::11, 0].tolist(),
            "variances": s[::11, 0].tolist(),
        }
    own = log_likelihood(envelope(), *theta, n=np.linspace(-1.0, 3.0, POINTS))
    still = log_likelihood(envelope(0, CYCLES // 2, 0.0), np.zeros(POINTS), *theta[1:])
    return found | {"each its own law": own.tolist(), "still air": still.tolist()}


def trial() -> list[float]:
    """The second-order exponential on the first record."""
    rates = (-around(1e-3, 0.5, 4), -around(RATE, 0.4, 2))
    more = (around(0.002, 0.4, 5), around(0.5, 0.4, 6), around(1.0, 0.2, 7))
    return list(trial_log_likelihood(envelope(0, CYCLES // 2), (*rates, *more), (0.0, 0.3)).tolist())


# Coefficients of which each row of the table of terms has one beside the bare law's.
TERMS: tuple[dict[str, float], ...] = (
    {},
    {"STRUCTURAL": 0.1, "STRUCTURAL_LINEAR": 0.8, "STRUCTURAL_SQUARE": 5.0},
    {"FRICTION": 0.002, "FRICTION_WIDTH": 0.004},
    {"AERO_LINEAR": 0.5, "AERO_SQUARE": 9.0, "AERO_FOURTH": 50.0},
    {"COHERENCE": 0.02},
    {"TREND": 0.05, "TREND_SINE": 0.04, "TREND_DRIVE": 0.03},
    {"LAG": 0.4, "LAG_KIND": 0.0, "LAG_START": 0.5},
    {"LAG": 0.4, "LAG_KIND": 1.0, "LAG_START": 1.0},
    {"FORCE_COS": 0.001, "FORCE_SIN": 0.002, "FORCE_RATE": 0.7},
    {"FORCE_COS": 0.02, "FORCE_SIN": 0.03, "FORCE_RATE": 0.7, "FORCE_TWICE": 1.0},
    {"GAIN": 0.04, "CLIP": 0.08},
    {"CLIP": 0.005, "CLIP_SOFT": -2.0},
    {"CLIP": 0.005, "CLIP_SOFT": -3.0},
    {"CLIP": 0.09, "CLIP_SOFT": 4.5},
    {"CLIP": 0.09, "CLIP_SOFT": 1.0},
    {"CLIP": 0.09, "CLIP_SOFT": 2.0},
    {"DETUNING": 0.002, "STIFFNESS": 0.8, "STIFFNESS_LINEAR": 0.03, "THIRD": 0.01},
    {"JUMP": 0.2, "JUMP_TIME": 3.0, "JUMP_RATE": 0.02},
    {"LINE_COS": 0.001, "LINE_SIN": 0.002, "LINE_RATE": 1.3, "LINE_DECAY": 0.1},
    {"HAT": 0.05},
    {"WARMING": 0.2, "WARMING_PACE": 2.0},
    {"STRUCTURAL_RISE": 0.1, "STRUCTURAL_KNEE": 0.04, "STRUCTURAL_POWER": 1.0},
    {"FRICTION": 0.002, "FRICTION_WIDTH": 0.004, "FRICTION_SPRING": 1e-3, "FRICTION_POWER": 0.3},
    {"FRICTION": 0.002, "FRICTION_WIDTH": 0.004, "FRICTION_HUMP": 0.4, "FRICTION_HUMP_AT": 0.02},
    {"LAW_POWER": -1.0, "LAW_EXPONENT": 0.6},
    {"COHERENCE": 0.03, "COHERENCE_POWER": 2.0, "COHERENCE_FLOOR": 0.2},
    {"TREND_DRIVE_ARCH": 0.03, "FREQUENCY_TREND": 0.001, "FREQUENCY_LOSS": 1.5},
)
BARE = {
    "AERO": RATE,
    "DRIVE": RATE * A_STAR,
    "SCATTER": 0.003,
    "NOISE": 1.0,
    "PHASE_SCATTER": 0.003,
    "THIRD_NOISE": 1.0,
}


def channels() -> Channels:
    """The series with a phase and a third harmonic."""
    data, half = envelope(), CYCLES // 2
    knots = np.linspace(np.log(0.003), np.log(0.15), HATS)
    t = np.tile(PERIOD * np.arange(half), 2)
    return Channels(
        amplitude=data.amplitude, standard_error=data.standard_error, gap=data.gap, period=data.period, time=t,
        record=np.repeat([0, 1], half), phase=0.02 * t + 0.01 * wobble(CYCLES, 3), third=5e-4 * wobble(CYCLES, 4),
        third_error=np.full(CYCLES, ERROR), place=t / t.max() - 0.5, omega=np.full(CYCLES, 2 * np.pi / PERIOD),
        has_phase=np.ones(CYCLES, dtype=bool), knots=knots,
    )  # fmt: skip


def extended() -> dict[str, Any]:
    """Every term of the filter with effects; each row alone, and all as neighbours of the first."""
    table = np.zeros((len(TERMS), 2, COLUMNS))
    for row, terms in zip(table, TERMS, strict=True):
        for name, value in (BARE | terms).items():
            row[:, Term[name]] = value
    table[:, 1, Term.DETUNING] += 0.001  # the records are not alike
    together = _gaussian(*channel_innovations(channels(), table, initial_sd=0.3))
    alone = {
        "+".join(terms) or "bare": _gaussian(*channel_innovations(channels(), table[i : i + 1], initial_sd=0.3))[0]
        for i, terms in enumerate(TERMS)
    }
    return {"alone": alone, "together": together}


def _gaussian(v: np.ndarray, s: np.ndarray) -> list[list[float]]:
    """Log density of every row: amplitude, phase, third harmonic."""
    terms = -0.5 * (v * v / s + np.log(2.0 * np.pi * s))
    return [[float(part.sum()) for part in np.split(row, 3)] for row in terms]


def steady() -> dict[str, Any]:
    """A steady record by itself, its gusts and its phase noise."""
    size = 240
    slow = np.convolve(wobble(size + 20, 9), np.ones(21) / 21.0, mode="valid")[:size]
    amplitude = 0.05 * (1.0 + 0.1 * slow + 0.01 * wobble(size, 2))
    flat = np.ones(size)
    phase = np.cumsum(0.01 * wobble(size, 6))
    cycles = Cycles(
        PERIOD * (np.arange(size) + 0.5), amplitude, ERROR * flat, phase, 8.0 * flat, 0.01 * flat, 8.0, ERROR
    )
    u = np.log(np.stack([around(c, 0.3, i) for i, c in enumerate((0.05, 0.01, 0.02, 1.0, 0.004))], axis=1))
    middles = (0.05, 0.01, 0.02, 1.0, 0.004)
    priors = [Prior(name, "lognormal", c, 0.5) for name, c in zip(PARAMETERS, middles, strict=True)]
    posterior = steady_posterior("steady.csv", cycles, priors, 2.0 * np.pi * 8.0)
    rates, q = np.geomspace(0.02, 0.5, 12), np.exp(np.linspace(-0.1, 0.1, 7)) * 0.002
    return {
        "log likelihood": posterior.log_likelihood(u).tolist(),
        "gusts": float(gust_log_odds(amplitude, PERIOD, rates, np.ones(12), q, ERROR)),
        "phase noise": [float(one) for one in phase_noise(cycles, 0.3, ERROR)],
    }


def speeds() -> dict[str, Any]:
    """The smooth model of other wind speeds."""
    points = []
    for rig, sc in (("light", 10.0), ("heavy", 30.0)):
        for i, v in enumerate(np.linspace(7.6, 10.4, 6)):
            mean = [
                float(np.log(0.04) - ((v - 9.0) / 1.2) ** 2 - 0.01 * sc),
                float(np.log(30.0) - ((v - 9.0) / 2.5) ** 2),
            ]
            known = 1 if rig == "light" and i % 2 else 2
            covariance = np.diag([0.02**2, 0.1**2][:known])
            points.append(SpeedPoint(f"{rig} {i}", rig, float(v), sc, 0.01, np.array(mean[:known]), covariance))
    scales = tuple(Prior(f"s{i}", "lognormal", c, 0.5) for i, c in enumerate((0.7, 0.4, 1.0)))
    shift = Prior("shift", "lognormal", 0.03, 0.7)
    u = np.concatenate([np.log(np.stack([around(c, 0.4, i) for i, c in enumerate((0.7, 0.4, 1.0))], axis=1)),
                        0.03 * np.stack([wobble(POINTS, 40), wobble(POINTS, 60)], axis=1)], axis=1)  # fmt: skip
    found = {}
    for n in (-1.0, 2.0):
        data = Observations(tuple(points), n, 20.0, (0.05, 0.1), float(np.log(100.0)))
        posterior = SpeedPosterior(scales, shift, data, ((float(np.log(0.04)), 1.0), (float(np.log(30.0)), 1.0)))
        found[f"n={n:g}"] = {
            "log likelihood": posterior.log_likelihood(u).tolist(), "log prior": posterior.log_prior(u).tolist()
        }  # fmt: skip
    return found


def gap(room: Room) -> dict[str, Any]:
    """Joint densities of a simulated campaign: of the bare hypothesis and of one effect, and of a test left out."""
    simulated(room)
    data = load_gap(load_campaign(room.folder / "campaign"))
    bare = Hypothesis(null_model(data), ())
    friction = bare.extended(CATALOGUE["coulomb_friction"].variants(data.layout)[0])
    found = {}
    for name, one in (("bare", bare), ("friction", friction)):
        steps = np.array([0.2 * one.prior[1] * wobble(one.size, 13 * i) for i in range(POINTS)])
        like, prior = one.log_prob(one.start() + steps)
        value, gradient, fisher = one.scores(one.start())
        found[name] = {
            "log likelihood": like.tolist(), "log prior": prior.tolist(), "posterior at the start": value,
            "gradient": gradient.tolist(), "trace of the information": float(np.trace(fisher)),
        }  # fmt: skip
    out = data.layout.test == 0
    scored = density(posterior_at_mode(bare.laplace(bare.start(), bare.scores(bare.start())[2]), out), out)
    return found | {"left out": {"value": float(scored.value), "learnt": float(scored.learnt)}}


def filters(room: Room) -> dict[str, Any]:
    """Everything that is a likelihood."""
    return {
        "state space": state_space(), "trial": trial(), "extended": extended(), "steady": steady(), "speeds": speeds(),
        "gap": gap(room),
    }  # fmt: skip
