"""Griffin: credible bands of the Griffin curve, and the predictive stable amplitude at a design Scruton number."""

from scruton.griffin.bands import (
    GriffinBand,
    band,
    griffin_band,
    griffin_draws,
    trial_griffin_band,
    trial_griffin_draws,
)
from scruton.griffin.predict import Prediction, SharedCurve, predict, predictive_draws, shared_curve, single_draws

__all__ = [
    "GriffinBand",
    "Prediction",
    "SharedCurve",
    "band",
    "griffin_band",
    "griffin_draws",
    "predict",
    "predictive_draws",
    "shared_curve",
    "single_draws",
    "trial_griffin_band",
    "trial_griffin_draws",
]
