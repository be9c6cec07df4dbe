"""Model cards: the shipped ones load, and mistakes are named."""

import os
import re
import tomllib
from dataclasses import fields

import pytest
import tomli_w

from scruton.campaign.schema import Motion
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.laws import LAWS
from scruton.errors import InputError
from scruton.infer.cards import load_card, shipped_cards


@pytest.mark.parametrize("name", sorted(shipped_cards()))
def test_shipped_cards_load(name):
    card = load_card(name)
    assert card.name == name
    for prior in card.priors.values():
        assert prior.reason
        assert prior.unit


def test_the_default_card_weighs_four_laws_and_refers_to_the_papers():
    card = load_card()
    assert card.laws == (-1.0, 0.0, 1.0, 2.0)
    assert card.law_weights == pytest.approx((0.7, 0.1, 0.1, 0.1))
    assert card.averaging == "evidence"
    assert card.law_n == -1
    assert card.exponent is None
    for name in ("discrepancy_amplitude", "discrepancy_relaxation", "speed_scale_amplitude", "speed_length"):
        assert card.prior(name, Motion.HEAVING).logarithmic
    assert card.prior("stable_amplitude", Motion.HEAVING).unit == "A/D"
    assert card.prior("stable_amplitude", Motion.TORSIONAL).unit == "rad"


def test_one_law_has_all_the_weight():
    card = load_card("paper")
    assert (card.laws, card.law_weights, card.law_n) == ((-1.0,), (1.0,), -1.0)


def test_a_free_exponent_has_a_prior_and_no_weights():
    card = load_card("free-exponent")
    assert card.laws == card.law_weights == ()
    assert card.law_n is None
    assert (card.exponent.name, card.exponent.family) == ("law_exponent", "normal")


def test_a_card_that_extends_another_changes_what_it_names(tmp_path):
    """What it does not name is the other card's; a prior that names its family replaces the other whole."""
    (tmp_path / "base.toml").write_text(load_card().text, encoding="utf-8")
    (tmp_path / "mine.toml").write_text(
        """extends = "base.toml"
name = "mine"
[law]
averaging = "stacking"
[priors.noise_factor]
log_sd = 0.3
[priors.amplitude_scatter]
family = "loguniform"
low = 0.001
high = 0.1
unit = "-"
reason = "known"
[sampler]
draws = 16
""",
        encoding="utf-8",
    )
    base, mine = load_card(), load_card(tmp_path / "mine.toml")
    assert mine.name == "mine"
    assert (mine.laws, mine.averaging) == (base.laws, "stacking")
    assert mine.title == base.title
    noise = mine.prior("noise_factor", Motion.HEAVING)
    assert (noise.family, noise.first, noise.second) == ("lognormal", 1.0, 0.3)
    assert mine.prior("amplitude_scatter", Motion.HEAVING).family == "loguniform"
    assert mine.prior("stable_amplitude", Motion.HEAVING) == base.prior("stable_amplitude", Motion.HEAVING)
    assert (mine.sampler.draws, mine.sampler.walkers) == (16, base.sampler.walkers)
    assert base.text in mine.text
    assert 'name = "mine"' in mine.text
    assert mine.sha256 != base.sha256


def test_a_card_from_before_gusts_were_a_state_has_the_shipped_priors_of_them(tmp_path):
    table = tomllib.loads(load_card().resolved)
    for name in ("gust_scatter", "gust_time", "set_point_scatter", "departure_scale"):
        del table["priors"][name]
    (tmp_path / "old.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    assert load_card(tmp_path / "old.toml").priors == load_card().priors
    del table["priors"]["amplitude_scatter"]
    (tmp_path / "old.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    with pytest.raises(InputError, match=r"priors\.amplitude_scatter: found"):
        load_card(tmp_path / "old.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('extends = "defualt"', "extends: found 'defualt'; wanted another card's path, or one of: default"),
        ('extends = "card.toml"', "extends: found 'card.toml'"),  # itself
        ('extends = "default"\n[law]\nn = "free"', r"priors.law_exponent: found None; wanted a table"),
    ],
)
def test_a_card_that_extends_nothing_is_named(tmp_path, text, message):
    (tmp_path / "card.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_card(tmp_path / "card.toml")


def test_a_card_that_leaves_no_effect_to_look_for_is_refused(tmp_path):
    every = "".join(f"{name} = 0\n" for name in CATALOGUE)
    (tmp_path / "card.toml").write_text(f'extends = "default"\n[effects.weights]\n{every}', encoding="utf-8")
    with pytest.raises(InputError, match=r"effects.weights: found .*; wanted an effect of the catalogue at least"):
        load_card(tmp_path / "card.toml")
    one = every.replace("coulomb_friction = 0\n", "")
    (tmp_path / "card.toml").write_text(f'extends = "default"\n[effects.weights]\n{one}', encoding="utf-8")
    assert "coulomb_friction" not in load_card(tmp_path / "card.toml").effect_weights


def test_cards_that_extend_each_other_are_named(tmp_path):
    for one, other in (("a", "b"), ("b", "a")):
        (tmp_path / f"{one}.toml").write_text(f'extends = "{other}.toml"', encoding="utf-8")
    with pytest.raises(InputError, match="extends: found"):
        load_card(tmp_path / "a.toml")


@pytest.mark.parametrize("name", sorted(shipped_cards()))
def test_the_resolved_card_is_the_same_model_and_extends_nothing(tmp_path, name):
    card = load_card(name)
    assert "extends" not in tomllib.loads(card.resolved)
    path = tmp_path / "resolved.toml"
    path.write_text(card.resolved, encoding="utf-8")
    again = load_card(path)
    own = {one.name for one in fields(card)} - {"text"}
    assert {one: getattr(again, one) for one in own} == {one: getattr(card, one) for one in own}
    assert {key: prior.reason for key, prior in again.priors.items()} == {
        key: prior.reason for key, prior in card.priors.items()
    }


@pytest.mark.parametrize(
    ("name", "n"), [("paper", -1.0), ("gompertz", 0.0), ("quadratic", 1.0), ("ehsan-scanlan", 2.0)]
)
def test_every_law_of_the_family_has_a_card(name, n):
    card = load_card(name)
    assert (card.laws, card.law_weights) == ((n,), (1.0,))
    assert LAWS[name] == n


def test_what_the_cards_for_common_cases_change():
    """Only what their titles say; everything else is the default's."""
    base = load_card()
    changed = {
        "stacking": {"averaging"},
        "stated-damping": {"damping_relative_sd", "priors"},
        "friction-dampers": {"prior_none", "effect_weights"},
    }
    always = {"name", "title", "reasons", "text", "resolved"}
    for name, wanted in changed.items():
        card = load_card(name)
        assert {
            one.name for one in fields(card) if getattr(card, one.name) != getattr(base, one.name)
        } - always == wanted
    friction = load_card("friction-dampers").effect_weights
    assert max(friction, key=friction.__getitem__) == "coulomb_friction"
    assert load_card("stated-damping").damping_relative_sd > base.damping_relative_sd


@pytest.mark.parametrize("name", sorted(set(shipped_cards()) - {"default"}))
def test_a_card_gives_a_reason_for_what_differs(name):
    table = tomllib.loads(shipped_cards()[name].read_text(encoding="utf-8"))
    assert table["extends"] == "default"
    parts = [value for value in table.values() if isinstance(value, dict)]
    parts += [one for part in parts if "reason" not in part for one in part.values()]
    assert any(isinstance(one, dict) and len(one.get("reason", "")) > 20 for one in parts)


def test_prior_weights_of_laws_are_normalised_and_equal_where_none_are_given(tmp_path):
    four = r"n = \[-1, 0, 1, 2\]\nprior_weights = .*"
    some = load_card(changed(tmp_path, four, "n = [2, 0]\nprior_weights = [3, 1]"))
    assert (some.laws, some.law_weights, some.law_n) == ((2.0, 0.0), (0.75, 0.25), 2.0)
    equal = load_card(changed(tmp_path, r"prior_weights = .*\n", ""))
    assert equal.law_weights == (0.25,) * 4


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
        (r"n = \[-1, 0, 1, 2\]", 'n = "paper"', "law.n: found 'paper'; wanted a number from -2 to 12, a list"),
        (r"n = \[-1, 0, 1, 2\]", "n = []", r"law.n: found \[\]"),
        (r"n = \[-1, 0, 1, 2\]", "n = [-1, 0, 1, 40]", r"law.n: found \[-1, 0, 1, 40\]"),
        (r"n = \[-1, 0, 1, 2\]", "n = [-1, 0, 1, true]", "law.n: found"),
        (r"n = \[-1, 0, 1, 2\]", "n = [-1, 0, 0, 2]", "law.n.*every law once"),
        (r"prior_weights = .*", "prior_weights = [0.7, 0.3]", "law.prior_weights.*wanted 4 positive numbers"),
        (r"prior_weights = .*", "prior_weights = [1, 1, 1, 0]", "law.prior_weights.*wanted 4 positive numbers"),
        (r'averaging = "evidence"', 'averaging = "loo"', "law.averaging: found 'loo'; wanted one of: evidence"),
        (r"\[structural_damping\]", "[discrepancy]", "discrepancy: found an unknown key"),
        (r"\[priors\.noise_factor\]", "[priors.nois_factor]", "nois_factor: found an unknown key"),
        (r"log_sd = 1\.5", "log_sd = " + "9" * 400, "log_sd: found a number of 400 digits"),
        (r"log_sd = 1\.5", "log_sd = 1e300", "log_sd: found 1e[+]300; wanted a number between"),
        (r"log_sd = 1\.5", "log_sd = nan", "log_sd: found nan"),
        (r"log_sd = 1\.5", "log_sd = 1979-05-27", "log_sd: found datetime"),
        (r"walkers = 256", "walkers = 1e14", "sampler.walkers: found 1"),
        (r"walkers = 256", "walkers = [256]", "sampler.walkers"),
        (r'(?m)^name = ".*"', "name = 3", "name: found 3; wanted a text"),
        (r"format = 1", "format = 1\npriors = 3", "TOML"),
        (r"format = 1", 'format = 1\nextends = "a\\\\u0000b"', "extends: found"),
        (r'reason = "Vortex[^"]*"', "reason = 3", "heaving.reason: found 3"),
        (r"n = \[-1, 0, 1, 2\]", "n = [[-1], {}]", "law.n"),
        (r"prior_weights = .*", 'prior_weights = ["a"]', "law.prior_weights"),
    ],
)
def test_mistakes_are_named(tmp_path, pattern, replacement, message):
    with pytest.raises(InputError, match=message):
        load_card(changed(tmp_path, pattern, replacement))


def test_a_card_is_a_file_of_bounded_size(tmp_path):
    os.mkfifo(tmp_path / "card.toml")
    with pytest.raises(InputError, match="found a pipe"):
        load_card(tmp_path / "card.toml")
    with pytest.raises(InputError, match="found a folder"):
        load_card(tmp_path)


def test_no_such_card():
    with pytest.raises(InputError, match=r"no such model card; wanted the path of a card, or one of: .*default"):
        load_card("defualt")
