"""What a reader must know before trusting a number, found from the data and said in one sentence each."""

from collections.abc import Mapping, Sequence

import numpy as np

from scruton.campaign.schema import Campaign
from scruton.envelope import RingDown
from scruton.infer.results import TestResult

# Two bands of amplitude differ in damping where they are apart by both of these.
VARIATION = 0.2  # of the mean
CERTAINTY = 3.0  # joint standard errors
FLOOR = 0.02  # relative error of a band that its scatter cannot show


def damping_varies(ringdown: RingDown) -> tuple[int, int] | None:
    """Indices of the bands between which damping changes most, if it does; None where one constant will do."""
    bands = ringdown.bands
    xi = np.array([one.damping_ratio for one in bands])
    error = np.array([np.hypot(one.sd / np.sqrt(one.plucks), FLOOR * abs(one.damping_ratio)) for one in bands])
    worst, found = 0.0, None
    for i in range(len(bands)):
        for j in range(i):
            gap = abs(xi[i] - xi[j])
            ratio = gap / np.hypot(error[i], error[j])
            if ratio > max(worst, CERTAINTY) and gap > VARIATION * 0.5 * abs(xi[i] + xi[j]):
                worst, found = ratio, (j, i)
    return found


def varying_damping(campaign: Campaign, ringdowns: Mapping[str, RingDown]) -> list[str]:
    """Rigs whose still-air damping depends on the amplitude."""
    unit = campaign.section.amplitude_unit
    lines = []
    for name, ringdown in ringdowns.items():
        found = damping_varies(ringdown)
        if found is None:
            continue
        texts = [
            f"{100 * one.damping_ratio:.3g} % at {one.lower:.3g} to {one.upper:.3g} {unit}"
            for one in (ringdown.bands[i] for i in found)
        ]
        lines.append(
            f"rig {name}: structural damping varies with amplitude ({texts[0]}, {texts[1]}); the posterior of one "
            "constant is an average over the ring-downs, and Eq. (6) takes the measured xi_s(A)"
        )
    return lines


def unconstrained(tests: Sequence[TestResult]) -> list[str]:
    """Tests that no transient record constrains."""
    names = [one.test.name for one in tests if not one.posterior.data.size]
    if not names:
        return []
    return [
        f"{'tests' if len(names) > 1 else 'test'} {', '.join(names)}: no growth or decay record. Lock-in records give "
        "the stable amplitude alone; the relaxation rate, and with it Y1, epsilon and amplitudes at other Scruton "
        "numbers, rest on the prior"
    ]
