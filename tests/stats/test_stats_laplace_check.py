"""Evidence from a short run at a known optimum: against an integral that is known."""

import numpy as np
import pytest
from scipy.stats import norm

from scruton.stats.evidence import bridge_halves
from scruton.stats.laplace_check import bridge_evidence, importance_evidence
from scruton.stats.student_t import StudentT

SCALE = np.array([1.0, 0.5, 2.0])
LOG_Z = 3.0 + float(np.log(SCALE).sum())


def density(u):
    return 3.0 + norm.logpdf(u / SCALE).sum(axis=-1)


def half(u):
    """Cut at zero in the first coordinate, with twice the density."""
    return np.where(u[:, 0] > 0.0, density(u) + np.log(2.0), -np.inf)


def proposal(width=1.05):
    return StudentT(np.zeros(3), width * np.diag(SCALE), 8.0)


def test_the_halves_of_a_normal_density_give_its_integral():
    rng = np.random.default_rng(0)
    chains = [SCALE * rng.standard_normal((20, 50, 3)) for _ in range(2)]
    halves = tuple((chain, density(chain)) for chain in chains)
    found = bridge_halves(density, halves, np.random.RandomState(1), 2000)
    assert found.log_z == pytest.approx(LOG_Z, abs=4.0 * found.error)
    assert found.error < 0.05


def test_importance_sampling_gives_the_integral():
    found = importance_evidence(density, proposal(), np.random.default_rng(1), 3000)
    assert found.log_z == pytest.approx(LOG_Z, abs=4.0 * found.error)
    assert found.error < 0.05


def test_a_proposal_that_is_too_narrow_says_so():
    found = importance_evidence(density, proposal(0.2), np.random.default_rng(1), 3000)
    assert not found.reliable


def test_a_short_run_is_bridged_to_the_integral_the_same_for_a_seed():
    found, again = (bridge_evidence(density, proposal(), 3, steps=60) for _ in range(2))
    assert found.log_z == again.log_z
    assert found.log_z == pytest.approx(LOG_Z, abs=4.0 * found.error + 0.02)
    assert bridge_evidence(density, proposal(), 3, steps=20).error > found.error


def test_walkers_start_inside_of_a_prior_that_is_cut():
    found = bridge_evidence(half, proposal(), 4, steps=60, inside=lambda u: np.abs(u) + 1e-9)
    assert found.log_z == pytest.approx(LOG_Z, abs=4.0 * found.error + 0.05)
