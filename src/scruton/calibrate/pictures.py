"""Pictures of a calibration: coverage of every cell, and how the ranks depart from uniform."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.coverage import CalibrationResult, Cell
from scruton.calibrate.quantities import INTERVALS, kind_of
from scruton.calibrate.thresholds import LIMIT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, RED, GREY, LIGHT = "#0072B2", "#D55E00", "#6E6E6E", "#E4E4E4"  # Okabe and Ito
_LOOKS = (("#56B4E9", "o"), (BLUE, "s"), (RED, "^"))  # of the three intervals
WIDTH = 180.0 / 25.4  # inches
_DPI = 160
_COLUMNS = 4


def draw(result: CalibrationResult, folder: Path) -> list[Path]:
    """Write the coverage picture and the rank pictures, one of all regimes together and one of each."""
    if not result.cells:
        return []
    pictures = {"coverage": coverage_picture(result)}
    tables = {regime: table for regime, table in result.ranks.items() if table}
    # By kind of quantity, of the first test where there are several: one of each kind a campaign.
    firsts = [{kind_of(name): rank for name, rank in reversed(list(table.items()))} for table in tables.values()]
    kinds = dict.fromkeys(kind_of(name) for name in next(iter(tables.values())))
    together = {kind: np.concatenate([ranks[kind] for ranks in firsts]) for kind in kinds}
    pictures["ranks"] = rank_picture(together, "all regimes, first test of each campaign")
    pictures |= {f"ranks-{regime}": rank_picture(table, regime) for regime, table in tables.items()}
    return [save(figure, folder / f"{name}.png") for name, figure in pictures.items()]


def coverage_picture(result: CalibrationResult) -> "Figure":
    """Draw coverage less nominal, in points: one panel a kind of quantity, one row a regime, one mark a test."""
    from matplotlib.figure import Figure

    regimes = list(dict.fromkeys(cell.regime for cell in result.cells))
    kinds = list(dict.fromkeys(kind_of(cell.quantity) for cell in result.cells))
    rows = -(-len(kinds) // _COLUMNS)
    figure = Figure(figsize=(WIDTH * 1.35, rows * (0.9 + 0.26 * len(regimes)) + 0.6), layout="constrained")
    panels = figure.subplots(rows, min(_COLUMNS, len(kinds)), sharex=True, sharey=True, squeeze=False)
    for axes in panels.flat[len(kinds) :]:
        axes.set_visible(False)
    for axes, kind in zip(panels.flat, kinds, strict=False):
        _coverage_panel(axes, [cell for cell in result.cells if kind_of(cell.quantity) == kind], regimes)
        axes.set_title(kind, fontsize=8, loc="left")
    first = panels[0, 0]
    first.set_yticks(range(len(regimes)), regimes)
    first.set_ylim(len(regimes) - 0.4, -0.6)
    figure.supxlabel("coverage less nominal [percentage points]", fontsize=8)
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), fontsize=8, frameon=False)
    return figure


def _coverage_panel(axes: "Axes", cells: list[Cell], regimes: list[str]) -> None:
    axes.axvline(0.0, color=GREY, lw=0.8)
    for i, (p, (colour, marker)) in enumerate(zip(INTERVALS, _LOOKS, strict=True)):
        shown = [cell for cell in cells if cell.interval == p]
        y = [regimes.index(cell.regime) + 0.26 * (i - 1) for cell in shown]
        for row, cell in dict(zip(y, shown, strict=True)).items():  # every cell of a regime has as many campaigns
            reach = 100.0 * LIMIT * cell.standard_error
            axes.barh(row, 2 * reach, 0.22, left=-reach, color=colour, alpha=0.18, lw=0)
        x = [100.0 * (cell.coverage - p) for cell in shown]
        faces = ["white" if cell.left_out else colour for cell in shown]
        edges = ["black" if cell.beyond else colour for cell in shown]
        axes.scatter(x, y, s=14, marker=marker, c=faces, edgecolors=edges, lw=0.8, zorder=3, label=f"{100 * p:.0f} %")
    axes.fill_between([], [], [], color=GREY, alpha=0.25, lw=0, label=f"bars: $\\pm${LIMIT:g} s.e.")
    dress(axes, "x")


def rank_picture(ranks: Mapping[str, FloatArray], title: str) -> "Figure":
    """Draw the distribution function of the ranks of each quantity, (campaigns,), less uniform, by arviz's SBC plot."""
    import arviz as az
    import matplotlib.pyplot as plt

    tree = az.from_dict({"prior_sbc": {name: rank[None, :] for name, rank in ranks.items()}})
    size = (WIDTH * 1.35, 1.55 * -(-len(ranks) // _COLUMNS) + 0.6)
    with warnings.catch_warnings(), plt.rc_context({"font.size": 7, "axes.titlesize": 8}):
        warnings.simplefilter("ignore")
        plot = az.plot_ecdf_pit(
            tree, group="prior_sbc", backend="matplotlib", col_wrap=_COLUMNS, visuals={"xlabel": False},
            figure_kwargs={"figsize": size, "layout": "constrained"},
        )  # fmt: skip
        figure: Figure = plot.viz["figure"].item()
        u = np.linspace(0.0, 1.0, 201)
        for name, rank in ranks.items():
            reach = LIMIT * np.sqrt(u * (1.0 - u) / len(rank))
            axes = plot.get_viz("plot", name)
            axes.fill_between(u, -reach, reach, color=BLUE, alpha=0.12, lw=0)
            axes.set_ylim(-1.5 * reach.max(), 1.9 * reach.max())
        figure.suptitle(f"{title}: distribution of the ranks less uniform; band {LIMIT:g} s.e.", fontsize=9)
        figure.supxlabel("rank of the truth", fontsize=8)
    plt.close(figure)
    return figure


def dress(axes: "Axes", grid: Literal["both", "x"] = "both") -> None:
    """Small ticks, a light grid behind what is drawn, no frame above and to the right."""
    axes.tick_params(labelsize=7)
    axes.grid(axis=grid, color=LIGHT, lw=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def save(figure: "Figure", path: Path) -> Path:
    """Write a picture; the same bytes each time."""
    import matplotlib as mpl

    path.parent.mkdir(parents=True, exist_ok=True)
    metadata = {"Software": None} if path.suffix == ".png" else {"Date": None}
    with mpl.rc_context({"svg.hashsalt": "scruton"}):
        figure.savefig(path, dpi=_DPI, metadata=metadata)
    return path
