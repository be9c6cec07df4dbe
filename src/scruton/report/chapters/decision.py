"""The first page where there is a bridge: what to do, the risk before and after, and what that rests on."""

from collections.abc import Iterator

from scruton.report.chapters.gap import contained_sentence, gap_sentence
from scruton.report.chapters.material import Material
from scruton.report.conventions import (
    amplitude,
    by_conventions,
    damping,
    damping_words,
    scruton,
    scruton_note,
    shown_in,
    warnings_note,
    with_unit,
)
from scruton.report.document import ALARM, Block, Callout, Heading, KeyFigures, Listing, paragraph
from scruton.report.figures.sizing import Content, governing, worst
from scruton.report.wording import PAGE, law_text, limit_text, number, percent, share
from scruton.sizing.checks import ASKED, LAW_FREE

_SHARES_NAMED = 2  # sources of variance that the first page names


def decision_page(material: Material) -> Iterator[Block]:
    """The decision, for whoever has to take it."""
    assert material.sizing is not None
    yield from _decision(material.sizing, material)


@by_conventions
def _decision(sizing: Content, material: Material) -> Iterator[Block]:
    fit = material.fit
    if not fit.converged:
        yield Callout(ALARM, "Not to be trusted: the sampling did not converge.", fit.flags)
    yield paragraph(decision_sentence(sizing, trusted=fit.converged), role="answer")
    yield KeyFigures(list(_figures(sizing)))
    yield from material.figure("decision")
    if flags := list(dict.fromkeys([*sizing["flags"], *(fit.flags if fit.converged else ())])):
        yield Callout(ALARM, "Read this before using a number.", [*flags, *warnings_note()])
    yield Heading("What it rests on")
    yield Listing(list(_basis(material, sizing)))
    yield Heading("What could overturn it")
    yield Listing(list(_doubts(material, sizing)))


def decision_sentence(sizing: Content, *, trusted: bool = True) -> str:
    """Keep the bridge as it is, add damping, or test more: in words that can be acted upon."""
    mode = worst(sizing)
    limit, name = governing(mode), f"mode {mode['name']}"
    required, reach = limit["required"][ASKED], limit.get("reach", {}).get(ASKED)
    if not trusted:
        return f"Decide nothing on these numbers: the fit of {name} did not converge."
    if required is None:
        return (
            f"No added damping that can be built keeps {name} below its limit with {share(float(ASKED))} confidence: "
            "change the section, or its limit."
        )
    if required == 0.0:
        return f"Keep the bridge as it is: {name} stays below its limit with {share(float(ASKED))} confidence."
    demand = f"Add a {damping_words()} of {damping(required)} to {name}{_damper_words(mode)}."
    if reach is not None and not reach["trusted"]:
        demand += (
            f" Test a rig at a Scruton number of about {scruton(reach['scruton_number'], digits=2)} before it is "
            "built: the answer lies far from those tested."
        )
    elif limit.get("required_at_discrepancy"):
        demand += " Test a second rig before it is built: one says nothing of how far rigs differ."
    return demand


def _damper_words(mode: Content) -> str:
    damper = mode["damper"]
    count = len(damper["dampers"])
    if not (count and damper["achievable"] and damper.get("mass")):
        return ""
    kind = "one tuned mass damper" if count == 1 else f"{count} tuned mass dampers"
    frequency = number(damper["dampers"][0]["frequency"], 3)
    return f", such as by {kind} of {number(damper['mass'] / 1e3, 3)} t in all at {frequency} Hz"


def _figures(sizing: Content) -> Iterator[tuple[str, str, str]]:
    mode = worst(sizing)
    limit, damper, files = governing(mode), mode["damper"], sizing["amplitude_unit"]
    factor, unit = shown_in(files)
    ends = PAGE.interval(*(mode["amplitude"][key] for key in ("median", "low", "high")), factor=factor)
    required = limit["required"][ASKED]
    yield (
        f"Amplitude, mode {mode['name']}", with_unit(ends[0], unit),
        f"90 %: {with_unit(ends[1], unit)}; limit {amplitude(limit['limit'], files)}",
    )  # fmt: skip
    yield "Risk as it is", percent(limit["probability"]), f"of exceeding the limit of {limit_text(limit)} in lock-in"
    if damper["dampers"]:
        yield (
            "Risk with the damper",
            percent(damper["probability"]),
            f"{percent(damper['asked']['risk'])} was asked for",
        )
    else:
        text = "–" if required is None else damping(required)
        yield "Damping to add", text, f"at {share(float(ASKED))} confidence"


def _basis(material: Material, sizing: Content) -> Iterator[str]:
    fit, limit = material.fit, governing(worst(sizing))
    peaks = [test for test in material.tests if test["peak"]]
    numbers = [test["parameters"]["scruton_number"]["median"] for test in peaks]
    between = " to ".join(scruton(one, digits=3) for one in sorted({min(numbers), max(numbers)}))
    yield (
        f"{len(peaks)} setting{'s' * (len(peaks) != 1)} of the section model, Sc {between}, "
        f"{sum(len(test.records) for test in fit.campaign.tests)} records in wind."
    )
    laws = ", ".join(
        f"{law_text(label)} ({share(weight)})" for label, weight in sizing["laws"].items() if weight > 0.005
    )
    yield f"Law of aerodynamic damping: {laws}."
    if reach := limit.get("reach", {}).get(ASKED):
        yield (
            f"The answer lies at Sc {scruton(reach['scruton_number'], digits=3)}, an extrapolation index of "
            f"{number(reach['extrapolation_index'], 2)} from the nearest test (laws agree to 8 % below 0.2); "
            f"transients of {reach['covered_by']} of {reach['tests']} tests went through the amplitude of the limit."
        )
    if (free := limit.get("required_by_law", {}).get(LAW_FREE)) is not None:
        by_hand = limit.get("required_by_hand")
        yield (
            f"Without a law, by the damping that the transients show there: {_added(free[ASKED])}"
            + ("." if by_hand is None else f"; by a straight line of 1/A, at the medians: {_added(by_hand)}.")
        )
    if note := scruton_note(heaving=sizing["amplitude_unit"] == "m"):
        yield note


def _added(value: float | None) -> str:
    return "more than can be added" if value is None else damping(value) if value else "none"


def _doubts(material: Material, sizing: Content) -> Iterator[str]:
    mode = worst(sizing)
    limit = governing(mode)
    if by_law := {law: row[ASKED] for law, row in limit.get("required_by_law", {}).items() if law != LAW_FREE}:
        yield (
            "Another law: "
            + ", ".join(f"{law_text(law)} asks for {_added(value)}" for law, value in by_law.items())
            + "."
        )
    if shares := [s for s in mode.get("shares", {}).get("needed", ()) if s["total"]][:_SHARES_NAMED]:
        named = " and ".join(f"{row['source']} ({share(max(row['first'], 0.0))})" for row in shares)
        yield f"What the uncertainty of the damping needed comes from most: {named}."
    for tau, row in limit.get("required_at_discrepancy", {}).items():
        yield f"Where rigs miss the curve by {share(float(tau))}: {_added(row[ASKED])}."
    if (gap := material.gap) is None:
        yield "The gap between model and records was not looked for."
        return
    yield gap_sentence(gap)
    if contained := contained_sentence(gap, material.fit.summary):
        yield contained
