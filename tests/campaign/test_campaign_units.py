"""Quantities as they stand in campaign.toml."""

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scruton.campaign.schema import Motion, Quantity, Section
from scruton.campaign.units import (
    ACCELERATION,
    ANGLE,
    DAMPING_RATIO,
    DENSITY,
    FREQUENCY,
    INERTIA,
    LENGTH,
    MASS,
    SPEED,
    TIME,
    USUAL,
    Dimension,
    parse_amplitude,
    parse_quantity,
    unit_factor,
)
from scruton.errors import InputError

HEAVING = Section(Motion.HEAVING, width=0.3, depth=0.075)
TORSIONAL = Section(Motion.TORSIONAL, width=0.6, depth=0.06)


def parse(value: object, dimension: Dimension = MASS) -> Quantity:
    return parse_quantity(value, dimension, "campaign.toml", "rigs[0].mass")


@pytest.mark.parametrize(
    ("text", "mean", "sd"),
    [
        ("7.089 kg/m", 7.089, None),
        ("7.089kg/m", 7.089, None),
        ("7.089 +/- 0.03 kg/m", 7.089, 0.03),
        ("7.089 ± 0.03 kg/m", 7.089, 0.03),
        ("(7.089 +/- 0.03) kg/m", 7.089, 0.03),
        ("7.089 kg/m +/- 30 g/m", 7.089, 0.03),
        ("7089 g/m", 7.089, None),
        ("0.007089 t/m", 7.089, None),
        ("1e1 kg/m", 10.0, None),
        ({"mean": "7.089 kg/m", "sd": "30 g/m"}, 7.089, 0.03),
        ({"mean": "7.089 kg/m"}, 7.089, None),
    ],
)
def test_quantities_come_in_many_spellings(text: object, mean: float, sd: float | None) -> None:
    found = parse(text)
    assert found.mean == pytest.approx(mean, rel=1e-12)
    assert found.sd == (None if sd is None else pytest.approx(sd, rel=1e-12))


@pytest.mark.parametrize(
    ("unit", "dimension", "factor"),
    [
        ("mm", LENGTH, 1e-3),
        ("µm", LENGTH, 1e-6),
        ("km/h", SPEED, 1 / 3.6),
        ("kg/m³", DENSITY, 1.0),
        ("kg m^2/m", INERTIA, 1.0),
        ("kg·m²/m", INERTIA, 1.0),
        ("ms", TIME, 1e-3),
        ("deg", ANGLE, math.pi / 180),
        ("°", ANGLE, math.pi / 180),
        ("kHz", FREQUENCY, 1e3),
        ("1/s", FREQUENCY, 1.0),
        # pint alone would take an angular frequency for a frequency, wrong by 2 pi.
        ("rad/s", FREQUENCY, 1 / (2 * math.pi)),
        ("rpm", FREQUENCY, 1 / 60),
        ("deg/s", FREQUENCY, 1 / 360),
    ],
)
def test_factor_of_a_unit(unit: str, dimension: Dimension, factor: float) -> None:
    assert unit_factor(unit, dimension) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (7.089, r'rigs\[0\].mass: found 7.089 without a unit; wanted .* mass = "7.089 kg/m"'),
        (7, r'mass = "7 kg/m"'),
        ("7.089", "no unit"),
        ("7.089 kg", "not that of a mass per unit length"),
        ("7.089 furlong/brick", "not known"),
        ("7,089 kg/m", "decimal comma"),
        ("heavy", "does not begin with a number"),
        ("", "does not begin with a number"),
        ("nan kg/m", "does not begin with a number"),
        ("1e999 kg/m", "not a finite number"),
        ("-7.089 kg/m", "greater than zero"),
        ("0 kg/m", "greater than zero"),
        ("7.089 +/- -0.03 kg/m", "standard deviation"),
        ("7.089 +/- 0 kg/m", "standard deviation"),
        ("7.089 +/- kg/m", "does not begin with a number"),
        ({"mean": "7.089 kg/m", "sd": 0.03}, "sd: no unit"),
        ({"sd": "0.03 kg/m"}, "no mean"),
        ({"mean": "7.089 kg/m", "std": "0.03 kg/m"}, '"std" is not known'),
        ({"mean": "7.089 +/- 0.03 kg/m"}, "standard deviation of its own"),
        (True, "neither a number nor a text"),
        ([7.089], "neither a number nor a text"),
    ],
)
def test_bad_quantities_say_what_is_wanted(value: object, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        parse(value)
    assert caught.value.field == "rigs[0].mass"


def test_ratios_are_bare_numbers() -> None:
    assert parse(0.0058, DAMPING_RATIO) == Quantity(0.0058)
    assert parse("0.0058 +/- 0.0003", DAMPING_RATIO) == Quantity(0.0058, 0.0003)
    assert parse({"mean": 0.0058, "sd": 0.0003}, DAMPING_RATIO) == Quantity(0.0058, 0.0003)
    with pytest.raises(InputError, match=r'the unit "%", where none belongs.*bare number'):
        parse("0.58 %", DAMPING_RATIO)
    with pytest.raises(InputError, match="not a finite number"):
        parse(math.inf, DAMPING_RATIO)


def test_amplitudes_are_over_depth_or_in_radians() -> None:
    def amplitude(value: object, section: Section) -> float:
        return parse_amplitude(value, section, "campaign.toml", "tests[0].stable_amplitude").mean

    assert amplitude(0.06551, HEAVING) == 0.06551
    assert amplitude("4.91 mm", HEAVING) == pytest.approx(0.00491 / 0.075)
    assert amplitude("0.0655 A/D", HEAVING) == 0.0655
    assert amplitude(0.02, TORSIONAL) == 0.02
    assert amplitude("1.2 deg", TORSIONAL) == pytest.approx(math.radians(1.2))
    with pytest.raises(InputError, match="not that of a length"):
        amplitude("1.2 deg", HEAVING)
    with pytest.raises(InputError, match="not that of an angle"):
        amplitude("4.91 mm", TORSIONAL)
    with pytest.raises(InputError, match="greater than zero"):
        amplitude(-0.01, HEAVING)


@given(st.text(max_size=20))
def test_no_text_breaks_the_parser(text: str) -> None:
    """Whatever a user writes is a quantity or an InputError, and never another error."""
    with contextlib.suppress(InputError):
        assert parse(text).mean > 0.0


@given(st.floats(min_value=1e-9, max_value=1e9), st.sampled_from(["kg/m", "g/mm", "t/km"]))
def test_numbers_survive(value: float, unit: str) -> None:
    assert parse(f"{value!r} {unit}").mean == pytest.approx(value, rel=1e-12)


def test_the_usual_units_are_pints(monkeypatch: pytest.MonkeyPatch) -> None:
    dimensions = (LENGTH, MASS, INERTIA, FREQUENCY, DENSITY, SPEED, TIME, ANGLE, ACCELERATION)
    assert {si for si, _ in USUAL.values()} == {dimension.unit for dimension in dimensions}

    def told(unit: str, dimension: Dimension) -> float | str:
        try:
            return unit_factor.__wrapped__(unit, dimension)
        except ValueError as error:
            return str(error)

    quick = {(unit, one): told(unit, one) for unit in USUAL for one in dimensions}
    monkeypatch.setattr("scruton.campaign.units.USUAL", {})
    assert quick == {(unit, one): told(unit, one) for unit in USUAL for one in dimensions}
