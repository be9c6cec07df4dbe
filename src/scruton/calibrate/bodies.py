"""What hangs in the wind: how every rig of a campaign truly moves, and how a new setting of the same body would.

Three kinds: the force that a law of the family asks for, the same with what no law has in it, and the wake oscillators
of VIVyD.  A campaign is simulated and scored in the same way whichever it is.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.sections import limit_cycle
from scruton.calibrate.regimes import AIR_DENSITY, DEPTH, FREQUENCY, Regime
from scruton.calibrate.thresholds import OUTSIDE_AMPLITUDE, OUTSIDE_RELAXATION
from scruton.calibrate.truths import Drawn, draw_normals, from_normals, omega0, setting, stated, wind_speed
from scruton.dynamics import Setting, amplitude_ratio, ehsan_scanlan_parameters, force_parameters
from scruton.infer.cards import ModelCard
from scruton.simulate import Disturbances, Noise, Truth, simulate_record
from scruton.simulate.disturbances import OFF
from scruton.simulate.equation import mean_rate

_TRIES = 1000
_AMPLITUDES = np.geomspace(0.02, 4.0, 60)  # over that of the force alone: it dies where all of them decay


class InWind(Protocol):
    """One rig in its wind, as it truly is."""

    @property
    def stable(self) -> tuple[float, float]:
        """Stable amplitude [A/D or rad] and relaxation rate [1/s] there."""

    @property
    def slowest(self) -> float:
        """Rate [1/s] at which a transient comes to rest: what the length of a record goes by."""

    @property
    def wind_speed(self) -> float:
        """Mean wind speed [m/s]."""

    @property
    def wind_exponent(self) -> float:
        """Relative change of the stable amplitude over that of the wind speed."""

    def record(
        self,
        *,
        initial_amplitude: float,
        duration: float,
        sample_rate: float,
        seed: np.random.SeedSequence,
        noise: Noise,
    ) -> tuple[FloatArray, FloatArray]:
        """Time [s] and response [A/D or rad] of one record, (N,) each; arguments as of `simulate_record`."""


@dataclass(frozen=True)
class Simulated:
    """A rig of `scruton.simulate`: a force, what disturbs it, and the limit cycle that follows."""

    wind: Truth
    stable: tuple[float, float]
    disturbances: Disturbances = OFF

    @property
    def slowest(self) -> float:
        """Of the limit cycle, of the force alone, and of an air that remembers."""
        if self.disturbances.off:
            return self.stable[1]
        memory = self.disturbances.memory_time
        return min(self.stable[1], self.wind.balance()[1], 0.5 / memory if memory else np.inf)

    @property
    def wind_speed(self) -> float:
        """Mean wind speed [m/s]."""
        return self.wind.wind_speed

    @property
    def wind_exponent(self) -> float:
        """As of the force alone."""
        return self.wind.wind_exponent

    def record(
        self,
        *,
        initial_amplitude: float,
        duration: float,
        sample_rate: float,
        seed: np.random.SeedSequence,
        noise: Noise,
    ) -> tuple[FloatArray, FloatArray]:
        """Integrate the full equation of motion."""
        if not self.disturbances.off:
            # Turbulence is scaled by the undisturbed limit cycle; here it shall scatter the amplitude that is there.
            (amplitude, rate), (usual, usual_rate) = self.stable, self.wind.balance()
            noise = replace(noise, turbulence=noise.turbulence * amplitude / usual * np.sqrt(rate / usual_rate))
        return simulate_record(
            self.wind, initial_amplitude=initial_amplitude, duration=duration, sample_rate=sample_rate, seed=seed,
            noise=noise, disturbances=self.disturbances,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Body:
    """All rigs of a campaign, and the stable amplitude of a new setting of the same body against its Scruton number.

    Zero where vibration dies; NaN where more than one amplitude is stable.
    """

    rigs: tuple[InWind, ...]
    curve: Callable[[float], float]


def draw_campaign(
    regime: Regime, card: ModelCard, seed: np.random.SeedSequence, beside: np.random.SeedSequence
) -> tuple[Drawn, Setting, Body]:
    """Draw one campaign, (1, J); what is outside the family is drawn again until every rig has a usual limit cycle.

    `card` is that of the prior, `seed` of what follows it, `beside` of what does not.
    """
    rng, other = np.random.default_rng(seed), np.random.default_rng(beside)
    for _ in range(_TRIES):
        drawn, setup, _ = from_normals(draw_normals(rng, regime, card, 1), regime, card)
        body = body_of(regime, drawn, setup, other)
        if not regime.outside:
            return drawn, setup, body
        stable = np.array([rig.stable for rig in body.rigs])
        (low, high), (slow, fast) = OUTSIDE_AMPLITUDE, OUTSIDE_RELAXATION
        amplitude, ratio = stable[:, 0], stable[:, 1] / omega0(regime.motion)
        if np.all((low <= amplitude) & (amplitude <= high) & (slow <= ratio) & (ratio <= fast)):
            return replace(drawn, a_star=stable[None, :, 0], relaxation_rate=stable[None, :, 1]), setup, body
    raise ValueError(f"regime {regime.name}: hardly any campaign has limit cycles of a usual size")


def body_of(regime: Regime, drawn: Drawn, setup: Setting, rng: np.random.Generator) -> Body:
    """Put rigs and curve together for one draw; what no prior has is drawn from `rng`."""
    if regime.wake:
        from scruton.calibrate.wake import Cylinder

        cylinder = Cylinder.drawn(regime, rng)
        factor = float(setting(regime, *stated(regime)).mass_damping_factor[0])
        tested = tuple(cylinder.rig(float(xi)) for xi in drawn.damping_ratio[0])
        return Body(tested, lambda sc: cylinder.rig(sc / factor).stable_amplitude)
    rigs = plain_rigs(regime, drawn, setup)
    if not regime.disturbances:
        return Body(rigs, lambda sc: _on_curve(drawn, sc))
    d = _disturbances(regime, rigs[len(rigs) // 2].stable, rng)
    disturbed = tuple(replace(rig, stable=limit_cycle(rig.wind, d), disturbances=d) for rig in rigs)

    def curve(sc: float) -> float:
        truth = _of_the_curve(regime, drawn, sc)
        amplitude, _ = limit_cycle(truth, d)
        dies = np.isnan(amplitude) and bool(np.all(mean_rate(truth, d, truth.balance()[0] * _AMPLITUDES) < 0.0))
        return 0.0 if dies else amplitude

    return Body(disturbed, curve)


def plain_rigs(regime: Regime, drawn: Drawn, setup: Setting) -> tuple[Simulated, ...]:
    """Rigs under the force of the regime's law alone."""
    rigs = []
    for j in range(len(regime.scruton_numbers)):
        a_star, rate, xi = (float(draws[0, j]) for draws in (drawn.a_star, drawn.relaxation_rate, drawn.damping_ratio))
        mass, density = (float(np.asarray(draws)[0, j]) for draws in (setup.mass, setup.air_density))
        forces = float(drawn.Y1[0, j]), float(drawn.epsilon[0, j])
        rigs.append(
            Simulated(_force(regime, still_rig(regime, mass, xi), density, (a_star, rate), forces), (a_star, rate))
        )
    return tuple(rigs)


def still_rig(regime: Regime, mass: float, damping_ratio: float) -> Truth:
    """A rig in still air."""
    return Truth(regime.motion, regime.width, DEPTH, mass, FREQUENCY[regime.motion], damping_ratio)


def _force(
    regime: Regime, still: Truth, density: float, stable: tuple[float, float], forces: tuple[float, float]
) -> Truth:
    """The rig in the wind, under the force that has the regime's law."""
    wind = replace(still, air_density=density, wind_speed=wind_speed(regime.motion))
    if regime.n in (-1.0, 2.0):
        return replace(wind, Y1=forces[0], epsilon=forces[1], force="ehsan-scanlan" if regime.n == 2.0 else "paper")
    return wind.power_law(*stable, regime.n)


def _on_curve(drawn: Drawn, scruton_number: float) -> float:
    """Stable amplitude on the shared curve."""
    x = (scruton_number - drawn.reference_scruton_number) / drawn.reference_relaxation
    return float((drawn.reference_amplitude * amplitude_ratio(x, drawn.n))[0])


def _of_the_curve(regime: Regime, drawn: Drawn, scruton_number: float) -> Truth:
    """A new setting of the body as it is stated, under the force of the shared curve, no part of it disturbed."""
    mass, density, xi = (values[:1] for values in stated(regime))
    factor = float(setting(regime, mass, density, xi).mass_damping_factor[0])
    damping = np.array([scruton_number / factor])
    place = setting(regime, mass, density, damping)
    relaxation = drawn.reference_relaxation - drawn.n * (scruton_number - drawn.reference_scruton_number)
    stable = _on_curve(drawn, scruton_number), float(relaxation[0]) / factor * omega0(regime.motion)
    Y1, epsilon = (ehsan_scanlan_parameters if regime.n == 2.0 else force_parameters)(*stable, place)
    still = still_rig(regime, float(mass[0]), float(damping[0]))
    return _force(regime, still, AIR_DENSITY, stable, (float(Y1[0]), float(epsilon[0])))


def _disturbances(regime: Regime, stable: tuple[float, float], rng: np.random.Generator) -> Disturbances:
    """Draw what disturbs every rig alike, in units of the middle rig's stable amplitude and relaxation rate."""
    amplitude, rate = stable
    units = {"amplitude": amplitude, "width": amplitude, "rate": rate, "time": 1.0 / rate}
    drawn: dict[str, Any] = {
        name: units[name.rsplit("_", 1)[1]] * float(rng.uniform(*span)) for name, span in regime.disturbances.items()
    }
    return Disturbances(**drawn)
