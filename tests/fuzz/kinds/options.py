"""Options of every verb: misspelt, missing, twice, out of range, and what no shell would let through."""

import argparse
from collections.abc import Callable
from functools import cache
from pathlib import Path

from numpy.random import Generator

from tests.fuzz.case import ANY, REFUSED, Case
from tests.fuzz.damage import ESCAPE, one
from tests.fuzz.kinds.tables import BRIDGE
from tests.fuzz.stock import Stock

# What each verb is called with where nothing is wrong; "{x}" are parts of the stock.
GOOD: dict[str, tuple[str, ...]] = {
    "check": ("{heaving}",),
    "fit": ("{heaving}", "-o", "out", "--model", "{card.toml}"),
    "report": ("{heaving}", "-o", "out", "--model", "{card.toml}", "--no-gap"),
    "predict": ("{fit}", "--sc", "30"),
    "size": ("{fit}", "-o", "out", "--limit", "0.05"),
    "criticise": ("{fit}", "-o", "out"),
    "validate": ("{heaving}", "-o", "out", "--model", "{card.toml}"),
    "batch": ("{heaving}", "-o", "out", "--model", "{card.toml}", "--jobs", "1"),
    "calibrate": ("-o", "out", "--regimes", "turbulence-1", "--campaigns", "2", "--model", "{card.toml}"),
    "diagnose": ("{heaving}", "-o", "out", "--model", "{card.toml}"),
    "challenge make": ("-o", "out", "--cases", "1"),
    "challenge run": ("{challenge/made}", "-o", "out"),
    "challenge score": ("{challenge/made}", "{challenge/results}", "-o", "out"),
    "challenge tune": ("{challenge/made}", "--results", "../results"),
    "models": (),
    "models show": ("{card.toml}",),
    "simulate": ("{heaving.toml}", "-o", "out"),
}
# Where a verb ends as accepted: what is asked for has been looked at, and the work would begin.
STOPS: dict[str, tuple[str, ...]] = {
    "fit": ("scruton.infer.fit.fit_campaign",),
    "report": ("scruton.processes.pool=no-pool", "scruton.infer.fit.fit_campaign"),
    "size": ("scruton.sizing.size.size",),
    "criticise": ("scruton.infer.criticism.criticise_tree",),
    "validate": ("scruton.infer.fit.fit_campaign",),
    "batch": ("distributed.LocalCluster",),
    "calibrate": ("scruton.calibrate.calibration.run_campaign", "scruton.processes.pool"),
    "diagnose": ("scruton.gap.diagnose.diagnose_data",),
    "challenge make": ("scruton.calibrate.challenge.make.simulate_case", "scruton.processes.pool"),
    "challenge run": ("scruton.gap.diagnose.examine", "scruton.processes.pool"),
    "challenge score": ("scruton.calibrate.challenge.pictures.draw",),
    "challenge tune": ("scruton.calibrate.challenge.tune.tune_challenges",),
}
NONSENSE = (
    "nonsense", "", " ", "nan", "inf", "-inf", "1e400", "x" * 5000, "/nonexistent/path", "\x01\x02", ESCAPE, "漢字",
    "\udcff", "a\nb", "%s", "--", "-", "=", "0x10", "1_000", "１２", "1,2", "1;2", "true", "None", "../..",
    "0.003 +/- inf", "0.003 +/- nan", "nan +/- 0.1", "-1", "0", "1", "0.3", "1.5",
    "99999999999999999999", "1e-300", "~", "file.txt", "folder", "file.txt/x",
    "x\0y", "a/" * 2000,
)  # fmt: skip
# Values that an option must refuse, by what it takes.
NUMBER = {
    "nonsense",
    "",
    " ",
    "nan",
    "inf",
    "-inf",
    "1e400",
    "x" * 5000,
    "\x01\x02",
    ESCAPE,
    "漢字",
    "%s",
    "0x10",
    "1,2",
    "None",
}
WHOLE = NUMBER | {"1.5", "0.003 +/- inf", "true", "file.txt"}
NAME = {"nonsense", "", " ", "\x01\x02", ESCAPE, "漢字", "a\nb", "%s", "nan", "x" * 5000, "\udcff", "file.txt"}
DAMPING = NAME | {"0.003 +/- inf", "0.003 +/- nan", "nan +/- 0.1", "-1", "0", "1", "1.5", "1e400", "inf"}
FILE = {"nonsense", "/nonexistent/path", "file.txt/x", "x" * 5000, "x\0y", "a/" * 2000, "file.txt"}
MUST_REFUSE: dict[str, set[str]] = {
    "--sc": NUMBER, "--law": NUMBER, "--seed": WHOLE, "--jobs": WHOLE | {"0", "-1"}, "--workers": WHOLE | {"0", "-1"},
    "--campaigns": WHOLE | {"0", "-1"}, "--cases": WHOLE | {"0", "-1"}, "--damping": DAMPING, "--effect": NAME,
    "--damper": NAME, "--identified": NAME,
    "--test": NAME, "--rig": NAME, "--model": NAME | FILE, "--limit": NAME, "--bridge": FILE, "--regimes": NAME,
    "--effects": NAME, "--severities": NAME | {"-1", "0", "1"}, "--turbulence": NAME | {"-1", "1"}, "--design": NAME,
    "--out": {"file.txt", "file.txt/x", "x" * 5000, "x\0y", "a/" * 2000}, "--scheduler": NAME | FILE,
    "spec": FILE, "campaign": FILE, "results": FILE, "card": FILE | NAME, "folder": FILE,
}  # fmt: skip


def make(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """Take the verbs and their options in turn."""
    (folder / "file.txt").write_text("a file in the way\n", encoding="utf-8")
    (folder / "folder").mkdir()
    (folder / "bridge.toml").write_text(BRIDGE, encoding="utf-8")
    how = number % 4
    if how == 0:
        return _misspelt(rng, number, stock)
    if how == 1:
        return _arranged(rng, number, stock)
    options = every_option()
    verb, option = options[(number // 4 * 2 + how - 2) % len(options)]
    value = NONSENSE[int(rng.integers(len(NONSENSE)))]
    strict = sorted(MUST_REFUSE.get(option, ()))
    if strict and rng.random() < 0.5:
        value = one(rng, strict)
    argv = _with(verb, option, value, stock)
    of_each = verb == "batch" and option in ("--test", "--bridge")  # which each campaign is refused for by itself
    allowed = REFUSED if value in MUST_REFUSE.get(option, ()) and not of_each else ANY
    return _case(verb, argv, f"{verb} {option}: {value[:40]!r}", allowed)


def _case(verb: str, argv: list[str], about: str, allowed: frozenset[int] = ANY) -> Case:
    return Case(about.replace(",", " "), tuple(argv), allowed, stops=STOPS.get(verb, ()))


def _good(verb: str, stock: Stock) -> list[str]:
    """Arguments of a verb where nothing is wrong."""
    return [str(stock.path(one[1:-1])) if one.startswith("{") else one for one in GOOD[verb]]


def _with(verb: str, option: str, value: str, stock: Stock) -> list[str]:
    """Put a value in an option's or an argument's place."""
    good = _good(verb, stock)
    if not option.startswith("-"):
        at = [
            i for i, one in enumerate(good) if not one.startswith("-") and (i == 0 or not good[i - 1].startswith("-"))
        ]
        good[at[1 if option == "results" and verb == "challenge score" else 0]] = value
        return [*verb.split(), *good]
    instead = {"--out": ("-o",), "--scheduler": ("--jobs",)}  # a scheduler has its own count of workers
    for spelled in (option, *instead.get(option, ())):
        if spelled in good:
            at = good.index(spelled)
            del good[at : at + 2]
    return [*verb.split(), *good, f"{option}={value}"]


@cache
def every_option() -> list[tuple[str, str]]:
    """Every verb with every option that takes a value and every argument, as the parser has them."""
    found: list[tuple[str, str]] = []
    for verb, parser in verbs().items():
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction | argparse._HelpAction) or action.nargs == 0:
                continue
            long = [one for one in action.option_strings if one.startswith("--")]
            found.append((verb, long[0] if long else action.dest))
    return [one for one in found if one[0] in GOOD]


@cache
def verbs() -> dict[str, argparse.ArgumentParser]:
    """Parsers by verb; "challenge make" for one with steps."""
    from scruton.cli import parser

    def below(prefix: str, one: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
        found = {prefix: one} if prefix else {}
        for action in one._actions:
            if isinstance(action, argparse._SubParsersAction):
                for name, child in action.choices.items():
                    found |= below(f"{prefix} {name}".strip(), child)
        return found

    return below("", parser())


def _misspelt(rng: Generator, number: int, stock: Stock) -> Case:
    """A verb or an option with a slip of the pen."""
    verb = tuple(GOOD)[number // 4 % len(GOOD)]
    good = [*verb.split(), *_good(verb, stock)]
    options = [i for i, word in enumerate(good) if word.startswith("--")]
    if verb == "challenge tune":  # an option without its dashes is one more folder, which is refused where work begins
        options = []
    at = 0 if rng.random() < 0.5 else one(rng, options or [0])
    good[at] = _slip(rng, good[at])
    return _case(verb, good, f"misspelt: {good[at][:60]!r}", REFUSED)


def _slip(rng: Generator, word: str) -> str:
    at = int(rng.integers(2, max(len(word), 3)))
    slips: tuple[Callable[[], str], ...] = (
        lambda: word[:at] + "q" + word[at:],
        lambda: word.upper() if word.upper() != word else word + "x",
        lambda: word[:2] + "zz" + word[2:],
        lambda: ESCAPE + word,
        lambda: word + "\u200b",
        lambda: "--" + word + "q",
    )
    return one(rng, slips)()


def _arranged(rng: Generator, number: int, stock: Stock) -> Case:
    """Arguments dropped, doubled, in another order, contradicting each other."""
    verb = tuple(GOOD)[number // 4 % len(GOOD)]
    good = _good(verb, stock)
    words = [*verb.split(), *good]
    several: dict[str, list[str]] = {
        "nothing but the verb": verb.split(),
        "nothing": [],
        "an argument too many": [*words, "one-more"],
        "an option without its value": [*words, "--seed"],
        "an option that is not known": [*words, "--colour"],
        "everything twice": [*words, *good],
        "backwards": words[::-1],
        "both --force and --resume": [*words, "--force", "--resume"],
        "--help": [*words, "--help"],
        "a NUL": [*words, "\0"],
        "quiet": [*words, "--quiet"],
        "-o of a file": [*verb.split(), *_replaced(good, "-o", "file.txt")],
        "-o below a file": [*verb.split(), *_replaced(good, "-o", "file.txt/x")],
        "-o of 5,000 characters": [*verb.split(), *_replaced(good, "-o", "x" * 5000)],
        "-o of a deep path": [*verb.split(), *_replaced(good, "-o", "a/" * 2500)],
        "-o with ESC": [*verb.split(), *_replaced(good, "-o", ESCAPE)],
        "-o in Chinese": [*verb.split(), *_replaced(good, "-o", "結果")],
        "-o of bytes that are no text": [*verb.split(), *_replaced(good, "-o", "\udcff\udcfe")],
    }
    about = one(rng, tuple(several))
    return _case(verb, several[about], f"{verb}: {about}")


def _replaced(good: list[str], option: str, value: str) -> list[str]:
    if option not in good:
        return [*good, f"{option}{value}"]
    at = good.index(option) + 1
    return [*good[:at], value, *good[at + 1 :]]
