"""`challenge make`: a folder of campaigns, and their answers in a sealed file whose hash lies in the open."""

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scruton.calibrate.challenge.case import EFFECTS, NOISE, TURBULENCE, simulate_case
from scruton.calibrate.challenge.files import read_json, write_case
from scruton.calibrate.challenge.plan import SEVERITIES, checked, planned
from scruton.errors import InputError

__all__ = ["ANSWERS", "CHALLENGE", "EFFECTS", "make_challenge", "simulate_case"]

CHALLENGE, ANSWERS = "challenge.json", "answers/answers.json"
_PARTS = "answers/parts"
_MADE = "a file that a challenge was made with"
Progress = Callable[[int, int], None]


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
        Told how many cases are there, of how many.

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
    _claim(out, settings, force=force, resume=resume)
    answers = _known(out)
    names = {index: f"case-{index:04d}" for index in range(1, cases + 1)}
    missing = [i for i, name in names.items() if name not in answers or not (out / name / "campaign.toml").exists()]
    done = cases - len(missing)
    for index in _made(out, missing, settings, jobs):
        done += 1
        if progress:
            progress(done, cases)
        answers[names[index]] = read_json(out / _PARTS / f"{names[index]}.json", _MADE)
    sealed = json.dumps({name: answers[name] for name in names.values()}, indent=1, sort_keys=True) + "\n"
    _write(out / ANSWERS, sealed)
    shutil.rmtree(out / _PARTS, ignore_errors=True)
    table = {
        "format": 1, "settings": settings, "cases": list(names.values()), "answers": ANSWERS,
        "answers_sha256": sha256(sealed.encode()).hexdigest(), "versions": {"scruton": version("scruton")},
    }  # fmt: skip
    _write(out / CHALLENGE, json.dumps(table, indent=1) + "\n")
    return out


def _claim(out: Path, settings: Mapping[str, Any], *, force: bool, resume: bool) -> None:
    """Make sure that this challenge may be written into a folder, and note its settings."""
    if out.exists() and not out.is_dir():
        raise InputError(out, "-o", "a file", "the path of a folder for the challenge")
    path = out / CHALLENGE
    if path.exists() and resume:
        earlier = read_json(path, _MADE).get("settings", {})
        differ = [key for key, value in settings.items() if earlier.get(key) != value]
        if differ:
            raise InputError(
                path, differ[0], repr(earlier.get(differ[0])),
                f"{settings[differ[0]]!r} as asked for now: a challenge is resumed with its own settings",
            )  # fmt: skip
        return
    if path.exists() and not force:
        raise InputError(
            out, "-o", "a challenge", "an empty folder, --resume to go on with it, or --force to replace it"
        )
    for folder in [out / "answers", *out.glob("case-[0-9]*")] if path.exists() else []:
        shutil.rmtree(folder, ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)
    _write(path, json.dumps({"format": 1, "settings": settings, "cases": []}, indent=1) + "\n")


def _known(out: Path) -> dict[str, Any]:
    """Answers of the cases that are there."""
    found: dict[str, Any] = read_json(out / ANSWERS, _MADE) if (out / ANSWERS).exists() else {}
    for path in sorted((out / _PARTS).glob("*.json")):
        found[path.stem] = read_json(path, _MADE)
    return found


def _made(out: Path, missing: Sequence[int], settings: Mapping[str, Any], jobs: int) -> Iterator[int]:
    """Write the cases that are missing, in this process or in several; their numbers come as they are done."""
    (out / _PARTS).mkdir(parents=True, exist_ok=True)
    if jobs == 1 or len(missing) < 2:
        for index in missing:
            yield _make_one(out, index, settings)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    pool = ProcessPoolExecutor(min(jobs, len(missing)), mp_context=multiprocessing.get_context("spawn"))
    try:
        for future in as_completed([pool.submit(_make_one, out, index, settings) for index in missing]):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _make_one(out: Path, index: int, settings: Mapping[str, Any]) -> int:
    """Write one case and the part of the answers that is its own, each in one step, the answer last."""
    seed, design = settings["seed"], settings["design"]
    effects, severity = planned(seed, index, settings["effects"], settings["severities"], design)
    campaign, answer = simulate_case(
        seed, index, effects, severity, design, tuple(settings["turbulence"]), tuple(settings["noise"])
    )
    place = out / campaign.title
    with tempfile.TemporaryDirectory(dir=out, prefix=".case-") as temporary:
        made = Path(temporary) / "made"
        made.mkdir()
        write_case(campaign, made)
        shutil.rmtree(place, ignore_errors=True)
        os.replace(made, place)  # noqa: PTH105
    _write(out / _PARTS / f"{campaign.title}.json", json.dumps(answer))
    return index


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    temporary.write_text(text, encoding="utf-8", newline="\n")
    os.replace(temporary, path)  # noqa: PTH105
