"""How far the numbers reach, stated plainly."""

from collections.abc import Iterator

from scruton.griffin.thresholds import X_TRUSTED
from scruton.report.chapters.gap import gap_sentence
from scruton.report.chapters.material import Material, chapter
from scruton.report.chapters.posterior import discrepancy
from scruton.report.chapters.sizing import sizing_assumptions
from scruton.report.document import ALARM, CAUTION, Block, Callout, Heading, Listing, Table, paragraph
from scruton.report.thresholds import TESTS_ABREAST
from scruton.report.wording import number, stated


@chapter("validity", "Limits of validity")
def validity_chapter(material: Material) -> Iterator[Block]:
    """Extrapolation, flags and assumptions."""
    if not material.in_wind:
        return
    flags, cautions = tuple(material.fit.flags), tuple(material.cautions())
    if flags:
        yield Callout(ALARM, "Flags of the fit", flags)
    if cautions:
        yield Callout(CAUTION, "Flags of the predictions", cautions)
    if not flags and not cautions:
        yield paragraph("Neither the fit nor the predictions raised a flag.")
    yield Heading("How far the design lies from the tests")
    yield paragraph(
        "The extrapolation index x is the distance from a test in units of the Scruton number that its relaxation rate "
        f"is worth. Laws of aerodynamic damping agree to 2 % in amplitude for |x| < 0.2; beyond {X_TRUSTED:g} the "
        "number rests on the laws that the model card lists."
    )
    yield _extrapolation(material)
    yield Heading("What is assumed")
    yield Listing((*_assumptions(material), *sizing_assumptions(material.sizing)))
    if material.gap is not None:
        said = gap_sentence(material.gap)
        yield paragraph(f"Of what is not modelled: {said[0].lower()}{said[1:]}")


def _extrapolation(material: Material) -> Table:
    tests = list(material.design[0].extrapolation_indices) if material.design else []
    apart = len(tests) <= TESTS_ABREAST  # more columns would not fit the page
    rows = tuple(
        (
            stated(one.scruton_number),
            *(number(one.extrapolation_indices[test], 2) for test in (tests if apart else ())),
            *(() if apart else (number(one.extrapolation_index, 2),)),
            "yes" if abs(one.extrapolation_index) <= X_TRUSTED else "NO",
        )
        for one in material.design
    )
    header = ("design Sc", *(f"from {test}" for test in (tests if apart else ["nearest test"])), "within reach")
    return Table("extrapolation", "Extrapolation index x of every design", header, rows)


def _assumptions(material: Material) -> tuple[str, ...]:
    fit = material.fit
    found = [
        "The section vibrates in one degree of freedom, and its amplitude changes little within one cycle.",
        "The peak tests share one Griffin curve up to a discrepancy that is inferred"
        + (f": {discrepancy(fit)}." if discrepancy(fit) else "."),
        "The aerodynamic force is that of the model: Reynolds number, turbulence and details of the section are those "
        "of the tunnel.",
        "A new setting is at the wind speed of the largest amplitude, and exchangeable with the settings tested.",
    ]  # fmt: skip
    if len(fit.ringdowns) < len(fit.campaign.rigs):
        found.append("Structural damping is as stated, with the uncertainty that the model card gives it.")
    return tuple(found)
