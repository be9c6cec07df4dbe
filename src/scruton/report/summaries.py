"""What the terminal is told of a fit, of predictions and of a validation, as blocks of a document."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from scruton.report.document import Block, Table, paragraph
from scruton.report.thresholds import SHARE_SHOWN
from scruton.report.wording import TERMINAL

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.griffin.validate import Validation
    from scruton.infer.results import Fit

_SPREAD = ("median", "90 % interval")


def fit_summary(fit: "Fit") -> Iterator[Block]:
    """Medians and 90 % intervals of what a fit found, the laws, and whether it converged."""
    yield paragraph(fit.campaign.title)
    rigs = [(one["name"], *TERMINAL.spread(one["parameters"]["damping_ratio"], 100.0)) for one in fit.summary["rigs"]]
    yield Table("damping", "Structural damping ratio [%]", ("rig", *_SPREAD), rigs)
    for key, title in {
        "scruton_number": "Sc",
        "a_star": f"stable amplitude [{fit.campaign.section.amplitude_unit}]",
        "relaxation_rate": "lambda [1/s]",
        "Y1": "Y1",
        "epsilon": "epsilon",
    }.items():
        tests = [
            (one["name"], one["rig"], *TERMINAL.spread(one["parameters"][key]))
            for one in fit.summary["tests"]
            if key in one["parameters"]
        ]
        yield Table(key, title, ("test", "rig", *_SPREAD), tests)
    weights = fit.summary["laws"].get("weights", {})
    if len(weights) > 1:
        best = max(one["log_evidence"] for one in weights.values())
        laws = [
            (
                law, TERMINAL.number(one["prior"]), TERMINAL.number(one["log_evidence"] - best, 3),
                TERMINAL.number(one["weight"], 3), TERMINAL.number(one["stacking"], 3),
                "" if one["sampled"] else "not sampled",
            )
            for law, one in weights.items()
        ]  # fmt: skip
        header = ("law", "prior", "log evidence", "weight", "stacking", "")
        yield Table("laws", "Laws of aerodynamic damping; log evidence below the best", header, laws)
    shared = fit.summary["campaign"].get("parameters", {})
    discrepancy = [
        (name, *TERMINAL.spread(shared[key]))
        for key, name in (("discrepancy_amplitude", "ln amplitude"), ("discrepancy_relaxation", "ln G"))
        if key in shared
    ]
    yield Table("discrepancy", "Discrepancy between settings, standard deviation", ("of", *_SPREAD), discrepancy)
    yield paragraph(f"Sampling: {'converged' if fit.converged else 'NOT CONVERGED: not to be trusted'}")


def prediction_summary(predictions: "Sequence[Prediction]", summary: dict[str, Any]) -> list[Block]:
    """Stable amplitudes at the design, one row each, and what is to be known of them; `summary` is that of the fit."""
    rows = [
        (
            TERMINAL.number(entry["sc"]), TERMINAL.number(entry["damping_ratio"]), *TERMINAL.spread(entry["amplitude"]),
            TERMINAL.number(entry["amplitude"]["sd"]), TERMINAL.number(entry["extrapolation_index"], 2),
        )
        for entry in (one.to_json() for one in predictions)
    ]  # fmt: skip
    header = ("Sc", "damping ratio", f"amplitude [{summary['amplitude_unit']}]", "90 % interval", "sd", "x")
    shares = [f"{law} {weight:.0%}" for law, weight in predictions[0].laws.items() if weight > SHARE_SHOWN]
    lines = [
        "x: extrapolation index; laws agree for |x| < 0.2 and part beyond 0.3.",
        f"Laws: {', '.join(shares)}. The interval carries the discrepancy between settings.",
        *(f"! {flag}" for one in predictions for flag in one.flags),
    ]
    if not summary["converged"]:
        lines.append("! the fit did not converge: " + "; ".join(summary["flags"]))
    return [Table("predictions", "", header, rows, "\n".join(lines))]


def validation_summary(title: str, unit: str, found: "Sequence[Validation]", coverage: dict[str, float]) -> list[Block]:
    """Every prediction of a test from others beside what was found there."""
    rows = [
        (
            one.test, ", ".join(one.source), TERMINAL.number(one.prediction.median),
            TERMINAL.range(one.prediction.interval(0.90)), TERMINAL.number(one.amplitude), f"{100 * one.error:+.0f} %",
            TERMINAL.number(one.factor, 3), f"{one.z:+.2f}", f"{one.log_score:.2f}",
            "inside" if one.inside() else "OUTSIDE",
        )
        for one in found
    ]  # fmt: skip
    header = ("test", "from", f"predicted [{unit}]", "90 % interval", "found", "error", "factor", "z", "log score", "")
    inside = ", ".join(f"{float(p):.0%}: {share:.0%}" for p, share in coverage.items())
    laws = sorted({label for one in found for label, weight in one.prediction.laws.items() if weight > SHARE_SHOWN})
    return [
        paragraph(title),
        Table("validation", "", header, rows),
        paragraph(
            f"{len(found)} predictions. Inside their intervals of {inside}. Factor: how far the 90 % interval reaches "
            "from its median. Log score: log density of ln(amplitude), larger is better."
        ),
        paragraph(f"Laws used: {', '.join(laws)}."),
    ]
