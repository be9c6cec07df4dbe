"""The Griffin plot, and the same as 1/A, in which the paper's law is a straight line."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Equation, Heading, Table, paragraph
from scruton.report.equations import RECIPROCAL
from scruton.report.maths import row

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("griffin-plot", "Griffin plot")
def griffin_chapter(material: Material) -> Iterator[Block]:
    """The plot that can be read off, the plots from single tests, and the laws."""
    if not material.in_wind:
        return
    laws, by_test, lock_in = (material.figure(name) for name in ("laws", "griffin_by_test", "lock_in"))
    yield from (picture for picture in material.of("griffin-plot") if picture not in (*laws, *by_test, *lock_in))
    weights = law_table(material.fit)
    if laws or weights.rows:
        yield Heading("The law of aerodynamic damping")
        yield weights
        yield from laws
    if by_test:
        yield Heading("From one test at a time")
        yield from by_test
    if lock_in:
        yield Heading("Amplitude against wind speed")
        yield from lock_in


@chapter("reciprocal", "1/A against the Scruton number")
def reciprocal_chapter(material: Material) -> Iterator[Block]:
    """1/A against the Scruton number."""
    if figures := material.of("reciprocal"):
        yield paragraph("Under the paper’s law the reciprocal of the stable amplitude is a straight line in Sc:")
        yield Equation(RECIPROCAL)
        yield paragraph(
            "where ", row("x"), " is the distance from the test in units of the Scruton number that its relaxation "
            "rate is worth. A bend says that another law, or an effect that is not modelled, is at work.",
        )  # fmt: skip
        yield from figures


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
