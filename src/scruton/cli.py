"""The command line: verbs, no logic.

Exit codes: 0 done; 1 done but not to be trusted; 2 bad input; 130 interrupted; 143 ended by SIGTERM.
"""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from scruton.app.verbs import ALIKE, ONE_PROCESS, VERBS, Argument, Verb
from scruton.spared import spare
from scruton.terminal import Parser, guarded, harmless_streams

if TYPE_CHECKING:
    from scruton.app.run import Outcome


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; without arguments that of this process, which is the program's own."""
    if argv is None:
        spare()
    with harmless_streams():
        return guarded(lambda: _run(argv))


def _run(argv: Sequence[str] | None) -> int:
    arguments = parser().parse_args(argv)
    from scruton.app.options import check_options

    check_options(vars(arguments))
    module, name = arguments.work.split(":")
    outcome: Outcome = getattr(import_module(f"scruton.app.{module}"), name)(arguments)
    say(outcome, quiet=arguments.quiet, as_json=arguments.json)
    return outcome.code


def say(outcome: "Outcome", *, quiet: bool, as_json: bool) -> None:
    """Print what a verb says: JSON alone, paths alone, or its tables and then the paths."""
    if as_json:
        print(outcome.json)
    else:
        if outcome.text and not quiet:
            print(outcome.text)
        for path in outcome.paths:
            print(path)
    for remark in outcome.remarks:
        print(f"scruton: {remark}", file=sys.stderr)


def parser() -> argparse.ArgumentParser:
    """Build the parser of all commands."""
    from scruton import __version__

    top = Parser(prog="scruton", description="Bayesian uncertainty quantification for vortex-induced vibration.")
    top.add_argument("--version", action="version", version=f"scruton {__version__}")
    verbs = top.add_subparsers(metavar="COMMAND", required=True)
    for verb in VERBS:
        below = verbs.add_parser(verb.name, help=verb.help, description=verb.help)
        if verb.work:
            _declare(below, verb)
        if verb.steps:
            steps = below.add_subparsers(metavar="STEP", required=not verb.work, dest="step")
            for step in verb.steps:
                _declare(steps.add_parser(step.name, help=step.help), step)
    return top


def _declare(parser: argparse.ArgumentParser, verb: Verb) -> None:
    groups = [(entry,) if isinstance(entry, Argument) else entry for entry in (*ALIKE, *verb.arguments)]
    if not any("--jobs" in argument.names for together in groups for argument in together):
        groups.append((ONE_PROCESS,))
    for together in groups:
        place = parser.add_mutually_exclusive_group() if len(together) > 1 else parser
        for argument in together:
            place.add_argument(*argument.names, **argument.settings)
    parser.set_defaults(work=verb.work)
