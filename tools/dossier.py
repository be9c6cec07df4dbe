"""Write docs/measured.md and its pictures from measured records: python -m tools.dossier FOLDER."""

import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scruton.report.figures import save, style
from scruton.report.figures.style import house_style
from tools.measured import (
    NAMES,
    SETS,
    Decrements,
    Examined,
    Law,
    Withheld,
    examined,
    foretold,
    median_error,
    scatter_in_wind,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from scruton.gap.diagnosis import Diagnosis

PAGE, PICTURES = Path("docs/measured.md"), Path("docs/images/measured")
_SURE, _WRONG, _LEVEL = 0.8, 0.9, 0.1
_HEAD = """# Measured records

What `scruton diagnose` says of records that were measured, not simulated. This page is written by `make dossier
DATA=FOLDER`, numbers and all; the records themselves are other people's and not part of the project. Tests of the
same (`pytest -m real`) skip where they are absent.

**Truth.** Each set's effect is known from elsewhere: from its owners, or from the damping read by hand. By hand means
without this program: turning points of the record, the logarithmic decrement over each fall of the amplitude by a
fifth, and the law $\\xi = x_0 + b/A + cA + dA^2$ with no coefficient negative, fitted to these by least relative
squares. Damping is the decay rate over $2\\pi f_0$ of the rig, as read; A is in A/D or rad.

**Withheld.** The records are cut where the amplitude is at the middle of its range, in logarithms. One side is
diagnosed, its own verdict taken, and the damping foretold on the other side, of which nothing was seen; then the
other way round. Where there are several records each is left out in turn, or each rig. Of a rig that is left out
nothing tells the constant damping: both models are given that at its middle amplitude. *Before* is the null model,
*after* the verdict's, both fitted to the same part; the figure is the median relative error of the damping over all
decrements left out.
"""


def words(names: Iterable[str]) -> str:
    """Names of effects in a sentence."""
    return " and ".join(name.replace("_", " ") for name in names) or "none"


def percent(value: float) -> str:
    """A share of one, to two figures."""
    return f"{float(f'{100.0 * value:.2g}'):g} %"


def _probability(p: float) -> str:
    return "> 0.99" if p > 0.99 else f"{p:.2f}"


def row(one: Examined) -> str:
    """A set's line of the table."""
    content, used = one.content, one.content["shrink"]
    before, after = median_error(one.withheld)
    group = [name for name in next(iter(content["indistinguishable"]), ()) if name != content["verdict"]]
    verdict = words([content["verdict"]])
    also = content["probability_also"]
    verdict += f"; also {words(f'{name} ({_probability(also[name])})' for name in content['also'])}" if also else ""
    verdict += f"; or {words(group)}" if group else ""
    held = (used.get("held_out") or {}).get("fraction")
    cells = (
        f"[{one.known.title}](#{one.known.title.replace(',', '').replace(' ', '-')})",
        words(one.known.truth),
        f"{used['before']:.0f}" if used else "-",
        f"{percent(one.on_used[0])} → {percent(one.on_used[1])}",
        verdict,
        _probability(content["probability"][content["verdict"]]),
        f"{percent(before)} → {percent(after)}",
        " / ".join("-" if share is None else percent(share) for share in (used.get("fraction"), held)),
    )
    return f"| {' | '.join(cells)} |"


def _law(law: Law) -> str:
    after = {"1": "", "1/A": "/A", "A": r"\,A", "A^2": r"\,A^2"}
    terms = [f"{100.0 * value:.3g}{after[name]}" for name, value in law.coefficients.items() if value > 0.0]
    without = "; ".join(f"{percent(value)} without {words([name])}" for name, value in law.without.items())
    misfit = f"root mean square; {without}; {percent(law.constant)} as a constant"
    return f"$\\xi = {' + '.join(terms)}$ per cent, to {percent(law.residual)} ({misfit})"


def sentences(one: Examined) -> Iterator[str]:
    """What is right, wrong and unsure about a verdict, as it came out."""
    content = one.content
    p = content["probability"][content["verdict"]]
    if one.missed:
        yield f"**{words(one.missed).capitalize()} is missed**: the verdict is {words([content['verdict']])}."
    elif one.known.truth == ("unknown",):
        yield "The verdict is unknown, as it has to be; a name from the catalogue would be wrong."
    else:
        yield "The truth is named."
    named_wrong = [name for name in one.named if name not in (*one.known.truth, *one.known.besides)]
    if named_wrong:
        yield f"Named besides, though nothing independent shows it: {words(sorted(named_wrong))}."
    if p < _SURE:
        yield f"It is not settled (p = {p:.2f})."
    for name, chance in content["probability_also"].items():
        if chance < _SURE:
            yield f"Beside it {words([name])} is not settled (p = {chance:.2g})."
    for name, value in one.wrong.items():
        if value > _WRONG:
            yield f"**{words([name]).capitalize()} has a probability of {_probability(value)} and is wrong.**"
    before, after = median_error(one.withheld)
    if after > before:
        worse = f"{percent(before)} before and {percent(after)} after"
        yield f"**Left out, the damping is foretold no better with the verdict than without**, {worse}."
    elif before < 3.0 * after:
        yield f"Left out, the damping is foretold only {before / after:.1f} times better."
    else:
        yield f"Left out, the damping is foretold {before / after:.1f} times better."
    blind = [part.what for part in one.withheld if not part.verdict]
    if blind:
        yield f"With the {' or the '.join(blind)} left out the rest shows no gap, and nothing can be put in."
    astray = [part for part in one.withheld if set(part.verdict) - {*one.known.truth, *one.known.besides}]
    if astray:
        called = (f"{words(part.verdict)} without the {part.what}" for part in astray)
        yield f"What remains is called wrongly: {'; '.join(called)}."
    worse = [part.what for part in one.withheld if part.error[1] > 1.02 * part.error[0]]
    if worse:
        yield f"Made worse: {', '.join(worse)}."
    floor = max(law.residual for law in one.laws.values())
    if floor > _LEVEL:
        yield f"The decrements themselves scatter by {percent(floor)} about a smooth law: no error falls far below."


def section(one: Examined) -> str:
    """A set's own part of the page."""
    known = one.known
    lines = [f"## {known.title.capitalize()}", "", f"*Origin:* {one.campaign.source}.", "", known.source]
    lines += ["", "Read by hand:", "", *(f"* rig {name}: {_law(law)}." for name, law in one.laws.items())]
    if gusts := scatter_in_wind(one.campaign):
        least, most = (percent(end(gusts.values())) for end in (min, max))
        lines.append(f"* in wind the amplitude scatters by {least} to {most} within a record.")
    lines += ["", *sentences(one), ""]
    lines += [
        "| left out | verdict of the rest | error of the damping, before → after | times smaller |",
        "|---|---|---|---|",
    ]
    for part in one.withheld:
        before, after = part.error
        errors = f"{percent(before)} → {percent(after)} | {before / after:.1f}"
        lines.append(f"| {part.what} | {words(part.verdict)} | {errors} |")
    stable = one.content["shrink"].get("stable_amplitude") or []
    if stable:
        lines += ["", "The stable amplitude of each rig in wind, foretold from the others:", "",
                  "| test | measured A/D | error before | after |", "|---|---|---|---|"]  # fmt: skip
        for s in stable:
            errors = f"{percent(s['error_before'])} | {percent(s['error_after'])}"
            lines.append(f"| {s['test']} | {s['measured']:.3g} | {errors} |")
        worse = sum(s["error_after"] > s["error_before"] for s in stable)
        lines += ["", f"Of {len(stable)} it is made worse in {worse}."]
    alt = f"Damping against amplitude of the {known.title}: measured, null model, verdict"
    lines += ["", f"![{alt}](images/measured/{known.folder}.svg)", ""]
    return "\n".join(lines)


def _panel(
    axes: "Axes", one: Examined, found: "Diagnosis", seen: dict[str, Decrements], out: dict[str, Decrements]
) -> None:
    for i, (name, whole) in enumerate(one.read.items()):
        pen = style.line_style(i)
        for read, face in ((seen, pen.colour), (out, "none")):
            if name in read:
                axes.plot(read[name].amplitude, 100.0 * read[name].damping, ls="none", marker=pen.marker, ms=2.8,
                          mew=0.6, color=pen.colour, mfc=face, alpha=0.75)  # fmt: skip
        grid = np.geomspace(whole.amplitude.min(), whole.amplitude.max(), 80)
        curves = foretold(found, name, Decrements(grid, grid))
        axes.plot(grid, 100.0 * curves.before, color=pen.colour, ls=(0, (3, 2)), lw=0.9)
        axes.plot(grid, 100.0 * curves.after, color=pen.colour, lw=1.3)
    every = 100.0 * np.concatenate([read.damping for read in one.read.values()])
    low, high = float(every.min()), float(every.max())
    axes.set_xscale("log")
    axes.set_ylim(max(0.0, low - 0.35 * (high - low)), high + 0.1 * (high - low))
    style.plain_log(axes.xaxis)


def picture(one: Examined) -> "Figure":
    """Damping against amplitude: fitted to everything, then with the small and with the large amplitudes left out."""
    from matplotlib.lines import Line2D

    with house_style():
        drawing = style.new_figure(62.0)
        axes = drawing.subplots(1, 3, sharey=True)
        _panel(axes[0], one, one.diagnosis, dict(one.read), {})
        axes[0].set_title("All records fitted")
        halves: list[Withheld] = one.withheld[:2]
        for panel, part, other in zip(axes[1:], halves, halves[::-1], strict=True):
            seen, out = ({p.rig: p.read for p in which.parts} for which in (other, part))
            _panel(panel, one, part.diagnosis, seen, out)
            panel.set_title(f"{part.what.capitalize()} left out")
        unit = one.campaign.section.amplitude_unit
        for panel in axes:
            panel.set_xlabel(style.amplitude_label(unit))
        axes[0].set_ylabel("Damping ratio [%]")
        grey = style.GREY
        handles = [
            Line2D([], [], ls="none", marker="o", ms=3, color=grey, label="decrements, fitted"),
            Line2D([], [], ls="none", marker="o", ms=3, color=grey, mfc="none", label="left out"),
            Line2D([], [], color=grey, ls=(0, (3, 2)), lw=0.9, label="null model"),
            Line2D([], [], color=grey, lw=1.3, label="with the verdict"),
        ]
        if len(one.read) > 1:
            handles += [
                Line2D([], [], ls="none", marker=style.line_style(i).marker, ms=3, color=style.line_style(i).colour,
                       label=style.shorten(name, 16))
                for i, name in enumerate(one.read)
            ]  # fmt: skip
        drawing.legend(handles=handles, loc="outside lower center", ncols=4)
    return drawing


def compact(svg: str) -> str:
    """The same picture with the style of markers in a row said once: it is most of the file where there are many."""

    def once(found: re.Match[str]) -> str:
        markers = found[0].replace(f' style="{found[1]}"', "")
        return f'<g style="{found[1]}">\n{markers}</g>\n'

    return re.sub(r'(?:[ ]*<use [^>]*? style="([^"]*)"/>\n)(?:[ ]*<use [^>]*? style="\1"/>\n){9,}', once, svg)


def page(sets: list[Examined]) -> str:
    """The whole page."""
    right = sum(not one.missed for one in sets)
    wrong = sum(max(one.wrong.values(), default=0.0) > _WRONG for one in sets)
    told = [one for one in sets if set(one.known.truth) & set(NAMES.values())]
    better = sum(error[0] >= 3.0 * error[1] for error in (median_error(one.withheld) for one in told))
    count = (
        f"Of {len(sets)} sets the truth is in the verdict, `also` or group in {right}; a wrong name has a probability "
        f"above {_WRONG:g} in {wrong}; where friction or drag is the truth, the held-out error of the damping is cut "
        f"threefold or more in {better} of {len(told)}."
    )
    table = [
        "| set | truth | misfit of the null model [nats] | error of the damping, before → after | verdict | p "
        "| damping left out, before → after | shrink, used / held out |",
        "|---|---|---|---|---|---|---|---|", *map(row, sets),
    ]  # fmt: skip
    return "\n".join([_HEAD, count, "", *table, "", *map(section, sets)])


def main(folder: Path) -> None:
    """Examine every set that is there, and write the page and its pictures."""
    sets = []
    for known in SETS:
        if not (folder / known.folder).is_dir():
            raise SystemExit(f"{folder}: no set '{known.folder}'; the page is written from all of them")
        sets.append(examined(known, folder / known.folder))
        for path in save(picture(sets[-1]), PICTURES, known.folder, formats=("svg",)):
            path.write_text(compact(path.read_text(encoding="utf-8")), encoding="utf-8")
            print(path, flush=True)
    PAGE.write_text(page(sets), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
