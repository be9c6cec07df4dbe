"""The null model: the paper's law, one (Y1, epsilon) for the peak tests, constant structural damping, and its noise.

Small imperfections that every laboratory has, and that nobody would call a gap, are part of it: slow gusts and
set-points, too.  All its priors are those of the model card's table [diagnosis].
"""

from dataclasses import dataclass, replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.effect import Parameter
from scruton.dynamics.effects.terms import COLUMNS, IntArray, Term, compact
from scruton.gap.data import GapData
from scruton.gap.thresholds import MOST_CORRELATION, MOST_GUSTS, MOST_SET_POINT


@dataclass(frozen=True, eq=False)
class NullModel:
    """Parameters of the null model and the table of coefficients that they make."""

    data: GapData
    parameters: tuple[Parameter, ...]

    def table(self, values: dict[str, FloatArray]) -> FloatArray:
        """Coefficients of every record, (W, R, COLUMNS), from values by name, (W, R) each (zero: not a member)."""
        layout, wind = self.data.layout, self.data.layout.wind
        still = layout.omega * self.data.nominal_damping
        # Linear, so that an error of the stated ratio lies along a straight line with it.
        damping = still * np.maximum(1.0 + values["damping"], 0.01)
        table = np.zeros((*damping.shape, COLUMNS))
        table[:, :, Term.STRUCTURAL] = damping
        level, rate = np.broadcast_to(layout.largest, damping.shape), damping
        if wind.any():
            # Of the middle setting with its damping as stated; what of the rate is the wind's may have either sign.
            relaxation = values["relaxation_rate"]
            aero = (relaxation - still[self.data.middle]) * self.data.aero_ratio
            drive = values["stable_amplitude"] * relaxation * self.data.drive_ratio
            strength = np.exp(values.get("mass", 0.0) + values["off_curve"])
            table[:, :, Term.AERO] = np.where(wind, aero * strength, 0.0)
            table[:, :, Term.DRIVE] = np.where(wind, drive * strength * np.exp(values["off_curve_epsilon"]), 0.0)
            rate = np.where(wind, np.maximum(table[:, :, Term.AERO] + damping, 1e-3 * damping + 1e-9), rate)
            level = np.where(wind, table[:, :, Term.DRIVE] / rate, level)
            # Gusts and set-points of the drive are those of the stable amplitude under the law.  They are bounded, or
            # they would take up whatever comes and goes; the prior is of the odds, which for small ones are the same.
            for term, name, most in (
                (Term.GUST, "gust_scatter", MOST_GUSTS),
                (Term.SET_POINT, "set_point_scatter", MOST_SET_POINT),
            ):
                table[:, :, term] = values[name] / (1.0 + values[name] / most) * table[:, :, Term.DRIVE]
            table[:, :, Term.GUST_RATE] = rate / np.where(wind, values["gust_time"], np.inf)
            table[:, :, Term.STIFFNESS_LINEAR] = values["stiffness_in_wind"] / layout.largest.max()
            table[:, :, Term.FREQUENCY_TREND] = values["frequency_trend"]
        unit = level * np.sqrt(2.0 * rate)
        table[:, :, Term.SCATTER] = values["scatter"] * unit
        table[:, :, Term.PHASE_SCATTER] = values["phase_scatter"] * unit
        table[:, :, Term.NOISE] = values["noise"] * values["record_noise"]
        for term in (Term.DETUNING, Term.THIRD, Term.THIRD_NOISE, Term.GAIN):
            table[:, :, term] = values[term.name.lower()]
        for term in (Term.CORRELATION, Term.PHASE_CORRELATION):
            correlation = values[term.name.lower()]  # bounded, too: what is smooth from cycle to cycle is no noise
            table[:, :, term] = correlation / np.hypot(1.0, correlation / MOST_CORRELATION)
        table[:, :, Term.FREQUENCY_LOSS] = values["frequency_loss"]
        table[:, :, Term.STIFFNESS] = values["stiffness"] / layout.largest.max() ** 2
        return table


def null_model(data: GapData) -> NullModel:
    """The null model of a campaign, with the priors of its card."""
    layout, wind = data.layout, data.layout.wind
    parameters = []

    def add(name: str, members: IntArray, *, times: float = 1.0, unit: str = "-", on_card: str = "") -> None:
        """A parameter whose prior's median is `times` that of the card, where another name may stand for it."""
        prior = data.priors[on_card or name]
        centre = float(np.log(prior.first * times)) if prior.logarithmic else prior.first
        parameters.append(Parameter(name, centre, prior.scale, members, prior.logarithmic, unit=unit, starts=(centre,)))

    if wind.any():
        add("stable_amplitude", layout.in_wind(), times=layout.reference_amplitude, unit="A/D or rad")
        omega = layout.reference_omega
        add("relaxation_rate", layout.in_wind(), times=omega, unit="1/s", on_card="aerodynamic_rate")
        if np.any(data.mass_sd[wind] > 0.0):
            mass_sd = np.maximum(data.mass_sd[list(data.first_in_wind.values())], 1e-6)
            parameters.append(Parameter("mass", 0.0, mass_sd, layout.by_test()))
        for name in ("off_curve", "off_curve_epsilon"):
            add(name, compact(np.where(wind, layout.rig, -1)), on_card="off_curve")
    rigs = np.unique(layout.rig)
    parameters.append(Parameter("damping", 0.0, data.damping_sd[rigs], layout.by_rig(), unit="of the nominal"))
    groups = compact(np.where(wind, layout.test, len(data.tests) + layout.rig))
    # In still air nothing pushes the amplitude about but draughts.
    still = np.array([not wind[groups == j].any() for j in range(groups.max() + 1)])
    for name in ("scatter", "phase_scatter"):
        add(name, groups)
        centre = np.where(still, data.priors["still_air_scatter"].location, parameters[-1].location)
        parameters[-1] = replace(parameters[-1], location=centre)
    each = np.arange(len(layout.records))
    for name, members in (
        ("noise", groups),
        ("correlation", groups),
        ("phase_correlation", groups),
        ("record_noise", each),
        ("detuning", each),
        ("third", layout.by_rig()),
        ("third_noise", layout.by_rig()),
        ("stiffness", layout.everywhere()),
        ("stiffness_in_wind", layout.in_wind()),
        ("frequency_trend", layout.each(wind)),
        ("frequency_loss", compact(np.where(wind, len(layout.records), 0))),
        ("gain", each),
        ("gust_scatter", layout.by_test()),
        ("gust_time", layout.by_test()),
        ("set_point_scatter", layout.in_wind()),
    ):
        if members.max() >= 0:
            add(name, members, on_card="correlation" if name == "phase_correlation" else "")
    return NullModel(data, tuple(parameters))
