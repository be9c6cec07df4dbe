"""Writing a campaign: its TOML file, and the CSV files of its records."""

from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Campaign, Fluid, Motion, Rig, Section, Test


def write_toml(path: Path, content: dict[str, Any]) -> None:
    """Write a TOML file, with the same bytes on every system."""
    import tomli_w

    path.write_text(tomli_w.dumps(content), encoding="utf-8", newline="\n")


def write_record(
    path: Path,
    section: Section,
    response: FloatArray,
    time: FloatArray | None = None,
    *,
    digits: int,
    angle: str = "deg",
) -> None:
    """Write a record as CSV: y/D in mm, rotation [rad] in `angle`, with so many digits of the largest reading.

    Without the time [s] the file has one column.
    """
    if section.motion is Motion.TORSIONAL:
        header, values = f"rotation [{angle}]", np.rad2deg(response) if angle == "deg" else response
    else:
        header, values = "displacement [mm]", response * section.depth * 1e3
    decimals = max(0, digits - 1 - int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-12)))))
    rows = [f"{y:.{decimals}f}" for y in values.tolist()]
    if time is not None:
        stamps = max(4, int(np.ceil(-np.log10(time[1] - time[0]))) + 2)
        header = f"time [s],{header}"
        rows = [f"{t:.{stamps}f},{row}" for t, row in zip(time.tolist(), rows, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8", newline="\n")


def save_campaign(campaign: Campaign, folder: Path) -> None:
    """Write a campaign, sampled evenly from time zero, into an empty folder; every test is the peak of its rig.

    The sampling rate stands in campaign.toml, the records have one column.
    """
    section = campaign.section
    mass_unit = "kg*m^2/m" if section.motion is Motion.TORSIONAL else "kg/m"

    def records(owner: Rig | Test) -> list[dict[str, str]]:
        tables = []
        for record in owner.records:
            write_record(folder / record.name, section, record.response, digits=5)
            rate = (len(record.time) - 1) / (record.time[-1] - record.time[0])
            tables.append({"file": record.name, "kind": record.kind.value, "sample_rate": f"{rate:.10g} Hz"})
        return tables

    body = {"motion": section.motion.value, "width": f"{section.width!r} m", "depth": f"{section.depth!r} m"}
    content: dict[str, Any] = {
        "format": 1,
        "title": campaign.title,
        "source": campaign.source,
        "section": body | ({} if section.fluid is Fluid.AIR else {"fluid": section.fluid.value}),
        "rigs": [
            {"name": rig.name}
            | ({"mass": _stated(rig.mass, mass_unit)} if rig.mass else {})
            | {"frequency": _stated(rig.frequency, "Hz")}
            | ({"damping_ratio": _stated(rig.damping_ratio)} if rig.damping_ratio else {})
            | ({"records": records(rig)} if rig.records else {})
            for rig in campaign.rigs
        ],
        "tests": [
            {"name": test.name, "rig": test.rig, "air_density": _stated(test.air_density, "kg/m^3"),
             "wind_speed": _stated(test.wind_speed, "m/s"), "peak": test.peak is not False, "records": records(test)}
            for test in campaign.tests
        ],
    }  # fmt: skip
    write_toml(folder / "campaign.toml", content)


def _stated(quantity: Quantity, unit: str = "") -> Any:
    moments: dict[str, Any] = {"mean": float(quantity.mean)}
    if quantity.sd is not None:
        moments["sd"] = float(quantity.sd)
    shown = {key: f"{value!r} {unit}" if unit else value for key, value in moments.items()}
    return shown if len(shown) > 1 else shown["mean"]
