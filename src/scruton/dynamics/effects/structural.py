"""What the rig does to the damping: dry friction, damping that varies with amplitude, a statement that is off."""

from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    DAMPING,
    DAMPING_RATIO,
    FACTOR,
    REFERENCE,
    Apply,
    Effect,
    Extent,
    Parameter,
    Scope,
    Values,
    Variant,
    add,
    adding,
    scopes,
    sized,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term

_WIDTH = 0.003  # of the reference amplitude: below it friction sticks and acts like a spring
_ALIKE = "in every rig alike"
_LARGER = 0.5  # prior odds that what is stated is the damping of a larger amplitude, over that of the smallest
OF_LARGEST = "of the rig's largest amplitude"
_STEEPEST = 0.8  # power of the speed of a force that is dry friction: a damping that rises with the amplitude is none
_NEVER = 1e9  # of the reference amplitude: where what goes as a power of the amplitude levels off
_LEVELS = Term.STRUCTURAL_RISE, Term.STRUCTURAL_KNEE, Term.STRUCTURAL_POWER


def _rub(table: FloatArray, values: Values, layout: Layout) -> None:
    # Of one force over the mass: 2 F/(pi omega) is what it takes from the amplitude in unit time.
    rate = layout.reference_rate * layout.reference_omega / layout.omega
    width, power = values.get("width", _WIDTH), np.minimum(values.get("power", 0.0), _STEEPEST)
    add(table, Term.FRICTION, values["size"] * rate * layout.reference_amplitude ** (1.0 - power))
    table[:, :, Term.FRICTION_POWER] = np.where(values["size"] != 0.0, power, 0.0)
    if "hump" in values:
        table[:, :, Term.FRICTION_HUMP] = np.where(values["size"] != 0.0, values["hump"], 0.0)
        place = values["place"] * layout.reference_amplitude
        table[:, :, Term.FRICTION_HUMP_AT] = np.where(values["size"] != 0.0, place, 0.0)
    table[:, :, Term.FRICTION_WIDTH] = np.where(values["size"] != 0.0, width * layout.reference_amplitude, 0.0)


def _stick(table: FloatArray, values: Values, layout: Layout) -> None:
    _rub(table, values, layout)
    add(table, Term.FRICTION_SPRING, 0.5 * np.pi * table[:, :, Term.FRICTION] / layout.omega)


def _friction(layout: Layout) -> list[Variant]:
    sudden = {
        Extent.EVERYWHERE: (2.0, _ALIKE),
        Extent.ONE_RIG: (2.0, "in one rig"),
        Extent.EACH_RIG: (1.0, "in every rig, each its own"),
        Extent.ALL_RIGS_BUT_ONE: (1.0, "in all rigs but one"),
    }
    variants = [sized("{scope}", _rub, scope, positive=True) for scope in scopes(layout, sudden)]
    slow = {Extent.EVERYWHERE: (0.5, "in every rig"), Extent.ONE_RIG: (0.5, "in one rig")}
    alone = layout.wind.all()  # where nothing tells friction from what the air does it has few forms of its own
    own = {} if alone else {Extent.EACH_RIG: (0.3, "in every rig, each its own")}
    presliding = slow | {Extent.ALL_RIGS_BUT_ONE: (0.5, "in all rigs but one")} | own
    centre = float(np.log(0.05))
    # Below its width it acts like oil, or, as Dahl's, like a spring, which the frequency shows.
    forms = (("smooth where it is slow, {scope}", _rub, slow | own), ("with presliding, {scope}", _stick, presliding))
    for form, apply, shares in forms:
        for scope in scopes(layout, shares):
            shared = layout.only(scope.records)
            width = Parameter("width", centre, 1.0, shared, log=True, unit=REFERENCE, starts=(centre,))
            friction = sized(form, apply, scope, positive=True)
            variants.append(replace(friction, parameters=(*friction.parameters, width)))
    if alone:
        return variants
    # With the speed the force goes as a power of it, or is the less (Stribeck).
    plain = [one for one in variants if one.scope.extent in slow and (one.apply is _stick or len(one.parameters) == 1)]
    for one in plain:
        members = one.scope.members
        power = Parameter("power", 0.0, 0.35, members, unit="power", starts=(-0.25, 0.25))
        hump = Parameter("hump", float(np.log(0.4)), 0.7, members, log=True, unit=FACTOR, starts=(float(np.log(0.4)),))
        falls = tuple(float(np.log(x)) for x in (0.1, 0.4))
        place = Parameter("place", falls[1], 1.0, members, log=True, unit=REFERENCE, starts=falls)
        variants += [
            replace(
                one,
                form=f"{one.form}, {words}",
                parameters=(*one.parameters, *more),
                weight=0.3 * one.weight,
                refines=one.form,
            )
            for words, more in (("with a power of the speed", (power,)), ("less at speed", (hump, place)))
        ]
    return variants


def _rising(
    table: FloatArray, layout: Layout, rise: FloatArray, knee: FloatArray | float, power: FloatArray | float
) -> None:
    """Damping that rises as a power of the amplitude to a knee, in parts of the reference amplitude."""
    add(table, Term.STRUCTURAL_RISE, rise * layout.rate)
    table[:, :, Term.STRUCTURAL_KNEE] = np.where(rise != 0.0, knee * layout.reference_amplitude, 0.0)
    table[:, :, Term.STRUCTURAL_POWER] = np.where(rise != 0.0, power, 0.0)


def _level_off(power: int, *, falls: bool = False) -> Apply:
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        size = values["size"]
        _rising(table, layout, -size if falls else size, values["knee"], power)
        if falls:
            add(table, Term.STRUCTURAL, size * layout.rate)

    return apply


def _as_power(table: FloatArray, values: Values, layout: Layout) -> None:
    power = values["power"]
    _rising(table, layout, values["size"] * _NEVER**power, _NEVER, power)


def _rate(table: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Structural damping rate [1/s] of tables (W, R, COLUMNS) at amplitudes (W, R), without friction."""
    rise, knee, power = (table[:, :, term] for term in _LEVELS)
    x = amplitude / np.where(knee > 0.0, knee, np.inf)
    part = np.where(power > 0.0, x**power / (1.0 + x**power), -np.expm1(-x))
    linear, square = table[:, :, Term.STRUCTURAL_LINEAR], table[:, :, Term.STRUCTURAL_SQUARE]
    return np.asarray(table[:, :, Term.STRUCTURAL] + (linear + square * amplitude) * amplitude + rise * part)


def _stated_at(apply: Apply) -> Apply:
    """The same where what is stated is the damping of a larger amplitude: a mean over a decay, or that of a test."""

    def moved(table: FloatArray, values: Values, layout: Layout) -> None:
        at = values["stated"] * layout.largest_of_rig
        before = _rate(table, at)
        apply(table, values, layout)
        add(table, Term.STRUCTURAL, before - _rate(table, at))

    return moved


def _with_amplitude(layout: Layout) -> list[Variant]:
    shares = {
        Extent.EVERYWHERE: (2.0, _ALIKE),
        Extent.EACH_RIG: (1.0, "in every rig, each its own"),
        Extent.ONE_RIG: (1.0, "in one rig"),
    }
    variants = [
        sized(f"as {power}, {{scope}}", adding(size=term), scope)
        for power, term in (("A", Term.STRUCTURAL_LINEAR), ("A^2", Term.STRUCTURAL_SQUARE))
        for scope in scopes(layout, shares)
    ]
    both = adding(linear=Term.STRUCTURAL_LINEAR, square=Term.STRUCTURAL_SQUARE)
    (everywhere,) = scopes(layout, {Extent.EVERYWHERE: (0.7, _ALIKE)})
    # What falls as the amplitude grows is what dry friction does, but for what falls over amplitudes such as these.
    rises = tuple(float(np.log(size)) for size in (0.2, 0.5))
    levels = Parameter("size", rises[0], 0.8, everywhere.members, log=True, unit=DAMPING, starts=rises)
    knee = Parameter("knee", 0.0, 0.7, everywhere.members, log=True, unit=REFERENCE, starts=(0.0, float(np.log(0.4))))
    forms = {
        "as A, levelling off": _level_off(1),
        "as A^2, levelling off": _level_off(2),
        "falling to nothing": _level_off(0, falls=True),
    }
    variants += [Variant(f"{form}, {{scope}}", (levels, knee), apply, everywhere, 0.2) for form, apply in forms.items()]
    powers = tuple(float(np.log(power)) for power in (0.5, 1.5))
    power = Parameter("power", 0.0, 0.5, everywhere.members, log=True, unit="power", starts=powers)
    variants.append(Variant("as a power of A, {scope}", (levels, power), _as_power, everywhere, 0.2))
    variants.append(sized("as A and A^2, {scope}", both, everywhere, "linear", "square"))
    if layout.wind.all() or len(layout.unstated) == np.unique(layout.rig).size:
        return variants
    centre = float(np.log(0.5))
    stated = Parameter("stated", centre, 0.7, everywhere.members, log=True, unit=OF_LARGEST, starts=(centre,))
    return variants + [
        replace(
            one,
            form=f"{one.form}, stated at a larger amplitude",
            parameters=(*one.parameters, stated),
            apply=_stated_at(one.apply),
            weight=_LARGER * one.weight,
        )
        for one in variants
        if one.scope.extent is Extent.EVERYWHERE
    ]


def _misstated(layout: Layout) -> list[Variant]:
    one_rig = (2.0, "of one rig")
    shares = {
        Extent.ONE_RIG: one_rig,
        Extent.EVERYWHERE: (1.0, "of all rigs alike"),
        Extent.EACH_RIG: (1.0, "of every rig by its own"),
    }
    stated = scopes(layout, shares)
    if np.unique(layout.rig).size == 1:
        stated = [Scope(Extent.ONE_RIG, layout.everywhere(), one_rig[1], int(layout.rig[0]), one_rig[0])]
    told = ~np.isin(layout.rig, list(layout.unstated))
    choices = [("stated damping {scope}", scope) for scope in stated if told[scope.records].all()]
    if layout.wind.any() and not layout.wind.all():
        in_wind = scopes(layout, {Extent.ONE_RIG_IN_WIND: (0.1, "of one rig")})
        choices += [("in wind other than in still air, {scope}", scope) for scope in in_wind]
    return [sized(form, adding(size=Term.STRUCTURAL), scope) for form, scope in choices]


EFFECTS = (
    Effect(
        "coulomb_friction",
        "Dry friction",
        "amplitude",
        Belongs.RIG,
        (
            Term.FRICTION,
            Term.FRICTION_WIDTH,
            Term.FRICTION_SPRING,
            Term.FRICTION_POWER,
            Term.FRICTION_HUMP,
            Term.FRICTION_HUMP_AT,
        ),
        DAMPING_RATIO,
        _friction,
    ),
    Effect(
        "structural_damping_nonlinearity",
        "Structural damping that varies with amplitude",
        "amplitude",
        Belongs.RIG,
        (Term.STRUCTURAL, Term.STRUCTURAL_LINEAR, Term.STRUCTURAL_SQUARE, *_LEVELS),
        DAMPING_RATIO,
        _with_amplitude,
    ),
    Effect(
        "structural_damping_error",
        "Stated structural damping wrong",
        "amplitude",
        Belongs.RIG,
        (Term.STRUCTURAL,),
        DAMPING_RATIO,
        _misstated,
    ),
)
