"""The campaign as it was read, and its similitude: what each test is without dimensions."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.schema import Motion
from scruton.report.chapters.material import Material, chapter
from scruton.report.chapters.sizing import similitude_of
from scruton.report.document import Block, Table, paragraph
from scruton.report.wording import column, estimate, number, stated, unit_text

if TYPE_CHECKING:
    import pandas as pd

    from scruton.infer.results import Fit


@chapter("campaign", "Campaign and similitude")
def campaign_chapter(material: Material) -> Iterator[Block]:
    """Section, similitude, rigs, tests and records."""
    section = material.fit.campaign.section
    heaving = section.motion is Motion.HEAVING
    yield paragraph(
        f"One section in {'heave' if heaving else 'torsion'}: width B = {stated(section.width)} m along the wind, "
        f"depth D = {stated(section.depth)} m across it. Amplitudes are "
        f"{'those of the displacement over D' if heaving else 'those of the rotation, in radians'}."
    )
    if material.sizing is not None:
        tested = [(one["name"], one["parameters"]["scruton_number"]["median"]) for one in material.fit.summary["tests"]]
        yield similitude_of(material.sizing, tested)
    if material.in_wind:
        yield similitude_table(material.fit)
    for name, caption, starts in (
        ("rigs", "Rigs", ("rig", "mass [", "f0 stated", "damping ratio stated", "ring-downs")),
        ("tests", "Tests in wind", ("test", "rig", "air density", "wind speed", "U/(f0", "frequency in", "peak")),
    ):
        if name in material.frames:
            frame = material.frames[name]
            kept = [one for one in frame.columns if str(one).startswith(starts) and not frame[one].isna().all()]
            yield from_frame(name, caption, frame[kept])
    if "records" in material.frames:
        yield _record_table(material.frames["records"])


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

    def texts(values: "pd.Series") -> list[str]:
        match values.dtype.kind:
            case "f":
                return column([float(one) for one in values])
            case "b":
                return ["yes" if one else "no" for one in values]
        return [str(one) for one in values]

    return Table(
        name,
        caption,
        tuple(_heading(str(one)) for one in frame.columns),
        tuple(zip(*(texts(frame[heading]) for heading in frame.columns), strict=True)),
        numeric=tuple(frame[heading].dtype.kind in "fi" for heading in frame.columns),
        data=name,
    )


def _heading(name: str) -> str:
    """A column's name with its unit as a reader writes it."""
    words, _, unit = name.replace("f0", "f₀").partition(" [")
    text = unit_text(unit.removesuffix("]"))
    return f"{words} [{text}]" if text else words
