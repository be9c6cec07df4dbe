"""Damper sizing and risk, from the content of sizing.json: its chapter, and what the terminal is told of it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from scruton.report.chapters.hours import hours_left, hours_note, hours_rows
from scruton.report.chapters.material import Material
from scruton.report.chapters.required import far, far_note, required_damping, required_tables
from scruton.report.chapters.together import (
    TOGETHER,
    as_fraction,
    both_blocks,
    exceedances,
    exceedances_note,
    existing_blocks,
    in_percent,
    modes_header,
)
from scruton.report.conventions import (
    DAMPING,
    SCRUTON,
    amplitude,
    by_conventions,
    damping,
    damping_label,
    damping_symbol,
    damping_words,
    flag_texts,
    known_to,
    scruton,
    scruton_note,
    shown_in,
    with_unit,
)
from scruton.report.document import ALARM, CAUTION, Block, Callout, Heading, Listing, Picture, Table, paragraph
from scruton.report.errors import at_most
from scruton.report.figures.sizing import limits, modes
from scruton.report.needs import Content
from scruton.report.wording import (
    PAGE,
    TERMINAL,
    Notation,
    counted,
    limit_text,
    money,
    percent,
    share,
    stated,
)
from scruton.report.wording import number as written
from scruton.sizing.checks import CONFIDENCES
from scruton.sizing.thresholds import LARGEST_ADDED

_SHARES = [share(float(p)) for p in CONFIDENCES]


def sizing_chapter(material: Material) -> Iterator[Block]:
    """What keeps the bridge below its limits, the damper that gives it, and the risk that is left."""
    pictures = {picture.name: picture for picture in material.of("sizing")}
    for content in material.sizings:
        ending = "" if content is material.sizing else f"_{content['bridge']['motion']}"
        if material.other is not None:
            yield Heading(f"{content['bridge']['motion'].capitalize()} modes")
        for block in _sizing_blocks(content, pictures, ending):
            yield replace(block, name=f"{block.name}{ending}") if isinstance(block, Table) else block
    if material.sizing is not None:
        yield from by_conventions(both_blocks)(material.sizing, "mode ", in_percent, PAGE)


@by_conventions
def _sizing_blocks(content: Content, pictures: Mapping[str, Picture], of_motion: str) -> Iterator[Block]:
    """What was sized of one motion; names of its pictures end so."""
    unit = content["amplitude_unit"]

    def shown(*names: str) -> Iterator[Picture]:
        yield from (pictures[f"{name}{of_motion}"] for name in names if f"{name}{of_motion}" in pictures)

    if of_motion:  # that of the fit's own motion stands on the first page
        yield from shown("decision")
    yield paragraph(
        f"Bridge: {content['bridge']['title']}. The added {damping_words()} is what the bridge needs beyond its own "
        "so that the stable amplitude in lock-in stays below the limit; its confidence is the probability that it "
        "suffices, all uncertainties taken together."
    )
    error = "±: Monte Carlo standard error." if any("required_mcse" in limit for _, limit in limits(content)) else ""
    yield Table(
        "required_damping",
        f"Added {damping_words()} that keeps the amplitude below the limit, by confidence",
        ("mode", "limit", "amplitude", "P without damper", *_SHARES),
        [
            (
                mode, limit_text(limit), amplitude(limit["limit"], unit),
                known_to(percent(limit["probability"]), limit["probability"], limit.get("probability_mcse"),
                         (100.0, "%")),
                *(
                    known_to(
                        required_damping(limit["required"][p], PAGE), limit["required"][p],
                        limit.get("required_mcse", {}).get(p), shown_in(DAMPING),
                    ) + far(limit, p)
                    for p in CONFIDENCES
                ),
            )
            for mode, limit in limits(content)
        ],
        f"{error} {far_note(content)}".strip(),
        numeric=(False, False, *[True] * 6),
    )  # fmt: skip
    if readings := [*_readings(content)]:
        yield Listing(readings)
    yield from shown("required_damping")
    yield from required_tables(content, PAGE)
    for k, (ending, mode) in enumerate(modes(content).items(), 1):
        yield Heading(f"Mode {mode['name']}" if ending else "Risk")
        yield from shown(f"risk{ending}", f"shares{ending}")
        yield from (*_damper_blocks(mode, k), *shown(f"damper{ending}"))
        yield from (*_cost_blocks(mode), *shown(f"cost{ending}", f"information{ending}"))
    if not content.get("both"):
        yield from existing_blocks(content, "mode ", in_percent)
    names = content["all_modes"]["names"]
    together = Table(
        "all_modes", TOGETHER, ("", *modes_header(names, "mode ")),
        exceedances(content, in_percent) if len(names) > 1 else (), exceedances_note(content["all_modes"]),
    )  # fmt: skip
    hours = Table(
        "hours",
        "Hours a year in lock-in, and expected beyond the limit",
        ("mode", "lock-in U/(fD)", "hours a year", "beyond the limit (90 %)", *hours_left(content)),
        hours_rows(content, " to ", partial(number, digits=3), partial(number, digits=3)),
        hours_note(content),
    )
    if together.rows or hours.rows:
        yield Heading("All modes together")
        yield from (together, hours)


def _monte_carlo(content: Content) -> Iterator[str]:
    """A sentence a limit: the Monte Carlo standard errors of its probability and of the damping required."""
    for mode, limit in limits(content):
        if errors := limit.get("required_mcse"):
            factor, shown = shown_in(DAMPING)
            required = ", ".join("–" if errors[p] is None else f"{factor * errors[p]:.1g}" for p in CONFIDENCES)
            yield (
                f"Monte Carlo standard errors, mode {mode}, {limit['rule']}: of P without "
                f"{100.0 * limit['probability_mcse']:.1g} %; of the damping required {with_unit(required, shown)}."
            )


def _readings(content: Content) -> Iterator[str]:
    """A sentence a limit: what its code says of the amplitude without added damping."""
    for mode, limit in limits(content):
        if limit.get("reading"):
            yield f"Mode {mode}, {limit_text(limit)}, without added damping: {limit['reading']}."


def sizing_assumptions(content: Content) -> list[str]:
    """What the sizing assumes, for the limits of validity."""
    return [
        "The bridge vibrates in one mode at a time, with the section’s force correlated along the span as stated.",
        *sorted({f"{limit['title']}. {limit['confirm']}" for _, limit in limits(content) if limit["confirm"]}),
    ]


def similitude_of(content: Content, tested: Sequence[tuple[str, float]]) -> Table:
    """Scruton numbers that the bridge asks for beside the nearest one tested."""
    rows = []
    for mode in content["modes"]:
        sc = mode["scruton_number"]
        name, nearest = min(tested, key=lambda pair: abs(np.log(max(pair[1], 1e-9) / max(sc["median"], 1e-9))))
        rows.append(
            (
                mode["name"], f"{number(mode['frequency']['mean'])} Hz", damping(mode["damping_ratio"]["mean"]),
                scruton(mode.get("scruton_number_at_means"), number),
                *PAGE.interval(*(sc[key] for key in ("median", "low", "high")), factor=shown_in(SCRUTON)[0]),
                name, scruton(nearest),
                number(nearest / sc["median"], 3),
            )
        )  # fmt: skip
    return Table(
        "bridge_similitude",
        "Scruton number required by the bridge, and the nearest one tested",
        (
            "mode",
            "f",
            f"mean {damping_symbol()}",
            "Sc of the means",
            "Sc required",
            "90 % interval",
            "nearest test",
            "Sc achieved",
            "achieved/required",
        ),
        rows,
        "A ratio far from 1 means that the prediction at the bridge reaches along the Griffin curve. Sc of the means: "
        f"{'4πmξ/(ρD²)' if shown_in(SCRUTON)[0] != 1.0 else '4πmξ/(ρBD), or 4πJξ/(ρB³D)'}, of the mean mass and "
        "damping, to be checked by hand.",
        (False, True, True, True, True, True, False, True, True),
    )


def _damper_blocks(mode: Content, place: int) -> Iterator[Block]:
    damper, name = mode["damper"], mode["name"]
    if not damper["dampers"]:
        yield paragraph(f"Tuned mass damper, mode {name}: {damper['reason']}.")
        return
    stroke = damper["stroke"]
    yield paragraph(
        f"Tuned mass damper, mode {name}: {'the least mass' if damper['achievable'] else 'NOT ACHIEVED'} for a risk of "
        f"{stated(100.0 * damper['asked']['risk'])} % ({damper['reason']}). The risk left is "
        f"{counted(damper['probability'])}; "
        f"the stroke is {number(stroke['median'], 3)} m, and below {number(stroke['high'], 3)} m with 95 % confidence."
        + _built(damper)
    )
    header = ("damper", "mass [kg]", "mass ratio", "frequency [Hz]", damping_words(), "spring [N/m]", "dashpot [N s/m]")
    rows = _damper_rows(damper, PAGE, percent, damping)
    yield Table(f"dampers_{place}", f"Tuned mass dampers, mode {name}", header, rows)
    yield Table(
        f"detuned_{place}",
        f"Risk and stroke where the dampers are detuned{_off(damper)}, mode {name}",
        ("detuning", "P of exceeding the limit", "stroke, 95 % [m]"),
        [
            (
                f"{100.0 * entry['detuning']:+.0f} %".replace("-", "−"),
                counted(entry["probability"]),
                number(entry.get("stroke_high"), 3),
            )
            for entry in damper["detuned"]
        ],
    )


def _off(damper: Content) -> str:
    """What a detuning stands for, where the risk is not kept and may be less there than where nothing is said of it."""
    return "" if damper["achievable"] else " (the frequency off by just that, where else it is uncertain)"


def _built(damper: Content) -> str:
    """What the dampers were taken to be, and the risk of a cycle that only a start from above reaches."""
    asked, text = damper["asked"], ""
    if "kept_detuning" in asked:
        within = [f"{100 * asked[key + '_tolerance']:g} % of {key}" for key in ("frequency", "damping", "mass")]
        text = f" A delivered damper may be off by {', '.join(within)}"
        if asked["temperature_detuning"]:
            text += f", and {100 * asked['temperature_detuning']:g} % of frequency with temperature"
        kept = "is" if damper["achievable"] else "was to be"
        text += f"; the risk {kept} kept where the bridge is {100 * asked['kept_detuning']:g} % off frequency, too."
    if "probability_worst" in damper:
        worst = counted(damper["probability_worst"])
        text += f" Counting vibrations that only a start from above leads to, the risk is {worst}."
    return text


def _damper_rows(damper: Content, of: Notation, mass: Callable[..., str], damping: Callable[..., str]) -> list[Any]:
    """One row a damper, its ratios of mass and of damping written as asked."""
    return [
        (
            str(k), of.number(entry["mass"]), mass(entry["mass_ratio"]), of.number(entry["frequency"], 5),
            damping(entry["damping_ratio"]), of.number(entry["spring"]), of.number(entry["dashpot"]),
        )
        for k, entry in enumerate(damper["dampers"], 1)
    ]  # fmt: skip


def _cost_blocks(mode: Content) -> Iterator[Block]:
    cost = mode.get("cost") or {}
    yield from map(paragraph, _cheapest(mode))
    if known := cost.get("information"):
        yield paragraph(
            f"To know everything before choosing would save {money(known['perfect'])} {_currency(cost)} in "
            "expectation: an upper bound on what a further test is worth."
        )


def _currency(cost: Content) -> str:
    return cost.get("currency") or "units of currency"


def _cheapest(mode: Content) -> Iterator[str]:
    """What the cheapest mass of damper comes to, and the cheapest damping, in a sentence each."""
    cost = mode.get("cost") or {}
    least = f"Least expected cost, mode {mode['name']}, where"
    if by_mass := cost.get("by_mass"):
        best, without = by_mass["best_mass"], f"without a damper {money(by_mass['without'])} {_currency(cost)}"
        end = ", the heaviest looked at" if by_mass["at_the_end"] else ""
        choice = f"with a damper of {number(best / 1e3, 2)} t{end}; {without}." if best else "without a damper."
        yield f"{least} dampers are bought by their mass: {money(by_mass['best_total'])} {_currency(cost)} {choice}"
    if by_damping := cost.get("by_damping"):
        end = ", the most looked at" if by_damping["at_the_end"] else ""
        added = damping(by_damping["best_added_damping"], 2)
        total = f"{money(by_damping['best_total'])} {_currency(cost)}"
        yield f"{least} damping is bought by the percentage point: {total} with {added} added damping{end}."


def number(value: float | None, digits: int = 4) -> str:
    """A number; where none exists (no amplitude is stable, no choice is allowed) in words."""
    return "no bound" if value is None else written(value, digits)


@by_conventions
def sizing_summary(content: Content) -> Iterator[Block]:
    """The sizing for the terminal: what is required, the dampers, what more knowledge would be worth."""
    every, together = content["modes"], content["all_modes"]
    factor, unit = shown_in(content["amplitude_unit"])

    def spread(entry: Content, factor: float) -> str:
        return "{} ({})".format(*TERMINAL.interval(*(entry[key] for key in ("median", "low", "high")), factor=factor))

    yield paragraph(f"{content['bridge']['title']}: damping that keeps the amplitude below the limit")
    flags = flag_texts(content["flags"], content, keys=True)
    if content.get("unconverged"):  # the reason not to trust them before the numbers
        yield Callout(ALARM, "", flags[:1])
        flags = flags[1:]
    required = [
        (
            mode, limit["rule"], TERMINAL.number(factor * limit["limit"]), f"{limit['probability']:.3f}",
            *(
                required_damping(limit["required"][p], TERMINAL, limit.get("required_mcse", {}).get(p)) + far(limit, p)
                for p in CONFIDENCES
            ),
        )
        for mode, limit in limits(content)
    ]  # fmt: skip
    header = ("mode", "limit", f"[{unit}]", "P without", *_SHARES)
    note = "\n".join([*filter(None, [far_note(content)]), *_monte_carlo(content), *_readings(content)])
    yield Table("required", f"Added {damping_words()} by confidence", header, required, note)
    yield from required_tables(content, TERMINAL)
    without = [
        (
            mode["name"], scruton(mode.get("scruton_number_at_means"), TERMINAL.number),
            spread(mode["scruton_number"], shown_in(SCRUTON)[0]), spread(mode["amplitude"], factor),
            *(f"{source['source']} {source['first']:.0%}" if source["total"] else "-"
              for source in mode["shares"]["needed"][:1]),
        )
        for mode in every
    ]  # fmt: skip
    header = ("mode", "Sc of means", "Sc (90 %)", f"amplitude without [{unit}]", "largest share of variance")
    known = at_most((errors for mode in every if (errors := mode["amplitude"].get("mcse"))), TERMINAL, factor)
    none = [mode["name"] for mode in every if not any(one["total"] for one in mode["shares"]["needed"])]
    more = f"needs more than {damping(LARGEST_ADDED)}, or every draw the same"
    unshared = f"-: nearly every draw of {', '.join(none)} {more}." if none else ""
    notes = filter(None, (known, unshared, scruton_note(heaving=content["amplitude_unit"] == "m")))
    yield Table("modes", "", header, without, " ".join(notes))
    yield from map(_damper_summary, every)
    for mode in every:
        yield from _cost_summary(mode)
    if len(together["names"]) > 1 or "hours" in together:
        yield Table(
            "all_modes", TOGETHER, ("", *modes_header(together["names"], "")),
            exceedances(content, as_fraction), exceedances_note(together),
        )  # fmt: skip
        hours = hours_rows(content, " .. ", "{:.2f}".format, TERMINAL.number)
        header = (
            "mode", "lock-in U/(fD)", "hours a year in lock-in", "expected hours beyond the limit (90 %)",
            *hours_left(content),
        )  # fmt: skip
        yield Table("hours", "", header, hours, hours_note(content))
    if not content.get("both"):
        yield from existing_blocks(content, "mode ", as_fraction)
    yield Callout(CAUTION, "", flags)


def _damper_summary(mode: Content) -> Block:
    damper, name = mode["damper"], f"Tuned mass damper, mode {mode['name']}"
    if not damper["dampers"]:
        return paragraph(f"{name}: {damper['reason']}")
    reached, worst = "least mass" if damper["achievable"] else "NOT ACHIEVED", ""
    if "probability_worst" in damper:
        worst = f" ({damper['probability_worst']:.3f} with vibrations that only a start from above leads to)"
    return Table(
        "dampers",
        f"{name}: {reached} for a risk of {damper['asked']['risk']:.1%}; {damper['reason']}",
        (
            "damper",
            "mass [kg]",
            "mass ratio [%]",
            "frequency [Hz]",
            damping_label("damping ratio"),
            "spring [N/m]",
            "dashpot [N s/m]",
        ),
        _damper_rows(
            damper, TERMINAL, lambda ratio: f"{100 * ratio:.3f}", lambda ratio: f"{shown_in(DAMPING)[0] * ratio:.3g}"
        ),
        f"risk left {damper['probability']:.3f}{worst}; stroke {TERMINAL.number(damper['stroke']['median'], 3)} m "
        f"(95 %: {TERMINAL.number(damper['stroke']['high'], 3)} m); risk where detuned{_off(damper)}: "
        + ", ".join(f"{each['detuning']:+.0%} {each['probability']:.3f}" for each in damper["detuned"]),
    )


def _cost_summary(mode: Content) -> Iterator[Block]:
    cost = mode.get("cost") or {}
    yield from map(paragraph, _cheapest(mode))
    if known := cost.get("information"):
        title = f"Value of knowing more before choosing [{_currency(cost)}]; all of it {money(known['perfect'])}"
        rows = [(entry["name"], entry["kind"], money(entry["value"])) for entry in known["worth"]]
        yield Table("information", title, ("of", "kind", "worth at most"), rows)
