r"""Rigs in the wake oscillators of VIVyD, which nobody here wrote: Facchinetti, Tamura and Matsui, Hartlen and Currie.

VIVyD has the equations and integrates them, for records and for stable amplitudes alike.  Only the wind speed of a
rig's test, and the state that its wake starts from, come from here, by the harmonic balance of VIVyD's general model

.. math:: \ddot y + c\dot y + k y = B_0 q, \qquad
   \ddot q + \gamma(a q^2 + b\dot q^2 - 1)\dot q + \kappa q = A_2\ddot y + A_1\dot y + A_0 y

VIVyD is loaded when it is needed: the package does not depend on it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.regimes import AIR_DENSITY, DEPTH, FREQUENCY, Regime
from scruton.errors import InputError
from scruton.simulate import Noise

# Class in `vivyd.models`, and the coefficients of its wake, which are drawn about the published ones.
WAKES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "facchinetti": ("FacchinettiDelangreBiolleyModel", ("eps", "A", "Cl0")),
    "tamura-matsui": ("TamuraModel", ("zeta", "Cl0", "l_star")),
    "hartlen-currie": ("HartlenCurrieModel", ("alpha", "gamma", "b_star")),
}
SAMPLES_PER_CYCLE, SUBSTEPS = 28, 2
_SCATTER = 0.1  # log sd of those coefficients
_SPEEDS = np.linspace(0.9, 1.4, 201)  # where a peak is looked for, over the speed at which the wake sheds at f0
_FREQUENCIES = np.linspace(0.8, 1.5, 7001)  # where a limit cycle is looked for, over f0
_SETTLES, _DECAYS = 8.0, 5.0  # relaxation times of the structure alone that quiet runs last for
_RELEASE, _WITHIN = 0.1, (0.005, 0.05)  # deviation of a quiet release, and deviations that the rate is that of


def vivyd() -> ModuleType:
    """VIVyD where it is installed; InputError that says how to get it where it is not."""
    try:
        import vivyd.models
        import vivyd.solvers
    except ImportError as error:
        wanted = "VIVyD, which has them: pip install vivyd"
        raise InputError("calibration", "regimes", f"wake oscillators, but {error}", wanted) from error
    module: ModuleType = vivyd
    return module


@dataclass(frozen=True)
class Cycle:
    """A limit cycle by harmonic balance: circular frequency [rad/s], and displacement [m] over the wake, complex."""

    omega: float
    response: complex
    wake: float

    @property
    def amplitude(self) -> float:
        """A/D."""
        return abs(self.response) * self.wake / DEPTH


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A circular cylinder: one of `WAKES`, mass [kg/m] and frequency [Hz] of its rigs, coefficients of its wake."""

    wake: str
    mass: float
    frequency: float
    coefficients: Mapping[str, float]

    @classmethod
    def drawn(cls, regime: Regime, rng: np.random.Generator) -> "Cylinder":
        """Draw the coefficients about the published ones, which are VIVyD's defaults."""
        name, varied = WAKES[regime.wake]
        published = getattr(vivyd().models, name)()
        factors = np.exp(_SCATTER * rng.standard_normal(len(varied)))
        values = {key: float(getattr(published, key).get() * by) for key, by in zip(varied, factors, strict=True)}
        return cls(regime.wake, regime.mass, FREQUENCY[regime.motion], values)

    def rig(self, damping_ratio: float) -> "WakeRig":
        """A rig at its peak: where growth from rest ends at the largest amplitude, by harmonic balance."""
        best, largest = self.at(damping_ratio, 1.0), 0.0
        for speed in _SPEEDS:
            rig = self.at(damping_ratio, float(speed))
            cycles = rig.cycles
            # Growth may end on the lower branch where there are several.
            if len(cycles) == 1 and cycles[0].amplitude > largest:
                best, largest = rig, cycles[0].amplitude
        return best

    def at(self, damping_ratio: float, speed: float) -> "WakeRig":
        """A rig at a wind speed, over that at which the wake sheds at the rig's natural frequency."""
        models = vivyd().models
        model, natural = getattr(models, WAKES[self.wake][0]), 2.0 * np.pi * self.frequency
        wind_speed = speed * self.frequency * DEPTH / float(model().St.get())
        given = {
            "diam": DEPTH, "rho": AIR_DENSITY, "m_lin": self.mass, "u_inf": wind_speed, "k_m": natural**2,
            "c_m": 2.0 * damping_ratio * natural, **self.coefficients,
        }  # fmt: skip
        general = model(**{key: models.Param(value) for key, value in given.items()}).generalized_params
        return WakeRig(
            self.frequency, damping_ratio, wind_speed, {key: float(one.get()) for key, one in general.items()}
        )


@dataclass(frozen=True, eq=False)
class WakeRig:
    """A rig of a cylinder in its wind; `terms` are the coefficients of VIVyD's `GeneralizedModel`, by name."""

    frequency: float
    damping_ratio: float
    wind_speed: float
    terms: Mapping[str, float]

    wind_exponent = 1.0  # no gusts are asked of it

    @cached_property
    def cycles(self) -> tuple[Cycle, ...]:
        """Limit cycles by harmonic balance, the largest first."""
        k = dict.fromkeys(("c_m", "ca_m", "a", "b", "A0", "A1", "A2"), 0.0) | dict(self.terms)

        def response(w: Any) -> Any:
            return k["B0"] / (k["k_m"] - w * w + 1j * w * (k["c_m"] + k["ca_m"]))

        def fed(w: Any) -> Any:
            return (k["A0"] + 1j * w * k["A1"] - w * w * k["A2"]) * response(w)

        omega = 2.0 * np.pi * self.frequency * _FREQUENCIES
        off = k["kappa"] - omega**2 - fed(omega).real
        found = []
        for i in np.flatnonzero(np.sign(off[1:]) != np.sign(off[:-1])):
            w = float(omega[i] - off[i] * (omega[i + 1] - omega[i]) / (off[i + 1] - off[i]))
            square = (1.0 + fed(w).imag / (k["gamma"] * w)) / (0.25 * k["a"] + 0.75 * k["b"] * w * w)
            if square > 0.0:
                found.append(Cycle(w, complex(response(w)), float(np.sqrt(square))))
        return tuple(sorted(found, key=lambda cycle: -cycle.amplitude))

    @cached_property
    def stable_amplitude(self) -> float:
        """A/D at the end of a long quiet run."""
        return float(self._quiet(self.cycles[0].amplitude, _SETTLES)[-5 * SAMPLES_PER_CYCLE :].mean())

    @cached_property
    def stable(self) -> tuple[float, float]:
        """Stable amplitude, and the rate [1/s] at which deviations die out, mean of releases above and below it.

        NaN where they do not die out in time.
        """
        rates = []
        for start in (1.0 - _RELEASE, 1.0 + _RELEASE):
            deviation = np.abs(self._quiet(start * self.stable_amplitude, _DECAYS) / self.stable_amplitude - 1.0)
            first, last = (int(np.argmax(deviation < limit)) for limit in _WITHIN[::-1])
            if last < first + SAMPLES_PER_CYCLE:
                return self.stable_amplitude, np.nan
            time = np.arange(first, last) / (SAMPLES_PER_CYCLE * self.frequency)
            rates.append(-np.polyfit(time, np.log(deviation[first:last]), 1)[0])
        return self.stable_amplitude, float(np.mean(rates))

    @property
    def slowest(self) -> float:
        """Rate [1/s] that the length of a record goes by."""
        return self.stable[1]

    def record(
        self,
        *,
        initial_amplitude: float,
        duration: float,
        sample_rate: float,
        seed: np.random.SeedSequence,
        noise: Noise,
    ) -> tuple[FloatArray, FloatArray]:
        """Integrate one record by VIVyD's solver; turbulence is white and kicks the structure between samples."""
        rng = np.random.default_rng(seed)
        phase = rng.uniform(0.0, 2.0 * np.pi)
        time = np.arange(int(np.floor(duration * sample_rate)) + 1) / sample_rate
        kicks = np.zeros(time.size)
        if noise.turbulence:
            amplitude, rate = self.stable
            strength = 2.0 * self.cycles[0].omega * noise.turbulence * amplitude * np.sqrt(rate / sample_rate)
            kicks = strength * rng.standard_normal(time.size)
        response = self._run(initial_amplitude, phase, time, kicks)
        return time, response + noise.sensor_noise * rng.standard_normal(time.size)

    def _quiet(self, initial_amplitude: float, relaxations: float) -> FloatArray:
        """Amplitude A/D of a run without noise, a moving mean over one cycle, sample by sample."""
        rate = 2.0 * np.pi * self.frequency * self.damping_ratio
        time = np.arange(int(SAMPLES_PER_CYCLE * self.frequency * relaxations / rate)) / (
            SAMPLES_PER_CYCLE * self.frequency
        )
        y = self._run(initial_amplitude, 0.0, time, np.zeros(time.size))
        quarter = SAMPLES_PER_CYCLE // 4
        turned = 0.5 * (y[2 * quarter :] - y[: -2 * quarter])
        amplitude = np.sqrt(y[quarter:-quarter] ** 2 + turned**2)
        return np.convolve(amplitude, np.full(SAMPLES_PER_CYCLE, 1.0 / SAMPLES_PER_CYCLE), "valid")

    def _run(self, initial_amplitude: float, phase: float, time: FloatArray, kicks: FloatArray) -> FloatArray:
        """Displacement A/D, (N,); the wake starts as in its limit cycle, and in step with the structure."""
        package = vivyd()
        model = package.models.GeneralizedModel(**{key: package.models.Param(one) for key, one in self.terms.items()})
        solver, cycle = package.solvers.RK4(), self.cycles[0]
        y = initial_amplitude * DEPTH * np.exp(1j * phase)
        q = cycle.wake * np.exp(1j * (phase - np.angle(cycle.response)))
        turn = 1j * cycle.omega
        state = np.array([(turn * y).real, y.real, (turn * q).real, q.real])
        if not kicks.any():
            return np.asarray(solver.run(model, state, time, n_substeps=SUBSTEPS)[:, 1] / DEPTH)
        out = np.empty(time.size)
        out[0] = state[1]
        for i in range(1, time.size):
            state = solver.run(model, state, time[i - 1 : i + 1], n_substeps=SUBSTEPS)[-1]
            state[0] += kicks[i] * DEPTH
            out[i] = state[1]
        return out / DEPTH
