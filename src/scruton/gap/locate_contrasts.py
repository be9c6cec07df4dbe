"""Places that one record shows only beside others: damping off its statement, drifts, gains, tests that differ."""

import numpy as np
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Extent, Parameter, Scope, Values, Variant, add, size_prior
from scruton.dynamics.effects.terms import Layout, Term
from scruton.gap.finding import Finding, amplitudes_of, place
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import CONTRAST_FALSE


def still_air_findings(null: FittedHypothesis) -> list[Finding]:
    """Rigs whose damping is not what is stated, as the records tell it without that statement."""
    data = null.hypothesis.data
    value, sd = null.value("damping")
    found = []
    for i, (m, s) in enumerate(zip(value, sd, strict=True)):
        still = (data.layout.rig == i) & ~data.layout.wind
        stated = data.damping[i] if i < data.damping.size else np.nan
        if not np.isfinite(stated) or not np.any(still):
            continue
        prior = float(data.damping_sd[i])
        share = 1.0 - (s / prior) ** 2
        if share < 0.1:
            continue
        error, error_sd = m / share, float(np.sqrt(s**2 / share + prior**2))
        if _beyond(error / error_sd, value.size):
            whole = {"record": None, "amplitude": amplitudes_of(data, still), "time": None}
            detail, r = "damping ratio, over the stated one", int(np.flatnonzero(still)[0])
            fields = {"significance": abs(error) / error_sd, **whole}
            found.append(place(data, r, "damping", float(stated * error), float(stated * error_sd), detail, **fields))
    return found


def drift_findings(null: FittedHypothesis) -> list[Finding]:
    """Damping that changes while a record runs: a wind that rises or falls, told record by record."""
    data = null.hypothesis.data
    layout = data.layout
    fit = _with_one_each(null, Term.TREND, size_prior("size", layout.each(layout.wind)))
    value, sd = fit.value("size", 0)
    table = fit.table
    # the slope of the damping at the stable amplitude, in the relative change of the wind
    slope = -(table[:, Term.AERO] + 2.0 * table[:, Term.STRUCTURAL]) / layout.omega
    return [
        place(data, int(r), "damping", slope[r] * value[j], abs(slope[r]) * sd[j],
              f"damping ratio, end of the record over its start: wind {value[j]:+.1%}", kind="drift")
        for j, r in enumerate(np.flatnonzero(layout.wind))
        if _beyond(value[j] / sd[j], value.size)
    ]  # fmt: skip


def gain_findings(null: FittedHypothesis) -> list[Finding]:
    """Records whose reading is larger or smaller than that of the others by a factor."""
    data = null.hypothesis.data
    layout = data.layout
    records = np.flatnonzero(layout.wind)
    if records.size < 3:
        return []
    fit = _with_one_each(null, Term.GAIN, size_prior("size", layout.each(layout.wind), scale=0.2))
    where = fit.hypothesis.slices[0, "size"]
    contrast = np.eye(records.size) - 1.0 / records.size
    sd = np.sqrt(np.diag(contrast @ fit.covariance[where, where] @ contrast.T))
    value = fit.mode[where] - np.median(fit.mode[where])
    return [
        place(data, int(r), "signal", value[j], sd[j], "gain over that of its fellows, minus 1", kind="gain")
        for j, r in enumerate(records)
        if _beyond(value[j] / sd[j], value.size)
    ]


def between_tests(null: FittedHypothesis) -> list[Finding]:
    """Tests whose aerodynamic damping or drive is not that of the shared (Y1, epsilon)."""
    data = null.hypothesis.data
    layout = data.layout
    if len(data.first_in_wind) < 2:
        return []
    scope = Scope(Extent.EACH_TEST, layout.by_test())

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        table[:, :, Term.AERO] *= np.exp(values["size"])
        table[:, :, Term.DRIVE] *= np.exp(values["size"] + values["drive"])

    parameters = (size_prior("size", scope.members), size_prior("drive", scope.members))
    fit = null.with_variants(Variant("tests", parameters, apply, scope))
    shared = null.table
    found = []
    for number, r in data.first_in_wind.items():
        whole = {"record": None, "amplitude": amplitudes_of(data, layout.test == number), "time": None}
        level = shared[r, Term.DRIVE] / (shared[r, Term.AERO] + shared[r, Term.STRUCTURAL])

        def parts(table: FloatArray, r: int = r, level: float = level) -> FloatArray:
            relaxation = table[:, r, Term.AERO] + table[:, r, Term.STRUCTURAL]
            return np.stack([relaxation, -table[:, r, Term.DRIVE] / level], axis=-1)

        own, slopes = fit.slopes(parts, 1e-3)
        values = (own - parts(shared[None])[0]) / layout.omega[r]
        looks = []
        words = ("relaxation (Y1, structural damping)", "drive over the stable amplitude (epsilon)")
        for what, value, slope in zip(words, values, np.ascontiguousarray(slopes.T), strict=True):
            sd = float(np.sqrt(slope @ fit.covariance @ slope)) / layout.omega[r]
            if _beyond(value / sd, 2 * len(data.first_in_wind)):
                looks.append(place(data, r, "test", value, sd, f"damping ratio of the test's own {what}", **whole))
        found += sorted(looks, key=lambda look: -look.significance)[:1]
    return found


def _beyond(z: float, count: int) -> bool:
    return bool(abs(z) > norm.isf(0.5 * CONTRAST_FALSE / count))


def _with_one_each(null: FittedHypothesis, term: Term, size: Parameter) -> FittedHypothesis:
    """Fit one value of a coefficient for every record."""

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        add(table, term, values["size"])

    return null.with_variants(Variant("each", (size,), apply, Scope(Extent.EACH_RECORD, size.members)))
