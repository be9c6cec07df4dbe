"""Whether a record in wind is of a vortex-induced vibration at all: one that stays finite, and does not die out."""

import numpy as np

from scruton.campaign.schema import Kind, Record
from scruton.envelope.thresholds import DIES, DISORDER, NO_VORTEX, VISIBLE
from scruton.envelope.types import Cycles
from scruton.errors import InputError


def check_vibrates(record: Record, cycles: Cycles, unit: str) -> None:
    """InputError for a record in wind that has no stable amplitude which the model could hold; `unit` of amplitudes.

    Notes
    -----
    Above some Scruton number nothing is locked in: a decay sinks to what noise and buffeting leave. Every law has a
    stable amplitude above zero, and would find one somewhere on the way down.
    """
    amplitude = cycles.amplitude
    largest = float(np.max(amplitude))
    if largest > NO_VORTEX:
        raise InputError(
            record.path, record.field, f"a largest amplitude of {largest:.3g} {unit}",
            f"at most {NO_VORTEX:g} {unit}, which no vortices exceed (its unit? galloping?)",
        )  # fmt: skip
    last = slice(-max(3, len(amplitude) // 4), None)
    tail, scatter = float(np.mean(amplitude[last])), float(np.std(amplitude[last]))
    noise = float(np.mean(cycles.standard_error[last]))
    if record.kind is Kind.DECAY and tail < DIES * largest and (tail < VISIBLE * noise or scatter > DISORDER * tail):
        left = 100.0 * max(tail, 0.0) / largest
        raise InputError(
            record.path, record.field, f"a decay that dies out, to {left:.2g} % of its largest amplitude",
            "a decay to a stable amplitude (a setting that does not vibrate tells none)",
        )  # fmt: skip
