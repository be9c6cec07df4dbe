"""Whether the sampling converged, and how well the intervals are calibrated on this campaign."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Code, Heading, Table, paragraph
from scruton.report.wording import number, parameter_name

if TYPE_CHECKING:
    from scruton.infer.results import Fit


@chapter("convergence", "Convergence and calibration")
def convergence_chapter(material: Material) -> Iterator[Block]:
    """Convergence of every posterior, and the campaign's own check of its intervals."""
    fit, sampler = material.fit, material.fit.card.sampler
    if len(fit.convergence):
        verdict = "Every posterior converged" if fit.converged else "Not every posterior converged"
        yield paragraph(
            f"{verdict}: wanted were a nested R-hat below {sampler.max_rhat} over {sampler.ensembles} independent "
            f"ensembles, and at least {sampler.min_ess:.0f} effective draws in the bulk and in the tails of every "
            "parameter."
        )
        yield convergence_table(fit)
    else:
        yield paragraph("Nothing had to be sampled: the damping ratios are as stated.")
    if material.in_wind:
        yield Heading("Calibration")
        yield _calibration(material)
    yield from material.of("convergence")


def _calibration(material: Material) -> Block:
    words = (
        "How often the intervals hold the truth is measured on simulated campaigns whose truth is known, by ",
        Code("scruton calibrate"), ".",
    )  # fmt: skip
    if not material.crossed:
        return paragraph(*words, " This campaign has one peak test, so it cannot check its own predictions.")
    inside = 0
    for test, prediction in material.crossed.items():
        low, high = prediction.interval(0.90)
        inside += low <= material.measured_or_found(test) <= high
    return paragraph(
        *words,
        f" On this campaign itself, {inside} of {len(material.crossed)} peak tests lie inside the 90 % interval that "
        "the others give them.",
    )


def convergence_table(fit: "Fit") -> Table:
    """The worst parameter of every posterior; all of them are in the CSV file."""
    rows = []
    for posterior, group in fit.convergence.groupby(level="posterior", sort=False):
        worst = group.index.get_level_values("parameter")[int(np.argmax(group["rhat_nested"].fillna(np.inf)))]
        rows.append(
            (
                str(posterior), "yes" if bool(group["converged"].all()) else "NO",
                number(float(group["rhat_nested"].max(skipna=False)), 5), parameter_name(str(worst)),
                f"{group['ess_bulk'].min():.0f}", f"{group['ess_tail'].min():.0f}",
                number(float(group["tau"].max()), 3), str(int(group["steps"].max())), str(int(group["stuck"].max())),
            )
        )  # fmt: skip
    return Table(
        "convergence",
        "Convergence of every posterior: its worst parameter",
        (
            "posterior", "converged", "nested R-hat", "of", "bulk ESS", "tail ESS", "τ [steps]", "steps",
            "stuck walkers",
        ),
        tuple(rows),
        numeric=(False, False, True, False, True, True, True, True, True),
        data="convergence",
    )  # fmt: skip
