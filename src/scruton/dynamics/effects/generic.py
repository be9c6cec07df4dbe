"""What is in no catalogue: generic terms that compete under the name `unknown`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    AMPLITUDE,
    DAMPING_RATIO,
    DRIVE,
    FREQUENCY,
    REFERENCE,
    REPEATED,
    Apply,
    Effect,
    Extent,
    Parameter,
    Scope,
    Values,
    Variant,
    adding,
    half_a_record,
    scopes,
    sized,
)
from scruton.dynamics.effects.recording import jumping
from scruton.dynamics.effects.terms import HATS, Belongs, Layout, Term, compact
from scruton.dynamics.effects.wake import force, forced

# From some moment of a record on; together of the weight of one form.
_JUMPS = {
    Extent.EACH_RECORD: (0.4, "in every record"),
    Extent.SOME_RECORDS: (0.3, "in some records"),
    Extent.EACH_RECORD_OF_ONE_TEST: (0.15, "in every record of one test"),
    Extent.ONE_RECORD: (0.15, "in one record"),
}
# Of a damper that warms, oil or magnet; together of the weight of one form.
_WARMS = {
    Extent.EVERYWHERE: (0.35, "of all rigs alike"),
    Extent.ONE_RIG: (0.35, "of one rig"),
    Extent.EACH_RIG: (0.15, "of every rig by its own"),
    Extent.EACH_TEST: (0.15, "of every test by its own, in wind"),
}
_GAINS = adding(size=Term.WARMING)
# Of what is not the same from record to record; together of the weight of one form.
_DIFFERS = {
    Extent.EACH_RECORD: (0.5, "of every record by its own"),
    Extent.ONE_RECORD: (0.5, "of one record"),
}
_APART = 1.5  # of two releases, from which on decays tell time from amplitude: judged
_DAMPS = adding(size=Term.STRUCTURAL)
# Of springs that creep or warm; together of the weight of one form. In still air as in the wind, for a wind that drifts
# moves the frequency, too.
_CREEPS = {
    Extent.EVERYWHERE: (0.5, "alike in every record"),
    Extent.EACH_RIG: (0.5, "of every rig by its own"),
}
_PITCHES = adding(size=Term.FREQUENCY_TREND)
_EXCESS = {f"hat{k}": Term.HAT + k for k in range(HATS)}
_BUMP = adding(size=Term.BUMP)
_BUMP_PLACES = 12  # over ln(amplitude), from which a bump is sought
_BUMP_WIDTH = float(np.log(0.2)), 0.5  # prior of ln(standard deviation in ln(amplitude)): hats are half of one apart


def discrepancy(form: str, scope: Scope) -> Variant:
    """Excess damping by hat functions in ln(amplitude), in units of the reference relaxation rate."""
    return sized(form, adding(**_EXCESS), scope, *_EXCESS)


def _jumps(layout: Layout) -> list[Variant]:
    """Of the drive: that of the damping leaves all but the same. Of one size in several records they are the wind's."""
    several = np.count_nonzero(layout.wind) > 1
    shares = _JUMPS if several else {Extent.IN_WIND: (1.0, "in the record")}
    return [jumping("a jump {scope}", scope) for scope in scopes(layout, shares, wind=True)]


def _told(layout: Layout, shares: Mapping[Extent, tuple[float, str]]) -> list[Scope]:
    """Scopes of what follows the time in a record: of rigs whose records go through an amplitude at several times."""
    growing, tells = layout.direction > 0, np.zeros(len(layout.records), dtype=bool)
    for rig in np.unique(layout.rig):
        own = layout.rig == rig
        released = layout.largest[own & ~growing]
        both = released.size > 0 and bool(np.any(growing[own]))
        tells[own] = both or (released.size > 1 and released.max() > _APART * released.min())
    each = Extent.EACH_RIG, Extent.EACH_TEST
    found = [
        replace(one, members=compact(np.where(tells, one.members, -1))) if one.extent in each else one
        for one in scopes(layout, shares)
    ]
    return [one for one in found if np.any(tells & one.records)]


def _warm(table: FloatArray, values: Values, layout: Layout) -> None:
    _GAINS(table, values, layout)
    acts = values["time"] > 0.0
    table[:, :, Term.WARMING_PACE] = np.where(acts, layout.duration / np.where(acts, values["time"], 1.0), 0.0)


def _warming(layout: Layout) -> list[Variant]:
    """Structural damping that changes as a record goes on, each anew from where it began.

    In still air and in wind, or in wind alone: a ring-down may be over before.
    """
    length, found = float(np.log(np.median(layout.duration))), []
    for scope in _told(layout, _WARMS):
        in_wind = scope.extent is Extent.EACH_TEST
        if in_wind and layout.wind.all():  # of every rig's all records
            continue
        middle, scale = half_a_record(layout) if in_wind else (length - 1.0, 1.0)
        time = Parameter(
            "time", middle, scale, layout.only(scope.records), log=True, unit="s",
            starts=(middle, middle - scale, middle + scale),
        )  # fmt: skip
        form = sized("structural damping that changes as a record goes on, {scope}", _warm, scope)
        found.append(replace(form, parameters=(*form.parameters, time), scan="time"))
    return found


def _differing(layout: Layout) -> list[Variant]:
    """Structural damping that differs between records of a rig, in still air and in wind."""
    if len(layout.records) == np.unique(layout.rig).size:
        return []
    return [sized("structural damping {scope}", _DAMPS, scope, unit=REPEATED) for scope in scopes(layout, _DIFFERS)]


def _creeping(layout: Layout) -> list[Variant]:
    return [
        sized("frequency that changes as a record goes on, {scope}", _PITCHES, scope, scale=0.01, unit=FREQUENCY)
        for scope in _told(layout, _CREEPS)
    ]


def _bump(table: FloatArray, values: Values, layout: Layout) -> None:
    _BUMP(table, values, layout)
    acts = values["width"] > 0.0
    table[:, :, Term.BUMP_AT] = np.log(np.where(acts, values["centre"], 1.0))
    table[:, :, Term.BUMP_WIDTH] = values["width"]


def _bumps(layout: Layout, among: Sequence[Scope]) -> list[Variant]:
    """Excess damping near one amplitude, which hats are too wide for."""
    low, high = np.log(layout.knots[[0, -1]]).tolist()
    places = tuple(np.linspace(low, high, _BUMP_PLACES).tolist())
    found = []
    for scope in among:
        centre = Parameter(
            "centre", 0.5 * (low + high), (high - low) / np.sqrt(12.0), scope.members, log=True, unit=AMPLITUDE,
            starts=places,
        )  # fmt: skip
        width = Parameter(
            "width", *_BUMP_WIDTH, scope.members, log=True, unit="of ln(amplitude)", starts=_BUMP_WIDTH[:1]
        )
        bump = sized("damping near one amplitude, {scope}", _bump, scope, weight=0.5)
        found.append(replace(bump, parameters=(*bump.parameters, centre, width), scan="centre"))
    return found


def _pulsing(table: FloatArray, values: Values, layout: Layout) -> None:
    force(table, values, layout.rate, layout)
    table[:, :, Term.FORCE_TWICE] = np.where(values["size"] != 0.0, 1.0, 0.0)


def _loose(kind: float) -> Apply:
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        loose, level = values["width"] > 0.0, values["width"] * layout.reference_amplitude
        table[:, :, Term.CLIP] = np.where(loose, level, table[:, :, Term.CLIP])  # other channels may saturate
        table[:, :, Term.CLIP_SOFT] = np.where(loose, kind, table[:, :, Term.CLIP_SOFT])

    return apply


def _playing(layout: Layout) -> list[Variant]:
    """What follows the motion stands still where that turns, as a linkage does, or where it goes through the middle."""
    centre = float(np.log(0.1))
    shares = {Extent.EVERYWHERE: (0.15, "in every rig"), Extent.ONE_RIG: (0.1, "in one rig")}
    return [
        Variant(
            f"{what} of the sensor, {{scope}}",
            (Parameter("width", centre, 1.0, one.members, log=True, unit=REFERENCE, starts=(centre,)),),
            _loose(kind),
            one,
            one.weight,
        )
        for what, kind in (("play", -2.0), ("a dead zone", -3.0))
        for one in scopes(layout, shares)
    ]


def _coming_and_going(table: FloatArray, values: Values, _layout: Layout) -> None:
    table[:, :, Term.GUST] = np.hypot(table[:, :, Term.GUST], values["scatter"] * table[:, :, Term.DRIVE])


def _forms(layout: Layout) -> list[Variant]:
    wind = Scope(Extent.IN_WIND, layout.in_wind(), "in wind")
    shared = [Scope(Extent.EVERYWHERE, layout.everywhere(), "everywhere"), wind]
    bumps = _bumps(layout, shared)
    if np.unique(layout.test[layout.wind]).size > 1:
        shared.append(Scope(Extent.EACH_TEST, layout.by_test(), "of every test by its own"))
    variants = [discrepancy("damping against amplitude, {scope}", scope) for scope in shared]
    # Of the drive, larger than any gusts of the null model.
    sizes = tuple(float(np.log(size)) for size in (0.1, 0.05, 0.2, 0.4))
    scatter = Parameter("scatter", sizes[0], 0.7, layout.by_test(), log=True, unit=DRIVE, starts=sizes)
    slow = Variant("what comes and goes", (scatter,), _coming_and_going, wind)
    pulses = [
        replace(one, form=f"stiffness that pulses near twice the frequency, {one.form}", apply=_pulsing, weight=0.3)
        for one in forced(layout)
        if one.scope.extent is Extent.EACH_TEST
    ]
    return [
        *variants, *bumps, *_jumps(layout), *_warming(layout), *_differing(layout), *_creeping(layout), slow, *pulses,
        *_playing(layout),
    ]  # fmt: skip


EFFECT = Effect(
    "unknown",
    "Something that is not in the catalogue",
    "amplitude",
    Belongs.WIND,
    (
        *(Term.HAT, Term.BUMP, Term.BUMP_AT, Term.BUMP_WIDTH, Term.JUMP, Term.JUMP_TIME),
        *(Term.WARMING, Term.WARMING_PACE, Term.STRUCTURAL, Term.FREQUENCY_TREND),
        *(Term.FORCE_COS, Term.FORCE_SIN, Term.FORCE_RATE, Term.FORCE_TWICE),
        *(Term.GUST, Term.CLIP, Term.CLIP_SOFT),
    ),
    DAMPING_RATIO,
    _forms,
)
