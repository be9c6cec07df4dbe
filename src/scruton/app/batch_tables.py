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

LEVEL = "0.90"
QUANTITIES = {"scruton_number": "Sc", "a_star": "a*", "Y1": "Y1", "epsilon": "epsilon"}


def write_batch(batch: "Batch", folder: Path) -> None:
    """Write the summary into a folder, each file in one atomic step."""
    page, rows, content = (path.name for path in batch.paths)
    write_text(folder / page, batch_page(batch))
    write_text(folder / rows, batch_csv(batch))
    write_document(
        folder / content,
        {
            "format": 1,
            "counts": batch.counts,
            "campaigns": list(batch.campaigns),
            "provenance": batch.provenance,
        },
    )


def batch_csv(batch: "Batch") -> str:
    """One row a peak test, or one a campaign that has none; intervals of 90 %."""
    design = [f"amplitude at Sc {stated(one)}" for one in batch.design]
    header = ["campaign", "title", "state", "reason", "rigs", "tests", "flags", "folder", "report", "peak test", "rig"]
    header += [one for name in QUANTITIES.values() for one in (name, f"{name} q05", f"{name} q95")]
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
    if not entry["predictions"]:
        return [None] * len(batch.design)
    return [one["amplitude"] for one in entry["predictions"]]


def _numbers(one: dict[str, Any] | None) -> list[float | None]:
    return [None] * 3 if one is None else [one["median"], *one["interval"][LEVEL]]


def batch_text(batch: "Batch") -> str:
    """Table for the terminal."""
    header = ["campaign", "state", "rigs", "tests", "Sc", "a*", "90 %", "Y1", "epsilon"]
    header += [f"A(Sc {stated(one)})" for one in batch.design] + ["unit", "flags"]
    rows = []
    for one in batch.campaigns:
        predicted = [TERMINAL.number(_numbers(found)[0]) for found in _predicted(one, batch)]
        for i, peak in enumerate(one["peaks"] or [{}]):
            sc, (amplitude, low, high), y1, epsilon = (_numbers(peak.get(key)) for key in QUANTITIES)
            own = [one["name"], one["state"], *(_count(one[key]) for key in ("rigs", "tests"))] if not i else [""] * 4
            rows.append(
                [
                    *own, TERMINAL.number(sc[0]), TERMINAL.number(amplitude),
                    TERMINAL.range(None if low is None else (low, high)), TERMINAL.number(y1[0]),
                    TERMINAL.number(epsilon[0]),
                    *(predicted if not i else [""] * len(predicted)),
                    *([one["unit"] or "-", str(len(one["flags"]))] if not i else ["", ""]),
                ]
            )  # fmt: skip
    return render_text([Table("batch", "", tuple(header), tuple(map(tuple, rows))), paragraph(_said(batch))])


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
    """One campaign as the page shows it: cells are text."""
    return {
        **{key: entry[key] for key in ("name", "title", "campaign", "state", "reason", "flags")},
        "unit": entry["unit"] or "",
        "counts": [_count(entry[key]).replace("-", "–") for key in ("rigs", "tests")],
        "folder": f"{quote(entry['name'])}/" if entry["rigs"] is not None else "",
        "links": _links(entry),
        "peaks": [
            {"test": one["test"], **{key: _estimate(one[key]) for key in QUANTITIES}} for one in entry["peaks"]
        ],
        "predicted": [_estimate(one) for one in _predicted(entry, batch)],
    }  # fmt: skip


def _links(entry: "Entry") -> dict[str, str]:
    """What a reader may open, by its name."""
    if entry["rigs"] is None:
        return {}
    files = ["report.html"] if entry["report"] else []
    return {name: f"{quote(entry['name'])}/{name}" for name in [*files, "fit.json"]}


def _estimate(one: dict[str, Any] | None) -> tuple[str, str]:
    """Median and interval, or dashes."""
    if one is None:
        return "–", ""
    median, interval = estimate(one)
    return median, "" if interval == "as stated" else interval
