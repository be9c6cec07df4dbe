"""Every verb that takes a campaign, on the examples."""

from typing import Any

from tests.goldens.capture import CAMPAIGNS, SEED, Room

# The default card for one campaign; the others under two laws and short chains, to keep the whole affordable.
FULL = "rectangle-4to1"
DESIGN = ("--sc", "20", "--sc", "60")


def card(name: str) -> tuple[str, ...]:
    """Options that choose the model card."""
    return () if name == FULL else ("--model", "quick.toml")


def check(room: Room) -> dict[str, Any]:
    """The text of `check` for all examples."""
    room.bring(*CAMPAIGNS)
    return {name: room.run("check", name) for name in CAMPAIGNS}


def fit(room: Room, name: str) -> dict[str, Any]:
    """Fit, predict, size and criticise a campaign."""
    room.bring(name, "quick.toml")
    bridge = room.folder / name / "bridge.toml"
    size = ("--bridge", f"{name}/bridge.toml") if bridge.exists() else ("--limit", "0.02")
    return {
        "fit": room.fitted(name, *card(name)),
        "predict": room.run("predict", "fit", "--seed", SEED, *DESIGN),
        "predict json": room.run("predict", "fit", "--seed", SEED, "--sc", "20", "--law", "-1", "--json"),
        "size": room.run("size", "fit", "--seed", SEED, "-o", "size", *size),
        "criticise": room.run("criticise", "fit", "--seed", SEED, "-o", "criticism"),
        "files": {one: room.files(one) for one in ("fit", "size", "criticism")},
    }


def validate(room: Room, name: str) -> dict[str, Any]:
    """Predict every rig from the others."""
    room.bring(name, "quick.toml")
    said = room.run("validate", name, "--seed", SEED, "-o", "validation", *card(name))
    return {"validate": said, "files": room.files("validation")}


def diagnose(room: Room, name: str) -> dict[str, Any]:
    """Diagnose the gap."""
    room.bring(name, "quick.toml")
    said = room.run("diagnose", name, "--seed", SEED, "-o", "gap", "--jobs", "1", *card(name))
    return {"diagnose": said, "files": room.files("gap")}


def report(room: Room, name: str) -> dict[str, Any]:
    """The report with everything in it."""
    room.bring(name, "quick.toml")
    more = ("--bridge", f"{name}/bridge.toml", "--sc", "20", "--model", "quick.toml")
    said = room.run("report", name, "--seed", SEED, "-o", "report", *more)
    return {"report": said, "files": room.files("report")}
