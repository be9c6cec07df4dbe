"""`scruton compare`: two results side by side."""

from argparse import Namespace

from scruton.app.options import check_page
from scruton.app.run import Outcome
from scruton.documents import write_text
from scruton.report.compare import compare, compared_blocks, compared_document
from scruton.report.render_text import render_text
from scruton.report.saved import chosen_sizing, sizing_remark
from scruton.report.wording import TERMINAL
from scruton.terminal import DONE, NOT_TRUSTED, line_width


def run(arguments: Namespace) -> Outcome:
    """Compare two folders of results; nothing is written but the page that --html asks for.

    InputError for results that cannot be read, or have nothing in common; not trusted where one did not converge.
    """
    page = arguments.html
    if page is not None:
        check_page(page)
    found = compare(
        arguments.results, arguments.other, tests=arguments.tests or (), scruton_numbers=arguments.sc,
        seed=arguments.seed,
    )  # fmt: skip
    if page is not None:
        from scruton.report.render_html import render_html

        write_text(page, render_html(compared_document(found)))
    beside = zip((arguments.results, arguments.other), found.fits, strict=True)
    remarks = [sizing_remark(folder, chosen_sizing(folder, fit.summary)) for folder, fit in beside]
    text = render_text(compared_blocks(found, TERMINAL), line_width())
    code = DONE if all(found.converged) else NOT_TRUSTED
    return Outcome(text, [] if page is None else [page], list(filter(None, remarks)), code, found.to_json())
