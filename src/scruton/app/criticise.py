"""`scruton criticise`: what a statistician asks of a fit, answered in tables, figures and sentences."""

from argparse import Namespace
from pathlib import Path
from textwrap import shorten
from typing import Any

from scruton.app.given import check_in_wind
from scruton.app.run import Outcome, Run
from scruton.documents import read_json, write_text
from scruton.errors import InputError
from scruton.infer.criticism import Criticism
from scruton.report.chapters.results import sensitivity_table
from scruton.report.document import ALARM, Block, Callout, Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL
from scruton.terminal import DONE, NOT_TRUSTED, line_width

FOLDER, CONTENT, TEXT = "criticism", "criticism.json", "criticism.txt"
FIGURES, TABLES = "figures", "tables"


STATISTIC = ("test", "record", "statistic", "observed", "90 % expected", "p", "p, Holm")


def run(arguments: Namespace) -> Outcome:
    """Criticise the fit in a folder of results: criticism.json, criticism.txt, tables (CSV) and figures (SVG, PNG).

    InputError if the folder holds no fit of a test in wind, or a criticism lies where one shall be written.
    """
    from scruton.griffin.sensitivity import criticised
    from scruton.infer.store import provenance_of, read_tree

    results = arguments.results
    folder = results / FOLDER if arguments.out is None else arguments.out
    if folder.resolve() == results.resolve():
        wanted = "another folder, such as its subfolder criticism"
        raise InputError(folder, "-o", "the folder of the fit itself", wanted)
    tree, summary = read_tree(results)
    check_in_wind(tree, results)
    fitted = provenance_of(results, summary)
    design = list(arguments.sc)
    if arguments.bridge is not None:
        from scruton.report.parts import scruton_numbers_of

        design += scruton_numbers_of(tree, arguments.bridge)
    settings = {"sc": design}
    with Run(folder, "criticise", arguments, sha256=fitted, settings=settings, results=(CONTENT, TEXT)) as work:
        criticism = criticised(tree, summary, design, seed=arguments.seed)
        text = criticism_text(criticism, str(summary["title"]), str(summary["amplitude_unit"]))
        written = [*_tables(criticism, work.new / TABLES), *_figures(tree, criticism, work.new / FIGURES)]
        write_text(work.new / TEXT, text + "\n")
        work.write(CONTENT, {**criticism.to_json(), "fit_sha256": fitted})
        work.published([work.new / CONTENT, work.new / TEXT, *written])
    said = f"{verdict(criticism)}\n{summary['title']}\n{_gist(criticism)}"
    if (width := line_width()) is not None:
        said = "\n".join(shorten(line, width, placeholder=" ...") for line in said.split("\n"))
    return Outcome(
        said, [work.folder / TEXT], code=DONE if criticism.ok else NOT_TRUSTED,
        content=read_json(work.folder / CONTENT),
    )  # fmt: skip


def _tables(criticism: Criticism, folder: Path) -> list[Path]:
    import pandas as pd

    from scruton.report.tables import write_csv

    frames = {name: pd.DataFrame(rows) for name, rows in criticism.rows().items() if rows}
    frames["flags"] = pd.DataFrame(criticism.flags, columns=["check", "where", "text", "serious"])
    return write_csv(frames, folder)


def _figures(tree: Any, criticism: Criticism, folder: Path) -> list[Path]:
    from scruton.report.figures import figures_from, save

    drawn = figures_from("criticism", tree, criticism)
    return [path for figure in drawn for path in save(figure, folder, formats=("svg", "png"))]


def _gist(criticism: Criticism) -> str:
    """The worst of what was found, or what was looked at."""
    flags = sorted(criticism.flags, key=lambda flag: not flag.serious)
    if flags:
        return f"First of them: {f'{flags[0].where}: ' if flags[0].where else ''}{flags[0].text}"
    return f"Examined: {criticism.model}." if criticism.model else "Examined: the fit."


def verdict(criticism: Criticism) -> str:
    """First line: how many things to look at, and whether the fit may be trusted."""
    count, serious = len(criticism.flags), sum(flag.serious for flag in criticism.flags)
    if not count:
        return "Nothing found." if not criticism.missing else "Nothing found in the checks that could be made."
    first = f"{count} thing{'s' if count > 1 else ''} to look at"
    return f"{first}, {serious} of them serious: NOT TO BE TRUSTED." if serious else f"{first}, none of them serious."


def criticism_text(criticism: Criticism, title: str, unit: str = "") -> str:
    """Verdict, flags and tables for the terminal."""
    flags = [
        f"{'SERIOUS, ' if flag.serious else ''}{f'{flag.where}: ' if flag.where else ''}{flag.text}"
        for flag in sorted(criticism.flags, key=lambda flag: not flag.serious)
    ]
    missing = "\n".join(["Not checked", *(f"  {check}" for check in criticism.missing)])
    examined = f"\nExamined: {criticism.model}." if criticism.model else ""
    opening: list[Block] = [paragraph(f"{title}\n{verdict(criticism)}{examined}"), Callout(ALARM, "", tuple(flags))]
    return render_text([*opening, *([paragraph(missing)] if criticism.missing else []), *_sections(criticism, unit)])


def _p(value: float) -> str:
    return TERMINAL.number(value, 2) if not value < 1e-6 else "< 1e-6"


def _whose(row: Any, *values: float) -> tuple[str, ...]:
    return row.test or "(campaign)", row.parameter, *(TERMINAL.number(value, 2) for value in values)


def _sections(criticism: Criticism, unit: str) -> list[Table]:
    innovations, predictive = (
        tuple(
            (check.test, check.record or "(all)", check.name, TERMINAL.number(check.value, 3),
             TERMINAL.range((check.low, check.high), 3), _p(check.p), _p(check.adjusted))
            for check in checks
        )
        for checks in (criticism.innovations, criticism.predictive)
    )  # fmt: skip
    shares = tuple(
        (band.test, band.record, f"{band.level:.0%}", f"{band.share:.0%}", f"{band.low:.0%} .. {band.high:.0%}")
        for band in criticism.shares
    )
    prior = tuple(
        (row.test, row.record, f"{row.inside:.0%}", _p(row.p_half), _p(row.p_final), f"{row.huge:.0%}",
         f"{row.instant:.0%}")
        for row in criticism.prior
    )  # fmt: skip
    scaling = tuple(
        (*_whose(row, row.prior, row.noise, row.still_air, row.likelihood), row.diagnosis) for row in criticism.scaling
    )
    moved = tuple((*_whose(row, row.prior_sd, row.posterior_sd, row.ratio), row.verdict) for row in criticism.moved)
    influence = tuple(
        (row.test, row.record, row.parameter, f"{row.shift:+.2f}", f"{row.widening:.2f}", TERMINAL.number(row.z, 2),
         f"{row.khat:.2f}" + ("" if row.trusted else " !"))
        for row in criticism.influence
    )  # fmt: skip
    return [
        Table("", "Innovations of the filter", STATISTIC, innovations),
        Table("", "Posterior predictive", STATISTIC, predictive),
        Table(
            "", "Share of cycles inside the posterior predictive bands",
            ("test", "record", "band", "share", "90 % expected"), shares,
        ),
        Table(
            "", "Prior predictive",
            ("test", "record", "inside 90 %", "p, half", "p, final", "amplitude x 10", "within a cycle"), prior,
        ),
        Table(
            "", "Sensitivity of the posterior, by power scaling (0.05 and more matters)",
            ("test", "parameter", "priors", "of noise", "still air", "records", "diagnosis"), scaling,
        ),
        Table(
            "", "Posterior over prior standard deviation (of the logarithm where positive)",
            ("test", "parameter", "prior sd", "posterior sd", "ratio", "verdict"), moved,
        ),
        Table(
            "", "Influence: the posterior without a record, in posterior sds",
            ("test", "record", "parameter", "shift", "sd ratio", "z", "k-hat"), influence,
        ),
        sensitivity_table(criticism.predictions, TERMINAL, unit),
    ]  # fmt: skip
