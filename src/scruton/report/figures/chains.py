"""What the sampler did: corner plots of the posterior and traces of its chains."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.posterior import peak_names, test_names
from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure
from scruton.report.thresholds import CHAINS_SHOWN

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.infer.results import Fit

LABELS = {
    "a_star": r"$a^*$ [{unit}]",
    "relaxation_rate": r"$\lambda$ [1/s]",
    "damping_ratio": r"$\xi_s$ [%]",
    "amplitude_scatter": "scatter [-]",
    "noise_factor": "noise factor [-]",
    "Y1": r"$Y_1$ [-]",
    "epsilon": r"$\varepsilon$ [-]",
}
CORNER = ("a_star", "relaxation_rate", "damping_ratio", "Y1", "epsilon", "amplitude_scatter")
CORNER_OTHER_LAW = ("a_star", "relaxation_rate", "damping_ratio", "amplitude_scatter", "noise_factor")
TRACE = ("a_star", "relaxation_rate", "damping_ratio", "amplitude_scatter", "noise_factor")
_MASS = (0.90, 0.50)  # what the contours hold
_WALKERS = 3  # lines drawn of each ensemble
_STEPS = 300


def chains_shown(fit: "Fit") -> dict[str, str]:
    """Peak tests whose plots a report holds, by their number in the campaign: a name may hold what a file cannot."""
    return {f"_{test_names(fit.tree).index(test) + 1}": test for test in peak_names(fit.tree)[:CHAINS_SHOWN]}


@figure("posterior", name="corner", what="The corner plot", each=chains_shown)
def corner_plot(fit: "Fit", test: str) -> FigureWithCaption:
    """Pairs of parameters of one test with contours that hold 50 and 90 % of the posterior."""
    names = CORNER if "Y1" in fit.tree["posterior"] else CORNER_OTHER_LAW
    draws = {name: _draws(fit.tree, name, test).reshape(-1) for name in names}
    size = len(names)
    drawing = style.new_figure(150.0)
    grid = drawing.add_gridspec(size, size)
    for i, below in enumerate(names):
        for j, across in enumerate(names[: i + 1]):
            axes = drawing.add_subplot(grid[i, j])
            if i == j:
                _marginal(axes, draws[across])
            else:
                _pair(axes, draws[across], draws[below])
                axes.set_ylim(*_range(draws[below]))
            axes.set_xlim(*_range(draws[across]))
            _corner_axes(axes, _label(fit, across), _label(fit, below), last=i == size - 1, first=j == 0 and i > 0)
    drawing.align_labels()
    # the empty corner says what it is
    words = f"{style.shorten(test, 30)}\ncontours hold 50 and 90 %"
    drawing.text(0.62, 0.9, words, fontsize=8.5, va="top")
    return FigureWithCaption(
        drawing,
        caption=f"Posterior of test {test}: marginal distributions with median and 90 % interval, and pairs with "
        "contours that hold 50 and 90 % of the draws.",
        alt=f"Corner plot of {', '.join(names)} for test {test}.",
    )


@figure("convergence", name="trace", what="The traces", each=chains_shown)
def trace_plot(fit: "Fit", test: str) -> FigureWithCaption:
    """Chains of one test against the draw, coloured by ensemble, with the marginal of each ensemble beside."""
    ensemble = fit.tree["posterior"]["ensemble"].to_numpy()
    labels = list(dict.fromkeys(ensemble.tolist()))
    drawing = style.new_figure(19.5 * len(TRACE) + 10.0)
    axes = drawing.subplots(len(TRACE), 2, width_ratios=(4.5, 1.0), sharey="row", squeeze=False)
    for (left, right), name in zip(axes, TRACE, strict=True):
        draws = _draws(fit.tree, name, test)
        bins = np.linspace(draws.min(), draws.max(), 22)
        for i, label in enumerate(labels):
            colour = style.line_style(i).colour
            _ensemble(left, right, draws[ensemble == label], bins, colour, f"ensemble {label + 1}")
        left.set_ylabel(_label(fit, name).replace("noise factor", "noise\nfactor"))
        right.xaxis.set_visible(False)
        right.spines["bottom"].set_visible(False)
        right.tick_params(labelleft=False)
        left.set_xlim(0, draws.shape[1])
        left.margins(y=0.05)
        left.tick_params(labelbottom=left is axes[-1, 0])
    axes[-1, 0].set_xlabel("Draw of each walker [-]")
    handles, texts = axes[0, 0].get_legend_handles_labels()
    drawing.legend(handles, texts, loc="outside lower center", ncols=min(4, len(handles)))
    drawing.align_ylabels(axes[:, 0])
    axes[0, 0].set_title(f"{style.shorten(test, 50)}")
    return FigureWithCaption(
        drawing,
        caption=f"Chains of test {test} by ensemble: band of 90 % of an ensemble's walkers at every draw, a few "
        "walkers as lines, and the distribution of each ensemble at the right. Ensembles start apart and must agree.",
        alt=f"Trace plot of {', '.join(TRACE)} for test {test}, one colour an ensemble.",
    )


def _ensemble(left: "Axes", right: "Axes", draws: FloatArray, bins: FloatArray, colour: str, label: str) -> None:
    """Draw one ensemble, (walkers, steps)."""
    step = -(-draws.shape[1] // _STEPS)
    steps = np.arange(0, draws.shape[1], step)
    if draws.shape[0] > _WALKERS:
        low, high = np.quantile(draws[:, steps], [0.05, 0.95], axis=0)
        left.fill_between(steps, low, high, color=colour, alpha=0.12, lw=0)
    for k, walker in enumerate(draws[:_WALKERS]):
        left.plot(steps, walker[steps], color=colour, lw=0.5, alpha=0.9, label=label if k == 0 else "")
    counts, _ = np.histogram(draws, bins=bins, density=True)
    right.plot(counts, 0.5 * (bins[1:] + bins[:-1]), color=colour, lw=0.9)


def _marginal(axes: "Axes", draws: FloatArray) -> None:
    low, middle, high = np.quantile(draws, style.Q90)
    counts, edges = np.histogram(draws, bins=_bins(draws), range=_range(draws), density=True)
    axes.stairs(counts, edges, color=style.BLUE, fill=True, alpha=0.3)
    axes.stairs(counts, edges, color=style.BLUE, lw=0.9)
    axes.axvline(middle, color=style.GREY, lw=0.9)
    for edge in (low, high):
        axes.axvline(edge, color=style.GREY, lw=0.8, ls=(0, (3, 2)))
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)


def _pair(axes: "Axes", x: FloatArray, y: FloatArray) -> None:
    from scipy.ndimage import gaussian_filter

    counts, first, second = np.histogram2d(x, y, bins=_bins(x), range=[_range(x), _range(y)])
    smooth = gaussian_filter(counts.T, 1.3, mode="constant")
    ordered = np.sort(smooth.ravel())[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    levels = sorted({float(ordered[np.searchsorted(held, mass)]) for mass in _MASS})
    if levels[0] <= 0.0 or levels[-1] >= smooth.max():
        axes.plot(x[:500], y[:500], ".", ms=1, color=style.BLUE)
        return
    centres = (0.5 * (first[1:] + first[:-1]), 0.5 * (second[1:] + second[:-1]))
    axes.contourf(
        *centres,
        smooth,
        levels=[*levels, float(smooth.max())],
        colors=[style.SKY, style.BLUE][: len(levels)],
        alpha=0.55,
    )
    axes.contour(*centres, smooth, levels=levels, colors=style.BLUE, linewidths=0.8)


def _corner_axes(axes: "Axes", across: str, below: str, *, last: bool, first: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
    axes.tick_params(axis="x", labelbottom=last, rotation=45)
    if last:
        axes.set_xlabel(across)
    if axes.get_yticks().size:
        axes.yaxis.set_major_locator(MaxNLocator(3, prune="both"))
        axes.tick_params(axis="y", labelleft=first)
    if first:
        axes.set_ylabel(below)


def _bins(draws: FloatArray) -> int:
    return int(np.clip(np.sqrt(draws.size) / 2, 16, 32))


def _range(draws: FloatArray) -> tuple[float, float]:
    low, high = np.quantile(draws, [0.01, 0.99])
    margin = 0.15 * (high - low) or 0.01 * abs(high) or 1e-9
    return float(low - margin), float(high + margin)


def _draws(tree: "xr.DataTree", name: str, test: str) -> FloatArray:
    values = np.asarray(tree["posterior"][name].sel(test=test).transpose("chain", "draw").values, dtype=float)
    return 100.0 * values if name == "damping_ratio" else values


def _label(fit: "Fit", name: str) -> str:
    unit = "-" if fit.campaign.section.amplitude_unit == "A/D" else "rad"
    return LABELS.get(name, style.literal(name)).replace("{unit}", unit)
