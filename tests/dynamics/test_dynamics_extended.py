"""The filter with effects: against the plain filter of the bare law, and against a point-mass filter."""

from dataclasses import replace

import numpy as np
import pytest
from grid_filter import grid_log_likelihood, gusty_innovations, motion
from numba import njit
from scipy.linalg import expm
from scipy.special import ive

from scruton.dynamics import row
from scruton.dynamics.cycles import ABSENT, Channels, EnvelopeData
from scruton.dynamics.drive_moments import NEAR, gust_decay, moments_of_all
from scruton.dynamics.effect_drift import effect_drift
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.extended import channel_innovations
from scruton.dynamics.filter import innovations_of
from scruton.dynamics.friction import hysteresis, spring
from scruton.dynamics.laws.law import Law
from scruton.dynamics.likelihood import Wind, innovations, pointwise_log_likelihood
from scruton.dynamics.reading import saturated_reading

A_STAR, LAM, PERIOD = 0.05, 0.5, 0.125


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def channels(y, se, period=PERIOD, phase=None, third=None):
    n = len(y)
    t = np.arange(n) * period
    return Channels(
        amplitude=np.asarray(y, float), standard_error=np.full(n, se), phase=np.zeros(n) if phase is None else phase,
        third=np.zeros(n) if third is None else third, third_error=np.full(n, se), gap=np.r_[-1.0, np.zeros(n - 1)],
        period=np.full(n, period), time=t, place=t / t[-1] - 0.5, record=np.zeros(n, dtype=np.intp),
        omega=np.full(n, 2 * np.pi / period), has_phase=np.ones(n, dtype=bool),
        knots=np.linspace(np.log(0.003), np.log(0.15), HATS),
    )  # fmt: skip


def bare_table(q, **terms):
    table = np.zeros((1, 1, COLUMNS))
    values = {"AERO": LAM, "DRIVE": LAM * A_STAR, "SCATTER": q, "NOISE": 1.0, "PHASE_SCATTER": q, "THIRD_NOISE": 1.0}
    for name, value in (values | terms).items():
        table[0, 0, Term[name]] = value
    return table


EFFECTS = {
    "bare": ({}, lambda a: 0.0),
    "friction": ({"FRICTION": 0.004, "FRICTION_WIDTH": 1e-4}, lambda a: -0.004 * a / np.sqrt(a * a + 1e-8)),
    "hysteresis": (
        {"FRICTION": 0.004, "FRICTION_WIDTH": 0.005, "FRICTION_SPRING": 1e-3},
        lambda a: -0.004 * (1.0 - np.tanh(a / 0.005) / (a / 0.005)),
    ),
    "quadratic": ({"STRUCTURAL_LINEAR": 2.0}, lambda a: -2.0 * a * a),
    "cubic": ({"AERO_SQUARE": 40.0}, lambda a: -40.0 * a**3),
    "fifth": ({"AERO_FOURTH": 8000.0}, lambda a: -8000.0 * a**5),
    "coherence": ({"COHERENCE": 0.02}, lambda a: -LAM * A_STAR * np.exp(-a / 0.02)),
    "coherence to a floor": (
        {"COHERENCE": 0.02, "COHERENCE_POWER": 2.0, "COHERENCE_FLOOR": 0.3},
        lambda a: -0.7 * LAM * A_STAR * (1.0 - a / np.hypot(a, 0.02)),
    ),
    "friction of a power": (
        {"FRICTION": 0.002, "FRICTION_WIDTH": 1e-4, "FRICTION_POWER": -0.3},
        lambda a: -0.002 * a**-0.3 * a / np.sqrt(a * a + 1e-8),
    ),
    "friction less at speed": (
        {"FRICTION": 0.002, "FRICTION_WIDTH": 1e-4, "FRICTION_HUMP": 0.5, "FRICTION_HUMP_AT": 0.03},
        lambda a: -0.002 * (1.0 + 0.5 / (1.0 + (a / 0.03) ** 2)) * a / np.sqrt(a * a + 1e-8),
    ),
    "law of a power": ({"LAW_POWER": -2.0, "LAW_EXPONENT": 0.7}, lambda a: -2.0 * a**1.7),
    "levels": (
        {"STRUCTURAL_RISE": 0.2, "STRUCTURAL_KNEE": 0.03, "STRUCTURAL_POWER": 2.0},
        lambda a: -0.2 * a**3 / (a * a + 9e-4),
    ),
    "bump": (
        {"BUMP": 0.1, "BUMP_AT": float(np.log(0.7 * A_STAR)), "BUMP_WIDTH": 0.3},
        lambda a: -0.1 * a * np.exp(-0.5 * (np.log(a / (0.7 * A_STAR)) / 0.3) ** 2),
    ),
}


def by_turns(first):
    """Every effect as growth or as decay, by turns; the other start of each is slow."""
    starts = (0.15, 2.0)
    return [
        pytest.param(name, start, marks=pytest.mark.slow if (i + k + first) % 2 else ())
        for i, name in enumerate(EFFECTS)
        for k, start in enumerate(starts)
    ]


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "start"), by_turns(0))
def test_filter_against_a_grid_filter(rng, name, start):
    """To 0.1 in log likelihood per 100 cycles, as growth and decay, with 2 % turbulence scatter."""
    terms, more = EFFECTS[name]
    q, se = 0.02 * A_STAR * np.sqrt(2 * LAM), 0.0004

    def rate(a):
        return LAM * (A_STAR - a) + more(a)

    y = motion(rng, rate, q, se, start * A_STAR)
    data = channels(y, se)
    v, s = channel_innovations(data, bare_table(q, **terms), initial_sd=0.3)
    got = pointwise_log_likelihood(v[0, :100], s[0, :100]).sum()
    assert got == pytest.approx(grid_log_likelihood(data, rate, q, 1.0, 0.3), abs=0.1)


@njit
def _with_effects(a, c):
    n = COLUMNS
    return effect_drift(a, a, c[:n], c[n], c[n + 1], c[n + 2], c[n + 3] > 0.5, c[n + 4 :])


ALONE = {
    "friction": {"FRICTION": 0.004, "FRICTION_WIDTH": 1e-3},
    "hysteresis": {"FRICTION": 0.004, "FRICTION_WIDTH": 0.01, "FRICTION_SPRING": 1e-3},
    "structural": {"STRUCTURAL": 0.05, "STRUCTURAL_LINEAR": 1.0, "STRUCTURAL_SQUARE": 10.0},
    "aerodynamic": {"AERO_LINEAR": 1.0, "AERO_SQUARE": 10.0, "AERO_FOURTH": 500.0},
    "friction of a power": {"FRICTION": 0.004, "FRICTION_WIDTH": 1e-3, "FRICTION_POWER": -0.3},
    "friction less at speed": {
        "FRICTION": 0.004,
        "FRICTION_WIDTH": 1e-3,
        "FRICTION_SPRING": 1e-3,
        "FRICTION_HUMP": 0.5,
        "FRICTION_HUMP_AT": 0.03,
    },
    "law of a power": {"LAW_POWER": -1.0, "LAW_EXPONENT": 0.7},
    "coherence": {"COHERENCE": 0.02},
    "coherence to a floor": {"COHERENCE": 0.02, "COHERENCE_POWER": 1.0, "COHERENCE_FLOOR": 0.3},
    **{
        f"coherence as {power}": {"COHERENCE": 0.02, "COHERENCE_POWER": power, "COHERENCE_FLOOR": 0.1}
        for power in (2.0, 2.5, 3.0)
    },
    "rises": {"STRUCTURAL_RISE": 0.2, "STRUCTURAL_KNEE": 0.03, "STRUCTURAL_POWER": 0.5},
    "levels": {"STRUCTURAL_RISE": 0.2, "STRUCTURAL_KNEE": 0.03, "STRUCTURAL_POWER": 1.0},
    "falls": {"STRUCTURAL_RISE": -0.2, "STRUCTURAL_KNEE": 0.03, "STRUCTURAL_POWER": 0.0},
    "levels later": {"STRUCTURAL_RISE": 0.2, "STRUCTURAL_KNEE": 0.03, "STRUCTURAL_POWER": 2.0},
    "trend": {"TREND": 0.1, "TREND_SINE": 0.05, "TREND_DRIVE": 0.05},
    "arch": {"TREND_ARCH": 0.1, "TREND_DRIVE_ARCH": -0.2},
    "jump": {"JUMP": 0.1, "JUMP_RATE": 0.1, "JUMP_TIME": 4.0},
    "warming": {"WARMING": 0.1, "WARMING_PACE": 2.0},
    "settling": {"TREND_SETTLING": 0.2, "TREND_DRIVE_SETTLING": -0.1, "TREND_PACE": 3.0},
    "forcing": {"FORCE_COS": 0.002, "FORCE_SIN": 0.001, "FORCE_RATE": 1.0},
    "gain": {"GAIN": 0.1},
    "line": {"LINE_COS": 0.002, "LINE_SIN": 0.001, "LINE_RATE": 3.0, "LINE_DECAY": 0.2},
    "hats": {Term(Term.HAT).name: 0.05},
    "bump": {"BUMP": 0.1, "BUMP_AT": float(np.log(0.7 * A_STAR)), "BUMP_WIDTH": 0.2},
}


@pytest.mark.parametrize("start", [0.3, 1.6])
@pytest.mark.parametrize("name", ALONE)
def test_every_effect_against_the_plain_filter(rng, name, start):
    """With the effect's drift as a law, what varies in time as parameters of every cycle, the line and gain taken off.

    The first cycles differ by how half a cycle is stepped, the later by the flow's curvature, which is left out here.
    Memory has a state of its own and saturation a curved reading: those the plain filter does not know.
    """
    q, se = 0.02 * A_STAR * np.sqrt(2 * LAM), 0.0004
    data = channels(motion(rng, lambda a: LAM * (A_STAR - a), q, se, start * A_STAR, steps=50), se)
    table = bare_table(q, **ALONE[name])
    v, s = channel_innovations(data, table, initial_sd=0.3)
    c, size = table[0, 0], data.size
    turn, chi = c[Term.LINE_RATE] * data.time, c[Term.FORCE_RATE] * data.time
    line = (c[Term.LINE_COS] * np.cos(turn) + c[Term.LINE_SIN] * np.sin(turn)) * np.exp(-c[Term.LINE_DECAY] * data.time)
    force = c[Term.FORCE_COS] * np.cos(chi) + c[Term.FORCE_SIN] * np.sin(chi)
    late = np.clip((data.time - c[Term.JUMP_TIME]) / data.period + 0.5, 0.0, 1.0)
    hats = np.full(size, float(name in ("hats", "bump")))
    rows = np.column_stack([np.tile(c, (size, 1)), data.place, late, force, hats, np.tile(data.knots, (size, 1))])
    gain = 1.0 + c[Term.GAIN]
    read = replace(data, amplitude=(data.amplitude - line) / gain, standard_error=data.standard_error / gain)
    plain_v, plain_s = innovations_of(
        Law("with effects", _with_effects, {}), read, rows[None], np.array([q]), np.ones(1), initial_sd=0.3,
        rows=np.arange(size),
    )  # fmt: skip
    np.testing.assert_allclose(v[0, 1:size], gain * plain_v[1:, 0], atol=0.05 * se)
    np.testing.assert_allclose(v[0, 30:size], gain * plain_v[30:, 0], atol=(0.02 if name == "hats" else 1e-3) * se)
    np.testing.assert_allclose(s[0, 5:size], gain**2 * plain_s[5:, 0], rtol=2e-3 if name == "hats" else 1e-4)


def test_effects_side_by_side_are_those_alone(rng):
    """Each term goes over all walkers in a loop of its own, and the wake that remembers takes them one by one."""
    q, se = 0.02 * A_STAR * np.sqrt(2 * LAM), 0.0004
    data = channels(motion(rng, lambda a: LAM * (A_STAR - a), q, se, 0.3 * A_STAR), se)
    several = {name: value for effect in ALONE.values() for name, value in effect.items() if name != "FRICTION_SPRING"}
    lagging = {"LAG": 2.0, "LAG_START": 1.0}
    for effects in (list(ALONE.values()), [*ALONE.values(), lagging], [several, several | lagging, {}]):
        tables = [bare_table(q, **effect) for effect in effects]
        v, s = channel_innovations(data, np.concatenate(tables), initial_sd=0.3)
        for table, v_there, s_there in zip(tables, v, s, strict=True):
            alone_v, alone_s = channel_innovations(data, table, initial_sd=0.3)
            np.testing.assert_allclose(v_there, alone_v[0], rtol=1e-8, atol=1e-8 * se)
            np.testing.assert_allclose(s_there, alone_s[0], rtol=1e-8)


def test_bare_filter_is_that_of_the_paper_law(rng):
    """Where the noise-induced drift is negligible the innovations are those of the exact linear filter.

    The first cycle, which fixes a diffuse state, is treated to another order; a few cycles later that is forgotten.
    """
    q, se = 1e-5, 2e-4
    y = motion(rng, lambda a: LAM * (A_STAR - a), q, se, 0.1, steps=50)
    data = channels(y, se)
    plain = EnvelopeData(y, data.standard_error, data.gap, data.period, data.time, np.repeat("a", y.size))
    v, s = innovations(plain, *(np.array([x]) for x in (A_STAR, LAM, q, 1.0)), initial_sd=100.0)
    got_v, got_s = channel_innovations(data, bare_table(q), initial_sd=100.0)
    np.testing.assert_allclose(got_v[0, 1:100], v[1:, 0], atol=0.05 * se)
    np.testing.assert_allclose(got_v[0, 30:100], v[30:, 0], atol=2e-3 * se)
    np.testing.assert_allclose(got_s[0, 30:100], s[30:, 0], rtol=2e-3)


# Standard deviation of the drive's gusts and of its offset, over the drive; relaxation times of the gust.
WINDS = [(0.03, 0.0, 2.0), (0.03, 0.0, 0.4), (0.0, 0.02, 1.0), (0.02, 0.01, 6.0)]


def wind_terms(gust, offset, times):
    return {"GUST": gust * LAM * A_STAR, "GUST_RATE": LAM / times, "SET_POINT": offset * LAM * A_STAR}


@pytest.mark.parametrize("pause", [0.0, 0.7])
@pytest.mark.parametrize("wind", WINDS)
def test_gusts_and_set_points_are_those_of_the_paper_law(rng, wind, pause):
    """The exact linear filter has its gusts in the stable amplitude; without noise-induced drift they are the same.

    A gap is stepped through by the midpoint rule here.
    """
    gust, offset, times = wind
    q, se = 1e-5, 2e-4
    y = motion(rng, lambda a: LAM * (A_STAR - a), 0.02 * A_STAR, se, 0.1, steps=50)
    data = channels(y, se)
    data.gap[[20, 60]] = pause
    plain = EnvelopeData(y, data.standard_error, data.gap, data.period, data.time, np.repeat("a", y.size))
    theta = [np.array([x]) for x in (A_STAR, LAM, q, 1.0)]
    wanted = gust * A_STAR, LAM / times, offset * A_STAR
    v, s = innovations(plain, *theta, Wind(*wanted), initial_sd=100.0)
    without, _ = innovations(plain, *theta, initial_sd=100.0)
    got_v, got_s = channel_innovations(data, bare_table(q, **wind_terms(*wind)), initial_sd=100.0)
    np.testing.assert_allclose(got_v[0, 1:100], v[1:, 0], atol=0.05 * se)
    np.testing.assert_allclose(got_v[0, 65:100], v[65:, 0], atol=(1e-2 if pause else 2e-3) * se)
    np.testing.assert_allclose(got_s[0, 65:100], s[65:, 0], rtol=2e-3)
    assert np.abs(v - without)[65:].max() > 0.3 * se


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "start"), by_turns(1))
def test_gusts_with_an_effect_against_small_steps(rng, name, start):
    """Linearised along the mean, with all states side by side; the first cycles differ by how half a cycle is stepped.

    In a gap the noise of a step is taken to first order: to 1.5 % in the cycle after it.
    """
    terms, more = EFFECTS[name]
    q, se = 0.01 * A_STAR * np.sqrt(2 * LAM), 0.0004

    def rate(a):
        return LAM * (A_STAR - a) + more(a)

    y = motion(rng, rate, 2 * q, se, start * A_STAR, steps=50)
    data = channels(y, se)
    data.gap[50] = 0.4
    drive = {"gust": 0.03 * LAM * A_STAR, "fade": LAM / 2, "offset": 0.01 * LAM * A_STAR}
    v, s = gusty_innovations(data, rate, q, 1.0, **drive)
    columns = dict(zip(("GUST", "GUST_RATE", "SET_POINT"), drive.values(), strict=True))
    got_v, got_s = channel_innovations(data, bare_table(q, **terms, **columns), initial_sd=0.3)
    np.testing.assert_allclose(got_v[0, 5:100], v[5:], atol=0.05 * se)
    np.testing.assert_allclose(got_s[0, 5:50], s[5:50], rtol=1e-3)
    np.testing.assert_allclose(got_s[0, 50:100], s[50:], rtol=0.02)


@njit
def _moments(x, dt):
    gust_decay(x, dt)
    moments_of_all(x, dt, True)


RATES = [-0.9, -0.3, -1e-9, 0.0, 1e-9, 0.4, 0.62]


@pytest.mark.parametrize("fade", [0.05, 0.4, 1.5])
def test_moments_of_a_drive_are_those_of_the_matrix_exponential(fade):
    """Of (amplitude, gust, offset, mean amplitude), as Van Loan has them: what forgets, what grows, what stays.

    All rates side by side: some in reach of the series, some not.
    """
    dt, x = 0.5, np.zeros((row.ROWS, row.LANES))
    x[row.FADE], x[row.RATE, : len(RATES)] = fade, RATES
    x[row.HALF_LOSS] = 0.5 * dt * x[row.RATE]
    _moments(x, dt)
    for w, rate in enumerate(RATES):
        along = np.array([[-rate, 1, 1, 0], [0, -fade, 0, 0], [0, 0, 0, 0], [1 / dt, 0, 0, 0]])
        flow, gathered = van_loan(along, np.diag([0.0, 2 * fade, 0.0, 0.0]), dt)
        wanted = {
            "PHI": flow[0, 0], "HALF": np.exp(-0.5 * rate * dt), "KEEP": flow[1, 1], "PUSH": flow[0, 1],
            "PUSH_MEAN": flow[3, 1], "HOLD": flow[0, 2], "HOLD_MEAN": flow[3, 2], "DD": gathered[0, 0],
            "DH": gathered[0, 1], "HH": gathered[1, 1], "DM": gathered[0, 3], "HM": gathered[1, 3],
            "MM": gathered[3, 3],
        }  # fmt: skip
        _, gathered = van_loan(along, np.diag([1.0, 0.0, 0.0, 0.0]), dt)
        wanted |= {"Q_END": gathered[0, 0], "Q_CROSS": gathered[0, 3], "Q_MEAN": gathered[3, 3]}
        got = {name: x[getattr(row, name), w] for name in wanted}
        assert got == pytest.approx(wanted, rel=1e-6), rate


def van_loan(along, diffusion, dt):
    """What is left of the states of a linear equation after dt, and the covariance that unit noise has built up."""
    size = len(along)
    both = expm(np.block([[-along, diffusion], [np.zeros((size, size)), along.T]]) * dt)
    return both[size:, size:].T, both[size:, size:].T @ both[:size, size:]


def test_series_and_closed_forms_of_the_moments_meet():
    """Where one takes over from the other the numbers do not jump: differences of the likelihood are taken there."""
    dt, step = 0.5, 1e-9
    x = np.zeros((row.ROWS, row.LANES))
    x[row.FADE] = 0.2
    x[row.RATE, :4] = np.array([NEAR - step, NEAR + step, step - NEAR, -step - NEAR]) / dt
    x[row.RATE, 2:4] += 0.2
    x[row.HALF_LOSS] = 0.5 * dt * x[row.RATE]
    _moments(x, dt)
    for moment in x[row.PHI : row.FAR]:
        np.testing.assert_allclose(moment[0:4:2], moment[1:4:2], rtol=2e-8)


def test_rows_that_leave_a_channel_alone_are_copied_exactly(rng):
    """What the first row's neighbours share with it is copied: the same numbers as when every row is run by itself."""
    q, se = 2e-4, 2e-4
    y = motion(rng, lambda a: LAM * (A_STAR - a), q, se, 0.1, steps=20)
    wander, flat = np.cumsum(0.01 * rng.standard_normal(100)), 1e-4 * rng.standard_normal(100)
    data = channels(y, se, phase=wander, third=flat)
    rows = [bare_table(q), bare_table(q, STIFFNESS=3.0), bare_table(q, THIRD=0.01), bare_table(q, AERO=0.6)]
    rows += [bare_table(q, DETUNING=1e-3), bare_table(q)]
    rows += [bare_table(q, **wind_terms(0.02, 0.01, 2.0)), bare_table(q, FRICTION=0.004, FRICTION_WIDTH=1e-4)]
    rows += [bare_table(q, CLIP=0.08), bare_table(q, FORCE_COS=0.002, FORCE_RATE=1.0), bare_table(q, AERO=5.0)]
    rows += [bare_table(q, DRIVE=(1.0 + 0.02 * k) * LAM * A_STAR) for k in range(12)]
    together = channel_innovations(data, np.concatenate(rows))
    for k, alike in enumerate(rows):
        alone = channel_innovations(data, alike)
        np.testing.assert_array_equal(together[0][k], alone[0][0])
        np.testing.assert_array_equal(together[1][k], alone[1][0])


def test_a_filter_that_loses_its_way_says_so_by_what_is_no_number(rng):
    """Amplitudes that run away, with every kind of term beside: nothing is raised, and neighbours are as they were."""
    y = motion(rng, lambda a: LAM * (A_STAR - a), 2e-4, 2e-4, 0.1, steps=20)
    data = channels(y, 2e-4)
    away = {"AERO_SQUARE": -1e6, "AERO_FOURTH": -1e9}
    rows = [{}, away, away | {Term(Term.HAT).name: 0.05}, away | {"FRICTION": 0.004, "FRICTION_WIDTH": 1e-4}]
    rows += [away | {"CLIP": 0.06, "CLIP_SOFT": 1.0}, away | {"COHERENCE": 0.02, "LAG": 0.4}, away | {"GUST": 0.01}]
    table = np.concatenate([bare_table(2e-4, GUST_RATE=0.2, **terms) for terms in rows])
    v, _ = channel_innovations(data, table)
    alone, _ = channel_innovations(data, table[:1])
    np.testing.assert_array_equal(v[0], alone[0])
    assert np.isfinite(v[0]).all()
    assert not np.isfinite(v[1:]).all(axis=1).any()


def test_stiffness_shows_in_the_phase():
    """The phase's innovations vanish where the frequency follows the amplitude as stated, and not otherwise."""
    t = np.arange(120) * PERIOD
    a = A_STAR * (1 + np.exp(-LAM * t))
    pace = 2 * np.pi / PERIOD * 2.0 * a**2
    phase = np.concatenate([[0.0], np.cumsum(pace[1:] * PERIOD)])
    data = channels(a, 1e-5, phase=phase)
    n = a.size
    right, _ = channel_innovations(data, bare_table(1e-6, STIFFNESS=2.0))
    wrong, _ = channel_innovations(data, bare_table(1e-6))
    assert np.abs(right[0, n + 1 : 2 * n]).max() < 1e-9
    assert np.abs(wrong[0, n + 1 : 2 * n]).max() > 1e-3


@pytest.mark.parametrize("width", [0.002, 0.05])
def test_friction_that_builds_up_shows_in_the_phase(width):
    """As a spring that is softer the larger the amplitude, on both sides of where its Bessel function changes form."""
    t = np.arange(120) * PERIOD
    a = A_STAR * (0.1 + np.exp(-LAM * t))
    pace = 2 * np.pi / PERIOD * 1e-3 / a * (1.0 + np.tanh(a / width)) * ive(1, a / width)
    data = channels(a, 1e-6, phase=np.concatenate([[0.0], np.cumsum(pace[1:] * PERIOD)]))
    friction = {"FRICTION": 1e-9, "FRICTION_WIDTH": width}
    right, _ = channel_innovations(data, bare_table(1e-6, FRICTION_SPRING=1e-3, **friction))
    wrong, _ = channel_innovations(data, bare_table(1e-6, **friction))
    phase = slice(a.size + 1, 2 * a.size)
    assert np.abs(right[0, phase]).max() < 1e-5
    assert np.abs(wrong[0, phase]).max() > 1e-2


@pytest.mark.parametrize("r", [0.01, 0.3, 3.7, 3.8, 40.0])
def test_dahls_loop_has_its_closed_form(r):
    """First harmonic of the force that follows x = r cos(theta), stepped in the displacement on its loop."""
    theta = np.linspace(0.0, 8 * np.pi, 80_001)
    x, z = r * np.cos(theta), np.full(theta.size, np.tanh(r))
    for i, dx in enumerate(np.diff(x)):
        side = np.sign(dx)
        z[i + 1] = side + (z[i] - side) * np.exp(-abs(dx))
    last = slice(60_000, 80_000)
    with_x, against_v = (2 * np.mean(z[last] * wave(theta[last])) for wave in (np.cos, lambda t: -np.sin(t)))
    loss, slope = hysteresis(r)
    assert 4 / np.pi * loss == pytest.approx(against_v, rel=1e-3)
    assert 2 * spring(r) == pytest.approx(with_x, rel=1e-3)
    assert slope == pytest.approx((hysteresis(1.001 * r)[0] - hysteresis(0.999 * r)[0]) / (0.002 * r), rel=1e-3)


@pytest.mark.parametrize("level", [0.06, 0.09, 0.2])
@pytest.mark.parametrize("soft", [-3.0, -1.0, -0.3, 0.0, 1.0, 2.0, 4.5])
def test_saturated_reading_is_the_describing_function(level, soft):
    """Fundamental and third harmonic of a clipped sine, against a Fourier integral."""
    theta = np.linspace(0.0, 2 * np.pi, 20001)[:-1]
    wave = 0.1 * np.cos(theta)
    x = wave / level
    kinds = {0.0: np.clip(x, -1, 1), 1.0: np.tanh(x), 2.0: x / (1 + np.abs(x) ** 8) ** 0.125}
    kinds |= {-1.0: np.minimum(x, 1), -0.3: np.clip(x, -1 / 0.7, 1)}
    kinds |= {4.5: x / (1 + np.abs(x) ** 4.5) ** (1 / 4.5), -3.0: x - np.clip(x, -1, 1)}
    cut = level * kinds[soft]
    first, third = (2 * np.mean(cut * np.cos(k * theta)) for k in (1, 3))
    value, slope, ratio = saturated_reading(0.1, level, soft)
    if soft == -3.0 and level > 0.1:
        assert value == pytest.approx(1e-4)  # nothing is seen but for what keeps the filter going
        return
    assert value == pytest.approx(first, rel=1e-4)
    assert ratio * 0.1 == pytest.approx(third, abs=1e-5)
    up, down = (saturated_reading(0.1 * f, level, soft)[0] for f in (1.0001, 0.9999))
    assert slope == pytest.approx((up - down) / 2e-5, abs=2e-3)


@pytest.mark.parametrize("over", [1.05, 1.5, 3.0, 10.0])
def test_a_reading_with_play_stands_until_the_motion_has_come_back(over):
    """Against a wave that is followed step by step: fundamental, and the third harmonic in phase with it."""
    play, n = 0.01, 20000
    theta = np.linspace(0.0, 4 * np.pi, 2 * n + 1)
    motion, shown = over * play * np.cos(theta), np.empty(theta.size)
    shown[0] = motion[0] - play
    for i in range(1, theta.size):
        shown[i] = np.clip(shown[i - 1], motion[i] - play, motion[i] + play)
    first, third = (2 * np.mean(shown[n:-1] * np.exp(1j * k * theta[n:-1])) for k in (1, 3))
    value, slope, ratio = saturated_reading(over * play, play, -2.0)
    assert value == pytest.approx(abs(first), rel=1e-4)
    assert ratio * over * play == pytest.approx((third / (first / abs(first)) ** 3).real, abs=1e-6)
    further, less = (saturated_reading(over * play * f, play, -2.0)[0] for f in (1.001, 0.999))
    assert slope == pytest.approx((further - less) / (0.002 * over * play), rel=5e-3)


def test_a_stiffness_that_pulses_turns_and_swells_what_swings():
    """Against dz/dt = (c - lambda |z|) z/|z| + F z* exp(i delta t) for the complex amplitude z, without noise."""
    force, rate, fine = 0.12 - 0.05j, 0.9, 40
    h, z, seen = PERIOD / fine, complex(0.02), []

    def pace(y: complex, t: float) -> complex:
        return LAM * (A_STAR / abs(y) - 1.0) * y + force * np.conj(y) * np.exp(1j * rate * t)

    for i in range(200 * fine):
        if i % fine == 0:
            seen.append(z)
        z += h * pace(z + 0.5 * h * pace(z, i * h), (i + 0.5) * h)
    data = channels(np.abs(seen), 1e-4, phase=np.unwrap(np.angle(seen)))
    terms = {"FORCE_COS": force.real, "FORCE_SIN": -force.imag, "FORCE_RATE": rate}
    left = []
    for twice in (1.0, 0.0):
        v, _ = channel_innovations(data, bare_table(1e-3, **terms, FORCE_TWICE=twice), initial_sd=0.3)
        left.append([np.abs(v[0, 5 : data.size]).max(), np.abs(v[0, data.size + 5 : 2 * data.size]).max()])
    assert np.all(np.array(left[0]) < [1e-4, 2e-3])
    assert np.all(np.array(left[1]) > [1e-3, 2e-2])


@pytest.mark.parametrize(("term", "power"), [("STIFFNESS_LINEAR", 1), ("STIFFNESS", 2), ("STIFFNESS_FOURTH", 4)])
def test_a_spring_that_bends_has_the_third_harmonic_of_its_force(term, power):
    """Of x'' + x + b|x|^p x = 0 to first order in b: its third harmonic, and its change of the frequency."""
    theta = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    force = np.abs(np.cos(theta)) ** power * np.cos(theta)
    first, third = (2 * np.mean(force * np.cos(k * theta)) for k in (1, 3))
    bend, ratio = 0.5 * first, third / 8.0  # k x - 9 k x_3 = -F_3
    size, n = 0.01, 40
    y = np.full(n, A_STAR)
    data = channels(y, 1e-5, third=ratio * size / bend * y)
    table = bare_table(1e-6, **{term: size / A_STAR**power})
    v, _ = channel_innovations(data, table)
    assert np.abs(v[0, -n:]).max() < 1e-3 * ratio * size / bend * A_STAR


def test_kept_cycles_come_with_all_knots():
    """Also where there are as many cycles as knots."""
    data = channels(np.full(HATS, A_STAR), 1e-4)
    kept = data.keep(np.arange(HATS) < 3)
    assert kept.size == kept.phase.size == 3
    np.testing.assert_array_equal(kept.knots, data.knots)


def test_what_a_cycle_foretells_of_the_next_one_is_taken_off(rng):
    """Of amplitude and phase; not behind a gap, nor by the cycle that the filter starts from."""
    q, rho, other = 2e-4, 0.4, -0.3
    data = channels(motion(rng, lambda a: LAM * (A_STAR - a), q, 2e-4, 1.0, steps=20), 2e-4, phase=rng.normal(size=100))
    gap = np.zeros(data.size)
    gap[0], gap[60] = -1.0, 3.0
    data = replace(data, gap=gap, third_error=np.full(data.size, ABSENT))
    white, s = (x[0].reshape(3, -1) for x in channel_innovations(data, bare_table(q)))
    table = bare_table(q, CORRELATION=rho, PHASE_CORRELATION=other)
    v, variance = (x[0].reshape(3, -1) for x in channel_innovations(data, table))
    for channel, correlation in enumerate((rho, other)):
        expected, spread = white[channel].copy(), s[channel].copy()
        after = np.setdiff1d(np.arange(2, data.size), 60)
        e = white[channel] / np.sqrt(s[channel])
        expected[after] -= correlation * np.sqrt(s[channel][after]) * e[after - 1]
        spread[after] *= 1.0 - correlation**2
        np.testing.assert_allclose(v[channel], expected, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(variance[channel], spread, rtol=1e-12)
    np.testing.assert_array_equal(v[2], white[2])
