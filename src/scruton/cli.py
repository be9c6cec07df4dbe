"""The command line: verbs, no logic.

Exit codes: 0 done; 1 done but not to be trusted; 2 bad input; 130 interrupted; 143 ended by SIGTERM.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.errors import InputError
from scruton.terminal import BAD_INPUT, DONE, NOT_TRUSTED, Parser, guarded, harmless_streams

if TYPE_CHECKING:
    from scruton.infer.results import Fit
    from scruton.progress import Progress


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    with harmless_streams():
        return guarded(lambda: _run(argv))


def _run(argv: Sequence[str] | None) -> int:
    arguments = parser().parse_args(argv)
    from scruton.app.options import check_options

    check_options(vars(arguments))
    verb: Callable[[argparse.Namespace], int] = arguments.verb
    return verb(arguments)


def parser() -> argparse.ArgumentParser:
    """Build the parser of all commands."""
    top = Parser(prog="scruton", description="Bayesian uncertainty quantification for vortex-induced vibration.")
    top.add_argument("--version", action="version", version=f"scruton {_version()}")
    verbs = top.add_subparsers(metavar="COMMAND", required=True)

    def add(name: str, verb: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        one = verbs.add_parser(name, help=text, description=text)
        one.add_argument("--seed", type=int, default=0, help="seed of all randomness (default 0)")
        one.add_argument("--quiet", action="store_true", help="no progress, no tables: only errors and paths")
        one.set_defaults(verb=verb)
        return one

    check = add("check", _check, "read a campaign, print what it holds and every warning")
    check.add_argument("campaign", type=Path, help="folder with a campaign.toml")

    fit = add("fit", _fit, "front end and posteriors: writes posterior.nc and fit.json")
    report = add("report", _report, "fit, predict and write the report")
    for one in (fit, report):
        one.add_argument("campaign", type=Path, help="folder with a campaign.toml")
        one.add_argument(
            "-o", "--out", type=Path, help="folder for the results (default: out/NAME of the campaign's folder)"
        )
        one.add_argument("--model", default="default", metavar="CARD", help="model card: a shipped name or a TOML file")
        one.add_argument(
            "--tests", "--test", action="append", metavar="NAME,...", help="use only these tests; may be repeated"
        )
        one.add_argument(
            "--effect", metavar="NAME", help='carry an unmodelled effect into the predictions; "auto": what is found'
        )
        one.add_argument("--force", action="store_true", help="replace the results that lie in the folder")
        one.add_argument("--resume", action="store_true", help="go on with an interrupted run")
    report.add_argument(
        "--sc", type=float, action="append", default=[], metavar="SC", help="design Scruton number; may be repeated"
    )
    report.add_argument("--bridge", type=Path, metavar="FILE", help="bridge.toml: damper sizing and risk, too")
    report.add_argument(
        "--limit",
        action="append",
        default=[],
        metavar="RULE",
        help="limit beside the bridge's, as of size; may be repeated",
    )
    report.add_argument("--no-gap", action="store_true", help="leave out the diagnosis of the gap")

    predict = add("predict", _predict, "predictive stable amplitude at a design Scruton number")
    predict.add_argument("results", type=Path, help="folder that fit or report wrote")
    predict.add_argument(
        "--sc", type=float, action="append", default=[], metavar="SC", help="design Scruton number; may be repeated"
    )
    predict.add_argument(
        "--damping",
        action="append",
        default=[],
        metavar="XI[+/-SD]",
        help='design damping ratio, "0.003" or "0.003 +/- 0.001"',
    )
    predict.add_argument("--rig", help="rig whose mass, frequency and wind are meant (default: the first)")
    predict.add_argument("--law", type=float, metavar="N", help="exponent of the law (default: the model card's)")
    predict.add_argument(
        "--effect", metavar="NAME", help='the effect that the fit has to carry; "auto": whichever it does'
    )
    predict.add_argument("--json", action="store_true", help="print JSON")

    size = add("size", _size, "damper sizing: required damping with its risk, dampers, what more testing is worth")
    size.add_argument("results", type=Path, help="folder that fit or report wrote")
    size.add_argument("-o", "--out", type=Path, help="folder for the sizing (default: RESULTS/sizing)")
    size.add_argument("--bridge", type=Path, metavar="FILE", help="bridge.toml (default: the section model itself)")
    size.add_argument(
        "--limit", action="append", default=[], metavar="RULE",
        help='"jtg", "kd", "rms-acceleration", "peak-acceleration: 0.5 m/s^2", "0.13 m", "0.05" (A/D); may be repeated',
    )  # fmt: skip
    size.add_argument(
        "--damping",
        metavar="XI[+/-SD]",
        help="structural damping ratio of every mode of the bridge; uncertain by 45 %% where no SD is given",
    )
    size.add_argument("--rig", help="rig whose mass ratio a mode without a mass has (default: the first)")
    size.add_argument("--law", type=float, metavar="N", help="exponent of the law (default: all, weighed)")
    size.add_argument(
        "--effect", metavar="NAME", help='the effect that the fit has to carry; "auto": whichever it does'
    )
    size.add_argument("--force", action="store_true", help="replace the sizing that lies in the folder")

    criticise = add(
        "criticise", _criticise, "checks of a fit: predictive, innovations, priors, identifiability, influence"
    )
    criticise.add_argument("results", type=Path, help="folder that fit or report wrote")
    criticise.add_argument("-o", "--out", type=Path, help="folder for the criticism (default: RESULTS/criticism)")
    criticise.add_argument("--force", action="store_true", help="replace the criticism that lies in the folder")

    validate = add("validate", _validate, "predict every rig from the others and from each single one")
    validate.add_argument("campaign", type=Path, help="folder with a campaign.toml")
    validate.add_argument("-o", "--out", type=Path, help="folder for the results (default: out/NAME/validation)")
    validate.add_argument(
        "--model", default="default", metavar="CARD", help="model card: a shipped name or a TOML file"
    )
    validate.add_argument("--force", action="store_true", help="replace the validation that lies in the folder")
    validate.add_argument("--resume", action="store_true", help="go on with an interrupted run")

    batch = add("batch", _batch, "fit many campaigns side by side: a folder for each, one summary of all")
    _batch_options(batch)

    calibrate = add("calibrate", _calibrate, "simulation-based calibration and coverage of the bands")
    calibrate.add_argument("-o", "--out", type=Path, required=True, help="folder for the results")
    calibrate.add_argument("--regimes", metavar="NAME,...", help="only these regimes (default: all)")
    calibrate.add_argument("--campaigns", type=int, default=500, metavar="N", help="in every regime (default 500)")
    calibrate.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (results do not depend on it)")
    calibrate.add_argument(
        "--model", default="default", metavar="CARD", help="model card: a shipped name or a TOML file"
    )
    calibrate.add_argument("--force", action="store_true", help="replace the results that lie in the folder")
    calibrate.add_argument(
        "--resume", action="store_true", help="go on with an interrupted run, or with more campaigns"
    )

    diagnose = add("diagnose", _diagnose, "the sim-to-real gap: where, which effect, how far it shrinks")
    diagnose.add_argument("campaign", type=Path, help="folder with a campaign.toml")
    diagnose.add_argument("-o", "--out", type=Path, help="folder for the results (default: out/NAME/gap)")
    diagnose.add_argument(
        "--model", default="default", metavar="CARD", help="model card: a shipped name or a TOML file"
    )
    diagnose.add_argument("--workers", type=int, default=2, metavar="N", help="threads (results do not depend on it)")
    diagnose.add_argument("--thorough", action="store_true", help="evidence of the leaders by bridge sampling, too")
    diagnose.add_argument("--force", action="store_true", help="replace the diagnosis that lies in the folder")
    diagnose.add_argument("--resume", action="store_true", help="go on with an interrupted run: it begins again")

    challenge = add("challenge", _challenge, "the blind check of diagnose: make campaigns, run, score")
    _challenge_verbs(challenge)

    models = add("models", _models, "the shipped model cards; one card in full; what its priors say")
    _models_verbs(models)

    simulate = add("simulate", _simulate, "write a synthetic campaign from the full equation of motion")
    simulate.add_argument("spec", type=Path, help="TOML file with the section, the rigs, the tests and the truth")
    simulate.add_argument("-o", "--out", type=Path, required=True, help="folder for the campaign")
    simulate.add_argument("--force", action="store_true", help="replace the campaign that lies in the folder")
    return top


def _models_verbs(models: argparse.ArgumentParser) -> None:
    """Add show."""
    verbs = models.add_subparsers(metavar="STEP", dest="step")
    show = verbs.add_parser("show", help="print a card with all that it extends, or draw its priors")
    show.add_argument("card", metavar="CARD", help="a shipped name or a TOML file")
    show.add_argument(
        "--prior-predictive",
        type=Path,
        metavar="DIR",
        help="draw Griffin curves from its priors: CARD.svg and CARD.png",
    )
    show.add_argument("--seed", type=int, default=0, help="seed of the draws (default 0)")


def _batch_options(batch: argparse.ArgumentParser) -> None:
    """Add what the batch takes."""
    batch.add_argument("campaigns", type=Path, nargs="+", metavar="CAMPAIGN", help="folders with a campaign.toml")
    batch.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="folder for all results")
    where = batch.add_mutually_exclusive_group()
    where.add_argument("--jobs", type=int, metavar="N", help="processes (default: one a core; results do not depend)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="a running Dask scheduler, tls://host:port or tcp://")
    for name, text in (("ca", "certificate of the authority"), ("cert", "own certificate"), ("key", "own key")):
        batch.add_argument(f"--tls-{name}", type=Path, metavar="FILE", help=f"{text}, for a scheduler under tls://")
    batch.add_argument("--model", default="default", metavar="CARD", help="model card: a shipped name or a TOML file")
    batch.add_argument("--report", action="store_true", help="write the report of each campaign, too")
    batch.add_argument(
        "--sc", type=float, action="append", default=[], metavar="SC", help="design Scruton number; may be repeated"
    )
    before = batch.add_mutually_exclusive_group()
    before.add_argument("--force", action="store_true", help="replace the results that lie in the folders")
    before.add_argument("--resume", action="store_true", help="go on with an interrupted batch, or with more campaigns")


def _challenge_verbs(challenge: argparse.ArgumentParser) -> None:
    """Add make, run and score."""
    verbs = challenge.add_subparsers(metavar="STEP", required=True, dest="step")
    make = verbs.add_parser("make", help="write campaigns with a hidden effect and seal the answers")
    make.add_argument("-o", "--out", type=Path, required=True, help="folder for the challenge")
    make.add_argument("--cases", type=int, default=65, metavar="N", help="campaigns; blocks of 65 hold every kind")
    make.add_argument("--seed", type=int, default=0, help="seed of all randomness (default 0)")
    make.add_argument("--effects", metavar="NAME,...", help='only these; "none" and "two" count (default: all)')
    make.add_argument("--severities", default="0.1,0.2,0.4", metavar="S,...", help="default 0.1,0.2,0.4")
    make.add_argument("--design", choices=("full", "one-rig"), default="full", help="or one rig, no still air")
    make.add_argument("--turbulence", default="0.005,0.015", metavar="LOW,HIGH", help="scatter of the amplitude")
    run = verbs.add_parser("run", help="diagnose every campaign, without the answers")
    run.add_argument("folder", type=Path, help="folder that make wrote")
    run.add_argument("-o", "--out", type=Path, required=True, help="folder for the results")
    score = verbs.add_parser("score", help="open the answers and score")
    score.add_argument("folder", type=Path, help="folder that make wrote")
    score.add_argument("results", type=Path, help="folder that run wrote")
    score.add_argument("-o", "--out", type=Path, help="folder for tables and pictures (default: RESULTS/score)")
    score.add_argument("--baselines", action="store_true", help="score simpler methods beside")
    score.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables as Markdown, too")
    score.add_argument(
        "--pictures", default=".", metavar="PATH", help="folder of the pictures, as the Markdown sees it"
    )
    for one in (make, run, score):
        one.add_argument("--quiet", action="store_true", help="no progress, no tables: only errors and paths")
        one.add_argument("--force", action="store_true", help="replace what lies in the folder")
    for one in (make, run, score):
        one.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (results do not depend on it)")
    for one in (make, run):
        one.add_argument("--resume", action="store_true", help="go on with an interrupted run")


def _version() -> str:
    from scruton import __version__

    return __version__


def _check(arguments: argparse.Namespace) -> int:
    from scruton.app.check import check

    text, usable = check(arguments.campaign)
    if not arguments.quiet or not usable:
        print(text)
    return DONE if usable else BAD_INPUT


def _fit(arguments: argparse.Namespace) -> int:
    from scruton.app.fit import fit_text, run_fit

    fit, folder = run_fit(
        arguments.campaign,
        arguments.out,
        model=arguments.model,
        tests=arguments.tests,
        seed=arguments.seed,
        force=arguments.force,
        resume=arguments.resume,
        quiet=arguments.quiet,
        effect=arguments.effect,
    )
    if not arguments.quiet:
        print(fit_text(fit))
    print(f"posterior: {folder / 'posterior.nc'}\nsummary:   {folder / 'fit.json'}")
    return _trust(fit)


def _report(arguments: argparse.Namespace) -> int:
    from scruton.app.fit import fit_text
    from scruton.app.report import run_report

    fit, paths = run_report(
        arguments.campaign,
        arguments.out,
        design_sc=arguments.sc,
        bridge=arguments.bridge,
        limits=arguments.limit,
        model=arguments.model,
        tests=arguments.tests,
        seed=arguments.seed,
        force=arguments.force,
        resume=arguments.resume,
        quiet=arguments.quiet,
        effect=arguments.effect,
        gap=not arguments.no_gap,
    )
    if not arguments.quiet:
        print(fit_text(fit))
    if paths.pdf is not None:
        print(f"report (PDF): {paths.pdf}")
    print(f"report:       {paths.report}")
    if paths.griffin is not None:
        print(f"Griffin plot: {paths.griffin}")
    for one in paths.failures:
        print(f"scruton: {one.sentence}", file=sys.stderr)
    return max(_trust(fit), NOT_TRUSTED if paths.failures else DONE)


def _trust(fit: "Fit") -> int:
    for flag in fit.flags:
        print(f"scruton: {flag}", file=sys.stderr)
    return DONE if fit.converged else NOT_TRUSTED


def _predict(arguments: argparse.Namespace) -> int:
    from scruton.app.fit import predict_text

    text, trusted = predict_text(
        arguments.results,
        scruton_numbers=arguments.sc,
        damping_ratios=arguments.damping,
        rig=arguments.rig,
        law_n=arguments.law,
        effect=arguments.effect,
        seed=arguments.seed,
        as_json=arguments.json,
    )
    print(text)
    return DONE if trusted else NOT_TRUSTED


def _size(arguments: argparse.Namespace) -> int:
    from scruton.app.size import run_size

    text, trusted, paths = run_size(
        arguments.results,
        arguments.out,
        bridge=arguments.bridge,
        limits=arguments.limit,
        damping=arguments.damping,
        rig=arguments.rig,
        law_n=arguments.law,
        effect=arguments.effect,
        seed=arguments.seed,
        force=arguments.force,
        quiet=arguments.quiet,
    )
    _show(text, paths, quiet=arguments.quiet)
    return DONE if trusted else NOT_TRUSTED


def _criticise(arguments: argparse.Namespace) -> int:
    from scruton.app.criticise import criticise

    text, trusted, paths = criticise(arguments.results, out=arguments.out, force=arguments.force, seed=arguments.seed)
    if not arguments.quiet:
        print(text)
    for path in paths if not arguments.quiet else paths[:1]:
        print(path)
    return DONE if trusted else NOT_TRUSTED


def _validate(arguments: argparse.Namespace) -> int:
    from scruton.app.fit import default_folder
    from scruton.app.validate import run_validate

    out = arguments.out if arguments.out is not None else default_folder(arguments.campaign) / "validation"
    text, trusted, paths = run_validate(
        arguments.campaign,
        out,
        model=arguments.model,
        seed=arguments.seed,
        force=arguments.force,
        resume=arguments.resume,
        quiet=arguments.quiet,
    )
    _show(text, paths, quiet=arguments.quiet)
    return DONE if trusted else NOT_TRUSTED


def _batch(arguments: argparse.Namespace) -> int:
    from scruton.app.batch import run_batch
    from scruton.app.batch_tables import batch_text

    batch = run_batch(
        arguments.campaigns,
        arguments.out,
        scheduler=arguments.scheduler,
        tls=(arguments.tls_ca, arguments.tls_cert, arguments.tls_key),
        jobs=arguments.jobs,
        model=arguments.model,
        design_sc=arguments.sc,
        report=arguments.report,
        seed=arguments.seed,
        force=arguments.force,
        resume=arguments.resume,
        quiet=arguments.quiet,
    )
    for name, reason in batch.faults:
        print(f"scruton: {name}: {reason}", file=sys.stderr)
    _show(batch_text(batch), batch.paths, quiet=arguments.quiet)
    return DONE if batch.good else BAD_INPUT if batch.none_ran else NOT_TRUSTED


def _calibrate(arguments: argparse.Namespace) -> int:
    from scruton.calibrate import calibration_text, run_calibration
    from scruton.progress import Bar

    _at_least_one("campaigns", arguments.campaigns)
    with Bar(arguments.quiet) as bar:
        result = run_calibration(
            arguments.out,
            regimes=None if arguments.regimes is None else [one.strip() for one in arguments.regimes.split(",")],
            campaigns=arguments.campaigns,
            seed=arguments.seed,
            jobs=arguments.jobs,
            force=arguments.force,
            resume=arguments.resume,
            progress=bar,
            model=arguments.model,
        )
    if not arguments.quiet:
        print(calibration_text(result))
    print(arguments.out / "calibration.json")
    return DONE if result.calibrated else NOT_TRUSTED


def _show(text: str, paths: Sequence[Path], *, quiet: bool) -> None:
    if not quiet:
        print(text)
    for path in paths:
        print(path)


def _at_least_one(option: str, value: int) -> None:
    if value < 1:
        raise InputError("command line", f"--{option}", str(value), "a whole number, one or more")


def _diagnose(arguments: argparse.Namespace) -> int:
    from scruton.app.diagnose import run_diagnose
    from scruton.app.fit import default_folder

    out = arguments.out if arguments.out is not None else default_folder(arguments.campaign) / "gap"
    text, paths = run_diagnose(
        arguments.campaign,
        out,
        model=arguments.model,
        workers=arguments.workers,
        thorough=arguments.thorough,
        force=arguments.force,
        resume=arguments.resume,
        quiet=arguments.quiet,
    )
    _show(text, paths, quiet=arguments.quiet)
    return DONE


def _challenge(arguments: argparse.Namespace) -> int:
    from scruton.progress import Bar

    with Bar(arguments.quiet) as bar:
        if arguments.step == "make":
            return _challenge_make(arguments, bar)
        if arguments.step == "run":
            return _challenge_run(arguments, bar)
        return _challenge_score(arguments, bar)


def _challenge_make(arguments: argparse.Namespace, progress: "Progress") -> int:
    from scruton.app.options import check_numbers
    from scruton.calibrate.challenge.make import make_challenge

    low, high = check_numbers("--turbulence", arguments.turbulence, 2)
    folder = make_challenge(
        arguments.out,
        cases=arguments.cases,
        seed=arguments.seed,
        effects=None if arguments.effects is None else [one.strip() for one in arguments.effects.split(",")],
        severities=check_numbers("--severities", arguments.severities),
        design=arguments.design,
        turbulence=(low, high),
        jobs=arguments.jobs,
        force=arguments.force,
        resume=arguments.resume,
        progress=progress,
    )
    print(f"challenge: {folder}")
    return DONE


def _challenge_run(arguments: argparse.Namespace, progress: "Progress") -> int:
    from scruton.calibrate.challenge.run import run_challenge

    run_challenge(
        arguments.folder,
        arguments.out,
        jobs=arguments.jobs,
        force=arguments.force,
        resume=arguments.resume,
        progress=progress,
    )
    print(f"results: {arguments.out}")
    return DONE


def _challenge_score(arguments: argparse.Namespace, progress: "Progress") -> int:
    from scruton.calibrate.challenge.baselines import BASELINES
    from scruton.calibrate.challenge.run import run_challenge
    from scruton.calibrate.challenge.score import score_challenge, score_markdown, score_text

    out = arguments.out if arguments.out is not None else arguments.results / "score"
    others = {name: arguments.results / "baselines" / name for name in BASELINES} if arguments.baselines else {}
    for name, place in others.items():
        run_challenge(
            arguments.folder, place, jobs=arguments.jobs, resume=True, progress=progress, diagnose=BASELINES[name]
        )
    score = score_challenge(arguments.folder, arguments.results, None, out, baselines=others, force=arguments.force)
    if arguments.markdown is not None:
        arguments.markdown.write_text(score_markdown(score, arguments.pictures), encoding="utf-8")
    if not arguments.quiet:
        print(score_text(score))
    print(out / "challenge-score.json")
    return DONE


def _models(arguments: argparse.Namespace) -> int:
    from scruton.app.models import draw_prior, models_text
    from scruton.infer.cards import load_card

    if arguments.step is None:
        print(models_text())
    elif arguments.prior_predictive is None:
        print(load_card(arguments.card).resolved, end="")
    else:
        for path in draw_prior(arguments.card, arguments.prior_predictive, seed=arguments.seed):
            print(path)
    return DONE


def _simulate(arguments: argparse.Namespace) -> int:
    from scruton.simulate import write_campaign

    folder = write_campaign(arguments.spec, arguments.out, seed=arguments.seed, force=arguments.force)
    print(f"campaign: {folder}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
