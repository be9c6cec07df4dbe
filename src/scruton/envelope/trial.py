"""Trial functions that smooth the transient amplitude: Eq. (4) of the paper and what its Fig. 13 compares."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.exceptions import RankWarning

from scruton.arrays import FloatArray
from scruton.shown import fields_in_brief, shown

_POINTS = 2000  # least squares runs on at most so many block means
_SHORTEST, _FASTEST = 12.0, 300.0  # growth and decay over the record, as exponents, that the search covers
_CLOSEST = 0.02  # smallest (b - d) times the record's length: below it a and c grow without bound


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class TrialFit:
    """A trial function with its constants found.

    Attributes
    ----------
    constants : mapping of str to float
        By name: a, b, c, d of Eq. (4) with b > d, in time from the first one fitted; coefficients c0, c1, ... else.
    value, derivative : callable
        Smoothed amplitude at times [s], the record's own, and its rate [1/s times the amplitude's unit].
    """

    constants: Mapping[str, float]
    value: Callable[[FloatArray], FloatArray]
    derivative: Callable[[FloatArray], FloatArray]


class TrialFunction(Protocol):
    """A form to fit; `fit` finds its constants by least squares."""

    def fit(self, time: FloatArray, amplitude: FloatArray) -> TrialFit:
        """Fit to `amplitude` at `time`, both (N,)."""


def block_means(time: FloatArray, amplitude: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Thin a long series to block means and their counts, for weighted least squares.

    A sum of squares about a curve is that of the block means, weighted by counts, plus the scatter inside the
    blocks, which does not depend on the curve while it is straight over one block (1/2000 of the record).
    """
    n = len(time)
    if n <= _POINTS:
        return time, amplitude, np.ones(n)
    starts = np.linspace(0, n, _POINTS, endpoint=False).astype(np.intp)
    counts = np.diff(starts, append=n).astype(float)
    return np.add.reduceat(time, starts) / counts, np.add.reduceat(amplitude, starts) / counts, counts


def _exponentials(time: FloatArray, origin: float, a: float, b: float, c: float, d: float) -> FloatArray:
    """Eq. (4), A = a exp(b t) + c exp(d t); t counts from `origin` [s]."""
    t = np.asarray(time) - origin
    return a * np.exp(b * t) + c * np.exp(d * t)


@dataclass(frozen=True)
class SecondOrderExponential:
    """The form that the paper recommends, Eq. (4).

    The amplitudes a and c enter linearly, so that they are solved for while only the two rates are searched
    (variable projection): all pairs of a grid of rates, then least squares from the best few.
    """

    starts: int = 5

    def fit(self, time: FloatArray, amplitude: FloatArray) -> TrialFit:
        """Fit a, b, c, d by least squares with b > d.

        Raises
        ------
        ValueError
            If there are fewer than five points.
        """
        from scipy.optimize import least_squares

        if len(time) < 5:
            raise ValueError(f"four constants need five or more amplitudes; found {len(time)}")
        t, y, weight = block_means(time, amplitude)
        origin, length = float(time[0]), float(time[-1] - time[0])
        x, root = (t - origin) / length, np.sqrt(weight / weight.sum())

        def project(p: FloatArray) -> tuple[FloatArray, FloatArray]:
            fast, gap = p[0], np.exp(p[1])
            # e^(bx) and the divided difference [e^(bx) - e^(dx)]/(b - d): well conditioned even where b is near d
            first = np.exp(fast * (x if fast <= 0.0 else x - 1.0))
            design = np.stack([first, first * -np.expm1(-gap * x) / gap], axis=1) * root[:, None]
            linear = np.linalg.lstsq(design, y * root, rcond=None)[0]
            return linear, y * root - design @ linear

        def residual(p: FloatArray) -> FloatArray:
            return project(p)[1]

        box, exact = ([-_FASTEST, np.log(_CLOSEST)], [_SHORTEST, np.log(_FASTEST)]), 1e-12
        starts = _grid_minima(x, y, root, self.starts)
        fits = [
            least_squares(residual, np.clip(start, *box), bounds=box, xtol=exact, ftol=exact, gtol=exact)
            for start in starts
        ]
        best = min(fits, key=lambda fit: fit.cost).x
        rate, gap = best[0], np.exp(best[1])
        u, v = project(best)[0]
        scale = np.exp(-max(rate, 0.0))
        a, b = float(scale * (u + v / gap)), float(rate / length)
        c, d = float(-scale * v / gap), float((rate - gap) / length)
        return TrialFit(
            {"a": a, "b": b, "c": c, "d": d},
            partial(_exponentials, origin=origin, a=a, b=b, c=c, d=d),
            partial(_exponentials, origin=origin, a=a * b, b=b, c=c * d, d=d),
        )


def _grid_minima(x: FloatArray, y: FloatArray, root: FloatArray, count: int) -> list[FloatArray]:
    """The best `count` pairs (rate, log gap) of a grid, by the projected sum of squares of every pair at once."""
    steps = np.concatenate([-np.geomspace(_FASTEST, 0.05, 28), [0.0], np.geomspace(0.05, _SHORTEST, 12)])
    columns = np.exp(np.minimum(steps, 0.0) * x[:, None] + np.maximum(steps, 0.0) * (x[:, None] - 1.0))
    columns *= root[:, None]
    norm = np.sqrt(np.sum(columns**2, axis=0))
    columns /= norm
    target = columns.T @ (y * root)
    cosine = columns.T @ columns
    slow, fast = np.triu_indices(len(steps), 1)
    i, j = fast, slow  # steps ascend: i holds the larger rate, b
    r = cosine[i, j]
    determinant = np.maximum(1.0 - r**2, 1e-12)
    explained = (target[i] ** 2 + target[j] ** 2 - 2.0 * r * target[i] * target[j]) / determinant
    chosen: list[FloatArray] = []
    for k in np.argsort(-explained):
        point = np.array([steps[i[k]], np.log(steps[i[k]] - steps[j[k]])])
        # starts that lie in one basin only repeat each other
        if all(np.abs(np.arcsinh(point[0]) - np.arcsinh(q[0])) + abs(point[1] - q[1]) > 0.7 for q in chosen):
            chosen.append(point)
        if len(chosen) == count:
            break
    return chosen


def _coefficients(values: np.ndarray) -> dict[str, float]:
    return {f"c{i}": float(c) for i, c in enumerate(values)}


@dataclass(frozen=True)
class Polynomial:
    """A polynomial of a stated order; its coefficients multiply powers of the time mapped on [-1, 1]."""

    order: int = 6

    def fit(self, time: FloatArray, amplitude: FloatArray) -> TrialFit:
        """Fit by least squares; ValueError if the points do not determine the coefficients."""
        if len(time) <= self.order + 1:
            raise ValueError(f"a polynomial of order {self.order} needs more than {self.order + 1} amplitudes")
        t, y, weight = block_means(time, amplitude)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RankWarning)
            try:
                polynomial = np.polynomial.Polynomial.fit(t, y, self.order, w=np.sqrt(weight))
            except RankWarning:
                raise ValueError(f"a polynomial of order {self.order}, which the amplitudes do not determine") from None
        return TrialFit(_coefficients(polynomial.coef), polynomial, polynomial.deriv())


@dataclass(frozen=True)
class CubicSpline:
    """A least-squares cubic spline with so many knots equally spaced inside the record."""

    knots: int = 8

    def fit(self, time: FloatArray, amplitude: FloatArray) -> TrialFit:
        """Fit by least squares; ValueError if there are too few points for the knots."""
        from scipy.interpolate import make_lsq_spline

        if len(time) < 2 * (self.knots + 4):
            raise ValueError(f"a spline with {self.knots} knots needs {2 * (self.knots + 4)} or more amplitudes")
        t, y, weight = block_means(time, amplitude)
        inner = np.linspace(time[0], time[-1], self.knots + 2)
        # the record's own ends close the spline; block means lie inside them
        knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
        spline = make_lsq_spline(t, y, knots, k=3, w=np.sqrt(weight))
        return TrialFit(_coefficients(spline.c), spline, partial(spline, nu=1))


TRIAL_FUNCTIONS: Mapping[str, TrialFunction] = {
    "second-order exponential": SecondOrderExponential(),
    "polynomial": Polynomial(),
    "cubic spline": CubicSpline(),
}
"""The trial functions of the paper's Fig. 13 by name, with orders that suit a record of some hundred cycles."""


def trial_function(name: str) -> TrialFunction:
    """Look a trial function up by name; "polynomial 8" and "cubic spline 12" set the order or the knots.

    Raises
    ------
    ValueError
        If the name is unknown; the message lists the names.
    """
    form, _, number = name.rpartition(" ")
    if number.isdigit() and form == "polynomial":
        return Polynomial(int(number))
    if number.isdigit() and form == "cubic spline":
        return CubicSpline(int(number))
    if name not in TRIAL_FUNCTIONS:
        raise ValueError(f"unknown trial function {name!r}; known are {', '.join(TRIAL_FUNCTIONS)}")
    return TRIAL_FUNCTIONS[name]
