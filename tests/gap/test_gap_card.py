"""What diagnosis takes for granted is what the model card says."""

from dataclasses import replace
from pathlib import Path

import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.errors import InputError
from scruton.gap.data import load_gap
from scruton.gap.hypothesis import Hypothesis
from scruton.gap.null_model import null_model
from scruton.infer.cards import ModelCard, load_card

CARD = 'format = 1\nname = "mine"\nextends = "default"\n'
WHY = 'unit = "-"\nreason = "none"\n'


def card(folder: Path, text: str) -> ModelCard:
    (folder / "mine.toml").write_text(CARD + text, encoding="utf-8")
    return load_card(folder / "mine.toml")


def scale(chosen: ModelCard, name: str) -> float:
    """Prior standard deviation of a parameter of the null model, of a campaign whose damping is stated without any."""
    campaign, _ = simulate_case(900, 3, None, 0.0, "one-rig")
    rigs = [
        replace(rig, damping_ratio=replace(rig.damping_ratio, sd=None)) for rig in campaign.rigs if rig.damping_ratio
    ]
    data = load_gap(replace(campaign, rigs=tuple(rigs)), chosen)
    hypothesis = Hypothesis(null_model(data))
    return float(hypothesis.prior[1][hypothesis.slices[None, name]][0])


@pytest.mark.parametrize(
    ("text", "name", "wanted"),
    [
        ("", "damping", 0.1),
        ("[structural_damping]\nrelative_sd = 0.3\n", "damping", 0.3),
        ("", "stiffness", 5e-4),
        ("[diagnosis.stiffness]\nsd = 0.002\n", "stiffness", 0.002),
        ("[diagnosis.scatter]\nlog_sd = 0.4\n", "scatter", 0.4),
    ],
)
def test_the_null_model_has_the_priors_of_the_card(tmp_path: Path, text: str, name: str, wanted: float) -> None:
    assert scale(card(tmp_path, text), name) == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (f'[diagnosis.gain]\nfamily = "uniform"\nlow = -1.0\nhigh = 1.0\n{WHY}', "diagnosis.gain.family"),
        (f'[diagnosis.noise]\nfamily = "normal"\nmean = 1.0\nsd = 0.1\n{WHY}', "diagnosis.noise.family"),
        ('[diagnosis.aerodynamic_rate]\nunit = "1/s"\n', "diagnosis.aerodynamic_rate.unit"),
        ("[diagnosis.stifness]\nsd = 0.1\n", "diagnosis.stifness"),
    ],
)
def test_what_makes_no_prior_is_refused_with_its_place(tmp_path: Path, text: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        card(tmp_path, text)
    assert field in str(caught.value)


def test_a_card_that_extends_none_may_leave_the_null_model_out(tmp_path: Path) -> None:
    default = load_card()
    text = default.resolved.partition("[diagnosis.")[0] + "[sampler]" + default.resolved.partition("[sampler]")[2]
    (tmp_path / "whole.toml").write_text(text, encoding="utf-8")
    assert load_card(tmp_path / "whole.toml").null_priors == default.null_priors


def test_an_older_card_has_the_shipped_gusts(tmp_path: Path) -> None:
    """One that states a null model of its own, from before gusts were a state."""
    default = load_card()
    first, _, rest = default.resolved.partition("[diagnosis.gust_scatter]")
    old = (first + "[effects" + rest.partition("[effects")[2]).replace("median = 0.008", "median = 0.02")
    (tmp_path / "whole.toml").write_text(old, encoding="utf-8")
    priors = load_card(tmp_path / "whole.toml").null_priors
    assert priors["scatter"].first == 0.02
    for name in ("gust_scatter", "gust_time", "set_point_scatter"):
        assert f"[diagnosis.{name}]" not in old
        assert priors[name] == default.null_priors[name]
