"""Cycles whose crests the sensor cut off, which tell no amplitude: left out of what is fitted."""

from functools import partial

import numpy as np

from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Record
from scruton.envelope.flat_tops import cut_off_sides
from scruton.envelope.stillness import LeftOut, about, without_samples

CLIPPED = "clipped"  # kind of the remarks on records that are clipped


def unclipped(campaign: Campaign) -> Campaign:
    """The campaign without the cycles of its records that are clipped, which its remarks then tell.

    Half a cycle goes on either side of every sample that stands at the end of the range. Of a record that a filter has
    rounded, and of an envelope, nobody can tell.
    """
    return without_samples(campaign, partial(_clipped, unit=campaign.section.amplitude_unit))


def _clipped(record: Record, frequency: float, unit: str) -> LeftOut | None:
    time = record.time
    if record.is_envelope or record.band is not None or time.size < 2 or not np.isfinite(record.response).all():
        return None
    sides = cut_off_sides(time, record.response, frequency)
    if not sides:
        return None
    at = time[np.any([side.at_top for side in sides], axis=0)]
    near = about(time, at, frequency)
    where = " and ".join("above" if side.sign > 0.0 else "below" for side in sides)
    level, cycles = min(side.level for side in sides), float(np.ptp(time)) * frequency
    share = 100.0 * float(np.mean(near))
    told = (
        f"the signal is clipped {where}: readings stand in a row at the extreme, {level:.3g} {unit} from the mean; the "
        f"cycles there, {share:.2g} % of {cycles:.0f}, are left out of what is fitted: their amplitude is larger than "
        "it looks."
    )
    alike = f"the signal is clipped {where} (the cycles there, {{}} % of the record, are left out of what is fitted)"
    return near, Remark(Severity.DOUBT, CLIPPED, "record", record.name, told, alike, share)
