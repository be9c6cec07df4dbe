"""The register of figures: a function that draws says which chapter it belongs to, and is found.

A new figure is one function in one file of this folder::

    @figure("griffin-plot", name="my_figure", what="The figure of mine", caption="What it shows.")
    def my_figure(fit: Fit) -> FigureWithCaption:
        drawing, axes = style.panels(1)
        ...
        return FigureWithCaption(drawing, alt="What is seen.")
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial, wraps
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from scruton.report.failures import Failures
from scruton.report.figures.style import house_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from scruton.infer.results import Fit

UNLISTED = "convergence"  # chapter of a figure that nobody registered


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

    draw: Callable[..., "FigureWithCaption | Iterable[FigureWithCaption]"]
    chapter: str
    name: str
    what: str
    source: str
    in_still_air: bool
    when: "Callable[[Fit], Any] | None"
    each: Callable[..., Mapping[str, Any]] | None


_REGISTER: dict[str, Registered] = {}


def figure(
    chapter: str,
    *,
    name: str,
    what: str = "",
    source: str = "fit",
    caption: str = "",
    in_still_air: bool = False,
    when: "Callable[[Fit], Any] | None" = None,
    each: Callable[..., Mapping[str, Any]] | None = None,
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function that draws: it runs in the style of the house, and its pages are numbered.

    Parameters
    ----------
    chapter, name, what, source, in_still_air, when, each
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
            with house_style():
                drawn = draw(*arguments, **settings)
                pages = _as_list(drawn)
            named = [
                replace(page, name=page.name or page_name(name, i), caption=page.caption or caption)
                for i, page in enumerate(pages)
            ]
            return named[0] if isinstance(drawn, FigureWithCaption) else named

        known = _REGISTER.get(name)
        if known is not None and (known.draw.__module__, known.draw.__qualname__) != (
            draw.__module__,
            draw.__qualname__,
        ):
            raise ValueError(f"two figures of the name {name}: in {known.draw.__module__} and {draw.__module__}")
        _REGISTER[name] = Registered(styled, chapter, name, what, source, in_still_air, when, each)
        return styled

    return register


def page_name(name: str, page: int) -> str:
    """Name of a page of a figure, counted from 0: the first has that of the figure."""
    return name if page == 0 else f"{name}_{page + 1}"


@cache
def registered() -> dict[str, Registered]:
    """Every figure of this folder by its name, file by file, whatever was imported before."""
    for module in iter_modules([str(Path(__file__).parent)]):
        import_module(f"{__package__}.{module.name}")
    return dict(sorted(_REGISTER.items(), key=lambda item: item[1].draw.__module__))


def registered_name(name: str) -> str:
    """Name of the figure whose page (of a name such as "records_2") this is."""
    return name if name in registered() else re.sub(r"_\d+$", "", name)


def chapter_of(name: str) -> str:
    """Key of the chapter in which a figure of this name stands."""
    entry = registered().get(registered_name(name))
    return UNLISTED if entry is None else entry.chapter


def _drawings(entry: Registered, *arguments: Any) -> Iterator[tuple[str, Callable[[], list[FigureWithCaption]]]]:
    """What draws a figure, for each thing that it is drawn for; and its name in a sentence."""
    if entry.each is None:
        yield entry.what, lambda: _as_list(entry.draw(*arguments))
        return

    def draw(ending: str, item: Any) -> list[FigureWithCaption]:
        return [replace(page, name=f"{entry.name}{ending}") for page in _as_list(entry.draw(*arguments, item))]

    for ending, item in entry.each(*arguments).items():
        yield f"{entry.what} of {item}", partial(draw, ending, item)


def _as_list(drawn: FigureWithCaption | Iterable[FigureWithCaption]) -> list[FigureWithCaption]:
    return [drawn] if isinstance(drawn, FigureWithCaption) else list(drawn)


def figures_from(source: str, *arguments: Any) -> list[FigureWithCaption]:
    """Every figure that is drawn from a sizing, or from a criticism; `arguments` go to the functions that draw."""
    entries = [entry for entry in registered().values() if entry.source == source]
    return [page for entry in entries for _, draw in _drawings(entry, *arguments) for page in draw()]


def all_figures(fit: "Fit", failures: Failures | None = None) -> list[FigureWithCaption]:
    """Every figure that this fit can fill, in the order of the register.

    Parameters
    ----------
    fit : Fit
    failures : Failures, optional
        Takes note of the figures that fail; without it, the first failure is raised.

    Returns
    -------
    list of FigureWithCaption
        Names are unique; a still-air campaign gives ring-downs alone.
    """
    in_wind = bool(fit.campaign.tests) and "posterior" in fit.tree
    found: list[FigureWithCaption] = []
    for entry in registered().values():
        if entry.source != "fit" or not (in_wind or entry.in_still_air) or (entry.when and not entry.when(fit)):
            continue
        for what, draw in _drawings(entry, fit):
            found += draw() if failures is None else failures.attempt(entry.chapter, what, draw, [])
    return found
