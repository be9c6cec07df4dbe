r"""From section to span: how much larger a mode's amplitude is than that of a section model.

With the section's law :math:`\dot a = (\lambda/n)\, a\,[1 - (a/a^*)^n]` acting on every strip with the local amplitude,
and full coherence along the span, the work of a cycle balances at :math:`A_{max} = \Gamma_n A_{section}`,

.. math:: \Gamma_n = \left[\int\varphi^2 \Big/ \int|\varphi|^{2+n}\right]^{1/n}

with the shape's largest value 1: 4/pi for a sine under the paper's law (n = -1), sqrt(4/3) under Ehsan and
Scanlan's (n = 2).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import simpson

from scruton.arrays import FloatArray
from scruton.campaign.bounded import read_bytes
from scruton.campaign.thresholds import LARGEST_NUMBER, LARGEST_TABLE
from scruton.errors import InputError
from scruton.sizing.thresholds import CLOSEST_POINTS

_POINTS = 2001


@dataclass(frozen=True, eq=False)
class ModeShape:
    """A mode shape along the span.

    Attributes
    ----------
    position : (N,) array
        Along the span, rising; any unit of length.
    value : (N,) array
        Largest absolute value 1.
    name : str
        "sine", or the file it was read from.
    """

    position: FloatArray
    value: FloatArray
    name: str

    def integral(self, power: float) -> float:
        """Mean of abs(phi)^power over the span."""
        return self._mean(np.abs(self.value) ** power)

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
        return float(np.interp(first + fraction * (last - first), self.position, self.value))

    def _factor(self, n: float) -> float:
        if abs(n) < 1e-6:
            size = np.abs(self.value)
            safe = np.where(size > 0.0, size, 1.0)  # phi^2 ln(phi) -> 0
            return float(np.exp(-self._mean(size**2 * np.log(safe)) / self.integral(2.0)))
        return float((self.integral(2.0) / self.integral(2.0 + n)) ** (1.0 / n))

    def _mean(self, y: FloatArray) -> float:
        return float(simpson(y, x=self.position) / (self.position[-1] - self.position[0]))


def sine(half_waves: int = 1) -> ModeShape:
    """Sine of one or more half waves."""
    # As many steps in each half wave, an even number, so that its ends are points of the quadrature.
    x = np.linspace(0.0, 1.0, 1 + half_waves * max(2 * round(0.5 * (_POINTS - 1) / half_waves), 60))
    return ModeShape(x, np.sin(half_waves * np.pi * x), "sine")


def uniform() -> ModeShape:
    """A rigid section: the factor is 1 under every law."""
    x = np.linspace(0.0, 1.0, 3)
    return ModeShape(x, np.ones(3), "uniform")


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


def read_table(path: Path, wanted: str) -> FloatArray:
    """Read the numbers below the header line of a CSV file, (rows, columns).

    Raises
    ------
    InputError
        A file that is not there or holds something else, or begins with numbers: they would be taken for the header.
    """
    try:
        text = read_bytes(path, LARGEST_TABLE, wanted).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, "", f"a file that cannot be read ({error})", wanted) from None
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) < 2:
        raise InputError(path, "", f"{len(lines)} lines", wanted)
    try:
        rows: FloatArray = np.loadtxt(lines[1:], delimiter=",", ndmin=2)
    except ValueError as error:
        raise InputError(path, "", str(error), wanted) from None
    try:
        float(lines[0].split(",")[0])
    except ValueError:
        return rows
    raise InputError(path, "line 1", f'numbers ("{lines[0]}")', wanted)


def make_shape(position: FloatArray, value: FloatArray, path: Path | str) -> ModeShape:
    """Check and scale a shape; refine it for quadrature by a cubic spline."""
    from scipy.interpolate import CubicSpline

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
    fine = np.linspace(position[0], position[-1], _POINTS)
    spline = CubicSpline(position, value / np.abs(value).max())(fine)
    return ModeShape(fine, spline / np.abs(spline).max(), str(path))
