"""`challenge make`: a folder of campaigns, and their answers in a sealed file whose hash lies in the open."""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scruton.calibrate.challenge.case import NOISE, TURBULENCE, simulate_case
from scruton.calibrate.challenge.plan import SEVERITIES, checked, planned
from scruton.campaign.write import save_campaign
from scruton.documents import read_json, write_text
from scruton.errors import InputError
from scruton.processes import completed
from scruton.progress import Progress
from scruton.provenance import provenance
from scruton.workspace import Workspace

CHALLENGE, ANSWERS = "challenge.json", "answers/answers.json"
_MADE = "a file that a challenge was made with"


def make_challenge(
    out: Path,
    *,
    cases: int,
    seed: int,
    effects: Sequence[str] | None = None,
    severities: Sequence[float] = SEVERITIES,
    design: str = "full",
    turbulence: tuple[float, float] = TURBULENCE,
    noise: tuple[float, float] = NOISE,
    jobs: int = 1,
    force: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write campaigns whose effects are hidden.

    Parameters
    ----------
    out : Path
        Gets `case-0001/campaign.toml` with its records and so on, `challenge.json` (settings, the list of cases, the
        SHA-256 of the answers) and `answers/answers.json`.
    cases : int
        How many. They come in blocks that have every effect at every severity once; see
        `scruton.calibrate.challenge.plan`.
    seed : int
        With the settings it settles every byte; case k does not depend on how many there are.
    effects : sequence of str, optional
        Effects, or "none" and "two"; all by default.
    severities : sequence of float
    design : {"full", "one-rig"}
    turbulence, noise : (float, float)
        Ranges: scatter of the amplitude over the stable amplitude, sensor noise over the smallest stable amplitude.
    jobs : int
        Processes.
    force, resume : bool
        Replace the challenge that lies in the folder, or go on with it, to more cases if need be.
    progress : callable, optional
        Told the step, and the fraction of the cases that is there.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For settings that make no challenge, or a folder that holds one.
    """
    for field, value in (("cases", cases), ("jobs", jobs)):
        if value < 1:
            raise InputError("challenge", field, str(value), "at least 1")
    for field, (low, high) in (("turbulence", turbulence), ("noise", noise)):
        if not 0.0 <= low <= high <= 0.2:
            raise InputError("challenge", field, f"{low:g} to {high:g}", "a range between 0 and 0.2")
    wanted = checked(effects, severities, design)
    settings: dict[str, Any] = {
        "seed": seed, "design": design, "effects": list(wanted), "severities": [float(s) for s in severities],
        "turbulence": list(turbulence), "noise": list(noise),
    }  # fmt: skip
    claim = Workspace(
        out,
        "challenge make",
        inputs={},
        settings=settings,
        results=(CHALLENGE,),
        force=force,
        resume=resume,
        grows=True,
    )
    names = {index: f"case-{index:04d}" for index in range(1, cases + 1)}
    with claim as work:
        answers = _known(work)
        missing = [i for i, name in names.items() if name not in answers or not work.find(f"{name}/campaign.toml")]
        tasks = [(work.new, work.checkpoints, i, settings) for i in missing]
        for done, index in enumerate(completed(_make_one, tasks, jobs), cases - len(missing) + 1):
            work.keep(names[index])
            if progress:
                progress("make", done / cases)
            answers[names[index]] = read_json(work.checkpoints / f"{names[index]}.json", _MADE)
        sealed = json.dumps({name: answers[name] for name in names.values()}, indent=1, sort_keys=True) + "\n"
        write_text(work.new / ANSWERS, sealed)
        table = {
            "format": 1, "settings": settings, "cases": list(names.values()), "answers": ANSWERS,
            "answers_sha256": sha256(sealed.encode()).hexdigest(), "versions": {"scruton": version("scruton")},
            "provenance": provenance("challenge make", seed=seed, sha256={}, settings=settings),
        }  # fmt: skip
        write_text(work.new / CHALLENGE, json.dumps(table, indent=1) + "\n")
        work.publish()
    return out


def _known(work: Workspace) -> dict[str, Any]:
    """Answers of the cases that are there."""
    before = work.find(ANSWERS)
    found: dict[str, Any] = {} if before is None else read_json(before, _MADE)
    for path in sorted(work.checkpoints.glob("*.json")):
        found[path.stem] = read_json(path, _MADE)
    return found


def _make_one(out: Path, answers: Path, index: int, settings: Mapping[str, Any]) -> int:
    """Write one case and the part of the answers that is its own, the campaign.toml and then the answer last."""
    seed, design = settings["seed"], settings["design"]
    effects, severity = planned(seed, index, settings["effects"], settings["severities"], design)
    campaign, answer = simulate_case(
        seed, index, effects, severity, design, tuple(settings["turbulence"]), tuple(settings["noise"])
    )
    place = out / campaign.title
    place.mkdir(parents=True, exist_ok=True)
    save_campaign(campaign, place)
    write_text(answers / f"{campaign.title}.json", json.dumps(answer))
    return index
