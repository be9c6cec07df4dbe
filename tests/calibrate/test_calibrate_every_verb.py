"""Every verb ends on campaigns of every regime without an error that a user cannot act upon."""

from dataclasses import replace
from pathlib import Path

import pytest

from scruton.calibrate.bodies import draw_campaign
from scruton.calibrate.campaigns import campaign_seeds, simulate_campaign
from scruton.calibrate.regimes import REGIMES
from scruton.campaign.schema import Motion, Record
from scruton.campaign.write import save_campaign
from scruton.cli import main
from scruton.infer.cards import load_card
from scruton.terminal import BAD_INPUT, DONE, NOT_TRUSTED

SEED = 20
VALIDATED = (
    "law-2",
    "bump",
    "coherence-loss",
    "memory",
    "wake-facchinetti",
    "off-20-three",
)  # of three rigs, 7 fits each
QUICK = """format = 1
name = "quick"
extends = "default"
[sampler]
walkers = 64
draws = 16
min_ess = 100
max_rhat = 1.2
max_steps = 800
"""


def written(regime: str, index: int, folder: Path) -> Path:
    """A campaign of a regime as a laboratory would hand it over."""
    card = load_card()
    draw, simulate, _, _, beside = campaign_seeds(regime, index, SEED)
    drawn, setup, body = draw_campaign(REGIMES[regime], REGIMES[regime].card(card), draw, beside)
    folder.mkdir()
    made = simulate_campaign(REGIMES[regime], drawn, setup, simulate, body.rigs)
    owners = {"rigs": made.rigs, "tests": made.tests}
    named = {key: tuple(replace(one, records=_as_files(one.records)) for one in of) for key, of in owners.items()}
    save_campaign(replace(made, **named), folder)
    return folder


def _as_files(records: tuple[Record, ...]) -> tuple[Record, ...]:
    """Records under names that files have."""
    return tuple(replace(one, name=f"{Path(one.name).stem}.csv") for one in records)


@pytest.mark.slow
@pytest.mark.parametrize("regime", REGIMES)
def test_every_verb_ends(regime: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    campaign, fit, card = written(regime, 0, tmp_path / "campaign"), str(tmp_path / "fit"), tmp_path / "quick.toml"
    card.write_text(QUICK, encoding="utf-8")
    limit = "0.02" if REGIMES[regime].motion is Motion.HEAVING else "0.4 deg"
    asked = [
        ["check", str(campaign)],
        ["identify", str(campaign)],
        ["fit", str(campaign), "-o", fit, "--model", str(card), "--quiet"],
        ["diagnose", str(campaign), "-o", str(tmp_path / "fit" / "gap"), "--quiet"],
        ["criticise", fit],
        ["predict", fit, "--sc", "20"],
        ["size", fit, "--limit", limit, "--quiet"],
        *([["validate", str(campaign), "--model", str(card), "--quiet"]] if regime in VALIDATED else []),
        ["report", fit, "--quiet"],
    ]
    for words in asked:
        code = main(words)
        said = capsys.readouterr()
        assert code in (DONE, NOT_TRUSTED), f"{words}: {said.err}{said.out}"
        assert "Traceback" not in said.err
    assert main(["predict", fit, "--sc", "nan"]) == BAD_INPUT
