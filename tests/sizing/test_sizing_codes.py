"""Amplitudes by codes: against a published calculation where one was found, else their formulas worked by hand."""

import numpy as np
import pytest

from scruton.campaign.schema import Motion
from scruton.sizing import codes

# The 4:1 rectangle of the paper's Table 1, second setting: m = 7.25 kg/m, xi = 0.643 %, rho = 1.2 kg/m^3: Sc = 21.70.
B, D, M, XI, RHO = 0.3, 0.075, 7.25, 0.00643, 1.2
SC = 4.0 * np.pi * M * XI / (RHO * B * D)
DECREMENT = 2.0 * np.pi * XI
TO_CODE = 0.005


def test_the_japanese_handbook_by_hand():
    """m_r = 7.25/(1.2 * 0.09) = 67.13, E_h = 0.065/4: h = E_h B/(m_r delta) = 1.7975 mm, 0.02397 D; twice for webs."""
    reduced = M / (RHO * B**2)
    assert reduced == pytest.approx(67.13, rel=1e-4)
    by_hand = 0.065 / 4.0 * B / (reduced * DECREMENT) / D
    assert by_hand == pytest.approx(0.02397, rel=TO_CODE)
    assert codes.japanese_handbook(SC, B, D) == pytest.approx(by_hand, rel=TO_CODE)
    assert codes.japanese_handbook(SC, B, D, shape=2.0) == pytest.approx(2 * by_hand, rel=TO_CODE)


def test_bd49_by_hand():
    """y = 0.5 * 0.3^0.5 * 0.075^2.5 * 1.2/(4 * 7.25 * delta) = 0.4323 mm, 0.00576 D."""
    y = 0.5 * B**0.5 * D**2.5 * RHO / (4.0 * M * DECREMENT)
    assert y == pytest.approx(0.0004321, rel=TO_CODE)
    assert codes.bd49(Motion.HEAVING, SC, B, D) == pytest.approx(y / D, rel=TO_CODE)


def test_bd49_in_torsion_by_hand():
    """At the edge y = c b^1.5 d^3.5 rho/(8 m r^2 delta), so a rotation of y/(b/2); J = m r^2."""
    inertia, sc = 0.05, 4.0 * np.pi * 0.05 * XI / (RHO * B**3 * D)
    y = 0.5 * B**1.5 * D**3.5 * RHO / (8.0 * inertia * DECREMENT)
    assert codes.bd49(Motion.TORSIONAL, sc, B, D) == pytest.approx(y / (B / 2), rel=TO_CODE)


def test_en_approach_1_by_hand():
    """Sc of the code is 2 delta m/(rho b^2) = 86.8 with b the depth; St 0.12, K 0.10, K_w 0.6, c_lat 1.1: 0.0528."""
    assert codes.en_scruton_number(SC, B, D) == pytest.approx(2.0 * DECREMENT * M / (RHO * D**2))
    assert codes.en_scruton_number(SC, B, D) == pytest.approx(86.8, rel=1e-3)
    assert codes.en_approach_1(SC, B, D, 0.12, mode_factor=0.10) == pytest.approx(0.0528, rel=TO_CODE)
    # a uniform mode has K = 1/(4 pi) (E.9), a half sine (2/pi)/(4 pi/2), which the code rounds to 0.10
    assert pytest.approx(0.10, rel=0.02) == (2 / np.pi) / (4 * np.pi * 0.5)
    assert codes.en_approach_1(SC, B, D, 0.12) == pytest.approx(0.0420, rel=TO_CODE)


def test_en_approach_1_as_a_published_calculation_prints_it():
    """A square tower of 60 m, 150 kg/m^3, xi = 1.5 %, rho = 1.2 kg/m^3: Sc 23.562, y = 14.126 m; K printed as 0.121.

    The notebook swe_ws2021_4_2_structural_effects of github.com/mpentek/SWELecture (commit 4e505a3).
    """
    sc = 4.0 * np.pi * 150.0 * 60.0**2 * 0.015 / (1.2 * 60.0**2)
    assert codes.en_scruton_number(sc, 60.0, 60.0) == pytest.approx(23.562, abs=6e-4)
    assert 60.0 * codes.en_approach_1(sc, 60.0, 60.0, 0.12, mode_factor=0.121) == pytest.approx(14.126, rel=TO_CODE)


def test_en_approach_2_by_hand():
    """A square in lock-in, Sc = 4 pi K_a/2 = 37.7: c1 = 0.04, sigma/b = sqrt(0.08) = 0.2828.

    k_p = sqrt(2) (1 + 1.2 arctan(0.75/16)) = 1.4937: y/b = 0.4225.
    """
    assert codes.en_approach_2(12.0 * np.pi, 1.0, 1.0, 0.12) == pytest.approx(0.4225, rel=TO_CODE)
    # (E.15) solves (E.14)
    sc, st, mass, slender = 60.0, 0.12, 0.01, 20.0
    force, damping, ceiling = codes.SQUARE
    peak = np.sqrt(2) * (1 + 1.2 * np.arctan(0.75 * (sc / (4 * np.pi * damping)) ** 4))
    sigma = codes.en_approach_2(sc, 1.0, 1.0, st, mass_ratio=mass, slenderness=slender) / peak
    inner = sc / (4 * np.pi) - damping * (1 - (sigma / ceiling) ** 2)
    assert sigma == pytest.approx(force / st**2 * np.sqrt(mass / slender) / np.sqrt(inner), rel=1e-9)


def test_which_codes_speak_of_a_section():
    def names(*of):
        return [one.name for one in codes.comparisons(*of, 0.12)]

    assert names(Motion.TORSIONAL, 0.6, 0.05) == ["BD 49/01"]
    assert names(Motion.HEAVING, B, D)[:2] == ["BD 49/01", "EN 1991-1-4, approach 1"]
    assert sum("Japanese" in name for name in names(Motion.HEAVING, B, D)) == 2
    assert names(Motion.HEAVING, 0.04, 0.05) == ["EN 1991-1-4, approach 1", "EN 1991-1-4, approach 2"]
    assert "EN 1991-1-4, approach 1" not in names(Motion.HEAVING, 1.2, 0.1)  # d/b = 12: no extrapolation
    sc = np.array([5.0, 20.0, 80.0])
    for one in codes.comparisons(Motion.HEAVING, B, D, 0.12):
        amplitude = one.amplitude(sc)
        assert (np.diff(amplitude) < 0.0).all()
        assert (amplitude > 0.0).all()
