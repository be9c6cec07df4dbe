"""`scruton batch`: many campaigns, each by one worker into a folder of its own, and one summary of them all."""

import contextlib
import io
import json
import threading
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scruton.errors import InputError
from scruton.report.run import Bar, check_design
from scruton.report.workers import NO_TLS, TlsFiles

DONE, NOT_CONVERGED, FAILED, UNFINISHED = STATES = "done", "not converged", "failed", "unfinished"
JSON, CSV, PAGE = "batch.json", "batch.csv", "batch.html"
# Figures are drawn with settings of the whole process, so a worker with several threads takes its campaigns in turn.
_ONE_AT_A_TIME = threading.Lock()

Entry = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """One campaign as its worker needs it; paths are absolute.

    Attributes
    ----------
    name : str
        Of the campaign in the batch, and of its folder.
    campaign, folder : str
    model : str
        Name or path of the model card.
    seed : int
    design : tuple of float
        Scruton numbers to predict the stable amplitude at.
    report, quiet : bool
    version : str
        Of the program that asks: results do not depend on who computes them.
    """

    name: str
    campaign: str
    folder: str
    model: str
    seed: int
    design: tuple[float, ...]
    report: bool
    quiet: bool
    version: str


@dataclass(frozen=True)
class Batch:
    """What became of a batch: one entry a campaign, in the order in which they were named (the content of batch.json).

    Attributes
    ----------
    folder : Path
    campaigns : tuple of dict
    design : tuple of float
    provenance : dict
    """

    folder: Path
    campaigns: tuple[Entry, ...]
    design: tuple[float, ...]
    provenance: dict[str, Any]

    @property
    def counts(self) -> dict[str, int]:
        """How many campaigns are in each state."""
        found = Counter(one["state"] for one in self.campaigns)
        return {state: found[state] for state in STATES if found[state]}

    @property
    def good(self) -> bool:
        """Whether every campaign is done and its sampling converged."""
        return set(self.counts) == {DONE}

    @property
    def none_ran(self) -> bool:
        """Whether there was nothing to run: every campaign is bad input."""
        return all(one["bad_input"] for one in self.campaigns)

    @property
    def faults(self) -> list[tuple[str, str]]:
        """Name and reason of each campaign that failed or did not converge."""
        return [(one["name"], f"{one['state']}: {one['reason']}") for one in self.campaigns if one["reason"]]

    @property
    def paths(self) -> tuple[Path, Path, Path]:
        """The page, the table and the JSON."""
        return self.folder / PAGE, self.folder / CSV, self.folder / JSON


def run_batch(
    campaigns: Sequence[Path],
    out: Path,
    *,
    scheduler: str | None = None,
    tls: TlsFiles = NO_TLS,
    jobs: int | None = None,
    model: str = "default",
    design_sc: Sequence[float] = (),
    report: bool = False,
    seed: int = 0,
    force: bool = False,
    resume: bool = False,
    quiet: bool = False,
) -> Batch:
    """Fit many campaigns, each into a folder of its own below `out`, and summarise them.

    The results are those of `scruton fit` or `scruton report` on each campaign, bit for bit, whoever computes them.

    Parameters
    ----------
    campaigns : sequence of Path
        Folders, each with a campaign.toml.
    out : Path
    scheduler : str, optional
        Address of a running Dask scheduler, whose workers see the same files under the same paths.
    tls : (Path, Path, Path), optional
        Certificate of the authority, own certificate and own key, for a scheduler under "tls://".
    jobs : int, optional
        Processes where no scheduler is named; the number of cores by default.
    model : str
        Model card: a shipped name or a TOML file.
    design_sc : sequence of float
        Design Scruton numbers to predict the stable amplitude at.
    report : bool
        Write each campaign's report, too.
    seed : int
        Of each campaign.
    force, resume : bool
        Replace the results that lie in the folders, or go on with them.
    quiet : bool

    Returns
    -------
    Batch
        A campaign that fails is an entry with its reason, and stops nothing.

    Raises
    ------
    InputError
        For bad arguments, a folder that holds results, or a scheduler that cannot be reached; nothing is written then.
    """
    from scruton import __version__
    from scruton.infer.cards import load_card
    from scruton.infer.output import claim_folder
    from scruton.report.workers import connected, cores, finished

    _check_arguments(campaigns, jobs, seed, design_sc)
    card = load_card(model)
    path = Path(model)
    place = str(path.absolute()) if path.is_file() else model
    design = tuple(dict.fromkeys(float(one) for one in design_sc))
    todo = [
        Job(name, str(one.absolute()), str(out.absolute() / name), place, seed, design, report, quiet, __version__)
        for name, one in zip(names(campaigns), campaigns, strict=True)
    ]
    provenance = _provenance(__version__, seed, card.name, card.sha256, design, report)
    _check_folder(out, [Path(one.folder) for one in todo], provenance, force=force, resume=resume)
    entries = [_blank(one, UNFINISHED) for one in todo]

    def batch() -> Batch:
        said = [_as_named(one, path, out) for one, path in zip(entries, campaigns, strict=True)]
        return Batch(out, tuple(said), design, provenance)

    with connected(scheduler, min(jobs or cores(), len(todo)), tls=tls, quiet=quiet) as client, Bar(quiet) as bar:
        for one in todo:
            claim_folder(Path(one.folder), force=force, resume=resume)
        _write(batch())
        try:
            for done, (index, outcome) in enumerate(finished(client, run_one, todo), start=1):
                entries[index] = outcome.value or _blank(todo[index], FAILED, outcome.fault)
                failed = sum(one["state"] == FAILED for one in entries)
                _advance(bar, done, len(todo), failed)
        finally:
            _write(batch())  # after an interruption, too: what was done is kept
    return batch()


def names(campaigns: Sequence[Path]) -> list[str]:
    """Names of campaigns in a batch: those of their folders, with as many of the folders above as tells them apart.

    >>> names([Path("/2023/deck"), Path("/2024/deck"), Path("/tower")])
    ['2023-deck', '2024-deck', 'tower']
    """
    parts = [_folder(one).resolve().parts[1:] or ("campaign",) for one in campaigns]
    found: list[str] = []
    for one in parts:
        depth = 1
        while depth < len(one) and sum(_same(one[-depth:], other[-depth:]) for other in parts) > 1:
            depth += 1
        name = label = "-".join(one[-depth:]).encode(errors="backslashreplace").decode()
        count = 1
        while name.casefold() in {JSON, CSV, PAGE, *(other.casefold() for other in found)}:
            count += 1
            name = f"{label}-{count}"
        found.append(name)
    return found


def _same(one: tuple[str, ...], other: tuple[str, ...]) -> bool:
    """Whether two paths are one on a file system that does not tell capitals from small letters."""
    return [part.casefold() for part in one] == [part.casefold() for part in other]


def _folder(campaign: Path) -> Path:
    return campaign.parent if campaign.name == "campaign.toml" else campaign


def run_one(job: Job) -> Entry:
    """Do one campaign, in a worker, and tell what came of it; no exception leaves it.

    What lies in its folder is taken up: finished results are kept, and an interrupted run goes on, whether it was the
    user or the death of a worker that interrupted it.
    """
    from scruton import __version__

    with _ONE_AT_A_TIME, contextlib.redirect_stderr(io.StringIO()) if job.quiet else contextlib.nullcontext():
        try:
            if __version__ != job.version:
                wanted = f"{job.version}, which asks for the results"
                raise InputError("worker", "version of scruton", __version__, wanted)
            if not _complete(job):
                _fit(job)
            return summarise(job)
        except InputError as error:
            return _blank(job, FAILED, str(error), bad_input=True)
        except Exception as error:
            return _blank(job, FAILED, f"unexpected {type(error).__name__}: {error}")


def _complete(job: Job) -> bool:
    """Whether the folder holds the finished results of this very job.

    Raises
    ------
    InputError
        If it holds those of another.
    """
    from scruton.campaign import load_campaign
    from scruton.infer.cards import load_card
    from scruton.infer.output import CHECKPOINTS
    from scruton.report.run import _same_run

    folder = Path(job.folder)
    wanted = ["posterior.nc", "fit.json", *(["report.html"] if job.report else [])]
    if (folder / CHECKPOINTS).exists() or not all((folder / name).is_file() for name in wanted):
        return False
    _same_run(folder, load_campaign(Path(job.campaign)), load_card(job.model).sha256, job.seed, ())
    return True


def _fit(job: Job) -> None:
    from scruton.report.build import build_report
    from scruton.report.run import run_fit

    fit, folder = run_fit(
        Path(job.campaign), Path(job.folder), model=job.model, seed=job.seed, resume=True, quiet=True
    )  # fmt: skip
    if job.report:
        build_report(fit, folder, design_sc=job.design if fit.summary["tests"] else ())


def summarise(job: Job) -> Entry:
    """Read a finished folder: the entry of its campaign."""
    from scruton.griffin import predict
    from scruton.infer.store import read_tree

    folder = Path(job.folder)
    tree, summary = read_tree(folder)
    predictions = [
        predict(tree, scruton_number=sc, seed=job.seed).to_json() for sc in (job.design if summary["tests"] else ())
    ]
    converged, flags = bool(summary["converged"]), list(summary["flags"])
    return _blank(job, DONE if converged else NOT_CONVERGED, "" if converged else "; ".join(flags[:1])) | {
        "title": summary["title"],
        "report": f"{job.name}/report.html" if (folder / "report.html").is_file() else None,
        "unit": summary["amplitude_unit"],
        "rigs": len(summary["rigs"]),
        "tests": len(summary["tests"]),
        "peaks": [_peak(one) for one in summary["tests"] if one["peak"]],
        "predictions": predictions,
        "flags": list(dict.fromkeys([*flags, *(flag for one in predictions for flag in one["flags"])])),
    }


def _peak(test: dict[str, Any]) -> dict[str, Any]:
    """What the table shows of a peak test; laws other than the paper's have no Y1 and epsilon."""
    found = {key: test["parameters"].get(key) for key in ("scruton_number", "a_star", "Y1", "epsilon")}
    kept = ("median", "mean", "sd", "interval")
    return {"test": test["name"], "rig": test["rig"]} | {
        key: None if one is None else {name: one[name] for name in kept} for key, one in found.items()
    }


def _blank(job: Job, state: str, reason: str = "", *, bad_input: bool = False) -> Entry:
    """Entry of a campaign of which nothing but its state is known."""
    return {
        "name": job.name, "campaign": job.campaign, "state": state, "reason": reason, "bad_input": bad_input,
        "title": "", "report": None, "unit": None, "rigs": None, "tests": None, "peaks": [], "predictions": [],
        "flags": [],
    }  # fmt: skip


def _as_named(entry: Entry, campaign: Path, out: Path) -> Entry:
    """Spell paths as the user did, so that the summary does not depend on where it was made."""
    reason = entry["reason"].replace(str(campaign.absolute()), str(campaign)).replace(str(out.absolute()), str(out))
    return entry | {"campaign": str(campaign), "reason": reason}


def _check_arguments(campaigns: Sequence[Path], jobs: int | None, seed: int, design_sc: Sequence[float]) -> None:
    if not campaigns:
        raise InputError("command line", "CAMPAIGN", "none", "at least one folder with a campaign.toml")
    if seed < 0:
        raise InputError("command line", "--seed", str(seed), "a whole number, zero or more")
    if jobs is not None and jobs < 1:
        raise InputError("command line", "--jobs", str(jobs), "a whole number, one or more")
    check_design(design_sc)
    seen: dict[Path, Path] = {}
    for one in campaigns:
        other = seen.setdefault(_folder(one).resolve(), one)
        if other is not one:
            raise InputError("command line", "CAMPAIGN", f"{one}, which is {other} again", "each campaign once")


def _check_folder(out: Path, folders: Sequence[Path], provenance: dict[str, Any], *, force: bool, resume: bool) -> None:
    """Refuse folders that hold results that nobody said what to do with; nothing is touched."""
    from scruton.infer.output import claim_folder

    summary = out / JSON
    if out.exists() and not out.is_dir():
        raise InputError(out, "-o", "a file", "the path of a folder for the results")
    if force and not resume:
        return
    if summary.is_file() and not resume:
        raise InputError(
            out, "-o", f"an earlier batch ({JSON})",
            "an empty folder, --resume to go on with the batch, or --force to replace its results",
        )  # fmt: skip
    for one in folders:
        claim_folder(one, resume=resume)
    if not summary.is_file():
        return
    found = json.loads(summary.read_text(encoding="utf-8"))["provenance"]
    differing = [key for key in ("seed", "card", "report") if found[key] != provenance[key]]
    if provenance["report"] and found["sc"] != provenance["sc"]:
        differing.append("sc")  # the reports that are there show others
    if differing:
        raise InputError(
            out, "--resume", f"a batch with other {', '.join(differing)}",
            "the same command as before, another folder, or --force to replace its results",
        )  # fmt: skip


def _provenance(
    version: str, seed: int, card: str, sha256: str, design: tuple[float, ...], report: bool
) -> dict[str, Any]:
    return {
        "versions": {"scruton": version}, "seed": seed, "card": {"name": card, "sha256": sha256}, "sc": list(design),
        "report": report,
    }  # fmt: skip


def _write(batch: Batch) -> None:
    from scruton.report.batch_tables import write_batch

    write_batch(batch)


def _advance(bar: Bar, done: int, total: int, failed: int) -> None:
    """One line that grows: the bar starts another line for another name, which here is the count."""
    bar.name = f"{done} of {total} campaigns" + (f", {failed} failed" if failed else "")
    bar(bar.name, done / total)
