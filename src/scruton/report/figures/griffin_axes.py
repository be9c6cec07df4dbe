"""What every plot against the Scruton number shares: its range, bands, deterministic curves, points and frame."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Quantity, Record
from scruton.envelope import FrontEnd
from scruton.griffin.bands import GriffinBand
from scruton.griffin.law_free import law_free
from scruton.griffin.posterior import draws_of, peak_names, printed_draws, test_names, unit_of
from scruton.infer.results import Fit
from scruton.report.conventions import DAMPING, SCRUTON, shown_in
from scruton.report.figures import style
from scruton.report.thresholds import CURVE_POINTS, MOST_BANDS, POINTS_LABELLED

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


SC_LABEL = "Scruton number Sc [-]"


def factors(unit: str) -> tuple[float, float]:
    """What Scruton numbers and amplitudes, or their reciprocals, of this unit are multiplied by to be shown."""
    return shown_in(SCRUTON)[0], shown_in(unit)[0]


def as_shown(band: GriffinBand) -> GriffinBand:
    """A band in the numbers that a reader is shown."""
    sc, amplitude = factors(band.unit)
    intervals = {probability: amplitude * ends for probability, ends in band.intervals.items()}
    return replace(band, scruton_number=sc * band.scruton_number, median=amplitude * band.median, intervals=intervals)


def sc_shown(limits: tuple[float, float]) -> tuple[float, float]:
    """Limits of Scruton numbers as they are shown."""
    times = shown_in(SCRUTON)[0]
    return times * limits[0], times * limits[1]


class Place(NamedTuple):
    """Where a test lies in a Griffin plot: median Sc, 5, 50 and 95 % of its stable amplitude, and the stated one.

    As files have them; a figure shows them by `factors`.
    """

    name: str
    scruton_number: float
    low: float
    median: float
    high: float
    measured: Quantity | None

    @property
    def known(self) -> list[float]:
        """Amplitudes that a plot has to hold: that of the posterior, and the measured one."""
        return [self.median] if self.measured is None else [self.median, self.measured.mean]


@lru_cache(maxsize=1)  # every figure of a fit asks
def test_points(fit: Fit) -> tuple[Place, ...]:
    """Where the peak tests lie."""
    placed = []
    for name in peak_names(fit.tree):
        printed = printed_draws(fit.tree, name)
        low, median, high = map(float, np.quantile(printed["a_star"], style.Q90))
        sc = float(np.median(printed["scruton_number"]))
        placed.append(Place(name, sc, low, median, high, fit.campaign.test(name).stable_amplitude))
    return tuple(placed)


def line_styles(tree: "xr.DataTree") -> dict[str, style.LineStyle]:
    """The style of every test, the same in all figures; peak tests have the first and most different ones."""
    order = dict.fromkeys([*peak_names(tree), *test_names(tree)])
    return {name: style.line_style(i) for i, name in enumerate(order)}


def sc_range(tree: "xr.DataTree") -> tuple[float, float]:
    """Scruton numbers worth drawing: those of the peak tests, a little beyond, and somewhat below zero."""
    sc, reach = (
        [float(np.median(draws_of(tree, key, name))) for name in peak_names(tree)]
        for key in ("scruton_number", "relaxation_scruton_number")
    )
    upper = 1.15 * max(sc)
    if max(sc) < 1.5 * min(sc):  # one setting: show what one relaxation rate more of damping does
        upper = max(upper, max(sc) + float(np.median(reach)))
    lower = max(-0.1 * upper, min(s - 0.9 * r for s, r in zip(sc, reach, strict=True)))
    return min(lower, -0.02 * upper), upper


def front_ends(fit: Fit, tests: Sequence[str]) -> Iterator[tuple[str, Record, FrontEnd]]:
    """Test, record and result of the paper's own procedure, one for each transient record of these tests."""
    for name in tests:
        for record in fit.campaign.test(name).records:
            if record.name in fit.front_ends:
                yield name, record, fit.front_ends[record.name]


def thinned_curve(front: FrontEnd, count: int) -> tuple[FloatArray, FloatArray]:
    """Scruton numbers and amplitudes of at most `count` points along a constructed Griffin curve."""
    curve = front.griffin
    pick = style.thin_along(np.log(np.maximum(curve.amplitude, 1e-12)), count)
    return curve.scruton_number[pick], curve.amplitude[pick]


def draw_bands(axes: "Axes", fit: Fit, bands: Sequence[GriffinBand], label: str = "") -> None:
    """Medians with 50 and 90 % bands, where they are not too many; a median is thin where its band is extrapolated."""
    draw_shown(axes, fit, [*map(as_shown, bands)], label)


def draw_shown(axes: "Axes", fit: Fit, bands: Sequence[GriffinBand], label: str = "") -> None:
    """The same of bands in the numbers that a reader is shown."""
    styles = line_styles(fit.tree)
    for band in bands:
        look, sc, median = styles[band.label], band.scruton_number, style.bounded(band.median)
        median = np.where((median == 0.0) & (np.roll(median, 1) == 0.0), np.nan, median)  # dead: stop at the axis
        for probability, alpha in ((0.90, 0.22), (0.50, 0.35)) if len(bands) <= MOST_BANDS else ():
            interval = style.bounded(band.intervals[probability])
            axes.fill_between(sc, *interval, color=look.colour, alpha=alpha, lw=0, zorder=2)
        inner = ~band.extrapolated
        inner[1:-1] &= ~band.extrapolated[2:] & ~band.extrapolated[:-2]  # the two lines meet
        axes.plot(sc, np.where(inner, np.nan, median), **look.pen, lw=0.8, zorder=3)
        named, trusted = label or style.shorten(f"from {band.label}"), np.where(band.extrapolated, np.nan, median)
        axes.plot(sc, trusted, **look.pen, lw=1.8, label=named, zorder=3)


def shade(axes: "Axes", predictive: GriffinBand) -> None:
    """The 90 % predictive band, in grey behind everything."""
    predictive = as_shown(predictive)
    sc, ends = predictive.scruton_number, style.bounded(predictive.intervals[0.90])
    axes.fill_between(sc, *ends, color=style.LIGHT, alpha=0.45, lw=0, label="predictive, 90 %", zorder=1)
    for end in ends:
        axes.plot(sc, end, color=style.GREY, lw=0.5, zorder=1)


def deterministic(axes: "Axes", fit: Fit, tests: Sequence[str], *, reciprocal: bool = False) -> None:
    """Curves of the paper's own procedure, one for each transient record of these tests."""
    for _, _, front in front_ends(fit, tests):
        plot_curve(axes, front, unit_of(fit.tree), "Eqs. (2)-(8), deterministic", reciprocal=reciprocal)


def plot_curve(
    axes: "Axes", front: FrontEnd, unit: str, label: str, *, reciprocal: bool = False, **kwargs: Any
) -> None:
    """Draw one constructed Griffin curve; `unit` is that of amplitudes in files."""
    (sc, amplitude), (times, scale) = thinned_curve(front, CURVE_POINTS), factors(unit)
    amplitude = scale * np.where(amplitude > 0.0, amplitude, np.nan)
    pen: dict[str, Any] = {"color": style.BLACK, "ls": ":", "lw": 1.0, "zorder": 4} | kwargs
    axes.plot(times * sc, 1.0 / amplitude if reciprocal else amplitude, **pen, label=label)


def without_law(axes: "Axes", fit: Fit) -> None:
    """The curve of the damping that transients show, without a law, with its 90 % band, as far as any reached."""
    curve = law_free(fit.tree)
    if curve is None:
        return
    times, scale = factors(unit_of(fit.tree))
    amplitude, (low, middle, high) = scale * curve.band()[0], (times * line for line in curve.band()[1])
    axes.fill_betweenx(amplitude, low, high, color=style.BLACK, alpha=0.12, lw=0, zorder=1)
    axes.plot(middle, amplitude, color=style.BLACK, ls="--", lw=1.1, zorder=4, label="measured damping, no law, 90 %")


def points(
    axes: "Axes", fit: Fit, *, reciprocal: bool = False, against_damping: bool = False, posteriors: bool = True
) -> None:
    """Measured stable amplitudes (filled, named) and each test's own posterior (open), where they were tested."""
    styles, (times, scale) = line_styles(fit.tree), factors(unit_of(fit.tree))
    named: list[tuple[str, float, float]] = []
    for place in test_points(fit):
        x, look, measured = times * place.scruton_number, styles[place.name], place.measured
        if against_damping:
            x = shown_in(DAMPING)[0] * float(np.median(draws_of(fit.tree, "damping_ratio", place.name)))
        low, middle, high = (scale * value for value in (place.low, place.median, place.high))
        if reciprocal:
            low, middle, high = 1.0 / high, 1.0 / middle, 1.0 / low
        if posteriors or measured is None:
            axes.errorbar(
                [x], [middle], [[middle - low], [high - middle]], fmt=look.marker, ms=6.5, mfc="none",
                color=look.colour, elinewidth=0.8, capsize=2, zorder=5, label="posterior of each test, 90 %",
            )  # fmt: skip
        at = middle
        if measured is not None and measured.mean > 0.0:
            mean, sd = scale * measured.mean, scale * style.Z90 * (measured.sd or 0.0)
            at, spread = (1.0 / mean, sd / mean**2) if reciprocal else (mean, sd)
            axes.errorbar(
                [x], [at], spread or None, fmt=look.marker, ms=4.0, color=style.BLACK,
                elinewidth=0.8, capsize=2, zorder=6, label="measured",
            )  # fmt: skip
        named.append((place.name, x, at))
    if len(named) <= POINTS_LABELLED:
        _name_points(axes, named, rising=reciprocal)


def _name_points(axes: "Axes", named: Sequence[tuple[str, float, float]], *, rising: bool) -> None:
    """Write the names beside the points, on the outer side of the curve; neighbours are stacked away from it."""
    right = max(x for _, x, _ in named)
    top = max(y for _, _, y in named)
    away = -1.0 if rising else 1.0
    level, before = 0, (-np.inf, -np.inf)
    leader = {"arrowstyle": "-", "lw": 0.4, "color": style.GREY, "shrinkA": 0, "shrinkB": 3}
    for name, x, y in sorted(named, key=lambda point: point[1]):
        close = abs(x - before[0]) < 0.15 * right and abs(y - before[1]) < 0.12 * top
        level, before = (level + 1 if close else 0), (x, y)
        edge = x > 0.75 * right and len(named) > 1 and level == 0  # no room at the right edge
        place, sides = (5.0 + 7.0 * level, away * (5.0 + 10.0 * level)), ("left", "top" if rising else "bottom")
        if edge:  # curves of other tests run below a rising one
            place, sides = ((-6.0, 5.0), ("right", "bottom")) if rising else ((0.0, 9.0), ("center", "bottom"))
        axes.annotate(
            style.shorten(name, 18), (x, y), textcoords="offset points", zorder=7, fontsize=7.5,
            xytext=place, ha=sides[0], va=sides[1],
            path_effects=style.halo(),
            arrowprops=leader if level else None,
        )  # fmt: skip


def frame(axes: "Axes", limits: tuple[float, float], ceiling: float, *, note: float | None = 0.3) -> None:
    """Limits, and the shaded strip of negative Scruton numbers (or damping ratios), its label about height `note`.

    A low one stands on the axis: half of its length may be more than the height.
    """
    axes.set(xlim=limits, ylim=(0.0, ceiling))
    if limits[0] < 0.0:
        axes.axvspan(limits[0], 0.0, facecolor="#EFEFEF", edgecolor=style.LIGHT, hatch="////", lw=0, zorder=0)
        axes.axvline(0.0, color=style.GREY, lw=0.6, zorder=0.5)
        if note is not None:
            axes.annotate(
                "no physical meaning", (0.5 * limits[0], 0.0 if note < 0.5 else note * ceiling), rotation=90,
                xytext=(0.0, 4.0 if note < 0.5 else 0.0), textcoords="offset points",
                ha="center", va="bottom" if note < 0.5 else "center", fontsize=7.5, color=style.GREY, zorder=8,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.8},
            )  # fmt: skip
