"""What a result was made from: the same block in every JSON, whoever writes it."""

import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

PACKAGES = ("scruton", "numpy", "scipy", "emcee", "arviz", "numba")


def versions() -> dict[str, str]:
    """Versions of all that decides what numbers come out."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


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
