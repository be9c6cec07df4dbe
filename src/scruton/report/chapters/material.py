"""What the chapters of a report are written from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from scruton.report.document import Picture

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

# Which chapter a figure belongs to, by the start of its name; what is not listed goes to the last one.
SECTIONS = (
    ("records", ("records",)),
    ("structural", ("ring_down",)),
    ("aerodynamic", ("aerodynamic", "stability")),
    ("reciprocal", ("griffin_reciprocal", "reciprocal")),
    ("griffin", ("griffin", "laws")),
    ("speed", ("lock_in",)),
    ("trial", ("trial",)),
    ("posterior", ("corner",)),
    ("convergence", ("trace",)),
    ("gap", ("gap",)),
    ("sizing", ("risk", "shares", "damper", "cost", "information", "required_damping")),
)

# Chapters that hold a section of another name.
_HOLDERS = {"griffin": "griffin-plot", "speed": "griffin-plot", "trial": "records", "other": "convergence"}


def section_of(name: str) -> str:
    """The chapter that a figure of this name belongs to."""
    return next((section for section, starts in SECTIONS if name.startswith(starts)), "other")


def chapter_of(name: str) -> str:
    """Key of the chapter in which a figure of this name stands."""
    section = section_of(name)
    return _HOLDERS.get(section, section)


@dataclass(frozen=True, eq=False)
class Material:
    """Results of a run, for the chapters.

    Attributes
    ----------
    fit : Fit
    frames : mapping
        Tables by name, as of `scruton.report.tables.tables`.
    pictures : sequence of Picture
        In the order in which they shall stand; each goes to the chapter that its name belongs to.
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

    def of(self, section: str) -> tuple[Picture, ...]:
        """Pictures of a section, in order."""
        return tuple(one for one in self.pictures if section_of(one.name) == section)

    def cautions(self) -> list[str]:
        """What the reader must know of the predictions, each once."""
        return list(dict.fromkeys(flag for one in self.design for flag in one.flags))
