"""Risk and stroke of a mode's dampers where they are heavier, tuned or damped otherwise: a table to be read off.

The frequency of the bridge enters by its ratio to that of the dampers alone, so a bridge that is off frequency is read
off at dampers that are tuned otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.shown import fields_in_brief, shown
from scruton.sizing.damper_request import delivered
from scruton.sizing.dampers import TUNING_DRAWS, reality, shapes
from scruton.sizing.model import ModeModel, unit_cube
from scruton.sizing.tmd import TunedMass
from scruton.sizing.tmd_draws import DamperDraws

# Factors of the design's own mass, frequency and damping ratio, dense where risk and stroke bend.
MASS = np.geomspace(0.4, 2.5, 7)
TUNING = np.exp(np.concatenate([[-0.11, -0.085], np.linspace(-0.06, 0.06, 13), [0.085, 0.11]]))
DAMPING = np.geomspace(0.4, 2.5, 7)
_CHECKED = 48  # places off the grid where the interpolation is held against the draws
_DIGITS = 4
_LEAST = 1e-4  # a risk below this is read as this: a sixth of what a draw is worth
_MOST = 0.99  # damping ratio of a damper: one above is read as this
_LEAST_STROKE = 1e-4  # [m] that of a bridge that does not vibrate: a shorter one is read as this


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class DamperTable:
    """What the dampers of a design leave with other factors of their mass, frequency and damping ratio.

    Attributes
    ----------
    mass, tuning, damping : (M,), (F,), (Z,) array
        Factors of the design. That of the frequency is over a frequency of the bridge that is off by a known factor.
    probability, stroke_high : (M, F, Z) array
        Of exceeding the limit, on the draws that dampers are tuned with; 95 % quantile of the relative stroke [m].
    error_probability, error_stroke : float
        The largest error of the interpolation, of the risk and relative of the stroke, at `checked` places off the
        grid, drawn within it.
    checked : int
    """

    mass: FloatArray
    tuning: FloatArray
    damping: FloatArray
    probability: FloatArray
    stroke_high: FloatArray
    error_probability: float
    error_stroke: float
    checked: int

    def at(self, mass: ArrayLike, tuning: ArrayLike, damping: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Risk and stroke at factors within the table, linear in the logarithms of all but the risk.

        The risk is interpolated as ln(p/(1 - p)): the page of a report does the same.
        """
        from scipy.interpolate import RegularGridInterpolator

        axes = tuple(map(np.log, (self.mass, self.tuning, self.damping)))
        place = np.stack(np.broadcast_arrays(*map(np.log, (mass, tuning, damping))), axis=-1)
        p = np.clip(self.probability, _LEAST, 1.0 - _LEAST)
        odds = RegularGridInterpolator(axes, np.log(p / (1.0 - p)))(place)
        stroke = RegularGridInterpolator(axes, np.log(self.stroke_high))(place)
        shape = place.shape[:-1]
        return (1.0 / (1.0 + np.exp(-odds))).reshape(shape), np.exp(stroke).reshape(shape)


def damper_table(model: ModeModel, limit: float, dampers: Sequence[TunedMass], seed: int) -> DamperTable | None:
    """Compute the table of a design against a limit [m] or [rad]; None without dampers.

    Also None where friction or end stops count, which no few nodes tell.
    """
    request, shape = model.bridge.damper, shapes(model, model.damper_positions)
    draws = model.draws(unit_cube(TUNING_DRAWS, seed + 4))
    made = delivered(request, shape.size, TUNING_DRAWS, seed + 4)
    real = reality(model, draws, made, seed + 4)
    if not dampers or not real.flaws.none:
        return None
    over = DamperDraws(draws.amplitude, limit, draws.detuning, shape, real)

    def left(mass: float, tuning: float, damping: float) -> tuple[float, float]:
        other = (
            TunedMass(mass * one.mass_ratio, tuning * one.frequency_ratio, min(damping * one.damping_ratio, _MOST))
            for one in dampers
        )
        risk, stroke = over.risk_and_stroke(tuple(other))
        return risk, max(stroke, _LEAST_STROKE)

    grid = np.array([[[left(m, f, z) for z in DAMPING] for f in TUNING] for m in MASS])
    probability, stroke = (np.vectorize(_short)(values) for values in (grid[..., 0], grid[..., 1]))
    if not np.isfinite(stroke).all():  # no amplitude is stable
        return None
    table = DamperTable(MASS, TUNING, DAMPING, probability, stroke, np.nan, np.nan, _CHECKED)
    places = np.random.default_rng([seed, 0x7AB1]).random((_CHECKED, 3))
    ends = [(np.log(axis[0]), np.log(axis[-1])) for axis in (MASS, TUNING, DAMPING)]
    factors = [np.exp(low + part * (high - low)) for part, (low, high) in zip(places.T, ends, strict=True)]
    true = np.array([left(*map(float, place)) for place in zip(*factors, strict=True)]).T
    read = table.at(*factors)
    return replace(
        table, error_probability=float(np.abs(read[0] - true[0]).max()),
        error_stroke=float(np.abs(read[1] / true[1] - 1.0).max()),
    )  # fmt: skip


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
