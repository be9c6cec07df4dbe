"""Which channels of a file are time, motion and wind, and in what unit."""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scruton.app.init.guess import Motion, Stretch, oscillation, stretches
from scruton.app.init.look import Channel, Source
from scruton.campaign import units
from scruton.campaign.schema import Kind

_TIME = re.compile(
    r"t|(?:(?:elapsed|relative|rel|test)[ _]?)?time|zeit|temps|times?tamps?|seconds|sec|x_value", re.IGNORECASE
)
_RATE = re.compile(r"fs|f_s|rate|sample_?rate|sampling_?rate|samplerate", re.IGNORECASE)
_STEP = re.compile(r"ts|dt|delta_?t|increment", re.IGNORECASE)
_WIND = re.compile(r"u|wind|wind[ _]?speed|velocity|u_?inf", re.IGNORECASE)
_WIND_CHANNEL = re.compile(r"u$|u_?inf|(?:mean|free)?[ _]?(?:wind|flow)|anemometer|pitot", re.IGNORECASE)
_CALM = 0.1  # m/s: the mean of an anemometer that stands still
_LENGTHS = re.compile(r"displ|heav|weg|auslenk|d[ée]plac|laser|lvdt|y|z|x", re.IGNORECASE)
_ANGLES = re.compile(r"rot|theta|phi|pitch|roll|torsi|twist|alpha|angle|winkel|psi", re.IGNORECASE)
_ACCELERATIONS = re.compile(r"acc|beschl|accél", re.IGNORECASE)
_VOLTS = ("v", "mv", "volt", "volts")
_ALIKE = 0.1  # of the variance: channels whose shares of the dominant line differ by less are alike
_PURE = 0.3  # of the variance, the least share of the dominant line in what is called motion
_STILL = re.compile(r"still|free|ring|calm|no_?wind|u0(?!\d)|ausschwing", re.IGNORECASE)
_SAID = re.compile(r"growth|gtr|decay|dtr", re.IGNORECASE)
_IN_WIND = re.compile(r"growth|gtr|dtr|build|lock|steady|wind|decay", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Found:
    """One record: where it lies, what moves in it, and the stretch that is meant."""

    source: Source
    response: Channel
    time: Channel | None
    rate: float | None  # Hz, where no channel tells the time; None: not known
    quantity: str  # as a record's table calls it
    stretch: Stretch
    wind_speed: float | None = None  # m/s, where the file says it
    wind_measured: bool = False  # by a channel, whose mean it is
    others: tuple[str, ...] = ()  # names of channels that say as plainly that they are motions

    @property
    def path(self) -> Path:
        """The file."""
        return self.source.path

    @property
    def timeless(self) -> bool:
        """Whether nothing tells its time: what stands for seconds are samples."""
        return self.time is None and self.response.clock is None and self.rate is None

    @property
    def uncalibrated(self) -> bool:
        """Whether the file holds what a sensor gave, in volts."""
        return _electrical(self.response)

    @property
    def angular(self) -> bool:
        """Whether it is a motion about an axis."""
        return self.quantity in _ANGULAR


def records(source: Source, rate: float | None) -> Iterator[Found]:
    """Find the records of a file; `rate` [Hz] is that of channels without any time."""
    scalars = {c.name: float(c.values[0]) for c in source.channels if c.values.size == 1}
    stated = next((value for name, value in scalars.items() if _RATE.fullmatch(name) and value > 0.0), None)
    step = next((value for name, value in scalars.items() if _STEP.fullmatch(name) and value > 0.0), None)
    own = stated or (1.0 / step if step else None) or rate
    groups = list(dict.fromkeys(c.group for c in source.channels if c.values.size > 1))
    for group in groups:
        members = [c for c in source.channels if c.group == group]
        yield from _record(source, members, own)


def _record(source: Source, members: Sequence[Channel], rate: float | None) -> Iterator[Found]:
    longest = [c for c in members if c.values.size >= 40]
    plain = [c for c in longest if _named(c) > 0]
    rising = [c for c in longest if bool((np.diff(c.values) > 0.0).all())]
    time = next((c for says in _TIMES for c in rising if says(c)), None)
    wind = next((float(c.values[0]) for c in members if c.values.size == 1 and _WIND.fullmatch(c.name)), None)
    blowing = None if wind is not None else _measured_wind(longest)
    candidates: list[tuple[tuple[int, float, float], Channel, Motion, float, float]] = []
    for channel in plain or longest:
        if channel is time or (time is not None and channel.values.size != time.values.size):
            continue
        start, step = _axis(channel, time, rate)
        motion = oscillation(channel.values, step)
        if motion is None or motion.share < _PURE * (not (_named(channel) and channel.unit)):
            continue
        # a second motion on a channel counts against it, the noise of the better of two does not
        pure = round(motion.share / _ALIKE)
        rank = _named(channel), pure, float(np.std(channel.values - np.median(channel.values)))
        candidates.append((rank, channel, motion, start, step))
    if not candidates:
        return
    (named, *_), channel, motion, start, step = max(candidates, key=lambda one: one[0])
    others = tuple(one.name for rank, one, *_ in candidates if rank[0] == named and one is not channel)
    speed = wind if wind is not None else blowing
    blows = _blows(source.path.stem) if speed is None else speed > 0.0
    for stretch in stretches(motion, start, step, wind=blows):
        if stretch.kind is Kind.STEADY and (
            said := _SAID.search(source.path.stem)
        ):  # too little to see: it is called so
            stretch = replace(stretch, kind=Kind.DECAY if said[0].lower() in ("decay", "dtr") else Kind.GROWTH)
        known = rate if time is None and channel.clock is None else None
        yield Found(
            source, channel, time, known, quantity_of(channel), stretch, speed or None, blowing is not None, others
        )


def quantity_of(channel: Channel) -> str:
    """What a channel holds, as a record's table calls it: by its unit, or its name."""
    if _electrical(channel) and _ACCELERATIONS.match(channel.name):
        return "acceleration"
    if channel.unit is None or _electrical(channel):
        return "rotation" if _ANGLES.match(channel.name) else "displacement"
    return next((name for name, one in QUANTITIES.items() if _fits(channel.unit, one)), "displacement")


def _measured_wind(channels: Iterable[Channel]) -> float | None:
    """Mean of a channel of wind speed [m/s], to three digits; zero for a calm, None where there is none."""
    for channel in channels:
        speed = channel.unit is None or _fits(channel.unit, units.SPEED)
        if speed and _WIND_CHANNEL.match(channel.name) and np.isfinite(channel.values).all():
            factor = units.unit_factor(channel.unit, units.SPEED) if channel.unit else 1.0
            mean = factor * float(np.mean(channel.values))
            return 0.0 if mean < _CALM else float(f"{mean:.3g}")
    return None


def unit_of(found: Iterable[Found]) -> str:
    """Guess the unit of channels of one name that state none, from the largest of their amplitudes."""
    some = list(found)
    largest = max(one.stretch.level for one in some)
    if some[0].angular:
        return "rad" if largest < 1.6 else "deg"
    return "m" if largest < 1.0 else "mm"


def _blows(stem: str) -> bool | None:
    if _STILL.search(stem):
        return False
    return True if _IN_WIND.search(stem) else None


def _axis(channel: Channel, time: Channel | None, rate: float | None) -> tuple[float, float]:
    """Start and step [s]; a step of one where nothing tells it."""
    if time is not None:
        factor = units.unit_factor(time.unit, units.TIME) if time.unit and _fits(time.unit, units.TIME) else 1.0
        values = time.values * factor
        return float(values[0]), float(values[-1] - values[0]) / (len(values) - 1)
    return channel.clock or (0.0, 1.0 / rate if rate else 1.0)


def _named(channel: Channel) -> int:
    """How plainly a channel says that it is a motion: by its unit, by a word, as what is integrated; 0 where not."""
    if channel.unit and not _electrical(channel):
        return next((rank for one, rank in _RANKS if _fits(channel.unit, one)), -1)
    accelerations = _electrical(channel) and _ACCELERATIONS.match(channel.name)
    return 2 * bool(_LENGTHS.match(channel.name) or _ANGLES.match(channel.name)) or bool(accelerations)


def _electrical(channel: Channel) -> bool:
    return channel.unit is not None and channel.unit.lower() in _VOLTS


def _fits(unit: str, dimension: units.Dimension) -> bool:
    try:
        units.unit_factor(unit, dimension)
    except ValueError:
        return False
    return True


# What tells the time, the plainest first: a name, a unit, or a place where columns have no names.
_TIMES: tuple[Callable[[Channel], bool], ...] = (
    lambda one: _TIME.fullmatch(one.name) is not None,
    lambda one: one.unit is not None and _fits(one.unit, units.TIME),
    lambda one: one.name.startswith("column ") or str(one.key).endswith("]"),
)
QUANTITIES = {
    "displacement": units.LENGTH, "rotation": units.ANGLE, "acceleration": units.ACCELERATION,
    "angular_acceleration": units.ANGULAR_ACCELERATION,
}  # fmt: skip
SCALES = {  # how a calibration of a sensor that gives volts is spelt
    "displacement": "0.18 m/V", "rotation": "2 deg/V", "acceleration": "100 mV/g",
    "angular_acceleration": "2 rad/s^2/V",
}  # fmt: skip
_ANGULAR = ("rotation", "angular_acceleration")
_RANKS = [(one, 3 if name in ("displacement", "rotation") else 1) for name, one in QUANTITIES.items()]
