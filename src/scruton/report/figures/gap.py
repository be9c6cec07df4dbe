"""The gap at a glance: excess damping of every test and rig, frequency against amplitude, and what explains it."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.gap.advise import confusions
from scruton.gap.diagnosis import NONE, UNKNOWN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.locate_curves import DECAY, GROWTH, STEADY, STILL, Curve, Curves, excess_curves
from scruton.gap.meaning import describe_unknown
from scruton.gap.sizes import largest_size
from scruton.report.conventions import (
    DAMPING,
    conventions,
    damping_label,
    damping_words,
    shown_excess,
    shown_in,
    shown_size,
)
from scruton.report.figures import FigureWithCaption, figure, style
from scruton.report.thresholds import GAP_BARS, GAP_ROWS, PROBABILITY_SHOWN, SMALL_EXCESS
from scruton.report.verdict import conclusion, perhaps
from scruton.report.wording import TERMINAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

    from scruton.gap.data import GapData

_ROW_HEIGHT, _ONE_ROW_HEIGHT = 33.0, 54.0  # mm; a single row holds the whole of the label at its side
_ROOM = 180.0  # mm, for all rows: a page holds the figure
_BELOW = 56.0  # mm, of what stands below the rows
_NARROW_TITLE = 40  # letters that fit above one of two panels side by side
_NAMED = 2  # records that are named above a panel
_HEADLINE = 72  # letters of the headline that fit on a line
_LINE = 104  # letters of the lines under it
_CAPTION = (
    "Where the null model and the records part. Above: damping ratio, measured minus null model, against amplitude for "
    "{every} and, beside it, its rig in still air, with 90 % bands; shaded, heavy where it differs. Below: change of "
    "frequency with amplitude, heavy where it differs from nothing, and the probability of each cause, that of no gap "
    "always among them; of what stands beside the verdict that in its own place. Under the title: how large what was "
    "found is, median and 90 % interval."
)
_LEFT_OUT_NAMED = 5
Row = tuple[int, int, list[Curve], list[Curve]]
_BESIDE = "#A6D8F5"  # of the bar of what stands beside the verdict: a lighter blue
_BAR_LABEL = 28  # letters of the name of a bar on a line
_HEAVY, _DASHED = "frequency, where it changes", "frequency in still air"
_DASHES = (0, (3, 1.5))
_DIFFERS = "differs from the null model"
_EXPLAINED = [*(f"{pen}, with its 90 % band" for pen in (GROWTH, DECAY, STEADY, STILL)), _DIFFERS, _HEAVY, _DASHED]
_PENS: dict[str, dict[str, Any]] = {
    GROWTH: {"color": style.BLUE, "ls": "-"},
    DECAY: {"color": style.VERMILLION, "ls": (0, (5, 2))},
    STEADY: {"color": style.PURPLE, "ls": ":"},
    STILL: {"color": style.GREEN, "ls": "-"},
}


@figure("gap", name="gap", what="The figure of the gap", source="")
def gap_figure(
    diagnosis: Diagnosis,
    findings: Sequence[Finding],
    curves: Curves | None = None,
    *,
    groups: Sequence[Sequence[str]] | None = None,
    alt: str = "",
) -> FigureWithCaption:
    """Draw where the null model and the measurement part, and what explains it; `alt` is the verdict in a sentence.

    `groups` are the effects that the records cannot tell apart, as `confusions` finds them where they are not given.
    One row for every test with its rig's still air beside it, marked by the findings where effects of the verdict act,
    and at the bottom frequency against amplitude and the probabilities; `curves` are those of the null model.
    """
    curves, data = curves or excess_curves(diagnosis.null), diagnosis.data
    with conventions(data.campaign):
        said = _said(diagnosis, confusions(diagnosis) if groups is None else groups)
        return _laid_out(diagnosis, findings, curves, said, alt)


def _laid_out(
    diagnosis: Diagnosis, findings: Sequence[Finding], curves: Curves, said: dict[str, Any], alt: str
) -> FigureWithCaption:
    data = diagnosis.data
    rows, left_out = _rows(data, curves)
    acting = _acting(diagnosis, findings, said)
    high = 12.0 + (min(_ROW_HEIGHT * len(rows), _ROOM) if len(rows) > 1 else _ONE_ROW_HEIGHT)
    drawing = style.new_figure(12.0 + high + _BELOW)
    (top,), (bottom,) = drawing.subfigures(2, 1, squeeze=False, height_ratios=[high, _BELOW])
    upper = _upper(top, data, rows, acting)
    left, right = bottom.subplots(1, 2)
    _frequency(left, curves.frequency, data)
    _probability(right, diagnosis)
    handles = style.legend_handles([*upper, left])
    order = sorted((label for label in handles if label in _EXPLAINED), key=_EXPLAINED.index)
    drawing.legend([handles[label] for label in order], order, loc="outside lower center", ncols=3)
    headline = conclusion(said, _words)
    if headline == _words(NONE):
        headline = "No gap: the null model and the records agree within their noise"
    headline = textwrap.fill(headline[0].upper() + headline[1:], _HEADLINE)
    drawing.suptitle(headline, x=0.01, ha="left", weight="bold")
    if below := [*_sizes(diagnosis, findings), *left_out]:
        lines = "\n".join(textwrap.fill(line, _LINE) for line in below)
        top.suptitle(lines, x=0.01, ha="left", fontsize=8.0, linespacing=1.3)
    every = "every test" if not left_out else f"{len(rows)} tests, {left_out[0][0].lower()}{left_out[0][1:]},"
    return FigureWithCaption(drawing, caption=gap_caption(every), alt=alt)


def gap_caption(every: str = "every test shown") -> str:
    """What stands under the figure; of one that was saved, which names itself what it leaves out, it says no more."""
    return _CAPTION.format(every=every)


def _sizes(diagnosis: Diagnosis, findings: Sequence[Finding]) -> list[str]:
    """How large every effect found is where it is largest, in a line: in what it is seen in; else a parameter of it."""
    parts = []
    for name in diagnosis.found:
        places = [f for f in findings if f.effect == name]
        largest = max(places, key=lambda f: abs(f.excess), default=None)
        ends: list[float | None]
        if largest is not None:
            factor, unit = shown_excess(largest.quantity, diagnosis.data.campaign.section.amplitude_unit)
            ends, count = [factor * end for end in (largest.excess, *largest.interval90)], len(places)
            what = largest.detail.partition(": ")[2].replace("damping ratio", damping_words()).partition("; also ")[0]
            whose = largest.record or largest.test or largest.rig
        elif (size := largest_size(diagnosis, name)) is not None:
            *ends, unit = shown_size(size[0])
            whose, count = "" if size[0]["of"].startswith("every") else size[0]["of"], size[1]
            what = size[0]["form"]
        else:
            continue
        value, interval = TERMINAL.interval(*ends)
        written = f"{value} ({interval.replace(TERMINAL.between, ' to ')}) {unit}".replace("-", "\N{MINUS SIGN}")
        where = f"in {whose}{f', the largest of {count}' if count > 1 else ''}" if whose else ""
        parts.append(", ".join(filter(None, [f"{_words(name)} {written}", what, where])))
    return [f"Size (90 % interval): {'; '.join(parts)}"] if parts else []


def _acting(
    diagnosis: Diagnosis, findings: Sequence[Finding], said: dict[str, Any]
) -> dict[tuple[str, str | None], list[str]]:
    """What acts in a rig and test (None: in still air), in words: effects, and an unknown cause with its records."""
    data, layout = diagnosis.data, diagnosis.data.layout
    acting: dict[tuple[str, str | None], list[str]] = {}
    tests = {rig: {data.tests[j] for j in layout.test[layout.rig == i] if j >= 0} for i, rig in enumerate(data.rigs)}
    for f in findings:
        if f.effect and f.rig is not None:
            for test in [None, *tests[f.rig]] if f.test is None else [f.test]:
                acting.setdefault((f.rig, test), []).append(perhaps(said, f.effect, _words))
    records = set(describe_unknown(diagnosis, ()).get("records", ()))
    if records == set(layout.records):
        return acting
    for i, rig in enumerate(data.rigs):
        for test in (None, *tests[rig]):
            j = -1 if test is None else data.tests.index(test)
            row = [name for name, a, b in zip(layout.records, layout.rig, layout.test, strict=True) if (a, b) == (i, j)]
            inside = [name for name in row if name in records]
            if inside:
                named = ", ".join(style.shorten(name, 16) for name in inside[:_NAMED])
                more = f" and {len(inside) - _NAMED} more" if len(inside) > _NAMED else ""
                where = "" if len(inside) == len(row) > 1 else f" in {named}{more}"
                acting.setdefault((rig, test), []).append(f"{_words(UNKNOWN)}{where}")
    return acting


def _said(diagnosis: Diagnosis, groups: Sequence[Sequence[str]]) -> dict[str, Any]:
    """What gap.json says of a verdict."""
    return {
        "verdict": diagnosis.verdict, "also": diagnosis.found[1:], "probability": diagnosis.probability,
        "probability_also": diagnosis.also, "in_its_place": diagnosis.beside,
        "indistinguishable": groups,
    }  # fmt: skip


def _words(name: str) -> str:
    return {NONE: "no gap", UNKNOWN: "not in the catalogue"}.get(name, name.replace("_", " "))


def _scale(data: "GapData") -> float:
    """What amplitudes are multiplied by to be shown."""
    return shown_in(data.campaign.section.amplitude_unit)[0]


def _rows(data: "GapData", curves: Curves) -> tuple[list[Row], list[str]]:
    """Rig, test (-1: none in wind) and curves in wind and in still air of every row; and what is left out, in words.

    Rows stand in the order of their Scruton numbers, rigs' still air in their first.
    """
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

    def scruton_number(row: tuple[int, int]) -> tuple[float, tuple[int, int]]:
        of = layout.scruton_number[(layout.test == row[1]) & layout.wind]
        return float(of[0]) if of.size else np.inf, row

    every = [*wind, *((rig, -1) for rig in still if rig not in {r for r, _ in wind})]
    shown = sorted(sorted(every, key=far, reverse=True)[:GAP_ROWS], key=scruton_number)
    missing = [
        style.shorten(str(data.tests[test] if test >= 0 else data.rigs[rig]), 16)
        for rig, test in sorted(set(every) - set(shown), key=scruton_number)
    ]
    named = ", ".join(missing[:_LEFT_OUT_NAMED]) + (", ..." if len(missing) > _LEFT_OUT_NAMED else "")
    left_out = [f"Left out, for they depart least: {named} ({len(missing)} of {len(every)})"] if missing else []
    return [(rig, test, wind.get((rig, test), []), still.pop(rig, [])) for rig, test in shown], left_out


def _upper(
    part: "SubFigure", data: "GapData", rows: Sequence[Row], acting: dict[tuple[str, str | None], list[str]]
) -> "list[Axes]":
    """Rows of excess damping, in wind on the left and in still air on the right, with what acts there above them."""
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
            acts = ", ".join(dict.fromkeys(acting.get((name, of), ())))
            if acts:
                title += f": {acts}"
            room = _HEADLINE if len(columns) == 1 else _NARROW_TITLE
            long = len(title) > room and bool(acts)
            panel.set_title(title.replace(": ", ":\n", 1) if long else title, fontsize=7.0 if long else None)
            drawn.append(panel)
    drawn[0].set_xscale("log")
    for panel in axes[-1]:
        style.plain_log(panel.xaxis)
        panel.set_xlabel(_amplitude(data))
    excess = damping_label("Excess damping ratio").replace(", ", ",\n")
    label: dict[str, Any] = {"fontsize": 8.0, "multialignment": "center"}
    # beside a single panel: the middle of the figure is higher, where the title is
    (drawn[0].set_ylabel if len(rows) == 1 else part.supylabel)(f"{excess}:\nmeasured minus null model", **label)
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
            axes.axvspan(a[place][0], a[place][-1], color=style.YELLOW, alpha=0.28, lw=0, zorder=0, label=_DIFFERS)
            axes.plot(a[place], y[place], color=colour, lw=2.6, solid_capstyle="butt")
            low, high = min(low, float(y[place].min())), max(high, float(y[place].max()))
        certain = sd <= np.quantile(sd, 0.6)
        low = min(low, float((y - style.Z90 * sd)[certain].min()))
        high = max(high, float((y + style.Z90 * sd)[certain].max()))
    axes.axhline(0.0, color=style.GREY, lw=0.6)
    margin = 0.12 * (high - low)
    axes.set_ylim(low - margin, high + margin)


def _frequency(axes: "Axes", curves: Sequence[Curve], data: "GapData") -> None:
    """Change of frequency with amplitude, a colour and a marker for every rig, dashed in still air."""
    from matplotlib import colormaps

    axes.axhline(0.0, color=style.GREY, lw=0.6)
    layout, reach = data.layout, 0.15
    rigs = sorted({int(layout.rig[curve.record]) for curve in curves}, key=lambda rig: _place_of(rig, data))
    # none of the colours of growth, decay and still air, light to dark in the order of the Scruton numbers
    shades = colormaps["copper_r"](np.linspace(0.12, 1.0, len(rigs)) if len(rigs) != 1 else [1.0])
    looks: dict[int, dict[str, Any]] = {
        rig: {"color": tuple(shade), "marker": style.line_style(rig).marker, "ms": 3.0}
        for rig, shade in zip(rigs, shades, strict=True)
    }  # fmt: skip
    both = len({curve.direction == STILL for curve in curves}) > 1
    for curve in sorted(curves, key=lambda curve: rigs.index(int(layout.rig[curve.record]))):
        look = looks[int(layout.rig[curve.record])]
        a, y, sd, width = _scale(data) * curve.amplitude, 100.0 * curve.excess, 100.0 * curve.sd, 0.9
        if curve.places():
            width = 2.4
            axes.fill_between(a, y - style.Z90 * sd, y + style.Z90 * sd, color=look["color"], alpha=0.2, lw=0)
            axes.plot([], [], color=style.BLACK, lw=width, label=_HEAVY)
        axes.plot(a, y, ls=_DASHES if both and curve.direction == STILL else "-", lw=width, markevery=0.3, **look)
        reach = max(reach, float(np.abs(y).max()))
    if both:
        axes.plot([], [], color=style.BLACK, lw=0.9, ls=_DASHES, label=_DASHED)
    longest = max((len(str(data.rigs[rig])) for rig in rigs), default=0)
    columns = 4 if longest <= 4 else 3 if longest <= 8 else 2
    room = min(0.5, 0.13 * -(-len(rigs) // columns))  # of the panel, for the names above the curves
    axes.set(ylim=(-1.15 * reach, 1.15 * reach * (1.0 + room) / (1.0 - room)), xscale="log")
    style.plain_log(axes.xaxis)
    axes.set(xlabel=_amplitude(data), ylabel="Change of frequency [%]", title="Frequency against amplitude")
    if not rigs:  # envelopes alone have no phase
        axes.text(0.5, 0.6, "no record tells the frequency", transform=axes.transAxes, ha="center", color=style.GREY)
        axes.set(xticks=[], yticks=[])
        axes.minorticks_off()
    else:
        # filled column by column, read line by line
        inline = [rig for k in range(columns) for rig in rigs[k::columns]]
        handles = [axes.plot([], [], lw=1.4, **looks[rig])[0] for rig in inline]
        axes.legend(
            handles, [style.shorten(str(data.rigs[rig]), 16) for rig in inline], fontsize=7.0, loc="upper left",
            ncols=columns, handlelength=1.4, columnspacing=0.8, labelspacing=0.25, handletextpad=0.4,
        )  # fmt: skip


def _place_of(rig: int, data: "GapData") -> tuple[float, int]:
    """Where a rig stands in the order of the Scruton numbers."""
    own = data.layout.scruton_number[(data.layout.rig == rig) & data.layout.wind]
    return (float(own.min()) if own.size else np.inf), rig


def _probability(axes: "Axes", diagnosis: Diagnosis) -> None:
    """Bars of the likeliest causes, and under them of what stands beside the verdict, by its own probability."""
    ranked = sorted(diagnosis.probability.items(), key=lambda pair: -pair[1])
    shown = [
        *ranked[: GAP_BARS[0]],
        *(pair for pair in ranked[GAP_BARS[0] : GAP_BARS[1]] if pair[1] >= PROBABILITY_SHOWN),
    ]
    beside = [(name, diagnosis.also[name]) for name in diagnosis.found[1:] if name in diagnosis.also]
    bars = [
        (_words(name), p, name == diagnosis.verdict, style.SKY if name == diagnosis.verdict else style.LIGHT)
        for name, p in ranked
        if ((name, p) in shown and name not in dict(beside)) or name == NONE
    ]
    bars += [(f"beside it: {_words(name)}", p, True, _BESIDE) for name, p in beside]
    for i, (_, p, named, colour) in enumerate(bars):
        axes.barh(i, p, color=colour, height=0.72)
        axes.text(max(p, 0.0) + 0.015 if p < 0.8 else p - 0.015, i, f"{p:.3f}", va="center", fontsize=7.0,
                  ha="left" if p < 0.8 else "right", weight="bold" if named else "normal")  # fmt: skip
    style.rows(axes, [textwrap.fill(words, _BAR_LABEL) for words, *_ in bars], fontsize=7.0)
    axes.set(xlim=(0.0, 1.0), xlabel="Probability", title="What explains it")


def _amplitude(data: "GapData") -> str:
    return style.amplitude_label(data.campaign.section.amplitude_unit)
