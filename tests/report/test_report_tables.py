"""Tables of a report against the fit that they come from, and as files."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fake_fit import ENSEMBLES, fake_fit, led_by

from scruton.app.batch import Batch
from scruton.app.batch_tables import batch_csv
from scruton.campaign.schema import Motion
from scruton.cells import csv_text, safe_cell
from scruton.griffin import predict
from scruton.griffin.validate import Validation
from scruton.infer.cards import load_card
from scruton.infer.joint import joint_draws
from scruton.infer.results import Fit
from scruton.report.document import ALARM, Callout, Listing, Picture, Table, paragraph
from scruton.report.exports import _as_shown
from scruton.report.render_text import render_text
from scruton.report.summaries import fit_summary, prediction_summary, validation_summary
from scruton.report.tables import tables, unit_of, write_csv
from scruton.report.wording import PAGE, TERMINAL, rounded
from scruton.stats.convergence import monte_carlo_error


@pytest.fixture(scope="module")
def fit():
    return fake_fit(growth=False, sweeps=False, names=["低阻尼 1", "b,c", 'say "d"'])


@pytest.fixture(scope="module")
def frames(fit) -> dict[str, pd.DataFrame]:
    return tables(fit, [predict(fit.tree, scruton_number=sc) for sc in (5.0, 30.0)])


def test_every_table_is_there(frames: dict[str, pd.DataFrame]) -> None:
    assert list(frames) == ["rigs", "tests", "records", "posterior", "laws", "convergence", "predictions", "ring_downs"]


def test_the_posterior_table_holds_the_quantiles_of_the_draws(fit, frames: dict[str, pd.DataFrame]) -> None:
    table = frames["posterior"].set_index(["posterior", "of", "parameter"])
    draws = joint_draws(fit.tree).tests["b,c"]["a_star"]
    row = table.loc[("test", "b,c", "a_star")]
    assert row["unit"] == "A/D"
    for name, q in (("q02.5", 0.025), ("q05", 0.05), ("q25", 0.25), ("median", 0.5), ("q75", 0.75), ("q97.5", 0.975)):
        assert row[name] == pytest.approx(np.quantile(draws, q)), name
    assert row["sd"] == pytest.approx(draws.std())
    alone = fit.tree["posterior"]["a_star"].sel(test="b,c").values
    assert table.loc[("test alone", "b,c", "a_star"), "median"] == pytest.approx(np.median(alone))
    shared = joint_draws(fit.tree).shared["discrepancy_amplitude"]
    assert table.loc[("campaign", "shared curve", "discrepancy_amplitude"), "q95"] == np.quantile(shared, 0.95)
    assert table.loc[("trial function", "test1_decay.csv", "b"), "unit"] == "1/s"
    assert table.loc[("rig", "1#", "damping_ratio"), "unit"] == "-"


def test_rows_match_the_campaign(fit, frames: dict[str, pd.DataFrame]) -> None:
    assert frames["rigs"]["mass [kg/m]"].tolist() == [7.089, 7.292, 7.292]
    assert frames["tests"]["test"].tolist() == [test.name for test in fit.campaign.tests]
    np.testing.assert_allclose(frames["tests"]["U/(f0 D) [-]"], 2 * np.pi / np.array([0.6549, 0.7364, 0.7733]))
    assert len(frames["records"]) == 3 + 6
    assert (frames["records"]["smallest amplitude [A/D]"] < frames["records"]["largest amplitude [A/D]"]).all()
    assert len(frames["convergence"]) == len(fit.convergence)


def test_predictions_are_those_of_the_json(fit, frames: dict[str, pd.DataFrame]) -> None:
    row = frames["predictions"].iloc[1]
    amplitude = predict(fit.tree, scruton_number=30.0).to_json()["amplitude"]
    assert row["Sc [-]"] == 30.0
    assert [row["q05"], row["q95"]] == amplitude["interval"]["0.90"]
    assert [row["q05 MC error"], row["q95 MC error"]] == amplitude["mcse"]["interval"]["0.90"]
    assert row["unit"] == "A/D"


def three_errors(draws, factor: float = 1.0) -> str:
    """Those of the median and of the ends of the 90 % interval, of draws (chains, draws)."""
    rows = np.asarray(draws).reshape(ENSEMBLES, -1)
    return " ".join(TERMINAL.number(factor * monte_carlo_error(rows, p), 2) for p in (0.5, 0.05, 0.95))


def test_the_terminal_shows_monte_carlo_errors_beside_every_median_and_interval(fit) -> None:
    """Gusts and the set points of records among them."""
    text = render_text(fit_summary(fit), 80)
    assert max(map(len, text.splitlines())) <= 80
    joint = joint_draws(fit.tree)
    for key, title in {
        "a_star": "stable amplitude [A/D]",
        "gust_scatter": "slow gusts, scatter",
        "gust_time": "slow gusts, correlation time",
        "set_point_scatter": "scatter of the stable amplitude from record to record",
    }.items():
        row = text[text.index(title) :].splitlines()[3]
        assert all(cell in row for cell in TERMINAL.spread(fit.summary["tests"][0]["parameters"][key])), row
        assert row.endswith(three_errors(joint.tests[fit.summary["tests"][0]["name"]][key]))
    row = text[text.index("Structural damping ratio") :].splitlines()[3]
    assert row.endswith(three_errors(fit.tree["rig_posterior"]["damping_ratio"].sel(rig="1#"), 100.0))
    row = next(line for line in text.splitlines() if line.startswith("n=0 "))
    assert row.split()[3] == TERMINAL.number(fit.summary["laws"]["weights"]["n=0"]["log_evidence_error"], 2)
    row = next(line for line in text.splitlines() if line.startswith("ln amplitude"))
    assert row.rstrip().endswith(three_errors(joint.shared["discrepancy_amplitude"]))


@pytest.fixture(scope="module")
def against() -> Fit:
    """A fit whose reference law has no weight: n = 0 has all."""
    fit = led_by(fake_fit(growth=False, sweeps=False, ringdowns=False), gompertz=1.0)
    fit.summary["campaign"]["left_at_prior"] = ["discrepancy_amplitude"]
    return fit


def test_the_terminal_says_which_model_is_printed_and_that_the_law_of_y1_does_not_hold(fit, against) -> None:
    text = render_text(fit_summary(against))
    assert "the joint posterior that predicts, n=0 100%" in text
    assert "Y1 (of the law n=-1, WHICH DOES NOT HOLD HERE)" in text
    row = next(line for line in text.splitlines() if line.startswith("ln amplitude"))
    assert row.endswith("equals its prior")
    tests = against.tree["campaign_posterior"]["a_star"].sel(law="n=0", peak_test="Sc 21.7").to_numpy()
    assert TERMINAL.number(float(np.median(tests))) in text
    clean = render_text(fit_summary(fit))
    assert "NOT HOLD" not in clean
    assert "equals its prior" not in clean


def test_a_free_exponent_is_printed_with_its_band() -> None:
    fit = fake_fit(tests=1, growth=False, sweeps=False, ringdowns=False, law_n=0.5)
    free = replace(fit, card=load_card("free-exponent"))
    found = fit.summary["campaign"]["parameters"]["n"]
    assert ["n", TERMINAL.number(found["median"])] in [
        line.split()[:2] for line in render_text(fit_summary(free)).splitlines()
    ]


def test_predictions_print_their_monte_carlo_errors(fit) -> None:
    one = predict(fit.tree, scruton_number=30.0)
    text = render_text(prediction_summary([one], fit.summary))
    low, high = one.interval(0.90)
    assert " .. ".join(rounded([low, high])) in text
    assert " ".join(TERMINAL.number(one.error(p), 2) for p in (0.5, 0.05, 0.95)) in text
    assert "One rig says nothing" not in text
    alone = fake_fit(tests=1, growth=False, sweeps=False, ringdowns=False)
    single = predict(alone.tree, scruton_number=30.0)
    text = render_text(prediction_summary([single], alone.summary))
    assert "with a discrepancy of 10 % and of 20 %" in text
    for tau, draws in single.at_discrepancy.items():
        median, *ends = map(float, three_errors(draws).split())
        wanted = [TERMINAL.number(one, 2) for one in (median, max(ends))]
        assert f"at {100 * tau:.0f} % at most {wanted[0]} of medians, {wanted[1]} of the ends of intervals" in text


def test_a_validation_prints_errors_of_its_ends_and_how_far_the_test_lies(fit) -> None:
    one = predict(fit.tree, scruton_number=30.0)
    case = Validation("t", ("a", "b"), one, 0.02, measured=True, trusted=True)
    text = render_text(validation_summary("title", "A/D", [case], {"0.90": 1.0}))
    row = next(line for line in text.splitlines() if line.startswith("t "))
    assert row.split()[-5:-1] == [TERMINAL.number(one.extrapolation_index, 2), str(one.covered_by), "of", "3"]
    largest = TERMINAL.number(max(one.error(0.05), one.error(0.95)), 2)
    assert f"{largest} of the ends of intervals" in text


def test_the_weight_of_the_measured_damping_is_printed_with_that_of_the_laws(fit) -> None:
    one = predict(fit.tree, scruton_number=30.0)
    told = replace(one, measured_weight=0.24, flags=())
    text = " ".join(render_text(prediction_summary([told], fit.summary)).split())
    assert "; beside them the measured damping has a weight of 24% at Sc = 30. The interval" in text
    text = render_text(prediction_summary([replace(told, measured_weight=0.004)], fit.summary))
    assert "measured damping" not in text


def test_torsional_predictions_are_printed_in_degrees() -> None:
    twisting = fake_fit(motion=Motion.TORSIONAL, growth=False, sweeps=False, ringdowns=False)
    one = predict(twisting.tree, scruton_number=0.8)
    text = render_text(prediction_summary([one], twisting.summary))
    low, high = np.rad2deg(one.interval(0.90))
    assert "amplitude [deg]" in text
    assert " .. ".join(rounded([low, high])) in text
    assert " ".join(TERMINAL.number(float(np.rad2deg(one.error(p))), 2) for p in (0.5, 0.05, 0.95)) in text
    assert "[rad]" not in text + render_text(fit_summary(twisting))
    assert one.to_json()["amplitude"]["unit"] == "rad"


def test_laws_by_weight(fit, frames: dict[str, pd.DataFrame]) -> None:
    table = frames["laws"].set_index("law")
    assert table.index.tolist() == [f"n={n:g}" for n in fit.card.laws]
    assert table["prior probability"].tolist() == [0.7, 0.1, 0.1, 0.1]
    assert table["posterior probability"].sum() == pytest.approx(1.0)
    odds = table["posterior probability"]["n=-1"] / table["posterior probability"]["n=0"]
    assert np.log(odds / 7) == pytest.approx(table["log evidence"]["n=-1"] - table["log evidence"]["n=0"])
    assert table["sampled"].tolist() == [True, True, False, False]
    assert table["log evidence error"].isna().tolist() == [False, False, True, True]
    assert frames["predictions"]["laws"].tolist() == ["n=-1 0.969, n=0 0.0309"] * 2


def test_ring_downs_by_amplitude(fit, frames: dict[str, pd.DataFrame]) -> None:
    assert set(frames["ring_downs"]["rig"]) == {"1#", "6#", "9#"}
    np.testing.assert_allclose(
        frames["ring_downs"].groupby("rig")["damping ratio [-]"].mean(), [0.00058, 0.0065, 0.0234], rtol=0.01
    )


def test_csv_round_trip_with_names_that_need_quoting(frames: dict[str, pd.DataFrame], tmp_path: Path) -> None:
    paths = write_csv(frames, tmp_path / "tables")
    assert [path.stem for path in paths] == list(frames)
    assert sorted(path.name for path in (tmp_path / "tables").iterdir()) == sorted(path.name for path in paths)
    read = pd.read_csv(tmp_path / "tables" / "tests.csv")
    assert read["test"].tolist() == ["低阻尼 1", "b,c", 'say "d"']
    pd.testing.assert_frame_equal(read, frames["tests"])


def test_an_empty_table_is_left_out() -> None:
    fit = fake_fit(tests=1, growth=False, ringdowns=False, measured=False)
    frames = tables(fit)
    assert "ring_downs" not in frames
    assert "predictions" not in frames
    assert np.isnan(tables(fake_fit(tests=1, growth=False, laws=False))["laws"]["log evidence"]).all()
    assert np.isnan(frames["tests"]["stable amplitude measured [A/D]"]).all()


def test_units_follow_the_motion() -> None:
    frames = tables(fake_fit(motion=Motion.TORSIONAL, tests=1, growth=False, ringdowns=False))
    assert "mass [kg m^2/m]" in frames["rigs"]
    assert unit_of("a_star", "rad") == "rad"
    assert "stable amplitude median [rad]" in frames["tests"]


FORMULAS = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "\tx", "\r=1"]
HARMLESS = ["-0.31", "+2", "-1e-3", "-", "a=b", "低阻尼", "", "-inf"]


@pytest.mark.parametrize("text", FORMULAS)
def test_a_formula_is_quoted(text: str) -> None:
    assert safe_cell(text) == "'" + text


@pytest.mark.parametrize("value", [*HARMLESS, -0.31, -3, None, True])
def test_numbers_and_plain_text_stay(value: object) -> None:
    assert safe_cell(value) is value


def test_no_csv_file_holds_a_formula(tmp_path: Path) -> None:
    """What names of tests and titles may put into every kind of CSV file that is written."""
    frame = pd.DataFrame({"=name": FORMULAS, "z": [-1.5, 2.0, np.nan, -0.0, 1e-300, -7.123456789012345]})
    (path,) = write_csv({"t": frame}, tmp_path)
    shown = _as_shown(Table("t", "c", ("=name", "z"), tuple((one, "-1.5") for one in FORMULAS)))
    entry = {
        "name": "=n", "title": "@t", "state": "done", "reason": "-r", "rigs": 1, "tests": 1, "flags": [], "unit": "A/D",
        "report": None, "predictions": [], "peaks": [{"test": "+t", "rig": "=r"}],
    }  # fmt: skip
    batch = Batch(tmp_path, (entry,), (), {})
    plain = csv_text([{"name": one, "z": -1.5} for one in FORMULAS])
    for text in (path.read_text(encoding="utf-8"), shown, batch_csv(batch), plain):
        cells = [cell for row in csv.reader(io.StringIO(text)) for cell in row]
        assert any(cell.startswith("'") for cell in cells)
        for cell in cells:
            assert not cell.startswith(("=", "+", "-", "@", "\t", "\r")) or float(cell) is not None
    assert pd.read_csv(path)["z"].tolist()[-1] == -7.123456789012345


def test_the_terminal_renders_the_blocks_of_a_document() -> None:
    rows = (("1#", "0.5", "-"), ("a long name", "12", "0.1 .. 0.2"))
    text = render_text(
        [
            paragraph("A campaign ", "of two rigs"),
            Table("t", "Damping", ("rig", "median", "90 %"), rows, "A note."),
            Table("none", "No row", ("rig",), ()),
            Callout(ALARM, "One warning", ("bent",)),
            Callout(ALARM, "", ()),
            Listing(("test more",)),
            Table("left", "", ("card", "title"), (("a", "b"),), numeric=(False, False)),
        ]
    )
    assert text.split("\n\n") == [
        "A campaign of two rigs",
        "Damping\n"
        "rig          median        90 %\n"
        "-----------  ------  ----------\n"
        "1#              0.5           -\n"
        "a long name      12  0.1 .. 0.2\n"
        "A note.",
        "One warning\n  ! bent",
        "- test more",
        "card  title\n----  -----\na     b",
    ]
    with pytest.raises(TypeError, match="no Picture"):
        render_text([Picture("griffin", "c", "a")])


def test_a_number_is_written_for_its_reader() -> None:
    assert (TERMINAL.range((-0.5, 1e6), 3), PAGE.range((-0.5, 1e6), 3)) == ("-0.5 .. 1e+06", "−0.500 to 1000000")
    assert (TERMINAL.range(None), PAGE.range(None)) == ("-", "–")
    assert (TERMINAL.number(None), TERMINAL.number(float("inf"))) == ("-", "-")
    assert (TERMINAL.unit("kg/m^3"), PAGE.unit("kg/m^3")) == ("kg/m^3", "kg/m³")
    entry = {"median": 0.02, "interval": {"0.90": [0.01, 0.03]}}
    assert TERMINAL.spread(entry, 100.0) == ("2.00", "1.00 .. 3.00")
