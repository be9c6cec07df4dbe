r"""Dampers that stick and strike: dry friction and end stops beside the dashpot, by equivalent harmonic balance.

Beside its spring and dashpot a damper has friction of size F, and springs that it meets at a stroke s, kappa times as
stiff as its own.  In a vibration of stroke X at frequency g (lengths as they are, times over the mode's), friction is a
dashpot and the stops are a spring,

.. math:: 2\zeta f g \to 2\zeta f g + \frac{4 F/m\omega^2}{\pi X}, \qquad
   f^2 \to f^2\Big[1 + \kappa\Big(1 - \tfrac2\pi\big(\arcsin a + a\sqrt{1 - a^2}\big)\Big)\Big], \quad
   a = \min(1, s/X),

so what the damper adds depends on the amplitude.  Below g^2 A = 4F/(pi m omega^2) it does not move: it is mass alone.
(The mass breaks loose at F/(m omega^2) already and then sticks and slips; it takes next to nothing there.)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scruton.arrays import BoolArray, FloatArray
from scruton.sizing.thresholds import STOP_STIFFNESS
from scruton.sizing.tmd import Response, resonance, respond

_PASSES, _CLOSE = 8, 1e-5  # from the frequency to strokes and back, and a change of it that is none
_HELD = 1e3  # damping ratio of a damper that friction holds
_SCAN, _HALVINGS = 14, 12  # of the amplitude
_TOP = 1.3  # of the amplitude without dampers: their mass lowers the frequency, which may raise it
_DEEPEST = 1e-3  # of the amplitude without dampers, below which a vibration has died


@dataclass(frozen=True)
class Flaws:
    """What keeps dampers from moving freely.

    Attributes
    ----------
    friction : float or (S,) array
        Force over the damper's mass and the square of the mode's circular frequency, F/(m omega^2) [m].
    stop : float or (S,) array
        Stroke at which the mass meets its end stops [m]; inf: none; one for each draw, as friction, if need be.
    stop_stiffness : float
        Of the stops, over the damper's own spring.
    """

    friction: float | FloatArray = 0.0
    stop: float | FloatArray = np.inf
    stop_stiffness: float = STOP_STIFFNESS

    @property
    def none(self) -> bool:
        """Whether the damper is linear."""
        return not np.any(self.friction) and bool(np.all(np.isinf(self.stop)))


def respond_at(
    mass_ratio: FloatArray, frequency_ratio: FloatArray, damping_ratio: FloatArray, movement: FloatArray, flaws: Flaws
) -> Response:
    """What dampers do where the mode moves them with a given amplitude.

    Parameters
    ----------
    mass_ratio, frequency_ratio, damping_ratio : (dampers, S) array
        As of `scruton.sizing.tmd.respond`.
    movement : (dampers, S) array
        Amplitude of the bridge where each damper stands [m].
    flaws : Flaws
    """
    mu, f, zeta, movement = np.broadcast_arrays(mass_ratio, frequency_ratio, damping_ratio, movement)
    found = respond(mu, f, zeta)
    if flaws.none:
        return found
    added, frequency, relative = found.added_damping.copy(), found.frequency.copy(), found.stroke.copy()
    friction, stop = (np.broadcast_to(each, frequency.shape) for each in (flaws.friction, flaws.stop))
    rest = np.arange(frequency.size)  # draws whose frequency still moves
    for _ in range(_PASSES):
        g, left = frequency[rest], Flaws(friction[rest], stop[rest], flaws.stop_stiffness)
        of = mu[:, rest], f[:, rest], zeta[:, rest]
        stroke = _stroke(of[1], of[2], g, movement[:, rest], left)
        share = np.where(stroke > left.stop, left.stop / np.maximum(stroke, 1e-300), 1.0)
        stiff = of[1] * np.sqrt(1.0 + flaws.stop_stiffness * _contact(share))
        with np.errstate(divide="ignore", invalid="ignore"):
            dry = np.where(np.asarray(left.friction) > 0.0, 2.0 * left.friction / (np.pi * g * stroke), 0.0)
        found = respond(of[0], stiff, np.minimum((of[2] * of[1] + dry) / stiff, _HELD))
        added[rest], frequency[rest], relative[:, rest] = found.added_damping, found.frequency, found.stroke
        rest = rest[np.abs(found.frequency - g) >= _CLOSE]
        if not rest.size:
            break
    return Response(added, frequency, relative)


def limit_cycle(
    respond_to: Callable[[FloatArray], Response],
    amplitude: Callable[[FloatArray, FloatArray], FloatArray],
    limit: float,
    *,
    largest: bool,
) -> tuple[FloatArray, Response]:
    """Stable limit cycle of every draw with dampers whose effect depends on the amplitude.

    Parameters
    ----------
    respond_to : callable
        What the dampers do at amplitudes (S,) of the mode.
    amplitude : callable
        Amplitude (S,) at an added damping and a frequency of the response, both (S,).
    limit : float
        The amplitude that matters; what is beyond a thousand times of it counts as that.
    largest : bool
        The largest one, which a vibration from above ends in, or the least, which growth from rest ends in.

    Returns
    -------
    amplitude : (S,) array
        Zero where the vibration dies.
    response : Response
        There.
    """

    def grows(size: FloatArray) -> BoolArray:
        found = respond_to(size)
        return np.asarray(amplitude(found.added_damping, found.frequency) >= size)

    shape = respond_to(np.full(1, limit)).added_damping.shape
    free = np.minimum(amplitude(np.zeros(shape), np.ones(shape)), 1e3 * limit)
    top = _TOP * np.maximum(free, 1e-12 * limit)
    step = (_DEEPEST / _TOP) ** (1.0 / _SCAN)
    # The first change between growth and decay, from above or from rest; a draw that has found it stays there.
    high, low = top, top * step
    if not largest:
        high, low = top * step ** (_SCAN - 1), top * step**_SCAN
    for _ in range(_SCAN - 1):
        if largest:
            moving = ~grows(low)
            high, low = np.where(moving, low, high), np.where(moving, low * step, low)
        else:
            moving = grows(high) & (high < top)
            high, low = np.where(moving, high / step, high), np.where(moving, high, low)
    alive = grows(low)
    for _ in range(_HALVINGS):
        middle = np.sqrt(low * high)
        up = grows(middle)
        low, high = np.where(up, middle, low), np.where(up, high, middle)
    size = np.where(alive, np.sqrt(low * high), 0.0)
    return size, respond_to(size)


def _contact(share: FloatArray) -> FloatArray:
    """Part of the stops' stiffness that a vibration of stroke s/share meets."""
    return np.asarray(1.0 - 2.0 / np.pi * (np.arcsin(share) + share * np.sqrt(1.0 - share**2)))


def _stroke(f: FloatArray, zeta: FloatArray, g: FloatArray, movement: FloatArray, flaws: Flaws) -> FloatArray:
    """Stroke at a frequency, (dampers, S): that without contact where there is one, else the least with it."""
    push, dry = g**2 * movement, 4.0 * flaws.friction / np.pi
    viscous, square = 2.0 * zeta * f * g, resonance(f, zeta, g)
    inner = np.maximum((viscous * dry) ** 2 + square * (push**2 - dry**2), 0.0)
    stroke = np.where(push > dry, (np.sqrt(inner) - viscous * dry) / square, 0.0)
    strikes = stroke > flaws.stop
    if not strikes.any():
        return stroke
    f, viscous, push, g, dry, stop = (
        np.broadcast_to(each, stroke.shape)[strikes] for each in (f, viscous, push, g, dry, flaws.stop)
    )

    def short(x: FloatArray) -> FloatArray:
        spring = f**2 * (1.0 + flaws.stop_stiffness * _contact(stop / x)) - g**2
        return np.asarray((spring * x) ** 2 + (viscous * x + dry) ** 2 < push**2)

    low, high = stop, 1.05 * stop
    for _ in range(150):  # small steps: the least root is wanted
        more = short(high)
        if not more.any():
            break
        low, high = np.where(more, high, low), np.where(more, 1.05 * high, high)
    for _ in range(30):
        middle = 0.5 * (low + high)
        more = short(middle)
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    stroke[strikes] = high
    return stroke
