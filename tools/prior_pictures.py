"""Draw what the priors of every shipped model card say: models/prior-predictive/NAME.svg."""

from pathlib import Path

from scruton.infer.cards import load_card, shipped_cards
from scruton.report.figures import save
from scruton.report.figures.predictions import prior_plot

if __name__ == "__main__":
    for name in shipped_cards():
        print(*save(prior_plot(load_card(name), seed=0), Path("models/prior-predictive"), name, formats=("svg",)))
