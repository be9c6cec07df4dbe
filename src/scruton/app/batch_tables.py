"""The summary of a batch: batch.json, batch.csv, batch.html, and its table for the terminal."""

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from scruton.cells import safe_cell
from scruton.documents import write_document, write_text
from scruton.report.document import Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL, estimate, stated

if TYPE_CHECKING:
    from scruton.app.batch import Batch, Entry

JSON, CSV, PAGE = "batch.json", "batch.csv", "batch.html"
LEVEL = "0.90"
QUANTITIES = {"scruton_number": "Sc", "a_star": "a*", "Y1": "Y1", "epsilon": "epsilon"}


def write_batch(batch: "Batch", folder: Path) -> None:
    """Write the summary into a folder, each file in one atomic step."""
    write_text(folder / PAGE, batch_page(batch))
    write_text(folder / CSV, batch_csv(batch))
    content = {"counts": batch.counts, "campaigns": list(batch.campaigns), "provenance": batch.provenance}
    write_document(folder / JSON, {"format": 1, **content})


def batch_csv(batch: "Batch") -> str:
    """One row a peak test, or one a campaign that has none; intervals of 90 %."""
    header = ["campaign", "title", "state", "reason", "rigs", "tests", "flags", "folder", "report", "peak test", "rig"]
    header += [one for name in QUANTITIES.values() for one in (name, f"{name} q05", f"{name} q95")]
    design = [f"amplitude at Sc {stated(one)}" for one in batch.design]
    header += ["unit", *(one for name in design for one in (name, f"{name} q05", f"{name} q95"))]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    for one in batch.campaigns:
        own = [one[key] for key in ("name", "title", "state", "reason", "rigs", "tests")]
        own += [len(one["flags"]), one["name"] if one["rigs"] is not None else None, one["report"]]
        predicted = [cell for found in _predicted(one, batch) for cell in _numbers(found)]
        for peak in one["peaks"] or [{}]:
            quantities = [cell for key in QUANTITIES for cell in _numbers(peak.get(key))]
            row = [*own, peak.get("test"), peak.get("rig"), *quantities, one["unit"], *predicted]
            writer.writerow([safe_cell(cell) for cell in row])
    return stream.getvalue()


def _predicted(entry: "Entry", batch: "Batch") -> list[dict[str, Any] | None]:
    """Amplitude at each design Scruton number; None where the campaign has no prediction."""
    return [one["amplitude"] for one in entry["predictions"]] or [None] * len(batch.design)


def _numbers(one: dict[str, Any] | None) -> list[float | None]:
    return [None] * 3 if one is None else [one["median"], *one["interval"][LEVEL]]


def batch_text(batch: "Batch") -> str:
    """Table for the terminal: what is the campaign's stands in the row of its first peak test."""
    header = ["campaign", "state", "rigs", "tests", "Sc", "a*", "90 %", "Y1", "epsilon"]
    header += [f"A(Sc {stated(one)})" for one in batch.design] + ["unit", "flags"]
    rows = []
    for one in batch.campaigns:
        own = [one["name"], one["state"], _count(one["rigs"]), _count(one["tests"])]
        last = [TERMINAL.number(_numbers(found)[0]) for found in _predicted(one, batch)]
        last += [one["unit"] or "-", str(len(one["flags"]))]
        for peak in one["peaks"] or [{}]:
            sc, (amplitude, low, high), y1, epsilon = (_numbers(peak.get(key)) for key in QUANTITIES)
            interval = TERMINAL.range(None if low is None else (low, high))
            found = [*map(TERMINAL.number, (sc[0], amplitude)), interval, *map(TERMINAL.number, (y1[0], epsilon[0]))]
            rows.append((*own, *found, *last))
            own, last = [""] * len(own), [""] * len(last)
    return render_text([Table("batch", "", tuple(header), tuple(rows)), paragraph(_said(batch))])


def _count(value: int | None) -> str:
    return "-" if value is None else str(value)


def _said(batch: "Batch") -> str:
    """How many campaigns are in which state."""
    total = len(batch.campaigns)
    states = ", ".join(f"{count} {state}" for state, count in batch.counts.items())
    return f"{total} campaign{'s' if total != 1 else ''}: {states}."


def batch_page(batch: "Batch") -> str:
    """Write the page: one file that needs nothing else; everything that came from the campaigns' files is escaped."""
    from scruton.report.render_html import page

    return page(
        "batch.html.j2",
        said=_said(batch),
        design=[stated(one) for one in batch.design],
        campaigns=[_shown(one, batch) for one in batch.campaigns],
        provenance=batch.provenance,
    )


def _shown(entry: "Entry", batch: "Batch") -> dict[str, Any]:
    """One campaign as the page shows it: cells are text; a folder without results has nothing to open."""
    folder = f"{quote(entry['name'])}/" if entry["rigs"] is not None else ""
    files = [*(["report.html"] if entry["report"] else []), "fit.json"] if folder else []
    return {
        **{key: entry[key] for key in ("name", "title", "campaign", "state", "reason", "flags")},
        "unit": entry["unit"] or "",
        "counts": [_count(entry[key]).replace("-", "–") for key in ("rigs", "tests")],
        "folder": folder,
        "links": {name: folder + name for name in files},
        "peaks": [
            {"test": one["test"], **{key: _estimate(one[key]) for key in QUANTITIES}} for one in entry["peaks"]
        ],
        "predicted": [_estimate(one) for one in _predicted(entry, batch)],
    }  # fmt: skip


def _estimate(one: dict[str, Any] | None) -> tuple[str, str]:
    """Median and interval, or dashes."""
    median, interval = ("–", "") if one is None else estimate(one)
    return median, "" if interval == "as stated" else interval
