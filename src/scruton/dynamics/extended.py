r"""The filter of the amplitude equation with any effect in it: amplitude, phase and waveform of every cycle.

Each record has a row of coefficients (`scruton.dynamics.effects.terms.Term`).  The amplitude is a state that the
equation moves and turbulence pushes about; the filter is linearised along its mean, by Runge-Kutta through every cycle.
Slow gusts of the drive, and what it is off by in one record, are states beside it (see `drive_moments`).
The phase is a state that wanders about its own frequency, and the in-phase third harmonic is read cycle by cycle: what
stiffness, forcing and a saturated sensor show themselves in.

Walkers stand side by side, a row of one array for each thing that they carry, as in `block_filter`.  What is rare
(friction, memory, the first cycle, gaps, a sensor that saturates) goes through them one by one.
"""

from typing import NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.dynamics import row
from scruton.dynamics.cycles import ABSENT, Channels
from scruton.dynamics.drive_moments import gust_decay, moments_of_all, moments_of_lane
from scruton.dynamics.effect_drift import polynomial, rough, settling, weather
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.moments import noise_drift
from scruton.dynamics.phase_and_wave import creep, found, stick, turn, wander, wave
from scruton.dynamics.reading import inverse_reading, saturated_reading
from scruton.dynamics.rough_flow import drift_here, kinds, rough_flow
from scruton.dynamics.thresholds import FAINT
from scruton.dynamics.whitening import CORRELATIONS, whiten

_LAG, _LAG_START = int(Term.LAG), int(Term.LAG_START)
_FC, _FS, _FR = int(Term.FORCE_COS), int(Term.FORCE_SIN), int(Term.FORCE_RATE)
_TWICE = int(Term.FORCE_TWICE)
_GAIN, _CLIP, _SOFT = int(Term.GAIN), int(Term.CLIP), int(Term.CLIP_SOFT)
_Q, _R = int(Term.SCATTER), int(Term.NOISE)
_STICK, _LOSS = int(Term.FRICTION_SPRING), int(Term.FREQUENCY_LOSS)
_DET, _PQ = int(Term.DETUNING), int(Term.PHASE_SCATTER)
_BENDS = [int(term) for term in (Term.STIFFNESS_LINEAR, Term.STIFFNESS, Term.STIFFNESS_FOURTH)]
_WARMS, _SETTLES, _CREEP = int(Term.WARMING), int(Term.TREND_PACE), int(Term.FREQUENCY_TREND)
_H3, _H3R, _JT = int(Term.THIRD), int(Term.THIRD_NOISE), int(Term.JUMP_TIME)
_LC, _LS, _LR, _LD = int(Term.LINE_COS), int(Term.LINE_SIN), int(Term.LINE_RATE), int(Term.LINE_DECAY)
_GUST, _GUST_RATE, _SET_POINT = int(Term.GUST), int(Term.GUST_RATE), int(Term.SET_POINT)
# Columns that move the phase and the third harmonic alone, and those that the amplitude depends on.
_BESIDE = [_DET, *_BENDS, _CREEP, _LOSS, _PQ, _H3, _H3R]
_DAMPING = np.setdiff1d(np.arange(COLUMNS), [*_BESIDE, *CORRELATIONS])


class _Cycles(NamedTuple):
    """The arrays of `Channels`, (N,) each, as compiled code takes them."""

    amplitude: FloatArray
    standard_error: FloatArray
    gap: FloatArray
    period: FloatArray
    time: FloatArray
    place: FloatArray
    record: np.ndarray
    phase: FloatArray
    omega: FloatArray
    has_phase: np.ndarray
    third: FloatArray
    third_error: FloatArray


@njit(cache=True, nogil=True)
def _extended_filter(data, log_knots, table, active, p0, v_out, s_out):  # type: ignore[no-untyped-def]
    """Record by record, block by block: rows that are `active` 2 anew, 1 but for the amplitude; 0 are copied."""
    size = data.amplitude.size
    knots = to_fixed_tuple(log_knots, HATS)  # for every hand-over of an array counts its owners
    levels = np.empty(size)  # filtered amplitudes of the first row
    low = np.int64(0)  # a literal is to numba another type, for which it compiles `_block` once more
    while low < size:
        record = data.record[low]
        high = low + 1
        while high < size and data.record[high] == record:
            high += 1
        for kind in (2, 1):
            rows = np.flatnonzero(active[:, record] == kind)
            for first in range(0, rows.size, row.LANES):
                here = rows[first : first + row.LANES]
                _block(data, table, here, low, high, kind == 2, p0, knots, levels, v_out, s_out)
        for w in np.flatnonzero(active[:, record] == 0):
            for at in (low, size + low, 2 * size + low):
                v_out[w, at : at + high - low] = v_out[0, at : at + high - low]
                s_out[w, at : at + high - low] = s_out[0, at : at + high - low]
        low = high


@njit(cache=True, error_model="numpy", nogil=True, fastmath={"contract"})
def _block(data, table, here, low, high, moved, p0, knots, levels, v_out, s_out):  # type: ignore[no-untyped-def]
    """One record, rows `here` of the table; unless they are `moved`, with the amplitudes of the first row."""
    x = np.zeros((row.ROWS, row.LANES))
    gusty, lined, forced, settles, creeping, bent, clipped, sticky = _coefficients(x, table, here, data.record[low])
    acting = kinds(x)
    size, dt, known = data.amplitude.size, -1.0, False
    for k in range(low, high):
        y, se, gap, period, now = data.amplitude[k], data.standard_error[k], data.gap[k], data.period[k], data.time[k]
        start = k == low or gap < 0.0
        if moved:
            _weather(x, data.place[k], now, period, settles)
        if lined or forced:
            _oscillations(x, now, data.phase[k], y, lined, forced)
        if moved:
            if start:
                _first(x, y, se, period, p0, knots)
                dt = -1.0
            else:
                if gap > 0.0:
                    _unseen(x, gap, period, knots)
                if gusty and (gap > 0.0 or period != dt):
                    gust_decay(x, period)
                dt = period
                if bent:
                    rough_flow(x, here.size, dt, knots, acting)
                else:
                    _flow(x, dt)
                moments_of_all(x, dt, gusty)
                _mean(x, dt)
                if clipped:
                    _read(x, here.size)
                _observe(x, y, se)
            if here[0] == 0:
                levels[k] = x[row.LEVEL, 0]
        else:
            x[row.LEVEL], x[row.V], x[row.S] = levels[k], v_out[0, k], s_out[0, k]
            if clipped:
                _read(x, here.size)
        _put(x, here, k, v_out, s_out)
        faint = y < FAINT * se or not data.has_phase[k]
        known = known and not start
        wander(x, y, data.omega[k], gap + period if known else 0.0)
        if creeping and known:
            before = data.amplitude[k - 1]
            grown = 0.0 if faint or before <= 0.0 else 2.0 * (y - before) / (y + before)
            creep(x, data.omega[k] * (gap + period), data.place[k], grown)
        if sticky and known:
            stick(x, y, data.omega[k] * (gap + period))
        if known and not faint:
            turn(x, y, se, data.phase[k])
        else:
            x[row.V], x[row.S] = 0.0, 1.0
            if not faint:
                found(x, y, se, data.phase[k])
                known = True
        _put(x, here, size + k, v_out, s_out)
        if data.third_error[k] < ABSENT:
            wave(x, data.third[k], data.third_error[k])
        else:
            x[row.V], x[row.S] = 0.0, 1.0
        _put(x, here, 2 * size + k, v_out, s_out)


@njit(cache=True, inline="always")
def _put(x, here, at, v_out, s_out):  # type: ignore[no-untyped-def]
    for i in range(here.size):
        v_out[here[i], at], s_out[here[i], at] = x[row.V, i], x[row.S, i]


@njit(cache=True)
def _coefficients(x, table, here, record):  # type: ignore[no-untyped-def]
    """Put rows on end, the last filling the block; and whether any of them has what is rare.

    That is gusts, a line, a force, what settles, a frequency that creeps, rough terms, saturation, sticking friction.
    """
    gusty = lined = forced = settles = creeping = bent = clipped = sticky = False
    for w in range(row.LANES):
        c = table[here[min(w, here.size - 1)], record]
        for i in range(COLUMNS):
            x[i, w] = c[i]
        x[row.Q2, w], x[row.G2, w], x[row.ROUGH, w] = c[_Q] * c[_Q], c[_GUST] * c[_GUST], rough(c)
        x[row.FADE, w] = c[_GUST_RATE] if c[_GUST] != 0.0 else 1e-3  # of no gust: any
        gusty |= c[_GUST] != 0.0
        lined |= c[_LC] != 0.0 or c[_LS] != 0.0
        forced |= c[_FC] != 0.0 or c[_FS] != 0.0
        settles |= c[_WARMS] != 0.0 or c[_SETTLES] > 0.0
        creeping |= c[_CREEP] != 0.0 or c[_LOSS] != 0.0
        bent |= x[row.ROUGH, w] > 0.0
        clipped |= c[_CLIP] > 0.0
        sticky |= c[_STICK] != 0.0
    x[row.KEEP] = 1.0
    return gusty, lined, forced, settles, creeping, bent, clipped, sticky


@njit(cache=True, inline="always")
def _weather(x, place, now, period, settles):  # type: ignore[no-untyped-def]
    """In a cycle about `now`; a jump has its moment within one, so that the likelihood has a slope in it."""
    bow, arch = 0.5 * np.sin(np.pi * place), np.cos(np.pi * place)
    for w in range(row.LANES):
        late = min(max((now - x[_JT, w]) / period + 0.5, 0.0), 1.0)
        wind, still, drive = weather(x, w, place, bow, arch, late)
        x[row.WIND, w], x[row.STILL, w], x[row.DRIVE, w] = wind, still, drive
    if settles:
        for w in range(row.LANES):
            gained, warmth, driven = settling(x, w, place)
            x[row.WIND, w], x[row.STILL, w] = x[row.WIND, w] + gained, x[row.STILL, w] + warmth
            x[row.DRIVE, w] *= driven


@njit(cache=True)
def _oscillations(x, now, phase, y, lined, forced):  # type: ignore[no-untyped-def]
    """A second line in the reading, and shedding beside the response, in phase and out of it."""
    for w in range(row.LANES):
        if lined and (x[_LC, w] != 0.0 or x[_LS, w] != 0.0):
            turn = x[_LR, w] * now - phase
            x[row.LINE, w] = (x[_LC, w] * np.cos(turn) + x[_LS, w] * np.sin(turn)) * np.exp(-x[_LD, w] * now)
        if forced and (x[_FC, w] != 0.0 or x[_FS, w] != 0.0):
            chi = x[_FR, w] * now - (1.0 + x[_TWICE, w]) * phase
            cosine, sine = np.cos(chi), np.sin(chi)
            along, across = x[_FC, w] * cosine + x[_FS, w] * sine, x[_FC, w] * sine - x[_FS, w] * cosine
            if x[_TWICE, w] == 0.0:
                x[row.FORCE, w], x[row.SIDE, w] = along, across
            else:  # of a stiffness that pulses both go with the amplitude
                x[row.STILL, w] -= along
                x[row.SIDE, w] = across * max(y, 0.0)


@njit(cache=True, error_model="numpy")
def _first(x, y, se, dt, p0, knots):  # type: ignore[no-untyped-def]
    """A diffuse state cannot be linearised: the first cycle fixes the state at its middle."""
    for w in range(row.LANES):
        gain, r2 = 1.0 + x[_GAIN, w], x[_R, w] * se * x[_R, w] * se
        start = inverse_reading(max((y - x[row.LINE, w]) / gain, 1e-9), x[_CLIP, w], x[_SOFT, w])
        _, steep, x[row.THIRD, w] = saturated_reading(start, x[_CLIP, w], x[_SOFT, w])
        steep *= gain
        x[row.V, w], x[row.S, w], x[row.LEVEL, w] = y, p0 + r2, start
        x[row.LAGGED, w] = x[_LAG_START, w] * start
        f, d = drift_here(x, w, start, x[row.LAGGED, w], knots)
        x[row.RATE, w], x[row.DRIFT, w] = -d, f * (1.0 + 0.25 * d * dt)
        x[row.M, w], x[row.P, w] = start, r2 / (steep * steep)
        x[row.H, w] = x[row.OFF, w] = x[row.P_H, w] = x[row.P_O, w] = x[row.P_HO, w] = 0.0
        x[row.P_HH, w], x[row.P_OO, w] = x[row.G2, w], x[_SET_POINT, w] * x[_SET_POINT, w]
    _step(x, 0.5 * dt)


@njit(cache=True, error_model="numpy")
def _unseen(x, gap, dt, knots):  # type: ignore[no-untyped-def]
    """Through a gap by the midpoint rule, in steps of about a cycle."""
    steps = max(1, int(np.ceil(gap / dt)))
    h = gap / steps
    for _ in range(steps):
        for w in range(row.LANES):
            m, lagged = x[row.M, w], x[row.LAGGED, w]
            f, _ = drift_here(x, w, m, lagged, knots)
            x[row.DRIFT, w], d = drift_here(x, w, m + 0.5 * h * f, lagged, knots)
            x[row.RATE, w] = -d
            if x[_LAG, w] > 0.0:
                x[row.LAGGED, w] += (m - lagged) * (1.0 - np.exp(-h / x[_LAG, w]))
        _step(x, h)


@njit(cache=True, error_model="numpy")
def _step(x, h):  # type: ignore[no-untyped-def]
    """Move everything on by h without observation; the broad-band noise to first order."""
    for w in range(row.LANES):
        moments_of_lane(x, w, h)
        x[row.M, w] += h * x[row.DRIFT, w] + x[row.PUSH, w] * x[row.H, w] + x[row.HOLD, w] * x[row.OFF, w]
        x[row.H, w] *= x[row.KEEP, w]
        _carry(x, w)
        x[row.P, w] += x[row.Q2, w] * h


@njit(cache=True, inline="always")
def _carry(x, w):  # type: ignore[no-untyped-def]
    """Covariances of (amplitude, gust, offset) after an interval, with what gusts but not what the noise adds in it."""
    phi, keep, push, hold, g2 = x[row.PHI, w], x[row.KEEP, w], x[row.PUSH, w], x[row.HOLD, w], x[row.G2, w]
    a = phi * x[row.P, w] + push * x[row.P_H, w] + hold * x[row.P_O, w]
    h = phi * x[row.P_H, w] + push * x[row.P_HH, w] + hold * x[row.P_HO, w]
    o = phi * x[row.P_O, w] + push * x[row.P_HO, w] + hold * x[row.P_OO, w]
    x[row.P, w] = phi * a + push * h + hold * o + g2 * x[row.DD, w]
    x[row.P_H, w] = keep * h + g2 * x[row.DH, w]
    x[row.P_O, w] = o
    x[row.P_HH, w] = keep * keep * x[row.P_HH, w] + g2 * x[row.HH, w]
    x[row.P_HO, w] *= keep


@njit(cache=True, inline="always")
def _flow(x, dt):  # type: ignore[no-untyped-def]
    """End and middle of the cycle by Runge-Kutta, and how fast deviations fade on the way, where nothing is rough."""
    sixth = dt / 6.0
    for w in range(row.LANES):
        k0, k1, k2, k3, k5 = polynomial(x, w, x[row.WIND, w], x[row.STILL, w], x[row.DRIVE, w], x[row.FORCE, w])
        m = x[row.M, w]
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
        x[row.END, w], x[row.MIDDLE, w] = end, middle
        x[row.HALF_LOSS, w], x[row.RATE, w] = -0.25 * dt * (d0 + dm), (d0 + 4.0 * dm + de) * (-1.0 / 6.0)


@njit(cache=True, inline="always")
def _mean(x, dt):  # type: ignore[no-untyped-def]
    """The mean over the cycle by Simpson's rule, and what a sensor that does not saturate shows of it."""
    for w in range(row.LANES):
        x[row.DRIFT, w] = noise_drift(x[row.M, w], x[row.P, w], x[row.Q2, w], dt)
        mean = (x[row.M, w] + 4.0 * x[row.MIDDLE, w] + x[row.END, w]) * (1.0 / 6.0) + 0.5 * x[row.DRIFT, w]
        mean += x[row.PUSH_MEAN, w] * x[row.H, w] + x[row.HOLD_MEAN, w] * x[row.OFF, w]
        x[row.LEVEL, w], x[row.SHOWN, w], x[row.STEEP, w] = mean, mean, 1.0


@njit(cache=True)
def _read(x, lanes):  # type: ignore[no-untyped-def]
    """What saturated sensors show of the mean amplitudes: the fundamental, its slope, the third harmonic."""
    for w in range(lanes):
        level = x[row.LEVEL, w]
        shown, steep, third = saturated_reading(level, x[_CLIP, w], x[_SOFT, w])
        x[row.SHOWN, w], x[row.STEEP, w], x[row.THIRD, w] = shown, steep, third if level > 1e-12 else 0.0


@njit(cache=True, inline="always")
def _observe(x, y, se):  # type: ignore[no-untyped-def]
    """One cycle: the innovation, what is learned from it, the states at its end."""
    for w in range(row.LANES):
        r, q2, g2, gain = x[_R, w] * se, x[row.Q2, w], x[row.G2, w], 1.0 + x[_GAIN, w]
        h = gain * x[row.STEEP, w]
        weight = (1.0 + 4.0 * x[row.HALF, w] + x[row.PHI, w]) * (1.0 / 6.0)
        push_mean, hold_mean = x[row.PUSH_MEAN, w], x[row.HOLD_MEAN, w]
        # covariances of the states at the start with the mean over the cycle
        at_a = weight * x[row.P, w] + push_mean * x[row.P_H, w] + hold_mean * x[row.P_O, w]
        at_h = weight * x[row.P_H, w] + push_mean * x[row.P_HH, w] + hold_mean * x[row.P_HO, w]
        at_o = weight * x[row.P_O, w] + push_mean * x[row.P_HO, w] + hold_mean * x[row.P_OO, w]
        s = weight * at_a + push_mean * at_h + hold_mean * at_o + q2 * x[row.Q_MEAN, w] + g2 * x[row.MM, w]
        s = h * h * s + r * r
        cross = x[row.PHI, w] * at_a + x[row.PUSH, w] * at_h + x[row.HOLD, w] * at_o
        cross = h * (cross + q2 * x[row.Q_CROSS, w] + g2 * x[row.DM, w])
        cross_h, cross_o = h * (x[row.KEEP, w] * at_h + g2 * x[row.HM, w]), h * at_o
        v = y - gain * x[row.SHOWN, w] - x[row.LINE, w]
        part = 1.0 / s
        of_a, of_h, of_o = cross * part, cross_h * part, cross_o * part
        m = x[row.END, w] + x[row.DRIFT, w] + x[row.PUSH, w] * x[row.H, w] + x[row.HOLD, w] * x[row.OFF, w] + of_a * v
        x[row.M, w] = 1e-9 if m < 0.0 else m
        x[row.H, w] = x[row.KEEP, w] * x[row.H, w] + of_h * v
        x[row.OFF, w] += of_o * v
        _carry(x, w)
        x[row.P, w] += q2 * x[row.Q_END, w] - of_a * cross
        x[row.P_H, w] -= of_a * cross_h
        x[row.P_O, w] -= of_a * cross_o
        x[row.P_HH, w] -= of_h * cross_h
        x[row.P_HO, w] -= of_h * cross_o
        x[row.P_OO, w] -= of_o * cross_o
        x[row.V, w], x[row.S, w] = v, s


def channel_innovations(data: Channels, table: FloatArray, *, initial_sd: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Innovations of amplitude, phase and third harmonic, and their variances, (W, 3 N) each in that order.

    `table` (W, R, COLUMNS) holds the coefficients of every record; `initial_sd` is that of the normal prior, mean 0, of
    each record's first amplitude.  Where the amplitude is too faint to tell the phase, they are 0 and 1.
    """
    shape = (len(table), 3 * data.size)
    # Rows are mostly neighbours of the first one: what they leave alone is copied from it.
    changed = table != table[:1]
    active = np.where(changed[:, :, _DAMPING].any(axis=2), 2, changed[:, :, _BESIDE].any(axis=2)).astype(np.int8)
    active[0] = 2
    innovation, variance = np.empty(shape), np.empty(shape)
    cycles, rows = _Cycles(*(getattr(data, name) for name in _Cycles._fields)), np.ascontiguousarray(table)
    _extended_filter(cycles, data.knots, rows, active, initial_sd**2, innovation, variance)
    if rows[:, :, CORRELATIONS].any():
        whiten(data.gap, data.record, rows, innovation, variance)
    return innovation, variance
