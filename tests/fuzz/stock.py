"""What cases start from: intact campaigns, a fit, a challenge, and folders of runs that were interrupted."""

import contextlib
import io
import json
import os
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
SEED = 1

CARD = """\
format = 1
name = "quick"
title = "One law and short chains, for fuzzing alone"
extends = "default"

[law]
n = [-1]
prior_weights = [1.0]

[sampler]
ensembles = 2
walkers = 32
draws = 8
min_ess = 50
max_rhat = 1.3
"""

RIG = """
[[rigs]]
name = "{name}"
mass = {{ mean = "{mass}", sd = "{mass_sd}" }}
frequency = "{frequency} Hz"
damping_ratio = {{ mean = {damping}, sd = {damping_sd} }}

[[rigs.records]]
file = "{name}-still.csv"
kind = "free-decay"
initial_amplitude = 0.06
duration = {still}

[[tests]]
name = "{name} in wind"
rig = "{name}"
air_density = "1.22 kg/m^3"
wind_speed = "{speed} m/s"
stable_amplitude = {stable}
truth = {{ {truth} }}

[[tests.records]]
file = "{name}-decay.csv"
kind = "decay"
initial_amplitude = 2.5
duration = {wind}

[[tests.records]]
file = "{name}-growth.csv"
kind = "growth"
initial_amplitude = 0.1
duration = {wind}
"""

TOP = """
format = 1
title = "Fuzz, {motion}"
source = "simulated"

[section]
motion = "{motion}"
width = "{width}"
depth = "{depth}"

[simulation]
sample_rate = 100
turbulence = 0.005
sensor_noise = 0.0001
"""

HEAVING = {
    "mass": "7.292 kg/m", "mass_sd": "0.04 kg/m", "frequency": 7.87, "speed": 5.036, "still": 8, "wind": 9,
    "truth": "Y1 = -11.111, epsilon = 0.03235",
}  # fmt: skip
TORSIONAL = {
    "mass": "0.183 kg*m^2/m", "mass_sd": "0.0009 kg*m^2/m", "frequency": 7.257, "speed": 4.3281, "still": 10,
    "wind": 14, "truth": "Y1 = -0.057, epsilon = 0.1625",
}  # fmt: skip
SECTIONS = {
    "heaving": {"width": "0.3 m", "depth": "0.075 m"},
    "torsional": {"width": "0.5933 m", "depth": "0.0497 m"},
}
RIGS = {
    "heaving": [("light", 0.0065, 0.0292), ("heavy", 0.0080, 0.0262)],
    "torsional": [("light", 0.00421, 0.0158), ("heavy", 0.0060, 0.0128)],
}


def specification(motion: str) -> str:
    """Spell a simulation of two rigs, each with a ring-down, and a decay and a growth in wind."""
    common = HEAVING if motion == "heaving" else TORSIONAL
    rigs = [
        RIG.format(name=name, damping=damping, damping_sd=0.04 * damping, stable=stable, **common)
        for name, damping, stable in RIGS[motion]
    ]
    return TOP.format(motion=motion, **SECTIONS[motion]) + "".join(rigs)


@dataclass(frozen=True)
class Stock:
    """The folder of the intact material; each part is made when it is first asked for (`make`, in one process)."""

    folder: Path

    def path(self, name: str) -> Path:
        """Return the folder or file of a part that was made."""
        return self.folder / name

    def copy(self, name: str, to: Path) -> Path:
        """Copy a part to where a case may spoil it."""
        source = self.path(name)
        if source.is_dir():
            shutil.copytree(source, to, dirs_exist_ok=True)
        else:
            shutil.copyfile(source, to)
        return to

    def campaign(self, motion: str, to: Path) -> dict[str, Any]:
        """Copy a campaign, and return the content of its campaign.toml."""
        self.copy(motion, to)
        return tomllib.loads((to / "campaign.toml").read_text(encoding="utf-8"))

    def make(self) -> None:
        """Make all parts that are not there."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for name, maker in PARTS.items():
            if not self.path(name).exists():
                made = self.folder / f"making-{name}"
                shutil.rmtree(made, ignore_errors=True)
                maker(self, made)
                os.replace(made, self.path(name))  # noqa: PTH105


def _run(*argv: object, stops: tuple[str, ...] = ()) -> None:
    """Run a command that has to succeed, in silence."""
    from scruton.cli import main
    from tests.fuzz.standins import stopped

    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), stopped(stops):
        try:
            code = main([str(one) for one in argv])
        except SystemExit as end:
            code = end.code
    if code not in (0, 1, None):
        raise RuntimeError(f"the stock cannot be made: {argv[0]} gave {code}: {said.getvalue()}")


def _campaign(motion: str) -> Callable[[Stock, Path], None]:
    def make(stock: Stock, to: Path) -> None:
        spec = stock.path(f"{motion}.toml")
        spec.write_text(specification(motion), encoding="utf-8")
        _run("simulate", spec, "-o", to, "--seed", SEED)
        sweep(to, motion)

    return make


def sweep(folder: Path, motion: str) -> None:
    """Add steady amplitudes of other wind speeds, of the first rig."""
    common, (name, _, stable) = HEAVING if motion == "heaving" else TORSIONAL, RIGS[motion][0]
    unit, column = ("mm", 75.0) if motion == "heaving" else ("rad", 1.0)
    shares = ((0.9, 0.3), (0.95, 0.7), (1.0, 1.0), (1.05, 0.8), (1.1, 0.4))
    rows = "".join(f"{common['speed'] * speed:.4f},{stable * share * column:.5f}\n" for speed, share in shares)
    (folder / "sweep.csv").write_text(f"wind speed [m/s],amplitude [{unit}]\n{rows}", encoding="utf-8")
    table = f'\n[[sweeps]]\nrig = "{name}"\nair_density = "1.22 kg/m^3"\nfile = "sweep.csv"\n'
    with (folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(table)


def _fit(stock: Stock, to: Path) -> None:
    """Fit, and keep in a part of its own what the run would have left, had it ended before its results."""
    command = ("fit", stock.path("heaving"), "--model", stock.path("card.toml"), "--quiet", "-o")
    interrupted = _empty(stock.path("interrupted"))
    _run(*command, interrupted, stops=("scruton.workspace.Workspace.publish",))
    stock.copy("interrupted", to)
    _run(*command, to, "--resume")


def _other(stock: Stock, to: Path) -> None:
    """Fit another campaign."""
    options = ("--model", stock.path("card.toml"), "--quiet", "--tests", "light in wind")
    _run("fit", stock.path("torsional"), "-o", to, *options)


def _empty(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def _challenge(_: Stock, to: Path) -> None:
    """Make two cases and spell the results of their diagnoses as FORMAT.md has them."""
    one_rig = ("--design", "one-rig", "--effects", "none,coulomb_friction", "--severities", "0.4")
    _run("challenge", "make", "-o", to / "made", "--cases", 2, *one_rig)
    _run("challenge", "run", to / "made", "-o", to / "results", stops=("scruton.gap.diagnose.examine",))
    for case, verdict in (("case-0001", "none"), ("case-0002", "coulomb_friction")):
        other = "none" if verdict != "none" else "coulomb_friction"
        content = {
            "format": 1, "verdict": verdict, "also": [], "probability": {verdict: 0.9, other: 0.06, "unknown": 0.04},
            "indistinguishable": [[verdict]], "where": [], "shrink": {}, "effects": {}, "advice": [],
        }  # fmt: skip
        place = to / "results" / case
        place.mkdir(parents=True, exist_ok=True)
        (place / "gap.json").write_text(json.dumps(content), encoding="utf-8")
        (place / "case.json").write_text('{"seconds": 1.0, "error": null}', encoding="utf-8")


def _batch(stock: Stock, to: Path) -> None:
    """Make a batch of one finished campaign that was interrupted before its summary."""
    stops = ("scruton.workers.connected=null", "scruton.workers.told=null", "scruton.workers.finished")
    _run("batch", stock.path("heaving"), "-o", to, "--model", stock.path("card.toml"), "--quiet", stops=stops)
    stock.copy("fit", to / "heaving")


def _calibration(stock: Stock, to: Path) -> None:
    """Claim the folder of a calibration that was interrupted in its first campaign."""
    stops = ("scruton.calibrate.calibration.run_campaign",)
    regimes = ("--regimes", "turbulence-1", "--campaigns", 2)
    _run("calibrate", "-o", to, *regimes, "--model", stock.path("card.toml"), "--quiet", stops=stops)


PARTS: dict[str, Callable[[Stock, Path], None]] = {
    "card.toml": lambda _, to: to.write_text(CARD, encoding="utf-8"),
    "heaving": _campaign("heaving"),
    "torsional": _campaign("torsional"),
    "fit": _fit,
    "other": _other,
    "challenge": _challenge,
    "batch": _batch,
    "calibration": _calibration,
}


def fingerprint() -> str:
    """Digest of the package as it is imported, and of this file: stock of other code is not used."""
    import scruton

    digest = sha256(Path(__file__).read_bytes())
    for path in sorted(Path(scruton.__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:10]
