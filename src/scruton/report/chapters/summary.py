"""The answer first, with whether it may be trusted; and how far the numbers reach, stated plainly."""

from collections.abc import Iterator

from scruton.griffin.thresholds import X_TRUSTED
from scruton.infer.thresholds import SENSITIVE
from scruton.report.chapters.campaign import damping_table
from scruton.report.chapters.decision import OVERTURNS, RESTS_ON, decision_page
from scruton.report.chapters.gap_words import contained_sentence, gap_sentence
from scruton.report.chapters.material import Material
from scruton.report.chapters.results import SOURCES, within
from scruton.report.chapters.sizing import sizing_assumptions
from scruton.report.conventions import (
    DAMPING,
    damping,
    damping_words,
    flag_texts,
    scruton,
    scruton_note,
    shown_in,
    with_unit,
)
from scruton.report.document import (
    ALARM,
    CAUTION,
    Abreast,
    Block,
    Callout,
    Heading,
    KeyFigures,
    Listing,
    Table,
    paragraph,
)
from scruton.report.errors import errors_of_rigs, errors_of_test, in_brackets
from scruton.report.needs import Content, needs
from scruton.report.summaries import covered, monte_carlo, told_errors
from scruton.report.thresholds import SHARE_SHOWN, TESTS_ABREAST
from scruton.report.wording import PAGE, estimate, how_many, law_text, number, share, stated


def summary_chapter(material: Material) -> Iterator[Block]:
    """The decision, where there is a bridge; else warnings in red, the answer, the numbers, and what they rest on."""
    if material.sizing is not None:
        yield from decision_page(material)
        return
    fit, warnings = material.fit, flag_texts(material.fit.flags, material.fit.summary)
    if not fit.converged:
        yield Callout(ALARM, "Not to be trusted: the sampling did not converge.", warnings)
    elif warnings:
        yield Callout(ALARM, "Read this before using a number.", warnings)
    lines = _answers(material)
    if len(lines) > 3:
        yield Listing(lines, role="answer")
    else:
        yield from (paragraph(line, role="answer") for line in lines)
    if figures := [*_design_figures(material)]:
        yield KeyFigures(figures)
    yield from material.figure("griffin")
    if cautions := material.cautions():
        yield Callout(CAUTION, "With caution", cautions)
    if material.tests:
        both = ((RESTS_ON, list(_basis(material))), (OVERTURNS, list(_doubts(material))))
        yield Abreast([(head, lines) for head, lines in both if lines])
        return
    yield damping_table(material)
    if material.gap is not None:
        yield paragraph(f"Diagnosis: {gap_sentence(material.gap)}")
    yield paragraph("The campaign holds no test in wind, so it says nothing of vortex-induced vibration.")


def _design_figures(material: Material) -> Iterator[tuple[str, str, str]]:
    """The numbers of the first design."""
    for design in material.design[:1]:
        amplitude, (factor, unit) = design.to_json()["amplitude"], material.shown
        shown = {
            f"Stable amplitude at Sc = {scruton(design.scruton_number, stated)}": (*estimate(amplitude, factor), unit)
        }
        if material.sizing is None and material.heaving:
            shown["At the model's scale"] = material.in_model_unit(amplitude)
        errors = f"; MC errors {monte_carlo(amplitude, PAGE)}"
        for title, (median, interval, unit) in shown.items():
            yield title, with_unit(median, unit), f"90 % interval {with_unit(interval, unit)}{errors}"
            errors = ""  # in another unit they say nothing more
        nearest = min(design.extrapolation_indices, key=lambda test: abs(design.extrapolation_indices[test]))
        reach = f"from {nearest}; laws agree to 8 % for |x| < 0.2"
        yield "Extrapolation index x", number(design.extrapolation_index, 2), reach


def _answers(material: Material) -> list[str]:
    """Sentences that answer what the report was asked: the design, else the peak tests, else structural damping."""
    (factor, unit), answers = material.shown, []
    for design in material.design:
        amplitude = design.to_json()["amplitude"]
        median, interval = estimate(amplitude, factor)
        model_median, model_interval, model_unit = material.in_model_unit(amplitude)
        scale = f"; at the model's scale {model_median} ({model_interval}) {model_unit}" if material.heaving else ""
        answers.append(
            f"At the design Scruton number {scruton(design.scruton_number, stated)} (structural {damping_words()} "
            f"{damping(design.damping_ratio)} on rig {design.rig}) the predicted stable amplitude is "
            f"{with_unit(median, unit)}, 90 % interval {with_unit(interval, unit)}"
            f"{in_brackets(told_errors(amplitude), factor)}{scale}."
        )
    for test in material.tests if not answers else ():
        if test["peak"]:
            median, interval = estimate(test["parameters"]["a_star"], factor)
            sc = scruton(test["parameters"]["scruton_number"]["median"], digits=3)
            errors = in_brackets(errors_of_test(material.fit.tree, test["name"], ("a_star",))["a_star"], factor)
            answers.append(
                f"Peak test {test['name']} (Sc = {sc}): the stable amplitude is {with_unit(median, unit)}, 90 % "
                f"interval {with_unit(interval, unit)}{errors}."
            )
    of_rigs = errors_of_rigs(material.fit.tree) if not answers else {}
    for rig in material.fit.summary["rigs"] if not answers else ():
        per, sign = shown_in(DAMPING)
        median, interval = (with_unit(text, sign) for text in estimate(rig["parameters"]["damping_ratio"], per))
        errors = in_brackets(of_rigs.get(rig["name"]), per)
        answers.append(
            f"Rig {rig['name']}: the structural {damping_words()} is {median}, 90 % interval {interval}{errors}."
        )
    if answers and material.tests and (note := scruton_note(heaving=material.heaving)):
        answers.append(note)
    return answers


def _basis(material: Material) -> Iterator[str]:
    """What the numbers rest on: records, law, prior, extrapolation."""
    campaign = material.fit.campaign
    sc = [test["parameters"]["scruton_number"]["median"] for test in material.tests if test["peak"]]
    records = how_many(sum(len(test.records) for test in campaign.tests), "record")
    words = f"It rests on {records} in wind of {how_many(len(campaign.tests), 'test')}"
    if sc:
        between = " to ".join(scruton(one, digits=3) for one in sorted({min(sc), max(sc)}))
        words += f", {how_many(len(sc), 'peak test')} among them (Sc = {between}), and on "
        words += how_many(len(campaign.rigs), "rig")
    yield (
        f"{words}. Intervals carry the record, the structural damping, the law of aerodynamic damping and the "
        "discrepancy between settings."
    )
    weights = material.fit.summary["laws"].get("weights", {})
    laws = [f"{law_text(law)} ({share(w['weight'])})" for law, w in weights.items() if w["weight"] > SHARE_SHOWN]
    if laws:
        yield f"Law of aerodynamic damping: {', '.join(laws)}."
    yield f"Priors: those of the model card “{material.fit.card.name}”."
    for design in material.design:
        yield (
            f"Sc = {scruton(design.scruton_number, stated)} lies at an extrapolation index of "
            f"{number(design.extrapolation_index, 2)} from the nearest test: laws part beyond {X_TRUSTED:g}."
        )


def _doubts(material: Material) -> Iterator[str]:
    """What could overturn the numbers: one rig, priors that they follow, tests that others miss, the gap."""
    if len({test["rig"] for test in material.tests}) == 1:
        yield "One rig says nothing of how far rigs differ."
    for sc in dict.fromkeys(row.scruton_number for row in material.sensitivity):
        followed = [
            SOURCES.get(row.source, row.source)
            for row in material.sensitivity
            if row.scruton_number == sc and row.distance >= SENSITIVE
        ]
        if followed:
            said = " and of the ".join(followed)
            yield f"The prediction at Sc = {scruton(sc)} follows what the model card says of the {said}."
    missed = [
        test for test, prediction in material.crossed.items()
        if not within(prediction["amplitude"]["interval"]["0.90"], material.measured_or_found(test))
    ]  # fmt: skip
    if missed:
        yield f"Outside the 90 % interval that the other tests give: {', '.join(missed)}."
    if material.gap is None:
        yield "The gap between model and records was not looked for."
        return
    yield f"Diagnosis: {gap_sentence(material.gap)}"
    if contained := contained_sentence(material.gap, material.fit.summary):
        yield contained


def validity_chapter(material: Material) -> Iterator[Block]:
    """Extrapolation, flags and assumptions."""
    if not material.tests:
        return
    flags, cautions = flag_texts(material.fit.flags, material.fit.summary), material.cautions()
    if flags:
        yield Callout(ALARM, "Flags of the fit", flags)
    if cautions:
        yield Callout(CAUTION, "Flags of the predictions", cautions)
    if sized := material.sizing_flags:
        yield Callout(CAUTION, "Flags of the sizing", sized)
    if not (flags or cautions or sized):
        yield paragraph("Neither the fit nor the predictions nor the sizing raised a flag.")
    yield Heading("How far the design lies from the tests")
    yield paragraph(
        "The extrapolation index x is the distance from a test in units of the Scruton number that its relaxation rate "
        "is worth. Laws of aerodynamic damping from n = −1 to 2 agree to 2 % in amplitude for |x| < 0.1, to 8 % "
        f"for |x| < 0.2; beyond {X_TRUSTED:g}, where they differ by up to 22 %, the number rests on the laws that the "
        "model card lists."
    )
    yield _extrapolation(material)
    yield Heading("What is assumed")
    discrepancy = material.discrepancy()
    assumed = [
        "The section vibrates in one degree of freedom, and its amplitude changes little within one cycle.",
        "The peak tests share one Griffin curve up to a discrepancy that is inferred"
        + (f": {discrepancy}." if discrepancy else "."),
        *_force_assumed(material.sizing),
        "A new setting is at the wind speed of the largest amplitude, and exchangeable with the settings tested.",
    ]  # fmt: skip
    if len(material.fit.ringdowns) < len(material.fit.campaign.rigs):
        assumed.append("Structural damping is as stated, with the uncertainty that the model card gives it.")
    sized_by = dict.fromkeys(text for content in material.sizings for text in sizing_assumptions(content))
    yield Listing([*assumed, *sized_by])
    if material.gap is not None:
        sentence = gap_sentence(material.gap)
        yield paragraph(f"Of what is not modelled: {sentence[0].lower()}{sentence[1:]}")


def _force_assumed(sizing: Content | None) -> Iterator[str]:
    """What the force is taken to share with the tunnel: of a bridge with a transfer the predictions alone do."""
    tunnel = "Reynolds number, turbulence and details of the section are those of the tunnel"
    transfer = None if sizing is None else sizing["bridge"].get("transfer")
    if transfer is None:
        yield f"The aerodynamic force is that of the model: {tunnel}."
        return
    factors = ", ".join(
        f"{words} {number(transfer[key]['mean'], 3)} ± {number(transfer[key]['sd'], 2)}"
        for key, words in (("turbulence", "turbulence"), ("reynolds_number", "Reynolds number"), ("details", "details"))
    )
    yield f"The aerodynamic force of a prediction at a Scruton number is that of the model: {tunnel}."
    yield (
        "What changes from the tunnel to the bridge is in the factors by which the sizing multiplies the amplitude"
        f"{', assumed' * transfer['assumed']} (mean ± standard deviation): {factors}."
    )


def _extrapolation(material: Material) -> Table:
    """How far every design lies from each test, or the nearest, and what every mode of the bridge needs from that."""
    tests = list(material.design[0].extrapolation_indices) if material.design else []
    if len(tests) > TESTS_ABREAST:  # more columns would not fit the page
        tests = []
    rows = []
    for design in material.design:
        indices = [design.extrapolation_indices[test] for test in tests]
        reached = abs(design.extrapolation_index) <= X_TRUSTED and design.covered_by > 0
        rows.append((
            "design", scruton(design.scruton_number, stated), *(number(index, 2) for index in indices),
            number(design.extrapolation_index, 2), covered(design.to_json()["amplitude_coverage"]),
            "yes" if reached else "NO",
        ))  # fmt: skip
    for need in needs(material.sizing) if material.sizing else ():
        if need.required and (reach := need.reach):
            rows.append((
                f"{need.name} with {damping(need.required)} added", scruton(reach["scruton_number"], digits=3),
                *("–" for _ in tests), number(reach["extrapolation_index"], 2),
                covered({"tests": reach["covered_by"], "of": reach["tests"]}), "yes" if reach["trusted"] else "NO",
            ))  # fmt: skip
    header = ["", "Sc", *(f"from {test}" for test in tests), "from nearest test", "covered", "within reach"]
    return Table(
        "extrapolation", "Extrapolation index x of every design", header, rows,
        "Covered: by the transients of so many peak tests. Within reach: x is no farther from zero than "
        f"{X_TRUSTED:g}, and a transient of some test went through that amplitude, too.",
    )  # fmt: skip
