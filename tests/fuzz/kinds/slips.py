"""Slips of the pen: each must make `check` (or the verb concerned) say something that it did not say before."""

import copy
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.random import Generator

from tests.fuzz.case import ACCEPTED, ANY, Case, Run
from tests.fuzz.damage import one
from tests.fuzz.kinds.tables import EXTENSION
from tests.fuzz.stock import Stock

CHECK = ("check", "case")


@dataclass
class Lab:
    """A clean campaign in a case's folder: what its TOML says, and its files."""

    place: Path
    content: dict[str, Any]
    motion: str

    def rig(self, rng: Generator) -> dict[str, Any]:
        return one(rng, self.content["rigs"])

    def test(self, rng: Generator) -> dict[str, Any]:
        return one(rng, self.content["tests"])

    def edit(self, file: str, change: Callable[[np.ndarray], np.ndarray]) -> None:
        """Change the rows of a CSV."""
        header, *rows = (self.place / file).read_text(encoding="utf-8").splitlines()
        values = change(np.array([[float(cell) for cell in row.split(",")] for row in rows]))
        text = "\n".join([header, *(",".join(f"{value:.8g}" for value in row) for row in values.tolist())])
        (self.place / file).write_text(text + "\n", encoding="utf-8")

    def scale(self, file: str, factor: float) -> None:
        """Multiply the readings of a record."""
        self.edit(file, lambda rows: rows * [1.0, factor])


def of_kind(owner: dict[str, Any], kind: str) -> dict[str, Any]:
    """Return the record of a kind."""
    return next(one for one in owner["records"] if one["kind"] == kind)


def times(text: str, factor: float) -> str:
    """Multiply the number of a quantity."""
    number, unit = text.split(" ", 1)
    return f"{float(number) * factor:.6g} {unit}"


Slip = Callable[[Lab, Generator], None]
SLIPS: dict[str, Slip] = {}


def slip(name: str) -> Callable[[Slip], Slip]:
    """Register a slip by its name."""

    def register(function: Slip) -> Slip:
        SLIPS[name] = function
        return function

    return register


def _scaled(owner: str, key: str, factor: float) -> Slip:
    """Multiply a stated quantity of a rig or a test."""

    def change(lab: Lab, rng: Generator) -> None:
        table = lab.rig(rng) if owner == "rig" else lab.test(rng)
        holder, name = (table[key], "mean") if isinstance(table[key], dict) else (table, key)
        old = holder[name]
        holder[name] = times(old, factor) if isinstance(old, str) else old * factor

    return change


for _name, _owner, _key, _factor in (
    ("f0 stated 5 % above its line", "rig", "frequency", 1.05),
    ("f0 stated 5 % below its line", "rig", "frequency", 0.95),
    ("f0 ten times too high", "rig", "frequency", 10.0),
    ("f0 ten times too low", "rig", "frequency", 0.1),
    ("stated damping ten times too high", "rig", "damping_ratio", 10.0),
    ("stated damping a hundred times too high", "rig", "damping_ratio", 100.0),
    ("mass a thousand times too large", "rig", "mass", 1000.0),
    ("mass a thousand times too small", "rig", "mass", 0.001),
    ("air density 0.5", "test", "air_density", 0.5 / 1.22),
    ("air density 12", "test", "air_density", 10.0),
    ("wind speed for U/(f0 D) of 90", "test", "wind_speed", 9.0),
    ("wind speed for U/(f0 D) of 0.5", "test", "wind_speed", 0.055),
    ("stable amplitude ten times too large", "test", "stable_amplitude", 10.0),
):
    SLIPS[_name] = _scaled(_owner, _key, _factor)


def _stated_sd(owner: str, key: str) -> Slip:
    def change(lab: Lab, rng: Generator) -> None:
        table = lab.rig(rng) if owner == "rig" else lab.test(rng)
        mean = table[key]["mean"] if isinstance(table[key], dict) else table[key]
        table[key] = {"mean": mean, "sd": times(mean, 0.4) if isinstance(mean, str) else 0.4 * mean}

    return change


for _owner, _key in (
    ("rig", "mass"), ("rig", "frequency"), ("rig", "damping_ratio"), ("test", "air_density"), ("test", "wind_speed"),
    ("test", "stable_amplitude"),
):  # fmt: skip
    SLIPS[f"an sd of 40 % of the {_key}"] = _stated_sd(_owner, _key)


def _section(key: str, factor: float) -> Slip:
    def change(lab: Lab, _: Generator) -> None:
        lab.content["section"][key] = times(lab.content["section"][key], factor)

    return change


SLIPS["B/D of 0.1"] = _section("width", 0.025)
SLIPS["B/D of 80"] = _section("width", 20.0)


@slip("a depth in km")
def _(lab: Lab, _: Generator) -> None:
    number = float(lab.content["section"]["depth"].split()[0])
    lab.content["section"]["depth"] = f"{number / 1000:g} km"


@slip("a frequency in 1/year")
def _(lab: Lab, rng: Generator) -> None:
    rig = lab.rig(rng)
    rig["frequency"] = f"{float(rig['frequency'].split()[0]) * 31557600.0:.10g} 1/year"


@slip("a start in years")
def _(lab: Lab, rng: Generator) -> None:
    lab.test(rng)["records"][0]["start"] = "1e-8 year"


@slip("a record thinned to about 8.5 Hz")
def _(lab: Lab, rng: Generator) -> None:
    lab.edit(one(rng, (*lab.rig(rng)["records"], *lab.test(rng)["records"]))["file"], lambda rows: rows[::12])


@slip("cm for mm in one of growth and decay")
def _(lab: Lab, rng: Generator) -> None:
    lab.scale(one(rng, lab.test(rng)["records"])["file"], 10.0)


@slip("growth and decay that end 1.5 apart")
def _(lab: Lab, rng: Generator) -> None:
    lab.scale(one(rng, lab.test(rng)["records"])["file"], 1.5)


@slip("a growth filed as free decay")
def _(lab: Lab, rng: Generator) -> None:
    test = lab.test(rng)
    record = of_kind(test, "growth")
    test["records"].remove(record)
    rig = next(one for one in lab.content["rigs"] if one["name"] == test["rig"])
    rig["records"].append({**record, "kind": "free-decay"})


@slip("a decay filed as growth")
def _(lab: Lab, rng: Generator) -> None:
    of_kind(lab.test(rng), "decay")["kind"] = "growth"


@slip("a growth filed as decay")
def _(lab: Lab, rng: Generator) -> None:
    of_kind(lab.test(rng), "growth")["kind"] = "decay"


@slip("the same bytes in two rigs")
def _(lab: Lab, _: Generator) -> None:
    first, second = (rig["records"][0]["file"] for rig in lab.content["rigs"][:2])
    shutil.copyfile(lab.place / first, lab.place / second)


@slip("the same bytes under two names in one test")
def _(lab: Lab, rng: Generator) -> None:
    test = lab.test(rng)
    record = one(rng, test["records"])
    shutil.copyfile(lab.place / record["file"], lab.place / "again.csv")
    test["records"].append({**record, "file": "again.csv"})


@slip("overlapping windows of one file")
def _(lab: Lab, rng: Generator) -> None:
    test = lab.test(rng)
    record = one(rng, test["records"])
    test["records"].remove(record)
    test["records"] += [{**record, "start": "0 s", "stop": "6 s"}, {**record, "start": "2 s"}]


@slip("A/D above 0.5")
def _(lab: Lab, rng: Generator) -> None:
    test = lab.test(rng)
    factor = 0.8 / test["stable_amplitude"]
    test["stable_amplitude"] = 0.8
    for record in test["records"]:
        lab.scale(record["file"], factor)


def _third(value: float | None) -> Slip:
    """Keep a third of a record at zero, or at the value that it stood at."""

    def change(lab: Lab, rng: Generator) -> None:
        at = rng.uniform(0.1, 0.6)

        def stuck(rows: np.ndarray) -> np.ndarray:
            first, last = (int(share * len(rows)) for share in (at, at + 0.34))
            rows[first:last, 1] = rows[first, 1] if value is None else value
            return rows

        lab.edit(one(rng, (*lab.rig(rng)["records"], *lab.test(rng)["records"]))["file"], stuck)

    return change


SLIPS["a third of a record zero"] = _third(0.0)
SLIPS["a third of a record constant"] = _third(None)


@slip("a sweep of one point")
def _(lab: Lab, _: Generator) -> None:
    lab.edit("sweep.csv", lambda rows: rows[2:3])


@slip("a sweep of zeros")
def _(lab: Lab, _: Generator) -> None:
    lab.edit("sweep.csv", lambda rows: rows * [1.0, 0.0])


# Slips at other verbs: what is asked for, and that it is refused or flagged.
COMMANDS: dict[str, tuple[str, ...]] = {
    "predict --damping 0.3": ("predict", "{fit}", "--damping", "0.3"),
    "predict --law nan": ("predict", "{fit}", "--sc", "30", "--law", "nan"),
    "predict --law inf": ("predict", "{fit}", "--sc", "30", "--law", "inf"),
    "predict --damping 0.003 +/- inf": ("predict", "{fit}", "--damping", "0.003 +/- inf"),
    "predict --sc -30": ("predict", "{fit}", "--sc=-30"),
    "size --damping 0.003 +/- inf": ("size", "{fit}", "--limit", "0.05", "--damping", "0.003 +/- inf"),
    "size --law nan": ("size", "{fit}", "--limit", "0.05", "--law", "nan"),
    "a prior's unit": ("models", "show", "card.toml"),
}


def make(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """Take the slips in turn, with the two campaigns; the first cases are clean ones."""
    if number < 2:
        motion = ("heaving", "torsional")[number]
        stock.campaign(motion, folder / "case")
        return Case(
            f"clean ({motion})", CHECK, ACCEPTED, demand=lambda run: "a false warning" if warnings(run.said) else ""
        )
    names = (*SLIPS, *COMMANDS)
    name = names[(number - 2) % len(names)]
    if name in COMMANDS:
        return _command(rng, name, folder, stock)
    motion = "heaving" if name == "A/D above 0.5" else ("heaving", "torsional")[(number - 2) // len(names) % 2]
    lab = Lab(folder / "case", stock.campaign(motion, folder / "case"), motion)
    lab.content = copy.deepcopy(lab.content)
    SLIPS[name](lab, rng)
    (lab.place / "campaign.toml").write_text(tomli_w.dumps(lab.content), encoding="utf-8")

    def demand(run: Run) -> str:
        said = warnings(run.said)
        return "" if said or run.code == 2 else f"slip unnoticed: {name}\n{motion}"

    return Case(f"slip ({motion}): {name}", CHECK, ANY, demand=demand)


def _command(rng: Generator, name: str, folder: Path, stock: Stock) -> Case:
    if name == "a prior's unit":
        content = copy.deepcopy(EXTENSION)
        content["priors"]["relaxation_ratio"]["unit"] = one(rng, ("Hz", "1/s", "%", "A/D"))
        (folder / "card.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    argv = tuple(str(stock.path(one[1:-1])) if one.startswith("{") else one for one in COMMANDS[name])
    argv += ("-o", "out") if argv[0] == "size" else ()

    def demand(run: Run) -> str:
        return "" if run.code == 2 or warnings(run.said) else f"slip unnoticed: {name}"

    stops = ("scruton.sizing.size.size",) if argv[0] == "size" else ()
    return Case(f"slip: {name}", argv, ANY, stops=stops, demand=demand)


def warnings(said: str) -> list[str]:
    """Return the sentences of what was printed that begin with an exclamation mark: both clean campaigns have none."""
    return [line for line in said.splitlines() if re.match(r"\s*!", line)]
