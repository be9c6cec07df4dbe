"""The diagnosis of a campaign that is at hand."""

from scruton.campaign.schema import Campaign
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import Diagnosis, diagnose_data


def diagnose(campaign: Campaign, **options: object) -> Diagnosis:
    """Load and diagnose; see `diagnose_data` for the options."""
    data = load_gap(campaign)
    return diagnose_data(data, data.campaign, **options)
