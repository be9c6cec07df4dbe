"""The backbone curve: frequency against amplitude, which a spring that bends makes a curve."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.envelope.types import Cycles

_BEND = 3  # coefficients of the curve: at rest, linear, quadratic


@dataclass(frozen=True)
class Backbone:
    """One curve through the cycles of some records, each shifted along it by its own part.

    Attributes
    ----------
    at_rest, at_rest_sd : float
        Frequency of the first at vanishing amplitude, and its standard deviation [Hz].
    apart, apart_sd : (n - 1,) array
        Frequencies of the others over that of the first at the same amplitudes, minus 1, and their standard deviations.
    """

    at_rest: float
    at_rest_sd: float
    apart: FloatArray
    apart_sd: FloatArray


def bends_from(track: Cycles, frequency: float, limit: float) -> bool:
    """Whether a record is known, to a relative `limit`, to swing at a frequency [Hz] once it hardly moves."""
    curve = backbone([track])
    return (
        curve is not None
        and abs(curve.at_rest / frequency - 1.0) <= limit
        and curve.at_rest_sd <= limit * frequency
    )  # fmt: skip


def backbone(tracks: Sequence[Cycles]) -> Backbone | None:
    """The backbone curve of some records, a parabola in the amplitude; None where they have too few cycles for it."""
    known = [
        np.isfinite(track.frequency_error) & (track.frequency_error > 0.0) & (track.amplitude > 0.0) for track in tracks
    ]
    parameters = _BEND + len(tracks) - 1
    if min(map(np.count_nonzero, known)) <= parameters:
        return None
    f, error, amplitude = (
        np.concatenate([getattr(track, name)[here] for track, here in zip(tracks, known, strict=True)])
        for name in ("frequency", "frequency_error", "amplitude")
    )
    which = np.repeat(np.arange(len(tracks)), [np.count_nonzero(here) for here in known])
    own = which[:, None] == np.arange(1, len(tracks))
    columns = np.hstack([(amplitude / amplitude.max())[:, None] ** np.arange(_BEND), own]) / error[:, None]
    found, misfit, rank, _ = np.linalg.lstsq(columns, f / error, rcond=None)
    if rank < parameters:
        return None
    # what turns the phase in wind is no error of the cycles
    scatter = max(1.0, float(misfit[0]) / (f.size - parameters))
    sd = np.sqrt(scatter * np.diag(np.linalg.inv(columns.T @ columns)))
    middle = float(np.average(f, weights=error**-2.0))
    return Backbone(float(found[0]), float(sd[0]), found[_BEND:] / middle, sd[_BEND:] / middle)
