"""What is said of spoiled input: every verb, exit code and text."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.goldens.capture import Room
from tests.goldens.others import simulated

CAMPAIGN, RECORD = "campaign/campaign.toml", "campaign/light-decay.csv"
OUT = ("-o", "out")


def replaced(file: str, old: str, new: str) -> Callable[[Path], None]:
    """Replace a text once."""

    def spoil(folder: Path) -> None:
        text = (folder / file).read_text(encoding="utf-8")
        if old not in text:
            raise ValueError(f"{file} does not hold {old!r}: the case spoils nothing")
        (folder / file).write_text(text.replace(old, new, 1), encoding="utf-8")

    return spoil


def written(file: str, text: str) -> Callable[[Path], None]:
    """Write a file anew."""

    def spoil(folder: Path) -> None:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")

    return spoil


def removed(file: str) -> Callable[[Path], None]:
    """Remove a file."""
    return lambda folder: (folder / file).unlink()


def intact(_: Path) -> None:
    """Spoil nothing: the arguments are what is wrong."""


CHECK = ("check", "campaign")
FIT = ("fit", "campaign", *OUT)
CARD = ("fit", "campaign", *OUT, "--model", "card.toml")
SIMULATE = ("simulate", "simulation.toml", *OUT)
SIZE = ("size", "fit", *OUT, "--bridge", "bridge.toml")
BRIDGE = 'format = 1\ntitle = "B"\nwidth = "12 m"\ndepth = "3 m"\n[[modes]]\nname = "V1"\nfrequency = "0.3 Hz"\n'
RECORD_TEXT = "time [s],displacement [mm]\n0,1\n0.01,2\n0.02,{cell}\n0.03,1\n"
Case = tuple[tuple[str, ...], Callable[[Path], None]]

CASES: dict[str, Case] = {
    # a campaign
    "no such folder": (("check", "nowhere"), intact),
    "no campaign.toml": (CHECK, removed(CAMPAIGN)),
    "broken TOML": (CHECK, replaced(CAMPAIGN, "[section]", "[section")),
    "unknown key": (CHECK, replaced(CAMPAIGN, "motion =", "colour = 1\nmotion =")),
    "misspelt key": (CHECK, replaced(CAMPAIGN, "frequency =", "frequenzy =")),
    "unknown motion": (CHECK, replaced(CAMPAIGN, '"heaving"', '"swaying"')),
    "wrong unit": (CHECK, replaced(CAMPAIGN, "kg/m", "Hz")),
    "unit nobody knows": (CHECK, replaced(CAMPAIGN, "7.87 Hz", "7.87 Hzz")),
    "negative damping": (CHECK, replaced(CAMPAIGN, "0.0065", "-0.0065")),
    "unknown kind": (CHECK, replaced(CAMPAIGN, '"decay"', '"decaying"')),
    "rig of a test that is not there": (CHECK, replaced(CAMPAIGN, 'rig = "light"', 'rig = "lihgt"')),
    "missing width": (CHECK, replaced(CAMPAIGN, "width =", "# width =")),
    "format of the future": (CHECK, replaced(CAMPAIGN, "format = 1", "format = 99")),
    "file outside": (CHECK, replaced(CAMPAIGN, "light-decay.csv", "../light-decay.csv")),
    "damping ten times off": (CHECK, replaced(CAMPAIGN, "0.0065", "0.065")),
    # a record
    "no record": (CHECK, removed(RECORD)),
    "empty record": (CHECK, written(RECORD, "")),
    "no column": (CHECK, written(RECORD, "time [s]\n0\n1\n")),
    "column without unit": (CHECK, written(RECORD, "time,displacement\n0,1\n1,2\n")),
    "unit of another kind": (CHECK, written(RECORD, "time [s],displacement [Hz]\n0,1\n1,2\n")),
    "no number": (CHECK, written(RECORD, RECORD_TEXT.format(cell="two"))),
    "nan": (CHECK, written(RECORD, RECORD_TEXT.format(cell="nan"))),
    "ragged": (CHECK, written(RECORD, RECORD_TEXT.format(cell="2,3"))),
    "time goes back": (CHECK, written(RECORD, RECORD_TEXT.format(cell="2").replace("0.03", "0.01"))),
    "a few samples": (FIT, written(RECORD, RECORD_TEXT.format(cell="2"))),
    # fit and its card
    "fit nowhere": (("fit", "nowhere", *OUT), intact),
    "unknown card": (("fit", "campaign", *OUT, "--model", "defualt"), intact),
    "broken card": (CARD, written("card.toml", "format = ")),
    "unknown key of a card": (CARD, written("card.toml", 'extends = "default"\nname = "x"\n[samplr]\ndraws = 8\n')),
    "bad sampler": (CARD, written("card.toml", 'extends = "default"\nname = "x"\n[sampler]\ndraws = -8\n')),
    "bad law": (CARD, written("card.toml", 'extends = "default"\nname = "x"\n[law]\nn = ["two"]\n')),
    "weights that do not fit": (
        CARD, written("card.toml", 'extends = "default"\nname = "x"\n[law]\nn = [-1, 2]\nprior_weights = [1.0]\n')
    ),
    "unknown test": (("fit", "campaign", *OUT, "--tests", "nothing"), intact),
    "unknown effect": (("fit", "campaign", *OUT, "--effect", "magic"), intact),
    "out is a file": (("fit", "campaign", "-o", "simulation.toml"), intact),
    "results are there": (("fit", "campaign", "-o", "fit"), intact),
    # results
    "predict nowhere": (("predict", "nowhere", "--sc", "30"), intact),
    "predict from a campaign": (("predict", "campaign", "--sc", "30"), intact),
    "predict nothing": (("predict", "fit"), intact),
    "negative Sc": (("predict", "fit", "--sc", "-3"), intact),
    "Sc that is no number": (("predict", "fit", "--sc", "many"), intact),
    "bad damping": (("predict", "fit", "--damping", "0.003 +/- nan"), intact),
    "unknown rig": (("predict", "fit", "--sc", "30", "--rig", "medium"), intact),
    "law that was not fitted": (("predict", "fit", "--sc", "30", "--law", "1"), intact),
    "effect that it does not carry": (("predict", "fit", "--sc", "30", "--effect", "coulomb_friction"), intact),
    "damaged fit.json": (("predict", "fit", "--sc", "30"), written("fit/fit.json", "{")),
    "no posterior": (("predict", "fit", "--sc", "30"), removed("fit/posterior.nc")),
    "unknown limit": (("size", "fit", *OUT, "--limit", "nonsense"), intact),
    "bridge without limits": (SIZE, written("bridge.toml", BRIDGE)),
    "bridge without modes": (SIZE, written("bridge.toml", BRIDGE.partition("[[modes]]")[0])),
    "unknown key of a bridge": (SIZE, written("bridge.toml", "lenght = 3\n" + BRIDGE)),
    "bad unit of a bridge": (SIZE, written("bridge.toml", BRIDGE.replace("12 m", "12 kg"))),
    "criticise nowhere": (("criticise", "nowhere"), intact),
    # the other verbs
    "report without a bridge": (("report", "campaign", *OUT, "--bridge", "nowhere.toml"), intact),
    "validate nowhere": (("validate", "nowhere", *OUT), intact),
    "diagnose with no workers": (("diagnose", "campaign", *OUT, "--jobs", "0"), intact),
    "batch of nothing": (("batch", *OUT), intact),
    "batch with no jobs": (("batch", "campaign", *OUT, "--jobs", "0"), intact),
    "unknown regime": (("calibrate", *OUT, "--regimes", "turbulence-x"), intact),
    "no campaigns": (("calibrate", *OUT, "--campaigns", "0"), intact),
    "unknown effect of a challenge": (("challenge", "make", *OUT, "--effects", "magic"), intact),
    "challenge of nothing": (("challenge", "run", "campaign", *OUT), intact),
    "score of nothing": (("challenge", "score", "campaign", "campaign"), intact),
    "card that is not there": (("models", "show", "nothing"), intact),
    "specification that is not there": (("simulate", "nowhere.toml", *OUT), intact),
    "unknown key of a specification": (SIMULATE, replaced("simulation.toml", "turbulence", "turbulense")),
    "bad number of a specification": (SIMULATE, replaced("simulation.toml", "duration = 8", "duration = -8")),
    "truth without Y1": (SIMULATE, replaced("simulation.toml", "Y1 = -11.111, ", "")),
    "unknown verb": (("chekc", "campaign"), intact),
    "unknown option": (("check", "campaign", "--colour"), intact),
    "no verb": ((), intact),
    "seed that is no number": (("check", "campaign", "--seed", "one"), intact),
}  # fmt: skip


def of_input(room: Room) -> dict[str, Any]:
    """Spoil what needs no results: cheap."""
    simulated(room)
    return _run(room, {name: case for name, case in CASES.items() if not _of_results(case)})


def of_results(room: Room) -> dict[str, Any]:
    """Spoil results, or ask them for what they do not hold."""
    simulated(room)
    room.bring("tiny.toml")
    room.fitted("campaign", "--model", "tiny.toml", "--tests", "light in wind")
    return _run(room, {name: case for name, case in CASES.items() if _of_results(case)})


def _of_results(case: Case) -> bool:
    return "fit" in case[0][1:]


def _run(room: Room, cases: dict[str, Case]) -> dict[str, Any]:
    """Run every case on a copy of what is intact."""
    found = {}
    for name, (argv, spoil) in cases.items():
        case = Room(room.folder / "case")
        shutil.copytree(room.folder, case.folder, ignore=shutil.ignore_patterns("case"))
        spoil(case.folder)
        found[name] = case.run(*argv)
        shutil.rmtree(case.folder)
    return found
