"""An effect is what it says it is, wherever its functions come from."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.case import simulate_case
from scruton.campaign.schema import Campaign
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Layout, Term
from scruton.dynamics.effects.effect import Effect, Extent, Scope, Values, Variant, scopes, size_prior
from scruton.dynamics.effects.terms import BELONGS, COLUMNS, HATS, Belongs
from scruton.gap.diagnose import examine
from scruton.infer.cards import ModelCard, load_card

NAME = "structural_damping_nonlinearity"
OTHERS = ("coulomb_friction", "aerodynamic_damping_nonlinearity")


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return simulate_case(900, 3, NAME, 0.4, "one-rig")[0]


@pytest.fixture(scope="module")
def card() -> ModelCard:
    """Three effects alone, so that it is quick."""
    weights = dict.fromkeys((*CATALOGUE, UNKNOWN.name), 0.0) | dict.fromkeys((NAME, *OTHERS), 1.0)
    return replace(load_card(), effect_weights=weights)


def diagnosed(campaign: Campaign, card: ModelCard) -> dict[str, Any]:
    content = examine(campaign, card)[1]
    return {key: content[key] for key in ("verdict", "effects", "where", "advice", "indistinguishable", "shrink")}


@pytest.fixture(scope="module")
def usual(campaign: Campaign, card: ModelCard) -> dict[str, Any]:
    found = diagnosed(campaign, card)
    verdict = found["verdict"]
    assert found["effects"][verdict]["parameters"]
    assert any(finding["effect"] == verdict for finding in found["where"])
    return found


def in_partial(effect: Effect) -> Effect:
    """Every function of an effect hidden in a `functools.partial`."""

    def forms(layout: Layout) -> list[Variant]:
        return [replace(variant, apply=partial(variant.apply), effect="") for variant in effect.variants(layout)]

    return replace(effect, forms=partial(forms), size=replace(effect.size, read=partial(effect.size.read)))


def linear(power: int, table: FloatArray, values: Values, layout: Layout) -> None:
    term = (Term.STRUCTURAL_LINEAR, Term.STRUCTURAL_SQUARE)[power - 1]
    table[:, :, int(term)] += values["size"] * layout.rate / layout.reference_amplitude**power


def both(table: FloatArray, values: Values, layout: Layout) -> None:
    linear(1, table, {"size": values["linear"]}, layout)
    linear(2, table, {"size": values["square"]}, layout)


def written_here(effect: Effect) -> Effect:
    """The same physics, written in this file."""

    def forms(layout: Layout) -> list[Variant]:
        shares = {
            Extent.EVERYWHERE: (2.0, "in every rig alike"),
            Extent.EACH_RIG: (1.0, "in every rig, each its own"),
            Extent.ONE_RIG: (1.0, "in one rig"),
        }
        found = [
            Variant(f"as {name}, {{scope}}", (size_prior("size", scope.members),), partial(linear, power), scope,
                    scope.weight)
            for power, name in ((1, "A"), (2, "A^2"))
            for scope in scopes(layout, shares)
        ]  # fmt: skip
        everywhere = Scope(Extent.EVERYWHERE, layout.everywhere(), "in every rig alike")
        pair = tuple(size_prior(name, everywhere.members) for name in ("linear", "square"))
        others = [
            replace(one, effect="")
            for one in effect.variants(layout)
            if {"knee", "power"} & {p.name for p in one.parameters}
        ]
        return [*found, *others, Variant("as A and A^2, {scope}", pair, both, everywhere, 0.7)]

    return replace(effect, forms=forms)


@pytest.mark.parametrize("disguise", [in_partial, written_here])
def test_a_disguised_effect_says_the_same(disguise, campaign, card, usual, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    for name in (NAME, *OTHERS):
        monkeypatch.setitem(CATALOGUE, name, (disguise if name == NAME else in_partial)(CATALOGUE[name]))
    assert diagnosed(campaign, card) == usual


@pytest.fixture
def renamed() -> Iterator[str]:
    """The catalogue with one effect under another name, and afterwards as it was, in its order."""
    shipped = dict(CATALOGUE)
    CATALOGUE["sagging_springs"] = replace(CATALOGUE.pop(NAME), name="sagging_springs")
    yield "sagging_springs"
    CATALOGUE.clear()
    CATALOGUE.update(shipped)


def test_an_effect_of_another_name_is_another(campaign, card, usual, renamed) -> None:  # type: ignore[no-untyped-def]
    """The case that must fail: what decides is the name that an effect gives itself."""
    found = diagnosed(campaign, card)
    assert {NAME: renamed}.get(usual["verdict"], usual["verdict"]) == found["verdict"]
    assert NAME not in found["effects"]


def test_every_column_belongs_to_somebody() -> None:
    assert set(BELONGS) == set(Term)


@pytest.mark.parametrize("effect", [*CATALOGUE.values(), UNKNOWN], ids=lambda effect: effect.name)
def test_an_effect_writes_the_terms_that_it_says(effect: Effect) -> None:
    index = np.array([0, 0, 1, 1, 2, 2, 0])
    test = np.array([0, 0, 1, 1, 2, 2, -1])
    layout = Layout(
        tuple("abcdefg"), index, test, np.array([1, -1] * 3 + [0]), np.full(7, 20.0), np.full(7, 12.0),
        np.linspace(0.08, 0.12, 7), 8.0 + 0.2 * test, 9.0 + test,
        0.05, 0.1, 12.0, np.geomspace(0.004, 0.12, 8),
    )  # fmt: skip
    written: set[Term] = set()
    for variant in effect.variants(layout):
        table = np.full((1, 7, COLUMNS), 0.01)
        values = {p.name: np.where(p.members >= 0, 0.2, 0.0)[None] for p in variant.parameters}
        variant.apply(table, values, layout)
        changed = np.flatnonzero((table != 0.01).any(axis=(0, 1)))
        hats = range(Term.HAT, Term.HAT + HATS)
        written |= {Term.HAT if column in hats else Term(int(column)) for column in changed}
    assert written == set(effect.terms)
    assert effect.belongs in Belongs
