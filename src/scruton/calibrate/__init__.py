"""Simulation-based calibration and coverage: whether a credible band deserves its name, on data from elsewhere."""

from scruton.calibrate.calibration import run_calibration
from scruton.calibrate.coverage import CalibrationResult
from scruton.calibrate.execution import Execution
from scruton.calibrate.regimes import REGIMES, Regime
from scruton.calibrate.tables import calibration_text

__all__ = ["REGIMES", "CalibrationResult", "Execution", "Regime", "calibration_text", "run_calibration"]
