"""Tuning dampers of a given mass over draws of what is uncertain.

A draw needs a certain added damping, found once; dampers add another, which is read off a table over the error of the
frequency, with the slopes of its logarithm in mass and damping.  Tuning minimises the order statistic of their ratio
that decides on the risk: the risk itself is a staircase, this is continuous.  The lightest dampers are sought where
that or the stroke is nearest to its limit; what mass there is to spare goes into the ratio, not into a short stroke.
"""

from collections.abc import Callable
from copy import copy
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.sizing.thresholds import STROKE_TOLERANCE
from scruton.sizing.tmd import TunedMass, den_hartog, positive, ratios_of, respond
from scruton.sizing.tmd_draws import STROKE_QUANTILE, DamperDraws, Reality
from scruton.sizing.tmd_real import respond_at

DAMPING_RANGE = (0.005, 0.4)  # damping ratios that a damper can be built with
_NODES = 81
_STEP = 0.1  # of the logarithms of mass and damping, for slopes
_BEND = 0.07  # of the logarithm of the frequency, for the change of what is needed
_CLOSE, _CLOSE_ENOUGH = 3e-3, 1e-2  # of a tuning to the best: of what is built, and of a chart of many masses
_LOWERINGS = 3  # of the risk that a tuning aims at
_FAR = 1e3  # what lacks at a tuning that no one would build
_STROKE_WEIGHT = 10.0  # a stroke beyond its limit, in logarithms, weighs more than any risk that it saves
_OUT_OF_REACH = 1e6
_SET_RIGHT = 2.0  # most by which what is read off the table is multiplied or divided to be what it is


class TuningDraws(DamperDraws):
    """Draws that dampers are tuned on.

    Parameters
    ----------
    amplitude, limit, detuning, shape, reality
        As of `DamperDraws`; one shape for every damper, or one for all.
    number : int
        Dampers of equal mass and damping ratio with evenly spread frequencies; the spread is found.
    largest_stroke : float, optional
        m, for the 95 % quantile of the stroke.
    kept : float
        Frequency error, either way, at which the risk has to be kept, too; 0: none.

    Attributes
    ----------
    needed : (S,) array
        Added damping that brings each draw to the limit: 0 where it is there already, inf where critical damping is not
        enough.

    Raises
    ------
    InputError
        As of `DamperDraws`.
    """

    def __init__(
        self,
        amplitude: Callable[[FloatArray], FloatArray],
        limit: float,
        detuning: ArrayLike,
        number: int = 1,
        shape: ArrayLike = 1.0,
        largest_stroke: float | None = None,
        reality: Reality | None = None,
        kept: float = 0.0,
    ) -> None:
        if number < 1:
            raise InputError("damper", "number", f"{number}", "a whole number, one or more")
        super().__init__(amplitude, limit, detuning, np.resize(np.asarray(shape, dtype=float), number), reality)
        self.number = number
        self.largest_stroke = None if largest_stroke is None else positive("largest_stroke", largest_stroke)
        self.errors = (None, -kept, kept) if kept else (None,)
        # What each draw needs, at the mode's own frequency and about it: a parabola in ln g.
        self.needed = self._needed(1.0)
        self._slope = self._bend = np.zeros(1)
        if np.any(self.reality.power):
            low, high = (self._needed(float(np.exp(step))) for step in (-_BEND, _BEND))
            known = np.isfinite(low) & np.isfinite(high)
            with np.errstate(invalid="ignore"):
                self._slope = np.where(known, (high - low) / (2.0 * _BEND), 0.0)
                self._bend = np.where(known, (high + low - 2.0 * self.needed) / (2.0 * _BEND**2), 0.0)
        # Nodes at the frequency errors of bridge and dampers together: half follow the draws, half reach their tails.
        one = np.ones(self.detuning.size)
        off = np.exp(np.log(self.reality.frequency).mean(axis=0)) * one
        away = [(1.0 + (self.detuning if error is None else error)) / off - 1.0 for error in self.errors]
        even = np.linspace(0.0, 1.0, _NODES // 2 + 1)
        together = np.concatenate(away)
        reach = together.min() + even * np.ptp(together)
        self._true = np.ones(len(self.errors) + 1)
        self._nodes = np.unique(np.concatenate([np.quantile(together, even), reach]))
        self._width = float(np.std(away[0]))
        last = max(self._nodes.size - 2, 0)
        self._places = []
        for error in away:
            below = np.clip(np.searchsorted(self._nodes, error, side="right") - 1, 0, last)
            gap = np.diff(self._nodes, append=self._nodes[-1] + 1.0)[below]
            self._places.append(
                (below, np.minimum(below + 1, self._nodes.size - 1), (error - self._nodes[below]) / gap)
            )
        self._mass, self._damping = (
            np.log(each).mean(axis=0) * one for each in (self.reality.mass, self.reality.damping)
        )

    def _needed(self, frequency: float | FloatArray) -> FloatArray:
        """Added damping that brings the draws to the limit, at a frequency of the response, by bisection."""
        least, most = np.zeros(self.detuning.size), np.ones(self.detuning.size)
        enough = self.amplitude(least, frequency) <= self.limit
        never = self.amplitude(most, frequency) > self.limit
        for _ in range(40):
            middle = 0.5 * (least + most)
            over = self.amplitude(middle, frequency) > self.limit
            least, most = np.where(over, middle, least), np.where(over, most, middle)
        return np.where(enough, 0.0, np.where(never, np.inf, most))

    def keeps(self, dampers: tuple[TunedMass, ...], risk: float) -> bool:
        """Whether dampers keep risk and stroke, without the table."""
        if any(self.probability(dampers, error) > risk for error in self.errors):
            return False
        return self.largest_stroke is None or self.outcome(dampers).stroke_high <= self.largest_stroke

    def set_right(self, dampers: tuple[TunedMass, ...], risk: float) -> tuple[Self, float]:
        """These draws with a table that is right at some dampers, and what lacks there without it, as of `lack`.

        The table has one frequency for all dampers, but each is delivered with errors of its own: the one that happens
        to be the softest or the least damped swings widest.  That is a factor which changes little from dampers to
        those next to them.
        """
        read, true = self._by_table(dampers, risk), self._without_table(dampers, risk)
        other = copy(self)
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = true / read
        other._true = np.where(np.isfinite(factor), np.clip(factor, 1.0 / _SET_RIGHT, _SET_RIGHT), 1.0)
        return other, float(_in_logarithms(true.max()))

    def shortages(self, dampers: tuple[TunedMass, ...], risk: float) -> FloatArray:
        """What lacks at each of the errors, and of the stroke, as of `lack` but without the table."""
        return _in_logarithms(self._without_table(dampers, risk))

    def tune(
        self,
        mass_ratio: float,
        risk: float | None,
        near: tuple[TunedMass, ...] = (),
        *,
        spare: bool = False,
        close: float = _CLOSE,
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
        spare : bool
            Whether the mass may be more than enough: damping is added beyond what is needed, as far as the stroke
            allows, at the worst of the frequency errors.  Else what lacks most is made least, risk or stroke.
        close : float
            How near to the best the logarithms of damping and frequency have to come.

        Returns
        -------
        dampers : tuple of TunedMass
        lack : float
            Logarithm of needed over added damping at the draw that decides on the risk, or of the stroke over its
            limit, the greater; 0 or less keeps both.
        """
        from scipy.optimize import minimize

        first = den_hartog(mass_ratio)
        unit = float(np.sqrt(mass_ratio)) + self._width  # frequencies are tuned in steps of this
        size = 3 if self.number > 1 else 2  # logarithm of the damping, middle and half width of the frequencies
        place = np.linspace(-1.0, 1.0, self.number) if self.number > 1 else np.zeros(1)
        low, high = np.log(DAMPING_RANGE)
        share = self.shape**2 / np.sum(self.shape**2)  # of the mass ratio, where all have the same mass

        def dampers(x: FloatArray) -> tuple[TunedMass, ...]:
            zeta = float(np.exp(np.clip(x[0], low, high)))
            ratios = first.frequency_ratio * (1.0 + unit * x[1]) * (1.0 + unit * x[-1] * place)
            return tuple(TunedMass(float(mu), float(f), zeta) for mu, f in zip(mass_ratio * share, ratios, strict=True))

        def objective(x: FloatArray) -> float:
            outside = float(max(0.0, low - x[0], x[0] - high, abs(x[1]) - 3.0))
            if size == 3:
                outside = float(max(outside, -x[2], x[2] - 4.0))
            if outside > 1.0 or unit * np.max(np.abs(x[1:])) > 0.8:
                return _FAR + outside
            lacking, stroke = self._lacks(dampers(x), risk)
            if spare or risk is None:
                return lacking + _STROKE_WEIGHT * max(stroke + _CLOSE, 0.0) + 10.0 * outside
            return max(lacking, stroke) + 10.0 * outside

        if near:
            bottom, top = sorted((near[0].frequency_ratio, near[-1].frequency_ratio))
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
                    options={"initial_simplex": simplex, "maxfev": 50 * size, "xatol": close, "fatol": close / 6.0},
                )
            )  # fmt: skip
        best = dampers(min(searches, key=lambda each: float(each.fun)).x)
        return best, max(self._lacks(best, risk))

    def best(
        self, mass_ratio: float, risk: float, near: tuple[TunedMass, ...] = (), *, close: float = _CLOSE_ENOUGH
    ) -> tuple[TunedMass, ...]:
        """Tune dampers of one total mass for the most added damping over what is needed at a risk.

        Where the mass does not keep the risk, for the least risk: each tuning aims below the risk of the last.  Within
        the largest stroke, where this mass can keep it; `near` and `close` as of `tune`.
        """
        # The draw that decides at this risk may be out of reach for all.
        known = risk if np.mean(np.isinf(self.needed)) <= risk else None
        best, lack = self.tune(mass_ratio, known, near, spare=True, close=close)
        if known is not None and lack <= 0.0:
            return best
        largest = np.inf if self.largest_stroke is None else self.largest_stroke
        left = self.outcome(best)
        for _ in range(_LOWERINGS):
            if left.probability == 0.0:
                break
            aim = left.probability - 0.5 / self.detuning.size
            other, _ = self.tune(mass_ratio, aim, best, spare=True, close=close)
            lower = self.outcome(other)
            strokes = [outcome.stroke_high / largest - 1.0 for outcome in (left, lower)]
            if lower.probability >= left.probability or strokes[0] <= STROKE_TOLERANCE < strokes[1]:
                break
            best, left = other, lower
        return best

    def _lacks(self, dampers: tuple[TunedMass, ...], risk: float | None) -> tuple[float, float]:
        """Logarithms of needed over added damping, as of `tune`, and of the stroke over its limit."""
        found = self._by_table(dampers, risk)
        if risk is not None:
            found = found * self._true
        lacking, stroke = _in_logarithms([found[:-1].max(), found[-1]]).tolist()
        return lacking, stroke

    def _by_table(self, dampers: tuple[TunedMass, ...], risk: float | None) -> FloatArray:
        """Needed over added damping at each of the errors at which the risk is kept, and the stroke over its limit.

        Without a risk the first is over all draws, at the stated frequency alone.
        """
        table, found, stroke = self._table(dampers), [], 0.0
        for k, (below, above, part) in enumerate(self._places if risk is not None else self._places[:1]):
            rows = table[:, below] * (1.0 - part) + table[:, above] * part
            added = np.exp(rows[0] + rows[1] * self._mass + (rows[2] + rows[3] * self._damping) * self._damping)
            needed = np.maximum(self.needed + (self._slope + self._bend * rows[4]) * rows[4], 0.0)
            ratio = needed / added
            if k == 0 and self.largest_stroke is not None:
                relative = np.exp(rows[5] + rows[6] * self._damping)
                amplitude = self.amplitude(added, np.exp(rows[4]))
                stroke = float(np.quantile(relative * amplitude, STROKE_QUANTILE)) / self.largest_stroke
            if risk is None:
                found.append(float(np.exp(np.mean(np.log(np.clip(ratio, 1e-2, 1e2))))))
            else:
                found.append(_deciding(ratio, risk))
        return np.array([*found, stroke])

    def _without_table(self, dampers: tuple[TunedMass, ...], risk: float) -> FloatArray:
        """The same, draw by draw with what every damper turns out to be."""
        found = []
        for error in self.errors:
            _, response = self.at_limit(dampers, error)
            assert response is not None
            with np.errstate(divide="ignore", invalid="ignore"):  # dampers that friction holds
                ratio = self._needed(response.frequency) / response.added_damping
            found.append(_deciding(np.where(np.isnan(ratio), 0.0, ratio), risk))
        stroke = 0.0 if self.largest_stroke is None else self.outcome(dampers).stroke_high / self.largest_stroke
        return np.array([*found, stroke])

    def _table(self, dampers: tuple[TunedMass, ...]) -> FloatArray:
        """Over the nodes: ln(added), slope in ln(mass), slope and bend in ln(damping), ln(g), ln(stroke), slope."""
        steps = np.array([(0.0, 0.0), (_STEP, 0.0), (0.0, -_STEP), (0.0, _STEP)])
        if not (np.any(self._mass) or np.any(self._damping)):
            steps = steps[:1]
        mu, f, zeta = ratios_of(dampers)
        many = np.repeat(np.exp(steps), self._nodes.size, axis=0).T
        ratios = mu * many[0], f / (1.0 + np.tile(self._nodes, len(steps))), zeta * many[1]
        flaws = self.reality.flaws
        found = respond(*ratios) if flaws.none else respond_at(*ratios, self.limit * self.shape[:, None], flaws)
        with np.errstate(divide="ignore"):  # dampers that friction holds
            added = np.log(np.maximum(found.added_damping, 1e-12)).reshape(len(steps), -1)
            stroke = np.log(np.maximum((self.shape[:, None] * found.stroke).max(axis=0), 1e-12)).reshape(len(steps), -1)
        flat = np.zeros(self._nodes.size)
        g = np.log(found.frequency[: self._nodes.size])
        if len(steps) == 1:
            return np.stack([added[0], flat, flat, flat, g, stroke[0], flat])
        return np.stack([
            added[0], (added[1] - added[0]) / _STEP, (added[3] - added[2]) / (2.0 * _STEP),
            (added[3] + added[2] - 2.0 * added[0]) / (2.0 * _STEP**2), g, stroke[0],
            (stroke[3] - stroke[2]) / (2.0 * _STEP),
        ])  # fmt: skip


def _deciding(ratio: FloatArray, risk: float) -> float:
    """The order statistic that decides on a risk: 1 or less where no more than that part of the draws is above 1."""
    last = ratio.size - 1 - int(np.floor(risk * ratio.size + 1e-9))
    return float(np.partition(ratio, last)[last])


def _in_logarithms(ratios: ArrayLike) -> FloatArray:
    """What lacks as the search takes it: finite also where nothing is needed or added."""
    return np.asarray(np.log(np.clip(ratios, 1.0 / _OUT_OF_REACH, _OUT_OF_REACH)))
