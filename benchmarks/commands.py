"""Whole commands on the shipped example, as a user runs them: processor seconds of one core, and peak memory."""

import tempfile
from pathlib import Path

from benchmarks import large
from benchmarks.result import Figure

CAMPAIGN = Path("examples/rectangle-4to1")
MOST_MEMORY = 500.0  # MB
REPEATS = 2  # the better one counts: a busy machine only adds


def spent(*arguments: object) -> tuple[float, float]:
    """Processor seconds, user and system, and peak memory [MB] of one command, its children included."""
    cost = large.run(*arguments)
    if cost.code not in (0, 1):
        raise SystemExit(f"scruton {' '.join(map(str, arguments))} ended with {cost.code}")
    return cost.processor, cost.memory


def run() -> list[Figure]:
    with tempfile.TemporaryDirectory() as name:
        out = Path(name)
        fit, bridge = out / "fit", CAMPAIGN / "bridge.toml"
        spent("fit", CAMPAIGN, "-o", fit, "--quiet")  # what is compiled at the first run is compiled now
        commands: list[tuple[str, float | None, tuple[object, ...]]] = [
            ("check", 0.8, ("check", CAMPAIGN)),
            ("fit", 8.0, ("fit", CAMPAIGN, "-o", out / "again", "--jobs", 1, "--quiet", "--force")),
            ("predict", 1.0, ("predict", fit, "--sc", 30)),
            ("criticise", 6.0, ("criticise", fit, "-o", out / "criticism", "--quiet", "--force")),
            ("diagnose", 7.0, ("diagnose", CAMPAIGN, "-o", out / "gap", "--jobs", 1, "--quiet", "--force")),
            ("size, two modes", 7.0, ("size", fit, "--bridge", bridge, "-o", out / "size", "--quiet", "--force")),
            (
                "report, all of it",
                30.0,
                ("report", CAMPAIGN, "--bridge", bridge, "-o", out / "report", "--jobs", 1, "--quiet", "--force"),
            ),
            (
                "calibrate, 40 campaigns of turbulence-1",
                None,
                ("calibrate", "-o", out / "c", "--campaigns", 40, "--regimes", "turbulence-1", "--jobs", 1, "--force"),
            ),
        ]
        figures = []
        for title, limit, arguments in commands:
            times, memory = zip(*(spent(*arguments) for _ in range(REPEATS if limit else 1)), strict=True)
            figures.append(Figure(title, min(times), "s", limit))
            figures.append(Figure(f"{title}: peak memory", max(memory), "MB", MOST_MEMORY))
        return figures
