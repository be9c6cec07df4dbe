"""Draw what the priors of every shipped model card say: models/prior-predictive/NAME.svg."""

from pathlib import Path

from scruton.infer.cards import shipped_cards
from scruton.report.models import draw_prior

if __name__ == "__main__":
    for name in shipped_cards():
        print(*draw_prior(name, Path("models/prior-predictive"), formats=("svg",)))
