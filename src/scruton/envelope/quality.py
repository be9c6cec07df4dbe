"""What a record is good for: its size, its noise, and what is to be said of it by itself."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Kind, Record
from scruton.envelope import thresholds
from scruton.envelope.clipping import CLIPPED
from scruton.envelope.cycles import misread
from scruton.envelope.lines import Line, second_line
from scruton.envelope.relaxation import Relaxation, relaxation
from scruton.envelope.ringdown import weighted_line
from scruton.envelope.sampling import Sampling, held_for, quantum_of, run_lengths, sampling
from scruton.envelope.slips import phase_slip
from scruton.envelope.standing import Swing, beats, swing
from scruton.envelope.types import Cycles
from scruton.envelope.windows import Windows, cut
from scruton.shown import fields_in_brief, shown


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class RecordQuality:
    """What `assess` finds; amplitudes in A/D or rad.

    Attributes
    ----------
    name : str
        The record.
    duration : float
        Length [s].
    sample_rate : float
        Samples per second [Hz].
    cycles : int
        Whole cycles that could be demodulated.
    amplitude_range : (float, float)
        Smallest and largest amplitude of a cycle; none below zero, as noise makes it.
    signal_to_noise : float
        Root mean square of the oscillation over that of the noise per sample.
    frequency : float
        Dominant frequency [Hz].
    second_line : Line or None
        The strongest other line of the spectrum, if there is one.
    stable_amplitude : float
        As given, or from the exponential fitted to the envelope; NaN where neither applies (free decay).
    remarks : tuple of Remark
        What is to be said of the record by itself.
    relaxation : Relaxation or None
        The exponential fitted to the envelope; None for steady records.
    swing : Swing or None
        How a growth or decay passes the amplitude where it comes to stand, and returns; None where it does not.
    """

    name: str
    duration: float
    sample_rate: float
    cycles: int
    amplitude_range: tuple[float, float]
    signal_to_noise: float
    frequency: float
    second_line: Line | None
    stable_amplitude: float
    remarks: tuple[Remark, ...]
    relaxation: Relaxation | None
    swing: Swing | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """The remarks as plain sentences, each naming the record."""
        return tuple(remark.sentence for remark in self.remarks)


def assess(record: Record, cycles: Cycles, *, stable_amplitude: float | None = None) -> RecordQuality:
    """Measure a record and collect its warnings.

    Parameters
    ----------
    record : Record
        As the campaign gives it.
    cycles : Cycles
        Its demodulation.
    stable_amplitude : float, optional
        As the laboratory states it (A/D or rad); otherwise the fitted exponential tells it.
    """
    steps = sampling(record.time)
    smooth = cycles.smoothed()
    transient = record.kind in (Kind.GROWTH, Kind.DECAY)
    relaxed = relaxation(cycles) if record.kind is not Kind.STEADY else None
    swung = swing(cycles) if transient else None
    stable = _stable(stable_amplitude, relaxed if transient else None, record, smooth)
    if swung and stable_amplitude is None:
        stable = float(swung.standing.amplitude.mean())
    line = None if record.is_envelope else second_line(record.time, record.response, cycles)
    remarks = [
        *(_transient_remarks(record, stable, relaxed) if transient and relaxed and not swung else ()),
        *(_swing_remarks(record, swung) if swung else ()),
        *(_beat_remarks(record, cycles) if record.kind is Kind.STEADY or (transient and not swung) else ()),
        *_sampling_remarks(record, steps),
        *([] if record.is_envelope else _signal_remarks(record, cycles, line, 1.0 / steps.step)),
    ]
    return RecordQuality(
        name=record.name,
        duration=float(record.time[-1] - record.time[0]),
        sample_rate=1.0 / steps.step,
        cycles=len(cycles.time),
        amplitude_range=cycles.amplitude_range,
        signal_to_noise=float(np.sqrt(np.mean(cycles.amplitude**2) / 2.0) / cycles.noise_sd),
        frequency=cycles.reference_frequency,
        second_line=line,
        stable_amplitude=stable,
        remarks=tuple(remarks),
        relaxation=relaxed,
        swing=swung,
    )


def _stable(stated: float | None, relaxed: Relaxation | None, record: Record, smooth: np.ndarray) -> float:
    if stated is not None:
        return stated
    if relaxed is not None:
        return relaxed.stable_amplitude
    return float(np.sqrt(np.mean(smooth**2))) if record.kind is Kind.STEADY else float("nan")


def _note(record: Record, kind: str, text: str, alike: str, value: float, excess: float = 1.0) -> Remark:
    return Remark(Severity.NOTE, kind, "record", record.name, text, alike, value, excess)


def _transient_remarks(record: Record, stable: float, relaxed: Relaxation) -> Iterator[Remark]:
    first, low, high = relaxed.first_amplitude, thresholds.DECAY_FROM, thresholds.GROWTH_FROM
    if record.kind is Kind.DECAY and first < low * stable:
        yield _note(
            record, "decay start",
            f"the decay starts at {first / stable:.2f} times the stable amplitude; from below {low} times, the "
            "rate of decay is hardly told from turbulence.",
            f"the decay starts at {{}} times the stable amplitude, below {low} times,", first / stable,
        )  # fmt: skip
    if record.kind is Kind.GROWTH and first > high * stable:
        yield _note(
            record, "growth start",
            f"the growth starts at {first / stable:.2f} times the stable amplitude; it should start below "
            f"{high}, so that the damping at small amplitude is seen.",
            f"the growth starts at {{}} times the stable amplitude, above {high} times,", first / stable,
            first / stable / high,
        )  # fmt: skip
    duration, least = float(record.time[-1] - record.time[0]), thresholds.RELAXATIONS
    if duration < least * relaxed.time:
        yield _note(
            record, "length",
            f"the record lasts {duration:.3g} s, {duration / relaxed.time:.1f} relaxation times of {relaxed.time:.3g} "
            f"s; below {least:g} the stable amplitude is an extrapolation.",
            f"the record lasts {{}} relaxation times, below the {least:g} that show the stable amplitude,",
            duration / relaxed.time, least * relaxed.time / duration,
        )  # fmt: skip


def _swing_remarks(record: Record, swung: Swing) -> Iterator[Remark]:
    past = "the amplitude passes the one where it comes to stand by {} and returns"
    why = (
        "as no damping makes it that depends on the amplitude alone (an air that remembers does, or a wind that "
        "changes); only where it stands is it used, like lock-in, and no rate of relaxation"
    )
    yield Remark(
        Severity.DOUBT, "swing", "record", record.name, f"{past.format(f'{swung.beyond:.0%}')}, {why}.",
        f"{past.format('{} %')}, {why},", 100.0 * swung.beyond, swung.beyond / thresholds.SWING,
    )  # fmt: skip


def _beat_remarks(record: Record, cycles: Cycles) -> Iterator[Remark]:
    if (ends := beats(cycles)) is None:
        return
    low, high = max(ends[0], 0.0), ends[1]
    ratio = high / max(low, 1e-3 * high)  # of one that is lost in the noise: what `beats` takes for it
    what = "there is no one stable amplitude. What is called so is the mean; hold a limit against the upper end, too"
    yield Remark(
        Severity.DOUBT, "beat", "record", record.name,
        f"the amplitude rises and falls to the end of the record, between {low:.3g} and {high:.3g}: {what}.",
        f"the amplitude rises and falls to the end, by up to {{}} times: {what},", ratio, ratio,
    )  # fmt: skip


def _sampling_remarks(record: Record, steps: Sampling) -> Iterator[Remark]:
    if steps.jitter > thresholds.JITTER:
        off = 100.0 * steps.jitter
        yield _note(
            record, "jitter",
            f"the sampling is not uniform; steps depart from {steps.step:.4g} s by up to {off:.0f} %.",
            "the sampling is not uniform; steps depart from the usual one by up to {} %",
            off, steps.jitter / thresholds.JITTER,
        )  # fmt: skip
    if len(steps.gaps):
        longest = float(np.max(np.diff(steps.gaps, axis=1)))
        yield _note(
            record, "gap",
            f"{len(steps.gaps)} gap{'s' if len(steps.gaps) > 1 else ''} in the record, the longest {longest:.3g} s, "
            f"the first at {steps.gaps[0, 0]:.4g} s; cycles inside are left out.",
            "gaps (cycles inside are left out), the longest of {} s,", longest,
        )  # fmt: skip


def _signal_remarks(record: Record, cycles: Cycles, line: Line | None, sample_rate: float) -> Iterator[Remark]:
    largest = float(np.max(cycles.amplitude))
    # a filter rounds what was clipped
    if record.band is None and (side := _clipped_side(record.time, record.response, cycles)):
        yield Remark(
            Severity.DOUBT, CLIPPED, "record", record.name,
            f"the signal is clipped {side}: samples pile up at the extreme reading, and amplitudes look too small.",
            f"the signal is clipped {side} (samples pile up at the extreme reading)",
        )  # fmt: skip
    if (held := held_for(record.response)) > 1:
        yield _note(
            record, "held",
            f"every reading stands for {held} samples, as a rule: the sensor is slower than the sampling, and late.",
            "every reading stands for {} samples, as a rule,", held, held,
        )  # fmt: skip
    if (off := misread(record.response, cycles)) > thresholds.COARSE:
        step = quantum_of(record.response)
        share, why = f"{step / np.median(cycles.amplitude):.0%} of the usual amplitude", "no noise blurs them enough"
        yield Remark(
            Severity.DOUBT, "steps", "record", record.name,
            f"the readings come in steps of {step:.3g}, {share}, and {why}: amplitudes are off by up to {off:.0%}, "
            "alike from cycle to cycle.",
            f"the readings come in steps, and {why}: amplitudes are off by up to {{}} %, alike from cycle to cycle,",
            100.0 * off, off / thresholds.COARSE,
        )  # fmt: skip
    if slip := phase_slip(cycles):
        why = "samples were lost, pieces were joined, or something struck"
        yield Remark(
            Severity.DOUBT, "slip", "record", record.name,
            f"the phase slips by {abs(slip.cycles):.2g} of a cycle from one cycle to the next, at {slip.time:.4g} s: "
            f"{why}; `start` and `stop` leave out what lies on one side.",
            f"the phase slips by {{}} of a cycle from one to the next ({why})",
            abs(slip.cycles), abs(slip.cycles / slip.sd) / thresholds.SLIP_SIGMAS,
        )  # fmt: skip
    offset, drift = _offset_and_drift(record, cycles)
    if abs(offset) > thresholds.OFFSET * largest:
        yield _note(
            record, "offset",
            f"the signal has an offset of {offset:.3g}, {100 * abs(offset) / largest:.0f} % of the largest amplitude; "
            "it is removed.",
            "the signal has an offset of {} % of the largest amplitude, which is removed,",
            100.0 * abs(offset) / largest, abs(offset) / largest / thresholds.OFFSET,
        )  # fmt: skip
    if abs(drift) > thresholds.MEAN_DRIFT * largest:
        yield _note(
            record, "mean drift",
            f"the mean drifts by {drift:.3g} over the record, {100 * abs(drift) / largest:.0f} % of the largest "
            "amplitude; it is removed.",
            "the mean drifts by {} % of the largest amplitude, which is removed,",
            100.0 * abs(drift) / largest, abs(drift) / largest / thresholds.MEAN_DRIFT,
        )  # fmt: skip
    change, low, high = _frequency_drift(cycles)
    if change > thresholds.FREQUENCY_DRIFT:
        still = "the stiffness depends on the amplitude, or changes"
        why = still if record.kind is Kind.FREE_DECAY else "stiffness, wind speed or lock-in changes"
        yield _note(
            record, "frequency drift",
            f"the frequency drifts by {100 * change:.1f} %, between {low:.4g} and {high:.4g} Hz; "
            f"{why} while the record runs.",
            "the frequency drifts by {} %", 100.0 * change, change / thresholds.FREQUENCY_DRIFT,
        )  # fmt: skip
    if line is not None and line.relative > thresholds.SECOND_LINE:
        what = f"the harmonic of order {line.harmonic}" if line.harmonic else "another motion or pick-up"
        if hum := line.mains(sample_rate):
            alias = "" if abs(line.frequency - hum) < 1.0 else "an alias of "
            what = f"{alias}the mains of {hum:g} Hz, which a `band` of the record leaves out"
        yield _note(
            record, "second line",
            f"a second line at {line.frequency:.4g} Hz has {100 * line.relative:.0f} % of the height of the main one "
            f"at {cycles.reference_frequency:.4g} Hz ({what}).",
            f"a second line ({what}) has {{}} % of the height of the main one", 100.0 * line.relative,
            line.relative / thresholds.SECOND_LINE,
        )  # fmt: skip


def _clipped_side(time: FloatArray, response: FloatArray, cycles: Cycles) -> str:
    """Say where a record is clipped: "above", "below", "above and below", or "" where it is not.

    Two signs are looked for, in the cycles that reach the extreme: the extreme reading repeated in a row, more
    often than rounding explains, and a top that holds far more samples than a sine's (a sensor that saturates softly):
    than a sine's on the average, and than those of the sine that was followed, at the very times of the samples. Where
    these keep step with the motion, every crest has the same few.
    """
    y = response - float(np.mean(response))
    # where the mean drifts by more than the motion, the end of the drift is the extreme, and its cycles are all top
    drifts = np.ptp(y) > 2.0 * thresholds.SWEPT * float(np.max(cycles.amplitude))
    windows = cut(time, cycles.reference_frequency)

    def sine() -> FloatArray:
        turned = 2.0 * np.pi * cycles.reference_frequency * (time - cycles.time[0])
        phase = turned + np.interp(time, cycles.time, cycles.phase)
        return np.asarray(np.interp(time, cycles.time, cycles.amplitude) * np.cos(phase))

    sides = [
        word
        for word, sign in (("above", 1.0), ("below", -1.0))
        if _piled_up(y, sign, None if drifts else sine, windows)
    ]
    return " and ".join(sides)


def _piled_up(response: FloatArray, sign: float, sine: Callable[[], FloatArray] | None, windows: Windows) -> bool:
    """Whether samples pile up at the top of a record times a sign; no softness is looked for where no sine is given."""
    y = sign * response
    top = float(np.max(y))
    if top <= 0.0 or len(windows.number) == 0:
        return False
    per_cycle = np.median(windows.stop - windows.first)
    at_top = y >= top - 1e-9 * top
    # a rounded sine, too, repeats its largest reading, as long as it stays within half a quantum of it
    held = held_for(y)
    honest = per_cycle / held / np.pi * np.sqrt(2.0 * min(quantum_of(y), top) / top)
    if np.max(run_lengths(at_top)) >= held * max(thresholds.RUN, 1.3 * honest + 2.0):
        return True
    if sine is None:
        return False
    share, of_sines = _share_at_top(y, windows), float(np.arccos(1.0 - thresholds.TOP) / np.pi)
    # the sine is as long as the record: it is made where the average one does not tell already
    return share > thresholds.CROWDED * of_sines and share > thresholds.CROWDED * _share_at_top(sign * sine(), windows)


def _share_at_top(y: FloatArray, windows: Windows) -> float:
    """Share of samples near the largest reading, in the cycles that reach it; 0 where they are too few to tell."""
    top = float(np.max(y))
    stops = np.stack([windows.first, windows.stop], axis=1).ravel()
    highest = np.maximum.reduceat(np.append(y, -np.inf), stops)[::2]
    reach = highest > top * (1.0 - 0.25 * thresholds.TOP)
    if np.count_nonzero(reach) < 3:
        return 0.0
    crowd = np.add.reduceat(np.append(y > top * (1.0 - thresholds.TOP), False).astype(float), stops)[::2]
    return float(np.sum(crowd[reach]) / np.sum((windows.stop - windows.first)[reach]))


def _offset_and_drift(record: Record, cycles: Cycles) -> tuple[float, float]:
    """Offset, and change of the mean over the record, from a line through the means of whole cycles."""
    f = cycles.reference_frequency
    block = np.floor((record.time - record.time[0]) * f).astype(np.intp)
    edges = np.flatnonzero(np.diff(block, prepend=-1))  # the last cycle is not whole
    means = np.add.reduceat(record.response, edges)[:-1]
    means[-1] = np.sum(record.response[edges[-2] : edges[-1]])
    means /= np.diff(edges)
    x = np.linspace(-0.5, 0.5, len(means))
    return float(np.mean(means)), float(np.sum(x * means) / np.sum(x * x))


def _frequency_drift(cycles: Cycles) -> tuple[float, float, float]:
    """Relative range of the frequency over stretches of the record that show it clearly, with both ends."""
    count = max(2, min(20, len(cycles.time) // 10))
    f, precision = [], []
    for part in np.array_split(np.arange(len(cycles.time)), count):
        usable = part[cycles.amplitude[part] > thresholds.STANDS_OUT_OF_NOISE * cycles.standard_error[part]]
        if len(usable) < 5:
            continue
        w = (cycles.amplitude[usable] / cycles.standard_error[usable]) ** 2
        slope, spread, residual = weighted_line(cycles.time[usable], cycles.phase[usable], w)
        chi2 = max(1.0, float(np.sum(w * residual**2)) / (len(usable) - 2))
        f.append(cycles.reference_frequency + slope / (2.0 * np.pi))
        precision.append(np.sqrt(chi2 / spread) / (2.0 * np.pi))
    if len(f) < 2:
        return 0.0, cycles.reference_frequency, cycles.reference_frequency
    low, high = int(np.argmin(f)), int(np.argmax(f))
    change = f[high] - f[low]
    # only what the precision of the stretches cannot explain
    certain = change > 4.0 * np.hypot(precision[low], precision[high])
    return (change / cycles.reference_frequency if certain else 0.0), f[low], f[high]
