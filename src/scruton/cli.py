"""The command line: verbs, no logic.

Exit codes: 0 done; 1 done but not to be trusted; 2 bad input; 130 interrupted; 143 ended by SIGTERM.
"""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from scruton.app.verbs import QUIET, SEED, VERBS, Argument, Verb
from scruton.terminal import Parser, guarded, harmless_streams

if TYPE_CHECKING:
    from scruton.app.run import Outcome


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    with harmless_streams():
        return guarded(lambda: _run(argv))


def _run(argv: Sequence[str] | None) -> int:
    arguments = parser().parse_args(argv)
    from scruton.app.options import check_options

    check_options(vars(arguments))
    module, name = arguments.work.split(":")
    outcome: Outcome = getattr(import_module(f"scruton.app.{module}"), name)(arguments)
    if outcome.text and not arguments.quiet:
        print(outcome.text)
    for line in outcome.lines:
        print(line)
    for remark in outcome.remarks:
        print(f"scruton: {remark}", file=sys.stderr)
    return outcome.code


def parser() -> argparse.ArgumentParser:
    """Build the parser of all commands."""
    from scruton import __version__

    top = Parser(prog="scruton", description="Bayesian uncertainty quantification for vortex-induced vibration.")
    top.add_argument("--version", action="version", version=f"scruton {__version__}")
    verbs = top.add_subparsers(metavar="COMMAND", required=True)
    for verb in VERBS:
        below = verbs.add_parser(verb.name, help=verb.help, description=verb.help)
        _declare(below, (SEED, QUIET, *verb.arguments), verb)
        if verb.steps:
            steps = below.add_subparsers(metavar="STEP", required=not verb.work, dest="step")
            for step in verb.steps:
                _declare(steps.add_parser(step.name, help=step.help), step.arguments, step)
    return top


def _declare(parser: argparse.ArgumentParser, arguments: Sequence[Argument | tuple[Argument, ...]], verb: Verb) -> None:
    for entry in arguments:
        together = (entry,) if isinstance(entry, Argument) else entry
        place = parser.add_mutually_exclusive_group() if len(together) > 1 else parser
        for argument in together:
            place.add_argument(*argument.names, **argument.settings)
    parser.set_defaults(work=verb.work)


if __name__ == "__main__":
    sys.exit(main())
