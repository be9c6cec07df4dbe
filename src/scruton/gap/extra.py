"""A record that was not taken: what a hypothesis expects of it, and how well it would tell another from that one."""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.cycles import Channels
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.dynamics.effects.terms import HATS, Term, Variant
from scruton.dynamics.extended import channel_innovations, effect_drift
from scruton.dynamics.reading import saturated_reading
from scruton.gap.bare import bare_model
from scruton.gap.data import FLOOR, GapData
from scruton.gap.hypothesis import Hypothesis

_LAG, _LAG_START, _HAT = int(Term.LAG), int(Term.LAG_START), int(Term.HAT)
_FC, _FS, _FR = int(Term.FORCE_COS), int(Term.FORCE_SIN), int(Term.FORCE_RATE)
_GAIN, _CLIP, _SOFT, _THIRD = int(Term.GAIN), int(Term.CLIP), int(Term.CLIP_SOFT), int(Term.THIRD)
_DET, _ST2, _ST1 = int(Term.DETUNING), int(Term.STIFFNESS), int(Term.STIFFNESS_LINEAR)


@dataclass(frozen=True)
class Extra:
    """A record that could be taken.

    Attributes
    ----------
    text : str
    cost : float
        Effort against a still-air decay.
    template : int
        Record whose rig (and test, in wind) it shares.
    still : bool
        In still air.
    start : float
        Amplitude of release, A/D or rad.
    cycles : int
    damping : float
        Structural damping ratio over that of the template's rig: another Scruton number; 1: the same.
    """

    text: str
    cost: float
    template: int
    still: bool
    start: float
    cycles: int
    damping: float = 1.0


def with_record(data: GapData, extra: Extra) -> GapData:
    """The layout of a campaign with one more record, at the end; its cycles are still to come."""
    layout, t = data.layout, extra.template
    other = extra.damping != 1.0
    rig = len(data.rigs) if other else int(layout.rig[t])
    test = -1 if extra.still else (len(data.tests) if other else int(layout.test[t]))

    def more(values: np.ndarray, value: float) -> np.ndarray:
        return np.append(values, np.asarray(value, dtype=values.dtype))

    sc = np.nan if extra.still else layout.scruton_number[t] * extra.damping
    layout = replace(
        layout,
        records=(*layout.records, "extra"),
        rig=more(layout.rig, rig),
        test=more(layout.test, test),
        direction=more(layout.direction, 0),
        duration=more(layout.duration, extra.cycles * 2.0 * np.pi / layout.omega[t]),
        omega=more(layout.omega, layout.omega[t]),
        largest=more(layout.largest, min(extra.start, float(layout.largest.max()))),
        reduced_velocity=more(layout.reduced_velocity, np.nan if extra.still else layout.reduced_velocity[t]),
        scruton_number=more(layout.scruton_number, sc),
    )
    grown = {
        name: more(getattr(data, name), 0.0 if extra.still else getattr(data, name)[t])
        for name in ("aero_ratio", "drive_ratio", "mass_sd")
    }
    if other:
        grown |= {
            "damping": more(data.damping, data.nominal_damping[t] * extra.damping),
            "damping_sd": more(data.damping_sd, float(np.median(data.damping_sd))),
        }
    grown["nominal_damping"] = more(data.nominal_damping, data.nominal_damping[t] * extra.damping)
    rigs, tests = (*data.rigs, "another") if other else data.rigs, (*data.tests, "another") if other else data.tests
    return replace(data, layout=layout, rigs=rigs, tests=tests, **grown)  # type: ignore[arg-type]


def carried(hypothesis: Hypothesis, data: GapData) -> Hypothesis:
    """The same hypothesis in a layout that has one more record.

    Raises
    ------
    LookupError
        If one of its variants does not exist there.
    """
    return Hypothesis(bare_model(data), tuple(_same(variant, data) for variant in hypothesis.variants))


def _same(variant: Variant, data: GapData) -> Variant:
    module = variant.apply.__module__
    for effect in (*CATALOGUE.values(), UNKNOWN):
        if module.endswith(effect.name) or (effect is UNKNOWN and module.endswith("generic")):
            for one in effect.variants(data.layout):
                if one.label == variant.label:
                    return one
    raise LookupError(variant.label)


def carry(old: Hypothesis, new: Hypothesis, u: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates and covariance in the larger layout: what is new there has its prior."""
    location, scale = new.prior
    mean, wide = location.copy(), np.diag(scale**2)
    to, fro = [], []
    count = len(old.bare.data.layout.records)
    for one, other in zip(new.parameters, old.parameters, strict=True):
        for j in range(one.size):
            shared = np.flatnonzero((one.members[:count] == j) & (other.members >= 0))
            if shared.size:
                to.append(new.places[one.name].start + j)
                fro.append(old.places[other.name].start + int(other.members[shared[0]]))
    mean[to] = u[fro]
    wide[np.ix_(to, to)] = covariance[np.ix_(fro, fro)]
    return mean, wide


@njit(cache=True)
def _run(c, start, cycles, period, omega, knots):  # type: ignore[no-untyped-def]
    """Reading, phase and third harmonic of a run without turbulence, cycle by cycle."""
    out = np.empty((3, cycles))
    hats = False
    for j in range(HATS):
        if c[_HAT + j] != 0.0:
            hats = True
    m, lagged, phase = start, c[_LAG_START] * start, 0.0
    for k in range(cycles):
        tau = (k + 0.5) / cycles - 0.5
        dt = 0.5 * period if k == 0 else period
        mean, total = m, 0.0
        if k > 0:
            phase += (omega * ((1.0 + c[_DET]) * (1.0 + m * (c[_ST1] + m * c[_ST2])) - 1.0)) * dt
        chi = c[_FR] * k * period - phase
        force = c[_FC] * np.cos(chi) + c[_FS] * np.sin(chi)
        if k > 0:
            phase += (c[_FC] * np.sin(chi) - c[_FS] * np.cos(chi)) / max(m, 1e-12) * dt
        steps = 4
        h = dt / steps
        for _ in range(steps):
            f0, _ = effect_drift(m, lagged, c, tau, False, force, hats, knots)
            half = max(m + 0.5 * h * f0, 1e-12)
            f1, _ = effect_drift(half, lagged, c, tau, False, force, hats, knots)
            total += half
            if c[_LAG] > 0.0:
                lagged += (half - lagged) * (1.0 - np.exp(-h / c[_LAG]))
            m = max(m + h * f1, 1e-12)
        if k > 0:
            mean = total / steps
        value, _, h3 = saturated_reading(mean, c[_CLIP], c[_SOFT])
        gain = 1.0 + c[_GAIN]
        out[0, k], out[1, k] = gain * value, phase
        out[2, k] = gain * mean * (h3 + c[_THIRD] + mean * (c[_ST1] + mean * c[_ST2]) / 12.0)
    return out


def expected(hypothesis: Hypothesis, u: FloatArray, extra: Extra) -> Channels:
    """Cycles of the extra record, the last of the layout, as a hypothesis expects them; errors as the others have."""
    data = hypothesis.bare.data
    last = len(data.layout.records) - 1
    omega = float(data.layout.omega[last])
    period = 2.0 * np.pi / omega
    row = hypothesis.table(u[None])[0, last]
    a, phase, third = _run(row, extra.start, extra.cycles, period, omega, data.channels.knots)
    old = data.channels
    same = old.record == extra.template
    se = float(np.median(np.sqrt(np.maximum(old.standard_error[same] ** 2 - (FLOOR * old.amplitude[same]) ** 2, 0.0))))
    sees = a > 3.0 * se
    time: FloatArray = np.arange(extra.cycles, dtype=np.float64) * period
    place: FloatArray = np.asarray(time / max(float(time[-1]), period) - 0.5)
    size = extra.cycles
    return Channels(
        amplitude=a,
        standard_error=np.hypot(se, FLOOR * a),
        phase=phase,
        third=third,
        third_error=np.full(size, float(np.median(old.third_error[same]))),
        gap=np.r_[-1.0, np.zeros(size - 1)],
        period=np.full(size, period),
        time=time,
        place=place,
        record=np.full(size, last, dtype=np.intp),
        omega=np.full(size, omega),
        has_phase=sees & bool(old.has_phase[same].any()),
        knots=old.knots,
    )


def separation(
    truth: tuple[Hypothesis, FloatArray],
    rival: tuple[Hypothesis, FloatArray, FloatArray],
    extra: Extra,
) -> float:
    """Standard deviations by which an extra record, as one hypothesis expects it, would miss a rival's prediction.

    The rival predicts with its parameters' uncertainty: it may bend them as far as the records that are there allow.

    Parameters
    ----------
    truth : (Hypothesis, (d,) array)
        And its optimum.
    rival : (Hypothesis, (k,) array, (k, k) array)
        And its optimum and covariance.
    extra : Extra

    Raises
    ------
    LookupError
        If one of them does not exist with that record.
    """
    data = with_record(truth[0].bare.data, extra)
    one, other = carried(truth[0], data), carried(rival[0], data)
    size = truth[0].size
    u, _ = carry(truth[0], one, truth[1], np.zeros((size, size)))
    w, covariance = carry(rival[0], other, rival[1], rival[2])
    channels = expected(one, u, extra)
    told = Hypothesis(replace(other.bare, data=replace(data, channels=channels)), other.variants)
    v, log_s, jv, _ = told.derivatives(w)
    own, _ = channel_innovations(channels, one.table(u[None]))
    residual = (v - own[0]) * np.exp(-0.5 * log_s)
    _, rows, where = told._blocks[-1]
    j = jv[rows] * np.exp(-0.5 * log_s)
    inner = j @ j.T
    prior = covariance[np.ix_(where, where)]
    bend = prior @ np.linalg.solve(np.eye(len(where)) + inner @ prior, j @ residual)
    return float(np.sqrt(max(residual @ residual - residual @ (j.T @ bend), 0.0)))
