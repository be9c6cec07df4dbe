"""A wind that changes while the record runs."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    Apply,
    Effect,
    Extent,
    Size,
    Station,
    Values,
    Variant,
    add,
    scopes,
    size_prior,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _drift(term: Term, *, from_start: bool) -> Apply:
    """A drift about the mean of the record, or one that begins at the stated speed: then the mean is off, too."""

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        del layout
        size = values["size"]
        mean = np.maximum(1.0 + 0.5 * size, 0.2) if from_start else np.ones_like(size)
        # Eq. 10: the aerodynamic damping goes with U, the drive with U^2.
        table[:, :, Term.AERO] *= mean
        table[:, :, Term.DRIVE] *= mean**2
        add(table, term, size / mean)

    return apply


def _two(table: FloatArray, values: Values, layout: Layout) -> None:
    del layout
    add(table, Term.TREND, values["size"])
    add(table, Term.TREND_DRIVE, values["drive"])


def _read(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    rise = rows[:, Term.TREND] + rows[:, Term.TREND_SINE]
    return np.asarray(-rise * (2.0 * rows[:, Term.DRIVE] / station.amplitude - rows[:, Term.AERO]) / station.omega)


def _forms(layout: Layout) -> list[Variant]:
    if not layout.wind.any():
        return []
    shares = {
        Extent.IN_WIND: (2.0, "the same in every record in wind"),
        Extent.ONE_TEST: (0.7, "in one test"),
        Extent.EACH_RECORD_OF_ONE_TEST: (0.7, "in every record of one test"),
        Extent.EACH_RECORD: (1.0, "in every record by its own"),
        Extent.ONE_RECORD: (1.0, "in one record"),
    }
    every = scopes(layout, shares, wind=True)
    # An S and a mean of its own for every record come too near to a jump in each.
    shared = [scope for scope in every if scope.extent is not Extent.EACH_RECORD]
    both = [
        Variant("linear drift, the drive's part its own, {scope}",
                (size_prior("size", scope.members), size_prior("drive", scope.members)), _two, scope,
                0.5 * scope.weight)
        for scope in every
    ]  # fmt: skip
    alike = [
        Variant(f"{form}, {{scope}}", (size_prior("size", scope.members),), apply, scope, scope.weight)
        for form, apply, places in (
            ("linear drift", _drift(Term.TREND, from_start=False), every),
            ("S-shaped drift", _drift(Term.TREND_SINE, from_start=False), every),
            ("linear drift from the stated speed", _drift(Term.TREND, from_start=True), every),
            ("S-shaped drift from the stated speed", _drift(Term.TREND_SINE, from_start=True), shared),
        )
        for scope in places
    ]
    return both + alike


EFFECT = Effect(
    "wind_speed_drift",
    "The wind changes during the record",
    "The wind speed, or the temperature, drifts while a record runs: the aerodynamic damping goes with U and the drive "
    "with U^2, so that the amplitude follows.",
    "Any log of a wind tunnel that was started a minute ago.",
    "Damping at the same amplitude changes with time; the end of the record is not steady. Frequency hardly moves.",
    "amplitude",
    Belongs.RUN,
    (Term.TREND, Term.TREND_SINE, Term.TREND_DRIVE, Term.AERO, Term.DRIVE),
    Size("damping", "damping ratio at amplitude {at:.3g}, end of the record over its start", _read),
    _forms,
)
