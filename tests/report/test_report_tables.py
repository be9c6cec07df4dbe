"""Tables of a report against the fit that they come from, and as files."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fake_fit import fake_fit

from scruton.campaign.schema import Motion
from scruton.griffin import predict
from scruton.report.tables import tables, unit_of, write_csv


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
    draws = fit.tree["posterior"]["a_star"].sel(test="b,c").values
    row = table.loc[("test", "b,c", "a_star")]
    assert row["unit"] == "A/D"
    for name, q in (("q02.5", 0.025), ("q05", 0.05), ("q25", 0.25), ("median", 0.5), ("q75", 0.75), ("q97.5", 0.975)):
        assert row[name] == pytest.approx(np.quantile(draws, q)), name
    assert row["sd"] == pytest.approx(draws.std())
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
    assert row["unit"] == "A/D"


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
