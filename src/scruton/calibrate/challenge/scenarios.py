r"""Every effect of the challenge at a severity: what is done to the rigs of a body.

Severity s means, at the middle rig's undisturbed stable amplitude a* and relaxation rate lambda: the effect's damping
is s lambda/omega; for the others

==================== ==============================================================================================
gain                 the reading is scaled by 1 + s or 1 - s
clipping             the range ends at 1 - 0.6 s of the largest amplitude of the rig's channel
stiffness            the frequency changes by 6 % s over the amplitude range of the campaign
reduced velocity     Y1 changes by 2 s over the rigs
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

from collections.abc import Callable

import numpy as np

from scruton.calibrate.challenge.outside import OPEN
from scruton.calibrate.challenge.scope import (
    IN_WIND,
    Parameters,
    coefficient,
    every,
    records,
    set_records,
    set_rigs,
    set_winds,
    some,
)  # fmt: skip
from scruton.calibrate.challenge.sections import Body
from scruton.simulate.disturbances import COHERENCE_FORMS

LARGEST = 2.35  # amplitude of a release over the stable amplitude, about

Scenario = Callable[[Body, float, np.random.Generator], tuple[Body, Parameters]]


def apply(body: Body, effect: str, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Put an effect into a body.

    Parameters
    ----------
    body : Body
    effect : str
        One of `CATALOGUE` or `OPEN`.
    severity : float
        See the table above.
    rng : Generator
        Forms and scopes are drawn.

    Returns
    -------
    body : Body
    parameters : dict
        What was drawn, with `rigs`: the rigs that are affected.

    Raises
    ------
    ValueError
        For an unknown effect.
    """
    scenarios = {**CATALOGUE, **OPEN}
    if effect not in scenarios:
        raise ValueError(f"unknown effect {effect!r}; one of {', '.join(scenarios)}")
    return scenarios[effect](body, severity, rng)


def coulomb_friction(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Regularised or hysteretic friction, in all rigs or in the damper of some."""
    form = str(rng.choice(["tanh", "dahl"]))
    smallest = min(rig.undisturbed[0] for rig in body.rigs)
    scale = float(rng.uniform(0.01, 0.03) * smallest * (body.middle.wind.omega if form == "tanh" else 1.0))
    force = coefficient(body, severity, "friction", friction_form=form, friction_scale=scale)
    rigs = every(body) if rng.random() < 0.5 else some(body, rng)
    made = set_rigs(body, rigs, friction=force, friction_form=form, friction_scale=scale)
    return made, {"rigs": rigs, "form": form, "force_over_mass": force, "scale": scale}


def structural_damping_nonlinearity(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Drag of the rig, or damping that grows with the square of the displacement."""
    field = str(rng.choice(["quadratic_drag", "displacement_drag"]))
    value = coefficient(body, severity, field)
    rigs = every(body) if rng.random() < 0.7 else some(body, rng)
    return set_rigs(body, rigs, **{field: value}), {"rigs": rigs, "form": field, "coefficient": value}


def structural_damping_error(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The true damping is not what the laboratory states."""
    amount = severity * body.middle.undisturbed[1] / body.middle.wind.omega
    rigs = every(body) if rng.random() < 0.4 else some(body, rng)
    sign = float(rng.choice([-1.0, 1.0]))
    if any(body.rigs[j].wind.damping_ratio - amount < 0.35 * body.rigs[j].wind.damping_ratio for j in rigs):
        sign = 1.0
    true = {j: body.rigs[j].wind.damping_ratio + sign * amount for j in rigs}
    return set_winds(body, {j: {"damping_ratio": xi} for j, xi in true.items()}), {
        "rigs": rigs, "damping_ratio": sign * amount,
    }  # fmt: skip


def aerodynamic_damping_nonlinearity(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A further term of the aerodynamic force."""
    field = str(rng.choice(["aero_xxv", "aero_vvv", "aero_xv", "aero_xxxxv"]))
    sign = -1.0 if rng.random() < 0.25 and field == "aero_xv" else 1.0
    value = sign * coefficient(body, severity, field)
    middle = body.middle.wind
    values = [value * r.wind.pressure * r.wind.passage / (middle.pressure * middle.passage) for r in body.rigs]
    return set_rigs(body, every(body), **{field: values}), {"rigs": every(body), "form": field, "coefficient": value}


def spanwise_coherence_loss(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The second term of the force is lost at small amplitude."""
    form = str(rng.choice(COHERENCE_FORMS))
    below = (0.15 + 0.85 * severity) * body.middle.undisturbed[0]
    made = set_rigs(body, every(body), coherence_amplitude=below, coherence_form=form)
    return made, {"rigs": every(body), "form": form, "amplitude": below}


def reduced_velocity_drift(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """Y1, perhaps epsilon, change in proportion to the reduced velocity from rig to rig."""
    count = len(body.rigs)
    if count < 2:
        raise ValueError("reduced_velocity_drift needs more than one rig")
    sign, other = float(rng.choice([-1.0, 1.0])), float(rng.choice([0.0, -0.5, 0.5]))
    spread = float(rng.uniform(0.02, 0.08) * rng.choice([-1.0, 1.0]))
    place = np.linspace(-0.5, 0.5, count)
    base = body.middle.wind.wind_speed / (body.middle.wind.frequency * body.section.depth)
    winds = {
        j: {
            "Y1": rig.wind.Y1 * (1.0 + 2.0 * severity * sign * u),
            "epsilon": rig.wind.epsilon * (1.0 + 2.0 * severity * sign * other * u),
            "wind_speed": base * (1.0 + spread * u) * rig.wind.frequency * body.section.depth,
        }
        for j, (rig, u) in enumerate(zip(body.rigs, place.tolist(), strict=True))
    }
    parameters = {"rigs": every(body), "Y1": 2.0 * severity * sign, "epsilon": 2.0 * severity * sign * other}
    return set_winds(body, winds), parameters


def fluid_memory(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The aerodynamic damping follows the amplitude late."""
    lag = severity / body.middle.undisturbed[1]
    parameters = {"rigs": every(body), "time_s": lag, "cycles": lag * body.middle.wind.frequency}
    return set_rigs(body, every(body), memory_time=lag), parameters


def vortex_shedding_forcing(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A force 2 to 6 % off the response, beating with it; its phase is another in every record."""
    amplitude, rate = body.middle.undisturbed
    wind = body.middle.wind
    coefficient = 2.0 * wind.omega * severity * rate * amplitude / wind.pressure
    off = float(rng.uniform(0.02, 0.06) * rng.choice([-1.0, 1.0]))
    rigs = every(body) if rng.random() < 0.7 else some(body, rng)
    offs = {j: off * (1.0 + 0.1 * float(rng.uniform(-1.0, 1.0))) for j in rigs}
    frequencies = {j: float(body.rigs[j].wind.omega * (1.0 + own) / (2.0 * np.pi)) for j, own in offs.items()}
    made = set_winds(body, {j: {"shedding": coefficient, "shedding_frequency": f} for j, f in frequencies.items()})
    return made, {"rigs": rigs, "coefficient": coefficient, "off": list(offs.values())}


def wind_speed_drift(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A ramp of the wind about its stated speed or from it, in all records, in those of some rigs, or in a third."""
    form = str(rng.choice(["linear", "cosine"]))
    from_start = bool(rng.random() < 0.5)
    chosen = records(body, rng)
    common = float(rng.choice([-1.0, 1.0])) if rng.random() < 0.5 else 0.0
    drifts = {place: 0.75 * severity * (common or float(rng.choice([-1.0, 1.0]))) for place in chosen}
    shared: Parameters = {"drift_form": form, "drift_from_start": from_start}
    return set_records(body, {place: {"drift": drift, **shared} for place, drift in drifts.items()}), {
        "rigs": sorted({j for j, _ in chosen}), "records": chosen, "form": form, "from_start": from_start,
        "drift": {f"{j},{i}": drift for (j, i), drift in drifts.items()},
    }  # fmt: skip


def stiffness_nonlinearity(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A spring that hardens or softens with the square of the displacement, or with its size."""
    largest = LARGEST * max(rig.undisturbed[0] for rig in body.rigs)
    change = 0.06 * severity * float(rng.choice([-1.0, 1.0]))
    # omega/omega0 = 1 + 3/8 k3 a^2, or 1 + 4/(3 pi) k2 a.
    cubic = bool(rng.random() < 0.65)
    form = "cubic_stiffness" if cubic else "linear_stiffness_slope"
    value = change / (0.375 * largest**2) if cubic else change / (4.0 / (3.0 * np.pi) * largest)
    parameters = {"rigs": every(body), "form": form, "change": change, "up_to": largest}
    return set_rigs(body, every(body), **{form: value}), parameters


def sensor_gain_error(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The channel of one rig, or of one record in wind, reads too much or too little."""
    gain = 1.0 + severity * float(rng.choice([-1.0, 1.0]))
    j = int(rng.integers(len(body.rigs)))
    if len(body.rigs) > 1 and rng.random() < 0.6:
        return set_rigs(body, [j], gain=gain), {"rigs": [j], "records": "all of the rig", "gain": gain}
    record = j, int(rng.integers(IN_WIND))
    return set_records(body, {record: {"gain": gain}}), {"rigs": [j], "records": [record], "gain": gain}


def sensor_clipping(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """A channel whose range ends smoothly; the range is set when the largest amplitude is known."""
    rigs = every(body) if rng.random() < 0.5 else some(body, rng)
    sharpness = float(rng.uniform(8.0, 20.0))
    # Negative: over the largest amplitude of the rig's records, see `scruton.calibrate.challenge.case`.
    made = set_rigs(body, rigs, clip_level=-(1.0 - 0.6 * severity), clip_sharpness=sharpness)
    return made, {"rigs": rigs, "over_largest": 1.0 - 0.6 * severity, "sharpness": sharpness}


CATALOGUE: dict[str, Scenario] = {
    one.__name__: one
    for one in (
        coulomb_friction, structural_damping_nonlinearity, structural_damping_error, aerodynamic_damping_nonlinearity,
        spanwise_coherence_loss, reduced_velocity_drift, fluid_memory, vortex_shedding_forcing, wind_speed_drift,
        stiffness_nonlinearity, sensor_gain_error, sensor_clipping,
    )
}  # fmt: skip
