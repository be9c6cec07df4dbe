"""The gap at a glance: excess damping of every test and rig, frequency against amplitude, and what explains it."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.gap.diagnosis import NONE, UNKNOWN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.locate_curves import DECAY, GROWTH, STEADY, STILL, Curve, Curves, excess_curves
from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import GAP_BARS, GAP_ROWS, PROBABILITY_SHOWN, SMALL_EXCESS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

    from scruton.gap.data import GapData

_ROW_HEIGHT, _ONE_ROW_HEIGHT = 31.0, 46.0  # mm; a single row holds the whole of the label at its side
_NARROW_TITLE = 40  # letters that fit above one of two panels side by side
_HEADLINE = 72  # letters of the headline that fit on a line
_PENS: dict[str, dict[str, Any]] = {
    GROWTH: {"color": style.BLUE, "ls": "-"},
    DECAY: {"color": style.VERMILLION, "ls": (0, (5, 2))},
    STEADY: {"color": style.PURPLE, "ls": ":"},
    STILL: {"color": style.GREEN, "ls": "-"},
}


@figure(
    "gap",
    name="gap",
    what="The figure of the gap",
    source="",
    caption="Where the bare model and the records part. Above: damping ratio, measured minus bare model, against "
    "amplitude for every test and, beside it, its rig in still air, with 90 % bands; shaded where it differs. Below: "
    "change of frequency with amplitude, and the probability of each cause.",
)
def gap_figure(
    diagnosis: Diagnosis, findings: Sequence[Finding], curves: Curves | None = None, *, alt: str = ""
) -> FigureWithCaption:
    """Draw where the bare model and the measurement part, and what explains it.

    One row for every test with its rig's still air beside it, and at the bottom frequency against amplitude and the
    probabilities.

    Parameters
    ----------
    diagnosis : Diagnosis
    findings : sequence of Finding
        Rigs and tests in which effects of the verdict act are marked.
    curves : Curves, optional
        `excess_curves(diagnosis.null)`, where they are there already.
    alt : str
        The verdict in a sentence.
    """
    curves = curves or excess_curves(diagnosis.null)
    data = diagnosis.data
    rows = _rows(data, curves)
    high = 8.0 + (_ROW_HEIGHT * len(rows) if len(rows) > 1 else _ONE_ROW_HEIGHT)
    drawing = style.new_figure(12.0 + high + 52.0)
    parts: Any = drawing.subfigures(2, 1, height_ratios=[high, 52.0])
    top, bottom = parts
    upper = _upper(top, curves, data, rows, findings)
    left, right = bottom.subplots(1, 2)
    _frequency(left, curves.frequency, data)
    _probability(right, diagnosis)
    handles = style.legend_handles(upper)
    order = sorted(handles, key=lambda label: label.startswith("differs"))
    drawing.legend([handles[label] for label in order], order, loc="outside lower center", ncols=2)
    drawing.suptitle(_headline(diagnosis), x=0.01, ha="left", weight="bold")
    return FigureWithCaption(drawing, alt=alt)


def _upper(
    part: "SubFigure", curves: Curves, data: "GapData", rows: Sequence[tuple[int, int]], findings: Sequence[Finding]
) -> "list[Axes]":
    """Rows of excess damping, in wind on the left and in still air on the right."""
    pairs = [
        _pair(curves, data, rig, test, first=all(r != rig for r, _ in rows[:i])) for i, (rig, test) in enumerate(rows)
    ]
    columns = [c for c in (0, 1) if any(pair[c] for pair in pairs)]
    axes = part.subplots(len(rows), len(columns), sharex=True, squeeze=False)
    drawn = []
    least = 100.0 * SMALL_EXCESS * data.layout.reference_rate / data.layout.reference_omega
    for i, ((rig, test), pair) in enumerate(zip(rows, pairs, strict=True)):
        for j, column in enumerate(columns):
            one = axes[i, j]
            if not pair[column]:
                one.set_axis_off()
                continue
            _damping(one, pair[column], least)
            name = data.rigs[rig]
            title = f"{style.shorten(name, 26)}, still air"
            if not column:
                title = f"{style.shorten(name, 20)}, {style.shorten(data.tests[test], 20)}"
            title += _marks(findings, name, None if column else data.tests[test])
            narrow = len(columns) > 1 and len(title) > _NARROW_TITLE
            one.set_title(":\n".join(title.rsplit(": ", 1)) if narrow else title)
            drawn.append(one)
    drawn[0].set_xscale("log")
    for j in range(len(columns)):
        style.plain_log(axes[-1, j].xaxis)
        axes[-1, j].set_xlabel(_amplitude(data))
    part.supylabel("Excess damping ratio:\nmeasured minus bare model [%]", fontsize=8.0, multialignment="center")
    return drawn


def _headline(diagnosis: Diagnosis) -> str:
    names = [_words(name) for name in diagnosis.found]
    if not names:
        return "No gap: the bare model and the records agree within their noise"
    p = diagnosis.probability[diagnosis.verdict]
    said = f"{' and '.join(names).capitalize()} (p {'> 0.99' if p > 0.99 else f'= {p:.2f}'})"
    return textwrap.fill(said, _HEADLINE)


def _words(name: str) -> str:
    return {NONE: "no gap", UNKNOWN: "not in the catalogue"}.get(name, name.replace("_", " "))


def _rows(data: "GapData", curves: Curves) -> list[tuple[int, int]]:
    """Rig and test (-1: none in wind) of every row."""
    layout = data.layout
    known: list[tuple[int, int]] = []
    for c in curves.damping:
        if layout.wind[c.record]:
            known.append((int(layout.rig[c.record]), int(layout.test[c.record])))
    in_wind = {rig for rig, _ in known}
    known += [(int(r), -1) for r in layout.rig[[c.record for c in curves.damping]] if int(r) not in in_wind]
    known = sorted(set(known))
    if len(known) <= GAP_ROWS:
        return known

    def far(row: tuple[int, int]) -> float:
        mine = [c for c in curves.damping if (int(layout.rig[c.record]), int(layout.test[c.record])) == row]
        return max((float(np.max(np.abs(c.excess) / c.sd)) for c in mine), default=0.0)

    return sorted(sorted(known, key=far, reverse=True)[:GAP_ROWS])


def _pair(curves: Curves, data: "GapData", rig: int, test: int, *, first: bool) -> tuple[list[Curve], list[Curve]]:
    """Curves in wind and in still air; the latter stand beside the first test of their rig."""
    layout = data.layout
    wind = [c for c in curves.damping if test >= 0 and layout.test[c.record] == test]
    still = [c for c in curves.damping if first and not layout.wind[c.record] and layout.rig[c.record] == rig]
    return wind, still


def _damping(axes: "Axes", curves: Sequence[Curve], least: float) -> None:
    """Curves with their bands; the axis holds the curves, and as much of the bands as lets them be seen."""
    low, high = -least, least
    for curve in curves:
        pen = _PENS[curve.direction]
        colour = pen["color"]
        a, y, sd = curve.amplitude, 100.0 * curve.excess, 100.0 * curve.sd
        axes.fill_between(a, y - style.Z90 * sd, y + style.Z90 * sd, color=colour, alpha=0.22, lw=0)
        axes.plot(a, y, **pen, lw=1.1, label=f"{curve.direction}, with its 90 % band")
        for place in curve.places():
            label = "differs from the bare model"
            axes.axvspan(a[place][0], a[place][-1], color=style.YELLOW, alpha=0.28, lw=0, zorder=0, label=label)
            axes.plot(a[place], y[place], color=colour, lw=2.6, solid_capstyle="butt")
            low, high = min(low, float(y[place].min())), max(high, float(y[place].max()))
        certain = sd <= np.quantile(sd, 0.6)
        low = min(low, float((y - style.Z90 * sd)[certain].min()))
        high = max(high, float((y + style.Z90 * sd)[certain].max()))
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    margin = 0.12 * (high - low)
    axes.set_ylim(low - margin, high + margin)


def _marks(findings: Sequence[Finding], rig: str, test: str | None) -> str:
    """Effects of the verdict that act in a row, for its title."""
    found = [
        _words(one.effect)
        for one in findings
        if one.effect and one.rig == rig and (one.test == test or one.test is None)
    ]
    return f": {', '.join(dict.fromkeys(found))}" if found else ""


def _frequency(axes: "Axes", curves: Sequence[Curve], data: "GapData") -> None:
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    reach = 0.15
    for curve in curves:
        rig = int(data.layout.rig[curve.record])
        colour, still = style.line_style(rig).colour, curve.direction == STILL
        y, sd = 100.0 * curve.excess, 100.0 * curve.sd
        label = f"{style.shorten(data.rigs[rig], 16)}, {curve.direction}"
        far = bool(curve.places())
        if far:
            axes.fill_between(curve.amplitude, y - style.Z90 * sd, y + style.Z90 * sd, color=colour, alpha=0.2, lw=0)
        line = (0, (4, 2)) if still else "-"
        axes.plot(curve.amplitude, y, color=colour, ls=line, lw=2.2 if far else 0.9, label=label)
        reach = max(reach, float(np.abs(y).max()))
    axes.set_ylim(-1.15 * reach, 1.15 * reach)
    axes.set_xscale("log")
    style.plain_log(axes.xaxis)
    axes.set_xlabel(_amplitude(data))
    axes.set_ylabel("Change of frequency [%]")
    axes.set_title("Frequency against amplitude")
    if curves:
        axes.legend(fontsize=7.0, loc="best", ncols=1, handlelength=1.8, columnspacing=0.8, labelspacing=0.25)


def _probability(axes: "Axes", diagnosis: Diagnosis) -> None:
    ranked = sorted(diagnosis.probability.items(), key=lambda pair: -pair[1])[: GAP_BARS[1]]
    ranked = [pair for i, pair in enumerate(ranked) if i < GAP_BARS[0] or pair[1] >= PROBABILITY_SHOWN]
    first = diagnosis.verdict
    for i, (name, p) in enumerate(ranked):
        colour = style.VERMILLION if name == first else style.ORANGE if name in diagnosis.found else style.LIGHT
        axes.barh(i, p, color=colour, height=0.72)
        weight = "bold" if name == first else "normal"
        axes.text(max(p, 0.0) + 0.015 if p < 0.8 else p - 0.015, i, f"{p:.3f}", va="center", fontsize=7.0,
                  ha="left" if p < 0.8 else "right", weight=weight)  # fmt: skip
    axes.set_yticks(range(len(ranked)), [_words(name) for name, _ in ranked], fontsize=7.0)
    axes.set_ylim(len(ranked) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("Probability")
    axes.set_title("What explains it")


def _amplitude(data: "GapData") -> str:
    return style.amplitude_label(data.campaign.section.amplitude_unit)
