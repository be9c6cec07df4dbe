"""`scruton models`: the shipped cards, one card resolved, its priors as Griffin curves."""

import tomllib
from argparse import Namespace
from pathlib import Path

from scruton.app.run import Outcome, Run
from scruton.infer.cards import load_card, shipped_cards
from scruton.report.document import Table
from scruton.report.render_text import render_text
from scruton.terminal import line_width


def run(_: Namespace) -> Outcome:
    """One row a shipped card: its name, the exponents of its laws and its title."""
    cards = [load_card(name) for name in sorted(shipped_cards(), key=lambda name: (name != "default", name))]
    rows = [(card.name, ", ".join(f"{exponent:g}" for exponent in card.laws) or "free", card.title) for card in cards]
    table = Table("cards", "", ("card", "n", "title"), rows, numeric=[False] * 3)
    content = {"cards": [{"name": card.name, "laws": list(card.laws), "title": card.title} for card in cards]}
    return Outcome(render_text([table], line_width()), content=content)


def show(arguments: Namespace) -> Outcome:
    """Print a card with all that it extends, or write its prior-predictive picture, NAME.svg and NAME.png.

    InputError if there is no such card.
    """
    card, folder = load_card(arguments.card), arguments.prior_predictive
    if folder is None:
        return Outcome(card.resolved.removesuffix("\n"), content=tomllib.loads(card.resolved))
    from scruton.report.figures import save
    from scruton.report.figures.predictions import prior_plot

    stem = Path(arguments.card).stem if arguments.card.endswith(".toml") else arguments.card
    forced = Namespace(**{**vars(arguments), "force": True})
    with Run(folder, f"prior of {stem}", forced, sha256={}, card=card, settings={}, results=()) as work:
        figures = save(prior_plot(card, seed=arguments.seed), work.new, stem, formats=("svg", "png"))
        return Outcome(paths=work.published(figures))
