"""Truth and diagnosis of every case side by side: the sealed answers are opened, their hash is checked."""

import json
import tomllib
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import pandas as pd

from scruton.calibrate.challenge.make import ANSWERS, CHALLENGE
from scruton.calibrate.challenge.run import CASE, GAP, cases_of
from scruton.calibrate.challenge.scenarios import CATALOGUE
from scruton.calibrate.thresholds import CERTAIN
from scruton.campaign.toml import is_number
from scruton.documents import read_json
from scruton.errors import InputError

NONE, UNKNOWN, FAILED = "none", "unknown", "failed"
_ALLOWED = {"wake_oscillator": (UNKNOWN, "fluid_memory")}  # of the cases outside the catalogue


def read_outcomes(folder: Path, results: Path, answers: Path | None = None) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Read the results of a run and open the sealed answers, which may lie elsewhere.

    Returns
    -------
    cases : DataFrame
        One row a case that was run: what is in it, what was said of it, and how the two agree; see `_outcome`.
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
    cases = pd.DataFrame([_outcome(folder / name, results / name, sealed[name]) for name in there])
    cases = cases.astype(dict.fromkeys(("shrink", "seconds", "p"), float))  # NaN for None
    return cases, dict(table.get("settings", {})) | {"not_run": len(names) - len(there)}


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


def _outcome(campaign: Path, place: Path, answer: Mapping[str, Any]) -> dict[str, Any]:
    """One case: what is in it, what was said of it, and how the two agree.

    In it: `kind` (none, catalogue, two, or open: outside the catalogue), `truth` (its effects), `severity`, `rigs`
    with friction, the `row` of the confusion matrix, `accepted` verdicts (of two effects, either).  Said: `verdict`
    ("failed" where there is no diagnosis), `also`, `probability`, `group` (what cannot be told from the verdict, itself
    among it), the held-out `shrink`, `settled` amplitudes, `rigs_named`.  Agreement: `right`, `both_named`, `in_group`,
    `misled` (with certainty to an effect that it has not), `p` and `p_truth` of the verdict and of what is accepted.
    """
    note = read_json(place / CASE) if (place / CASE).exists() else {}
    seconds = note.get("seconds")
    if seconds is not None and not is_number(seconds):
        raise InputError(place / CASE, "seconds", repr(seconds), "a number")
    kind, truth = str(answer["kind"]), tuple(map(str, answer["effects"]))
    friction = answer["parameters"].get("coulomb_friction", {}).get("rigs", ())
    row: dict[str, Any] = {
        "case": campaign.name, "kind": kind, "truth": truth, "severity": float(answer["severity"]), "verdict": FAILED,
        "also": (), "probability": {}, "group": (), "shrink": None, "settled": (),
        "rigs": tuple(str(answer["rigs"][j]["name"]) for j in friction), "rigs_named": (), "seconds": seconds,
    }  # fmt: skip
    if (place / GAP).exists():
        gap = read_json(place / GAP)
        try:
            row |= _said(campaign, gap, answer)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            found = f"{type(error).__name__}: {error}"
            raise InputError(place / GAP, "", found, "a gap.json of scruton diagnose") from error
    verdict, probability = row["verdict"], row["probability"]
    accepted = truth or (NONE,)
    if kind == "open":
        accepted = _ALLOWED.get(truth[0], (UNKNOWN,))
    return row | {
        "right": verdict in accepted, "accepted": accepted,
        "row": NONE if not truth else "two" if len(truth) > 1 else truth[0],
        "both_named": set(truth) <= {verdict, *row["also"]}, "in_group": set(truth) <= set(row["group"]),
        "misled": any(p > CERTAIN for name, p in probability.items() if name in CATALOGUE and name not in accepted),
        "p": probability.get(verdict, 0.0) if probability else None,
        "p_truth": sum(probability.get(name, 0.0) for name in accepted),
    }  # fmt: skip


def _said(campaign: Path, gap: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, Any]:
    """What a gap.json says of a case."""
    verdict, shrink = str(gap["verdict"]), gap.get("shrink") or {}
    where = [row for row in gap.get("where", ()) if row.get("rig")]
    # Friction is where the diagnosis gives it as the scope, else where the damping departs.
    scope = {str(row["rig"]) for row in where if row.get("effect") == "coulomb_friction"}
    scope = scope or {str(row["rig"]) for row in where if row["quantity"] == "damping"}
    return {
        "verdict": verdict,
        "also": tuple(gap.get("also", ())),
        "probability": {str(name): float(p) for name, p in gap.get("probability", {}).items()},
        "group": next((tuple(group) for group in gap.get("indistinguishable", ()) if verdict in group), (verdict,)),
        "shrink": (shrink.get("held_out") or {}).get("fraction"),
        "settled": _settled(campaign, shrink.get("stable_amplitude") or (), answer),
        "rigs_named": tuple(sorted(scope)),
    }


def _settled(campaign: Path, rows: Any, answer: Mapping[str, Any]) -> tuple[dict[str, float], ...]:
    """Stable amplitudes of tests left out [A/D or rad].

    `moved` is what the effect does to it, relative; `truth` as simulated, `measured`, `before` and `after` as the null
    model and the verdict's predict it.
    """
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
            said = {key: float(row[key]) for key in ("measured", "before", "after")}
            amplitudes.append({"moved": abs(truth / without - 1.0), "truth": truth, **said})
    return tuple(amplitudes)
