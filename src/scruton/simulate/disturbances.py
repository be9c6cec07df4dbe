"""What the plain equation of motion leaves out: forces, changes in time, faults of the channel; all off by default."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray

COHERENCE_FORMS = ("exponential", "tanh", "algebraic")
FRICTION_FORMS = ("tanh", "dahl")
DRIFT_FORMS = ("linear", "cosine")


@dataclass(frozen=True)
class Disturbances:
    r"""What is added to the equation of motion of one record; x is A/D or rad, v its rate.

    Attributes
    ----------
    friction : float
        Coulomb force over mass [1/s^2].
    friction_form : {"tanh", "dahl"}
        F tanh(v/scale), or Dahl's hysteresis (LuGre friction without Stribeck effect): the force builds up over a
        presliding displacement, dF/dx = (F - f sign v)/scale.
    friction_scale : float
        Presliding velocity [1/s] or displacement.
    quadratic_drag : float
        Of the rig: acceleration -c abs(v) v.
    displacement_drag : float
        Of the rig: -c x^2 v [1/s].
    linear_stiffness_slope, cubic_stiffness : float
        Of the rig: -omega0^2 (k2 abs(x) + k3 x^2) x.
    aero_xxv, aero_vvv, aero_xv, aero_xxxxv : float
        In wind: -c x^2 v, -c v^3, -c abs(x) v, -c x^4 v.
    coherence_amplitude : float
        Below it the second term of the force is lost; 0 is off.
    coherence_form : {"exponential", "tanh", "algebraic"}
        1 - exp(-u), tanh(u), or u/sqrt(1 + u^2) with u = a/a_c, a the running amplitude sqrt(x^2 + (v/omega)^2).
    memory_time : float
        The aerodynamic damping is that of the running amplitude a first-order lag of so many seconds ago.
    bump_rate, bump_amplitude, bump_width : float
        Damping -2 r v near one amplitude, r [1/s] at the top of a normal curve.
    bump_in_still_air : bool
        Whether the bump is the rig's.
    drift, drift_form : float, {"linear", "cosine"}
        Relative change of the wind speed over the record, centred on its middle.
    drift_from_start : bool
        The speed that is stated is that at the record's start.
    jump_time : float
        s; 0 is off.
    jump_drive, jump_rate : float
        After it, relative change of the force's second term, and added damping rate [1/s].
    spell_on, spell_off, spell_depth : float
        Intermittent lock-in: mean durations [s], and the part of the second term that is lost while off.
    wake_share : float
        Part of the second term that is taken over by a wake oscillator, q'' + e w (q^2 - 1) q' + w^2 q = A x''.
    wake_gain : float
        Acceleration of the section per unit of q [1/s^2].
    wake_damping, wake_coupling, wake_frequency : float
        e, A, and w over the section's frequency.
    second_amplitude, second_frequency, second_rate, second_scatter : float
        Another mode in the channel: its amplitude at release, frequency [Hz], decay rate [1/s], and the standard
        deviation that turbulence keeps it at.
    gain : float
        Of the channel.
    clip_level, clip_sharpness : float
        y/(1 + abs(y/level)^p)^(1/p); a level of 0 is off.
    """

    friction: float = 0.0
    friction_form: str = "tanh"
    friction_scale: float = 1.0
    quadratic_drag: float = 0.0
    displacement_drag: float = 0.0
    linear_stiffness_slope: float = 0.0
    cubic_stiffness: float = 0.0
    aero_xxv: float = 0.0
    aero_vvv: float = 0.0
    aero_xv: float = 0.0
    aero_xxxxv: float = 0.0
    coherence_amplitude: float = 0.0
    coherence_form: str = "exponential"
    memory_time: float = 0.0
    bump_rate: float = 0.0
    bump_amplitude: float = 0.0
    bump_width: float = 1.0
    bump_in_still_air: bool = False
    drift: float = 0.0
    drift_form: str = "linear"
    drift_from_start: bool = False
    jump_time: float = 0.0
    jump_drive: float = 0.0
    jump_rate: float = 0.0
    spell_on: float = 0.0
    spell_off: float = 0.0
    spell_depth: float = 0.0
    wake_share: float = 0.0
    wake_gain: float = 0.0
    wake_damping: float = 0.0
    wake_coupling: float = 0.0
    wake_frequency: float = 1.0
    second_amplitude: float = 0.0
    second_frequency: float = 0.0
    second_rate: float = 0.0
    second_scatter: float = 0.0
    gain: float = 1.0
    clip_level: float = 0.0
    clip_sharpness: float = 12.0

    def __post_init__(self) -> None:
        for field, forms in (
            ("friction_form", FRICTION_FORMS), ("coherence_form", COHERENCE_FORMS), ("drift_form", DRIFT_FORMS)
        ):  # fmt: skip
            if getattr(self, field) not in forms:
                raise ValueError(f"{field} is one of {', '.join(forms)}; found {getattr(self, field)!r}")
        for field in ("friction_scale", "bump_width", "clip_sharpness"):
            if not getattr(self, field) > 0.0:
                raise ValueError(f"{field} is positive; found {getattr(self, field)!r}")

    @property
    def off(self) -> bool:
        """Whether nothing is added."""
        return self == OFF


OFF = Disturbances()


def schedules(
    disturbances: Disturbances, time: FloatArray, *, still: bool, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What changes in time, sample by sample, (N,) each.

    Returns
    -------
    speed : array
        Wind speed over the stated one.
    drive : array
        Factor of the force's second term.
    rate : array
        Added damping rate [1/s].
    """
    d, unchanged = disturbances, np.ones_like(time)
    if still:
        return unchanged, unchanged, 0.0 * unchanged
    u = time / time[-1]
    rise = u - 0.5 if d.drift_form == "linear" else -0.5 * np.cos(np.pi * u)
    speed = unchanged + d.drift * (rise + 0.5 if d.drift_from_start else rise)
    after = (time >= d.jump_time) & (d.jump_time > 0.0)
    drive = np.where(after, 1.0 + d.jump_drive, 1.0)
    if d.spell_depth:  # a random telegraph: lock-in is on for exponential times, then off
        now, is_on = 0.0, bool(rng.random() < d.spell_on / (d.spell_on + d.spell_off))
        on = np.zeros(time.shape, bool)
        while now < time[-1]:
            end = now + rng.exponential(d.spell_on if is_on else d.spell_off)
            on[(time >= now) & (time < end)] = is_on
            now, is_on = end, not is_on
        drive = drive * np.where(on, 1.0, 1.0 - d.spell_depth)
    return speed, drive, np.where(after, d.jump_rate, 0.0)


def read_out(disturbances: Disturbances, response: FloatArray, step: float, rng: np.random.Generator) -> FloatArray:
    """What the channel shows of the response: another mode, its gain, its range."""
    d, shown = disturbances, response
    if d.second_amplitude or d.second_scatter:
        from scipy.signal import lfilter

        # A linear oscillator's complex amplitude, kicked by white noise: exact from sample to sample.
        samples = len(response)
        pole = np.exp((-d.second_rate + 2j * np.pi * d.second_frequency) * step)
        fresh = d.second_scatter * np.sqrt(-np.expm1(-2.0 * d.second_rate * step))
        kicks = fresh * (rng.standard_normal(samples) + 1j * rng.standard_normal(samples))
        start = d.second_scatter * (rng.standard_normal() + 1j * rng.standard_normal())
        kicks[0] = start + d.second_amplitude * np.exp(2j * np.pi * rng.random())
        shown = shown + np.real(lfilter([1.0], [1.0, -pole], kicks))
    shown = d.gain * shown
    if d.clip_level:
        shown = shown / (1.0 + np.abs(shown / d.clip_level) ** d.clip_sharpness) ** (1.0 / d.clip_sharpness)
    return shown
