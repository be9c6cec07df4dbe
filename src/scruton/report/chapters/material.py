"""What the chapters of a report are written from, and what makes a function one of them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from scruton.report.document import Block, Chapter, Picture
from scruton.report.figures.registry import chapter_of, registered_name

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit


@dataclass(frozen=True, eq=False)
class Material:
    """Results of a run, for the chapters.

    Attributes
    ----------
    fit : Fit
    frames : mapping
        Tables by name, as of `scruton.report.tables.tables`.
    pictures : sequence of Picture
        In the order in which they shall stand; each goes to the chapter that its figure is registered with.
    design : sequence of Prediction
        Predictions at the design Scruton numbers that were asked for.
    at_tests, crossed : mapping
        Predictions by test: for another setting at its Scruton number, and of it from the other peak tests.
    gap : mapping or None
        Content of gap.json; None where no diagnosis was made.
    sizing : mapping or None
        Content of sizing.json; None without a bridge.
    """

    fit: "Fit"
    frames: "Mapping[str, pd.DataFrame]"
    pictures: Sequence[Picture] = ()
    design: "Sequence[Prediction]" = ()
    at_tests: "Mapping[str, Prediction]" = field(default_factory=dict)
    crossed: "Mapping[str, Prediction]" = field(default_factory=dict)
    gap: Mapping[str, Any] | None = None
    sizing: Mapping[str, Any] | None = None

    @property
    def in_wind(self) -> bool:
        """Whether the fit holds a test in wind."""
        return bool(self.fit.summary["tests"])

    @property
    def unit(self) -> str:
        """Unit of amplitudes."""
        return self.fit.campaign.section.amplitude_unit

    def of(self, chapter: str) -> tuple[Picture, ...]:
        """Pictures of a chapter, in order."""
        return tuple(one for one in self.pictures if chapter_of(one.name) == chapter)

    def figure(self, name: str) -> tuple[Picture, ...]:
        """Every page of the figure that is registered under a name."""
        return tuple(one for one in self.pictures if registered_name(one.name) == name)

    def cautions(self) -> list[str]:
        """What the reader must know of the predictions, each once."""
        return list(dict.fromkeys(flag for one in self.design for flag in one.flags))

    def measured_or_found(self, test: str) -> float:
        """Stable amplitude of a test as the laboratory states it, else the median of its posterior."""
        measured = self.fit.campaign.test(test).stable_amplitude
        if measured is not None:
            return measured.mean
        entry = next(one for one in self.fit.summary["tests"] if one["name"] == test)
        return float(entry["parameters"]["a_star"]["median"])


@dataclass(frozen=True)
class ChapterWriter:
    """A function that writes a chapter, with the key and title under which it is found, also where it fails."""

    key: str
    title: str
    blocks: Callable[[Material], Iterable[Block]]
    appendix: bool = False

    def blank(self) -> Chapter:
        """The chapter without a block."""
        return Chapter(self.key, self.title, (), self.appendix)

    def __call__(self, material: Material) -> Chapter:
        """Write it; without a block it is left out of the report."""
        return Chapter(self.key, self.title, tuple(self.blocks(material)), self.appendix)


def chapter(
    key: str, title: str, *, appendix: bool = False
) -> Callable[[Callable[[Material], Iterable[Block]]], ChapterWriter]:
    """Make a function that gives blocks a chapter."""
    return lambda blocks: ChapterWriter(key, title, blocks, appendix)
