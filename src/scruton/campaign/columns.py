"""Which column of a file holds which quantity, and how the file is laid out, as a record's table says."""

import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from scruton.campaign.files import Files
from scruton.campaign.readers import Column, Container, CsvDialect, is_delimited, read_columns
from scruton.campaign.spelling import folded, show
from scruton.campaign.toml import Field, Table, valid, whole
from scruton.errors import InputError

TEXT_KEYS = ("columns", "skip_rows", "delimiter", "decimal", "encoding")
_DELIMITERS = 'one character: ",", ";", "\\t", or " " for any white space'
EXAMPLES = {  # of headers
    "time": "time [s]",
    "displacement": "displacement [m]",
    "rotation": "rotation [rad]",
    "acceleration": "acceleration [m/s^2]",
    "angular_acceleration": "angular acceleration [rad/s^2]",
    "amplitude": "amplitude [mm]",
    "wind_speed": "wind speed [m/s]",
    "reduced_velocity": "reduced velocity",
}
# What is taken by its own name only where nothing else is there: a file may hold the displacement beside it.
_LAST = ("acceleration", "angular_acceleration")
_SPELLINGS = {"amplitude": ("amplitude", "A/D")}


def file_path(table: Table, folder: Path) -> Path:
    """Path of the file that a table names (InputError if it names none)."""
    return folder / table.text("file", 'the name of a file, such as file = "decay.csv"')


def open_table(table: Table, files: Files) -> tuple[Path, Container]:
    """Open the file that a table names (InputError for the file, or for dialect keys that do not go with its type)."""
    path = file_path(table, files.folder)
    wrong, right = (("variables",), "columns") if is_delimited(path) else (TEXT_KEYS, "variables")
    for key in wrong:
        if key in table:
            raise table.error(key, f'a key that does not go with a file of type "{path.suffix}"', f'"{right}", perhaps')
    dialect = CsvDialect(**{key: field.read(table, key) for key, field in _DIALECT.items()})
    if dialect.delimiter == dialect.decimal:
        raise table.error("delimiter", show(dialect.delimiter), "a sign other than the decimal one")
    return path, files.open(path, dialect)


def chosen_columns(table: Table, path: Path, container: Container, wanted: Mapping[str, bool]) -> dict[str, Column]:
    """Read the columns that hold the wanted quantities, by quantity; InputError where one is unknown or missing.

    What is `wanted` are quantities, alternatives parted by a bar ("displacement|amplitude"), and whether one must be
    there.  What the table's `columns` or `variables` do not state goes by its own name in the file.
    """
    known = [quantity for group in wanted for quantity in group.split("|")]
    positions = is_delimited(path)
    key = "columns" if positions else "variables"
    table.table("units").check_keys(known)
    names_of = table.table(key)
    stated: dict[str, str | int] = {}
    names_of.check_keys(known)
    for quantity, value in names_of.values.items():
        position = positions and isinstance(value, int) and not isinstance(value, bool)
        if not position and not (isinstance(value, str) and value):
            say = "the name of a column, or its position counted from 0" if positions else "the path of a variable"
            raise names_of.error(quantity, show(value), say)
        stated[quantity] = value
    there = container.names
    have = {folded(name): name for name in there}
    names: dict[str, str | int] = {}
    for group, needed in wanted.items():
        quantities = group.split("|")
        matches = {quantity: stated[quantity] for quantity in quantities if quantity in stated} or {
            quantity: have[folded(spelling)]
            for quantity in quantities
            for spelling in _SPELLINGS.get(quantity, (quantity,))
            if folded(spelling) in have
        }
        if len(matches) > 1 and not stated.keys() & matches.keys():
            matches = {quantity: name for quantity, name in matches.items() if quantity not in _LAST} or matches
        if len(matches) > 1:
            say = f'one of the two; say which in the table: {key} = {{ {quantities[0]} = "{matches[quantities[0]]}" }}'
            raise InputError(path, "", f"both {' and '.join(matches)}", say)
        if needed and not matches:
            raise _missing(path, key, quantities, there)
        names |= matches
    return dict(zip(names, read_columns(container, list(names.values())), strict=True))


def _missing(path: Path, key: str, quantities: list[str], there: Sequence[str]) -> InputError:
    if key == "columns" and not there:
        return InputError(
            path, "header", "no header line: the first line holds numbers",
            f'a header with names and units, such as "{EXAMPLES[quantities[0]]}", '
            f"or columns by position, columns = {{ {quantities[0]} = 1 }}, with their units",
        )  # fmt: skip
    listed = ", ".join(f'"{name}"' for name in there[:12]) + (", ..." if len(there) > 12 else "")
    example = there[-1] if there else "y"
    wanted = f'one, or its name in the table: {key} = {{ {quantities[0]} = "{example}" }}'
    if key == "columns" and len(there) == 1:  # the whole header was taken for one column
        sign = next((sign for sign in (";", "\t", ",", "|", " ") if sign in there[0]), "")
        wanted += f'; or the delimiter, delimiter = "{"\\t" if sign == "\t" else sign}"' if sign else ""
    usual = " or ".join(quantity for quantity in quantities if quantity not in _LAST)
    return InputError(path, usual, f"no such column among {listed or 'none'}", wanted)


def _encoding(table: Table, key: str) -> str:
    name = table.text(key, 'the name of an encoding, such as "utf-8" or "gbk"')
    try:
        io.TextIOWrapper(io.BytesIO(), encoding=name)
    except (LookupError, ValueError):
        raise table.refusal(key, 'an encoding that Python knows, such as "utf-8" or "gbk"') from None
    return name


_DIALECT = {
    "skip_rows": whole(0, math.inf, 0, wanted="how many lines stand before the header, such as skip_rows = 3"),
    "delimiter": valid(lambda sign: isinstance(sign, str) and len(sign) == 1 and sign not in '"\n\r', _DELIMITERS, ""),
    "decimal": valid(lambda sign: sign in (".", ","), '"." or ","', "."),
    "encoding": Field(_encoding, "utf-8"),
}
