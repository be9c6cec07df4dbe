"""What the terminal is told of a sizing: what is required, the dampers, what more knowledge would be worth."""

from collections.abc import Iterator

from scruton.report.chapters.sizing import exceedances, hours_in_lock_in, least_cost
from scruton.report.document import CAUTION, Block, Callout, Table, paragraph
from scruton.report.figures.sizing import CONFIDENCES, Content
from scruton.report.wording import TERMINAL, share


def sizing_summary(content: Content) -> list[Block]:
    """The sizing for the terminal: what is required, the damper, what more knowledge would be worth."""
    unit, modes = content["amplitude_unit"], content["modes"]
    required = [
        (
            mode["name"], one["rule"], TERMINAL.number(one["limit"]), f"{one['probability']:.3f}",
            *("> 5" if one["required"][p] is None else f"{100 * one['required'][p]:.3f}" for p in CONFIDENCES),
        )
        for mode in modes
        for one in mode["limits"]
    ]  # fmt: skip
    header = ("mode", "limit", f"[{unit}]", "P without", *(share(float(p)) for p in CONFIDENCES))
    without = [
        (
            mode["name"], _terminal_spread(mode["scruton_number"]), _terminal_spread(mode["amplitude"]),
            *(f"{source['source']} {max(source['first'], 0.0):.0%}" if source["total"] else "-"
              for source in mode["shares"]["needed"][:1]),
        )
        for mode in modes
    ]  # fmt: skip
    return [
        paragraph(f"{content['bridge']['title']}: damping that keeps the amplitude below the limit"),
        Table("required", "Added damping [%] by confidence", header, tuple(required)),
        Table(
            "modes", "", ("mode", "Sc (90 %)", f"amplitude without [{unit}]", "largest share of variance"),
            tuple(without),
        ),
        *(_damper_summary(mode) for mode in modes),
        *(block for mode in modes if "cost" in mode for block in _cost_summary(mode)),
        *_all_modes_summary(content),
        Callout(CAUTION, "", tuple(content["flags"])),
    ]  # fmt: skip


def _terminal_spread(entry: Content) -> str:
    return f"{TERMINAL.number(entry['median'], 3)} ({TERMINAL.range((entry['low'], entry['high']), 3)})"


def _damper_summary(mode: Content) -> Block:
    one = mode["damper"]
    name = f"Tuned mass damper, mode {mode['name']}"
    if not one["dampers"]:
        return paragraph(f"{name}: {one['reason']}")
    rows = tuple(
        (
            str(k), TERMINAL.number(damper["mass"]), f"{100 * damper['mass_ratio']:.3f}",
            TERMINAL.number(damper["frequency"], 5), f"{100 * damper['damping_ratio']:.2f}",
            TERMINAL.number(damper["spring"]), TERMINAL.number(damper["dashpot"]),
        )
        for k, damper in enumerate(one["dampers"], 1)
    )  # fmt: skip
    header = (
        "damper", "mass [kg]", "mass ratio [%]", "frequency [Hz]", "damping [%]", "spring [N/m]", "dashpot [N s/m]",
    )  # fmt: skip
    stroke, asked = one["stroke"], one["asked"]
    reached = "least mass" if one["achievable"] else "NOT ACHIEVED"
    return Table(
        "dampers",
        f"{name}: {reached} for a risk of {asked['risk']:.1%}; {one['reason']}",
        header,
        rows,
        f"risk left {one['probability']:.3f}; stroke {TERMINAL.number(stroke['median'], 3)} m "
        f"(95 %: {TERMINAL.number(stroke['high'], 3)} m); risk where detuned: "
        + ", ".join(f"{each['detuning']:+.0%} {each['probability']:.3f}" for each in one["detuned"]),
    )


def _cost_summary(mode: Content) -> Iterator[Block]:
    cost = mode["cost"]
    money = cost["currency"]
    if by_mass := cost.get("by_mass"):
        least = least_cost(mode, by_mass, money, TERMINAL.number, 4)
        end = ", the heaviest looked at" if by_mass["at_the_end"] else ""
        yield paragraph(
            f"{least} with a damper of {TERMINAL.number(by_mass['best_mass'])} kg{end} "
            f"(without: {TERMINAL.number(by_mass['without'])} {money})"
            if by_mass["best_mass"]
            else f"{least} without a damper"
        )
    if by_damping := cost.get("by_damping"):
        end = ", the most looked at" if by_damping["at_the_end"] else ""
        added = f"{100 * by_damping['best_added_damping']:.3f} % added damping{end}"
        yield paragraph(f"{least_cost(mode, by_damping, money, TERMINAL.number, 4)} with {added}")
    if known := cost.get("information"):
        every = f"all of it {TERMINAL.number(known['perfect'], 3)}"
        rows = tuple((one["name"], one["kind"], TERMINAL.number(one["value"], 3)) for one in known["worth"])
        title = f"Value of knowing more before choosing [{money or 'currency'}]; {every}"
        yield Table("information", title, ("of", "kind", "worth at most"), rows)


def _all_modes_summary(content: Content) -> list[Block]:
    names = content["all_modes"]["names"]
    if len(names) < 2 and "hours" not in content["all_modes"]:
        return []
    hours = tuple(
        (name, f"{low:.2f} .. {high:.2f}{assumed}", TERMINAL.number(a_year), TERMINAL.number(beyond))
        for name, low, high, assumed, a_year, beyond in hours_in_lock_in(content)
    )
    header = ("mode", "lock-in U/(fD)", "hours a year in lock-in", "expected hours beyond the limit")
    together = tuple(exceedances(content, "{:.3f}".format))
    return [
        Table("all_modes", "Probability of exceeding the limit in lock-in", ("", *names, "any"), together),
        Table("hours", "", header, hours),
    ]
