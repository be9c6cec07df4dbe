"""The campaign as it was read, and its similitude: what each test is without dimensions."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.schema import Motion
from scruton.report.chapters.material import Material
from scruton.report.chapters.sizing import similitude_of
from scruton.report.document import Block, Chapter, Paragraph, Table
from scruton.report.wording import column, estimate, number, stated, unit_text

if TYPE_CHECKING:
    import pandas as pd

    from scruton.infer.results import Fit


def campaign_chapter(material: Material) -> Chapter:
    """Section, similitude, rigs, tests and records."""
    section = material.fit.campaign.section
    heaving = section.motion is Motion.HEAVING
    words = (
        f"One section in {'heave' if heaving else 'torsion'}: width B = {stated(section.width)} m along the wind, "
        f"depth "
        f"D = {stated(section.depth)} m across it. Amplitudes are "
        f"{'those of the displacement over D' if heaving else 'those of the rotation, in radians'}."
    )
    blocks: list[Block] = [Paragraph((words,))]
    if material.sizing is not None:
        tested = [(one["name"], one["parameters"]["scruton_number"]["median"]) for one in material.fit.summary["tests"]]
        blocks.append(similitude_of(material.sizing, tested))
    if material.in_wind:
        blocks.append(similitude_table(material.fit))
    return Chapter("campaign", "Campaign and similitude", (*blocks, *campaign_tables(material.frames)))


def similitude_table(fit: "Fit") -> Table:
    """Dimensionless numbers of every test, which are what a bridge of the same section shares."""
    section = fit.campaign.section
    heaving = section.motion is Motion.HEAVING
    rows = []
    for one in fit.summary["tests"]:
        test = fit.campaign.test(one["name"])
        rig = fit.campaign.rig(test.rig)
        area = section.width * section.depth if heaving else section.width**3 * section.depth
        mass = float("nan") if rig.mass is None else rig.mass.mean / (test.air_density.mean * area)
        reduced = test.wind_speed.mean / (rig.frequency.mean * section.depth)
        sc, interval = estimate(one["parameters"]["scruton_number"])
        xi = estimate(one["parameters"]["damping_ratio"], 100.0)[0]
        rows.append(
            (
                one["name"], one["rig"], "yes" if one["peak"] else "no", sc, interval, number(mass), f"{xi} %",
                number(reduced), number(2.0 * np.pi * one["wind_frequency"] * section.depth / test.wind_speed.mean),
            )
        )  # fmt: skip
    return Table(
        "similitude",
        "Similitude: the tests without dimensions",
        (
            "test", "rig", "peak", "Sc", "90 % interval", "m/(ρBD)" if heaving else "J/(ρB³D)", "ξₛ", "U/(f₀D)",
            "K = ωD/U",
        ),
        tuple(rows),
        "Peak tests are at the wind speed of the largest amplitude; they share one Griffin curve.",
        (False, False, False, *[True] * 6),
        data="tests",
    )  # fmt: skip


def campaign_tables(frames: "Mapping[str, pd.DataFrame]") -> list[Table]:
    """Rigs, tests and records as they were read."""
    found = []
    plans: tuple[tuple[str, str, tuple[str, ...]], ...] = (
        ("rigs", "Rigs", ("rig", "mass [", "f0 stated", "damping ratio stated", "ring-downs")),
        ("tests", "Tests in wind", ("test", "rig", "air density", "wind speed", "U/(f0", "frequency in", "peak")),
    )
    for name, caption, starts in plans:
        if name in frames:
            frame = frames[name]
            kept = [one for one in frame.columns if str(one).startswith(starts) and not frame[one].isna().all()]
            found.append(from_frame(name, caption, frame[kept]))
    if "records" in frames:
        found.append(_record_table(frames["records"]))
    return found


def _record_table(frame: "pd.DataFrame") -> Table:
    smallest = next(str(one) for one in frame.columns if str(one).startswith("smallest"))
    unit = smallest.partition("[")[2]
    rows = [
        (
            str(one["record"]), str(one["of"]), str(one["kind"]), number(float(one["length [s]"]), 3),
            str(one["cycles"]), number(float(one["frequency [Hz]"])),
            f"{number(float(one[smallest]), 3)} to {number(float(one[smallest.replace('smallest', 'largest')]), 3)}",
        )
        for one in frame.to_dict("records")
    ]  # fmt: skip
    return Table(
        "records",
        "Records",
        ("record", "of", "kind", "length [s]", "cycles", "frequency [Hz]", f"amplitude [{unit}"),
        tuple(rows),
        numeric=(False, False, False, True, True, True, True),
        data="records",
    )


def from_frame(name: str, caption: str, frame: "pd.DataFrame") -> Table:
    """A frame as a table: four significant digits, units with their powers raised."""
    columns, numeric = [], []
    for heading in frame.columns:
        kind = frame[heading].dtype.kind
        numeric.append(kind in "fi")
        if kind == "f":
            columns.append(column([float(one) for one in frame[heading]]))
        elif kind == "b":
            columns.append(["yes" if one else "no" for one in frame[heading]])
        else:
            columns.append([str(one) for one in frame[heading]])
    return Table(
        name,
        caption,
        tuple(_heading(str(one)) for one in frame.columns),
        tuple(zip(*columns, strict=True)),
        numeric=tuple(numeric),
        data=name,
    )


def _heading(name: str) -> str:
    """A column's name with its unit as a reader writes it."""
    words, _, unit = name.replace("f0", "f₀").partition(" [")
    text = unit_text(unit.removesuffix("]"))
    return f"{words} [{text}]" if text else words
