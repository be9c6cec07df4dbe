r"""What a section does that no law says: a smooth factor on the drift of the law, as large as the records ask for.

.. math:: \dot a = f(a; a^*, \lambda)\, (1 + g), \qquad g = \sum_k \theta_k\, \varphi_k(\ln a/a^*), \quad
   \theta_k \sim N(0, s^2)

g is a random walk in ln(amplitude), pinned to zero at the stable amplitude: a* stays the zero of the drift and lambda
its slope there, whatever g is.  It walks on either side by itself, so that growth and decay may differ, as they do
where the wake remembers.  The columns are ramps between `GROWTH` or `DECAY` knots, of the variance of the walk between
them, and s is the standard deviation that g has one e-fold from a*.  The filters carry theta as states that do not
change; as the drift is linear in them, so is what a cycle says of them.

A wake that remembers is not that of the amplitude of the moment: at the start of a record the slow state of the wind
(`scruton.dynamics.moments`) has, beside that of the gusts, a standard deviation of s^2 a*, and fades at their rate.
"""

from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.compiled import njit

# Knots of the walk, as ratios of the amplitude to a*: below it, and above.
GROWTH, DECAY = (1.0, 0.7, 0.35, 0.1), (1.0, 1.35, 2.3)
COLUMNS = len(GROWTH) + len(DECAY) - 2
STATIC = 1 + COLUMNS  # with the set-point of the record
ROUGH = 0.15  # of s: sd of the departure about its ramps, which the filters take for noise of each cycle's own
_LEAST, _LARGEST = 0.4, 20.0  # of 1 + g; the least times a/a* below a*, where the laws differ by as much
_NOTHING = 1e-6  # of a*


@njit(cache=True, inline="always")
def place_of(a, a_star):  # type: ignore[no-untyped-def]
    """2 (a - a*)/(a + a*), which is ln(a/a*) to second order and needs no logarithm; -2 for all below zero."""
    a = max(a, 0.0)
    return 2.0 * (a - a_star) / (a + a_star + 1e-300)


def _place(ratio: Any) -> Any:
    return 2.0 * (ratio - 1.0) / (ratio + 1.0)


def _columns() -> tuple[tuple[float, ...], ...]:
    """Place where each ramp starts, 1 / its length in place (negative for growth), sqrt of its length in ln(a)."""
    pairs = [(knots[i], knots[i + 1]) for knots in (GROWTH, DECAY) for i in range(len(knots) - 1)]
    start = tuple(_place(a) for a, _ in pairs)
    steep = tuple(1.0 / (_place(b) - _place(a)) for a, b in pairs)
    return start, steep, tuple(float(np.sqrt(abs(np.log(b / a)))) for a, b in pairs)


START, STEEP, HEIGHT = (np.array(values) for values in _columns())


def relative_drift(ratio: FloatArray, theta: FloatArray) -> FloatArray:
    """1 + g, bounded, at amplitudes over the stable one, (...), with columns theta (..., COLUMNS)."""
    ratio = np.maximum(ratio, 0.0)
    columns = HEIGHT * np.clip((_place(ratio)[..., None] - START) * STEEP, 0.0, 1.0)
    return np.asarray(np.clip(1.0 + (columns * theta).sum(axis=-1), _LEAST * np.clip(ratio, _NOTHING, 1.0), _LARGEST))


@njit(cache=True, inline="always")
def ramp(place, k):  # type: ignore[no-untyped-def]
    """Column k at a place, of unit scale."""
    return HEIGHT[k] * min(max((place - START[k]) * STEEP[k], 0.0), 1.0)


@njit(cache=True, inline="always")
def factor(g, place):  # type: ignore[no-untyped-def]
    """1 + g, bounded: the drift keeps its sign, and stands nearly still at no amplitude but a*."""
    least = _LEAST * max((2.0 + min(place, 0.0)) / (2.0 - min(place, 0.0)), _NOTHING)
    return min(max(1.0 + g, least), _LARGEST)


@njit(cache=True, inline="always")
def faded(rate, dt):  # type: ignore[no-untyped-def]
    """exp(-rate dt) for what a departure adds to a rate: to 1e-3 of 1 - exp(-rate dt) where that is under one."""
    x = 0.125 * rate * dt
    root = (1.0 - x) / (1.0 + x)
    root *= root
    return root * root


@njit(cache=True, inline="always")
def factor_at(a, a_star, theta):  # type: ignore[no-untyped-def]
    """1 + g at an amplitude; theta (STATIC,) begins with the set-point, which has no part in it."""
    place, g = place_of(a, a_star), 0.0
    for k in range(COLUMNS):
        g += theta[k + 1] * ramp(place, k)
    return factor(g, place)
