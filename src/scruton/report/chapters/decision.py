"""The first page where there is a bridge: what to do, the risk before and after, and what that rests on."""

from collections.abc import Iterable, Iterator, Sequence

from scruton.report.chapters.gap_words import capital, contained_sentence, gap_sentence
from scruton.report.chapters.material import Material
from scruton.report.conventions import (
    DAMPING,
    amplitude,
    by_conventions,
    damping,
    damping_words,
    flag_texts,
    known_to,
    scruton,
    scruton_note,
    shown_in,
    with_unit,
)
from scruton.report.document import ALARM, Abreast, Block, Callout, KeyFigures, paragraph
from scruton.report.needs import Content, Need, for_any, governing, needs, required_of, worst
from scruton.report.wording import PAGE, law_text, limit_text, number, percent, share
from scruton.sizing.checks import ASKED, LAW_FREE
from scruton.sizing.thresholds import LARGEST_ADDED, STROKE_TOLERANCE

RESTS_ON, OVERTURNS = "What it rests on", "What could overturn it"
_SHARES_NAMED = 2  # sources of variance that the first page names
_LEAST_TOLD = 0.001  # of a probability: a dozen or two draws of those it is counted with


def decision_page(material: Material) -> Iterator[Block]:
    """The decision, for whoever has to take it."""
    assert material.sizing is not None
    yield from _decision(material.sizing, material)


@by_conventions
def _decision(sizing: Content, material: Material) -> Iterator[Block]:
    fit, failed = material.fit, _unconverged(sizing, converged=material.fit.converged)
    of_fit = flag_texts(fit.flags, fit.summary) if fit.converged else ()
    flags = list(dict.fromkeys([*material.sizing_flags, *of_fit, *material.cautions()]))
    if failed:
        yield Callout(ALARM, "Not to be trusted: the sampling did not converge.", flags[:1])
        flags = flags[1:]
    yield paragraph(decision_sentence(sizing, failed), role="answer")
    yield KeyFigures(list(_figures(sizing)))
    yield from material.figure("decision")[:1]  # that of the other motion stands with its modes
    if flags:
        yield Callout(ALARM, "Read this before using a number.", flags)
    yield Abreast([(RESTS_ON, list(_basis(material, sizing))), (OVERTURNS, list(_doubts(material, sizing)))])


def _unconverged(sizing: Content, *, converged: bool) -> Sequence[str]:
    """Posteriors that the sizing rests on and that did not converge; an earlier sizing says of the whole fit alone."""
    failed: Sequence[str] = sizing.get("unconverged", () if converged else ("the fit",))
    return failed


def decision_sentence(sizing: Content, failed: Sequence[str] = ()) -> str:
    """Keep the bridge as it is, add damping, or test more: in words that can be acted upon, for every mode."""
    every = needs(sizing)
    own = [need for need in every if need.mode is not None]
    if failed:
        return f"Decide nothing on these numbers: the fit of {_and(need.name for need in own)} did not converge."
    asked, confidence, together = for_any(sizing), f"{share(float(ASKED))} confidence", "Add"
    if asked is not None:
        confidence = f"{share(1.0 - asked['risk'])} confidence, all modes together"
        together = f"For a risk of {percent(asked['risk'])} of any mode, add"
    trusted = [need for need in every if need.trusted]
    beyond = [need for need in trusted if need.required is None]
    wanting = [need for need in trusted if need.required]
    kept = [need for need in trusted if need.required == 0.0]
    sentences: list[str] = []
    if beyond:
        sentences += _beyond(beyond, confidence)
    if wanting:
        parts = [
            f"{damping(need.required)} to {need.name}{f', such as by {_damper_words(need)}' if need.dampers else ''}"
            for need in wanting
        ]
        sentences.append(f"{together} a {damping_words()} of {_and(parts)}.")
    if kept:
        below = "stays below its limit" if len(kept) == 1 else "stay below their limits"
        names = _and(need.name for need in kept)
        if len(kept) == len(every):
            sentences.append(f"Keep the bridge as it is: {names} {below} with {confidence}.")
        else:
            sentences.append(f"{capital(names)} {below} as the bridge is.")
    if doubted := [need.name for need in every if not need.trusted]:
        sentences.append(f"Decide nothing on {_and(doubted)}: the fit did not converge.")
    far = [need for need in wanting if need.reach is not None and not need.reach["trusted"]]
    if far:
        places = [
            scruton(need.reach["scruton_number"], digits=2) + (f" ({need.name})" if len(every) > 1 else "")
            for need in far
            if need.reach is not None
        ]
        sentences.append(
            f"Test a rig at a Scruton number of about {_and(places)} before it is built: the answer extrapolates from "
            "those tested."
        )
    elif wanting and any(governing(need.mode).get("required_at_discrepancy") for need in own if need.mode is not None):
        sentences.append("Test a second rig before it is built: one says nothing of how far rigs differ.")
    return " ".join(sentences)


def _beyond(beyond: Sequence[Need], confidence: str) -> Iterator[str]:
    """What to do about modes that need more damping than is looked at: which cap that is, and what lies behind it."""
    one = len(beyond) == 1
    names = _and(need.name for need in beyond)
    yield (
        f"{capital(names)} need{'s' * one} an added {damping_words()} of more than {damping(LARGEST_ADDED)}, the most "
        f"that is looked at, to stay below {'its limit' if one else 'their limits'} with {confidence}."
    )
    rest = []
    for need in beyond:
        if need.dampers:
            yield f"Enough for {need.name}: {_damper_words(need)}."
        elif heavier := _heavier(need):
            yield heavier
        else:
            rest.append(need.name)
    if rest:
        yield f"Change the section of {_and(rest)}, or {'its limit' if len(rest) == 1 else 'their limits'}."


def _heavier(need: Need) -> str:
    """What dampers beyond the largest mass ratio that is allowed would leave, where they keep the risk; else empty."""
    damper = need.mode["damper"] if need.mode is not None else {}
    chart, asked = damper.get("map") or {}, damper.get("asked") or {}
    largest, room = asked.get("largest_mass_ratio"), asked.get("largest_stroke")
    if largest is None or not damper.get("dampers"):
        return ""
    strokes = chart.get("stroke_high") or []
    for ratio, left, stroke in zip(
        chart.get("mass_ratio") or [], chart.get("probability") or [], strokes, strict=False
    ):
        fits = room is None or (stroke is not None and stroke <= (1.0 + STROKE_TOLERANCE) * room)
        if ratio > 1.001 * largest and left <= asked["risk"] and fits:
            return (
                f"For {need.name} the mass ratio of dampers is held to {100.0 * largest:g} %, which leaves a risk of "
                f"{percent(damper['probability'])}; one of {percent(ratio, 2)} would leave {percent(left)}: allow "
                "heavier dampers, or more of them."
            )
    return ""


def _and(parts: Iterable[str]) -> str:
    *most, last = parts
    return f"{', '.join(most)} and {last}" if most else last


def _damper_words(need: Need) -> str:
    count, mass = len(need.dampers), sum(mass for mass, _ in need.dampers)
    kind = "one tuned mass damper" if count == 1 else f"{count} tuned mass dampers"
    total = f"{number(mass / 1e3, 3)} t" + (" in all" if count > 1 else "")
    return f"{kind} of {total} at {number(need.dampers[0][1], 3)} Hz"


def _figures(sizing: Content) -> Iterator[tuple[str, str, str]]:
    mode, together = worst(sizing), sizing.get("both") or sizing["all_modes"]
    limit, damper, files = governing(mode), mode["damper"], sizing["amplitude_unit"]
    factor, unit = shown_in(files)
    ends = PAGE.interval(*(mode["amplitude"][key] for key in ("median", "low", "high")), factor=factor)
    yield (
        f"Amplitude, mode {mode['name']}", with_unit(ends[0], unit),
        f"90 %: {with_unit(ends[1], unit)}; limit {amplitude(limit['limit'], files)}",
    )  # fmt: skip
    alone, required = f"of exceeding the limit of {limit_text(limit)} in lock-in", required_of(sizing, mode)
    if len(together["names"]) == 1:
        yield "Risk as it is", _risk(limit["probability"]), alone
    else:
        detail = f"mode {mode['name']} {percent(limit['probability'])}: {alone}"
        yield "Risk of any mode as it is", _risk(together["without"]["any"]), detail
    asked = f"{percent(damper['asked']['risk'])} was asked for"
    needed = for_any(sizing)
    with_damping = together.get("with_required_damping") if needed is None else needed["left"]
    if len(together["names"]) > 1 and damper["dampers"] and together.get("with_dampers"):
        every = "any mode" if for_any(sizing) is not None else "each mode"
        yield "Risk of any mode with all dampers", _risk(together["with_dampers"]["any"]), f"{asked} of {every}"
    elif damper["dampers"]:
        yield "Risk with the damper", _risk(damper["probability"]), asked
    elif len(together["names"]) > 1 and required and with_damping:
        detail = f"mode {mode['name']} has {damping(required)} of it"
        yield "Risk of any mode with the damping added", _risk(with_damping["any"]), detail
    else:
        text = "–" if required is None else damping(required)
        yield "Damping to add", text, f"at {share(float(ASKED))} confidence"


def _risk(probability: float) -> str:
    """A risk; the smallest is not told to the draw that it was counted with."""
    return "below 0.1 %" if probability < _LEAST_TOLD else percent(probability)


def _basis(material: Material, sizing: Content) -> Iterator[str]:
    fit, mode = material.fit, worst(sizing)
    limit, every = governing(mode), needs(sizing)
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
    yield f"Law of aerodynamic damping: {laws}. Laws agree to 8 % for an extrapolation index below 0.2."
    if reached := [(need, need.reach) for need in every if (need.required or need is every[0]) and need.reach]:
        several = len(every) > 1
        more = [need.required is None for need, _ in reached]
        places = [scruton(reach["scruton_number"], digits=3) + f" ({need.name})" * several for need, reach in reached]
        indices = [number(reach["extrapolation_index"], 2) for _, reach in reached]
        # What needs more than is looked at lies beyond where that much would take it.
        places = [f"beyond Sc {place}" if over else f"at Sc {place}" for place, over in zip(places, more, strict=True)]
        indices = [f"at least {one}" if over else one for one, over in zip(indices, more, strict=True)]
        covered = [f"{reach['covered_by']} of {reach['tests']}" for _, reach in reached]
        yield (
            f"The answer lies {_and(places)}, an extrapolation index of {_and(indices)} from the nearest test; "
            f"transients of {_and(covered)} tests went through the limit's amplitude."
        )
    if (free := limit.get("required_by_law", {}).get(LAW_FREE)) is not None:
        by_hand, of = limit.get("required_by_hand"), f"Mode {mode['name']} without" if len(every) > 1 else "Without"
        yield (
            f"{of} a law, by the damping that the transients show there: {_added(free[ASKED])}"
            + ("." if by_hand is None else f"; by a straight line of 1/A, at the medians: {_added(by_hand)}.")
        )
    if known := ", ".join(_known(sizing, mode)):
        yield f"Monte Carlo standard errors{f' (mode {mode["name"]})' if len(every) > 1 else ''}: {known}."
    if note := scruton_note(heaving=sizing["amplitude_unit"] == "m"):
        yield note


def _known(sizing: Content, mode: Content) -> Iterator[str]:
    """The numbers that the decision is taken by, each with what the draws know it to."""
    limit, (factor, unit) = governing(mode), shown_in(sizing["amplitude_unit"])
    for what, value, error, shown in (
        ("median amplitude", mode["amplitude"]["median"], (mode["amplitude"].get("mcse") or [None])[0], (factor, unit)),
        ("risk as it is", limit["probability"], limit.get("probability_mcse"), (100.0, "%")),
        (
            f"damping to add with {share(float(ASKED))} confidence", limit["required"][ASKED],
            limit.get("required_mcse", {}).get(ASKED), shown_in(DAMPING),
        ),
    ):  # fmt: skip
        if text := known_to("", value, error, shown):
            yield f"{what} {text}"


def _added(value: float | None) -> str:
    return f"more than {damping(LARGEST_ADDED)}" if value is None else damping(value) if value else "none"


def _doubts(material: Material, sizing: Content) -> Iterator[str]:
    mode = worst(sizing)
    limit, of = governing(mode), f" (mode {mode['name']})" if len(needs(sizing)) > 1 else ""
    if by_law := {law: row[ASKED] for law, row in limit.get("required_by_law", {}).items() if law != LAW_FREE}:
        yield (
            f"Another law{of}: "
            + ", ".join(f"{law_text(law)} asks for {_added(value)}" for law, value in by_law.items())
            + "."
        )
    if shares := [s for s in mode.get("shares", {}).get("needed", ()) if s["total"]][:_SHARES_NAMED]:
        named = " and ".join(f"{row['source']} ({share(max(row['first'], 0.0))})" for row in shares)
        yield f"What the uncertainty of the damping needed{of} comes from most: {named}."
    for tau, row in limit.get("required_at_discrepancy", {}).items():
        yield f"Where rigs miss the curve by {share(float(tau))}{of}: {_added(row[ASKED])}."
    if (gap := material.gap) is None:
        yield "The gap between model and records was not looked for."
        return
    yield gap_sentence(gap)
    if contained := contained_sentence(gap, material.fit.summary):
        yield contained
