r"""The filter of the amplitude equation with any effect in it: amplitude, phase and waveform of every cycle.

Each record has a row of coefficients (`scruton.dynamics.effects.terms.Term`).  The amplitude is a state that the
equation moves and turbulence pushes about; the filter is linearised along its mean, by Runge-Kutta through every cycle.
The phase is a state that wanders about its own frequency, and the in-phase third harmonic is read cycle by cycle: what
stiffness, forcing and a saturated sensor show themselves in.
"""

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import ABSENT, Channels
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.moments import moments_along, noise_drift
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
_HAT = int(Term.HAT)
# Columns that the amplitude depends on; the others move the phase and the third harmonic alone.
_DAMPING = np.setdiff1d(np.arange(COLUMNS), [_DET, _ST2, _ST1, _PQ, _H3, _H3R])


@njit(cache=True, inline="always")
def _hat(c, log_a, knots):  # type: ignore[no-untyped-def]
    """Excess damping rate at an amplitude, and its slope in ln(amplitude)."""
    if log_a <= knots[0]:
        return c[_HAT], 0.0
    last = knots.size - 1
    if log_a >= knots[last]:
        return c[_HAT + last], 0.0
    step = knots[1] - knots[0]
    i = min(int((log_a - knots[0]) / step), last - 1)
    part = (log_a - knots[i]) / step
    low, high = c[_HAT + i], c[_HAT + i + 1]
    return low + part * (high - low), (high - low) / step


@njit(cache=True)
def effect_drift(a, lagged, c, tau, late, force, hats, knots):  # type: ignore[no-untyped-def]
    """da/dt and its derivative in a."""
    wind = 1.0 + c[_TREND] * tau
    if c[_SINE] != 0.0:
        wind += 0.5 * c[_SINE] * np.sin(np.pi * tau)
    still = c[_S1]
    drive = c[_C] * (1.0 + c[_TREND_DRIVE] * tau)
    if late:
        still += c[_JUMP_RATE]
        drive *= 1.0 + c[_JUMP]
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


@njit(cache=True, error_model="numpy", nogil=True)
def _extended_filter(  # type: ignore[no-untyped-def]
    y, se, phase, third, third_se, gap, period, time, place, rec, omega, knots, table, active, usable, p0, v_out, s_out
):
    size = y.size
    levels = np.empty(size)  # filtered amplitudes of the first row
    for w in range(table.shape[0]):
        m = p = lagged = angle = angle_p = 0.0
        known = False
        for k in range(size):
            if active[w, rec[k]] == 0:
                for channel in range(3):
                    v_out[w, channel * size + k] = v_out[0, channel * size + k]
                    s_out[w, channel * size + k] = s_out[0, channel * size + k]
                continue
            c = table[w, rec[k]]
            dt = period[k]
            gain = 1.0 + c[_GAIN]
            blur = c[_R] * se[k]
            r2 = blur * blur
            q2 = c[_Q] * c[_Q]
            hats = False
            for j in range(HATS):
                if c[_HAT + j] != 0.0:
                    hats = True
            late = time[k] > c[_JT]
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
                f, d = effect_drift(m, lagged, c, place[k], late, force, hats, knots)
                h = 0.5 * dt
                e = np.exp(d * h)
                m += f * h * (1.0 + 0.5 * d * h)
                p = e * e * p + q2 * h
                level = start
            else:
                if gap[k] > 0.0:
                    steps = max(1, int(np.ceil(gap[k] / dt)))
                    h = gap[k] / steps
                    for _ in range(steps):
                        f0, d0 = effect_drift(m, lagged, c, place[k], late, force, hats, knots)
                        f1, d1 = effect_drift(m + 0.5 * h * f0, lagged, c, place[k], late, force, hats, knots)
                        if c[_LAG] > 0.0:
                            lagged += (m - lagged) * (1.0 - np.exp(-h / c[_LAG]))
                        m += h * f1
                        e = np.exp(h * d1)
                        p = e * e * p + q2 * h
                lag_mid = lag_end = lagged
                if c[_LAG] > 0.0:
                    lag_mid = lagged + (m - lagged) * (1.0 - np.exp(-0.5 * dt / c[_LAG]))
                f0, d0 = effect_drift(m, lagged, c, place[k], late, force, hats, knots)
                f1, _ = effect_drift(m + 0.5 * dt * f0, lag_mid, c, place[k], late, force, hats, knots)
                f2, _ = effect_drift(m + 0.5 * dt * f1, lag_mid, c, place[k], late, force, hats, knots)
                if c[_LAG] > 0.0:
                    middle = m + 0.5 * dt * f2
                    lag_end = lagged + (middle - lagged) * (1.0 - np.exp(-dt / c[_LAG]))
                f3, _ = effect_drift(m + dt * f2, lag_end, c, place[k], late, force, hats, knots)
                end = m + dt / 6.0 * (f0 + 2.0 * f1 + 2.0 * f2 + f3)
                fe, de = effect_drift(end, lag_end, c, place[k], late, force, hats, knots)
                middle = 0.5 * (m + end) + 0.125 * dt * (f0 - fe)
                _, dm = effect_drift(middle, lag_mid, c, place[k], late, force, hats, knots)
                half = np.exp(0.25 * dt * (d0 + dm))
                phi = np.exp(dt / 6.0 * (d0 + 4.0 * dm + de))
                drift = noise_drift(m, p, q2, dt)
                mean = (m + 4.0 * middle + end) / 6.0 + 0.5 * drift
                weight = (1.0 + 4.0 * half + phi) / 6.0
                q_end, q_cross, q_mean = moments_along(phi, dt)
                value, slope, _ = saturated_reading(mean, c[_CLIP], c[_SOFT])
                h = gain * slope
                s = h * h * (weight * weight * p + q2 * q_mean) + r2
                cross = h * (phi * weight * p + q2 * q_cross)
                v = y[k] - gain * value - line
                level = mean
                m = end + drift + cross / s * v
                if m < 0.0:
                    m = 1e-9
                p = phi * phi * p + q2 * q_end - cross * cross / s
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
