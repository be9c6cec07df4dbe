r"""The filter of the amplitude equation with any effect in it: amplitude, phase and waveform of every cycle.

Each record has a row of coefficients (`scruton.dynamics.effects.terms.Term`).  The amplitude is a state that the
equation moves and turbulence pushes about; the filter is linearised along its mean, by Runge-Kutta through every cycle.
Slow gusts of the drive, and what it is off by in one record, are states beside it (see `scruton.dynamics.moments`).
The phase is a state that wanders about its own frequency, and the in-phase third harmonic is read cycle by cycle: what
stiffness, forcing and a saturated sensor show themselves in.
"""

import numpy as np
from numba import njit
from numba.np.unsafe.ndarray import to_fixed_tuple

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import ABSENT, Channels
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.moments import gust_moments, mean_weight, moments_along, noise_drift
from scruton.dynamics.reading import inverse_reading, saturated_reading
from scruton.dynamics.thresholds import FAINT

_S1, _S2, _S3 = int(Term.STRUCTURAL), int(Term.STRUCTURAL_LINEAR), int(Term.STRUCTURAL_SQUARE)
_F, _FW = int(Term.FRICTION), int(Term.FRICTION_WIDTH)
_L1, _C, _L2, _L3, _L5 = (
    int(Term.AERO), int(Term.DRIVE), int(Term.AERO_LINEAR), int(Term.AERO_SQUARE), int(Term.AERO_FOURTH)
)  # fmt: skip
_COH, _TREND, _SINE = int(Term.COHERENCE), int(Term.TREND), int(Term.TREND_SINE)
_TREND_DRIVE = int(Term.TREND_DRIVE)
_LAG, _LAG_KIND, _LAG_START = int(Term.LAG), int(Term.LAG_KIND), int(Term.LAG_START)
_FC, _FS, _FR = int(Term.FORCE_COS), int(Term.FORCE_SIN), int(Term.FORCE_RATE)
_GAIN, _CLIP, _SOFT = int(Term.GAIN), int(Term.CLIP), int(Term.CLIP_SOFT)
_Q, _R = int(Term.SCATTER), int(Term.NOISE)
_DET, _ST2, _ST1, _PQ = int(Term.DETUNING), int(Term.STIFFNESS), int(Term.STIFFNESS_LINEAR), int(Term.PHASE_SCATTER)
_H3, _H3R = int(Term.THIRD), int(Term.THIRD_NOISE)
_JUMP, _JUMP_RATE, _JT = int(Term.JUMP), int(Term.JUMP_RATE), int(Term.JUMP_TIME)
_LC, _LS, _LR, _LD = int(Term.LINE_COS), int(Term.LINE_SIN), int(Term.LINE_RATE), int(Term.LINE_DECAY)
_GUST, _GUST_RATE, _SET_POINT = int(Term.GUST), int(Term.GUST_RATE), int(Term.SET_POINT)
_HAT = int(Term.HAT)
# Columns that the amplitude depends on; the others move the phase and the third harmonic alone.
_DAMPING = np.setdiff1d(np.arange(COLUMNS), [_DET, _ST2, _ST1, _PQ, _H3, _H3R])


@njit(cache=True, inline="always")
def _hat(c, log_a, knots):  # type: ignore[no-untyped-def]
    """Excess damping rate at an amplitude, and its slope in ln(amplitude)."""
    if log_a <= knots[0]:
        return c[_HAT], 0.0
    last = len(knots) - 1
    if log_a >= knots[last]:
        return c[_HAT + last], 0.0
    step = knots[1] - knots[0]
    i = min(int((log_a - knots[0]) / step), last - 1)
    part = (log_a - knots[i]) / step
    low, high = c[_HAT + i], c[_HAT + i + 1]
    return low + part * (high - low), (high - low) / step


@njit(cache=True, inline="always")
def _weather(c, tau, late):  # type: ignore[no-untyped-def]
    """Wind, still-air damping and drive at a place in a record: what no amplitude changes."""
    wind = 1.0 + c[_TREND] * tau
    if c[_SINE] != 0.0:
        wind += 0.5 * c[_SINE] * np.sin(np.pi * tau)
    still = c[_S1]
    drive = c[_C] * (1.0 + c[_TREND_DRIVE] * tau)
    if late:
        still += c[_JUMP_RATE]
        drive *= 1.0 + c[_JUMP]
    return wind, still, drive


@njit(cache=True, inline="always")
def _drift(a, lagged, c, wind, still, drive, force, hats, knots):  # type: ignore[no-untyped-def]
    """`effect_drift` in a given wind."""
    f = -(still + a * (c[_S2] + a * c[_S3])) * a
    d = -still - a * (2.0 * c[_S2] + 3.0 * a * c[_S3])
    if c[_F] != 0.0:
        w2 = c[_FW] * c[_FW]
        root = np.sqrt(a * a + w2)
        f -= c[_F] * a / root
        d -= c[_F] * w2 / (root * root * root)
    b = a if c[_LAG] <= 0.0 else lagged
    slow = c[_L1] + b * (c[_L2] + b * (c[_L3] + b * b * c[_L5]))
    slope_drive = 0.0
    if c[_COH] > 0.0:
        lost = np.exp(-max(b, 0.0) / c[_COH])
        slope_drive = drive * lost / c[_COH]
        drive *= 1.0 - lost
    if c[_LAG] <= 0.0:
        f += wind * (wind * drive - slow * a)
        d += wind * (wind * slope_drive - c[_L1] - a * (2.0 * c[_L2] + a * (3.0 * c[_L3] + 5.0 * a * a * c[_L5])))
    elif c[_LAG_KIND] > 0.5:
        b = max(b, 1e-3 * abs(a) + 1e-12)
        damping = wind * (wind * drive / b - slow)
        f += damping * a
        d += damping
    else:
        f += wind * (wind * drive - slow * b)
    if hats:
        excess, slope = _hat(c, np.log(max(a, 1e-300)), knots)
        f -= excess * a
        d -= excess + slope
    return f + force, d


@njit(cache=True)
def effect_drift(a, lagged, c, tau, late, force, hats, knots):  # type: ignore[no-untyped-def]
    """da/dt and its derivative in a."""
    wind, still, drive = _weather(c, tau, late)
    return _drift(a, lagged, c, wind, still, drive, force, hats, knots)


@njit(cache=True)
def drive_moments(rate, fade, dt):  # type: ignore[no-untyped-def]
    """What the drive's gusts and offset do over one interval to an amplitude that forgets at a rate of either sign.

    The gust's decay, its response (state, mean), that to the offset (state, mean), and the covariances that a gust of
    unit standard deviation builds up: (state, state), (state, gust), (gust, gust), (state, mean), (gust, mean),
    (mean, mean).  Without a `fade` there is no gust.
    """
    if abs(rate * dt) < 1e-8:
        rate = 1e-8 / dt
    part = mean_weight(rate, dt)
    hold, hold_mean = part * dt, (1.0 - part) / rate
    if fade <= 0.0:
        return 1.0, 0.0, 0.0, hold, hold_mean, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # those of a gust towards which the amplitude relaxes, which is a drive over the rate
    keep, push, push_mean, dd, dh, hh, dm, hm, mm = gust_moments(rate, fade, dt)
    each = 1.0 / rate
    return (
        keep, push * each, push_mean * each, hold, hold_mean,
        each * each * dd, each * dh, hh, each * each * dm, each * hm, each * each * mm,
    )  # fmt: skip


@njit(cache=True, inline="always")
def _carried(p, p_h, p_o, hh, ho, oo, phi, keep, push, hold):  # type: ignore[no-untyped-def]
    """Covariances of (amplitude, gust, offset) after an interval, without what the noise adds in it."""
    a, h, o = phi * p + push * p_h + hold * p_o, phi * p_h + push * hh + hold * ho, phi * p_o + push * ho + hold * oo
    return phi * a + push * h + hold * o, keep * h, o, keep * keep * hh, keep * ho


@njit(cache=True, error_model="numpy", nogil=True)
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
    size = y.size
    levels = np.empty(size)  # filtered amplitudes of the first row
    # Tuples, for every hand-over of an array counts its owners, which took two fifths of the time.
    knots = to_fixed_tuple(ln_knots, HATS)
    for w in range(table.shape[0]):
        m = p = lagged = angle = angle_p = 0.0
        gust = offset = p_h = p_o = hh = ho = oo = 0.0  # means and covariances of the drive's states
        last_rate = last_dt = last_fade = -1.0
        moments = drive_moments(1.0, 1.0, 1.0)
        known = False
        row = -1
        c, gain, q2, g2, fade, hats = to_fixed_tuple(table[w, 0], COLUMNS), 1.0, 0.0, 0.0, 0.0, False
        for k in range(size):
            if active[w, rec[k]] == 0:
                for channel in range(3):
                    v_out[w, channel * size + k] = v_out[0, channel * size + k]
                    s_out[w, channel * size + k] = s_out[0, channel * size + k]
                continue
            if rec[k] != row:
                row = rec[k]
                values = table[w, row]
                c = to_fixed_tuple(values, COLUMNS)
                gain, q2, g2 = 1.0 + c[_GAIN], c[_Q] * c[_Q], c[_GUST] * c[_GUST]
                fade = c[_GUST_RATE] if g2 > 0.0 else 0.0
                hats = bool(np.any(values[_HAT : _HAT + HATS] != 0.0))
            dt = period[k]
            blur = c[_R] * se[k]
            r2 = blur * blur
            late = time[k] > c[_JT]
            wind, still, drive = _weather(c, place[k], late)
            line = 0.0
            if c[_LC] != 0.0 or c[_LS] != 0.0:
                turn = c[_LR] * time[k] - phase[k]
                line = (c[_LC] * np.cos(turn) + c[_LS] * np.sin(turn)) * np.exp(-c[_LD] * time[k])
            force = side = 0.0
            if c[_FC] != 0.0 or c[_FS] != 0.0:
                chi = c[_FR] * time[k] - phase[k]
                force = c[_FC] * np.cos(chi) + c[_FS] * np.sin(chi)
                side = c[_FC] * np.sin(chi) - c[_FS] * np.cos(chi)
            # amplitude
            if active[w, rec[k]] == 1:
                v_out[w, k] = v_out[0, k]
                s_out[w, k] = s_out[0, k]
                level = levels[k]
            elif gap[k] < 0.0:
                start = inverse_reading(max((y[k] - line) / gain, 1e-9), c[_CLIP], c[_SOFT])
                _, slope, _ = saturated_reading(start, c[_CLIP], c[_SOFT])
                s = p0 + r2
                v_out[w, k] = y[k]
                s_out[w, k] = s
                m = start
                steep = gain * slope
                p = r2 / (steep * steep)
                lagged = c[_LAG_START] * start
                f, d = _drift(m, lagged, c, wind, still, drive, force, hats, knots)
                h = 0.5 * dt
                e = np.exp(d * h)
                m += f * h * (1.0 + 0.5 * d * h)
                gust = offset = 0.0
                keep, push, _, hold, _, dd, dh, turn, _, _, _ = drive_moments(-d, fade, h)
                oo = c[_SET_POINT] * c[_SET_POINT]
                p, p_h, p_o, hh, ho = _carried(p, 0.0, 0.0, g2, 0.0, oo, e, keep, push, hold)
                p, p_h, hh = p + q2 * h + g2 * dd, p_h + g2 * dh, hh + g2 * turn
                level = start
            else:
                if gap[k] > 0.0:
                    steps = max(1, int(np.ceil(gap[k] / dt)))
                    h = gap[k] / steps
                    for _ in range(steps):
                        f0, d0 = _drift(m, lagged, c, wind, still, drive, force, hats, knots)
                        f1, d1 = _drift(m + 0.5 * h * f0, lagged, c, wind, still, drive, force, hats, knots)
                        if c[_LAG] > 0.0:
                            lagged += (m - lagged) * (1.0 - np.exp(-h / c[_LAG]))
                        e = np.exp(h * d1)
                        keep, push, _, hold, _, dd, dh, turn, _, _, _ = drive_moments(-d1, fade, h)
                        m += h * f1 + push * gust + hold * offset
                        gust *= keep
                        p, p_h, p_o, hh, ho = _carried(p, p_h, p_o, hh, ho, oo, e, keep, push, hold)
                        p, p_h, hh = p + q2 * h + g2 * dd, p_h + g2 * dh, hh + g2 * turn
                lag_mid = lag_end = lagged
                if c[_LAG] > 0.0:
                    lag_mid = lagged + (m - lagged) * (1.0 - np.exp(-0.5 * dt / c[_LAG]))
                f0, d0 = _drift(m, lagged, c, wind, still, drive, force, hats, knots)
                f1, _ = _drift(m + 0.5 * dt * f0, lag_mid, c, wind, still, drive, force, hats, knots)
                f2, _ = _drift(m + 0.5 * dt * f1, lag_mid, c, wind, still, drive, force, hats, knots)
                if c[_LAG] > 0.0:
                    middle = m + 0.5 * dt * f2
                    lag_end = lagged + (middle - lagged) * (1.0 - np.exp(-dt / c[_LAG]))
                f3, _ = _drift(m + dt * f2, lag_end, c, wind, still, drive, force, hats, knots)
                end = m + dt / 6.0 * (f0 + 2.0 * f1 + 2.0 * f2 + f3)
                fe, de = _drift(end, lag_end, c, wind, still, drive, force, hats, knots)
                middle = 0.5 * (m + end) + 0.125 * dt * (f0 - fe)
                _, dm = _drift(middle, lag_mid, c, wind, still, drive, force, hats, knots)
                half = np.exp(0.25 * dt * (d0 + dm))
                rate = -(d0 + 4.0 * dm + de) / 6.0
                phi = np.exp(-rate * dt)
                drift = noise_drift(m, p, q2, dt)
                if rate != last_rate or dt != last_dt or fade != last_fade:
                    last_rate, last_dt, last_fade = rate, dt, fade
                    moments = drive_moments(rate, fade, dt)
                keep, push, push_mean, hold, hold_mean, dd, dh, turn, dc, hm, mm = moments
                mean = (m + 4.0 * middle + end) / 6.0 + 0.5 * drift + push_mean * gust + hold_mean * offset
                weight = (1.0 + 4.0 * half + phi) / 6.0
                q_end, q_cross, q_mean = moments_along(phi, dt)
                value, slope, _ = saturated_reading(mean, c[_CLIP], c[_SOFT])
                h = gain * slope
                # covariances of the states at the start with the mean over the cycle
                at_a = weight * p + push_mean * p_h + hold_mean * p_o
                at_h = weight * p_h + push_mean * hh + hold_mean * ho
                at_o = weight * p_o + push_mean * ho + hold_mean * oo
                s = weight * at_a + push_mean * at_h + hold_mean * at_o + q2 * q_mean + g2 * mm
                s = h * h * s + r2
                cross = h * (phi * at_a + push * at_h + hold * at_o + q2 * q_cross + g2 * dc)
                cross_h, cross_o = h * (keep * at_h + g2 * hm), h * at_o
                v = y[k] - gain * value - line
                level = mean
                m = end + drift + push * gust + hold * offset + cross / s * v
                if m < 0.0:
                    m = 1e-9
                gust = keep * gust + cross_h / s * v
                offset += cross_o / s * v
                p, p_h, p_o, hh, ho = _carried(p, p_h, p_o, hh, ho, oo, phi, keep, push, hold)
                p += q2 * q_end + g2 * dd - cross * cross / s
                p_h += g2 * dh - cross * cross_h / s
                p_o -= cross * cross_o / s
                hh += g2 * turn - cross_h * cross_h / s
                ho -= cross_h * cross_o / s
                oo -= cross_o * cross_o / s
                lagged = lag_end
                v_out[w, k] = v
                s_out[w, k] = s
            if w == 0:
                levels[k] = level
            # phase
            a = max((y[k] - line) / gain, 1e-12)
            noise = r2 / (y[k] * y[k] + r2)
            faint = y[k] < FAINT * se[k] or not usable[k]
            pace = omega[k] * ((1.0 + c[_DET]) * (1.0 + a * (c[_ST1] + a * c[_ST2])) - 1.0)
            pace += side / a
            wander = c[_PQ] * c[_PQ] / (a * a)
            if gap[k] < 0.0:
                known = False
            elif known:
                step = gap[k] + dt
                angle += pace * step
                angle_p += wander * step
            if faint:
                v_out[w, size + k] = 0.0
                s_out[w, size + k] = 1.0
            elif not known:
                v_out[w, size + k] = 0.0
                s_out[w, size + k] = 1.0
                angle, angle_p, known = phase[k], noise, True
            else:
                v = phase[k] - angle
                s = angle_p + noise
                v_out[w, size + k] = v
                s_out[w, size + k] = s
                angle += angle_p / s * v
                angle_p -= angle_p * angle_p / s
            # waveform
            _, _, h3 = saturated_reading(max(level, 1e-12), c[_CLIP], c[_SOFT])
            bend = level * (c[_ST1] + level * c[_ST2])
            if third_se[k] >= ABSENT:
                v_out[w, 2 * size + k] = 0.0
                s_out[w, 2 * size + k] = 1.0
                continue
            v_out[w, 2 * size + k] = third[k] - gain * level * (h3 + c[_H3] + bend / 12.0)
            blur = c[_H3R] * third_se[k]
            s_out[w, 2 * size + k] = blur * blur


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
