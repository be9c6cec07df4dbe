"""Tuning dampers of a given mass over draws of what is uncertain.

A draw needs a certain added damping, found once; dampers add another, which depends on its frequency error alone and
is read off a table over that error.  Tuning minimises the order statistic of their ratio that decides on the risk: the
risk itself is a staircase, this is continuous.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.sizing.thresholds import STROKE_TOLERANCE
from scruton.sizing.tmd import TunedMass, check_detuning, den_hartog, positive, response

STROKE_QUANTILE = 0.95
_NODES = 81
_LOWERINGS = 3  # of the risk that a tuning aims at
_FAR = 1e3  # what lacks at a tuning that no one would build
_OUT_OF_REACH = 1e6


@dataclass(frozen=True)
class Outcome:
    """What dampers leave over the draws.

    Attributes
    ----------
    probability : float
        Of exceeding the limit.
    stroke, stroke_high : float
        Median and 95 % quantile of the largest relative stroke among the dampers [m].
    added_damping, added_damping_low : float
        Median and 5 % quantile of the damping ratio that they add in the limit cycle.
    """

    probability: float
    stroke: float
    stroke_high: float
    added_damping: float
    added_damping_low: float


class TuningDraws:
    """Joint draws of amplitude and frequency error, with the limits to keep; nothing in it changes once it is made.

    Parameters
    ----------
    amplitude : callable
        Stable amplitude (S,) [m, or rad with `shape` in m] of every draw at its added damping ratio (S,), where the
        mode shape is one.  More damping must never give more amplitude.
    limit : float
        Unit of the amplitude.
    detuning : (S,) array
        Draws of the relative error of the mode's frequency, joint with those in `amplitude`.
    number : int
        Dampers of equal mass and damping ratio with evenly spread frequencies; the spread is found.
    shape : float
        Mode shape where the dampers hang; for torsion their distance from the axis [m].
    damping_range : tuple of float
        Damping ratios that a damper can be built with.
    largest_stroke : float, optional
        m, for the 95 % quantile of the stroke.

    Attributes
    ----------
    needed : (S,) array
        Added damping that brings each draw to the limit: 0 where it is there already, inf where critical damping is not
        enough.

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
        number: int = 1,
        shape: float = 1.0,
        damping_range: tuple[float, float] = (0.005, 0.4),
        largest_stroke: float | None = None,
    ) -> None:
        self.detuning = np.atleast_1d(check_detuning(detuning))
        if self.detuning.ndim != 1 or self.detuning.size == 0:
            raise InputError("damper", "detuning", f"an array of shape {self.detuning.shape}", "one number per draw")
        if number < 1:
            raise InputError("damper", "number", f"{number}", "a whole number, one or more")
        low, high = damping_range
        if not 0.0 < low < high < 1.0:
            raise InputError("damper", "damping_range", f"{low:g} to {high:g}", "two rising numbers between 0 and 1")
        self._amplitude, self.number, self.damping_range = amplitude, number, damping_range
        self.limit, self.shape = positive("limit", limit), positive("shape", shape)
        self.largest_stroke = None if largest_stroke is None else positive("largest_stroke", largest_stroke)
        # What each draw needs, by bisection.
        least, most = np.zeros(self.detuning.size), np.ones(self.detuning.size)
        enough, never = self.amplitude(least) <= self.limit, self.amplitude(most) > self.limit
        for _ in range(40):
            middle = 0.5 * (least + most)
            over = self.amplitude(middle) > self.limit
            least, most = np.where(over, middle, least), np.where(over, most, middle)
        self.needed = np.where(enough, 0.0, np.where(never, np.inf, most))
        # Half of the nodes follow the draws, half reach their tails.
        even = np.linspace(0.0, 1.0, _NODES // 2 + 1)
        reach = self.detuning.min() + even * np.ptp(self.detuning)
        self._nodes = np.unique(np.concatenate([np.quantile(self.detuning, even), reach]))
        self._width = float(np.std(self.detuning))

    def amplitude(self, added: FloatArray) -> FloatArray:
        """Amplitude (S,) at an added damping (S,)."""
        value = np.asarray(self._amplitude(added), dtype=float)
        if value.shape != self.detuning.shape or np.any(np.isnan(value)):
            found = "not a number" if value.shape == self.detuning.shape else f"an array of shape {value.shape}"
            raise InputError("damper", "amplitude", found, f"one amplitude for each of {self.detuning.size} draws")
        return value

    def outcome(self, dampers: tuple[TunedMass, ...], detuning: float | None = None) -> Outcome:
        """What dampers leave, without the table; at one frequency error for all draws if it is given."""
        added = relative = np.zeros(self.detuning.size)
        if dampers:
            added_by = response(dampers, self.detuning if detuning is None else detuning)
            added = np.broadcast_to(added_by.added_damping, self.detuning.shape)
            relative = np.broadcast_to(added_by.stroke.max(axis=0), self.detuning.shape)
        amplitude = self.amplitude(added)
        stroke = self.shape * relative * amplitude if dampers else relative
        return Outcome(
            float(np.mean(amplitude > self.limit)),
            float(np.median(stroke)),
            float(np.quantile(stroke, STROKE_QUANTILE)),
            float(np.median(added)),
            float(np.quantile(added, 0.05)),
        )

    def tune(
        self, mass_ratio: float, risk: float | None, near: tuple[TunedMass, ...] = ()
    ) -> tuple[tuple[TunedMass, ...], float]:
        """Tune dampers of one total mass.

        Parameters
        ----------
        mass_ratio : float
        risk : float or None
            The risk to keep; None asks for the least mean logarithm of what lacks, wherever the limit lies.
        near : tuple of TunedMass
            Dampers of another mass to start from; without them the search starts from Den Hartog's damping, from half
            and from twice of it.

        Returns
        -------
        dampers : tuple of TunedMass
        lack : float
            As `lack` gives it.
        """
        from scipy.optimize import minimize

        first = den_hartog(mass_ratio)
        unit = float(np.sqrt(mass_ratio)) + self._width  # frequencies are tuned in steps of this
        size = 3 if self.number > 1 else 2  # logarithm of the damping, middle and half width of the frequencies
        place = np.linspace(-1.0, 1.0, self.number) if self.number > 1 else np.zeros(1)
        low, high = np.log(self.damping_range)

        def dampers(x: FloatArray) -> tuple[TunedMass, ...]:
            zeta = float(np.exp(np.clip(x[0], low, high)))
            ratios = first.frequency_ratio * (1.0 + unit * x[1]) * (1.0 + unit * x[-1] * place)
            return tuple(TunedMass(mass_ratio / self.number, float(f), zeta) for f in ratios)

        def objective(x: FloatArray) -> float:
            outside = float(max(0.0, low - x[0], x[0] - high, abs(x[1]) - 3.0))
            if size == 3:
                outside = float(max(outside, -x[2], x[2] - 4.0))
            if outside > 1.0 or unit * np.max(np.abs(x[1:])) > 0.8:
                return _FAR + outside
            return self.lack(dampers(x), risk) + 10.0 * outside

        if near:
            bottom, top = near[0].frequency_ratio, near[-1].frequency_ratio
            middle, half = 0.5 * (bottom + top), 0.5 * (top - bottom)
            zeta = near[0].damping_ratio
            starts = [[np.log(zeta), (middle / first.frequency_ratio - 1.0) / unit, half / middle / unit]]
        else:
            starts = [[np.log(first.damping_ratio * k), 0.0, 0.5 / k] for k in (1.0, 0.5, 2.0)]
        searches = []
        for start in starts:
            x = np.array(start[:size])
            x[0] = np.clip(x[0], low, high - 0.3 if high - low > 0.3 else low)
            simplex = np.vstack([x, x + np.diag([0.3, 0.2, 0.3][:size])])
            searches.append(
                minimize(
                    objective, x, method="Nelder-Mead",
                    options={"initial_simplex": simplex, "maxfev": 50 * size, "xatol": 3e-3, "fatol": 5e-4},
                )
            )  # fmt: skip
        best = dampers(min(searches, key=lambda each: float(each.fun)).x)
        return best, self.lack(best, risk)

    def least_risk(self, mass_ratio: float) -> tuple[TunedMass, ...]:
        """Tune dampers of one total mass for the least risk: each tuning aims below the risk of the last.

        Within the largest stroke, where this mass can keep it.
        """
        largest = np.inf if self.largest_stroke is None else self.largest_stroke
        best, _ = self.tune(mass_ratio, None)
        left = self.outcome(best)
        for _ in range(_LOWERINGS):
            if left.probability == 0.0:
                break
            other, _ = self.tune(mass_ratio, left.probability - 0.5 / self.detuning.size, best)
            lower = self.outcome(other)
            strokes = [outcome.stroke_high / largest - 1.0 for outcome in (left, lower)]
            if lower.probability >= left.probability or strokes[0] <= STROKE_TOLERANCE < strokes[1]:
                break
            best, left = other, lower
        return best

    def lack(self, dampers: tuple[TunedMass, ...], risk: float | None) -> float:
        """Logarithm of needed over added damping at the draw that decides on a risk, or of the stroke over its limit.

        The greater of the two; 0 or less keeps both.
        """
        table = response(dampers, self._nodes)
        added = np.interp(self.detuning, self._nodes, table.added_damping)
        ratio = self.needed / added
        stroke = 0.0
        if self.largest_stroke is not None:
            relative = np.interp(self.detuning, self._nodes, table.stroke.max(axis=0))
            stroke = float(np.quantile(self.shape * relative * self.amplitude(added), STROKE_QUANTILE))
            stroke /= self.largest_stroke
        if risk is None:
            # A stroke beyond its limit weighs more than any risk that it saves.
            return float(np.mean(np.log(np.clip(ratio, 1e-2, 1e2)))) + 10.0 * float(np.log(max(stroke, 1.0)))
        last = ratio.size - 1 - int(np.floor(risk * ratio.size + 1e-9))
        deciding = np.clip(np.partition(ratio, last)[last], 1.0 / _OUT_OF_REACH, _OUT_OF_REACH)
        return float(np.log(max(deciding, stroke)))
