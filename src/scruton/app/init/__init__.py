"""`scruton init`: from a folder of records to a commented campaign.toml."""

import re
import sys
from argparse import Namespace
from pathlib import Path
from textwrap import fill

from scruton.app.init.channels import Found, records
from scruton.app.init.look import is_record, look
from scruton.app.init.write import ANSWER, Question, campaign_text, grouped, of_quantity
from scruton.app.run import Outcome
from scruton.campaign import units
from scruton.campaign.files import Files
from scruton.campaign.load import FILE_NAME, UNFILLED
from scruton.documents import write_text
from scruton.errors import InputError
from scruton.report.wording import how_many
from scruton.terminal import line_width
from scruton.workspace import STATE

SMALL = 0.05  # of the largest steady amplitude of the same file: less is no lock-in


def run(arguments: Namespace) -> Outcome:
    """Write campaign.toml for the files of a folder; InputError where one lies there already, or no record does."""
    folder = arguments.folder
    if not folder.is_dir():
        raise InputError(folder, "", "no such folder", "a folder with files of records")
    path = folder / FILE_NAME
    if path.exists() and not arguments.force:
        raise InputError(path, "", "a campaign that is there already", "another folder, or --force to replace it")
    asking = sys.stdin is not None and sys.stdin.isatty() and not arguments.quiet and not arguments.json
    stated = arguments.sample_rate
    rate = None
    if stated is not None:
        rate = units.parse_quantity(stated, units.FREQUENCY, "command line", "--sample-rate").mean
    found, remarks = examine(folder, rate)
    if asking and rate is None and any(one.timeless for one in found):
        what = "sample rate of records without any time"
        answer = _answered(of_quantity("sample_rate", what, units.FREQUENCY))
        if answer:
            found, remarks = examine(folder, units.parse_quantity(answer[""], units.FREQUENCY, ANSWER, what).mean)
    if not found:
        reason = "; ".join(remarks[:3])
        wanted = "files of motion against time, in the folder or in those below it"
        raise InputError(folder, "", f"no record{f' ({reason})' if reason else ''}", wanted)
    groups = grouped(found, folder)
    answers = {one.key: _answered(one) for one in groups.questions()} if asking else {}
    text = campaign_text(folder, groups, answers, remarks)
    write_text(path, text)
    lines = [i for i, line in enumerate(text.splitlines(), start=1) if line.startswith("#") and UNFILLED in line]
    said = f"{how_many(len(found), 'record')} in {how_many(len({one.path for one in found}), 'file')}.\n"
    said += f"To be filled in: line{'s' * (len(lines) > 1)} {', '.join(map(str, lines))}.\n" if lines else ""
    return Outcome(said + f"Look it over, then: scruton check {folder}", [path], remarks)


def examine(folder: Path, rate: float | None) -> tuple[list[Found], list[str]]:
    """Find the records of a folder and of those below it, in the order of the names, and what to say of other files."""
    files, found = Files(folder), []
    paths, remarks = _files(folder)
    for path in paths:
        try:
            there = list(records(look(path, files), rate))
        except InputError as error:
            remarks.append(str(error))
            continue
        if not there:
            remarks.append(f"{files.key(path)}: nothing in it that oscillates with time")
        found += there
    largest: dict[Path, float] = {}
    for one in found:
        if one.stretch.kind == "steady":
            largest[one.path] = max(largest.get(one.path, 0.0), one.stretch.level)
    kept = []
    for one in found:
        if one.stretch.kind != "steady" or one.stretch.level >= SMALL * largest[one.path]:
            kept.append(one)
        else:
            share = f"steady at less than {SMALL:.0%} of the largest of its file"
            remarks.append(f"{files.key(one.path)} {one.response.key}: left out, {share}")
    return kept, remarks


def _files(folder: Path) -> tuple[list[Path], list[str]]:
    """Files that may hold records, here and below, and what is to be said of the folders that are passed over.

    A folder below with a campaign of its own, or with results of this program, is no laboratory's.
    """
    found, remarks = [path for path in sorted(folder.iterdir()) if path.is_file() and is_record(path)], []
    for below in sorted(path for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")):
        if (below / FILE_NAME).exists() or (below / STATE).exists():
            what = "a campaign of its own" if (below / FILE_NAME).exists() else "results of scruton"
            remarks.append(f"{below.name}: {what}")
            continue
        files, said = _files(below)
        found += files
        remarks += [f"{below.name}/{text}" for text in said]
    return found, remarks


def _answered(question: Question) -> dict[str, str]:
    """Ask once, and again after what is no quantity, or not as many as are asked for; one may stand for all.

    By whom it is asked of, the empty name where it is of one thing; empty where nothing is answered: the lines stay to
    be filled in.
    """
    names = question.of or ("",)
    several = f" of {', '.join(question.of)}" if question.of else ""
    hint = "; one for all, or one each, with commas between\n " if len(question.of) > 1 else ""
    print(fill(f"{question.what[0].upper()}{question.what[1:]}{several},", line_width() or 80))
    prompt = f"  such as {question.example}{hint} (empty: later): "
    while True:
        try:
            answer = _unquoted(input(prompt))
        except EOFError:
            return {}
        if not answer:
            return {}
        try:
            said = _values(answer, question)
        except InputError as error:
            print(error)
            continue
        if len(said) in (1, len(names)):
            return dict(zip(names, said * len(names) if len(said) == 1 else said, strict=True))
        print(f"{len(said)} values; wanted one, or {len(names)}")


def _unquoted(answer: str) -> str:
    """An answer without the quotes that it has in a file, around the whole or around each of several."""
    return re.sub(r"""(?:^|(?<=[,;]))\s*(["'])(.*?)\1\s*(?=[,;]|$)""", r"\2", answer.strip()).strip()


def _values(answer: str, question: Question) -> list[str]:
    """What an answer gives, one or several with commas between; InputError where one of them is no answer.

    "0,3 m" is one that has a decimal comma, unless it makes sense as two.
    """
    ways = [re.split(r"\s*[,;]\s*", answer), re.split(r"[,;]\s+", answer)] if question.of else [[answer]]
    for said in ways:
        try:
            for one in said:
                question.read(one, question.what)
        except InputError as error:
            wrong = error
        else:
            return said
    raise wrong
