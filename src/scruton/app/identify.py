"""`scruton identify`: the paper's own quick estimation of every transient record, its Table 5, without any sampling."""

from argparse import Namespace
from dataclasses import fields

from scruton.app.run import Outcome
from scruton.campaign import Campaign, load_campaign, tests_used
from scruton.campaign.schema import Motion
from scruton.dynamics.identify import Identified, identify
from scruton.envelope import gather
from scruton.envelope.inspection import SET_ASIDE
from scruton.envelope.trial import TRIAL_FUNCTIONS, trial_function
from scruton.errors import InputError
from scruton.report.conventions import SCRUTON, conventions, scruton_note, shown_in
from scruton.report.document import Block, Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import plain_number as number
from scruton.terminal import line_width

HEADER = ("record", "Sc", "U/(f0 D)", "m_r", "slope", "K", "A", "lambda [1/s]", "Y1", "epsilon")


def run(arguments: Namespace) -> Outcome:
    """Print a row for every growth or decay; InputError for bad input, or where no record gives a row."""
    check_trial(arguments.trial, "command line", "--trial")
    campaign = load_campaign(arguments.campaign)
    if arguments.tests is not None:
        campaign = tests_used(campaign, arguments.tests)
    rows, left = rows_of(campaign, arguments.trial)
    content = [
        {field.name: getattr(row, field.name) for field in fields(row) if field.name != "front"}
        | {"trial": {"name": arguments.trial, "constants": dict(row.front.trial.constants)}}
        for row in rows
    ]
    with conventions(campaign):
        return Outcome(
            _text(campaign, rows, arguments.trial), remarks=list(map(str, left)), content={"identified": content}
        )


def check_trial(name: str, place: str, field: str) -> None:
    """Refuse a trial function that there is none of."""
    try:
        trial_function(name)
    except ValueError:
        known = ", ".join(f'"{one}"' for one in TRIAL_FUNCTIONS)
        wanted = f'one of: {known}; an order or knots may follow, "polynomial 8"'
        raise InputError(place, field, f'"{name}"', wanted) from None


def rows_of(campaign: Campaign, trial: str) -> tuple[list[Identified], list[InputError]]:
    """What the paper's procedure finds, and why it finds nothing in other records; InputError where in none of them."""
    inspection = gather(campaign)
    found = list(identify(inspection, trial))
    rows = [one for one in found if isinstance(one, Identified)]
    left = [one for one in found if isinstance(one, InputError)]
    if not rows:
        aside = [str(one.sentence) for one in inspection.campaign.remarks if one.kind == SET_ASIDE]
        none = InputError(
            campaign.path, "tests", " ".join(["no transient", *aside]).rstrip("."), "a growth or a decay in wind"
        )
        raise left[0] if left else none
    return rows, left


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
