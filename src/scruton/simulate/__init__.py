"""Synthetic records from the full equation of motion; it shares no approximation with the rooms that it checks."""

from scruton.simulate.campaign import write_campaign
from scruton.simulate.disturbances import Disturbances
from scruton.simulate.motion import Noise, simulate_record
from scruton.simulate.truth import Truth

__all__ = ["Disturbances", "Noise", "Truth", "simulate_record", "write_campaign"]
