"""One case of the challenge: a campaign in memory, and the answer to it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.scenarios import IN_WIND, OPEN, STILL, Parameters, apply
from scruton.calibrate.challenge.sections import Body, RigTruth, limit_cycle, random_body, scruton_factor
from scruton.calibrate.thresholds import FAIR_AMPLITUDE, FAIR_RANGE, FAIR_RATE, SAME_CYCLE, STEADY, USUAL
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Rig, Test
from scruton.simulate import Disturbances, Noise, Truth, simulate_record
from scruton.simulate.disturbances import OFF

DESIGNS = {"full": 3, "one-rig": 1}
TURBULENCE, NOISE = (0.005, 0.015), (0.0, 0.02)
SAMPLES_PER_CYCLE = 28
_CYCLES = (40.0, 200.0)
_RELAXATIONS = (4.0, 6.0)
_STILL_RELAXATIONS = 3.0
_START = {Kind.GROWTH: (0.1, 0.2), Kind.DECAY: (2.1, 2.45)}
_STILL_START = (2.0, 2.4)
_REST = 0.05  # a still-air record ends where the amplitude has fallen to this part of its start
_KINDS = (Kind.GROWTH, Kind.GROWTH, Kind.DECAY, Kind.DECAY)
_TRIES = 400
_MASS_SD, _DAMPING_SD = 0.01, (0.02, 0.05)
HELD_OUT = (0.7, 1.4, 3.0)  # of the middle rig's Scruton number


@dataclass(frozen=True)
class DrawnCase:
    """A body with its effects and without; each rig's stable amplitude, and its relaxation rate [1/s]."""

    body: Body
    without: Body
    parameters: tuple[Parameters, ...]
    stable: tuple[tuple[float, float], ...]


def simulate_case(
    seed: int,
    index: int,
    effect: str | Sequence[str] | None,
    severity: float,
    design: str = "full",
    turbulence: float | tuple[float, float] = TURBULENCE,
    noise: float | tuple[float, float] = NOISE,
) -> tuple[Campaign, dict[str, Any]]:
    """Simulate one campaign of the challenge, which `seed` and `index` settle.

    Parameters
    ----------
    effect : str, sequence of str, or None
        None, one, or several at once, of the catalogue or outside of it.
    severity : float
        Of each.
    design : {"full", "one-rig"}
        Three rigs with two growths and two decays in wind and two free decays in still air each; or one rig without
        still-air records.
    turbulence, noise : float or (float, float)
        Scatter of the amplitude over the stable amplitude, and sensor noise over the smallest stable amplitude, or a
        range to draw from.

    Returns
    -------
    campaign : Campaign
    answer : dict
        Plain numbers and strings; `rigs` has the stable amplitudes with and without the effects.

    Raises
    ------
    ValueError
        For an unknown effect or design, or one that leaves no rig a limit cycle.
    """
    if design not in DESIGNS:
        raise ValueError(f"unknown design {design!r}; one of {', '.join(DESIGNS)}")
    effects = () if effect is None else (effect,) if isinstance(effect, str) else tuple(effect)
    draws, records, statements = (np.random.SeedSequence([seed, index, k]) for k in range(3))
    rng = np.random.default_rng(draws)
    # Drawn in any case, so that the rest of the stream does not depend on what is given.
    shares = [float(rng.random()) for _ in range(2)]
    ranges = [(given, given) if isinstance(given, int | float) else given for given in (turbulence, noise)]
    scatter, hiss = (low + (high - low) * u for (low, high), u in zip(ranges, shares, strict=True))
    case = _with_limit_cycles(effects, severity, DESIGNS[design], rng)
    air = Noise(scatter, sensor_noise=hiss * min(amplitude for amplitude, _ in case.stable))
    campaign = _campaign(case, air, records, statements, f"case-{index:04d}", still=design == "full")
    answer = {"case": campaign.title, "design": design, "turbulence": scatter, "noise": hiss, "gusts": 0.0}
    return campaign, answer | _answer(case, effects, severity)


def _with_limit_cycles(effects: Sequence[str], severity: float, rigs: int, rng: np.random.Generator) -> DrawnCase:
    for _ in range(_TRIES):
        body = without = random_body(rng, rigs)
        parameters = []
        for name in effects:
            body, drawn = apply(body, name, severity, rng)
            parameters.append(drawn)
        case = DrawnCase(body, without, tuple(parameters), tuple(_limit_cycle(rig) for rig in body.rigs))
        if all(_fair(*stable, rig, body) for stable, rig in zip(case.stable, without.rigs, strict=True)):
            return case
    raise ValueError(f"no section was drawn in which {' and '.join(effects)} at {severity:g} leaves a limit cycle")


def _fair(amplitude: float, rate: float, before: RigTruth, body: Body) -> bool:
    """Whether a limit cycle is left, not much smaller or larger than the one before the effects."""
    low, high = USUAL[body.section.motion]["amplitude"]
    old_amplitude, old_rate = before.undisturbed
    return (
        np.isfinite(amplitude)
        and FAIR_RANGE[0] * low <= amplitude <= FAIR_RANGE[1] * high
        and FAIR_AMPLITUDE[0] <= amplitude / old_amplitude <= FAIR_AMPLITUDE[1]
        and FAIR_RATE[0] <= rate / old_rate <= FAIR_RATE[1]
    )


def _limit_cycle(rig: RigTruth) -> tuple[float, float]:
    """Stable amplitude and relaxation rate: by work over a cycle; by simulation where the wake has its own equation."""
    if not rig.disturbances.wake_gain:
        return limit_cycle(rig.wind, rig.disturbances)
    usual, rate = rig.undisturbed
    ends = []
    for start in (0.12, 2.4):
        time, x = simulate_record(
            rig.wind, initial_amplitude=start * usual, duration=16.0 / rate,
            sample_rate=SAMPLES_PER_CYCLE * rig.wind.frequency, seed=0, disturbances=rig.disturbances,
        )  # fmt: skip
        tail = x[time > 12.0 / rate]
        halves = [float(np.sqrt(2.0) * part.std()) for part in np.array_split(tail, 2)]
        if abs(halves[1] - halves[0]) > STEADY * usual:
            return np.nan, np.nan
        ends.append(float(np.mean(halves)))
    if abs(ends[1] - ends[0]) > SAME_CYCLE * usual:
        return np.nan, np.nan
    return float(np.mean(ends)), rate


def _campaign(
    case: DrawnCase, air: Noise, seed: np.random.SeedSequence, statements: np.random.SeedSequence, title: str,
    *, still: bool,
) -> Campaign:  # fmt: skip
    """Measure every rig; the laboratory states mass and damping with their errors."""
    rng = np.random.default_rng(statements)
    damping_sd = float(rng.uniform(*_DAMPING_SD))
    rigs, tests = [], []
    for j, (rig, child) in enumerate(zip(case.body.rigs, seed.spawn(len(case.body.rigs)), strict=True)):
        own = replace(air, turbulence=air.turbulence * float(rng.uniform(0.85, 1.15)))
        records = _records(rig, case.stable[j], own, child, j, still=still)
        mass = rig.wind.mass * (1.0 + _MASS_SD * float(rng.standard_normal()))
        damping = rig.stated_damping * (1.0 + damping_sd * float(rng.standard_normal()))
        stated = Quantity(mass, _MASS_SD * mass), Quantity(damping, damping_sd * damping)
        rigs.append(Rig(f"rig {j + 1}", Quantity(rig.wind.frequency), *stated, tuple(records[IN_WIND:])))
        wind = Quantity(rig.wind.air_density), Quantity(rig.wind.wind_speed)
        tests.append(Test(f"test {j + 1}", f"rig {j + 1}", *wind, peak=True, records=tuple(records[:IN_WIND])))
    source, section = "simulated from the full equation of motion", case.body.section
    return Campaign(Path("campaign.toml"), title, source, section, tuple(rigs), tuple(tests))


def _records(
    rig: RigTruth, stable: tuple[float, float], air: Noise, seed: np.random.SeedSequence, j: int, *, still: bool
) -> list[Record]:
    """All records of a rig, those in wind first."""
    amplitude, rate = stable
    f0 = rig.wind.frequency
    choices, *children = seed.spawn(1 + IN_WIND + STILL)
    rng = np.random.default_rng(choices)
    plans: list[tuple[Kind, Truth, float, float]] = []
    for kind in _KINDS:
        cycles = float(np.clip(rng.uniform(*_RELAXATIONS) * f0 / rate, *_CYCLES))
        phase, start = float(rng.uniform(0.0, 2.0 * np.pi)), amplitude * float(rng.uniform(*_START[kind]))
        plans.append((kind, replace(rig.wind, shedding_phase=phase), start, cycles))
    if still:
        decay = 2.0 * np.pi * f0 * rig.wind.damping_ratio
        for _ in range(STILL):
            cycles = float(np.clip(_STILL_RELAXATIONS * f0 / decay, *_CYCLES))
            plans.append((Kind.FREE_DECAY, rig.still, amplitude * float(rng.uniform(*_STILL_START)), cycles))
    largest = max(start for _, _, start, _ in plans)
    # Turbulence is scaled by the undisturbed limit cycle; here it shall scatter the amplitude that is there.
    usual, usual_rate = rig.undisturbed
    air = replace(air, turbulence=air.turbulence * amplitude / usual * np.sqrt(rate / usual_rate))
    made = []
    for i, (kind, truth, start, cycles) in enumerate(plans):
        time, response = simulate_record(
            truth, initial_amplitude=start, duration=cycles / f0, sample_rate=SAMPLES_PER_CYCLE * f0,
            seed=children[i], noise=air, disturbances=_resolved(rig.of(i), largest, cycles / f0),
        )  # fmt: skip
        if kind is Kind.FREE_DECAY:
            end = _until_rest(response, max(_REST * start, 3.0 * air.sensor_noise))
            time, response = time[:end], response[:end]
        name = f"r{j + 1}_{kind.value.replace('-', '_')}{i % 2 + 1}.csv"
        made.append(Record(name, Path(name), kind, time, response))
    return made


def _resolved(d: Disturbances, largest: float, duration: float) -> Disturbances:
    """Turn a range over the largest amplitude, and a time over the record's length, into numbers."""
    return replace(
        d,
        clip_level=-d.clip_level * d.gain * largest if d.clip_level < 0.0 else d.clip_level,
        jump_time=-d.jump_time * duration if d.jump_time < 0.0 else d.jump_time,
    )


def _until_rest(response: FloatArray, level: float) -> int:
    """Number of samples until the motion is small, never less than twelve cycles."""
    cycle = SAMPLES_PER_CYCLE
    whole = len(response) // cycle
    peaks = np.abs(response[: whole * cycle]).reshape(whole, cycle).max(axis=1)
    small = np.flatnonzero(peaks < level)
    return max(int(small[0]), 12) * cycle + 1 if len(small) else len(response)


def _answer(case: DrawnCase, effects: Sequence[str], severity: float) -> dict[str, Any]:
    """What is in a case; stable amplitudes of the middle rig also at Scruton numbers that were not tested."""
    kind = "none" if not effects else "open" if set(effects) & set(OPEN) else "two" if len(effects) > 1 else "catalogue"
    rigs = []
    triples = zip(case.body.rigs, case.without.rigs, case.stable, strict=True)
    for j, (rig, before, stable) in enumerate(triples, start=1):
        changed = {key: value for key, value in vars(rig.disturbances).items() if value != getattr(OFF, key)}
        answer = {
            "name": f"rig {j}", "mass_damping_factor": scruton_factor(rig.wind), "disturbances": changed,
            "records": {str(i): dict(fields) for i, fields in rig.own.items()},
        }  # fmt: skip
        for suffix, truth, (amplitude, rate) in (("", rig, stable), ("_without", before, before.undisturbed)):
            answer |= {
                f"scruton_number{suffix}": truth.scruton_number,
                f"damping_ratio{suffix}": truth.wind.damping_ratio,
                f"Y1{suffix}": truth.wind.Y1,
                f"epsilon{suffix}": truth.wind.epsilon,
                f"stable_amplitude{suffix}": amplitude,
                f"relaxation_rate{suffix}": rate,
            }
        rigs.append(answer)
    held_out = []
    middle = case.without.middle
    for ratio in HELD_OUT:
        row: dict[str, float | None] = {"scruton_number": ratio * middle.scruton_number}
        for name, rig in (("stable_amplitude", case.body.middle), ("stable_amplitude_without", middle)):
            damping = rig.wind.damping_ratio + (ratio - 1.0) * middle.wind.damping_ratio
            amplitude, _ = _limit_cycle(replace(rig, wind=replace(rig.wind, damping_ratio=damping)))
            row[name] = None if np.isnan(amplitude) else amplitude  # no limit cycle
        held_out.append(row)
    return {
        "kind": kind, "effects": list(effects), "severity": severity if effects else 0.0,
        "motion": case.body.section.motion.value, "parameters": dict(zip(effects, case.parameters, strict=True)),
        "rigs": rigs, "held_out": held_out,
    }  # fmt: skip
