"""A mode of the bridge as a function of what is uncertain: from the unit cube to amplitudes and the damping they need.

Every source of uncertainty has one coordinate of the unit cube.  Risk curves, shares of variance and the value of
information all start from the same function of it, so they cannot disagree about the model.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from scruton.arrays import BoolArray, FloatArray
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.dynamics.laws import index_of
from scruton.dynamics.scruton_number import factor as scruton_number_factor
from scruton.griffin.curves import LawCurves, SharedCurve, portions
from scruton.griffin.law_free import LawFree
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.span import CurveTable, EffectOnSpan, IncoherentCurve, IntArray, Strips, effect_on_span, strips
from scruton.sizing.transfer import factor_at
from scruton.stats.convergence import monte_carlo_error

SECTION, LAW, DISCREPANCY, DAMPING, COHERENCE, MASS, FREQUENCY = range(7)
COHERENCE_AMPLITUDE, TURBULENCE, REYNOLDS, DETAILS = range(7, 11)
SOURCES = {
    SECTION: "section model's posterior",
    LAW: "law of aerodynamic damping",
    DISCREPANCY: "discrepancy between settings",
    DAMPING: "structural damping of the bridge",
    COHERENCE: "spanwise coherence",
    MASS: "mass of the mode",
    FREQUENCY: "frequency of the mode",
    COHERENCE_AMPLITUDE: "amplitude at which coherence is lost",
    TURBULENCE: "turbulence at the site",
    REYNOLDS: "Reynolds number",
    DETAILS: "details of the section",
}
TRANSFER = (TURBULENCE, REYNOLDS, DETAILS)
_REPETITIONS = 25  # most take four; one in a thousand meets a bend of the distance
_SETTLED = 1e-10  # change that is none
_LOOKS = (2, 3, 5, 8, 12)  # repetitions after which draws without one are left alone
_FALLS = -0.3, -3.0  # slope of what one repetition moves, between which the line through the last two is followed
_OWN = ("scale", "damping_ratio", "factor", "detuning", "discrepancy", "row")  # arrays of the draws
_CUBES = 16  # kept, of 3 MB at most: every limit and mode asks for the same ones
_BLOCKS = 64  # of the posterior's draws, between which Monte Carlo errors look for differences


@lru_cache(_CUBES)
def unit_cube(count: int, seed: int, sources: int = len(SOURCES)) -> FloatArray:
    """Scrambled Sobol' points, (count, sources), which nobody may change; `count` is a power of two.

    Rows of two cubes must not be paired: whatever their seeds, points of the same index share leading digits.
    """
    from scipy.stats import qmc

    points = qmc.Sobol(sources, scramble=True, rng=np.random.default_rng([seed, 0x512E])).random(count)
    cube = np.clip(points, 1e-9, 1.0 - 1e-9)
    cube.flags.writeable = False
    return cube


@dataclass(frozen=True)
class Spread:
    """Median, 5 and 95 % points of what is uncertain; None for a point that is not asked for.

    `mcse` has the Monte Carlo standard errors of the median, the 5 and the 95 % point, where they are told.
    """

    median: float
    low: float | None = None
    high: float | None = None
    mcse: tuple[float, float, float] | None = None


def spread(draws: FloatArray, u: FloatArray | None = None) -> Spread:
    """Median, 5 and 95 % points of draws; no interpolation, since some may be infinite.

    `u` are the points of the unit cube that the draws stand at, for their Monte Carlo errors.
    """
    low, median, high = np.quantile(draws, [0.05, 0.5, 0.95], method="inverted_cdf")
    mcse = None
    if u is not None:
        of_median, of_low, of_high = (sampling_error(draws, u, p) for p in (0.5, 0.05, 0.95))
        mcse = of_median, of_low, of_high
    return Spread(float(median), float(low), float(high), mcse)


def sampling_error(draws: FloatArray, u: FloatArray, probability: float | None = None) -> float:
    """Monte Carlo standard error of a quantile, or of the mean, of draws (N,) at points of the unit cube (N, sources).

    Notes
    -----
    Taken in the order of the posterior's draws that they stand on, one chain after the other: points that share a draw
    of the section's posterior, or neighbours of one chain, are not independent, and count for as many as they are.
    That the points are spread evenly over the other sources makes the error smaller than this.
    """
    return error_by_row(draws, u[:, SECTION], probability)


def error_by_row(draws: FloatArray, row: FloatArray | IntArray, probability: float | None = None) -> float:
    """The same of draws (N,) by where each stands among those of the section's posterior, such as `Draws.row`."""
    ordered = draws[np.argsort(row, kind="stable")]
    return monte_carlo_error(ordered.reshape(_BLOCKS, -1), probability)


def stated_scruton_number(bridge: Bridge, mode: Mode) -> float | None:
    """Scruton number of a mode at its mean mass and mean damping; None where it states no mass."""
    if mode.mass is None:
        return None
    factor = scruton_number_factor(
        "paper", mass=mode.mass.mean, air_density=bridge.air_density, width=bridge.width, depth=bridge.depth,
        torsional=bridge.motion is Motion.TORSIONAL,
    )  # fmt: skip
    return float(factor * mode.damping_ratio.mean)


@dataclass(frozen=True, eq=False)
class ModeModel:
    """One mode in the light of the section's posterior.

    `section_factor`, (S,), has draws of the Scruton number per unit of damping ratio of the section model, for a mode
    of the same mass ratio.
    """

    laws: LawCurves
    section_factor: FloatArray
    bridge: Bridge
    mode: Mode

    def uncertain(self) -> tuple[int, ...]:
        """Sources of which there is more than one value, that bear on the amplitude."""
        vary = {
            SECTION: True,
            LAW: np.count_nonzero(self.laws.weights > 0.0) > 1,
            DISCREPANCY: self.laws.discrepancy.max() > 0.0,
            DAMPING: not self.mode.damping_ratio.certain,
            COHERENCE: not self.bridge.coherence.certain,
            COHERENCE_AMPLITUDE: not (self.bridge.coherence_amplitude or Quantity(1.0)).certain,
            MASS: self.mode.mass is not None and not self.mode.mass.certain,
        }
        if (transfer := self.bridge.transfer) is not None:
            vary |= {source: not factor.certain for source, factor in zip(TRANSFER, transfer.factors, strict=True)}
        return tuple(source for source, varies in vary.items() if varies)

    def draws(self, u: FloatArray) -> "Draws":
        """Draws at points of the unit cube, (N, sources)."""
        laws = self.laws
        size = laws.n.shape[1]
        law = np.minimum(np.searchsorted(np.cumsum(laws.weights), u[:, LAW], side="right"), len(laws.labels) - 1)
        draw = np.minimum((u[:, SECTION] * size).astype(int), size - 1)
        # A curve with an effect in it is read from a table: its coefficients need not be copied to every draw.
        curve = replace(laws, effect=None).choose(law, draw)
        bridge, shape, effect = self.bridge, self.mode.shape, laws.effect
        length = bridge.depth if bridge.motion is Motion.HEAVING else 1.0
        z = ndtri(u[:, DISCREPANCY])
        over_section = shape.factor(curve.n if effect is None else -1.0) * bridge.coherence.quantile(u[:, COHERENCE])
        if bridge.transfer is not None:
            over_section = over_section * factor_at(bridge.transfer, u[:, list(TRANSFER)])
        span: EffectOnSpan | IncoherentCurve | None = None
        if bridge.coherence_amplitude is not None:
            lost_at = bridge.coherence_amplitude.quantile(u[:, COHERENCE_AMPLITUDE])
            with np.errstate(divide="ignore"):
                span = IncoherentCurve(curve, self.strips, np.log(over_section / lost_at))
            if self.table is not None and effect is not None:
                span = replace(span, rest=self.table, row=draw, drive=effect.drive[draw])
        elif self.table is not None:
            span = EffectOnSpan(self.table, draw)
        if self.mode.mass is None:
            factor = np.resize(self.section_factor, size)[draw]
        else:
            factor = scruton_number_factor(
                "paper", mass=self.mode.mass.quantile(u[:, MASS]), air_density=self.bridge.air_density,
                width=self.bridge.width, depth=self.bridge.depth, torsional=self.bridge.motion is Motion.TORSIONAL,
            )  # fmt: skip
        frequency = self.mode.frequency
        return Draws(
            curve, length * over_section, self.mode.damping_ratio.quantile(u[:, DAMPING]), factor,
            frequency.quantile(u[:, FREQUENCY]) / frequency.mean - 1.0, z, draw, span,
        )  # fmt: skip

    @property
    def scruton_number_at_means(self) -> float:
        """4 pi m xi/(rho B D), for torsion 4 pi J xi/(rho B^3 D), of the mean mass and the mean damping."""
        stated = stated_scruton_number(self.bridge, self.mode)
        return float(np.median(self.section_factor)) * self.mode.damping_ratio.mean if stated is None else stated

    @property
    def lever_arm(self) -> float:
        """Lever arm of dampers against torsion [m]; 1 for heaving."""
        if self.bridge.motion is Motion.HEAVING:
            return 1.0
        return self.bridge.damper.lever_arm or 0.5 * self.bridge.width

    @property
    def damper_positions(self) -> tuple[float, ...]:
        """Fractions of the span where the mode's dampers stand: as asked for, or all where the mode is largest."""
        request = self.bridge.damper
        if (places := request.places(self.mode.name)) is not None:
            return places
        x = self.mode.shape.position
        largest = x[int(np.abs(self.mode.shape.value).argmax())]
        return (round(float((largest - x[0]) / (x[-1] - x[0])), 9),) * request.number

    @cached_property
    def table(self) -> CurveTable | None:
        """Curves with an effect in them over the span, each draw once; None where the law has a closed form.

        Where the bridge states how coherence depends on the amplitude, that replaces what the effect says of it.
        """
        if self.laws.effect is None:
            return None
        driven = self.bridge.coherence_amplitude is None
        return effect_on_span(self.laws.effect, self.mode.shape, driven=driven)

    @cached_property
    def strips(self) -> Strips:
        """Strips of the mode for all exponents of the laws."""
        return strips(self.mode.shape, self.laws.n)


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of a mode from the section's curves, (N,) arrays.

    Attributes
    ----------
    scale : (N,) array
        Amplitude of the bridge [m] or [rad] over that of a section.
    damping_ratio : (N,) array
        Structural damping ratio of the bridge.
    factor : (N,) array
        Scruton number per unit of damping ratio.
    detuning : (N,) array
        Relative error of the frequency.
    discrepancy : (N,) array
        Standard normal deviate of the discrepancy.
    row : (N,) array
        Which draw of the posterior each one is.
    span : EffectOnSpan or IncoherentCurve or None
        The curve over the span, where Gamma_n is not all that there is to it.
    law_free : LawFree, optional
        What inverts the curve, where the law shall not.
    """

    curve: SharedCurve
    scale: FloatArray
    damping_ratio: FloatArray
    factor: FloatArray
    detuning: FloatArray
    discrepancy: FloatArray
    row: IntArray
    span: EffectOnSpan | IncoherentCurve | None = None
    law_free: LawFree | None = None

    def __len__(self) -> int:
        return len(self.scale)

    def scruton_number(self, added: ArrayLike) -> FloatArray:
        """Scruton number with added damping: (N,) for one a draw, (N, K) for (1, K) or (N, K)."""
        damping = self.damping_ratio if np.ndim(added) < 2 else self.damping_ratio[:, None]
        factor = self.factor if np.ndim(added) < 2 else self.factor[:, None]
        return np.asarray((damping + np.asarray(added)) * factor)

    def amplitude(self, added: ArrayLike) -> FloatArray:
        """Stable amplitude [m] or [rad] with added damping, shaped as `scruton_number`; zero where vibration dies."""
        sc = self.scruton_number(added)
        square = sc.reshape(len(self), -1)
        found = np.empty(square.shape)
        for columns in portions(square.shape[1]):
            on_curve = self.on_curve(square[:, columns])
            away = np.exp(self.curve.setting(square[:, columns], on_curve).off(self.discrepancy))
            found[:, columns] = self.scale[:, None] * on_curve * away
        return found.reshape(sc.shape)

    def spread(self, added: FloatArray) -> FloatArray:
        """Sd of ln(amplitude) that the discrepancy between settings means, with (1, K) or (N, K) added damping."""
        sc = self.scruton_number(added)
        found = np.empty(sc.shape)
        for columns in portions(sc.shape[1]):
            found[:, columns] = self.curve.setting(sc[:, columns], self.on_curve(sc[:, columns])).spread
        return found

    def on_curve(self, sc: FloatArray) -> FloatArray:
        """Amplitude of the section by the laws that the mode's comes from, A/D or rad, at (N, K) Scruton numbers."""
        return self.curve.at(sc) if self.span is None else self.span.amplitude(sc)

    def needed(self, limit: float) -> FloatArray:
        """Added damping at which the amplitude is down to the limit, (N,); below zero where none is needed.

        Notes
        -----
        The inverse of A(Sc) = A_ref (1 - n x)^(1/n), or the balance over the span where there is more to it.  How far
        the setting lies off the curve depends a little on where it is: found by repetition.
        """
        with np.errstate(divide="ignore"):  # a coherence that comes out as zero keeps any limit
            target = np.log(limit / self.scale)
        on_curve, rest, left = target.copy(), np.arange(len(self)), self  # those that still move
        here, moved = on_curve, np.zeros(len(self))  # where they were before, and by how much one round moved them
        for k in range(_REPETITIONS):
            before, amplitude = on_curve[rest], np.exp(on_curve[rest])
            setting = left.curve.setting(left._inverse(amplitude)[:, None], amplitude[:, None])
            found = target[rest] - setting.off(left.discrepancy)[:, 0]
            with np.errstate(invalid="ignore", divide="ignore"):  # infinite ones stay what they are
                moves = found - before
                still = np.abs(moves) > _SETTLED
                slope = (moves - moved) / (before - here)  # infinite, or none, in the first round
                straight = still & (slope < _FALLS[0]) & (slope > _FALLS[1])
                on_curve[rest] = np.where(straight, before - moves / slope, found)
            here, moved = before, moves
            if not still.any():
                break
            if k in _LOOKS and self.span is None:
                rest, left, here, moved = rest[still], left.only(still), here[still], moved[still]
        return np.asarray(self._inverse(np.exp(on_curve)) / self.factor - self.damping_ratio)

    def only(self, kept: BoolArray) -> "Draws":
        """These draws alone, where the curve is that of the section."""
        assert self.span is None
        curve = replace(
            self.curve, amplitude=self.curve.amplitude[kept], relaxation=self.curve.relaxation[kept],
            n=self.curve.n[kept], discrepancy=self.curve.discrepancy[kept],
            sample=None if self.curve.sample is None else self.curve.sample[kept],
        )  # fmt: skip
        own = {key: getattr(self, key)[kept] for key in _OWN}
        return replace(self, curve=curve, **own)

    def _inverse(self, on_curve: FloatArray) -> FloatArray:
        """Scruton numbers at which the curves have these amplitudes, (N,)."""
        if self.law_free is not None:
            return self.law_free.scruton_number_of(on_curve, self.row % len(self.law_free.scruton_number))
        if self.span is not None:
            return self.span.scruton_number(on_curve[:, None])[:, 0]
        curve = self.curve
        return np.asarray(curve.reference + curve.relaxation * index_of(np.log(on_curve / curve.amplitude), curve.n))
