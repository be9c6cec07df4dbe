"""The verbs of the command line as data: name, help, arguments, and the function that does it."""

from argparse import SUPPRESS, Action, Namespace
from pathlib import Path
from typing import Any, NamedTuple  # dataclasses would take as long to import as all the rest

from scruton.errors import InputError


class Argument:
    """What `argparse` is told of an argument, spelt as for it."""

    def __init__(self, *names: str, **settings: Any) -> None:
        self.names, self.settings = names, settings


class Verb(NamedTuple):
    """A verb, or a step of one; one without a function of its own needs a step."""

    name: str
    help: str
    work: str  # its function, "module:name" below `scruton.app`, which takes the arguments and gives an `Outcome`
    arguments: tuple[Argument | tuple[Argument, ...], ...] = ()  # those of a tuple within exclude each other
    steps: "tuple[Verb, ...]" = ()


class Refused(Action):
    """An option that other verbs have; whoever gives it to this one is told why it has none."""

    def __call__(self, _parser: object, _namespace: object, values: object, option: str | None = None) -> None:
        """Refuse it: InputError, with the constant of the argument as what is wanted."""
        raise InputError("command line", option or self.dest, f'"{values}"', str(self.const))


class Numbers(Action):
    """An option of numbers, which may be repeated or have several with commas between them, as names have."""

    def __call__(self, _parser: object, namespace: Namespace, values: object, option: str | None = None) -> None:
        """Add what is given: InputError for what is no number, said as everywhere."""
        from scruton.app.options import numbers_of

        setattr(namespace, self.dest, [*getattr(namespace, self.dest), *numbers_of(option or self.dest, str(values))])


def flag(name: str, text: str) -> Argument:
    """Note an option without a value."""
    return Argument(name, action="store_true", help=text)


def force(what: str, where: str = "in the folder") -> Argument:
    """Note the option that replaces earlier results."""
    return flag("--force", f"replace {what} {where}")


CAMPAIGN = Argument("campaign", type=Path, help="folder with a campaign.toml")
RESULTS = Argument("results", type=Path, help="folder that fit or report wrote")
SEED = Argument("--seed", type=int, default=0, help="seed of all randomness (default 0)")
QUIET = flag("--quiet", "no progress, no tables: only errors and the paths of what was written")
JSON = flag("--json", "print the results as JSON in place of tables and paths")
ALIKE = SEED, QUIET, JSON  # every verb and every step has them
MODEL = Argument("--model", default="default", metavar="CARD", help="model card: a shipped name or a TOML file")
SC = Argument("--sc", action=Numbers, default=[], metavar="SC", help="design Scruton number; may be repeated")
STRICT = flag("--strict", "bad input where a record shows no motion to measure; else it is set aside")
RESUME = flag("--resume", "go on with an interrupted run")
TESTS = Argument(
    "--test", "--tests", dest="tests", action="append", metavar="NAME,...", help="only these tests; may be repeated"
)
WHOLE_FIT = Argument(
    "--test", "--tests", dest="tests", action=Refused, help=SUPPRESS,
    const="a fit of these tests alone, by `scruton fit CAMPAIGN --test NAME`: this is of all that the fit rests on",
)  # fmt: skip
FIT_EFFECT = Argument(
    "--effect", metavar="NAME", help='carry an unmodelled effect into the predictions; "auto": what is found'
)
EFFECT = Argument("--effect", metavar="NAME", help='the effect that the fit has to carry; "auto": whichever it does')
OTHER = Argument(
    "--other", type=Path, metavar="RESULTS",
    help="fit of the other motion, torsion beside heaving: its modes of the bridge, too, and the union",
)  # fmt: skip


def out(text: str, **settings: Any) -> Argument:
    """Note the folder of the results."""
    return Argument("-o", "--out", type=Path, help=text, **settings)


def jobs(what: str, default: int | None = 1) -> Argument:
    """Note how many work side by side."""
    usual = "one a core" if default is None else default
    text = f"{what} (default: {usual}; results do not depend on it)"
    return Argument("--jobs", type=int, default=default, metavar="N", help=text)


ONE_PROCESS = Argument(  # of every verb that has no --jobs of its own
    "--jobs", type=int, default=1, metavar="N", help="taken as everywhere; this works in one process"
)


def spread(default: int | None = 1) -> tuple[Argument | tuple[Argument, ...], ...]:
    """Note the options of work that many processes share, here or on other machines."""
    files = ("ca", "certificate of the authority"), ("cert", "own certificate"), ("key", "own key")
    return (
        (
            jobs("processes", default),
            Argument("--scheduler", metavar="ADDRESS", help="a running Dask scheduler, tls://host:port or tcp://"),
        ),
        *(
            Argument(f"--tls-{name}", type=Path, metavar="FILE", help=f"{text}, for a scheduler under tls://")
            for name, text in files
        ),
    )


FIT = (
    CAMPAIGN,
    out("folder for the results (default: out/NAME of the campaign's folder)"),
    MODEL,
    TESTS,
    FIT_EFFECT,
    STRICT,
    force("the results that lie"),
    RESUME,
)

CHALLENGE = (
    Verb("make", "write campaigns with a hidden effect and seal the answers", "calibrate:challenge_make", (
        out("folder for the challenge", required=True),
        Argument("--cases", type=int, default=68, metavar="N", help="campaigns; blocks of 68 hold every kind"),
        Argument("--effects", metavar="NAME,...", help='only these; "none" and "two" count (default: all)'),
        Argument("--severities", default="0.1,0.2,0.4", metavar="S,...", help="default 0.1,0.2,0.4"),
        Argument("--design", choices=("full", "one-rig"), default="full", help="or one rig, no still air"),
        Argument("--turbulence", default="0.005,0.015", metavar="LOW,HIGH", help="scatter of the amplitude"),
        Argument("--gusts", default="0,0", metavar="LOW,HIGH", help="scatter of the drive by slow gusts (default 0,0)"),
        force("what lies"), RESUME, *spread(),
    )),
    Verb("run", "diagnose every campaign, without the answers", "calibrate:challenge_run", (
        Argument("folder", type=Path, help="folder that make wrote"),
        out("folder for the results", required=True),
        force("what lies"), RESUME, *spread(),
    )),
    Verb("score", "open the answers and score", "calibrate:challenge_score", (
        Argument("folder", type=Path, help="folder that make wrote"),
        Argument("results", type=Path, help="folder that run wrote"),
        out("folder for tables and pictures (default: RESULTS/score)"),
        flag("--baselines", "score simpler methods beside"),
        Argument("--markdown", type=Path, metavar="FILE", help="write the tables as Markdown, too"),
        Argument("--pictures", default=".", metavar="PATH", help="folder of the pictures, as the Markdown sees it"),
        force("what lies"), *spread(),
    )),
    Verb("tune", "set how far evidences are believed by challenges and their results", "calibrate:challenge_tune", (
        Argument("folders", type=Path, nargs="+", metavar="FOLDER", help="that make wrote, with its results inside"),
        Argument("--results", default="results", metavar="NAME", help="folder of results in each (default results)"),
        Argument("--least", default="1,1", metavar="NONE,BETWEEN", help="temperatures not gone below (default 1,1)"),
        Argument("-o", "--file", type=Path, help="write the JSON that the diagnosis reads"),
        force("the file that lies", "there"),
    )),
)  # fmt: skip

VERBS = (
    Verb("init", "write a commented campaign.toml for the files of a folder", "init:run", (
        Argument("folder", type=Path, help="folder with the files of the records"),
        Argument("--sample-rate", metavar="RATE", help='of records without any time, such as "1000 Hz"'),
        force("the campaign.toml that lies"),
    )),
    Verb("check", "read a campaign, print what it holds and every warning", "check:run", (
        CAMPAIGN,
        TESTS,
        Argument("--html", type=Path, metavar="FILE", help="draw records, windows and quick estimation: one page"),
        STRICT,
    )),
    Verb("identify", "the paper's own quick estimation: its Table 5, record by record", "identify:run", (
        CAMPAIGN,
        TESTS,
        Argument(
            "--trial", default="second-order exponential", metavar="NAME",
            help='trial function: "second-order exponential", "polynomial 8", "cubic spline 12" (knots)',
        ),
    )),
    Verb("fit", "front end and posteriors: writes posterior.nc and fit.json", "fit:run", (
        *FIT,
        jobs("processes: one, or two"),
    )),
    Verb("report", "fit, predict and write the report; or write it of results that are there", "report:run", (
        Argument("campaign", type=Path, metavar="CAMPAIGN|RESULTS", help="folder with a campaign.toml, or of a fit"),
        *FIT[1:],
        SC,
        Argument("--bridge", type=Path, metavar="FILE", help="bridge.toml: damper sizing and risk, too"),
        OTHER,
        Argument(
            "--limit", action="append", default=[], metavar="RULE",
            help="limit beside the bridge's, as of size; may be repeated",
        ),
        Argument(
            "--sizing", type=Path, metavar="DIR",
            help="of results with several sizings: the folder of the one to report (default: the last)",
        ),
        flag("--no-gap", "leave out the diagnosis of the gap"),
        flag("--docx", "a Word file, too"),
        flag("--xlsx", "an Excel file with every table, too"),
        jobs("processes: one, or two", 2),
    )),
    Verb("predict", "predictive stable amplitude at a design Scruton number", "predict:predict", (
        RESULTS,
        WHOLE_FIT,
        SC,
        Argument(
            "--damping", action="append", default=[], metavar="XI[+/-SD]",
            help='design damping ratio, "0.003" or "0.003 +/- 0.001"',
        ),
        Argument("--rig", help="rig whose mass, frequency and wind are meant (default: the first)"),
        Argument("--law", type=float, metavar="N", help="exponent of the law (default: the model card's)"),
        EFFECT,
    )),
    Verb("compare", "two results side by side: what differs beyond Monte Carlo error, and what not", "compare:run", (
        RESULTS,
        Argument("other", type=Path, metavar="OTHER", help="the folder to compare it with"),
        TESTS,
        SC,
        Argument("--html", type=Path, metavar="FILE", help="a page of it, with both Griffin plots in one"),
    )),
    Verb("size", "damper sizing: required damping with its risk, dampers, what more testing is worth", "predict:size", (
        RESULTS,
        WHOLE_FIT,
        out("folder for the sizing (default: RESULTS/sizing, or sizing-2 and so on where one lies there)"),
        Argument("--bridge", type=Path, metavar="FILE", help="bridge.toml (default: the section model itself)"),
        OTHER,
        Argument(
            "--limit", action="append", default=[], metavar="RULE",
            help='"jtg", "kd", "iso2631", "rms-acceleration", "peak-acceleration: 0.5 m/s^2", "motion-sickness: 0.05", '
            '"0.13 m", "0.4 deg", "0.05" (A/D); may be repeated',
        ),
        Argument(
            "--damping", metavar="XI[+/-SD]",
            help="structural damping ratio of every mode of the bridge; uncertain by 45 %% where no SD is given",
        ),
        Argument("--rig", help="rig whose mass ratio a mode without a mass has (default: the first)"),
        Argument("--law", type=float, metavar="N", help="exponent of the law (default: all, weighed)"),
        Argument(
            "--damper", action="append", default=[], metavar="MASS,HZ,XI[,X]",
            help='damper that is there or on offer, "12 t, 0.29 Hz, 0.08" and its place on the span, if need be; '
            "several that hang together have a ; between; or a supplier's list (.csv): the risk with it; repeatable",
        ),
        Argument(
            "--identified", action="append", default=[], metavar="MODE:HZ,XI",
            help='frequency and damping ratio of a mode identified on the bridge: "V1: 0.296 Hz, 0.0042"; repeatable',
        ),
        EFFECT,
        force("the sizing that lies"),
    )),
    Verb(
        "criticise", "checks of a fit: predictive, innovations, priors, identifiability, influence", "criticise:run",
        (RESULTS, WHOLE_FIT, out("folder for the criticism (default: RESULTS/criticism)"), SC,
         Argument("--bridge", type=Path, metavar="FILE", help="bridge.toml: how its predictions follow the card"),
         force("the criticism that lies")),
    ),
    Verb(
        "validate",
        "predict every rig, or that of each --test, from the others and from each single one: 2 R + 1 fits of R rigs",
        "campaigns:validate",
        (CAMPAIGN, out("folder for the results (default: out/NAME/validation)"), MODEL,
         TESTS,
         flag("--no-singles", "leave out predictions from single rigs: R + 1 fits"),
         force("the validation that lies"), RESUME, *spread()),
    ),
    Verb("batch", "fit many campaigns side by side: a folder for each, one summary of all", "batch:run", (
        Argument("campaigns", type=Path, nargs="+", metavar="CAMPAIGN", help="folders with a campaign.toml"),
        out("folder for all results", required=True, metavar="DIR"),
        *spread(None),
        MODEL,
        TESTS,
        flag("--report", "write the report of each campaign, too"),
        Argument("--bridge", type=Path, metavar="FILE", help="bridge.toml: damper sizing with each campaign, too"),
        FIT_EFFECT,
        SC,
        (
            force("the results that lie", "in the folders"),
            flag("--resume", "go on with an interrupted batch, or with more campaigns"),
        ),
    )),
    Verb("calibrate", "simulation-based calibration and coverage of the bands", "calibrate:run", (
        out("folder for the results", required=True),
        Argument("--regimes", metavar="NAME,...", help="only these regimes, or law-* (default: all but wake-*)"),
        Argument("--campaigns", type=int, default=500, metavar="N", help="in every regime (default 500)"),
        *spread(),
        MODEL,
        force("the results that lie"),
        flag("--resume", "go on with an interrupted run, or with more campaigns"),
    )),
    Verb("diagnose", "the sim-to-real gap: where, which effect, how far it shrinks", "campaigns:diagnose", (
        CAMPAIGN,
        out("folder for the results (default: out/NAME/gap)"),
        MODEL,
        TESTS,
        jobs("threads", 2),
        Argument("--workers", dest="jobs", type=int, default=2, help=SUPPRESS),  # its name until version 1
        flag("--thorough", "evidence of the leaders by bridge sampling, too"),
        SC,
        STRICT,
        force("the diagnosis that lies"),
        flag("--resume", "go on with an interrupted run: it begins again"),
    )),
    Verb("challenge", "the blind check of diagnose: make campaigns, run, score, tune", "", steps=CHALLENGE),
    Verb("models", "the shipped model cards; one card in full; what its priors say", "models:run", steps=(
        Verb("show", "print a card with all that it extends, or draw its priors", "models:show", (
            Argument("card", metavar="CARD", help="a shipped name or a TOML file"),
            Argument(
                "--prior-predictive", type=Path, metavar="DIR",
                help="draw Griffin curves from its priors: CARD.svg and CARD.png",
            ),
        )),
    )),
    Verb("simulate", "write a synthetic campaign from the full equation of motion", "campaigns:simulate", (
        Argument("spec", type=Path, help="TOML file with the section, the rigs, the tests and the truth"),
        out("folder for the campaign", required=True),
        force("the campaign that lies"),
    )),
)  # fmt: skip
