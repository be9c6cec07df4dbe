"""Draw what the priors of every shipped model card say: models/prior-predictive/NAME.svg."""

from pathlib import Path

from scruton.app.models import draw_prior
from scruton.infer.cards import shipped_cards

if __name__ == "__main__":
    for name in shipped_cards():
        print(*draw_prior(name, Path("models/prior-predictive"), formats=("svg",)))
