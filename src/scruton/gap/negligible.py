"""Effects so small that they are nobody's concern, whatever the evidence for them."""

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects import Layout, Variant
from scruton.dynamics.effects.effect import POWERS
from scruton.dynamics.effects.terms import COLUMNS, Term
from scruton.dynamics.effects.wake import late_share
from scruton.dynamics.reading import inverse_reading
from scruton.gap.blocks import PHASE
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.thresholds import BEATS, HIDDEN, SECOND_NATS, SMALLEST
from scruton.stats.fisher_scoring import inverse


def negligible(fit: FittedHypothesis | None) -> set[str]:
    """Effects in a model whose sizes are nobody's concern.

    What grows with the amplitude is measured at the largest of the records that it acts in; a saturation by what it
    hides there, unless waves are seen to be cut off; a force off the response by how far it moves the amplitude, too.
    A gain beside a frequency that bends has to be told by the amplitudes: that bend, of springs that differ a little
    or whose form is off, tells of one that is none.
    """
    small: set[str] = set()
    if fit is None:
        return small
    for k, variant in enumerate(fit.hypothesis.variants):
        sizes = [(fit.value(p.name, k)[0], p) for p in variant.parameters if not p.log and p.name != variant.scan]
        # of what cannot be negative, a fit below zero is nothing
        largest = max((float((size if p.positive else np.abs(size)).max()) for size, p in sizes), default=np.inf)
        hidden = _hidden(variant, fit) if variant.effect == "sensor_clipping" and not variant.seen > 0.0 else np.inf
        if (
            largest * _growth(variant, fit.hypothesis.data.layout) < SMALLEST
            or hidden < HIDDEN
            or _beats(variant, fit) < BEATS
            or _follows(variant, fit) < SMALLEST
            or _heard(k, fit) < SECOND_NATS
        ):
            small.add(variant.effect)
    return small


def _hidden(variant: Variant, fit: FittedHypothesis) -> float:
    """Largest part of an amplitude that the readings of the records do not show in which a saturation acts."""
    rows, largest = (of[variant.scope.records] for of in (fit.table, fit.hypothesis.data.layout.largest))
    return max(
        float(1.0 - y / inverse_reading(y, row[Term.CLIP], row[Term.CLIP_SOFT]))
        for row, y in zip(rows, largest, strict=True)
    )


def _beats(variant: Variant, fit: FittedHypothesis) -> float:
    """Largest part of an amplitude that comes and goes by a force off the response; inf of another effect."""
    if variant.effect != "vortex_shedding_forcing":
        return np.inf
    rows, largest = (of[variant.scope.records] for of in (fit.table, fit.hypothesis.data.layout.largest))
    force = np.hypot(rows[:, Term.FORCE_COS], rows[:, Term.FORCE_SIN])
    return float(np.max(force / (np.maximum(np.abs(rows[:, Term.FORCE_RATE]), 1e-12) * largest)))


def _follows(variant: Variant, fit: FittedHypothesis) -> float:
    """What a memory changes of growth through half the stable amplitude, over its rate there; inf of another effect."""
    if variant.effect != "fluid_memory":
        return np.inf
    return float(np.max(np.abs(late_share(fit.table[variant.scope.records]))))


def _heard(k: int, fit: FittedHypothesis) -> float:
    """By how many nats amplitudes alone tell a gain beside a frequency that bends; inf of another effect."""
    hypothesis, variant = fit.hypothesis, fit.hypothesis.variants[k]
    bent = any(other.effect == "stiffness_nonlinearity" for other in hypothesis.variants)
    if variant.effect != "sensor_gain_error" or not bent:
        return np.inf
    _, gradient, fisher = hypothesis.scores(fit.mode, deaf=PHASE)
    covariance = inverse(fisher, hypothesis.prior[1])
    where = hypothesis.slices[k, variant.size]
    size, sd = (fit.mode + covariance @ gradient)[where], np.sqrt(np.diag(covariance))[where]
    return float(np.max(0.5 * (size / sd) ** 2))


def _growth(variant: Variant, layout: Layout) -> float:
    """How much larger a size is at the largest amplitude that it acts at than at the reference amplitude."""
    of_each = added(variant, layout)
    power = max((p for term, p in POWERS.items() if of_each[:, int(term)].any()), default=0)
    return max(float(layout.largest[variant.scope.records].max() / layout.reference_amplitude) ** power, 1.0)


def added(variant: Variant, layout: Layout) -> FloatArray:
    """Coefficients that a variant adds to nothing in every record, its parameters all one, (R, COLUMNS)."""
    table = np.zeros((1, len(layout.records), COLUMNS))
    variant.apply(table, {p.name: np.ones(table.shape[:2]) for p in variant.parameters}, layout)
    return np.asarray(table[0])
