"""`scruton size` on the results of a small fit."""

import json

import pytest

from scruton import InputError, load_sizing
from scruton.app.options import parse_damping
from scruton.campaign.schema import Motion
from scruton.cli import main
from scruton.documents import write_document
from scruton.infer.store import read_tree
from scruton.report.parts import Asked, sizing_part
from scruton.sizing.bridge import load_bridge, with_damping
from scruton.sizing.existing import as_built, offers
from scruton.sizing.limits import limit
from scruton.sizing.size import size

BRIDGE = """format = 1
title = "A <bridge> & 桥"
width = "12 m"
depth = "3 m"
limits = ["jtg", "kd"]
coherence = { mean = 0.95, sd = 0.03 }

[[modes]]
name = "V1"
frequency = "0.3 Hz"
mass = "20000 kg/m"
length = "400 m"

[[modes]]
name = "V2"
frequency = "0.45 Hz"
mass = "20000 kg/m"
length = "400 m"
half_waves = 2
lock_in = [8, 11]

[damper]
largest_stroke = "0.5 m"

[wind]
weibull_scale = "7 m/s"
weibull_shape = 2

[cost]
per_percent = 1e6
per_kg = 20
failure = 1e7
"""
ONE_MODE = BRIDGE[: BRIDGE.rindex("[[modes]]")]


@pytest.fixture(scope="module")
def bridge(tmp_path_factory):
    path = tmp_path_factory.mktemp("bridge") / "bridge.toml"
    path.write_text(BRIDGE, encoding="utf-8")
    return path


def run(*arguments, capsys):
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_size_writes_what_an_engineer_asks_for(quick_results, bridge, tmp_path, capsys):
    out = tmp_path / "sizing"
    offered = ("--damper", "12 t, 0.29 Hz, 0.08", "--damper", "9 t, 0.29 Hz, 0.08; 9 t, 0.44 Hz, 0.08, 0.25")
    arguments = ("--bridge", bridge, "--limit", "0.05", *offered, "--identified", "V1: 0.29 Hz, 0.004")
    code, text, _ = run("size", quick_results, *arguments, "-o", out, capsys=capsys)
    assert code in (0, 1)  # the small fit need not have converged
    assert "Added damping ratio by confidence" in text
    found = json.loads((out / "sizing.json").read_text(encoding="utf-8"))
    assert load_sizing(out).to_json() == {key: value for key, value in found.items() if key != "checksum"}
    earlier = {key: value for key, value in found.items() if key not in ("checksum", "unconverged")}
    every = {key: value for key, value in found["all_modes"].items() if key != "required_for_any"}
    every["hours"] = {key: value for key, value in every["hours"].items() if key != "exceeding_with"}
    write_document(tmp_path / "earlier" / "sizing.json", earlier | {"all_modes": every})
    assert load_sizing(tmp_path / "earlier").unconverged is None, "a sizing of an earlier version says less"
    assert found["bridge"]["title"] == "A <bridge> & 桥"
    assert [mode["name"] for mode in found["modes"]] == ["V1", "V2"]
    for mode in found["modes"]:
        assert [one["rule"] for one in mode["limits"]] == ["jtg", "kd", "0.05"]
        smallest = min(mode["limits"], key=lambda one: one["limit"])
        assert mode["governing"] == smallest["rule"]
        for one in mode["limits"]:
            needs = [one["required"][p] for p in ("0.50", "0.84", "0.95", "0.99")]
            known = [need for need in needs if need is not None]
            assert known == sorted(known)
            assert one["source"]
            probability = one["curve"]["probability"]
            assert probability == sorted(probability, reverse=True)
            assert probability[0] == pytest.approx(one["probability"], abs=1e-9)
        damper = mode["damper"]
        if damper["achievable"] and damper["dampers"]:
            assert damper["probability"] <= 0.05
            assert damper["stroke"]["high"] <= 0.505
            assert damper["mass_ratio"] > 0.00499
            assert max(entry["probability"] for entry in damper["detuned"][1:3]) <= 0.05
            assert damper["mass"] == pytest.approx(damper["mass_ratio"] * mode["modal_mass"], rel=1e-3)
        shares = mode["shares"]["needed"]
        assert sum(one["total"] for one in shares) > 0.95
        assert {one["kind"] for one in mode["cost"]["information"]["worth"]} == {"perfect", "sample"}
    assert [one["name"] for one in found["existing"]] == list(offered[1::2])
    for one in found["existing"]:
        assert one["left"]["any"] >= max(one["left"]["each"])
        assert {"each", "any", "each_mcse", "any_mcse"} == set(one["as_designed"])
    assert [one["position"] for one in found["existing"][1]["dampers"]] == pytest.approx([0.5, 0.25])
    assert found["modes"][0]["frequency"]["mean"] == 0.29
    assert "any, as designed" in text
    every = found["all_modes"]
    assert max(every["without"]["each"]) <= every["without"]["any"] <= sum(every["without"]["each"]) + 1e-9
    assert every["hours"]["assumed"] == [True, False]
    assert all(0.0 < hours < 8766.0 for hours in every["hours"]["a_year"])
    keys = {"card", "command", "seed", "settings", "sha256", "versions"}
    assert set(found["provenance"]) == keys | {"fit_sha256", "bridge_sha256", "limits", "law", "effect"}
    for name in ("risk_1", "shares_2", "cost_1", "information_1", "required_damping"):
        assert (out / f"{name}.png").stat().st_size > 5_000
        assert (out / f"{name}.svg").is_file()


@pytest.mark.thorough
@pytest.mark.usefixtures("no_figures")
def test_a_sizing_is_not_overwritten_and_repeats_itself(quick_results, tmp_path, capsys):
    # a limit that takes no damper: those come again in what is rebuilt, below
    arguments = ("size", quick_results, "--limit", "0.1", "-o", tmp_path / "s")
    run(*arguments, capsys=capsys)
    first = (tmp_path / "s" / "sizing.json").read_bytes()
    code, _, error = run(*arguments, capsys=capsys)
    assert code == 2
    assert "--force" in error
    run(*arguments, "--force", "--quiet", capsys=capsys)
    assert (tmp_path / "s" / "sizing.json").read_bytes() == first


@pytest.mark.usefixtures("no_figures")
def test_what_cannot_be_reached_is_said(quick_results, tmp_path, capsys):
    _, text, _ = run("size", quick_results, "--limit", "0.0001", "-o", tmp_path / "s", "--law", "-1", capsys=capsys)
    found = json.loads((tmp_path / "s" / "sizing.json").read_text())
    one = found["modes"][0]["limits"][0]
    assert one["required"]["0.95"] is None
    assert one["required_text"]["0.95"] == "not achievable with added damping up to 5 %"
    damper = found["modes"][0]["damper"]
    assert not damper["achievable"]
    assert "not achievable" in damper["reason"]
    assert "inf" not in text.lower().replace("information", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "at least one"),
        (("--limit", "-0.1 m"), "greater than zero"),
        (("--limit", "nonsense"), "a rule"),
        (("--limit", "0.05", "--bridge", "nowhere.toml"), "no such file"),
        (("--limit", "0.05", "--damping", "2"), "between 0 and 1"),
        (("--limit", "0.05", "--effect", "coulomb_friction"), "fit CAMPAIGN --effect coulomb_friction"),
        (("--limit", "0.05", "--rig", "nobody"), "nobody"),
        (("--limit", "0.4 deg"), "a rule for it"),
        (("--limit", "0.05", "--seed", "-1"), "zero or more"),
        (("--limit", "0.05", "--damper", "12 t, 0.29 Hz"), "mass, frequency, damping"),
        (("--limit", "0.05", "--damper", "12 t, 0.29 Hz, 0.08"), "modal mass"),
        (("--limit", "0.05", "--identified", "V1: 0.3 Hz"), "--bridge"),
    ],
)
def test_bad_input_exits_with_two_and_writes_nothing(quick_results, tmp_path, capsys, arguments, words):
    code, _, error = run("size", quick_results, "-o", tmp_path / "s", *arguments, capsys=capsys)
    assert code == 2
    assert words in error
    assert not (tmp_path / "s").exists()


def test_a_folder_that_holds_no_fit_is_refused(tmp_path, capsys):
    code, _, error = run("size", tmp_path, "--limit", "0.05", capsys=capsys)
    assert code == 2
    assert "posterior.nc" in error


def test_a_sizing_that_is_not_one_is_refused(tmp_path):
    with pytest.raises(InputError, match="found nothing; wanted a folder that `scruton size` wrote"):
        load_sizing(tmp_path)
    write_document(tmp_path / "sizing.json", {"format": 1, "modes": []})
    with pytest.raises(InputError, match="a sizing that this version wrote"):
        load_sizing(tmp_path)


@pytest.mark.thorough
@pytest.mark.usefixtures("no_figures")
def test_the_decision_can_be_rebuilt_and_is_the_same_whichever_verb_wrote_it(quick_results, tmp_path, capsys):
    path = tmp_path / "one" / "bridge.toml"
    path.parent.mkdir()
    path.write_text(ONE_MODE, encoding="utf-8")
    out = tmp_path / "sizing"
    run("size", quick_results, "--bridge", path, "--limit", "0.05", "-o", out, capsys=capsys)
    found = json.loads((out / "sizing.json").read_text(encoding="utf-8"))

    by_report = json.loads(json.dumps(sizing_part(quick_results, Asked(path, ["0.05"])).content))
    different = {key for key in by_report if key != "provenance" and by_report[key] != found[key]}
    assert not different
    for key in ("seed", "sha256", "settings", "versions", "fit_sha256", "bridge_sha256", "law", "effect"):
        assert by_report["provenance"][key] == found["provenance"][key], key

    assert found["inputs"]["limits"] == ["jtg", "kd", "0.05"]
    assert rebuilt(quick_results, found, tmp_path / "again")["modes"] == found["modes"]


def test_a_law_without_a_curve_of_its_own_starts_where_it_has_its_answer_whoever_asks(small_results, tmp_path):
    """The sizing under a law alone and its row in that of all laws are one number; that no law holds is said."""
    tree = read_tree(small_results)[0].copy()
    tree["laws"].attrs["doubted"] = "the drift leaves even n=-1"
    path = tmp_path / "bridge.toml"
    path.write_text(ONE_MODE.replace('limits = ["jtg", "kd"]', 'limits = ["jtg"]'), encoding="utf-8")
    of = load_bridge(path, Motion.HEAVING)
    (every,), (alone,) = (size([(tree, of)], law_n=n) for n in (None, 2.0))
    assert any("no law of the card holds" in flag for flag in every.flags)
    assert any("its curve is a what-if" in flag for flag in alone.flags)
    for one, other in zip(every.modes, alone.modes, strict=True):
        for weighed, by_law in zip(one.limits, other.limits, strict=True):
            assert weighed.required_by_law["n=2"]["0.95"] == by_law.required["0.95"]


def rebuilt(results, found, folder):
    """What follows again from a sizing.json and the fit, by nothing else."""
    kept, settings = found["inputs"], found["provenance"]["settings"]
    folder.mkdir()
    for name, text in kept["documents"].items():
        (folder / name).write_text(text, encoding="utf-8")
    tree, _ = read_tree(results)
    bridge = load_bridge(folder, Motion(found["bridge"]["motion"]))
    if settings["damping"] is not None:
        bridge = with_damping(bridge, parse_damping(settings["damping"]), f"--damping {settings['damping']}")
    bridge = as_built(bridge, settings["identified"])
    (again,) = size(
        [(tree, bridge)],
        [limit(rule) for rule in kept["limits"]],
        rig=settings["rig"],
        law_n=settings["law"],
        seed=found["provenance"]["seed"],
        offers=[offer for stated in settings["dampers"] for offer in offers(stated)],
    )
    return json.loads(json.dumps(again.to_json()))


@pytest.mark.thorough
@pytest.mark.usefixtures("no_figures")
def test_the_decision_can_be_rebuilt_with_what_the_command_line_said(quick_results, tmp_path, capsys):
    path = tmp_path / "bridge.toml"
    path.write_text(ONE_MODE, encoding="utf-8")
    said = ("--damping", "0.004 +/- 0.001", "--identified", "V1: 0.29 Hz", "--damper", "12 t, 0.29 Hz, 0.08")
    under = ("--rig", "6#", "--law", "-1", "--seed", "3")
    run("size", quick_results, "--bridge", path, *said, *under, "-o", tmp_path / "s", capsys=capsys)
    found = json.loads((tmp_path / "s" / "sizing.json").read_text(encoding="utf-8"))
    again = rebuilt(quick_results, found, tmp_path / "again")
    for key in ("bridge", "laws", "modes", "all_modes", "existing", "inputs"):
        assert again[key] == found[key], key
    mode = found["modes"][0]
    assert (mode["frequency"]["mean"], mode["damping_ratio"]["mean"]) == (0.29, 0.004)
