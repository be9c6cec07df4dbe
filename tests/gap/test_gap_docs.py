"""The pages say the thresholds that are in force."""

from pathlib import Path

import pytest

from scruton.gap import thresholds
from scruton.infer import thresholds as fitted

DOCS = Path(__file__).parents[2] / "docs"
BOUNDS = (
    f"{100.0 * thresholds.MOST_GUSTS:g} % of the drive and {100.0 * thresholds.MOST_SET_POINT:g} % of the stable "
    "amplitude"
)
SAID = {
    "diagnosis.md": (
        f"they have bounds, {BOUNDS}",
        f"the generic term {thresholds.UNKNOWN_NATS:g} beside the bend (and {100.0 * thresholds.SECOND_SHARE:g} %",
        f"less {thresholds.ALLOWED_EXCESS:g} nats and {100.0 * thresholds.ALLOWED_SHARE:g} % of what it explained",
        f"beyond {thresholds.LINE_NATS:g} nats over chance",
        f"{thresholds.FIT_WITHIN:g} nats and two fifths",
        f"no more than {thresholds.FURTHER_NATS:g} nats and {100.0 * thresholds.FURTHER_SHARE:g} % of what it gains",
        f"gains at least {thresholds.SECOND_NATS:g} nats",
        f"places, {thresholds.MOST_FINDINGS} at most",
    ),
    "theory.md": (
        f"$s_{{max}}$ {BOUNDS}",
        f"[{100.0 * fitted.MOST_GUSTS:g} and {100.0 * fitted.MOST_SET_POINT:g} %](#the-likelihood)",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("page", "words"), [(page, words) for page, every in SAID.items() for words in every])
def test_a_page_says_what_is_in_force(page: str, words: str) -> None:
    assert words in " ".join((DOCS / page).read_text(encoding="utf-8").split())
    assert pytest.approx(0.4) == thresholds.FIT_SHARE, "two fifths"
    assert thresholds.MOST_EFFECTS == 3, "three at most"
