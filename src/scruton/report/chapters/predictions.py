"""Predictions: at the design, at every tested Scruton number, and of each peak test from the others."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Motion
from scruton.report.chapters.material import Material, chapter
from scruton.report.document import CAUTION, Block, Callout, Table, paragraph
from scruton.report.wording import estimate, number, percent, stated

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("predictions", "Predictions")
def predictions_chapter(material: Material) -> Iterator[Block]:
    """Every prediction, with how each peak test would have been predicted from the others."""
    if material.design:
        numbers = ", ".join(f"Sc = {stated(one.scruton_number)}" for one in material.design)
        yield paragraph(
            f"The predictions at the design ({numbers}) stand in the summary. They draw on every law of the model "
            "card as often as its weight says."
        )
        if material.cautions():
            yield Callout(CAUTION, "With caution", tuple(material.cautions()))
    if material.in_wind:
        yield _test_table(material)
    if material.crossed:
        yield _crossed_table(material)


def in_model_unit(fit: "Fit", entry: Mapping[str, Any]) -> tuple[str, str, str]:
    """An amplitude as a length at the model's scale, or in degrees: median, 90 % interval and unit."""
    heaving = fit.campaign.section.motion is Motion.HEAVING
    scale = 1e3 * fit.campaign.section.depth if heaving else 180.0 / np.pi
    return (*estimate(entry, scale), "mm" if heaving else "°")


def design_table(material: Material) -> Table:
    """Predictions at the design Scruton numbers."""
    unit = material.unit
    rows = []
    for one in material.design:
        amplitude = one.to_json()["amplitude"]
        median, interval, model_unit = in_model_unit(material.fit, amplitude)
        rows.append(
            (
                stated(one.scruton_number), percent(one.damping_ratio), *estimate(amplitude),
                estimate(amplitude, level="0.95")[1], f"{median} ({interval}) {model_unit}",
                number(one.extrapolation_index, 2),
            )
        )  # fmt: skip
    return Table(
        "design",
        "Predicted stable amplitude at the design Scruton numbers",
        (
            "Sc", "ξₛ", f"median [{unit}]", f"90 % interval [{unit}]", f"95 % interval [{unit}]",
            "at the model's scale, 90 %", "x",
        ),
        tuple(rows),
        "x is the extrapolation index from the nearest test: laws of aerodynamic damping agree for |x| < 0.2 and part "
        "beyond 0.3.",
        data="predictions",
    )  # fmt: skip


def _test_table(material: Material) -> Table:
    """Stable amplitude of every test: measured, found, and predicted for another setting at its Scruton number."""
    rows = []
    for one in material.fit.summary["tests"]:
        measured = material.fit.campaign.test(one["name"]).stable_amplitude
        predicted = material.at_tests.get(one["name"])
        rows.append(
            (
                one["name"], one["rig"], number(one["parameters"]["scruton_number"]["median"]),
                "–" if measured is None else number(measured.mean), *estimate(one["parameters"]["a_star"]),
                *(("–", "–") if predicted is None else estimate(predicted.to_json()["amplitude"])),
            )
        )  # fmt: skip
    return Table(
        "stable_amplitudes",
        f"Stable amplitude at the tested Scruton numbers [{material.unit}]",
        ("test", "rig", "Sc", "measured", "this test", "90 % interval", "another setting", "90 % interval"),
        tuple(rows),
        "“This test” is what its own records say. “Another setting” is the prediction for a rig of the same Scruton "
        "number that was not tested; it draws on all peak tests and carries the discrepancy between settings.",
        (False, False, *[True] * 6),
        data="predictions" if material.at_tests else "tests",
    )


def _crossed_table(material: Material) -> Table:
    """Each peak test predicted from the others, beside what it was."""
    rows = []
    for test, one in material.crossed.items():
        truth = material.measured_or_found(test)
        low, high = one.interval(0.90)
        rows.append(
            (
                test, number(one.scruton_number), *estimate(one.to_json()["amplitude"]), number(truth),
                "from its records" if material.fit.campaign.test(test).stable_amplitude is None else "measured",
                f"{100 * (one.median / truth - 1):+.0f} %".replace("-", "−"),
                "inside" if low <= truth <= high else "OUTSIDE",
            )
        )  # fmt: skip
    return Table(
        "crossed",
        f"Each peak test predicted from the other peak tests [{material.unit}]",
        ("test", "Sc", "predicted", "90 % interval", "found", "how", "error", "90 % interval"),
        tuple(rows),
        "Each is a fit of its own that never sees the records of the test it predicts. Nine in ten should lie inside.",
        (False, True, True, True, True, False, True, False),
    )
