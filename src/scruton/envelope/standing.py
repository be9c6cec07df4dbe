"""Transients that pass the amplitude where they come to stand, and return to it, and records that never stand."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.sampling import run_lengths
from scruton.envelope.thresholds import (
    BEATS,
    FEWEST_STANDING,
    PASSES,
    STANDING,
    SWING,
    SWING_SIGMAS,
    UNSETTLED,
    UNSETTLED_SIGMAS,
    UNSETTLED_SWING,
)
from scruton.envelope.types import Cycles


@dataclass(frozen=True, eq=False)
class Swing:
    """A transient that swings past its stable amplitude.

    Attributes
    ----------
    beyond : float
        By how much it passes the amplitude where it comes to stand, over that.
    standing : Cycles
        From where it stands, or its second half where it swings to the end.
    settled : bool
        Whether it stands; the mean is else known to no better than what it swings by.
    """

    beyond: float
    standing: Cycles
    settled: bool


def swing(cycles: Cycles, *, anyway: bool = False) -> Swing | None:
    """How a transient swings past the amplitude where it comes to stand; None where it does not.

    `anyway` asks where it stands though it may not swing; None then where it is too short to say.

    Notes
    -----
    Where the damping depends on the amplitude alone, dA/dt = -omega xi(A) A, the amplitude comes to its stable value
    from one side and stays, but for what the wind's fluctuations do.  One that goes on by far more than it scatters
    in the end, and returns, has a second state behind it, an air that remembers: no such xi(A) describes it.
    It stands if it does so for longer than it was away: where a swing turns round it rests, too.
    """
    whole = cycles.smoothed()
    quarter, half = 3 * whole.size // 4, whole.size // 2
    if whole.size - quarter < FEWEST_STANDING:
        return None
    smooth = np.log(np.maximum(whole, 1e-3 * whole.max()))
    late = smooth[quarter:]
    level, scatter = float(np.median(late)), float(late.std())
    crossed, beyond = _beyond(smooth, level, quarter)
    moved = abs(float(smooth[half:quarter].mean()) - level)
    if (anyway or abs(beyond) > max(SWING, SWING_SIGMAS * scatter)) and moved <= UNSETTLED:
        far = np.abs(smooth - level) > max(STANDING, SWING_SIGMAS * scatter)
        start = min(int(far.size - np.argmax(far[::-1])), quarter)
        away = (smooth[crossed:start] > level) != (smooth[0] > level)
        if smooth.size - start >= int(np.max(run_lengths(away), initial=0)):
            return Swing(
                abs(float(np.expm1(beyond))), cycles.part(slice(start + 2, None)), settled=True
            )  # the middle of five
    level, scatter = float(smooth[half:].mean()), float(smooth[half:].std())
    crossed, beyond = _beyond(smooth, level, half)
    returned = bool(np.any((smooth[crossed:half] > level) == (smooth[0] > level)))
    if anyway or (returned and abs(beyond) > max(UNSETTLED_SWING, UNSETTLED_SIGMAS * scatter)):
        return Swing(abs(float(np.expm1(beyond))), cycles.part(slice(half + 2, None)), settled=False)
    return None


def beats(cycles: Cycles) -> tuple[float, float] | None:
    """5 and 95 % points over the second half of a record whose amplitude rises and falls to the end; None if it stands.

    There is no one stable amplitude then: two states behind the motion pass energy to each other, or the wind changes.
    """
    late = cycles.smoothed()
    late = late[late.size // 2 :]
    if late.size < FEWEST_STANDING:
        return None
    log = np.log(np.maximum(late, 1e-3 * late.max()))
    passes = int(np.count_nonzero(np.diff(log > np.median(log))))
    if not (log.std() > BEATS and passes >= PASSES):
        return None
    low, high = np.quantile(late, [0.05, 0.95]).tolist()
    return low, high


def _beyond(log_amplitude: FloatArray, level: float, until: int) -> tuple[int, float]:
    """Where a transient first crosses a level, and how far it goes beyond it before `until`, with its sign."""
    side = 1.0 if log_amplitude[0] > level else -1.0
    past = side * (level - log_amplitude)
    crossed = int(np.argmax(past > 0.0))
    return crossed, -side * float(past[crossed:until].max(initial=0.0))
