"""The bare model: the paper's law, one (Y1, epsilon) for the peak tests, constant structural damping, and its noise.

Small imperfections that every laboratory has, and that nobody would call a gap, are part of it with priors of their
own: `TOLERANCES` says what is too small to count.
"""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import COLUMNS, Layout, Parameter, Term, compact
from scruton.gap.data import GapData

TOLERANCES = {
    "stiffness": 5e-4,  # relative change of frequency up to the largest amplitude
    "wind_stiffness": 3e-3,  # the same in wind, where growth and decay move the frequency a little, too
    "third": 1.5e-3,  # in-phase third harmonic over the amplitude
    "gain": 3e-3,  # of a record
}


@dataclass(frozen=True, eq=False)
class BareModel:
    """Parameters of the bare model and the table of coefficients that they make."""

    data: GapData
    parameters: tuple[Parameter, ...]

    def table(self, values: dict[str, FloatArray]) -> FloatArray:
        """Coefficients of every record, (W, R, COLUMNS), from values by name, (W, R) each (zero: not a member)."""
        layout = self.data.layout
        walkers = next(iter(values.values())).shape[0]
        table = np.zeros((walkers, len(layout.records), COLUMNS))
        wind = layout.wind
        # Linear, so that an error of the stated ratio lies along a straight line with it.
        damping = layout.omega * self.data.nominal_damping * np.maximum(1.0 + values["damping"], 0.01)
        table[:, :, Term.STRUCTURAL] = damping
        a_star = np.ones((walkers, len(layout.records)))
        rate = damping.copy()
        if wind.any():
            still = layout.omega * self.data.nominal_damping
            aero = values["aerodynamic_rate"] * self.data.aero_ratio
            # The drive, given as the stable amplitude of the middle setting with its damping as stated.
            drive = values["stable_amplitude"] * (values["aerodynamic_rate"] + still[self.data.middle])
            drive *= self.data.drive_ratio
            mass = np.exp(values["mass"]) if "mass" in values else 1.0
            table[:, :, Term.AERO] = np.where(wind, aero * mass, 0.0)
            table[:, :, Term.DRIVE] = np.where(wind, drive * mass, 0.0)
            rate = np.where(wind, np.maximum(table[:, :, Term.AERO] + damping, 1e-3 * damping + 1e-9), rate)
            a_star = np.where(wind, table[:, :, Term.DRIVE] / rate, a_star)
        level = np.where(wind, a_star, layout.largest)
        unit = level * np.sqrt(2.0 * rate)
        table[:, :, Term.SCATTER] = values["scatter"] * unit
        table[:, :, Term.PHASE_SCATTER] = values["phase_scatter"] * unit
        table[:, :, Term.NOISE] = values["noise"]
        table[:, :, Term.DETUNING] = values["detuning"]
        table[:, :, Term.THIRD] = values["third"]
        table[:, :, Term.THIRD_NOISE] = values["third_noise"]
        table[:, :, Term.STIFFNESS] = values["bend"] / layout.largest.max() ** 2
        if wind.any():
            table[:, :, Term.STIFFNESS_LINEAR] = values["wind_bend"] / layout.largest.max()
        table[:, :, Term.GAIN] = values["reading"]
        return table


def bare_model(data: GapData) -> BareModel:
    """Priors of the bare model for a campaign."""
    layout = data.layout
    wind = layout.wind
    parameters = []

    def log(name: str, median: float, scale: float, members: np.ndarray, unit: str = "-") -> None:
        centre = float(np.log(median))
        parameters.append(Parameter(name, centre, scale, members, log=True, unit=unit, starts=(centre,)))

    def plain(name: str, scale: float, members: np.ndarray, unit: str = "-") -> None:
        parameters.append(Parameter(name, 0.0, scale, members, unit=unit))

    if wind.any():
        log("stable_amplitude", layout.reference_amplitude, 1.5, layout.in_wind(), "A/D or rad")
        log("aerodynamic_rate", 0.01 * layout.reference_omega, 1.2, layout.in_wind(), "1/s")
        if np.any(data.mass_sd[wind] > 0.0):
            plain("mass", 1.0, layout.by_test())
    plain("damping", 1.0, layout.by_rig(), "of the nominal")
    log("scatter", 0.008, 0.8, compact(np.where(wind, layout.test, len(data.tests) + layout.rig)))
    log("phase_scatter", 0.008, 1.5, compact(np.where(wind, layout.test, len(data.tests) + layout.rig)))
    log("noise", 1.0, 0.25, layout.by_rig())
    plain("detuning", 0.02, np.arange(len(layout.records)))
    plain("third", TOLERANCES["third"], layout.by_rig())
    log("third_noise", 1.0, 0.25, layout.by_rig())
    plain("bend", TOLERANCES["stiffness"], layout.everywhere())
    if wind.any():
        plain("wind_bend", TOLERANCES["wind_stiffness"], layout.in_wind())
    plain("reading", TOLERANCES["gain"], np.arange(len(layout.records)))
    return BareModel(data, tuple(parameters))


def reference(layout: Layout) -> str:
    """What sizes are referred to, in words."""
    return (
        f"stable amplitude {layout.reference_amplitude:.4g}, relaxation rate {layout.reference_rate:.4g} 1/s "
        f"({layout.reference_rate / layout.reference_omega:.3%} of omega)"
    )
