"""1/A against the Scruton number: friction bends it upwards at small amplitude; here it is found and taken out.

Run `python examples/closed-box-heaving/reciprocal.py`; it writes out/closed-box-heaving/reciprocal.png and .svg.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign import load_campaign
from scruton.dynamics.effects.terms import Term
from scruton.gap.bands import posterior_draws
from scruton.gap.diagnosis import Diagnosis, diagnose
from scruton.gap.finding import Z90
from scruton.report.document import Table
from scruton.report.figures import FigureWithCaption, save
from scruton.report.figures.style import BLACK, BLUE, GREEN, LIGHT, VERMILLION, house_style, new_figure
from scruton.report.render_text import render_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HERE = Path(__file__).parent
OUT = Path("out/closed-box-heaving")
DRAWS = 1000
LIMIT = 13.2  # Sc above which the dampers rub: where the paper's curve leaves the line
FROM = 2.0 / 3.0  # of a record: what comes later has settled


@dataclass(frozen=True, eq=False)
class Reciprocals:
    """Reciprocals of stable amplitudes, D/A, of T tests and along S Scruton numbers; bands are 5 and 95 %.

    Attributes
    ----------
    rigs : (T,) tuple of str
    sc, measured, error, bare_test, with_friction : (T,) arrays
        As stated; from the ends of the records, with standard error; by the null model; with the effect found.
    at_test : (T,) array
        With the friction taken out.
    grid, bare, without : (S,) arrays
        Scruton numbers; the null model's line; the line with the friction taken out.
    band : (2, S) array
        Of `without`.
    """

    rigs: tuple[str, ...]
    sc: FloatArray
    measured: FloatArray
    error: FloatArray
    bare_test: FloatArray
    with_friction: FloatArray
    at_test: FloatArray
    grid: FloatArray
    bare: FloatArray
    without: FloatArray
    band: FloatArray


def settled_mean(diagnosis: Diagnosis, test: int) -> tuple[float, float]:
    """Mean amplitude of the settled ends of a test's records and its standard error.

    The scatter about the mean is forgotten at the relaxation rate, so that a time T holds rate T/2 independent values.
    """
    data, final = diagnosis.data, diagnosis.final
    records = np.flatnonzero(data.layout.test == test)
    row = final.hypothesis.table(final.mode[None])[0, records[0]]
    ends, time = [], 0.0
    for r in records:
        one = data.cycles[data.layout.records[r]]
        late = one.time >= one.time[0] + FROM * np.ptp(one.time)
        ends.append(one.amplitude[late])
        time += float(np.ptp(one.time[late]))
    values = np.concatenate(ends)
    independent = 0.5 * time * float(row[Term.STRUCTURAL] + row[Term.AERO])
    return float(values.mean()), float(values.std() / np.sqrt(independent - 1.0))


def reciprocals(diagnosis: Diagnosis) -> Reciprocals:
    """All that the figure shows."""
    data, bare, final = diagnosis.data, diagnosis.null, diagnosis.final
    u = posterior_draws(final, np.random.default_rng(11), DRAWS)
    first = [int(np.flatnonzero(data.layout.test == j)[0]) for j in range(len(data.tests))]
    means, errors = np.array([settled_mean(diagnosis, j) for j in range(len(data.tests))]).T
    sc = data.layout.scruton_number[first]
    grid = np.linspace(2.0, 40.0, 77)

    def line(scruton_numbers: FloatArray) -> FloatArray:
        one = [
            final.hypothesis.stable_amplitude(u, data.middle, scruton_number=float(x), bridge=True)
            for x in scruton_numbers
        ]
        return 1.0 / np.array(one).T

    def bare_at(x: float) -> float:
        return float(bare.hypothesis.stable_amplitude(bare.mode[None], data.middle, scruton_number=float(x))[0])

    found = 1.0 / np.array([final.hypothesis.stable_amplitude(u, r) for r in first])
    along = line(grid)
    return Reciprocals(
        rigs=tuple(data.rigs[data.layout.rig[i]] for i in first),
        sc=sc,
        measured=1.0 / means,
        error=errors / means**2,
        bare_test=np.array([1.0 / bare_at(x) for x in sc]),
        with_friction=np.median(found, axis=1),
        at_test=np.median(line(sc), axis=0),
        grid=grid,
        bare=np.array([1.0 / bare_at(x) for x in grid]),
        without=np.median(along, axis=0),
        band=np.quantile(along, (0.05, 0.95), axis=0),
    )


def draw(axes: "Axes", r: Reciprocals, *, percent: bool) -> None:
    """Everything into one panel, as D/A or in percent above the line without friction."""
    straight = np.interp(r.sc, r.grid, r.without)

    def shown(values: FloatArray, base: FloatArray) -> FloatArray:
        return 100.0 * (values / base - 1.0) if percent else values

    axes.axvspan(LIMIT, r.grid[-1], color=LIGHT, alpha=0.28, lw=0)
    low, high = shown(r.band, r.without)
    axes.fill_between(r.grid, low, high, color=GREEN, alpha=0.25, lw=0)
    axes.plot(r.grid, shown(r.without, r.without), color=GREEN, label="friction found and taken out, 90 % band")
    axes.plot(
        r.grid, shown(r.bare, r.without), color=VERMILLION, ls=(0, (5, 2)), label="null model, fitted to all rigs"
    )
    axes.plot(
        r.sc, shown(r.with_friction, straight), color=BLUE, ls=(0, (1.2, 1.6)), lw=0.9,
        marker="s", ms=8.5, mfc="none", mew=1.1, label="with the friction found, rig by rig",
    )  # fmt: skip
    middle = shown(r.measured, straight)
    error = Z90 * r.error * (100.0 / straight if percent else 1.0)
    axes.errorbar(
        r.sc, middle, error, fmt="o", ms=3.6, color=BLACK, elinewidth=0.9, capsize=2.2,
        label="simulated records, mean of their settled ends",
    )  # fmt: skip


def figure(r: Reciprocals) -> FigureWithCaption:
    """1/A against Sc, and below it by how much everything lies above the line without friction."""
    with house_style():
        made = new_figure(112.0)
        upper, lower = made.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
        draw(upper, r, percent=False)
        draw(lower, r, percent=True)
        for sc, y, rig in zip(r.sc, r.with_friction, r.rigs, strict=True):
            upper.annotate(rig, (sc, y), (0.0, 8.0), textcoords="offset points", ha="center", va="bottom")
        upper.text(LIMIT + 0.4, 0.04, "dampers that rub", transform=upper.get_xaxis_transform(), va="bottom")
        upper.set_ylabel("Reciprocal of the stable amplitude, D/A [-]")
        upper.set_ylim(0.0, 240.0)
        upper.legend(loc="upper left")
        lower.set_ylabel("Above the line\nwithout friction [%]")
        lower.set_xlabel("Scruton number, damping as stated [-]")
        lower.set_ylim(-5.0, 24.0)
        lower.set_xlim(r.grid[0], r.grid[-1])
        made.align_ylabels()
    return FigureWithCaption(
        made,
        "reciprocal",
        "Simulated closed-box girder, heaving: reciprocal of the stable amplitude against the Scruton number. Bars and "
        "band are 90 %. Friction in the dampers above Sc 13 lifts it off the line; the diagnosis finds and removes it.",
        "1/A rises linearly up to Sc 13, the points above lie over the line; with friction in the model it meets them.",
    )


def main() -> None:
    """Diagnose, print the table and draw."""
    diagnosis = diagnose(load_campaign(HERE), workers=1)
    r = reciprocals(diagnosis)
    print(f"found: {', '.join(diagnosis.found) or 'nothing'}\n\nReciprocal of the stable amplitude, D/A")
    head = ["rig", "Sc", "records", "null model", "with friction", "friction taken out", "friction lifts it by"]
    columns = (r.rigs, r.sc, r.measured, r.error, r.bare_test, r.with_friction, r.at_test)
    rows = [
        [
            rig,
            f"{sc:.1f}",
            f"{y:.1f} ± {e:.1f}",
            f"{b:.1f}",
            f"{w:.1f}",
            f"{o:.1f}",
            f"{round(100 * (w / o - 1), 1) + 0.0:.1f} %",
        ]
        for rig, sc, y, e, b, w, o in zip(*columns, strict=True)
    ]
    print(render_text([Table("rigs", "", head, rows)]).strip("\n"))
    for path in save(figure(r), OUT, formats=("png", "svg")):
        print(path)


if __name__ == "__main__":
    main()
