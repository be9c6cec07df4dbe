r"""From section to span: how much larger a mode's amplitude is than that of a section model.

With the section's law :math:`\dot a = (\lambda/n)\, a\,[1 - (a/a^*)^n]` acting on every strip with the local amplitude,
and full coherence along the span, the work of a cycle balances at :math:`A_{max} = \Gamma_n A_{section}`,

.. math:: \Gamma_n = \left[\int\varphi^2 \Big/ \int|\varphi|^{2+n}\right]^{1/n}

with the shape's largest value 1: 4/pi for a sine under the paper's law (n = -1), sqrt(4/3) under Ehsan and
Scanlan's (n = 2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.campaign.thresholds import LARGEST_NUMBER
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown
from scruton.sizing.number_table import read_table
from scruton.sizing.thresholds import CLOSEST_POINTS

_PANELS = 64  # of a half wave, and of a shape that is read from a file at least so many times two
# Gauss-Lobatto, five points, their weights for a panel of length 1: exact for the square of a cubic, and with the ends
# of every panel among its points, so that the largest value and the nodes of a shape are.
_NODES = np.array([0.0, 0.5 - np.sqrt(3.0 / 28.0), 0.5, 0.5 + np.sqrt(3.0 / 28.0), 1.0])
_WEIGHTS = np.array([9.0, 49.0, 64.0, 49.0, 9.0]) / 180.0


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class ModeShape:
    """A mode shape along the span.

    Attributes
    ----------
    position : (N,) array
        Along the span, rising; any unit of length.  Points of the quadrature.
    value : (N,) array
        Largest absolute value 1.
    weight : (N,) array
        Part of the span that each point stands for.
    name : str
        "sine", "uniform", or the file it was read from, as it is stated in bridge.toml.
    curve : callable
        The shape itself, at any positions.
    """

    position: FloatArray
    value: FloatArray
    weight: FloatArray
    name: str
    curve: Callable[[FloatArray], FloatArray]

    def integral(self, power: float) -> float:
        """Mean of abs(phi)^power over the span."""
        return float(self.weight @ np.abs(self.value) ** power)

    def factor(self, n: ArrayLike) -> FloatArray:
        """Amplitude of the mode over that of the section, Gamma_n, for exponents n > -3; any shape."""
        exponents = np.asarray(n, dtype=float)
        levels, place = np.unique(exponents, return_inverse=True)
        if levels.size > 60:  # a free exponent: smooth in n
            grid = np.linspace(levels[0], levels[-1], 60)
            return np.asarray(np.interp(exponents, grid, [self._factor(level) for level in grid]))
        return np.array([self._factor(level) for level in levels])[place].reshape(exponents.shape)

    def at(self, fraction: float) -> float:
        """Value at a fraction of the span."""
        first, last = self.position[0], self.position[-1]
        return float(self.curve(first + fraction * (last - first)))

    def _factor(self, n: float) -> float:
        if abs(n) < 1e-6:
            size = np.abs(self.value)
            safe = np.where(size > 0.0, size, 1.0)  # phi^2 ln(phi) -> 0
            return float(np.exp(-(self.weight @ (size**2 * np.log(safe))) / self.integral(2.0)))
        return float((self.integral(2.0) / self.integral(2.0 + n)) ** (1.0 / n))


def _shape(curve: Callable[[FloatArray], FloatArray], edges: FloatArray, panels: int, name: str) -> ModeShape:
    """Put the quadrature on a curve: so many panels between two edges, closer where the shape may be at a node."""
    graded = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, panels + 1))
    ends = np.append((edges[:-1, None] + np.diff(edges)[:, None] * graded[:-1]).ravel(), edges[-1])
    length = np.diff(ends)[:, None]
    position = np.append((ends[:-1, None] + length * _NODES[:-1]).ravel(), ends[-1])
    weight = np.zeros(position.size)
    for k, part in enumerate(_WEIGHTS):
        weight[k : k + 4 * length.size : 4] += part * length[:, 0]
    return ModeShape(position, curve(position), weight / (ends[-1] - ends[0]), name, curve)


def sine(half_waves: int = 1) -> ModeShape:
    """Sine of one or more half waves."""
    edges = np.linspace(0.0, 1.0, half_waves + 1)
    return _shape(lambda x: np.sin(half_waves * np.pi * x), edges, _PANELS, "sine")


def uniform() -> ModeShape:
    """A rigid section: the factor is 1 under every law."""
    return _shape(np.ones_like, np.array([0.0, 1.0]), 1, "uniform")


def read_shape(path: Path) -> ModeShape:
    """Read a shape from CSV: one header line, then position and displacement (any unit, any scale).

    Raises
    ------
    InputError
        Not two columns of numbers, fewer than five points, positions that do not rise, a shape of zeros.
    """
    table = read_table(path, "one header line, then two columns of numbers with a comma between, position and shape")
    if table.shape[1] != 2 or len(table) < 5:
        found = f"{len(table)} rows of {table.shape[1]} columns"
        raise InputError(path, "", found, "two columns and at least five rows")
    return make_shape(table[:, 0], table[:, 1], path)


def make_shape(position: FloatArray, value: FloatArray, path: Path | str) -> ModeShape:
    """Check and scale a shape; between its points it is monotone, so that a step stays one."""
    from scipy.interpolate import PchipInterpolator

    if not (np.isfinite(position).all() and np.isfinite(value).all()):
        raise InputError(path, "", "a number that is not finite", "finite positions and displacements")
    if not (np.diff(position) > 0.0).all():
        raise InputError(path, "position", "values that do not rise from row to row", "rising positions")
    span = position[-1] - position[0]
    if span < CLOSEST_POINTS or np.diff(position).min() < CLOSEST_POINTS * span:
        apart = f"more than {CLOSEST_POINTS:g} of the span between"
        raise InputError(path, "position", "points that all but coincide", apart)
    if max(np.abs(position).max(), np.abs(value).max()) > LARGEST_NUMBER:
        raise InputError(path, "", "a number that no bridge has", f"numbers up to {LARGEST_NUMBER:g}")
    if not np.abs(value).max() > 0.0:
        raise InputError(path, "displacement", "a mode shape of zeros", "a shape that moves somewhere")
    between = PchipInterpolator(position, value / np.abs(value).max())
    roots = between.roots(extrapolate=False)
    nodes = np.unique(roots[np.isfinite(roots)])  # abs(phi) bends there; where it rests at zero a root is not a number
    away = np.abs(nodes[:, None] - position).min(axis=1, initial=np.inf) > CLOSEST_POINTS * span
    edges = np.union1d(position, nodes[away])
    return _shape(between, edges, max(2, -(-2 * _PANELS // (edges.size - 1))), str(path))
