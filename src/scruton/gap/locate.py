"""Where the bare model and the measurement part: every place, with amplitude, time, rig, test, size and interval."""

from scruton.gap.diagnosis import UNSEEN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.locate_contrasts import between_tests, drift_findings, gain_findings, still_air_findings
from scruton.gap.locate_curves import Curves, curve_findings, excess_curves
from scruton.gap.locate_records import line_findings, scatter_findings, wave_findings
from scruton.gap.locate_scope import scope_findings
from scruton.gap.thresholds import ECHO, MOST_FINDINGS, MOST_OF_A_QUANTITY

__all__ = ["Curves", "Finding", "excess_curves", "locate"]


def locate(diagnosis: Diagnosis, curves: Curves | None = None) -> tuple[Finding, ...]:
    """Find where the bare model and the measurement part.

    Parameters
    ----------
    diagnosis : Diagnosis
    curves : Curves, optional
        `excess_curves(diagnosis.null)`, where they are there already.

    Returns
    -------
    tuple of Finding
        First where the effects of the verdict act, then what is seen without a look at the verdict, strongest first;
        at most `MOST_FINDINGS`.
    """
    scopes = scope_findings(diagnosis)
    seen = _places(diagnosis, curves or excess_curves(diagnosis.null))
    explained = {_key(finding) for finding in scopes}
    return tuple([*scopes, *(finding for finding in seen if _key(finding) not in explained)][:MOST_FINDINGS])


def _key(finding: Finding) -> tuple[object, ...]:
    return finding.quantity, finding.rig, finding.test, finding.record, finding.excess > 0.0


def _places(diagnosis: Diagnosis, curves: Curves) -> list[Finding]:
    """Places that the null model leaves, whatever the verdict, strongest first.

    Most quantities move a little with any effect.  What a drift, a gain, a test or a stated damping would explain is
    listed only where such an effect gains about as much evidence as the best one.
    """
    data, null = diagnosis.data, diagnosis.null
    found = curve_findings(curves, data)
    found += merged([*scatter_findings(curves.fit), *line_findings(diagnosis.lines, data), *wave_findings(data)])
    for effect, look in (
        ("structural_damping_error", still_air_findings),
        ("reduced_velocity_drift", between_tests),
        ("wind_speed_drift", lambda null: merged(drift_findings(null))),
        ("sensor_gain_error", lambda null: merged(gain_findings(null))),
    ):
        if _credible(diagnosis, effect):
            found += look(null)
    found.sort(key=lambda finding: -finding.significance)
    first: list[Finding] = []
    later: list[Finding] = []
    for i, finding in enumerate(found):
        before = sum(other.quantity == finding.quantity for other in found[:i])
        (first if before < MOST_OF_A_QUANTITY else later).append(finding)
    return first + later


def merged(findings: list[Finding]) -> list[Finding]:
    """The strongest of the findings of one kind and sign in several records of a test or rig."""
    kinds: dict[tuple[object, ...], list[Finding]] = {}
    for finding in findings:
        key = (finding.quantity, finding.rig, finding.test, finding.kind, finding.excess > 0.0)
        kinds.setdefault(key, []).append(finding)
    return [max(several, key=_significance) for several in kinds.values()]


def _significance(finding: Finding) -> float:
    return finding.significance


def _credible(diagnosis: Diagnosis, effect: str) -> bool:
    """Whether an effect explains about as much as the best one does."""
    if diagnosis.verdict == effect or effect in diagnosis.found:
        return True
    base = diagnosis.null.log_evidence
    gains = {name: candidate.log_evidence - base for name, candidate in diagnosis.singles.items()}
    best = max((gain for name, gain in gains.items() if name != UNSEEN), default=0.0)
    return effect in gains and gains[effect] > 0.0 and gains[effect] > ECHO * best
