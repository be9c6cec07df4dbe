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
    "amplitude": "amplitude [mm]",
    "wind_speed": "wind speed [m/s]",
    "reduced_velocity": "reduced velocity",
}
_SPELLINGS = {"amplitude": ("amplitude", "A/D")}


def file_path(table: Table, folder: Path) -> Path:
    """Path of the file that a table names (InputError if it names none)."""
    return folder / table.text("file", 'the name of a file, such as file = "decay.csv"')


def open_table(table: Table, files: Files) -> tuple[Path, Container]:
    """Open the file that a table names.

    Raises
    ------
    InputError
        A missing or unreadable file; dialect keys that are wrong or do not go with its type.
    """
    path = file_path(table, files.folder)
    wrong, right = (("variables",), "columns") if is_delimited(path) else (TEXT_KEYS, "variables")
    for key in wrong:
        if key in table:
            raise table.error(key, f'a key that does not go with a file of type "{path.suffix}"', f'"{right}", perhaps')
    return path, files.open(path, _dialect(table))


def chosen_columns(table: Table, path: Path, container: Container, wanted: Mapping[str, bool]) -> dict[str, Column]:
    """Read the columns that hold the wanted quantities.

    Parameters
    ----------
    table : Table
        A record's or a sweep's; its `columns` or `variables` say what is called what.
    path, container : Path, Container
        The open file.
    wanted : mapping of str to bool
        Quantities, alternatives parted by a bar ("displacement|amplitude"), and whether one must be there.

    Returns
    -------
    dict
        By quantity.  What the table does not state goes by its own name in the file.

    Raises
    ------
    InputError
        Unknown quantities, none or several of one group, columns that are not there.
    """
    known = [quantity for group in wanted for quantity in group.split("|")]
    key = "columns" if is_delimited(path) else "variables"
    table.table("units").check_keys(known)
    stated = _stated(table.table(key), known, positions=is_delimited(path))
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
        if len(matches) > 1:
            choice = f'{key} = {{ {quantities[0]} = "{matches[quantities[0]]}" }}'
            raise InputError(
                path, "", f"both {' and '.join(matches)}", f"one of the two; say which in the table: {choice}"
            )
        if needed and not matches:
            raise _missing(path, key, quantities, there)
        names |= matches
    return dict(zip(names, read_columns(container, list(names.values())), strict=True))


def _stated(table: Table, known: list[str], *, positions: bool) -> dict[str, str | int]:
    table.check_keys(known)
    names: dict[str, str | int] = {}
    for quantity, value in table.values.items():
        name: object = None if isinstance(value, bool) or value == "" else value
        if isinstance(name, str) or (positions and isinstance(name, int)):
            names[quantity] = name
        else:
            wanted = "the name of a column, or its position counted from 0" if positions else "the path of a variable"
            raise table.error(quantity, show(value), wanted)
    return names


def _missing(path: Path, key: str, quantities: list[str], there: Sequence[str]) -> InputError:
    if key == "columns" and not there:
        return InputError(
            path, "header", "no header line: the first line holds numbers",
            f'a header with names and units, such as "{EXAMPLES[quantities[0]]}", '
            f"or columns by position, columns = {{ {quantities[0]} = 1 }}, with their units",
        )  # fmt: skip
    listed = ", ".join(f'"{name}"' for name in there[:12]) + (", ..." if len(there) > 12 else "")
    example = there[-1] if there else "y"
    return InputError(
        path, " or ".join(quantities), f"no such column among {listed or 'none'}",
        f'one, or its name in the table: {key} = {{ {quantities[0]} = "{example}" }}' + _delimiter_hint(key, there),
    )  # fmt: skip


def _delimiter_hint(key: str, there: Sequence[str]) -> str:
    """Suggest a delimiter where the whole header was taken for one column."""
    if key == "columns" and len(there) == 1:
        for sign, spelling in ((";", ";"), ("\t", "\\t"), (",", ","), ("|", "|"), (" ", " ")):
            if sign in there[0]:
                return f'; or the delimiter, delimiter = "{spelling}"'
    return ""


def _dialect(table: Table) -> CsvDialect:
    """Read how a text file is laid out."""
    dialect = CsvDialect(**{key: field.read(table, key) for key, field in _DIALECT.items()})
    if dialect.delimiter == dialect.decimal:
        raise table.error("delimiter", show(dialect.delimiter), "a sign other than the decimal one")
    return dialect


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
