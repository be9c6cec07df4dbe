"""Places in single records: scatter that is no white noise, lines and beats in the spectrum, bent waves."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.gap.bare import TOLERANCES
from scruton.gap.check import SecondLine
from scruton.gap.data import GapData
from scruton.gap.finding import Finding, amplitudes_of, interval, names_of, time_of
from scruton.gap.hypothesis import Weighed

LINE_NATS = 30.0  # over chance
_FALSE = 0.03  # probability that any record of a campaign without a gap shows one kind of scatter
_FEWEST = 24  # cycles
_QUARTERS = 4
_TAKEN = 2
_HIGH = 0.8  # of a record's largest amplitude: where its wave would be bent


def scatter_findings(fit: Weighed) -> list[Finding]:
    """Innovations that are coloured, come in bursts, are modulated or have heavy tails, by record in wind.

    Parameters
    ----------
    fit : Weighed
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
        # in still air the innovations are those of the demodulation, whose errors are bounds
        if cycles.size < _FEWEST or not data.layout.wind[r]:
            continue
        x = z[cycles]
        critical = float(norm.isf(_FALSE / max(int(np.count_nonzero(data.layout.wind)), 1)))
        level = float(np.median(root[cycles] / np.maximum(data.channels.amplitude[cycles], 1e-12)))
        for one in (_colour(x), _bursts(x), _tails(x), _modulation(x, level, data, cycles)):
            value, sd, significance, quantity, detail, span = one
            if significance > critical:
                rig, test, record = names_of(data, r)
                amplitude = amplitudes_of(data, np.arange(len(data.layout.records)) == r)
                time = data.cycles[record].time
                whole = time_of(data, r) if span is None else (float(time[1:][span][0]), float(time[1:][span][-1]))
                found.append(
                    Finding(
                        quantity, rig, test, record, amplitude, whole, value, interval(value, sd), significance, detail
                    )
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
    # heavy tails leave fewer values that count
    worth = 1.0 / max(1.0, float(np.mean(x**4) / np.mean(x**2) ** 2) / 3.0)
    for quarter, (low, high) in enumerate(pairwise(edges), 1):
        inside, outside = x[low:high], np.r_[x[:low], x[high:]]
        ratio = float(np.mean(inside**2) / np.mean(outside**2))
        # a curve of damping takes some of a quarter's freedom
        freedom = (worth * max(inside.size - _TAKEN, 2), worth * max(outside.size - _TAKEN, 2))
        chance = 2.0 * _QUARTERS * min(f_distribution.sf(ratio, *freedom), f_distribution.cdf(ratio, *freedom))
        mark = float(norm.isf(min(max(0.5 * chance, 1e-300), 0.5)))
        if mark > best[2]:
            sd = ratio * float(np.sqrt(2.0 / freedom[0] + 2.0 / freedom[1]))
            text = f"variance of the innovations in quarter {quarter} over the others', minus 1"
            best = (ratio - 1.0, sd, mark, "scatter", text, slice(int(low), int(high)))
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


def line_findings(lines: Sequence[SecondLine], data: GapData) -> list[Finding]:
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
        # a plain mean: errors grow with the harmonic itself, so that weights would choose the cycles without it
        value = float(np.mean(ratio))
        sd = float(np.hypot(np.sqrt(np.mean(se**2) / se.size), TOLERANCES["third"]))
        if abs(value) / sd < critical:
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
