"""Where the bare model and the measurement part: every place, with amplitude, time, rig, test, size and interval."""

from operator import attrgetter

from scruton.gap.diagnosis import UNKNOWN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.locate_contrasts import between_tests, drift_findings, gain_findings, still_air_findings
from scruton.gap.locate_curves import Curves, curve_findings, excess_curves
from scruton.gap.locate_records import line_findings, scatter_findings, wave_findings
from scruton.gap.locate_scope import scope_findings
from scruton.gap.thresholds import ECHO, MOST_FINDINGS, MOST_OF_A_QUANTITY


def locate(diagnosis: Diagnosis, curves: Curves | None = None) -> tuple[Finding, ...]:
    """Find where the bare model and the measurement part.

    First where the effects of the verdict act, then what is seen without a look at the verdict, strongest first; at
    most `MOST_FINDINGS`.  `curves` are `excess_curves(diagnosis.null)`, where they are there already.
    """
    found = scope_findings(diagnosis)
    explained = {_key(finding) for finding in found}
    seen = _places(diagnosis, curves or excess_curves(diagnosis.null))
    return tuple([*found, *(finding for finding in seen if _key(finding) not in explained)][:MOST_FINDINGS])


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
        ("wind_speed_drift", drift_findings),
        ("sensor_gain_error", gain_findings),
    ):
        if _credible(diagnosis, effect):
            found += merged(look(null))
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
    return [max(several, key=attrgetter("significance")) for several in kinds.values()]


def _credible(diagnosis: Diagnosis, effect: str) -> bool:
    """Whether an effect explains about as much as the best one does."""
    if effect in diagnosis.found:
        return True
    gains = {name: one.log_evidence - diagnosis.null.log_evidence for name, one in diagnosis.singles.items()}
    best = max((gain for name, gain in gains.items() if name != UNKNOWN), default=0.0)
    return gains.get(effect, 0.0) > max(0.0, ECHO * best)
