"""How the numbers came about: convergence and calibration, provenance, and methods in short, to paste."""

from collections.abc import Iterator

import numpy as np

from scruton.report import equations as eq
from scruton.report.chapters.inputs import inputs_table
from scruton.report.chapters.material import Material
from scruton.report.chapters.results import within
from scruton.report.conventions import parameter_words
from scruton.report.document import Block, Code, Definitions, Equation, Heading, Table, paragraph
from scruton.report.maths import row
from scruton.report.wording import number, stated

# What feeds the samplers, by the source that the model card names.
_ENVELOPE = {
    "regression": (
        "Each cycle of a record is regressed on sine, cosine, offset and second harmonic: one amplitude with its "
        "standard error. These amplitudes feed the samplers, not Eqs. (2) to (8) of the method’s authors, which are "
        "computed beside them, without any sampling; a model card whose envelope has the source “front-end” feeds the "
        "samplers Eq. (3)."
    ),
    "front-end": (
        "The samplers are fed with the transient amplitude of the method’s authors, Eqs. (2) and (3): its mean square "
        "over each cycle, less what the noise of the sensor adds to it, with a standard error. The model card says so "
        "by the source “front-end” of its envelope; the default is a regression of each cycle."
    ),
}


def convergence_chapter(material: Material) -> Iterator[Block]:
    """Convergence of every posterior, and the campaign's own check of its intervals."""
    fit, sampler = material.fit, material.fit.card.sampler
    if len(fit.convergence):
        verdict = "What numbers rest on converged" if fit.converged else "Not every posterior converged"
        yield paragraph(
            f"{verdict}: wanted were a nested R-hat below {sampler.max_rhat} over {sampler.ensembles} independent "
            f"ensembles, and at least {sampler.min_ess:.0f} effective draws in the bulk and in the tails of every "
            "parameter."
        )
        # the worst parameter of every posterior; all of them are in the CSV file
        rows = []
        for posterior, group in fit.convergence.groupby(level="posterior", sort=False):
            worst = str(group.index.get_level_values("parameter")[int(np.argmax(group["rhat_nested"].fillna(np.inf)))])
            rows.append(
                (
                    str(posterior), "yes" if bool(group["converged"].all()) else "NO",
                    number(float(group["rhat_nested"].max(skipna=False)), 5), parameter_words(worst),
                    *(f"{group[ess].min():.0f}" for ess in ("ess_bulk", "ess_tail")),
                    number(float(group["tau"].max()), 3), *(str(int(group[of].max())) for of in ("steps", "stuck")),
                )
            )  # fmt: skip
        yield Table(
            "convergence",
            "Convergence of every posterior: its worst parameter",
            (
                "posterior",
                "converged",
                "nested R-hat",
                "of",
                "bulk ESS",
                "tail ESS",
                "τ [steps]",
                "steps",
                "stuck walkers",
            ),
            rows,
            numeric=(False, False, True, False, True, True, True, True, True),
            data="convergence",
        )
    else:
        yield paragraph("Nothing had to be sampled: the damping ratios are as stated.")
    if material.tests:
        yield Heading("Calibration")
        yield paragraph(
            "How often the intervals hold the truth is measured on simulated campaigns whose truth is known, by ",
            Code("scruton calibrate"), ".", _own_calibration(material),
        )  # fmt: skip
    yield from material.of("convergence")


def _own_calibration(material: Material) -> str:
    if not material.crossed:
        return " This campaign has one peak test, so it cannot check its own predictions."
    inside = 0
    for test, prediction in material.crossed.items():
        inside += within(prediction["amplitude"]["interval"]["0.90"], material.measured_or_found(test))
    return (
        f" On this campaign itself, {inside} of {len(material.crossed)} peak tests lie inside the 90 % interval that "
        "the others give them."
    )


def provenance_chapter(material: Material) -> Iterator[Block]:
    """Everything that is needed to make the same numbers again: command, seed, versions, digests, the model card."""
    origin = material.fit.summary["provenance"]
    card = origin["card"]
    tables = "tables/NAME.csv (numbers unrounded where there are more digits) and tables/NAME.tex (as shown)"
    yield Definitions(
        (
            ("Command", str(origin["command"] or "not recorded")),
            ("Seed", str(origin["seed"])),
            ("Versions", ", ".join(f"{name} {version}" for name, version in sorted(origin["versions"].items()))),
            ("Tables", tables),
            ("Figures", "figures/NAME.svg and figures/NAME.png"),
            ("All numbers", "report.json"),
        )
    )
    yield inputs_table(material)
    if digests := sorted({**origin["sha256"], **material.bridge_sha256}.items()):
        yield Heading("Files read")
        yield Table("digests", "SHA-256 of every file read", ("file", "SHA-256"), digests, numeric=(False, False))
    yield Heading(f"Model card “{card['name']}”")
    yield paragraph(f"SHA-256 {card['sha256']}", role="note")
    yield Code(str(card["text"]).rstrip("\n"))


def methods_chapter(material: Material) -> Iterator[Block]:
    """What was done, in the order in which it was done."""
    fit = material.fit
    if material.tests:
        exponent = "free" if fit.card.law_n is None else stated(fit.card.law_n)
        yield paragraph(
            f"{_ENVELOPE[fit.card.envelope_source]} The amplitude follows, to first order in the small total damping,"
        )
        yield Equation(eq.AMPLITUDE)
        yield paragraph(
            "with ", row("n"), f" = {exponent}, where ", eq.A_STAR, " is the stable amplitude and ", row("lambda"),
            " the rate at which the amplitude relaxes to it. Turbulence pushes the amplitude about, so it is a state "
            "with process noise; gusts, slower than that, are another; each record’s wind is set a little differently; "
            "and the sensor adds noise on top. The drift may leave the law by a smooth factor of the amplitude, one at "
            "the stable amplitude, as large as the records ask for. The likelihood is that of the state-space filter, "
            "with the initial state, the set-points and the departure integrated out. ",
            row("n", "=", "-", "1"), " is the law of Gao and others, under "
            "which 1/A is a straight line in the Scruton number; ", row("n", "=", "2"), " is that of Ehsan and "
            "Scanlan. The Scruton number is",
        )  # fmt: skip
        yield Equation(eq.SCRUTON_HEAVING if material.heaving else eq.SCRUTON_TORSIONAL)
        yield paragraph("and the stable amplitude at another Scruton number ", eq.SC_NEW, " is")
        yield from (Equation(eq.GRIFFIN), Equation(eq.INDEX), Equation(eq.RELAXATION))
        discrepancy = material.discrepancy()
        yield paragraph(
            "The peak tests of all rigs are one model. They share this curve; each test’s amplitude lies off it by a "
            "factor whose logarithm is normal, and so does the strength of the wind, ", eq.STRENGTH,
            ", which is the relaxation Scruton number, for ", row("n", ">", "0"), " that at zero damping."
            + (f" The standard deviations were found to be {discrepancy}." if discrepancy else "")
            + " A new setting carries the discrepancy of the amplitude, which grows with the distance from the Scruton "
            "numbers and the amplitudes that were tested. Laws are weighed by evidence (bridge sampling), or by what "
            "they say of records and rigs left out where innovations are not white. Where no law holds, a part of the "
            "weight goes by the stable amplitudes of rigs left out; from one rig, a part is shared out evenly. The "
            "trial function is fitted as its authors have it, and turned into a Griffin curve by",
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
    yield Code(bibtex(str(fit.summary["provenance"]["versions"].get("scruton", ""))))


def bibtex(version: str) -> str:
    """The entries by which the paper is cited, and the program in the version that made the numbers."""
    return (
        "% The paper; its text at hand names neither journal nor year: complete them\n"
        "@article{gao-griffin-plots,\n"
        "  title   = {{Griffin} plots of vortex-induced vibrations: revealing self-similarity for quick\n"
        "             estimation from transient displacement responses},\n"
        "  author  = {Gao, Guangzhong and Li, Suhan and Hao, Jianming and Fu, Bo and Yang, Shucheng and Zhu, Ledong}\n"
        "}\n"
        "% The program\n"
        "@software{scruton,\n"
        "  title   = {scruton: {Bayesian} uncertainty quantification for vortex-induced vibration},\n"
        "  author  = {{The scruton authors}},\n"
        f"  version = {{{version}}},\n"
        "  year    = {2026}\n"
        "}"
    )
