"""Places in single records: scatter that is no white noise, lines, bent waves; drifts, gains and tests that differ."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.stats import norm

from scruton.campaign.schema import FloatArray
from scruton.effects.terms import Parameter, Term, Values, Variant, add, size_prior
from scruton.effects.terms import Layout as _Layout
from scruton.gap.bare import TOLERANCES
from scruton.gap.check import Line
from scruton.gap.data import GapData
from scruton.gap.finding import Z90, Finding, amplitudes_of, interval, names_of, time_of
from scruton.gap.hypothesis import Evidence

LINE_NATS = 30.0  # over chance
_FALSE = 0.03  # probability that any record of a campaign without a gap shows one kind of scatter
_FEWEST = 24  # cycles
_QUARTERS = 4
_HIGH = 0.8  # of a record's largest amplitude: where its wave would be bent


def scatter_findings(fit: Evidence) -> list[Finding]:
    """Innovations that are coloured, come in bursts, are modulated or have heavy tails, record by record.

    Parameters
    ----------
    fit : Evidence
        With excess curves of damping: what a curve explains is no scatter.
    """
    data = fit.hypothesis.bare.data
    size = data.channels.size
    v, s = fit.hypothesis.innovations(fit.mode[None])
    z = (v / np.sqrt(s))[0, :size]
    root = np.sqrt(s[0, :size])
    found: list[Finding] = []
    for r in range(len(data.layout.records)):
        cycles = np.flatnonzero(data.channels.record == r)[1:]
        if cycles.size < _FEWEST:
            continue
        x = z[cycles]
        critical = float(norm.isf(_FALSE / len(data.layout.records)))
        level = float(np.median(root[cycles] / np.maximum(data.channels.amplitude[cycles], 1e-12)))
        for one in (_colour(x), _bursts(x), _tails(x), _modulation(x, level, data, cycles)):
            value, sd, significance, quantity, detail, span = one
            if significance > critical:
                rig, test, record = names_of(data, r)
                amplitude = amplitudes_of(data, np.arange(len(data.layout.records)) == r)
                time = data.cycles[record].time
                whole = time_of(data, r) if span is None else (float(time[1:][span][0]), float(time[1:][span][-1]))
                found.append(
                    Finding(quantity, rig, test, record, amplitude, whole, value, interval(value, sd), significance, detail)
                )  # fmt: skip
    return found


_Mark = tuple[float, float, float, str, str, slice | None]


def _colour(x: FloatArray) -> _Mark:
    x = x - x.mean()
    rho = float(x[1:] @ x[:-1] / (x @ x))
    sd = 1.0 / np.sqrt(x.size)
    return rho, float(sd), abs(rho) / sd, "scatter", "correlation of innovations one cycle apart", None


def _bursts(x: FloatArray) -> _Mark:
    """The quarter whose variance is farthest from that of the others."""
    edges = np.linspace(0, x.size, _QUARTERS + 1).astype(int)
    best: _Mark = (0.0, 1.0, 0.0, "scatter", "", None)
    tails = max(1.0, float(np.mean(x**4) / np.mean(x**2) ** 2) / 3.0)
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside, outside = x[low:high], np.r_[x[:low], x[high:]]
        ratio = float(np.mean(inside**2) / np.mean(outside**2))
        sd = float(np.sqrt(2.0 * tails * (1.0 / inside.size + 1.0 / outside.size)))
        # the logarithm of a variance ratio is close to normal; the farthest of four costs half a standard error
        mark = max(0.0, abs(np.log(ratio)) / sd - 0.5)
        if mark > best[2]:
            text = f"variance of the innovations in quarter {int(low * _QUARTERS / x.size + 0.5) + 1} over the others'"
            best = (ratio - 1.0, ratio * sd, mark, "scatter", text + ", minus 1", slice(int(low), int(high)))
    return best


def _tails(x: FloatArray) -> _Mark:
    n = x.size
    excess = float(np.mean(np.minimum(np.abs(x - x.mean()), 20.0) ** 4) / np.var(x) ** 2 - 3.0)
    sd = float(np.sqrt(24.0 / n))
    # heavy-tailed itself: 0.6, as in the absolute check
    return excess, sd, max(0.0, 0.6 * excess / sd), "scatter", "excess kurtosis of the innovations", None


def _modulation(x: FloatArray, level: float, data: GapData, cycles: np.ndarray) -> _Mark:
    """A period in the innovations, between the slowest four in a record and one of four cycles."""
    n = x.size
    power = np.abs(np.fft.rfft(x - x.mean())) ** 2 / (n * np.var(x))
    use = np.arange(power.size)
    use = use[(use >= 4) & (use <= n // 4)]
    if use.size < 4:
        return 0.0, 1.0, 0.0, "spectrum", "", None
    peak = int(use[np.argmax(power[use])])
    chance = min(1.0, float(use.size * np.exp(-power[peak])))
    period = float(data.channels.period[cycles[0]])
    size = 2.0 * float(np.sqrt(power[peak] / n)) * level * float(np.median(data.channels.amplitude[cycles]))
    text = f"beating: innovations rise and fall at {peak / n / period:.4g} Hz"
    significance = float(norm.isf(max(0.5 * chance, 1e-300)))
    return size, size / np.sqrt(2.0 * power[peak]), significance, "spectrum", text, None


def line_findings(lines: Sequence[Line], data: GapData) -> list[Finding]:
    """Lines beside the response."""
    found = []
    for line in lines:
        if line.ratio < LINE_NATS:
            continue
        r = data.layout.records.index(line.record)
        rig, test, record = names_of(data, r)
        sd = line.amplitude / np.sqrt(2.0 * line.ratio)
        found.append(
            Finding(
                "spectrum", rig, test, record, amplitudes_of(data, np.arange(len(data.layout.records)) == r),
                time_of(data, r), line.amplitude, interval(line.amplitude, sd), float(np.sqrt(2.0 * line.ratio)),
                f"a second line at {line.frequency:.4g} Hz",
            )
        )  # fmt: skip
    return found


def wave_findings(data: GapData) -> list[Finding]:
    """Third harmonics in phase at the largest amplitudes, beyond those at small ones: flat tops of a reading."""
    channels, found = data.channels, []
    count = len(data.layout.records)
    critical = float(norm.isf(0.5 * _FALSE / count))
    for r in range(count):
        mine = channels.record == r
        a, third, error = channels.amplitude[mine], channels.third[mine], channels.third_error[mine]
        high = a > _HIGH * a.max()
        if np.count_nonzero(high) < 2 or not np.all(error < 1e5):
            continue
        ratio, se = third[high] / a[high], error[high] / a[high]
        weight = 1.0 / se**2
        value = float(np.sum(weight * ratio) / np.sum(weight))
        scatter = max(1.0, float(np.sum(weight * (ratio - value) ** 2)) / max(ratio.size - 1, 1))
        sd = float(np.hypot(np.sqrt(scatter / np.sum(weight)), TOLERANCES["third"]))
        if abs(value) / sd < max(critical, 4.0):
            continue
        rig, test, record = names_of(data, r)
        span = (float(a[high].min()), float(a.max()))
        what = "flat tops" if value < 0.0 else "peaked tops"
        found.append(
            Finding(
                "signal", rig, test, record, span, time_of(data, r, span), value, interval(value, sd), abs(value) / sd,
                f"{what}: third harmonic in phase, over the amplitude",
            )
        )  # fmt: skip
    return found


def still_air_findings(bare: Evidence) -> list[Finding]:
    """Rigs whose damping is not what is stated, as the records tell it without that statement."""
    data = bare.hypothesis.bare.data
    value, sd = bare.value("damping")
    found = []
    for i, (m, s) in enumerate(zip(value, sd, strict=True)):
        mine = data.layout.rig == i
        stated = data.damping[i] if i < data.damping.size else np.nan
        if not np.isfinite(stated) or not np.any(mine & ~data.layout.wind):
            continue
        prior = float(data.damping_sd[i])
        share = 1.0 - (s / prior) ** 2
        if share < 0.1:
            continue
        told, variance = m / share, s**2 / share + prior**2
        z = abs(told) / np.sqrt(variance)
        if z > norm.isf(0.5 * _FALSE / value.size):
            excess = float(stated * told)
            found.append(
                Finding(
                    "damping", data.rigs[i], None, None, amplitudes_of(data, mine & ~data.layout.wind), None, excess,
                    interval(excess, float(stated * np.sqrt(variance))), float(z), "damping ratio, over the stated one",
                )
            )  # fmt: skip
    return found


def drift_findings(bare: Evidence) -> list[Finding]:
    """Damping that changes while a record runs: a wind that rises or falls, told record by record."""
    data = bare.hypothesis.bare.data
    layout = data.layout

    def apply(table: FloatArray, values: Values, layout: _Layout) -> None:
        del layout
        add(table, Term.TREND, values["size"])

    parameter = size_prior("size", layout.each(layout.wind))
    fit, value, sd = _each(bare, parameter, apply)
    table = fit.hypothesis.table(fit.mode[None])[0]
    # the slope of the damping at the stable amplitude, in the relative change of the wind
    slope = -(table[:, Term.AERO] + 2.0 * table[:, Term.STRUCTURAL]) / layout.omega
    found = []
    for j, r in enumerate(np.flatnonzero(layout.wind)):
        if not _beyond(value[j] / sd[j], value.size):
            continue
        rig, test, record = names_of(data, int(r))
        low, high = sorted((value[j] - Z90 * sd[j], value[j] + Z90 * sd[j]), key=lambda x: slope[r] * x)
        found.append(
            Finding(
                "damping", rig, test, record, amplitudes_of(data, np.arange(len(layout.records)) == r),
                time_of(data, int(r)), float(slope[r] * value[j]), (float(slope[r] * low), float(slope[r] * high)),
                float(abs(value[j]) / sd[j]), f"damping ratio, end of the record over its start: wind {value[j]:+.1%}",
            )
        )  # fmt: skip
    return found


def gain_findings(bare: Evidence) -> list[Finding]:
    """Records whose reading is larger or smaller than that of their fellows by a factor."""
    data = bare.hypothesis.bare.data
    layout = data.layout
    records = np.flatnonzero(layout.wind)
    if records.size < 3:
        return []

    def apply(table: FloatArray, values: Values, layout: _Layout) -> None:
        del layout
        add(table, Term.GAIN, values["size"])

    parameter = size_prior("size", layout.each(layout.wind), scale=0.2)
    fit, value, _ = _each(bare, parameter, apply)
    where = fit.hypothesis.places[_size(fit, parameter)]
    contrast = np.eye(records.size) - 1.0 / records.size
    sd = np.sqrt(np.diag(contrast @ fit.covariance[where, where] @ contrast.T))
    value = value - np.median(value)
    found = []
    for j, r in enumerate(records):
        if not _beyond(value[j] / sd[j], value.size):
            continue
        rig, test, record = names_of(data, int(r))
        found.append(
            Finding(
                "signal", rig, test, record, amplitudes_of(data, np.arange(len(layout.records)) == r),
                time_of(data, int(r)), float(value[j]), interval(value[j], sd[j]), float(abs(value[j]) / sd[j]),
                "gain over that of its fellows, minus 1",
            )
        )  # fmt: skip
    return found


def test_findings(bare: Evidence) -> list[Finding]:
    """Tests whose aerodynamic damping or drive is not that of the shared (Y1, epsilon)."""
    data = bare.hypothesis.bare.data
    layout = data.layout
    numbers = np.unique(layout.test[layout.wind])
    if numbers.size < 2:
        return []
    members = layout.by_test()

    def apply(table: FloatArray, values: Values, layout: _Layout) -> None:
        del layout
        table[:, :, Term.AERO] *= np.exp(values["size"])
        table[:, :, Term.DRIVE] *= np.exp(values["size"] + values["drive"])

    parameters = (size_prior("size", members), size_prior("drive", members))
    variant = Variant("tests", parameters, apply, layout.wind)
    hypothesis = bare.hypothesis.extended(variant)
    fit = hypothesis.fit(hypothesis.start_from(bare.mode, {}))
    step = 1e-3 * np.sqrt(np.diag(fit.covariance))
    wide = hypothesis.table(np.concatenate([fit.mode[None], fit.mode + np.diag(step), fit.mode - np.diag(step)]))
    alone = bare.hypothesis.table(bare.mode[None])[0]
    found = []
    for number in numbers:
        mine = layout.test == number
        r = int(np.flatnonzero(mine)[0])
        level = alone[r, Term.DRIVE] / (alone[r, Term.AERO] + alone[r, Term.STRUCTURAL])
        best: Finding | None = None
        for what, sums in (
            ("relaxation (Y1, structural damping)", wide[:, r, Term.AERO] + wide[:, r, Term.STRUCTURAL]),
            ("drive over the stable amplitude (epsilon)", -wide[:, r, Term.DRIVE] / level),
        ):
            then = alone[r, Term.AERO] + alone[r, Term.STRUCTURAL]
            then = then if what.startswith("relaxation") else -alone[r, Term.DRIVE] / level
            rows = (sums[1 : step.size + 1] - sums[step.size + 1 :]) / (2.0 * step)
            value = float(sums[0] - then) / layout.omega[r]
            sd = float(np.sqrt(rows @ fit.covariance @ rows)) / layout.omega[r]
            rig, test, _ = names_of(data, r)
            z = abs(value) / sd
            if _beyond(z, 2 * numbers.size) and (best is None or z > best.significance):
                best = Finding(
                    "test", rig, test, None, amplitudes_of(data, mine), None, value, interval(value, sd), z,
                    f"damping ratio of the test's own {what}",
                )  # fmt: skip
        found += [best] if best else []
    return found


test_findings.__test__ = False  # type: ignore[attr-defined]


def _beyond(z: float, count: int) -> bool:
    return bool(abs(z) > norm.isf(0.5 * _FALSE / count))


def _size(fit: Evidence, parameter: Parameter) -> str:
    return f"{len(fit.hypothesis.variants) - 1}:{parameter.name}"


def _each(
    bare: Evidence, parameter: Parameter, apply: Callable[[FloatArray, Values, _Layout], None]
) -> tuple[Evidence, FloatArray, FloatArray]:
    """Fit one value for every record; its values and their standard errors."""
    hypothesis = bare.hypothesis.extended(Variant("each", (parameter,), apply, parameter.members >= 0))
    fit = hypothesis.fit(hypothesis.start_from(bare.mode, {}))
    return fit, *fit.value(_size(fit, parameter))


def merged(findings: Sequence[Finding]) -> Iterator[Finding]:
    """One finding in place of those of the same kind in several records of a test, the strongest of them."""
    kinds: dict[tuple[object, ...], list[Finding]] = {}
    for one in findings:
        text = one.detail.split(":")[0].split(" at ")[0].split(" in quarter")[0]
        kinds.setdefault((one.quantity, one.rig, one.test, text, one.excess > 0.0), []).append(one)
    for several in kinds.values():
        yield max(several, key=lambda one: one.significance)
