"""Aerodynamic parameters that change between tests with the reduced velocity."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Effect, Extent, Scope, Size, Values, Variant, added_damping, size_prior
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _position(layout: Layout) -> FloatArray:
    """Place of every record's test between the lowest (-1/2) and the highest (1/2) reduced velocity, 0 in still air."""
    speed = layout.reduced_velocity
    inside = layout.wind
    if not inside.any():
        return np.zeros(len(speed))
    low, high = float(np.min(speed[inside])), float(np.max(speed[inside]))
    if high - low > 1e-3 * high:
        return np.where(inside, (speed - 0.5 * (low + high)) / (high - low), 0.0)
    # equal as stated: by the Scruton number, since the peak moves with it
    sc = np.log(layout.scruton_number)
    low, high = float(np.min(sc[inside])), float(np.max(sc[inside]))
    return np.where(inside, (sc - 0.5 * (low + high)) / max(high - low, 1e-9), 0.0)


def _scale(table: FloatArray, factor: FloatArray, *terms: Term) -> None:
    for term in terms:
        table[:, :, int(term)] *= factor


def _both(table: FloatArray, values: Values, layout: Layout) -> None:
    _scale(table, np.exp(values["size"] * _position(layout)), Term.AERO, Term.DRIVE)


def _drive(table: FloatArray, values: Values, layout: Layout) -> None:
    _scale(table, np.exp(values["size"] * _position(layout)), Term.DRIVE)


def _two(table: FloatArray, values: Values, layout: Layout) -> None:
    _both(table, {"size": values["size"]}, layout)
    _drive(table, {"size": values["epsilon"]}, layout)


def _own_two(table: FloatArray, values: Values, layout: Layout) -> None:
    _own(table, {"size": values["size"]}, layout)
    _scale(table, np.exp(values["epsilon"]), Term.DRIVE)


def _own(table: FloatArray, values: Values, layout: Layout) -> None:
    del layout
    _scale(table, np.exp(values["size"]), Term.AERO, Term.DRIVE)


def _forms(layout: Layout) -> list[Variant]:
    tests = np.unique(layout.test[layout.wind])
    if tests.size < 2:
        return []
    wind, own = Scope(Extent.IN_WIND, layout.in_wind()), Scope(Extent.EACH_TEST, layout.by_test())
    slope = size_prior("size", wind.members, scale=0.5)
    both = (slope, size_prior("epsilon", wind.members, scale=0.3))
    found = [
        Variant("Y1 linear in the reduced velocity", (slope,), _both, wind, 2.0),
        Variant("epsilon linear in the reduced velocity", (slope,), _drive, wind, 1.0),
        Variant("Y1 and epsilon linear in the reduced velocity", both, _two, wind, 2.0),
    ]
    if tests.size > 2:
        each = (size_prior("size", own.members, scale=0.25), size_prior("epsilon", own.members, scale=0.15))
        found.append(Variant("Y1 and epsilon of every test by its own", each, _own_two, own, 0.3))
        found.append(Variant("Y1 of every test by its own", each[:1], _own, own, 1.0))
    return found


EFFECT = Effect(
    "reduced_velocity_drift",
    "Aerodynamic parameters change with the reduced velocity",
    "Y1 and epsilon are functions of the reduced frequency. Where the peaks of the rigs lie at different reduced "
    "velocities, each test has parameters of its own.",
    "Section 4.3 of the Griffin-plot paper; Table 5 there.",
    "Tests differ by one factor in damping and drive alike, in order of U/(f0 D).",
    "amplitude",
    Belongs.WIND,
    (Term.AERO, Term.DRIVE),
    Size("test", "damping ratio at amplitude {at:.3g}", added_damping),
    _forms,
)
