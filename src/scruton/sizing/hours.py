r"""Hours a year beyond a limit, with the amplitude as a function of the wind speed over the lock-in range.

.. math:: A(U) = A_{peak}\, s(U/fD), \qquad h = \sum_U h(U) \sum_t p_t\, P[f_t\, A(U) > limit]

s is the stable amplitude over its largest, at the bridge's Scruton number; p_t and f_t are share of the time and factor
of the amplitude of a class of turbulence.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.quantity import Quantity
from scruton.griffin.lock_in import has_speeds, lock_in_draws, lock_in_velocities
from scruton.griffin.posterior import draws_of, peak_names
from scruton.infer.thresholds import DISTINCT_SPEEDS, FEWEST_SPEEDS
from scruton.said import key, said
from scruton.sizing.bridge import Mode
from scruton.sizing.model import Draws, ModeModel
from scruton.sizing.thresholds import LOCK_IN_MARGIN
from scruton.sizing.transfer import TurbulenceClass

if TYPE_CHECKING:
    import xarray as xr

_CELLS = 60  # of the lock-in range
_STEADY_AIR = (TurbulenceClass(1.0, None, Quantity(1.0, family="known")),)


@dataclass(frozen=True, eq=False)
class LockInShape:
    """Stable amplitude over its largest against reduced velocity, at the Scruton number of a mode.

    Attributes
    ----------
    edges : (V + 1,) array
        Of cells of U/(fD), from one end of lock-in to the other.
    ratio : (S, V) array
        Draws, in the middle of the cells.
    source : str
        What it was taken from.
    assumed : bool
        Whether neither records nor the bridge say where lock-in lies.
    triangle : bool
        Whether neither records nor the bridge say how the amplitude depends on the speed, so that lines are assumed.
    """

    edges: FloatArray
    ratio: FloatArray
    source: str
    assumed: bool = False
    triangle: bool = False


@dataclass(frozen=True, eq=False)
class LockInCurve:
    """Amplitude of a mode against reduced velocity, without added damping; (V,) arrays, amplitudes in m or rad."""

    reduced_velocity: FloatArray
    wind_speed: FloatArray
    amplitude_05: FloatArray
    amplitude_50: FloatArray
    amplitude_95: FloatArray


@dataclass(frozen=True, eq=False)
class LockInHours:
    """Hours a year in lock-in, by mode.

    Attributes
    ----------
    lock_in : tuple of (float, float)
        Reduced velocities between which a mode locks in.
    assumed : tuple of bool
        Whether that is the range of a peak test, widened, since neither the bridge nor records at other speeds tell it.
    a_year, exceeding_a_year : tuple of float
        Hours in lock-in, and those expected beyond the limit.
    exceeding_low, exceeding_high : tuple of float
        5 and 95 % points of the hours beyond the limit.
    exceeding_with : mapping
        Hours expected beyond the limit, by mode, "with_required_damping" at 95 % and "with_dampers", where there are.
        None in a sizing of earlier versions.
    shape : tuple of str
        What the amplitude against the wind speed was taken from.
    curves : tuple of LockInCurve
    """

    lock_in: tuple[tuple[float, float], ...]
    assumed: tuple[bool, ...]
    a_year: tuple[float, ...]
    exceeding_a_year: tuple[float, ...]
    exceeding_low: tuple[float, ...] = ()
    exceeding_high: tuple[float, ...] = ()
    shape: tuple[str, ...] = ()
    curves: tuple[LockInCurve, ...] = ()
    exceeding_with: Mapping[str, tuple[float, ...]] | None = None


def lock_in_shape(tree: "xr.DataTree", mode: Mode, scruton_number: float, seed: int) -> LockInShape:
    """Find how the amplitude of a mode depends on the wind speed.

    Notes
    -----
    From the file that the mode names; else from tests and sweeps at other wind speeds, where one rig at least was
    tested at three (peaks of several rigs, one speed each, are no sweep), with their band; else rising linearly to the
    peak of the test whose Scruton number is nearest, and falling linearly from there.
    """
    if mode.lock_in_shape is not None:
        known, height = mode.lock_in_shape
        v, edges = _cells(*(mode.lock_in or (float(known[0]), float(known[-1]))))
        ratio = np.interp(v, known, height / height.max(), left=0.0, right=0.0)
        return LockInShape(edges, ratio[None], "the file that the mode names")
    if has_speeds(tree) and _swept(tree):
        return _of_speeds(tree, mode, scruton_number, seed)
    peak = _peak(tree, scruton_number)
    low, high = mode.lock_in or (peak * (1.0 - LOCK_IN_MARGIN), peak * (1.0 + LOCK_IN_MARGIN))
    v, edges = _cells(low, high)
    top = peak if low < peak < high else 0.5 * (low + high)
    source = f"assumed: linear to the largest at U/(fD) = {top:.3g} and linear from there"
    ratio = np.interp(v, [low, top, high], [0.0, 1.0, 0.0])[None]
    return LockInShape(edges, ratio, source, mode.lock_in is None, triangle=True)


def assumed_remarks(names: Sequence[str], shapes: Sequence[LockInShape]) -> list[str]:
    """What has to be said of hours where nothing tells how the amplitude depends on the speed: one for each shape."""
    of: dict[str, list[str]] = {}
    for name, shape in zip(names, shapes, strict=False):  # no shape without a wind climate
        if shape.triangle:
            low, high = shape.edges[[0, -1]]
            reach = f"between the stated ends of lock-in, {low:.3g} and {high:.3g}"
            if shape.assumed:
                reach = f"from {100.0 * LOCK_IN_MARGIN:g} % below that speed to as much above it"
            of.setdefault(f"{shape.source}, {reach}", []).append(name)
    return [
        said(
            f"hours of mode{'s' * (len(modes) > 1)} {', '.join(modes)}: the amplitude against the wind speed is "
            f"{words}. Tests of one rig at three wind speeds, or a ",
            key("lock_in_shape of the mode", "curve of the mode's amplitude against the wind speed"),
            ", would tell it",
        )
        for words, modes in of.items()
    ]


def _swept(tree: "xr.DataTree") -> bool:
    """Whether one rig was tested at speeds enough within lock-in."""
    group = tree["speeds"]
    rigs, speeds = (group[f"point_{of}"].to_numpy() for of in ("rig", "velocity"))
    counts = [
        1 + np.count_nonzero(np.diff(np.log(np.sort(speeds[rigs == rig]))) > np.log(DISTINCT_SPEEDS))
        for rig in np.unique(rigs)
    ]
    return bool(max(counts, default=0) >= FEWEST_SPEEDS)


def _of_speeds(tree: "xr.DataTree", mode: Mode, scruton_number: float, seed: int) -> LockInShape:
    drawn = lock_in_velocities(tree)
    v, edges = _cells(*(mode.lock_in or (float(drawn[0]), float(drawn[-1]))))
    at = np.append(np.clip(v, drawn[0], drawn[-1]), drawn)  # beyond what was tested the end of it is held
    amplitude = lock_in_draws(tree, scruton_number, at, seed=seed)
    # Where the law of the speeds lets it die at this Scruton number, the shape is that of the tests; where there, too,
    # the whole range counts as the peak.
    dead = ~(amplitude > 0.0).any(axis=1)
    reference = float(tree["speeds"].attrs["reference_scruton_number"])
    amplitude[dead] = lock_in_draws(tree, reference, at, seed=seed)[dead]
    finite = np.isfinite(amplitude)
    most = np.where(finite, amplitude, 0.0).max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(finite & (most > 0.0), amplitude / most, 1.0)[:, : v.size]
    return LockInShape(edges, ratio, "tests and sweeps at other wind speeds")


def _peak(tree: "xr.DataTree", scruton_number: float) -> float:
    """Reduced velocity of the peak test whose Scruton number is nearest."""
    names = list(peak_names(tree))
    data = tree["constant_data"]
    numbers = np.array([np.median(draws_of(tree, "scruton_number", name)) for name in names])
    nearest = int(np.argmin(np.abs(numbers - scruton_number)))
    speed, frequency = (float(data[name].sel(test=names[nearest])) for name in ("wind_speed", "frequency"))
    return speed / (frequency * float(data["depth"]))


def _cells(low: float, high: float) -> tuple[FloatArray, FloatArray]:
    edges = np.linspace(low, high, _CELLS + 1)
    return 0.5 * (edges[1:] + edges[:-1]), edges


def lock_in_hours(
    models: Sequence[ModeModel],
    draws: Sequence[Draws],
    limits: Sequence[float],
    shapes: Sequence[LockInShape],
    seed: int,
    left: Mapping[str, Sequence[FloatArray]] | None = None,
) -> LockInHours | None:
    """Hours of every mode in lock-in and beyond its limit, without added damping; None without a wind climate.

    `left` has what is done about it, with draws of the peak amplitude by mode, (S,): the hours expected then are told,
    too, with the amplitude over its largest as it is at the bridge's own Scruton number.
    """
    wind = models[0].bridge.wind
    if wind is None:
        return None
    ranges, a_year, exceeding, curves = [], [], [], []
    beyond: dict[str, list[float]] = {name: [] for name in left or ()}
    for k, (model, drawn, limit, shape) in enumerate(zip(models, draws, limits, shapes, strict=True)):
        speed = model.mode.frequency.mean * model.bridge.depth
        cells = np.diff([wind.between(0.0, edge * speed) for edge in shape.edges])
        rng = np.random.default_rng([seed, 0x40F5, k])
        ratio = shape.ratio[rng.integers(len(shape.ratio), size=len(drawn))]
        amplitude = _over_speeds(drawn.amplitude(0.0), ratio)
        hours = np.zeros(len(drawn))
        after = {name: _over_speeds(peaks[k], ratio) for name, peaks in (left or {}).items()}
        expected = dict.fromkeys(after, 0.0)
        for each in wind.turbulence or _STEADY_AIR:
            factor = each.factor.quantile(rng.random(len(drawn)))[:, None]
            hours += each.share * ((factor * amplitude > limit) @ cells)
            for name, at in after.items():
                expected[name] += each.share * float(((factor * at > limit) @ cells).mean())
        for name, total in expected.items():
            beyond[name].append(total)
        ranges.append((float(shape.edges[0]), float(shape.edges[-1])))
        a_year.append(float(cells.sum()))
        exceeding.append((float(hours.mean()), *np.quantile(hours, [0.05, 0.95]).tolist()))
        middle = 0.5 * (shape.edges[1:] + shape.edges[:-1])
        band = np.quantile(amplitude, [0.05, 0.5, 0.95], axis=0, method="inverted_cdf")
        curves.append(LockInCurve(middle, middle * speed, *band))
    mean, low, high = zip(*exceeding, strict=True)
    return LockInHours(
        tuple(ranges), tuple(shape.assumed for shape in shapes), tuple(a_year), mean, low, high,
        tuple(shape.source for shape in shapes), tuple(curves), {name: tuple(of) for name, of in beyond.items()},
    )  # fmt: skip


def _over_speeds(peak: FloatArray, ratio: FloatArray) -> FloatArray:
    """Amplitude (S, V) of draws (S,) of the largest; none where there is no lock-in, however large."""
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(peak[:, None] * ratio, nan=0.0, posinf=np.inf)
