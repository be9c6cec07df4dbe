"""The laboratory's files to validated, frozen dataclasses in SI units.

`load_campaign` is the door: it reads a campaign.toml and every record that it names.
"""

from scruton.campaign.load import load_campaign
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Campaign, Fluid, Kind, Motion, Record, Rig, Section, Sweep, Test
from scruton.campaign.select import peak_tests, tests_named, tests_used
from scruton.campaign.units import parse_quantity

__all__ = [
    "Campaign",
    "Fluid",
    "Kind",
    "Motion",
    "Quantity",
    "Record",
    "Rig",
    "Section",
    "Sweep",
    "Test",
    "load_campaign",
    "parse_quantity",
    "peak_tests",
    "tests_named",
    "tests_used",
]
