"""Frozen dataclasses back from JSON: the way there is `scruton.documents.as_json`."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from scruton.arrays import BoolArray, FloatArray


def from_json(kind: Any, content: Any) -> Any:
    """The result of a kind that `as_json` gave this content; a number that is null comes back as NaN.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the content is not that of such a result.
    """
    origin, parts = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        make: Callable[..., Any] = kind  # type: ignore[assignment]
        hints, found = get_type_hints(kind), {}
        for field in fields(kind):
            if field.default is not None:
                found[field.name] = from_json(hints[field.name], content[field.name])
            elif field.name in content:  # it has a value, if only one that JSON cannot say
                found[field.name] = from_json(_stated(hints[field.name]), content[field.name])
        return make(**found)
    if origin in (UnionType, Union):
        return None if content is None else from_json(_stated(kind), content)
    if kind in (FloatArray, BoolArray):
        return np.array(content, dtype=float if kind == FloatArray else bool)
    if origin is tuple:
        each = [parts[0]] * len(content) if parts[-1] is Ellipsis else parts
        return tuple(from_json(part, own) for part, own in zip(each, content, strict=True))
    if origin is not None and issubclass(origin, Mapping):
        return {key: from_json(parts[1], own) for key, own in content.items()}
    if isinstance(kind, type) and issubclass(kind, Enum | Path):
        return kind(content)
    return np.nan if kind is float and content is None else content


def _stated(kind: Any) -> Any:
    """A kind without its None."""
    return next(part for part in get_args(kind) if part is not type(None)) if type(None) in get_args(kind) else kind
