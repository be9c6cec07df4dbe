"""Dampers over joint draws of what is uncertain: vibration, frequency of the bridge, and what the dampers are."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.sizing.tmd import Response, TunedMass, check_detuning, positive, ratios_of, respond
from scruton.sizing.tmd_real import Flaws, limit_cycle, respond_at

STROKE_QUANTILE = 0.95
_FREE = Flaws()


@dataclass(frozen=True)
class Outcome:
    """What dampers leave over the draws.

    Attributes
    ----------
    probability : float
        Of exceeding the limit; where friction or end stops count, of growing from the limit.
    stroke, stroke_high : float
        Median and 95 % quantile of the largest relative stroke among the dampers [m].
    added_damping, added_damping_low : float
        Median and 5 % quantile of the damping ratio that they add in the limit cycle.
    struck : float
        Probability that a damper strikes its end stops.
    """

    probability: float
    stroke: float
    stroke_high: float
    added_damping: float
    added_damping_low: float
    struck: float = 0.0


@dataclass(frozen=True, eq=False)
class Reality:
    """What dampers turn out to be, draw by draw, and what the frequency of the response does.

    Attributes
    ----------
    frequency, damping, mass : (dampers, S) array
        Factors of each damper's frequency, damping ratio and mass ratio (its own mass, and one over the modal mass);
        anything that broadcasts to that.
    flaws : Flaws
        Friction and end stops.
    power : (S,) array
        p: the amplitude is that of the section's curve over g^p, g the frequency of the response over the mode's.
    """

    frequency: FloatArray = field(default_factory=lambda: np.ones((1, 1)))
    damping: FloatArray = field(default_factory=lambda: np.ones((1, 1)))
    mass: FloatArray = field(default_factory=lambda: np.ones((1, 1)))
    flaws: Flaws = _FREE
    power: FloatArray = field(default_factory=lambda: np.zeros(1))


def frequency_power(n: ArrayLike) -> FloatArray:
    r"""Power p of 1/g in the amplitude at a frequency g under the law of exponent n: 1 at n = -1, 0 from n = 0 on.

    Notes
    -----
    Over a cycle the dashpots of the bridge and of the dampers take 2 (xi_s + xi_add) omega per unit mass and velocity,
    whatever g is.  The wind gives back a part that is linear in the velocity, whatever g is, and a part that depends
    on the amplitude.  If that one goes with the velocity, as sign(v) under the paper's law, it depends on g a: what is
    on the section's curve is g a, and p = 1.  For n = -1 no force in the displacement has a finite sum over the cycle,
    so p = 1 is no choice.  If it goes with the displacement, as abs(y)^n v of Larsen and of Ehsan and Scanlan, it
    depends on a, and p = 0.  Between n = -1 and 0, where either could be, p is -n.
    """
    return np.asarray(np.clip(-np.asarray(n, dtype=float), 0.0, 1.0))


class DamperDraws:
    """Joint draws of amplitude and frequency error, and of what dampers turn out to be; nothing in it changes.

    Parameters
    ----------
    amplitude : callable
        Stable amplitude (S,) [m, or rad with `shape` in m] of every draw at its added damping ratio (S,), where the
        mode shape is one.  More damping must never give more amplitude.
    limit : float
        Unit of the amplitude.
    detuning : (S,) array
        Draws of the relative error of the mode's frequency, joint with those in `amplitude`.
    shape : float or (dampers,) array
        Mode shape where the dampers hang; for torsion times their distance from the axis [m].
    reality : Reality, optional
        Left out, dampers are what they were meant to be, and the amplitude is that of the curve.

    Raises
    ------
    InputError
        If an argument is out of range, or `amplitude` does not return one number per draw.
    """

    def __init__(
        self,
        amplitude: Callable[[FloatArray], FloatArray],
        limit: float,
        detuning: ArrayLike,
        shape: ArrayLike = 1.0,
        reality: Reality | None = None,
    ) -> None:
        self.detuning = np.atleast_1d(check_detuning(detuning))
        if self.detuning.ndim != 1 or self.detuning.size == 0:
            raise InputError("damper", "detuning", f"an array of shape {self.detuning.shape}", "one number per draw")
        self._amplitude, self.limit = amplitude, positive("limit", limit)
        self.shape = np.array([positive("shape", each) for each in np.atleast_1d(np.asarray(shape, dtype=float))])
        self.reality = reality or Reality()

    def amplitude(self, added: FloatArray, frequency: FloatArray | float = 1.0) -> FloatArray:
        """Amplitude (S,) at an added damping (S,), at a frequency of the response over the mode's."""
        value = np.asarray(self._amplitude(added), dtype=float)
        if value.shape != self.detuning.shape or np.any(np.isnan(value)):
            found = "not a number" if value.shape == self.detuning.shape else f"an array of shape {value.shape}"
            raise InputError("damper", "amplitude", found, f"one amplitude for each of {self.detuning.size} draws")
        return np.asarray(value / frequency**self.reality.power)

    def at_limit(
        self, dampers: tuple[TunedMass, ...], detuning: float | None = None
    ) -> tuple[FloatArray, Response | None]:
        """Amplitude (S,) with what the dampers do where the vibration is at its limit, and that; above it, it grows."""
        if not dampers:
            return self.amplitude(np.zeros(self.detuning.size)), None
        found = self._respond(dampers, detuning, self.limit)
        return self.amplitude(found.added_damping, found.frequency), found

    def probability(self, dampers: tuple[TunedMass, ...], detuning: float | None = None) -> float:
        """Of a vibration at the limit that grows, at one frequency error for all draws if it is given."""
        return float(np.mean(self.at_limit(dampers, detuning)[0] > self.limit))

    def probability_worst(self, dampers: tuple[TunedMass, ...]) -> float:
        """Of any stable limit cycle beyond the limit: one that a vibration from above stays in counts, too."""
        if not dampers or self.reality.flaws.none:
            return self.probability(dampers)
        worst, _ = limit_cycle(
            lambda size: self._respond(dampers, None, size), self.amplitude, self.limit, largest=True
        )
        return float(np.mean(worst > self.limit))

    def outcome(self, dampers: tuple[TunedMass, ...], detuning: float | None = None) -> Outcome:
        """What dampers leave; at one frequency error for all draws if it is given."""
        amplitude, found = self.at_limit(dampers, detuning)
        left = float(np.mean(amplitude > self.limit))
        if found is None:
            return Outcome(left, 0.0, 0.0, 0.0, 0.0)
        if not self.reality.flaws.none:
            amplitude, found = limit_cycle(
                lambda size: self._respond(dampers, detuning, size), self.amplitude, self.limit, largest=False
            )
        stroke = self._stroke(found, amplitude)
        return Outcome(
            left,
            float(np.median(stroke)),
            float(np.quantile(stroke, STROKE_QUANTILE)),
            float(np.median(found.added_damping)),
            float(np.quantile(found.added_damping, 0.05)),
            float(np.mean(stroke > self.reality.flaws.stop)),
        )

    def risk_and_stroke(self, dampers: tuple[TunedMass, ...]) -> tuple[float, float]:
        """Probability and 95 % quantile of the stroke, as of `outcome`, of dampers that move freely."""
        amplitude, found = self.at_limit(dampers)
        assert found is not None
        assert self.reality.flaws.none
        high = float(np.quantile(self._stroke(found, amplitude), STROKE_QUANTILE))
        return float(np.mean(amplitude > self.limit)), high

    def _stroke(self, found: Response, amplitude: FloatArray) -> FloatArray:
        """Largest stroke among the dampers [m], (S,)."""
        return np.asarray((self.shape[:, None] * found.stroke).max(axis=0) * amplitude)

    def _respond(self, dampers: tuple[TunedMass, ...], detuning: float | None, size: FloatArray | float) -> Response:
        """What the dampers do at an amplitude of the mode, (S,)."""
        real, error = self.reality, self.detuning if detuning is None else check_detuning(detuning)
        mu, f, zeta = ratios_of(dampers)
        one = np.ones(self.detuning.size)
        mu, f, zeta = mu * real.mass * one, f * real.frequency / (1.0 + error) * one, zeta * real.damping * one
        if real.flaws.none:
            return respond(mu, f, zeta)
        return respond_at(mu, f, zeta, self.shape[:, None] * size, real.flaws)
