"""A record that was not taken: what a hypothesis expects of it, and how well it would tell another from that one."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.dynamics.cycles import Channels
from scruton.dynamics.effect_drift import effect_drift, has_hats
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.dynamics.effects.effect import SOME, Extent
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.extended import channel_innovations
from scruton.dynamics.friction import at_speed, stiffening
from scruton.dynamics.reading import saturated_reading, third_of_bend
from scruton.gap.data import FLOOR, GapData
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.null_model import null_model

_LAG, _LAG_START = int(Term.LAG), int(Term.LAG_START)
_FC, _FS, _FR, _TWICE = int(Term.FORCE_COS), int(Term.FORCE_SIN), int(Term.FORCE_RATE), int(Term.FORCE_TWICE)
_GAIN, _CLIP, _SOFT, _THIRD = int(Term.GAIN), int(Term.CLIP), int(Term.CLIP_SOFT), int(Term.THIRD)
_STICK, _WIDTH, _POWER = int(Term.FRICTION_SPRING), int(Term.FRICTION_WIDTH), int(Term.FRICTION_POWER)
_HUMP, _HUMP_AT = int(Term.FRICTION_HUMP), int(Term.FRICTION_HUMP_AT)
_LOSS = int(Term.FREQUENCY_LOSS)
_DET, _ST1, _ST2, _ST4 = (
    int(Term.DETUNING), int(Term.STIFFNESS_LINEAR), int(Term.STIFFNESS), int(Term.STIFFNESS_FOURTH)
)  # fmt: skip


@dataclass(frozen=True)
class FurtherRecord:
    """A record that could be taken."""

    text: str
    cost: float  # effort against a still-air decay
    template: int  # record whose rig (and test, in wind) it shares
    still: bool  # in still air
    start: float  # amplitude of release, A/D or rad
    cycles: int
    damping: float = 1.0  # structural, over that of the template's rig: another Scruton number where it is not 1


def with_record(data: GapData, record: FurtherRecord) -> GapData:
    """The layout of a campaign with one more record, at the end; its cycles are still to come."""
    layout, t = data.layout, record.template
    other = record.damping != 1.0
    rig = len(data.rigs) if other else layout.rig[t]
    test = -1 if record.still else (len(data.tests) if other else layout.test[t])

    def grown(of: Any, **values: Any) -> dict[str, Any]:
        arrays = {name: np.asarray(getattr(of, name)) for name in values}
        return {name: np.append(a, np.asarray(values[name], dtype=a.dtype)) for name, a in arrays.items()}

    added = grown(
        layout, rig=rig, test=test, direction=0, omega=layout.omega[t],
        duration=record.cycles * 2.0 * np.pi / layout.omega[t], largest=min(record.start, float(layout.largest.max())),
        reduced_velocity=np.nan if record.still else layout.reduced_velocity[t],
        scruton_number=np.nan if record.still else layout.scruton_number[t] * record.damping,
    )  # fmt: skip
    stated = {"damping": data.nominal_damping[t] * record.damping, "damping_sd": float(np.median(data.damping_sd))}
    names = ("aero_ratio", "drive_ratio", "mass_sd")
    return replace(
        data,
        layout=replace(layout, **added | {"records": (*layout.records, "extra")}),
        rigs=(*data.rigs, "another") if other else data.rigs,
        tests=(*data.tests, "another") if other else data.tests,
        **grown(data, **{name: 0.0 if record.still else getattr(data, name)[t] for name in names}),
        **grown(data, nominal_damping=data.nominal_damping[t] * record.damping, **(stated if other else {})),
    )


def in_layout_of(data: GapData, hypothesis: Hypothesis) -> Hypothesis:
    """The same hypothesis in a layout that has one more record; LookupError if a variant does not exist there."""
    effects, variants = CATALOGUE | {UNKNOWN.name: UNKNOWN}, []
    for variant in hypothesis.variants:
        same = [other for other in effects[variant.effect].variants(data.layout) if other.identity == variant.identity]
        if not same:
            raise LookupError(variant.label)
        same_records = np.zeros(len(data.layout.records), dtype=bool)
        same_records[: variant.scope.records.size] = variant.scope.records
        chosen = variant.scope.extent in SOME  # by what was seen: not by one that is still to come, but of such a test
        if variant.scope.extent is Extent.SOME_TESTS:
            same_records = np.isin(data.layout.test, data.layout.test[same_records])
        variants.append(same[0].within(same_records) if chosen else same[0])
    return Hypothesis(null_model(data), tuple(variants))


def transplanted(
    old: Hypothesis, new: Hypothesis, u: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and covariance in the larger layout: what is new there has its prior."""
    location, scale = new.prior
    mean, wide = location.copy(), np.diag(scale**2)
    there = new.places[:, : len(old.data.layout.records)]
    shared = (there >= 0) & (old.places >= 0)
    to, first = np.unique(there[shared], return_index=True)
    fro = old.places[shared][first]
    mean[to] = u[fro]
    wide[np.ix_(to, to)] = covariance[np.ix_(fro, fro)]
    return mean, wide


@njit(cache=True)
def _run(c, start, cycles, period, omega, knots):  # type: ignore[no-untyped-def]
    """Reading, phase and third harmonic of a run without turbulence, cycle by cycle."""
    out = np.empty((3, cycles))
    hats = has_hats(c)
    m, lagged, phase = start, c[_LAG_START] * start, 0.0
    for k in range(cycles):
        tau = (k + 0.5) / cycles - 0.5
        dt = 0.5 * period if k == 0 else period
        mean, total = m, 0.0
        if k > 0:
            phase += (omega * ((1.0 + c[_DET]) * (1.0 + m * (c[_ST1] + m * (c[_ST2] + m * m * c[_ST4]))) - 1.0)) * dt
            if c[_STICK] != 0.0:
                strength = c[_STICK] * at_speed(m, c[_POWER], c[_HUMP], c[_HUMP_AT])[0]
                phase += omega * dt * stiffening(m, strength, c[_WIDTH])
        chi = c[_FR] * k * period - (1.0 + c[_TWICE]) * phase
        size = m if c[_TWICE] != 0.0 else 1.0
        force = size * (c[_FC] * np.cos(chi) + c[_FS] * np.sin(chi))
        if k > 0:
            phase += size * (c[_FC] * np.sin(chi) - c[_FS] * np.cos(chi)) / max(m, 1e-12) * dt
        steps = 4
        h = dt / steps
        for _ in range(steps):
            f0, _ = effect_drift(m, lagged, c, tau, 0.0, force, hats, knots)
            half = max(m + 0.5 * h * f0, 1e-12)
            f1, _ = effect_drift(half, lagged, c, tau, 0.0, force, hats, knots)
            total += half
            if c[_LAG] > 0.0:
                lagged += (half - lagged) * (1.0 - np.exp(-h / c[_LAG]))
            m = max(m + h * f1, 1e-12)
        if k > 0:
            mean = total / steps
        value, _, h3 = saturated_reading(mean, c[_CLIP], c[_SOFT])
        gain = 1.0 + c[_GAIN]
        out[0, k] = gain * value
        if k > 0:
            grown = 2.0 * (out[0, k] - out[0, k - 1]) / (out[0, k] + out[0, k - 1])
            phase -= c[_LOSS] * grown * grown / (omega * period)
        out[1, k] = phase
        bend = third_of_bend(mean, c[_ST1], c[_ST2], c[_ST4])
        out[2, k] = gain * mean * (h3 + c[_THIRD] + bend)
    return out


def expected(hypothesis: Hypothesis, u: FloatArray, record: FurtherRecord) -> Channels:
    """Cycles of the extra record, the last of the layout, as a hypothesis expects them; errors as the others have."""
    data = hypothesis.data
    last = len(data.layout.records) - 1
    omega = float(data.layout.omega[last])
    period = 2.0 * np.pi / omega
    row = hypothesis.table(u[None])[0, last]
    a, phase, third = _run(row, record.start, record.cycles, period, omega, data.channels.knots)
    old = data.channels
    same = old.record == record.template
    se = float(np.median(np.sqrt(np.maximum(old.standard_error[same] ** 2 - (FLOOR * old.amplitude[same]) ** 2, 0.0))))
    sees = a > 3.0 * se
    size = record.cycles
    time: FloatArray = np.arange(size, dtype=np.float64) * period
    return Channels(
        amplitude=a,
        standard_error=np.hypot(se, FLOOR * a),
        phase=phase,
        third=third,
        third_error=np.full(size, float(np.median(old.third_error[same]))),
        gap=np.r_[-1.0, np.zeros(size - 1)],
        period=np.full(size, period),
        time=time,
        place=time / max(float(time[-1]), period) - 0.5,
        record=np.full(size, last, dtype=np.intp),
        omega=np.full(size, omega),
        has_phase=sees & bool(old.has_phase[same].any()),
        knots=old.knots,
    )


def separation(truth: tuple[Hypothesis, FloatArray], rival: FittedHypothesis, record: FurtherRecord) -> float:
    """Standard deviations by which an extra record, as one hypothesis expects it, would miss a rival's prediction.

    The first comes with its coordinates; the rival may bend its own as far as the records that are there allow.
    LookupError if one of them does not exist with that record, or foresees none that could be measured.
    """
    hypothesis, at = truth
    data = with_record(hypothesis.data, record)
    extended, other = in_layout_of(data, hypothesis), in_layout_of(data, rival.hypothesis)
    u, _ = transplanted(hypothesis, extended, at, np.zeros((at.size, at.size)))
    w, covariance = transplanted(rival.hypothesis, other, rival.mode, rival.covariance)
    channels = expected(extended, u, record)
    informed = Hypothesis(replace(other.null, data=replace(data, channels=channels)), other.variants)
    with np.errstate(invalid="ignore"):  # what grows without bound is found out below
        v, s, told = informed.derivatives(w)
        predicted, _ = channel_innovations(channels, extended.table(u[None]))
        residual, j = (v - predicted[0]) / np.sqrt(s), told[-1][0] / np.sqrt(s)
    if not (np.isfinite(residual).all() and np.isfinite(j).all()):
        raise LookupError(f"{record.text}: no finite prediction")
    inner = j @ j.T
    prior = covariance[informed.blocks[-1].square]
    bend = prior @ np.linalg.solve(np.eye(len(j)) + inner @ prior, j @ residual)
    return float(np.sqrt(max(residual @ residual - residual @ (j.T @ bend), 0.0)))
