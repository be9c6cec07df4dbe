"""`scruton identify`: the paper's own quick estimation of every transient record, its Table 5, without any sampling."""

from argparse import Namespace
from dataclasses import fields

from scruton.app.run import Outcome
from scruton.campaign import Campaign, load_campaign, tests_used
from scruton.campaign.schema import Motion
from scruton.dynamics.identify import Identified, identify
from scruton.envelope import gather
from scruton.envelope.trial import trial_function
from scruton.errors import InputError
from scruton.report.conventions import SCRUTON, conventions, scruton_note, shown_in
from scruton.report.document import Block, Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import plain_number as number
from scruton.terminal import line_width

HEADER = ("record", "Sc", "U/(f0 D)", "m_r", "slope", "K", "A", "lambda [1/s]", "Y1", "epsilon")


def run(arguments: Namespace) -> Outcome:
    """Print a row for every growth or decay; InputError for bad input, or where no record gives a row."""
    try:
        trial_function(arguments.trial)
    except ValueError as error:
        raise InputError("command line", "--trial", f'"{arguments.trial}"', str(error)) from error
    campaign = load_campaign(arguments.campaign)
    if arguments.tests is not None:
        campaign = tests_used(campaign, arguments.tests)
    rows: list[Identified] = []
    left: list[InputError] = []
    for found in identify(gather(campaign), arguments.trial):
        if isinstance(found, InputError):
            left.append(found)
        else:
            rows.append(found)
    if not rows:
        raise left[0] if left else InputError(campaign.path, "tests", "no transient", "a growth or a decay in wind")
    content = [
        {field.name: getattr(row, field.name) for field in fields(row) if field.name != "front"}
        | {"trial": {"name": arguments.trial, "constants": dict(row.front.trial.constants)}}
        for row in rows
    ]
    with conventions(campaign):
        return Outcome(
            _text(campaign, rows, arguments.trial), remarks=list(map(str, left)), content={"identified": content}
        )


def _text(campaign: Campaign, rows: list[Identified], trial: str) -> str:
    """The rows as a table for the terminal."""
    (factor, unit), times = shown_in(campaign.section.amplitude_unit), shown_in(SCRUTON)[0]
    cells = [
        (
            row.record, number(times * row.scruton_number), number(row.reduced_velocity), number(row.mass_ratio),
            number(row.slope / (factor * times)), number(row.reduced_frequency),
            number(factor * row.stable_amplitude) + ("" if row.measured else " *"), number(row.relaxation_rate),
            number(row.Y1), number(row.epsilon),
        )
        for row in rows
    ]  # fmt: skip
    note = f"slope: d(1/A)/dSc; A in {unit}"
    if not all(row.measured for row in rows):
        note += "; *: where the record's own curve meets its Scruton number"
    blocks: list[Block] = [
        paragraph(f"{campaign.title}: Eqs. (2) to (8) and (17) to (19), trial function: {trial}"),
        Table("identified", "", HEADER, cells, note),
    ]
    if said := scruton_note(heaving=campaign.section.motion is Motion.HEAVING):
        blocks.append(paragraph(said))
    return render_text(blocks, line_width())
