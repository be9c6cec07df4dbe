"""What the chapters of a report are written from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from scruton.campaign.schema import Motion
from scruton.report.conventions import flag_texts, shown_in
from scruton.report.document import Picture
from scruton.report.figures.registry import chapter_of, registered_name
from scruton.report.wording import estimate, unit_text

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit
    from scruton.infer.sensitivity import PredictionSensitivity


@dataclass(frozen=True, eq=False)
class Material:
    """Results of a run, for the chapters."""

    fit: "Fit"
    frames: "Mapping[str, pd.DataFrame]"  # by name, as of `scruton.report.tables.tables`
    pictures: Sequence[Picture] = ()  # in their order; each goes to the chapter that its figure is registered with
    design: "Sequence[Prediction]" = ()  # at the Scruton numbers that were asked for
    at_tests: "Mapping[str, Prediction]" = field(default_factory=dict)  # for another setting at a test's Scruton number
    crossed: Mapping[str, Any] = field(default_factory=dict)  # of a peak test from the others, as JSON has predictions
    gap: Mapping[str, Any] | None = None  # content of gap.json, where a diagnosis was made
    charts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # of interactive pictures, drawn or not
    sizing: Mapping[str, Any] | None = None  # content of sizing.json, where there is a bridge
    other: Mapping[str, Any] | None = None  # that of the other motion, where both were sized
    sensitivity: "Sequence[PredictionSensitivity]" = ()  # of predictions to what the card says

    @property
    def tests(self) -> list[dict[str, Any]]:
        """Summary of every test in wind."""
        tests: list[dict[str, Any]] = self.fit.summary["tests"]
        return tests

    @property
    def unit(self) -> str:
        """Unit of amplitudes."""
        return self.fit.campaign.section.amplitude_unit

    @property
    def shown(self) -> tuple[float, str]:
        """Factor and unit by which a reader is shown amplitudes: degrees in the place of radians."""
        factor, unit = shown_in(self.unit)
        return factor, unit_text(unit)

    @property
    def heaving(self) -> bool:
        """Whether the section heaves: else it twists."""
        return self.fit.campaign.section.motion is Motion.HEAVING

    @property
    def sizings(self) -> "list[Mapping[str, Any]]":
        """What was sized: nothing, the motion of the fit, or both."""
        return [content for content in (self.sizing, self.other) if content is not None]

    @property
    def sizing_flags(self) -> list[str]:
        """Flags of the sizing, as they are shown, each once."""
        return list(dict.fromkeys(flag for one in self.sizings for flag in flag_texts(one["flags"], one)))

    @property
    def bridge_sha256(self) -> dict[str, str]:
        """SHA-256 of the files of the bridge, by name; of none where there is no bridge."""
        return {**(self.sizing or {}).get("provenance", {}).get("bridge_sha256", {})}

    def of(self, chapter: str) -> list[Picture]:
        """Pictures of a chapter, in order."""
        return [picture for picture in self.pictures if chapter_of(picture.name) == chapter]

    def figure(self, name: str) -> list[Picture]:
        """Every page of the figure that is registered under a name."""
        return [picture for picture in self.pictures if registered_name(picture.name) == name]

    def cautions(self) -> list[str]:
        """What the reader must know of the predictions, each once."""
        return list(dict.fromkeys(flag for prediction in self.design for flag in prediction.flags))

    def measured_or_found(self, test: str) -> float:
        """Stable amplitude of a test as the laboratory states it, else the median of its posterior."""
        measured = self.fit.campaign.test(test).stable_amplitude
        if measured is not None:
            return measured.mean
        return float(next(entry["parameters"]["a_star"]["median"] for entry in self.tests if entry["name"] == test))

    def in_model_unit(self, entry: Mapping[str, Any]) -> tuple[str, str, str]:
        """An amplitude as a length at the model's scale, or in degrees: median, 90 % interval and unit."""
        factor, unit = shown_in("m" if self.heaving else self.unit)
        scale = factor * (self.fit.campaign.section.depth if self.heaving else 1.0)
        return (*estimate(entry, scale), unit_text(unit))

    def discrepancy(self) -> str:
        """What was found of the discrepancy between settings, in words."""
        parameters = self.fit.summary["campaign"].get("parameters")
        if not parameters:
            return ""
        amplitude, strength = (
            "{} (90 %: {})".format(*estimate(parameters[f"discrepancy_{of}"])) for of in ("amplitude", "relaxation")
        )
        return f"{amplitude} in the logarithm of the amplitude and {strength} in that of G"
