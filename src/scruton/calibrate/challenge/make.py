"""`challenge make`: a folder of campaigns, and their answers in a sealed file whose hash lies in the open."""

import json
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scruton.calibrate.challenge.case import simulate_case
from scruton.calibrate.challenge.plan import Plan
from scruton.calibrate.execution import Execution, at_least
from scruton.campaign.write import save_campaign
from scruton.documents import read_json, write_text
from scruton.processes import completed
from scruton.provenance import provenance
from scruton.workspace import Workspace

CHALLENGE, ANSWERS = "challenge.json", "answers/answers.json"
_MADE = "a file that a challenge was made with"


def make_challenge(how: Execution, plan: Plan, cases: int) -> Path:
    """Write campaigns whose effects are hidden.

    Parameters
    ----------
    how : Execution
        Its folder gets `case-0001/campaign.toml` with its records and so on, `challenge.json` (settings, the list of
        cases, the SHA-256 of the answers) and `answers/answers.json`.
    plan : Plan
        Case k does not depend on how many there are.
    cases : int
        How many. They come in blocks that have every effect at every severity once; see
        `scruton.calibrate.challenge.plan`. A challenge that is resumed may go on to more.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For a folder that holds a challenge.
    """
    at_least(1, "challenge", cases=cases, jobs=how.jobs)
    settings = plan.settings
    claim = how.claim("challenge make", inputs={}, settings=settings, results=(CHALLENGE,))
    names = {index: f"case-{index:04d}" for index in range(1, cases + 1)}
    with claim as work:
        answers = _known(work)
        missing = [i for i, name in names.items() if name not in answers or not work.find(f"{name}/campaign.toml")]
        tasks = [(work.new, work.checkpoints, i, plan) for i in missing]
        for done, index in enumerate(completed(_write_case, tasks, how.jobs), cases - len(missing) + 1):
            work.keep(names[index])
            how.tell("make", done, cases)
            answers[names[index]] = read_json(work.checkpoints / f"{names[index]}.json", _MADE)
        sealed = json.dumps({name: answers[name] for name in names.values()}, indent=1, sort_keys=True) + "\n"
        write_text(work.new / ANSWERS, sealed)
        table = {
            "format": 1, "settings": settings, "cases": list(names.values()), "answers": ANSWERS,
            "answers_sha256": sha256(sealed.encode()).hexdigest(), "versions": {"scruton": version("scruton")},
            "provenance": provenance("challenge make", seed=plan.seed, sha256={}, settings=settings),
        }  # fmt: skip
        write_text(work.new / CHALLENGE, json.dumps(table, indent=1) + "\n")
        work.publish()
    return how.folder


def _known(work: Workspace) -> dict[str, Any]:
    """Answers of the cases that are there."""
    before = work.find(ANSWERS)
    answers: dict[str, Any] = {} if before is None else read_json(before, _MADE)
    return answers | {path.stem: read_json(path, _MADE) for path in sorted(work.checkpoints.glob("*.json"))}


def _write_case(out: Path, answers: Path, index: int, plan: Plan) -> int:
    """Write one case and the part of the answers that is its own, the campaign.toml and then the answer last."""
    campaign, answer = simulate_case(plan.seed, index, *plan.case(index), plan.design, plan.turbulence, plan.noise)
    place = out / campaign.title
    place.mkdir(parents=True, exist_ok=True)
    save_campaign(campaign, place)
    write_text(answers / f"{campaign.title}.json", json.dumps(answer))
    return index
