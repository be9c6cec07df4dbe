"""Checkpoints: one file per sampled posterior, written after every chunk in one atomic step.

A run that was killed resumes from the last chunk and gives, bit for bit, what the uninterrupted run gives, because
both go through the same chunks: a chunk depends only on the walkers' positions and the generator's state at its start.
"""

import json
import os
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from scruton.errors import InputError


@dataclass(frozen=True)
class Checkpoint:
    """Where one posterior's chunks are kept, and the fingerprint of everything that determines them."""

    path: Path
    fingerprint: str

    def save(self, arrays: dict[str, Any]) -> None:
        """Write atomically: a reader sees the old file or the new one, never a part."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self.path.with_suffix(".tmp")
        with temporary.open("wb") as stream:
            np.savez(stream, fingerprint=np.array(self.fingerprint), **arrays)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, self.path)  # noqa: PTH105 - the atomic one, by its own name

    def load(self) -> dict[str, Any] | None:
        """Read what was saved, None if nothing was.

        Raises
        ------
        InputError
            If it is damaged, or belongs to another run: other data, card, seed or version.
        """
        if not self.path.is_file():
            return None
        wanted = "the same inputs as in the interrupted run, or --force to start again"
        try:
            with np.load(self.path, allow_pickle=False) as stored:
                arrays = {key: stored[key] for key in stored.files}
            fingerprint = str(arrays.pop("fingerprint"))
        except (OSError, ValueError, KeyError, EOFError, BadZipFile, zlib.error) as error:
            raise InputError(self.path, "", f"a damaged checkpoint ({error})", wanted) from error
        if fingerprint != self.fingerprint:
            found = "a checkpoint of other data, another model card, seed or version"
            raise InputError(self.path, "", found, wanted)
        return arrays


def pack_random_state(state: tuple[Any, ...]) -> str:
    """Turn the state tuple of a numpy RandomState into text that survives a file unchanged."""
    name, keys, position, has_gauss, cached = state
    return json.dumps([name, keys.tolist(), int(position), int(has_gauss), float(cached).hex()])


def unpack_random_state(text: str) -> tuple[Any, ...]:
    """Turn the text of `pack_random_state` back into a state tuple."""
    name, keys, position, has_gauss, cached = json.loads(text)
    return name, np.array(keys, dtype=np.uint32), position, has_gauss, float.fromhex(cached)
