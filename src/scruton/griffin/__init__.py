"""Griffin: credible bands of the Griffin curve, and the predictive stable amplitude at a design Scruton number."""

from scruton.griffin.bands import (
    GriffinBand,
    band,
    griffin_band,
    griffin_draws,
    trial_griffin_draws,
)
from scruton.griffin.curves import EffectCurve, LawCurves, SharedCurve, law_curves, shared_curve
from scruton.griffin.predict import Prediction, predict, predictive_draws, single_draws

__all__ = [
    "EffectCurve",
    "GriffinBand",
    "LawCurves",
    "Prediction",
    "SharedCurve",
    "band",
    "griffin_band",
    "griffin_draws",
    "law_curves",
    "predict",
    "predictive_draws",
    "shared_curve",
    "single_draws",
    "trial_griffin_draws",
]
