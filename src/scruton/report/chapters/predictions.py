"""Predictions: at the design, at every tested Scruton number, and of each peak test from the others."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from scruton.report.chapters.material import Material
from scruton.report.document import CAUTION, Block, Callout, Chapter, Paragraph, Table
from scruton.report.wording import estimate, number, percent, stated

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit


def predictions_chapter(material: Material) -> Chapter:
    """Every prediction, with how each peak test would have been predicted from the others."""
    fit = material.fit
    blocks: list[Block] = []
    if material.design:
        places = ", ".join(f"Sc = {stated(one.scruton_number)}" for one in material.design)
        blocks.append(
            Paragraph(
                (
                    f"The predictions at the design ({places}) stand in the summary. They draw on every law of the "
                    f"model card as often as its weight says.",
                )
            )
        )
        if material.cautions():
            blocks.append(Callout(CAUTION, "With caution", tuple(material.cautions())))
    if material.in_wind:
        blocks.append(test_table(fit, material.at_tests))
    if material.crossed:
        blocks.append(crossed_table(fit, material.crossed))
    return Chapter("predictions", "Predictions", tuple(blocks))


def design_table(fit: "Fit", design: "Sequence[Prediction]") -> Table:
    """Predictions at the design Scruton numbers."""
    from scruton.report.chapters.summary import in_model_unit

    unit = fit.campaign.section.amplitude_unit
    rows = []
    for one in design:
        entry = one.to_json()
        amplitude = entry["amplitude"]
        median, interval = estimate(amplitude)
        wide = estimate({"median": amplitude["median"], "interval": {"0.90": amplitude["interval"]["0.95"]}})[1]
        rows.append(
            (
                stated(one.scruton_number), percent(one.damping_ratio), median, interval, wide,
                in_model_unit(fit, amplitude), number(one.extrapolation_index, 2),
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


def test_table(fit: "Fit", at_tests: "Mapping[str, Prediction]") -> Table:
    """Stable amplitude of every test: measured, found, and predicted for another setting at its Scruton number."""
    unit = fit.campaign.section.amplitude_unit
    rows = []
    for one in fit.summary["tests"]:
        measured = fit.campaign.test(one["name"]).stable_amplitude
        predicted = at_tests.get(one["name"])
        rows.append(
            (
                one["name"],
                one["rig"],
                number(one["parameters"]["scruton_number"]["median"], 4),
                "–" if measured is None else number(measured.mean),
                *estimate(one["parameters"]["a_star"]),
                *(("–", "–") if predicted is None else estimate(predicted.to_json()["amplitude"])),
            )
        )
    return Table(
        "stable_amplitudes",
        f"Stable amplitude at the tested Scruton numbers [{unit}]",
        ("test", "rig", "Sc", "measured", "this test", "90 % interval", "another setting", "90 % interval"),
        tuple(rows),
        "“This test” is what its own records say. “Another setting” is the prediction for a rig of the same Scruton "
        "number that was not tested; it draws on all peak tests and carries the discrepancy between settings.",
        (False, False, True, True, True, True, True, True),
        data="predictions" if at_tests else "tests",
    )


def crossed_table(fit: "Fit", crossed: "Mapping[str, Prediction]") -> Table:
    """Each peak test predicted from the others, beside what it was."""
    unit = fit.campaign.section.amplitude_unit
    found = {one["name"]: one["parameters"]["a_star"] for one in fit.summary["tests"]}
    rows = []
    for test, one in crossed.items():
        measured = fit.campaign.test(test).stable_amplitude
        truth = found[test]["median"] if measured is None else measured.mean
        low, high = one.interval(0.90)
        rows.append(
            (
                test, number(one.scruton_number), *estimate(one.to_json()["amplitude"]), number(truth),
                "measured" if measured is not None else "from its records",
                f"{100 * (one.median / truth - 1):+.0f} %".replace("-", "−"),
                "inside" if low <= truth <= high else "OUTSIDE",
            )
        )  # fmt: skip
    return Table(
        "crossed",
        f"Each peak test predicted from the other peak tests [{unit}]",
        ("test", "Sc", "predicted", "90 % interval", "found", "how", "error", "90 % interval"),
        tuple(rows),
        "Each is a fit of its own that never sees the records of the test it predicts. Nine in ten should lie inside.",
        (False, True, True, True, True, False, True, False),
    )
