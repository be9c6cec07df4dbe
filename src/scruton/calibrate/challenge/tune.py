"""`challenge tune`: how far the diagnosis may believe its evidences, from challenges whose answers are known.

Temperatures and floor (`scruton.gap.probability`) are those that give the truth the largest mean log probability, every
challenge counting alike however many cases it has. Each challenge is also scored by what the others alone would set.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.attempt import GAP
from scruton.calibrate.challenge.figures import NONE, read_outcomes, reliability
from scruton.calibrate.challenge.make import CHALLENGE
from scruton.calibrate.thresholds import COLDEST, FLOORS, HOTTEST, LEAST_PROBABILITY
from scruton.cells import aligned
from scruton.documents import read_json
from scruton.errors import InputError
from scruton.gap.probability import Temperatures, tempered
from scruton.infer.cards import ModelCard, load_card
from scruton.provenance import provenance

_GRID = 8  # starts along a temperature, of which the best is taken further
_DIGITS = 3  # of what is found: the score does not tell more


@dataclass(frozen=True, eq=False)
class Judged:
    """The cases of one challenge that have a diagnosis.

    Attributes
    ----------
    name : str
        Of its folder.
    gains : (C, E) array
        Log evidence over none of every effect that is named in any case; minus infinity where it is not possible.
    prior : (C, E) array
    accepted : (C, 1 + E) bool array
        Which names are right; none comes first.
    about : mapping
        Settings of the challenge, number of `cases` by kind, how many could not be diagnosed or were not run.
    """

    name: str
    gains: FloatArray
    prior: FloatArray
    accepted: np.ndarray
    about: Mapping[str, Any]

    def probabilities(self, by: Temperatures) -> FloatArray:
        """Probability of every name, (C, 1 + E)."""
        return tempered(self.gains, self.prior, by)

    def log_score(self, by: Temperatures) -> float:
        """Mean log probability of the truth."""
        p = np.sum(self.probabilities(by) * self.accepted, axis=1)
        return float(np.mean(np.log(np.maximum(p, LEAST_PROBABILITY))))

    def scores(self, by: Temperatures) -> dict[str, float]:
        """Mean log score of the truth, and calibration error of the verdict with what bins alone would give."""
        p = self.probabilities(by)
        verdict = p.argmax(axis=1)
        right = np.take_along_axis(self.accepted, verdict[:, None], axis=1)[:, 0]
        _, error, chance = reliability(p.max(axis=1).tolist(), right.tolist())
        values = {"log_score": self.log_score(by), "calibration_error": error, "chance": chance}
        return {key: round(value, 4) for key, value in values.items()}


def tune_challenges(
    folders: Sequence[Path], results: str = "results", least: tuple[float, float] = COLDEST
) -> dict[str, Any]:
    """Set temperatures and floor by challenges with sealed answers, each with the results of its run inside.

    Parameters
    ----------
    folders : sequence of Path
        As `challenge make` writes them.
    results : str
        Folder in each of them that `challenge run` wrote; the default card is taken for its prior.
    least : tuple of float
        Temperatures against none and between effects that are not gone below, whatever the challenges say: forms of
        a simulator are nearer to the catalogue's than nature's are.

    Returns
    -------
    dict
        The content of temperatures.json. The floor is that of `FLOORS` with the largest log score on the folder left
        out (of one folder alone: on itself).

    Raises
    ------
    InputError
        If the answers are not those that were sealed, or a folder has no results or none with log weights.
    """
    card = load_card()
    challenges = [read_challenge(folder, folder / results, card) for folder in folders]
    fitted = {floor: _left_out(challenges, floor, least) for floor in FLOORS}
    floor = max(FLOORS, key=lambda one: _mean_score(challenges, fitted[one]))
    before, after = Temperatures(), fit(challenges, floor, least)
    rows: list[dict[str, Any]] = []
    for challenge, by in zip(challenges, fitted[floor], strict=True):
        row = {"name": challenge.name, **challenge.about, "before": challenge.scores(before)}
        row["after"] = challenge.scores(after)
        row["left_out"] = vars(by) | challenge.scores(by) if len(challenges) > 1 else None
        rows.append(row)
    answers = {row["name"]: row["answers_sha256"] for row in rows}
    return {
        "format": 1, **vars(after), "least_floor": min(FLOORS), "least": list(least), "folders": rows,
        "provenance": provenance(
            "challenge tune", seed=0, sha256=answers, settings={"before": vars(before)},
            card={"name": card.name, "sha256": card.sha256},
        ),
    }  # fmt: skip


def read_challenge(folder: Path, results: Path, card: ModelCard) -> Judged:
    """Read the log weights of a run beside the truth; see `tune_challenges` for the errors."""
    cases, settings = read_outcomes(folder, results)
    not_run = settings.pop("not_run")
    judged = cases[[bool(weights) for weights in cases.log_weights]]
    if judged.empty:
        raise InputError(results, "log_weights", "none in any gap.json", f"{GAP} of scruton challenge run")
    names = sorted({name for weights in judged.log_weights for name in weights} - {NONE})
    gains = np.array([[weights.get(name, -np.inf) for name in names] for weights in judged.log_weights])
    share = np.array([
        [card.effect_weights.get(name, 1.0) if name in weights else 0.0 for name in names]
        for weights in judged.log_weights
    ])  # fmt: skip
    about = {
        "settings": settings, "answers_sha256": read_json(folder / CHALLENGE)["answers_sha256"],
        "cases": len(judged), "kinds": dict(sorted(Counter(judged.kind).items())),
        "no_diagnosis": len(cases) - len(judged), "not_run": not_run,
    }  # fmt: skip
    return Judged(
        folder.resolve().name, gains, (1.0 - card.prior_none) * share / share.sum(axis=1, keepdims=True),
        _accepted(judged, (NONE, *names)), about,
    )  # fmt: skip


def _accepted(cases: pd.DataFrame, names: Sequence[str]) -> np.ndarray:
    return np.array([[name in accepted for name in names] for accepted in cases.accepted])


def fit(challenges: Sequence[Judged], floor: float, least: tuple[float, float] = COLDEST) -> Temperatures:
    """Temperatures with the largest mean log score, every challenge counting alike."""

    def loss(logs: FloatArray) -> float:
        against_none, between = np.exp(logs).tolist()
        return -_mean_score(challenges, [Temperatures(against_none, between, floor)] * len(challenges))

    bounds = [(float(np.log(low)), float(np.log(HOTTEST))) for low in least]
    start = min((np.array(at) for at in product(*(np.linspace(*ends, _GRID) for ends in bounds))), key=loss)
    found = minimize(loss, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 1e-3})
    against_none, between = (float(f"{value:.{_DIGITS}g}") for value in np.exp(found.x))
    return Temperatures(against_none, between, floor)


def _mean_score(challenges: Sequence[Judged], by: Sequence[Temperatures]) -> float:
    return float(np.mean([one.log_score(its) for one, its in zip(challenges, by, strict=True)]))


def _left_out(challenges: Sequence[Judged], floor: float, least: tuple[float, float]) -> list[Temperatures]:
    """For each challenge what the others set."""
    others = [[one for one in challenges if one is not left] or challenges for left in challenges]
    return [fit(rest, floor, least) for rest in others]


def tuning_text(content: Mapping[str, Any], width: int | None = None) -> str:
    """What was set, and a row a challenge: log score and calibration error before, after, and left out."""
    rows = [["challenge", "cases", "log score", "after", "left out", "calibration", "after", "left out", "by chance"]]
    for folder in content["folders"]:
        stages = [folder["before"], folder["after"], folder["left_out"]]
        cells = [
            "-" if stage is None else f"{stage[key]:.3f}"
            for key in ("log_score", "calibration_error")
            for stage in stages
        ]
        rows.append([folder["name"], str(folder["cases"]), *cells, f"{folder['after']['chance']:.3f}"])
    values = [f"{key.replace('_', ' ')} {content[key]:g}" for key in ("against_none", "between", "floor")]
    return f"temperature {', '.join(values)}\n\n{aligned(rows, width)}"
