"""What sensors read: accelerations, volts, and hum beside the line."""

import numpy as np
import pytest
from campaign_room import DEPTH, HEAVING, TORSIONAL, csv, record

from scruton.campaign.signal import band_limited
from scruton.errors import InputError

RATE, F, F_TORSION = 500.0, 8.0, 7.3
TIME = np.arange(6000) / RATE
GROWTH = -0.004 + 1j  # of a decay at a damping ratio of 0.4 %, over its circular frequency


def motion(frequency: float, derivative: int = 0, size: float = 0.004) -> np.ndarray:
    """A decay from 4 mm (or 4 mrad), or its derivative by time."""
    rate = GROWTH * 2 * np.pi * frequency
    return (size * rate**derivative * np.exp(rate * TIME + 0.4j)).real


def hum(size: float) -> np.ndarray:
    return size * sum(np.cos(2 * np.pi * f * TIME + f) for f in (126.0, 131.0, 138.0))


@pytest.mark.parametrize("order", [0, 2])
def test_band_keeps_the_motion_and_nothing_else(order):
    """Drift and hum of the size of the signal leave it untouched, its ends within half a percent of the first swing."""
    signal = motion(F, order)
    size = np.abs(signal).max()
    _, found = band_limited(TIME, signal + hum(0.5 * size) + 3 * size * (TIME / 12) ** 2, (4.5, 13.5), order)
    error = np.abs(found - motion(F)) / 0.004
    assert error.max() < 0.005
    assert error[500:-500].max() < 3e-4


def test_without_the_ends_led_on_they_would_be_wrong():
    """The guard that the test above can fail: the bare spectrum is wrong by a tenth at the start of a decay."""
    spectrum = np.fft.rfft(motion(F))
    grid = np.fft.rfftfreq(TIME.size, 1 / RATE)
    bare = np.fft.irfft(np.where((grid > 4.5) & (grid < 13.5), spectrum, 0), TIME.size)
    assert np.abs(bare - motion(F)).max() > 0.1 * 0.004


@pytest.mark.parametrize(("unit", "size"), [("m/s^2", 1.0), ("m/s2", 1.0), ("g", 9.80665), ("mg", 9.80665e-3)])
def test_acceleration(room, unit, size):
    content = csv(f"time [s],acceleration [{unit}]", TIME, motion(F, 2) / size)
    record = room.record("a.csv", content)
    assert np.abs(record.response * DEPTH - motion(F)).max() < 0.01 * 0.004
    assert record.band == pytest.approx((0.5 * 7.97, 1.7 * 7.97))


def test_angular_acceleration(room):
    content = csv("time [s],angular acceleration [deg/s^2]", TIME, np.rad2deg(motion(F_TORSION, 2)))
    record = room.record("a.csv", content, toml=TORSIONAL)
    assert np.abs(record.response - motion(F_TORSION)).max() < 0.01 * 0.004


def test_a_displacement_beside_an_acceleration_is_taken(room):
    content = csv("time [s],acceleration [m/s^2],displacement [m]", TIME, motion(F, 2), motion(F))
    record = room.record("a.csv", content)
    assert record.band is None
    assert record.response * DEPTH == pytest.approx(motion(F), abs=1e-12)
    chosen = room.record("a.csv", content, 'columns = { acceleration = "acceleration" }')
    assert chosen.band is not None


@pytest.mark.parametrize(
    ("header", "lines", "per_reading"),
    [
        ("displacement [V]", ['scale = "0.18 m/V"'], 0.18),
        ("displacement [mV]", ['scale = "0.18 m/V"'], 0.18e-3),
        ("displacement", ['scale = "180 mm/V"'], 0.18),  # the reading is in what it divides by
        ("displacement", ['scale = "180 mm/V"', 'units = { displacement = "mV" }'], 0.18e-3),
        ("displacement [mm]", ["scale = 0.5"], 0.5e-3),
        ("displacement [V]", ['scale = "20 V/m"'], 0.05),  # a sensitivity
    ],
)
def test_scale(room, header, lines, per_reading):
    record = room.record("a.csv", csv(f"time [s],{header}", TIME, motion(F)), *lines)
    assert record.response * DEPTH == pytest.approx(per_reading * motion(F), rel=1e-9)


def test_scale_of_an_accelerometer(room):
    """100 mV/g: its reading in volts is ten times the acceleration in g."""
    content = csv("time [s],acceleration [V]", TIME, motion(F, 2) / 9.80665 * 0.1)
    record = room.record("a.csv", content, 'scale = "100 mV/g"')
    assert np.abs(record.response * DEPTH - motion(F)).max() < 0.01 * 0.004


def test_band(room):
    record = room.record(
        "a.csv", csv("time [s],displacement [m]", TIME, motion(F) + hum(0.002)), 'band = "4.5-13.5 Hz"'
    )
    assert record.band == (4.5, 13.5)
    assert np.abs(record.response * DEPTH - motion(F)).max() < 0.01 * 0.004


def test_steps_that_vary_are_made_even(room):
    rng = np.random.default_rng(2)
    time = TIME + rng.uniform(-0.2, 0.2, TIME.size) / RATE
    rate = GROWTH * 2 * np.pi * F
    values = (0.004 * rate**2 * np.exp(rate * time + 0.4j)).real
    record = room.record("a.csv", csv("time [s],acceleration [m/s^2]", time, values))
    wanted = (0.004 * np.exp(rate * record.time + 0.4j)).real
    assert np.abs(record.response * DEPTH - wanted).max() < 0.01 * 0.004


PLAIN = csv("time [s],displacement [V]", TIME, motion(F))


@pytest.mark.parametrize(
    ("content", "lines", "message"),
    [
        (
            PLAIN,
            ['scale = "0.18 kg/V"'],
            r'scale: found "0.18 kg/V" for a column in V .*wanted a factor to displacement',
        ),
        (PLAIN, ["scale = true"], r"scale: found true; wanted a factor"),
        (PLAIN, ['scale = "0 m/V"'], r"a factor of zero"),
        (csv("time [s],acceleration", TIME, motion(F, 2)), ['scale = "100 mV/g"'], "a column without a unit"),
        (PLAIN, ['scale = "1 m/V"', 'band = "15 Hz"'], r'band: found "15 Hz"; wanted a band of frequencies'),
        (PLAIN, ['scale = "1 m/V"', 'band = "13-4 Hz"'], "the lower edge first"),
        (PLAIN, ['scale = "1 m/V"', 'band = "7-9 Hz"'], "wanted a band from 5.98 Hz or less to 10.4 Hz or more"),
        (
            csv("time [s],amplitude [m]", TIME, np.abs(motion(F))),
            ['band = "4-14 Hz"'],
            "an amplitude is filtered already",
        ),
        (
            csv("time [s],acceleration [m/s^2]", np.where(TIME > 6, TIME + 1, TIME), motion(F, 2)),
            [],
            "a gap of 1.002 s after 6 s; wanted an unbroken record",
        ),
    ],
)
def test_what_is_refused(room, content, lines, message):
    with pytest.raises(InputError, match=message):
        room.record("a.csv", content, *lines, toml=HEAVING)


def test_another_band_makes_no_other_record(room):
    """The very same samples would count twice."""
    lines = 'scale = "1 m/V"', 'band = "4-14 Hz"'
    toml = HEAVING + record("a.csv", lines[0]) + record("a.csv", *lines)
    with pytest.raises(InputError, match="the same record as tests"):
        room.load(toml, {"a.csv": PLAIN})
