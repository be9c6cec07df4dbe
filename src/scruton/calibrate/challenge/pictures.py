"""Pictures of a challenge: the confusion matrix, and the reliability of the verdicts' probabilities."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scruton.calibrate.challenge.figures import calibration, confusion
from scruton.calibrate.challenge.outcomes import UNKNOWN, Outcome
from scruton.calibrate.challenge.outside import OPEN
from scruton.calibrate.challenge.rates import wilson

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH = 180.0 / 25.4
_DPI = 160
_BLUE, _RED, _GREY = "#0072B2", "#D55E00", "#6E6E6E"  # Okabe and Ito


def draw(outcomes: Sequence[Outcome], folder: Path) -> list[Path]:
    """Write confusion and reliability, as PNG and SVG."""
    pictures = {"confusion": confusion_picture(outcomes), "reliability": reliability_picture(outcomes)}
    return [_save(figure, folder / f"{name}.{kind}") for name, figure in pictures.items() for kind in ("png", "svg")]


def confusion_picture(outcomes: Sequence[Outcome]) -> "Figure":
    """Draw the verdicts of each truth in per cent of its cases; where they should lie is framed."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    rows, columns, counts = confusion(outcomes)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(_WIDTH * 1.25, 2.3 + 0.27 * len(rows)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(share, cmap=LinearSegmentedColormap.from_list("", ["white", _BLUE]), vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in np.argwhere(counts > 0).tolist():
        colour = "white" if share[i, j] > 0.6 else "black"
        axes.text(j, i, f"{100 * share[i, j]:.0f}", ha="center", va="center", fontsize=7, color=colour)
    for i, name in enumerate(rows):
        for verdict in _right(name):
            if verdict in columns:
                place = (columns.index(verdict) - 0.5, i - 0.5)
                axes.add_patch(Rectangle(place, 1, 1, fill=False, ec=_RED, lw=1.1, clip_on=False))
    axes.set_yticks(range(len(rows)), [f"{_words(n)} ({c})" for n, c in zip(rows, counts.sum(axis=1), strict=True)])
    axes.set_xticks(range(len(columns)), [_words(n) for n in columns], rotation=45, ha="left", rotation_mode="anchor")
    axes.xaxis.tick_top()
    axes.tick_params(labelsize=7, length=0)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color="#E4E4E4", lw=0.5)
    axes.tick_params(which="minor", length=0)
    axes.set_xlabel("verdict [per cent of the truth's cases; framed: right]", fontsize=8)
    axes.set_ylabel("truth (cases)", fontsize=8)
    for side in axes.spines.values():
        side.set_visible(False)
    return figure


def reliability_picture(outcomes: Sequence[Outcome]) -> "Figure":
    """Draw how often verdicts of a probability are right, in bins of equal count, over where the probabilities lie."""
    from matplotlib.figure import Figure

    bins = calibration(outcomes)
    figure = Figure(figsize=(_WIDTH * 0.6, _WIDTH * 0.72), layout="constrained")
    axes, below = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
    axes.plot([0, 1], [0, 1], color=_GREY, lw=0.8)
    hits = np.rint(bins.accuracy * bins.count).astype(int)
    spans = np.array([wilson(int(h), int(n)) for h, n in zip(hits, bins.count, strict=True)]).reshape(-1, 2)
    reach = np.abs(spans.T - bins.accuracy)
    axes.errorbar(bins.probability, bins.accuracy, reach, fmt="o", ms=4, color=_BLUE, lw=1, capsize=2)
    axes.set_ylabel("right [share of the verdicts]", fontsize=8)
    axes.set_ylim(-0.02, 1.03)
    title = "no probabilities" if not bins.count.size else (
        f"calibration error {bins.error:.3f} (finite bins alone: {bins.chance:.3f})"
    )  # fmt: skip
    axes.set_title(title, fontsize=8, loc="left")
    p = [one.probability.get(one.verdict, 0.0) for one in outcomes if one.probability]
    below.hist(p, bins=np.linspace(0, 1, 41).tolist(), color=_BLUE, alpha=0.5, lw=0)
    below.set_ylabel("cases", fontsize=8)
    below.set_xlabel("probability of the verdict", fontsize=8)
    below.set_xlim(-0.02, 1.02)
    for one in (axes, below):
        one.tick_params(labelsize=7)
        one.grid(color="#E4E4E4", lw=0.5)
        one.set_axisbelow(True)
        for side in ("top", "right"):
            one.spines[side].set_visible(False)
    return figure


def _right(name: str) -> tuple[str, ...]:
    if name == "two":
        return ()
    return (UNKNOWN, "fluid_memory") if name == "wake_oscillator" else (UNKNOWN,) if name in OPEN else (name,)


def _words(name: str) -> str:
    return "two at once" if name == "two" else name.replace("_", " ")


def _save(figure: "Figure", path: Path) -> Path:
    import matplotlib as mpl

    path.parent.mkdir(parents=True, exist_ok=True)
    own = {"Software": None} if path.suffix == ".png" else {"Date": None}
    with mpl.rc_context({"svg.hashsalt": "scruton"}):
        figure.savefig(path, dpi=_DPI, metadata=own)
    return path
