r"""The filter of the amplitude equation with any effect in it: amplitude, phase and waveform of every cycle.

Each record has a row of coefficients (`scruton.dynamics.effects.terms.Term`).  The amplitude is a state that the
equation moves and turbulence pushes about; the filter is linearised along its mean, by Runge-Kutta through every cycle.
Slow gusts of the drive, and what it is off by in one record, are states beside it (see `drive_moments`).
The phase is a state that wanders about its own frequency, and the in-phase third harmonic is read cycle by cycle: what
stiffness, forcing and a saturated sensor show themselves in.

Walkers stand side by side, a row of one array for each thing that they carry, as in `block_filter`.  What is rare
(friction, memory, the first cycle, gaps, a sensor that saturates) goes through them one by one.
"""

import numpy as np
from numba import njit
from numba.np.unsafe.ndarray import to_fixed_tuple

from scruton.arrays import FloatArray
from scruton.dynamics import drive_moments as rows
from scruton.dynamics.cycles import ABSENT, Channels
from scruton.dynamics.drive_moments import (
    DD, DH, DM, FADE, H, HALF, HALF_LOSS, HH, HM, HOLD, HOLD_MEAN, KEEP, LAGGED, LANES, MM, M, O, P, P_H, P_HH, P_HO,
    P_O, P_OO, PHI, PUSH, PUSH_MEAN, Q_CROSS, Q_END, Q_MEAN, RATE, gust_decay, moments_of_all, moments_of_lane,
)  # fmt: skip
from scruton.dynamics.effect_drift import drift_of, polynomial, rough, weather
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.moments import noise_drift
from scruton.dynamics.reading import inverse_reading, saturated_reading
from scruton.dynamics.thresholds import FAINT

_LAG, _LAG_START = int(Term.LAG), int(Term.LAG_START)
_FC, _FS, _FR = int(Term.FORCE_COS), int(Term.FORCE_SIN), int(Term.FORCE_RATE)
_GAIN, _CLIP, _SOFT = int(Term.GAIN), int(Term.CLIP), int(Term.CLIP_SOFT)
_Q, _R = int(Term.SCATTER), int(Term.NOISE)
_DET, _ST2, _ST1, _PQ = int(Term.DETUNING), int(Term.STIFFNESS), int(Term.STIFFNESS_LINEAR), int(Term.PHASE_SCATTER)
_H3, _H3R, _JT = int(Term.THIRD), int(Term.THIRD_NOISE), int(Term.JUMP_TIME)
_LC, _LS, _LR, _LD = int(Term.LINE_COS), int(Term.LINE_SIN), int(Term.LINE_RATE), int(Term.LINE_DECAY)
_GUST, _GUST_RATE, _SET_POINT = int(Term.GUST), int(Term.GUST_RATE), int(Term.SET_POINT)
# Columns that the amplitude depends on; the others move the phase and the third harmonic alone.
_DAMPING = np.setdiff1d(np.arange(COLUMNS), [_DET, _ST2, _ST1, _PQ, _H3, _H3R])
# Rows after those of `drive_moments`: of a record, of the weather in a cycle, of the way through it, of what is seen.
(
    _Q2, _G2, _ROUGH,
    _WIND, _STILL, _DRIVE, _LINE, _FORCE, _SIDE, _K0, _K1, _K2, _K3, _K5,
    _DRIFT, _END, _MIDDLE, _SHOWN, _STEEP, _THIRD, _LEVEL, _V, _S, _ANGLE, _ANGLE_P,
) = range(rows.ROWS, rows.ROWS + 25)  # fmt: skip
_ROWS = rows.ROWS + 25


@njit(cache=True, error_model="numpy", nogil=True, fastmath={"contract"})
def _extended_filter(  # type: ignore[no-untyped-def]
    y,
    se,
    phase,
    third,
    third_se,
    gap,
    period,
    time,
    place,
    rec,
    omega,
    ln_knots,
    table,
    active,
    usable,
    p0,
    v_out,
    s_out,
):
    size, walkers = y.size, table.shape[0]
    # A tuple, for every hand-over of an array counts its owners.
    knots = to_fixed_tuple(ln_knots, HATS)
    x = np.zeros((_ROWS, LANES))
    levels = np.empty(size)  # filtered amplitudes of the first row
    lanes = np.empty(walkers + LANES, dtype=np.intp)
    low = 0
    while low < size:
        high = low + 1
        while high < size and rec[high] == rec[low]:
            high += 1
        for kind in (2, 1):  # all of them anew; phase and waveform alone, the amplitudes being the first row's
            count = 0
            for w in range(walkers):
                if active[w, rec[low]] == kind:
                    lanes[count] = w
                    count += 1
            lanes[count : count + LANES] = lanes[max(count - 1, 0)]  # the last one fills its block
            for first in range(0, count, LANES):
                here = lanes[first : min(first + LANES, count)]
                gusty, lined, forced, bent, clipped = _coefficients(x, table, lanes[first : first + LANES], rec[low])
                dt, known = -1.0, False
                for k in range(low, high):
                    start = k == low or gap[k] < 0.0
                    tau, now = place[k], time[k]
                    bow = 0.5 * np.sin(np.pi * tau)
                    if lined or forced:
                        _oscillations(x, now, phase[k], lined, forced)
                    if kind == 2:
                        for w in range(LANES):
                            wind, still, drive = weather(x, w, tau, bow, now > x[_JT, w])
                            x[_WIND, w], x[_STILL, w], x[_DRIVE, w] = wind, still, drive
                        if start or gap[k] > 0.0:
                            dt = -1.0
                            if start:
                                _first(x, y[k], se[k], period[k], p0, knots)
                            else:
                                _unseen(x, gap[k], period[k], knots)
                        if not start:
                            if period[k] != dt:
                                dt = period[k]
                                if gusty:
                                    gust_decay(x, dt)
                            _flow(x, dt)
                            if bent:
                                for w in range(here.size):
                                    if x[_ROUGH, w] > 0.0:
                                        _rough_flow(x, w, dt, knots)
                            moments_of_all(x, dt, gusty)
                            _mean(x, dt)
                            if clipped:
                                _read(x, here.size)
                            _observe(x, y[k], se[k])
                        for i in range(here.size):
                            v_out[here[i], k], s_out[here[i], k] = x[_V, i], x[_S, i]
                    else:
                        for i in range(here.size):
                            v_out[here[i], k], s_out[here[i], k] = v_out[0, k], s_out[0, k]
                        x[_LEVEL] = levels[k]
                        if clipped:
                            _read(x, here.size)
                    if kind == 2 and first == 0 and here[0] == 0:
                        levels[k] = x[_LEVEL, 0]
                    at = size + k
                    known = known and not start
                    step = gap[k] + period[k] if known else 0.0
                    faint = y[k] < FAINT * se[k] or not usable[k]
                    if faint or not known:
                        _wander(x, y[k], se[k], omega[k], step)
                        if not faint:
                            _found(x, y[k], se[k], phase[k])
                            known = True
                        for i in range(here.size):
                            v_out[here[i], at], s_out[here[i], at] = 0.0, 1.0
                    else:
                        _wander(x, y[k], se[k], omega[k], step)
                        _turn(x, y[k], se[k], phase[k])
                        for i in range(here.size):
                            v_out[here[i], at], s_out[here[i], at] = x[_V, i], x[_S, i]
                    at += size
                    if third_se[k] >= ABSENT:
                        for i in range(here.size):
                            v_out[here[i], at], s_out[here[i], at] = 0.0, 1.0
                        continue
                    _wave(x, third[k], third_se[k])
                    for i in range(here.size):
                        v_out[here[i], at], s_out[here[i], at] = x[_V, i], x[_S, i]
        for w in range(1, walkers):
            if active[w, rec[low]] == 0:
                for at in (low, size + low, 2 * size + low):
                    v_out[w, at : at + high - low] = v_out[0, at : at + high - low]
                    s_out[w, at : at + high - low] = s_out[0, at : at + high - low]
        low = high


@njit(cache=True)
def _coefficients(x, table, lanes, record):  # type: ignore[no-untyped-def]
    """Put the rows of a block on end; whether any has gusts, a line, forcing, rough terms, a sensor that saturates."""
    gusty = lined = forced = bent = clipped = False
    for w in range(LANES):
        c = table[lanes[w], record]
        for i in range(COLUMNS):
            x[i, w] = c[i]
        x[_Q2, w], x[_G2, w], x[_ROUGH, w] = c[_Q] * c[_Q], c[_GUST] * c[_GUST], rough(c)
        x[FADE, w] = c[_GUST_RATE] if c[_GUST] != 0.0 else 1e-3  # of no gust: any
        gusty |= c[_GUST] != 0.0
        lined |= c[_LC] != 0.0 or c[_LS] != 0.0
        forced |= c[_FC] != 0.0 or c[_FS] != 0.0
        bent |= x[_ROUGH, w] > 0.0
        clipped |= c[_CLIP] > 0.0
    x[_LINE], x[_FORCE], x[_SIDE], x[_THIRD], x[KEEP] = 0.0, 0.0, 0.0, 0.0, 1.0
    return gusty, lined, forced, bent, clipped


@njit(cache=True)
def _oscillations(x, now, phase, lined, forced):  # type: ignore[no-untyped-def]
    """A second line in the reading, and shedding beside the response, in phase and out of it."""
    for w in range(LANES):
        if lined and (x[_LC, w] != 0.0 or x[_LS, w] != 0.0):
            turn = x[_LR, w] * now - phase
            x[_LINE, w] = (x[_LC, w] * np.cos(turn) + x[_LS, w] * np.sin(turn)) * np.exp(-x[_LD, w] * now)
        if forced and (x[_FC, w] != 0.0 or x[_FS, w] != 0.0):
            chi = x[_FR, w] * now - phase
            cosine, sine = np.cos(chi), np.sin(chi)
            x[_FORCE, w] = x[_FC, w] * cosine + x[_FS, w] * sine
            x[_SIDE, w] = x[_FC, w] * sine - x[_FS, w] * cosine


@njit(cache=True)
def _drift(x, w, a, lagged, knots):  # type: ignore[no-untyped-def]
    return drift_of(
        a, lagged, x, w, x[_WIND, w], x[_STILL, w], x[_DRIVE, w], x[_FORCE, w], x[_ROUGH, w] > 1.5, knots
    )


@njit(cache=True, error_model="numpy")
def _first(x, y, se, dt, p0, knots):  # type: ignore[no-untyped-def]
    """A diffuse state cannot be linearised: the first cycle fixes the state at its middle."""
    for w in range(LANES):
        gain, r2 = 1.0 + x[_GAIN, w], x[_R, w] * se * x[_R, w] * se
        start = inverse_reading(max((y - x[_LINE, w]) / gain, 1e-9), x[_CLIP, w], x[_SOFT, w])
        _, steep, x[_THIRD, w] = saturated_reading(start, x[_CLIP, w], x[_SOFT, w])
        steep *= gain
        x[_V, w], x[_S, w], x[_LEVEL, w] = y, p0 + r2, start
        x[LAGGED, w] = x[_LAG_START, w] * start
        f, d = _drift(x, w, start, x[LAGGED, w], knots)
        x[RATE, w], x[_DRIFT, w] = -d, f * (1.0 + 0.25 * d * dt)
        x[M, w], x[P, w] = start, r2 / (steep * steep)
        x[H, w] = x[O, w] = x[P_H, w] = x[P_O, w] = x[P_HO, w] = 0.0
        x[P_HH, w], x[P_OO, w] = x[_G2, w], x[_SET_POINT, w] * x[_SET_POINT, w]
    _step(x, 0.5 * dt)


@njit(cache=True, error_model="numpy")
def _unseen(x, gap, dt, knots):  # type: ignore[no-untyped-def]
    """Through a gap by the midpoint rule, in steps of about a cycle."""
    steps = max(1, int(np.ceil(gap / dt)))
    h = gap / steps
    for _ in range(steps):
        for w in range(LANES):
            m, lagged = x[M, w], x[LAGGED, w]
            f, _ = _drift(x, w, m, lagged, knots)
            x[_DRIFT, w], d = _drift(x, w, m + 0.5 * h * f, lagged, knots)
            x[RATE, w] = -d
            if x[_LAG, w] > 0.0:
                x[LAGGED, w] += (m - lagged) * (1.0 - np.exp(-h / x[_LAG, w]))
        _step(x, h)


@njit(cache=True, error_model="numpy")
def _step(x, h):  # type: ignore[no-untyped-def]
    """Move everything on by h without observation; the broad-band noise to first order."""
    for w in range(LANES):
        moments_of_lane(x, w, h)
        x[M, w] += h * x[_DRIFT, w] + x[PUSH, w] * x[H, w] + x[HOLD, w] * x[O, w]
        x[H, w] *= x[KEEP, w]
        _carry(x, w)
        x[P, w] += x[_Q2, w] * h


@njit(cache=True, inline="always")
def _carry(x, w):  # type: ignore[no-untyped-def]
    """Covariances of (amplitude, gust, offset) after an interval, with what gusts but not what the noise adds in it."""
    phi, keep, push, hold, g2 = x[PHI, w], x[KEEP, w], x[PUSH, w], x[HOLD, w], x[_G2, w]
    a = phi * x[P, w] + push * x[P_H, w] + hold * x[P_O, w]
    h = phi * x[P_H, w] + push * x[P_HH, w] + hold * x[P_HO, w]
    o = phi * x[P_O, w] + push * x[P_HO, w] + hold * x[P_OO, w]
    x[P, w] = phi * a + push * h + hold * o + g2 * x[DD, w]
    x[P_H, w] = keep * h + g2 * x[DH, w]
    x[P_O, w] = o
    x[P_HH, w] = keep * keep * x[P_HH, w] + g2 * x[HH, w]
    x[P_HO, w] *= keep


@njit(cache=True, inline="always")
def _flow(x, dt):  # type: ignore[no-untyped-def]
    """End and middle of the cycle by Runge-Kutta, and how fast deviations fade on the way, where nothing is rough."""
    sixth = dt / 6.0
    for w in range(LANES):
        k0, k1, k2, k3, k5 = polynomial(x, w, x[_WIND, w], x[_STILL, w], x[_DRIVE, w], x[_FORCE, w])
        m = x[M, w]
        f0 = k0 + m * (k1 + m * (k2 + m * (k3 + m * m * k5)))
        a = m + 0.5 * dt * f0
        f1 = k0 + a * (k1 + a * (k2 + a * (k3 + a * a * k5)))
        a = m + 0.5 * dt * f1
        f2 = k0 + a * (k1 + a * (k2 + a * (k3 + a * a * k5)))
        a = m + dt * f2
        f3 = k0 + a * (k1 + a * (k2 + a * (k3 + a * a * k5)))
        end = m + sixth * (f0 + 2.0 * (f1 + f2) + f3)
        fe = k0 + end * (k1 + end * (k2 + end * (k3 + end * end * k5)))
        middle = 0.5 * (m + end) + 0.125 * dt * (f0 - fe)
        k2, k3, k5 = 2.0 * k2, 3.0 * k3, 5.0 * k5
        d0 = k1 + m * (k2 + m * (k3 + m * m * k5))
        dm = k1 + middle * (k2 + middle * (k3 + middle * middle * k5))
        de = k1 + end * (k2 + end * (k3 + end * end * k5))
        x[_END, w], x[_MIDDLE, w] = end, middle
        x[HALF_LOSS, w], x[RATE, w] = -0.25 * dt * (d0 + dm), (d0 + 4.0 * dm + de) * (-1.0 / 6.0)


@njit(cache=True, error_model="numpy")
def _rough_flow(x, w, dt, knots):  # type: ignore[no-untyped-def]
    """`_flow` of one walker with any drift, and with the wake that remembers."""
    m, lagged = x[M, w], x[LAGGED, w]
    lag_mid = lag_end = lagged
    if x[_LAG, w] > 0.0:
        lag_mid = lagged + (m - lagged) * (1.0 - np.exp(-0.5 * dt / x[_LAG, w]))
    f0, d0 = _drift(x, w, m, lagged, knots)
    f1, _ = _drift(x, w, m + 0.5 * dt * f0, lag_mid, knots)
    f2, _ = _drift(x, w, m + 0.5 * dt * f1, lag_mid, knots)
    if x[_LAG, w] > 0.0:
        middle = m + 0.5 * dt * f2
        lag_end = lagged + (middle - lagged) * (1.0 - np.exp(-dt / x[_LAG, w]))
    f3, _ = _drift(x, w, m + dt * f2, lag_end, knots)
    end = m + dt / 6.0 * (f0 + 2.0 * f1 + 2.0 * f2 + f3)
    fe, de = _drift(x, w, end, lag_end, knots)
    middle = 0.5 * (m + end) + 0.125 * dt * (f0 - fe)
    _, dm = _drift(x, w, middle, lag_mid, knots)
    x[_END, w], x[_MIDDLE, w], x[LAGGED, w] = end, middle, lag_end
    x[HALF_LOSS, w], x[RATE, w] = -0.25 * dt * (d0 + dm), -(d0 + 4.0 * dm + de) / 6.0


@njit(cache=True, inline="always")
def _mean(x, dt):  # type: ignore[no-untyped-def]
    """The mean over the cycle by Simpson's rule, and what a sensor that does not saturate shows of it."""
    for w in range(LANES):
        x[_DRIFT, w] = noise_drift(x[M, w], x[P, w], x[_Q2, w], dt)
        mean = (x[M, w] + 4.0 * x[_MIDDLE, w] + x[_END, w]) * (1.0 / 6.0) + 0.5 * x[_DRIFT, w]
        mean += x[PUSH_MEAN, w] * x[H, w] + x[HOLD_MEAN, w] * x[O, w]
        x[_LEVEL, w], x[_SHOWN, w], x[_STEEP, w] = mean, mean, 1.0


@njit(cache=True)
def _read(x, lanes):  # type: ignore[no-untyped-def]
    """What saturated sensors show of the mean amplitudes: the fundamental, its slope, the third harmonic."""
    for w in range(lanes):
        level = x[_LEVEL, w]
        shown, steep, third = saturated_reading(level, x[_CLIP, w], x[_SOFT, w])
        x[_SHOWN, w], x[_STEEP, w], x[_THIRD, w] = shown, steep, third if level > 1e-12 else 0.0


@njit(cache=True, inline="always")
def _observe(x, y, se):  # type: ignore[no-untyped-def]
    """One cycle: the innovation, what is learned from it, the states at its end."""
    for w in range(LANES):
        r, q2, g2, gain = x[_R, w] * se, x[_Q2, w], x[_G2, w], 1.0 + x[_GAIN, w]
        h = gain * x[_STEEP, w]
        weight = (1.0 + 4.0 * x[HALF, w] + x[PHI, w]) * (1.0 / 6.0)
        push_mean, hold_mean = x[PUSH_MEAN, w], x[HOLD_MEAN, w]
        # covariances of the states at the start with the mean over the cycle
        at_a = weight * x[P, w] + push_mean * x[P_H, w] + hold_mean * x[P_O, w]
        at_h = weight * x[P_H, w] + push_mean * x[P_HH, w] + hold_mean * x[P_HO, w]
        at_o = weight * x[P_O, w] + push_mean * x[P_HO, w] + hold_mean * x[P_OO, w]
        s = weight * at_a + push_mean * at_h + hold_mean * at_o + q2 * x[Q_MEAN, w] + g2 * x[MM, w]
        s = h * h * s + r * r
        cross = x[PHI, w] * at_a + x[PUSH, w] * at_h + x[HOLD, w] * at_o + q2 * x[Q_CROSS, w] + g2 * x[DM, w]
        cross, cross_h, cross_o = h * cross, h * (x[KEEP, w] * at_h + g2 * x[HM, w]), h * at_o
        v = y - gain * x[_SHOWN, w] - x[_LINE, w]
        part = 1.0 / s
        of_a, of_h, of_o = cross * part, cross_h * part, cross_o * part
        m = x[_END, w] + x[_DRIFT, w] + x[PUSH, w] * x[H, w] + x[HOLD, w] * x[O, w] + of_a * v
        x[M, w] = 1e-9 if m < 0.0 else m
        x[H, w] = x[KEEP, w] * x[H, w] + of_h * v
        x[O, w] += of_o * v
        _carry(x, w)
        x[P, w] += q2 * x[Q_END, w] - of_a * cross
        x[P_H, w] -= of_a * cross_h
        x[P_O, w] -= of_a * cross_o
        x[P_HH, w] -= of_h * cross_h
        x[P_HO, w] -= of_h * cross_o
        x[P_OO, w] -= of_o * cross_o
        x[_V, w], x[_S, w] = v, s


@njit(cache=True, inline="always")
def _wander(x, y, se, omega, step):  # type: ignore[no-untyped-def]
    """Move the phase on: its pace follows stiffness and forcing."""
    for w in range(LANES):
        a = max((y - x[_LINE, w]) / (1.0 + x[_GAIN, w]), 1e-12)
        pace = omega * ((1.0 + x[_DET, w]) * (1.0 + a * (x[_ST1, w] + a * x[_ST2, w])) - 1.0) + x[_SIDE, w] / a
        x[_ANGLE, w] += pace * step
        x[_ANGLE_P, w] += x[_PQ, w] * x[_PQ, w] / (a * a) * step


@njit(cache=True, inline="always")
def _found(x, y, se, phase):  # type: ignore[no-untyped-def]
    """The first phase that is seen is where it starts."""
    for w in range(LANES):
        r2 = x[_R, w] * se * x[_R, w] * se
        x[_ANGLE, w], x[_ANGLE_P, w] = phase, r2 / (y * y + r2)


@njit(cache=True, inline="always")
def _turn(x, y, se, phase):  # type: ignore[no-untyped-def]
    """Innovation of the phase, and what is learned from it."""
    for w in range(LANES):
        r2 = x[_R, w] * se * x[_R, w] * se
        v, s = phase - x[_ANGLE, w], x[_ANGLE_P, w] + r2 / (y * y + r2)
        part = x[_ANGLE_P, w] / s
        x[_ANGLE, w] += part * v
        x[_ANGLE_P, w] -= part * x[_ANGLE_P, w]
        x[_V, w], x[_S, w] = v, s


@njit(cache=True, inline="always")
def _wave(x, third, se):  # type: ignore[no-untyped-def]
    """Innovation of the third harmonic, which nothing is learned from."""
    for w in range(LANES):
        level, blur = x[_LEVEL, w], x[_H3R, w] * se
        bend = level * (x[_ST1, w] + level * x[_ST2, w])
        x[_V, w] = third - (1.0 + x[_GAIN, w]) * level * (x[_THIRD, w] + x[_H3, w] + bend / 12.0)
        x[_S, w] = blur * blur


def channel_innovations(data: Channels, table: FloatArray, *, initial_sd: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Innovations of amplitude, phase and third harmonic, and their variances, (W, 3 N) each in that order.

    `table` (W, R, COLUMNS) holds the coefficients of every record; `initial_sd` is that of the normal prior, mean 0, of
    each record's first amplitude.  Where the amplitude is too faint to tell the phase, they are 0 and 1.
    """
    shape = (len(table), 3 * data.size)
    # Rows are mostly neighbours of the first one: what they leave alone is copied from it.
    changed = table != table[:1]
    active = np.where(changed[:, :, _DAMPING].any(axis=2), 2, np.where(changed.any(axis=2), 1, 0)).astype(np.int8)
    active[0] = 2
    innovation, variance = np.empty(shape), np.empty(shape)
    _extended_filter(
        data.amplitude, data.standard_error, data.phase, data.third, data.third_error, data.gap, data.period,
        data.time, data.place, data.record, data.omega, data.knots, np.ascontiguousarray(table), active, data.has_phase,
        initial_sd**2, innovation, variance,
    )  # fmt: skip
    return innovation, variance
