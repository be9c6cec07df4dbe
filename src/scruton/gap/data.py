"""A campaign as diagnosis reads it: still air and the peak tests, the cycles of every record, what belongs to each."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign import peak_tests
from scruton.campaign.remarks import Remark
from scruton.campaign.schema import Campaign, Kind, Record
from scruton.dynamics import Setting
from scruton.dynamics.cycles import ABSENT, Channels, gaps
from scruton.dynamics.effects import Layout
from scruton.dynamics.effects.aerodynamic import SAME_SPEED
from scruton.dynamics.effects.terms import HATS, CutOff
from scruton.envelope import Cycles, usable, weigh
from scruton.envelope.consistency import check_units, review
from scruton.envelope.flat_tops import flat_top
from scruton.envelope.harmonics import third_harmonic
from scruton.envelope.types import OtherMode
from scruton.errors import InputError
from scruton.gap.stated import clear, damping_sd, rung_down
from scruton.gap.thresholds import BESIDE_THIRD, BEYOND_PEAKS, DIES_OUT, FEWEST_OTHER_SPEEDS, KEPT_UP_BESIDE_THIRD
from scruton.infer.cards import ModelCard, load_card
from scruton.stats.priors import Prior

_TYPICAL = 0.004  # damping ratio where none is stated or measured
_DIRECTION = {Kind.GROWTH: 1, Kind.DECAY: -1}
FLOOR = 2e-4  # of the amplitude: what a demodulated amplitude may be off by, beside its noise


@dataclass(frozen=True, eq=False)
class GapData:
    """The data of one campaign.

    Attributes
    ----------
    campaign : Campaign
    channels : Channels
    layout : Layout
        Its reference amplitude and rate are first guesses until the null model has been fitted.
    tests, rigs : tuple of str
        Names, in the order of the numbers in the layout.
    middle : int
        Record that the shared parameters are referred to (of the test with the middle Scruton number); -1: still air.
    aero_ratio, drive_ratio : (R,) arrays
        Linear aerodynamic damping and drive of each record over those of the middle one, for equal Y1 and epsilon.
    mass_sd : (R,) array
        Of the logarithm of the mass ratio.
    damping : (rigs,) array
        Stated structural damping, NaN where none is.
    damping_sd : (rigs,) array
        Relative; 1 where none is stated.
    nominal_damping : (R,) array
        Damping ratio of the record's rig as stated, or a typical one.
    cycles : dict
        By name of record.
    priors : dict
        Of the null model, by parameter.
    at_other_speeds : GapData or None
        The same with more records at the end: of tests at other speeds of its rigs, where the reduced velocity lies
        between those of the peak tests, or a tenth of their span beyond; all of them where a single rig was tested.
        None where there are none.
    repeats : dict
        Tests of the rig, and in the wind, of a peak test, as whose their records are read: their numbers, and its own.
    remarks : sequence of Remark
        What the records say against what is stated of them.
    modes : sequence of tuple of float
        Frequencies [Hz] of the modes that a release sets going in any record, used or not, or the wind keeps up at no
        large amplitude, each with that of the response beside it.
    """

    campaign: Campaign
    channels: Channels
    layout: Layout
    tests: tuple[str, ...]
    rigs: tuple[str, ...]
    middle: int
    aero_ratio: FloatArray
    drive_ratio: FloatArray
    mass_sd: FloatArray
    damping: FloatArray
    damping_sd: FloatArray
    nominal_damping: FloatArray
    cycles: Mapping[str, Cycles]
    priors: Mapping[str, Prior]
    at_other_speeds: "GapData | None" = None
    repeats: Mapping[int, int] = field(default_factory=dict)
    remarks: Sequence[Remark] = ()
    modes: Sequence[tuple[float, float]] = ()

    @property
    def first_in_wind(self) -> dict[int, int]:
        """First record of every test that has records here, by the numbers of both."""
        return _first_in_wind(self.layout.test)

    @property
    def of_one_rig(self) -> bool:
        """Whether a single rig was tested in the wind."""
        return np.unique(self.layout.rig[self.layout.wind]).size == 1

    def referred_to(self, amplitude: float, rate: float) -> "GapData":
        """The same data with other reference amplitude and rate."""
        more = self.at_other_speeds
        return replace(
            self,
            layout=replace(self.layout, reference_amplitude=amplitude, reference_rate=rate),
            at_other_speeds=None if more is None else more.referred_to(amplitude, rate),
        )


def load_gap(campaign: Campaign, card: ModelCard | None = None) -> GapData:
    """Demodulate every record and note what belongs to it.

    Parameters
    ----------
    campaign : Campaign
    card : ModelCard, optional
        Gives the priors of the null model; the shipped default by default.

    Raises
    ------
    InputError
        If there is no record, or none that can be demodulated: others are set aside, as the campaign's remarks say; if
        records of one test cannot be of one unit.
    """
    card = card or load_card()
    campaign, cycles = usable(campaign, clipped=True)
    inspection = weigh(campaign, cycles, {})
    check_units(inspection)
    stable = {
        test.name: float(np.median([settled_end(cycles[record.name]) for record in test.records]))
        for test in campaign.tests
        if test.records
    }
    peaks = {test.name for test in peak_tests(campaign, stable)} if stable else set()
    modes = [(mode.frequency, track.reference_frequency) for track in cycles.values() for mode in track.released]
    modes += [
        (mode.frequency, track.reference_frequency)
        for track in cycles.values()
        for mode in track.lasting
        if not mode.is_large
    ]
    data = _assembled(campaign, card, cycles, stable, peaks)
    data = replace(data, remarks=tuple(review(inspection)), modes=tuple(modes))
    others = _between_peaks(data, cycles)
    if not others:
        return data
    return replace(data, at_other_speeds=_assembled(campaign, card, cycles, stable, peaks, others))


def _between_peaks(data: GapData, cycles: Mapping[str, Cycles]) -> set[int]:
    """Tests beside the peak tests whose reduced velocity lies between those, by number; all of a single rig."""
    read = data.first_in_wind.keys() | data.repeats.keys()
    rest = [j for j, test in enumerate(data.campaign.tests) if test.records and j not in read]
    if data.of_one_rig:  # fewer tell no law of the speed from what every speed has by its own
        return set(rest) if len(rest) >= FEWEST_OTHER_SPEEDS else set()
    speeds = data.layout.reduced_velocity[data.layout.wind]
    if not speeds.size or not np.ptp(speeds) > SAME_SPEED * speeds.max():
        return set()
    reach = SAME_SPEED * float(speeds.max()) + BEYOND_PEAKS * float(np.ptp(speeds))
    low, high = float(speeds.min()) - reach, float(speeds.max()) + reach
    return {j for j in rest if low <= _in_wind(data.campaign, j, cycles)[1] <= high}


def _repeats(campaign: Campaign, peaks: Sequence[int], cycles: Mapping[str, Cycles]) -> dict[int, int]:
    """Tests that repeat one of the peak tests, the same rig in the same wind, by number, and which."""
    of_rig = {campaign.tests[j].rig: j for j in peaks if campaign.tests[j].records}
    found = {}
    for j, test in enumerate(campaign.tests):
        peak = of_rig.get(test.rig, j)
        if peak != j and test.records and test.peak is not False:
            own, its = (np.array(_in_wind(campaign, k, cycles)[:2]) for k in (j, peak))
            if np.all(np.abs(own - its) < SAME_SPEED * its):
                found[j] = peak
    return found


def _assembled(
    campaign: Campaign,
    card: ModelCard,
    cycles: Mapping[str, Cycles],
    stable: Mapping[str, float],
    peaks: Collection[str],
    others: Collection[int] = (),
) -> GapData:
    """Still air and the peak tests, then those tests that are named by their numbers."""
    rigs, tests = (tuple(owner.name for owner in owners) for owners in (campaign.rigs, campaign.tests))
    entries = [(record, i, -1) for i, rig in enumerate(campaign.rigs) for record in rig.records]
    numbers = [j for j, name in enumerate(tests) if name in peaks]
    again = _repeats(campaign, numbers, cycles)
    entries += [
        (record, rigs.index(campaign.tests[j].rig), j)
        for j in (*numbers, *sorted(others))
        for k in (j, *(k for k, of in again.items() if of == j))
        for record in campaign.tests[k].records
    ]
    if not entries:
        raise InputError(campaign.path, "", "no record in any rig or peak test", "records to diagnose")
    cycles = {record.name: _moving(cycles[record.name]) if j < 0 else cycles[record.name] for record, _, j in entries}
    records = [record for record, _, _ in entries]
    of_rig, of_test = (np.array([entry[k] for entry in entries]) for k in (1, 2))
    omega = 2.0 * np.pi * np.array([campaign.rigs[i].frequency.mean for i in of_rig])
    stated = [rig.damping_ratio for rig in campaign.rigs]
    damping = np.array([ratio.mean if ratio else np.nan for ratio in stated])
    shown = np.array(
        [rung_down([cycles[one.name] for one in rig.records], rig.frequency.mean) for rig in campaign.rigs]
    )
    nominal = np.where(np.isfinite(damping), damping, np.where(np.isfinite(shown), shown, _TYPICAL))[of_rig]
    in_wind = np.array([_in_wind(campaign, j, cycles, xi) for j, xi in zip(of_test, nominal, strict=True)])
    sc, speed, aero, drive, mass_sd = (column.copy() for column in in_wind.T)
    by_sc = sorted((r for j, r in _first_in_wind(of_test).items() if tests[j] in peaks), key=lambda r: sc[r])
    k = (len(by_sc) - 1) // 2
    middle = by_sc[k] if by_sc else -1
    demodulated = [cycles[record.name] for record in records]
    largest = np.array([float(np.max(track.amplitude)) for track in demodulated])
    base, reference, rate = 0, float(np.exp(np.mean(np.log(largest)))) * 0.5, 0.005
    if middle >= 0:
        levels = np.array([stable[tests[of_test[r]]] for r in by_sc])
        stand = levels >= DIES_OUT * levels.max()
        base, reference, rate = middle, float(levels[k] if stand[k] else np.median(levels[stand])), 0.01
        aero, drive = aero / aero[middle], drive / drive[middle]
    smallest = min(track.amplitude.min(where=clear(track), initial=np.max(track.amplitude)) for track in demodulated)
    knots = np.linspace(np.log(max(smallest, largest.max() / 100.0)), np.log(largest.max()), HATS)
    layout = Layout(
        records=tuple(record.name for record in records),
        rig=of_rig,
        test=of_test,
        direction=np.array([_DIRECTION.get(record.kind, 0) for record in records]),
        duration=np.array([float(np.ptp(track.time)) for track in demodulated]),
        omega=omega,
        largest=largest,
        reduced_velocity=speed,
        scruton_number=sc,
        reference_amplitude=reference,
        reference_rate=float(omega[base] * rate),
        reference_omega=float(omega[base]),
        knots=np.exp(knots),
        cut_off=_cut_off(records, cycles),
        unstated=frozenset(i for i, ratio in enumerate(stated) if ratio is None),
    )
    return GapData(
        campaign=campaign,
        channels=_channels(records, cycles, knots),
        layout=layout,
        tests=tests,
        rigs=rigs,
        middle=middle,
        aero_ratio=aero,
        drive_ratio=drive,
        mass_sd=mass_sd,
        damping=damping,
        damping_sd=damping_sd(stated, shown, card.damping_relative_sd),
        cycles=cycles,
        nominal_damping=nominal,
        priors=card.null_priors,
        repeats=again,
    )


def _cut_off(records: list[Record], cycles: Mapping[str, Cycles]) -> dict[int, CutOff]:
    """Records whose wave is seen to be cut off beyond chance, by number."""
    tops = {
        r: flat_top(record.time, record.response, cycles[record.name].reference_frequency)
        for r, record in enumerate(records)
        if not record.is_envelope and record.band is None  # a filter rounds what was cut off
    }
    chance = float(np.log(2.0 * len(records)))  # so many tops were looked at
    return {
        r: CutOff(min(top.levels), min(top.levels) / max(top.levels), top.nats - chance)
        for r, top in tops.items()
        if top.nats > chance
    }


def _moving(cycles: Cycles) -> Cycles:
    """The cycles up to rest, and as many of rest at most as of motion: a record may run on where friction has ended it.

    What is left there is the noise of the reading, of which no model of the motion has hundreds of cycles to explain.
    """
    seen = np.flatnonzero(clear(cycles))
    return cycles.part(slice(0, 2 * (int(seen[-1]) + 1))) if seen.size else cycles


def settled_end(cycles: Cycles) -> float:
    """Mean amplitude of the last fifth of a record."""
    return cycles.settled_amplitude


def _first_in_wind(test: np.ndarray) -> dict[int, int]:
    """First record of every test that has records here, by the numbers of both."""
    return {int(j): int(np.flatnonzero(test == j)[0]) for j in np.unique(test[test >= 0])}


def _in_wind(
    campaign: Campaign, j: int, cycles: Mapping[str, Cycles], damping_ratio: float = _TYPICAL
) -> tuple[float, ...]:
    """Scruton number, reduced velocity, linear aerodynamic damping and drive of a test, and sd of ln(mass ratio)."""
    if j < 0:
        return np.nan, np.nan, 0.0, 0.0, 0.0
    test = campaign.tests[j]
    rig = campaign.rig(test.rig)
    assert rig.mass is not None, "the loader refuses a test whose rig has no mass"
    setting = Setting(
        motion=campaign.section.motion,
        width=campaign.section.width,
        depth=campaign.section.depth,
        mass=rig.mass.mean,
        air_density=test.air_density.mean,
        wind_speed=test.wind_speed.mean,
        frequency=rig.frequency.mean,
        wind_frequency=float(np.median([cycles[r.name].reference_frequency for r in test.records])),
        damping_ratio=damping_ratio,
    )
    aero = float(setting.mass_ratio * np.asarray(setting.wind_speed) / np.asarray(setting.depth))
    mass_sd = float(np.hypot(rig.mass.relative_sd, test.air_density.relative_sd))
    return float(setting.scruton_number), 2.0 * np.pi / float(setting.K), aero, aero / float(setting.K), mass_sd


def _beside_third(record: Record, cycles: Mapping[str, Cycles]) -> FloatArray:
    """What a mode near three times the frequency may hide in the third harmonic of a record, (K,).

    So near a harmonic it is found in few of the records whose release sets it going; of what the wind keeps up some is
    left.
    """
    track = cycles[record.name]
    line = 3.0 * track.reference_frequency

    def near(found: Iterable[OtherMode]) -> list[OtherMode]:
        return [mode for mode in found if abs(mode.frequency - line) < BESIDE_THIRD * line]

    largest, margin = float(np.max(track.amplitude)), KEPT_UP_BESIDE_THIRD * line
    kept_up = (
        max((mode.relative for mode in track.lasting if abs(mode.frequency - line) < margin), default=0.0) * largest
    )
    modes = near(mode for other in cycles.values() for mode in other.released)
    if not modes or near(track.released) or record.kind is Kind.STEADY:
        return np.full(track.time.size, kept_up)
    rate, size = float(np.median([mode.rate for mode in modes])), max(mode.relative for mode in modes)
    return np.asarray(np.hypot(kept_up, size * largest * np.exp(-rate * (track.time - track.time[0]))))


def _channels(records: list[Record], cycles: Mapping[str, Cycles], knots: FloatArray) -> Channels:
    parts: list[dict[str, FloatArray]] = []
    for number, record in enumerate(records):
        track = cycles[record.name]
        size, period = track.time.size, 1.0 / track.reference_frequency
        third, error = np.zeros(size), np.full(size, np.inf)
        if not record.is_envelope and record.band is None:  # a band leaves no third harmonic
            third, error = third_harmonic(record.time, record.response, track)
            error = np.hypot(error, _beside_third(record, cycles))
        time = track.time - track.time[0]
        columns = {
            "amplitude": track.amplitude,
            "standard_error": np.hypot(track.standard_error, FLOOR * np.abs(track.amplitude)),
            "phase": track.phase - track.phase[0],
            "third": third,
            "third_error": np.where(np.isfinite(error), np.hypot(error, FLOOR * track.amplitude), ABSENT),
            "gap": gaps(track),
            "period": np.full(size, period),
            "time": time,
            "place": time / max(float(np.ptp(track.time)), period) - 0.5,
            "record": np.full(size, number, dtype=np.intp),
            "omega": np.full(size, 2.0 * np.pi * track.reference_frequency),
            "has_phase": np.full(size, not record.is_envelope),
        }
        parts.append(columns)
    return Channels(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]}, knots=knots)
