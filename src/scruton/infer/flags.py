"""What a reader must know before trusting a number, found from the data and said in one sentence each."""

from collections.abc import Mapping, Sequence

import numpy as np

from scruton.campaign.schema import Campaign
from scruton.envelope import RingDown
from scruton.infer.results import TestResult
from scruton.infer.thresholds import BAND_FLOOR, DAMPING_CERTAINTY, DAMPING_VARIATION, NOT_WHITE
from scruton.stats import whiteness


def damping_varies(ringdown: RingDown) -> tuple[int, int] | None:
    """Indices of the bands between which damping changes most, if it does; None where one constant will do."""
    bands = ringdown.bands
    xi = np.array([one.damping_ratio for one in bands])
    error = np.array([np.hypot(one.sd / np.sqrt(one.plucks), BAND_FLOOR * abs(one.damping_ratio)) for one in bands])
    worst, found = 0.0, None
    for i in range(len(bands)):
        for j in range(i):
            gap = abs(xi[i] - xi[j])
            ratio = gap / np.hypot(error[i], error[j])
            if ratio > max(worst, DAMPING_CERTAINTY) and gap > DAMPING_VARIATION * 0.5 * abs(xi[i] + xi[j]):
                worst, found = ratio, (j, i)
    return found


def varying_damping(campaign: Campaign, ringdowns: Mapping[str, RingDown]) -> list[str]:
    """Rigs whose still-air damping depends on the amplitude."""
    unit, lines = campaign.section.amplitude_unit, []
    for name, ringdown in ringdowns.items():
        bands = [ringdown.bands[i] for i in damping_varies(ringdown) or ()]
        texts = [f"{100 * one.damping_ratio:.3g} % at {one.lower:.3g} to {one.upper:.3g} {unit}" for one in bands]
        if texts:
            lines.append(
                f"rig {name}: structural damping varies with amplitude ({', '.join(texts)}); the posterior of one "
                "constant is an average over the ring-downs, and Eq. (6) takes the measured xi_s(A)"
            )
    return lines


def misfit(tests: Sequence[TestResult]) -> list[str]:
    """Records whose innovations can be predicted: the law or the noise of the model is not theirs.

    The innovations are those of each test's own posterior at its median; p-values are adjusted over all records.
    """
    parts = [one for one in tests if one.posterior.data.size]
    if not parts:
        return []
    checks = whiteness.judge(
        np.concatenate([one.posterior.standardised(one.samples.chain) for one in parts]),
        np.concatenate([one.posterior.data.amplitude for one in parts]),
        np.repeat([one.test.name for one in parts], [one.posterior.data.size for one in parts]),
        np.concatenate([one.posterior.data.record for one in parts]),
    )
    found: dict[str, list[str]] = {}
    for one in checks:
        if one.name in whiteness.PREDICTABLE and one.adjusted < NOT_WHITE:
            found.setdefault(one.test, []).append(f"{one.name}{f' of {one.record}' if one.record else ''}")
    return [
        f"test {test}: the innovations of the filter are not white ({'; '.join(what)}); the law or the noise of the "
        "model is not that of the records, `scruton criticise` says more"
        for test, what in found.items()
    ]


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
