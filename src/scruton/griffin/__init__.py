"""Griffin: credible bands of the Griffin curve, and the predictive stable amplitude at a design Scruton number."""

from scruton.griffin.bands import (
    GriffinBand,
    band,
    griffin_band,
    griffin_draws,
    trial_griffin_band,
    trial_griffin_draws,
)
from scruton.griffin.predict import Prediction, cross_predictions, predict, predictive_draws

__all__ = [
    "GriffinBand",
    "Prediction",
    "band",
    "cross_predictions",
    "griffin_band",
    "griffin_draws",
    "predict",
    "predictive_draws",
    "trial_griffin_band",
    "trial_griffin_draws",
]
