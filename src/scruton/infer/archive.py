"""Frozen dataclasses as data and back: a JSON text, and all numbers of their arrays end to end.

So a campaign and its resolved model card stand beside the draws that were made of them, and nobody has to read a text
that was written for people.
"""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray


def pack(folder: Path, **values: Any) -> tuple[str, FloatArray]:
    """Turn dataclasses, by name, into a JSON text and the numbers that it refers to.

    Their fields may be numbers, texts, enumerations, paths, float arrays, tuples, mappings and dataclasses again. Paths
    are kept as they lie from `folder`: where that stood on some machine is nobody's business, and no result depends
    on it.
    """
    arrays: list[FloatArray] = []
    start = 0

    def plain(value: Any) -> Any:
        nonlocal start
        if is_dataclass(value) and not isinstance(value, type):
            return {one.name: plain(getattr(value, one.name)) for one in fields(value) if one.init}
        if isinstance(value, np.ndarray):
            arrays.append(np.asarray(value, dtype=np.float64).reshape(-1))
            start += value.size
            return {"start": start - value.size, "shape": list(value.shape)}
        if isinstance(value, Enum):
            return value.value
        if isinstance(value, Path):
            return Path(os.path.relpath(value, folder)).as_posix()
        if isinstance(value, Mapping):
            return {str(key): plain(one) for key, one in value.items()}
        if isinstance(value, str | bool | int | NoneType):
            return value
        return [plain(one) for one in value] if isinstance(value, Sequence) else float(value)

    text = json.dumps(plain(values), ensure_ascii=False)
    return text, np.concatenate([np.empty(0), *arrays])


def unpack(document: str, numbers: FloatArray, **kinds: type) -> dict[str, Any]:
    """Read back what `pack` made: the values called as the keywords are, of their types.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the document holds no such values.
    """
    content = json.loads(document)

    def read(kind: Any, value: Any) -> Any:
        origin, arguments = get_origin(kind), get_args(kind)
        if NoneType in arguments:
            (kind,) = (one for one in arguments if one is not NoneType)
            return None if value is None else read(kind, value)
        if origin in (np.ndarray, NDArray):  # an alias of its own from numpy 2.5 on
            size = int(np.prod(value["shape"]))
            return numbers[value["start"] : value["start"] + size].reshape(value["shape"])
        if origin is tuple:
            each = [arguments[0]] * len(value) if arguments[-1] is ... else arguments
            return tuple(read(one, item) for one, item in zip(each, value, strict=True))
        if origin is not None and issubclass(origin, Mapping):
            return {read(arguments[0], key): read(arguments[1], one) for key, one in value.items()}
        if isinstance(kind, type) and is_dataclass(kind):
            hints = get_type_hints(kind)
            return kind(**{name: read(hints[name], one) for name, one in value.items()})
        return kind(value)

    return {name: read(kind, content[name]) for name, kind in kinds.items()}
