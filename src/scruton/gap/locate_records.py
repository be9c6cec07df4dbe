"""Places in single records: scatter that is no white noise, lines and beats in the spectrum, bent waves."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.gap.check import SecondLine
from scruton.gap.data import GapData
from scruton.gap.finding import Finding, place, time_of
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import FEWEST_CYCLES_OF_SCATTER, HIGH_AMPLITUDE, KURTOSIS_SHARE, LINE_NATS, SCATTER_FALSE
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
    critical = float(norm.isf(SCATTER_FALSE / max(int(np.count_nonzero(data.layout.wind)), 1)))
    found: list[Finding] = []
    for r, name in enumerate(data.layout.records):
        cycles = np.flatnonzero(channels.record == r)[1:]
        # in still air the innovations are those of the demodulation, whose errors are bounds
        if cycles.size < FEWEST_CYCLES_OF_SCATTER or not data.layout.wind[r]:
            continue
        x = (v / np.sqrt(s))[cycles]
        amplitude = channels.amplitude[cycles]
        level = float(np.median(np.sqrt(s)[cycles] / np.maximum(amplitude, 1e-12))) * float(np.median(amplitude))
        time = data.cycles[name].time[1:]
        for mark in (_colour(x), _bursts(x), _tails(x), _modulation(x, level, float(channels.period[cycles[0]]))):
            if mark.significance > critical:
                fields = {"kind": mark.kind, "significance": mark.significance}
                if mark.cycles is not None:
                    fields["time"] = tuple(time[mark.cycles][[0, -1]].tolist())
                quantity = "spectrum" if mark.kind == "beating" else "scatter"
                found.append(place(data, r, quantity, mark.value, mark.sd, mark.detail, **fields))
    return found


def _colour(x: FloatArray) -> Mark:
    rho, sd = float(autocorrelation(x, 1)[0]), float(1.0 / np.sqrt(x.size))
    return Mark("colour", rho, sd, abs(rho) / sd, "correlation of innovations one cycle apart")


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
        chance = 2.0 * _QUARTERS * min(f_distribution.sf(ratio, *freedom), f_distribution.cdf(ratio, *freedom))
        significance = float(norm.isf(min(max(0.5 * chance, 1e-300), 0.5)))
        if significance > best.significance:
            sd = ratio * float(np.sqrt(2.0 / freedom[0] + 2.0 / freedom[1]))
            detail = f"variance of the innovations in quarter {quarter} over the others', minus 1"
            best = Mark("bursts", ratio - 1.0, sd, significance, detail, slice(int(low), int(high)))
    return best


def _tails(x: FloatArray) -> Mark:
    excess = float(np.mean(np.minimum(np.abs(x - x.mean()), 20.0) ** 4) / np.var(x) ** 2 - 3.0)
    sd = float(np.sqrt(24.0 / x.size))
    return Mark("tails", excess, sd, max(0.0, KURTOSIS_SHARE * excess / sd), "excess kurtosis of the innovations")


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
    significance = float(norm.isf(max(0.5 * chance, 1e-300)))
    return Mark("beating", size, size / np.sqrt(2.0 * power[peak]), significance, detail)


def line_findings(lines: Sequence[SecondLine], data: GapData) -> list[Finding]:
    """Lines beside the response."""
    return [
        place(data, data.layout.records.index(line.record), "spectrum", line.amplitude,
              line.amplitude / np.sqrt(2.0 * line.ratio), f"a second line at {line.frequency:.4g} Hz", kind="line")
        for line in lines
        if line.ratio >= LINE_NATS
    ]  # fmt: skip


def wave_findings(data: GapData) -> list[Finding]:
    """Third harmonics in phase at the largest amplitudes, beyond those at small ones: flat tops of a reading."""
    channels, found = data.channels, []
    count = len(data.layout.records)
    critical = float(norm.isf(0.5 * SCATTER_FALSE / count))
    for r in range(count):
        mine = channels.record == r
        a, third, error = channels.amplitude[mine], channels.third[mine], channels.third_error[mine]
        high = a > HIGH_AMPLITUDE * a.max()
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
        found.append(place(data, r, "signal", value, sd, what, **fields))
    return found
