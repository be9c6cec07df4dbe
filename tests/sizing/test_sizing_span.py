"""The curve along the span, against a hundred strips: their equation of motion, or the work of a cycle alone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from sizing_room import LIMIT, at_most, laws, mode_model

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.dynamics.effects.terms import COLUMNS, Term
from scruton.griffin.curves import EffectCurve
from scruton.sizing.mode_shape import make_shape, sine, uniform
from scruton.sizing.model import COHERENCE_AMPLITUDE, SOURCES, CurveTable, unit_cube
from scruton.sizing.remarks import coherence_remarks, mode_factors
from scruton.sizing.risk import risk, shares

STRIPS = (np.arange(100) + 0.5) / 100
A_REF, RATE, TESTED = 0.06551, 0.005139, 0.00058  # of the room's section: a*, lambda/omega, xi


def model_of(n=-1.0, lost_at=None, shape=None, spread=0.0, effect=None):
    """The room's section without any uncertainty but that of A_c [A/D]."""
    model = mode_model(exponents=(n,), shape=shape, draws=1 << 8)
    one = {name: np.full_like(getattr(model.laws, name), value) for name, value in
           (("amplitude", A_REF), ("relaxation", RATE))}  # fmt: skip
    scale = None if lost_at is None else Quantity(lost_at, spread * lost_at)
    bridge = replace(model.bridge, depth=1.0, coherence_amplitude=scale)
    return replace(model, laws=replace(model.laws, effect=effect, **one), bridge=bridge)


def left(amplitude, lost_at):
    return 1.0 if lost_at is None else 1.0 - np.exp(-amplitude / lost_at)


def simulated(n, damping, phi, lost_at, start):
    """A mode of a hundred strips in time: each feels the force of its own movement; circular frequency 1."""
    c, own = RATE * A_REF, RATE - TESTED  # of the paper's law: its drive, its linear aerodynamic damping
    step, mass = 2.0 * np.pi / 80, (phi**2).sum()

    def acceleration(q, v):
        y, w = phi * q, phi * v
        share = left(np.abs(phi) * np.hypot(q, v), lost_at)
        if n == -1.0:  # a force F sign(v) moves the amplitude by 2 F/pi
            force = 0.5 * np.pi * c * share * np.sign(w) - 2.0 * own * w
        else:  # Van der Pol: k y^2 v moves it by k a^3/8
            force = share * (2.0 * (TESTED + 0.5 * RATE) - 8.0 * (0.5 * RATE / A_REF**2) * y**2) * w
        return -q - 2.0 * damping * v + (phi * force).sum() / mass

    q, v, peaks = start, 0.0, []
    for _ in range(80 * 500):  # Heun on the velocity, half a step about it
        q += 0.5 * step * v
        first = acceleration(q, v)
        v += 0.5 * step * (first + acceleration(q, v + step * first))
        q += 0.5 * step * v
        peaks.append(np.hypot(q, v))
    return np.mean(peaks[-800:])


@pytest.mark.parametrize(("n", "lost_at", "damping"), [
    (-1.0, None, 0.003), (-1.0, 0.2 * A_REF, 0.003), (-1.0, 0.5 * A_REF, 0.004), (2.0, 0.2 * A_REF, 0.0015),
])  # fmt: skip
def test_the_stable_amplitude_is_that_of_a_hundred_strips_in_time(n, lost_at, damping):
    shape = sine()
    found = model_of(n, lost_at, shape).draws(unit_cube(1 << 8, 0)).amplitude(damping - 0.003)
    assert np.ptp(found) < 1e-9
    assert found[0] == pytest.approx(simulated(n, damping, np.sin(np.pi * STRIPS), lost_at, 1.3 * A_REF), rel=0.01)


def work(n, amplitude, lost_at):
    """Of the wind on a strip, over a cycle, as a damping ratio times the amplitude squared; written law by law."""
    a, ratio = amplitude, amplitude / A_REF
    share = left(a, lost_at)
    if n < 0.0:
        grows = RATE / -n * ratio**n
        own = RATE / -n - TESTED  # the linear damping of the law
        kept = max(RATE * min(-n, -1.0 / n) - TESTED, 0.0)  # what of it is not lost
        return a**2 * ((grows - own + kept) * share - kept)
    whole = -np.log(ratio) if n == 0.0 else (1.0 - ratio**n) / n
    return a**2 * (TESTED + RATE * whole) * share


def balance(n, damping, phi, lost_at, low=1e-4, high=0.5):
    """Largest amplitude at which the work over the span vanishes."""
    phi = np.abs(phi[phi != 0.0])

    def surplus(a):
        return work(n, a * phi, lost_at).sum() - damping * ((a * phi) ** 2).sum()

    grid = np.geomspace(low, high, 400)
    above = np.flatnonzero([surplus(a) > 0.0 for a in grid])
    return 0.0 if above.size == 0 else brentq(surplus, grid[above[-1]], grid[above[-1] + 1])


STEPPED = make_shape(np.linspace(0.0, 1.0, 11), np.array([0, 0, 0, 0.2, 0.8, 1, 1, 1, 0.5, -0.2, -0.4]), "stepped")


@pytest.mark.parametrize("n", [-1.5, -1.0, -0.5, 0.0, 0.7, 2.0, 4.0])
@pytest.mark.parametrize("lost_at", [0.05 * A_REF, 0.3 * A_REF, 20.0 * A_REF])
@pytest.mark.parametrize("shape", [sine(), STEPPED, uniform()], ids=lambda one: one.name)
def test_every_law_balances_over_the_span(n, lost_at, shape):
    model = model_of(n, lost_at, shape)
    draws = model.draws(unit_cube(1 << 8, 0))
    first, last = shape.position[0], shape.position[-1]
    phi = shape.curve(first + (last - first) * (np.arange(2000) + 0.5) / 2000)
    for damping in (0.0007, 0.002, 0.004, 0.01):
        there = balance(n, damping, phi, lost_at)
        found = draws.amplitude(damping - 0.003)[0]
        if there < 0.004 * A_REF:  # what is fainter counts as nothing
            assert found < 0.005 * A_REF
        elif np.isfinite(found):
            assert found == pytest.approx(there, rel=0.01)
            # and what is needed for that amplitude is that damping
            assert draws.needed(there)[0] == pytest.approx(damping - 0.003, abs=0.01 * damping)


def test_a_small_limit_needs_less_damping_where_coherence_is_lost_and_none_to_go_lower():
    u = unit_cube(1 << 8, 0)
    plain, lost = model_of().draws(u), model_of(lost_at=0.2 * A_REF).draws(u)
    small = 0.1 * A_REF
    assert lost.needed(small)[0] < 0.6 * plain.needed(small)[0]
    # the vibration dies at c/A_c: no limit, however small, needs more
    assert lost.needed(1e-9)[0] == pytest.approx(RATE / 0.2 - (RATE - TESTED) - 0.003, rel=1e-3)
    assert (lost.amplitude(RATE / 0.2 - (RATE - TESTED) - 0.0029) == 0.0).all()
    # a large amplitude knows nothing of it
    assert lost.needed(1.2 * A_REF)[0] == pytest.approx(plain.needed(1.2 * A_REF)[0], abs=2e-4)


def effect_curve(size=256, **terms):
    rows = np.zeros((size, COLUMNS))
    omega0, factor = 50.0, 1.0
    values = {"aero": omega0 * (RATE - TESTED), "drive": omega0 * RATE * A_REF} | terms
    for name, value in values.items():
        rows[:, Term[name.upper()]] = value
    return EffectCurve(rows, omega0, factor, 0.1)


@pytest.mark.parametrize("terms", [
    {}, {"coherence": 0.2 * A_REF}, {"aero_square": 20.0}, {"aero_linear": 1.5, "coherence": 0.01},
])  # fmt: skip
@pytest.mark.parametrize("shape", [sine(), STEPPED], ids=lambda one: one.name)
@pytest.mark.parametrize("stated", [None, 0.3 * A_REF])
def test_an_effect_is_integrated_along_the_span(terms, shape, stated):
    draws = model_of(shape=shape, effect=effect_curve(**terms), lost_at=stated).draws(unit_cube(1 << 8, 0))
    phi = np.abs(shape.curve((np.arange(4000) + 0.5) / 4000))
    phi = phi[phi > 0.0]
    lost_at = stated or terms.get("coherence")

    def surplus(a, damping):
        b = a * phi
        fed = RATE * A_REF * left(b, lost_at) / b
        own = RATE - TESTED + (terms.get("aero_linear", 0.0) + terms.get("aero_square", 0.0) * b) * b / 50.0
        return (b**2 * (fed - own - damping)).sum()

    for damping in (0.001, 0.003, 0.008):
        there = brentq(surplus, 1e-5, 1.0, args=(damping,))
        assert draws.amplitude(damping - 0.003)[0] == pytest.approx(there, rel=0.01)
        assert draws.needed(there)[0] == pytest.approx(damping - 0.003, abs=0.01 * damping)


def test_an_uncertain_amplitude_of_coherence_has_its_share():
    model = model_of(lost_at=0.2 * A_REF, spread=0.5)
    assert COHERENCE_AMPLITUDE in model.uncertain()
    rows = {row.source: row for row in shares(model, 0.3 * A_REF)["needed"]}
    assert rows[SOURCES[COHERENCE_AMPLITUDE]].total > 0.9


def test_required_damping_of_all_draws_agrees_with_the_strips():
    """2^15 draws of A_c, of a free exponent and of the bridge's damping; forty of them written out."""
    model = mode_model(cov=0.4, exponents=(-1.0,), draws=1 << 10)
    free = np.linspace(-1.4, 2.5, 1 << 10)[None]
    bridge = replace(model.bridge, coherence_amplitude=Quantity(0.012, 0.006))
    model = replace(model, laws=replace(model.laws, n=free), bridge=bridge)
    found = risk(model, at_most(LIMIT))
    assert np.isfinite(found.required["0.95"])
    draws = model.draws(unit_cube(1 << 8, 4))
    need, ratio = draws.needed(LIMIT), np.exp(draws.span.log_ratio)
    phi = np.sin(np.pi * (np.arange(2000) + 0.5) / 2000)
    mean = (phi**2).mean()
    for i in range(0, 256, 7):
        n, a_ref, rate = draws.curve.n[i], draws.curve.amplitude[i], draws.curve.relaxation[i]
        gamma = (mean / (phi ** (2.0 + n)).mean()) ** (1.0 / n)
        lost_at = gamma / ratio[i]
        kept = max(rate * min(-n, -1.0 / n) - TESTED, 0.0) if n < 0.0 else 0.0

        def number(a, n=n, a_ref=a_ref, rate=rate, lost_at=lost_at, kept=kept):
            b = a * phi
            own = TESTED + rate * (1.0 - (b / a_ref) ** n) / n
            return (phi**2 * ((own + kept) * (1.0 - np.exp(-b / lost_at)) - kept)).mean() / mean

        most = max(number(a) for a in np.append(LIMIT / 3.0, np.geomspace(LIMIT / 3.0, 1.0, 60)))
        assert need[i] + draws.damping_ratio[i] == pytest.approx(most, rel=0.01)


def test_a_tabulated_curve_is_the_curve():
    """Amplitude and Scruton number of a table of the law's own closed form."""
    one = laws(draws=1 << 6)
    amplitude, rate = one.amplitude[0], one.relaxation[0]
    log = np.arange(np.log(1e-4), np.log(2.0), 1.0 / 32.0)
    table = CurveTable(log, one.reference + rate[:, None] * (amplitude[:, None] / np.exp(log) - 1.0))
    rows, sc = np.arange(len(rate)), np.geomspace(2e-4, 0.03, 40) * np.ones((len(rate), 1))
    exact = amplitude[:, None] / (1.0 + (sc - one.reference) / rate[:, None])
    np.testing.assert_allclose(table.amplitude(rows, sc), exact, rtol=3e-4)
    number = table.scruton_number(rows, exact)
    np.testing.assert_allclose(number + rate[:, None], sc + rate[:, None], rtol=3e-4)
    assert np.isinf(table.amplitude(rows, np.full((len(rate), 1), -1.0))).all()
    assert (table.amplitude(rows, np.full((len(rate), 1), 1e4)) == 0.0).all()


def test_what_coherence_does_to_the_need_is_said():
    limit = at_most(0.2 * A_REF)
    model = model_of(lost_at=0.2 * A_REF, spread=0.1)
    found = risk(model, limit)
    (remark,) = coherence_remarks(model, found, 0)
    coherent = risk(model_of(), limit)
    assert found.required["0.95"] < 0.8 * coherent.required["0.95"]
    assert f"needs {found.required_text['0.95']} of added" in remark
    assert f"{100.0 * coherent.required['0.95']:.3f} % were it coherent" in remark
    assert coherence_remarks(model_of(), coherent, 0) == []
    assert f"A_c = {0.2 * A_REF:.3g} A/D, so" in remark
    twisting = replace(model, bridge=replace(model.bridge, motion=Motion.TORSIONAL))
    assert f"A_c = {0.2 * A_REF * 180.0 / np.pi:.3g} deg, so" in coherence_remarks(twisting, found, 0)[0]


def test_the_mode_factor_of_an_effect_is_that_of_its_strips():
    model = model_of(effect=effect_curve(aero_square=20.0))
    (factor,) = mode_factors(model, model.draws(unit_cube(1 << 8, 0))).values()
    phi = np.sin(np.pi * (np.arange(2000) + 0.5) / 2000)

    def surplus(a, shape):
        b = a * shape
        return (b**2 * (RATE * A_REF / b - (RATE - TESTED) - 20.0 * b**2 / 50.0 - 0.003)).sum()

    mode, section = (brentq(surplus, 1e-4, 1.0, args=(shape,)) for shape in (phi, np.ones(1)))
    assert factor == pytest.approx(mode / section, rel=2e-3)
    (plain,) = mode_factors(model_of(), model_of().draws(unit_cube(1 << 8, 0))).values()
    assert plain == pytest.approx(4.0 / np.pi)
    assert abs(factor - plain) > 0.01
