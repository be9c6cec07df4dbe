"""True bridges and campaigns, emulated: a law of the amplitude, its integration in time, and what a fit would say.

Nothing of it is the model's.  The truth is an excitation written out here (or in `wakes`), strip by strip along the
span and integrated in time; a fit is emulated from what its records would show of each rig (stable amplitude to 1 %,
relaxation to 4 %, the exponent to 0.35; in slow gusts to 2 %, 8 % and 0.5), by the weights of draws from the priors of
the default card.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from wakes import FACCHINETTI, RAYLEIGH

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.griffin.coverage import Coverage
from scruton.griffin.curves import LawCurves
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.checks import required_of
from scruton.sizing.mode_shape import sine
from scruton.sizing.model import ModeModel
from scruton.sizing.thresholds import ONE_RIG

REFERENCE, RELAXATION, AMPLITUDE = 20.0, 60.0, 0.05  # of the true curve: Sc, Sc_lambda and A/D there
DEPTH, FACTOR = 3.0, 6000.0  # of the bridge [m], and its Scruton number per unit of damping ratio
DAMPING, DAMPING_COV = 0.003, 0.45
RIGS = {1: (40.0,), 3: (10.0, 20.0, 40.0)}  # Scruton numbers tested
EXPONENTS, PRIOR_WEIGHTS = (-1.0, 0.0, 1.0, 2.0), (0.7, 0.1, 0.1, 0.1)
KAPPA, CANDIDATES, DRAWS = 0.10, 4000, 1024


@dataclass(frozen=True)
class Seen:
    """How well records tell a rig's stable amplitude and relaxation (in logarithms) and its exponent: deviations."""

    amplitude: float
    relaxation: float
    exponent: float


STILL, GUSTY = Seen(0.01, 0.04, 0.35), Seen(0.02, 0.08, 0.50)


@dataclass(frozen=True)
class PowerLaw:
    """Excitation that falls with the amplitude to the power n; what transients show of it is what it is."""

    n: float

    def excitation(self, amplitude):
        """Scruton number that holds a section at an amplitude A/D."""
        ratio = amplitude / AMPLITUDE
        return REFERENCE - RELAXATION * (np.log(ratio) if self.n == 0.0 else (ratio**self.n - 1.0) / self.n)

    def on_curve(self, sc):
        """Amplitude A/D at a Scruton number on the true curve."""
        x = (sc - REFERENCE) / RELAXATION
        return AMPLITUDE * (np.exp(-x) if self.n == 0.0 else max(1.0 - self.n * x, 0.0) ** (1.0 / self.n))

    def shown(self, sc):
        """What transients of a test show: its relaxation in Scruton numbers, and an exponent."""
        return RELAXATION + self.n * (REFERENCE - sc), self.n


TRUTHS = {f"n = {n:g}": PowerLaw(n) for n in EXPONENTS} | {"van der Pol wake": FACCHINETTI, "Rayleigh wake": RAYLEIGH}

_AT, _OF = np.polynomial.legendre.leggauss(24)
_PHI = np.sin(0.25 * np.pi * (_AT + 1.0))  # half a sine, from a node to where it is largest
_SHARE = _OF * _PHI**2 / np.sum(_OF * _PHI**2)


def held_at(amplitude, truth, miss):
    """Scruton number that holds the mode at amplitudes (N,) [A/D] of bridges that miss the curve by exp(miss)."""
    return truth.excitation(amplitude[:, None] * _PHI / np.exp(miss)[:, None]) @ _SHARE


def grown(sc, truth, miss):
    """Amplitude (N,) [A/D] that each bridge's vibration comes to, in time: Runge and Kutta's steps of ln A."""

    def rate(log):
        return np.clip((held_at(np.exp(log), truth, miss) - sc) / RELAXATION, -2.0, 2.0)

    log, step = np.full(sc.size, np.log(0.3 * AMPLITUDE)), 0.05
    for _ in range(1500):
        first = rate(log)
        second = rate(log + 0.5 * step * first)
        third = rate(log + 0.5 * step * second)
        log = log + step / 6.0 * (first + 2.0 * second + 2.0 * third + rate(log + step * third))
        log = np.maximum(log, np.log(1e-9))
    return np.exp(log)


def fitted(rng, tested, truth, tau, seen=STILL):
    """What a fit of rigs at these Scruton numbers would say of the shared curve, from what its records show."""
    tested = np.array(tested)
    stable = np.array([truth.on_curve(sc) for sc in tested]) * np.exp(tau * rng.standard_normal(tested.size))
    relaxation, exponents = np.transpose([truth.shown(float(sc)) for sc in tested])
    at_zero = np.maximum(exponents, 0.0) * tested
    strength = (relaxation + at_zero) * np.exp(KAPPA * rng.standard_normal(tested.size))
    relaxation = (strength - at_zero) * np.exp(seen.relaxation * rng.standard_normal(tested.size))
    level = np.log(stable) + seen.amplitude * rng.standard_normal(tested.size)
    exponent = exponents.mean() + seen.exponent * rng.standard_normal()
    columns, evidence = [], []
    reference = float(np.exp(np.log(tested).mean()))
    for law, weight in zip(EXPONENTS, PRIOR_WEIGHTS, strict=True):
        strength = np.maximum(relaxation + max(law, 0.0) * tested, 1e-3)
        taus, kappas = (median * np.exp(0.8 * rng.standard_normal(CANDIDATES)) for median in (0.07, 0.15))
        if tested.size == 1:
            taus = np.full(CANDIDATES, ONE_RIG)  # as the sizing takes it
        along = max(-law, 0.0) * (tested - reference)  # for n < 0 the strength changes along the curve
        log_weight, strengths = _about(rng, np.log(strength)[None], np.hypot(kappas, seen.relaxation), along)
        slope = np.exp(strengths) - max(law, 0.0) * reference
        x = (tested[None] - reference) / slope[:, None]
        usable = (slope > 0.0) & (law * x < 1.0).all(axis=1)
        with np.errstate(all="ignore"):
            log_ratio = -x if law == 0.0 else np.log1p(-law * x) / law
        off = np.where(usable[:, None], level - log_ratio, 0.0)
        more, amplitude = _about(rng, off, np.hypot(taus, seen.amplitude))
        weights = np.where(usable, np.exp(log_weight + more), 0.0)
        evidence.append(weight * weights.mean() * np.exp(-0.5 * ((law - exponent) / seen.exponent) ** 2))
        chosen = rng.choice(CANDIDATES, DRAWS, p=weights / weights.sum()) if weights.any() else np.arange(DRAWS)
        columns.append((np.exp(amplitude[chosen]), np.maximum(slope[chosen], 1e-3), taus[chosen]))
    amplitude, slope, taus = (np.array(rows) for rows in zip(*columns, strict=True))
    rows = np.array(EXPONENTS)[:, None] * np.ones(DRAWS)
    order = np.argsort(tested)
    covered = Coverage(tested[order], 0.2 * stable[order], 1.6 * stable[order])
    weights = np.array(evidence) / np.sum(evidence)
    return LawCurves(
        reference, amplitude, slope, rows, taus, weights, tuple(f"n={law:g}" for law in EXPONENTS), coverage=covered
    )


def _about(rng, values, sd, along=0.0):
    """Weigh draws of a level that nothing is known of: values (N or 1, J) lie about ln(exp(level) + along), by sd (N,).

    Log weights and levels, (N,) each, drawn about the mean, with what the values are more or less likely by than there.
    """
    count, mean = values.shape[1], values.mean(axis=1)
    for _ in range(20 if np.any(along) else 0):
        mean = (values - np.log(np.maximum(1.0 + along * np.exp(-mean)[:, None], 1e-3))).mean(axis=1)
    deviates = rng.standard_normal(sd.size)
    level = mean + sd / np.sqrt(count) * deviates
    with np.errstate(invalid="ignore"):
        off = values - level[:, None] - np.log1p(along * np.exp(-level)[:, None])
    log_weight = 0.5 * deviates**2 - 0.5 * (off**2).sum(axis=1) / sd**2 - (count - 1) * np.log(sd)
    return np.where(np.isfinite(log_weight), log_weight, -np.inf), level


@dataclass(frozen=True)
class Cell:
    """Many decisions of one kind: whether the bridge as built exceeds its limit, what was required, what is needed."""

    violated: np.ndarray
    required: np.ndarray
    needed: np.ndarray

    @property
    def dearer(self):
        """Required over truly needed damping, medians."""
        return np.median(self.required) / np.median(self.needed)


def decided(rigs, name, tau, *, bridges, seed, cube, seen=STILL):
    """Size so many bridges of their own from campaigns of their own, build what is required, and let the wind blow."""
    truth, (rng, own, miss, limits) = TRUTHS[name], _bridges(rigs, name, tau, bridges, seed, seen)
    mode = Mode("V1", Quantity(0.3), shape=sine(), damping_ratio=Quantity(DAMPING, DAMPING_COV * DAMPING))
    bridge = Bridge("bridge", Motion.HEAVING, 12.0, DEPTH, 1.225, Quantity(1.0), (), (mode,))
    required = np.empty(bridges)
    for k, limit in enumerate(limits):
        model = ModeModel(fitted(rng, RIGS[rigs], truth, tau, seen), np.full(1, FACTOR), bridge, mode)
        asked = required_of(model.draws(cube).needed(limit * DEPTH))["0.95"]
        required[k] = 0.05 if asked is None else asked
    return _built(truth, required, own, miss, limits)


def knowing(rigs, name, tau, *, bridges, seed, cube, curve=False):
    """Size the same bridges by the law and the discrepancy that are true; what rigs miss hides the level of the curve.

    With `curve` that is known, too: what is left is how far the bridge misses it, and its own damping.
    """
    truth, (rng, own, miss, limits) = TRUTHS[name], _bridges(rigs, name, tau, bridges, seed, STILL)
    level = 0.0 if curve else tau / np.sqrt(len(RIGS[rigs]))
    damping, off, here = _own_damping(ndtri(cube[:, 0])), level * ndtri(cube[:, 1]), tau * ndtri(cube[:, 2])
    required = np.empty(bridges)
    for k, limit in enumerate(limits):
        found = held_at(np.full(len(cube), limit), truth, level * rng.standard_normal() + off + here) / FACTOR
        required[k] = max(float(np.quantile(found - damping, 0.95)), 0.0)
    return _built(truth, required, own, miss, limits)


def _own_damping(deviate):
    log = np.sqrt(np.log1p(DAMPING_COV**2))
    return DAMPING * np.exp(log * deviate - 0.5 * log**2)


def _bridges(rigs, name, tau, count, seed, seen):
    """What draws their campaigns; damping ratios, deviations from the curve [ln A] and limits [A/D] of true bridges."""
    rng = np.random.default_rng([seed, rigs, list(TRUTHS).index(name), round(1000 * tau), seen is GUSTY])
    own = _own_damping(rng.standard_normal(count))
    miss = tau * rng.standard_normal(count)
    return rng, own, miss, AMPLITUDE * rng.uniform(0.45, 0.7, count)


def _built(truth, required, own, miss, limits):
    needed = np.maximum(held_at(limits, truth, miss) / FACTOR - own, 0.0)
    return Cell(grown((own + required) * FACTOR, truth, miss) > 1.002 * limits, required, needed)
