"""Truth and diagnosis of every case side by side: the sealed answers are opened, their hash is checked."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from scruton.calibrate.challenge.make import ANSWERS, CHALLENGE
from scruton.calibrate.challenge.run import CASE, GAP, cases_of
from scruton.documents import read_json
from scruton.errors import InputError

NONE, UNKNOWN, FAILED = "none", "unknown", "failed"
_ALLOWED = {"wake_oscillator": (UNKNOWN, "fluid_memory")}  # of the cases outside the catalogue


@dataclass(frozen=True)
class StableAmplitude:
    """Stable amplitude of a test left out, A/D or rad.

    Attributes
    ----------
    moved : float
        What the effect does to it, relative.
    truth, measured, before, after : float
        As simulated; as measured; as the null model and the verdict's predict it.
    """

    moved: float
    truth: float
    measured: float
    before: float
    after: float


@dataclass(frozen=True)
class Outcome:
    """One case: what is in it, and what was said of it.

    Attributes
    ----------
    case, kind : str
        Kind: none, catalogue, two, or open (outside the catalogue).
    truth : tuple of str
        Effects; empty for none.
    severity : float
    verdict : str
        "failed" where there is no diagnosis.
    also : tuple of str
    probability : mapping
        Empty where the diagnosis gives none.
    group : tuple of str
        Effects that cannot be told from the verdict, itself among them.
    shrink : float or None
        Held-out shrink; None where it was not measured.
    settled : tuple of StableAmplitude
    rigs, rigs_named : tuple of str
        Where friction is, and where it is said to be.
    seconds : float or None
    """

    case: str
    kind: str
    truth: tuple[str, ...]
    severity: float
    verdict: str
    also: tuple[str, ...] = ()
    probability: Mapping[str, float] = field(default_factory=dict)
    group: tuple[str, ...] = ()
    shrink: float | None = None
    settled: tuple[StableAmplitude, ...] = ()
    rigs: tuple[str, ...] = ()
    rigs_named: tuple[str, ...] = ()
    seconds: float | None = None

    @property
    def name(self) -> str:
        """Row of the confusion matrix."""
        return NONE if not self.truth else "two" if len(self.truth) > 1 else self.truth[0]

    @property
    def accepted(self) -> tuple[str, ...]:
        """Verdicts that are right; of two effects, either."""
        if self.kind == NONE:
            return (NONE,)
        if self.kind == "open":
            return _ALLOWED.get(self.truth[0], (UNKNOWN,))
        return self.truth

    @property
    def right(self) -> bool:
        """Whether the verdict is."""
        return self.verdict in self.accepted

    @property
    def both_named(self) -> bool:
        """Whether every effect is named, in `verdict` or `also`."""
        return set(self.truth) <= {self.verdict, *self.also}


def read_outcomes(
    folder: Path, results: Path, answers: Path | None = None
) -> tuple[tuple[Outcome, ...], dict[str, Any]]:
    """Read results and open the sealed answers.

    Parameters
    ----------
    folder : Path
        Of the challenge.
    results : Path
        Of the run.
    answers : Path, optional
        The sealed file, if it lies elsewhere.

    Returns
    -------
    outcomes : tuple of Outcome
        Of every case that was run.
    settings : dict
        Of the challenge, and how many of its cases were not run (`not_run`).

    Raises
    ------
    InputError
        If the hash of the answers is another than stands in challenge.json, or there is nothing to score.
    """
    table = read_json(folder / CHALLENGE)
    sealed = _opened(answers or folder / str(table.get("answers", ANSWERS)), table.get("answers_sha256"))
    names = [name for name in cases_of(folder) if name in sealed]
    there = [name for name in names if (results / name / CASE).exists() or (results / name / GAP).exists()]
    if not there:
        raise InputError(results, "", "no result of any case", "the folder that scruton challenge run wrote")
    outcomes = tuple(_outcome(folder / name, results / name, sealed[name]) for name in there)
    return outcomes, dict(table.get("settings", {})) | {"not_run": len(names) - len(there)}


def _opened(path: Path, digest: object) -> dict[str, Any]:
    """Open the sealed answers."""
    if not path.is_file():
        raise InputError(path, "", "no file", "the sealed answers of the challenge (--answers FILE)")
    text = path.read_bytes()
    if (found := sha256(text).hexdigest()) != digest:
        wanted = f"{digest} as {CHALLENGE} has it: the answers are not those that were sealed"
        raise InputError(path, "SHA-256", found, wanted)
    answers = json.loads(text)
    if not isinstance(answers, dict):
        raise InputError(path, "", type(answers).__name__, "one answer a case, by its name")
    return answers


def _outcome(campaign: Path, place: Path, answer: Mapping[str, Any]) -> Outcome:
    note = read_json(place / CASE) if (place / CASE).exists() else {}
    seconds = note.get("seconds")
    if seconds is not None and (isinstance(seconds, bool) or not isinstance(seconds, int | float)):
        raise InputError(place / CASE, "seconds", repr(seconds), "a number")
    rigs = answer["parameters"].get("coulomb_friction", {}).get("rigs", ())
    truth = Outcome(
        campaign.name, str(answer["kind"]), tuple(map(str, answer["effects"])), float(answer["severity"]), FAILED,
        rigs=tuple(str(answer["rigs"][j]["name"]) for j in rigs), seconds=seconds,
    )  # fmt: skip
    if not (place / GAP).exists():
        return truth
    gap = read_json(place / GAP)
    try:
        verdict = str(gap["verdict"])
        groups = [tuple(group) for group in gap.get("indistinguishable", ()) if verdict in group]
        shrink = gap.get("shrink") or {}
        return replace(
            truth,
            verdict=verdict,
            also=tuple(gap.get("also", ())),
            probability={str(name): float(p) for name, p in gap.get("probability", {}).items()},
            group=groups[0] if groups else (verdict,),
            shrink=(shrink.get("held_out") or {}).get("fraction"),
            settled=_stable_amplitudes(campaign, shrink.get("stable_amplitude") or (), answer),
            rigs_named=_rigs_with_friction(gap.get("where", ())),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        found = f"{type(error).__name__}: {error}"
        raise InputError(place / GAP, "", found, "a gap.json of scruton diagnose") from error


def _rigs_with_friction(where: Any) -> tuple[str, ...]:
    """Those that the diagnosis gives as the scope of it, else those where the damping departs."""
    rows = [row for row in where if row.get("rig")]
    scope = {str(row["rig"]) for row in rows if row.get("effect") == "coulomb_friction"}
    return tuple(sorted(scope or {str(row["rig"]) for row in rows if row["quantity"] == "damping"}))


def _stable_amplitudes(campaign: Path, rows: Any, answer: Mapping[str, Any]) -> tuple[StableAmplitude, ...]:
    if not rows:
        return ()
    tests = tomllib.loads((campaign / "campaign.toml").read_text(encoding="utf-8"))["tests"]
    rig_of = {test["name"]: test["rig"] for test in tests}
    rigs = {rig["name"]: rig for rig in answer["rigs"]}
    amplitudes = []
    for row in rows:
        rig = rigs[rig_of[row["test"]]]
        truth, without = float(rig["stable_amplitude"]), float(rig["stable_amplitude_without"])
        if None not in (row["before"], row["after"]):
            numbers = (float(row[key]) for key in ("measured", "before", "after"))
            amplitudes.append(StableAmplitude(abs(truth / without - 1.0), truth, *numbers))
    return tuple(amplitudes)
