"""What every kind of record shares: a campaign around one file, and whether it is read as it was written."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.random import Generator

from tests.fuzz.case import ACCEPTED, ANY, Case, Run
from tests.fuzz.damage import one, spoil_bytes

DEPTH = 0.075
PER_UNIT = {"m": 1.0, "mm": 1e3, "cm": 1e2}  # of a metre
PER_SECOND = {"s": 1.0, "ms": 1e3, "min": 1 / 60}
CHECK = ("check", "case")


@dataclass
class Written:
    """A record as it stands in its file, and as it must be read: seconds, and displacement over depth."""

    data: bytes
    time: np.ndarray
    response: np.ndarray
    table: dict[str, Any] = field(default_factory=dict)


def ring_down(rng: Generator) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and displacement [m]."""
    samples, rate = int(rng.integers(600, 1200)), float(one(rng, (50.0, 100.0, 128.0, 200.0)))
    time = np.arange(samples) / rate
    size, rate_of_decay = 10 ** rng.uniform(-3.5, -2), rng.uniform(0.05, 0.4)
    return time, size * np.exp(-rate_of_decay * time) * np.cos(2 * np.pi * 7.87 * time + rng.uniform(0, 6))


def lay(folder: Path, name: str, written: Written) -> None:
    """Write the record and a campaign of one rig around it."""
    place = folder / "case"
    place.mkdir(exist_ok=True)
    (place / name).write_bytes(written.data)
    record = {"file": name, "kind": "free-decay", **written.table}
    content = {
        "format": 1, "title": "One record", "section": {"motion": "heaving", "width": "0.3 m", "depth": f"{DEPTH} m"},
        "rigs": [{"name": "1#", "frequency": "7.87 Hz", "damping_ratio": 0.0065, "records": [record]}],
    }  # fmt: skip
    (place / "campaign.toml").write_text(tomli_w.dumps(content), encoding="utf-8")


def intact(kind: str, layout: str, folder: Path, name: str, written: Written) -> Case:
    """Make a case that must be accepted, and read as it was written."""
    lay(folder, name, written)
    return Case(f"{kind}: intact, {layout}", CHECK, ACCEPTED, (name, "records[0]"), demand=_as_written(written))


def spoiled(
    about: str, folder: Path, name: str, written: Written, allowed: frozenset[int] = ANY, says: tuple[str, ...] = ()
) -> Case:
    """Make a case that may be refused, with the name of its file."""
    lay(folder, name, written)
    return Case(about, CHECK, allowed, (name, "records[0]", *says))


def flipped(rng: Generator, about: str, folder: Path, name: str, written: Written) -> Case:
    """Spoil the bytes of a good record."""
    how, written.data = spoil_bytes(rng, written.data)
    return spoiled(f"{about}: bytes, {how}", folder, name, written)


def _as_written(written: Written) -> Callable[[Run], str]:
    def demand(run: Run) -> str:
        import scruton

        if run.code == 2:
            return ""  # said already
        record = scruton.load_campaign(run.folder / "case").rigs[0].records[0]
        for what, found, wanted in (
            ("time", record.time, written.time), ("response", record.response, written.response),
        ):  # fmt: skip
            if found.shape != wanted.shape:
                return f"intact record misread\n{what}: {found.shape} for {wanted.shape}"
            scale = np.abs(wanted).max()
            if not np.allclose(found, wanted, rtol=1e-9, atol=1e-9 * scale):
                return (
                    f"intact record misread\n{what}: up to {np.abs(found - wanted).max() / scale:g} of the largest off"
                )
        return ""

    return demand
