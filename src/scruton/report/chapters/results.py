"""What was found: aerodynamic damping, the Griffin plot and its law, posteriors, predictions."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.report.chapters.material import Material
from scruton.report.conventions import damping, damping_symbol, parameter_unit, parameter_words, scruton, shown_in
from scruton.report.document import CAUTION, Block, Callout, Equation, Heading, Table, paragraph
from scruton.report.equations import AERODYNAMIC, RECIPROCAL
from scruton.report.errors import MEANING_AT_90, Errors, at_most, errors_of_prediction, errors_of_test, known, written
from scruton.report.maths import row
from scruton.report.summaries import (
    covered,
    forces_hold,
    law_of_tests,
    law_of_tests_leads,
    model_printed,
    monte_carlo,
    stated_discrepancies,
    told_errors,
)
from scruton.report.tables import unit_of
from scruton.report.wording import PAGE, Notation, estimate, law_text, number, percent, stated, unit_text

if TYPE_CHECKING:
    from scruton.infer.sensitivity import Band, PredictionSensitivity

_BY_TEST = (
    "One transient at one Scruton number holds a whole Griffin plot: each test’s own, without the records of the "
    "others, foretells where their stable amplitudes lie."
)
_NOT_LED = (
    "What each test’s records alone say by {}. Another law leads in predictions: these plots are no evidence that one "
    "transient holds the whole."
)
# What predictions may follow, in words.
SOURCES = {"tau": "discrepancy of the amplitude τ", "kappa": "discrepancy of the relaxation κ"}
_LOCK_IN = (
    "Records at further wind speeds of one rig tell how the stable amplitude rises and falls over the lock-in range; "
    "the Griffin plot is of its peak."
)


def aerodynamic_chapter(material: Material) -> Iterator[Block]:
    """Figures of aerodynamic damping against amplitude, and of the stability that follows from it."""
    if figures := material.of("aerodynamic"):
        yield paragraph("The aerodynamic damping ratio follows from the envelope’s rate of change,")
        yield Equation(AERODYNAMIC)
        yield paragraph(
            "Where it is as far below zero as the structural one is above, the amplitude stays as it is; it is stable "
            "where the sum of both grows with amplitude."
        )
        yield from figures


def griffin_chapter(material: Material) -> Iterator[Block]:
    """The plot that can be read off, the plots from single tests, and the laws."""
    if not material.tests:
        return
    laws, by_test, lock_in = (material.figure(name) for name in ("laws", "griffin_by_test", "lock_in"))
    first = material.figure("griffin") if material.sizing is None else []  # it stands on the first page then
    apart = (*laws, *by_test, *lock_in, *first)
    yield from (picture for picture in material.of("griffin-plot") if picture not in apart)
    weights = _law_table(material)
    summary = material.fit.summary
    said = _BY_TEST if law_of_tests_leads(summary) else _NOT_LED.format(law_of_tests(summary))
    below: dict[str, Sequence[Block]] = {
        "The law of aerodynamic damping": [*([weights] if weights.rows else []), *_exponent(material), *laws],
        "From one test at a time": [paragraph(said), *by_test] if by_test else [],
        "Amplitude against wind speed": [paragraph(_LOCK_IN), *lock_in] if lock_in else [],
    }
    for heading, blocks in below.items():
        if blocks:
            yield Heading(heading)
            yield from blocks


def _exponent(material: Material) -> Iterator[Block]:
    """The exponent and its band, where it is free."""
    if material.fit.card.exponent is not None and (found := material.fit.summary["campaign"].get("parameters")):
        median, interval = estimate(found["n"])
        yield paragraph(f"The exponent of the law is free: n = {median}, 90 % interval {interval}.")


def _law_table(material: Material) -> Table:
    """The laws of the model card and what the records say of them; no row where there is but one."""
    weights = material.fit.summary["laws"].get("weights", {})
    best = max((entry["log_evidence"] for entry in weights.values() if entry["log_evidence"] is not None), default=0.0)
    rows = []
    for label, law in weights.items() if len(weights) > 1 else ():
        below, error = law["log_evidence"], law["log_evidence_error"]
        rows.append(
            (
                law_text(label), f"{law['prior']:.2f}",
                "–" if below is None else f"{below - best:.1f}".replace("-", "−"),
                "by Laplace's approximation" if error is None else f"± {error:.2f}", f"{law['weight']:.3f}",
                "–" if law["stacking"] is None else f"{law['stacking']:.3f}",
            )
        )  # fmt: skip
    return Table(
        "laws",
        "Laws of aerodynamic damping, weighed by the records of the peak tests",
        ("law", "prior", "log evidence below the best", "error", "weight in predictions", "stacking"),
        rows,
        " ".join(
            filter(
                None,
                (
                    material.fit.summary["laws"].get("explained", ""),
                    "Stacking scores each record, left out, by its joint density given all others. Where one law leads "
                    "and holds, others far below it are not sampled. Predictions draw on each law as often as its "
                    "weight says.",
                ),
            )
        ),
        (False, True, True, False, True, True),
        data="laws",
    )


def reciprocal_chapter(material: Material) -> Iterator[Block]:
    """1/A against the Scruton number, in which the paper's law is a straight line."""
    if figures := material.of("reciprocal"):
        yield paragraph("Under the paper’s law the reciprocal of the stable amplitude is a straight line in Sc:")
        yield Equation(RECIPROCAL)
        yield paragraph(
            "where ", row("x"), " is the distance from the test in units of the Scruton number that its relaxation "
            "rate is worth. A bend says that another law, or an effect that is not modelled, is at work.",
        )  # fmt: skip
        yield from figures


def posterior_chapter(material: Material) -> Iterator[Block]:
    """One table a test; corner plots of the peak tests."""
    if material.tests:
        yield paragraph(model_printed(material.fit.summary))
    doubt = (
        "" if forces_hold(material.fit.summary) else "Y₁ and ε are those of the law n = −1, which does not hold here."
    )
    corners = {picture.name: picture for picture in material.of("posterior")}
    for i, test in enumerate(material.tests, 1):
        tree, entries = material.fit.tree, test["parameters"]
        inner, outer = (errors_of_test(tree, test["name"], entries, level) for level in (0.5, 0.9))
        yield Table(
            f"posterior_{i}",
            f"Test {test['name']}",
            ("parameter", "unit", "median", "50 % interval", "90 % interval", "MC errors"),
            [
                (
                    parameter_words(key), unit_text(unit), estimate(entry, factor)[0],
                    *(estimate(entry, factor, level)[1] for level in ("0.50", "0.90")),
                    written(outer.get(key), PAGE, factor),
                )
                for key, entry in entries.items()
                for factor, unit in [shown_in(parameter_unit(key, unit_of(key, material.unit)))]
            ],
            " ".join(filter(None, (doubt if "Y1" in entries else "", _posterior_errors(entries, inner)))),
            numeric=(False, False, True, True, True, True),
            data="posterior",
        )  # fmt: skip
        if f"corner_{i}" in corners:
            yield corners.pop(f"corner_{i}")
    yield from corners.values()


def _posterior_errors(entries: Mapping[str, Any], inner: Mapping[str, Errors]) -> str:
    """What the Monte Carlo errors of a table of parameters are, and those of the 50 % intervals, over their widths."""
    shares = [
        max(ends) / width
        for key, errors in inner.items()
        if (ends := [one for one in errors[1:] if one is not None])
        and (width := float(np.ptp(entries[key]["interval"]["0.50"]))) > 0.0
    ]
    words = f" Of the ends of 50 % intervals at most {percent(max(shares), 2)} of their widths." if shares else ""
    return f"{MEANING_AT_90}{words}"


def predictions_chapter(material: Material) -> Iterator[Block]:
    """Every prediction, with how each peak test would have been predicted from the others."""
    if material.design:
        yield paragraph("Predictions draw on every law of the model card as often as its weight says.")
        yield design_table(material)
        if cautions := material.cautions():
            yield Callout(CAUTION, "With caution", cautions)
    yield stated_discrepancies([*material.design] or [*material.at_tests.values()], PAGE)
    if material.tests:
        yield _test_table(material)
    yield sensitivity_table(material.sensitivity, PAGE, material.unit)
    rows, (factor, unit) = [], material.shown
    for test, prediction in material.crossed.items():
        truth, amplitude = material.measured_or_found(test), prediction["amplitude"]
        rows.append(
            (
                test, scruton(prediction["sc"]), *estimate(amplitude, factor), number(factor * truth),
                "from its records" if material.fit.campaign.test(test).stable_amplitude is None else "measured",
                _error(amplitude["median"], truth),
                "inside" if within(amplitude["interval"]["0.90"], truth) else "OUTSIDE",
            )
        )  # fmt: skip
    yield Table(
        "crossed",
        f"Each peak test predicted from the other peak tests [{unit}]",
        ("test", "Sc", "predicted", "90 % interval", "found", "how", "error", "90 % interval"),
        rows,
        "Each is a fit of its own that never sees the records of the test it predicts. Nine in ten should lie inside. "
        + at_most((told_errors(one["amplitude"]) for one in material.crossed.values()), PAGE, factor, "of predictions"),
        (False, True, True, True, True, False, True, False),
    )


def _error(predicted: float | None, truth: float) -> str:
    return "∞" if predicted is None else f"{100 * (predicted / truth - 1):+.0f} %".replace("-", "−")


def within(interval: Sequence[float | None], truth: float) -> bool:
    """Whether an interval holds a number; a bound that is missing is infinite."""
    low, high = (np.inf if bound is None else bound for bound in interval)
    return bool(low <= truth <= high)


def sensitivity_table(rows: "Sequence[PredictionSensitivity]", of: Notation, unit: str = "") -> Table:
    """How far predictions, of this unit, follow the priors of the discrepancy and the weights of the laws."""
    factor, unit = shown_in(unit)
    sources = {} if of.plain else SOURCES
    what = f"stable amplitude [{of.unit(unit)}]" if unit else "stable amplitude"

    def shown(band: "Band", errors: "Band") -> tuple[str, ...]:
        return *of.interval(*band, factor=factor), written([known(error) for error in errors], of, factor)

    lines: list[tuple[str, ...]] = []
    for (where, sc), group in groupby(rows, key=lambda one: (one.where, one.scruton_number)):
        first, *others = group
        as_it_is = shown((first.median, first.low, first.high), first.errors)
        lines.append((scruton(sc, of.number), where, "as it is", "", *as_it_is))
        for one in (first, *others):
            source, follows = sources.get(one.source, one.source), of.number(one.distance, 2)
            lines.append(("", "", f"{source}, halved", follows, *shown(one.halved, one.halved_errors)))
            lines.append(("", "", f"{source}, doubled", "", *shown(one.doubled, one.doubled_errors)))
    return Table(
        "prediction_sensitivity",
        f"Sensitivity of predictions: {what}, as it is, and with a prior halved and doubled",
        ("Sc", "where", "prior", "follows", "median", "90 % interval", "MC errors"),
        lines,
        "Halved and doubled: the median of the card's prior of a discrepancy; the odds of the law with most weight. "
        "Follows: cumulative Jensen-Shannon distance per doubling of the power of that prior; 0.05 and more matters. "
        + MEANING_AT_90,
        (True, False, False, True, True, True, True),
    )


def design_table(material: Material) -> Table:
    """Predictions at the design Scruton numbers."""
    factor, unit = material.shown
    rows = []
    for prediction in material.design:
        amplitude = prediction.to_json()["amplitude"]
        median, interval, model_unit = material.in_model_unit(amplitude)
        rows.append(
            (
                scruton(prediction.scruton_number, stated), damping(prediction.damping_ratio),
                *estimate(amplitude, factor),
                monte_carlo(amplitude, PAGE), estimate(amplitude, factor, "0.95")[1],
                *([f"{median} ({interval}) {model_unit}"] if material.heaving else []),
                number(prediction.extrapolation_index, 2), covered(prediction.to_json()["amplitude_coverage"]),
            )
        )  # fmt: skip
    return Table(
        "design",
        "Predicted stable amplitude at the design Scruton numbers",
        (
            "Sc", damping_symbol(), f"median [{unit}]", f"90 % interval [{unit}]", "MC errors",
            f"95 % interval [{unit}]",
            *(["at the model's scale, 90 %"] if material.heaving else []), "x", "covered",
        ),
        rows,
        "x is the extrapolation index from the nearest test: laws of aerodynamic damping agree to 8 % for |x| < 0.2 "
        "and part beyond 0.3. Covered: by the transients of so many peak tests. " + MEANING_AT_90,
        data="predictions",
    )  # fmt: skip


def _test_table(material: Material) -> Table:
    """Stable amplitude of every test: measured, found, and predicted for another setting at its Scruton number."""
    rows, (factor, unit) = [], material.shown
    own = [errors_of_test(material.fit.tree, test["name"], ("a_star",))["a_star"] for test in material.tests]
    for test in material.tests:
        measured = material.fit.campaign.test(test["name"]).stable_amplitude
        predicted = material.at_tests.get(test["name"])
        rows.append(
            (
                test["name"], test["rig"], scruton(test["parameters"]["scruton_number"]["median"]),
                "–" if measured is None else number(factor * measured.mean),
                *estimate(test["parameters"]["a_star"], factor),
                *(("–", "–") if predicted is None else estimate(predicted.to_json()["amplitude"], factor)),
            )
        )  # fmt: skip
    return Table(
        "stable_amplitudes",
        f"Stable amplitude at the tested Scruton numbers [{unit}]",
        ("test", "rig", "Sc", "measured", "this test", "90 % interval", "another setting", "90 % interval"),
        rows,
        "“This test” is the setting itself, in the joint posterior of all peak tests. “Another setting” is the "
        "prediction for a rig of the same Scruton number that was not tested; it carries the discrepancy between "
        f"settings. {at_most(own, PAGE, factor, 'of this test')} "
        + at_most(map(errors_of_prediction, material.at_tests.values()), PAGE, factor, "of another setting"),
        (False, False, *[True] * 6),
        data="predictions" if material.at_tests else "tests",
    )
