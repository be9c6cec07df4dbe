"""`challenge run`: the diagnosis of every campaign of a folder, one gap.json a case; the answers are not looked at."""

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scruton.calibrate.execution import Execution, at_least
from scruton.documents import read_json, write_text
from scruton.errors import InputError
from scruton.provenance import provenance
from scruton.workers import Workers
from scruton.workspace import digest

RUN, GAP, CASE = "challenge-run.json", "gap.json", "case.json"
Diagnose = Callable[[Path], Mapping[str, Any]]


def diagnose_case(folder: Path) -> Mapping[str, Any]:
    """Diagnose a campaign with the default card in one thread: the content of gap.json."""
    from scruton.gap.diagnose import examine
    from scruton.infer.cards import load_card

    return examine(folder, load_card(), workers=1)[1]


def run_challenge(folder: Path, how: Execution, diagnose: Diagnose = diagnose_case) -> dict[str, str]:
    """Diagnose every case of a challenge, and give the reason for each that has no diagnosis.

    The folder of results gets `case-0001/gap.json` and `case-0001/case.json` (seconds; the reason where a case failed)
    and so on. Failed cases of a run that is resumed are tried again.

    Parameters
    ----------
    folder : Path
        With one folder a case, each with its campaign.toml (InputError where there is none).
    how : Execution
    diagnose : callable
        From a case's folder to the content of gap.json; of module level, for several processes.
    """
    at_least(1, "challenge", jobs=how.workers.jobs)
    cases, out = cases_of(folder), how.folder
    tomls = sha256()
    for name in cases:
        tomls.update(name.encode() + b"\0" + (folder / name / "campaign.toml").read_bytes())
    called = f"{diagnose.__module__}.{getattr(diagnose, '__qualname__', type(diagnose).__name__)}"
    compared = {"diagnosis": called, "scruton": version("scruton")}
    files = (path for name in cases for path in sorted((folder / name).rglob("*")) if path.is_file())
    inputs = {path.relative_to(folder).as_posix(): digest(path) for path in files}
    with how.claim("challenge run", inputs=inputs, settings=compared, results=(RUN,)) as work:
        missing = [name for name in cases if work.find(f"{name}/{GAP}") is None]
        for done, name in enumerate(
            _run(folder, work.new, missing, how.workers, diagnose), len(cases) - len(missing) + 1
        ):
            work.keep(name)
            how.tell("run", done, len(cases))
        block = provenance("challenge run", seed=0, sha256=inputs, settings={"diagnosis": called})
        settings = {"format": 1, "campaigns_sha256": tomls.hexdigest(), **compared, "provenance": block}
        write_text(work.new / RUN, json.dumps(settings, indent=1) + "\n")
        work.publish()
    failed = (name for name in cases if not (out / name / GAP).exists())
    return {name: str(read_json(out / name / CASE).get("error")) for name in failed}


def cases_of(folder: Path) -> tuple[str, ...]:
    """Names of the folders with a campaign.toml, in order (InputError if there is none)."""
    names = tuple(sorted(p.parent.name for p in folder.glob("*/campaign.toml") if not p.parent.name.startswith(".")))
    if not names:
        wanted = "a folder made by scruton challenge make, with case-0001/campaign.toml and so on"
        raise InputError(folder, "", "no folder with a campaign.toml" if folder.is_dir() else "no folder", wanted)
    return names


def _run(
    folder: Path, out: Path, names: Sequence[str], workers: Workers, diagnose: Diagnose
) -> Iterator[str]:  # fmt: skip
    """Run the cases; names come as they are done."""
    tasks = [(folder.absolute(), out.absolute(), name, diagnose) for name in names]
    for index, outcome in workers.outcomes(_one, tasks):
        if outcome.fault:
            _note(out / names[index], 0.0, outcome.fault)
        yield names[index]


def _one(task: tuple[Path, Path, str, Diagnose]) -> None:
    """Diagnose one case; gap.json comes last, for it is what says that a case is done."""
    folder, out, name, diagnose = task
    start = time.perf_counter()
    try:
        text = json.dumps(diagnose(folder / name), indent=1, allow_nan=False) + "\n"
    except Exception as error:
        _note(out / name, time.perf_counter() - start, f"{type(error).__name__}: {error}")
        return
    _note(out / name, time.perf_counter() - start, None)
    write_text(out / name / GAP, text)


def _note(place: Path, seconds: float, error: str | None) -> None:
    write_text(place / CASE, json.dumps({"seconds": round(seconds, 3), "error": error}) + "\n")
