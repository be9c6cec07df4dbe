"""Where the bare model and the measurement part: every place, with amplitude, time, rig, test, size and interval."""

from scruton.gap.diagnosis import UNSEEN, Diagnosis
from scruton.gap.finding import Finding
from scruton.gap.locate_curves import Curves, curve_findings, excess_curves
from scruton.gap.locate_fellows import between_tests, drift_findings, gain_findings, still_air_findings
from scruton.gap.locate_records import line_findings, scatter_findings, wave_findings
from scruton.gap.locate_scope import scope_findings

__all__ = ["Curves", "Finding", "excess_curves", "locate", "places"]

MOST = 12
_ECHO = 0.6  # of the largest gain of any effect: places that one of less would explain are echoes of another
_KIND = 3  # places of one quantity, at most, before those of others have had their turn


def locate(diagnosis: Diagnosis, curves: Curves | None = None) -> tuple[Finding, ...]:
    """Find where the bare model and the measurement part.

    Parameters
    ----------
    diagnosis : Diagnosis
    curves : Curves, optional
        `excess_curves(diagnosis.bare)`, where they are there already.

    Returns
    -------
    tuple of Finding
        First where the effects of the verdict act, then what is seen without a look at the verdict, strongest first;
        at most `MOST`.
    """
    scopes = scope_findings(diagnosis)
    seen = places(diagnosis, curves or excess_curves(diagnosis.bare))
    told = {_kind(one) for one in scopes}
    return tuple([*scopes, *(one for one in seen if _kind(one) not in told)][:MOST])


def _kind(one: Finding) -> tuple[object, ...]:
    return one.quantity, one.rig, one.test, one.record, one.excess > 0.0


def places(diagnosis: Diagnosis, curves: Curves) -> list[Finding]:
    """Places that the bare model leaves, whatever the verdict, strongest first.

    Most quantities move a little with any effect.  What a drift, a gain, a test or a stated damping would explain is
    listed only where such an effect gains about as much evidence as the best one.
    """
    data, bare = diagnosis.data, diagnosis.bare
    found = curve_findings(curves, data)
    found += merged([*scatter_findings(curves.fit), *line_findings(diagnosis.lines, data), *wave_findings(data)])
    if _credible(diagnosis, "structural_damping_error"):
        found += still_air_findings(bare)
    if _credible(diagnosis, "reduced_velocity_drift"):
        found += between_tests(bare)
    if _credible(diagnosis, "wind_speed_drift"):
        found += merged(drift_findings(bare))
    if _credible(diagnosis, "sensor_gain_error"):
        found += merged(gain_findings(bare))
    found.sort(key=lambda one: -one.significance)
    first: list[Finding] = []
    later: list[Finding] = []
    for i, one in enumerate(found):
        before = sum(other.quantity == one.quantity for other in found[:i])
        (first if before < _KIND else later).append(one)
    return first + later


def merged(findings: list[Finding]) -> list[Finding]:
    """The strongest of the findings of one kind in several records of a test or rig."""
    kinds: dict[tuple[object, ...], list[Finding]] = {}
    for one in findings:
        kind = one.detail.split(":")[0].split(" at ")[0].split(" in quarter")[0]
        kinds.setdefault((one.quantity, one.rig, one.test, kind, one.excess > 0.0), []).append(one)
    return [max(several, key=lambda one: one.significance) for several in kinds.values()]


def _credible(diagnosis: Diagnosis, effect: str) -> bool:
    """Whether an effect explains about as much as the best one does."""
    if diagnosis.verdict == effect or effect in diagnosis.found:
        return True
    base = diagnosis.bare.log_evidence
    gains = {name: one.log_evidence - base for name, one in diagnosis.singles.items()}
    best = max((gain for name, gain in gains.items() if name != UNSEEN), default=0.0)
    return effect in gains and gains[effect] > 0.0 and gains[effect] > _ECHO * best
