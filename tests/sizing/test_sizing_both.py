"""Heaving and torsion of one bridge: the union of their risks against numbers drawn by hand, and what is read."""

from dataclasses import replace

import numpy as np
import pytest

from scruton import InputError
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.griffin.curves import LawCurves
from scruton.infer.store import read_tree
from scruton.sizing.bridge import Bridge, Mode, load_bridge
from scruton.sizing.damper_request import DamperRequest, RiskOf
from scruton.sizing.dampers import damper
from scruton.sizing.existing import existing, hung, offers
from scruton.sizing.inputs import inputs_of
from scruton.sizing.limits import limit
from scruton.sizing.mode_shape import sine
from scruton.sizing.model import ModeModel
from scruton.sizing.modes import exceedance
from scruton.sizing.size import size
from scruton.sizing.together import OnAxis, Placed, exceedance_of, joint_draws, placed, sized_for_any, with_dampers
from scruton.sizing.transfer import Transfer

# Two sections that nobody knows well: amplitude (A/D, rad) and relaxation (of xi) at xi = 0.00058, both 30 %.
SECTION = {Motion.HEAVING: (0.065, 0.0051), Motion.TORSIONAL: (0.012, 0.0034)}
SPREAD, TAU, COV = 0.30, 0.15, 0.45
LIMITS = {Motion.HEAVING: 0.07, Motion.TORSIONAL: 0.0055}
COHERENCE = Quantity(0.85, 0.10, "beta")
SITE = Transfer(*(Quantity(1.0, 0.2),) * 3)
MODES = (Motion.HEAVING, Motion.HEAVING, Motion.TORSIONAL)


def model(motion, name, request=DamperRequest()):  # noqa: B008
    rng = np.random.default_rng(3 if motion is Motion.HEAVING else 4)
    amplitude, relaxation = (value * np.exp(SPREAD * rng.standard_normal((1, 1 << 14))) for value in SECTION[motion])
    laws = LawCurves(
        0.00058, amplitude, relaxation, np.full(amplitude.shape, -1.0), np.full(amplitude.shape, TAU), np.ones(1),
        ("n=-1",),
    )  # fmt: skip
    frequency = Quantity(0.3 if motion is Motion.HEAVING else 0.8, 0.003)
    mode = Mode(name, frequency, None, 4e6, sine(), Quantity(0.003, COV * 0.003))
    bridge = Bridge(
        "bridge", motion, 12.0, 3.0, 1.225, COHERENCE, (), (mode,), transfer=SITE, damper=request,
    )  # fmt: skip
    return ModeModel(laws, np.ones(1), bridge, mode)


FREE = DamperRequest(
    risk_of=RiskOf.ANY, smallest_mass_ratio=1e-4, largest_mass_ratio=0.2, largest_stroke=9.0, kept_detuning=0.0,
    frequency_tolerance=0.0, damping_tolerance=0.0, mass_tolerance=0.0,
)  # fmt: skip


def hung_by_hand(dampers, motion, error, modal):
    """Damping ratio added and frequency g of the response (size,): the equation of motion with every damper.

    Of the roots of 1 - g^2 (1 + sum mu Re K) = 0 that of least damping counts: each is a limit cycle of its own.
    """
    frequency = 0.3 if motion is Motion.HEAVING else 0.8
    g = np.linspace(0.75, 1.25, 801)
    added, at = np.full(error.size, np.inf), np.ones(error.size)
    for k in range(error.size):
        k_sum = np.zeros(g.size, complex)
        for mass, own, zeta, on_axis in dampers:
            if motion is Motion.TORSIONAL and on_axis:
                continue
            arm = 1.0 if motion is Motion.HEAVING else 6.0
            f = own / (frequency * (1.0 + error[k]))
            mu = mass * arm**2 / (4e6 * modal[k])
            k_sum += mu * (f**2 + 2j * zeta * f * g) / (f**2 - g**2 + 2j * zeta * f * g)
        left = 1.0 - g**2 * (1.0 + k_sum.real)
        (here,) = np.nonzero(left[:-1] * left[1:] <= 0.0)
        part = left[here] / (left[here] - left[here + 1])
        damping = -0.5 * g * k_sum.imag
        roots = damping[here] + part * (damping[here + 1] - damping[here])
        one = int(np.argmin(roots))
        added[k], at[k] = roots[one], g[here[one]] + part[one] * (g[1] - g[0])
    return added, at


def damped_by_hand(rng, size, dampers):
    """Which bridges exceed with dampers (mass, frequency, damping ratio, on the axis), in heaving and torsion."""
    exceeds = []
    log = np.sqrt(np.log1p(0.2**2))
    a, b = (x * (0.85 * 0.15 / 0.10**2 - 1.0) for x in (0.85, 0.15))
    site = rng.beta(a, b, size) * np.exp(log * rng.standard_normal((3, size)) - 0.5 * log**2).prod(axis=0)
    for motion in Motion:
        amplitude, relaxation = (value * np.exp(SPREAD * rng.standard_normal(size)) for value in SECTION[motion])
        log = np.sqrt(np.log1p(COV**2))
        damping = 0.003 * np.exp(log * rng.standard_normal(size) - 0.5 * log**2)
        miss, modal = np.exp(TAU * rng.standard_normal(size)), np.exp(0.05 * rng.standard_normal(size))
        error = 0.003 / (0.3 if motion is Motion.HEAVING else 0.8) * rng.standard_normal(size)
        added, g = hung_by_hand(dampers, motion, error, modal)
        of_section = amplitude / (1.0 + (damping + added - 0.00058) / relaxation) * miss / g
        exceeds.append((3.0 if motion is Motion.HEAVING else 1.0) * 4.0 / np.pi * site * of_section > LIMITS[motion])
    return np.array(exceeds)


@pytest.mark.thorough
def test_dampers_for_any_mode_of_either_motion_keep_the_risk_of_bridges_built_by_hand():
    models = [model(motion, motion.value, FREE) for motion in Motion]
    limits = [LIMITS[motion] for motion in Motion]
    alone = [damper(each, most, 0) for each, most in zip(models, limits, strict=True)]
    found = sized_for_any(models, limits, alone, 0, lambda what, done: None)
    assert all(one.achievable for one in found)

    def truth(designed):
        hung = [
            (one.mass, one.frequency, one.damping_ratio, motion is Motion.HEAVING)
            for damped, motion in zip(designed, Motion, strict=True)
            for one in damped.dampers
        ]
        return damped_by_hand(np.random.default_rng(11), 20_000, hung)

    before, after = truth(alone), truth(found)
    noise = 3.0 * np.sqrt(0.05 * 0.95 / 20_000)
    assert before.any(axis=0).mean() > 0.05 + 2.0 * noise  # each keeps the risk, any does not
    assert before.mean(axis=1).max() < 0.05 + noise
    assert 0.04 < after.any(axis=0).mean() < 0.05 + noise
    said = exceedance_of(with_dampers(placed(found, models), models, limits, 30))
    assert said.each == pytest.approx(after.mean(axis=1), abs=noise)
    assert said.any == pytest.approx(after.any(axis=0).mean(), abs=noise)


def by_hand(rng, size, *, one_site=True, one_section=False):
    """Which of a million bridges exceed, (modes, size): the paper's law and the lognormal sources written out."""
    exceeds = []
    section = {motion: rng.standard_normal((2, size)) for motion in SECTION}
    if one_section:
        section[Motion.TORSIONAL] = section[Motion.HEAVING]
    a, b = (x * (0.85 * 0.15 / 0.10**2 - 1.0) for x in (0.85, 0.15))
    site = None
    for motion in MODES:
        if site is None or not one_site:
            log = np.sqrt(np.log1p(0.2**2))
            site = rng.beta(a, b, size) * np.exp(log * rng.standard_normal((3, size)) - 0.5 * log**2).prod(axis=0)
        amplitude, relaxation = (
            value * np.exp(SPREAD * z) for value, z in zip(SECTION[motion], section[motion], strict=True)
        )
        log = np.sqrt(np.log1p(COV**2))
        damping = 0.003 * np.exp(log * rng.standard_normal(size) - 0.5 * log**2)
        of_section = amplitude / (1.0 + (damping - 0.00058) / relaxation) * np.exp(TAU * rng.standard_normal(size))
        depth = 3.0 if motion is Motion.HEAVING else 1.0
        exceeds.append(depth * 4.0 / np.pi * site * of_section > LIMITS[motion])
    return np.array(exceeds)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_union_is_that_of_bridges_drawn_by_hand(seed):
    rng = np.random.default_rng(7)
    truth = by_hand(rng, 1_000_000)
    found = exceedance(
        joint_draws([model(motion, f"{k}") for k, motion in enumerate(MODES)], seed), [LIMITS[m] for m in MODES],
        [0.0] * 3,
    )  # fmt: skip
    assert found.each == pytest.approx(truth.mean(axis=1), abs=0.008)
    assert found.any == pytest.approx(truth.any(axis=0).mean(), abs=0.008)
    # it can tell: with a site for each mode, or one section for both motions, other bridges come out
    for other in (by_hand(rng, 1_000_000, one_site=False), by_hand(rng, 1_000_000, one_section=True)):
        assert abs(found.any - other.any(axis=0).mean()) > 0.012


def test_a_damper_on_the_axis_is_not_moved_by_torsion_and_one_at_the_edge_moves_with_heaving():
    models = [model(Motion.HEAVING, "V1"), model(Motion.TORSIONAL, "T1")]
    limits = [LIMITS[Motion.HEAVING], LIMITS[Motion.TORSIONAL]]
    heaving, torsional = (
        with_dampers([each], models, limits, 0)
        for each in (OnAxis(40_000.0, 0.3, 0.1, 0.5), Placed(40_000.0, 0.8, 0.1, 0.5))
    )
    assert [len(mode.dampers) for mode in heaving] == [1, 0]
    assert heaving[0].dampers[0].mass_ratio == pytest.approx(0.01)
    assert [len(mode.dampers) for mode in torsional] == [1, 1]
    assert torsional[1].dampers[0].mass_ratio == pytest.approx(0.01 * 6.0**2)  # at the edge, B/2 from the axis
    assert torsional[0].dampers[0].mass_ratio == pytest.approx(0.01)


def test_an_offer_hangs_as_a_damper_of_the_mode_that_its_frequency_is_nearest_to():
    models = [model(Motion.HEAVING, "V1"), model(Motion.TORSIONAL, "T1")]
    limits = [LIMITS[Motion.HEAVING], LIMITS[Motion.TORSIONAL]]
    (offer,) = hung(models, offers("40 t, 0.31 Hz, 0.1; 20 t, 0.75 Hz, 0.1, 0.3"))
    assert offer.dampers == (OnAxis(40_000.0, 0.31, 0.1, 0.5), Placed(20_000.0, 0.75, 0.1, 0.3))
    (found,) = existing(models, limits, [offer], 0)
    ours = damped_by_hand(
        np.random.default_rng(5), 20_000, [(40e3, 0.31, 0.1, True), (20e3 * np.sin(0.3 * np.pi) ** 2, 0.75, 0.1, False)]
    )
    assert ours.any(axis=0).mean() > 0.1
    # made as ordered to 1 % of frequency, 10 % of damping: what that adds is little beside the spread of the section
    assert found.left.each == pytest.approx(ours.mean(axis=1), abs=0.02)
    assert found.left.any == pytest.approx(ours.any(axis=0).mean(), abs=0.02)
    with pytest.raises(InputError, match="no node"):
        hung(
            [replace(models[0], mode=replace(models[0].mode, shape=sine(2))), models[1]],
            offers("40 t, 0.3 Hz, 0.1, 0.5"),
        )


BOTH = """format = 1
width = "12 m"
depth = "3 m"
limits = ["jtg", "0.12 m", "0.4 deg"]
{top}
[[modes]]
name = "V1"
motion = "heaving"
frequency = "0.3 Hz"
mass = "20000 kg/m"
length = "400 m"

[[modes]]
name = "T1"
motion = "torsional"
frequency = "0.8 Hz"
inertia = "8e5 kg*m^2/m"
length = "400 m"

[damper]
lever_arm = "5 m"
position = {{ T1 = 0.4 }}
"""


def written(folder, top=""):
    path = folder / "bridge.toml"
    path.write_text(BOTH.format(top=top), encoding="utf-8")
    return path


def test_one_file_has_the_modes_of_both_motions(tmp_path):
    path = written(tmp_path)
    heaving, torsional = (load_bridge(path, motion) for motion in Motion)
    assert [mode.name for mode in heaving.modes] == ["V1"]
    assert [mode.name for mode in torsional.modes] == ["T1"]
    assert (heaving.others, torsional.others) == (("T1",), ("V1",))
    assert [rule.text for rule in heaving.limits] == ["jtg", "0.12 m"]
    assert [rule.text for rule in torsional.limits] == ["jtg", "0.4 deg"]
    assert torsional.modes[0].mass.mean == 8e5


def test_a_file_that_leaves_open_which_motion_is_refused(tmp_path):
    path = written(tmp_path)
    path.write_text(path.read_text() + '\n[[modes]]\nname = "V2"\nfrequency = "0.4 Hz"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"modes\[2\].motion.*both"):
        load_bridge(path, Motion.HEAVING)
    with pytest.raises(InputError, match=r"coherence_amplitude.*both"):
        load_bridge(written(tmp_path, top="coherence_amplitude = { mean = 0.01, cov = 0.5 }"), Motion.HEAVING)


def test_each_motion_has_an_amplitude_at_which_coherence_is_lost(tmp_path):
    both = 'coherence_amplitude = { heaving = "30 mm", torsional = { mean = 0.002, cov = 0.5 } }'
    path = written(tmp_path, top=both)
    heaving, torsional = (load_bridge(path, motion) for motion in Motion)
    assert heaving.coherence_amplitude.mean == pytest.approx(0.03 / heaving.depth)
    assert torsional.coherence_amplitude.mean == 0.002
    rows = {row.name: row.origin for row in inputs_of(torsional, ("kd",)).numbers}
    assert rows["coherence_amplitude.mean"] == "stated"
    one = load_bridge(written(tmp_path, top='coherence_amplitude = { heaving = "30 mm" }'), Motion.TORSIONAL)
    assert one.coherence_amplitude is None


@pytest.mark.thorough
def test_two_fits_of_one_bridge_are_sized_with_their_union(quick_results, tmp_path):
    tree, _ = read_tree(quick_results)
    tree = tree.drop_nodes("convergence")  # the small fit need not have converged
    other = tree.copy(deep=True)
    other["constant_data"]["motion"] = "torsional"
    path = written(tmp_path)
    heaving, torsional = (load_bridge(path, motion) for motion in Motion)
    offer = offers("40 t, 0.3 Hz, 0.1; 20 t, 0.8 Hz, 0.1")
    sizings = size([(tree, heaving), (other, torsional)], [limit("kd")], offers=offer)
    (alone,) = size([(tree, heaving)], [limit("kd")])
    assert [[mode.name for mode in one.modes] for one in sizings] == [["V1"], ["T1"]]
    said = next(flag for flag in alone.flags if "other motion" in flag)
    assert "T1. `scruton size` takes their fit as --other" in said  # also where another verb tells it
    for one in sizings:
        assert not any("other motion" in flag for flag in one.flags)
        assert one.both is not None
        assert one.both.names == ("V1", "T1")
        assert one.both.motions == ("heaving", "torsional")
        assert one.both.required == tuple(each.modes[0].governing_limit.required["0.95"] for each in sizings)
        assert one.both.trusted == (True, True)
        assert len(one.both.required_for_any.required) == 2
        assert max(one.both.without.each) <= one.both.without.any <= sum(one.both.without.each)
    first, second = sizings
    assert first.modes[0].governing_limit.required == alone.modes[0].governing_limit.required
    assert first.both.edge[0].median == pytest.approx(first.modes[0].amplitude.median)
    assert first.both.edge[1].median == pytest.approx(6.0 * second.modes[0].amplitude.median)
    numbers = {row.name: row for row in second.inputs.numbers}
    assert numbers["modes[0].inertia.mean"].origin == "stated"
    assert first.modes[0].damper.mass == alone.modes[0].damper.mass, "what is offered changes no damper of its own"
    for k, one in enumerate(sizings):
        (every,), (own,) = one.both.existing, one.existing
        assert [len(each.left.each) for each in (every, own)] == [2, 1]
        assert [each.position for each in every.dampers] == [0.5, 0.4]
        assert own.left.each[0] == pytest.approx(every.left.each[k], abs=0.01)
    with pytest.raises(InputError, match="no stated motion"):
        size([(tree, heaving), (other, replace(heaving, motion=Motion.TORSIONAL))], [limit("kd")])
    with pytest.raises(InputError, match="--other"):
        size([(tree, heaving), (tree, replace(heaving))], [limit("kd")])
