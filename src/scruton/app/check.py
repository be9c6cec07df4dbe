"""`scruton check`: what a campaign holds, and every warning; with --html, the records themselves to look at."""

from argparse import Namespace
from pathlib import Path

from scruton.app.run import Outcome
from scruton.documents import write_text
from scruton.dynamics.first_look import Check, check
from scruton.envelope import usable
from scruton.envelope.inspection import SET_ASIDE
from scruton.errors import InputError
from scruton.report.first_look import overview
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL
from scruton.terminal import BAD_INPUT


def run(arguments: Namespace) -> Outcome:
    """Read everything, say what was found; a record that cannot be read stops nothing, but is bad input.

    One that shows no motion to measure is set aside with a warning, and bad input where the user is strict.

    InputError if campaign.toml itself cannot be used.
    """
    if arguments.html is not None:
        _check_page(arguments.html)
    found = check(arguments.campaign)
    if arguments.strict and any(remark.kind == SET_ASIDE for remark in found.inspection.campaign.remarks):
        usable(found.campaign, strict=True)
    lines = [] if arguments.html is None else [_page(found, arguments.html)]
    text = render_text(overview(found, TERMINAL))
    if found.problems:
        return Outcome(lines=[text, *lines], code=BAD_INPUT)
    return Outcome(text, lines=lines)


def _check_page(page: Path) -> None:
    """Refuse what cannot be written to, before any work is done."""
    if page.is_dir() or not page.absolute().parent.is_dir():
        raise InputError("command line", "--html", str(page), "a file in a folder that is there, such as check.html")


def _page(found: Check, page: Path) -> Path:
    from scruton.report.first_look import first_look
    from scruton.report.render_html import render_html

    write_text(page, render_html(first_look(found), "look.js"))
    return page
