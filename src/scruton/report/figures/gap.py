"""The gap at a glance: excess damping of every test and rig, frequency against amplitude, and what explains it."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.gap.diagnosis import NONE, UNKNOWN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.locate_curves import DECAY, GROWTH, STEADY, STILL, Curve, Curves, excess_curves
from scruton.report.conventions import DAMPING, conventions, damping_label, shown_in
from scruton.report.figures import FigureWithCaption, figure, style
from scruton.report.thresholds import GAP_BARS, GAP_ROWS, PROBABILITY_SHOWN, SMALL_EXCESS
from scruton.report.verdict import conclusion, perhaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

    from scruton.gap.data import GapData

_ROW_HEIGHT, _ONE_ROW_HEIGHT = 31.0, 46.0  # mm; a single row holds the whole of the label at its side
_NARROW_TITLE = 40  # letters that fit above one of two panels side by side
_HEADLINE = 72  # letters of the headline that fit on a line
CAPTION = (
    "Where the null model and the records part. Above: damping ratio, measured minus null model, against amplitude for "
    "every test and, beside it, its rig in still air, with 90 % bands; shaded where it differs. Below: change of "
    "frequency with amplitude, and the probability of each cause; that of no gap is always among them."
)
Row = tuple[int, int, list[Curve], list[Curve]]
_PENS: dict[str, dict[str, Any]] = {
    GROWTH: {"color": style.BLUE, "ls": "-"},
    DECAY: {"color": style.VERMILLION, "ls": (0, (5, 2))},
    STEADY: {"color": style.PURPLE, "ls": ":"},
    STILL: {"color": style.GREEN, "ls": "-"},
}


@figure("gap", name="gap", what="The figure of the gap", source="")
def gap_figure(
    diagnosis: Diagnosis, findings: Sequence[Finding], curves: Curves | None = None, *, alt: str = ""
) -> FigureWithCaption:
    """Draw where the null model and the measurement part, and what explains it; `alt` is the verdict in a sentence.

    One row for every test with its rig's still air beside it, marked by the findings where effects of the verdict act,
    and at the bottom frequency against amplitude and the probabilities; `curves` are those of the null model.
    """
    curves, data = curves or excess_curves(diagnosis.null), diagnosis.data
    with conventions(data.campaign):
        return _laid_out(diagnosis, findings, curves, alt)


def _laid_out(diagnosis: Diagnosis, findings: Sequence[Finding], curves: Curves, alt: str) -> FigureWithCaption:
    data = diagnosis.data
    rows = _rows(data, curves)
    high = 8.0 + (_ROW_HEIGHT * len(rows) if len(rows) > 1 else _ONE_ROW_HEIGHT)
    drawing = style.new_figure(12.0 + high + 52.0)
    (top,), (bottom,) = drawing.subfigures(2, 1, squeeze=False, height_ratios=[high, 52.0])
    said = _said(diagnosis)
    upper = _upper(top, data, rows, findings, said)
    left, right = bottom.subplots(1, 2)
    _frequency(left, curves.frequency, data)
    _probability(right, diagnosis)
    handles = style.legend_handles(upper)
    order = sorted(handles, key=lambda label: label.startswith("differs"))
    drawing.legend([handles[label] for label in order], order, loc="outside lower center", ncols=2)
    headline = conclusion(said, _words)
    if headline == _words(NONE):
        headline = "No gap: the null model and the records agree within their noise"
    headline = textwrap.fill(headline[0].upper() + headline[1:], _HEADLINE)
    drawing.suptitle(headline, x=0.01, ha="left", weight="bold")
    return FigureWithCaption(
        drawing,
        caption=CAPTION,
        alt=alt,
    )


def _said(diagnosis: Diagnosis) -> dict[str, Any]:
    """What gap.json says of a verdict."""
    return {
        "verdict": diagnosis.verdict, "also": diagnosis.found[1:], "probability": diagnosis.probability,
        "probability_also": diagnosis.also,
    }  # fmt: skip


def _words(name: str) -> str:
    return {NONE: "no gap", UNKNOWN: "not in the catalogue"}.get(name, name.replace("_", " "))


def _scale(data: "GapData") -> float:
    """What amplitudes are multiplied by to be shown."""
    return shown_in(data.campaign.section.amplitude_unit)[0]


def _rows(data: "GapData", curves: Curves) -> list[Row]:
    """Rig, test (-1: none in wind) and curves in wind and in still air of every row, rigs' still air in their first."""
    layout = data.layout
    wind: dict[tuple[int, int], list[Curve]] = {}
    still: dict[int, list[Curve]] = {}
    for curve in curves.damping:
        rig, test = int(layout.rig[curve.record]), int(layout.test[curve.record])
        if layout.wind[curve.record]:
            wind.setdefault((rig, test), []).append(curve)
        else:
            still.setdefault(rig, []).append(curve)

    def far(row: tuple[int, int]) -> float:
        return max(float(np.max(np.abs(c.excess) / c.sd)) for c in wind.get(row) or still[row[0]])

    known = sorted([*wind, *((rig, -1) for rig in still if rig not in {r for r, _ in wind})])
    known = sorted(sorted(known, key=far, reverse=True)[:GAP_ROWS]) if len(known) > GAP_ROWS else known
    return [(rig, test, wind.get((rig, test), []), still.pop(rig, [])) for rig, test in known]


def _upper(
    part: "SubFigure", data: "GapData", rows: Sequence[Row], findings: Sequence[Finding], said: dict[str, Any]
) -> "list[Axes]":
    """Rows of excess damping, in wind on the left and in still air on the right."""
    columns = [c for c in (0, 1) if any(row[2 + c] for row in rows)]
    axes = part.subplots(len(rows), len(columns), sharex=True, squeeze=False)
    drawn = []
    least = shown_in(DAMPING)[0] * SMALL_EXCESS * data.layout.reference_rate / data.layout.reference_omega
    for across, (rig, test, *pair) in zip(axes, rows, strict=True):
        for panel, column in zip(across, columns, strict=True):
            if not pair[column]:
                panel.set_axis_off()
                continue
            _damping(panel, pair[column], least, _scale(data))
            name, of = data.rigs[rig], None if column else data.tests[test]
            where = "still air" if of is None else style.shorten(of, 20)
            title = f"{style.shorten(name, 26 if of is None else 20)}, {where}"
            acting = [
                perhaps(said, f.effect, _words) for f in findings if f.effect and f.rig == name and f.test in (of, None)
            ]
            if acting:
                title += f": {', '.join(dict.fromkeys(acting))}"
            room = _HEADLINE if len(columns) == 1 else _NARROW_TITLE
            head, _, names = title.rpartition(": ")
            panel.set_title(f"{head}:\n{textwrap.fill(names, room)}" if head and len(title) > room else title)
            drawn.append(panel)
    drawn[0].set_xscale("log")
    for panel in axes[-1]:
        style.plain_log(panel.xaxis)
        panel.set_xlabel(_amplitude(data))
    excess = damping_label("Excess damping ratio").replace(", ", ",\n")
    part.supylabel(f"{excess}:\nmeasured minus null model", fontsize=8.0, multialignment="center")
    return drawn


def _damping(axes: "Axes", curves: Sequence[Curve], least: float, scale: float) -> None:
    """Curves with their bands; the axis holds the curves, and as much of the bands as lets them be seen."""
    low, high = -least, least
    for curve in curves:
        pen, colour = _PENS[curve.direction], _PENS[curve.direction]["color"]
        per = shown_in(DAMPING)[0]
        a, y, sd = scale * curve.amplitude, per * curve.excess, per * curve.sd
        axes.fill_between(a, y - style.Z90 * sd, y + style.Z90 * sd, color=colour, alpha=0.22, lw=0)
        axes.plot(a, y, **pen, lw=1.1, label=f"{curve.direction}, with its 90 % band")
        for place in curve.places():
            label = "differs from the null model"
            axes.axvspan(a[place][0], a[place][-1], color=style.YELLOW, alpha=0.28, lw=0, zorder=0, label=label)
            axes.plot(a[place], y[place], color=colour, lw=2.6, solid_capstyle="butt")
            low, high = min(low, float(y[place].min())), max(high, float(y[place].max()))
        certain = sd <= np.quantile(sd, 0.6)
        low = min(low, float((y - style.Z90 * sd)[certain].min()))
        high = max(high, float((y + style.Z90 * sd)[certain].max()))
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    margin = 0.12 * (high - low)
    axes.set_ylim(low - margin, high + margin)


def _frequency(axes: "Axes", curves: Sequence[Curve], data: "GapData") -> None:
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    reach = 0.15
    for curve in curves:
        rig = int(data.layout.rig[curve.record])
        colour, line = style.line_style(rig).colour, (0, (4, 2)) if curve.direction == STILL else "-"
        a, y, sd, width = _scale(data) * curve.amplitude, 100.0 * curve.excess, 100.0 * curve.sd, 0.9
        label = style.shorten(data.rigs[rig], 16) + (f", {STILL}" if curve.direction == STILL else "")
        if curve.places():
            width = 2.2
            axes.fill_between(a, y - style.Z90 * sd, y + style.Z90 * sd, color=colour, alpha=0.2, lw=0)
        axes.plot(a, y, color=colour, ls=line, lw=width, label=label)
        reach = max(reach, float(np.abs(y).max()))
    columns = 2 if len(curves) <= 6 else 3
    room = min(0.5, 0.11 * -(-len(curves) // columns))  # of the panel, for the names above the curves
    axes.set(ylim=(-1.15 * reach, 1.15 * reach * (1.0 + room) / (1.0 - room)), xscale="log")
    style.plain_log(axes.xaxis)
    axes.set(xlabel=_amplitude(data), ylabel="Change of frequency [%]", title="Frequency against amplitude")
    if curves:
        axes.legend(
            fontsize=7.0, loc="upper left", ncols=columns, handlelength=1.8, columnspacing=0.8, labelspacing=0.25
        )


def _probability(axes: "Axes", diagnosis: Diagnosis) -> None:
    ranked = sorted(diagnosis.probability.items(), key=lambda pair: -pair[1])
    shown = [
        *ranked[: GAP_BARS[0]],
        *(pair for pair in ranked[GAP_BARS[0] : GAP_BARS[1]] if pair[1] >= PROBABILITY_SHOWN),
    ]
    ranked = [pair for pair in ranked if pair in shown or pair[0] == NONE]
    for i, (name, p) in enumerate(ranked):
        colour, weight = style.ORANGE if name in diagnosis.found else style.LIGHT, "normal"
        if name == diagnosis.verdict:
            colour, weight = style.VERMILLION, "bold"
        axes.barh(i, p, color=colour, height=0.72)
        axes.text(max(p, 0.0) + 0.015 if p < 0.8 else p - 0.015, i, f"{p:.3f}", va="center", fontsize=7.0,
                  ha="left" if p < 0.8 else "right", weight=weight)  # fmt: skip
    style.rows(axes, [_words(name) for name, _ in ranked], fontsize=7.0)
    axes.set(xlim=(0.0, 1.0), xlabel="Probability", title="What explains it")


def _amplitude(data: "GapData") -> str:
    return style.amplitude_label(data.campaign.section.amplitude_unit)
