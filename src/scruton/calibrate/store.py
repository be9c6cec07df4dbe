"""The folder of a calibration: one line a campaign as it is done, so that an interrupted run loses none."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scruton.calibrate.execution import Execution
from scruton.documents import write_bytes, write_text
from scruton.errors import InputError
from scruton.workspace import Workspace

SETTINGS, LINES = "settings.json", "campaigns"


def claim(how: Execution, settings: Mapping[str, Any]) -> Workspace:
    """Claim the folder of a calibration: what every campaign's numbers depend on is in `settings`."""
    flat = {key: value for key, value in settings.items() if key != "versions"} | settings["versions"]
    return how.claim("calibrate", inputs={}, settings=flat, results=(SETTINGS, LINES))


def begin(work: Workspace, settings: Mapping[str, Any]) -> None:
    """Note the settings, and take up the campaigns of a calibration that is finished and shall have more."""
    for path in (work.folder / LINES).glob("*.jsonl") if not work.replacing else ():
        mine = work.new / LINES / path.name
        if not mine.exists():
            write_bytes(mine, path.read_bytes())
    (work.new / LINES).mkdir(exist_ok=True)
    write_text(work.new / SETTINGS, json.dumps(settings, indent=2, sort_keys=True) + "\n")


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
        if not _is_record(record, regime):
            raise InputError(path, f"line {number}", "what is no campaign of this regime", wanted)
    return {record["index"]: record for record in records}


def _is_record(record: Any, regime: str) -> bool:
    """Whether this is what `scruton.calibrate.campaigns.run_campaign` gives."""
    if not isinstance(record, dict) or type(record.get("index")) is not int or record.get("regime") != regime:
        return False
    if isinstance(record.get("failed"), str):
        return True
    return isinstance(record.get("converged"), bool) and isinstance(record.get("scores"), dict)


def append(folder: Path, record: Mapping[str, Any]) -> None:
    """Add a campaign to its regime's file."""
    with (folder / LINES / f"{record['regime']}.jsonl").open("a", encoding="utf-8", newline="\n") as file:
        file.write(json.dumps(record) + "\n")


def put_in_order(folder: Path, records: Mapping[int, Mapping[str, Any]]) -> None:
    """Write a regime's campaigns in the order of their index, which does not depend on who was done first."""
    lines = [json.dumps(records[index]) + "\n" for index in sorted(records)]
    if lines:
        write_text(folder / LINES / f"{records[min(records)]['regime']}.jsonl", "".join(lines))
