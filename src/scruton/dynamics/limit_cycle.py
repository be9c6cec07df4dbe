"""Limit cycles: the amplitude that the motion comes to under any drift, and what of it goes to a bridge."""

from collections.abc import Callable

import numpy as np

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.dynamics.effect_drift import effect_drift, has_hats
from scruton.dynamics.effects.terms import BELONGS, HATS, Belongs, Term
from scruton.dynamics.thresholds import RANGE

_GRID = 280
_HALVINGS = 40
# What does not go to a bridge; the damping ratio itself is the bridge's own, by its Scruton number.
_LEFT_BEHIND = [int(term) for term in Term if BELONGS[term] is not Belongs.WIND and term is not Term.STRUCTURAL]


@njit(cache=True)
def _rates(table, amplitude, knots):  # type: ignore[no-untyped-def]
    """da/dt of every row of coefficients at its own amplitudes, (W, A)."""
    rates = np.empty(amplitude.shape)
    for w in range(amplitude.shape[0]):
        hats = has_hats(table[w])
        for i in range(amplitude.shape[1]):
            a = amplitude[w, i]
            rates[w, i] = effect_drift(a, a, table[w], 0.0, 0.0, 0.0, hats, knots)[0]
    return rates


def amplitude_rates(table: FloatArray, amplitude: FloatArray, knots: FloatArray) -> FloatArray:
    """da/dt [amplitude per second], (W, A), in the middle of the record, with a wake that has caught up.

    Rows of coefficients, (W, COLUMNS), at amplitudes (A,) or (W, A); ln(amplitude) of the discrepancy's knots, (HATS,).
    """
    grid = np.empty((len(table), amplitude.shape[-1]))  # a read-only view is another type, compiled for once more
    grid[:] = amplitude
    return np.asarray(_rates(np.ascontiguousarray(table), grid, knots))


def limit_cycle_amplitude(table: FloatArray, knots: FloatArray | None, scale: float) -> FloatArray:
    """Amplitude of the limit cycle that the equation with effects comes to, (W,): see `attracting_amplitude`.

    `table` and `knots` are those of `amplitude_rates`; without a generic discrepancy there are no knots.
    """
    log_knots = np.linspace(0.0, 1.0, HATS) if knots is None else knots
    table = np.ascontiguousarray(table)
    return attracting_amplitude(lambda a: amplitude_rates(table, a, log_knots), len(table), scale)


def attracting_amplitude(rate: Callable[[FloatArray], FloatArray], walkers: int, scale: float) -> FloatArray:
    """Amplitude that the motion comes to under any drift, (W,): 0 where it dies out, inf where it grows without end.

    Of several stable amplitudes it is the one that growth from a small amplitude reaches; where small amplitudes die
    out (friction, coherence lost) it is the one that the widest range of ln(amplitude) leads to.  It is sought by
    bisection, from 0.004 to 8 times `scale`, a typical amplitude; `rate` gives da/dt at amplitudes (W, A).
    """
    grid = scale * np.geomspace(*RANGE, _GRID)
    up = rate(np.broadcast_to(grid, (walkers, _GRID))) > 0.0
    stable = up[:, :-1] & ~up[:, 1:]
    chosen = np.argmax(stable, axis=1)
    threshold = stable.any(axis=1) & ~up[:, 0]
    for w in np.flatnonzero(threshold):
        # Basins reach from one unstable amplitude to the next.
        edges = np.r_[np.flatnonzero(~up[w, :-1] & up[w, 1:]), _GRID - 1]
        chosen[w] = max(
            (int(i) for i in np.flatnonzero(stable[w])),
            key=lambda i: edges[edges >= i].min() - edges[edges <= i].max(initial=0),
        )
    low, high = grid[chosen], grid[chosen + 1]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        above = rate(middle[:, None])[:, 0] > 0.0
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.where(stable.any(axis=1), 0.5 * (low + high), np.where(up[:, -1], np.inf, 0.0))


def transferred(table: FloatArray) -> FloatArray:
    """Coefficients without what belongs to the rig, the run or the reading.

    The wind's own goes to a bridge: the law, further aerodynamic damping, loss of coherence, drift with the reduced
    velocity (at that test's), memory (which moves no stable amplitude), and the generic discrepancy, for want of
    knowing better.  The suspension's own stays in the laboratory: friction, structural damping that varies with
    amplitude, an error of the stated damping (when `scruton_number` gives the bridge's own), stiffness.  So do wind
    that drifted in one run, and gain and saturation of a sensor.
    """
    kept = table.copy()
    kept[..., _LEFT_BEHIND] = 0.0
    return kept
