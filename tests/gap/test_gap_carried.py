"""What a fit carries of what was found: what was asked for, and nothing else."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from scruton.app.fit import carry
from scruton.calibrate.challenge.case import simulate_case
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.dynamics.effects.terms import Term
from scruton.gap.bands import GROUP, attach, chosen
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import Diagnosis, fit_null
from scruton.infer.cards import load_card

FIRST, SECOND = "aerodynamic_damping_nonlinearity", "stiffness_nonlinearity"


@pytest.fixture(scope="module")
def pair() -> Diagnosis:
    """A diagnosis of two effects, as a search leaves it."""
    data, null = fit_null(load_gap(simulate_case(900, 7, FIRST, 0.3)[0]))
    variants = [CATALOGUE[name].variants(data.layout)[0] for name in (SECOND, FIRST)]
    final = null.with_variants(variants[0]).with_variants(variants[1])
    gains = {"none": 0.0, FIRST: 50.0}
    beside = {SECOND: {SECOND: 0.9, "none": 0.1}}
    return Diagnosis(data, null, (FIRST, SECOND), final, {}, {}, gains, {"none": 0.02, FIRST: 0.98}, (), {}, (), beside)


def put_in(diagnosis: Diagnosis, effect: str) -> tuple[tuple[str, ...], xr.Dataset]:
    draws = xr.Dataset({"n": (("chain", "draw"), np.zeros((1, 50)))})
    tree = xr.DataTree.from_dict({"campaign_posterior": draws})
    return attach(tree, diagnosis, effect, 0), tree[GROUP].to_dataset()


def test_of_a_pair_what_is_asked_for_is_put_in_alone(pair: Diagnosis) -> None:
    names, both = put_in(pair, "auto")
    assert names == (FIRST, SECOND)
    assert (both.attrs["effect"], list(both.attrs["also"])) == (FIRST, [SECOND])
    for asked in (FIRST, SECOND):
        (name, fit) = chosen(pair, asked)
        assert fit is not None
        assert name == (asked,)
        assert [one.effect for one in fit.hypothesis.variants] == [asked]
        names, alone = put_in(pair, asked)
        assert names == (asked,)
        assert (alone.attrs["effect"], list(alone.attrs["also"])) == (asked, [])
    beyond = [term for term in CATALOGUE[FIRST].terms if term not in (Term.AERO, Term.DRIVE)]  # which the law has, too
    aerodynamic = [alone["coefficient"].sel(term=term.name.lower()).to_numpy() for term in beyond]
    assert not np.any(aerodynamic), "nor is what was found beside it"
    assert np.any(both["coefficient"].to_numpy() != 0.0)


def test_what_is_written_is_what_is_put_in(pair: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scruton.gap.diagnosis.diagnose_data", lambda *_, **__: pair)
    draws = xr.Dataset({"n": (("chain", "draw"), np.zeros((1, 50)))})
    for asked, used, also, probability in (
        ("auto", FIRST, [SECOND], 0.98),
        (FIRST, FIRST, [], 0.98),
        (SECOND, SECOND, [], 0.9),
    ):
        tree = xr.DataTree.from_dict({"campaign_posterior": draws})
        fit: Any = SimpleNamespace(tree=tree, summary={}, card=load_card())
        carry(fit, pair.data.campaign, asked, 0, lambda *_: None)
        said = {"asked": asked, "used": used, "also": also, "probability": probability}
        assert fit.summary["effect"] == said
        assert tree[GROUP].attrs["effect"] == used


def test_the_generic_term_goes_nowhere_by_the_name_of_what_stands_beside_it(pair: Diagnosis) -> None:
    hats = UNKNOWN.variants(pair.data.layout)[0]
    bend = pair.final.hypothesis.variants[0]
    unknown = replace(
        pair, found=("unknown", SECOND), final=pair.null.with_variants(bend).with_variants(hats, iterations=5)
    )
    for asked, names in ((SECOND, (SECOND,)), ("auto", ("unknown", SECOND))):
        carried, fit = chosen(unknown, asked)
        assert carried == names
        assert fit is not None
        assert [one.effect for one in fit.hypothesis.variants] == [SECOND]
        table = fit.table
        assert not np.any(table[:, Term.HAT : Term.BUMP])
