"""Pictures of a challenge: the confusion matrix, and the reliability of the verdicts' probabilities."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from scruton.calibrate.challenge.figures import calibration, confusion, wilson
from scruton.calibrate.pictures import BLUE, GREY, LIGHT, RED, WIDTH, dress, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(cases: pd.DataFrame, folder: Path) -> list[Path]:
    """Write confusion and reliability, as PNG and SVG."""
    pictures = {"confusion": confusion_picture(cases), "reliability": reliability_picture(cases)}
    return [save(figure, folder / f"{name}.{kind}") for name, figure in pictures.items() for kind in ("png", "svg")]


def confusion_picture(cases: pd.DataFrame) -> "Figure":
    """Draw the verdicts of each truth in per cent of its cases; where they should lie is framed."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    table = confusion(cases)
    rows, columns, counts = list(table.index), list(table.columns), table.to_numpy()
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(WIDTH * 1.25, 2.3 + 0.27 * len(rows)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(share, cmap=LinearSegmentedColormap.from_list("", ["white", BLUE]), vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in np.argwhere(counts > 0).tolist():
        colour = "white" if share[i, j] > 0.6 else "black"
        axes.text(j, i, f"{100 * share[i, j]:.0f}", ha="center", va="center", fontsize=7, color=colour)
    for i, name in enumerate(rows):
        right = cases.accepted[(cases.row == name) & (cases.row != "two")].explode().unique()
        for j in map(columns.index, right):
            axes.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, ec=RED, lw=1.1, clip_on=False))
    axes.set_yticks(range(len(rows)), [f"{_words(n)} ({c})" for n, c in zip(rows, counts.sum(axis=1), strict=True)])
    axes.set_xticks(range(len(columns)), [_words(n) for n in columns], rotation=45, ha="left", rotation_mode="anchor")
    axes.xaxis.tick_top()
    axes.tick_params(labelsize=7, length=0)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color=LIGHT, lw=0.5)
    axes.tick_params(which="minor", length=0)
    axes.set_xlabel("verdict [per cent of the truth's cases; framed: right]", fontsize=8)
    axes.set_ylabel("truth (cases)", fontsize=8)
    axes.spines[:].set_visible(False)
    return figure


def reliability_picture(cases: pd.DataFrame) -> "Figure":
    """Draw how often verdicts of a probability are right, in bins of equal count, over where the probabilities lie."""
    from matplotlib.figure import Figure

    bins, error, chance = calibration(cases)
    figure = Figure(figsize=(WIDTH * 0.6, WIDTH * 0.72), layout="constrained")
    axes, below = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
    axes.plot([0, 1], [0, 1], color=GREY, lw=0.8)
    hits = np.rint(bins.accuracy * bins.cases).astype(int)
    spans = np.array([wilson(int(h), int(n)) for h, n in zip(hits, bins.cases, strict=True)]).reshape(-1, 2)
    reach = np.abs(spans.T - bins.accuracy.to_numpy())
    axes.errorbar(bins.probability, bins.accuracy, reach, fmt="o", ms=4, color=BLUE, lw=1, capsize=2)
    axes.set_ylabel("right [share of the verdicts]", fontsize=8)
    axes.set_ylim(-0.02, 1.03)
    title = f"calibration error {error:.3f} (finite bins alone: {chance:.3f})"
    axes.set_title(title if len(bins) else "no probabilities", fontsize=8, loc="left")
    below.hist(cases.p.dropna(), bins=np.linspace(0, 1, 41).tolist(), color=BLUE, alpha=0.5, lw=0)
    below.set_ylabel("cases", fontsize=8)
    below.set_xlabel("probability of the verdict", fontsize=8)
    below.set_xlim(-0.02, 1.02)
    dress(axes)
    dress(below)
    return figure


def _words(name: str) -> str:
    return "two at once" if name == "two" else name.replace("_", " ")
