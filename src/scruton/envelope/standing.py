"""Transients that pass the amplitude where they come to stand, and return to it."""

from dataclasses import dataclass, replace

import numpy as np

from scruton.envelope.sampling import run_lengths
from scruton.envelope.thresholds import FEWEST_STANDING, STANDING, SWING, SWING_SIGMAS, UNSETTLED_SWING
from scruton.envelope.types import Cycles


@dataclass(frozen=True, eq=False)
class Swing:
    """A transient that swings past its stable amplitude.

    Attributes
    ----------
    beyond : float
        By how much it passes the amplitude where it comes to stand, over that.
    standing : Cycles
        From where it stands.
    """

    beyond: float
    standing: Cycles


def swing(cycles: Cycles) -> Swing | None:
    """How a transient swings past the amplitude where it comes to stand; None where it does not, or never stands.

    Notes
    -----
    Where the damping depends on the amplitude alone, dA/dt = -omega xi(A) A, the amplitude comes to its stable value
    from one side and stays, but for what the wind's fluctuations do.  One that goes on by far more than it scatters
    once it stands, and returns, has a second state behind it, an air that remembers: no such xi(A) describes it.
    It stands if it does so for longer than it was away: where a swing turns round it rests, too.
    """
    smooth = np.convolve(cycles.amplitude, np.ones(5) / 5.0, mode="valid")
    late = smooth[3 * smooth.size // 4 :]
    if late.size < FEWEST_STANDING:
        return None
    level, scatter = float(np.median(late)), float(late.std())
    halves = [float(half.mean()) for half in np.array_split(late, 2)]
    if abs(halves[1] - halves[0]) > UNSETTLED_SWING * level:
        return None
    side = 1.0 if smooth[0] > level else -1.0
    past = side * (level - smooth) / level  # positive on the side that it did not come from
    crossed = int(np.argmax(past > 0.0))
    beyond = float(past[crossed : smooth.size - late.size].max(initial=0.0))
    if not beyond > max(SWING, SWING_SIGMAS * scatter / level):
        return None
    far = np.abs(smooth - level) > max(STANDING * level, SWING_SIGMAS * scatter)
    start = min(int(far.size - np.argmax(far[::-1])), smooth.size - late.size)
    if smooth.size - start < int(np.max(run_lengths(past[crossed:start] > 0.0), initial=0)):
        return None
    start += 2  # the middle of five cycles
    names = ("time", "amplitude", "standard_error", "phase", "frequency", "frequency_error")
    return Swing(beyond, replace(cycles, **{name: getattr(cycles, name)[start:] for name in names}))
