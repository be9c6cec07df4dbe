"""The first look: one page before any sampling, that draws whole files and says which window to paste."""

import html
import json
import re
import shutil

import numpy as np
import pytest
from browser import chromium, opened

import scruton
from scruton.cli import main
from scruton.report.wording import PAGE

WINDOW = (1.0, 7.0)


@pytest.fixture(scope="module")
def page(small_campaign, tmp_path_factory):
    """Of a campaign whose decay is read in part."""
    folder = shutil.copytree(small_campaign, tmp_path_factory.mktemp("look") / "campaign")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    window = f'start = "{WINDOW[0]} s", stop = "{WINDOW[1]} s"'
    chosen, count = re.subn(r'(\{ file = "decay.csv",)', rf"\1 {window},", text)
    assert count == 1
    (folder / "campaign.toml").write_text(chosen, encoding="utf-8")
    assert main(["check", str(folder), "--html", str(folder / "check.html")]) == 0
    return folder / "check.html"


def charts(page):
    text = page.read_text(encoding="utf-8")
    return [json.loads(found) for found in re.findall(r'<script type="application/json">(.*?)</script>', text)]


def test_a_window_is_drawn_over_the_whole_of_its_file(page):
    (found,) = [one["window"] for one in charts(page) if "decay.csv" in one.get("window", {}).get("place", "")]
    assert (found["start"], found["stop"]) == pytest.approx(WINDOW, abs=0.01)
    assert found["min"] == 0.0
    assert found["max"] > WINDOW[1] + 1.0
    assert found["place"].startswith("tests[0].records[")


def test_the_quick_estimation_is_what_identify_finds(page):
    text = page.read_text(encoding="utf-8")
    found = scruton.check(page.parent)
    assert len(found.identified) == 2
    for row in found.identified:
        assert f"{row.Y1:.3g}".replace("-", "−")[:4] in text
    curves = charts(page)[0]["panels"][0]["series"]
    assert [one["label"] for one in curves[:-1]] == [row.record for row in found.identified]


def test_the_terminal_has_the_quick_estimation_and_measured_damping(small_campaign, tmp_path, capsys, monkeypatch):
    """Also of a rig that states no damping, within 80 letters."""
    folder = shutil.copytree(small_campaign, tmp_path / "campaign")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    silent, count = re.subn(r"\[rigs.damping_ratio\]\n.*\n.*\n", "", text)
    assert count == 1
    (folder / "campaign.toml").write_text(silent, encoding="utf-8")
    monkeypatch.setenv("COLUMNS", "80")
    found = scruton.check(folder)
    assert main(["check", str(folder), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    (rig,), (test,) = content["rigs"], content["tests"]
    assert rig["xi_s [%]"] == "-"
    measured = 100.0 * found.inspection.ringdowns["6#"].damping_ratio
    assert float(rig["xi_s measured [%]"].split(" +/- ")[0]) == pytest.approx(measured, rel=1e-3)
    for key, of in (("Y1", "Y1"), ("epsilon", "epsilon"), ("lambda [1/s]", "relaxation_rate")):
        values = sorted(getattr(row, of) for row in found.identified)
        assert [float(one) for one in test[key].split(" .. ")] == pytest.approx([values[0], values[-1]], rel=5e-3)
    assert main(["check", str(folder)]) == 0
    text = capsys.readouterr().out
    assert "epsilon" in text
    assert max(map(len, text.splitlines())) <= 80


def test_measured_damping_has_the_digits_of_its_error_and_a_record_set_aside_does_not_count(
    small_campaign, tmp_path, capsys
):
    folder = shutil.copytree(small_campaign, tmp_path / "campaign")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    noise = np.random.default_rng(1).normal(0.0, 1e-6, 2000)
    rows = "\n".join(f"{k / 100:.2f},{y:.9f}" for k, y in enumerate(noise))
    (folder / "weak.csv").write_text(f"time [s],displacement [m]\n{rows}", encoding="utf-8")
    name = re.search(r'file = "([^"]*)",[^}]*free-decay', text).group(1)
    weak = f'{{ file = "{name}", kind = "free-decay" }}, {{ file = "weak.csv", kind = "free-decay" }}'
    text, count = re.subn(rf'\{{ file = "{re.escape(name)}", kind = "free-decay" \}}', weak, text)
    assert count == 1
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    page = tmp_path / "check.html"
    assert main(["check", str(folder), "--html", str(page)]) == 0
    shown = re.search(r"^6#.*$", capsys.readouterr().out, re.MULTILINE).group(0).split()
    ringdown = scruton.check(folder).inspection.ringdowns["6#"]
    assert shown[-1] == "1", "that which is set aside is no ring-down"
    value, error = shown[-4], shown[-2]
    assert float(error) == pytest.approx(100.0 * ringdown.damping_ratio_sd, rel=0.5)
    assert len(value.partition(".")[2]) == len(error.partition(".")[2])
    assert "xi_s" not in page.read_text(encoding="utf-8")


def test_the_page_loads_nothing_and_leaves_no_file_behind(page):
    text = html.unescape(page.read_text(encoding="utf-8"))
    assert "default-src 'none'" in text
    assert "script-src 'sha256-" in text
    assert not re.search(r'(src|href)="https?:', text)
    assert not list(page.parent.glob("*.png"))


def test_a_page_that_cannot_be_written_is_refused_at_once(small_campaign, tmp_path, capsys):
    assert main(["check", str(small_campaign), "--html", str(tmp_path / "none" / "check.html")]) == 2
    assert "--html" in capsys.readouterr().err


@pytest.mark.skipif(chromium() is None, reason="no chromium here")
def test_a_window_follows_pointer_and_keys_and_says_what_to_paste(page, tmp_path):
    index = next(i for i, one in enumerate(charts(page)) if "decay.csv" in one.get("window", {}).get("place", ""))
    figure = f"document.querySelectorAll('figure.chart')[{index}]"
    with opened(page, tmp_path) as browser:
        paste = f"{figure}.querySelector('.paste').textContent"
        before = browser.value(paste)
        assert 'start = "1.0' in before
        browser.value(f"{figure}.scrollIntoView()")
        box = browser.value(
            f"(b => [b.x, b.y, b.width, b.height])({figure}.querySelector('svg').getBoundingClientRect())"
        )
        bars = f"[...{figure}.querySelectorAll('.edge')].map(e => e.getBoundingClientRect().x + 2)"
        start, stop = browser.value(bars)
        y = box[1] + 60
        there = start + 0.25 * (stop - start)
        for kind, x in (("mousePressed", start), ("mouseMoved", there), ("mouseReleased", there)):
            browser.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)
        dragged = float(re.search(r'start = "([\d.]+) s"', browser.value(paste)).group(1))
        assert dragged == pytest.approx(WINDOW[0] + 0.25 * (WINDOW[1] - WINDOW[0]), abs=0.1)
        browser.value(f"{figure}.querySelectorAll('input[type=range]')[1].focus()")
        browser.press("ArrowLeft", 37)
        stopped = float(re.search(r'stop = "([\d.]+) s"', browser.value(paste)).group(1))
        assert WINDOW[1] - 0.1 < stopped < WINDOW[1]
        assert browser.complaints() == []
        assert [one for one in browser.requests() if not one.startswith("data:")] == [page.as_uri()]


def test_captions_and_the_table_have_one_range_of_amplitudes(page):
    text = html.unescape(page.read_text(encoding="utf-8"))
    found = scruton.check(page.parent)
    for quality in found.qualities.values():
        low, high = (PAGE.number(end, 3) for end in quality.amplitude_range)
        assert re.search(rf"amplitudes of {quality.cycles} cycles, {low} to {high}", text)
        assert text.count(f"{low} to {high}") >= 2, "in the table, too"


def test_the_peak_of_a_rig_is_told_where_the_campaign_does_not_say_it(small_campaign, tmp_path, capsys):
    """By the rule that a fit goes by: of tests that say nothing, the one of the largest amplitude."""
    folder = shutil.copytree(small_campaign, tmp_path / "campaign")
    path = folder / "campaign.toml"
    stated = path.read_text(encoding="utf-8")
    assert "peak" not in stated
    assert scruton.check(folder).peaks == {"Sc 21.7"}
    main(["check", str(folder)])
    (row,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("Sc 21.7  "))
    assert " yes " in row
    text = stated.replace('name = "Sc 21.7"', 'name = "Sc 21.7"\npeak = false', 1)
    small = stated[stated.index("[[tests]]") :].replace("Sc 21.7", "off it").replace("0.0292", "0.02")
    path.write_text(text + re.sub(r"records = \[.*?\n\]\n", "", small, flags=re.S), encoding="utf-8")
    main(["check", str(folder)])
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith(("Sc 21.7  ", "off it  "))]
    assert [" yes " in row for row in rows] == [False, True], "what is stated goes first"
