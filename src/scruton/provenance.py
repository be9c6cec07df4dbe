"""What a result was made from: the same block in every JSON, whoever writes it."""

import platform
from collections.abc import Mapping
from functools import cache
from hashlib import sha256 as _sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

PACKAGES = ("scruton", "numpy", "scipy", "emcee", "arviz", "numba")


def versions() -> dict[str, str]:
    """Versions of all that decides what numbers come out."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


@cache
def code_sha256() -> str:
    """SHA-256 of all modules of this package: its version stays the same while somebody works on it."""
    root = Path(__file__).parent
    modules = sorted(root.rglob("*.py"))
    parts = (part for path in modules for part in (path.relative_to(root).as_posix().encode(), path.read_bytes()))
    return _sha256(b"\0".join(parts)).hexdigest()


def provenance(
    command: str | None,
    *,
    seed: int,
    sha256: Mapping[str, str],
    settings: Mapping[str, Any],
    card: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Everything that is needed to make the same numbers again.

    Parameters
    ----------
    command : str or None
        What the user asked for; None for a call from Python.
    seed : int
        Of all randomness.
    sha256 : mapping of str to str
        SHA-256 of every file that was read, by the name that errors show.
    settings : mapping
        What else the numbers depend on, as it was resolved; as JSON can hold it.
    card : mapping, optional
        The model card: "name", "sha256", and its texts where they are kept.

    Returns
    -------
    dict
        "command", "versions", "seed", "sha256", "card" and "settings".
    """
    return {
        "command": command,
        "versions": versions(),
        "seed": seed,
        "sha256": dict(sha256),
        "card": None if card is None else dict(card),
        "settings": dict(settings),
    }
