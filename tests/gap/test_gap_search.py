"""Effects together, in a world where the evidence of every set of them is written down."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Effect, Layout
from scruton.dynamics.effects.effect import DAMPING, Extent
from scruton.dynamics.effects.terms import COLUMNS, Term
from scruton.gap import pairs
from scruton.gap import search as module
from scruton.gap.attribute import Candidate
from scruton.gap.search import Place, beside_unknown

A, B, C, BEND = "coulomb_friction", "structural_damping_nonlinearity", "fluid_memory", "stiffness_nonlinearity"
EFFECTS = (*(CATALOGUE[name] for name in (A, B, C, BEND)), UNKNOWN)
DATA = SimpleNamespace(layout=SimpleNamespace(
    records=("r",), wind=np.zeros(1, dtype=bool), largest=np.ones(1), reference_amplitude=1.0,
))  # fmt: skip
LAYOUT = Layout(
    ("growth", "decay"), np.zeros(2, dtype=int), np.zeros(2, dtype=int), np.array([1, -1]), np.full(2, 20.0),
    np.full(2, 12.0), np.full(2, 0.05), np.full(2, 8.0), np.full(2, 10.0), 0.05, 0.1, 12.0, np.geomspace(0.004, 0.1, 8),
)  # fmt: skip
SIZE = SimpleNamespace(name="size", log=False, positive=False, unit=DAMPING)
World = dict[tuple[str, ...], float]
Search = Callable[..., list[Place]]


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> Search:
    """Search a world: log evidence by the effects in the model; sets that are not written down have that of none."""

    def search(
        world: World, seen: Sequence[str] = (), bending: Sequence[str] = (), own: Sequence[str] = (),
        doubted: Sequence[str] = (), small: Sequence[str] = (), shared: Sequence[str] = (), alone: float = 0.9,
        damps: Sequence[str] = (), eases: Sequence[str] = (), unsure: Sequence[str] = (),
    ) -> list[Place]:  # fmt: skip
        def bend(table: Any, *_: object) -> None:
            table[..., Term.STIFFNESS] += 1.0

        evidence = {frozenset(names): value for names, value in world.items()}

        def size(name: str, count: int) -> FloatArray:
            return np.full(1, -1.0 if name in eases else 0.0 if name in small and count > 2 else 1.0)

        def fit(names: Sequence[str]) -> Any:
            variants = tuple(
                SimpleNamespace(
                    name=name, identity=name, effect=name, scan="", seen=float(name in seen),
                    parameters=(SIZE,) * (name in (*small, *damps, *eases)),
                    scope=SimpleNamespace(
                        extent=Extent.EACH_RIG if name in own else Extent.EVERYWHERE, records=np.ones(1, dtype=bool)
                    ),
                    apply=bend if name in bending else lambda *_: None,
                )
                for name in names
            )  # fmt: skip
            value = evidence.get(frozenset(names), 0.0)
            return SimpleNamespace(
                log_evidence=value, is_lost=False, mode=np.empty(0), names=tuple(names),
                value=lambda _name, k: (size(names[k], len(names)), np.full(1, 0.1)),
                with_variants=lambda variant, start: fit((*names, variant.name)),
                hypothesis=SimpleNamespace(null=None, variants=variants, data=DATA), table=np.ones((1, COLUMNS)),
            )  # fmt: skip

        def weigh(base: Any, effects: Sequence[Effect], **_: object) -> dict[str, Candidate]:
            fits = {}
            for effect in effects:  # of its forms the best, but where one alone is asked for
                forms = [*([effect.name] if effect in EFFECTS else []), f"{effect.name} alike"]
                fits[effect.name] = max((fit((*base.names, form)) for form in forms), key=lambda one: one.log_evidence)
            return {name: Candidate(name, one.log_evidence, one) for name, one in fits.items()}

        def hypothesis(_null: object, variants: Sequence[Any]) -> Any:
            slices = dict.fromkeys(((k, "size") for k in range(len(variants))), slice(0))
            return SimpleNamespace(
                start=lambda: np.empty(0), fit=lambda _u: fit([v.name for v in variants]), slices=slices
            )  # fmt: skip

        for place in (module, pairs):
            monkeypatch.setattr(place, "weigh", weigh)
        monkeypatch.setattr(module, "Hypothesis", hypothesis)
        null = fit(())
        singles = weigh(null, EFFECTS)

        def probable(place: Place) -> Mapping[str, float]:
            if place.base is null and place.candidates is singles:
                return {place.best.name: alone, "none": 1.0 - alone}
            if place.best.name in unsure:
                return {place.best.name: 0.6, "none": 0.4}
            return likely(place.best.name, doubted, shared)

        return module.search(null, singles, EFFECTS, probable=probable, workers=1, progress=lambda _what, _done: None)

    return search


def likely(name: str, doubted: Sequence[str], shared: Sequence[str] = ()) -> Mapping[str, float]:
    """Probabilities in the place of an effect."""
    if name in shared:
        return {name: 0.4, BEND if name != BEND else A: 0.3, "none": 0.2, "unknown": 0.1}
    return {name: 0.4, "none": 0.3, "unknown": 0.3} if name in doubted else {name: 0.9, "none": 0.1}


def names(places: Sequence[Place]) -> list[str]:
    return [place.best.name for place in places]


ALONE: World = {(A,): 50.0, (B,): 20.0, (C,): 5.0}


def test_one_effect_stands_alone(found: Search) -> None:
    (place,) = found(ALONE | {("unknown",): 45.0, (A, B): 52.0, (A, C): 51.0, (A, "unknown"): 53.0})
    assert place.best.name == A
    assert place.gains == {A: 50.0, B: 20.0, C: 5.0, BEND: 0.0, "unknown": 45.0}


def test_what_the_readings_show_by_themselves_excuses_nothing(found: Search) -> None:
    world: World = {(A,): 1000.0, (B,): 20.0, (A, B): 1030.0, (A, "unknown"): 1025.0}
    assert names(found(world)) == [A], "what the generic term mends may be the first one's form"
    assert names(found(world, seen=(A,))) == [A, B]
    world |= {(A, B): 1060.0, (A, "unknown"): 1055.0}
    assert names(found(world)) == [A, B], "the form is off by 4 % of what it gained, at most"
    assert names(found(world | {(A, B): 1010.0, (A, "unknown"): 1001.0})) == [A, B], "nor by what nothing mends"


def test_a_pair_wins_where_each_of_it_loses_to_the_generic_term(found: Search) -> None:
    # beside the first the generic term leads the second, so that effects that join one by one end with the first
    world: World = ALONE | {("unknown",): 90.0, (A, B): 110.0, (B, C): 30.0, (A, "unknown"): 150.0}
    assert names(found(world)) == [A, B]
    assert names(found(world | {("unknown",): 120.0})) == [A], "a pair with less evidence than the generic term is none"


def test_two_that_explain_nothing_alone_are_no_pair(found: Search) -> None:
    world: World = ALONE | {("unknown",): 90.0, (A, C): 110.0, (A, "unknown"): 150.0}
    assert names(found(world)) == [A], "C alone gains 5 of 110"
    assert names(found(world | {(C,): 6.0})) == [A, C]
    assert names(found(world, damps=[A, C])) == [A, C], "both add damping: neither mends the other"
    assert names(found(world, damps=[A], eases=[C])) == [A], "what the one adds the other takes"


def test_a_pair_is_sought_beside_what_was_found_where_the_generic_term_leads_there(found: Search) -> None:
    """A film of a swing, the sine of its angle, damped by friction and by drag: each loses to hats beside the sine."""
    world: World = {(C,): 158.0, (A,): 25.0, (B,): 17.0, (A, B): 128.0, (C, A): 166.0, (C, B): 170.0, (A, B, C): 290.0}
    world |= {("unknown",): 54.0, (C, "unknown"): 220.0}
    assert names(found(world)) == [C], "any two would mend what is none of them"
    assert sorted(names(found(world, damps=[A, B]))) == sorted([A, B, C])
    assert names(found(world | {(C, "unknown"): 178.0}, damps=[A, B])) == [C], "not where it gains less than two must"
    first, second = found(world | {(C, "unknown"): 300.0}, damps=[A, B])
    assert (first.gains["unknown"], second.best.name) == (142.0, C), "nor where the two have less"


def test_where_the_generic_term_gains_much_beside_what_was_found_it_is_judged_first(found: Search) -> None:
    world: World = {(A,): 400.0, (B,): 100.0, (A, B): 460.0, ("unknown",): 380.0}
    assert names(found(world | {(A, "unknown"): 530.0})) == [A], "130 beside 400: a form that is off"
    first, second = found(world | {(A, "unknown"): 600.0})
    assert (first.base.log_evidence, first.gains["unknown"]) == (400.0, 200.0)
    assert second.best.name == A
    assert names(found(world | {(A, "unknown"): 600.0, (A, B): 590.0})) == [A, B], "which a second effect mends"


def test_what_does_better_beside_the_others_takes_a_place(found: Search) -> None:
    world: World = {(C,): 60.0, (A,): 50.0, (B,): 40.0, (C, B): 90.0, (C, A): 70.0, (A, B): 130.0, ("unknown",): 30.0}
    places = found(world)
    assert sorted(names(places)) == [A, B]
    assert {place.best.name: place.gains[place.best.name] for place in places} == {A: 90.0, B: 80.0}


def test_where_one_effect_alone_is_looked_for_nothing_joins_it(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    """A card that leaves all others out ended in a traceback: nothing was left to stand beside what was found."""
    monkeypatch.setattr(f"{__name__}.EFFECTS", (CATALOGUE[A], UNKNOWN))
    assert names(found({(A,): 50.0, ("unknown",): 20.0, (A, "unknown"): 55.0})) == [A]
    assert names(found({(A,): 50.0, ("unknown",): 90.0, (A, "unknown"): 95.0})) == [A], "no partner for a pair"


def test_no_place_is_judged_twice_beside_the_same_effects(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    """B takes the place of the one that joined first: beside A it is not judged once more, and A is, beside B."""
    asked: list[tuple[str, ...]] = []
    together = module._together

    def counted(null: Any, effects: Sequence[Candidate]) -> Any:
        asked.append(tuple(effect.name for effect in effects))
        return together(null, effects)

    monkeypatch.setattr(module, "_together", counted)
    world: World = {(C,): 60.0, (A,): 50.0, (B,): 40.0, (C, B): 90.0, (C, A): 70.0, (A, B): 130.0, ("unknown",): 30.0}
    assert sorted(names(found(world))) == [A, B]
    assert len(asked) == len(set(asked)) == 3, asked


def test_what_mends_nothing_any_more_leaves(found: Search) -> None:
    world: World = {(C,): 60.0, (A,): 50.0, (B,): 40.0, (C, B): 90.0, (C, A): 70.0, (A, B): 130.0, (A, B, C): 141.0}
    assert sorted(names(found(world | {("unknown",): 30.0}))) == sorted([A, B, C])
    # beside A and B the third, which joined first, gains 4: less than it had to
    assert sorted(names(found(world | {(A, B, C): 134.0, ("unknown",): 30.0}))) == [A, B]


def test_a_further_effect_that_is_less_probable_than_not_leaves(found: Search) -> None:
    world: World = {(A,): 60.0, (B,): 20.0, (C,): 25.0, (A, B): 75.0, (A, C): 70.0, (A, B, C): 90.0}
    assert sorted(names(found(world))) == sorted([A, B, C])
    assert sorted(names(found(world, doubted=[C]))) == [A, B], "C gains as much as B, which stays"
    assert names(found(world, doubted=[B, C])) == [A]
    assert names(found(world, doubted=[A, B, C])) == [A], "the first one is judged by the verdict"


def test_what_several_names_share_stays_where_one_effect_alone_is_sure(found: Search) -> None:
    """A gain in gusts, a drift or tests that differ: 0.4 and twice 0.3, and none of them has a half."""
    world: World = {(A,): 60.0, (B,): 20.0, (C,): 25.0, (A, B): 75.0, (A, C): 70.0, (A, B, C): 90.0}
    assert sorted(names(found(world, shared=[C]))) == sorted([A, B, C])
    assert sorted(names(found(world, shared=[C], alone=0.4))) == [A, B], "two that make a gap of none together"
    assert sorted(names(found(world, alone=0.4))) == sorted([A, B, C]), "each by its own name is sure"


def test_damping_that_takes_what_friction_adds_is_named_only_if_it_is_sure(found: Search) -> None:
    """Of a cart pendulum's small amplitudes it mended the form of the friction, and foretold six times too much."""
    world: World = {(A,): 60.0, (B,): 20.0, (A, B): 75.0}
    assert sorted(names(found(world, unsure=[B], damps=[B]))) == sorted([A, B])
    assert names(found(world, unsure=[B], eases=[B])) == [A]
    assert sorted(names(found(world, eases=[B]))) == sorted([A, B])


def test_what_is_nothing_with_all_of_them_in_the_model_leaves(found: Search) -> None:
    """A gain found beside a poor optimum was 0.16 % with 0.86, and nothing in the model of all three."""
    world: World = {(A,): 60.0, (B,): 20.0, (C,): 25.0, (A, B): 75.0, (A, C): 70.0, (A, B, C): 90.0}
    assert sorted(names(found(world))) == sorted([A, B, C])
    assert sorted(names(found(world, small=[C]))) == [A, B], "C has a size beside one, and none beside two"


def test_damping_of_each_rig_by_its_own_gives_way_to_one_that_gains_read_differently(found: Search) -> None:
    """A gain of one rig scales what bends its damping: each rig's own left that gain nothing, and it was not found."""
    world: World = {(A,): 500.0, (C,): 20.0, (A, C): 501.0, (f"{A} alike",): 300.0, (f"{A} alike", C): 560.0}
    places = found(world, own=[A])
    assert names(places) == [A, C]
    assert [_form(place) for place in places] == [f"{A} alike", C]
    assert names(found(world | {(f"{A} alike", C): 490.0}, own=[A])) == [A], "with less evidence it is none"


def _form(place: Place) -> str:
    return place.best.variant.name  # type: ignore[union-attr]


# What the frequency shows is worth 500 with and without the rest, and the generic term knows nothing of it.
BENT: World = {
    (BEND,): 500.0, (A,): 30.0, (B,): 20.0, ("unknown",): 60.0,
    (BEND, A): 530.0, (BEND, B): 520.0, (BEND, C): 501.0, (BEND, "unknown"): 560.0,
}  # fmt: skip


def test_what_the_frequency_shows_does_not_pay_for_the_damping(found: Search) -> None:
    places = found(BENT)
    assert names(places) == [A, BEND]
    assert places[0].gains["unknown"] == 60.0, "against friction's 30, the frequency in both"
    assert names(found(BENT | {(BEND, A, B): 590.0})) == [A, B, BEND]


def test_what_only_the_frequency_shows_stands_alone(found: Search) -> None:
    (place,) = found({(BEND,): 500.0, (BEND, A): 501.0, (BEND, "unknown"): 503.0})
    assert place.best.name == BEND


def test_a_bend_that_is_not_quite_of_its_form_is_no_unknown_beside_itself(found: Search) -> None:
    world: World = {(BEND,): 2000.0, ("unknown",): 700.0, (BEND, "unknown"): 2040.0}
    assert found(world)[0].candidates["unknown"].log_evidence == 2040.0, "of the damping it may be"
    (place,) = found(world, bending=("unknown",))
    assert place.best.name == BEND, "40 nats are 2 % of what the bend explains"
    assert len(found(world | {(BEND, "unknown"): 2120.0}, bending=("unknown",))) == 2


def test_what_grows_with_the_amplitude_is_small_where_it_is_largest() -> None:
    """A part in A^4 of 1.9 % at the middle rig's stable amplitude, and of 30 % at the smallest Scruton number's."""
    (fourth,) = [
        variant for variant in CATALOGUE["aerodynamic_damping_nonlinearity"].variants(LAYOUT)
        if variant.label == "a part in A^4 of the aerodynamic damping"
    ]  # fmt: skip
    for ratio, small in ((1.0, {fourth.effect}), (2.0, set())):
        layout = replace(LAYOUT, largest=np.full(2, ratio * LAYOUT.reference_amplitude))
        hypothesis = SimpleNamespace(variants=(fourth,), data=SimpleNamespace(layout=layout))
        fit: Any = SimpleNamespace(hypothesis=hypothesis, value=lambda *_: (np.full(1, 0.019), np.full(1, 0.001)))
        assert module.negligible(fit) == small


@pytest.mark.parametrize(("level", "seen", "small"), [(1.5, 0.0, True), (1.0, 0.0, False), (1.5, 20.0, False)])
def test_a_saturation_that_hides_nothing_is_small_unless_it_is_seen(level: float, seen: float, small: bool) -> None:
    variant = next(one for one in CATALOGUE["sensor_clipping"].variants(LAYOUT) if one.label.startswith("rounded"))
    table = np.zeros((2, COLUMNS))
    table[:, Term.CLIP], table[:, Term.CLIP_SOFT] = level * LAYOUT.largest, 2.0
    hypothesis = SimpleNamespace(variants=(replace(variant, seen=seen),), data=SimpleNamespace(layout=LAYOUT))
    fit: Any = SimpleNamespace(hypothesis=hypothesis, table=table)
    assert module.negligible(fit) == ({"sensor_clipping"} if small else set())


def test_a_bend_that_gains_nothing_beside_the_unknown_leaves(found: Search) -> None:
    world: World = {(BEND,): 9.0, (A,): 16.0, (BEND, A): 17.0, ("unknown",): 287.0, (BEND, "unknown"): 274.0}
    (place,) = found(world)
    assert place.candidates["unknown"].log_evidence == 287.0
    assert len(found(world | {(BEND, "unknown"): 296.0})) == 2


def test_one_bend_read_with_a_wrong_gain_is_not_a_bend_of_every_rig(found: Search) -> None:
    alike = f"{BEND} alike"
    world: World = {
        (BEND,): 2560.0, (alike,): 2100.0, (A,): 300.0, (B,): 80.0,
        (BEND, A): 2560.0, (BEND, B): 2650.0, (alike, A): 2630.0, (alike, B): 2190.0,
    }  # fmt: skip
    assert names(found(world)) == [B, BEND], "alike in all of itself"
    assert names(found(world, own=(BEND,))) == [A, BEND]
    assert names(found(world | {(alike, A): 2500.0}, own=(BEND,))) == [B, BEND], "a form is off by no more than 4 %"


# The unknown leads in the place of A, C in the model.
LED: World = {(A,): 60.0, (C,): 50.0, ("unknown",): 55.0, (A, C): 100.0, (C, "unknown"): 130.0}


@pytest.mark.parametrize(
    ("more", "doubted", "held"),
    [
        ({}, (), [("unknown", C)]),
        ({("unknown",): 59.0}, (), [("unknown", C)]),
        ({("unknown",): 125.0, (A,): 126.0, (A, C): 200.0}, (), [("unknown",)]),
        ({}, (C,), [("unknown",)]),
        ({(B, "unknown"): 140.0}, (), [("unknown",)]),
        ({(B,): 20.0, (A, B): 110.0, (A, B, C): 140.0, (B, C): 90.0, (B, C, "unknown"): 170.0,
          (B, "unknown"): 165.0}, (), [("unknown", B)]),
    ],
    ids=["stays", "whatever else", "gains too little", "less probable than not", "another does better", "one of two"],
)  # fmt: skip
def test_what_was_found_stays_beside_the_unknown_if_it_holds_there(
    found: Search, more: World, doubted: Sequence[str], held: list[tuple[str, ...]]
) -> None:
    places = found(LED | more)
    assert names(places)[0] == A
    null = module.Hypothesis(None, ()).fit(None)  # type: ignore[arg-type]
    first, *others = beside_unknown(
        null, places, module.weigh(null, EFFECTS), EFFECTS, workers=1, progress=lambda _what, _done: None,
        probable=lambda place: likely(place.best.name, doubted),
    )  # fmt: skip
    assert [("unknown", *(place.best.name for place in others))] == held
    unknown = first.candidates["unknown"].best
    assert set(unknown.names) == set(held[0]), "what is weighed is what is reported"  # type: ignore[union-attr]
    for place in others:
        assert "unknown" in place.base.names, "judged beside it"  # type: ignore[attr-defined]
