"""A campaign in memory to a campaign.toml and one CSV a record."""

from pathlib import Path
from typing import Any

import numpy as np

from scruton.campaign.schema import Campaign, Fluid, Motion, Quantity, Record

_DIGITS = 5  # significant, of the largest reading


def write_case(campaign: Campaign, folder: Path) -> None:
    """Write a campaign of the challenge; the sampling rate stands in campaign.toml, the records have one column.

    Parameters
    ----------
    campaign : Campaign
        Sampled evenly from time zero.
    folder : Path
        There, and empty.
    """
    import tomli_w

    motion, depth = campaign.section.motion, campaign.section.depth
    mass_unit = "kg*m^2/m" if motion is Motion.TORSIONAL else "kg/m"
    content: dict[str, Any] = {
        "format": 1,
        "title": campaign.title,
        "source": campaign.source,
        "section": {
            "motion": motion.value,
            "width": f"{campaign.section.width!r} m",
            "depth": f"{campaign.section.depth!r} m",
        }
        | ({} if campaign.section.fluid is Fluid.AIR else {"fluid": campaign.section.fluid.value}),
        "rigs": [
            {"name": rig.name}
            | ({"mass": _stated(rig.mass, mass_unit)} if rig.mass else {})
            | {"frequency": _stated(rig.frequency, "Hz")}
            | ({"damping_ratio": _stated(rig.damping_ratio)} if rig.damping_ratio else {})
            | ({"records": [_record(one) for one in rig.records]} if rig.records else {})
            for rig in campaign.rigs
        ],
        "tests": [
            {
                "name": test.name,
                "rig": test.rig,
                "air_density": _stated(test.air_density, "kg/m^3"),
                "wind_speed": _stated(test.wind_speed, "m/s"),
                "peak": True,
                "records": [_record(one) for one in test.records],
            }
            for test in campaign.tests
        ],
    }
    for records in (*(rig.records for rig in campaign.rigs), *(test.records for test in campaign.tests)):
        for record in records:
            _write_csv(folder / record.name, record, motion, depth)
    (folder / "campaign.toml").write_text(tomli_w.dumps(content), encoding="utf-8", newline="\n")


def _stated(quantity: Quantity, unit: str = "") -> Any:
    def show(value: float) -> Any:
        return f"{float(value)!r} {unit}" if unit else float(value)

    return show(quantity.mean) if quantity.sd is None else {"mean": show(quantity.mean), "sd": show(quantity.sd)}


def _record(record: Record) -> dict[str, Any]:
    rate = (len(record.time) - 1) / (record.time[-1] - record.time[0])
    return {"file": record.name, "kind": record.kind.value, "sample_rate": f"{rate:.10g} Hz"}


def _write_csv(path: Path, record: Record, motion: Motion, depth: float) -> None:
    if motion is Motion.TORSIONAL:
        header, values = "rotation [deg]", np.rad2deg(record.response)
    else:
        header, values = "displacement [mm]", record.response * depth * 1e3
    decimals = max(0, _DIGITS - 1 - int(np.floor(np.log10(float(np.abs(values).max())))))
    lines = [f"{y:.{decimals}f}" for y in values.tolist()]
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8", newline="\n")
