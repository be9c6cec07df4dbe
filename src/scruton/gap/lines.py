"""Second lines: what moves beside the response in a record, a mode of its own, or hum."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.polynomial.chebyshev import chebfit, chebval
from scipy.ndimage import median_filter

from scruton.arrays import BoolArray, FloatArray
from scruton.campaign.schema import Campaign, Kind, Record
from scruton.dynamics.effects import CATALOGUE
from scruton.envelope import Cycles
from scruton.envelope.lines import apart_from_folded, apart_from_mains, harmonics
from scruton.envelope.types import OtherMode
from scruton.gap.data import GapData
from scruton.gap.thresholds import (
    BEAT_SIZE,
    DETUNING_MARGIN,
    FEWEST_BEATING,
    LINE_NATS,
    LINE_SIZE,
    MOST_DETUNING,
    NEAREST,
    ONE_SIDED,
    SAME_LINE,
    SMOOTH_DEGREE,
)


@dataclass(frozen=True, eq=False)
class SecondLine:
    """A second line in the spectrum of a record.

    Attributes
    ----------
    record : str
    frequency : float
        Hz.
    amplitude : float
        A/D or rad, of a steady line of that power.
    ratio : float
        Power over the local noise, minus ln of the number of frequencies looked at: nats against chance.
    dies : bool
        Whether it is a free vibration that was taken out of the record.
    """

    record: str
    frequency: float
    amplitude: float
    ratio: float
    dies: bool = False


def second_lines(
    campaign: Campaign, cycles: Mapping[str, Cycles], modes: Sequence[tuple[float, float]] = ()
) -> tuple[SecondLine, ...]:
    """Lines that matter beside the response in every record: what is left there, and large modes that died away.

    A line at the frequency of a mode that a release sets going in other records is that mode, and so is one that has
    its place beside the response of another rig: `modes` as of `GapData`.
    """
    used = [one for one, _, _ in campaign.records() if not one.is_envelope and one.name in cycles]
    found = []
    for record in used:
        track = cycles[record.name]
        lasting = (SecondLine(record.name, one.frequency, one.amplitude, one.nats) for one in track.lasting)
        seen = filter(None, (_near(record, track), _line(record, track), *lasting))
        line = max(seen, key=attrgetter("ratio"), default=None)
        own = track.reference_frequency
        places = (place for mode, response in modes for place in (mode, mode / response * own))
        if line and any(abs(line.frequency / place - 1.0) < SAME_LINE for place in places):
            line = None
        found += [*([line] if line else []), *(_died(record, mode, track) for mode in track.released if mode.is_large)]
    return tuple(found)


def _died(record: Record, mode: OtherMode, cycles: Cycles) -> SecondLine:
    """The line of a free vibration, as one of its power that lasts."""
    squared = float(np.mean(mode.motion(record.time) ** 2))
    nats = 0.5 * record.time.size * squared / cycles.noise_sd**2
    return SecondLine(record.name, mode.frequency, float(np.sqrt(2.0 * squared)), nats, dies=True)


def _line(record: Record, cycles: Cycles) -> SecondLine | None:
    inside = (record.time >= cycles.begin) & (record.time <= cycles.end)
    t, y = record.time[inside], record.response[inside]
    if t.size < 64:
        return None
    columns = np.column_stack([np.ones_like(t), harmonics(t, cycles)])
    rest = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
    window = np.hanning(t.size) ** 0.5
    power = np.abs(np.fft.rfft(rest * window)) ** 2
    step = float(np.median(np.diff(t)))
    frequency = np.fft.rfftfreq(t.size, step)
    f0, resolution = cycles.reference_frequency, 1.0 / (t[-1] - t[0])
    use = (frequency > 0.3 * f0) & (frequency < 2.85 * f0)
    for k in (1, 2):
        use &= np.abs(frequency - k * f0) > max(4.0 * resolution, 0.08 * f0)
    use &= apart_from_folded(frequency, f0, 1.0 / step, 4.0 * resolution)
    use &= apart_from_mains(frequency, 1.0 / step, resolution)
    if np.count_nonzero(use) < 12:
        return None
    # The floor is local: turbulence drives the response, whose skirts are no line.
    width = max(5, int(0.15 * f0 / resolution))
    peak, ratio = _highest(power, use, width)
    amplitude = float(2.0 * np.sqrt(power[peak]) / window.sum())
    if amplitude < LINE_SIZE * float(np.median(cycles.amplitude)):
        return None
    return SecondLine(record.name, float(frequency[peak]), amplitude, ratio)


def _near(record: Record, cycles: Cycles) -> SecondLine | None:
    """A mode so near the response that the two beat, in a free decay, where no wind makes them.

    Amplitude and phase go smoothly there, and what the mode adds turns one way round them: a damping or a frequency
    that varies makes two lines of one size, on either side.
    """
    count = cycles.amplitude.size
    if record.kind is not Kind.FREE_DECAY or count < FEWEST_BEATING:
        return None
    place, error = np.linspace(-1.0, 1.0, count), float(np.median(cycles.standard_error))
    amplitude = np.maximum(cycles.amplitude, error)

    def smooth(y: FloatArray) -> FloatArray:
        weights = amplitude / cycles.standard_error
        return np.asarray(chebval(place, chebfit(place, y, SMOOTH_DEGREE, w=weights)))

    turned = cycles.amplitude * np.exp(1j * (cycles.phase - smooth(cycles.phase)))
    window = np.hanning(count + 2)[1:-1] ** 0.5
    power = np.fft.fftshift(np.abs(np.fft.fft((turned - np.exp(smooth(np.log(amplitude)))) * window)) ** 2)
    off = np.fft.fftshift(np.fft.fftfreq(count))  # of the response's frequency
    use = (np.abs(off) > (SMOOTH_DEGREE + 3) / count) & (np.abs(off) < NEAREST)
    if np.count_nonzero(use) < FEWEST_BEATING:
        return None
    peak, ratio = _highest(power, use, max(5, count // 12))
    mirrored = float(np.interp(-off[peak], off, power))
    size = float(np.sqrt(power[peak]) / window.sum())
    if power[peak] < ONE_SIDED * mirrored or size < BEAT_SIZE * float(np.median(cycles.amplitude)):
        return None
    return SecondLine(record.name, float((1.0 + off[peak]) * cycles.reference_frequency), size, ratio)


def _highest(power: FloatArray, use: BoolArray, width: int) -> tuple[int, float]:
    """Where a power in use is highest above the median of its neighbours, and by how many nats over chance."""
    floor = median_filter(power, size=2 * width + 1, mode="nearest") / np.log(2.0)
    above = np.where(use, power / np.maximum(floor, 1e-300), 0.0)
    peak = int(np.argmax(above))
    return peak, float(above[peak] - np.log(np.count_nonzero(use)))


def unexplained_lines(lines: Sequence[SecondLine], names: Sequence[str], data: GapData) -> list[SecondLine]:
    """Lines beside the response, beyond chance, that none of the effects that are named brings; strongest first."""
    still = {name for name, wind in zip(data.layout.records, data.layout.wind, strict=True) if not wind}
    # Of a force off the response such lines are the signature, as near as one is sought: what stands in still air or
    # further off is another mode, or hum.
    forced = any(CATALOGUE[name].channel == "spectrum" for name in names)
    strong = sorted((one for one in lines if one.ratio > LINE_NATS), key=lambda one: -one.ratio)
    return [line for line in strong if not forced or line.record in still or _far_off(line, data)]


def detuned_by(line: SecondLine, data: GapData) -> float:
    """How far a line is off the response, relative to it."""
    return line.frequency / data.cycles[line.record].reference_frequency - 1.0


def _far_off(line: SecondLine, data: GapData) -> bool:
    """Whether a line is further from the response than a force that beats with it is sought."""
    return abs(detuned_by(line, data)) > MOST_DETUNING + DETUNING_MARGIN
