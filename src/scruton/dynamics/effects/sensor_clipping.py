"""A reading that saturates at large amplitude."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import (
    Apply,
    Effect,
    Extent,
    Parameter,
    Size,
    Span,
    Station,
    Values,
    Variant,
    scopes,
)
from scruton.dynamics.effects.terms import Belongs, Layout, Term

_FORMS = (("hard", 0.0, 0.95), ("rounded", 2.0, 1.0), ("soft", 1.0, 1.6))  # kind, and level over the largest reading


def _form(kind: float, by_rig: bool) -> Apply:
    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        # Over the largest reading: of the rig, whose channel it is, or of all.
        scope = values["level"][0] > 0.0
        largest = np.full(scope.shape, np.max(np.where(scope, layout.largest, 0.0)))
        if by_rig:
            for i in np.unique(layout.rig):
                largest[layout.rig == i] = layout.largest[layout.rig == i].max()
        table[:, :, Term.CLIP] = values["level"] * largest
        table[:, :, Term.CLIP_SOFT] = np.where(values["level"] > 0.0, kind, 0.0)

    return apply


def _read(rows: FloatArray, _without: FloatArray, station: Station) -> FloatArray:
    """Part of the amplitude that a saturated reading loses at the largest reading, negative."""
    reading = station.largest
    low, high = np.full(len(rows), 0.5 * reading), np.full(len(rows), 4.0 * reading)
    for _ in range(40):
        middle = 0.5 * (low + high)
        short = station.reading(rows, middle) < reading
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return np.asarray(reading / (0.5 * (low + high)) - 1.0)


def _span(row: FloatArray, span: Span) -> Span:
    """Amplitudes above the level; a saturation that is not hard bends well below it."""
    level = float(row[Term.CLIP]) * (0.6 if row[Term.CLIP_SOFT] > 0.5 else 1.0)
    return min(max(span[0], level), span[1]), span[1]


def _forms(layout: Layout) -> list[Variant]:
    # One level for all rigs, each by its own largest reading, is another effect than one for all by the largest of all.
    rigs = {Extent.EACH_RIG: (1.0, "at its own"), Extent.EVERYWHERE: (1.0, "alike")}
    single = {Extent.ONE_RIG: (2.0, "of one rig"), Extent.ONE_RECORD: (2.0, "of one record")}
    choices = [("", False, scope) for scope in scopes(layout, {Extent.EVERYWHERE: (2.0, "of every channel")})]
    if np.unique(layout.rig).size > 1:
        choices += [("of every rig ", True, scope) for scope in scopes(layout, rigs)]
    choices += [("", False, scope) for scope in scopes(layout, single)]
    found = []
    for form, kind, centre in _FORMS:
        starts = tuple(float(np.log(centre * x)) for x in (0.97, 0.8))
        for whose, by_rig, scope in choices:
            level = Parameter("level", float(np.log(centre)), 0.4, scope.members, log=True, unit="largest reading",
                              starts=starts)  # fmt: skip
            text = f"{form} saturation {whose}{{scope}}"
            found.append(Variant(text, (level,), _form(kind, by_rig), scope, scope.weight))
    return found


EFFECT = Effect(
    "sensor_clipping",
    "The reading saturates",
    "Above some level the sensor, its amplifier or its target range flattens the reading.",
    "Describing function of a saturation; any text on control.",
    "The largest cycles have flat tops: a third harmonic in phase, of minus some per cent, and an amplitude too small.",
    "signal",
    Belongs.SENSOR,
    (Term.CLIP, Term.CLIP_SOFT),
    Size("signal", "relative error of the reading at the largest amplitude", _read, _span),
    _forms,
)
