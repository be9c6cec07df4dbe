"""How far the numbers reach, stated plainly."""

from scruton.griffin.thresholds import X_TRUSTED
from scruton.report.chapters.gap import gap_sentence
from scruton.report.chapters.material import Material
from scruton.report.chapters.posterior import discrepancy
from scruton.report.chapters.sizing import sizing_assumptions
from scruton.report.document import ALARM, CAUTION, Block, Callout, Chapter, Heading, Listing, Paragraph, Table
from scruton.report.wording import number, stated


def validity_chapter(material: Material) -> Chapter:
    """Extrapolation, flags and assumptions."""
    fit = material.fit
    if not material.in_wind:
        return Chapter("validity", "Limits of validity", ())
    blocks: list[Block] = []
    if fit.flags:
        blocks.append(Callout(ALARM, "Flags of the fit", tuple(fit.flags)))
    if material.cautions():
        blocks.append(Callout(CAUTION, "Flags of the predictions", tuple(material.cautions())))
    if not fit.flags and not material.cautions():
        blocks.append(Paragraph(("Neither the fit nor the predictions raised a flag.",)))
    blocks += [Heading("How far the design lies from the tests"), *_extrapolation(material)]
    blocks += [Heading("What is assumed"), Listing((*_assumptions(material), *sizing_assumptions(material.sizing)))]
    if material.gap is not None:
        blocks.append(Paragraph((f"Of what is not modelled: {_lower(gap_sentence(material.gap))}",)))
    return Chapter("validity", "Limits of validity", tuple(blocks))


def _extrapolation(material: Material) -> list[Block]:
    words = Paragraph(
        (
            "The extrapolation index x is the distance from a test in units of the Scruton number that its relaxation "
            "rate "
            f"is worth. Laws of aerodynamic damping agree to 2 % in amplitude for |x| < 0.2; beyond {X_TRUSTED:g} the "
            f"number "
            "rests on the laws that the model card lists.",
        )
    )  # fmt: skip
    tests = list(material.design[0].extrapolation_indices) if material.design else []
    rows = tuple(
        (
            stated(one.scruton_number), *(number(one.extrapolation_indices[test], 2) for test in tests),
            "yes" if abs(one.extrapolation_index) <= X_TRUSTED else "NO",
        )
        for one in material.design
    )  # fmt: skip
    if len(tests) > 6:  # a column a test would not fit the page
        tests = ["nearest test"]
        rows = tuple(
            (
                stated(one.scruton_number),
                number(one.extrapolation_index, 2),
                "yes" if abs(one.extrapolation_index) <= X_TRUSTED else "NO",
            )
            for one in material.design
        )
    header = ("design Sc", *(f"from {test}" for test in tests), "within reach")
    return [words, Table("extrapolation", "Extrapolation index x of every design", header, rows)]


def _assumptions(material: Material) -> tuple[str, ...]:
    fit = material.fit
    found = [
        "The section vibrates in one degree of freedom, and its amplitude changes little within one cycle.",
        "The peak tests share one Griffin curve up to a discrepancy that is inferred"
        + (f": {discrepancy(fit)}." if discrepancy(fit) else "."),
        "The aerodynamic force is that of the model: Reynolds number, turbulence and details of the section are those "
        "of "
        "the tunnel.",
        "A new setting is at the wind speed of the largest amplitude, and exchangeable with the settings tested.",
    ]  # fmt: skip
    if len(fit.ringdowns) < len(fit.campaign.rigs):
        found.append("Structural damping is as stated, with the uncertainty that the model card gives it.")
    return tuple(found)


def _lower(text: str) -> str:
    return text[0].lower() + text[1:]
