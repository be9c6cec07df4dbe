"""What `scruton models` prints and draws: the shipped cards, one card resolved, its priors as Griffin curves."""

from pathlib import Path
from typing import TYPE_CHECKING

from scruton.infer.cards import load_card, shipped_cards

if TYPE_CHECKING:
    from scruton.infer.cards import ModelCard


def models_text() -> str:
    """One row a shipped card: its name, its laws and its title."""
    cards = [load_card(name) for name in sorted(shipped_cards(), key=lambda name: (name != "default", name))]
    rows = [("card", "n", "title"), *((one.name, law_text(one), one.title) for one in cards)]
    name, law, title = (max(map(len, column)) for column in zip(*rows, strict=True))
    lines = [f"{row[0]:{name}}  {row[1]:{law}}  {row[2]}" for row in rows]
    return "\n".join([lines[0], f"{'-' * name}  {'-' * law}  {'-' * title}", *lines[1:]])


def law_text(card: "ModelCard") -> str:
    """Exponents of a card's laws, "-1, 0, 1, 2", or "free"."""
    return ", ".join(f"{one:g}" for one in card.laws) or "free"


def draw_prior(name: str, folder: Path, *, seed: int = 0, formats: tuple[str, ...] = ("svg", "png")) -> list[Path]:
    """Write the prior-predictive picture of a card, NAME.svg and NAME.png.

    Parameters
    ----------
    name : str
        A shipped card, or the path of one.
    folder : Path
    seed : int
        Of the draws.
    formats : tuple of str

    Raises
    ------
    InputError
        If there is no such card.
    """
    from scruton.report.figures.prior import prior_plot
    from scruton.report.figures.save import save

    card = load_card(name)
    stem = Path(name).stem if name.endswith(".toml") else name
    return save(prior_plot(card, seed=seed), folder, stem, formats=formats)
