"""A phase that slips: what cuts, joins and blows do to a record, and what turbulence and a growth from rest do not."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign.schema import Kind, Record
from scruton.envelope import assess, record_cycles
from scruton.envelope.slips import phase_slip

F, FS, STABLE, RATE = 5.0, 200.0, 0.05, 0.6
CYCLE = round(FS / F)


def record(first, turbulence=0.01, seconds=30.0, seed=0):
    """Two quadratures that a white force moves about a stable amplitude: amplitude and phase walk, as they do."""
    rng, n = np.random.default_rng(seed), round(seconds * FS)
    z, steps = np.empty(n, dtype=complex), rng.standard_normal((n, 2)) @ [1.0, 1.0j]
    z[0] = first * STABLE
    push = turbulence * STABLE * np.sqrt(2.0 * RATE / FS)
    for i in range(n - 1):
        a = abs(z[i])
        z[i + 1] = z[i] + RATE * (STABLE - a) * z[i] / a / FS + push * steps[i]
    t = np.arange(n) / FS
    y = (z * np.exp(2j * np.pi * F * t)).real + 0.003 * STABLE * rng.standard_normal(n)
    return Record("r1", Path("r1.csv"), Kind.GROWTH if first < 1.0 else Kind.DECAY, t, y, field="tests[0].records[0]")


def without(one, begin, samples):
    """The record as it is where samples are lost and its time runs on."""
    response = np.delete(one.response, slice(begin, begin + samples))
    return replace(one, time=one.time[: response.size], response=response)


def slip_of(one):
    return phase_slip(record_cycles(one, F))


@pytest.mark.parametrize("first", [0.1, 2.2])
@pytest.mark.parametrize("part", [0.15, 0.35, -0.4])
def test_samples_that_are_lost_are_told_by_how_many_and_where(first, part):
    lost = 3 * CYCLE + round(part * CYCLE)
    found = slip_of(without(record(first), 1000, lost))
    assert found is not None
    assert found.time == pytest.approx(1000 / FS, abs=1.0 / F)
    assert found.cycles == pytest.approx(part, abs=0.05)


def test_whole_cycles_that_are_lost_turn_no_phase():
    assert slip_of(without(record(2.2), 1000, 4 * CYCLE)) is None


@pytest.mark.parametrize("first", [0.03, 0.15, 2.2])
@pytest.mark.parametrize("turbulence", [0.003, 0.01, 0.03])
def test_neither_turbulence_nor_a_growth_from_rest_slips(first, turbulence):
    assert [slip_of(record(first, turbulence, seed=seed)) for seed in range(8)] == [None] * 8


def test_a_record_of_a_few_cycles_says_nothing():
    assert slip_of(record(2.2, seconds=2.0)) is None


def test_check_says_where_and_what_may_be_done():
    one = without(record(2.2), 1000, 14)
    (warning,) = [w for w in assess(one, record_cycles(one, F)).warnings if "slips" in w]
    assert re.match(r"r1: the phase slips by 0\.3[3-7] of a cycle from one cycle to the next, at (5|4\.9)", warning)
    assert "samples were lost" in warning
    assert "`start` and `stop`" in warning
    clean = record(2.2)
    assert not any("slips" in w for w in assess(clean, record_cycles(clean, F)).warnings)
