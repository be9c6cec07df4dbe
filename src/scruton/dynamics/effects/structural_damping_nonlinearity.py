"""Structural damping that varies with amplitude, in still air as in wind."""

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import DAMPING_RATIO, Effect, Extent, Values, Variant, add, scopes, size_prior
from scruton.dynamics.effects.terms import Belongs, Layout, Term

_ALIKE = "in every rig alike"


def _linear(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STRUCTURAL_LINEAR, values["size"] * layout.rate / layout.reference_amplitude)


def _square(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.STRUCTURAL_SQUARE, values["size"] * layout.rate / layout.reference_amplitude**2)


def _quadratic(table: FloatArray, values: Values, layout: Layout) -> None:
    _linear(table, {"size": values["linear"]}, layout)
    _square(table, {"size": values["square"]}, layout)


def _forms(layout: Layout) -> list[Variant]:
    shares = {
        Extent.EVERYWHERE: (2.0, _ALIKE),
        Extent.EACH_RIG: (1.0, "in every rig, each its own"),
        Extent.ONE_RIG: (1.0, "in one rig"),
    }
    found = [
        Variant(f"as {power}, {{scope}}", (size_prior("size", scope.members),), apply, scope, scope.weight)
        for power, apply in (("A", _linear), ("A^2", _square))
        for scope in scopes(layout, shares)
    ]
    (everywhere,) = scopes(layout, {Extent.EVERYWHERE: (0.7, _ALIKE)})
    pair = tuple(size_prior(name, everywhere.members) for name in ("linear", "square"))
    return [*found, Variant("as A and A^2, {scope}", pair, _quadratic, everywhere, everywhere.weight)]


EFFECT = Effect(
    "structural_damping_nonlinearity",
    "Structural damping that varies with amplitude",
    "Springs, clamps and air drag of the arms dissipate more (or less) at large amplitude: a damping ratio that has a "
    "part proportional to A (quadratic drag) or to A^2.",
    "Nayfeh and Mook, Nonlinear Oscillations, section 3.3 (averaged quadratic and cubic damping).",
    "The same curve of damping against amplitude in still air and in wind, in growth and in decay.",
    "amplitude",
    Belongs.RIG,
    (Term.STRUCTURAL_LINEAR, Term.STRUCTURAL_SQUARE),
    DAMPING_RATIO,
    _forms,
)
