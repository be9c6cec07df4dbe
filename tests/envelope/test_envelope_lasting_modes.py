"""What stands in narrow bands beside a motion, and is taken out of its record."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from scruton.campaign.schema import Kind, Record
from scruton.envelope import record_cycles
from scruton.envelope.lasting_modes import lasting_modes, remark_on_lasting, without_lasting_modes
from scruton.envelope.other_modes import Tracked

F0, RATE = 6.65, 100.0  # fifteen samples a cycle: what hum leaves of one changes its sign in the next
TIME = np.arange(0.0, 60.0, 1.0 / RATE)


def record_of(response):
    noise = 5e-5 * np.random.default_rng(3).standard_normal(TIME.size)
    return Record("r.csv", Path("r.csv"), Kind.STEADY, TIME, response + noise)


def motion(scatter=0.0):
    slow = np.interp(TIME, TIME[::250], np.random.default_rng(5).standard_normal(TIME[::250].size))
    return 0.05 * (1.0 + scatter * slow) * np.sin(2.0 * np.pi * F0 * TIME)


def kept_up(ratio, size, damping=0.004):
    """A mode driven by white noise."""
    turn = 2.0 * np.pi * ratio * F0 / RATE
    fall = np.exp(-damping * turn)
    driven = lfilter(
        [1.0], [1.0, -2.0 * fall * np.cos(turn), fall**2], np.random.default_rng(1).standard_normal(TIME.size)
    )
    return size * 0.05 * driven / driven.std()


def cleared(record):
    track = record_cycles(record, F0)
    less = without_lasting_modes(Tracked(record, track), lambda left: record_cycles(left, F0))
    return track, less.record, less.cycles


@pytest.mark.parametrize("ratio", [1.31, 1.5, 2.5, 0.6])
def test_a_mode_that_is_kept_up_is_taken_out(ratio):
    record = record_of(motion() + kept_up(ratio, 0.03))
    before, left, after = cleared(record)
    (mode,) = after.lasting
    assert mode.frequency == pytest.approx(ratio * F0, rel=0.02)
    assert 0.02 < mode.relative < 0.08
    assert after.amplitude.std() < before.amplitude.std() / 2.0
    assert "another mode" in remark_on_lasting(record, after).text
    assert left.response.std() == pytest.approx(record.response.std(), rel=0.01)


def test_hum_is_taken_out_and_is_no_mode():
    record = record_of(motion() + 2e-3 * np.sin(2.0 * np.pi * 50.03 * TIME + 1.0))
    before, _, after = cleared(record)
    assert not after.lasting
    assert after.amplitude.std() < before.amplitude.std() / 2.0


@pytest.mark.parametrize("beside", [0.0, 1.12, 2.0, 3.0])
def test_what_is_the_motions_own_stays(beside):
    """Its scatter, a force that beats with it, and its harmonics."""
    record = record_of(motion(0.01) + 0.05 * 0.02 * np.sin(2.0 * np.pi * beside * F0 * TIME))
    assert lasting_modes(Tracked(record, record_cycles(record, F0))) == ([], [])
