"""`scruton size --other`: heaving and torsion of one bridge, from two small fits to the report."""

import io
import json
import shutil
from contextlib import redirect_stdout

import pytest

from scruton import report
from scruton.cli import main
from scruton.errors import InputError
from tests.conftest import CARD

TORSION = """
format = 1
title = "The same deck, twisting"

[section]
motion = "torsional"
width = "0.25 m"
depth = "0.05 m"

[simulation]
sample_rate = 150
turbulence = 0.01
sensor_noise = 0.0001

[[rigs]]
name = "T"
mass = { mean = "0.012 kg m^2/m", sd = "6e-05 kg m^2/m" }
frequency = "6 Hz"
damping_ratio = { mean = 0.004, sd = 0.0002 }

[[tests]]
name = "twist"
rig = "T"
air_density = "1.225 kg/m^3"
wind_speed = "3.3 m/s"
truth = { Y1 = -0.0422, epsilon = 0.0986 }

[[tests.records]]
file = "decay.csv"
kind = "decay"
initial_amplitude = 2.0
duration = 9

[[tests.records]]
file = "growth.csv"
kind = "growth"
initial_amplitude = 0.2
duration = 9
"""

BRIDGE = """format = 1
title = "A deck that does both"
width = "12 m"
depth = "3 m"
limits = ["0.06 m", "0.4 deg"]

[[modes]]
name = "V1"
motion = "heaving"
frequency = "0.3 Hz"
mass = "20000 kg/m"
length = "400 m"

[[modes]]
name = "T1"
motion = "torsional"
frequency = "0.8 Hz"
inertia = "8e5 kg*m^2/m"
length = "400 m"
"""


@pytest.fixture(scope="module")
def deck(tmp_path_factory, quick_results):
    """The small heaving fit, a torsional one, and the bridge of both."""
    folder = tmp_path_factory.mktemp("deck")
    for name, text in (("spec.toml", TORSION), ("card.toml", CARD), ("bridge.toml", BRIDGE)):
        (folder / name).write_text(text, encoding="utf-8")
    campaign, torsion = folder / "campaign", folder / "torsion"
    assert main(["simulate", str(folder / "spec.toml"), "-o", str(campaign), "--seed", "3", "--quiet"]) == 0
    card = str(folder / "card.toml")
    assert main(["fit", str(campaign), "-o", str(torsion), "--model", card, "--quiet"]) in (0, 1)
    shutil.copytree(quick_results, folder / "heaving")
    return folder / "heaving", torsion, folder / "bridge.toml"


@pytest.fixture(scope="module")
def first(deck):
    """The first sizing of the deck, where it goes by itself."""
    return sizing_of(deck)


@pytest.fixture(scope="module")
def sized(first):
    return first[0]


def sizing_of(deck):
    """Size the deck: where it went, and what was printed on a terminal of eighty columns."""
    heaving, torsion, bridge = deck
    printed, before = io.StringIO(), set(heaving.glob("sizing*"))
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.setenv("COLUMNS", "80")
        assert main([str(one) for one in ("size", heaving, "--other", torsion, "--bridge", bridge)]) in (0, 1)
    (folder,) = {*heaving.glob("sizing*")} - before
    return folder, printed.getvalue()


def test_each_motion_has_its_file_and_both_the_union(sized):
    heaving, torsion = (json.loads((sized / part / "sizing.json").read_text()) for part in ("", "torsional"))
    assert [mode["name"] for mode in heaving["modes"]] == ["V1"]
    assert [mode["name"] for mode in torsion["modes"]] == ["T1"]
    assert torsion["amplitude_unit"] == "rad", "files hold radians"
    assert heaving["both"] == torsion["both"]
    both = heaving["both"]
    assert (both["names"], both["motions"]) == (["V1", "T1"], ["heaving", "torsional"])
    for what in ("without", "with_required_damping", "with_dampers"):
        each, either = both[what]["each"], both[what]["any"]
        assert max(each) <= either <= sum(each) + 1e-9
    for mode, risk in zip((heaving["modes"][0], torsion["modes"][0]), both["without"]["each"], strict=True):
        limit = next(one for one in mode["limits"] if one["rule"] == mode["governing"])
        assert risk == pytest.approx(limit["probability"], abs=0.02), "the same bridge, other draws"
    for path in (sized / "required_damping.png", sized / "torsional" / "required_damping.png"):
        assert path.stat().st_size > 5_000


@pytest.mark.slow  # quicker: of one motion, in test_cli_alike.py
@pytest.mark.usefixtures("no_figures")
def test_a_second_run_gets_a_number(deck, sized):
    folder, text = sizing_of(deck)
    assert folder == deck[0] / "sizing-2"
    for part in ("", "torsional"):
        assert (sized / part / "sizing.json").is_file()
        assert str(folder / part / "sizing.json") in text


def test_the_terminal_shows_both_in_eighty_columns(deck, first):
    heaving, (folder, text) = deck[0], first
    assert folder == heaving / "sizing"
    for part in ("", "torsional"):
        assert str(folder / part / "sizing.json") in text
    lines = [line for line in text.splitlines() if not line.startswith(str(heaving))]
    assert max(map(len, lines)) <= 80
    assert "T1 (torsional)" in " ".join(" ".join(lines).split())


def test_the_report_of_results_shows_both(deck, sized, tmp_path):
    folder = tmp_path / "results"
    shutil.copytree(deck[0], folder, ignore=shutil.ignore_patterns("sizing*", ".scruton"))
    shutil.copytree(sized, folder / "sizing")
    assert main(["report", str(folder), "--quiet"]) in (0, 1)
    text = next(folder.rglob("report.html")).read_text(encoding="utf-8")
    assert "Heaving and torsion together" in text
    assert "mode T1" in text
    assert "Torsional modes" in text
    said_of_both(next(folder.rglob("report.json")))


def said_of_both(path):
    numbers, text = json.loads(path.read_text()), path.with_name("report.html").read_text(encoding="utf-8")
    assert not numbers["failures"]
    assert {"decision", "risk", "risk_torsional", "decision_torsional", "required_damping_torsional"} <= {
        *numbers["figures"]
    }
    assert {"required_damping", "required_damping_torsional", "both"} <= {*numbers["tables"]}
    first, later = text.split('id="sizing"', 1)
    for said in ("mode V1", "mode T1 (torsional)", "Risk of any mode"):
        assert said in first.split('id="summary"', 1)[1]
    assert later.index("Heaving modes") < later.index("Torsional modes") < later.index("Heaving and torsion together")


@pytest.mark.slow  # quicker: the report of results, above, and one motion by both verbs, in test_cli_size.py
def test_a_report_sizes_both_motions_as_size_does(deck, sized, tmp_path):
    heaving, torsion, bridge = deck
    out = tmp_path / "report"
    arguments = ["report", heaving, "--other", torsion, "--bridge", bridge, "-o", out, "--no-gap", "--quiet"]
    assert main([str(one) for one in arguments]) in (0, 1)
    for part in ("", "torsional"):
        made, by_size = (json.loads((folder / part / "sizing.json").read_text()) for folder in (out, sized))
        assert made["both"] == by_size["both"]
        assert made["modes"] == by_size["modes"]
        assert made["provenance"]["bridge_sha256"] == by_size["provenance"]["bridge_sha256"]
    said_of_both(out / "report.json")


def test_a_report_of_both_motions_wants_the_bridge_and_a_fit_of_the_other(deck, tmp_path, capsys):
    heaving, torsion, bridge = deck
    out = ["-o", str(tmp_path / "report")]
    for verb in ("report", "size"):
        assert main([verb, str(heaving), "--other", str(torsion), *out]) == 2
        assert "--bridge: the bridge.toml with modes of both motions" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"other.* bridge: the bridge\.toml with modes of both motions"):
        report(heaving, tmp_path / "p", other=torsion)
    assert main(["report", str(heaving), "--other", str(heaving), "--bridge", str(bridge), *out]) == 2
    assert "another fit of a heaving section" in capsys.readouterr().err
    assert main(["report", str(heaving), "--other", str(tmp_path), "--bridge", str(bridge), *out]) == 2
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([], ["--bridge"]),
        (["--bridge", "BRIDGE", "--damper", "12 t, 0.29"], ["--damper"]),
        (["--bridge", "BRIDGE", "--identified", "V9: 0.3 Hz"], ["--identified", "V1, T1"]),
    ],
)
def test_what_cannot_be_done_with_both_is_refused(deck, tmp_path, capsys, more, words):
    heaving, torsion, bridge = deck
    more = [str(bridge) if one == "BRIDGE" else one for one in more]
    arguments = ["size", str(heaving), "--other", str(torsion), *more, "-o", str(tmp_path / "out")]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert all(word in error for word in words)
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
@pytest.mark.usefixtures("no_figures")
def test_given_dampers_and_what_was_identified_are_judged_with_both(deck, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    heaving, torsion, bridge = deck
    listed = tmp_path / "offers.csv"
    listed.write_text("mass,frequency,damping\n30000,0.3,0.1\n10000,0.8,0.1\n", encoding="utf-8")
    found = ["--identified", "V1: 0.296 Hz, 0.0042", "--identified", "T1: 0.81 Hz"]
    out = tmp_path / "out"
    arguments = ["size", heaving, "--other", torsion, "--bridge", bridge, "-o", out, *found]
    arguments += ["--damper", listed, "--damper", "30 t, 0.3 Hz, 0.1; 10 t, 0.8 Hz, 0.1"]
    assert main([str(one) for one in arguments]) in (0, 1)
    contents = [json.loads((out / part / "sizing.json").read_text()) for part in ("", "torsional")]
    assert [content["modes"][0]["frequency"]["mean"] for content in contents] == [0.296, 0.81]
    first, second, together = contents[0]["both"]["existing"]
    assert first["dampers"][0]["frequency"] == 0.3
    # one on the axis does nothing for torsion, the other little for heaving: together they keep both
    assert together["left"]["each"][1] == pytest.approx(second["left"]["each"][1], abs=0.02)
    assert together["left"]["any"] <= min(first["left"]["any"], second["left"]["any"])
    assert all("as_designed" in one for one in (first, second, together))
    for k, content in enumerate(contents):
        assert content["existing"][2]["left"]["each"] == pytest.approx([together["left"]["each"][k]], abs=0.02)
        assert content["provenance"]["settings"]["identified"] == found[1::2]
    text = capsys.readouterr().out
    assert text.count("with a given damper") == 1
    assert max(len(line) for line in text.splitlines() if not line.startswith(str(tmp_path))) <= 80


def test_two_fits_of_one_motion_are_no_pair(deck, tmp_path, capsys):
    heaving, _, bridge = deck
    out = str(tmp_path / "out")
    assert main(["size", str(heaving), "--other", str(heaving), "--bridge", str(bridge), "-o", out]) == 2
    assert "another fit of a heaving section" in capsys.readouterr().err
