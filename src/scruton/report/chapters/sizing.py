"""Damper sizing and risk, from the content of sizing.json."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Heading, KeyFigure, Picture, Table, paragraph
from scruton.report.figures.sizing import CONFIDENCES, Content, governing, modes
from scruton.report.wording import number as written
from scruton.report.wording import percent, share

ASKED = "0.95"  # the confidence that the summary states


@chapter("sizing", "Damper sizing and risk")
def sizing_chapter(material: Material) -> Iterator[Block]:
    """What keeps the bridge below its limits, the damper that gives it, and the risk that is left."""
    content = material.sizing
    if content is None:
        return
    yield paragraph(
        f"Bridge: {content['bridge']['title']}. The added damping ratio is what the bridge needs beyond its own so "
        "that the stable amplitude in lock-in stays below the limit; its confidence is the probability that it "
        "suffices, all uncertainties taken together."
    )
    yield _required_table(content)
    pictures = {one.name: one for one in material.of("sizing")}

    def shown(name: str) -> Iterator[Picture]:
        if name in pictures:
            yield pictures[name]

    yield from shown("required_damping")
    for k, (ending, mode) in enumerate(modes(content).items(), 1):
        yield Heading(f"Mode {mode['name']}" if ending else "Risk")
        yield from (*shown(f"risk{ending}"), *shown(f"shares{ending}"))
        yield from (*_damper_blocks(mode, k), *shown(f"damper{ending}"))
        yield from (*_cost_blocks(mode), *shown(f"cost{ending}"), *shown(f"information{ending}"))
    together = [_together_table(content), _hours_table(content)]
    if any(table.rows for table in together):
        yield Heading("All modes together")
        yield from together


def worst(content: Content) -> tuple[Content, Content]:
    """The mode that needs most damping, and its governing limit."""

    def need(mode: Content) -> tuple[float, float]:
        limit = governing(mode)
        required = limit["required"][ASKED]
        return (np.inf if required is None else required, limit["probability"])

    mode = max(content["modes"], key=need)
    return mode, governing(mode)


def sizing_figures(content: Content | None) -> tuple[KeyFigure, ...]:
    """Amplitude of the bridge, limit, probability of exceeding it, damping required with its confidence."""
    if content is None:
        return ()
    mode, limit = worst(content)
    unit = content["amplitude_unit"]
    own = mode["amplitude"]
    return (
        KeyFigure(
            f"Amplitude of the bridge, mode {mode['name']}",
            _length(own["median"], unit),
            f"90 % interval {_length(own['low'], unit)} to {_length(own['high'], unit)}, no damper",
        ),
        KeyFigure(f"Limit ({limit['rule']})", _length(limit["limit"], unit), limit["title"]),
        KeyFigure("Probability of exceeding it", percent(limit["probability"]), "in lock-in, without a damper"),
        KeyFigure(
            "Added damping ratio required", limit["required_text"][ASKED], f"{share(float(ASKED))} confidence"
        ),
    )  # fmt: skip


def sizing_sentence(content: Content) -> str:
    """The sizing in one sentence, for the summary."""
    mode, limit = worst(content)
    unit = content["amplitude_unit"]
    own, sc = mode["amplitude"], mode["scruton_number"]
    required = limit["required"][ASKED]
    demand = (
        "No added damping is needed"
        if required == 0.0
        else f"No added damping that was looked at suffices ({limit['required_text'][ASKED]})"
        if required is None
        else f"An added damping ratio of {limit['required_text'][ASKED]} is needed"
    )
    return (
        f"{content['bridge']['title']}, mode {mode['name']}: at its Scruton number of {number(sc['median'], 3)} (90 %: "
        f"{number(sc['low'], 3)} to {number(sc['high'], 3)}) the stable amplitude is {_length(own['median'], unit)}, "
        f"90 % "
        f"interval {_length(own['low'], unit)} to {_length(own['high'], unit)}. The limit of "
        f"{_length(limit['limit'], unit)} "
        f"({limit['rule']}) is exceeded with a probability of {percent(limit['probability'])}. {demand} to stay below "
        f"it "
        f"with {share(float(ASKED))} confidence."
    )  # fmt: skip


def sizing_warnings(content: Content | None) -> tuple[str, ...]:
    """What is not to be trusted of the sizing."""
    return () if content is None else tuple(str(one) for one in content["flags"])


def sizing_assumptions(content: Content | None) -> tuple[str, ...]:
    """What the sizing assumes, for the limits of validity."""
    if content is None:
        return ()
    confirm = {
        f"{one['title']}. {one['confirm']}" for mode in content["modes"] for one in mode["limits"] if one["confirm"]
    }
    return (
        "The bridge vibrates in one mode at a time, with the section’s force correlated along the span as stated.",
        *sorted(confirm),
    )  # fmt: skip


def similitude_of(content: Content, tested: Sequence[tuple[str, float]]) -> Table:
    """Scruton numbers that the bridge asks for beside the nearest one tested."""
    rows = []
    for mode in content["modes"]:
        sc = mode["scruton_number"]
        name, nearest = min(tested, key=lambda pair: abs(np.log(max(pair[1], 1e-9) / max(sc["median"], 1e-9))))
        rows.append(
            (
                mode["name"], f"{number(mode['frequency']['mean'])} Hz", percent(mode["damping_ratio"]["mean"]),
                number(sc["median"]), f"{number(sc['low'], 3)} to {number(sc['high'], 3)}", name, number(nearest),
                number(nearest / sc["median"], 3),
            )
        )  # fmt: skip
    return Table(
        "bridge_similitude",
        "Scruton number required by the bridge, and the nearest one tested",
        ("mode", "f", "mean ξₛ", "Sc required", "90 % interval", "nearest test", "Sc achieved", "achieved/required"),
        tuple(rows),
        "A ratio far from 1 means that the prediction at the bridge reaches along the Griffin curve.",
        (False, True, True, True, True, False, True, True),
    )


def _required_table(content: Content) -> Table:
    unit = content["amplitude_unit"]
    rows = tuple(
        (
            mode["name"], one["rule"], _length(one["limit"], unit), percent(one["probability"]),
            *(one["required_text"][p] for p in CONFIDENCES),
        )
        for mode in content["modes"]
        for one in mode["limits"]
    )  # fmt: skip
    return Table(
        "required_damping",
        "Added damping ratio that keeps the amplitude below the limit, by confidence",
        ("mode", "limit", "amplitude", "P without damper", *(f"{share(float(p))}" for p in CONFIDENCES)),
        rows,
        numeric=(False, False, *[True] * 6),
    )


def _damper_blocks(mode: Content, place: int) -> list[Block]:
    damper = mode["damper"]
    if not damper["dampers"]:
        return [paragraph(f"Tuned mass damper, mode {mode['name']}: {damper['reason']}.")]
    asked, stroke = damper["asked"], damper["stroke"]
    words = (
        f"Tuned mass damper, mode {mode['name']}: "
        f"{'the least mass' if damper['achievable'] else 'NOT ACHIEVED'} for a risk of {percent(asked['risk'])}"
        f" ({damper['reason']}). The risk left is {percent(damper['probability'])}; the stroke is "
        f"{number(stroke['median'], 3)} m, and below {number(stroke['high'], 3)} m with 95 % confidence."
    )
    rows = tuple(
        (
            str(k), number(one["mass"]) if one["mass"] is not None else "–", percent(one["mass_ratio"]),
            number(one["frequency"], 5), percent(one["damping_ratio"]),
            *("–" if one[key] is None else number(one[key]) for key in ("spring", "dashpot")),
        )
        for k, one in enumerate(damper["dampers"], 1)
    )  # fmt: skip
    return [
        paragraph(words),
        Table(
            f"dampers_{place}",
            f"Tuned mass dampers, mode {mode['name']}",
            ("damper", "mass [kg]", "mass ratio", "frequency [Hz]", "damping ratio", "spring [N/m]", "dashpot [N s/m]"),
            rows,
        ),
        Table(
            f"detuned_{place}",
            f"Risk where the dampers are detuned, mode {mode['name']}",
            ("detuning", "P of exceeding the limit"),
            tuple((_signed(one["detuning"]), percent(one["probability"])) for one in damper["detuned"]),
        ),
    ]  # fmt: skip


def _cost_blocks(mode: Content) -> list[Block]:
    cost = mode.get("cost")
    if not cost:
        return []
    money = cost["currency"] or "units of currency"
    found: list[Block] = []
    if by_mass := cost.get("by_mass"):
        choice = (
            f"with a damper of {number(by_mass['best_mass'], 3)} kg; without a damper "
            f"{number(by_mass['without'], 3)} {money}."
            if by_mass["best_mass"]
            else "without a damper."
        )
        found.append(paragraph(f"{least_cost(mode, by_mass, money, number, 3)} {choice}"))
    if by_damping := cost.get("by_damping"):
        added = percent(by_damping["best_added_damping"])
        found.append(paragraph(f"{least_cost(mode, by_damping, money, number, 3)} with {added} added damping."))
    if known := cost.get("information"):
        found.append(
            paragraph(
                f"To know everything before choosing would save {number(known['perfect'], 3)} {money} in "
                "expectation: an upper bound on what a further test is worth."
            )
        )
    return found


def least_cost(mode: Content, curve: Content, money: str, write: Callable[..., str], digits: int) -> str:
    """What the cheapest choice along a curve of cost comes to, in words."""
    return f"Least expected cost, mode {mode['name']}: {write(curve['best_total'], digits)} {money}"


def exceedances(content: Content, write: Callable[[float], str]) -> list[tuple[str, ...]]:
    """Probability of exceeding the limit in every mode and in any, by what is done about it."""
    every = content["all_modes"]
    labels = {
        "without": "as it is",
        "with_required_damping": f"with the damping required at {share(float(ASKED))}",
        "with_dampers": "with all dampers, each acting on every mode",
    }
    return [
        (label, *(write(p) for p in every[key]["each"]), write(every[key]["any"]))
        for key, label in labels.items()
        if key in every
    ]


def _together_table(content: Content) -> Table:
    names = content["all_modes"]["names"]
    return Table(
        "all_modes",
        "Probability of exceeding the limit in lock-in",
        ("", *(f"mode {name}" for name in names), "any mode"),
        tuple(exceedances(content, percent)) if len(names) > 1 else (),
    )


def hours_in_lock_in(content: Content) -> Iterator[tuple[str, float, float, str, float, float]]:
    """Mode, reduced velocities of lock-in, whether they are assumed, hours in lock-in and beyond the limit."""
    if hours := content["all_modes"].get("hours"):
        columns = (hours[key] for key in ("lock_in", "assumed", "a_year", "exceeding_a_year"))
        for name, (low, high), assumed, a_year, beyond in zip(content["all_modes"]["names"], *columns, strict=True):
            yield name, low, high, " (assumed)" if assumed else "", a_year, beyond


def _hours_table(content: Content) -> Table:
    return Table(
        "hours",
        "Hours a year in lock-in, and expected beyond the limit",
        ("mode", "lock-in U/(fD)", "hours a year", "beyond the limit"),
        tuple(
            (name, f"{number(low, 3)} to {number(high, 3)}{assumed}", number(a_year, 3), number(beyond, 3))
            for name, low, high, assumed, a_year, beyond in hours_in_lock_in(content)
        ),
    )


def number(value: float | None, digits: int = 4) -> str:
    """A number; where none exists (no amplitude is stable, no choice is allowed) in words."""
    return "no bound" if value is None else written(value, digits)


def _signed(value: float) -> str:
    return f"{100.0 * value:+.0f} %".replace("-", "−")


def _length(value: float | None, unit: str) -> str:
    """An amplitude of the bridge in mm, or in degrees."""
    if value is None:
        return "no bound"
    return f"{number(1e3 * value, 3)} mm" if unit == "m" else f"{number(180.0 / np.pi * value, 3)}°"
