"""Figures of the sizing: risk against added damping, damping by confidence, mass against risk, shares, cost."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, figure

Content = Mapping[str, Any]
CONFIDENCES = ("0.50", "0.84", "0.95", "0.99")
_COLOURS = (style.GREEN, style.ORANGE, style.VERMILLION, style.PURPLE)  # of the confidences
_BAND: dict[str, Any] = {"color": style.SKY, "alpha": 0.4, "lw": 0}


def modes(content: Content, having: Callable[[Content], Any] = bool) -> dict[str, Content]:
    """Every mode that has what is drawn, by what the names of its figures end with."""
    several = len(content["modes"]) > 1
    return {f"_{k}" if several else "": mode for k, mode in enumerate(content["modes"], 1) if having(mode)}


def governing(mode: Content) -> Content:
    """The limit that decides: the smallest."""
    found: Content = next(one for one in mode["limits"] if one["rule"] == mode["governing"])
    return found


def _array(values: Any) -> Any:
    return np.array([np.nan if one is None else one for one in values], dtype=float)


@figure("sizing", name="risk", source="sizing", each=modes)
def risk_curves(content: Content, mode: Content) -> FigureWithCaption:
    """Probability of exceeding the limit, and amplitude, against added damping."""
    one = governing(mode)
    curve = one["curve"]
    x = 100.0 * _array(curve["added_damping"])
    drawing, axes = style.panels(2, height_mm=70.0)
    left, right = axes
    low, high = (_array(curve[f"probability_{q}"]) for q in ("05", "95"))
    left.fill_between(x, low, high, **_BAND, label="90 % band of section and law")
    left.plot(x, _array(curve["probability"]), color=style.BLUE, label="P(amplitude > limit)")
    if len(curve["by_law"]) > 1:
        for k, (label, values) in enumerate(curve["by_law"].items()):
            pen = style.line_style(k + 1).pen
            left.plot(x, _array(values), **pen, lw=0.8, label=label.replace("n=", "n = "))
    left.axhline(0.05, color=style.GREY, lw=0.6)
    left.annotate("5 %", (x[-1], 0.05), ha="right", va="bottom", color=style.GREY, fontsize=7)
    for p, colour in zip(CONFIDENCES, _COLOURS, strict=True):
        value = one["required"][p]
        if value is not None and value > 0.0:
            left.plot(100 * value, 1.0 - float(p), "o", color=colour, ms=5, zorder=5)
            left.annotate(f"{100 * float(p):.0f} %", (100 * value, 1.0 - float(p)), xytext=(4, 4),
                          textcoords="offset points", fontsize=7)  # fmt: skip
    left.set(xlabel="Added damping ratio [%]", ylabel="Probability", ylim=(0.0, 1.02))
    factor, shown = (1e3, "mm") if content["amplitude_unit"] == "m" else (180.0 / np.pi, "°")
    low, middle, high = (factor * _array(curve[f"amplitude_{q}"]) for q in ("05", "50", "95"))
    right.fill_between(x, low, high, **_BAND, label="90 % interval")
    right.plot(x, middle, color=style.BLUE, label="median amplitude")
    right.axhline(factor * one["limit"], color=style.VERMILLION, ls="--", label="limit")
    top = float(np.nanmax(high, initial=0.0))
    right.set(xlabel="Added damping ratio [%]", ylabel=f"Stable amplitude [{shown}]",
              ylim=(0.0, 1.08 * max(min(top, 6.0 * factor * one["limit"]), factor * one["limit"])))  # fmt: skip
    style.below(drawing, axes)
    left.set_title(f"Mode {style.shorten(mode['name'])}, limit {style.shorten(one['rule'])}")
    return FigureWithCaption(
        drawing,
        caption=f"Risk of mode {mode['name']} against added damping, limit {one['rule']}. Left: probability that the "
        "stable amplitude in lock-in exceeds the limit, with the band that the section's posterior and the law leave; "
        "dots are the confidences. Right: the amplitude.",
        alt=f"Probability of exceeding the limit falls from {one['probability']:.2f} without added damping; "
        + "; ".join(f"{p}: {one['required_text'][p]}" for p in CONFIDENCES),
    )  # fmt: skip


@figure("sizing", name="shares", source="sizing", each=modes)
def variance_shares(content: Content, mode: Content) -> FigureWithCaption:
    """Shares of variance: first-order and total Sobol' indices."""
    rows = mode["shares"]["needed"]
    other = {one["source"]: one for one in mode["shares"]["amplitude"]}
    drawing, axes = style.panels(2, height_mm=14.0 + 8.0 * len(rows), sharey=True)
    for one, title, values in (
        (axes[0], "damping that is needed", rows),
        (axes[1], "amplitude at the required damping", [other[row["source"]] for row in rows]),
    ):
        y = np.arange(len(rows))
        one.barh(
            y, [100 * value["total"] for value in values], color=style.LIGHT, height=0.7, label="with interactions"
        )
        one.barh(y, [100 * max(value["first"], 0.0) for value in values], color=style.BLUE, height=0.4, label="alone")
        one.set(xlabel="Share of variance [%]", title=title, xlim=(0.0, 105.0))
    axes[0].set_yticks(range(len(rows)), [row["source"] for row in rows])
    axes[0].invert_yaxis()
    axes[1].legend(loc="lower right")
    return FigureWithCaption(
        drawing,
        caption=f"What the uncertainty of mode {mode['name']} comes from: Sobol' shares of the variance of the added "
        "damping that is needed, and of the amplitude at the damping required with 95 % confidence.",
        alt="; ".join(f"{row['source']} {row['first']:.0%}" for row in rows),
    )  # fmt: skip


@figure(
    "sizing",
    name="damper",
    source="sizing",
    each=lambda content: modes(content, lambda mode: mode["damper"]["dampers"]),
)
def damper_masses(content: Content, mode: Content) -> FigureWithCaption:
    """Mass of the damper against risk, with its stroke."""
    damper = mode["damper"]
    chart = damper["map"]
    stated = chart["mass"] is not None
    x = _array(chart["mass"]) / 1e3 if stated else 100.0 * _array(chart["mass_ratio"])
    drawing, axes = style.panels(2, height_mm=58.0)
    left, right = axes
    left.plot(x, 100.0 * _array(chart["probability"]), color=style.BLUE, marker="o", ms=3)
    left.axhline(100.0 * damper["asked"]["risk"], color=style.VERMILLION, ls="--", lw=0.8, label="risk asked for")
    own = damper["mass"] / 1e3 if stated else 100.0 * damper["mass_ratio"]
    own_label = "damper of least mass" if damper["achievable"] else "heaviest, and not enough"
    middle = damper["stroke"]["median"]  # None where no amplitude is stable
    left.plot(own, 100.0 * damper["probability"], "D", color=style.BLACK, label=own_label)
    left.legend()
    label = "Mass of all dampers [t]" if stated else "Mass ratio [%]"
    left.set(xlabel=label, ylabel="P(amplitude > limit) [%]")
    left.set_ylim(bottom=0.0)
    stroke = 1e3 * _array(chart["stroke"])
    right.fill_between(x, stroke, 1e3 * _array(chart["stroke_high"]), **_BAND, label="median to 95 %")
    right.plot(x, stroke, color=style.BLUE, marker="o", ms=3, label="median stroke")
    right.plot(own, np.nan if middle is None else 1e3 * middle, "D", color=style.BLACK)
    if damper["asked"]["largest_stroke"]:
        right.axhline(
            1e3 * damper["asked"]["largest_stroke"], color=style.VERMILLION, ls="--", lw=0.8, label="largest stroke"
        )
    right.set(xlabel=label, ylabel="Relative stroke [mm]")
    right.set_ylim(bottom=0.0)
    right.legend()
    count = damper["asked"]["number"]
    left.set_title(
        f"Mode {style.shorten(mode['name'])}: {'one damper' if count == 1 else f'{count} dampers'}, tuned at every mass"
    )
    return FigureWithCaption(
        drawing,
        caption=f"Tuned mass damper of mode {mode['name']}: risk and stroke against its mass, tuned for the least risk "
        "at every mass under the uncertainty of the frequency"
        + (", within the largest stroke where the mass allows it." if damper["asked"]["largest_stroke"] else "."),
        alt=f"Risk falls with mass; the {'lightest that is good enough' if damper['achievable'] else 'heaviest'} "
        f"leaves {damper['probability']:.3f}.",
    )  # fmt: skip


@figure(
    "sizing",
    name="cost",
    source="sizing",
    each=lambda content: modes(
        content, lambda mode: any(key in mode.get("cost", {}) for key in ("by_damping", "by_mass"))
    ),
)
def expected_costs(content: Content, mode: Content) -> FigureWithCaption:
    """Expected cost against what is bought: damping, or mass."""
    cost = mode["cost"]
    curves = [key for key in ("by_damping", "by_mass") if key in cost]
    drawing, axes = style.panels(len(curves), height_mm=60.0)
    money = cost["currency"] or "currency"
    for one, key in zip(axes, curves, strict=True):
        curve = cost[key]
        by_mass = key == "by_mass"
        x = _array(curve["mass"]) / 1e3 if by_mass else 100.0 * _array(curve["added_damping"])
        one.plot(x, _array(curve["damper"]), color=style.GREEN, ls=":", label="damper")
        one.plot(x, _array(curve["failure"]), color=style.VERMILLION, ls="--", label="expected failure")
        one.plot(x, _array(curve["total"]), color=style.BLUE, label="sum")
        if by_mass:
            too_light = np.where(curve["allowed"], np.nan, _array(curve["total"]))
            if np.isfinite(too_light).any():
                one.plot(x, too_light, "o", ms=4, mfc="white", color=style.BLUE, label="not allowed: stroke or mass")
        best = curve["best_mass"] / 1e3 if by_mass else 100.0 * curve["best_added_damping"]
        one.plot(best, curve["best_total"], "D", color=style.BLACK, label="least")
        one.set(xlabel="Mass of all dampers [t]" if by_mass else "Added damping ratio [%]",
                ylabel=f"Expected cost [{money}]", ylim=(0.0, 4.0 * curve["best_total"]))  # fmt: skip
    style.below(drawing, axes, columns=4)
    return FigureWithCaption(
        drawing,
        caption=f"Expected cost of mode {mode['name']}: of the damper, of failure, and their sum.",
        alt="Curves of damper cost, expected failure cost and their sum, with its least value marked.",
    )  # fmt: skip


@figure(
    "sizing",
    name="information",
    source="sizing",
    each=lambda content: modes(content, lambda mode: "information" in mode.get("cost", {})),
)
def worth_of_information(content: Content, mode: Content) -> FigureWithCaption:
    """What it would be worth to know more."""
    worth = mode["cost"]["information"]["worth"]
    drawing = style.new_figure(22.0 + 6.5 * len(worth))
    axes = drawing.subplots()
    y = np.arange(len(worth))
    for kind, colour, label in (("perfect", style.SKY, "known perfectly"), ("sample", style.BLUE, "after a test")):
        place = [k for k, one in enumerate(worth) if one["kind"] == kind]
        axes.barh(y[place], [worth[k]["value"] for k in place], color=colour, label=label)
    axes.set_yticks(y, [one["name"] for one in worth])
    axes.invert_yaxis()
    axes.set_xlabel(f"Expected saving [{mode['cost']['currency'] or 'currency'}]")
    axes.legend(loc="lower right")
    return FigureWithCaption(
        drawing,
        caption=f"What it would be worth to know more of mode {mode['name']} before the damper is chosen.",
        alt="; ".join(f"{one['name']} {one['value']:.3g}" for one in worth),
    )  # fmt: skip


@figure("sizing", name="required_damping", source="sizing")
def required_plot(content: Content) -> FigureWithCaption:
    """Added damping by confidence, every mode and limit."""
    rows = [(mode["name"], one) for mode in content["modes"] for one in mode["limits"]]
    drawing = style.new_figure(20.0 + 15.0 * len(rows))
    axes = drawing.subplots()
    height = 0.8 / len(CONFIDENCES)
    top = max([one["required"][p] or 0.0 for _, one in rows for p in CONFIDENCES] + [1e-4])
    for i, (_, one) in enumerate(rows):
        for k, p in enumerate(CONFIDENCES):
            y = i - 0.4 + (k + 0.5) * height
            value = one["required"][p]
            axes.barh(y, 100.0 * (top * 1.15 if value is None else value), height=0.9 * height, color=_COLOURS[k],
                      hatch="//" if value is None else None, alpha=0.35 if value is None else 1.0,
                      label=f"{100 * float(p):.0f} % confidence" if i == 0 else None)  # fmt: skip
            text = "not achievable" if value is None else f" {100 * value:.2f} %" if value > 0.0 else " none"
            axes.annotate(text, (0.0 if value is None else 100.0 * value, y), xytext=(3, 0), textcoords="offset points",
                          va="center", fontsize=7)  # fmt: skip
    axes.set_yticks(
        range(len(rows)), [f"{style.shorten(name, 16)}\n{style.shorten(one['rule'], 20)}" for name, one in rows]
    )
    axes.set(xlabel="Added damping ratio [%]", xlim=(0.0, 100.0 * top * 1.25))
    axes.invert_yaxis()
    drawing.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return FigureWithCaption(
        drawing,
        caption="Added damping that keeps the amplitude below the limit, by confidence.",
        alt="Bars of required added damping for 50, 84, 95 and 99 per cent confidence, by mode and limit.",
    )  # fmt: skip
