"""Rigs off the curve of the others: who is named, and how seldom where rigs merely scatter."""

from types import SimpleNamespace

import numpy as np
import pytest

from scruton.campaign.schema import Motion
from scruton.infer.cards import load_card
from scruton.infer.off_curve import off_curve


def said_of(factors, rng, *, shared, noise=0.03, sc=(5.0, 40.0)):
    """What is said of as many rigs on a* = 0.9/(Sc + 10), each off by its factor."""
    count, reference = len(factors), 20.0
    sc = np.linspace(*sc, count)
    shape = (4, 200, count)
    strength = sc + 10.0
    derived = {
        "a_star": 0.9 / strength * np.array(factors) * np.exp(noise * rng.standard_normal(shape)),
        "scruton_number": sc * np.ones(shape),
        "mass_damping_factor": 1000.0 * np.ones(shape),
        "relaxation_rate": strength / 1000.0 * np.exp(0.05 * rng.standard_normal(shape)),
        "reference_amplitude": 0.03 * np.exp(0.1 * rng.standard_normal(shape[:2])),
        "reference_relaxation": np.full(shape[:2], reference + 10.0),
        "n": np.full(shape[:2], -1.0),
    }
    names = tuple(f"test {k}" for k in range(count))
    each = [SimpleNamespace(wind=SimpleNamespace(omega0=1.0), relaxes=True) for _ in names]
    law = SimpleNamespace(
        label="n=-1", derived=derived,
        posterior=SimpleNamespace(tests=each, reference=(reference, 1000.0), shared=shared),
    )  # fmt: skip
    weights = SimpleNamespace(labels=("n=-1",), weight=np.ones(1))
    tests = [
        SimpleNamespace(test=SimpleNamespace(name=name), rig=SimpleNamespace(name="ABCDEF"[k]))
        for k, name in enumerate(names)
    ]
    return off_curve(SimpleNamespace(tests=names, laws=[law], weights=weights), tests)


@pytest.fixture(scope="module")
def scales():
    """Priors of the discrepancies between settings, of the shipped card."""
    card = load_card("default")
    return tuple(card.prior(name, Motion.HEAVING) for name in ("discrepancy_amplitude", "discrepancy_relaxation"))


@pytest.mark.parametrize(
    ("factors", "upper"),
    [
        ((1.8, 1.0, 1.75, 1.05, 0.95, 1.8), "rigs A, C, F and rigs B, D, E lie on two curves"),
        ((1.0, 1.8, 1.0, 1.8), "rigs B, D and rigs A, C lie on two curves"),
        ((1.0, 1.0, 1.3, 1.3, 1.3, 1.0), ""),
        ((0.75, 0.85, 0.95, 1.05, 1.15, 1.25), ""),
        ((0.6, 0.8, 1.0, 1.6, 2.0, 2.4), ""),
    ],
    ids=["two groups", "two pairs", "by no more than usual", "scatter", "no gap"],
)
def test_two_groups_of_rigs_on_two_curves_are_named(factors, upper, scales):
    """The rigs of a group foretell each other, so that no single one lies off all others."""
    sentence = said_of(factors, np.random.default_rng(4), shared=scales)
    assert sentence.startswith(upper) if upper else sentence == ""


@pytest.mark.parametrize("count", [2, 3, 6])
def test_plain_scatter_between_settings_names_no_rig(count, scales):
    """As the card has it, from a per cent to 30: seldom; the gap alone would name one twice as often."""
    rng = np.random.default_rng(71)
    tau = scales[0].from_sampled(scales[0].draw(rng, 300))
    named = [
        bool(said_of(np.exp(one * rng.standard_normal(count)), rng, shared=scales, noise=0.02, sc=(10.0, 25.0)))
        for one in tau
    ]
    assert np.mean(named) < 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / len(named))


@pytest.mark.parametrize("factor", [1.6, 0.625])
def test_a_rig_off_others_that_agree_is_named_and_not_in_a_wide_scatter(factor, scales):
    rng = np.random.default_rng(72)
    for agree in ((1.0, 0.99, factor, 1.02), (0.98, factor, 1.0)):
        which = "ABCDEF"[agree.index(factor)]
        sentence = said_of(agree, rng, shared=scales, noise=0.02, sc=(10.0, 25.0))
        assert sentence.startswith(f"rig {which} lies off the curve of the others")
    assert said_of((0.7, 1.3, 0.9, 1.15, 1.0, 1.75), rng, shared=scales, noise=0.02, sc=(10.0, 25.0)) == ""
