"""The register of figures: a function that draws says which chapter it belongs to, and is found; and figures to files.

A new figure is one function in one file of this folder, as docs/extending.md shows.
"""

import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial, wraps
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from scruton.documents import write_bytes
from scruton.report.conventions import conventions
from scruton.report.failures import Failures
from scruton.report.figures.style import house_style, plain_numbers
from scruton.report.render_typst import rasterised
from scruton.report.thresholds import DOTS_PER_INCH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from scruton.infer.results import Fit

UNLISTED = "convergence"  # chapter of a figure that nobody registered
FORMATS = ("svg", "png", "pdf")
_FAR = re.compile(rb"(?<![\d.])(-?)\d{5,}(?:\.\d+)?")
# Dates and program versions would make every run's files differ.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@dataclass(frozen=True, eq=False)
class FigureWithCaption:
    """A figure ready to be placed.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
    name : str
        Stem of the file it is saved under; given by the register where it is left out.
    caption : str
        What stands below it; that of the register where it is left out.
    alt : str
        What it shows, for a reader who cannot see it.
    """

    figure: "Figure"
    name: str = ""
    caption: str = ""
    alt: str = ""


Drawn = FigureWithCaption | Iterable[FigureWithCaption]


@dataclass(frozen=True)
class Registered:
    """A figure of the register.

    Attributes
    ----------
    draw : callable
        Draws it, or its pages.
    chapter : str
        Key of the chapter that shows it; empty where no report does.
    name : str
        Stem of its files; second pages and modes add "_2".
    what : str
        Its name in a sentence that says that it failed.
    source : str
        What it is drawn from: "fit", "sizing", "criticism", or "" where only its own caller has it.
    in_still_air : bool
        Whether a campaign without tests in wind has it, too.
    when : callable or None
        Whether a fit can fill it.
    each : callable or None
        Gives what it is drawn for one by one, by the ending of the figure's name; `draw` takes it as its last argument.
    """

    draw: Callable[..., Drawn]
    chapter: str
    name: str
    what: str = ""
    source: str = "fit"
    in_still_air: bool = False
    when: "Callable[[Fit], Any] | None" = None
    each: Callable[..., Mapping[str, Any]] | None = None


_REGISTER: dict[str, Registered] = {}


def figure(
    chapter: str = "", *, name: str, caption: str = "", **entry: Any
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function that draws: it runs in the style of the house, and its pages are numbered.

    Parameters
    ----------
    chapter, name, **entry
        As of `Registered`.
    caption : str
        Where it does not depend on what is drawn.

    Raises
    ------
    ValueError
        If another function has the name already.
    """

    def register(draw: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(draw)
        def styled(*arguments: Any, **settings: Any) -> Any:
            with house_style(), conventions(arguments[0]):
                drawn = draw(*arguments, **settings)
                pages = _as_list(drawn)
            named = [
                replace(page, name=page.name or (f"{name}_{i}" if i > 1 else name), caption=page.caption or caption)
                for i, page in enumerate(pages, 1)
            ]
            return named[0] if isinstance(drawn, FigureWithCaption) else named

        known = _REGISTER.get(name)
        if known and (known.draw.__module__, known.draw.__qualname__) != (draw.__module__, draw.__qualname__):
            raise ValueError(f"two figures of the name {name}: in {known.draw.__module__} and {draw.__module__}")
        _REGISTER[name] = Registered(styled, chapter, name, **entry)
        return styled

    return register


@cache
def registered() -> dict[str, Registered]:
    """Every figure of this folder by its name, file by file, whatever was imported before."""
    for module in iter_modules([str(Path(__file__).parent)]):
        import_module(f"{__package__}.{module.name}")
    return dict(sorted(_REGISTER.items(), key=lambda item: item[1].draw.__module__))


def registered_name(name: str) -> str:
    """Name of the figure whose page (of a name such as "records_2", or "risk_1_torsional") this is."""
    return name if name in registered() else re.sub(r"(_\d+)?(_heaving|_torsional)?$", "", name)


def chapter_of(name: str) -> str:
    """Key of the chapter in which a figure of this name stands."""
    entry = registered().get(registered_name(name))
    return UNLISTED if entry is None else entry.chapter


def _as_list(drawn: Drawn) -> list[FigureWithCaption]:
    return [drawn] if isinstance(drawn, FigureWithCaption) else list(drawn)


def _drawn(
    entries: Iterable[Registered], arguments: Sequence[Any], failures: Failures | None
) -> Iterator[FigureWithCaption]:
    """Every page of these figures, for each thing that they are drawn for, none before it is asked for."""
    for entry in entries:
        for ending, item in (entry.each(*arguments) if entry.each else {"": None}).items():
            what, more = (f"{entry.what} of {item}", [item]) if entry.each else (entry.what, [])
            draw: Callable[[], Any] = partial(entry.draw, *arguments, *more)
            drawn = draw() if failures is None else failures.attempt(entry.chapter, what, draw, [])
            yield from (replace(page, name=f"{page.name}{ending}") for page in _as_list(drawn))


def figures_from(source: str, *arguments: Any) -> list[FigureWithCaption]:
    """Every figure that is drawn from a sizing, or from a criticism; `arguments` go to the functions that draw."""
    return list(_drawn([entry for entry in registered().values() if entry.source == source], arguments, None))


def all_figures(fit: "Fit", failures: Failures | None = None) -> Iterator[FigureWithCaption]:
    """Every figure that this fit can fill, in the order of the register, each drawn when it is asked for.

    Parameters
    ----------
    fit : Fit
    failures : Failures, optional
        Takes note of the figures that fail; without it, the first failure is raised.

    Yields
    ------
    FigureWithCaption
        Names are unique; a still-air campaign gives ring-downs alone.
    """
    in_wind = bool(fit.campaign.tests) and "posterior" in fit.tree
    wanted = [entry for entry in registered().values() if entry.source == "fit" and (in_wind or entry.in_still_air)]
    yield from _drawn([entry for entry in wanted if not entry.when or entry.when(fit)], [fit], failures)


def save(
    figure: "Figure | FigureWithCaption", folder: Path, name: str = "", *, formats: Sequence[str] = FORMATS
) -> list[Path]:
    """Write a figure as SVG, PNG (200 dpi) and PDF.

    Parameters
    ----------
    figure : Figure or FigureWithCaption
    folder : Path
        Made if it is not there.
    name : str
        Stem of the files; that of the figure with caption if left out.
    formats : sequence of str
        Some of `FORMATS`.

    Returns
    -------
    list of Path
        The files, in the order of `formats`.

    Raises
    ------
    ValueError
        If there is no name.
    """
    stem = name or getattr(figure, "name", "")
    if not stem:
        raise ValueError("a figure needs a name to be saved under")
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{stem}.{kind}" for kind in formats]
    for path, content in zip(paths, contents(figure, formats), strict=True):
        write_bytes(path, content)
    return paths


def contents(figure: "Figure | FigureWithCaption", formats: Sequence[str] = FORMATS) -> list[bytes]:
    """What `save` writes, as bytes in the order of `formats`."""
    drawing = figure.figure if isinstance(figure, FigureWithCaption) else figure
    description = {"Title": figure.caption, "Description": figure.alt} if isinstance(figure, FigureWithCaption) else {}
    files: dict[str, bytes] = {}
    with house_style(), laid_out_once(drawing):
        for kind in dict.fromkeys("svg" if kind == "png" else kind for kind in formats):
            content = io.BytesIO()
            metadata = _METADATA[kind] | (description if kind == "svg" else {})
            drawing.savefig(content, format=kind, dpi=DOTS_PER_INCH, metadata=metadata)
            files[kind] = rounded(content.getvalue()) if kind == "svg" else content.getvalue()
    return [rasterised(files["svg"]) if kind == "png" else files[kind] for kind in formats]


@contextmanager
def labels_by_themselves(figure: "Figure") -> Iterator[None]:
    """Leave labels unaligned while panels are placed: none takes more room than the widest of its row or column.

    Where each is to stand beside all others every one of them is measured once for each.
    """
    from matplotlib.cbook import Grouper

    groups: Any = figure
    aligned = groups._align_label_groups
    groups._align_label_groups = {axis: Grouper() for axis in aligned}
    try:
        yield
    finally:
        groups._align_label_groups = aligned


@contextmanager
def laid_out_once(figure: "Figure") -> Iterator[None]:
    """Lay out before the first file rather than before each: many panels take a second."""
    engine, dpi = figure.get_layout_engine(), figure.dpi
    figure.dpi = DOTS_PER_INCH
    plain_numbers(figure)
    if engine is not None:
        with labels_by_themselves(figure):
            engine.execute(figure)
    figure.set_layout_engine(None)  # "none" leaves a placeholder, for which every file is drawn twice
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.dpi = dpi


def rounded(svg: bytes) -> bytes:
    """Round the coordinates of paths and marks to a hundredth of a point: a third of the file is such digits.

    What lies ten thousand points off, as a band does that has no upper end, is brought to there: it ends the process
    of the rasteriser, which counts in 16 bits.
    """

    def near(attribute: re.Match[bytes]) -> bytes:
        return _FAR.sub(rb"\g<1>9999", re.sub(rb"(\.\d\d)\d+", rb"\1", attribute.group()))

    return re.sub(rb'\s(?:d|x|y)="[^"]*"', near, svg)
