from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from scruton.campaign.schema import Kind, Record
from scruton.envelope import assess, demodulate, record_cycles, relaxation
from scruton.envelope.lines import folded, folded_harmonics, second_line
from scruton.envelope.sampling import quantum_of
from scruton.errors import InputError

F, FS, STABLE, RATE = 8.0, 256.0, 0.05, 0.5


def envelope(t, first, rate=RATE):
    return STABLE * (1 + (first - 1) * np.exp(-rate * t))


def record(kind, first, seconds=12.0, seed=0, change=None, rate=RATE, add=None, chirp=0.0):
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * FS)) / FS
    turn = 2 * np.pi * F * (t + 0.5 * chirp * t * t / seconds)
    a = envelope(t, first, rate) if kind is not Kind.FREE_DECAY else STABLE * np.exp(-rate * t)
    y = a * np.cos(turn + 1) + 2e-4 * rng.normal(size=len(t))
    if add is not None:
        y = y + add(t)
    if change is not None:
        t, y = change(t, y)
    return Record("r1", Path("r1.csv"), kind, t, y, field="tests[0].records[0]")


def assessed(one, frequency=F, **options):
    return assess(one, record_cycles(one, frequency), **options)


def warned(word, *args, stable_amplitude=None, **kwargs):
    found = [w for w in assessed(record(*args, **kwargs), stable_amplitude=stable_amplitude).warnings if word in w]
    assert all(w.startswith("r1: ") and w.endswith(".") for w in found)
    return bool(found)


def test_what_a_good_record_looks_like():
    quality = assessed(record(Kind.DECAY, 3.0))
    assert quality.warnings == ()
    assert quality.name == "r1"
    assert quality.duration == pytest.approx(12.0, abs=0.01)
    assert quality.sample_rate == pytest.approx(FS)
    assert quality.cycles in (95, 96)
    assert quality.frequency == pytest.approx(F, rel=1e-3)
    assert quality.amplitude_range == (pytest.approx(STABLE, rel=0.02), pytest.approx(3 * STABLE, rel=0.1))
    assert quality.stable_amplitude == pytest.approx(STABLE, rel=0.02)
    assert quality.relaxation.time == pytest.approx(2.0, rel=0.02)
    assert quality.signal_to_noise == pytest.approx(0.06 / np.sqrt(2) / 2e-4, rel=0.3)
    assert quality.second_line is None or quality.second_line.relative < 0.01


def test_the_range_of_amplitudes_is_that_of_the_cycles_and_never_negative():
    """A growth and a decay are fastest at one end: a mean of five cycles there is another amplitude."""
    grown = record(Kind.GROWTH, 0.04, rate=2.0)
    cycles = demodulate(grown.time, grown.response)
    low, high = assess(grown, cycles).amplitude_range
    assert (low, high) == (cycles.amplitude.min(), cycles.amplitude.max())
    assert low == pytest.approx(cycles.amplitude[0], rel=1e-12)
    over = record(Kind.FREE_DECAY, 1.0, seconds=30.0)
    assert demodulate(over.time, over.response).amplitude.min() < 0.0, "noise alone"
    assert assessed(over).amplitude_range[0] == 0.0


def ou(rng, n, correlation_time, sd):
    p = np.exp(-1 / FS / correlation_time)
    return lfilter([sd * np.sqrt(1 - p * p)], [1, -p], rng.normal(size=n))


@pytest.mark.parametrize("kind", list(Kind))
def test_no_false_alarms_with_turbulence_noise_and_rounding(kind):
    rng = np.random.default_rng(11)
    alarms = []
    for i in range(25):
        rate = RATE * rng.uniform(0.5, 2)
        t = np.arange(int(FS * {Kind.STEADY: 40.0, Kind.FREE_DECAY: 4 / rate}.get(kind, 6 / rate))) / FS
        turbulence = (0.01, 0.03)[i % 2] if kind is not Kind.FREE_DECAY else 0.0
        first = {Kind.DECAY: 2.0, Kind.GROWTH: 0.15, Kind.STEADY: 1.0}.get(kind, 1.0)
        a = envelope(t, first, rate) if kind is not Kind.FREE_DECAY else STABLE * np.exp(-rate * t)
        a = a + STABLE * ou(rng, len(t), 1 / rate, turbulence)
        phase = np.cumsum(rng.normal(size=len(t))) * turbulence * np.sqrt(2 * rate / FS)
        y = a * np.cos(2 * np.pi * F * t + phase) + STABLE * (1e-3, 2e-2)[i % 3 == 0] * rng.normal(size=len(t))
        if i % 4 == 0:
            y = np.round(y / 1e-4) * 1e-4
        alarms += assessed(Record("r", Path("r"), kind, t, y)).warnings
    assert alarms == []


def test_decay_that_starts_too_low():
    assert warned("the decay starts at 1.", Kind.DECAY, 1.3)
    assert not warned("the decay starts", Kind.DECAY, 1.8)
    assert warned("the decay starts", Kind.DECAY, 1.8, stable_amplitude=STABLE * 1.5)


def test_growth_that_starts_too_high():
    assert warned("the growth starts at 0.5", Kind.GROWTH, 0.5)
    assert not warned("the growth starts", Kind.GROWTH, 0.2)


def test_record_shorter_than_three_relaxation_times():
    assert warned("relaxation times", Kind.DECAY, 3.0, seconds=4.0)
    assert warned("relaxation times", Kind.DECAY, 1.8, seconds=1.5)
    assert not warned("relaxation times", Kind.DECAY, 3.0, seconds=8.0)


def test_relaxation_matches_the_truth():
    found = relaxation(demodulate(record(Kind.GROWTH, 0.1).time, record(Kind.GROWTH, 0.1).response))
    assert found.rate == pytest.approx(RATE, rel=0.01)
    assert found.stable_amplitude == pytest.approx(STABLE, rel=0.005)
    assert found.residual_sd < 2e-4


def test_sampling_that_is_not_uniform():
    def jitter(t, y):
        moved = t + np.random.default_rng(1).uniform(-0.2, 0.2, len(t)) / FS
        return moved, np.interp(moved, t, y)

    assert warned("not uniform", Kind.DECAY, 3.0, change=jitter)
    assert not warned("not uniform", Kind.DECAY, 3.0)


def test_gaps():
    def hole(t, y):
        keep = (t < 5.0) | (t > 5.6)
        return t[keep], y[keep]

    def one_sample(t, y):
        return np.delete(t, 700), np.delete(y, 700)

    assert warned("1 gap in the record, the longest 0.6", Kind.DECAY, 3.0, change=hole)
    assert warned("1 gap", Kind.DECAY, 3.0, change=one_sample)
    assert not warned("gap", Kind.DECAY, 3.0)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (lambda t, y: (t, np.clip(y, -0.13, 0.13)), "above and below"),
        (lambda t, y: (t, np.minimum(y, 0.135)), "clipped above:"),
        (lambda t, y: (t, np.maximum(np.round(y / 1e-3) * 1e-3, -0.12)), "clipped below:"),
        (lambda t, y: (t, 0.07 * np.tanh(y / 0.05)), "above and below"),
    ],
    ids=["hard", "one side", "rounded", "soft"],
)
def test_clipping(change, where):
    assert warned(where, Kind.DECAY, 3.0, change=change)


@pytest.mark.parametrize("quantum", [1e-5, 1e-3, 5e-3])
@pytest.mark.parametrize("kind", [Kind.STEADY, Kind.DECAY])
def test_rounding_is_not_clipping(quantum, kind):
    first = 1.0 if kind is Kind.STEADY else 3.0
    assert not warned("clipped", kind, first, change=lambda t, y: (t, np.round(y / quantum) * quantum))


@pytest.mark.parametrize("samples", [2, 3])
def test_readings_that_are_held_are_said_to_be_and_are_no_clipping(samples):
    def change(t, y):
        return t, np.repeat(y[::samples], samples)[: y.size]

    assert warned(f"every reading stands for {samples} samples", Kind.DECAY, 3.0, change=change)
    assert not warned("clipped", Kind.DECAY, 3.0, change=change)
    assert not warned("every reading stands", Kind.DECAY, 3.0, change=lambda t, y: (t, np.round(y / 1e-2) * 1e-2))


def test_steps_that_no_noise_blurs_are_said_to_leave_amplitudes_off():
    def rounded(t, y):
        return t, np.round(y / 0.02) * 0.02

    def blurred(t, y):
        return rounded(t, y + 0.01 * np.random.default_rng(1).standard_normal(y.size))

    assert warned("the readings come in steps of 0.02,", Kind.STEADY, 1.0, change=rounded)
    assert not warned("the readings come in steps", Kind.STEADY, 1.0, change=blurred)
    assert not warned(
        "the readings come in steps", Kind.STEADY, 1.0, change=lambda t, y: (t, np.round(y / 5e-3) * 5e-3)
    )


def test_a_noiseless_sine_in_step_with_the_sampling_is_not_clipped():
    t = np.arange(4000) / FS
    assert assessed(Record("r", Path("r"), Kind.STEADY, t, np.cos(2 * np.pi * F * t))).warnings == ()


@pytest.mark.parametrize(
    ("frequency", "rate", "phase", "quantum"),
    [(5.0, 50.0, 0.3, 0.0), (4.0, 50.0, 0.3, 0.0), (5.0, 50.0, np.pi / 2, 1e-4), (1.25, 1000.0, 0.0, 7.4e-5)],
)
@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_every_crest_alike_is_not_clipping_and_a_clipped_one_is(frequency, rate, phase, quantum, noise):
    """Sampled in step with the motion, and rounded or not, the crests of a steady sine hold the same few samples."""
    t = np.arange(20 * int(rate)) / rate
    y = np.cos(2.0 * np.pi * frequency * t + phase) + noise * np.random.default_rng(2).standard_normal(t.size)

    def clipped(response):
        rounded = quantum * np.round(response / quantum) if quantum else response
        found = assessed(Record("r", Path("r"), Kind.STEADY, t, rounded), frequency).warnings
        return any("clipped" in line for line in found)

    assert not clipped(y)
    assert clipped(np.clip(y, -0.8, 0.8))


@pytest.mark.parametrize(("samples", "quantum"), [(800, 1e-4), (800, 3e-4), (42.4264, 1e-4), (800, 0.0)])
def test_the_quantum_of_a_sine_in_step_with_the_sampling(samples, quantum):
    y = 1.35 * np.cos(2.0 * np.pi * np.arange(16_000) / samples)
    assert quantum_of(quantum * np.round(y / quantum) if quantum else y) == pytest.approx(quantum)


def test_offset_and_drift():
    assert warned("has an offset of", Kind.DECAY, 3.0, add=lambda t: 0.05)
    assert warned("the mean drifts by", Kind.DECAY, 3.0, add=lambda t: 0.04 * t / 12.0)
    assert not warned("offset", Kind.DECAY, 3.0, add=lambda t: 0.005)
    assert not warned("drifts", Kind.DECAY, 3.0, add=lambda t: 0.005 * t / 12.0)


def test_frequency_drift():
    assert warned("the frequency drifts by", Kind.STEADY, 1.0, chirp=0.02)
    assert not warned("the frequency drifts", Kind.STEADY, 1.0, chirp=0.005)


@pytest.mark.parametrize("frequency", [8.35, 7.6, 4.4, 13.1, 50.0])
def test_second_line(frequency):
    def other(size):
        return lambda t: size * STABLE * np.cos(2 * np.pi * frequency * t)

    assert warned("a second line at", Kind.STEADY, 1.0, add=other(0.1), seconds=30.0)
    assert not warned("a second line", Kind.STEADY, 1.0, add=other(0.02), seconds=30.0)
    line = assessed(record(Kind.STEADY, 1.0, add=other(0.1), seconds=30.0)).second_line
    assert line.frequency == pytest.approx(frequency, abs=0.05)
    assert line.relative == pytest.approx(0.1, rel=0.25)
    assert line.harmonic == 0


def test_beating_in_a_free_decay():
    def other(t):
        return 0.3 * STABLE * np.exp(-0.2 * t) * np.cos(2 * np.pi * 8.8 * t)

    assert warned("a second line at 8.8", Kind.FREE_DECAY, 1.0, add=other, rate=0.2)
    assert not warned("a second line", Kind.FREE_DECAY, 1.0, rate=0.2)


def test_a_harmonic_is_called_one():
    assert warned("the harmonic of order 3", Kind.STEADY, 1.0, add=lambda t: 0.1 * STABLE * np.cos(6 * np.pi * F * t))


@pytest.mark.parametrize(
    ("frequency", "rate", "name"),
    [(49.9, 256.0, "(the mains of 50 Hz"), (40.1, 100.0, "(an alias of the mains of 60 Hz")],
)
def test_the_mains_are_named(frequency, rate, name):
    t = np.arange(30 * int(rate)) / rate
    y = STABLE * (np.cos(2 * np.pi * F * t) + 0.1 * np.cos(2 * np.pi * frequency * t))
    assert any(name in line for line in assessed(Record("r", Path("r"), Kind.STEADY, t, y)).warnings)


def test_what_is_beside_a_high_multiple_is_no_harmonic():
    assert warned("another motion", Kind.STEADY, 1.0, add=lambda t: 0.1 * STABLE * np.cos(2 * np.pi * 7.89 * F * t))


def test_envelope_record():
    t = np.arange(1200) / 100.0
    r = Record("e1", Path("e1.csv"), Kind.DECAY, t, envelope(t, 3.0), is_envelope=True, field="tests[0].records[1]")
    assert assessed(r).warnings == ()


def test_a_record_that_never_oscillates():
    r = Record("n", Path("n.csv"), Kind.STEADY, np.arange(3000) / FS, np.random.default_rng(0).normal(size=3000))
    with pytest.raises(InputError, match=r"n\.csv: .*wanted a record that oscillates"):
        record_cycles(r, F)


RESPONSE = 6.13  # Hz


@pytest.mark.parametrize("order", [7, 9, 17])
def test_an_alias_of_a_harmonic_is_that_harmonic(order):
    """Of a wave that is cut off, where samples are few: none is another motion."""
    line = folded(order * RESPONSE, 60.0)
    assert folded_harmonics(RESPONSE, 60.0)[order] == pytest.approx(line)
    found = second_line(*_sampled(order), demodulate(*_sampled(order)))
    assert found is not None
    assert found.frequency == pytest.approx(line, abs=0.05)
    assert found.harmonic == order


def _sampled(order):
    t = np.arange(0.0, 40.0, 1.0 / 60.0)
    motion = np.cos(2.0 * np.pi * RESPONSE * t) + 0.05 * np.cos(2.0 * np.pi * order * RESPONSE * t + 0.3)
    return t, motion + 1e-3 * np.random.default_rng(1).standard_normal(t.size)
