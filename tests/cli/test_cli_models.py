"""`scruton models`: the list, a card in full, its priors as a picture."""

import json
import tomllib

import pytest

from scruton.cli import main
from scruton.infer.cards import load_card, shipped_cards

MINE = """extends = "paper"
name = "mine"
title = "Mine"
[priors.relaxation_ratio]
median = 0.02
"""


def run(*arguments, capsys):
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_the_list_has_every_card_with_its_laws_and_title(capsys):
    code, out, _ = run("models", capsys=capsys)
    assert code == 0
    rows = {line.split()[0]: line for line in out.splitlines()[2:]}
    assert set(rows) == set(shipped_cards())
    assert next(iter(rows)) == "default"
    for name, line in rows.items():
        card = load_card(name)
        assert card.title in line
        assert (", ".join(f"{n:g}" for n in card.laws) or "free") in line


def test_a_card_is_printed_in_full_and_can_be_used_as_one(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8")
    code, out, _ = run("models", "show", tmp_path / "mine.toml", capsys=capsys)
    assert code == 0
    table = tomllib.loads(out)
    assert table["law"]["n"] == -1
    assert table["priors"]["relaxation_ratio"]["median"] == 0.02
    assert table["priors"]["relaxation_ratio"]["log_sd"] == 1.2
    (tmp_path / "copy.toml").write_text(out, encoding="utf-8")
    assert load_card(tmp_path / "copy.toml").priors == load_card(tmp_path / "mine.toml").priors


def test_the_priors_are_drawn_the_same_bytes_every_time(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8")
    for folder in ("one", "two"):
        arguments = ("models", "show", tmp_path / "mine.toml", "--prior-predictive", tmp_path / folder, "--seed", 3)
        code, out, _ = run(*arguments, capsys=capsys)
        assert code == 0
        assert out.split() == [str(tmp_path / folder / f"mine.{kind}") for kind in ("svg", "png")]
    for kind in ("svg", "png"):
        assert (tmp_path / "one" / f"mine.{kind}").read_bytes() == (tmp_path / "two" / f"mine.{kind}").read_bytes()
    assert "before any record" in (tmp_path / "one" / "mine.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("show", "defualt"), "no such model card; wanted the path of a card, or one of: default"),
        (("show", "defualt", "--prior-predictive", "x"), "no such model card"),
        (("show", "paper", "--prior-predictive", "x", "--seed", -1), "--seed: found -1; wanted a whole number"),
    ],
)
def test_mistakes_are_named(arguments, message, capsys):
    code, _, err = run("models", *arguments, capsys=capsys)
    assert code == 2
    assert message in err


def test_every_shipped_card_has_its_picture():
    for path in shipped_cards().values():
        assert (path.parent / "prior-predictive" / f"{path.stem}.svg").is_file()


def test_the_resolved_card_goes_into_the_results(small_results):
    card = json.loads((small_results / "fit.json").read_text(encoding="utf-8"))["provenance"]["card"]
    table = tomllib.loads(card["resolved"])
    assert "extends" not in table
    assert table["name"] == card["name"]
    assert table["priors"]["relaxation_ratio"]["median"] == load_card().priors["relaxation_ratio"].first
