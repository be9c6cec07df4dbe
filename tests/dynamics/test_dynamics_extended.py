"""The filter with effects: against the plain filter of the bare law, and against a point-mass filter."""

import numpy as np
import pytest
from scipy.stats import norm

from scruton.dynamics.cycles import Channels, EnvelopeData
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.extended import channel_innovations
from scruton.dynamics.likelihood import innovations, pointwise_log_likelihood

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


def motion(rng, rate, q, se, start, cycles=100, steps=200):
    a, y, h = start, [], PERIOD / steps
    for _ in range(cycles):
        mean = 0.0
        for _ in range(steps):
            mean += a / steps
            a += h * (rate(a) + q**2 / (2 * a)) + q * np.sqrt(h) * rng.standard_normal()
        y.append(mean + se * rng.standard_normal())
    return np.array(y)


def grid_log_likelihood(y, se, rate, q, sd0, points=321, steps=200):
    """Point-mass filter: the state's density on a moving grid, moments of each cycle by small Euler steps."""

    def moments(x, dt):
        h, d = dt / steps, 1e-4 * A_STAR
        m, s, p, c, v = x.copy(), np.zeros_like(x), np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
        for _ in range(steps):
            f, up, dn = (rate(m + e) + q**2 / (2 * (m + e)) for e in (0.0, d, -d))
            f1, f2 = (up - dn) / (2 * d), (up - 2 * f + dn) / d**2
            s, v = s + h * m, v + 2 * h * c
            c = c + h * (f1 * c + p)
            m, p = m + h * (f + 0.5 * f2 * p), p + h * (2 * f1 * p + q**2)
        return m, s / dt, p, c / dt, v / dt**2

    total = 0.0
    for k, value in enumerate(y):
        if k == 0:
            total += norm.logpdf(value, 0, np.hypot(sd0, se))
            gain = sd0**2 / (sd0**2 + se**2)
            centre, sd = gain * value, np.sqrt(gain) * se
            grid = np.linspace(max(centre - 7 * sd, 0.02 * centre), centre + 7 * sd, points)
            density = norm.pdf(grid, centre, sd)
            density /= density.sum()
            means, _, variances, _, _ = moments(grid, 0.5 * PERIOD)
        else:
            m, z, p, c, v = moments(grid, PERIOD)
            s = v + se**2
            like = norm.pdf(value, z, np.sqrt(s)) * density
            total += np.log(like.sum())
            density = like / like.sum()
            means, variances = m + c / s * (value - z), p - c**2 / s
        centre = (density * means).sum()
        sd = np.sqrt((density * (variances + (means - centre) ** 2)).sum())
        new = np.linspace(max(centre - 7 * sd, 0.02 * centre), centre + 7 * sd, points)
        density = norm.pdf(new[:, None], means[None, :], np.sqrt(variances)[None, :]) @ density
        density /= density.sum()
        grid = new
    return total


EFFECTS = {
    "bare": ({}, lambda a: 0.0),
    "friction": ({"FRICTION": 0.004, "FRICTION_WIDTH": 1e-4}, lambda a: -0.004 * a / np.sqrt(a * a + 1e-8)),
    "quadratic": ({"STRUCTURAL_LINEAR": 2.0}, lambda a: -2.0 * a * a),
    "cubic": ({"AERO_SQUARE": 40.0}, lambda a: -40.0 * a**3),
    "fifth": ({"AERO_FOURTH": 8000.0}, lambda a: -8000.0 * a**5),
    "coherence": ({"COHERENCE": 0.02}, lambda a: -LAM * A_STAR * np.exp(-a / 0.02)),
}


@pytest.mark.parametrize("start", [0.15, 2.0])
@pytest.mark.parametrize("name", EFFECTS)
def test_filter_against_a_grid_filter(rng, name, start):
    """To 0.1 in log likelihood per 100 cycles, as growth and decay, with 2 % turbulence scatter."""
    terms, more = EFFECTS[name]
    q, se = 0.02 * A_STAR * np.sqrt(2 * LAM), 0.0004

    def rate(a):
        return LAM * (A_STAR - a) + more(a)

    y = motion(rng, rate, q, se, start * A_STAR)
    v, s = channel_innovations(channels(y, se), bare_table(q, **terms), initial_sd=0.3)
    got = pointwise_log_likelihood(v[0, :100], s[0, :100]).sum()
    assert got == pytest.approx(grid_log_likelihood(y, se, rate, q, 0.3), abs=0.1)


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


def test_rows_that_leave_a_channel_alone_are_copied_exactly(rng):
    """What the first row's neighbours share with it is copied: the same numbers as when every row is run by itself."""
    q, se = 2e-4, 2e-4
    y = motion(rng, lambda a: LAM * (A_STAR - a), q, se, 0.1, steps=20)
    wander, flat = np.cumsum(0.01 * rng.standard_normal(100)), 1e-4 * rng.standard_normal(100)
    data = channels(y, se, phase=wander, third=flat)
    rows = [bare_table(q), bare_table(q, STIFFNESS=3.0), bare_table(q, THIRD=0.01), bare_table(q, AERO=0.6)]
    rows += [bare_table(q, DETUNING=1e-3), bare_table(q)]
    together = channel_innovations(data, np.concatenate(rows))
    for k, row in enumerate(rows):
        alone = channel_innovations(data, row)
        np.testing.assert_array_equal(together[0][k], alone[0][0])
        np.testing.assert_array_equal(together[1][k], alone[1][0])


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


@pytest.mark.parametrize("level", [0.06, 0.09, 0.2])
@pytest.mark.parametrize("soft", [0.0, 1.0, 2.0])
def test_saturated_reading_is_the_describing_function(level, soft):
    """Fundamental and third harmonic of a clipped sine, against a Fourier integral."""
    from scruton.dynamics.reading import saturated_reading

    theta = np.linspace(0.0, 2 * np.pi, 20001)[:-1]
    wave = 0.1 * np.cos(theta)
    x = wave / level
    cut = level * {0.0: np.clip(x, -1, 1), 1.0: np.tanh(x), 2.0: x / (1 + np.abs(x) ** 8) ** 0.125}[soft]
    first, third = (2 * np.mean(cut * np.cos(k * theta)) for k in (1, 3))
    value, slope, ratio = saturated_reading(0.1, level, soft)
    assert value == pytest.approx(first, rel=1e-4)
    assert ratio * 0.1 == pytest.approx(third, abs=1e-5)
    up, down = (saturated_reading(0.1 * f, level, soft)[0] for f in (1.0001, 0.9999))
    assert slope == pytest.approx((up - down) / 2e-5, abs=2e-3)
