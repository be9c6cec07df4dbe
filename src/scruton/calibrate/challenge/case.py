"""One case of the challenge: a campaign in memory, and the answer to it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.calibrate.challenge.scenarios import IN_WIND, OPEN, STILL, Parameters, apply
from scruton.calibrate.challenge.sections import SAMPLES_PER_CYCLE, Body, RigTruth, limit_cycle, random_body
from scruton.calibrate.thresholds import FAIR_AMPLITUDE, FAIR_RANGE, FAIR_RATE, USUAL
from scruton.campaign.schema import Campaign, Kind, Quantity, Record, Rig, Test
from scruton.simulate import Noise, Truth, simulate_record
from scruton.simulate.disturbances import OFF

DESIGNS = {"full": 3, "one-rig": 1}
TURBULENCE, NOISE, GUSTS = (0.005, 0.015), (0.0, 0.02), (0.0, 0.0)
_GUST_TIME = (0.3, 10.0)  # in relaxation times of the middle rig
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
    gusts: float | tuple[float, float] = GUSTS,
) -> tuple[Campaign, dict[str, Any]]:
    """Simulate one campaign of the challenge, and give the answer to it; `seed` and `index` settle what is drawn.

    It has no effect, one, or several of a severity at once.  The design "full" is three rigs with two growths and two
    decays in wind and two free decays in still air each, "one-rig" one rig without still-air records.  `turbulence` is
    the scatter of the amplitude over the stable amplitude, `noise` that of the sensor over the smallest stable
    amplitude, `gusts` that of the amplitude to which slow gusts drive it, or ranges to draw them from.  ValueError for
    an unknown effect or design, or one that leaves no rig a limit cycle.
    """
    if design not in DESIGNS:
        raise ValueError(f"unknown design {design!r}; one of {', '.join(DESIGNS)}")
    effects = () if effect is None else (effect,) if isinstance(effect, str) else tuple(effect)
    draws, records, statements, gusty = (np.random.SeedSequence([seed, index, k]) for k in range(4))
    rng = np.random.default_rng(draws)
    # Drawn in any case, so that the rest of the stream does not depend on what is given.
    slow, relaxations = (float(u) for u in np.random.default_rng(gusty).random(2))
    shares = [float(rng.random()), float(rng.random()), slow]
    ranges = [(given, given) if isinstance(given, int | float) else given for given in (turbulence, noise, gusts)]
    scatter, hiss, gust = (low + (high - low) * u for (low, high), u in zip(ranges, shares, strict=True))
    case = _with_limit_cycles(effects, severity, DESIGNS[design], rng)
    shortest, longest = _GUST_TIME
    gust_time = shortest * (longest / shortest) ** relaxations / case.body.middle.undisturbed[1]
    air = Noise(scatter, hiss * min(amplitude for amplitude, _ in case.stable), 0.0, gust, gust_time)
    campaign = _campaign(case, air, records, statements, f"case-{index:04d}", still=design == "full")
    answer = {"case": campaign.title, "design": design, "turbulence": scatter, "noise": hiss, "gusts": gust}
    return campaign, answer | _answer(case, effects, severity)


def _with_limit_cycles(effects: Sequence[str], severity: float, rigs: int, rng: np.random.Generator) -> DrawnCase:
    for _ in range(_TRIES):
        body = without = random_body(rng, rigs)
        parameters = []
        for name in effects:
            body, drawn = apply(body, name, severity, rng)
            parameters.append(drawn)
        stable = tuple(limit_cycle(rig.wind, rig.disturbances) for rig in body.rigs)
        low, high = USUAL[body.section.motion]["amplitude"]
        before = [rig.undisturbed for rig in without.rigs]
        # A limit cycle is left, not much smaller or larger than the one before the effects.
        if all(
            np.isfinite(amplitude)
            and FAIR_RANGE[0] * low <= amplitude <= FAIR_RANGE[1] * high
            and FAIR_AMPLITUDE[0] <= amplitude / usual <= FAIR_AMPLITUDE[1]
            and FAIR_RATE[0] <= rate / usual_rate <= FAIR_RATE[1]
            for (amplitude, rate), (usual, usual_rate) in zip(stable, before, strict=True)
        ):
            return DrawnCase(body, without, tuple(parameters), stable)
    raise ValueError(f"no section was drawn in which {' and '.join(effects)} at {severity:g} leaves a limit cycle")


def _campaign(
    case: DrawnCase, air: Noise, seed: np.random.SeedSequence, statements: np.random.SeedSequence, title: str,
    *, still: bool,
) -> Campaign:  # fmt: skip
    """Measure every rig; the laboratory states mass and damping with their errors.

    The gusts' intensity in `air` is the scatter of the amplitude that they drive to, not yet that of the wind speed.
    """
    rng = np.random.default_rng(statements)
    damping_sd = float(rng.uniform(*_DAMPING_SD))
    rigs, tests = [], []
    seeds = seed.spawn(len(case.body.rigs))
    for j, (rig, before) in enumerate(zip(case.body.rigs, case.without.rigs, strict=True)):
        noise = replace(
            air, turbulence=air.turbulence * float(rng.uniform(0.85, 1.15)),
            gust_intensity=air.gust_intensity / rig.wind.wind_exponent,
        )  # fmt: skip
        records = _records(rig, case.stable[j], noise, seeds[j], j, still=still)
        mass = rig.wind.mass * (1.0 + _MASS_SD * float(rng.standard_normal()))
        damping = before.wind.damping_ratio * (1.0 + damping_sd * float(rng.standard_normal()))
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
        d = replace(rig.disturbances, **rig.own.get(i, {}))  # type: ignore[arg-type]
        if d.clip_level < 0.0:  # a range over the largest amplitude
            d = replace(d, clip_level=-d.clip_level * d.gain * largest)
        if d.jump_time < 0.0:  # a time over the record's length
            d = replace(d, jump_time=-d.jump_time * (cycles / f0))
        time, response = simulate_record(
            truth, initial_amplitude=start, duration=cycles / f0, sample_rate=SAMPLES_PER_CYCLE * f0,
            seed=children[i], noise=air, disturbances=d,
        )  # fmt: skip
        if kind is Kind.FREE_DECAY:
            # Until the motion is small, never less than twelve cycles.
            whole = len(response) // SAMPLES_PER_CYCLE
            peaks = np.abs(response[: whole * SAMPLES_PER_CYCLE]).reshape(whole, SAMPLES_PER_CYCLE).max(axis=1)
            small = np.flatnonzero(peaks < max(_REST * start, 3.0 * air.sensor_noise))
            end = max(int(small[0]), 12) * SAMPLES_PER_CYCLE + 1 if len(small) else len(response)
            time, response = time[:end], response[:end]
        name = f"r{j + 1}_{kind.value.replace('-', '_')}{i % 2 + 1}.csv"
        made.append(Record(name, Path(name), kind, time, response))
    return made


def _answer(case: DrawnCase, effects: Sequence[str], severity: float) -> dict[str, Any]:
    """What is in a case; stable amplitudes of the middle rig also at Scruton numbers that were not tested."""
    kind = "none" if not effects else "open" if set(effects) & set(OPEN) else "two" if len(effects) > 1 else "catalogue"
    rigs = []
    triples = zip(case.body.rigs, case.without.rigs, case.stable, strict=True)
    for j, (rig, before, stable) in enumerate(triples, start=1):
        changed = {key: value for key, value in vars(rig.disturbances).items() if value != getattr(OFF, key)}
        answer = {
            "name": f"rig {j}", "mass_damping_factor": rig.scruton_factor, "disturbances": changed,
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
            amplitude, _ = limit_cycle(replace(rig.wind, damping_ratio=damping), rig.disturbances)
            row[name] = None if np.isnan(amplitude) else amplitude  # no limit cycle
        held_out.append(row)
    return {
        "kind": kind, "effects": list(effects), "severity": severity if effects else 0.0,
        "motion": case.body.section.motion.value, "parameters": dict(zip(effects, case.parameters, strict=True)),
        "rigs": rigs, "held_out": held_out,
    }  # fmt: skip
