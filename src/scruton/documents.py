"""JSON that the program writes and reads back: written in one step, and with a checksum of its own content.

A bit that flipped, a number that was edited, a field that went missing: reading says so instead of computing with it.
"""

import contextlib
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import sha256
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from scruton.errors import InputError

CHECKSUM = "checksum"  # of everything else in the document


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """The content with its checksum."""
    plain: dict[str, Any] = json.loads(json.dumps({key: value for key, value in content.items() if key != CHECKSUM}))
    return plain | {CHECKSUM: _checksum(plain)}


def write_document(path: Path, content: Mapping[str, Any]) -> None:
    """Write JSON with its checksum, in one atomic step."""
    write_text(path, json.dumps(sealed(content), indent=1, ensure_ascii=False) + "\n")


def read_document(path: Path, wanted: str, fields: Sequence[str] = (), *, version: int | None = None) -> dict[str, Any]:
    """Read what `write_document` wrote.

    Parameters
    ----------
    path : Path
    wanted : str
        What the file should be, for the error.
    fields : sequence of str
        That it must have.
    version : int, optional
        Its "format".

    Raises
    ------
    InputError
        If it cannot be read, is of another version, lacks a field, or is not as it was written.
    """
    content = read_json(path, wanted)
    if version is not None and content.get("format", version) != version:
        raise InputError(path, "format", repr(content["format"]), f"{version}, the one that this version reads")
    for name in (*fields, CHECKSUM):
        if name not in content:
            raise InputError(path, name, "nothing", wanted)
    if content[CHECKSUM] != _checksum(content):
        raise InputError(path, CHECKSUM, "a checksum that is not that of the content: damaged, or edited", wanted)
    return content


def read_json(path: Path, wanted: str = "a JSON object") -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    InputError
        If it cannot be read, or is none; `wanted` says what the file should be.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(path, "", f"no valid JSON ({error})", wanted) from error
    if not isinstance(content, dict):
        raise InputError(path, "", f"JSON that is a {type(content).__name__}", wanted)
    return content


def as_json(value: Any) -> Any:
    """What a JSON document holds of a result.

    Dataclasses become objects, their fields in order; a field that stands at its default of None is left out.  Arrays
    and tuples become lists, numpy's numbers Python's, and numbers that are not finite null.
    """
    if is_dataclass(value):
        shown = ((field, getattr(value, field.name)) for field in fields(value))
        return {field.name: as_json(part) for field, part in shown if part is not None or field.default is not None}
    if hasattr(value, "tolist"):  # numpy's, which need not be loaded for that
        return as_json(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): as_json(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def from_json(kind: Any, content: Any) -> Any:
    """The result of a kind that `as_json` gave this content; a number that is null comes back as NaN.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the content is not that of such a result.
    """
    import numpy as np

    from scruton.arrays import BoolArray, FloatArray

    origin, parts = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        make: Callable[..., Any] = kind  # type: ignore[assignment]
        hints, values = get_type_hints(kind), {}
        for field in fields(kind):
            if field.default is not None:
                values[field.name] = from_json(hints[field.name], content[field.name])
            elif field.name in content:  # it has a value, if only one that JSON cannot say
                values[field.name] = from_json(_stated(hints[field.name]), content[field.name])
        return make(**values)
    if origin in (UnionType, Union):
        return None if content is None else from_json(_stated(kind), content)
    if kind in (FloatArray, BoolArray):
        return np.array(content, dtype=float if kind == FloatArray else bool)
    if origin is tuple:
        each = [parts[0]] * len(content) if parts[-1] is Ellipsis else parts
        return tuple(from_json(part, entry) for part, entry in zip(each, content, strict=True))
    if origin is not None and issubclass(origin, Mapping):
        return {key: from_json(parts[1], entry) for key, entry in content.items()}
    if isinstance(kind, type) and issubclass(kind, Enum | Path):
        return kind(content)
    return np.nan if kind is float and content is None else content


def _stated(kind: Any) -> Any:
    """A kind without its None."""
    return next(part for part in get_args(kind) if part is not type(None)) if type(None) in get_args(kind) else kind


def write_text(path: Path, text: str) -> None:
    """Write a file in one atomic step: a reader sees the old one or the new one, never a part."""
    # a byte of a command line or of a name that is no UTF-8 is a lone surrogate here, which JSON escapes, too
    write_bytes(path, text.encode(errors="backslashreplace"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file in one atomic step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    with written_to(path, temporary):
        with temporary.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        replace_file(temporary, path)


@contextlib.contextmanager
def written_to(path: Path, temporary: Path) -> Iterator[None]:
    """Where writing fails, leave no half of a file, and let the error name the place: that of a full disk does not."""
    try:
        yield
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if error.filename is None:
            error.filename = str(path)
        raise


def replace_file(source: Path, place: Path) -> None:
    """Move a file to a place on the same disk in one atomic step, over what lies there."""
    os.replace(source, place)  # noqa: PTH105 - the atomic one, by its own name


def _checksum(content: Mapping[str, Any]) -> str:
    rest = {key: value for key, value in content.items() if key != CHECKSUM}
    return sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def found_beside(folder: Path, beside: str, name: str) -> Path | None:
    """A result in the folder of the fit, or in the one beside it that its own verb writes."""
    return next((path for path in (folder / name, folder / beside / name) if path.is_file()), None)
