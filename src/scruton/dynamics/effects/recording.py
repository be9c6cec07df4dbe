"""What befalls a record: a wind that drifts, a frequency that follows the amplitude, a sensor that errs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    BENDS,
    DRIVE,
    FACTOR,
    TENTHS,
    TRENDS,
    Apply,
    Effect,
    Extent,
    Parameter,
    Scope,
    Size,
    Span,
    Station,
    Values,
    Variant,
    add,
    adding,
    bend_at,
    half_a_record,
    scopes,
    size_prior,
    sized,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term, compact

_ONE_SIDE = -1.0
# Saturation: kind, and level over the largest reading.
_BLUNTEST = 2.6  # power of a saturation that is rounded: below it is no edge
_KINDS = (("hard", 0.0, 0.95), ("one-sided hard", _ONE_SIDE, 0.85), ("rounded", 2.0, 1.0), ("soft", 1.0, 1.6))
# A change of the wind by s changes the damping by s (2 lambda - l), of which lambda or a little more is usual, so that
# 0.2 of the wind is what 0.3 of the relaxation damping is.
_WIND_SCALE = 0.2
_ALIKE = 0.05  # prior standard deviation of ln(bend) between rigs: their springs are the same, and their masses about
_SHOWN = 0.01  # relative standard deviation of a level that the extreme readings show: the mean may be off


def _drift(term: Term, *, from_start: bool) -> Apply:
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


def jump(table: FloatArray, values: Values, layout: Layout) -> None:
    """A drive that is another from some moment of a record on."""
    add(table, Term.JUMP, values["size"])
    table[:, :, Term.JUMP_TIME] = values["moment"] * layout.duration


def jumping(form: str, scope: Scope) -> Variant:
    """A jump of the drive at a part of the record."""
    moment = Parameter("moment", 0.5, 0.3, scope.members, unit="of the record", starts=(0.5,))
    size = sized(form, jump, scope, unit=DRIVE)
    return replace(size, parameters=(*size.parameters, moment), scan="moment")


def _stepping(layout: Layout) -> list[Variant]:
    """A step of the wind, of one size at one part of several records: by their own they are no wind's, but unknown."""
    shares = {
        Extent.IN_WIND: (0.5, "at the same part of every record in wind"),
        Extent.ONE_TEST: (0.5, "at the same part of every record of one test"),
        Extent.SOME_RECORDS: (0.5, "at the same part of some records"),
    }
    found = []
    for scope in scopes(layout, shares, wind=True):
        if scope.extent is Extent.SOME_RECORDS:
            scope = replace(scope, members=layout.in_wind())
        if np.count_nonzero(scope.records) > 1:
            found.append(jumping("a step of one size {scope}", scope))
    return found


def _rise(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    rise = rows[:, Term.TREND] + rows[:, Term.TREND_SINE] + rows[:, Term.TREND_ARCH] + rows[:, Term.TREND_SETTLING]
    return np.asarray(-rise * (2.0 * rows[:, Term.DRIVE] / station.amplitude - rows[:, Term.AERO]) / station.omega)


def _settles(table: FloatArray, values: Values, layout: Layout) -> None:
    sizes = values["size"], values.get("drive", np.zeros_like(values["size"]))
    for term, size in zip((Term.TREND_SETTLING, Term.TREND_DRIVE_SETTLING), sizes, strict=True):
        add(table, term, size)
    acts = np.any(sizes, axis=0)
    table[:, :, Term.TREND_PACE] = np.where(acts, layout.duration / np.where(acts, values["time"], 1.0), 0.0)


def _settling(layout: Layout, among: Sequence[Scope]) -> list[Variant]:
    """A wind that approaches another speed as 1 - exp(-t/T), alike in several records: a fan or a tunnel that warms."""
    (middle, scale), found = half_a_record(layout), []
    for scope in among:
        if scope.extent not in (Extent.IN_WIND, Extent.ONE_TEST):
            continue
        starts = middle, middle - 0.5, middle + 0.5
        time = Parameter("time", middle, scale, scope.members, log=True, unit="s", starts=starts)
        for words, names in (("", ("size",)), (" the drive's part its own,", ("size", "drive"))):
            one = sized(
                f"change that settles,{words} {{scope}}", _settles, scope, *names,
                weight=0.5 * scope.weight, scale=_WIND_SCALE, unit="of the wind",
            )  # fmt: skip
            found.append(replace(one, parameters=(*one.parameters, time), scan="time"))
    return found


def _drifting(layout: Layout) -> list[Variant]:
    shares = {
        Extent.IN_WIND: (2.0, "the same in every record in wind"),
        Extent.ONE_TEST: (0.7, "in one test"),
        Extent.EACH_RECORD_OF_ONE_TEST: (0.7, "in every record of one test"),
        Extent.EACH_RECORD: (1.0, "in every record by its own"),
        Extent.SOME_RECORDS: (1.0, "in some records, each by its own"),
        Extent.ONE_RECORD: (1.0, "in one record"),
    }
    every = scopes(layout, shares, wind=True)
    # An S and a mean of its own for every record come too near to a jump in each.
    shared = [scope for scope in every if scope.extent not in (Extent.EACH_RECORD, Extent.SOME_RECORDS)]
    both = [
        sized(
            f"{form}, the drive's part its own, {{scope}}", adding(size=wind, drive=drive), scope, "size", "drive",
            weight=0.5 * scope.weight, scale=_WIND_SCALE, unit="of the wind",
        )
        for form, wind, drive, allowed in (
            ("linear drift", Term.TREND, Term.TREND_DRIVE, every),
            ("rise and return", Term.TREND_ARCH, Term.TREND_DRIVE_ARCH, shared),
        )
        for scope in allowed
    ]  # fmt: skip
    alike = [
        sized(f"{form}, {{scope}}", apply, scope, scale=_WIND_SCALE, unit="of the wind")
        for form, apply, allowed in (
            ("linear drift", _drift(Term.TREND, from_start=False), every),
            ("S-shaped drift", _drift(Term.TREND_SINE, from_start=False), every),
            ("linear drift from the stated speed", _drift(Term.TREND, from_start=True), every),
            ("S-shaped drift from the stated speed", _drift(Term.TREND_SINE, from_start=True), shared),
        )
        for scope in allowed
    ]
    arch = adding(size=Term.TREND_ARCH)
    arches = [sized("rise and return, {scope}", arch, scope, scale=_WIND_SCALE, unit="of the wind") for scope in shared]
    return both + alike + arches + _settling(layout, shared) + _stepping(layout)


def _bend(rows: FloatArray, without: FloatArray, station: Station) -> FloatArray:
    return bend_at(rows - without, np.asarray(station.largest))


def _bending(term: Term, damping: Term, name: str = "size") -> Apply:
    r"""A frequency that changes as a power of the amplitude, and the damping of that amplitude with it.

    What viscous damping takes in every spring alike is the action, :math:`\omega a^2` of the fundamental, at the rate
    :math:`2\xi\omega_0`; so that where :math:`\omega` grows with :math:`a^p` by a share :math:`\delta`, the amplitude
    falls :math:`1 - p\delta/2` times as fast.
    """
    bend, eases = adding(**{name: term}), 0.5 * BENDS[term]

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        before = table[:, :, term].copy()
        bend(table, values, layout)
        table[:, :, damping] -= eases * (table[:, :, term] - before) * table[:, :, Term.STRUCTURAL]

    return apply


def _alike(variant: Variant, layout: Layout) -> Variant:
    """The same form in all rigs, whose springs and masses are alike to within a twentieth."""

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        factor = np.exp(values["own"])
        variant.apply(table, {name: value * factor for name, value in values.items() if name != "own"}, layout)

    own = size_prior("own", layout.by_rig(), scale=_ALIKE, unit=FACTOR)
    form = variant.form.format(scope="in every rig to within a twentieth")
    return replace(variant, form=form, parameters=(*variant.parameters, own), apply=apply)


def _stiffness(layout: Layout) -> list[Variant]:
    shares = {Extent.EVERYWHERE: (2.0, "in every record"), Extent.EACH_RIG: (1.0, "of every rig by its own")}
    square, linear = (Term.STIFFNESS, Term.STRUCTURAL_SQUARE), (Term.STIFFNESS_LINEAR, Term.STRUCTURAL_LINEAR)
    powers = {
        "linear": _bending(*linear, "linear"),
        "square": _bending(*square, "square"),
        "fourth": adding(fourth=Term.STIFFNESS_FOURTH),  # no damping in the fourth power has a term
    }

    def several(table: FloatArray, values: Values, layout: Layout) -> None:
        for apply in powers.values():
            apply(table, values, layout)

    # Stops, gaps and springs that stiffen late follow no power of the amplitude.
    choices: list[tuple[str, Apply, tuple[str, ...], float]] = [
        ("A^2", _bending(*square), ("size",), 1.0),
        ("A", _bending(*linear), ("size",), 0.5),
        ("A, A^2 and A^4", several, tuple(powers), 0.5),
    ]
    variants = [
        sized(
            f"frequency changes as {power}, {{scope}}", apply, scope, *names, weight=share * scope.weight,
            unit=TENTHS,
        )
        for power, apply, names, share in choices
        for scope in scopes(layout, shares)
    ]  # fmt: skip
    if np.unique(layout.rig).size > 1:
        variants += [_alike(one, layout) for one in variants if one.scope.extent is Extent.EVERYWHERE]
    if layout.wind.any() and not layout.wind.all():
        # The air's own, which no spring's damping goes with. Small changes of it are everywhere, and no gap.
        wind, bend = (
            Scope(Extent.IN_WIND, layout.in_wind(), "in wind alone"),
            adding(linear=linear[0], square=square[0]),
        )
        form = "frequency changes as A and A^2, {scope}"
        variants.append(sized(form, bend, wind, "linear", "square", scale=0.2, weight=0.1, unit=TENTHS))
    return variants


def _gain(rows: FloatArray, without: FloatArray, _station: Station) -> FloatArray:
    return rows[:, Term.GAIN] - without[:, Term.GAIN]


def _gains(layout: Layout) -> list[Variant]:
    shares = {
        Extent.ONE_RIG: (2.0, "of one rig"),
        Extent.ONE_TEST: (1.0, "of one test"),
        Extent.ONE_RECORD: (2.0, "of one record"),
    }
    whole = {tuple(layout.only(layout.rig == rig).tolist()) for rig in np.unique(layout.rig)}
    chosen = [
        scope
        for scope in scopes(layout, shares, wind=True)
        if scope.extent is not Extent.ONE_TEST or tuple(scope.members.tolist()) not in whole
    ]
    return [sized("{scope}", adding(size=Term.GAIN), scope, scale=0.2, unit="of the reading") for scope in chosen]


def _clip(kind: float, by_rig: bool) -> Apply:
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        # Over the largest reading: of the rig, whose channel it is, or of all.
        scope = values["level"][0] > 0.0
        largest = np.full(scope.shape, np.max(np.where(scope, layout.largest, 0.0)))
        if by_rig:
            for i in np.unique(layout.rig):
                largest[layout.rig == i] = layout.largest[layout.rig == i].max()
        sharpness = np.maximum(values["sharpness"], _BLUNTEST) if "sharpness" in values else kind
        _saturate(table, values["level"], largest, sharpness)

    return apply


def _saturate(table: FloatArray, level: FloatArray, largest: FloatArray, kind: float | FloatArray) -> None:
    """A saturation of a kind at a level, (W, R), in parts of the largest reading, (R,)."""
    table[:, :, Term.CLIP] = level * largest
    table[:, :, Term.CLIP_SOFT] = np.where(level > 0.0, kind, 0.0)


def _loss(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    """Part of the amplitude that a saturated reading loses at the largest reading, negative."""
    reading = station.largest
    low, high = np.full(len(rows), 0.5 * reading), np.full(len(rows), 4.0 * reading)
    for _ in range(40):
        middle = 0.5 * (low + high)
        short = station.reading(rows, middle) < reading
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return np.asarray(reading / (0.5 * (low + high)) - 1.0)


def _above(row: FloatArray, span: Span) -> Span:
    """Amplitudes above the level; a saturation that is not hard bends well below it."""
    level = float(row[Term.CLIP]) * (0.6 if row[Term.CLIP_SOFT] > 0.5 else 1.0)
    return min(max(span[0], level), span[1]), span[1]


def _cut_off(layout: Layout) -> list[Variant]:
    """Channels whose waves are seen to be cut off, on the sides and at the levels that they show."""
    if not layout.cut_off:
        return []
    shown, other = np.zeros((2, len(layout.records)))
    for rig in np.unique(layout.rig[list(layout.cut_off)]):
        seen = {r: mark for r, mark in layout.cut_off.items() if layout.rig[r] == rig}
        of_all = np.average([mark[:2] for mark in seen.values()], axis=0, weights=[mark.nats for mark in seen.values()])
        # what goes beyond the level was recorded with another range, unless one side alone is cut off
        inside = (layout.rig == rig) & ((layout.largest <= of_all[0]) | (of_all[1] == 0.0))
        shown[inside], other[inside] = of_all
        for r, mark in seen.items():  # a channel's zero is another in every record
            shown[r], other[r] = mark.level, mark.other

    def cut(kind: FloatArray) -> Apply:
        def apply(table: FloatArray, values: Values, layout: Layout) -> None:
            del layout
            _saturate(table, values["level"], shown, kind)

        return apply

    scope = Scope(Extent.GROUPS, compact(np.where(shown > 0.0, layout.rig, -1)), "where the waves are cut off")
    level = Parameter("level", 0.0, _SHOWN, scope.members, log=True, unit="extreme reading")
    nats = sum(mark.nats for mark in layout.cut_off.values())
    forms = {"hard saturation {scope}": other - 1.0, "hard saturation on both sides {scope}": np.zeros_like(other)}
    return [Variant(form, (level,), cut(kind), scope, 0.5, seen=nats) for form, kind in forms.items()]


def _clipped(layout: Layout) -> list[Variant]:
    # One level for all rigs, each by its own largest reading, is another effect than one for all by the largest of all.
    rigs = {Extent.EACH_RIG: (1.0, "at its own"), Extent.EVERYWHERE: (1.0, "alike")}
    single = {Extent.ONE_RIG: (2.0, "of one rig"), Extent.ONE_RECORD: (2.0, "of one record")}
    choices = [("", False, scope) for scope in scopes(layout, {Extent.EVERYWHERE: (2.0, "of every channel")})]
    if np.unique(layout.rig).size > 1:
        choices += [("of every rig ", True, scope) for scope in scopes(layout, rigs)]
    choices += [("", False, scope) for scope in scopes(layout, single)]
    whole = [one for one in choices if one[2].extent in (Extent.EVERYWHERE, Extent.EACH_RIG)]
    variants = _cut_off(layout)
    for form, kind, centre in _KINDS:
        log, starts = float(np.log(centre)), tuple(float(np.log(centre * x)) for x in (0.97, 0.8))
        for whose, by_rig, scope in whole if kind == _ONE_SIDE else choices:
            level = Parameter("level", log, 0.4, scope.members, log=True, unit="largest reading", starts=starts)
            text = f"{form} saturation {whose}{{scope}}"
            variants.append(Variant(text, (level,), _clip(kind, by_rig), scope, scope.weight))
            if form == "rounded" and scope.extent is not Extent.ONE_RECORD:
                edge = float(np.log(5.0))
                sharpness = Parameter("sharpness", edge, 0.4, scope.members, log=True, unit="power", starts=(edge,))
                more, apply = f"{text}, more or less sharply", _clip(kind, by_rig)
                variants.append(Variant(more, (level, sharpness), apply, scope, 0.3 * scope.weight, refines=text))
    return variants


EFFECTS = (
    Effect(
        "wind_speed_drift",
        "The wind changes during the record",
        "amplitude",
        Belongs.RUN,
        (*TRENDS, Term.TREND_PACE, Term.AERO, Term.DRIVE, Term.JUMP, Term.JUMP_TIME),
        Size("damping", "damping ratio at amplitude {at}, end of the record, or its middle, over its start", _rise),
        _drifting,
    ),
    Effect(
        "stiffness_nonlinearity",
        "Frequency varies with amplitude",
        "frequency",
        Belongs.RIG,
        (
            Term.STIFFNESS,
            Term.STIFFNESS_LINEAR,
            Term.STIFFNESS_FOURTH,
            Term.STRUCTURAL_LINEAR,
            Term.STRUCTURAL_SQUARE,
        ),
        Size("frequency", "relative change of frequency up to the largest amplitude", _bend),
        _stiffness,
    ),
    Effect(
        "sensor_gain_error",
        "Gain of a channel wrong",
        "signal",
        Belongs.SENSOR,
        (Term.GAIN,),
        Size("signal", "relative error of the reading at the largest amplitude", _gain),
        _gains,
    ),
    Effect(
        "sensor_clipping",
        "The reading saturates",
        "signal",
        Belongs.SENSOR,
        (Term.CLIP, Term.CLIP_SOFT),
        Size("signal", "relative error of the reading at the largest amplitude", _loss, _above),
        _clipped,
    ),
)
