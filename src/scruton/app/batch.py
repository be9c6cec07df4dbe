"""`scruton batch`: many campaigns, each by one worker into a folder of its own, and one summary of them all."""

import contextlib
import io
import threading
from argparse import Namespace
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from scruton.app.batch_tables import CSV, JSON, PAGE, batch_text, write_batch
from scruton.app.fit import RESULTS, FitTask
from scruton.app.run import Outcome, Run, campaign_folder, workers_of
from scruton.documents import read_document, read_json, write_document
from scruton.errors import InputError
from scruton.terminal import BAD_INPUT, DONE, NOT_TRUSTED
from scruton.workspace import digest, results_in

TOPIC = "scruton batch"  # of what workers tell: the folder of which a step is done
CONVERGED, NOT_CONVERGED, FAILED, UNFINISHED = STATES = "done", "not converged", "failed", "unfinished"
# Figures are drawn with settings of the whole process, so a worker with several threads takes its campaigns in turn.
_ONE_AT_A_TIME = threading.Lock()

Entry = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """One campaign as its worker needs it; paths are absolute, `name` is that of the campaign in the batch."""

    name: str
    campaign: str
    folder: str
    model: str
    seed: int
    design: tuple[float, ...]  # Scruton numbers to predict the stable amplitude at
    report: bool
    quiet: bool
    version: str  # of the program that asks: results do not depend on who computes them
    force: bool = False  # replace results that lie in the folder
    bridge: str | None = None  # to size the damping of
    effect: str | None = None  # that the fit has to carry
    tests: tuple[str, ...] | None = None  # these alone, of every campaign

    @property
    def steps(self) -> int:
        """How many there are to it: the fit, the sizing, the report."""
        return 1 + (self.bridge is not None) + self.report


@dataclass(frozen=True)
class Batch:
    """What became of a batch: one entry a campaign, in the order in which they were named, as batch.json holds it."""

    folder: Path
    campaigns: tuple[Entry, ...]
    design: tuple[float, ...]
    provenance: dict[str, Any]

    @property
    def counts(self) -> dict[str, int]:
        """How many campaigns are in each state."""
        tally = Counter(entry["state"] for entry in self.campaigns)
        return {state: tally[state] for state in STATES if tally[state]}

    @property
    def good(self) -> bool:
        """Whether every campaign is done and its sampling converged."""
        return set(self.counts) == {CONVERGED}

    @property
    def none_ran(self) -> bool:
        """Whether there was nothing to run: every campaign is bad input."""
        return all(entry["bad_input"] for entry in self.campaigns)


def run(arguments: Namespace) -> Outcome:
    """Fit many campaigns, each into a folder of its own below that of the results, and summarise them.

    The results are those of `scruton fit` or `scruton report` on each campaign, bit for bit, whoever computes them. A
    campaign that fails is an entry with its reason, and stops nothing.  InputError for bad arguments, a folder that
    holds results, or a scheduler that cannot be reached; nothing is written then.
    """
    from scruton.workers import connected, finished, told

    out = arguments.out
    todo, claim = _planned(arguments)
    entries = [_blank(job, UNFINISHED) for job in todo]
    where = workers_of(arguments)
    processes = min(where.jobs, len(todo))

    def batch() -> Batch:
        named = [_as_named(entry, path, out) for entry, path in zip(entries, arguments.campaigns, strict=True)]
        return Batch(out, tuple(named), todo[0].design, claim.provenance)

    def sum_up() -> None:
        write_batch(batch(), claim.new)
        claim.keep(PAGE, CSV, JSON)

    with (
        claim as work,
        connected(where.scheduler, processes, tls=where.tls, quiet=arguments.quiet) as client,
    ):
        sum_up()
        done = {job.folder: 0 for job in todo}  # steps
        total = sum(job.steps for job in todo)

        def show() -> None:
            failed, steps = sum(entry["state"] == FAILED for entry in entries), sum(done.values())
            ended = sum(entry["state"] != UNFINISHED for entry in entries)
            note = f", {failed} failed" if failed else ""
            work.bar("steps", steps / total, f", {steps} of {total}; campaigns, {ended} of {len(todo)}{note}")

        def step(folder: str) -> None:
            if folder in done:
                done[folder] += 1
                show()

        try:
            with told(client, TOPIC, step):
                for index, outcome in finished(client, run_one, todo):
                    entries[index] = outcome.value or _blank(todo[index], FAILED, outcome.fault)
                    done[todo[index].folder] = todo[index].steps  # whatever was left of them
                    show()
        finally:  # where it is interrupted, too: what was done is kept
            sum_up()
        whole = batch()
        write_batch(whole, work.new)
        work.publish()
    return Outcome(
        batch_text(whole),
        [out / name for name in (PAGE, CSV, JSON)],
        [f"{entry['name']}: {entry['state']}: {entry['reason']}" for entry in whole.campaigns if entry["reason"]],
        DONE if whole.good else BAD_INPUT if whole.none_ran else NOT_TRUSTED,
    )


def _planned(arguments: Namespace) -> tuple[list[Job], Run]:
    """One job a campaign, and the claim on the folder of the batch, to be entered; nothing is touched."""
    from scruton import __version__
    from scruton.infer.cards import load_card

    seen: dict[Path, Path] = {}
    for given in arguments.campaigns:
        other = seen.setdefault(campaign_folder(given).resolve(), given)
        if other is not given:
            raise InputError("command line", "CAMPAIGN", f"{given}, which is {other} again", "each campaign once")
    card, path, bridge = load_card(arguments.model), Path(arguments.model), arguments.bridge
    if bridge is not None and not bridge.is_file():
        raise InputError(bridge, "", "no such file", "a bridge.toml")
    design = tuple(dict.fromkeys(arguments.sc))
    common: dict[str, Any] = {
        "model": str(path.absolute()) if path.is_file() else arguments.model, "seed": arguments.seed, "design": design,
        "report": arguments.report, "quiet": arguments.quiet, "version": __version__, "force": arguments.force,
        "bridge": None if bridge is None else str(bridge.absolute()), "effect": arguments.effect,
        "tests": None if arguments.tests is None else tuple(arguments.tests),
    }  # fmt: skip
    todo = [
        Job(name, str(campaign.absolute()), str(arguments.out.absolute() / name), **common)
        for name, campaign in zip(names(arguments.campaigns), arguments.campaigns, strict=True)
    ]
    for job in todo if not arguments.force and not arguments.resume else ():
        if earlier := results_in(Path(job.folder), "fit", RESULTS):
            raise InputError(
                job.folder, "-o", f"results of an earlier run ({', '.join(earlier[:4])})",
                "an empty folder, --resume to go on with the batch, or --force to replace its results",
            )  # fmt: skip
    settings = {"report": arguments.report, **({"sc": list(design)} if arguments.report else {})}
    if bridge is not None or arguments.effect is not None:
        settings |= {"effect": arguments.effect, "bridge": bridge is not None}
    settings |= {} if arguments.tests is None else {"tests": arguments.tests}
    files = {} if bridge is None else {bridge.name: digest(bridge)}
    claim = Run(
        arguments.out, "batch", arguments, sha256=files, card=card, settings=settings, results=(JSON,), grows=True
    )
    claim.provenance |= {"sc": list(design), "report": arguments.report}
    return todo, claim


def names(campaigns: Sequence[Path]) -> list[str]:
    """Names of campaigns in a batch: those of their folders, with as many of the folders above as tells them apart.

    File systems that do not tell capitals from small letters hold them, too.

    >>> names([Path("/2023/deck"), Path("/2024/deck"), Path("/tower")])
    ['2023-deck', '2024-deck', 'tower']
    """
    parts = [campaign_folder(campaign).resolve().parts[1:] or ("campaign",) for campaign in campaigns]
    folded = [[part.casefold() for part in path] for path in parts]
    unique: list[str] = []
    for path, alike in zip(parts, folded, strict=True):
        depth = 1
        while depth < len(path) and sum(alike[-depth:] == other[-depth:] for other in folded) > 1:
            depth += 1
        name = label = "-".join(path[-depth:]).encode(errors="backslashreplace").decode()
        count = 1
        while name.casefold() in {JSON, CSV, PAGE, *(other.casefold() for other in unique)}:
            count += 1
            name = f"{label}-{count}"
        unique.append(name)
    return unique


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
    """Fit, size and write the report where they are wanted, unless the whole results of this very job lie there."""
    from scruton.infer.store import POSTERIOR, SUMMARY, write_fit
    from scruton.report.build import HTML, write_report
    from scruton.report.parts import Asked, check_bridge, scruton_numbers_of, sizing_part
    from scruton.sizing.results import RESULT
    from scruton.workers import tell

    bridge = None if job.bridge is None else Path(job.bridge)
    checked = None if bridge is None else check_bridge(Path(job.campaign), bridge)
    asked = Namespace(
        campaign=Path(job.campaign), out=Path(job.folder), model=job.model, tests=job.tests, seed=job.seed,
        effect=job.effect, quiet=True, force=job.force, resume=True,
    )  # fmt: skip
    task = FitTask.of(asked)
    settings: dict[str, Any] = {"report": True, "sc": list(job.design)} if job.report else {}
    settings |= {"bridge": True} if bridge is not None else {}
    claim = task.claim(asked, {} if checked is None else checked.sha256, settings)
    results = [POSTERIOR, SUMMARY, *([HTML] if job.report else []), *([RESULT] if bridge is not None else [])]
    if not job.force and claim.done(results) and not _missing(job):
        return
    with claim as work:
        fit = task.fit(work)
        write_fit(fit, work.new)
        tell(TOPIC, job.folder)
        sizing, in_wind = None, bool(fit.summary["tests"])
        if bridge is not None:
            sizing = sizing_part(work.new, Asked(bridge), job.seed)
            write_document(work.new / RESULT, sizing.content)
            tell(TOPIC, job.folder)
        if job.report:
            of_the_bridge = partial(scruton_numbers_of, fit.tree, bridge) if bridge and not job.design else job.design
            write_report(fit, work.new, design_sc=of_the_bridge if in_wind else (), sizing=sizing)
        work.publish()


def _missing(job: Job) -> list[str]:
    """What is missing from the report of a finished folder."""
    content = read_json(Path(job.folder) / "report.json") if job.report else {}
    return [failure["sentence"] for failure in content.get("failures", [])]


def summarise(job: Job) -> Entry:
    """Read a finished folder: the entry of its campaign."""
    from scruton.griffin import predict
    from scruton.infer.store import read_tree

    folder = Path(job.folder)
    tree, summary = read_tree(folder)
    predictions = [
        predict(tree, scruton_number=sc, seed=job.seed).to_json() for sc in (job.design if summary["tests"] else ())
    ]
    flags = list(summary["flags"])
    state, reason = (CONVERGED, "") if summary["converged"] else (NOT_CONVERGED, "; ".join(flags[:1]))
    if missing := _missing(job):
        state, reason = FAILED, "; ".join(missing)
    return _blank(job, state, reason) | {
        "title": summary["title"],
        "report": f"{job.name}/report.html" if (folder / "report.html").is_file() else None,
        "unit": summary["amplitude_unit"],
        "rigs": len(summary["rigs"]),
        "tests": len(summary["tests"]),
        "peaks": [_peak(test) for test in summary["tests"] if test["peak"]],
        "predictions": predictions,
        "flags": list(dict.fromkeys([*flags, *(flag for prediction in predictions for flag in prediction["flags"])])),
        **({"required": _required(folder)} if job.bridge is not None else {}),
        **({"effect": summary["effect"]["used"]} if job.effect is not None else {}),
    }


def _required(folder: Path) -> list[dict[str, Any]]:
    """What the modes of the bridge need, at the confidence that is spoken of, or for any of them where it asks that."""
    from scruton.report.needs import required_of
    from scruton.sizing.results import RESULT

    content = read_document(folder / RESULT, "what the batch wrote")
    return [
        {"mode": mode["name"], "rule": mode["governing"], "damping_ratio": required_of(content, mode)}
        for mode in content["modes"]
    ]


def _peak(test: dict[str, Any]) -> dict[str, Any]:
    """What the table shows of a peak test; laws other than the paper's have no Y1 and epsilon."""
    estimates = {key: test["parameters"].get(key) for key in ("scruton_number", "a_star", "Y1", "epsilon")}
    kept = ("median", "mean", "sd", "interval")
    return {"test": test["name"], "rig": test["rig"]} | {
        key: None if value is None else {name: value[name] for name in kept} for key, value in estimates.items()
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
