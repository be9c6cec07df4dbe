"""The summary of a batch: batch.json, batch.csv, batch.html, and its table for the terminal."""

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from scruton.cells import safe_cell
from scruton.documents import write_document, write_text
from scruton.report.conventions import damping, shown_in
from scruton.report.document import Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL, estimate, stated, unit_text
from scruton.sizing.checks import ASKED
from scruton.terminal import line_width

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
    header += [column for name in QUANTITIES.values() for column in (name, f"{name} q05", f"{name} q95")]
    design = [f"amplitude at Sc {stated(sc)}" for sc in batch.design]
    needs = [f"required damping ratio at {ASKED} confidence", "of mode"] if _sized(batch) else []
    header += [*needs, "unit", *(column for name in design for column in (name, f"{name} q05", f"{name} q95"))]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    for entry in batch.campaigns:
        leading = [entry[key] for key in ("name", "title", "state", "reason", "rigs", "tests")]
        leading += [len(entry["flags"]), entry["name"] if entry["rigs"] is not None else None, entry["report"]]
        predicted = [cell for amplitude in _predicted(entry, batch) for cell in _numbers(amplitude)]
        for peak in entry["peaks"] or [{}]:
            quantities = [cell for key in QUANTITIES for cell in _numbers(peak.get(key))]
            needed = [*_worst(entry)] if needs else []
            row = [*leading, peak.get("test"), peak.get("rig"), *quantities, *needed, entry["unit"], *predicted]
            writer.writerow([safe_cell(cell) for cell in row])
    return stream.getvalue()


def _predicted(entry: "Entry", batch: "Batch") -> list[dict[str, Any] | None]:
    """Amplitude at each design Scruton number; None where the campaign has no prediction."""
    return [prediction["amplitude"] for prediction in entry["predictions"]] or [None] * len(batch.design)


def _numbers(summary: dict[str, Any] | None) -> list[float | None]:
    return [None] * 3 if summary is None else [summary["median"], *summary["interval"][LEVEL]]


def batch_text(batch: "Batch") -> str:
    """Table for the terminal: what is the campaign's stands in the row of its first peak test."""
    header = ["campaign", "state", "rigs", "tests", "Sc", "a*", "90 %", "Y1", "epsilon"]
    header += [f"A(Sc {stated(design)})" for design in batch.design] + ["unit"]
    header += [*(["needs [%]"] if _sized(batch) else []), "flags"]
    rows = []
    for entry in batch.campaigns:
        leading = [entry["name"], entry["state"], _count(entry["rigs"]), _count(entry["tests"])]
        factor, unit = shown_in(entry["unit"] or "-")
        last = [TERMINAL.interval(*_numbers(predicted), factor=factor)[0] for predicted in _predicted(entry, batch)]
        required, _ = _worst(entry)
        needs = [TERMINAL.number(None if required is None else 100.0 * required)] if _sized(batch) else []
        last += [unit, *needs, str(len(entry["flags"]))]
        for peak in entry["peaks"] or [{}]:
            sc, (amplitude, low, high), y1, epsilon = (_numbers(peak.get(key)) for key in QUANTITIES)
            stable = TERMINAL.interval(amplitude, low, high, factor=factor)
            cells = [TERMINAL.number(sc[0]), *stable, *map(TERMINAL.number, (y1[0], epsilon[0]))]
            rows.append((*leading, *cells, *last))
            leading, last = [""] * len(leading), [""] * len(last)
    return render_text([Table("batch", "", tuple(header), tuple(rows)), paragraph(_said(batch))], line_width())


def _sized(batch: "Batch") -> bool:
    """Whether a bridge was asked for."""
    return any("required" in entry for entry in batch.campaigns)


def _worst(entry: "Entry") -> tuple[float | None, str | None]:
    """The largest damping ratio that a mode needs, and the mode; nothing where there is none, or no bound to it."""
    modes = entry.get("required", [])
    if not modes or any(mode["damping_ratio"] is None for mode in modes):
        return None, next((mode["mode"] for mode in modes if mode["damping_ratio"] is None), None)
    worst = max(modes, key=lambda mode: float(mode["damping_ratio"]))
    return worst["damping_ratio"], worst["mode"]


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
        design=[stated(sc) for sc in batch.design],
        sized=_sized(batch),
        campaigns=[_shown(entry, batch) for entry in batch.campaigns],
        provenance=batch.provenance,
    )


def _shown(entry: "Entry", batch: "Batch") -> dict[str, Any]:
    """One campaign as the page shows it: cells are text; a folder without results has nothing to open."""
    folder = f"{quote(entry['name'])}/" if entry["rigs"] is not None else ""
    factor, unit = shown_in(entry["unit"] or "-")
    scales = {"a_star": factor}
    files = [*(["report.html"] if entry["report"] else []), "fit.json"] if folder else []
    return {
        **{key: entry[key] for key in ("name", "title", "campaign", "state", "reason", "flags")},
        "unit": unit_text(unit),
        "counts": [_count(entry[key]).replace("-", "–") for key in ("rigs", "tests")],
        "folder": folder,
        "links": {name: folder + name for name in files},
        "peaks": [
            {"test": peak["test"], **{key: _estimate(peak[key], scales.get(key, 1.0)) for key in QUANTITIES}}
            for peak in entry["peaks"]
        ],
        "needs": "–" if (required := _worst(entry)[0]) is None else damping(required),
        "predicted": [_estimate(amplitude, factor) for amplitude in _predicted(entry, batch)],
    }  # fmt: skip


def _estimate(summary: dict[str, Any] | None, factor: float = 1.0) -> tuple[str, str]:
    """Median and interval, or dashes."""
    median, interval = ("–", "") if summary is None else estimate(summary, factor)
    return median, "" if interval == "as stated" else interval
