"""The whole calibration: regimes, processes, resumption, and what comes out.

Its folder has one line a campaign, written as it is done, so that an interrupted run loses none.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scruton.calibrate.campaigns import run_campaign
from scruton.calibrate.coverage import CalibrationResult, summarise
from scruton.calibrate.execution import Execution, at_least
from scruton.calibrate.identifiability import identifiability
from scruton.calibrate.regimes import REGIMES, chosen
from scruton.calibrate.tables import write_tables
from scruton.documents import write_bytes, write_text
from scruton.errors import InputError
from scruton.infer.cards import ModelCard, load_card
from scruton.provenance import versions

SETTINGS, LINES = "settings.json", "campaigns"


def run_calibration(
    how: Execution,
    *,
    regimes: Sequence[str] | None = None,
    campaigns: int = 500,
    seed: int = 0,
    model: str = "default",
) -> CalibrationResult:
    """Simulate and fit campaigns whose truths come from the prior, and see how often the intervals hold them.

    Parameters
    ----------
    how : Execution
        Where the results go, and by whom.
    regimes : sequence of str, optional
        Some of `REGIMES`, or patterns such as ``law-*``; by default all that need no other package.
    campaigns : int
        In every regime.
    seed : int
        The one source of randomness.
    model : str
        Model card: a shipped name or a TOML file. A regime replaces some of its priors; see `Regime.card`.

    Raises
    ------
    InputError
        For unknown regimes, wake oscillators without VIVyD, a card that cannot be read, or a folder that holds results.
    """
    at_least(2, "calibration", campaigns=campaigns)
    at_least(1, "calibration", jobs=how.workers.jobs)
    wanted, base = chosen(regimes), load_card(model)
    used = versions()
    if any(regime.wake for regime in wanted):
        from scruton.calibrate.wake import vivyd

        used |= {"vivyd": vivyd().__version__}  # without it an error now, not in the first campaign
    settings = {"seed": seed, "model": base.name, "model_sha256": base.sha256, "versions": used}
    compared = {key: settings[key] for key in ("seed", "model", "model_sha256")} | used
    with how.claim("calibrate", inputs={}, settings=compared, results=(SETTINGS, LINES)) as work:
        lines = work.new / LINES
        # A calibration that is finished and shall have more goes on with its campaigns.
        for path in (work.folder / LINES).glob("*.jsonl") if not work.replacing else ():
            if not (lines / path.name).exists():
                write_bytes(lines / path.name, path.read_bytes())
        lines.mkdir(exist_ok=True)
        write_text(work.new / SETTINGS, json.dumps(settings, indent=2, sort_keys=True) + "\n")
        informed = [regime for regime in wanted if not regime.weighs_laws]
        design = tuple(row for regime in informed for row in identifiability(regime, regime.card(base)))
        done = {regime.name: load(work.new, regime.name) for regime in wanted}
        # Campaign by campaign through all regimes, so that a run that is stopped early tells something of each.
        missing = [(name, i) for i in range(campaigns) for name, records in done.items() if i not in records]
        for _, record in how.workers.values(_fitted, [(*task, seed, base) for task in missing]):
            with (lines / f"{record['regime']}.jsonl").open("a", encoding="utf-8", newline="\n") as file:
                file.write(json.dumps(record) + "\n")
            records = done[record["regime"]]
            records[record["index"]] = record
            how.tell(record["regime"], len(records), campaigns)
        for name, records in done.items():  # in an order that does not depend on who was done first
            write_text(lines / f"{name}.jsonl", "".join(json.dumps(records[index]) + "\n" for index in sorted(records)))
        kept = {name: [records[i] for i in range(campaigns)] for name, records in done.items()}
        result = summarise(how.folder, settings, wanted, kept, design)
        write_tables(result, work.new)
        work.publish()
    return result


def _fitted(task: tuple[str, int, int, ModelCard]) -> dict[str, Any]:
    return run_campaign(*task)


def load(folder: Path, regime: str) -> dict[int, dict[str, Any]]:
    """Campaigns of a regime that are done, by index; a last line that was cut off while writing is removed."""
    path = folder / LINES / f"{regime}.jsonl"
    if not path.exists():
        return {}
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(path, "", f"bytes that are no UTF-8 ({error})", "one JSON object a line") from error
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        write_text(path, "".join(lines[:-1]))
        lines = lines[:-1]
    wanted = f"one JSON object a line, a campaign of the regime {regime}"
    try:
        records = [json.loads(line) for line in lines]
    except (ValueError, RecursionError) as error:
        raise InputError(path, "", f"a line that cannot be read ({error})", wanted) from error
    for number, record in enumerate(records, start=1):
        belongs = isinstance(record, dict) and type(record.get("index")) is int and record.get("regime") == regime
        fitted = belongs and isinstance(record.get("converged"), bool) and isinstance(record.get("scores"), dict)
        if not (fitted or (belongs and isinstance(record.get("failed"), str))):
            raise InputError(path, f"line {number}", "what is no campaign of this regime", wanted)
        if record.get("definition") != REGIMES[regime].digest:
            raise InputError(
                path, f"line {number}", f"a campaign of another definition of the regime {regime}",
                "campaigns of one definition: another folder, or --force to simulate and fit all of them anew",
            )  # fmt: skip
    return {record["index"]: record for record in records}
