"""The quick estimation on records of a force whose parameters are known: the rows of the paper's Table 5."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from scruton.campaign import load_campaign
from scruton.cli import main
from scruton.dynamics.identify import identify
from scruton.envelope import gather
from scruton.errors import InputError

EXAMPLES = Path(__file__).parents[2] / "examples"
# Sc: m_r, slope, K, Y1, epsilon, as printed in the paper
TABLE_5 = {
    1.9: (9.442e-4, 0.8927, 0.6549, -6.337, 0.03791),
    21.7: (9.411e-4, 0.7543, 0.7364, -11.111, 0.03235),
    78.1: (9.411e-4, 0.9583, 0.7733, -8.001, 0.03900),
}


@pytest.fixture(scope="module")
def rectangle():
    return gather(load_campaign(EXAMPLES / "rectangle-4to1"))


@pytest.mark.parametrize("trial", ["second-order exponential", "cubic spline 12"])
def test_the_rows_of_table_5_come_out(rectangle, trial):
    found = list(identify(rectangle, trial))
    assert len(found) == 6
    for sc, (mass_ratio, slope, k, y1, epsilon) in TABLE_5.items():
        rows = [row for row in found if row.scruton_number == pytest.approx(sc, rel=0.02)]
        assert len(rows) == 2
        for row in rows:
            assert row.mass_ratio == pytest.approx(mass_ratio, rel=1e-3)
            assert row.reduced_frequency == pytest.approx(k, rel=2e-3)
            assert row.slope == pytest.approx(slope, rel=0.08), (row.record, trial)
            # Y1 and epsilon are near the pole of Eq. (18) at large Sc; their product is what the slope says.
            assert row.Y1 * row.epsilon == pytest.approx(y1 * epsilon, rel=0.08)
        if sc < 50.0:
            assert pytest.approx(y1, rel=0.1) == rows[0].Y1


def test_a_record_that_gives_no_curve_says_why(rectangle):
    bare = replace(rectangle.campaign, rigs=tuple(replace(rig, damping_ratio=None) for rig in rectangle.campaign.rigs))
    found = list(identify(replace(rectangle, campaign=bare, ringdowns={})))
    assert len(found) == 6
    assert all(isinstance(row, InputError) and "no structural damping" in str(row) for row in found)


def test_the_verb_prints_the_table_and_json(capsys):
    campaign = str(EXAMPLES / "closed-box-torsional")
    assert main(["identify", campaign]) == 0
    table = capsys.readouterr().out
    assert "sc0p76_decay.csv" in table
    assert "A in deg" in table
    assert main(["identify", campaign, "--json", "--trial", "polynomial 8"]) == 0
    rows = json.loads(capsys.readouterr().out)["identified"]
    assert len(rows) == 6
    assert {row["trial"]["name"] for row in rows} == {"polynomial 8"}
    assert all(row["epsilon"] > 0.0 for row in rows)


def test_a_trial_function_that_is_none_is_refused(capsys):
    assert main(["identify", str(EXAMPLES / "pylon"), "--trial", "sine"]) == 2
    assert "--trial" in capsys.readouterr().err
