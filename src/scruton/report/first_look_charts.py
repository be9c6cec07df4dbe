"""What look.js draws on the first page: panels of lines, dots and areas, as JSON; no drawing is made before."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from scruton.arrays import FloatArray, thin
from scruton.campaign import Record, load_campaign
from scruton.dynamics.first_look import Check
from scruton.envelope import Cycles
from scruton.report.conventions import DAMPING, SCRUTON, damping, damping_symbol, damping_words, shown_in
from scruton.report.document import Picture
from scruton.report.figures.style import extremes
from scruton.report.wording import PAGE, listed, share

_BINS = 500  # stretches of a response: as many as a page has columns to tell apart
_APART = 150  # cycles that a page can show one by one
_SAMPLES = 4000  # of them, at most
_CYCLES = 500  # amplitudes drawn
Series = Mapping[str, Any]


_numbers = partial(listed, digits=5)  # no longer than a drawing can show


def _line(x: FloatArray, y: FloatArray, label: str, mark: str = "line", tone: int = 0) -> Series:
    pick = thin(len(x), _CYCLES)
    return {"mark": mark, "label": label, "tone": tone, "x": _numbers(x[pick]), "y": _numbers(y[pick])}


def _area(x: FloatArray, low: FloatArray, high: FloatArray, label: str) -> Series:
    return {"mark": "area", "label": label, "x": _numbers(x), "low": _numbers(low), "high": _numbers(high)}


def _panel(x: str, y: str, series: Sequence[Series], **more: Any) -> dict[str, Any]:
    """A panel: labels of its axes, and what stands in it; `more` may set `height`, `log` (of x) and bounds."""
    return {"x": x, "y": y, "series": series, **more}


def record_pictures(found: Check) -> Iterator[Picture]:
    """Every record that can be used, all of its file, with the window that was read and its cycles."""
    factor, unit = shown_in(found.campaign.section.amplitude_unit)
    # a record that is unusable beyond its window is shown within it
    whole = {one.field: one for one, _, _ in load_campaign(found.campaign.path, [], whole=True).records()}
    fronts = {row.record: row.front for row in found.identified}
    for number, (record, rig, test) in enumerate(found.inspection.records()):
        cycles, entire = found.inspection.cycles[record.name], whole.get(record.field, record)
        turns = int((entire.time[-1] - entire.time[0]) * cycles.reference_frequency)
        series = [] if record.is_envelope else [_response(entire, turns, factor)]
        series.append(_line(cycles.time, factor * cycles.amplitude, "amplitude of a cycle", "dots"))
        if (front := fronts.get(record.name)) is not None:
            series.append(_line(front.time, factor * front.smooth_amplitude, "line followed: Eq. (4)", tone=1))
        if test is not None and test.stable_amplitude is not None:
            level = factor * np.full(2, test.stable_amplitude.mean)
            series.append(_line(entire.time[[0, -1]], level, "stable amplitude, as stated", "dashes", 2))
        of = f"rig {rig.name}, still air" if test is None else f"test {test.name}"
        words = record.kind.value.replace("-", " ")
        yield Picture(
            f"record-{number}",
            f"{record.name}: {of}, {words}; {len(cycles.time)} cycles at "
            f"{PAGE.number(cycles.reference_frequency, 5)} Hz.",
            f"{record.name}, {words} of {of}: amplitudes of {len(cycles.time)} cycles, "
            f"{PAGE.range([factor * float(cycles.amplitude[end]) for end in (0, -1)], 3)} {unit}.",
            chart={
                "panels": [
                    _panel("", _of(unit, "response"), series, height=250),
                    _panel("time [s], as in the file", "frequency [Hz]", [_frequency(cycles)], height=130),
                ],
                "window": _window(record, entire),
            },
        )


def _of(unit: str, word: str) -> str:
    return f"{word} {'y/D [-]' if unit == 'A/D' and word == 'response' else f'[{unit}]'}"


def _response(record: Record, cycles: int, factor: float) -> Series:
    """Every sample where cycles can be told apart; else the band that they fill, a cycle or more to a stretch."""
    if cycles > _APART:
        time, low, high = extremes(record.time, record.response, min(cycles, _BINS))
        return _area(time, factor * low, factor * high, "response")
    pick = thin(len(record.time), _SAMPLES)
    x, y = _numbers(record.time[pick]), _numbers(factor * record.response[pick])
    return {"mark": "thin", "label": "response", "x": x, "y": y}


def _frequency(cycles: Cycles) -> Series:
    """Local frequency of the cycles whose phase is known to a tenth of it."""
    sure = cycles.frequency_error < 0.1 * cycles.frequency
    return _line(cycles.time[sure], cycles.frequency[sure], "frequency of a cycle", "dots")


def _window(record: Record, entire: Record) -> dict[str, Any]:
    """The part that was read, in the file's own time, and how far it may go."""
    low, high = float(entire.time[0]), float(entire.time[-1])
    step = (high - low) / (len(entire.time) - 1)
    return {
        "place": f"{record.field}, {record.name}", "min": low, "max": high, "start": float(record.time[0]),
        "stop": float(record.time[-1]), "decimals": max(0, int(np.ceil(-np.log10(step)))),
    }  # fmt: skip


def ring_down_pictures(found: Check) -> list[Picture]:
    """Damping ratio against amplitude of every rig with ring-downs."""
    factor, unit = shown_in(found.campaign.section.amplitude_unit)
    pictures = []
    for number, (name, ring) in enumerate(found.inspection.ringdowns.items()):
        per, sign = shown_in(DAMPING)
        label = f"{damping_symbol()} [{sign or '-'}]"
        x, xi = factor * ring.curve_amplitude, per * ring.curve_damping_ratio
        spread = 1.645 * per * ring.curve_sd
        series = [_area(x, xi - spread, xi + spread, "smooth, 90 %"), _line(x, xi, "smooth", tone=0)]
        if ring.bands:
            centre, ratio = np.array([((b.lower * b.upper) ** 0.5, per * b.damping_ratio) for b in ring.bands]).T
            series.append(_line(factor * centre[::-1], ratio[::-1], "by octave", "dots"))
        given = found.campaign.rig(name).damping_ratio
        if given is not None:
            series.append(_line(x[[0, -1]], np.full(2, per * given.mean), "as stated", "dashes", 2))
        middle, change = ring.damping_ratio, ring.curve_damping_ratio
        pictures.append(
            Picture(
                f"ring-down-{number}",
                f"Rig {name}: f₀ = {PAGE.number(ring.frequency, 5)} Hz, {damping_symbol()} = {damping(middle)} as one "
                f"constant; by amplitude it goes over {share((change.max() - change.min()) / middle)} of that.",
                f"Rig {name}: {damping_words()} from {damping(change.min())} to {damping(change.max())} over the "
                "amplitudes of its ring-downs.",
                chart={"panels": [_panel(_of(unit, "amplitude"), label, series, height=260, log=True)]},
            )
        )
    return pictures


def griffin_pictures(found: Check) -> list[Picture]:
    """The Griffin curve that Eqs. (5) to (8) construct from each transient, and the stable amplitudes."""
    rows = found.identified
    if not rows:
        return []
    factor, unit = shown_in(found.campaign.section.amplitude_unit)
    series, times = [], shown_in(SCRUTON)[0]
    for tone, row in enumerate(rows):
        sc, amplitude = times * row.front.griffin.scruton_number, factor * row.front.griffin.amplitude
        shown = np.isfinite(sc) & (amplitude > 0.0)
        series.append(_line(sc[shown], amplitude[shown], row.record, tone=tone))
    sc = times * np.array([row.scruton_number for row in rows])
    stable = factor * np.array([row.stable_amplitude for row in rows])
    series.append(_line(sc, stable, "stable amplitude at the test’s Sc", "dots"))
    return [
        Picture(
            "griffin",
            "Griffin plot of the quick estimation: the curve that each transient draws by Eqs. (5) to (8), without any "
            "uncertainty, and the stable amplitude of its test.",
            f"Griffin curves of {len(rows)} transients over Scruton numbers up to {PAGE.number(1.4 * sc.max(), 3)}.",
            chart={
                "panels": [
                    _panel("Scruton number", _of(unit, "stable amplitude"), series, height=360,
                           bounds=[0.0, float(1.4 * sc.max()), 0.0, float(1.4 * stable.max())])
                ]
            },
        )
    ]  # fmt: skip
