"""Aerodynamic damping beyond the law: parts in A, A^2 and A^4."""

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Effect, Layout, Term, Values, Variant, add, size_prior


def _linear(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.AERO_LINEAR, values["size"] * layout.rate / layout.reference_amplitude)


def _square(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.AERO_SQUARE, values["size"] * layout.rate / layout.reference_amplitude**2)


def _quadratic(table: FloatArray, values: Values, layout: Layout) -> None:
    _linear(table, {"size": values["linear"]}, layout)
    _square(table, {"size": values["square"]}, layout)


def _fourth(table: FloatArray, values: Values, layout: Layout) -> None:
    add(table, Term.AERO_FOURTH, values["size"] * layout.rate / layout.reference_amplitude**4)


def _variants(layout: Layout) -> tuple[Variant, ...]:
    if not layout.wind.any():
        return ()
    members = layout.in_wind()
    both = Variant(
        "parts in A and A^2 of the aerodynamic damping", (size_prior("linear", members), size_prior("square", members)),
        _quadratic, members >= 0, 0.5,
    )  # fmt: skip
    return both, *(
        Variant(
            f"a part in {form} of the aerodynamic damping", (size_prior("size", members),), apply, members >= 0, weight
        )
        for form, apply, weight in (("A", _linear, 1.0), ("A^2", _square, 1.5), ("A^4", _fourth, 0.7))
    )


EFFECT = Effect(
    "aerodynamic_damping_nonlinearity",
    "Aerodynamic damping beyond the law",
    "The self-excited force has a part of higher order in the motion, as in Ehsan and Scanlan's model or in "
    "Larsen's: the "
    "aerodynamic damping ratio gains a part proportional to A, A^2 or A^4.",
    "Ehsan and Scanlan (1990); Larsen (1995); Gao and Zhu (2015).",
    "The curve of damping against amplitude bends in wind, alike at all Scruton numbers, and not in still air.",
    "amplitude",
    _variants,
)
