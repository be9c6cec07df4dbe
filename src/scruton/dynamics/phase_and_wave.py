"""Phase and third harmonic of every cycle, for walkers side by side: where stiffness, forcing and saturation show."""

from scruton.compiled import njit
from scruton.dynamics import row
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.friction import at_speed, stiffening
from scruton.dynamics.reading import third_of_bend

_GAIN, _R = int(Term.GAIN), int(Term.NOISE)
_DET, _PQ = int(Term.DETUNING), int(Term.PHASE_SCATTER)
_ST1, _ST2, _ST4 = int(Term.STIFFNESS_LINEAR), int(Term.STIFFNESS), int(Term.STIFFNESS_FOURTH)
_CREEP, _LOSS = int(Term.FREQUENCY_TREND), int(Term.FREQUENCY_LOSS)
_FW, _FS, _FP = int(Term.FRICTION_WIDTH), int(Term.FRICTION_SPRING), int(Term.FRICTION_POWER)
_HUMP, _HUMP_AT = int(Term.FRICTION_HUMP), int(Term.FRICTION_HUMP_AT)
_H3, _H3R = int(Term.THIRD), int(Term.THIRD_NOISE)


@njit(cache=True, inline="always")
def wander(x, y, omega, step):  # type: ignore[no-untyped-def]
    """Move the phase on: its pace follows stiffness and forcing."""
    for w in range(row.LANES):
        a = max((y - x[row.LINE, w]) / (1.0 + x[_GAIN, w]), 1e-12)
        bend = a * (x[_ST1, w] + a * (x[_ST2, w] + a * a * x[_ST4, w]))
        pace = omega * ((1.0 + x[_DET, w]) * (1.0 + bend) - 1.0) + x[row.SIDE, w] / a
        x[row.ANGLE, w] += pace * step
        x[row.ANGLE_P, w] += x[_PQ, w] * x[_PQ, w] / (a * a) * step


@njit(cache=True)
def creep(x, turned, place, grown):  # type: ignore[no-untyped-def]
    """Move the phase on by what the frequency has changed by since the middle of the record, and by what growth costs.

    That is of second order in the rate, the share of itself `grown` by while it `turned`: a force that is the sign of
    the velocity runs ahead of the phase.
    """
    rate = grown / turned
    for w in range(row.LANES):
        x[row.ANGLE, w] += turned * (x[_CREEP, w] * place - x[_LOSS, w] * rate * rate)


@njit(cache=True)
def stick(x, y, turned):  # type: ignore[no-untyped-def]
    """Move the phase on by what friction that builds up over a displacement adds to the frequency."""
    for w in range(row.LANES):
        if x[_FS, w] != 0.0:
            a = max((y - x[row.LINE, w]) / (1.0 + x[_GAIN, w]), 1e-12)
            strength = x[_FS, w]
            if x[_FP, w] != 0.0 or x[_HUMP, w] != 0.0:
                strength *= at_speed(a, x[_FP, w], x[_HUMP, w], x[_HUMP_AT, w])[0]
            x[row.ANGLE, w] += turned * stiffening(a, strength, x[_FW, w])


@njit(cache=True, inline="always")
def found(x, y, se, phase):  # type: ignore[no-untyped-def]
    """The first phase that is seen is where it starts."""
    for w in range(row.LANES):
        r2 = x[_R, w] * se * x[_R, w] * se
        x[row.ANGLE, w], x[row.ANGLE_P, w] = phase, r2 / (y * y + r2)


@njit(cache=True, inline="always")
def turn(x, y, se, phase):  # type: ignore[no-untyped-def]
    """Innovation of the phase, and what is learned from it."""
    for w in range(row.LANES):
        r2 = x[_R, w] * se * x[_R, w] * se
        noise = r2 / (y * y + r2)
        v, s = phase - x[row.ANGLE, w], x[row.ANGLE_P, w] + noise
        part = x[row.ANGLE_P, w] / s
        x[row.ANGLE, w] += part * v
        x[row.ANGLE_P, w] = part * noise
        x[row.V, w], x[row.S, w] = v, s


@njit(cache=True, inline="always")
def wave(x, third, se):  # type: ignore[no-untyped-def]
    """Innovation of the third harmonic, which nothing is learned from."""
    for w in range(row.LANES):
        level, blur = x[row.LEVEL, w], x[_H3R, w] * se
        bend = third_of_bend(level, x[_ST1, w], x[_ST2, w], x[_ST4, w])
        x[row.V, w] = third - (1.0 + x[_GAIN, w]) * level * (x[row.THIRD, w] + x[_H3, w] + bend)
        x[row.S, w] = blur * blur
