"""Ways to spoil things: bytes, values, tables, JSON."""

import copy
import datetime
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.random import Generator

Place = tuple[Any, ...]
HUGE = 10**400
LONG = "x" * 5000
ESCAPE = "a\x1b[31mred\x1b[0m"


def deep(depth: int) -> list[Any]:
    """Nest lists."""
    found: list[Any] = []
    for _ in range(depth):
        found = [found]
    return found


STRANGE: tuple[Any, ...] = (
    0, -1, 1, 2, 0.5, -0.0, float("nan"), float("inf"), float("-inf"), 1e300, -1e300, 1e-300, 5e-324, HUGE, -HUGE,
    2**63, True, False, "", " ", "nan", "inf", "1e400", "-1", "0x10", "1_000", "1,5", "漢字 ξ", ESCAPE, "\0", "\x9b31m",
    "a\nb", "\u202eabc", "../../../etc/passwd", "/dev/null", ".", LONG, "%s %d {0}", [], {}, [[]], [1, "a"], [{}],
    {"a": {}}, {"mean": 1.0}, {"mean": "1 m", "sd": "nan m"}, {"mean": {}, "sd": []}, list(range(5000)), [{}] * 2000,
    deep(60), datetime.date(2024, 2, 29), datetime.time(12, 30),
    datetime.datetime(2024, 2, 29, 12, 30, tzinfo=datetime.UTC),
)  # fmt: skip
UNITS = (
    "", "m", "km", "year", "1/year", "km/year", "kg", "kg/m^2", "Hz", "rad", "deg", "degC", "delta_degC", "degF", "%",
    "ppm", "dB", "m m m", "m**", "**", "m**1e9", "m^9^9^9", "m**-1", "m/0", "m/(0*m)", "((((", "()", "1e9 m", "1e308 m",
    "1e400 m", "light_year", "planck_length", "furlong", "µm", "μm", "Å", "m²", "kg·m²/m", "°", "m;", "lambda", "None",
    "__import__('os')", "c", "dimensionless", "bit", "mol", "USD", ESCAPE, "\0", "漢", "m" * 3000, "m*" * 500 + "m",
    "m +/- 1 m",
)  # fmt: skip


def one[T](rng: Generator, several: "tuple[T, ...] | list[T]") -> T:
    """Choose one."""
    return several[int(rng.integers(len(several)))]


def spoil_bytes(rng: Generator, data: bytes) -> tuple[str, bytes]:
    """Flip, cut, double, insert or overwrite."""
    how = one(rng, ("flip", "flips", "cut", "cut head", "insert", "remove", "double", "zeros", "ones", "swap"))
    size = max(len(data), 1)
    at = int(rng.integers(size))
    length = int(min(size - at, 2 ** rng.integers(1, 12)))
    changed = bytearray(data)
    if how in ("flip", "flips"):
        for _ in range(1 if how == "flip" else int(rng.integers(2, 60))):
            if changed:
                changed[int(rng.integers(len(changed)))] ^= 1 << int(rng.integers(8))
    elif how == "cut":
        del changed[at:]
    elif how == "cut head":
        del changed[:at]
    elif how == "insert":
        changed[at:at] = rng.bytes(length)
    elif how == "remove":
        del changed[at : at + length]
    elif how == "double":
        changed[at:at] = changed[at : at + length]
    elif how == "zeros":
        changed[at : at + length] = bytes(length)
    elif how == "ones":
        changed[at : at + length] = b"\xff" * length
    else:
        there = int(rng.integers(size))
        changed[at : at + length], changed[there : there + length] = (
            changed[there : there + length], changed[at : at + length],
        )  # fmt: skip
    return how, bytes(changed)


def places(value: Any, at: Place = ()) -> Iterator[Place]:
    """Every place in nested tables and lists, the whole first."""
    yield at
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in items:
        yield from places(child, (*at, key))


def get(value: Any, place: Place) -> Any:
    """What stands at a place."""
    for key in place:
        value = value[key]
    return value


def put(value: Any, place: Place, new: Any) -> Any:
    """Copy with another value at a place."""
    if not place:
        return new
    found = copy.deepcopy(value)
    get(found, place[:-1])[place[-1]] = copy.deepcopy(new)
    return found


def leaves(value: Any) -> list[Place]:
    """Places that hold no table and no list."""
    return [one for one in places(value) if not isinstance(get(value, one), dict | list)]


def spell(place: Place) -> str:
    """Name a place as an error message does: tests[0].records[1].file."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).lstrip(".") or "the whole"


def spoil_tree(rng: Generator, value: Any) -> tuple[str, Any]:
    """Drop, rename, double, retype, nest or move something in nested tables and lists."""
    place = one(rng, [one for one in places(value) if one])
    parent, key = place[:-1], place[-1]
    found = copy.deepcopy(value)
    holder = get(found, parent)
    how = one(
        rng, ("drop", "rename", "retype", "retype", "nest in a list", "nest in a table", "unnest", "move", "many")
    )
    if how == "drop":
        del holder[key]
    elif how == "rename" and isinstance(holder, dict):
        word = str(key)
        wrong = one(
            rng, (word.upper(), word[:-1], word + "s", word[::-1], "", "漢字", ESCAPE, LONG, word + " ", "__class__")
        )
        holder[wrong] = holder.pop(key)
    elif how == "nest in a list":
        holder[key] = [holder[key]]
    elif how == "nest in a table":
        holder[key] = {str(key): holder[key]}
    elif how == "unnest" and isinstance(holder[key], dict):
        inner = holder.pop(key) if isinstance(holder, dict) else holder[key]
        if isinstance(holder, dict):
            holder.update(inner)
    elif how == "move":
        other = get(found, one(rng, [one for one in places(found) if isinstance(get(found, one), dict)]))
        other[str(key)] = copy.deepcopy(holder[key])
    elif how == "many" and isinstance(holder[key], list):
        holder[key] = holder[key] * int(rng.integers(2, 40))
    else:
        how, holder[key] = "retype", copy.deepcopy(one(rng, STRANGE))
    return f"{how} {spell(place)}", found


def noise(rng: Generator, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and a ring-down [m] of about that many samples, at random rate and size."""
    rate = float(one(rng, (50.0, 100.0, 128.0, 200.0, 500.0)))
    time = np.arange(samples) / rate
    size, decay = 10 ** rng.uniform(-4, -2), rng.uniform(0.05, 0.4)
    return time, size * np.exp(-decay * time) * np.cos(2 * np.pi * 7.87 * time + rng.uniform(0, 6))
