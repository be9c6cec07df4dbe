"""Model cards: the shipped ones load, and mistakes are named."""

import re

import pytest

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.infer.cards import load_card, shipped_cards


@pytest.mark.parametrize("name", sorted(shipped_cards()))
def test_shipped_cards_load(name):
    card = load_card(name)
    assert card.name == name
    for prior in card.priors.values():
        assert prior.reason
        assert prior.unit


def test_the_default_card_is_the_papers_law():
    card = load_card()
    assert card.law_n == -1
    assert card.prior("stable_amplitude", Motion.HEAVING).unit == "A/D"
    assert card.prior("stable_amplitude", Motion.TORSIONAL).unit == "rad"


def changed(tmp_path, pattern, replacement):
    text, count = re.subn(pattern, replacement, load_card().text, count=1)
    assert count == 1
    path = tmp_path / "card.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_copied_card_changes_a_prior(tmp_path):
    card = load_card(changed(tmp_path, r"median = 0\.05\nlog_sd = 1\.5", "median = 0.02\nlog_sd = 0.5"))
    prior = card.prior("stable_amplitude", Motion.HEAVING)
    assert (prior.first, prior.second) == (0.02, 0.5)
    assert card.sha256 != load_card().sha256


@pytest.mark.parametrize(
    ("pattern", "replacement", "message"),
    [
        (r"format = 1", "format = 2", "format: found 2; wanted format = 1"),
        (r"\[law\]", "[lwa]", "lwa: found an unknown key; wanted did you mean 'law'"),
        (r"log_sd = 1\.5", "log_ds = 1.5", "stable_amplitude.heaving.log_ds: found an unknown key.*'log_sd'"),
        (r"log_sd = 1\.5", "log_sd = -1.5", "stable_amplitude.heaving.*log_sd = -1.5 must be positive"),
        (r'family = "lognormal"', 'family = "lognormall"', "family: found 'lognormall'; wanted one of"),
        (r'reason = "Vortex[^"]*"', 'reason = ""', "heaving.reason: found nothing"),
        (r'kind = "state-space"', 'kind = "iid"', "likelihood.kind: found 'iid'"),
        (r"walkers = 256", "walkers = 2", "sampler.walkers: found 2; wanted at least 14"),
        (r"max_steps = 4000", "max_steps = 60", "sampler.max_steps: found 60; wanted at least 100"),
        (r"draws = 8", "draws = 30000", "sampler.draws: found 30000; wanted at most half of max_steps"),
        (
            r'family = "lognormal"',
            'family = "normal"',
            "heaving.family: found 'normal'; wanted one of: lognormal, loguniform",
        ),
        (r"draws = 8", "draws = 8.5", "sampler.draws: found 8.5; wanted a whole number"),
        (r"n = -1 ", 'n = "paper" ', "law.n: found 'paper'; wanted a number"),
        (r"\[priors\.noise_factor\]", "[priors.nois_factor]", "nois_factor: found an unknown key"),
    ],
)
def test_mistakes_are_named(tmp_path, pattern, replacement, message):
    with pytest.raises(InputError, match=message):
        load_card(changed(tmp_path, pattern, replacement))


def test_no_such_card():
    with pytest.raises(InputError, match=r"no such model card; wanted the path of a card, or one of: .*default"):
        load_card("defualt")
