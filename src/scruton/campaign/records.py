"""One record or sweep: from its table in campaign.toml and its file to arrays in A/D or rad."""

from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign import units
from scruton.campaign.columns import EXAMPLES, chosen_columns, open_table
from scruton.campaign.files import Files
from scruton.campaign.readers import Column
from scruton.campaign.schema import Kind, Motion, Record, Section, Sweep
from scruton.campaign.signal import band_limited
from scruton.campaign.spelling import show
from scruton.campaign.thresholds import (
    BAND,
    LATEST,
    MIN_SAMPLES,
    NARROWEST_BAND,
    RATE_TOLERANCE,
    RATES,
    SIZES,
    SPARSEST,
)
from scruton.campaign.toml import Table
from scruton.errors import InputError

DIALECT_KEYS = ("columns", "variables", "units", "skip_rows", "delimiter", "decimal", "encoding")
RECORD_KEYS = ("file", "kind", "sample_rate", "start", "stop", "scale", "band", *DIALECT_KEYS)
SWEEP_KEYS = ("rig", "air_density", "file", *DIALECT_KEYS)
# What is to become of values that are none.
_NUMBERS = "numbers throughout"
_CHOOSES = f"{_NUMBERS}, or a part of the record that has them, by start and stop"
_MAKES_A_GAP = (
    f"{_NUMBERS}: leave such lines out of the file, which makes a gap that is allowed for, or choose a part of the "
    "record by start and stop"
)


# What a sensor may have read, and how often it is to be integrated.
ORDERS = {
    Motion.HEAVING: {"displacement": 0, "acceleration": 2},
    Motion.TORSIONAL: {"rotation": 0, "angular_acceleration": 2},
}


def read_record(
    table: Table, name: str, section: Section, frequency: float, files: Files, kinds: Collection[Kind]
) -> Record:
    """Read one record that is to be called `name`, of one of the kinds that may stand in this place (InputError).

    `frequency` [Hz] of its rig is where an acceleration is integrated.
    """
    table.check_keys(RECORD_KEYS)
    kind = Kind(table.choice("kind", [member.value for member in Kind]))
    if kind not in kinds:
        place = "still air, below a rig" if Kind.FREE_DECAY in kinds else "wind, below a test"
        raise table.error("kind", f'"{kind}" in {place}', " or ".join(f'"{allowed}"' for allowed in kinds))
    displacement, derivative = orders = ORDERS[section.motion]
    path, container = open_table(table, files)
    columns = chosen_columns(table, path, container, {"time": False, f"{displacement}|amplitude|{derivative}": True})
    time_column = columns.pop("time", None)
    ((quantity, column),) = columns.items()
    order = orders.get(quantity, 0)
    factor = _factor(table, path, quantity, column, partial(units.amplitude_factor, section=section, order=order))
    _check_count(path, column, len(column.values))
    time = _time(table, path, time_column, column)
    window = _window(table, path, time)
    values = column.values[window]
    _check_count(path, column, len(values), " between start and stop")
    # a record whose times are counted by its rate would be shifted by lines left out
    ours = time_column is not None and "sample_rate" not in table
    _check_finite(path, column, values, _MAKES_A_GAP if ours else _CHOOSES, window.start)
    if (values == values[0]).all():
        raise _error(path, column, f"a constant signal, {values[0]:g} throughout", "one that oscillates")
    is_envelope = quantity == "amplitude"
    if is_envelope:
        _check_not_negative(path, column, values, window.start)
    _check_size(path, column, values, factor)
    _check_gaps(path, time_column, time[window])
    time, response = time[window].copy(), values * factor
    band = _band(table, quantity, order, frequency, time)
    if band is not None:
        try:
            time, response = band_limited(time, response, band, order)
        except ValueError as error:
            raise _error(
                path, column, str(error), "an unbroken record, by start or stop: a filter leaps no gap"
            ) from None
    return Record(name, path, kind, time, response, is_envelope, table.field, band)


def read_sweep(table: Table, section: Section, frequency: float, files: Files) -> Sweep:
    """Read one sweep; `frequency` [Hz] of its rig turns reduced velocities into speeds (InputError)."""
    table.check_keys(SWEEP_KEYS)
    air_density = table.quantity("air_density", units.DENSITY)
    path, container = open_table(table, files)
    columns = chosen_columns(table, path, container, {"wind_speed|reduced_velocity": True, "amplitude": True})
    amplitude = columns.pop("amplitude")
    ((quantity, speed),) = columns.items()
    if quantity == "wind_speed":
        to_speed = _factor(table, path, quantity, speed, _to(units.SPEED))
    else:
        to_speed = _factor(table, path, quantity, speed, _to(units.REDUCED_VELOCITY), "-") * frequency * section.depth
    usual = "A/D" if amplitude.name.upper() == "A/D" else None
    to_amplitude = _factor(table, path, "amplitude", amplitude, partial(units.amplitude_factor, section=section), usual)
    _check_lengths(path, speed, amplitude)
    for column in (speed, amplitude):
        _check_finite(path, column, column.values, _NUMBERS)
        _check_not_negative(path, column, column.values)
    _check_size(path, speed, speed.values, to_speed)
    _check_size(path, amplitude, amplitude.values, to_amplitude, least=0.0)
    rig = table.text("rig", "the name of a rig")
    return Sweep(rig, air_density, speed.values * to_speed, amplitude.values * to_amplitude, path)


def _band(table: Table, quantity: str, order: int, frequency: float, time: FloatArray) -> tuple[float, float] | None:
    """Band [Hz] that a record is filtered to: as stated, for accelerations around f0; None for any other."""
    if "band" not in table:
        return (BAND[0] * frequency, BAND[1] * frequency) if order else None
    if quantity == "amplitude":
        raise table.error("band", show(table.values["band"]), "none: an amplitude is filtered already")
    low, high = units.parse_band(table.values["band"], table.file, table.at("band"))
    widest, least = NARROWEST_BAND[0] * frequency, NARROWEST_BAND[1] * frequency
    if low > widest or high < least:
        found = f"{low:g} to {high:g} Hz, around the rig's {frequency:g} Hz"
        wanted = f"a band from {widest:.3g} Hz or less to {least:.3g} Hz or more, which lets transients and noise pass"
        raise table.error("band", found, wanted)
    if (time[-1] - time[0]) * low < 3.0 or 2.0 * low * (time[-1] - time[0]) > len(time) - 1:
        found = f"{low:g} to {high:g} Hz for {len(time)} samples in {time[-1] - time[0]:.3g} s"
        raise table.error("band", found, "a record of three periods of the lower edge, sampled twice a period or more")
    return low, high


def _to(dimension: units.Dimension) -> Callable[[str], float]:
    return partial(units.unit_factor, dimension=dimension)


def _factor(
    table: Table, path: Path, quantity: str, column: Column, factor: Callable[[str], float], usual: str | None = None
) -> float:
    """Factor from a column's unit, stated in the table or in the file; `usual` is the unit where neither says one."""
    there, example = table.table("units"), EXAMPLES[quantity]
    stated = there.text(quantity, f'a unit, such as {quantity} = "mm"') if quantity in there else None
    unit = stated if stated is not None else column.unit if column.unit is not None else usual
    if "scale" in table and quantity not in ("time", "wind_speed", "reduced_velocity"):
        return _scaled(table, quantity, unit, factor)
    if unit is None:
        wanted = f'a unit in the header, "{example}", or in the record\'s table, units = {{ {quantity} = "..." }}'
        raise _error(path, column, "no unit", wanted)
    try:
        return factor(unit)
    except ValueError as error:
        wanted = f'a unit of {quantity.replace("_", " ")}, as in "{example}"'
        if stated is not None:
            raise there.error(quantity, str(error), wanted) from None
        raise _error(path, column, str(error), wanted) from None


def _scaled(table: Table, quantity: str, unit: str | None, factor: Callable[[str], float]) -> float:
    """Factor of a column in `unit` that the record's `scale` turns into the quantity."""
    scale, example = table.values["scale"], "2 m/s^2/V" if "acceleration" in quantity else "0.18 m/V"
    wanted = f'a factor to {quantity.replace("_", " ")}, such as scale = "{example}", or a sensitivity, "100 mV/g"'
    if isinstance(scale, bool) or not isinstance(scale, str | int | float):
        raise table.refusal("scale", wanted)
    try:
        return units.scaled_factor(scale, unit, factor)
    except ValueError as error:
        reading = "a column without a unit" if unit is None else f"a column in {unit}" if unit else "a bare number"
        raise table.error("scale", f"{show(scale)} for {reading} ({error})", wanted) from None


def _time(table: Table, path: Path, column: Column | None, response: Column) -> FloatArray:
    """Time [s] of every sample: the file's own column or clock, or from `sample_rate`."""
    rate = table.number("sample_rate", units.FREQUENCY) if "sample_rate" in table else None
    if column is not None:
        _check_lengths(path, column, response)
        _check_finite(path, column, column.values, _MAKES_A_GAP if rate is None else _NUMBERS)
        time = column.values * _factor(table, path, "time", column, _to(units.TIME))
        _check_size(path, column, time, 1.0, least=0.0, largest=LATEST)
        start, duration = float(time[0]), float(time[-1] - time[0])
        own_rate = (len(time) - 1) / duration if duration > 0.0 else 0.0
        if rate is None and (bad := np.diff(time) <= 0.0).any():
            first = int(np.argmax(bad)) + 1
            found = f"time that does not increase, first at {column.where(first)} "
            found += f"({time[first - 1]:.10g} s, then {time[first]:.10g} s)"
            wanted = (
                'strictly increasing time, or sample_rate = "500 Hz" in the record\'s table where time is only rounded'
            )
            raise _error(path, column, found, wanted)
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
        if not RATES[0] <= own_rate <= RATES[1]:
            wanted = f"between {RATES[0]:g} and {RATES[1]:g}"
            raise _error(path, column or response, f"{own_rate:g} samples a second", wanted)
        if column is not None:
            return time
    elif not abs(own_rate - rate) <= RATE_TOLERANCE * rate:
        found = f"{rate:g} Hz, while the file's own time says {own_rate:g} Hz"
        raise table.error("sample_rate", found, f"the same rate to {RATE_TOLERANCE:.0%}, or none")
    # A stated rate replaces the file's own time, which may be rounded; the origin stays the file's.
    return start + np.arange(len(response.values)) / (rate if rate is not None else own_rate)


def _window(table: Table, path: Path, time: FloatArray) -> slice:
    """Samples from `start` to `stop`, both included, which must lie in the record to within one sample."""
    step = float(time[-1] - time[0]) / (len(time) - 1)
    edges = {"start": float(time[0]), "stop": float(time[-1])}
    for key in edges:
        if key in table:
            value = table.number(key, units.TIME)
            if not time[0] - step <= value <= time[-1] + step:
                wanted = f"a time in the record {path.name}, which goes from {time[0]:g} s to {time[-1]:g} s"
                raise table.error(key, show(table.values[key]), wanted)
            edges[key] = value
    if edges["start"] >= edges["stop"]:
        raise table.error("stop", f"{edges['stop']:g} s", f"a time after the start, {edges['start']:g} s")
    slack = 1e-6 * step  # for times such as 3 * 0.1
    first = int(np.searchsorted(time, edges["start"] - slack, side="left"))
    return slice(first, int(np.searchsorted(time, edges["stop"] + slack, side="right")))


def _error(path: Path, column: Column, found: str, wanted: str) -> InputError:
    return InputError(path, f'column "{column.name}"', found, wanted)


def _check_count(path: Path, column: Column, count: int, where: str = "") -> None:
    if count < MIN_SAMPLES:
        samples = "1 sample" if count == 1 else f"{count} samples"
        raise _error(path, column, samples + where, f"{MIN_SAMPLES} or more")


def _check_lengths(path: Path, column: Column, other: Column) -> None:
    if len(column.values) != len(other.values):
        found = f'{len(column.values)} values in "{column.name}" and {len(other.values)} in "{other.name}"'
        raise _error(path, other, found, "columns of one length")


def _check_finite(path: Path, column: Column, values: FloatArray, wanted: str, offset: int = 0) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        first, count = int(np.argmax(bad)) + offset, int(bad.sum())
        what = "1 value that is" if count == 1 else f"{count} values that are"
        found = f"{what} no finite number (NaN, infinite or blank), the first at {column.where(first)}"
        raise _error(path, column, found, wanted)


def _check_not_negative(path: Path, column: Column, values: FloatArray, offset: int = 0) -> None:
    bad = values < 0.0
    if bad.any():
        first = int(np.argmax(bad))
        found = f"{values[first]:g} at {column.where(first + offset)}"
        raise _error(path, column, found, "numbers of zero or more")


def _check_size(
    path: Path, column: Column, values: FloatArray, factor: float, least: float = SIZES[0], largest: float = SIZES[1]
) -> None:
    """Refuse what no tunnel measures, and no double can square: a record whose largest value is out of all bounds."""
    top = float(np.abs(values).max()) if len(values) else least
    if not least <= factor * top <= largest:
        found = f"{top:g} as the largest value, {factor * top:g} in SI units or over the depth"
        raise _error(path, column, found, f"a size between {least:g} and {largest:g}")


def _check_gaps(path: Path, column: Column | None, time: FloatArray) -> None:
    """Refuse a record that is mostly gaps: a date that jumps, say. Its spectrum would be that of what is not there."""
    steps = np.diff(time)
    longest = int(np.argmax(steps))
    if column is not None and time[-1] - time[0] > SPARSEST * len(time) * float(np.median(steps)):
        found = f"a gap of {steps[longest]:.4g} s after {time[longest]:.6g} s, beside steps of {np.median(steps):.4g} s"
        raise _error(path, column, found, "the part before or after it, by start or stop")
