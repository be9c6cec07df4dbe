"""Effects of the challenge that are not in the catalogue: what a diagnosis should call unknown."""

import numpy as np
from numba import njit

from scruton.calibrate.challenge.scope import Parameters, every, records, set_records, set_rigs
from scruton.calibrate.challenge.sections import Body


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
    return set_rigs(body, every(body), **fields), {"rigs": every(body), **fields}


def time_jump(body: Body, severity: float, rng: np.random.Generator) -> tuple[Body, Parameters]:
    """The drive, or the damping, is another from some moment on; times are over the record's length."""
    form = str(rng.choice(["jump_drive", "jump_rate"]))
    chosen = records(body, rng)
    unit = body.middle.undisturbed[1] if form == "jump_rate" else 1.0
    jumps = {
        place: {form: float(rng.choice([-1.0, 1.0])) * severity * unit, "jump_time": -float(rng.uniform(0.3, 0.7))}
        for place in chosen
    }
    return set_records(body, jumps), {
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
    return set_rigs(body, every(body), **fields), {"rigs": every(body), **fields}


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
    made = set_rigs(body, every(body), second_frequency=frequencies, **fields)
    return made, {"rigs": every(body), "frequency_ratio": ratio, **fields}


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
    return set_rigs(body, every(body), wake_gain=gains, **fields), {"rigs": every(body), "wake_gain": gain, **fields}


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


OPEN = {one.__name__: one for one in (damping_bump, time_jump, intermittent_lock_in, second_mode, wake_oscillator)}
