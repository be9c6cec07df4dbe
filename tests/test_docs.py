"""What README and guide show must work as it stands there."""

import re
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.cli import parser
from scruton.infer.cards import PRIOR_NAMES, load_card

ROOT = Path(__file__).resolve().parents[1]
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
    assert "stable_amplitude" in PRIOR_NAMES
    prior = load_card().priors["stable_amplitude.heaving"]
    for piece in (f"median = {prior.first:g}", f"log_sd = {prior.second:g}", prior.reason):
        assert piece in text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_that_are_shown_parse(page):
    for block in blocks(page, "sh"):
        for line in block.splitlines():
            if line.startswith("scruton "):
                words = re.findall(r'"[^"]*"|\S+', line.split(" #")[0])[1:]
                parser().parse_args([word.strip('"') for word in words])


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
