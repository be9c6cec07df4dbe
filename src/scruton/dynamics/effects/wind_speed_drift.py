"""A wind that changes while the record runs."""

from collections.abc import Callable

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, IntArray, Layout, Term, Values, Variant, add, size_prior


def _drift(term: Term, *, from_start: bool) -> Callable[[FloatArray, Values, Layout], None]:
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


_OWN = "in every record by its own"
_NEAR_A_JUMP = "S-shaped drift from the stated speed"
_FORMS = (
    ("linear drift", _drift(Term.TREND, from_start=False)),
    ("S-shaped drift", _drift(Term.TREND_SINE, from_start=False)),
    ("linear drift from the stated speed", _drift(Term.TREND, from_start=True)),
    (_NEAR_A_JUMP, _drift(Term.TREND_SINE, from_start=True)),
)


def _two(table: FloatArray, values: Values, layout: Layout) -> None:
    del layout
    add(table, Term.TREND, values["size"])
    add(table, Term.TREND_DRIVE, values["drive"])


def _variants(layout: Layout) -> tuple[Variant, ...]:
    if not layout.wind.any():
        return ()
    scopes: list[tuple[str, IntArray, float]] = [("the same in every record in wind", layout.in_wind(), 2.0)]
    tests = np.unique(layout.test[layout.wind])
    records = np.flatnonzero(layout.wind)
    if tests.size > 1:
        scopes += [(f"in one test#{i}", layout.only(layout.test == i), 0.7 / tests.size) for i in tests]
        scopes += [
            (f"in every record of one test#{i}", layout.each(layout.test == i), 0.7 / tests.size)
            for i in tests
            if np.count_nonzero(layout.test == i) > 1
        ]
    if records.size > 1:
        scopes.append((_OWN, layout.each(layout.wind), 1.0))
        names = np.arange(len(layout.records))
        scopes += [(f"in one record#{i}", layout.only(names == i), 1.0 / records.size) for i in records]
    both = [
        Variant(
            f"linear drift, the drive's part its own, {where}",
            (size_prior("size", members), size_prior("drive", members)), _two, members >= 0, 0.5 * weight,
        )
        for where, members, weight in scopes
    ]  # fmt: skip
    return (*both, *_alike(scopes))


def _alike(scopes: list[tuple[str, IntArray, float]]) -> tuple[Variant, ...]:
    return tuple(
        Variant(f"{form}, {where}", (size_prior("size", members),), apply, members >= 0, weight)
        for form, apply in _FORMS
        for where, members, weight in scopes
        # An S and a mean of its own for every record come too near to a jump in each.
        if not (form == _NEAR_A_JUMP and where == _OWN)
    )


EFFECT = Effect(
    "wind_speed_drift",
    "The wind changes during the record",
    "The wind speed, or the temperature, drifts while a record runs: the aerodynamic damping goes with U and the drive "
    "with U^2, so that the amplitude follows.",
    "Any log of a wind tunnel that was started a minute ago.",
    "Damping at the same amplitude changes with time; the end of the record is not steady. Frequency hardly moves.",
    "amplitude",
    _variants,
)
