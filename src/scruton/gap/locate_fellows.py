"""Places that one record shows only beside others: damping off its statement, drifts, gains, tests that differ."""

from collections.abc import Callable

import numpy as np
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Layout, Parameter, Term, Values, Variant, add, size_prior
from scruton.gap.finding import Z90, Finding, amplitudes_of, interval, names_of, time_of
from scruton.gap.hypothesis import Weighed

_FALSE = 0.03  # probability that any member of a campaign without a gap shows one kind


def still_air_findings(bare: Weighed) -> list[Finding]:
    """Rigs whose damping is not what is stated, as the records tell it without that statement."""
    data = bare.hypothesis.bare.data
    value, sd = bare.value("damping")
    found = []
    for i, (m, s) in enumerate(zip(value, sd, strict=True)):
        mine = data.layout.rig == i
        stated = data.damping[i] if i < data.damping.size else np.nan
        if not np.isfinite(stated) or not np.any(mine & ~data.layout.wind):
            continue
        prior = float(data.damping_sd[i])
        share = 1.0 - (s / prior) ** 2
        if share < 0.1:
            continue
        told, variance = m / share, s**2 / share + prior**2
        z = abs(told) / np.sqrt(variance)
        if z > norm.isf(0.5 * _FALSE / value.size):
            excess = float(stated * told)
            found.append(
                Finding(
                    "damping", data.rigs[i], None, None, amplitudes_of(data, mine & ~data.layout.wind), None, excess,
                    interval(excess, float(stated * np.sqrt(variance))), float(z), "damping ratio, over the stated one",
                )
            )  # fmt: skip
    return found


def drift_findings(bare: Weighed) -> list[Finding]:
    """Damping that changes while a record runs: a wind that rises or falls, told record by record."""
    data = bare.hypothesis.bare.data
    layout = data.layout

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        add(table, Term.TREND, values["size"])

    parameter = size_prior("size", layout.each(layout.wind))
    fit, value, sd = _each(bare, parameter, apply)
    table = fit.hypothesis.table(fit.mode[None])[0]
    # the slope of the damping at the stable amplitude, in the relative change of the wind
    slope = -(table[:, Term.AERO] + 2.0 * table[:, Term.STRUCTURAL]) / layout.omega
    found = []
    for j, r in enumerate(np.flatnonzero(layout.wind)):
        if not _beyond(value[j] / sd[j], value.size):
            continue
        rig, test, record = names_of(data, int(r))
        low, high = sorted((value[j] - Z90 * sd[j], value[j] + Z90 * sd[j]), key=lambda x: slope[r] * x)
        found.append(
            Finding(
                "damping", rig, test, record, amplitudes_of(data, np.arange(len(layout.records)) == r),
                time_of(data, int(r)), float(slope[r] * value[j]), (float(slope[r] * low), float(slope[r] * high)),
                float(abs(value[j]) / sd[j]), f"damping ratio, end of the record over its start: wind {value[j]:+.1%}",
            )
        )  # fmt: skip
    return found


def gain_findings(bare: Weighed) -> list[Finding]:
    """Records whose reading is larger or smaller than that of their fellows by a factor."""
    data = bare.hypothesis.bare.data
    layout = data.layout
    records = np.flatnonzero(layout.wind)
    if records.size < 3:
        return []

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        add(table, Term.GAIN, values["size"])

    parameter = size_prior("size", layout.each(layout.wind), scale=0.2)
    fit, value, _ = _each(bare, parameter, apply)
    where = fit.hypothesis.places[_size(fit, parameter)]
    contrast = np.eye(records.size) - 1.0 / records.size
    sd = np.sqrt(np.diag(contrast @ fit.covariance[where, where] @ contrast.T))
    value = value - np.median(value)
    found = []
    for j, r in enumerate(records):
        if not _beyond(value[j] / sd[j], value.size):
            continue
        rig, test, record = names_of(data, int(r))
        found.append(
            Finding(
                "signal", rig, test, record, amplitudes_of(data, np.arange(len(layout.records)) == r),
                time_of(data, int(r)), float(value[j]), interval(value[j], sd[j]), float(abs(value[j]) / sd[j]),
                "gain over that of its fellows, minus 1",
            )
        )  # fmt: skip
    return found


def between_tests(bare: Weighed) -> list[Finding]:
    """Tests whose aerodynamic damping or drive is not that of the shared (Y1, epsilon)."""
    data = bare.hypothesis.bare.data
    layout = data.layout
    numbers = np.unique(layout.test[layout.wind])
    if numbers.size < 2:
        return []
    members = layout.by_test()

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        table[:, :, Term.AERO] *= np.exp(values["size"])
        table[:, :, Term.DRIVE] *= np.exp(values["size"] + values["drive"])

    parameters = (size_prior("size", members), size_prior("drive", members))
    variant = Variant("tests", parameters, apply, layout.wind)
    hypothesis = bare.hypothesis.extended(variant)
    fit = hypothesis.fit(hypothesis.start_from(bare.mode, {}))
    step = 1e-3 * np.sqrt(np.diag(fit.covariance))
    wide = hypothesis.table(np.concatenate([fit.mode[None], fit.mode + np.diag(step), fit.mode - np.diag(step)]))
    alone = bare.hypothesis.table(bare.mode[None])[0]
    found = []
    for number in numbers:
        mine = layout.test == number
        r = int(np.flatnonzero(mine)[0])
        level = alone[r, Term.DRIVE] / (alone[r, Term.AERO] + alone[r, Term.STRUCTURAL])
        best: Finding | None = None
        for what, sums in (
            ("relaxation (Y1, structural damping)", wide[:, r, Term.AERO] + wide[:, r, Term.STRUCTURAL]),
            ("drive over the stable amplitude (epsilon)", -wide[:, r, Term.DRIVE] / level),
        ):
            then = alone[r, Term.AERO] + alone[r, Term.STRUCTURAL]
            then = then if what.startswith("relaxation") else -alone[r, Term.DRIVE] / level
            rows = (sums[1 : step.size + 1] - sums[step.size + 1 :]) / (2.0 * step)
            value = float(sums[0] - then) / layout.omega[r]
            sd = float(np.sqrt(rows @ fit.covariance @ rows)) / layout.omega[r]
            rig, test, _ = names_of(data, r)
            z = abs(value) / sd
            if _beyond(z, 2 * numbers.size) and (best is None or z > best.significance):
                best = Finding(
                    "test", rig, test, None, amplitudes_of(data, mine), None, value, interval(value, sd), z,
                    f"damping ratio of the test's own {what}",
                )  # fmt: skip
        found += [best] if best else []
    return found


def _beyond(z: float, count: int) -> bool:
    return bool(abs(z) > norm.isf(0.5 * _FALSE / count))


def _size(fit: Weighed, parameter: Parameter) -> str:
    return f"{len(fit.hypothesis.variants) - 1}:{parameter.name}"


def _each(
    bare: Weighed, parameter: Parameter, apply: Callable[[FloatArray, Values, Layout], None]
) -> tuple[Weighed, FloatArray, FloatArray]:
    """Fit one value for every record; its values and their standard errors."""
    hypothesis = bare.hypothesis.extended(Variant("each", (parameter,), apply, parameter.members >= 0))
    fit = hypothesis.fit(hypothesis.start_from(bare.mode, {}))
    return fit, *fit.value(_size(fit, parameter))
