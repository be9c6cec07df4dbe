"""The parts of what is frozen, by name: how each is computed, and to what it is compared."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tests.goldens import campaigns, errors, filters, others
from tests.goldens.capture import CAMPAIGNS, Room
from tests.goldens.leaves import DIGITS, kept


@dataclass(frozen=True)
class Part:
    """One golden file; what is `drawn` is compared by its form alone where the machine's arithmetic is another."""

    compute: Callable[[Room], dict[str, Any]]
    rtol: float = 1e-6
    atol: float = 1e-12  # below what any quantity here means
    digits: int = DIGITS
    drawn: bool = True


PARTS: dict[str, Part] = {
    "texts": Part(others.texts, drawn=False),
    "check": Part(campaigns.check, drawn=False),
    "errors": Part(errors.of_input, drawn=False),
    "errors-results": Part(errors.of_results),
    "filters": Part(filters.filters, rtol=1e-8, digits=14, drawn=False),
    "schema": Part(others.schema),
    "small": Part(others.small),
    "effect": Part(others.effect),
    "batch": Part(others.batch),
    "calibrate": Part(others.calibrate),
    "challenge": Part(others.challenge),
    "report": Part(partial(campaigns.report, name="closed-box-torsional")),
    **{f"fit-{name}": Part(partial(campaigns.fit, name=name)) for name in CAMPAIGNS},
    **{f"validate-{name}": Part(partial(campaigns.validate, name=name)) for name in CAMPAIGNS},
    **{f"diagnose-{name}": Part(partial(campaigns.diagnose, name=name)) for name in CAMPAIGNS},
}
# What costs seconds and belongs into every run of the tests.
FAST = ("texts", "check", "errors", "filters", "schema")


def compute(name: str) -> Any:
    """Compute a part in a room of its own."""
    part = PARTS[name]
    with tempfile.TemporaryDirectory(prefix="goldens-") as folder:
        return kept(part.compute(Room(Path(folder).resolve())), part.digits)


def golden(name: str) -> Path:
    """Return the file of a part."""
    return Path(__file__).with_name(f"{name}.json")


def arithmetic_of_goldens() -> Path:
    """Return the file that tells on what arithmetic they were written."""
    return Path(__file__).with_name("arithmetic.txt")
