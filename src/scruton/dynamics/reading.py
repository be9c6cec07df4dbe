"""What a sensor that saturates shows of a harmonic motion, and what shows so."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.dynamics.effects.terms import Term

_GAIN, _CLIP, _SOFT = int(Term.GAIN), int(Term.CLIP), int(Term.CLIP_SOFT)
# Gauss-Chebyshev quadrature over a quarter of a wave: exact for smooth waves.
_ANGLES = 16
_ANGLE = (np.arange(_ANGLES) + 0.5) * 0.5 * np.pi / _ANGLES
_COSINE, _COSINE_THIRD = np.cos(_ANGLE), np.cos(3.0 * _ANGLE)


@njit(cache=True, inline="always")
def third_of_bend(level, linear, square, fourth):  # type: ignore[no-untyped-def]
    """Third harmonic of the motion over the first, where the spring bends with A, A^2 and A^4, at an amplitude.

    Of its change of the frequency a restoring force in x^3 makes a twelfth, x^5 an eighth, |x| x a twentieth.
    """
    return level * (0.6 * linear + level * (square + 1.5 * level * level * fourth)) / 12.0


@njit(cache=True)
def saturated_reading(a, level, soft):  # type: ignore[no-untyped-def]
    """Amplitude of the fundamental of a saturated sine, its slope, and the third harmonic over the amplitude."""
    if level <= 0.0:
        return a, 1.0, 0.0
    x = a / level
    if soft > 0.5:
        first, slope, third = 0.0, 0.0, 0.0
        for j in range(_ANGLES):
            cosine = _COSINE[j]
            z = x * cosine
            if soft > 2.5:
                most = 1.0 + abs(z) ** soft
                root = most ** (1.0 / soft)
                t, steep = z / root, 1.0 / (root * most)
            elif soft > 1.5:
                # z / (1 + z^8)^(1/8): rounded, but sharper than tanh
                z2 = z * z
                z8 = z2 * z2 * z2 * z2
                root = np.sqrt(np.sqrt(np.sqrt(1.0 + z8)))
                t, steep = z / root, 1.0 / (root * (1.0 + z8))
            else:
                t = np.tanh(z)
                steep = 1.0 - t * t
            first += t * cosine
            slope += steep * cosine * cosine
            third += t * _COSINE_THIRD[j]
        scale = 2.0 / _ANGLES
        return level * first * scale, slope * scale, third * scale / max(x, 1e-12)
    if -2.5 < soft < -1.5:
        return _loose(a, level)
    if x <= 1.0:
        return (a, 1.0, 0.0) if soft > -2.5 else (1e-3 * a, 1e-3, 0.0)
    share, slope, third = _cut(x)
    if soft < -2.5:  # the rest of what ends there
        return max(a * (1.0 - share), 1e-3 * a), 1.0 - slope, -third
    if soft < 0.0:  # the other side ends elsewhere, or not at all
        share_other, slope_other, third_other = _cut(x * max(1.0 + soft, 0.0))
        share, slope, third = 0.5 * (share + share_other), 0.5 * (slope + slope_other), 0.5 * (third + third_other)
    return a * share, slope, third


@njit(cache=True)
def _loose(a, play):  # type: ignore[no-untyped-def]
    """The same of a sensor that follows with play: it stands until the motion has come back by twice the half width."""
    first, third = _followed(a, play)
    further, _ = _followed(a * 1.0001, play)
    return abs(first), (abs(further) - abs(first)) / (1e-4 * a), third


@njit(cache=True)
def _followed(a, play):  # type: ignore[no-untyped-def]
    """First harmonic, complex, of what follows a sine with play, and the third in phase with it, over the amplitude."""
    if a <= 1.001 * play:
        return 1e-3 * a + 0.0j, 0.0
    stays = np.arccos(1.0 - 2.0 * play / a)  # angle from the crest at which it moves again
    turn = np.exp(1j * stays)
    turn2, turn3, turn4 = turn * turn, turn * turn * turn, turn * turn * turn * turn
    first = (a - play) * (turn - 1.0) / 1j + play * (-1.0 - turn) / 1j
    first += 0.5 * a * ((1.0 - turn2) / 2j + np.pi - stays)
    third = (a - play) * (turn3 - 1.0) / 3j + play * (-1.0 - turn3) / 3j
    third += 0.5 * a * ((1.0 - turn4) / 4j + (1.0 - turn2) / 2j)
    first, third = 2.0 / np.pi * first, 2.0 / np.pi * third
    phase = first / abs(first)
    return first, (third / (phase * phase * phase)).real / a


@njit(cache=True, inline="always")
def _cut(x):  # type: ignore[no-untyped-def]
    """The same over the amplitude, of a wave of x times the level that ends there on both sides."""
    if x <= 1.0:
        return 1.0, 1.0, 0.0
    rho = 1.0 / x
    s = np.sqrt(1.0 - rho * rho)
    angle = np.arcsin(rho)
    return 2.0 / np.pi * (angle + rho * s), 2.0 / np.pi * (angle - rho * s), -4.0 / (3.0 * np.pi) * rho * s * s * s


@njit(cache=True)
def inverse_reading(y, level, soft):  # type: ignore[no-untyped-def]
    """Amplitude whose reading is y, by a few Newton steps."""
    a = y
    if level > 0.0:
        for _ in range(8):
            value, slope, _ = saturated_reading(a, level, soft)
            a += min(max((y - value) / max(slope, 0.05), -0.5 * a), 0.5 * a)
    return a


def readings(table: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Readings of (W,) amplitudes by the sensors of (W, COLUMNS) rows of coefficients, (W,)."""
    return np.asarray(_readings(np.ascontiguousarray(table), amplitude))


@njit(cache=True)
def _readings(table, amplitude):  # type: ignore[no-untyped-def]
    shown = np.empty(amplitude.shape)
    for w in range(amplitude.size):
        shown[w] = (1.0 + table[w, _GAIN]) * saturated_reading(amplitude[w], table[w, _CLIP], table[w, _SOFT])[0]
    return shown
