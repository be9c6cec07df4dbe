"""What looks like a slip stands on the report's first page, in the order of the fit's flags."""

from dataclasses import replace

from fake_fit import fake_fit

from scruton.report.chapters import Material
from scruton.report.chapters.summary import summary_chapter
from scruton.report.document import ALARM, Callout
from scruton.report.tables import tables


def test_slips_open_the_first_page():
    fit = fake_fit(growth=False, sweeps=False)
    flags = (
        "serious: the line followed is at 0.1 times the f0 stated for its rig in 3 records: a, b, c.",
        "rig 1#: less.",
    )
    first = next(summary_chapter(Material(replace(fit, flags=flags), tables(fit))))
    assert isinstance(first, Callout)
    assert (first.role, tuple(first.lines)) == (ALARM, flags)
