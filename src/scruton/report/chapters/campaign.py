"""What was measured: the campaign and its similitude, structural damping, records with their fitted envelopes."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from scruton.report.chapters.material import Material
from scruton.report.chapters.sizing import similitude_of
from scruton.report.conventions import (
    DAMPING,
    SCRUTON,
    damping,
    damping_symbol,
    damping_words,
    scruton_note,
    shown_in,
    with_unit,
)
from scruton.report.document import Block, Heading, Table, paragraph
from scruton.report.equations import TRIAL
from scruton.report.wording import PAGE, column, estimate, number, stated, unit_text

if TYPE_CHECKING:
    import pandas as pd


def campaign_chapter(material: Material) -> Iterator[Block]:
    """Section, similitude, rigs, tests and records."""
    section, heaving, frames = material.fit.campaign.section, material.heaving, material.frames
    yield paragraph(
        f"One section in {'heave' if heaving else 'torsion'}: width B = {stated(section.width)} m along the wind, "
        f"depth D = {stated(section.depth)} m across it. Amplitudes are "
        f"{'those of the displacement over D' if heaving else 'those of the rotation, in degrees'}."
    )
    if material.sizing is not None:
        tested = [(test["name"], test["parameters"]["scruton_number"]["median"]) for test in material.tests]
        yield similitude_of(material.sizing, tested)
    if material.tests:
        yield _similitude(material)
    for name, caption, starts in (
        ("rigs", "Rigs", ("rig", "mass [", "f0 stated", "damping ratio stated", "ring-downs")),
        ("tests", "Tests in wind", ("test", "rig", "air density", "wind speed", "U/(f0", "frequency in", "peak")),
    ):
        if name in frames:
            kept = [key for key in frames[name] if str(key).startswith(starts) and not frames[name][key].isna().all()]
            yield _from_frame(name, caption, frames[name][kept])
    factor, unit = material.shown
    if "records" in frames:
        yield Table(
            "records",
            "Records",
            ("record", "of", "kind", "length [s]", "cycles", "frequency [Hz]", f"amplitude [{unit}]"),
            [
                (
                    row["record"], row["of"], row["kind"], number(row["length [s]"], 3), str(row["cycles"]),
                    number(row["frequency [Hz]"]),
                    PAGE.range(
                        [factor * row[f"{end} amplitude [{material.unit}]"] for end in ("smallest", "largest")], 3
                    ),
                )
                for row in frames["records"].to_dict("records")
            ],
            numeric=(False, False, False, True, True, True, True),
            data="records",
        )  # fmt: skip


def _similitude(material: Material) -> Table:
    """Dimensionless numbers of every test, which are what a bridge of the same section shares."""
    section, heaving = material.fit.campaign.section, material.heaving
    area = section.width * section.depth if heaving else section.width**3 * section.depth
    rows = []
    for entry in material.tests:
        test = material.fit.campaign.test(entry["name"])
        rig = material.fit.campaign.rig(test.rig)
        mass = float("nan") if rig.mass is None else rig.mass.mean / (test.air_density.mean * area)
        reduced = material.fit.campaign.reduced_velocity(test)
        sc, interval = estimate(entry["parameters"]["scruton_number"], shown_in(SCRUTON)[0])
        factor, unit = shown_in(DAMPING)
        xi = with_unit(estimate(entry["parameters"]["damping_ratio"], factor)[0], unit)
        rows.append(
            (
                entry["name"], entry["rig"], "yes" if entry["peak"] else "no", sc, interval, number(mass), xi,
                number(reduced), number(2.0 * np.pi * entry["wind_frequency"] * section.depth / test.wind_speed.mean),
            )
        )  # fmt: skip
    mass_ratio = "m/(ρBD)" if heaving else "J/(ρB³D)"
    return Table(
        "similitude",
        "Similitude: the tests without dimensions",
        ("test", "rig", "peak", "Sc", "90 % interval", mass_ratio, damping_symbol(), "U/(f₀D)", "K = ωD/U"),
        rows,
        "Peak tests are at the wind speed of the largest amplitude; they share one Griffin curve. "
        + scruton_note(heaving=heaving),
        (False, False, False, *[True] * 6),
        data="tests",
    )


def _from_frame(name: str, caption: str, frame: "pd.DataFrame") -> Table:
    """A frame as a table: four significant digits, units with their powers raised."""
    header, cells = [], []
    for heading, values in frame.items():
        words, _, unit = str(heading).replace("f0", "f₀").partition(" [")
        factor, shown = shown_in(unit.removesuffix("]"))
        if words.startswith("damping ratio"):
            (factor, shown), words = shown_in(DAMPING), words.replace("damping ratio", damping_words())
        elif words == SCRUTON:
            factor, shown = shown_in(SCRUTON)
        text = unit_text(shown)
        header.append(f"{words} [{text}]" if text else words)
        match values.dtype.kind:
            case "f":
                cells.append(column([factor * float(value) for value in values]))
            case "b":
                cells.append(["yes" if flag else "no" for flag in values])
            case _:
                cells.append([str(value) for value in values])
    numeric = [kind.kind in "fi" for kind in frame.dtypes]
    return Table(name, caption, header, [*zip(*cells, strict=True)], numeric=numeric, data=name)


def structural_chapter(material: Material) -> Iterator[Block]:
    """Damping ratio of every rig, by amplitude where there are ring-downs."""
    if material.tests:
        yield damping_table(material)
    if ringdowns := material.fit.ringdowns:
        yield paragraph(
            "A suspension whose damping changes with amplitude shows it here; the Scruton number then depends "
            "on the amplitude at which it is read."
        )
        yield Table(
            "ring_downs",
            f"Structural {damping_words()} by amplitude",
            ("rig", f"amplitude [{material.shown[1]}]", damping_words(), "sd", "plucks"),
            [
                (
                    name, PAGE.range([material.shown[0] * end for end in (band.lower, band.upper)], 3),
                    damping(band.damping_ratio), damping(band.sd, 2), str(band.plucks),
                )
                for name, ring in ringdowns.items()
                for band in ring.bands
            ],
            data="ring_downs",
        )  # fmt: skip
    yield from material.of("structural")


def damping_table(material: Material) -> Table:
    """Structural damping of every rig."""
    rows, (factor, unit) = [], shown_in(DAMPING)
    for entry in material.fit.summary["rigs"]:
        rig = material.fit.campaign.rig(entry["name"])
        ring, given = material.fit.ringdowns.get(rig.name), rig.damping_ratio
        as_stated = "–" if given is None else with_unit(number(factor * given.mean, 4), unit)
        if given is not None and given.sd:
            as_stated += f" ± {with_unit(number(factor * given.sd, 2), unit)}"
        median, interval = estimate(entry["parameters"]["damping_ratio"], factor)
        inferred = (with_unit(median, unit), interval if interval == "as stated" else with_unit(interval, unit))
        frequency = ring.frequency if ring else rig.frequency.mean
        rows.append((rig.name, number(frequency), as_stated, str(len(rig.records)), *inferred))
    return Table(
        "damping",
        f"Structural {damping_words()} in still air",
        ("rig", "f₀ [Hz]", "stated", "ring-downs", "found", "90 % interval"),
        rows,
        "Without ring-downs the damping found is the stated one, with the uncertainty of the model card; "
        "where it varies with amplitude, it is that over all amplitudes of the ring-downs.",
        data="rigs",
    )


def records_chapter(material: Material) -> Iterator[Block]:
    """Every record beside its envelope; the constants of the trial functions, Eq. (4), below."""
    yield from material.figure("records")
    if records := material.fit.summary["records"]:
        factor, unit = material.shown
        scales = {"a": factor, "b": 1.0, "c": factor, "d": 1.0}
        yield Heading("Trial functions")
        yield paragraph("The second-order exponential ", TRIAL, " with b > d, and t from the record’s first cycle.")
        yield Table(
            "trial",
            "Constants of the trial function: median, and 90 % interval below it",
            ("record", "test", f"a [{unit}]", "b [1/s]", f"c [{unit}]", "d [1/s]"),
            [
                (
                    record["name"], record["test"],
                    *("\n".join(estimate(record["parameters"][name], scale)) for name, scale in scales.items()),
                )
                for record in records
            ],
            numeric=(False, False, True, True, True, True),
            data="posterior",
        )  # fmt: skip
    yield from material.figure("trial_functions")
