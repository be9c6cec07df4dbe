"""The natural frequency that a rig's free decays show, where what is stated for it contradicts them."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Rig
from scruton.campaign.thresholds import FAR
from scruton.envelope.backbone import bends_from
from scruton.envelope.thresholds import ANOTHER_MOTION, SIGMAS, STILL_FREQUENCY
from scruton.envelope.types import Cycles
from scruton.errors import InputError


def retuned(campaign: Campaign, cycles: Mapping[str, Cycles], *, refuse: bool) -> Campaign:
    """The campaign with f0 as the free decays of each rig show it, where what is stated is off, and remarks on it.

    Free decays that do not agree with each other show none, and remarks on the records say so; nor do those whose
    frequency goes to what is stated as they die out, which a spring that bends does.

    Raises
    ------
    InputError
        Where they `refuse` what is off by so much that the decays are of another motion, or of another time.
    """
    remarks: list[Remark] = []

    def tuned(rig: Rig) -> Rig:
        lines = [cycles[record.name].reference_frequency for record in rig.records if not record.is_envelope]
        if not lines or max(lines) > (1.0 + STILL_FREQUENCY) * min(lines):
            return rig
        line, stated = float(np.median(lines)), rig.frequency.mean
        limit = max(STILL_FREQUENCY, SIGMAS * rig.frequency.relative_sd)
        off = abs(line / stated - 1.0)
        if off <= limit:
            return rig
        if all(bends_from(cycles[record.name], stated, limit) for record in rig.records if not record.is_envelope):
            return rig
        if off > ANOTHER_MOTION:
            if refuse:
                number = campaign.rigs.index(rig)
                wanted = (
                    f"the f0 that its free decays ring at, {line:.4g} Hz; or other records, where these are of another "
                    "motion or their time is wrong"
                )
                raise InputError(campaign.path, f"rigs[{number}].frequency", f"{stated:.4g} Hz", wanted)
            return rig
        remarks.append(
            Remark(
                Severity.SERIOUS if off > FAR * limit else Severity.DOUBT, "natural frequency", "rig", rig.name,
                f"its free decays ring at {line:.5g} Hz, {line / stated:.3g} times the f0 = {stated:.4g} Hz stated, "
                f"more than {100.0 * limit:.2g} % off; {line:.5g} Hz is used. Wind speeds stay what they are in m/s: "
                "a reduced_velocity was that of the f0 stated.",
                "the free decays, whose frequency is used, ring at {} times the f0 stated", line / stated, off / limit,
            )
        )  # fmt: skip
        return replace(rig, frequency=replace(rig.frequency, mean=line))

    rigs = tuple(tuned(rig) for rig in campaign.rigs)
    return replace(campaign, rigs=rigs, remarks=(*campaign.remarks, *remarks)) if remarks else campaign
