"""What the terminal is told of a fit, of predictions and of a validation, as blocks of a document."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Motion
from scruton.infer.joint import SCALES
from scruton.report.conventions import (
    DAMPING,
    SCRUTON,
    by_conventions,
    conventions,
    damping_label,
    scruton,
    scruton_note,
    shown_in,
)
from scruton.report.document import Block, Table, paragraph
from scruton.report.errors import (
    MEANING,
    Errors,
    at_most,
    errors_of,
    errors_of_prediction,
    errors_of_rigs,
    errors_of_shared,
    errors_of_test,
    written,
)
from scruton.report.thresholds import SHARE_SHOWN
from scruton.report.wording import TERMINAL, Notation, law_text, share

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.griffin.validate import Validation
    from scruton.infer.results import Fit

_WITH_ERRORS = ("median", "90 % interval", "MC errors")


@by_conventions
def fit_summary(fit: "Fit") -> Iterator[Block]:
    """Medians and 90 % intervals of what a fit found, the laws, and whether it converged."""
    yield paragraph(fit.campaign.title)
    factor, _ = shown_in(DAMPING)
    of_rigs = errors_of_rigs(fit.tree)
    rigs = [
        (
            rig["name"], *TERMINAL.spread(rig["parameters"]["damping_ratio"], factor),
            written(of_rigs.get(rig["name"]), TERMINAL, factor),
        )
        for rig in fit.summary["rigs"]
    ]  # fmt: skip
    note = scruton_note(heaving=fit.campaign.section.motion is Motion.HEAVING)
    yield Table("damping", damping_label("Structural damping ratio"), ("rig", *_WITH_ERRORS), rigs)
    doubt = "" if forces_hold(fit.summary) else " (of the law n=-1, WHICH DOES NOT HOLD HERE)"
    factor, unit = shown_in(fit.campaign.section.amplitude_unit)
    scales = {"a_star": factor, "scruton_number": shown_in(SCRUTON)[0]}
    titles = {
        "scruton_number": "Sc",
        "a_star": f"stable amplitude [{unit}]",
        "relaxation_rate": "lambda [1/s]",
        "gust_scatter": "slow gusts, scatter of the stable amplitude over it",
        "gust_time": "slow gusts, correlation time [relaxation times]",
        "set_point_scatter": "scatter of the stable amplitude from record to record, over it",
        "Y1": f"Y1{doubt}",
        "epsilon": f"epsilon{doubt}",
    }
    of_tests = {test["name"]: errors_of_test(fit.tree, test["name"], titles) for test in fit.summary["tests"]}
    for key, title in titles.items():
        scale = scales.get(key, 1.0)
        tests = [
            (
                test["name"], test["rig"], *TERMINAL.spread(entry, scale),
                written(of_tests[test["name"]].get(key), TERMINAL, scale),
            )
            for test in fit.summary["tests"]
            if (entry := test["parameters"].get(key))
        ]  # fmt: skip
        yield Table(key, title, ("test", "rig", *_WITH_ERRORS), tests, note if key == "scruton_number" else "")
    weights = fit.summary["laws"].get("weights", {})
    if len(weights) > 1:
        # None of a law that does not reach the records.
        evidence = {law: -np.inf if (z := entry["log_evidence"]) is None else z for law, entry in weights.items()}
        best = max(evidence.values())
        laws = [
            (
                law, TERMINAL.number(entry["prior"]), TERMINAL.number(evidence[law] - best, 3),
                TERMINAL.number(entry["log_evidence_error"], 2),
                TERMINAL.number(entry["weight"], 3), TERMINAL.number(entry["stacking"], 3),
                "" if entry["sampled"] else "not sampled",
            )
            for law, entry in weights.items()
        ]  # fmt: skip
        header = ("law", "prior", "log evidence", "MC error", "weight", "stacking", "")
        note = fit.summary["laws"].get("explained", "")
        yield Table("laws", "Laws of aerodynamic damping; log evidence below the best", header, laws, note)
    shared = fit.summary["campaign"].get("parameters", {})
    of_shared = errors_of_shared(fit.tree, ("n", *SCALES))
    if shared and fit.card.exponent is not None:
        exponent = [("n", *TERMINAL.spread(shared["n"]), written(of_shared.get("n"), TERMINAL))]
        yield Table("exponent", "Law of aerodynamic damping", ("", *_WITH_ERRORS), exponent)
    at_prior = fit.summary["campaign"].get("left_at_prior", ())
    discrepancy = [
        (
            name, *TERMINAL.spread(shared[key]), written(of_shared.get(key), TERMINAL),
            "equals its prior" if key in at_prior else "",
        )
        for key, name in (("discrepancy_amplitude", "ln amplitude"), ("discrepancy_relaxation", "ln G"))
        if key in shared
    ]  # fmt: skip
    columns = ("of", *_WITH_ERRORS, "")
    yield Table("discrepancy", "Discrepancy between settings, standard deviation", columns, discrepancy)
    if shared:
        yield paragraph(model_printed(fit.summary))
    if fit.summary.get("effect"):
        from scruton.report.chapters.gap_words import carried_sentence  # it takes its time to come

        yield paragraph(carried_sentence(fit.summary))
    yield paragraph(MEANING)
    yield paragraph(f"Sampling: {'converged' if fit.converged else 'NOT CONVERGED: not to be trusted'}")


def forces_hold(summary: Mapping[str, Any]) -> bool:
    """Whether the law that Y1 and epsilon are parameters of carries weight; so it does where a fit does not say."""
    return bool(summary["laws"].get("forces_hold", True))


def model_printed(summary: Mapping[str, Any]) -> str:
    """Which model the numbers of the tests are those of."""
    weights = summary["laws"].get("weights", {})
    shares = [f"{label} {entry['weight']:.0%}" for label, entry in weights.items() if entry["weight"] > SHARE_SHOWN]
    peaks = [test["name"] for test in summary["tests"] if test["peak"]]
    others = len(summary["tests"]) - len(peaks)
    words = f"Peak tests ({', '.join(peaks)}): the joint posterior that predicts, {', '.join(shares)}."
    return words + (" Other tests: each by its own records, under the reference law." if others else "")


def law_of_tests(summary: Mapping[str, Any]) -> str:
    """The law that single tests were sampled under, in words, with its weight where several are weighed."""
    label, weights = _reference(summary), summary["laws"].get("weights", {})
    words = f"the law {law_text(label)}"
    if label not in weights or len(weights) < 2:
        return words
    leads = max(weights, key=lambda law: float(weights[law]["weight"]))
    words += f" ({share(weights[label]['weight'])} of the weight in predictions"
    return f"{words})" if leads == label else f"{words}; {law_text(leads)} has {share(weights[leads]['weight'])})"


def law_of_tests_leads(summary: Mapping[str, Any]) -> bool:
    """Whether no law has more weight in predictions than the one that single tests were sampled under."""
    weights = {label: float(law["weight"]) for label, law in summary["laws"].get("weights", {}).items()}
    return weights.get(_reference(summary), 1.0) >= max(weights.values(), default=0.0)


def _reference(summary: Mapping[str, Any]) -> str:
    """Label of the law that single tests were sampled under: the card's first."""
    n = summary["law_n"]
    return "n free" if n is None or np.isnan(n) else f"n={n:g}"


def prediction_summary(predictions: "Sequence[Prediction]", summary: dict[str, Any]) -> list[Block]:
    """Stable amplitudes at the design, one row each, and what is to be known of them; `summary` is that of the fit."""
    with conventions(summary):
        return _predicted(predictions, summary)


def _predicted(predictions: "Sequence[Prediction]", summary: dict[str, Any]) -> list[Block]:
    entries = [prediction.to_json() for prediction in predictions]
    factor, unit = shown_in(summary["amplitude_unit"])
    rows = [
        (
            scruton(entry["sc"], TERMINAL.number), TERMINAL.number(shown_in(DAMPING)[0] * entry["damping_ratio"]),
            *TERMINAL.spread(entry["amplitude"], factor), monte_carlo(entry["amplitude"], TERMINAL),
            TERMINAL.number(None if (sd := entry["amplitude"]["sd"]) is None else factor * sd),
            TERMINAL.number(entry["extrapolation_index"], 2), covered(entry["amplitude_coverage"]),
        )
        for entry in entries
    ]  # fmt: skip
    header = ("Sc", damping_label(), f"amplitude [{unit}]", "90 % interval", "MC errors", "sd", "x", "covered")
    shares = [f"{law} {weight:.0%}" for law, weight in predictions[0].laws.items() if weight > SHARE_SHOWN]
    measured = [f"{one.measured} at Sc = {one.scruton_number:.4g}" for one in predictions if one.measured]
    lines = [
        "x: extrapolation index; laws agree to 8 % for |x| < 0.2 and part beyond 0.3.",
        "Covered: peak tests whose transients run through the amplitude.",
        MEANING,
        *([note] if (note := scruton_note(heaving=summary["amplitude_unit"] == "A/D")) else []),
        f"Laws: {'; '.join([', '.join(shares), *measured])}. The interval carries the discrepancy between settings.",
        *dict.fromkeys(f"! {flag}" for prediction in predictions for flag in prediction.flags),
    ]
    if not summary["converged"]:
        lines.append("! the fit did not converge: " + "; ".join(summary["flags"]))
    return [Table("predictions", "", header, rows, "\n".join(lines)), stated_discrepancies(predictions, TERMINAL)]


def covered(coverage: Mapping[str, int]) -> str:
    """How many of the peak tests have seen an amplitude."""
    return f"{coverage['tests']} of {coverage['of']}"


def monte_carlo(amplitude: Mapping[str, Any], of: Notation) -> str:
    """Monte Carlo standard errors of the median and of both ends of the 90 % interval, of an amplitude as in JSON."""
    return written(told_errors(amplitude), of, shown_in(amplitude["unit"])[0])


def told_errors(amplitude: Mapping[str, Any]) -> Errors:
    """The same as numbers; none of an earlier version's prediction, which does not tell them."""
    told = amplitude.get("mcse")
    return (told["median"], *told["interval"]["0.90"]) if told else ()


def stated_discrepancies(predictions: "Sequence[Prediction]", of: Notation) -> Table:
    """Predictions from one rig where the discrepancy between settings is stated; no row with several rigs."""
    rows, (factor, unit) = [], shown_in(predictions[0].unit if predictions else "")
    for entry in (prediction.to_json() for prediction in predictions):
        stated = entry.get("at_discrepancy", {})
        if stated:
            rows.append(
                (scruton(entry["sc"], of.number), *(cell for at in stated.values() for cell in of.spread(at, factor)))
            )
    at = predictions[0].at_discrepancy if predictions else ()
    taus = [f"{100.0 * tau:.0f} %" for tau in at]
    known = [
        at_most((errors_of(one.at_discrepancy[tau], one.chains) for one in predictions), of, factor, f"at {words}")
        for tau, words in zip(at, taus, strict=True)
    ]
    return Table(
        "stated_discrepancies",
        "One rig says nothing of how far settings lie off one curve: predictions with a discrepancy of "
        + " and of ".join(taus)
        + f" [{of.unit(unit)}]",
        ("Sc", *(column for tau in taus for column in (f"median, {tau}", "90 % interval"))),
        rows,
        " ".join(filter(None, known)),
    )


def validation_summary(title: str, unit: str, folds: "Sequence[Validation]", coverage: dict[str, float]) -> list[Block]:
    """Every prediction of a test from others beside what was found there."""
    factor, unit = shown_in(unit)
    rows = [
        (
            fold.test, ", ".join(fold.source),
            *TERMINAL.interval(fold.prediction.median, *fold.prediction.interval(0.90), factor=factor),
            TERMINAL.number(factor * fold.prediction.error(0.5), 2), TERMINAL.number(factor * fold.amplitude),
            f"{100 * fold.error:+.0f} %", TERMINAL.number(fold.factor, 3), f"{fold.z:+.2f}", f"{fold.log_score:.2f}",
            TERMINAL.number(fold.prediction.extrapolation_index, 2),
            covered(fold.prediction.to_json()["amplitude_coverage"]),
            "inside" if fold.inside() else "OUTSIDE",
        )
        for fold in folds
    ]  # fmt: skip
    header = (
        "test",
        "from",
        f"predicted [{unit}]",
        "90 % interval",
        "MC error",
        "found",
        "error",
        "factor",
        "z",
        "log score",
        "x",
        "covered",
        "",
    )
    ends = at_most((errors_of_prediction(fold.prediction) for fold in folds), TERMINAL, factor)
    inside = ", ".join(f"{float(p):.0%}: {share:.0%}" for p, share in coverage.items())
    laws = sorted({label for fold in folds for label, weight in fold.prediction.laws.items() if weight > SHARE_SHOWN})
    return [
        paragraph(title),
        Table("validation", "", header, rows, ends),
        paragraph(
            f"{len(folds)} predictions. Inside their intervals of {inside}. Factor: how far the 90 % interval reaches "
            "from its median. MC error: Monte Carlo standard error of the median. Log score: log density of "
            "ln(amplitude), larger is better. x: extrapolation index from the nearest test that predicts. Covered: "
            "tests that predict whose transients run through the amplitude."
        ),
        paragraph(f"Laws used: {', '.join(laws)}."),
    ]
