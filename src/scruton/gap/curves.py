"""How far the damping curves of two models are from the measured ones, over the band of amplitudes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Extent, Scope
from scruton.dynamics.effects.generic import discrepancy
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.dynamics.reading import inverse_reading
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis

_BAND = 40
_ITERATIONS = 8


@dataclass(frozen=True)
class Discrepancy:
    """Mean distance of damping curves from the measured ones over ln(amplitude) and tests, over the relaxation rate.

    Attributes
    ----------
    before, after : float
        Of the bare model and the verdict's, fitted to all records.
    held_out_before, held_out_after : float
        Each test by what the others tell; as the former where no test can be left out.
    """

    before: float
    after: float
    held_out_before: float
    held_out_after: float


def damping_discrepancy(
    null: FittedHypothesis, final: FittedHypothesis, left_out: Sequence[tuple[FloatArray, FloatArray]]
) -> Discrepancy:
    """Compare damping curves.

    The measured curve of a test is that of the verdict's hypothesis with a generic discrepancy of every test by its
    own, fitted in the likelihood of all records; its noise keeps the distance of a right model above zero.

    Parameters
    ----------
    null, final : FittedHypothesis
    left_out : sequence of (array, array)
        Coordinates of both, one pair a test in order, from the records of the others.
    """
    data = final.hypothesis.data
    layout = data.layout
    scope = Scope(Extent.EACH_TEST, layout.by_test())
    fitted = final.with_variants(discrepancy("measured", scope), iterations=_ITERATIONS)
    tests = [int(np.flatnonzero(layout.test == j)[0]) for j in np.unique(layout.test[layout.wind])]
    measured = [_curve(fitted.hypothesis, fitted.mode, r) for r in tests]

    def distance(hypothesis: Hypothesis, each: Sequence[FloatArray]) -> float:
        away = [
            np.mean(np.abs(_curve(hypothesis, u, r) - m)) / layout.rate[r]
            for u, m, r in zip(each, measured, tests, strict=True)
        ]
        return float(np.mean(away))

    full = [distance(fit.hypothesis, [fit.mode] * len(tests)) for fit in (null, final)]
    out = full
    if len(left_out) == len(tests):
        out = [distance(fit.hypothesis, [pair[i] for pair in left_out]) for i, fit in enumerate((null, final))]
    return Discrepancy(*full, *out)


def _curve(hypothesis: Hypothesis, u: FloatArray, record: int) -> FloatArray:
    """Damping rate -da/dt/a of a test over the amplitudes that its records read [1/s]; a steady wind."""
    data = hypothesis.data
    layout = data.layout
    mine = np.isin(data.channels.record, np.flatnonzero(layout.test == layout.test[record]))
    read = data.channels.amplitude[mine]
    band = np.geomspace(max(np.quantile(read, 0.02), 0.03 * read.max()), read.max(), _BAND)
    table = hypothesis.table(u[None])[:, record]
    table[:, [int(Term.TREND), int(Term.TREND_SINE), int(Term.TREND_DRIVE)]] = 0.0
    row = table[0]
    true = np.array([inverse_reading(y / (1.0 + row[Term.GAIN]), row[Term.CLIP], row[Term.CLIP_SOFT]) for y in band])
    return np.asarray(-amplitude_rates(table, true, data.channels.knots)[0] / true)
