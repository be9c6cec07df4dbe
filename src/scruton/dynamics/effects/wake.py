"""What the wake does by itself: it lags behind the motion, and sheds vortices at a frequency of its own."""

from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    FREQUENCY,
    Apply,
    Effect,
    Extent,
    Parameter,
    Size,
    Station,
    Values,
    Variant,
    add,
    adding,
    in_wind,
    scopes,
    size_prior,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term, compact

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
    scope = in_wind(layout)
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
    # Less than none would be of turbulence that has a memory of some cycles.
    part = size_prior("part", scope.members, scale=_LATE, positive=True, unit="of the relaxation rate")
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


def force(table: FloatArray, values: Values, unit: FloatArray, layout: Layout) -> None:
    """Add what goes round at a frequency of its own, (R,) units of size one."""
    size = values["size"] * unit
    add(table, Term.FORCE_COS, size * np.cos(values["phase"]))
    add(table, Term.FORCE_SIN, size * np.sin(values["phase"]))
    table[:, :, Term.FORCE_RATE] = values["detuning"] * layout.omega


def _shedding(table: FloatArray, values: Values, layout: Layout) -> None:
    force(table, values, layout.rate * layout.reference_amplitude, layout)


def _force(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    return np.asarray(np.hypot(rows[:, Term.FORCE_COS], rows[:, Term.FORCE_SIN]) / station.omega)


def forced(layout: Layout) -> list[Variant]:
    """A force beside the response, at a frequency of its own in every test."""
    variants = []
    shares = {
        Extent.EACH_TEST: (1.0, "in every test"),
        Extent.ONE_TEST: (1.0, "in one test"),
        Extent.SOME_TESTS: (0.7, "in some tests"),
    }
    for scope in scopes(layout, shares):
        parameters = (
            size_prior("size", scope.members, positive=True),
            # A uniform phase: a normal prior whose density at its centre is 1/(2 pi).
            Parameter("phase", 0.0, np.sqrt(2.0 * np.pi), layout.each(scope.records), unit="rad"),
            Parameter("detuning", 0.0, 0.05, scope.members, unit=FREQUENCY, starts=(0.03,)),
        )
        variants.append(Variant("{scope}", parameters, _shedding, scope, scope.weight, scan="detuning"))
    return variants


EFFECTS = (
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
        forced,
    ),
)
