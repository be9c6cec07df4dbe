"""Verbs that take no example, or several; and a small campaign on which every option is cheap."""

from typing import Any

from tests.goldens.capture import SEED, Room

VERBS = (
    "check", "fit", "report", "predict", "size", "criticise", "validate", "batch", "calibrate", "diagnose",
    "challenge", "challenge make", "challenge run", "challenge score", "models", "models show", "simulate",
)  # fmt: skip
CARDS = ("default", "ehsan-scanlan", "free-exponent", "friction-dampers", "gompertz", "paper", "quadratic", "stacking",
         "stated-damping")  # fmt: skip


def texts(room: Room) -> dict[str, Any]:
    """What is said without any work: help of every verb, the shipped cards."""
    room.bring("quick.toml")
    return {
        "help": {verb: room.run(*verb.split(), "--help") for verb in ("", *VERBS)},
        "models": room.run("models"),
        "show": {one: room.run("models", "show", one) for one in (*CARDS, "quick.toml")},
    }


def small(room: Room) -> dict[str, Any]:
    """Simulate a small campaign and put it through the options of the quick verbs."""
    simulated(room)
    return {
        "check": room.run("check", "campaign"),
        "fit": room.fitted("campaign", "--model", "quick.toml"),
        "one test": room.fitted("campaign", "--model", "quick.toml", "--tests", "light in wind", out="one"),
        "damping": room.run("predict", "fit", "--seed", SEED, "--damping", "0.01 +/- 0.002", "--rig", "heavy"),
        "json": room.run("predict", "fit", "--seed", SEED, "--sc", "30", "--sc", "21.7", "--json"),
        "law": room.run("predict", "fit", "--seed", SEED, "--sc", "30", "--law", "2"),
        "size": room.run("size", "fit", "--seed", SEED, "-o", "size", "--limit", "0.02", "--limit", "1.2 mm"),
        "files": {one: room.files(one) for one in ("campaign", "fit", "one", "size")},
    }


def simulated(room: Room) -> dict[str, Any]:
    """Simulate the small campaign."""
    room.bring("simulation.toml", "quick.toml")
    return room.run("simulate", "simulation.toml", "--seed", SEED, "-o", "campaign")


def schema(room: Room) -> dict[str, Any]:
    """One example in the shortest way to a posterior.nc."""
    room.bring("closed-box-torsional", "tiny.toml")
    said = room.fitted("closed-box-torsional", "--model", "tiny.toml", "--tests", "Sc 1.13")
    return {"fit": said, "files": room.files("fit")}


def effect(room: Room) -> dict[str, Any]:
    """A fit that carries an effect into its predictions: the friction that is in the pylon's dampers."""
    room.bring("pylon", "tiny.toml")
    return {
        "fit": room.fitted("pylon", "--model", "tiny.toml", "--effect", "coulomb_friction"),
        "predict": room.run("predict", "fit", "--seed", SEED, "--sc", "30", "--effect", "auto"),
        "size": room.run("size", "fit", "--seed", SEED, "-o", "size", "--limit", "0.05", "--effect", "auto"),
        "files": {one: room.files(one) for one in ("fit", "size")},
    }


def batch(room: Room) -> dict[str, Any]:
    """Two campaigns side by side, and one that is not there."""
    simulated(room)
    room.bring("closed-box-torsional")
    said = room.run(
        "batch", "campaign", "closed-box-torsional", "nowhere", "--seed", SEED, "-o", "batch", "--jobs", "1", "--sc",
        "20", "--model", "quick.toml",
    )  # fmt: skip
    return {"batch": said, "files": room.files("batch")}


def calibrate(room: Room) -> dict[str, Any]:
    """Two regimes, two campaigns each."""
    room.bring("quick.toml")
    said = room.run(
        "calibrate", "--seed", SEED, "-o", "calibration", "--regimes", "turbulence-1,growth", "--campaigns", "2",
        "--model", "quick.toml",
    )  # fmt: skip
    return {"calibrate": said, "files": room.files("calibration")}


def challenge(room: Room) -> dict[str, Any]:
    """Make, run and score 24 blind cases."""
    return {
        "make": room.run("challenge", "make", "-o", "made", "--cases", "24", "--seed", SEED, "--quiet"),
        "run": room.run("challenge", "run", "made", "-o", "results", "--quiet"),
        "score": room.run("challenge", "score", "made", "results", "-o", "score"),
        "files": {one: room.files(one) for one in ("results", "score")},
    }
