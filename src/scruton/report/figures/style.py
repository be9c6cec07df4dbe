"""How every figure looks: page width, type, colours that a colour-blind reader tells apart, and decimation."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from unicodedata import bidirectional

import numpy as np

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.report import typefaces
from scruton.report.conventions import shown_in
from scruton.report.wording import unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

WIDTH = 160.0 / 25.4  # inches: the text width of an A4 page
Q90 = (0.05, 0.5, 0.95)  # quantiles: median, and the bounds of 90 %
Z90 = 1.645  # the same in standard deviations of a normal

# Okabe and Ito (2008), "Color Universal Design": told apart under every common colour blindness.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY, LIGHT = "#6E6E6E", "#C8C8C8"

LEFT_TO_RIGHT = "\N{LEFT-TO-RIGHT MARK}"
_OURS = "scruton "  # before the name of a typeface: none of the machine's is called so

# Colour never speaks alone: each comes with a line style and a marker of its own.
_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
_LINES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (6, 1.5, 1, 1.5)), (0, (1.2, 1.2)), (0, (8, 2)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")

_PARAMETERS: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "figure.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-4, 5),
    "axes.xmargin": 0.02,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.5,
    "patch.linewidth": 0.6,
    "hatch.linewidth": 0.4,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "figure.constrained_layout.w_pad": 0.04,
    "figure.constrained_layout.h_pad": 0.04,
    "svg.hashsalt": "scruton",  # the same identifiers each time
}


@dataclass(frozen=True)
class LineStyle:
    """Colour, line style and marker of one test."""

    colour: str
    line: Any
    marker: str

    @property
    def pen(self) -> dict[str, Any]:
        """What matplotlib draws a line of it with."""
        return {"color": self.colour, "ls": self.line}


def line_style(index: int) -> LineStyle:
    """Style of the test at this place in the campaign; distinct for the first 35."""
    round_trip, colour = divmod(index, len(_COLOURS))
    return LineStyle(_COLOURS[colour], _LINES[(colour + round_trip) % len(_LINES)], _MARKERS[(colour + round_trip) % 7])


@cache
def _families() -> tuple[str, ...]:
    """Make the typefaces known to matplotlib; their names there."""
    from matplotlib.font_manager import FontEntry, fontManager

    fontManager.ttflist += [
        FontEntry(str(face.path), face.index, f"{_OURS}{face.family}", face.style, weight=face.weight, size="scalable")
        for face in typefaces.typefaces()
    ]
    return tuple(f"{_OURS}{family}" for family in typefaces.families())


@contextmanager
def _fonts_found_once() -> Iterator[None]:
    """Matplotlib asks for every family anew whenever a text is laid out: two thirds of the time of a figure."""
    from matplotlib.font_manager import fontManager

    manager: Any = fontManager
    plain = manager._find_fonts_by_props
    manager._find_fonts_by_props = cache(plain)
    try:
        yield
    finally:
        manager._find_fonts_by_props = plain


@contextmanager
def house_style() -> Iterator[None]:
    """Set matplotlib's parameters for the time of drawing or saving, and put them back."""
    # it warns where it keeps its cache when there is no folder to write to, and that Chinese comes in one weight alone
    log = logging.getLogger("matplotlib")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        import matplotlib as mpl

        with mpl.rc_context():
            mpl.rcdefaults()  # the user's own matplotlibrc is for the user's own figures
            mpl.rcParams.update({"font.family": list(_families()), **_PARAMETERS})
            with _fonts_found_once():
                yield
    finally:
        log.setLevel(level)


def plain_numbers(figure: "Figure") -> None:
    """Set the numbers of linear axes as text: only a power beside the axis needs the typesetter of formulas."""
    from matplotlib.ticker import ScalarFormatter

    class Numbers(ScalarFormatter):
        def __call__(self, x: float, pos: int | None = None) -> str:
            return super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(Numbers())


@dataclass
class _Place:
    """Axes of a user, and the page of a figure that goes there."""

    axes: "Axes"
    page: int
    drawn: int = 0

    def claimed(self) -> bool:
        """Whether the page that now begins is the one."""
        self.drawn += 1
        return self.drawn == self.page


_PLACE: ContextVar[_Place | None] = ContextVar("place", default=None)


@contextmanager
def placed(axes: "Axes | None", page: int = 1) -> Iterator[None]:
    """Draw this page of what is drawn within in a user's axes: one panel in them, several in their place."""
    token = _PLACE.set(None if axes is None else _Place(axes, page))
    try:
        yield
    finally:
        _PLACE.reset(token)


def new_figure(height_mm: float) -> "Figure":
    """Start an empty figure of the page's width, laid out so that nothing overlaps; in a user's axes, a part of theirs.

    InputError where those axes are no subplot, in whose place several panels could stand.
    """
    from matplotlib.figure import Figure

    place = _PLACE.get()
    if place is None or not place.claimed():
        return Figure(figsize=(WIDTH, height_mm / 25.4), layout="constrained")
    spec = place.axes.get_subplotspec()
    if spec is None:
        raise InputError("plot", "ax", "axes that are no subplot", "those of plt.subplots, for several panels")
    place.axes.set_visible(False)
    part: Figure = place.axes.get_figure().add_subfigure(spec)  # type: ignore[union-attr, assignment]
    return part


def alone(height_mm: float) -> "tuple[Figure, Axes]":
    """Start a figure of one panel."""
    if (place := _PLACE.get()) is not None and place.claimed():
        return place.axes.get_figure(), place.axes  # type: ignore[return-value]
    token = _PLACE.set(None)
    drawing = new_figure(height_mm)
    _PLACE.reset(token)
    return drawing, drawing.subplots()


def panels(count: int, *, columns: int = 2, height_mm: float = 52.0, **kwargs: Any) -> "tuple[Figure, list[Axes]]":
    """Lay out a figure with `count` panels, at most `columns` abreast, `height_mm` a row; unused places stay empty."""
    columns = min(columns, count)
    rows = -(-count // columns)
    # one panel alone is drawn wide, hence a little higher
    figure = new_figure(rows * height_mm * (1.35 if count == 1 else 1.0) + 8.0)
    flat = list(figure.subplots(rows, columns, squeeze=False, **kwargs).flat)
    for spare in flat[count:]:
        spare.set_visible(False)
    return figure, flat[:count]


def outer_labels(axes: "Sequence[Axes]", x: str, y: str, *, columns: int = 2) -> None:
    """Label the outer panels: horizontal axes at the bottom, vertical ones at the left."""
    columns = min(columns, len(axes))
    for panel in axes[::columns]:
        panel.set_ylabel(y)
    for panel in axes[-columns:]:
        panel.set_xlabel(x)


def pages(items: Sequence[Any], size: int) -> list[Sequence[Any]]:
    """Split into pages of at most `size`, evenly filled."""
    if not items:
        return []
    count = -(-len(items) // size)
    each = -(-len(items) // count)
    return [items[i : i + each] for i in range(0, len(items), each)]


def below(figure: "Figure", axes: "Sequence[Axes]", *, columns: int = 3) -> None:
    """Put one legend for all panels below them, or in a place that no panel fills, with every label once."""
    handles = legend_handles(axes)
    if (place := _PLACE.get()) is not None and list(axes) == [place.axes]:  # the rest of the figure is the user's
        axes[0].legend(handles.values(), handles.keys())
        return
    spare = [panel for panel in figure.axes if not panel.get_visible()]
    if spare:
        spare[0].set_visible(True)
        spare[0].set_axis_off()
        spare[0].legend(handles.values(), handles.keys(), loc="center")
    elif handles:
        # as many columns as fit: some 105 letters, of which each handle takes the room of eight; Chinese is wide
        widths = [8 + sum(2 if ord(letter) > 0x2E7F else 1 for letter in label) for label in handles]
        counts = range(min(columns, len(handles)), 1, -1)
        fitting = (n for n in counts if sum(int(part.max()) for part in np.array_split(widths, n)) <= 105)
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=next(fitting, 1))
    figure.align_ylabels()


def legend_handles(axes: "Sequence[Axes]") -> dict[str, Any]:
    """What a legend shows of several panels, every label once."""
    handles: dict[str, Any] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    return handles


def halo() -> list[Any]:
    """What a name is drawn with, so that no line strikes it."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=3.0, foreground="white")]


def shorten(text: str, length: int = 34) -> str:
    """Cut a long name in its middle, where names differ least."""
    if len(text) <= length:
        return literal(text)
    tail = (length - 1) // 2
    return literal(f"{text[: length - 1 - tail]}\N{HORIZONTAL ELLIPSIS}{text[-tail:]}")


def literal(text: str) -> str:
    """Keep a name to itself: no mathematics, no line breaks, no right-to-left letters that draw what follows along."""
    edge = LEFT_TO_RIGHT if any(bidirectional(letter) in ("R", "AL") for letter in text) else ""
    return edge + " ".join(text.split()).replace("$", r"\$") + edge


def decimate(x: FloatArray, y: FloatArray, bins: int) -> tuple[FloatArray, FloatArray]:
    """Keep the smallest and largest sample of `bins` stretches of equal count, so that a long record draws alike."""
    if len(y) <= 2 * bins:
        return x, y
    edges = np.linspace(0, len(y), bins + 1).astype(int)
    ends = [(begin + y[begin:end].argmin(), begin + y[begin:end].argmax()) for begin, end in pairwise(edges)]
    keep = np.sort(ends).ravel()
    return x[keep], y[keep]


def extremes(x: FloatArray, y: FloatArray, bins: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middle, smallest and largest sample of every bin, to be filled between where cycles themselves cannot be seen."""
    starts = np.linspace(0, len(y), bins, endpoint=False).astype(int)
    middle = np.append((starts[:-1] + starts[1:]) // 2, (starts[-1] + len(y)) // 2)
    return x[middle], np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)


def thin_along(values: FloatArray, count: int) -> np.ndarray:
    """Indices of at most `count` points along a curve, dense where `values` change, so that corners stay round."""
    if len(values) <= count:
        return np.arange(len(values))
    path = np.append(0.0, np.cumsum(np.abs(np.diff(np.nan_to_num(values)))))
    position = path / (path[-1] or 1.0) + 0.2 * np.linspace(0.0, 1.0, len(values))
    return np.unique(np.searchsorted(position, np.linspace(0.0, position[-1], count)).clip(0, len(values) - 1))


def bounded(values: FloatArray) -> FloatArray:
    """Draw infinity as far out as no axis reaches."""
    return np.where(np.isinf(values), np.sign(values) * 1e6, values)


def plain_log(axis: "Axis") -> None:
    """Label a logarithmic axis with plain numbers: at 1, 2 and 5 of each decade, or at decades where it spans many.

    An axis too short for two of these has a few round numbers.
    """
    from matplotlib.ticker import FormatStrFormatter, Locator, LogLocator, MaxNLocator, NullFormatter

    low, high = axis.get_view_interval()
    decades: Locator = LogLocator(subs=(1.0, 2.0, 5.0) if high < 80.0 * low else (1.0,), numticks=12)
    axis.set_major_locator(MaxNLocator(5) if high < 2.5 * low else decades)
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def rows(axes: "Axes", labels: Sequence[str], **words: Any) -> None:
    """Name the rows of a panel that counts downwards."""
    axes.set_yticks(range(len(labels)), labels, **words)
    axes.set_ylim(len(labels) - 0.4, -0.6)


def amplitude_label(unit: str, name: str = "Amplitude") -> str:
    """Axis label of an amplitude that files hold in this unit."""
    return f"{name} A/D [-]" if unit == "A/D" else f"{name} [{unit_text(shown_in(unit)[1])}]"
