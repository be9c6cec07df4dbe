"""Fixtures that every test may use."""

import fcntl
import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import settings

# The same commit gives the same verdict; what is drawn anew each time is the business of tests/fuzz.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")

# Processes of xdist are told the width of a terminal, of which there is none.
os.environ.pop("COLUMNS", None)

SHARED = Path(__file__).resolve().parents[1].parent / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Callable[[str], Path]:
    """Find a folder of measured records beside the project, or skip the test and say why."""

    def find(name: str) -> Path:
        folder = SHARED / name
        if not folder.is_dir():
            pytest.skip(f"the measured records '{name}' do not lie beside the project")
        return folder

    return find


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], object]], Path]:
    """Make a folder of this name once a run of the suite, whichever of its processes asks first; read only."""
    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root

    def made(name: str, make: Callable[[Path], object]) -> Path:
        folder, done = root / name, root / f"{name}.done"
        with (root / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                folder.mkdir()
                make(folder)
                done.touch()
        return folder

    return made


@pytest.fixture(autouse=True)
def nothing_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Do in this process what a command does in a copy of its own, which would keep what a test counts or changes."""
    monkeypatch.setattr("scruton.processes._of_one_thread", lambda: False)


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw none, of a sizing or a report: that takes half as long as a sizing."""
    # by its module: `scruton.report` by itself is the function; both before any is changed, as one imports the other
    for place in [import_module(f"scruton.report.{name}") for name in ("figures", "parts")]:
        monkeypatch.setattr(place, "figures_from", lambda *_: [])


SPEC = """
format = 1
title = "A small campaign <b>with</b> 漢字 and ξ"
source = "simulated for the tests"

[section]
motion = "heaving"
width = "0.3 m"
depth = "0.075 m"

[simulation]
sample_rate = 100
turbulence = 0.01
sensor_noise = 0.0001

[[rigs]]
name = "6#"
mass = { mean = "7.292 kg/m", sd = "0.04 kg/m" }
frequency = "7.87 Hz"
damping_ratio = { mean = 0.0065, sd = 0.0004 }

[[rigs.records]]
file = "still.csv"
kind = "free-decay"
initial_amplitude = 0.06
duration = 8

[[tests]]
name = "Sc 21.7"
rig = "6#"
air_density = "1.22 kg/m^3"
wind_speed = "5.036 m/s"
stable_amplitude = 0.0292
truth = { Y1 = -11.111, epsilon = 0.03235 }

[[tests.records]]
file = "decay.csv"
kind = "decay"
initial_amplitude = 2.5
duration = 9

[[tests.records]]
file = "growth.csv"
kind = "growth"
initial_amplitude = 0.1
duration = 9
"""

# A model card that costs a second.
CARD = """extends = "paper"
name = "quick"
[sampler]
walkers = 64
draws = 16
min_ess = 100
"""


@pytest.fixture(scope="session")
def small_campaign(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """Make a campaign of one rig, one test in wind, three records; read only, copy it to change it."""
    from scruton.simulate import write_campaign

    def make(folder: Path) -> None:
        (folder / "spec.toml").write_text(SPEC, encoding="utf-8")
        write_campaign(folder / "spec.toml", folder / "campaign", seed=1)

    return once("small", make) / "campaign"


@pytest.fixture(scope="session")
def small_results(small_campaign: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """Fit the small campaign once; read only."""
    from scruton.cli import main

    def make(folder: Path) -> None:
        assert main(["fit", str(small_campaign), "-o", str(folder / "fit"), "--quiet"]) == 0

    return once("results", make) / "fit"


@pytest.fixture(scope="session")
def quick_results(small_campaign: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """Fit the small campaign once under the paper's law, quickly: for what asks little of the draws; read only."""
    from scruton.cli import main

    def make(folder: Path) -> None:
        (folder / "card.toml").write_text(CARD, encoding="utf-8")
        card = str(folder / "card.toml")
        assert main(["fit", str(small_campaign), "-o", str(folder / "fit"), "--model", card, "--quiet"]) == 0

    return once("quick", make) / "fit"


# Two rigs in one wind under one law: what the campaign model, predictions and validation need at least.
TWO_RIGS = """
format = 1
title = "Two rigs"
source = "simulated for the tests"

[section]
motion = "heaving"
width = "0.3 m"
depth = "0.075 m"

[simulation]
sample_rate = 100
turbulence = 0.01
sensor_noise = 0.0001
"""

RIG = """
[[rigs]]
name = "{name}"
mass = "7.292 kg/m"
frequency = "7.87 Hz"
damping_ratio = {{ mean = {damping}, sd = {sd} }}

[[tests]]
name = "{name} in wind"
rig = "{name}"
air_density = "1.22 kg/m^3"
wind_speed = "5.036 m/s"
stable_amplitude = {amplitude}
truth = {{ {truth} }}

[[tests.records]]
file = "{name}-decay.csv"
kind = "decay"
initial_amplitude = 2.5
duration = 9

[[tests.records]]
file = "{name}-growth.csv"
kind = "growth"
initial_amplitude = 0.1
duration = 9
"""

# Van der Pol's force: 1.2428/s of negative damping, of which 2 xi omega0 is met; A^2 = (4/epsilon)(1 - 0.6429/1.2428).
FORCES = {
    "paper": ("Y1 = -11.111, epsilon = 0.03235", 0.0292, 0.0358),
    "ehsan-scanlan": ('Y1 = 19.67, epsilon = 2146, force = "ehsan-scanlan"', 0.0300, 0.0357),
}


@pytest.fixture(scope="session")
def two_rigs(once: Callable[[str, Callable[[Path], object]], Path]) -> Callable[[str], Path]:
    """Make a campaign of two rigs under a force, "paper" or "ehsan-scanlan", once; read only."""
    from scruton.simulate import write_campaign

    def make(force: str) -> Path:
        def write(folder: Path) -> None:
            truth, high, low = FORCES[force]
            rigs = (("heavy", 0.0065, high), ("light", 0.004, low))
            spec = TWO_RIGS + "".join(
                RIG.format(name=name, damping=damping, sd=0.02 * damping, amplitude=amplitude, truth=truth)
                for name, damping, amplitude in rigs
            )
            (folder / "spec.toml").write_text(spec, encoding="utf-8")
            write_campaign(folder / "spec.toml", folder / "campaign", seed=2)

        return once(f"two-{force}", write) / "campaign"

    return make


@pytest.fixture
def with_slip(small_campaign: Path, tmp_path: Path) -> Callable[..., Path]:
    """Copy the small campaign and make one slip in it.

    Texts of its campaign.toml are replaced pairwise; a record named `record` has its time and displacement [mm] changed
    by `change`, and its header replaced by `header`.
    """
    import shutil

    import numpy as np

    def make(*texts: str, record: str = "", change: Callable | None = None, header: str = "") -> Path:
        folder = shutil.copytree(small_campaign, tmp_path / "campaign")
        toml = (folder / "campaign.toml").read_text(encoding="utf-8")
        for old, new in zip(texts[::2], texts[1::2], strict=True):
            assert old in toml
            toml = toml.replace(old, new)
        (folder / "campaign.toml").write_text(toml, encoding="utf-8")
        if record:
            first = header or (folder / record).read_text(encoding="utf-8").splitlines()[0]
            time, response = np.loadtxt(folder / record, delimiter=",", skiprows=1).T
            changed = np.column_stack(change(time, response) if change else (time, response))
            np.savetxt(folder / record, changed, delimiter=",", header=first, comments="", fmt="%.8g")
        return folder

    return make
