"""What every plot against the Scruton number shares: its range, bands, deterministic curves, points and frame."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.bands import GriffinBand
from scruton.griffin.posterior import draws_of, peak_names, test_names
from scruton.report.figures import style
from scruton.report.thresholds import CURVE_POINTS, POINTS_LABELLED

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from scruton.campaign.schema import Quantity
    from scruton.envelope import FrontEnd
    from scruton.infer.results import Fit

SC_LABEL = "Scruton number Sc [-]"


@dataclass(frozen=True)
class TestPoint:
    """Where a test lies in a Griffin plot.

    Attributes
    ----------
    name : str
    scruton_number : float
        Median of its posterior.
    low, median, high : float
        Of the posterior of its stable amplitude: 5, 50 and 95 %.
    measured : Quantity or None
        The stable amplitude that the laboratory states.
    """

    __test__ = False  # no test of pytest

    name: str
    scruton_number: float
    low: float
    median: float
    high: float
    measured: "Quantity | None"

    @property
    def known(self) -> list[float]:
        """Amplitudes that a plot has to hold: that of the posterior, and the measured one."""
        return [self.median] if self.measured is None else [self.median, self.measured.mean]


def test_points(fit: "Fit", tests: Sequence[str]) -> list[TestPoint]:
    """Where these tests lie."""
    found = []
    for name in tests:
        low, median, high = map(float, np.quantile(draws_of(fit.tree, "a_star", name), style.Q90))
        sc = float(np.median(draws_of(fit.tree, "scruton_number", name)))
        found.append(TestPoint(name, sc, low, median, high, fit.campaign.test(name).stable_amplitude))
    return found


def line_styles(tree: "xr.DataTree") -> dict[str, style.LineStyle]:
    """The style of every test, the same in all figures; peak tests have the first and most different ones."""
    order = dict.fromkeys([*peak_names(tree), *test_names(tree)])
    return {name: style.line_style(i) for i, name in enumerate(order)}


def sc_range(tree: "xr.DataTree", tests: Sequence[str]) -> tuple[float, float]:
    """Scruton numbers worth drawing: the tested ones, a little beyond, and somewhat below zero."""
    sc = [float(np.median(draws_of(tree, "scruton_number", name))) for name in tests]
    reach = [float(np.median(draws_of(tree, "relaxation_scruton_number", name))) for name in tests]
    upper = 1.15 * max(sc)
    if max(sc) < 1.5 * min(sc):  # one setting: show what one relaxation rate more of damping does
        upper = max(upper, max(sc) + float(np.median(reach)))
    lower = max(-0.1 * upper, min(s - 0.9 * r for s, r in zip(sc, reach, strict=True)))
    return min(lower, -0.02 * upper), upper


def front_ends(fit: "Fit", tests: Sequence[str]) -> "Iterator[tuple[str, str, FrontEnd]]":
    """Test, record and result of the paper's own procedure, one for each transient record of these tests."""
    for name in tests:
        for record in fit.campaign.test(name).records:
            if record.name in fit.front_ends:
                yield name, record.name, fit.front_ends[record.name]


def thinned_curve(front: "FrontEnd", count: int) -> tuple[FloatArray, FloatArray]:
    """Scruton numbers and amplitudes of at most `count` points along a constructed Griffin curve."""
    curve = front.griffin
    pick = style.thin_along(np.log(np.maximum(curve.amplitude, 1e-12)), count)
    return curve.scruton_number[pick], curve.amplitude[pick]


def draw_band(axes: "Axes", one: GriffinBand, look: style.LineStyle, label: str, *, bands: bool = True) -> None:
    """Median with 50 and 90 % bands; the median is thin where the band is extrapolated."""
    sc, median = one.scruton_number, style.bounded(one.median)
    median = np.where((median == 0.0) & (np.roll(median, 1) == 0.0), np.nan, median)  # dead: stop at the axis
    if bands:
        for probability, alpha in ((0.90, 0.22), (0.50, 0.35)):
            interval = style.bounded(one.intervals[probability])
            axes.fill_between(sc, *interval, color=look.colour, alpha=alpha, lw=0, zorder=2)
    trusted = np.where(one.extrapolated, np.nan, median)
    inner = ~one.extrapolated
    inner[1:-1] &= ~one.extrapolated[2:] & ~one.extrapolated[:-2]  # the two lines meet
    axes.plot(sc, np.where(inner, np.nan, median), **look.pen, lw=0.8, zorder=3)
    axes.plot(sc, trusted, **look.pen, lw=1.8, label=style.shorten(label) or "median, 50 and 90 %", zorder=3)


def shade(axes: "Axes", grid: FloatArray, predictive: GriffinBand) -> None:
    """The 90 % predictive band, in grey behind everything."""
    low, high = style.bounded(predictive.intervals[0.90])
    axes.fill_between(grid, low, high, color=style.LIGHT, alpha=0.45, lw=0, label="predictive, 90 %", zorder=1)
    axes.plot(grid, low, color=style.GREY, lw=0.5, zorder=1)
    axes.plot(grid, high, color=style.GREY, lw=0.5, zorder=1)


def deterministic(axes: "Axes", fit: "Fit", tests: Sequence[str], *, reciprocal: bool = False) -> None:
    """Curves of the paper's own procedure, one for each transient record of these tests."""
    label = "Eqs. (2)-(8), deterministic"
    for _, _, front in front_ends(fit, tests):
        plot_curve(axes, front, reciprocal=reciprocal, label=label)
        label = ""


def plot_curve(axes: "Axes", front: "FrontEnd", *, reciprocal: bool = False, label: str = "", **kwargs: Any) -> None:
    """Draw one constructed Griffin curve."""
    sc, amplitude = thinned_curve(front, CURVE_POINTS)
    amplitude = np.where(amplitude > 0.0, amplitude, np.nan)
    pen: dict[str, Any] = {"color": style.BLACK, "ls": ":", "lw": 1.0, "zorder": 4} | kwargs
    axes.plot(sc, 1.0 / amplitude if reciprocal else amplitude, **pen, label=label)


def points(
    axes: "Axes", fit: "Fit", *, reciprocal: bool = False, against_damping: bool = False, own: bool = True
) -> None:
    """Measured stable amplitudes (filled, named) and each test's own posterior (open), where they were tested."""
    tree, styles, peaks = fit.tree, line_styles(fit.tree), set(peak_names(fit.tree))
    labels = {"measured": "measured", "own": "posterior of each test, 90 %"}
    named: list[tuple[str, float, float]] = []
    for one in test_points(fit, [name for name in test_names(tree) if name in peaks]):
        x, look, measured = one.scruton_number, styles[one.name], one.measured
        if against_damping:
            x = 100.0 * float(np.median(draws_of(tree, "damping_ratio", one.name)))
        low, middle, high = one.low, one.median, one.high
        if reciprocal:
            low, middle, high = 1.0 / high, 1.0 / middle, 1.0 / low
        if own or measured is None:
            axes.errorbar(
                [x], [middle], [[middle - low], [high - middle]], fmt=look.marker, ms=6.5, mfc="none",
                color=look.colour, elinewidth=0.8, capsize=2, zorder=5, label=labels.pop("own", ""),
            )  # fmt: skip
        at = middle
        if measured is not None and measured.mean > 0.0:
            at = 1.0 / measured.mean if reciprocal else measured.mean
            sd = style.Z90 * (measured.sd or 0.0)
            spread = sd / measured.mean**2 if reciprocal else sd
            axes.errorbar(
                [x], [at], [[spread], [spread]] if spread else None, fmt=look.marker, ms=4.0, color=style.BLACK,
                elinewidth=0.8, capsize=2, zorder=6, label=labels.pop("measured", ""),
            )  # fmt: skip
        named.append((one.name, x, at))
    if len(named) <= POINTS_LABELLED:
        _name_points(axes, named, rising=reciprocal)


def _name_points(axes: "Axes", named: Sequence[tuple[str, float, float]], *, rising: bool) -> None:
    """Write the names beside the points, on the outer side of the curve; neighbours are stacked away from it."""
    from matplotlib.patheffects import withStroke

    right = max(x for _, x, _ in named)
    top = max(y for _, _, y in named)
    away = -1.0 if rising else 1.0
    level, before = 0, (-np.inf, -np.inf)
    leader = {"arrowstyle": "-", "lw": 0.4, "color": style.GREY, "shrinkA": 0, "shrinkB": 3}
    for name, x, y in sorted(named, key=lambda point: point[1]):
        close = abs(x - before[0]) < 0.15 * right and abs(y - before[1]) < 0.12 * top
        level, before = (level + 1 if close else 0), (x, y)
        edge = x > 0.75 * right and len(named) > 1 and level == 0  # no room at the right edge
        axes.annotate(
            style.shorten(name, 18), (x, y), textcoords="offset points", zorder=7, fontsize=7.5,
            xytext=(0.0 if edge else 5.0 + 7.0 * level, away * (9.0 if edge else 5.0 + 10.0 * level)),
            ha="center" if edge else "left", va="top" if rising else "bottom",
            path_effects=[withStroke(linewidth=1.8, foreground="white", alpha=0.8)],
            arrowprops=leader if level else None,
        )  # fmt: skip


def frame(axes: "Axes", limits: tuple[float, float], ceiling: float, *, note: float | None = 0.3) -> None:
    """Limits, and the shaded strip of negative Scruton numbers (or damping ratios), its label at height `note`."""
    axes.set_xlim(*limits)
    axes.set_ylim(0.0, ceiling)
    if limits[0] < 0.0:
        axes.axvspan(limits[0], 0.0, facecolor="#EFEFEF", edgecolor=style.LIGHT, hatch="////", lw=0, zorder=0)
        axes.axvline(0.0, color=style.GREY, lw=0.6, zorder=0.5)
        if note is not None:
            axes.annotate(
                "no physical meaning", (0.5 * limits[0], note * ceiling), rotation=90, ha="center", va="center",
                fontsize=7.5, color=style.GREY, zorder=8,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.8},
            )  # fmt: skip


def stable_amplitude_label(unit: str) -> str:
    """Axis label of a stable amplitude."""
    label = style.amplitude_label(unit)
    return f"Stable {label[0].lower()}{label[1:]}"
