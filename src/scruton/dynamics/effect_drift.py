"""The drift of the amplitude with every term that an effect may add: da/dt in a given wind."""

import numpy as np

from scruton.compiled import njit
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.friction import at_speed, hysteresis

_S1, _S2, _S3 = int(Term.STRUCTURAL), int(Term.STRUCTURAL_LINEAR), int(Term.STRUCTURAL_SQUARE)
_RISE, _KNEE, _POWER = int(Term.STRUCTURAL_RISE), int(Term.STRUCTURAL_KNEE), int(Term.STRUCTURAL_POWER)
_F, _FW, _FS, _FP = (
    int(Term.FRICTION), int(Term.FRICTION_WIDTH), int(Term.FRICTION_SPRING), int(Term.FRICTION_POWER)
)  # fmt: skip
_HUMP, _HUMP_AT = int(Term.FRICTION_HUMP), int(Term.FRICTION_HUMP_AT)
_L1, _C, _L2, _L3, _L5 = (
    int(Term.AERO), int(Term.DRIVE), int(Term.AERO_LINEAR), int(Term.AERO_SQUARE), int(Term.AERO_FOURTH)
)  # fmt: skip
_COH, _LAG, _LAG_KIND, _LATE = int(Term.COHERENCE), int(Term.LAG), int(Term.LAG_KIND), int(Term.LATE)
_COH_POWER, _COH_FLOOR = int(Term.COHERENCE_POWER), int(Term.COHERENCE_FLOOR)
_LAW, _EXPONENT = int(Term.LAW_POWER), int(Term.LAW_EXPONENT)
_TREND, _SINE, _ARCH = int(Term.TREND), int(Term.TREND_SINE), int(Term.TREND_ARCH)
_TREND_DRIVE, _ARCH_DRIVE = int(Term.TREND_DRIVE), int(Term.TREND_DRIVE_ARCH)
_SETTLING, _SETTLING_DRIVE, _TREND_PACE = (
    int(Term.TREND_SETTLING), int(Term.TREND_DRIVE_SETTLING), int(Term.TREND_PACE)
)  # fmt: skip
_JUMP, _JUMP_RATE = int(Term.JUMP), int(Term.JUMP_RATE)
_WARMING, _PACE = int(Term.WARMING), int(Term.WARMING_PACE)
_HAT = int(Term.HAT)
_NO_WIDTH = 1e-60  # squared: of walkers without friction, whose amplitude may be nothing, too
_BUMP, _BUMP_AT, _BUMP_WIDTH = int(Term.BUMP), int(Term.BUMP_AT), int(Term.BUMP_WIDTH)


@njit(cache=True)
def effect_drift(a, lagged, c, tau, late, force, hats, knots):  # type: ignore[no-untyped-def]
    """da/dt and its derivative in a, for coefficients (COLUMNS,) at a place `tau` in the record.

    `late` is the part of the cycle that lies behind a jump.
    """
    x = c.reshape((COLUMNS, 1))
    wind, still, drive = weather(x, 0, tau, 0.5 * np.sin(np.pi * tau), np.cos(np.pi * tau), late)
    gained, warmth, driven = settling(x, 0, tau)
    wind, still, drive = wind + gained, still + warmth, drive * driven
    return drift_of(a, lagged, x, 0, wind, still, drive, force, hats, knots)


@njit(cache=True, inline="always")
def weather(x, w, tau, bow, arch, late):  # type: ignore[no-untyped-def]
    """Wind, still-air damping and drive at a place in a record, of column w: what no amplitude changes.

    `bow` is sin(pi tau)/2 and `arch` cos(pi tau), which do not depend on the column.
    """
    wind = 1.0 + x[_TREND, w] * tau + x[_SINE, w] * bow + x[_ARCH, w] * arch
    still = x[_S1, w] + late * x[_JUMP_RATE, w]
    drive = x[_C, w] * (1.0 + x[_TREND_DRIVE, w] * tau + x[_ARCH_DRIVE, w] * arch) * (1.0 + late * x[_JUMP, w])
    return wind, still, drive


@njit(cache=True, inline="always")
def settling(x, w, tau):  # type: ignore[no-untyped-def]
    """What column w has gained at a place in the record: of wind, structural damping rate and drive (a factor)."""
    share = 1.0 - np.exp(-(tau + 0.5) * x[_TREND_PACE, w])
    warmth = x[_WARMING, w] * (1.0 - np.exp(-(tau + 0.5) * x[_PACE, w]))
    return x[_SETTLING, w] * share, warmth, 1.0 + x[_SETTLING_DRIVE, w] * share


@njit(cache=True, inline="always")
def polynomial(x, w, wind, still, drive, force):  # type: ignore[no-untyped-def]
    """Coefficients of 1, a, a^2, a^3, a^5 in da/dt: all of it where there is no `rough` term."""
    return (
        wind * wind * drive + force,
        -still - wind * x[_L1, w],
        -x[_S2, w] - wind * x[_L2, w],
        -x[_S3, w] - wind * x[_L3, w],
        -wind * x[_L5, w],
    )


@njit(cache=True, inline="always")
def has_hats(c):  # type: ignore[no-untyped-def]
    """Whether a row of coefficients has excess damping at any amplitude: the terms of nothing that has a name."""
    return np.any(c[_HAT : _HAT + HATS] != 0.0) or c[_BUMP] != 0.0


@njit(cache=True, inline="always")
def rough(c):  # type: ignore[no-untyped-def]
    """Whether a row of coefficients has terms that are no polynomial of the amplitude: 0, 1, or 2 with hats."""
    if has_hats(c):
        return 2.0
    return 1.0 if c[_F] != 0.0 or c[_LAG] > 0.0 or c[_COH] > 0.0 or c[_RISE] != 0.0 or c[_LAW] != 0.0 else 0.0


@njit(cache=True, inline="always")
def drift_of(a, lagged, x, w, wind, still, drive, force, hats, knots):  # type: ignore[no-untyped-def]
    """`effect_drift` of column w of a table on end, (COLUMNS or more, W), in a given wind."""
    f = -(still + a * (x[_S2, w] + a * x[_S3, w])) * a
    d = -still - a * (2.0 * x[_S2, w] + 3.0 * a * x[_S3, w])
    if x[_F, w] != 0.0:
        loss, steep = friction(x, w, a)
        f -= loss
        d -= steep
    if x[_RISE, w] != 0.0:
        loss, steep = rise(x, w, a)
        f -= loss
        d -= steep
    at_once = x[_LAG, w] <= 0.0 or x[_LAG_KIND, w] > 1.5
    b = a if at_once else lagged
    slow = x[_L1, w] + b * (x[_L2, w] + b * (x[_L3, w] + b * b * x[_L5, w]))
    steep = x[_L1, w] + b * (2.0 * x[_L2, w] + b * (3.0 * x[_L3, w] + 5.0 * b * b * x[_L5, w]))
    if x[_LAW, w] != 0.0:
        faster = power_growth(x, w, b)
        slow -= faster
        steep -= (1.0 + x[_EXPONENT, w]) * faster
    slope_drive = 0.0
    if x[_COH, w] > 0.0:
        lost, slope_drive = incoherence(x, w, b, drive)
        drive -= lost
    if at_once:
        f += wind * (wind * drive - slow * a)
        d += wind * (wind * slope_drive - steep)
    elif x[_LAG_KIND, w] > 0.5:
        b = max(b, 1e-3 * abs(a) + 1e-12)
        damping = wind * (wind * drive / b - slow)
        f += damping * a
        d += damping
    else:
        f += wind * (wind * drive - slow * b)
    if x[_LATE, w] != 0.0:
        late = steep = x[_LATE, w]
        if x[_LAG_KIND, w] > 2.5:
            now = max(abs(a), 1e-12)
            late *= wind * wind * drive / now
            steep = late * lagged / now
        f += late * (lagged - a)
        d -= steep
    if hats:
        loss, steep = excess(x, w, a, knots)
        f -= loss
        d -= steep
    return f + force, d


@njit(cache=True, inline="always")
def smooth_friction(x, w, a):  # type: ignore[no-untyped-def]
    """What sudden friction takes from da/dt at an amplitude, and from its derivative: no branch, for loops."""
    w2 = x[_FW, w] * x[_FW, w] + _NO_WIDTH
    root = np.sqrt(a * a + w2)
    return x[_F, w] * (a / root), x[_F, w] * (w2 / (root * root * root))


@njit(cache=True, inline="always")
def friction(x, w, a):  # type: ignore[no-untyped-def]
    """The same of any friction."""
    if x[_FS, w] != 0.0:
        loss, steep = hysteresis(a / x[_FW, w])
        loss, steep = x[_F, w] * loss, x[_F, w] * steep / x[_FW, w]
    else:
        loss, steep = smooth_friction(x, w, a)
    if x[_FP, w] != 0.0 or x[_HUMP, w] != 0.0:
        factor, slope = at_speed(max(abs(a), 1e-12), x[_FP, w], x[_HUMP, w], x[_HUMP_AT, w])
        steep = factor * steep + slope * loss
        loss *= factor
    return loss, steep


@njit(cache=True, inline="always")
def rise(x, w, a):  # type: ignore[no-untyped-def]
    """The same of structural damping that rises as a power of the amplitude to a knee."""
    ratio, power = abs(a) / x[_KNEE, w], x[_POWER, w]
    if power > 0.0:
        grown = ratio if power == 1.0 else ratio * ratio if power == 2.0 else ratio**power
        share = grown / (1.0 + grown)
        steep = power * share * (1.0 - share)
    else:
        share = 1.0 - np.exp(-ratio)
        steep = ratio * (1.0 - share)
    return x[_RISE, w] * share * a, x[_RISE, w] * (share + steep)


@njit(cache=True, inline="always")
def power_growth(x, w, a):  # type: ignore[no-untyped-def]
    """Rate of growth that goes with a power of the amplitude."""
    return x[_LAW, w] * max(abs(a), 1e-12) ** x[_EXPONENT, w]


@njit(cache=True, inline="always")
def incoherence(x, w, a, drive):  # type: ignore[no-untyped-def]
    """What is lost of a drive at an amplitude, and the derivative of what is left."""
    far, part = max(a, 0.0) / x[_COH, w], (1.0 - x[_COH_FLOOR, w]) * drive
    power = x[_COH_POWER, w]
    if power == 1.0:
        left = 1.0 / (1.0 + far)
        kept, slope = far * left, left * left
    elif power == 2.0:
        left = 1.0 / np.sqrt(1.0 + far * far)
        kept, slope = far * left, left * left * left
    elif power > 0.0:
        most = 1.0 + (far * far * far if power == 3.0 else far**power)
        left = most ** (-1.0 / power)
        kept, slope = far * left, left / most
    else:
        slope = np.exp(-far)
        kept = 1.0 - slope
    return part * (1.0 - kept), part * slope / x[_COH, w]


@njit(cache=True, inline="always")
def excess(x, w, a, knots):  # type: ignore[no-untyped-def]
    """What excess damping takes from da/dt at an amplitude, and from its derivative."""
    log_a = np.log(max(a, 1e-300))
    rate, slope = _hat(x, w, log_a, knots)
    if x[_BUMP, w] != 0.0:
        off = (log_a - x[_BUMP_AT, w]) / x[_BUMP_WIDTH, w]
        bump = x[_BUMP, w] * np.exp(-0.5 * off * off)
        rate += bump
        slope -= bump * off / x[_BUMP_WIDTH, w]
    return rate * a, rate + slope


@njit(cache=True, inline="always")
def _hat(x, w, log_a, knots):  # type: ignore[no-untyped-def]
    """Excess damping rate at an amplitude, and its slope in ln(amplitude)."""
    if not log_a > knots[0]:  # also where the filter lost its way and it is no number
        return x[_HAT, w], 0.0
    last = len(knots) - 1
    if log_a >= knots[last]:
        return x[_HAT + last, w], 0.0
    step = knots[1] - knots[0]
    i = min(int((log_a - knots[0]) / step), last - 1)
    part = (log_a - knots[i]) / step
    low, high = x[_HAT + i, w], x[_HAT + i + 1, w]
    return low + part * (high - low), (high - low) / step
