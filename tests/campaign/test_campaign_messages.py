"""What is said of spoiled TOML of all four kinds, word for word as it was before one mechanism read them."""

import copy
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from campaign_room import TIME, csv

from scruton.campaign import Motion, load_campaign
from scruton.campaign.toml import parse_toml
from scruton.errors import InputError
from scruton.infer.cards import load_card
from scruton.simulate import write_campaign
from scruton.sizing.bridge import load_bridge

SPOILED = Path(__file__).parent / "spoiled"
CASES = json.loads((SPOILED / "messages.json").read_text(encoding="utf-8"))
READ = {
    "campaign": load_campaign,
    "campaign_t": load_campaign,
    "card": load_card,
    "bridge": lambda path: load_bridge(path, Motion.HEAVING),
    "bridge_t": lambda path: load_bridge(path, Motion.TORSIONAL),
    "spec": lambda path: write_campaign(path, path.parent / "out", seed=1),
}


@pytest.fixture
def beside(tmp_path: Path) -> Path:
    """The files that the tables name."""
    rows = np.c_[TIME, np.cos(50.0 * TIME)][:60].T
    (tmp_path / "r.csv").write_text(csv("time [s],displacement [mm]", *rows), encoding="utf-8")
    (tmp_path / "s.csv").write_text("wind speed [m/s],amplitude [mm]\n5,1\n6,2\n", encoding="utf-8")
    np.savez(tmp_path / "d.npz", y=rows[1])
    (tmp_path / "shape.csv").write_text("x,y\n0,0\n1,0.5\n2,1\n3,0.5\n4,0\n", encoding="utf-8")
    (tmp_path / "rose.csv").write_text("v,h\n1,100\n5,1000\n10,100\n", encoding="utf-8")
    return tmp_path


def spoil(content: dict, at: list, change: list) -> dict:
    content = copy.deepcopy(content)
    owner = content
    for key in at[:-1]:
        owner = owner[key]
    value = owner.pop(at[-1])
    if change[0] == "set" and isinstance(owner, list):
        owner.insert(at[-1], change[1])
    elif change[0] == "set":
        owner[at[-1]] = change[1]
    elif change[0] == "typo":
        owner[at[-1][:-1] + "z"] = value
    return content


@pytest.mark.parametrize("kind", READ)
def test_what_is_spoilt_here_is_good_as_it_is(kind: str, beside: Path) -> None:
    path = beside / f"{kind}.toml"
    path.write_bytes((SPOILED / path.name).read_bytes())
    assert READ[kind](path) is not None


@pytest.mark.parametrize("kind", READ)
def test_messages_are_as_they_were(kind: str, beside: Path) -> None:
    content = tomllib.loads((SPOILED / f"{kind}.toml").read_text(encoding="utf-8"))
    path = beside / f"{kind}.toml"
    others = []
    for case in (case for case in CASES if case["kind"] == kind):
        path.write_text(tomli_w.dumps(spoil(content, case["at"], case["change"])), encoding="utf-8")
        with pytest.raises(InputError) as caught:
            READ[kind](path)
        found = str(caught.value).replace(f"{beside}/", "")
        if found != case["message"]:
            others.append((case["at"], case["change"], found, case["message"]))
    assert others == []


def test_a_slip_is_told_by_the_line_that_an_editor_counts():
    """A line separator in a comment is no line break to TOML."""
    text = "a = 1 # one\u2028two\u0085three\r\nb = .5\r\n"
    with pytest.raises(InputError, match=r"line 2: .*wanted a digit before the point: 0\.5"):
        parse_toml(text.encode(), Path("campaign.toml"))


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_toml_in_another_unicode_encoding_is_named(encoding: str):
    name = encoding.upper()[:6]
    with pytest.raises(InputError, match=f"found text in {name}; wanted a TOML file in UTF-8"):
        parse_toml("format = 1\n".encode(encoding), Path("campaign.toml"))
