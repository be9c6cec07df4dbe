"""What the section and the wind do beyond the law: parts of higher order, coherence, K, a wake that lags, shedding."""

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    DAMPING_RATIO,
    DRIVE,
    FACTOR,
    FREQUENCY,
    POWERS,
    REFERENCE,
    Apply,
    Effect,
    Extent,
    Parameter,
    Scope,
    Size,
    Station,
    Values,
    Variant,
    add,
    added_damping,
    adding,
    scopes,
    size_prior,
    sized,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term, compact

SAME_SPEED = 5e-3  # relative: wind speeds are known no better, and reduced velocities that differ by less are one


def _in_wind(layout: Layout) -> Scope:
    return Scope(Extent.IN_WIND, layout.in_wind())


def _incoherent(table: FloatArray, values: Values, layout: Layout) -> None:
    lost = values["amplitude"] * layout.reference_amplitude
    table[:, :, Term.COHERENCE] = lost
    # Less of the drive is left, and the amplitude relaxes more slowly: gusts and set-points stay those of the stable
    # amplitude, or a drive that is lost throughout would let them grow to what comes and goes.
    x = layout.reference_amplitude / np.where(lost > 0.0, lost, np.inf)
    left = np.where(x > 0.0, -np.expm1(-x) * (1.0 - x / np.expm1(np.clip(x, 1e-9, 700.0))), 1.0)
    for term in (Term.GUST, Term.SET_POINT):
        table[:, :, term] *= left


def _critical(scope: Scope, usual: float, *starts: float) -> Parameter:
    """A_c of a drive that saturates as 1 - exp(-A/A_c): what is usual of it, and where its search begins."""
    return Parameter(
        "amplitude", float(np.log(usual)), 1.0, scope.members, log=True, unit=REFERENCE,
        starts=tuple(float(np.log(x)) for x in starts),
    )  # fmt: skip


def _saturating(layout: Layout, form: str, weight: float = 1.0) -> Variant:
    scope = _in_wind(layout)
    return Variant(form, (_critical(scope, 0.2, 0.04, 0.12, 0.4),), _incoherent, scope, weight)


def _bent_and_saturating(layout: Layout, weight: float) -> Variant:
    """A drive that falls with the amplitude more than as its inverse, and less at small ones: whatever smooth law."""
    scope, bend = _in_wind(layout), adding(size=Term.AERO_SQUARE)

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        _incoherent(table, values, layout)
        bend(table, values, layout)

    form = "a part in A^2 of the aerodynamic damping, and a drive that saturates as 1 - exp(-A/A_c)"
    parameters = size_prior("size", scope.members), _critical(scope, 0.4, 0.12, 0.4, 1.2)
    return Variant(form, parameters, apply, scope, weight, size="amplitude")


def _of_another_law(layout: Layout, power: Term, weight: float) -> Variant:
    """Growth in proportion to the amplitude that a power of it ends, as in Ehsan and Scanlan's law, not the paper's.

    A share w of the drive c becomes c ((1 + 1/p) x - x^(p + 1)/p) with x = a/a0: at the reference amplitude a0 that is
    c, and what relaxes there does so as fast as under the paper's law.
    """
    scope, p, a0 = _in_wind(layout), POWERS[power], layout.reference_amplitude

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        moved = values["share"] * table[:, :, Term.DRIVE]
        add(table, Term.DRIVE, -moved)
        add(table, Term.AERO, -(1.0 + 1.0 / p) * moved / a0)
        add(table, power, moved / (p * a0 ** (p + 1)))

    form = f"in the place of the drive, growth in proportion to the amplitude that a part in A^{p} ends"
    share = size_prior("share", scope.members, scale=0.6, unit=DRIVE)
    return Variant(form, (share,), apply, scope, weight, read_at=0.5)


def _coherence(layout: Layout) -> list[Variant]:
    return [_saturating(layout, "drive saturates as 1 - exp(-A/A_c)")]


def _of_higher_order(layout: Layout) -> list[Variant]:
    linear, square, fourth, scope = Term.AERO_LINEAR, Term.AERO_SQUARE, Term.AERO_FOURTH, _in_wind(layout)
    both = adding(linear=linear, square=square)
    return [
        sized("parts in A and A^2 of the aerodynamic damping", both, scope, "linear", "square", weight=0.5),
        sized("a part in A of the aerodynamic damping", adding(size=linear), scope),
        sized("a part in A^2 of the aerodynamic damping", adding(size=square), scope, weight=1.5),
        sized("a part in A^4 of the aerodynamic damping", adding(size=fourth), scope, weight=0.7),
        # A wake that falls out of step at small amplitude loses its drive as a span does whose parts no longer agree.
        _saturating(layout, "a wake out of step at small amplitude: drive saturates as 1 - exp(-A/A_c)", 0.4),
        *(_of_another_law(layout, power, 0.5) for power in (linear, square, fourth)),
        _bent_and_saturating(layout, 0.3),
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
# that line: as much as tells a straight change of Y1 from a straight change of ln(Y1), and no more.
_OWN = {"size": 0.25, "epsilon": 0.15}
_ALONG = {"size": 0.5, "epsilon": 0.3, "bend": 0.2, "epsilon_bend": 0.1}


def _scaled(form: str, scope: Scope, weight: float, *, place: Place | None = None, **parts: Terms) -> Variant:
    """Coefficients times exp(parameter): of every test by its own, or times its place, or what bends that line."""
    scales = _OWN if place is None else _ALONG

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        along = place(layout) if place else 1.0
        bent = np.where(layout.wind, 2.0 * along**2 - 0.25, 0.0)
        for name, terms in parts.items():
            factor = np.exp(values[name] * (bent if "bend" in name else along))
            for term in terms:
                table[:, :, int(term)] *= factor

    priors = tuple(size_prior(name, scope.members, scale=scales[name], unit=FACTOR) for name in parts)
    return Variant(form, priors, apply, scope, weight)


def _along_speed(layout: Layout) -> list[Variant]:
    wind, speed = _in_wind(layout), layout.reduced_velocity[layout.wind]
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
        weight = 1.0 if what == "epsilon" else 2.0
        variants.append(_scaled(f"{what} along the reduced velocity", wind, weight, place=_speed, **parts))
        if tests > 2:
            bends = {"bend" if name == "size" else "epsilon_bend": terms for name, terms in parts.items()}
            title = f"{what} along the reduced velocity, bent"
            variants.append(_scaled(title, wind, weight, place=_speed, **parts, **bends))
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


_LATE = 2.0  # prior standard deviation of what follows late, over the relaxation rate


def _lagging(kind: float, start: float) -> Apply:
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        cycles = values["lag"]
        table[:, :, Term.LAG] = cycles * 2.0 * np.pi / layout.omega
        table[:, :, Term.LAG_KIND] = np.where(cycles > 0.0, kind, 0.0)
        # where nothing is released the wake knows the amplitude
        told = values["start"] / (1.0 + values["start"]) if "start" in values else start
        remembers = np.where(layout.direction == 0, 1.0, told)
        table[:, :, Term.LAG_START] = np.where(cycles > 0.0, remembers, 0.0)

    return apply


def late_share(rows: FloatArray) -> FloatArray:
    """What a memory hastens growth through half the stable amplitude by, over its rate there, (W,), to first order.

    There da/dt = rate a, and the wake's amplitude is (1 - lag rate) a.
    """
    aero, rate = rows[:, Term.AERO], rows[:, Term.AERO] + rows[:, Term.STRUCTURAL]
    late = rows[:, Term.LATE]  # at half the stable amplitude the drive over the amplitude is twice the rate
    pull = np.choose(rows[:, Term.LAG_KIND].astype(np.intp), [aero, 2.0 * rate, -late, -2.0 * rate * late])
    return np.asarray(pull * rows[:, Term.LAG])


def _branch(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    rate = rows[:, Term.AERO] + rows[:, Term.STRUCTURAL]
    return np.asarray(-late_share(rows) * rate / station.omega)


def _memory(layout: Layout) -> list[Variant]:
    scope = _in_wind(layout)
    centre = float(np.log(0.15 * layout.reference_omega / (2.0 * np.pi * layout.reference_rate)))
    lag = Parameter("lag", centre, 1.0, scope.members, log=True, unit="cycles", starts=(centre - 1.0, centre + 0.3))
    bend, follow = adding(size=Term.AERO_LINEAR), _lagging(0.0, 1.0)

    def answering(table: FloatArray, values: Values, layout: Layout) -> None:
        bend(table, values, layout)
        follow(table, values, layout)

    def power_of_drive(table: FloatArray, values: Values, _layout: Layout) -> None:
        add(table, Term.LATE, values["part"])

    def following(late: Apply, kind: float) -> Apply:
        neither = _lagging(kind, 1.0)

        def apply(table: FloatArray, values: Values, layout: Layout) -> None:
            late(table, values, layout)
            # An amplitude is that of a cycle: what follows sooner than by one has no lag, and would be of the noise.
            neither(table, {**values, "lag": values["lag"] + (values["lag"] > 0.0)}, layout)

        return apply

    # A push by hand is over before the wake has followed it.
    decays = compact(np.where(layout.direction < 0, 0, -1))
    odds = float(np.log(0.3))
    start = Parameter("start", odds, 0.8, decays, log=True, unit="of what it has forgotten", starts=(odds,))
    pushed = "the wake's amplitude sets the force, from rest, and after a push from a part of it"
    # Small lags act by their product with it alone: it is wide.
    after = replace(lag, unit="cycles after the first")
    part = size_prior("part", scope.members, scale=_LATE, unit="of the relaxation rate")
    power = size_prior("part", scope.members, scale=1.0, unit="power")
    return [
        # A wake oscillator does both at once: it follows late, and answers a large amplitude with less than its share.
        Variant(
            "the wake's amplitude sets a force with a part in A",
            (size_prior("size", scope.members), lag),
            answering,
            scope,
            0.1,
            size="lag",
        ),
        Variant("the wake's amplitude sets the damping", (lag,), _lagging(1.0, 1.0), scope),
        Variant("the wake's amplitude sets the force", (lag,), _lagging(0.0, 1.0), scope),
        Variant("the wake's amplitude sets the force, from rest", (lag,), _lagging(0.0, 0.0), scope),
        *([Variant(pushed, (lag, start), _lagging(0.0, 0.0), scope, 0.5)] if decays.max() >= 0 else []),
        # A drive that grows with the amplitude and follows it late slows growth and decay down.
        Variant(
            "a part of the drive follows the amplitude", (part, after), following(adding(part=Term.LATE), 2.0), scope,
            size="lag",
        ),
        # All of it by its own amplitude over what the wake remembers, which leaves what is stable where it was.
        Variant(
            "the drive goes with the wake's amplitude over that now", (power, after), following(power_of_drive, 3.0),
            scope, size="lag",
        ),
    ]  # fmt: skip


def _shedding(table: FloatArray, values: Values, layout: Layout) -> None:
    unit = values["size"] * layout.rate * layout.reference_amplitude
    add(table, Term.FORCE_COS, unit * np.cos(values["phase"]))
    add(table, Term.FORCE_SIN, unit * np.sin(values["phase"]))
    table[:, :, Term.FORCE_RATE] = values["detuning"] * layout.omega


def _force(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    return np.asarray(np.hypot(rows[:, Term.FORCE_COS], rows[:, Term.FORCE_SIN]) / station.omega)


def _forced(layout: Layout) -> list[Variant]:
    variants = []
    shares = {Extent.EACH_TEST: (1.0, "in every test"), Extent.ONE_TEST: (1.0, "in one test")}
    for scope in scopes(layout, shares):
        parameters = (
            size_prior("size", scope.members, positive=True),
            # A uniform phase: a normal prior whose density at its centre is 1/(2 pi).
            Parameter("phase", 0.0, np.sqrt(2.0 * np.pi), layout.each(scope.records), unit="rad"),
            Parameter("detuning", 0.0, 0.05, scope.members, unit=FREQUENCY, starts=(0.03,)),
        )
        variants.append(Variant("{scope}", parameters, _shedding, scope, scope.weight, scan="detuning"))
    return variants


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
            Term.COHERENCE,
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
        (Term.COHERENCE, Term.GUST, Term.SET_POINT),
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
    Effect(
        "fluid_memory",
        "The wake lags",
        "amplitude",
        Belongs.WIND,
        (Term.LAG, Term.LAG_KIND, Term.LAG_START, Term.LATE, Term.AERO_LINEAR),
        Size("branch", "damping ratio of growth through half the stable amplitude, to first order in the lag", _branch),
        _memory,
    ),
    Effect(
        "vortex_shedding_forcing",
        "Vortex-shedding force",
        "spectrum",
        Belongs.WIND,
        (Term.FORCE_COS, Term.FORCE_SIN, Term.FORCE_RATE),
        Size("spectrum", "amplitude that the force would add in one radian", _force),
        _forced,
    ),
)
