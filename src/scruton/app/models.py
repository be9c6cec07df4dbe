"""`scruton models`: the shipped cards, one card resolved, its priors as Griffin curves."""

from argparse import Namespace
from pathlib import Path

from scruton.app.run import Outcome, Run
from scruton.infer.cards import ModelCard, load_card, shipped_cards


def run(_: Namespace) -> Outcome:
    """One row a shipped card: its name, its laws and its title."""
    cards = [load_card(name) for name in sorted(shipped_cards(), key=lambda name: (name != "default", name))]
    rows = [("card", "n", "title"), *((card.name, law_text(card), card.title) for card in cards)]
    name, law, title = (max(map(len, column)) for column in zip(*rows, strict=True))
    lines = [f"{row[0]:{name}}  {row[1]:{law}}  {row[2]}" for row in rows]
    return Outcome(lines=[lines[0], f"{'-' * name}  {'-' * law}  {'-' * title}", *lines[1:]])


def law_text(card: ModelCard) -> str:
    """Exponents of a card's laws, "-1, 0, 1, 2", or "free"."""
    return ", ".join(f"{one:g}" for one in card.laws) or "free"


def show(arguments: Namespace) -> Outcome:
    """Print a card with all that it extends, or write its prior-predictive picture, NAME.svg and NAME.png.

    Raises
    ------
    InputError
        If there is no such card.
    """
    card = load_card(arguments.card)
    folder = arguments.prior_predictive
    if folder is None:
        return Outcome(lines=[card.resolved.removesuffix("\n")])
    from scruton.report.figures import save
    from scruton.report.figures.predictions import prior_plot

    stem = Path(arguments.card).stem if arguments.card.endswith(".toml") else arguments.card
    claim = Run(
        folder, f"prior of {stem}", Namespace(**{**vars(arguments), "force": True}), sha256={}, card=card, settings={},
        results=(),
    )  # fmt: skip
    with claim as work:
        figures = save(prior_plot(card, seed=arguments.seed), work.new, stem, formats=("svg", "png"))
        return Outcome(lines=work.published(figures))
