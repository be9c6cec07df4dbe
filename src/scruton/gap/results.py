"""What `scruton diagnose` found, read back from a folder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from scruton.documents import read_document
from scruton.errors import InputError
from scruton.shown import shown

RESULT, FORMAT = "gap.json", 1


def _facts(one: "SavedDiagnosis") -> Mapping[str, object]:
    also = [f"{name} {one.probability_also[name]:.0%}" if name in one.probability_also else name for name in one.also]
    probable = sorted(one.probability.items(), key=lambda pair: -pair[1])[:3]
    return {
        "verdict": one.verdict, "also": ", ".join(also) or "-",
        "probability": ", ".join(f"{name} {p:.0%}" for name, p in probable), "advice": len(one.advice),
    }  # fmt: skip


@shown(_facts)
@dataclass(frozen=True, eq=False)
class SavedDiagnosis:
    """The content of a gap.json; amplitudes are A/D or rad, times in s.

    Attributes
    ----------
    verdict : str
        Name of an effect, "none" or "unknown".
    also : sequence of str
        Further effects, strongest first.
    probability : mapping of str to float
        Of every effect considered, "none" and "unknown"; they sum to 1.
    indistinguishable : sequence of sequence of str
        Effects that these data cannot tell apart, the verdict's group first.
    where : sequence of mapping
        Where the records part from the null model.
    shrink : mapping
        How far the gap shrinks with the effect in the model; empty where there is no gap.
    effects : mapping
        Parameters of the effects that were found, by effect and name.
    advice : sequence of str
        What to measure next.
    invisible : sequence of mapping
        What these records cannot show.
    provenance : mapping
        As of `scruton.provenance.provenance`.
    probability_also : mapping of str to float
        Of each further effect, judged in its place with the others in the model.
    in_its_place : mapping of mapping of str to float
        By further effect, the probabilities of everything that might stand there instead.
    flags : sequence of str
        What was not read, and what to do about it.
    """

    verdict: str
    also: Sequence[str]
    probability: Mapping[str, float]
    indistinguishable: Sequence[Sequence[str]]
    where: Sequence[Mapping[str, Any]]
    shrink: Mapping[str, Any]
    effects: Mapping[str, Mapping[str, Any]]
    advice: Sequence[str]
    invisible: Sequence[Mapping[str, Any]]
    provenance: Mapping[str, Any]
    probability_also: Mapping[str, float] = field(default_factory=dict)
    in_its_place: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    flags: Sequence[str] = ()

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "SavedDiagnosis":
        """Take from the content of a gap.json what it has of these."""
        return cls(**{one.name: content[one.name] for one in fields(cls) if one.name in content})

    @property
    def found(self) -> tuple[str, ...]:
        """Every effect that was found, strongest first; none where the verdict is "none"."""
        return () if self.verdict == "none" else (self.verdict, *self.also)


def load_diagnosis(folder: Path | str) -> SavedDiagnosis:
    """Read back what `scruton diagnose` or `scruton report` found.

    Parameters
    ----------
    folder : Path or str
        That holds a gap.json.

    Returns
    -------
    SavedDiagnosis

    Raises
    ------
    InputError
        If there is none, it is of another version, or not as it was written.
    """
    path, wanted = Path(folder) / RESULT, "a diagnosis that this version wrote"
    if not path.is_file():
        raise InputError(path, "", "no such file", "the folder of `scruton diagnose` or `scruton report`")
    every = [one.name for one in fields(SavedDiagnosis)]
    later = ("probability_also", "in_its_place", "flags")  # an earlier version wrote none
    content = read_document(path, wanted, [name for name in every if name not in later], version=FORMAT)
    return SavedDiagnosis.of(content)
