"""Figures to files: SVG and PDF for print, PNG for the screen; the same figure gives the same bytes."""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.documents import write_bytes
from scruton.report.figures.registry import FigureWithCaption
from scruton.report.figures.style import house_style
from scruton.report.thresholds import DOTS_PER_INCH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("svg", "png", "pdf")
# Dates and program versions would make every run's files differ.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


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
    stem = name or (figure.name if isinstance(figure, FigureWithCaption) else "")
    if not stem:
        raise ValueError("a figure needs a name to be saved under")
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{stem}.{kind}" for kind in formats]
    for path, content in zip(paths, contents(figure, formats), strict=True):
        write_bytes(path, content)
    return paths


def contents(figure: "Figure | FigureWithCaption", formats: Sequence[str] = FORMATS) -> list[bytes]:
    """What `save` writes, as bytes in the order of `formats`."""
    bare = figure.figure if isinstance(figure, FigureWithCaption) else figure
    found = []
    with house_style(), laid_out_once(bare):
        for kind in formats:
            metadata = dict(_METADATA[kind])
            if kind == "svg" and isinstance(figure, FigureWithCaption):
                metadata |= {"Title": figure.caption, "Description": figure.alt}
            content = io.BytesIO()
            bare.savefig(content, format=kind, dpi=DOTS_PER_INCH, metadata=metadata)
            found.append(rounded(content.getvalue()) if kind == "svg" else content.getvalue())
    return found


@contextmanager
def laid_out_once(figure: "Figure") -> Iterator[None]:
    """Lay out before the first file rather than before each: many panels take a second."""
    engine, dpi = figure.get_layout_engine(), figure.dpi
    figure.dpi = DOTS_PER_INCH
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.dpi = dpi


def rounded(svg: bytes) -> bytes:
    """Round the coordinates of paths and marks to a hundredth of a point: a third of the file is such digits."""

    def cut(found: re.Match[bytes]) -> bytes:
        return re.sub(rb"(\.\d\d)\d+", rb"\1", found.group())

    return re.sub(rb'\s(?:d|x|y)="[^"]*"', cut, svg)
