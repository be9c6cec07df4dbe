"""CSV in the dialects of laboratories, and what goes wrong with it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.fuzz.case import ANY, REFUSED, Case
from tests.fuzz.damage import ESCAPE, one
from tests.fuzz.kinds.records import DEPTH, PER_SECOND, PER_UNIT, Written, flipped, intact, ring_down, spoiled
from tests.fuzz.stock import Stock

NAME = "record.csv"


def make(rng: Generator, number: int, folder: Path, _: Stock) -> Case:
    """One third intact in a random dialect, one third damaged in a known way, one third spoiled bytes."""
    if number % 3 == 0:
        written, about = dialect(rng)
        return intact("CSV", about, folder, NAME, written)
    if number % 3 == 1:
        about, change, allowed = SPOILED[number // 3 % len(SPOILED)]
        written = plain(rng)
        written.data = change(written.data, rng)
        return spoiled(f"CSV: {about}", folder, NAME, written, allowed)
    return flipped(rng, "CSV", folder, NAME, dialect(rng)[0])


def plain(rng: Generator) -> Written:
    """Spell time and displacement as FORMAT.md does."""
    time, displacement = ring_down(rng)
    rows = "".join(f"{t:.6f},{y:.9f}\n" for t, y in zip(time.tolist(), displacement.tolist(), strict=True))
    return Written(f"time [s],displacement [m]\n{rows}".encode(), time, displacement / DEPTH)


def dialect(rng: Generator) -> tuple[Written, str]:
    """Spell a record in a random valid dialect."""
    time, displacement = ring_down(rng)
    decimal = one(rng, (".", ".", ","))
    delimiter = one(rng, (",", ";", "\t", " ", "|")) if decimal == "." else one(rng, (";", "\t", " ", "|"))
    length, clock = one(rng, tuple(PER_UNIT)), one(rng, tuple(PER_SECOND))
    digits = one(rng, ("{:.10f}", "{:.10e}", "{!r}", "{:+.12g}"))
    timed, extra, header = rng.random() < 0.7, rng.random() < 0.4, rng.random() < 0.8
    columns = [time * PER_SECOND[clock]] if timed else []
    columns += [displacement * PER_UNIT[length]]
    columns += [np.sin(time)] if extra else []
    cells = [[digits.format(value) for value in column.tolist()] for column in columns]
    values = [np.array([float(cell) for cell in column]) for column in cells]
    rows = [delimiter.join(row).replace(".", decimal) for row in zip(*cells, strict=True)]
    table: dict[str, object] = {}
    spelled = one(rng, ("{} [{}]", "{} ({})", "{}  [{}]"))
    names = [*(["time"] if timed else []), "displacement", *(["idle"] if extra else [])]
    units = [*([clock] if timed else []), length, *(["V"] if extra else [])]
    lines = []
    if header:
        quote = '"' if rng.random() < 0.3 and delimiter != " " else ""
        words = [
            quote + spelled.format(one(rng, (n, n.upper(), n.title())), u) + quote
            for n, u in zip(names, units, strict=True)
        ]
        lines = [delimiter.join(words)]
    else:
        table["columns"] = {name: i for i, name in enumerate(names) if name != "idle"}
        table["units"] = {name: unit for name, unit in zip(names, units, strict=True) if name != "idle"}
    if skip := int(rng.integers(4)) if rng.random() < 0.3 else 0:
        lines = [one(rng, ("Laboratory", "# a comment", "Date: 2024-02-29", "1;2,3 x")) for _ in range(skip)] + lines
    if delimiter != (";" if decimal == "," else ","):
        table["delimiter"] = delimiter
    if decimal == ",":
        table["decimal"] = ","
    encoding = one(rng, ("utf-8", "utf-8", "utf-8-sig", "latin-1", "gbk", "utf-16"))
    if not encoding.startswith("utf-8"):
        table["encoding"] = encoding
    if not timed:
        rate = 1.0 / (time[1] - time[0])
        table["sample_rate"] = f"{rate:.12g} Hz"
    end = one(rng, ("\n", "\r\n", "\n\n"))
    if skip:
        table["skip_rows"] = skip * end.count("\n")
    text = end.join([*lines, *rows]) + (end if rng.random() < 0.8 else "")
    seconds = values[0] / PER_SECOND[clock] if timed else time
    units_used = f"{length} {clock if timed else 'rate'} {spelled if header else ''}"
    about = f"{delimiter!r} {decimal!r} {encoding} {end!r} {units_used}"
    return Written(text.encode(encoding), seconds, values[int(timed)] / PER_UNIT[length] / DEPTH, table), about


def _row(data: bytes, rng: Generator, change: Callable[[list[bytes]], list[bytes]]) -> bytes:
    """Change the cells of one row."""
    lines = data.split(b"\n")
    at = int(rng.integers(1, len(lines) - 1))
    lines[at] = b",".join(change(lines[at].split(b",")))
    return b"\n".join(lines)


def _cell(text: bytes) -> Callable[[bytes, Generator], bytes]:
    return lambda data, rng: _row(data, rng, lambda cells: [cells[0], text])


def _column(index: int, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[bytes, Generator], bytes]:
    """Change all numbers of a column."""

    def spoil(data: bytes, _: Generator) -> bytes:
        header, *rows = data.decode().splitlines()
        values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
        values[:, index] = change(values[:, index])
        return "\n".join([header, *(f"{t!r},{y!r}" for t, y in values.tolist())]).encode()

    return spoil


def _header(text: str) -> Callable[[bytes, Generator], bytes]:
    return lambda data, _: text.encode() + b"\n" + data.split(b"\n", 1)[1]


Spoiled = tuple[str, Callable[[bytes, Generator], bytes], frozenset[int]]
SPOILED: tuple[Spoiled, ...] = (
    ("text in a cell", _cell(b"broken"), REFUSED),
    ("nan in a cell", _cell(b"nan"), REFUSED),
    ("inf in a cell", _cell(b"inf"), REFUSED),
    ("an empty cell", _cell(b""), REFUSED),
    ("ESC in a cell", _cell(ESCAPE.encode()), REFUSED),
    ("NUL in a cell", _cell(b"\0"), REFUSED),
    ("1e400 in a cell", _cell(b"1e400"), REFUSED),
    ("1e300 in a cell", _cell(b"1e300"), ANY),
    ("a date in a cell", _cell(b"2024-02-29"), REFUSED),
    ("a boolean in a cell", _cell(b"true"), REFUSED),
    ("thousands in a cell", _cell(b'"1,234.5"'), ANY),
    ("hexadecimal in a cell", _cell(b"0x1p-3"), REFUSED),
    ("full-width digits in a cell", _cell("１２".encode()), ANY),
    ("a row too long", lambda d, r: _row(d, r, lambda cells: [*cells, b"7"]), REFUSED),
    ("a row too short", lambda d, r: _row(d, r, lambda cells: cells[:1]), REFUSED),
    ("a quote that does not end", lambda d, r: _row(d, r, lambda cells: [cells[0], b'"' + cells[1]]), ANY),
    ("a constant signal", _column(1, np.zeros_like), REFUSED),
    ("all values 1e308", _column(1, lambda y: 1e308 * np.sign(y)), ANY),
    ("all values 1e-320", _column(1, lambda y: 1e-320 * np.sign(y)), ANY),
    ("time that goes back", _column(0, lambda t: t[::-1].copy()), REFUSED),
    ("time twice", _column(0, lambda t: np.repeat(t[::2], 2)[: t.size]), REFUSED),
    ("time that stands still", _column(0, np.zeros_like), REFUSED),
    ("time in steps of 1e-300", _column(0, lambda t: t * 1e-300), ANY),
    ("time at 1e300", _column(0, lambda t: t * 1e300), ANY),
    ("negative time", _column(0, lambda t: t - 1e6), ANY),
    ("a gap of a year", _column(0, lambda t: np.where(np.arange(t.size) > t.size // 2, t + 3e7, t)), ANY),
    ("random time steps", _column(0, lambda t: np.cumsum(np.random.default_rng(0).exponential(0.01, t.size))), ANY),
    ("white noise", _column(1, lambda y: np.random.default_rng(0).normal(size=y.size)), ANY),
    ("an impulse", _column(1, lambda y: np.where(np.arange(y.size) == 50, 1.0, 0.0)), ANY),
    ("a step", _column(1, lambda y: np.where(np.arange(y.size) > 50, 1.0, 0.0)), ANY),
    ("a ramp", _column(1, lambda y: np.arange(float(y.size))), ANY),
    ("a header of one word", _header("displacement"), REFUSED),
    ("no unit in the header", _header("time,displacement"), REFUSED),
    ("a wrong unit", _header("time [s],displacement [kg]"), REFUSED),
    ("an unknown unit", _header("time [s],displacement [furlongs^^2]"), REFUSED),
    ("a unit with ESC", _header(f"time [s],displacement [{ESCAPE}]"), REFUSED),
    ("a year of time", _header("time [year],displacement [m]"), ANY),
    ("two displacements", _header("displacement [m],displacement [m]"), REFUSED),
    ("an unbalanced header", _header("time [s],displacement [m"), REFUSED),
    ("one header line of 20 MB", _header("time [s],displacement [m]" + "x" * 20_000_000), ANY),
    ("a header alone", lambda d, _: d.split(b"\n", 1)[0] + b"\n", REFUSED),
    ("one row", lambda d, _: b"\n".join(d.split(b"\n")[:2]), REFUSED),
    ("four rows", lambda d, _: b"\n".join(d.split(b"\n")[:5]), REFUSED),
    ("five rows", lambda d, _: b"\n".join(d.split(b"\n")[:6]), ANY),
    ("empty", lambda _d, _r: b"", REFUSED),
    ("white space alone", lambda _d, _r: b" \n\n \n", REFUSED),
    ("binary", lambda _d, r: r.bytes(20_000), REFUSED),
    ("NUL bytes", lambda _d, _r: bytes(20_000), REFUSED),
    ("one column", lambda d, _: b"\n".join(line.split(b",")[0] for line in d.split(b"\n")), REFUSED),
    ("3,000 columns", lambda d, _: b"\n".join(line + b",1" * 3000 for line in d.split(b"\n")[:60] if line), ANY),
    ("another delimiter", lambda d, _: d.replace(b",", b";"), REFUSED),
    ("decimal commas", lambda d, _: d.replace(b",", b";").replace(b".", b","), REFUSED),
    ("UTF-16 without saying so", lambda d, _: d.decode().encode("utf-16"), REFUSED),
    ("an HTML page", lambda _d, _r: b"<!DOCTYPE html><html><body>404</body></html>\n" * 30, REFUSED),
    ("a ZIP", lambda d, _: b"PK\x03\x04" + d, REFUSED),
    ("a line of 20 MB", lambda d, _: d + b"1" * 20_000_000 + b"\n", REFUSED),
)  # fmt: skip
