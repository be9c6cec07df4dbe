"""What a fit says of tests that its model does not describe, or of which records say too little."""

from collections.abc import Iterator, Sequence

import numpy as np

from scruton.campaign.schema import Kind
from scruton.infer.joint import Joint
from scruton.infer.results import Sampled, TestResult
from scruton.infer.thresholds import BARELY_MOVED, DEPARTS, SET_APART


def lock_in_not_used(tests: Sequence[TestResult]) -> list[str]:
    """Why of lock-in records the mean alone is used; what transients are used for a review of the records says."""
    kinds = {record.name: record.kind for result in tests for record in result.test.records}
    verdicts = (verdict for result in tests for verdict in result.steady)
    return [v.explain() for v in verdicts if kinds[v.record] is Kind.STEADY and not v.usable]


def departing(tests: Sequence[TestResult]) -> list[str]:
    """Tests whose drift is not that of the reference law."""
    return [
        f"test {name}: the drift leaves the reference law by {scale:.0%} one e-fold from the stable amplitude; Y1, "
        "epsilon and the relaxation rate under that law alone describe these records badly"
        for name, scale in _surely_beyond(tests, "departure_scale", DEPARTS)
    ]


def set_apart(tests: Sequence[TestResult]) -> list[str]:
    """Tests whose records differ in their stable amplitudes by more than winds that are set anew."""
    return [
        f"test {name}: its records stand at amplitudes that scatter by {100.0 * scatter:.2g} %, more than a wind that "
        "is set anew for each explains: a gain, a unit or the wind of one of them. The stable amplitude is a mean of "
        "theirs, and may be that of none; `scruton diagnose` says more"
        for name, scatter in _surely_beyond(tests, "set_point_scatter", SET_APART)
    ]


def _surely_beyond(tests: Sequence[TestResult], quantity: str, most: float) -> Iterator[tuple[str, float]]:
    """Names of the tests whose transients show more of a quantity, with 95 % certainty, and its median there."""
    for result in tests:
        draws = result.derived[quantity]
        if result.posterior.data.size and float(np.quantile(draws, 0.05)) > most:
            yield result.test.name, float(np.median(draws))


def unconstrained(sampled: Sampled, joint: Joint) -> list[str]:
    """Tests whose relaxation rate neither a transient record tells nor the curve that several rigs share."""
    scale = sampled.card.prior("relaxation_ratio", sampled.campaign.section.motion).scale
    told = [
        name for name, draws in joint.tests.items() if np.log(draws["relaxation_rate"]).std() < BARELY_MOVED * scale
    ]
    alone = (result.test.name for result in sampled.tests if not result.posterior.data.size)
    names = [name for name in alone if name not in told]
    if not names:
        return []
    return [
        f"{'tests' if len(names) > 1 else 'test'} {', '.join(names)}: no growth or decay record that tells of "
        "damping. The others give the stable amplitude alone; the relaxation rate, and with it Y1, epsilon and "
        "amplitudes at other Scruton numbers, rest on the prior"
    ]
