"""What a reader must know before trusting a number, found from the data and said in one sentence each."""

from collections.abc import Mapping, Sequence

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.remarks import Severity, sentences
from scruton.campaign.schema import Campaign
from scruton.envelope import Cycles, RingDown, review, weigh
from scruton.infer.results import TestResult
from scruton.infer.thresholds import BAND_FLOOR, DAMPING_CERTAINTY, DAMPING_VARIATION, NOT_WHITE
from scruton.stats import whiteness


def slips(
    campaign: Campaign, cycles: Mapping[str, Cycles], ringdowns: Mapping[str, RingDown], stated_sd: float
) -> list[str]:
    """What looks like a slip in the campaign, worst first, alike slips in one line.

    `stated_sd` is the relative standard deviation of a damping ratio that is stated without one. Mere properties of
    records, which `scruton check` notes, are left out.
    """
    return sentences(review(weigh(campaign, cycles, ringdowns, stated_sd)), Severity.DOUBT)


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


def misfit(tests: Sequence[TestResult]) -> list[str]:
    """Records whose innovations can be predicted: the law or the noise of the model is not theirs.

    The innovations are those of each test's own posterior at its median; p-values are adjusted over all records.
    """
    parts = [(one, standardised_innovations(one)) for one in tests if one.posterior.data.size]
    if not parts:
        return []
    checks = whiteness.judge(
        np.concatenate([innovation for _, innovation in parts]),
        np.concatenate([one.posterior.data.amplitude for one, _ in parts]),
        np.concatenate([np.full(one.posterior.data.size, one.test.name) for one, _ in parts]),
        np.concatenate([one.posterior.data.record for one, _ in parts]),
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


def standardised_innovations(one: TestResult) -> FloatArray:
    """One-step errors over their standard deviations at the posterior median, (N,)."""
    middle = np.median(one.samples.chain.reshape(-1, one.samples.chain.shape[-1]), axis=0)
    innovation, variance = one.posterior.innovations(middle[None])
    return np.asarray(innovation[:, 0] / np.sqrt(variance[:, 0]))


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
