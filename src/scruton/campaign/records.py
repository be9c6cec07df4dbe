"""One record or sweep: from its table in campaign.toml and its file to arrays in A/D or rad."""

from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.columns import EXAMPLES, chosen_columns, open_table
from scruton.campaign.files import Files
from scruton.campaign.readers import Column
from scruton.campaign.schema import Kind, Motion, Record, Section, Sweep
from scruton.campaign.spelling import show
from scruton.campaign.thresholds import LATEST, MIN_SAMPLES, RATE_TOLERANCE, RATES, SIZES, SPARSEST
from scruton.campaign.toml import Table
from scruton.campaign.units import (
    DENSITY,
    FREQUENCY,
    REDUCED_VELOCITY,
    SPEED,
    TIME,
    Dimension,
    amplitude_factor,
    unit_factor,
)
from scruton.errors import InputError

DIALECT_KEYS = ("columns", "variables", "units", "skip_rows", "delimiter", "decimal", "encoding")
RECORD_KEYS = ("file", "kind", "sample_rate", "start", "stop", *DIALECT_KEYS)
SWEEP_KEYS = ("rig", "air_density", "file", *DIALECT_KEYS)


def read_record(table: Table, name: str, section: Section, files: Files, kinds: Collection[Kind]) -> Record:
    """Read one record.

    Parameters
    ----------
    table : Table
        Its table in campaign.toml.
    name : str
        What it is to be called.
    section : Section
        For the motion, and the depth that displacements are divided by.
    files : Files
        Where bytes come from.
    kinds : collection of Kind
        Those that may stand in this place.

    Raises
    ------
    InputError
        Whatever is wrong with the table or the file.
    """
    table.check_keys(RECORD_KEYS)
    kind = _kind(table, kinds)
    displacement = "displacement" if section.motion is Motion.HEAVING else "rotation"
    path, container = open_table(table, files)
    columns = chosen_columns(table, path, container, {"time": False, f"{displacement}|amplitude": True})
    time_column = columns.pop("time", None)
    ((quantity, column),) = columns.items()
    is_envelope = quantity == "amplitude"
    factor = _factor(table, path, quantity, column, lambda unit: amplitude_factor(unit, section))
    if len(column.values) < MIN_SAMPLES:
        raise _too_few(path, column, len(column.values))
    time = _time(table, path, time_column, column)
    window = _window(table, path, time)
    values = column.values[window]
    if len(values) < MIN_SAMPLES:
        raise _too_few(path, column, len(values), "between start and stop")
    _check_finite(path, column, values, window.start)
    if (values == values[0]).all():
        raise InputError(path, _column(column), f"a constant signal, {values[0]:g} throughout", "one that oscillates")
    if is_envelope:
        _check_not_negative(path, column, values, window.start)
    _check_size(path, column, values, factor)
    _check_gaps(path, time_column, time[window])
    return Record(name, path, kind, time[window].copy(), values * factor, is_envelope, table.field)


def read_sweep(table: Table, section: Section, frequency: float, files: Files) -> Sweep:
    """Read one sweep; `frequency` [Hz] of its rig turns reduced velocities into speeds.

    Raises
    ------
    InputError
        Whatever is wrong with the table or the file.
    """
    table.check_keys(SWEEP_KEYS)
    air_density = table.quantity("air_density", DENSITY)
    path, container = open_table(table, files)
    columns = chosen_columns(table, path, container, {"wind_speed|reduced_velocity": True, "amplitude": True})
    amplitude = columns.pop("amplitude")
    ((quantity, speed),) = columns.items()
    if quantity == "wind_speed":
        to_speed = _factor(table, path, quantity, speed, _to(SPEED))
    else:
        to_speed = _factor(table, path, quantity, speed, _to(REDUCED_VELOCITY), bare="-") * frequency * section.depth
    bare = amplitude.name.upper() == "A/D"
    to_amplitude = _factor(
        table, path, "amplitude", amplitude, lambda unit: amplitude_factor(unit, section), bare="A/D" if bare else None
    )
    if len(speed.values) != len(amplitude.values):
        raise _different_lengths(path, speed, amplitude)
    for column in (speed, amplitude):
        _check_finite(path, column, column.values)
        _check_not_negative(path, column, column.values)
    _check_size(path, speed, speed.values, to_speed)
    _check_size(path, amplitude, amplitude.values, to_amplitude, least=0.0)
    rig = table.text("rig", "the name of a rig")
    return Sweep(rig, air_density, speed.values * to_speed, amplitude.values * to_amplitude, path)


def _kind(table: Table, kinds: Collection[Kind]) -> Kind:
    kind = Kind(table.choice("kind", [one.value for one in Kind]))
    if kind not in kinds:
        place = "still air, below a rig" if Kind.FREE_DECAY in kinds else "wind, below a test"
        raise table.error("kind", f'"{kind}" in {place}', " or ".join(f'"{one}"' for one in kinds))
    return kind


def _to(dimension: Dimension) -> Callable[[str], float]:
    return lambda unit: unit_factor(unit, dimension)


def _factor(
    table: Table,
    path: Path,
    quantity: str,
    column: Column,
    factor: Callable[[str], float],
    bare: str | None = None,
) -> float:
    """Factor from a column's unit, stated in the table or in the file; `bare` is the unit where neither says one."""
    units = table.table("units")
    stated = units.text(quantity, f'a unit, such as {quantity} = "mm"') if quantity in units else None
    unit = stated if stated is not None else column.unit if column.unit is not None else bare
    example = EXAMPLES[quantity]
    if unit is None:
        raise InputError(
            path, _column(column), "no unit",
            f'a unit in the header, "{example}", or in the record\'s table, units = {{ {quantity} = "..." }}',
        )  # fmt: skip
    try:
        return factor(unit)
    except ValueError as error:
        wanted = f'a unit of {quantity.replace("_", " ")}, as in "{example}"'
        if stated is not None:
            raise units.error(quantity, str(error), wanted) from None
        raise InputError(path, _column(column), str(error), wanted) from None


def _time(table: Table, path: Path, column: Column | None, response: Column) -> FloatArray:
    """Time [s] of every sample: the file's own column or clock, or from `sample_rate`."""
    rate = table.number("sample_rate", FREQUENCY) if "sample_rate" in table else None
    count = len(response.values)
    if column is not None:
        if len(column.values) != count:
            raise _different_lengths(path, column, response)
        _check_finite(path, column, column.values)
        time = column.values * _factor(table, path, "time", column, _to(TIME))
        _check_size(path, column, time, 1.0, least=0.0, largest=LATEST)
        if rate is None:
            _check_increasing(path, column, time)
            _check_rate(path, column, _mean_rate(time))
            return time
        start, own_rate = float(time[0]), _mean_rate(time)
    elif response.clock is not None:
        start, own_rate = response.clock.start, 1.0 / response.clock.step
    elif rate is None:
        raise InputError(
            path, "time", "no time column",
            'one, "time [s]", or in the record\'s table the name of one or the rate, sample_rate = "500 Hz"',
        )  # fmt: skip
    else:
        start, own_rate = 0.0, rate
    if rate is None:
        _check_rate(path, response, own_rate)
    if rate is not None and not abs(own_rate - rate) <= RATE_TOLERANCE * rate:
        found = f"{rate:g} Hz, while the file's own time says {own_rate:g} Hz"
        raise table.error("sample_rate", found, f"the same rate to {RATE_TOLERANCE:.0%}, or none")
    # A stated rate replaces the file's own time, which may be rounded; the origin stays the file's.
    return start + np.arange(count) / (rate if rate is not None else own_rate)


def _mean_rate(time: FloatArray) -> float:
    duration = float(time[-1] - time[0])
    return (len(time) - 1) / duration if duration > 0.0 else 0.0


def _window(table: Table, path: Path, time: FloatArray) -> slice:
    """Samples from `start` to `stop`, both included, which must lie in the record to within one sample."""
    step = float(time[-1] - time[0]) / (len(time) - 1)
    edges = {"start": float(time[0]), "stop": float(time[-1])}
    for key in edges:
        if key in table:
            value = table.number(key, TIME)
            if not time[0] - step <= value <= time[-1] + step:
                raise table.error(
                    key, show(table.values[key]),
                    f"a time in the record {path.name}, which goes from {time[0]:g} s to {time[-1]:g} s",
                )  # fmt: skip
            edges[key] = value
    if edges["start"] >= edges["stop"]:
        raise table.error("stop", f"{edges['stop']:g} s", f"a time after the start, {edges['start']:g} s")
    slack = 1e-6 * step  # for times such as 3 * 0.1
    first = int(np.searchsorted(time, edges["start"] - slack, side="left"))
    return slice(first, int(np.searchsorted(time, edges["stop"] + slack, side="right")))


def _column(column: Column) -> str:
    return f'column "{column.name}"'


def _too_few(path: Path, column: Column, count: int, where: str = "") -> InputError:
    samples = "1 sample" if count == 1 else f"{count} samples"
    return InputError(path, _column(column), f"{samples} {where}".rstrip(), f"{MIN_SAMPLES} or more")


def _different_lengths(path: Path, one: Column, other: Column) -> InputError:
    found = f'{len(one.values)} values in "{one.name}" and {len(other.values)} in "{other.name}"'
    return InputError(path, _column(other), found, "columns of one length")


def _check_finite(path: Path, column: Column, values: FloatArray, offset: int = 0) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        first, count = int(np.argmax(bad)) + offset, int(bad.sum())
        what = "1 value that is" if count == 1 else f"{count} values that are"
        raise InputError(
            path, _column(column),
            f"{what} no finite number (NaN, infinite or blank), the first at {column.where(first)}",
            "numbers throughout (start and stop choose a part of a record)",
        )  # fmt: skip


def _check_not_negative(path: Path, column: Column, values: FloatArray, offset: int = 0) -> None:
    bad = values < 0.0
    if bad.any():
        first = int(np.argmax(bad))
        raise InputError(
            path, _column(column), f"{values[first]:g} at {column.where(first + offset)}", "numbers of zero or more"
        )


def _check_size(
    path: Path, column: Column, values: FloatArray, factor: float, least: float = SIZES[0], largest: float = SIZES[1]
) -> None:
    """Refuse what no tunnel measures, and no double can square: a record whose largest value is out of all bounds."""
    top = float(np.abs(values).max()) if len(values) else least
    if not least <= factor * top <= largest:
        found = f"{top:g} as the largest value, {factor * top:g} in SI units or over the depth"
        raise InputError(path, _column(column), found, f"a size between {least:g} and {largest:g}")


def _check_gaps(path: Path, column: Column | None, time: FloatArray) -> None:
    """Refuse a record that is mostly gaps: a date that jumps, say. Its spectrum would be that of what is not there."""
    steps = np.diff(time)
    longest = int(np.argmax(steps))
    if column is not None and time[-1] - time[0] > SPARSEST * len(time) * float(np.median(steps)):
        found = f"a gap of {steps[longest]:.4g} s after {time[longest]:.6g} s, beside steps of {np.median(steps):.4g} s"
        raise InputError(path, _column(column), found, "the part before or after it, by start or stop")


def _check_rate(path: Path, column: Column, rate: float) -> None:
    low, high = RATES
    if not low <= rate <= high:
        raise InputError(path, _column(column), f"{rate:g} samples a second", f"between {low:g} and {high:g}")


def _check_increasing(path: Path, column: Column, time: FloatArray) -> None:
    bad = np.diff(time) <= 0.0
    if bad.any():
        first = int(np.argmax(bad)) + 1
        raise InputError(
            path, _column(column), f"time that does not increase, first at {column.where(first)} "
            f"({time[first - 1]:.10g} s, then {time[first]:.10g} s)",
            'strictly increasing time, or sample_rate = "500 Hz" in the record\'s table where time is only rounded',
        )  # fmt: skip
