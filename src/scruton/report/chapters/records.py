"""Records with their fitted envelopes, and the trial function of the paper's own procedure."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Heading, Table, paragraph
from scruton.report.equations import TRIAL
from scruton.report.wording import estimate

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("records", "Records and fitted envelopes")
def records_chapter(material: Material) -> Iterator[Block]:
    """Every record beside its envelope; the trial functions below."""
    yield from material.figure("records")
    if material.fit.summary["records"]:
        yield Heading("Trial functions")
        yield paragraph("The second-order exponential ", TRIAL, " with b > d, and t from the record’s first cycle.")
        yield trial_table(material.fit)
    yield from material.figure("trial_functions")


def trial_table(fit: "Fit") -> Table:
    """Constants of the trial function, Eq. (4), of every transient record."""
    rows = []
    for one in fit.summary["records"]:
        texts = (estimate(one["parameters"][name]) for name in "abcd")
        rows.append((one["name"], one["test"], *(f"{median}\n{interval}" for median, interval in texts)))
    unit = fit.campaign.section.amplitude_unit
    return Table(
        "trial",
        "Constants of the trial function: median, and 90 % interval below it",
        ("record", "test", f"a [{unit}]", "b [1/s]", f"c [{unit}]", "d [1/s]"),
        tuple(rows),
        numeric=(False, False, True, True, True, True),
        data="posterior",
    )
