"""Quantities of a test that stand in a file, and several tests in one table: a sweep of speeds recorded in one go."""

from collections.abc import Iterator
from typing import Any

from scruton.arrays import FloatArray
from scruton.campaign.columns import open_table
from scruton.campaign.files import Files
from scruton.campaign.readers import Column, read_columns
from scruton.campaign.spelling import show
from scruton.campaign.thresholds import MOST_TABLES
from scruton.campaign.toml import Table
from scruton.errors import InputError

QUANTITIES = ("wind_speed", "reduced_velocity", "air_density", "stable_amplitude")
EACH = "*"  # stands for the number of the test of a sweep, counted from 0
_KEYS = ("file", "variable", "unit", "skip_rows", "delimiter", "decimal", "encoding")
_WITHOUT_UNIT = ("reduced_velocity", "stable_amplitude")


def each_test(table: Table, files: Files) -> Iterator[Table]:
    """Go through the tests that a table describes, with every quantity in words.

    A quantity may be `{ file = "a.mat", variable = "DATA[3].U" }`.  Where the variable holds several values, or an
    asterisk in place of a number, the table is one test for each: the asterisk stands for its number, counted from 0,
    wherever it is in the test's records, and is put behind its name (InputError where two quantities differ in number,
    or whatever a file gives rise to).
    """
    read = {
        key: _values(Table(table.file, table.at(key), value, table.wording), key, files)
        for key in QUANTITIES
        if isinstance(value := table.values.get(key), dict) and "file" in value
    }
    sizes = {key: len(values) for key, (values, several) in read.items() if several}
    if not sizes:
        yield _with(table, {key: values[0] for key, (values, _) in read.items()}) if read else table
        return
    count = max(sizes.values())
    for key, size in sizes.items():
        if size != count:
            raise table.error(key, f"{size} values", f"{count}, as in {max(sizes, key=lambda name: sizes[name])}")
    for number in range(count):
        values = {key: values[number if several else 0] for key, (values, several) in read.items()}
        test = _with(table, values)
        filled = {key: _filled(value, number) if key == "records" else value for key, value in test.values.items()}
        filled["name"] = f"{table.values.get('name', '')} {number}".strip()
        if filled.get("peak"):
            raise table.error("peak", "true, of a sweep of tests", "none: the one of largest amplitude is found")
        yield Table(table.file, f"{table.field}[{number}]", filled, table.wording)


def _with(table: Table, quantities: dict[str, Any]) -> Table:
    return Table(table.file, table.field, {**table.values, **quantities}, table.wording)


def _filled(value: Any, number: int) -> Any:
    """A value of TOML with the number of the test in the place of every asterisk."""
    if isinstance(value, str):
        return value.replace(EACH, str(number))
    if isinstance(value, dict):
        return {key: _filled(inner, number) for key, inner in value.items()}
    return [_filled(inner, number) for inner in value] if isinstance(value, list) else value


def _values(table: Table, key: str, files: Files) -> tuple[list[Any], bool]:
    """The values that a file holds of a quantity, spelt as in a TOML file, and whether there may be several."""
    table.check_keys(_KEYS)
    unit = table.text("unit", 'a unit, such as unit = "m/s"', blank=True) if "unit" in table else None
    variable = table.text("variable", 'the name of a column or variable, such as variable = "DATA[3].U"')
    _, container = open_table(Table(table.file, table.field, _without(table), table.wording), files)
    columns: list[Column] = []
    several = EACH in variable
    try:
        while len(columns) < MOST_TABLES and (several or not columns):
            columns += read_columns(container, [variable.replace(EACH, str(len(columns)))])
    except InputError as error:
        if not columns or "outside" not in error.found:
            raise
    numbers: list[float] = [float(x) for column in columns for x in _checked(column, several, table)]
    unit = unit if unit is not None else columns[0].unit
    if unit is None and key not in _WITHOUT_UNIT:
        raise table.error("unit", f"nothing, and none in the file for {show(variable)}", 'one, such as unit = "m/s"')
    return [f"{number!r} {unit}" if unit else number for number in numbers], several or len(numbers) > 1


def _checked(column: Column, several: bool, table: Table) -> FloatArray:
    if len(column.values) == 0 or (several and len(column.values) != 1):
        raise table.error("variable", f"{len(column.values)} values in {show(column.name)}", "one value")
    return column.values


def _without(table: Table) -> dict[str, Any]:
    return {key: value for key, value in table.values.items() if key not in ("variable", "unit")}
