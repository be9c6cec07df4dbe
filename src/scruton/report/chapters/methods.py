"""The appendix: methods in short, to paste, with the equations."""

from collections.abc import Iterator

from scruton.campaign.schema import Motion
from scruton.report import equations as eq
from scruton.report.chapters.material import Material, chapter
from scruton.report.chapters.posterior import discrepancy
from scruton.report.document import Block, Equation, paragraph
from scruton.report.maths import row
from scruton.report.wording import stated


@chapter("methods", "Methods in short", appendix=True)
def methods_chapter(material: Material) -> Iterator[Block]:
    """What was done, in the order in which it was done."""
    fit = material.fit
    if material.in_wind:
        exponent = "free" if fit.card.law_n is None else stated(fit.card.law_n)
        yield paragraph(
            "Each record is demodulated by least squares, one amplitude with its standard error for every cycle. The "
            "amplitude follows, to first order in the small total damping,"
        )
        yield Equation(eq.AMPLITUDE)
        yield paragraph(
            "with ", row("n"), f" = {exponent}, where ", eq.A_STAR, " is the stable amplitude and ", row("lambda"),
            " the rate at which the amplitude relaxes to it. Turbulence pushes the amplitude about, so it is a state "
            "with process noise, and the sensor adds noise on top; the likelihood is that of the state-space filter, "
            "with the initial state integrated out. ", row("n", "=", "-", "1"), " is the law of Gao and others, under "
            "which 1/A is a straight line in the Scruton number; ", row("n", "=", "2"), " is that of Ehsan and "
            "Scanlan. The Scruton number is",
        )  # fmt: skip
        heaving = fit.campaign.section.motion is Motion.HEAVING
        yield Equation(eq.SCRUTON_HEAVING if heaving else eq.SCRUTON_TORSIONAL)
        yield paragraph("and the stable amplitude at another Scruton number ", eq.SC_NEW, " is")
        yield from (Equation(eq.GRIFFIN), Equation(eq.INDEX), Equation(eq.RELAXATION))
        found = discrepancy(fit)
        yield paragraph(
            "The peak tests of all rigs are one model. They share this curve; each test’s amplitude lies off it by a "
            "factor whose logarithm is normal, and so does the relaxation Scruton number at zero damping, ",
            eq.STRENGTH, ", which stands for the strength of the wind."
            + (f" The standard deviations were found to be {found}." if found else "")
            + " A new setting carries the discrepancy of the amplitude. Laws are weighed by evidence (bridge "
            "sampling). The trial function is fitted as its authors have it, and turned into a Griffin curve by",
        )  # fmt: skip
        yield from (Equation(eq.TRIAL), Equation(eq.AERODYNAMIC), Equation(eq.REQUIRED))
        yield paragraph(
            "with its sign kept: negative Scruton numbers have no physical meaning and show the trend only. Beyond the "
            "amplitudes of the record such a curve is extrapolation."
        )
    yield paragraph(
        "Structural damping comes from the amplitudes of the ring-downs, cycle by cycle, with what the laboratory "
        "states as prior; where a damping ratio is stated without uncertainty the model card gives one. Posteriors "
        "are sampled by independent ensembles of walkers, each from its own optimised start."
    )
    yield paragraph(
        "Source of the method: G. Gao, S. Li, J. Hao, B. Fu, S. Yang, L. Zhu, “Griffin plots of vortex-induced "
        "vibrations: revealing self-similarity for quick estimation from transient displacement responses”. "
        "The same text in LaTeX: tables/methods.tex.",
        role="note",
    )
