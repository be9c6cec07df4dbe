"""The cases of a challenge, truth and diagnosis side by side, and the figures over them, each with what is wanted.

The sealed answers are opened here, and their hash is checked.
"""

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binom, binomtest

from scruton.calibrate import thresholds
from scruton.calibrate.challenge.attempt import CASE, GAP, cases_of
from scruton.calibrate.challenge.make import ANSWERS, CHALLENGE
from scruton.calibrate.challenge.scenarios import CATALOGUE, OPEN
from scruton.calibrate.thresholds import SEVERE
from scruton.campaign.toml import is_number
from scruton.documents import read_json
from scruton.errors import InputError

NONE, UNKNOWN, FAILED = "none", "unknown", "failed"
# What else a case outside the catalogue may be called, if all of it is in one group: a wake that follows the amplitude
# late, with a force that grows as its cube root, is a memory and a nonlinearity of aerodynamic damping.
_ALLOWED = {"wake_oscillator": ("fluid_memory", "aerodynamic_damping_nonlinearity")}
_SEVERE, _MILD = "s >= 20 %", "s = 10 %"
_AT_MOST = (
    "mean group size", "no effect", "outside the catalogue, given", "catalogued", "calibration", "...", "seconds",
)  # fmt: skip


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
    `misled` (with certainty to an effect that it has not), `p` and `p_truth` of the verdict and of what is accepted;
    `log_weights` that they come from (none of a diagnosis that gives none).
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
    weights: dict[str, float] = {}
    if (place / GAP).exists():
        gap = read_json(place / GAP)
        try:
            row |= _said(campaign, gap, answer)
            stated = gap.get("log_weights", {})  # that of another diagnosis may have none
            weights = {str(name): -np.inf if gain is None else float(gain) for name, gain in stated.items()}
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            found = f"{type(error).__name__}: {error}"
            raise InputError(place / GAP, "", found, "a gap.json of scruton diagnose") from error
    verdict, probability = row["verdict"], row["probability"]
    sure = {name for name, p in probability.items() if p > thresholds.CERTAIN}
    accepted = truth or (NONE,)
    named = True
    if kind == "open":
        allowed = _ALLOWED.get(truth[0], ())
        accepted = (UNKNOWN, *allowed)
        named = verdict == UNKNOWN or set(allowed) <= set(row["group"])
    return row | {
        "right": verdict in accepted and named, "accepted": accepted,
        "row": NONE if not truth else "two" if len(truth) > 1 else truth[0],
        "both_named": set(truth) <= {verdict, *row["also"]}, "in_group": set(truth) <= set(row["group"]),
        "misled": bool(sure & set(CATALOGUE) - set(accepted)),
        "p": probability.get(verdict, 0.0) if probability else None,
        "p_truth": sum(probability.get(name, 0.0) for name in accepted),
        "log_weights": weights,
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
            values = {key: float(row[key]) for key in ("measured", "before", "after")}
            amplitudes.append({"moved": abs(truth / without - 1.0), "truth": truth, **values})
    return tuple(amplitudes)


def figures(cases: pd.DataFrame, *, one_rig: bool = False) -> list[dict[str, Any]]:
    """Every figure of a challenge; a case that could not be diagnosed counts as wrong.

    Parameters
    ----------
    cases : DataFrame
        As `read_outcomes` gives it.
    one_rig : bool
        Of one rig without still-air records less is wanted: that the truth is in a group of at most six.

    Returns
    -------
    list of dict
        `figure`; `reached`, `low95` and `high95` (NaN without cases, or where no interval is given); number of
        `cases`; `percent`, for rates; `wanted`, perhaps None; `at_most`, where smaller is better; `met`, None where
        nothing is wanted or there are no cases.
    """
    single, without, outside, both = (cases[cases.kind == kind] for kind in ("catalogue", NONE, "open", "two"))
    severities = ((_SEVERE, True), (_MILD, False))
    table: dict[str, dict[str, Any]] = {}
    for label, severe in severities:
        part = single[(single.severity > SEVERE) == severe]
        table[f"top-1, {label}"] = rate(part.right)
        table[f"truth in the group, {label}"] = rate(part.in_group)
        table[f"mean group size, {label}"] = _mean([len(group) for group in part.group[part.verdict != FAILED]])
    table["no effect, called something else"] = rate(~without.right)
    for label, severe in severities:
        table[f"outside the catalogue, called unknown, {label}"] = rate(
            outside.right[(outside.severity > SEVERE) == severe]
        )
    table[f"outside the catalogue, given to an effect with more than {thresholds.CERTAIN:g}"] = rate(outside.misled)
    table["catalogued, called unknown"] = rate(single.verdict == UNKNOWN)
    judged = cases[cases.p.notna()]
    _, error, chance = calibration(cases)
    score = np.mean(np.log([max(p, thresholds.LEAST_PROBABILITY) for p in judged.p_truth])) if len(judged) else np.nan
    table["calibration error of the verdict's probability"] = _figure(error, len(judged))
    table["... that finite bins alone would give"] = _figure(chance, len(judged))
    table["mean log score of the truth"] = _figure(float(score), len(judged))
    held_out = single.settled[(single.severity > SEVERE) & single.right]
    moved = [test for amplitudes in held_out for test in amplitudes if test["moved"] > thresholds.MOVED]
    for label, true in ((_SEVERE, "truth"), ("against the measured one", "measured")):
        table[f"held-out stable amplitude, error before over after, {label}"] = _median(
            [abs(test["before"] - test[true]) / max(abs(test["after"] - test[true]), 1e-12) for test in moved]
        )
    table["median held-out shrink, verdict right"] = _median(single.shrink[single.right].dropna())
    table["median held-out shrink, called unknown and right"] = _median(outside.shrink[outside.right].dropna())
    table[f"two at once, both named, {_SEVERE}"] = rate(both.both_named[both.severity > SEVERE])
    table["two at once, the first is one of them"] = rate(both.right)
    friction = single[(single.row == "coulomb_friction") & single.right]
    named = [set(true) == set(claimed) for true, claimed in zip(friction.rigs, friction.rigs_named, strict=True)]
    table["friction found: exactly its rigs named"] = rate(named)
    table["seconds a campaign, one process (median)"] = _median(cases.seconds.dropna())
    table["no diagnosis"] = rate(cases.verdict == FAILED)
    goals = thresholds.WANTED_OF_ONE_RIG if one_rig else thresholds.WANTED
    rows = []
    for name, figure in table.items():
        wanted, at_most, reached = goals.get(name), name.startswith(_AT_MOST), figure["reached"]
        met = None if wanted is None or not np.isfinite(reached) else bool(
            reached <= wanted if at_most else reached >= wanted
        )  # fmt: skip
        rows.append({"figure": name, **figure, "wanted": wanted, "at_most": at_most, "met": met})
    return rows


def rate(hits: Iterable[bool]) -> dict[str, Any]:
    """Rate of hits with its Wilson interval."""
    all_hits = list(hits)
    count, cases = int(sum(all_hits)), len(all_hits)
    return _figure(count / cases if cases else np.nan, cases, *wilson(count, cases), percent=True)


def _mean(values: Sequence[float]) -> dict[str, Any]:
    mean = float(np.mean(values)) if values else np.nan
    half = 1.96 * float(np.std(values, ddof=1)) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return _figure(mean, len(values), mean - half, mean + half)


def _median(values: "Sequence[float] | pd.Series[float]") -> dict[str, Any]:
    reached = float(np.median(values)) if len(values) else np.nan
    return _figure(reached, len(values), *median_interval(values))


def _figure(
    reached: float, cases: int, low95: float = np.nan, high95: float = np.nan, *, percent: bool = False
) -> dict[str, Any]:
    return {"reached": reached, "low95": low95, "high95": high95, "cases": cases, "percent": percent}


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """95 % interval of a rate (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927); (0, 1) without trials."""
    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(hits, trials).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def median_interval(values: "Sequence[float] | pd.Series[float]") -> tuple[float, float]:
    """95 % interval of a median by order statistics, which assumes no distribution; all values if there are few."""
    ordered = np.sort(np.asarray(values, dtype=float))
    n = ordered.size
    if n == 0:
        return np.nan, np.nan
    low = max(int(binom.ppf(0.025, n, 0.5)) - 1, 0)
    return float(ordered[low]), float(ordered[n - 1 - low])


def reliability(
    probability: Sequence[float], right: Sequence[bool], bins: int = thresholds.RELIABILITY_BINS
) -> tuple[pd.DataFrame, float, float]:
    """Sort verdicts by probability, cut into bins of equal count, and compare mean probability with accuracy.

    Returns
    -------
    bins : DataFrame
        Mean `probability`, `accuracy` and number of `cases` of each; fewer if there are fewer cases.
    error, chance : float
        Mean distance of the two, weighted by the cases; and what it would be on average, were the probabilities right:
        bins are finite.
    """
    p, hit = np.asarray(probability, dtype=float), np.asarray(right, dtype=float)
    # Ties keep the order in which they come.
    parts = np.array_split(np.argsort(p, kind="stable"), min(bins, p.size)) if p.size else []
    table = pd.DataFrame(
        [(p[part].mean(), hit[part].mean(), part.size) for part in parts], columns=["probability", "accuracy", "cases"]
    )
    if not parts:
        return table, np.nan, np.nan
    spread = np.array([np.sqrt(np.sum(p[part] * (1.0 - p[part]))) / part.size for part in parts])
    apart, count = (table.probability - table.accuracy).abs().to_numpy(), table.cases.to_numpy()
    error, chance = (float(np.sum(count * distance) / p.size) for distance in (apart, np.sqrt(2.0 / np.pi) * spread))
    return table, error, chance


def calibration(cases: pd.DataFrame) -> tuple[pd.DataFrame, float, float]:
    """Reliability of the verdicts' probabilities, over all cases that have them."""
    judged = cases[cases.p.notna()]
    return reliability(judged.p.tolist(), judged.right.tolist())


def confusion(cases: pd.DataFrame) -> pd.DataFrame:
    """Number of cases of each truth (rows) and verdict (columns)."""
    rows = [name for name in (NONE, *CATALOGUE, "two", *OPEN) if (cases.row == name).any()]
    usual = [NONE, *CATALOGUE, UNKNOWN]
    columns = usual + sorted(set(cases.verdict) - set(usual))
    return pd.crosstab(cases.row, cases.verdict).reindex(index=rows, columns=columns, fill_value=0)


def by_effect(cases: pd.DataFrame) -> list[dict[str, Any]]:
    """One row an effect and severity, and one for all severities (severity None)."""
    rows = []
    for name in confusion(cases).index:
        in_row = cases[cases.row == name]
        severities: list[float | None] = sorted(set(in_row.severity))
        for s in [*severities, None] if len(severities) > 1 else severities:
            part = in_row if s is None else in_row[in_row.severity == s]
            right, shrinks = rate(part.right), part.shrink[part.right].dropna()
            wrong = part.verdict[~part.right].tolist()
            rows.append({
                "truth": name, "severity": s, "cases": len(part),
                "right": right["reached"], "low95": right["low95"], "high95": right["high95"],
                "in_group": rate(part.in_group)["reached"] if (part.kind == "catalogue").any() else None,
                "group_size": float(np.mean([len(group) for group in part.group])),
                "unknown": rate(part.verdict == UNKNOWN)["reached"],
                "both_named": rate(part.both_named)["reached"] if name == "two" else None,
                "shrink": float(np.median(shrinks)) if len(shrinks) else None,
                "most_often_wrong": max(set(wrong), key=lambda v: (wrong.count(v), v)) if wrong else "",
            })  # fmt: skip
    return rows
