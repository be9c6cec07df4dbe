"""`challenge tune`: temperatures that made-up evidences were drawn with come back; what is written says from what."""

import json
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from scruton.calibrate.challenge.tune import Judged, fit, tune_challenges, tuning_text
from scruton.cli import main
from scruton.errors import InputError
from scruton.gap import thresholds
from scruton.gap.probability import Temperatures, probabilities, tempered

FRICTION, MEMORY, AERO, WAKE = "coulomb_friction", "fluid_memory", "aerodynamic_damping_nonlinearity", "wake_oscillator"
NAMES = (FRICTION, MEMORY, AERO, "wind_speed_drift", "sensor_clipping", "unknown")
PRIOR = np.full(len(NAMES), 0.5 / len(NAMES))


def drawn(by, cases, seed):
    """Log weights as they come, and truths that are as probable as the temperatures say."""
    rng = np.random.default_rng(seed)
    gains = rng.normal(-2.0, 3.0, (cases, len(NAMES)))
    leads = rng.random(cases) < 0.8
    gains[leads] += rng.uniform(0.0, 20.0, leads.sum())[:, None] - rng.exponential(8.0, (leads.sum(), len(NAMES)))
    gains[rng.random(gains.shape) < 0.05] = -np.inf
    p = tempered(gains, np.tile(PRIOR, (cases, 1)), by)
    truth = (p.cumsum(axis=1) > rng.random(cases)[:, None]).argmax(axis=1)
    return gains, truth


def judged(by, cases, seed):
    gains, truth = drawn(by, cases, seed)
    accepted = np.arange(1 + len(NAMES)) == truth[:, None]
    return Judged(f"made-{seed}", gains, np.tile(PRIOR, (cases, 1)), accepted, {})


def write(folder, by, cases, seed, answers=None):
    """A challenge on disk whose log weights and truths are drawn."""
    gains, truth = drawn(by, cases, seed)
    sealed = {}
    for i in range(cases):
        name, effect = f"case-{i + 1:04d}", ("none", *NAMES)[truth[i]]
        kind = {"none": "none", "unknown": "open"}.get(effect, "catalogue")
        effects = {"none": [], "unknown": ["time_jump"]}.get(effect, [effect])
        sealed[name] = {"kind": kind, "effects": effects, "severity": 0.2, "parameters": {}, "rigs": []}
        (folder / name).mkdir(parents=True)
        (folder / name / "campaign.toml").write_text("format = 1\n")
        (folder / "results" / name).mkdir(parents=True)
        weights = dict(zip(NAMES, gains[i].tolist(), strict=True)) | {"none": 0.0}
        p = probabilities(weights, {}, 0.5)
        gap = {"verdict": max(p, key=p.get), "probability": p}
        gap["log_weights"] = {key: value if np.isfinite(value) else None for key, value in weights.items()}
        (folder / "results" / name / "gap.json").write_text(json.dumps(gap))
    text = json.dumps(sealed | (answers or {}))
    (folder / "answers").mkdir()
    (folder / "answers" / "answers.json").write_text(text)
    table = {"answers_sha256": sha256(text.encode()).hexdigest(), "settings": {"seed": seed, "design": "full"}}
    (folder / "challenge.json").write_text(json.dumps(table))
    return folder


def outcome(folder, answer, weights):
    """One case."""
    write(folder, Temperatures(), 1, 1, {"case-0001": {"severity": 0.2, "parameters": {}, "rigs": []} | answer})
    gap = json.loads((path := folder / "results" / "case-0001" / "gap.json").read_text())
    path.write_text(json.dumps(gap | {"log_weights": weights}))
    return folder


@pytest.mark.parametrize("truth", [Temperatures(1.6, 6.0, 0.03), Temperatures(4.0, 2.0, 0.03)])
def test_the_temperatures_that_made_the_truths_are_recovered(truth):
    # 16 000 cases leave some 4 % of a temperature open
    found = fit([judged(truth, 4000, 1), judged(truth, 12000, 2)], 0.03)
    assert found.against_none == pytest.approx(truth.against_none, rel=0.12)
    assert found.between == pytest.approx(truth.between, rel=0.12)


def test_every_challenge_counts_alike():
    few, many = judged(Temperatures(2.0, 2.0, 0.02), 1500, 1), judged(Temperatures(2.0, 12.0, 0.02), 6000, 2)
    alone, together = [fit([one], 0.02).between for one in (few, many)], fit([few, many], 0.02).between
    assert alone[0] < together < alone[1]
    again = Judged("", *(np.tile(part, (4, 1)) for part in (few.gains, few.prior, few.accepted)), {})
    assert fit([again, many], 0.02).between == pytest.approx(together, rel=0.01)


def test_the_right_temperatures_are_calibrated_and_others_are_not():
    right, sharp = Temperatures(1.6, 6.0, 0.03), Temperatures(1.0, 1.0, 0.03)
    made = judged(right, 4000, 3)
    good, bad = made.scores(right), made.scores(sharp)
    assert good["calibration_error"] < 2.0 * good["chance"]
    assert good["chance"] < 0.02
    assert bad["calibration_error"] > 0.1
    assert good["log_score"] > bad["log_score"]


def test_a_floor_is_dealt_out_among_what_is_possible():
    weights = {"none": 0.0, FRICTION: 60.0, MEMORY: -3.0, AERO: -np.inf, "unknown": 4.0}
    p = probabilities(weights, {"unknown": 0.0}, 0.5, Temperatures(2.5, 4.0, 0.06))
    assert sum(p.values()) == pytest.approx(1.0)
    assert (p[AERO], p["unknown"]) == (0.0, 0.0)
    assert p[FRICTION] == pytest.approx(0.94 + 0.02, abs=1e-6)
    assert p["none"] == pytest.approx(0.02, abs=1e-6)
    bare = probabilities(weights, {}, 0.5, Temperatures(2.5, 4.0, 0.0))
    odds = np.log(bare[FRICTION] / bare["none"] / 0.25), np.log(bare[FRICTION] / bare["unknown"])
    assert odds == pytest.approx((60.0 / 2.5, 56.0 / 4.0))
    assert np.log(bare[MEMORY] / bare["none"] / 0.25) == pytest.approx(-3.0)  # evidence against stands as it is


def test_folders_are_tuned_scored_and_left_out_in_turn(tmp_path):
    truth = Temperatures(1.8, 5.0, 0.03)
    folders = [write(tmp_path / f"c{seed}", truth, cases, seed) for seed, cases in ((1, 400), (2, 300), (3, 200))]
    content = tune_challenges(folders)
    assert content["against_none"] == pytest.approx(1.8, rel=0.3)
    assert content["between"] == pytest.approx(5.0, rel=0.3)
    assert content["floor"] >= content["least_floor"] == 0.02
    assert [(row["name"], row["cases"], row["settings"]["seed"]) for row in content["folders"]] == [
        ("c1", 400, 1), ("c2", 300, 2), ("c3", 200, 3)
    ]  # fmt: skip
    for row in content["folders"]:
        assert row["after"]["log_score"] > row["before"]["log_score"] - 0.01
        assert row["left_out"]["log_score"] <= row["after"]["log_score"] + 0.01
        assert row["left_out"]["between"] != content["between"]
        assert sum(row["kinds"].values()) == row["cases"]
    text = tuning_text(content)
    assert f"between {content['between']:g}" in text
    assert all(f"c{k}" in text for k in (1, 2, 3))
    alone = tune_challenges(folders[:1])
    assert alone["folders"][0]["left_out"] is None
    assert "  -  " in tuning_text(alone)


@pytest.mark.parametrize(
    ("kind", "effects", "right"),
    [
        ("none", [], {"none"}),
        ("open", ["time_jump"], {"unknown"}),
        ("open", [WAKE], {"unknown", MEMORY, AERO}),
        ("open", ["what no scruton has"], {"unknown"}),
        ("two", [FRICTION, MEMORY], {FRICTION, MEMORY}),
    ],
)
def test_what_counts_as_the_truth(tmp_path, kind, effects, right):
    weights = {"none": 0.0, **dict.fromkeys(NAMES, 3.0)}
    folder = outcome(tmp_path / "c", {"kind": kind, "effects": effects}, weights)
    content = tune_challenges([folder])
    p = probabilities(weights, {}, 0.5)
    # six names that are alike have one half at no gain
    assert content["folders"][0]["before"]["log_score"] == pytest.approx(
        np.log(sum(p[name] for name in right)), abs=1e-4
    )


def test_the_same_folders_give_the_same_bytes_and_nothing_is_overwritten(tmp_path, capsys):
    folder, one, two = write(tmp_path / "c", Temperatures(), 20, 5), tmp_path / "one.json", tmp_path / "two.json"
    assert main(["challenge", "tune", str(folder), "-o", str(one)]) == 0
    assert "against none" in capsys.readouterr().out
    assert main(["challenge", "tune", str(folder), "-o", str(two)]) == 0
    assert one.read_bytes() == two.read_bytes()
    assert main(["challenge", "tune", str(folder), "-o", str(two)]) == 2
    assert "--force" in capsys.readouterr().err
    assert main(["challenge", "tune", str(folder), "-o", str(two), "--force", "--quiet"]) == 0
    assert {"against_none", "between", "floor"} <= set(json.loads(two.read_text()))


def test_folders_that_cannot_be_tuned_on_are_refused(tmp_path, capsys):
    folder = write(tmp_path / "c", Temperatures(), 3, 5)
    with pytest.raises(InputError, match="no result of any case"):
        tune_challenges([folder], "elsewhere")
    assert main(["challenge", "tune", str(folder), "--results", "elsewhere"]) == 2
    assert "no result of any case" in capsys.readouterr().err
    for path in (folder / "results").glob("*/gap.json"):
        gap = json.loads(path.read_text())
        path.write_text(json.dumps({key: value for key, value in gap.items() if key != "log_weights"}))
    with pytest.raises(InputError, match=r"log_weights: found none in any gap\.json"):
        tune_challenges([folder])
    (folder / "answers" / "answers.json").write_text("{}")
    with pytest.raises(InputError, match="not those that were sealed"):
        tune_challenges([folder])


def test_the_diagnosis_believes_what_the_shipped_file_says():
    shipped = json.loads((Path(thresholds.__file__).parent / "temperatures.json").read_text())
    assert Temperatures() == Temperatures(*(shipped[name] for name in ("against_none", "between", "floor")))
    assert all(row["cases"] == sum(row["kinds"].values()) and "seed" in row["settings"] for row in shipped["folders"])
    assert sum(row["cases"] for row in shipped["folders"]) == thresholds.TUNED_ON
    assert tuple(shipped["least"]) == thresholds.LEAST
    certain = probabilities({"none": 0.0, FRICTION: 1e4, MEMORY: -1.0}, {}, 0.5)
    assert certain[FRICTION] == pytest.approx(1.0 - shipped["floor"] * 2.0 / 3.0)
