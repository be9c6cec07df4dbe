"""`scruton criticise`: what a statistician asks of a fit, answered in tables, figures and sentences."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scruton.app.run import Outcome, Run
from scruton.documents import write_text
from scruton.errors import InputError
from scruton.infer.criticism import Criticism
from scruton.report.text import bullets, number, table
from scruton.terminal import DONE, NOT_TRUSTED

FOLDER, CONTENT, TEXT = "criticism", "criticism.json", "criticism.txt"
FIGURES, TABLES = "figures", "tables"


def run(arguments: Namespace) -> Outcome:
    """Criticise the fit in a folder of results: criticism.json, criticism.txt, tables (CSV) and figures (SVG, PNG).

    Raises
    ------
    InputError
        If the folder holds no fit of a test in wind, or a criticism lies where one shall be written.
    """
    from scruton.infer.criticism import criticise_tree
    from scruton.infer.store import provenance_of, read_tree

    results, seed = arguments.results, arguments.seed
    folder = results / FOLDER if arguments.out is None else arguments.out
    if folder.resolve() == results.resolve():
        raise InputError(
            folder, "-o", "the folder of the fit itself", "another folder, such as its subfolder criticism"
        )
    tree, summary = read_tree(results)
    if "posterior" not in tree:
        wanted = "a fit of at least one test in wind: still air says nothing of the law"
        raise InputError(results, "", "a campaign without tests in wind", wanted)
    fitted = provenance_of(results, summary)
    with Run(folder, "criticise", arguments, sha256=fitted, settings={}, results=(CONTENT, TEXT)) as work:
        criticism = criticise_tree(tree, summary, seed=seed)
        text = criticism_text(criticism, str(summary["title"]))
        written = [*_tables(criticism, work.new / TABLES), *_figures(tree, criticism, work.new / FIGURES)]
        write_text(work.new / TEXT, text + "\n")
        work.write(CONTENT, {**criticism.to_json(), "fit_sha256": fitted})
        paths = work.published([work.new / CONTENT, work.new / TEXT, *written])
    code = DONE if criticism.ok else NOT_TRUSTED
    if arguments.quiet:
        return Outcome(lines=paths[:1], code=code)
    return Outcome(text, paths, code=code)


def _tables(criticism: Criticism, folder: Path) -> list[Path]:
    import pandas as pd

    from scruton.report.tables import write_csv

    frames = {name: pd.DataFrame(rows) for name, rows in criticism.rows().items() if rows}
    frames["flags"] = pd.DataFrame(
        [[one.check, one.where, one.text, one.serious] for one in criticism.flags],
        columns=["check", "where", "text", "serious"],
    )
    return write_csv(frames, folder)


def _figures(tree: Any, criticism: Criticism, folder: Path) -> list[Path]:
    from scruton.report.figures.criticism import criticism_figures
    from scruton.report.figures.save import save

    found = []
    for one in criticism_figures(tree, criticism):
        found += save(one, folder, formats=("svg", "png"))
    return found


def verdict(criticism: Criticism) -> str:
    """First line: how many things to look at, and whether the fit may be trusted."""
    count, serious = len(criticism.flags), sum(one.serious for one in criticism.flags)
    if not count:
        return "Nothing found." if not criticism.missing else "Nothing found in the checks that could be made."
    first = f"{count} thing{'s' if count > 1 else ''} to look at"
    return f"{first}, {serious} of them serious: NOT TO BE TRUSTED." if serious else f"{first}, none of them serious."


def criticism_text(criticism: Criticism, title: str) -> str:
    """Verdict, flags and tables for the terminal."""
    parts = [f"{title}\n{verdict(criticism)}"]
    if criticism.flags:
        ordered = sorted(criticism.flags, key=lambda one: not one.serious)
        lines = [f"{one.where}: {one.text}" if one.where else one.text for one in ordered]
        parts.append(
            bullets([f"{'SERIOUS, ' if one.serious else ''}{line}" for one, line in zip(ordered, lines, strict=True)])
        )
    if criticism.missing:
        parts.append("Not checked\n" + "\n".join(f"  {one}" for one in criticism.missing))
    for heading, header, rows in _sections(criticism):
        if rows:
            parts.append(f"{heading}\n{table(header, rows)}")
    return "\n\n".join(parts)


def _sections(criticism: Criticism) -> list[tuple[str, Sequence[str], list[list[str]]]]:
    def p(value: float) -> str:
        return number(value, 2) if not value < 1e-6 else "< 1e-6"

    def checks(rows: Sequence[Any]) -> list[list[str]]:
        return [
            [one.test, one.record or "(all)", one.name, number(one.value, 3), _range(one.low, one.high), p(one.p),
             p(one.adjusted)]
            for one in rows
        ]  # fmt: skip

    statistic = ("test", "record", "statistic", "observed", "90 % expected", "p", "p, Holm")

    def whose(one: Any, *values: float) -> list[str]:
        return [one.test or "(campaign)", one.parameter, *(number(value, 2) for value in values)]

    return [
        ("Innovations of the filter", statistic, checks(criticism.innovations)),
        ("Posterior predictive", statistic, checks(criticism.predictive)),
        (
            "Share of cycles inside the posterior predictive bands",
            ("test", "record", "band", "share", "90 % expected"),
            [
                [one.test, one.record, f"{one.level:.0%}", f"{one.share:.0%}", f"{one.low:.0%} .. {one.high:.0%}"]
                for one in criticism.shares
            ],
        ),
        (
            "Prior predictive",
            ("test", "record", "inside 90 %", "p, half", "p, final", "amplitude x 10", "within a cycle"),
            [
                [one.test, one.record, f"{one.inside:.0%}", p(one.p_half), p(one.p_final), f"{one.huge:.0%}",
                 f"{one.instant:.0%}"]
                for one in criticism.prior
            ],
        ),
        (
            "Sensitivity of the posterior, by power scaling (0.05 and more matters)",
            ("test", "parameter", "priors", "still air", "records", "diagnosis"),
            [
                [*whose(one, one.prior, one.still_air, one.likelihood), one.diagnosis]
                for one in criticism.scaling
            ],
        ),
        (
            "Posterior over prior standard deviation (of the logarithm where positive)",
            ("test", "parameter", "prior sd", "posterior sd", "ratio", "verdict"),
            [
                [*whose(one, one.prior_sd, one.posterior_sd, one.ratio), one.verdict]
                for one in criticism.moved
            ],
        ),
        (
            "Influence: the posterior without a record, in posterior sds",
            ("test", "record", "parameter", "shift", "sd ratio", "z", "k-hat"),
            [
                [one.test, one.record, one.parameter, f"{one.shift:+.2f}", f"{one.widening:.2f}", number(one.z, 2),
                 f"{one.khat:.2f}" + ("" if one.trusted else " !")]
                for one in criticism.influence
            ],
        ),
    ]  # fmt: skip


def _range(low: float, high: float) -> str:
    return f"{number(low, 3)} .. {number(high, 3)}"
