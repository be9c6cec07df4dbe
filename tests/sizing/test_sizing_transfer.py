"""Factors between tunnel and site: what is read, what they do to the damping that is needed, what a test is worth."""

from dataclasses import replace

import numpy as np
import pytest
from sizing_room import LIMIT, at_most, mode_model

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.sizing.bridge import Cost, load_bridge
from scruton.sizing.model import DETAILS, REYNOLDS, SOURCES, TRANSFER, TURBULENCE, unit_cube
from scruton.sizing.money import information
from scruton.sizing.risk import risk, shares
from scruton.sizing.transfer import Transfer, factor_at, handbook_factor, transfer_remarks

BRIDGE = 'format = 1\nwidth = "12 m"\ndepth = "3 m"\nlimits = ["jtg"]\n'
MODE = '[[modes]]\nname = "V1"\nfrequency = "0.3 Hz"\n'


@pytest.fixture
def read(tmp_path):
    def of(text="", mode=MODE, motion=Motion.HEAVING):
        path = tmp_path / "bridge.toml"
        path.write_text(BRIDGE + text + mode, encoding="utf-8")
        return load_bridge(path, motion)

    return of


def with_transfer(model, transfer):
    return replace(model, bridge=replace(model.bridge, transfer=transfer))


@pytest.mark.parametrize(("intensity", "ratio", "told"), [
    (0.05, 4, 0.93), (0.10, 4, 0.70), (0.12, 4, 0.57), (0.05, 8, 0.89), (0.10, 8, 0.58), (0.12, 8, 0.39),
    (0.05, 12, 0.87), (0.10, 12, 0.48), (0.12, 12, 0.25), (0.30, 8, 0.0),
])  # fmt: skip
def test_the_handbooks_factor(intensity, ratio, told):
    assert handbook_factor(intensity, 3.0 * ratio, 3.0) == pytest.approx(told, abs=0.006)


def test_what_nobody_states_is_assumed_and_said(read):
    bridge = read()
    assert bridge.transfer == Transfer(assumed=True)
    assert [factor.median for factor in bridge.transfer.factors] == pytest.approx([1.0] * 3)
    (remark,) = transfer_remarks(bridge.transfer, 12.0, 3.0, Motion.HEAVING)
    assert "15, 15 and 10 %" in remark
    assert 'transfer = "none"' in remark
    assert read('transfer = "none"\n').transfer is None
    assert transfer_remarks(None, 12.0, 3.0, Motion.HEAVING) == []


def test_what_is_stated_is_read(read):
    text = "transfer = { turbulence = 0.8, details = { median = 1.1, cov = 0.05 }, turbulence_intensity = 0.1 }\n"
    found = read(text).transfer
    assert (found.turbulence.mean, found.turbulence.sd) == (0.8, pytest.approx(0.12))  # never certain by silence
    assert found.details.median == pytest.approx(1.1)
    assert found.reynolds_number == Transfer().reynolds_number
    assert not found.assumed
    assert found.handbook(12.0, 3.0) == pytest.approx(0.7)
    (remark,) = transfer_remarks(found, 12.0, 3.0, Motion.HEAVING)
    assert "is 0.70" in remark
    assert transfer_remarks(found, 12.0, 3.0, Motion.TORSIONAL) == []


@pytest.mark.parametrize(("text", "field", "words"), [
    ('transfer = "off"\n', "transfer", "none"),
    ("transfer = { turbulense = 1.0 }\n", "transfer.turbulense", "turbulence"),
    ("transfer = { turbulence = -1.0 }\n", "transfer.turbulence", "greater than zero"),
    ("transfer = { turbulence_intensity = 1.5 }\n", "turbulence_intensity", "between 0 and 1"),
    ("transfer = 3\n", "transfer", "one table"),
    ('coherence_amplitude = "1 kg"\n', "coherence_amplitude", "a length"),
    ("coherence_amplitude = -0.1\n", "coherence_amplitude", "greater than zero"),
])  # fmt: skip
def test_bad_transfer_is_named_with_its_place(read, text, field, words):
    with pytest.raises(InputError) as caught:
        read(text)
    assert field in str(caught.value)
    assert words in str(caught.value)


def test_the_amplitude_of_coherence_is_over_the_depth_or_in_radians(read):
    cases = {"0.013": 0.0, '"39 +/- 9 mm"': 0.003, '{ mean = "39 mm", cov = 0.5 }': 0.0065,
             "{ mean = 0.013, sd = 0.003 }": 0.003}  # fmt: skip
    for text, sd in cases.items():
        found = read(f"coherence_amplitude = {text}\n").coherence_amplitude
        assert (found.mean, found.sd or 0.0) == pytest.approx((0.013, sd))
    found = read('coherence_amplitude = "0.3 deg"\n', motion=Motion.TORSIONAL).coherence_amplitude
    assert found.mean == pytest.approx(np.deg2rad(0.3))
    assert read().coherence_amplitude is None


def test_the_factors_multiply_the_amplitude():
    model, u = mode_model(0.1, 0.3), unit_cube(1 << 10, 2)
    transfer = Transfer(turbulence=Quantity(0.7, 0.1))
    plain, moved = model.draws(u), with_transfer(model, transfer).draws(u)
    factor = factor_at(transfer, u[:, list(TRANSFER)])
    np.testing.assert_allclose(moved.amplitude(0.001), factor * plain.amplitude(0.001))
    assert np.log(factor).std() == pytest.approx(np.sqrt(np.log1p([(0.1 / 0.7) ** 2, 0.15**2, 0.1**2]).sum()), rel=0.02)


def test_a_default_transfer_widens_what_is_required_and_leaves_its_middle():
    plain = risk(mode_model(0.1), at_most(LIMIT))
    wide = risk(with_transfer(mode_model(0.1), Transfer()), at_most(LIMIT))
    assert wide.required["0.50"] == pytest.approx(plain.required["0.50"], abs=1e-4)
    # under the paper's law the Scruton number that is needed follows the amplitude
    spread = np.sqrt(0.1**2 + np.log1p([0.15**2, 0.15**2, 0.1**2]).sum())
    whole = wide.required["0.50"] + 0.003 + 0.005139 - 0.00058
    assert wide.required["0.95"] == pytest.approx(
        whole * np.exp(1.645 * spread) - whole + wide.required["0.50"], rel=0.03
    )


def test_their_shares_are_those_of_their_variances():
    model = with_transfer(mode_model(0.2), Transfer())
    assert {TURBULENCE, REYNOLDS, DETAILS} <= set(model.uncertain())
    rows = {row.source: row.first for row in shares(model, LIMIT)["amplitude"]}
    total = 0.2**2 + np.log1p([0.15**2, 0.15**2, 0.1**2]).sum() + 0.02**2
    assert rows[SOURCES[TURBULENCE]] == pytest.approx(rows[SOURCES[REYNOLDS]], abs=0.02)
    assert rows[SOURCES[REYNOLDS]] == pytest.approx(np.log1p(0.15**2) / total, abs=0.05)
    assert rows[SOURCES[DETAILS]] == pytest.approx(np.log1p(0.1**2) / total, abs=0.05)


def test_a_large_scale_test_is_worth_more_than_another_rig_where_reynolds_number_is_what_is_unknown():
    cost, added = Cost("", 0.0, 0.0, 1e6, 2e7), np.linspace(0.0, 0.01, 41)
    transfer = Transfer(Quantity(1.0), Quantity(1.0, 0.3), Quantity(1.0))
    worth = {
        one.name: one.value for one in information(with_transfer(mode_model(0.1), transfer), LIMIT, cost, added).worth
    }
    large, rig = (worth[f"a {name} at the bridge's own Scruton number"] for name in ("large-scale test", "rig"))
    assert large > 1.5 * rig
    plain = {one.name for one in information(mode_model(0.1), LIMIT, cost, added).worth}
    assert not any("large-scale" in name for name in plain)


@pytest.mark.parametrize(("classes", "field", "words"), [
    ("share = 0.5\nfactor = 0.8", "turbulence", "sum to 1"),
    ("share = 1.0", "factor", "or for heaving an intensity"),
    ("share = 2.0\nfactor = 0.8", "share", "up to 1"),
    ("share = 1.0\nfactor = 0", "factor", "greater than zero"),
])  # fmt: skip
def test_bad_classes_of_turbulence_are_named_with_their_place(read, classes, field, words):
    wind = f'[wind]\nweibull_scale = "7 m/s"\nweibull_shape = 2.0\n[[wind.turbulence]]\n{classes}\n'
    with pytest.raises(InputError) as caught:
        read(mode=MODE + wind)
    assert field in str(caught.value)
    assert words in str(caught.value)


def test_a_class_without_a_factor_has_the_handbooks(read):
    wind = '[wind]\nweibull_scale = "7 m/s"\nweibull_shape = 2.0\n'
    wind += "[[wind.turbulence]]\nshare = 0.4\nintensity = 0.1\n[[wind.turbulence]]\nshare = 0.6\nfactor = 0.9\n"
    first, second = read(mode=MODE + wind).wind.turbulence
    assert (first.share, first.factor.mean) == (0.4, pytest.approx(0.7))
    assert (second.share, second.factor.mean, second.intensity) == (0.6, 0.9, None)
