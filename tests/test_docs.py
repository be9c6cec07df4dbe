"""What README and guide show must work as it stands there."""

import re
import sys
from collections.abc import Mapping
from dataclasses import is_dataclass
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import get_args, get_origin, get_type_hints

import numpy as np
import pytest

from scruton.calibrate import REGIMES
from scruton.campaign import Motion, load_campaign
from scruton.cli import parser
from scruton.infer.cards import UNITS, load_card, shipped_cards
from scruton.provenance import provenance
from scruton.sizing.bridge import load_bridge
from scruton.sizing.limits import RULES
from scruton.sizing.results import Sizing
from scruton.sizing.size import ASKED_FOR

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("campaign", "envelope", "stats", "dynamics", "infer", "griffin", "report", "calibrate")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def test_the_campaign_of_the_guide_loads(tmp_path):
    (tmp_path / "campaign.toml").write_text(blocks(ROOT / "docs/guide.md", "toml")[0], encoding="utf-8")
    t = np.arange(0.0, 10.0, 0.01)
    y = 0.002 * np.cos(50.0 * t)
    for name in ("rig1_free_decay.csv", "sc1p9_decay.csv", "sc1p9_growth.csv"):
        np.savetxt(tmp_path / name, np.c_[t, y], delimiter=",", header="time [s],displacement [m]", comments="")
    (tmp_path / "sweep.csv").write_text("wind speed [m/s],amplitude [mm]\n5.0,1.0\n5.7,4.9\n", encoding="utf-8")
    campaign = load_campaign(tmp_path)
    assert campaign.rig("1#").mass.sd == pytest.approx(0.035)
    assert [record.kind for record in campaign.test("Sc 1.9").records] == ["decay", "growth"]


def test_the_prior_of_the_guide_is_that_of_the_card():
    text = next(one for one in blocks(ROOT / "docs/guide.md", "toml") if one.startswith("[priors"))
    assert "stable_amplitude" in UNITS
    prior = load_card().priors["stable_amplitude.heaving"]
    for piece in (f"median = {prior.first:g}", f"log_sd = {prior.second:g}", prior.reason):
        assert piece in text


def test_the_card_of_the_guide_loads(tmp_path):
    text = next(one for one in blocks(ROOT / "docs/guide.md", "toml") if "extends" in one)
    (tmp_path / "card.toml").write_text(text, encoding="utf-8")
    card = load_card(tmp_path / "card.toml")
    assert (card.laws, card.law_weights, card.averaging) == ((-1.0, 2.0), (0.5, 0.5), "stacking")


@pytest.mark.parametrize("name", ["models/README.md", "docs/guide.md"])
def test_the_shipped_cards_are_named(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert {one for one in shipped_cards() if f"`{one}" not in text} == set()


def test_the_priors_that_the_pages_state_are_those_of_the_default_card():
    card, theory = load_card(), (ROOT / "docs/theory.md").read_text(encoding="utf-8")
    tau, kappa = (card.priors[f"discrepancy_{one}"] for one in ("amplitude", "relaxation"))
    assert tau.second == kappa.second
    stated = f"lognormal with medians {tau.first:g}\n($\\tau$) and {kappa.first:g} ($\\kappa$)"
    assert f"{stated} and a log standard deviation of {tau.second:g}." in theory
    guide = (ROOT / "docs/guide.md").read_text(encoding="utf-8")
    laws, weights = (", ".join(f"{one:g}" for one in values) for values in (card.laws, card.law_weights))
    assert f"n = {laws} with prior weights {weights}" in guide


@pytest.mark.parametrize("page", ["README.md", "docs/guide.md"])
def test_every_command_is_named(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    verbs = re.findall(r"^    ([a-z]+) ", parser().format_help(), re.MULTILINE)
    assert len(verbs) > 7
    mark = "| `{}` |" if page == "README.md" else "### `scruton {} "
    assert [one for one in verbs if mark.format(one) not in text] == []


def test_every_regime_is_named():
    text = (ROOT / "docs/calibration.md").read_text(encoding="utf-8")
    assert [one for one in REGIMES if f"`{one}`" not in text] == []


@pytest.mark.parametrize("room", ["", *(f".{one}" for one in ROOMS)])
def test_the_reference_names_everything_public(room):
    """Each public name of a room lies in a module of the reference that lists it, or lists all its members."""
    text = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    listed = dict(re.findall(r"automodule:: (\S+)\n   :members:(.*)", text))
    package = import_module(f"scruton{room}")
    missing = []
    for name in package.__all__:
        home = getattr(getattr(package, name), "__module__", None)
        if home is None or not home.startswith("scruton"):  # a constant, which autodoc does not describe
            found = f"`{name}`" in text
        else:
            found = home in listed and (not listed[home].strip() or name in listed[home].replace(" ", "").split(","))
        if not found and name != "__version__":
            missing.append(name)
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_that_are_shown_parse(page):
    for block in blocks(page, "sh"):
        for line in block.splitlines():
            if line.startswith("scruton "):
                words = re.findall(r'"[^"]*"|\S+', line.split(" #")[0])[1:]
                parser().parse_args([word.strip('"') for word in words])


def documented_fields() -> dict[str, set[str]]:
    """Fields of a sizing.json that the page names, by place."""
    page = (ROOT / "docs" / "sizing.md").read_text(encoding="utf-8")
    table = page.split("## What is in sizing.json")[1].split("\n## ")[0]
    rows = [row.strip("|").split("|", 1) for row in table.splitlines() if row.startswith("| ")][1:]
    return {place.strip(" `"): set(re.findall(r"`([^`]+)`", said)) for place, said in rows}


def test_every_field_of_a_sizing_is_documented_at_its_place():
    fields_at, seen = documented_fields(), set()

    def walk(kind: object, place: str) -> None:
        if is_dataclass(kind):
            if kind in seen:  # as where it stands first
                return
            seen.add(kind)
            said = fields_at[place or "the document"]
            for field, its in get_type_hints(kind).items():
                assert field in said, f"{place}.{field}"
                walk(its, f"{place}.{field}".lstrip("."))
        elif (origin := get_origin(kind)) is tuple:
            walk(get_args(kind)[0], f"{place}[]")
        elif origin is Mapping:
            walk(get_args(kind)[1], f"{place}.*")
        else:
            for part in get_args(kind):
                walk(part, place)

    walk(Sizing, "")
    assert len(seen) > 25
    made = provenance("size", seed=0, sha256={}, settings=ASKED_FOR)
    assert {"checksum", *made} <= fields_at["the document"] | fields_at["provenance"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.slow
def test_the_python_of_the_readme_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    (code,) = blocks(ROOT / "README.md", "python")
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("True")
    assert printed[-1].endswith("A/D")


def script(name: str):
    spec = spec_from_file_location(Path(name).stem, ROOT / "examples" / name)
    module = module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_the_tables_of_the_rectangle_are_those_that_its_script_prints(capsys):
    script("table5.py").main()
    printed = capsys.readouterr().out.strip("\n")
    page = (ROOT / "examples/rectangle-4to1/README.md").read_text(encoding="utf-8")
    stated = next(block for block in page.split("```") if printed.splitlines()[0] in block)
    # processors differ in the last digit
    numbers, rules = re.compile(r"[-+]?\d+(?:\.\d+)?"), re.compile("--+")
    words = [rules.sub("--", numbers.sub("#", text)).split() for text in (printed, stated)]
    assert words[0] == words[1]
    for found, wanted in zip(numbers.findall(printed), numbers.findall(stated), strict=True):
        unit = 10.0 ** -len(wanted.partition(".")[2])
        assert float(found) == pytest.approx(float(wanted), rel=0.02, abs=1.5 * unit)


def test_the_script_of_the_closed_box_loads():
    assert callable(script("closed-box-heaving/reciprocal.py").main)


@pytest.mark.parametrize("place", range(4))
def test_the_python_of_the_page_on_extending_runs(place):
    code = blocks(ROOT / "docs/extending.md", "python")[place]
    names: dict[str, object] = {"__name__": f"extending_{place}"}
    exec(compile(code, f"extending {place}", "exec"), names)


def test_the_law_of_the_page_on_extending_loads(tmp_path):
    (tmp_path / "larsen.toml").write_text(blocks(ROOT / "docs/extending.md", "toml")[0], encoding="utf-8")
    assert load_card(tmp_path / "larsen.toml").laws == (-1.0, 0.6)


def test_the_bridge_of_the_page_on_sizing_loads(tmp_path):
    (tmp_path / "bridge.toml").write_text(blocks(ROOT / "docs/sizing.md", "toml")[0], encoding="utf-8")
    bridge = load_bridge(tmp_path, Motion.HEAVING)
    assert [one.text for one in bridge.limits] == ["jtg", "kd", "0.12 m"]
    assert bridge.modes[0].lock_in == (7.5, 10.5)


@pytest.mark.parametrize("name", sorted(RULES))
def test_every_limit_is_in_the_page_on_sizing(name):
    text = (ROOT / "docs/sizing.md").read_text(encoding="utf-8")
    assert f"`{name}" in text or name in ("amplitude", "amplitude-over-depth", "angle")
