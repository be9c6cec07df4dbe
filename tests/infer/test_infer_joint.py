"""What is printed is what predicts: laws mixed by their weights, and what the records leave at its prior."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from scruton.campaign.schema import Motion
from scruton.infer.cards import load_card
from scruton.infer.flagged import unconstrained
from scruton.infer.joint import (
    Joint,
    joint_draws,
    left_at_prior,
    mixed,
    names_at_prior,
    reference_holds,
    reference_remark,
    scales_remark,
    unconverged,
)
from scruton.infer.results import LawWeights
from scruton.stats.priors import Prior

SHAPE = (8, 500)
PRIORS = {name: Prior(name, "lognormal", 0.1, 0.8) for name in ("discrepancy_amplitude", "discrepancy_relaxation")}


def tree_of(weights: dict[str, float], law_n: float = -1.0) -> xr.DataTree:
    """Two peak tests whose amplitude is 1 under the first law, 2 under the second, and so on; Y1 under n = -1."""
    rng, count = np.random.default_rng(1), len(weights)
    n = np.array([np.nan if label == "n free" else float(label.removeprefix("n=")) for label in weights])
    level = np.arange(1.0, count + 1.0)[:, None, None, None] * np.ones((count, *SHAPE, 2))
    exponents = n[:, None, None] * np.ones((count, *SHAPE))
    exponents = np.where(np.isnan(exponents), -1.0 + 0.2 * rng.standard_normal(exponents.shape), exponents)
    own = {
        "a_star": level, "relaxation_rate": 3.0 * level, "mass_damping_factor": 100.0 * np.ones_like(level),
        "Y1": np.where((n == -1.0)[:, None, None, None], -rng.uniform(1.0, 2.0, level.shape), np.nan),
    }  # fmt: skip
    scales = {name: 0.1 * np.exp(0.8 * rng.standard_normal(exponents.shape)) for name in PRIORS}
    group = xr.Dataset(
        {name: (("law", "chain", "draw", "peak_test"), value) for name, value in own.items()}
        | {name: (("law", "chain", "draw"), value) for name, value in (scales | {"n": exponents}).items()},
        coords={"law": list(weights), "peak_test": ["a", "b"]},
    )
    laws = xr.Dataset({"weight": ("law", [*weights.values()])}, coords={"law": list(weights)})
    constant = xr.Dataset({"frequency": ("test", [2.0, 4.0]), "law_n": law_n}, coords={"test": ["a", "b"]})
    return xr.DataTree.from_dict({"/campaign_posterior": group, "/laws": laws, "/constant_data": constant})


@pytest.mark.parametrize("weights", [[1.0], [0.0, 1.0], [0.7, 0.1, 0.1, 0.1], [0.5, 0.0, 0.5], [1e-9, 1.0 - 1e-9]])
def test_every_law_gives_as_many_draws_as_its_weight_says_from_every_chain(weights: list[float]) -> None:
    law = mixed(np.array(weights), 4000)
    counts = np.bincount(law, minlength=len(weights))
    np.testing.assert_allclose(counts, 4000 * np.array(weights), atol=3.0)
    by_chain = np.array([np.bincount(chain, minlength=len(weights)) for chain in law.reshape(8, 500)])
    np.testing.assert_allclose(by_chain, 500 * np.tile(weights, (8, 1)), atol=4.0)


def test_the_law_without_weight_is_not_printed_but_for_its_own_parameters() -> None:
    tree = tree_of({"n=-1": 0.0, "n=2": 1.0})
    joint = joint_draws(tree)
    assert (joint.tests["b"]["a_star"] == 2.0).all()
    assert (joint.shared["n"] == 2.0).all()
    np.testing.assert_array_equal(
        joint.tests["b"]["Y1"], tree["campaign_posterior"]["Y1"].sel(law="n=-1", peak_test="b").to_numpy().reshape(-1)
    )
    assert "law_exponent" not in joint.tests["b"]


def test_laws_with_weight_are_mixed() -> None:
    joint = joint_draws(tree_of({"n=-1": 0.25, "n=2": 0.75}))
    for draws in joint.tests.values():
        assert draws["a_star"].mean() == pytest.approx(1.75, abs=0.002)
        assert set(zip(draws["a_star"], joint.shared["n"], strict=True)) == {(1.0, -1.0), (2.0, 2.0)}
    # factor lambda / omega0
    expected = 100.0 * 3.0 / (2.0 * np.pi * np.array([2.0, 4.0]))
    found = [np.min(draws["relaxation_scruton_number"]) for draws in joint.tests.values()]
    np.testing.assert_allclose(found, expected)


def test_a_free_exponent_is_printed_and_what_no_law_has_is_not() -> None:
    joint = joint_draws(tree_of({"n free": 1.0}, law_n=np.nan))
    assert joint.tests["a"]["law_exponent"].std() == pytest.approx(0.2, rel=0.05)
    assert "Y1" not in joint.tests["a"]
    assert "Y1" not in joint_draws(tree_of({"n=0": 1.0})).tests["a"]


def test_a_posterior_that_equals_its_prior_is_found_and_one_that_moved_is_not() -> None:
    rng = np.random.default_rng(2)
    z = rng.standard_normal(4000)
    same, narrow, moved = (0.1 * np.exp(0.8 * value) for value in (z, 0.6 * z, z - 0.5))
    for draws, expected in ((same, True), (narrow, False), (moved, False)):
        assert bool(left_at_prior({"tau": draws}, {"tau": PRIORS["discrepancy_amplitude"]})) == expected


def test_what_stays_at_its_prior_is_said_with_its_band() -> None:
    tree = tree_of({"n=-1": 1.0})
    assert scales_remark(joint_draws(tree)) == ""
    tree["campaign_posterior"].attrs["left_at_prior"] = "discrepancy_amplitude,discrepancy_relaxation"
    assert names_at_prior(tree) == tuple(PRIORS)
    remark = scales_remark(joint_draws(tree))
    assert "tau 0.098, 90 % 0.028 to 0.38" in remark
    assert "kappa" in remark
    assert "2 rigs say next to nothing" in remark
    assert scales_remark(Joint()) == ""


@pytest.mark.parametrize(
    ("labels", "weight", "log_evidence", "holds", "said"),
    [
        (("n=-1", "n=2"), [0.9, 0.1], [0.0, -2.0], True, False),
        (("n=-1", "n=2"), [0.01, 0.99], [0.0, 1.0], False, True),
        (("n=-1", "n=2"), [0.07, 0.93], [0.0, 200.0], False, False),  # the flag of the laws says it
        (("n=2",), [1.0], [0.0], False, False),
    ],
)
def test_the_law_of_y1_holds_where_it_carries_weight(labels, weight, log_evidence, holds, said) -> None:
    count = len(labels)
    weights = LawWeights(
        labels, np.full(count, 1 / count), np.array(weight), np.array(log_evidence), np.zeros(count),
        np.ones(count, bool), np.full(count, np.nan),
    )  # fmt: skip
    assert reference_holds(weights) == holds
    assert bool(reference_remark(weights)) == said
    if said:
        assert "does not hold" in reference_remark(weights)


def test_a_rate_that_the_rigs_curve_tells_is_not_said_to_rest_on_the_prior() -> None:
    """Three tests without transients: one whose rate the joint posterior knows, one that it does not, one not in it."""
    rng, card = np.random.default_rng(4), load_card()

    def of(name: str, size: int = 0) -> SimpleNamespace:
        return SimpleNamespace(
            test=SimpleNamespace(name=name), posterior=SimpleNamespace(data=SimpleNamespace(size=size))
        )

    section = SimpleNamespace(motion=Motion.HEAVING)
    sampled = SimpleNamespace(
        card=card,
        campaign=SimpleNamespace(section=section),
        tests=[of("told"), of("vague"), of("other"), of("full", 9)],
    )
    z = rng.standard_normal(4000)
    rates = {name: {"relaxation_rate": np.exp(sd * z)} for name, sd in (("told", 0.3), ("vague", 1.0))}
    (flag,) = unconstrained(sampled, Joint(tests=rates))
    assert flag.startswith("tests vague, other: no growth or decay record")
    sampled.tests = sampled.tests[:1]
    assert unconstrained(sampled, Joint(tests=rates)) == []


def test_a_law_without_weight_does_not_bring_the_verdict_down() -> None:
    rows = {
        "posterior": ["test a", "test b", "test off the peak", "campaign, n=-1", "campaign, n=1"],
        "converged": [False, True, False, False, True],
    }
    table = xr.DataTree(xr.Dataset({name: ("row", values) for name, values in rows.items()}))

    def of(weight: float, more: tuple[str, ...] = (), law_n: float = -1.0) -> list[str]:
        tree = tree_of({"n=-1": weight, "n=1": 1.0 - weight}, law_n)
        tree["convergence"] = table
        for name in more:
            tree[name] = xr.DataTree()
        return unconverged(tree)

    assert of(0.3) == ["test a", "test off the peak", "campaign, n=-1"]
    assert of(1e-9) == ["test off the peak"], "alone, a peak test is of the reference law"
    assert of(1e-9, law_n=np.nan) == ["test a", "test off the peak"]
    assert of(1e-9, ("speeds",)) == ["test a", "test off the peak"], "that model takes every test's own"
    assert unconverged(xr.DataTree.from_dict({"/convergence": table})) == [
        *rows["posterior"][:1],
        *rows["posterior"][2:4],
    ]
