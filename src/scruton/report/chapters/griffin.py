"""The Griffin plot, and the same as 1/A, in which the paper's law is a straight line."""

from typing import TYPE_CHECKING

from scruton.report.chapters.material import Material
from scruton.report.document import Block, Chapter, Equation, Heading, Paragraph, Table
from scruton.report.equations import RECIPROCAL
from scruton.report.maths import row

if TYPE_CHECKING:
    from scruton.infer.results import Fit


def griffin_chapter(material: Material) -> Chapter:
    """The plot that can be read off, the plots from single tests, and the laws."""
    if not material.in_wind:
        return Chapter("griffin-plot", "Griffin plot", ())
    apart = {name: material.figure(name) for name in ("laws", "griffin_by_test", "lock_in")}
    shown_later = [picture for pictures in apart.values() for picture in pictures]
    blocks: list[Block] = [picture for picture in material.of("griffin-plot") if picture not in shown_later]
    weights = law_table(material.fit)
    if apart["laws"] or weights.rows:
        blocks += [Heading("The law of aerodynamic damping"), weights, *apart["laws"]]
    if apart["griffin_by_test"]:
        blocks += [Heading("From one test at a time"), *apart["griffin_by_test"]]
    if apart["lock_in"]:
        blocks += [Heading("Amplitude against wind speed"), *apart["lock_in"]]
    return Chapter("griffin-plot", "Griffin plot", tuple(blocks))


def reciprocal_chapter(material: Material) -> Chapter:
    """1/A against the Scruton number."""
    figures = material.of("reciprocal")
    words: list[Block] = [
        Paragraph(("Under the paper’s law the reciprocal of the stable amplitude is a straight line in Sc:",)),
        Equation(RECIPROCAL),
        Paragraph(
            (
                "where ", row("x"), " is the distance from the test in units of the Scruton number that its relaxation "
                "rate is worth. A bend says that another law, or an effect that is not modelled, is at work.",
            )
        ),
    ]  # fmt: skip
    return Chapter("reciprocal", "1/A against the Scruton number", (*words, *figures) if figures else ())


def law_table(fit: "Fit") -> Table:
    """The laws of the model card and what the records say of them; no row where there is but one."""
    weights = fit.summary["laws"].get("weights", {})
    best = max((one["log_evidence"] for one in weights.values() if one["log_evidence"] is not None), default=0.0)
    rows = []
    for label, one in weights.items() if len(weights) > 1 else ():
        gap = None if one["log_evidence"] is None else one["log_evidence"] - best
        text = "–" if gap is None else f"{gap:.1f}".replace("-", "−")
        error = (
            "by Laplace's approximation" if one["log_evidence_error"] is None else f"± {one['log_evidence_error']:.2f}"
        )
        stacked = "–" if one["stacking"] is None else f"{one['stacking']:.3f}"
        rows.append((label, f"{one['prior']:.2f}", text, error, f"{one['weight']:.3f}", stacked))
    return Table(
        "laws",
        "Laws of aerodynamic damping, weighed by the records of the peak tests",
        ("law", "prior", "log evidence below the best", "error", "weight in predictions", "stacking"),
        tuple(rows),
        "Stacking scores each record, left out, by its joint density given all others. A law far below the best is not "
        "sampled. Predictions draw on each law as often as its weight says.",
        (False, True, True, False, True, True),
        data="laws",
    )
