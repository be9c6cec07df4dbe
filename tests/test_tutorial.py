"""The tutorial, run as it is written: its commands in their order, its answers at a terminal, its twelve files."""

import re
import resource
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.terminals import at_a_terminal
from tests.test_docs import ROOT, blocks

PAGE = ROOT / "docs" / "tutorial.md"
SESSION = blocks(PAGE, "text")[0]
ANSWERS = re.findall(r"\(empty: later\): (.*)", SESSION)


def commands(until: str = "") -> list[list[str]]:
    """The commands of the page, up to the section of a name."""
    text = PAGE.read_text(encoding="utf-8").partition(f"\n## {until}" if until else "\0")[0]
    lines = "".join(re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE)).splitlines()
    return [shlex.split(line) for line in lines]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Stand in for the project's folder: the examples lie in it."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    return tmp_path


def do(words: list[str], folder: Path, *more: str) -> None:
    """Run a line of the page as it stands, with `more` behind; `scruton` is this one."""
    if words[0] != "scruton":
        subprocess.run(shlex.join(words).replace("'", ""), shell=True, cwd=folder, check=True)  # * is the shell's
    elif words[1] == "init":
        code, seen = at_a_terminal(words[1:], ANSWERS, folder)
        assert (code, seen) == (0, SESSION)
    else:
        ran = subprocess.run(
            [sys.executable, "-m", "scruton", *words[1:], *more], cwd=folder, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        assert ran.returncode == 0, f"{shlex.join(words)}: {ran.stdout}{ran.stderr}"


def test_from_twelve_files_to_a_report_are_four_commands_and_ten_answers_at_most() -> None:
    ours = [words[1] for words in commands("3. ") if words[0] == "scruton"]
    assert ours == ["init", "check", "fit", "report"]
    assert len([value for answer in ANSWERS for value in answer.split(",")]) <= 10


def test_what_is_asked_is_what_the_page_shows_and_the_campaign_is_the_example(folder: Path) -> None:
    *others, check = [words for words in commands("3. ") if words[:1] != ["scruton"] or words[1] in ("init", "check")]
    for words in (*others, check):
        do(words, folder)
    assert len(list((folder / "my-deck").glob("*.csv"))) == 12
    assert (folder / "check.html").is_file()
    made = tomllib.loads((folder / "my-deck/campaign.toml").read_text(encoding="utf-8"))
    example = tomllib.loads((ROOT / "examples/rectangle-4to1/campaign.toml").read_text(encoding="utf-8"))
    assert made["section"] == example["section"]
    for owner in ("rigs", "tests"):
        assert [one["records"] for one in made[owner]] == [one["records"] for one in example[owner]]
    rigs = {ours["name"]: theirs["name"] for ours, theirs in zip(made["rigs"], example["rigs"], strict=True)}
    assert [rigs[one["rig"]] for one in made["tests"]] == [one["rig"] for one in example["tests"]]
    assert [one["mass"] for one in made["rigs"]] == [one["mass"]["mean"] for one in example["rigs"]]


@pytest.mark.slow  # quicker: the first two, above, a report in test_cli.py, and that all parse, in test_docs.py
def test_the_four_commands_as_they_are_written_leave_a_report(folder: Path) -> None:
    for words in commands("3. "):
        do(words, folder)
    assert (folder / "out/deck/report/report.html").is_file()
    assert (folder / "out/deck/report/report.pdf").is_file()


@pytest.mark.slow
def test_the_four_commands_take_a_minute_of_processor_time(folder: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for words in commands("3. "):
        do(words, folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{used:.1f} s of processor time")
    assert used < 60.0


@pytest.mark.slow
def test_every_command_of_the_page_runs(folder: Path) -> None:
    for words in commands():
        do(words, folder)
