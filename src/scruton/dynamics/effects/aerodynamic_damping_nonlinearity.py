"""Aerodynamic damping beyond the law: parts in A, A^2 and A^4."""

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import DAMPING_RATIO, Effect, Extent, Scope, Values, Variant, add, size_prior
from scruton.dynamics.effects.terms import Belongs, Layout, Term


def _linear(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.AERO_LINEAR, values["size"] * layout.rate / layout.reference_amplitude)


def _square(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.AERO_SQUARE, values["size"] * layout.rate / layout.reference_amplitude**2)


def _quadratic(table: FloatArray, values: Values, layout: Layout) -> None:
    _linear(table, {"size": values["linear"]}, layout)
    _square(table, {"size": values["square"]}, layout)


def _fourth(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.AERO_FOURTH, values["size"] * layout.rate / layout.reference_amplitude**4)


def _forms(layout: Layout) -> list[Variant]:
    if not layout.wind.any():
        return []
    scope = Scope(Extent.IN_WIND, layout.in_wind())
    pair = (size_prior("linear", scope.members), size_prior("square", scope.members))
    size = (size_prior("size", scope.members),)
    return [
        Variant("parts in A and A^2 of the aerodynamic damping", pair, _quadratic, scope, 0.5),
        Variant("a part in A of the aerodynamic damping", size, _linear, scope, 1.0),
        Variant("a part in A^2 of the aerodynamic damping", size, _square, scope, 1.5),
        Variant("a part in A^4 of the aerodynamic damping", size, _fourth, scope, 0.7),
    ]


EFFECT = Effect(
    "aerodynamic_damping_nonlinearity",
    "Aerodynamic damping beyond the law",
    "The self-excited force has a part of higher order in the motion, as in Ehsan and Scanlan's model or in "
    "Larsen's: the aerodynamic damping ratio gains a part proportional to A, A^2 or A^4.",
    "Ehsan and Scanlan (1990); Larsen (1995); Gao and Zhu (2015).",
    "The curve of damping against amplitude bends in wind, alike at all Scruton numbers, and not in still air.",
    "amplitude",
    Belongs.WIND,
    (Term.AERO_LINEAR, Term.AERO_SQUARE, Term.AERO_FOURTH),
    DAMPING_RATIO,
    _forms,
)
