"""Figures of the sizing: risk against added damping, damping by confidence, mass against risk, shares, cost."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.report.conventions import (
    DAMPING,
    SCRUTON,
    amplitude,
    damping,
    damping_label,
    scruton_note,
    shown_in,
)
from scruton.report.figures import FigureWithCaption, figure, style
from scruton.report.needs import Content, governing, required_of, worst
from scruton.report.wording import law_text, limit_text, unit_text
from scruton.sizing.checks import ASKED, CONFIDENCES
from scruton.sizing.thresholds import LARGEST_ADDED

if TYPE_CHECKING:
    from matplotlib.axis import Axis

_SHADES = ("#E9C6DA", style.PURPLE, "#A14C7D", "#6B2A51")  # of the confidences: one colour, darker the surer
_BAND: dict[str, Any] = {"color": style.SKY, "alpha": 0.4, "lw": 0}
_TALLEST = 3.0  # of the median: where the upper end of its interval lies higher, it is written
_ADDED = "Added damping ratio"
_array = partial(np.array, dtype=float)  # None, of JSON, becomes NaN


def modes(content: Content, having: Callable[[Content], Any] = bool) -> dict[str, Content]:
    """Every mode that has what is drawn, by what the names of its figures end with."""
    several = len(content["modes"]) > 1
    return {f"_{k}" if several else "": mode for k, mode in enumerate(content["modes"], 1) if having(mode)}


def limits(content: Content) -> Iterator[tuple[str, Content]]:
    """Name of the mode and entry of every limit."""
    return ((mode["name"], limit) for mode in content["modes"] for limit in mode["limits"])


def _drawable(content: Content) -> dict[str, Content]:
    mode = worst(content)
    return {"": mode} if "amplitude_50" in governing(mode)["curve"] else {}


@figure("sizing", name="decision", source="sizing", each=_drawable)
def decision_plot(content: Content, mode: Content) -> FigureWithCaption:
    """The Griffin plot of the bridge itself: its amplitude, the limit, where it is and where it has to go."""
    rule, files = governing(mode), content["amplitude_unit"]
    (factor, shown), note = shown_in(files), scruton_note(heaving=files == "m")
    curve = {key: _array(values) for key, values in rule["curve"].items() if key != "by_law"}
    sc = shown_in(SCRUTON)[0] * curve["scruton_number"]
    low, middle, high = (factor * curve[f"amplitude_{q}"] for q in ("05", "50", "95"))
    limit = factor * rule["limit"]
    now = [float(x[0]) for x in (sc, low, middle, high)]
    drawing, axes = style.alone(52.0)  # mm: the first page holds it with all else that decides
    # the whole of the bar, as long as it leaves its middle room
    whole = max(4.0 * limit, 1.3 * now[2], min(now[3], _TALLEST * now[2]))
    top = 1.15 * max(min(float(np.nanmax(high, initial=0.0)), whole), limit)
    axes.fill_between(sc, low, np.minimum(high, 2.0 * top), **_BAND, label="bridge, 90 % interval")
    axes.plot(sc, middle, color=style.BLUE, label="median")
    axes.axhline(limit, color=style.VERMILLION, ls="--", label=f"limit, {style.shorten(limit_text(rule))}")
    axes.errorbar(
        [now[0]], [now[2]], [[now[2] - now[1]], [min(now[3], 2.0 * top) - now[2]]], fmt="o", color=style.BLACK, ms=6,
        capsize=3, zorder=5, label="without added damping",
    )  # fmt: skip
    if top < now[3] < np.inf:
        axes.annotate(f"to {amplitude(now[3] / factor, files)}", (now[0], top), xytext=(5, -2), va="top", zorder=6,
                      textcoords="offset points", fontsize=7, path_effects=style.halo())  # fmt: skip
    required = required_of(content, mode)
    ends_now = f"90 % {amplitude(now[1] / factor, files)} to {amplitude(now[3] / factor, files)}"
    alt = f"Without added damping the amplitude is {amplitude(now[2] / factor, files)} ({ends_now}), the limit "
    alt += f"{amplitude(rule['limit'], files)}."
    if required:
        there, ends = float(np.interp(required, curve["added_damping"], sc)), []
        for line in (low, middle, high):
            ends.append(float(np.interp(required, curve["added_damping"], line)))
        axes.errorbar(
            [there], [ends[1]], [[ends[1] - ends[0]], [ends[2] - ends[1]]], fmt="D", color=style.GREEN, ms=6, capsize=3,
            zorder=5, label=f"with {damping(required)} added",
        )  # fmt: skip
        alt += (
            f" With {damping(required)} added damping, at Sc {there:.3g}, it is {amplitude(ends[1] / factor, files)}."
        )
    axes.set(xlabel="Scruton number Sc of the bridge [-]", ylabel=f"Amplitude [{unit_text(shown)}]", ylim=(0.0, top))
    axes.set_xlim(left=min(0.0, float(sc[0])) if sc[0] < 0.3 * sc[-1] else 0.9 * float(sc[0]))
    style.below(drawing, [axes], columns=3)
    return FigureWithCaption(
        drawing,
        caption=f"The Griffin plot of the bridge, mode {mode['name']}: its stable amplitude in lock-in, as it is and "
        "with the damping that it needs. " + note,
        alt=alt,
    )


@figure("sizing", name="risk", source="sizing", each=modes)
def risk_curves(content: Content, mode: Content) -> FigureWithCaption:
    """Probability of exceeding the limit, and amplitude, against added damping."""
    rule = governing(mode)
    curve = {key: _array(values) for key, values in rule["curve"].items() if key != "by_law"}
    laws = rule["curve"]["by_law"]
    x, per = shown_in(DAMPING)[0] * curve["added_damping"], shown_in(DAMPING)[0]
    drawing, (left, right) = style.panels(2, height_mm=70.0)
    low, high, label = curve["probability_05"], curve["probability_95"], "90 % band of section and law"
    left.fill_between(x, low, high, **_BAND, label=label)
    left.plot(x, curve["probability"], color=style.BLUE, label="P(amplitude > limit)")
    for k, (label, values) in enumerate(laws.items() if len(laws) > 1 else (), 1):
        pen = {"color": style.BLACK, "ls": style.line_style(k).line, "lw": 0.8}
        left.plot(x, _array(values), **pen, label=law_text(label))
    left.axhline(0.05, color=style.GREY, lw=0.6)
    left.annotate("5 %", (x[0], 0.05), xytext=(2, 1), textcoords="offset points", va="bottom", color=style.GREY,
                  fontsize=7, path_effects=style.halo())  # fmt: skip
    for p, shade in zip(CONFIDENCES, _SHADES, strict=True):
        value = rule["required"][p]
        if value is not None and value > 0.0:
            left.plot(per * value, 1.0 - float(p), "o", color=shade, mec=style.BLACK, mew=0.5, ms=5, zorder=5)
            clear = 5 if float(p) <= 0.95 else 8  # pt, of the line of 5 %
            left.annotate(f"{100 * float(p):.0f} %", (per * value, 1.0 - float(p)), xytext=(4, clear), zorder=6,
                          textcoords="offset points", fontsize=7, path_effects=style.halo())  # fmt: skip
    left.set(xlabel=damping_label(_ADDED), ylabel="Probability", ylim=(0.0, 1.02))
    factor, shown = shown_in(content["amplitude_unit"])
    low, middle, high = (factor * curve[f"amplitude_{q}"] for q in ("05", "50", "95"))
    limit = factor * rule["limit"]
    right.fill_between(x, low, high, **_BAND, label="90 % interval")
    right.plot(x, middle, color=style.BLUE, label="median amplitude")
    right.axhline(limit, color=style.VERMILLION, ls="--", label="limit")
    top = max(min(float(np.nanmax(high, initial=0.0)), 6.0 * limit), limit)
    right.set(xlabel=damping_label(_ADDED), ylabel=f"Stable amplitude [{unit_text(shown)}]", ylim=(0.0, 1.08 * top))
    style.below(drawing, [left, right])
    left.set_title(f"Mode {style.shorten(mode['name'])}, limit {style.shorten(limit_text(rule))}")
    return FigureWithCaption(
        drawing,
        caption=f"Risk of mode {mode['name']} against added damping, limit {limit_text(rule)}. Left: probability that "
        "the stable amplitude in lock-in exceeds the limit, with the band that the section's posterior and the law "
        "leave; dots are the confidences. Right: the amplitude.",
        alt=f"Probability of exceeding the limit falls from {rule['probability']:.2f} without added damping; "
        + "; ".join(f"{p}: {_added(rule['required'][p])}" for p in CONFIDENCES),
    )  # fmt: skip


def _added(required: float | None, error: float | None = None) -> str:
    return "not achievable" if required is None else damping(required, error=error) if required else "none"


@figure("sizing", name="shares", source="sizing", each=modes)
def variance_shares(content: Content, mode: Content) -> FigureWithCaption:
    """Shares of variance: first-order and total Sobol' indices."""
    rows = mode["shares"]["needed"]
    if not any(row["total"] for row in rows):
        rows = mode["shares"]["amplitude"]
    required = governing(mode)["required"][ASKED]
    names = [row["source"] for row in rows]
    drawing, axes = style.panels(2, height_mm=14.0 + 8.0 * len(rows), sharey=True)
    given = "at the required damping" if required else "without added damping"
    titles = {"needed": "damping that is needed", "amplitude": f"amplitude {given}"}
    for panel, (key, title) in zip(axes, titles.items(), strict=True):
        shares = {share["source"]: share for share in mode["shares"][key]}
        total, first = ([100 * shares[name][of] for name in names] for of in ("total", "first"))
        panel.barh(range(len(rows)), total, color=style.LIGHT, height=0.7, label="with interactions")
        panel.barh(range(len(rows)), np.maximum(first, 0.0), color=style.BLUE, height=0.4, label="alone")
        panel.set(xlabel="Share of variance [%]", title=title, xlim=(0.0, 105.0))
        if not any(total):
            none = "the same in every draw"
            if key == "needed":
                none = f"nearly every draw needs more than {damping(LARGEST_ADDED)},\nor {none}"
            panel.text(52.5, 0.5 * (len(rows) - 1), none, ha="center", va="center", fontsize=7)
    axes[0].set_yticks(range(len(rows)), names)
    axes[0].invert_yaxis()
    axes[1].legend(loc="lower right")
    return FigureWithCaption(
        drawing,
        caption=f"What the uncertainty of mode {mode['name']} comes from: Sobol' shares of the variance of the added "
        "damping that is needed, and of the amplitude "
        + ("at the damping required with 95 % confidence." if required else "without added damping."),
        alt="; ".join(f"{row['source']} {row['first']:.0%}" for row in rows),
    )  # fmt: skip


@figure("sizing", name="damper", source="sizing", each=partial(modes, having=lambda mode: mode["damper"]["dampers"]))
def damper_masses(content: Content, mode: Content) -> FigureWithCaption:
    """Mass of the damper against risk, with its stroke."""
    damper = mode["damper"]
    chart = damper["map"]
    stated = chart["mass"] is not None
    x = _array(chart["mass"]) / 1e3 if stated else 100.0 * _array(chart["mass_ratio"])
    drawing, (left, right) = style.panels(2, height_mm=58.0)
    limit: dict[str, Any] = {"color": style.VERMILLION, "ls": "--", "lw": 0.8}
    left.plot(x, 100.0 * _array(chart["probability"]), color=style.BLUE, marker="o", ms=3)
    left.axhline(100.0 * damper["asked"]["risk"], **limit, label="risk asked for")
    mass = damper["mass"] / 1e3 if stated else 100.0 * damper["mass_ratio"]
    mass_label = "damper of least mass" if damper["achievable"] else f"{_heaviest(damper)}not enough"
    left.plot(mass, 100.0 * damper["probability"], "D", color=style.BLACK, label=mass_label)
    stroke = 1e3 * _array(chart["stroke"])
    right.fill_between(x, stroke, 1e3 * _array(chart["stroke_high"]), **_BAND, label="median to 95 %")
    right.plot(x, stroke, color=style.BLUE, marker="o", ms=3, label="median stroke")
    right.plot(mass, 1e3 * _array(damper["stroke"]["median"]), "D", color=style.BLACK)  # NaN: no amplitude is stable
    if damper["asked"]["largest_stroke"]:
        right.axhline(1e3 * damper["asked"]["largest_stroke"], **limit, label="largest stroke")
    for axes, label in ((left, "P(amplitude > limit) [%]"), (right, "Relative stroke [mm]")):
        axes.set(xlabel="Mass of all dampers [t]" if stated else "Mass ratio [%]", ylabel=label)
        axes.set_ylim(bottom=0.0)
    style.below(drawing, [left, right])
    count = damper["asked"]["number"]
    dampers = "one damper" if count == 1 else f"{count} dampers"
    left.set_title(f"Mode {style.shorten(mode['name'])}: {dampers}, tuned at every mass")
    return FigureWithCaption(
        drawing,
        caption=f"Tuned mass damper of mode {mode['name']}: risk and stroke against its mass, tuned at every mass for "
        "the risk asked for, or the least where the mass does not keep that, under the uncertainty of the frequency"
        + (", within the largest stroke where the mass allows it." if damper["asked"]["largest_stroke"] else "."),
        alt=f"Risk falls with mass; {'the lightest that is good enough' if damper['achievable'] else mass_label}: "
        f"{damper['probability']:.3f} is left.",
    )  # fmt: skip


def _heaviest(damper: Content) -> str:
    """Which dampers do not keep the risk: mostly the heaviest that are allowed, but not the heaviest of the chart."""
    largest = damper["asked"]["largest_mass_ratio"]
    return f"heaviest allowed ({100.0 * largest:g} %), and " if damper["mass_ratio"] > 0.999 * largest else ""


def _with_costs(*keys: str) -> Callable[[Content], dict[str, Content]]:
    """Modes whose cost holds one of these."""
    return partial(modes, having=lambda mode: any(key in mode.get("cost", {}) for key in keys))


def _in_money(axis: "Axis", what: str, mode: Content) -> None:
    """Label an axis of money, in millions where its numbers were too long else."""
    currency, million = mode["cost"]["currency"] or "currency", max(map(abs, axis.get_view_interval())) >= 1e5
    if million:
        axis.set_major_formatter(lambda value, _: f"{value / 1e6:g}")
    axis.set_label_text(f"{what} [{'million ' if million else ''}{currency}]")


@figure("sizing", name="cost", source="sizing", each=_with_costs("by_damping", "by_mass"))
def expected_costs(content: Content, mode: Content) -> FigureWithCaption:
    """Expected cost against what is bought: damping, or mass."""
    curves = {key: mode["cost"][key] for key in ("by_damping", "by_mass") if key in mode["cost"]}
    drawing, axes = style.panels(len(curves), height_mm=60.0)
    for panel, (key, curve) in zip(axes, curves.items(), strict=True):
        by_mass = key == "by_mass"
        x = _array(curve["mass"]) / 1e3 if by_mass else shown_in(DAMPING)[0] * _array(curve["added_damping"])
        panel.plot(x, _array(curve["damper"]), color=style.GREEN, ls=":", label="damper")
        panel.plot(x, _array(curve["failure"]), color=style.VERMILLION, ls="--", label="expected failure")
        panel.plot(x, _array(curve["total"]), color=style.BLUE, label="sum")
        if by_mass:
            too_light = np.where(curve["allowed"], np.nan, _array(curve["total"]))
            if np.isfinite(too_light).any():
                panel.plot(x, too_light, "o", ms=4, mfc="white", color=style.BLUE, label="not allowed: stroke or mass")
        best = curve["best_mass"] / 1e3 if by_mass else shown_in(DAMPING)[0] * curve["best_added_damping"]
        panel.plot(best, curve["best_total"], "D", color=style.BLACK, label="least")
        panel.set(xlabel="Mass of all dampers [t]" if by_mass else damping_label(_ADDED))
        panel.set_ylim(0.0, 4.0 * curve["best_total"] or None)
        _in_money(panel.yaxis, "Expected cost", mode)
    style.below(drawing, axes, columns=4)
    return FigureWithCaption(
        drawing,
        caption=f"Expected cost of mode {mode['name']}: of the damper, of failure, and their sum.",
        alt="Curves of damper cost, expected failure cost and their sum, with its least value marked.",
    )  # fmt: skip


@figure("sizing", name="information", source="sizing", each=_with_costs("information"))
def worth_of_information(content: Content, mode: Content) -> FigureWithCaption:
    """What it would be worth to know more."""
    worth = mode["cost"]["information"]["worth"]
    drawing, axes = style.alone(22.0 + 6.5 * len(worth))
    for kind, colour, label in (("perfect", style.SKY, "known perfectly"), ("sample", style.BLUE, "after a test")):
        place = [k for k, entry in enumerate(worth) if entry["kind"] == kind]
        axes.barh(place, [worth[k]["value"] for k in place], color=colour, label=label)
    axes.set_yticks(range(len(worth)), [entry["name"] for entry in worth])
    axes.invert_yaxis()
    _in_money(axes.xaxis, "Expected saving", mode)
    axes.legend(loc="lower right")
    return FigureWithCaption(
        drawing,
        caption=f"What it would be worth to know more of mode {mode['name']} before the damper is chosen.",
        alt="; ".join(f"{entry['name']} {entry['value']:.3g}" for entry in worth),
    )  # fmt: skip


@figure("sizing", name="required_damping", source="sizing")
def required_plot(content: Content) -> FigureWithCaption:
    """Added damping by confidence, every mode and limit."""
    rows = [*limits(content)]
    drawing, axes = style.alone(20.0 + 15.0 * len(rows))
    height = 0.8 / len(CONFIDENCES)
    top, per = (
        max([entry["required"][p] or 0.0 for _, entry in rows for p in CONFIDENCES] + [1e-4]),
        shown_in(DAMPING)[0],
    )
    for i, (_, limit) in enumerate(rows):
        for k, p in enumerate(CONFIDENCES):
            y = i - 0.4 + (k + 0.5) * height
            value = limit["required"][p]
            axes.barh(y, per * (top * 1.15 if value is None else value), height=0.9 * height, color=_SHADES[k],
                      hatch="//" if value is None else None, alpha=0.35 if value is None else 1.0,
                      label=f"{100 * float(p):.0f} % confidence")  # fmt: skip
            place = (0.0 if value is None else per * value, y)
            said = _added(value, limit.get("required_mcse", {}).get(p))
            axes.annotate(said, place, xytext=(3, 0), textcoords="offset points", va="center", fontsize=7)
    labels = [f"{style.shorten(name, 28)}\n{style.shorten(limit_text(entry), 28)}" for name, entry in rows]
    axes.set_yticks(range(len(rows)), labels)
    axes.set(xlabel=damping_label(_ADDED), xlim=(0.0, per * top * 1.25))
    axes.invert_yaxis()
    style.below(drawing, [axes], columns=4)
    return FigureWithCaption(
        drawing,
        caption="Added damping that keeps the amplitude below the limit, by confidence.",
        alt="Bars of required added damping for 50, 84, 95 and 99 per cent confidence, by mode and limit.",
    )  # fmt: skip
