r"""Every effect of the challenge at a severity, of the catalogue and outside it: what is done to the rigs of a body.

Severity s means, at the middle rig's undisturbed stable amplitude a* and relaxation rate lambda: the effect's damping
is s lambda/omega; for the others

==================== ==============================================================================================
gain                 the reading is scaled by 1 + s or 1 - s
clipping             the range ends at 1 - 0.6 s of the largest amplitude of the rig's channel
stiffness            the frequency changes by 6 % s over the amplitude range of the campaign
reduced velocity     Y1 changes by 2 s over the rigs
setting              Y1 changes by 2 s over the rigs
wind drift           the wind changes by 0.75 s over the record
coherence            lost below (0.15 + 0.85 s) a*
memory               the lag is s/lambda: growth through a*/2 is faster by 2 s lambda/omega in damping
vortex shedding      the force, were it in phase, would change the amplitude a* at a rate of s lambda
structural error     the error is s lambda/omega
jump in time         the drive, or the damping, jumps by s lambda/omega at a*
bump                 the top of the bump is 1.5 s lambda/omega
intermittence        2 s of the drive is lost while off
second mode          its amplitude at release is 0.5 s a*
wake oscillator      its own amplitude relaxes in a time s/lambda, and it drives the section
==================== ==============================================================================================
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.sections import Body
from scruton.calibrate.thresholds import MOST_ORDER
from scruton.compiled import njit
from scruton.simulate import Disturbances
from scruton.simulate.disturbances import COHERENCE_FORMS
from scruton.simulate.equation import mean_rate

IN_WIND, STILL = 4, 2  # records of a rig: two growths and two decays, two free decays
_LARGEST = 2.35  # amplitude of a release over the stable amplitude, about

Parameters = dict[str, Any]  # what was drawn, with `rigs`: those that are affected
Scenario = Callable[[Body, float, np.random.Generator], tuple[Body, Parameters]]


def apply(body: Body, effect: str, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Put an effect of `SCENARIOS` into a body (ValueError for any other); forms and scopes are drawn."""
    if effect not in SCENARIOS:
        raise ValueError(f"unknown effect {effect!r}; one of {', '.join(SCENARIOS)}")
    return SCENARIOS[effect](body, severity, rng)


def _changed(body: Body, rigs: list[int], part: str = "disturbances", /, **fields: Any) -> Body:
    """Put fields of `Disturbances`, or of the `wind`, into some rigs; a list or dict has one value a rig."""
    made = list(body.rigs)
    for j in rigs:
        values = {key: value[j] if isinstance(value, list | dict) else value for key, value in fields.items()}
        made[j] = replace(made[j], **{part: replace(getattr(made[j], part), **values)})
    return replace(body, rigs=tuple(made))


def _changed_records(body: Body, fields: Mapping[tuple[int, int], Parameters]) -> Body:
    """Put fields of `Disturbances` into single records, by rig and number."""
    made = list(body.rigs)
    for (j, i), changes in fields.items():
        made[j] = replace(made[j], own={**made[j].own, i: {**made[j].own.get(i, {}), **changes}})
    return replace(body, rigs=tuple(made))


def _some(body: Body, rng: np.random.Generator) -> list[int]:
    """Some but not all of the rigs."""
    count = len(body.rigs)
    if count == 1:
        return [0]
    return sorted(int(j) for j in rng.choice(count, size=int(rng.integers(1, count)), replace=False))


def _coefficient(body: Body, severity: float, field: str, **fixed: Any) -> float:
    """Coefficient of a force that is linear in it, so that it damps the middle rig at a* by s lambda/omega."""
    rig = body.middle
    amplitude, rate = rig.undisturbed
    without, unit = (
        float(mean_rate(rig.wind, Disturbances(**{**fixed, field: value}), np.array([amplitude]))[0])
        for value in (0.0, 1.0)
    )
    return severity * rate * amplitude / (without - unit)


def _records(body: Body, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Records in wind as (rig, number): all, those of some rigs, or a third."""
    all_records = [(j, i) for j in body.every for i in range(IN_WIND)]
    choice = rng.random()
    if choice < 0.4:
        return all_records
    if choice < 0.7 and len(body.rigs) > 1:
        rigs = _some(body, rng)
        return [(j, i) for j, i in all_records if j in rigs]
    picked = rng.choice(len(all_records), size=max(1, len(all_records) // 3), replace=False)
    return [all_records[int(i)] for i in sorted(picked)]


def coulomb_friction(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Regularised or hysteretic friction, in all rigs or in the damper of some."""
    form = str(rng.choice(["tanh", "dahl"]))
    smallest = min(rig.undisturbed[0] for rig in body.rigs)
    scale = float(rng.uniform(0.01, 0.03) * smallest * (body.middle.wind.omega if form == "tanh" else 1.0))
    force = _coefficient(body, severity, "friction", friction_form=form, friction_scale=scale)
    rigs = body.every if rng.random() < 0.5 else _some(body, rng)
    made = _changed(body, rigs, friction=force, friction_form=form, friction_scale=scale)
    return made, {"rigs": rigs, "form": form, "force_over_mass": force, "scale": scale}


def structural_damping_nonlinearity(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Drag of the rig, or damping that grows with the square of the displacement."""
    field = str(rng.choice(["quadratic_drag", "displacement_drag"]))
    value = _coefficient(body, severity, field)
    rigs = body.every if rng.random() < 0.7 else _some(body, rng)
    return _changed(body, rigs, **{field: value}), {"rigs": rigs, "form": field, "coefficient": value}


def structural_damping_error(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The true damping is not what the laboratory states."""
    amount = severity * body.middle.undisturbed[1] / body.middle.wind.omega
    rigs = body.every if rng.random() < 0.4 else _some(body, rng)
    sign = float(rng.choice([-1.0, 1.0]))
    if any(body.rigs[j].wind.damping_ratio - amount < 0.35 * body.rigs[j].wind.damping_ratio for j in rigs):
        sign = 1.0
    true = [rig.wind.damping_ratio + sign * amount for rig in body.rigs]
    return _changed(body, rigs, "wind", damping_ratio=true), {"rigs": rigs, "damping_ratio": sign * amount}


def aerodynamic_damping_nonlinearity(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A further term of the aerodynamic force."""
    field = str(rng.choice(["aero_xxv", "aero_vvv", "aero_xv", "aero_xxxxv"]))
    sign = -1.0 if rng.random() < 0.25 and field == "aero_xv" else 1.0
    value = sign * _coefficient(body, severity, field)
    middle = body.middle.wind
    values = [value * r.wind.pressure * r.wind.passage / (middle.pressure * middle.passage) for r in body.rigs]
    return _changed(body, body.every, **{field: values}), {"rigs": body.every, "form": field, "coefficient": value}


def spanwise_coherence_loss(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The second term of the force is lost at small amplitude."""
    form = str(rng.choice(COHERENCE_FORMS))
    below = (0.15 + 0.85 * severity) * body.middle.undisturbed[0]
    made = _changed(body, body.every, coherence_amplitude=below, coherence_form=form)
    return made, {"rigs": body.every, "form": form, "amplitude": below}


def reduced_velocity_drift(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Y1, perhaps epsilon, change in proportion to the reduced velocity from rig to rig."""
    count = len(body.rigs)
    if count < 2:
        raise ValueError("reduced_velocity_drift needs more than one rig")
    sign, other = float(rng.choice([-1.0, 1.0])), float(rng.choice([0.0, -0.5, 0.5]))
    spread = float(rng.uniform(0.02, 0.08) * rng.choice([-1.0, 1.0]))
    base = body.middle.wind.wind_speed / (body.middle.wind.frequency * body.section.depth)
    winds = [(rig.wind, u) for rig, u in zip(body.rigs, np.linspace(-0.5, 0.5, count).tolist(), strict=True)]
    made = _changed(
        body, body.every, "wind", Y1=[wind.Y1 * (1.0 + 2.0 * severity * sign * u) for wind, u in winds],
        epsilon=[wind.epsilon * (1.0 + 2.0 * severity * sign * other * u) for wind, u in winds],
        wind_speed=[base * (1.0 + spread * u) * wind.frequency * body.section.depth for wind, u in winds],
    )  # fmt: skip
    return made, {"rigs": body.every, "Y1": 2.0 * severity * sign, "epsilon": 2.0 * severity * sign * other}


def setting_dependence(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Y1, perhaps epsilon too, differ from rig to rig without order in the reduced velocity."""
    count = len(body.rigs)
    if count < 3:
        raise ValueError("setting_dependence needs three rigs: two are always in some order")
    place = _spread(rng, count)
    values = _without_order(rng, place)
    others = float(rng.choice([0.0, 0.5])) * _without_order(rng, place)
    speed = float(rng.uniform(0.02, 0.08))
    base = body.middle.wind.wind_speed / (body.middle.wind.frequency * body.section.depth)
    winds = [rig.wind for rig in body.rigs]
    Y1, epsilon, speeds = 2.0 * severity * values, 2.0 * severity * others, base * (1.0 + speed * place)
    made = _changed(
        body, body.every, "wind", Y1=[wind.Y1 * (1.0 + float(u)) for wind, u in zip(winds, Y1, strict=True)],
        epsilon=[wind.epsilon * (1.0 + float(u)) for wind, u in zip(winds, epsilon, strict=True)],
        wind_speed=[float(u) * wind.frequency * body.section.depth for wind, u in zip(winds, speeds, strict=True)],
    )  # fmt: skip
    return made, {"rigs": body.every, "Y1": Y1.tolist(), "epsilon": epsilon.tolist(), "place": place.tolist()}


def _spread(rng: np.random.Generator, count: int) -> FloatArray:
    """Values of mean zero whose largest is one above the smallest."""
    drawn = rng.standard_normal(count)
    return (drawn - drawn.mean()) / float(np.ptp(drawn))


def _without_order(rng: np.random.Generator, place: FloatArray) -> FloatArray:
    """Likewise, and hardly correlated with the places."""
    while abs(np.corrcoef(values := _spread(rng, place.size), place)[0, 1]) > MOST_ORDER:
        pass
    return values


def fluid_memory(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The aerodynamic damping follows the amplitude late."""
    lag = severity / body.middle.undisturbed[1]
    parameters = {"rigs": body.every, "time_s": lag, "cycles": lag * body.middle.wind.frequency}
    return _changed(body, body.every, memory_time=lag), parameters


def vortex_shedding_forcing(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A force 2 to 6 % off the response, beating with it; its phase is another in every record."""
    amplitude, rate = body.middle.undisturbed
    wind = body.middle.wind
    coefficient = 2.0 * wind.omega * severity * rate * amplitude / wind.pressure
    off = float(rng.uniform(0.02, 0.06) * rng.choice([-1.0, 1.0]))
    rigs = body.every if rng.random() < 0.7 else _some(body, rng)
    offs = {j: off * (1.0 + 0.1 * float(rng.uniform(-1.0, 1.0))) for j in rigs}
    frequencies = {j: float(body.rigs[j].wind.omega * (1.0 + offset) / (2.0 * np.pi)) for j, offset in offs.items()}
    made = _changed(body, rigs, "wind", shedding=coefficient, shedding_frequency=frequencies)
    return made, {"rigs": rigs, "coefficient": coefficient, "off": list(offs.values())}


def wind_speed_drift(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A ramp of the wind about its stated speed or from it, in all records, in those of some rigs, or in a third."""
    form = str(rng.choice(["linear", "cosine"]))
    from_start = bool(rng.random() < 0.5)
    chosen = _records(body, rng)
    common = float(rng.choice([-1.0, 1.0])) if rng.random() < 0.5 else 0.0
    drifts = {place: 0.75 * severity * (common or float(rng.choice([-1.0, 1.0]))) for place in chosen}
    shared: Parameters = {"drift_form": form, "drift_from_start": from_start}
    return _changed_records(body, {place: {"drift": drift, **shared} for place, drift in drifts.items()}), {
        "rigs": sorted({j for j, _ in chosen}), "records": chosen, "form": form, "from_start": from_start,
        "drift": {f"{j},{i}": drift for (j, i), drift in drifts.items()},
    }  # fmt: skip


def stiffness_nonlinearity(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A spring that hardens or softens with the square of the displacement, or with its size."""
    largest = _LARGEST * max(rig.undisturbed[0] for rig in body.rigs)
    change = 0.06 * severity * float(rng.choice([-1.0, 1.0]))
    # omega/omega0 = 1 + 3/8 k3 a^2, or 1 + 4/(3 pi) k2 a.
    cubic = bool(rng.random() < 0.65)
    form = "cubic_stiffness" if cubic else "linear_stiffness_slope"
    value = change / (0.375 * largest**2) if cubic else change / (4.0 / (3.0 * np.pi) * largest)
    parameters = {"rigs": body.every, "form": form, "change": change, "up_to": largest}
    return _changed(body, body.every, **{form: value}), parameters


def sensor_gain_error(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The channel of one rig, or of one record in wind, reads too much or too little."""
    gain = 1.0 + severity * float(rng.choice([-1.0, 1.0]))
    j = int(rng.integers(len(body.rigs)))
    if len(body.rigs) > 1 and rng.random() < 0.6:
        return _changed(body, [j], gain=gain), {"rigs": [j], "records": "all of the rig", "gain": gain}
    record = j, int(rng.integers(IN_WIND))
    return _changed_records(body, {record: {"gain": gain}}), {"rigs": [j], "records": [record], "gain": gain}


def sensor_clipping(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A channel whose range ends smoothly; the range is set when the largest amplitude is known."""
    rigs = body.every if rng.random() < 0.5 else _some(body, rng)
    sharpness = float(rng.uniform(8.0, 20.0))
    # Negative: over the largest amplitude of the rig's records, see `scruton.calibrate.challenge.case`.
    made = _changed(body, rigs, clip_level=-(1.0 - 0.6 * severity), clip_sharpness=sharpness)
    return made, {"rigs": rigs, "over_largest": 1.0 - 0.6 * severity, "sharpness": sharpness}


def damping_bump(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Damping near one amplitude, below or above the stable one."""
    amplitude, rate = body.middle.undisturbed
    centre = float(rng.uniform(0.4, 0.65) if rng.random() < 0.5 else rng.uniform(1.2, 1.6))
    fields = {
        "bump_rate": 1.5 * severity * rate,
        "bump_amplitude": centre * amplitude,
        "bump_width": float(rng.uniform(0.1, 0.16)) * amplitude,
        "bump_in_still_air": bool(rng.random() < 0.4),
    }
    return _changed(body, body.every, **fields), {"rigs": body.every, **fields}


def time_jump(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The drive, or the damping, is another from some moment on; times are over the record's length."""
    form = str(rng.choice(["jump_drive", "jump_rate"]))
    chosen = _records(body, rng)
    unit = body.middle.undisturbed[1] if form == "jump_rate" else 1.0
    jumps = {
        place: {form: float(rng.choice([-1.0, 1.0])) * severity * unit, "jump_time": -float(rng.uniform(0.3, 0.7))}
        for place in chosen
    }
    return _changed_records(body, jumps), {
        "rigs": sorted({j for j, _ in chosen}), "records": chosen, "form": form, "size": severity,
    }  # fmt: skip


def intermittent_lock_in(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Part of the drive is lost for spells."""
    rate = body.middle.undisturbed[1]
    fields = {
        "spell_depth": min(1.0, 2.0 * severity),
        "spell_on": float(rng.uniform(1.0, 2.0)) / rate,
        "spell_off": float(rng.uniform(0.3, 0.7)) / rate,
    }
    return _changed(body, body.every, **fields), {"rigs": body.every, **fields}


def second_mode(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Another mode in the channel, released with the first and kept up by turbulence."""
    amplitude, rate = body.middle.undisturbed
    ratio = float(rng.uniform(1.12, 1.7) if rng.random() < 0.7 else rng.uniform(0.6, 0.88))
    size = 0.5 * severity * amplitude
    fields = {
        "second_amplitude": size,
        "second_rate": float(rng.uniform(0.3, 1.0)) * rate,
        "second_scatter": 0.25 * size,
    }
    frequencies = [ratio * rig.wind.frequency for rig in body.rigs]
    made = _changed(body, body.every, second_frequency=frequencies, **fields)
    return made, {"rigs": body.every, "frequency_ratio": ratio, **fields}


def wake_oscillator(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A wake with an equation of motion of its own drives the section.

    Its own amplitude relaxes at the rate e w of the van der Pol equation, which is lambda/s here: its memory is as
    long as that of `fluid_memory` at the same severity. Its force is scaled so that at the middle rig's a* it does the
    work of what it replaces.
    """
    amplitude, rate = body.middle.undisturbed
    wind = body.middle.wind
    damping = rate / wind.omega / severity
    coupling = float(rng.uniform(1.0, 3.0)) * damping / amplitude
    detuning = 1.0 + float(rng.uniform(-0.1, 0.1)) * damping  # well within lock-in
    response = float(_in_phase(amplitude, damping, coupling, detuning))
    drive = -4.0 / np.pi * wind.pressure * wind.Y1 * wind.epsilon  # first harmonic of the second term
    gain = drive / response
    gains = [gain * rig.wind.pressure / wind.pressure for rig in body.rigs]
    fields = {"wake_share": 1.0, "wake_damping": damping, "wake_coupling": coupling, "wake_frequency": detuning}
    return _changed(body, body.every, wake_gain=gains, **fields), {"rigs": body.every, "wake_gain": gain, **fields}


@njit(cache=True)
def _in_phase(a, e, coupling, w):  # type: ignore[no-untyped-def]
    """Part in phase with the velocity of the wake variable, q'' + e w (q^2 - 1) q' + w^2 q = A x'', once locked.

    Time in radians of the section's motion x = a cos t; semi-implicit steps, mean over the last cycles.
    """
    steps, cycles, averaged = 2000, 400, 40
    h = 2.0 * np.pi / steps
    q, p, total = 0.0, -2.0, 0.0
    for i in range(cycles * steps):
        t = (i + 0.5) * h
        p += h * (-coupling * a * np.cos(t) - e * w * (q * q - 1.0) * p - w * w * q)
        q += h * p
        if i >= (cycles - averaged) * steps:
            total += -np.sin(t) * q
    return 2.0 * total / (averaged * steps)


CATALOGUE: dict[str, Scenario] = {
    make.__name__: make
    for make in (
        coulomb_friction, structural_damping_nonlinearity, structural_damping_error, aerodynamic_damping_nonlinearity,
        spanwise_coherence_loss, reduced_velocity_drift, setting_dependence, fluid_memory, vortex_shedding_forcing,
        wind_speed_drift, stiffness_nonlinearity, sensor_gain_error, sensor_clipping,
    )
}  # fmt: skip
# What a diagnosis should call unknown.
OPEN: dict[str, Scenario] = {
    make.__name__: make for make in (damping_bump, time_jump, intermittent_lock_in, second_mode, wake_oscillator)
}
SCENARIOS = CATALOGUE | OPEN
BETWEEN_RIGS = ("reduced_velocity_drift", "setting_dependence")  # one rig does not show them
