"""What the section and the wind do beyond the law: parts of higher order, coherence, what the reduced velocity does."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    DAMPING_RATIO,
    DRIVE,
    FACTOR,
    POWERS,
    REFERENCE,
    Effect,
    Extent,
    Parameter,
    Scope,
    Size,
    Values,
    Variant,
    add,
    added_damping,
    adding,
    in_wind,
    scopes,
    size_prior,
    sized,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term, compact

_NO_POWER = 1e-3  # exponent of a law, below which it is that of the logarithm to a thousandth
SAME_SPEED = 5e-3  # relative: wind speeds are known no better, and reduced velocities that differ by less are one


def _incoherent(table: FloatArray, values: Values, layout: Layout, power: float = 0.0) -> None:
    lost = values["amplitude"] * layout.reference_amplitude
    held = values.get("held", 0.0)
    floor = held / (1.0 + held)
    table[:, :, Term.COHERENCE] = lost
    table[:, :, Term.COHERENCE_POWER] = np.where(lost > 0.0, power, 0.0)
    table[:, :, Term.COHERENCE_FLOOR] = np.where(lost > 0.0, floor, 0.0)
    # Less of the drive is left, and the amplitude relaxes more slowly: gusts and set-points stay those of the stable
    # amplitude, or a drive that is lost throughout would let them grow to what comes and goes.
    x = np.clip(layout.reference_amplitude / np.where(lost > 0.0, lost, np.inf), 1e-9, 700.0)
    if power:
        most = 1.0 + x**power
        kept, turned = x * most ** (-1.0 / power), x * most ** (-1.0 / power - 1.0)
    else:
        kept, turned = -np.expm1(-x), x * np.exp(-x)
    left = np.where(lost > 0.0, floor + (1.0 - floor) * (kept - turned), 1.0)
    if "held" in values:  # what is left of the drive at the reference amplitude is what it is without
        whole = np.where(lost > 0.0, floor + (1.0 - floor) * kept, 1.0)
        table[:, :, Term.DRIVE] /= whole
        left /= whole
    for term in (Term.GUST, Term.SET_POINT):
        table[:, :, term] *= left


# One for each form, so that what two effects have in common is seen to be one.
_SATURATES = {power: partial(_incoherent, power=power) for power in (0.0, 1.0, 2.0, 3.0)}


def _critical(scope: Scope, usual: float, *starts: float) -> Parameter:
    """A_c of a drive that saturates as 1 - exp(-A/A_c): what is usual of it, and where its search begins."""
    return Parameter(
        "amplitude", float(np.log(usual)), 1.0, scope.members, log=True, unit=REFERENCE,
        starts=tuple(float(np.log(x)) for x in starts),
    )  # fmt: skip


def _saturating(layout: Layout, form: str, weight: float = 1.0, *, power: float = 0.0, floor: bool = False) -> Variant:
    scope = in_wind(layout)
    parameters: tuple[Parameter, ...] = (_critical(scope, 0.2, 0.04, 0.12, 0.4),)
    if floor:
        usual, more = float(np.log(0.7)), float(np.log(3.0))
        held = Parameter(
            "held", usual, 0.8, scope.members, log=True, unit="of what is lost at rest", starts=(more, usual)
        )
        parameters = (_critical(scope, 0.4, 0.4, 0.12, 1.0), held)
    return Variant(form, parameters, _SATURATES[power], scope, weight, read_at=0.5 if floor else 1.0)


def _bent_and_saturating(layout: Layout, weight: float) -> Variant:
    """A drive that falls with the amplitude more than as its inverse, and less at small ones: whatever smooth law."""
    scope, bend = in_wind(layout), adding(size=Term.AERO_SQUARE)

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        _incoherent(table, values, layout)
        bend(table, values, layout)

    form = "a part in A^2 of the aerodynamic damping, and a drive that saturates as 1 - exp(-A/A_c)"
    parameters = size_prior("size", scope.members), _critical(scope, 0.4, 0.12, 0.4, 1.2)
    return Variant(form, parameters, apply, scope, weight, size="amplitude")


def _moved(table: FloatArray, values: Values, n: FloatArray | float, a0: float) -> FloatArray:
    """Take a share of the drive, put growth of the law n in proportion to the amplitude in its place, and return it."""
    moved = values["share"] * table[:, :, Term.DRIVE]
    add(table, Term.DRIVE, -moved)
    add(table, Term.AERO, -(1.0 + 1.0 / n) * moved / a0)
    return np.asarray(moved)


def _of_any_law(layout: Layout, weight: float) -> Variant:
    """The same of any exponent n: a share w of the drive c becomes c ((1 + 1/n) x - x^(n + 1)/n).

    At n = -1 that is the drive itself.
    """
    scope, a0 = in_wind(layout), layout.reference_amplitude

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        n = values["exponent"]
        n = np.where(np.abs(n) < _NO_POWER, _NO_POWER, n)
        moved = _moved(table, values, n, a0)
        add(table, Term.LAW_POWER, -moved / (n * a0 ** (n + 1.0)))
        table[:, :, Term.LAW_EXPONENT] = np.where(moved != 0.0, n, 0.0)

    form = "in the place of the drive, growth that any power of the amplitude ends"
    share = size_prior("share", scope.members, scale=0.6, unit=DRIVE)
    exponent = Parameter("exponent", 0.3, 0.7, scope.members, unit="power", starts=(-0.5, 0.5, 1.5))
    return Variant(form, (share, exponent), apply, scope, weight, read_at=0.5)


def _of_another_law(layout: Layout, power: Term, weight: float) -> Variant:
    """Growth in proportion to the amplitude that a power of it ends, as in Ehsan and Scanlan's law, not the paper's.

    A share w of the drive c becomes c ((1 + 1/p) x - x^(p + 1)/p) with x = a/a0: at the reference amplitude a0 that is
    c, and what relaxes there does so as fast as under the paper's law.
    """
    scope, p, a0 = in_wind(layout), POWERS[power], layout.reference_amplitude

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        moved = _moved(table, values, p, a0)
        add(table, power, moved / (p * a0 ** (p + 1)))

    form = f"in the place of the drive, growth in proportion to the amplitude that a part in A^{p} ends"
    share = size_prior("share", scope.members, scale=0.6, unit=DRIVE)
    return Variant(form, (share,), apply, scope, weight, read_at=0.5)


def _coherence(layout: Layout) -> list[Variant]:
    soon = "drive saturates as 1 - exp(-A/A_c)"
    return [
        _saturating(layout, soon),
        *(_saturating(layout, f"drive saturates as x/(1 + x^{p})^(1/{p})", 0.4, power=p) for p in (1, 2, 3)),
        # Of a span whose parts agree over some length even at rest.
        _saturating(layout, f"{soon}, but for a part", 0.4, floor=True),
        _saturating(layout, "drive saturates as x/(1 + x), but for a part", 0.4, power=1, floor=True),
    ]


def _of_higher_order(layout: Layout) -> list[Variant]:
    linear, square, fourth, scope = Term.AERO_LINEAR, Term.AERO_SQUARE, Term.AERO_FOURTH, in_wind(layout)
    both = adding(linear=linear, square=square)
    return [
        sized("parts in A and A^2 of the aerodynamic damping", both, scope, "linear", "square", weight=0.5),
        sized("a part in A of the aerodynamic damping", adding(size=linear), scope),
        sized("a part in A^2 of the aerodynamic damping", adding(size=square), scope, weight=1.5),
        sized("a part in A^4 of the aerodynamic damping", adding(size=fourth), scope, weight=0.7),
        # A force that saturates by itself, or a wake that falls out of step at small amplitude, drives as a span does
        # whose parts no longer agree.
        *(replace(one, form=f"by itself the {one.form}", weight=0.4 * one.weight) for one in _coherence(layout)),
        *(_of_another_law(layout, power, 0.5) for power in (linear, square, fourth)),
        _bent_and_saturating(layout, 0.3),
        _of_any_law(layout, 0.5),
    ]


_BOTH, _DRIVE = (Term.AERO, Term.DRIVE), (Term.DRIVE,)  # what goes with Y1, and with epsilon
Place = Callable[[Layout], FloatArray]
Terms = tuple[Term, ...]


def _between_ends(values: FloatArray, inside: np.ndarray) -> FloatArray:
    """Place of every record in wind between the lowest (-1/2) and the highest (1/2) value; 0 in still air."""
    low, high = float(np.min(values[inside])), float(np.max(values[inside]))
    return np.where(inside, (values - 0.5 * (low + high)) / max(high - low, 1e-9), 0.0)


def _speed(layout: Layout) -> FloatArray:
    return _between_ends(layout.reduced_velocity, layout.wind)


# Prior standard deviations of ln(factor): of every test by its own, along the place of the tests, and of what bends
# that line: as much as tells a straight change of Y1 from a straight change of ln(Y1), and no more.  Of more than three
# tests it may bend freely, and level off at its ends, by a part of what it rises: these have an order all the same.
_OWN = {"size": 0.25, "epsilon": 0.15}
_ALONG = {"size": 0.5, "epsilon": 0.3, "bend": 0.2, "epsilon_bend": 0.1}
_FREELY = _ALONG | {"bend": 0.8, "epsilon_bend": 0.5, "levels": 0.08}


def _scaled(
    form: str, scope: Scope, weight: float, *, place: Place | None = None, scales: Mapping[str, float] = _OWN,
    **parts: Terms,
) -> Variant:  # fmt: skip
    """Coefficients times exp(parameter): of every test by its own, or times its place, or what bends that line."""

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        along = place(layout) if place else np.ones(1)
        # Legendre's polynomials between the ends, that of the second order halved and raised
        bent = np.where(layout.wind, 2.0 * along**2 - 0.25, 0.0)
        straight = along + values["levels"] * (20.0 * along**3 - 3.0 * along) if "levels" in scales else along
        for name, terms in parts.items():
            factor = np.exp(values[name] * (bent if "bend" in name else straight))
            for term in terms:
                table[:, :, int(term)] *= factor

    names = (*parts, "levels") if "levels" in scales else (*parts,)
    priors = (size_prior(name, scope.members, scale=scales[name], unit=FACTOR) for name in names)
    return Variant(form, tuple(priors), apply, scope, weight)


def _along_speed(layout: Layout) -> list[Variant]:
    wind, speed = in_wind(layout), layout.reduced_velocity[layout.wind]
    tests = np.unique(layout.test[layout.wind]).size
    if tests < 2 or not np.ptp(speed) > SAME_SPEED * np.max(speed):  # nor where it is not known
        return []
    forms: dict[str, dict[str, Terms]] = {
        "Y1": {"size": _BOTH},
        "epsilon": {"size": _DRIVE},
        "Y1 and epsilon": {"size": _BOTH, "epsilon": _DRIVE},
    }
    variants = []
    for what, parts in forms.items():
        weight, title = 1.0 if what == "epsilon" else 2.0, f"{what} along the reduced velocity"
        bends = {"bend" if name == "size" else "epsilon_bend": terms for name, terms in parts.items()}
        variants.append(_scaled(title, wind, weight, place=_speed, scales=_ALONG, **parts))
        if tests > 2:
            form = f"{title}, bent"
            variants.append(_scaled(form, wind, weight, place=_speed, scales=_ALONG, **parts, **bends))
        if tests > 3:
            free = _scaled(f"{form} freely", wind, 0.5 * weight, place=_speed, scales=_FREELY, **parts, **bends)
            variants.append(replace(free, refines=form))
    return variants


def _between_tests(layout: Layout) -> list[Variant]:
    # A setting is that of a rig: tests at other speeds of the same rig share it.
    settings = compact(np.where(layout.wind, layout.rig, -1))
    by_test = Scope(Extent.EACH_TEST, settings)
    if settings.max(initial=-1) < 1:
        return []
    whose = {int(j): int(settings[np.argmax(layout.test == j)]) for j in np.unique(layout.test[layout.wind])}
    one = [
        replace(scope, members=layout.only(settings == whose[scope.number]))
        for scope in scopes(layout, {Extent.ONE_TEST: (1.0, "of one test")})
    ]
    return [
        _scaled("Y1 of every test by its own", by_test, 1.0, size=_BOTH),
        _scaled("epsilon of every test by its own", by_test, 0.5, size=_DRIVE),
        _scaled("Y1 and epsilon of every test by its own", by_test, 1.0, size=_BOTH, epsilon=_DRIVE),
        *(_scaled("Y1 {scope}", scope, scope.weight, size=_BOTH) for scope in one),
    ]


def each_its_own(layout: Layout, tests: Collection[int], tolerance: float | None) -> Variant:
    """Y1 and epsilon of some tests, by number, by their own: to within a tolerance of ln(factor), or anyhow."""
    by_test = Scope(Extent.GROUPS, compact(np.where(np.isin(layout.test, list(tests)), layout.test, -1)))
    own = _scaled("tests by their own", by_test, 1.0, size=_BOTH, epsilon=_DRIVE)
    scaled = (replace(p, scale=_ALONG[p.name] if tolerance is None else tolerance) for p in own.parameters)
    return replace(own, parameters=tuple(scaled))


_COHERENCE = Term.COHERENCE, Term.COHERENCE_POWER, Term.COHERENCE_FLOOR
_TEST = Size("test", "damping ratio at amplitude {at}", added_damping)

EFFECTS = (
    Effect(
        "aerodynamic_damping_nonlinearity",
        "Aerodynamic damping beyond the law",
        "amplitude",
        Belongs.WIND,
        (
            Term.AERO,
            Term.DRIVE,
            Term.AERO_LINEAR,
            Term.AERO_SQUARE,
            Term.AERO_FOURTH,
            Term.LAW_POWER,
            Term.LAW_EXPONENT,
            *_COHERENCE,
            Term.GUST,
            Term.SET_POINT,
        ),
        DAMPING_RATIO,
        _of_higher_order,
    ),
    Effect(
        "spanwise_coherence_loss",
        "Spanwise coherence lost at small amplitude",
        "amplitude",
        Belongs.WIND,
        (Term.DRIVE, *_COHERENCE, Term.GUST, Term.SET_POINT),
        DAMPING_RATIO,
        _coherence,
    ),
    Effect(
        "reduced_velocity_drift",
        "Aerodynamic parameters change with the reduced velocity",
        "amplitude",
        Belongs.WIND,
        (Term.AERO, Term.DRIVE),
        _TEST,
        _along_speed,
    ),
    Effect(
        "setting_dependence",
        "Aerodynamic parameters differ from test to test, not by the reduced velocity",
        "amplitude",
        Belongs.WIND,
        (Term.AERO, Term.DRIVE),
        _TEST,
        _between_tests,
    ),
)
