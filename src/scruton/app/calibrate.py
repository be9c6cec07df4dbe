"""`scruton calibrate`, and `scruton challenge` with its steps: the verbs that check the program itself."""

import json
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scruton.app.options import check_new, check_numbers
from scruton.app.run import Outcome, workers_of
from scruton.errors import InputError
from scruton.progress import Bar
from scruton.terminal import DONE, NOT_TRUSTED, line_width

if TYPE_CHECKING:
    from scruton.calibrate.execution import Execution


def run(arguments: Namespace) -> Outcome:
    """Simulate, fit and see how often the intervals hold the truth."""
    from scruton.calibrate import calibration_text, run_calibration

    if arguments.campaigns < 1:
        raise InputError("command line", "--campaigns", str(arguments.campaigns), "a whole number, one or more")
    with execution(arguments) as execute:
        result = run_calibration(
            execute, regimes=names(arguments.regimes), campaigns=arguments.campaigns, seed=arguments.seed,
            model=arguments.model,
        )  # fmt: skip
    code = DONE if result.calibrated else NOT_TRUSTED
    return Outcome(calibration_text(result, line_width()), [arguments.out / "calibration.json"], code=code)


def challenge_make(arguments: Namespace) -> Outcome:
    """Write campaigns with a hidden effect and seal the answers."""
    from scruton.calibrate.challenge.make import Plan, make_challenge

    low, high = check_numbers("--turbulence", arguments.turbulence, 2)
    least, most = check_numbers("--gusts", arguments.gusts, 2)
    severities = check_numbers("--severities", arguments.severities)
    plan = Plan(
        arguments.seed, names(arguments.effects), severities, arguments.design, (low, high), gusts=(least, most)
    )
    with execution(arguments) as execute:
        folder = make_challenge(execute, plan, arguments.cases)
    return Outcome(paths=[folder])


def challenge_run(arguments: Namespace) -> Outcome:
    """Diagnose every campaign of a challenge, without the answers."""
    from scruton.calibrate.challenge.attempt import run_challenge

    with execution(arguments) as execute:
        run_challenge(arguments.folder, execute)
    return Outcome(paths=[arguments.out])


def challenge_score(arguments: Namespace) -> Outcome:
    """Open the answers of a challenge and score."""
    from scruton.calibrate.challenge.attempt import run_challenge
    from scruton.calibrate.challenge.baselines import BASELINES
    from scruton.calibrate.challenge.score import score_challenge, score_markdown, score_text
    from scruton.calibrate.execution import Execution
    from scruton.documents import write_text

    folder, results, markdown = arguments.folder, arguments.results, arguments.markdown
    if markdown is not None:
        check_new(markdown, "--markdown", force=arguments.force)
    out = arguments.out if arguments.out is not None else results / "score"
    others = {name: results / "baselines" / name for name in BASELINES} if arguments.baselines else {}
    workers = workers_of(arguments)
    with Bar(arguments.quiet) as bar:
        for name, place in others.items():
            run_challenge(folder, Execution(place, workers, resume=True, progress=bar), BASELINES[name])
    score = score_challenge(folder, results, None, out, baselines=others, force=arguments.force)
    if markdown is not None:
        write_text(markdown, score_markdown(score, arguments.pictures))
    return Outcome(score_text(score, line_width()), [out / "challenge-score.json"])


def challenge_tune(arguments: Namespace) -> Outcome:
    """Set temperatures and floor by challenges whose answers are known."""
    from scruton.calibrate.challenge.tune import tune_challenges, tuning_text
    from scruton.documents import write_text

    file = arguments.file
    if file is not None:
        check_new(file, "-o", force=arguments.force)
    low, high = check_numbers("--least", arguments.least, 2)
    content = tune_challenges(arguments.folders, arguments.results, (low, high))
    if file is not None:
        write_text(file, json.dumps(content, indent=1) + "\n")
    return Outcome(tuning_text(content, line_width()), [] if file is None else [file], content=content)


@contextmanager
def execution(arguments: Namespace) -> "Iterator[Execution]":
    """Where the results go and how, as the command line says; a bar shows how far it is."""
    from scruton.calibrate.execution import Execution

    with Bar(arguments.quiet) as bar:
        yield Execution(arguments.out, workers_of(arguments), arguments.force, arguments.resume, bar)


def names(listed: str | None) -> list[str] | None:
    """The names in a list with commas; None where none was given."""
    return None if listed is None else [name.strip() for name in listed.split(",")]
