"""Bridge sampling on draws: against importance sampling, and against an integral that is known."""

import numpy as np
import pytest
from scipy.stats import norm

from scruton.calibrate.challenge.case import simulate_case
from scruton.gap.bridge import bridge_evidence
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import fit_bare
from scruton.gap.importance import importance
from scruton.stats.evidence import bridge_halves

SEED = 8101


def test_the_halves_of_a_normal_density_give_its_integral():
    rng = np.random.default_rng(0)
    scale = np.array([1.0, 0.5, 2.0])
    chains = [scale * rng.standard_normal((20, 50, 3)) for _ in range(2)]

    def density(u):
        return 3.0 + norm.logpdf(u / scale).sum(axis=-1)

    halves = tuple((one, density(one)) for one in chains)
    found = bridge_halves(density, halves, np.random.RandomState(1), 2000)
    assert found.log_z == pytest.approx(3.0 + np.log(scale).sum(), abs=4.0 * found.error)
    assert found.error < 0.05


@pytest.mark.slow
def test_bridge_and_importance_sampling_agree():
    campaign, _ = simulate_case(SEED, 1, None, 0.0)
    _, bare = fit_bare(load_gap(campaign))
    first, again = (bridge_evidence(bare, seed) for seed in (0, 1))
    assert first.log_z == pytest.approx(again.log_z, abs=4.0 * np.hypot(first.error, again.error))
    assert bridge_evidence(bare, 0, steps=30).error > first.error
    other = importance(bare, np.random.default_rng(1), 3000)
    assert first.log_z == pytest.approx(other.log_evidence, abs=4.0 * np.hypot(first.error, other.error) + 0.5)


def test_the_evidence_of_one_rig_is_bridged():
    campaign, _ = simulate_case(SEED, 2, None, 0.0, design="one-rig")
    _, bare = fit_bare(load_gap(campaign))
    found, again = (bridge_evidence(bare, 3, steps=30) for _ in range(2))
    assert found.log_z == again.log_z  # the same seed, the same bytes
    assert found.log_z == pytest.approx(bare.log_evidence, abs=2.0 + 4.0 * found.error)
    assert 0.0 < found.error < 0.5
