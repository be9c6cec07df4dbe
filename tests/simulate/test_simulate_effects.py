"""Every disturbance of the equation of motion against its signature, measured from the simulated motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scruton.campaign import load_campaign
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.simulate import Disturbances, Noise, Truth, simulate_record, write_campaign
from scruton.simulate.equation import mean_rate

WIND = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065, 1.22, 5.036, -11.111, 0.03235)
TWIST = Truth(Motion.TORSIONAL, 1.08, 0.0908, 2.110, 3.162, 0.00096, 1.228, 3.4, -0.02, 0.04)
STILL = Truth(Motion.HEAVING, 0.3, 0.075, 7.292, 7.87, 0.0065)
A, RATE = WIND.balance()
CYCLE = 1.0 / 7.87
W0 = 2.0 * np.pi * 7.87
SHORT = {"initial_amplitude": 0.03, "duration": 2.0, "sample_rate": 200.0, "seed": 2}


def envelope(truth, disturbances, amplitude, cycles=8.0, **more):
    """Amplitude of every cycle at its middle, by least squares on sine and cosine: no part of the program."""
    fs = 64 * truth.frequency
    t, x = simulate_record(
        truth, initial_amplitude=amplitude, duration=cycles / truth.frequency, sample_rate=fs, seed=3,
        disturbances=disturbances, **more,
    )  # fmt: skip
    whole = (len(t) - 1) // 64
    angle = truth.omega * t[: whole * 64].reshape(whole, 64)
    design = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    y = x[: whole * 64].reshape(whole, 64)
    found = np.array([np.linalg.lstsq(d, one, rcond=None)[0] for d, one in zip(design, y, strict=True)])
    return (
        (np.arange(whole) + 0.5) / truth.frequency,
        np.hypot(*found.T),
        np.unwrap(np.arctan2(-found[:, 1], found[:, 0])),
    )


def rate_near(truth, disturbances, amplitude):
    """da/dt, and the amplitude that it belongs to, four cycles after a release."""
    t, a, _ = envelope(truth, disturbances, amplitude)
    middle = t.mean()
    fit = np.polyfit(t - middle, a, 4)
    return fit[3], fit[4]


def added(truth, disturbances, amplitude):
    """What disturbances add to da/dt, and the amplitude that it belongs to; the bare rate is the energy balance's."""
    rate, now = rate_near(truth, disturbances, amplitude)
    bare = -W0 * truth.damping_ratio * now if truth.still else -RATE * (now - A)
    return rate - bare, now


def test_forces_within_a_cycle_against_a_tight_integration():
    d = Disturbances(
        friction=0.8, friction_scale=0.05, quadratic_drag=3.0, displacement_drag=40.0, cubic_stiffness=5.0,
        linear_stiffness_slope=0.2,
    )  # fmt: skip
    t, x = simulate_record(STILL, initial_amplitude=0.06, duration=3.0, sample_rate=300.0, seed=5, disturbances=d)
    phase = np.random.default_rng(5).uniform(0, 2 * np.pi)

    def rhs(_, s):
        y, v = s
        return [
            v,
            -2 * 0.0065 * W0 * v - W0**2 * y * (1 + 0.2 * abs(y) + 5.0 * y**2)
            - 0.8 * np.tanh(v / 0.05) - 3.0 * abs(v) * v - 40.0 * y**2 * v,
        ]  # fmt: skip

    start = [0.06 * np.cos(phase), -0.06 * W0 * np.sin(phase)]
    want = solve_ivp(rhs, (0, 3.0), start, t_eval=t, rtol=1e-10, atol=1e-13, max_step=1e-3).y[0]
    np.testing.assert_allclose(x, want, atol=3e-5 * 0.06)


def test_aerodynamic_forces_against_a_tight_integration():
    d = Disturbances(aero_xxv=900.0, aero_vvv=0.4, aero_xv=20.0, aero_xxxxv=1e5)
    windy = replace(WIND, epsilon=1e-12)  # without the jump at rest
    t, x = simulate_record(windy, initial_amplitude=0.06, duration=2.0, sample_rate=300.0, seed=5, disturbances=d)
    phase = np.random.default_rng(5).uniform(0, 2 * np.pi)
    drag = windy.pressure * windy.Y1 * windy.passage - 2 * 0.0065 * W0

    def rhs(_, s):
        y, v = s
        return [v, (drag - 900 * y**2 - 0.4 * v**2 - 20 * abs(y) - 1e5 * y**4) * v - W0**2 * y]

    start = [0.06 * np.cos(phase), -0.06 * W0 * np.sin(phase)]
    want = solve_ivp(rhs, (0, 2.0), start, t_eval=t, rtol=1e-10, atol=1e-13, max_step=1e-3).y[0]
    np.testing.assert_allclose(x, want, atol=3e-5 * 0.06)


@pytest.mark.parametrize("truth", [WIND, STILL])
@pytest.mark.parametrize(("form", "scale"), [("tanh", 0.01 * A * W0), ("dahl", 0.01 * A)])
def test_friction_takes_the_same_from_every_amplitude(truth, form, scale):
    d = Disturbances(friction=0.5, friction_form=form, friction_scale=scale)
    for amplitude in (0.5 * A, A, 2.0 * A):
        assert added(truth, d, amplitude)[0] == pytest.approx(-2 * 0.5 / (np.pi * W0), rel=0.04)


def test_friction_holds_less_below_its_presliding_scale():
    d = Disturbances(friction=0.5, friction_scale=0.5 * A * W0)
    assert abs(added(STILL, d, 0.1 * A)[0]) < 0.2 * abs(added(STILL, d, 2 * A)[0])


@pytest.mark.parametrize(
    ("field", "power", "law", "in_still_air"),
    [
        ("quadratic_drag", 2, 4 / (3 * np.pi) * W0, True),
        ("displacement_drag", 3, 1 / 8, True),
        ("aero_xxv", 3, 1 / 8, False),
        ("aero_vvv", 3, 3 / 8 * W0**2, False),
        ("aero_xv", 2, 2 / (3 * np.pi), False),
        ("aero_xxxxv", 5, 1 / 16, False),
    ],
)
def test_damping_grows_with_its_power_of_the_amplitude(field, power, law, in_still_air):
    value = 0.2 * 2.0 ** (2 - power) * RATE * A / (law * A**power)
    d = Disturbances(**{field: value})
    for amplitude in (A, 2.0 * A):
        extra, now = added(WIND, d, amplitude)
        assert extra == pytest.approx(-law * value * now**power, rel=0.03)
        extra, now = added(STILL, d, amplitude)
        assert extra == pytest.approx(-law * value * now**power * in_still_air, rel=0.03, abs=1e-3 * RATE * A)


@pytest.mark.parametrize("truth", [WIND, TWIST])
def test_mean_rate_is_what_the_motion_does(truth):
    amplitude = truth.balance()[0]
    rate = truth.balance()[1]
    d = Disturbances(
        friction=0.3 * rate * amplitude * truth.omega, friction_scale=0.02 * amplitude * truth.omega,
        coherence_amplitude=0.5 * amplitude,
    )  # fmt: skip
    for a in (0.4 * amplitude, amplitude, 2.0 * amplitude):
        found, now = rate_near(truth, d, a)
        assert found == pytest.approx(mean_rate(truth, d, np.array([now]))[0], rel=0.01, abs=0.005 * rate * amplitude)


@pytest.mark.parametrize(
    ("d", "change"),
    [
        (Disturbances(cubic_stiffness=10.0), lambda a: 3 / 8 * 10.0 * a**2),
        (Disturbances(linear_stiffness_slope=-0.5), lambda a: -4 / (3 * np.pi) * 0.5 * a),
    ],
)
def test_stiffness_moves_the_frequency_with_the_amplitude(d, change):
    for truth in (STILL, WIND):
        for amplitude in (A, 2 * A):
            t, a, phase = envelope(truth, d, amplitude, cycles=6)
            bare = envelope(truth, None, amplitude, cycles=6)[2]
            assert np.polyfit(t, phase - bare, 1)[0] / W0 == pytest.approx(change(a.mean()), rel=0.05)


@pytest.mark.parametrize(
    ("form", "left"),
    [("exponential", lambda u: 1 - np.exp(-u)), ("tanh", np.tanh), ("algebraic", lambda u: u / np.hypot(1, u))],
)
def test_coherence_takes_the_drive_at_small_amplitude(form, left):
    d = Disturbances(coherence_amplitude=0.4 * A, coherence_form=form)
    for amplitude in (0.3 * A, A, 2.4 * A):
        extra, now = added(WIND, d, amplitude)
        want = -(1 - left(now / (0.4 * A))) * RATE * A
        assert extra == pytest.approx(want, rel=0.03, abs=2e-3 * RATE * A)
    assert simulate_record(STILL, **SHORT, disturbances=d)[1] == pytest.approx(simulate_record(STILL, **SHORT)[1])


def test_memory_speeds_growth_and_decay_and_leaves_the_stable_amplitude():
    d = Disturbances(memory_time=0.2 / RATE)
    for start in (0.15 * A, 2.4 * A):
        t, slow, _ = envelope(WIND, None, start, cycles=5 / RATE / CYCLE)
        _, quick, _ = envelope(WIND, d, start, cycles=5 / RATE / CYCLE)
        some = np.searchsorted(t, 1.2 / RATE)
        assert abs(quick[some] - A) < 0.9 * abs(slow[some] - A)
        assert quick[-1] == pytest.approx(A, rel=0.01)


def test_a_bump_damps_near_its_amplitude_alone():
    d = Disturbances(bump_rate=0.4 * RATE, bump_amplitude=0.6 * A, bump_width=0.1 * A)
    for truth, bump in ((WIND, d), (STILL, replace(d, bump_in_still_air=True))):
        extra, now = added(truth, bump, 0.6 * A)
        assert extra == pytest.approx(-0.4 * RATE * now * np.exp(-0.5 * ((now / A - 0.6) / 0.1) ** 2), rel=0.05)
    assert abs(added(WIND, d, 1.3 * A)[0]) < 2e-3 * RATE * A
    assert simulate_record(STILL, **SHORT, disturbances=d)[1] == pytest.approx(simulate_record(STILL, **SHORT)[1])


@pytest.mark.parametrize("form", ["linear", "cosine"])
def test_a_ramp_of_the_wind_carries_the_amplitude_along(form):
    cycles = 30 / RATE / CYCLE
    d = Disturbances(drift=0.2, drift_form=form)
    t, a, _ = envelope(WIND, d, A, cycles=cycles)
    for place, speed in ((0.5, 1.0), (0.98, 1.1)):
        now = float(np.interp(place * t[-1], t, a))
        then = replace(WIND, wind_speed=WIND.wind_speed * speed).balance()[0]
        assert now == pytest.approx(then, rel=0.02)  # the amplitude lags the wind a little
    assert simulate_record(STILL, **SHORT, disturbances=d)[1] == pytest.approx(simulate_record(STILL, **SHORT)[1])


@pytest.mark.parametrize(("field", "sign"), [("jump_drive", 1.0), ("jump_rate", -1.0)])
def test_a_jump_moves_the_amplitude_from_its_time_on(field, sign):
    cycles = 20 / RATE / CYCLE
    when = 10 / RATE
    d = Disturbances(jump_time=when, **{field: 0.2 * (RATE if field == "jump_rate" else 1.0)})
    t, a, _ = envelope(WIND, d, A, cycles=cycles)
    assert np.ptp(a[t < when - CYCLE]) < 0.01 * A
    want = A * 1.2 if sign > 0 else A / 1.2
    assert a[-1] == pytest.approx(want, rel=0.01)


def test_lock_in_comes_and_goes():
    d = Disturbances(spell_on=1.0 / RATE, spell_off=0.5 / RATE, spell_depth=1.0)
    t, a, _ = envelope(WIND, d, A, cycles=200 / RATE / CYCLE)
    slope = np.gradient(a, t) + RATE * a  # the drive
    off = slope < 0.5 * RATE * A
    assert np.mean(off) == pytest.approx(1 / 3, abs=0.1)
    assert np.median(np.abs(slope[off])) < 0.05 * RATE * A
    assert np.median(slope[~off]) == pytest.approx(RATE * A, rel=0.02)


def test_a_second_mode_adds_a_line_that_dies_out():
    d = Disturbances(second_amplitude=0.1 * A, second_frequency=10.0, second_rate=0.5, second_scatter=0.0)
    arguments = {"initial_amplitude": A, "duration": 8.0, "sample_rate": 200.0, "seed": 8, "noise": Noise(0.01)}
    t, bare = simulate_record(WIND, **arguments)
    line = simulate_record(WIND, **arguments, disturbances=d)[1] - bare
    spectrum = np.abs(np.fft.rfft(line * np.hanning(len(line))))
    assert np.fft.rfftfreq(len(line), 1 / 200.0)[np.argmax(spectrum)] == pytest.approx(10.0, abs=0.15)
    early, late = (np.abs(line[(t >= a) & (t < a + 0.5)]).max() for a in (0.0, 4.0))
    assert early == pytest.approx(0.1 * A, rel=0.05)
    assert late / early == pytest.approx(np.exp(-2.0), rel=0.05)
    kept = replace(d, second_amplitude=0.0, second_scatter=0.1 * A, second_rate=3.0)
    long = {**arguments, "duration": 200.0}
    rest = simulate_record(WIND, **long, disturbances=kept)[1] - simulate_record(WIND, **long)[1]
    assert rest.std() == pytest.approx(0.1 * A, rel=0.1)


def test_the_channel_scales_and_saturates():
    arguments = {"initial_amplitude": 2 * A, "duration": 5.0, "sample_rate": 200.0, "seed": 8, "noise": Noise(0.01)}
    x = simulate_record(WIND, **arguments)[1]
    np.testing.assert_allclose(
        simulate_record(WIND, **arguments, disturbances=Disturbances(gain=0.8))[1], 0.8 * x, atol=1e-12
    )
    clipped = simulate_record(WIND, **arguments, disturbances=Disturbances(clip_level=1.5 * A, clip_sharpness=10.0))[1]
    assert np.abs(clipped).max() < 1.5 * A
    small = np.abs(x) < 0.75 * A
    np.testing.assert_allclose(clipped[small], x[small], rtol=1e-3)


def test_shedding_off_the_response_beats():
    force = 0.3 * RATE * A * 2 * W0 / WIND.pressure
    shed = replace(WIND, shedding=force, shedding_frequency=1.04 * 7.87)
    t, a, _ = envelope(shed, None, A, cycles=400)
    a = a[t > 8 / RATE]
    spectrum = np.abs(np.fft.rfft((a - a.mean()) * np.hanning(len(a)), 8192))
    assert np.fft.rfftfreq(8192, 1.0)[np.argmax(spectrum)] == pytest.approx(0.04, rel=0.05)
    assert np.sqrt(2) * a.std() == pytest.approx(0.3 * A * RATE / np.hypot(RATE, 0.04 * W0), rel=0.15)


def test_a_wake_with_an_equation_of_its_own_drives_to_a_stable_amplitude():
    d = Disturbances(wake_share=1.0, wake_gain=2.0, wake_damping=0.2, wake_coupling=8.0)
    ends = [envelope(WIND, d, start * A, cycles=200)[1] for start in (0.3, 3.0)]
    assert ends[0][-1] == pytest.approx(ends[1][-1], rel=0.01)
    assert np.ptp(ends[0][-20:]) < 0.01 * ends[0][-1]
    assert simulate_record(STILL, **SHORT, disturbances=d)[1] == pytest.approx(simulate_record(STILL, **SHORT)[1])


def test_the_same_seed_gives_the_same_bytes():
    d = Disturbances(
        spell_on=0.5, spell_off=0.5, spell_depth=0.5, second_scatter=1e-3, second_frequency=9.0, second_rate=1.0
    )
    arguments = {"initial_amplitude": A, "duration": 5.0, "sample_rate": 200.0, "disturbances": d, "noise": Noise(0.01)}
    one, two = (simulate_record(WIND, **arguments, seed=np.random.SeedSequence(3))[1] for _ in range(2))
    assert one.tobytes() == two.tobytes()
    assert one.tobytes() != simulate_record(WIND, **arguments, seed=4)[1].tobytes()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"friction_form": "sticky"}, "friction_form is one of tanh, dahl; found 'sticky'"),
        ({"coherence_form": "step"}, "coherence_form is one of exponential, tanh, algebraic; found 'step'"),
        ({"drift_form": "sine"}, "drift_form is one of linear, cosine; found 'sine'"),
        ({"clip_sharpness": 0.0}, "clip_sharpness is positive; found 0.0"),
    ],
)
def test_what_cannot_be_is_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        Disturbances(**fields)


SPEC = """
format = 1
title = "one rig"
source = "simulated"
simulation = {{ sample_rate = 200.0, turbulence = 0.01 }}
section = {{ motion = "heaving", width = "0.3 m", depth = "0.075 m" }}
[[rigs]]
name = "1#"
mass = "7.292 kg/m"
frequency = "7.87 Hz"
damping_ratio = 0.0065
{rig}
records = [{{ file = "still.csv", kind = "free-decay", duration = 5.0, initial_amplitude = 0.05 }}]
[[tests]]
name = "a"
rig = "1#"
air_density = "1.22 kg/m^3"
wind_speed = "5.036 m/s"
truth = {{ Y1 = -11.111, epsilon = 0.03235 }}
records = [{{ file = "growth.csv", kind = "growth", duration = 5.0, initial_amplitude = 0.2 {record} }},
           {{ file = "decay.csv", kind = "decay", duration = 5.0, initial_amplitude = 2.0 }}]
"""


def specified(folder, rig="", record=""):
    folder.mkdir()
    path = folder / "spec.toml"
    path.write_text(SPEC.format(rig=rig, record=record))
    return load_campaign(write_campaign(path, folder / "made", seed=1))


def test_a_specification_may_disturb_a_rig_or_a_record(tmp_path):
    bare = specified(tmp_path / "bare")
    rigs = specified(tmp_path / "rig", rig="disturbances = { gain = 0.5 }")
    one = specified(tmp_path / "record", record=", disturbances = { gain = 0.5 }")
    for made, halved in ((rigs, (True, True, True)), (one, (False, True, False))):
        pairs = zip(
            (*made.rigs[0].records, *made.tests[0].records), (*bare.rigs[0].records, *bare.tests[0].records), halved,
            strict=True,
        )  # fmt: skip
        for got, want, half in pairs:
            np.testing.assert_allclose(got.response, (0.5 if half else 1.0) * want.response, atol=1e-6)


@pytest.mark.parametrize(
    ("rig", "message"),
    [
        ("disturbances = 3", r"rigs\[0\].disturbances: found 3; wanted a table"),
        ("disturbances = { wobble = 3 }", r"disturbances.wobble: found an unknown key; wanted some of: friction,"),
        ('disturbances = { friction = "much" }', r"disturbances.friction: found 'much'; wanted a number"),
        ("disturbances = { friction_form = 1 }", r"friction_form: found 1; wanted a value such as 'tanh'"),
        (
            'disturbances = { friction_form = "sticky" }',
            r"disturbances: found what cannot be \(friction_form is one of",
        ),
    ],
)
def test_a_specification_with_disturbances_that_are_none(tmp_path, rig, message):
    with pytest.raises(InputError, match=message):
        specified(tmp_path / "bad", rig=rig)
