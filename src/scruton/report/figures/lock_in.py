"""Amplitude against reduced velocity through the lock-in range, as the paper's Figs. 1 and 6a."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.griffin.posterior import draws_of, test_names
from scruton.report.figures.style import (
    BLACK,
    FigureWithCaption,
    Look,
    add_degrees,
    amplitude_label,
    below,
    house_style,
    look,
    new_figure,
    shorten,
)

if TYPE_CHECKING:
    from scruton.infer.results import Fit

_SPEEDS = 1.005  # wind speeds of one rig that differ by more are several speeds


def has_lock_in(fit: "Fit") -> bool:
    """Whether there are sweeps, or one rig was tested at several speeds."""
    speeds: dict[str, list[float]] = {}
    for test in fit.campaign.tests:
        speeds.setdefault(test.rig, []).append(test.wind_speed.mean)
    return bool(fit.campaign.sweeps) or any(max(one) > _SPEEDS * min(one) for one in speeds.values())


def lock_in_plot(fit: "Fit") -> FigureWithCaption:
    """Steady amplitudes of the sweeps by rig, and each test's posterior where it was made.

    Parameters
    ----------
    fit : Fit
        With sweeps, or tests at several speeds; see `has_lock_in`.
    """
    campaign, tree = fit.campaign, fit.tree
    depth, unit = campaign.section.depth, campaign.section.amplitude_unit
    wanted = {sweep.rig for sweep in campaign.sweeps} | {test.rig for test in campaign.tests}
    used = [rig.name for rig in campaign.rigs if rig.name in wanted]
    style: dict[str, Look] = {name: look(i) for i, name in enumerate(used)}
    frequency = {rig.name: rig.frequency.mean for rig in campaign.rigs}
    top = 0.0
    with house_style():
        figure = new_figure(95.0)
        axes = figure.subplots()
        for sweep in campaign.sweeps:
            one = style[sweep.rig]
            order = np.argsort(sweep.wind_speed, kind="stable")
            axes.plot(
                sweep.wind_speed[order] / (frequency[sweep.rig] * depth), sweep.amplitude[order], color=one.colour,
                ls=one.line, lw=0.8, marker=one.marker, ms=3.5, label=shorten(f"rig {sweep.rig}, sweep"),
            )  # fmt: skip
            top = max(top, float(sweep.amplitude.max()))
        for rig in used:
            mine = [test for test in campaign.tests if test.rig == rig and test.name in test_names(tree)]
            if not mine:
                continue
            x = [test.wind_speed.mean / (frequency[rig] * depth) for test in mine]
            low, middle, high = np.array(
                [np.quantile(draws_of(tree, "a_star", test.name), [0.05, 0.5, 0.95]) for test in mine]
            ).T
            one = style[rig]
            axes.errorbar(
                x, middle, [middle - low, high - middle], fmt=one.marker, ms=7.5, mfc="none", color=one.colour,
                elinewidth=0.9, capsize=2.5, label=f"rig {shorten(rig, 20)}, posterior, 90 %", zorder=4,
            )  # fmt: skip
            top = max(top, float(high.max()))
        stated = [test for test in campaign.tests if test.stable_amplitude is not None]
        if stated:
            axes.plot(
                [test.wind_speed.mean / (frequency[test.rig] * depth) for test in stated],
                [test.stable_amplitude.mean for test in stated if test.stable_amplitude is not None],
                "x", color=BLACK, ms=5, mew=1.1, label="measured stable amplitude", zorder=5,
            )  # fmt: skip
        axes.set_ylim(0.0, 1.08 * top)
        axes.set_xlabel(r"Reduced velocity $U/(f_0 D)$ [-]")
        axes.set_ylabel(amplitude_label(unit))
        if unit == "rad":
            add_degrees(axes)
        below(figure, [axes])
    return FigureWithCaption(
        figure,
        "lock_in",
        "Steady amplitude against reduced velocity, with the still-air frequency of each rig: sweeps where the "
        "campaign has them, and the stable amplitude of every test's posterior with its 90 % interval.",
        f"Amplitude through the lock-in range for rig(s) {', '.join(used)}.",
    )
