"""From a record to its envelope: the paper's front end, Eqs. (2) to (8), and the demodulation that feeds inference."""

from scruton.envelope.consistency import review
from scruton.envelope.cycles import demodulate
from scruton.envelope.damping import GriffinCurve, aerodynamic_damping, griffin_curve, total_damping
from scruton.envelope.extracted import cycles_from_envelope
from scruton.envelope.frequency import dominant_frequency
from scruton.envelope.front_end import FrontEnd, front_end
from scruton.envelope.inspection import Inspection, gather, record_cycles, usable, weigh
from scruton.envelope.lines import Line
from scruton.envelope.quality import RecordQuality, assess
from scruton.envelope.relaxation import Relaxation, relaxation
from scruton.envelope.ringdown import DampingBand, RingDown, ring_down
from scruton.envelope.standing import Swing, beats, swing
from scruton.envelope.trial import (
    TRIAL_FUNCTIONS,
    CubicSpline,
    Polynomial,
    SecondOrderExponential,
    TrialFit,
    TrialFunction,
    trial_function,
)
from scruton.envelope.types import Cycles

__all__ = [
    "TRIAL_FUNCTIONS",
    "CubicSpline",
    "Cycles",
    "DampingBand",
    "FrontEnd",
    "GriffinCurve",
    "Inspection",
    "Line",
    "Polynomial",
    "RecordQuality",
    "Relaxation",
    "RingDown",
    "SecondOrderExponential",
    "Swing",
    "TrialFit",
    "TrialFunction",
    "aerodynamic_damping",
    "assess",
    "beats",
    "cycles_from_envelope",
    "demodulate",
    "dominant_frequency",
    "front_end",
    "gather",
    "griffin_curve",
    "record_cycles",
    "relaxation",
    "review",
    "ring_down",
    "swing",
    "total_damping",
    "trial_function",
    "usable",
    "weigh",
]
