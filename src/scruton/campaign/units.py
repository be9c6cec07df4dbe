"""Quantities as a laboratory writes them, to SI: the only place that knows pint.

pint takes half a second to import and build its registry, hence the import inside a function, and `USUAL`.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion, Section
from scruton.campaign.spelling import figure, show
from scruton.campaign.thresholds import LONGEST_UNIT
from scruton.errors import InputError

if TYPE_CHECKING:
    import pint


@dataclass(frozen=True)
class Dimension:
    """What a number stands for."""

    name: str  # as an error message calls it
    unit: str  # the SI unit that it is converted to; empty for bare numbers
    example: float  # a usual value in that unit
    positive: bool = True  # zero and negative values are errors
    units: tuple[float, float] = (0.0, math.inf)  # the smallest and the largest that a laboratory writes it in
    largest: float = 1e12  # no size beyond it, nor below its inverse, is one of this world

    @property
    def spelling(self) -> str:
        """A usual value as it stands in a TOML file."""
        return f'"{self.example:g} {self.unit}"' if self.unit else f"{self.example:g}"


# Units that somebody writes: the micrometre to the fathom, the gram to the ton per metre, cycles an hour to the
# megahertz, millimetres per second to metres per second, the nanosecond to the hour, the microradian to the turn.
LENGTH = Dimension("a length", "m", 0.075, units=(1e-6, 2.0))
MASS = Dimension("a mass per unit length", "kg/m", 7.089, units=(1e-4, 1e3))
INERTIA = Dimension("a mass moment of inertia per unit length", "kg*m^2/m", 0.183, units=(1e-7, 1e3))
FREQUENCY = Dimension("a frequency", "Hz", 7.97, units=(1e-4, 1e6))
DENSITY = Dimension("a density", "kg/m^3", 1.19, units=(1e-3, 1e3))
SPEED = Dimension("a speed", "m/s", 5.735, units=(1e-3, 10.0))
TIME = Dimension("a time", "s", 3.2, positive=False, units=(1e-9, 3600.0))
ANGLE = Dimension("an angle", "rad", 0.02, units=(1e-6, 7.0))
ACCELERATION = Dimension("an acceleration", "m/s^2", 9.81, positive=False)
ANGULAR_ACCELERATION = Dimension("an angular acceleration", "rad/s^2", 2.0, positive=False)
DAMPING_RATIO = Dimension("a damping ratio, a bare number", "", 0.0058)
REDUCED_VELOCITY = Dimension("a reduced velocity U/(f0 D), a bare number", "", 9.594)
HEAVING_AMPLITUDE = Dimension("an amplitude A/D, or a length with its unit", "", 0.0655)
TORSIONAL_AMPLITUDE = Dimension("an amplitude in radians, or an angle with its unit", "", 0.02)

# What most campaigns are written in, and its factor to the SI unit of its dimension as pint has it: without pint.
USUAL: Mapping[str, tuple[str, float]] = {
    "m": ("m", 1.0),
    "cm": ("m", 0.01),
    "mm": ("m", 0.001),
    "kg/m": ("kg/m", 1.0),
    "kg*m^2/m": ("kg*m^2/m", 1.0),
    "kg m^2/m": ("kg*m^2/m", 1.0),
    "Hz": ("Hz", 1.0),
    "kg/m^3": ("kg/m^3", 1.0),
    "m/s": ("m/s", 1.0),
    "s": ("s", 1.0),
    "ms": ("s", 0.001),
    "rad": ("rad", 1.0),
    "m/s^2": ("m/s^2", 1.0),
}

_POWER_SIGN = re.compile(r"\*\*|\^|[⁻⁰¹²³⁴-⁹]")
_POWER = re.compile(  # of a unit, not of a number or of a power: m^2, m**-2, m²
    r"(?<=[^\W\d⁰¹²³⁴-⁹])(?:\s*(?:\*\*|\^)\s*[+-]?\d{1,2}(?!\d|\s*\*\*|\s*\^)|⁻?[⁰¹²³⁴-⁹]{1,2})"
)
_PLAIN_POWER = re.compile(r"(?<=[a-zA-Z])[2-4](?!\w)")  # m/s2, kg/m3
_GRAVITY = re.compile(r"(?<!\w)(m|u|µ|)[gG](?!\w)")  # where an acceleration is meant: elsewhere g is the gram
_EDGE = r"\s*([\d.]+)\s*([a-zA-Z/]*)\s*"
_BAND = re.compile(f"{_EDGE}(?:-|–|to\\b){_EDGE}")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_PLUS_MINUS = re.compile(r"±|\+\s*/\s*-|\+-")
_OVER_DEPTH = frozenset({"-", "1", "A/D", "y/D"})  # ways to write "already divided by D"

Factor = Callable[[str], float]  # of a unit that makes the number SI; ValueError if it has another dimension


def parse_quantity(value: object, dimension: Dimension, file: Path | str, field: str) -> Quantity:
    """Read a quantity from a value of a TOML file.

    Parameters
    ----------
    value : str, float or mapping
        `"7.089 kg/m"`, `"7.089 +/- 0.03 kg/m"`, or `{mean = ..., sd = ...}` of two of the former; numbers without
        a unit where `dimension` has none.
    dimension : Dimension
        What it must be.
    file, field : Path, str
        Where it stands, for error messages.

    Returns
    -------
    Quantity
        In the SI unit of `dimension`.

    Raises
    ------
    InputError
        Unit missing or of another dimension; not a number; not positive where it must be; bad standard deviation.
    """
    return _parse(value, dimension, partial(unit_factor, dimension=dimension), file, field)


def parse_amplitude(value: object, section: Section, file: Path | str, field: str) -> Quantity:
    """Read an amplitude, A/D or rad: bare, or with a unit ("4.91 mm", "1.2 deg"); InputError as `parse_quantity`."""
    dimension = HEAVING_AMPLITUDE if section.motion is Motion.HEAVING else TORSIONAL_AMPLITUDE
    return _parse(value, dimension, lambda unit: amplitude_factor(unit, section) if unit else 1.0, file, field)


def amplitude_factor(unit: str, section: Section, order: int = 0) -> float:
    """Factor from `unit` to A/D (heaving: a length over the depth) or to rad (torsion); errors as `unit_factor`.

    With `order` 2 it is that of an acceleration, to 1/s^2 or rad/s^2.
    """
    if section.motion is Motion.TORSIONAL:
        return unit_factor(unit, ANGULAR_ACCELERATION if order else ANGLE)
    if order:
        return unit_factor(unit, ACCELERATION) / section.depth
    return 1.0 if unit in _OVER_DEPTH else unit_factor(unit, LENGTH) / section.depth


def scaled_factor(scale: object, unit: str | None, factor: "Factor") -> float:
    """Factor of a reading in `unit` by a calibration, "0.18 m/V", or a sensitivity, "100 mV/g", to SI by `factor`.

    A bare number is a gain.  Where the file states no unit, a calibration tells it: what it divides by.  ValueError
    where neither makes the quantity that `factor` wants.
    """
    value, per = _number_and_unit(scale) if isinstance(scale, str) else (_finite(scale), "")  # type: ignore[arg-type]
    if value == 0.0:
        raise ValueError("a factor of zero")
    reading = unit if unit is not None else per.rpartition("/")[2]
    if not per:
        return value * factor(reading)
    try:
        return value * factor(f"({per})*({reading})")
    except ValueError:
        return factor(f"({reading})/({per})") / value


def parse_band(value: object, file: Path | str, field: str) -> tuple[float, float]:
    """Read a band [Hz], "15-35 Hz"; InputError where it is none, or its second edge is not above the first."""
    match = _BAND.fullmatch(value) if isinstance(value, str) else None
    wanted = 'a band of frequencies, such as band = "15-35 Hz"'
    if match is None:
        raise InputError(file, field, show(value), wanted)
    low_edge, unit, high_edge, last_unit = match.groups()
    low = parse_quantity(f"{low_edge} {unit or last_unit}", FREQUENCY, file, field).mean
    high = parse_quantity(f"{high_edge} {last_unit}", FREQUENCY, file, field).mean
    if low >= high:
        raise InputError(file, field, show(value), f"{wanted}, the lower edge first")
    return low, high


@lru_cache(maxsize=256)
def unit_factor(unit: str, dimension: Dimension) -> float:
    """Factor from `unit` to the SI unit of `dimension`; ValueError for another dimension, or one that is not known."""
    if not dimension.unit:
        if unit in ("", "-", "1"):
            return 1.0
        raise ValueError(f'the unit "{unit}", where none belongs')
    if not unit:
        raise ValueError("no unit")
    if unit in USUAL:
        own, known = USUAL[unit]
        if own == dimension.unit:
            return known
        raise ValueError(f'the unit "{unit}", which is not that of {dimension.name}')
    factor, root = _root(_GRAVITY.sub(r"\1g_0", unit) if dimension is ACCELERATION else unit)
    si_factor, si_root = _root(dimension.unit)
    if root == si_root:
        return factor / si_factor
    # An angular frequency is not a frequency: rad/s and revolutions per minute turn into Hz through 2 pi.
    if dimension is FREQUENCY and root == _root("rad/s")[1]:
        return factor / (2.0 * math.pi)
    raise ValueError(f'the unit "{unit}", which is not that of {dimension.name}')


def is_unit(text: str) -> bool:
    """Whether a text is a unit, of whatever dimension."""
    try:
        _root(text)
    except ValueError:
        return False
    return True


def odd_unit(text: str) -> str | None:
    """Say what is odd about the unit of a text such as "0.000075 km", or of a bare unit; None where nothing is.

    A number may be right in any unit, but nobody writes the width of a model in kilometres: `Dimension.units` are those
    that somebody does.
    """
    for part in _PLUS_MINUS.split(text):
        match = _NUMBER.match(part.strip())
        unit = part.strip()[match.end() if match else 0 :].strip(" ()")
        for dimension in (LENGTH, MASS, INERTIA, FREQUENCY, DENSITY, SPEED, TIME, ANGLE):
            try:
                factor = unit_factor(unit, dimension)
            except ValueError:
                continue
            low, high = dimension.units
            # a unit of 1 Hz may be spelt 2 pi rad/s: a hair's breadth decides nothing
            if not 0.999 * low <= factor <= 1.001 * high:
                return f'the unit "{unit}", {figure(factor)} {dimension.unit}'
    return None


def _root(unit: str) -> "tuple[float, pint.Unit]":
    """Split a unit into a factor and pint's base units (which keep radians, unlike the dimensionality)."""
    registry = _registry()
    unit = _PLAIN_POWER.sub(r"^\g<0>", unit)
    if len(unit) > LONGEST_UNIT or _POWER_SIGN.search(_POWER.sub("", unit)):  # pint would work 9^9^9^9 out
        raise ValueError(f"the unit {show(unit)}, which is not known")
    try:
        base = registry.Quantity(1.0, registry.parse_units(unit)).to_root_units()
        return float(base.magnitude), base.units
    except Exception:  # pint raises its own, tokenize's and Python's errors on what it cannot read
        raise ValueError(f'the unit "{unit}", which is not known') from None


@lru_cache(maxsize=1)
def _registry() -> "pint.UnitRegistry[float]":
    import pint

    return pint.UnitRegistry()


def _parse(value: object, dimension: Dimension, factor: Factor, file: Path | str, field: str) -> Quantity:
    leaf = field.rpartition(".")[2]
    wanted = f"{dimension.name}, such as {leaf} = {dimension.spelling}"
    if dimension.unit and isinstance(value, int | float) and not isinstance(value, bool):
        # The user's own number, in the spelling that is wanted.
        wanted = f'{dimension.name} with its unit, such as {leaf} = "{show(value)} {dimension.unit}"'
        raise InputError(file, field, f"{show(value)} without a unit", wanted)
    try:
        mean, sd = _from_table(value, factor) if isinstance(value, Mapping) else _from_text(value, factor)
    except ValueError as error:
        raise InputError(file, field, f"{show(value)} ({error})", wanted) from None
    if dimension.positive and mean <= 0.0:
        raise InputError(file, field, show(value), f"{wanted}, greater than zero")
    largest = dimension.largest
    if max(abs(mean), sd or 0.0) > largest or (mean != 0.0 and abs(mean) < 1.0 / largest):
        bounds = f"a size between {1.0 / largest:g} and {largest:g} {dimension.unit}".rstrip()
        raise InputError(file, field, f"{show(value)}, which no measurement has", f"{wanted}, {bounds}")
    if sd is not None and sd <= 0.0:
        raise InputError(
            file, field, f"{show(value)} (its standard deviation is not greater than zero)",
            "a standard deviation greater than zero, or none at all",
        )  # fmt: skip
    return Quantity(mean, sd)


def _from_table(table: Mapping[str, object], factor: Factor) -> tuple[float, float | None]:
    """Read `{mean, sd}`."""
    unknown = sorted(set(table) - {"mean", "sd"})
    if unknown:
        raise ValueError(f'the key "{unknown[0]}" is not known here, only mean and sd are')
    if "mean" not in table:
        raise ValueError("it has no mean")
    moments: dict[str, float] = {}
    for key in ("mean", "sd") if "sd" in table else ("mean",):
        try:
            moments[key], sd = _from_text(table[key], factor)
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from None
        if sd is not None:
            raise ValueError(f"{key} has a standard deviation of its own")
    return moments["mean"], moments.get("sd")


def _from_text(value: object, factor: Factor) -> tuple[float, float | None]:
    """Read a number, or a text with a unit and perhaps "+/-"."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return _finite(value) * factor(""), None
    if not isinstance(value, str):
        raise ValueError("neither a number nor a text")
    left, *rest = _PLUS_MINUS.split(value, maxsplit=1)
    if not rest:
        number, unit = _number_and_unit(left)
        return number * factor(unit), None
    right = rest[0]
    if left.lstrip().startswith("("):  # "(7.089 +/- 0.03) kg/m"
        left, right = left.replace("(", "", 1), right.replace(")", "", 1)
    mean, mean_unit = _number_and_unit(left)
    sd, sd_unit = _number_and_unit(right)
    return mean * factor(mean_unit or sd_unit), sd * factor(sd_unit)


def _number_and_unit(text: str) -> tuple[float, str]:
    text = text.strip()
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError("it does not begin with a number")
    unit = text[match.end() :].strip()
    if unit.startswith(","):
        raise ValueError("a decimal comma, where a point belongs")
    return _finite(match[0]), unit


def _finite(value: str | float) -> float:
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        number = math.inf
    if not math.isfinite(number):
        raise ValueError("not a finite number")
    return number
