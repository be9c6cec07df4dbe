"""Places in single records: scatter that is no white noise, lines and beats in the spectrum, bent waves.

And those that one record shows only beside others: damping off its statement, drifts, gains, tests that differ.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import fdtr, fdtrc, ndtri

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Extent, Parameter, Scope, Values, Variant, add, size_prior
from scruton.dynamics.effects.terms import Layout, Term
from scruton.gap import thresholds
from scruton.gap.check import shared_by_neighbours
from scruton.gap.contradictions import Contradiction
from scruton.gap.data import GapData
from scruton.gap.finding import Finding, amplitudes_of, place, time_of
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.lines import SecondLine
from scruton.stats.whiteness import autocorrelation

_QUARTERS = 4
_TAKEN = 2


class Mark(NamedTuple):
    """What one look at the innovations of a record gives; `cycles` are those in which it was seen, by default all."""

    kind: str
    value: float
    sd: float
    significance: float
    detail: str
    cycles: slice | None = None


def scatter_findings(fit: FittedHypothesis) -> list[Finding]:
    """Innovations that are coloured, come in bursts, are modulated or have heavy tails, by record in wind.

    The fit is that with excess curves of damping: what a curve explains is no scatter.
    """
    data = fit.hypothesis.data
    channels = data.channels
    v, s = (x[0, : channels.size] for x in fit.hypothesis.innovations(fit.mode[None]))
    critical = float(-ndtri(thresholds.SCATTER_FALSE / max(int(np.count_nonzero(data.layout.wind)), 1)))
    shared = shared_by_neighbours(fit, s)
    findings: list[Finding] = []
    for r, name in enumerate(data.layout.records):
        cycles = np.flatnonzero(channels.record == r)[1:]
        # in still air the innovations are those of the demodulation, whose errors are bounds
        if cycles.size < thresholds.FEWEST_CYCLES_OF_SCATTER or not data.layout.wind[r]:
            continue
        x = (v / np.sqrt(s))[cycles]
        amplitude = channels.amplitude[cycles]
        level = float(np.median(np.sqrt(s)[cycles] / np.maximum(amplitude, 1e-12))) * float(np.median(amplitude))
        time = data.cycles[name].time[1:]
        colour = _colour(x, float(shared[cycles].mean()))
        for mark in (colour, _bursts(x), _tails(x), _modulation(x, level, float(channels.period[cycles[0]]))):
            if mark.significance > critical:
                fields = {"kind": mark.kind, "significance": mark.significance}
                if mark.cycles is not None:
                    fields["time"] = tuple(time[mark.cycles][[0, -1]].tolist())
                quantity = "spectrum" if mark.kind == "beating" else "scatter"
                findings.append(place(data, r, quantity, mark.value, mark.sd, mark.detail, **fields))
    return findings


def _colour(x: FloatArray, shared: float = 0.0) -> Mark:
    """Correlation of neighbours, beyond what turbulence gives them."""
    rho, sd = float(autocorrelation(x, 1)[0]), float(1.0 / np.sqrt(x.size))
    beyond = rho - float(np.clip(rho, 0.0, shared))
    return Mark("colour", rho, sd, abs(beyond) / sd, "correlation of innovations one cycle apart")


def _bursts(x: FloatArray) -> Mark:
    """The quarter whose variance is farthest from that of the others."""
    edges = np.linspace(0, x.size, _QUARTERS + 1).astype(int)
    best = Mark("bursts", 0.0, 1.0, 0.0, "")
    # heavy tails leave fewer values that count
    worth = 1.0 / max(1.0, float(np.mean(x**4) / np.mean(x**2) ** 2) / 3.0)
    for quarter, (low, high) in enumerate(pairwise(edges), 1):
        inside, outside = x[low:high], np.r_[x[:low], x[high:]]
        ratio = float(np.mean(inside**2) / np.mean(outside**2))
        # a curve of damping takes some of a quarter's freedom
        freedom = (worth * max(inside.size - _TAKEN, 2), worth * max(outside.size - _TAKEN, 2))
        chance = 2.0 * _QUARTERS * min(fdtrc(*freedom, ratio), fdtr(*freedom, ratio))
        significance = float(-ndtri(min(max(0.5 * chance, 1e-300), 0.5)))
        if significance > best.significance:
            sd = ratio * float(np.sqrt(2.0 / freedom[0] + 2.0 / freedom[1]))
            detail = f"variance of the innovations in quarter {quarter} over the others', minus 1"
            best = Mark("bursts", ratio - 1.0, sd, significance, detail, slice(int(low), int(high)))
    return best


def _tails(x: FloatArray) -> Mark:
    excess = float(np.mean(np.minimum(np.abs(x - x.mean()), 20.0) ** 4) / np.var(x) ** 2 - 3.0)
    sd = float(np.sqrt(24.0 / x.size))
    return Mark(
        "tails", excess, sd, max(0.0, thresholds.KURTOSIS_SHARE * excess / sd), "excess kurtosis of the innovations"
    )


def _modulation(x: FloatArray, level: float, period: float) -> Mark:
    """A period in the innovations, between the slowest four in a record and one of four cycles."""
    n = x.size
    power = np.abs(np.fft.rfft(x - x.mean())) ** 2 / (n * np.var(x))
    use = np.arange(power.size)
    use = use[(use >= 4) & (use <= n // 4)]
    if use.size < 4:
        return Mark("beating", 0.0, 1.0, 0.0, "")
    peak = int(use[np.argmax(power[use])])
    chance = min(1.0, float(use.size * np.exp(-power[peak])))
    size = 2.0 * float(np.sqrt(power[peak] / n)) * level
    detail = f"beating: innovations rise and fall at {peak / n / period:.4g} Hz"
    significance = float(-ndtri(max(0.5 * chance, 1e-300)))
    return Mark("beating", size, size / np.sqrt(2.0 * power[peak]), significance, detail)


def line_findings(lines: Sequence[SecondLine], data: GapData) -> list[Finding]:
    """Lines beside the response."""
    return [
        place(data, data.layout.records.index(line.record), "spectrum", line.amplitude,
              line.amplitude / np.sqrt(2.0 * line.ratio), f"a second line at {line.frequency:.4g} Hz", kind="line")
        for line in lines
        if line.ratio >= thresholds.LINE_NATS
    ]  # fmt: skip


def contradiction_findings(contradictions: Sequence[Contradiction], data: GapData) -> list[Finding]:
    """What a record does that its test, or its rig in still air, cannot."""
    return [
        place(data, data.layout.records.index(one.record), one.quantity, one.value, one.sd, one.seen, kind=one.kind)
        for one in contradictions
    ]


def wave_findings(data: GapData) -> list[Finding]:
    """Third harmonics in phase at the largest amplitudes, beyond those at small ones: flat tops of a reading."""
    channels, findings = data.channels, []
    count = len(data.layout.records)
    critical = float(-ndtri(0.5 * thresholds.SCATTER_FALSE / count))
    for r in range(count):
        cycles = channels.record == r
        a, third, error = channels.amplitude[cycles], channels.third[cycles], channels.third_error[cycles]
        high = a > thresholds.HIGH_AMPLITUDE * a.max()
        if np.count_nonzero(high) < 2 or not np.all(error < 1e5):
            continue
        ratio, se = third[high] / a[high], error[high] / a[high]
        # a plain mean: errors grow with the harmonic itself, so that weights would choose the cycles without it
        value = float(np.mean(ratio))
        sd = float(np.hypot(np.sqrt(np.mean(se**2) / se.size), data.priors["third"].scale))
        if abs(value) / sd < critical:
            continue
        span = (float(a[high].min()), float(a.max()))
        what = f"{'flat' if value < 0.0 else 'peaked'} tops: third harmonic in phase, over the amplitude"
        fields = {"kind": "wave", "amplitude": span, "time": time_of(data, r, span)}
        findings.append(place(data, r, "signal", value, sd, what, **fields))
    return findings


def still_air_findings(null: FittedHypothesis) -> list[Finding]:
    """Rigs whose damping is not what is stated, as the records tell it without that statement."""
    data = null.hypothesis.data
    value, sd = null.value("damping")
    looks = []
    for i, (m, s) in enumerate(zip(value, sd, strict=True)):
        still = (data.layout.rig == i) & ~data.layout.wind
        stated = data.damping[i] if i < data.damping.size else np.nan
        if not np.isfinite(stated) or not np.any(still):
            continue
        prior = float(data.damping_sd[i])
        share = 1.0 - (s / prior) ** 2
        if share < 0.1:
            continue
        error, error_sd = m / share, float(np.sqrt(s**2 / share + prior**2))
        if _beyond(error / error_sd, value.size):
            whole = {"record": None, "amplitude": amplitudes_of(data, still), "time": None}
            detail, r = "damping ratio, over the stated one", int(np.flatnonzero(still)[0])
            fields = {"significance": abs(error) / error_sd, **whole}
            looks.append(place(data, r, "damping", float(stated * error), float(stated * error_sd), detail, **fields))
    return looks


def drift_findings(null: FittedHypothesis) -> list[Finding]:
    """Damping that changes while a record runs: a wind that rises or falls, told record by record."""
    data = null.hypothesis.data
    layout = data.layout
    fit = _with_one_each(null, Term.TREND, size_prior("size", layout.each(layout.wind)))
    value, sd = fit.value("size", 0)
    table = fit.table
    # the slope of the damping at the stable amplitude, in the relative change of the wind
    slope = -(table[:, Term.AERO] + 2.0 * table[:, Term.STRUCTURAL]) / layout.omega
    return [
        place(data, int(r), "damping", slope[r] * value[j], abs(slope[r]) * sd[j],
              f"damping ratio, end of the record over its start: wind {value[j]:+.1%}", kind="drift")
        for j, r in enumerate(np.flatnonzero(layout.wind))
        if _beyond(value[j] / sd[j], value.size)
    ]  # fmt: skip


def gain_findings(null: FittedHypothesis) -> list[Finding]:
    """Records whose reading is larger or smaller than that of the others by a factor."""
    data = null.hypothesis.data
    layout = data.layout
    records = np.flatnonzero(layout.wind)
    if records.size < 3:
        return []
    fit = _with_one_each(null, Term.GAIN, size_prior("size", layout.each(layout.wind), scale=0.2))
    where = fit.hypothesis.slices[0, "size"]
    contrast = np.eye(records.size) - 1.0 / records.size
    sd = np.sqrt(np.diag(contrast @ fit.covariance[where, where] @ contrast.T))
    value = fit.mode[where] - np.median(fit.mode[where])
    return [
        place(data, int(r), "signal", value[j], sd[j], "gain over that of its fellows, minus 1", kind="gain")
        for j, r in enumerate(records)
        if _beyond(value[j] / sd[j], value.size)
    ]


def between_tests(null: FittedHypothesis) -> list[Finding]:
    """Tests whose aerodynamic damping or drive is not that of the shared (Y1, epsilon)."""
    data = null.hypothesis.data
    layout = data.layout
    if len(data.first_in_wind) < 2:
        return []
    scope = Scope(Extent.EACH_TEST, layout.by_test())

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        table[:, :, Term.AERO] *= np.exp(values["size"])
        table[:, :, Term.DRIVE] *= np.exp(values["size"] + values["drive"])

    parameters = (size_prior("size", scope.members), size_prior("drive", scope.members))
    fit = null.with_variants(Variant("tests", parameters, apply, scope))
    shared = null.table
    findings = []
    for number, r in data.first_in_wind.items():
        whole = {"record": None, "amplitude": amplitudes_of(data, layout.test == number), "time": None}
        level = shared[r, Term.DRIVE] / (shared[r, Term.AERO] + shared[r, Term.STRUCTURAL])

        def parts(table: FloatArray, r: int = r, level: float = level) -> FloatArray:
            relaxation = table[:, r, Term.AERO] + table[:, r, Term.STRUCTURAL]
            return np.stack([relaxation, -table[:, r, Term.DRIVE] / level], axis=-1)

        fitted, slopes = fit.slopes(parts, 1e-3)
        values = (fitted - parts(shared[None])[0]) / layout.omega[r]
        looks = []
        words = ("relaxation (Y1, structural damping)", "drive over the stable amplitude (epsilon)")
        for what, value, slope in zip(words, values, np.ascontiguousarray(slopes.T), strict=True):
            sd = float(np.sqrt(slope @ fit.covariance @ slope)) / layout.omega[r]
            if _beyond(value / sd, 2 * len(data.first_in_wind)):
                looks.append(place(data, r, "test", value, sd, f"damping ratio of the test's own {what}", **whole))
        findings += sorted(looks, key=lambda look: -look.significance)[:1]
    return findings


def _beyond(z: float, count: int) -> bool:
    return bool(abs(z) > -ndtri(0.5 * thresholds.CONTRAST_FALSE / count))


def _with_one_each(null: FittedHypothesis, term: Term, size: Parameter) -> FittedHypothesis:
    """Fit one value of a coefficient for every record."""

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        add(table, term, values["size"])

    return null.with_variants(Variant("each", (size,), apply, Scope(Extent.EACH_RECORD, size.members)))


# Looks that are listed only where one of these effects is credible.
CONTRASTS = {
    still_air_findings: ("structural_damping_error",),
    between_tests: ("reduced_velocity_drift", "setting_dependence"),
    drift_findings: ("wind_speed_drift",),
    gain_findings: ("sensor_gain_error",),
}
