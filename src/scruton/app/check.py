"""`scruton check`: what a campaign holds, and every warning; with --html, the records themselves to look at."""

from argparse import Namespace
from pathlib import Path

from scruton.app.options import check_page
from scruton.app.run import Outcome
from scruton.documents import write_text
from scruton.dynamics.first_look import Check, check
from scruton.envelope import usable
from scruton.envelope.inspection import SET_ASIDE
from scruton.report.document import Table
from scruton.report.first_look import overview
from scruton.report.render_text import render_text
from scruton.terminal import BAD_INPUT, DONE, line_width


def run(arguments: Namespace) -> Outcome:
    """Read everything, say what was found; a record that cannot be read stops nothing, but is bad input.

    One that shows no motion to measure is set aside with a warning, and bad input where the user is strict.

    InputError if campaign.toml itself cannot be used.
    """
    if arguments.html is not None:
        check_page(arguments.html)
    found = check(arguments.campaign, arguments.tests)
    if arguments.strict and any(remark.kind == SET_ASIDE for remark in found.inspection.campaign.remarks):
        usable(found.campaign, strict=True)
    lines = [] if arguments.html is None else [_page(found, arguments.html)]
    unread = [str(problem) for problem in found.problems]
    blocks = overview(found)
    tables = [block for block in overview(found, in_files=True) if isinstance(block, Table)]
    content = {
        "title": found.campaign.title,
        **{one.name: [dict(zip(one.header, row, strict=True)) for row in one.rows] for one in tables},
        "warnings": list(found.warnings),
        "unusable": unread,
    }
    remarks = unread if arguments.quiet or arguments.json else ()
    text = render_text(blocks, line_width())
    return Outcome(text, lines, remarks, BAD_INPUT if unread else DONE, content)


def _page(found: Check, page: Path) -> Path:
    from scruton.report.first_look import first_look
    from scruton.report.render_html import render_html

    write_text(page, render_html(first_look(found), "look.js"))
    return page
