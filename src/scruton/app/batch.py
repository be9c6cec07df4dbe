"""`scruton batch`: many campaigns, each by one worker into a folder of its own, and one summary of them all."""

import contextlib
import io
import threading
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scruton.app.fit import check_design
from scruton.app.workers import NO_TLS, TlsFiles
from scruton.documents import read_json
from scruton.errors import InputError
from scruton.progress import Bar
from scruton.workspace import Workspace, results_in

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
    force : bool
        Replace results that lie in the folder.
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
    force: bool = False


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
    from scruton.app.batch_tables import write_batch
    from scruton.app.workers import connected, cores, finished
    from scruton.infer.cards import load_card

    _check_arguments(campaigns, jobs, seed, design_sc)
    card = load_card(model)
    path = Path(model)
    place = str(path.absolute()) if path.is_file() else model
    design = tuple(dict.fromkeys(float(one) for one in design_sc))
    todo = [
        Job(
            name,
            str(one.absolute()),
            str(out.absolute() / name),
            place,
            seed,
            design,
            report,
            quiet,
            __version__,
            force,
        )
        for name, one in zip(names(campaigns), campaigns, strict=True)
    ]
    provenance = _provenance(__version__, seed, card.name, card.sha256, design, report)
    if not force and not resume:
        _refuse_results(todo)
    claim = Workspace(
        out,
        "batch",
        inputs={f"model card {card.name}": card.sha256},
        settings={"seed": seed, "report": report, **({"sc": list(design)} if report else {})},
        results=(JSON,),
        force=force,
        resume=resume,
        grows=True,
    )
    entries = [_blank(one, UNFINISHED) for one in todo]

    def batch() -> Batch:
        said = [_as_named(one, path, out) for one, path in zip(entries, campaigns, strict=True)]
        return Batch(out, tuple(said), design, provenance)

    def sum_up(work: Workspace) -> None:
        write_batch(batch(), work.new)
        work.keep(PAGE, CSV, JSON)

    processes = min(jobs or cores(), len(todo))
    with claim as work, connected(scheduler, processes, tls=tls, quiet=quiet) as client, Bar(quiet) as bar:
        sum_up(work)
        try:
            for done, (index, outcome) in enumerate(finished(client, run_one, todo), start=1):
                entries[index] = outcome.value or _blank(todo[index], FAILED, outcome.fault)
                failed = sum(one["state"] == FAILED for one in entries)
                bar(
                    "campaigns",
                    done / len(todo),
                    f" ({done} of {len(todo)})" + (f", {failed} failed" if failed else ""),
                )
        finally:
            sum_up(work)  # after an interruption, too: what was done is kept
        write_batch(batch(), work.new)
        work.publish()
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
            _do(job)
            return summarise(job)
        except InputError as error:
            return _blank(job, FAILED, str(error), bad_input=True)
        except Exception as error:
            return _blank(job, FAILED, f"unexpected {type(error).__name__}: {error}")


def _do(job: Job) -> None:
    """Fit, and write the report where one is wanted, unless the whole results of this very job lie there."""
    from scruton.app.fit import FitTask
    from scruton.infer.store import POSTERIOR, SUMMARY, write_fit
    from scruton.report.build import HTML, write_report

    task = FitTask.of(
        Path(job.campaign), Path(job.folder), model=job.model, tests=None, seed=job.seed, effect=None
    )  # fmt: skip
    settings = {"report": True, "sc": list(job.design)} if job.report else {}
    claim = task.workspace(force=job.force, resume=True, settings=settings)
    if not job.force and claim.done([POSTERIOR, SUMMARY, *([HTML] if job.report else [])]) and not _missing(job):
        return
    with claim as work:
        fit = task.fit(work, quiet=True)
        write_fit(fit, work.new)
        if job.report:
            write_report(fit, work.new, design_sc=job.design if fit.summary["tests"] else ())
        work.publish()


def _missing(job: Job) -> list[str]:
    """What is missing from the report of a finished folder."""
    if not job.report:
        return []
    content = read_json(Path(job.folder) / "report.json")
    return [one["sentence"] for one in content.get("failures", [])]


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
    state, reason = (DONE, "") if converged else (NOT_CONVERGED, "; ".join(flags[:1]))
    if missing := _missing(job):
        state, reason = FAILED, "; ".join(missing)
    return _blank(job, state, reason) | {
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


def _refuse_results(todo: Sequence[Job]) -> None:
    """Refuse folders with results that nobody said what to do with; nothing is touched."""
    from scruton.app.fit import RESULTS

    for one in todo:
        if found := results_in(Path(one.folder), "fit", RESULTS):
            raise InputError(
                one.folder, "-o", f"results of an earlier run ({', '.join(found[:4])})",
                "an empty folder, --resume to go on with the batch, or --force to replace its results",
            )  # fmt: skip


def _provenance(
    version: str, seed: int, card: str, sha256: str, design: tuple[float, ...], report: bool
) -> dict[str, Any]:
    return {
        "versions": {"scruton": version}, "seed": seed, "card": {"name": card, "sha256": sha256}, "sc": list(design),
        "report": report,
    }  # fmt: skip
