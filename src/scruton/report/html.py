"""The report as one HTML file that needs nothing else: no network, no scripts, pictures inside."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.campaign.schema import Motion
from scruton.report.page import (
    campaign_tables,
    convergence_table,
    crossed_table,
    damping_table,
    design_table,
    discrepancy,
    in_model_unit,
    law_table,
    posterior_tables,
    ring_down_table,
    test_table,
    trial_table,
)
from scruton.report.wording import estimate, number, percent, stated

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit

TEMPLATES = Path(__file__).parent / "templates"
LARGEST_SVG = 350_000  # bytes; a larger drawing goes in as PNG
LARGEST_REPORT = 4_500_000  # bytes of pictures, before the text


@dataclass(frozen=True)
class Picture:
    """A figure as the page holds it: `uri` is a data URI, empty where it was left out to keep the file small."""

    name: str
    caption: str
    alt: str
    uri: str


def picture(name: str, caption: str, alt: str, paths: Sequence[Path]) -> Picture:
    """Read a saved figure: its drawing, or its PNG where the drawing is large."""
    by_kind = {path.suffix: path for path in paths}
    drawing, pixels = by_kind[".svg"], by_kind[".png"]
    if drawing.stat().st_size <= max(LARGEST_SVG, 0) or drawing.stat().st_size <= pixels.stat().st_size:
        kind, path = "image/svg+xml", drawing
    else:
        kind, path = "image/png", pixels
    return Picture(name, caption, alt, f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}")


def within_size(pictures: Sequence[Picture], limit: int = LARGEST_REPORT) -> list[Picture]:
    """Leave out the pictures that would make the file too large, the last first; the page names their files."""
    kept, total = [], 0
    for one in pictures:
        total += len(one.uri)
        kept.append(one if total <= limit else Picture(one.name, one.caption, one.alt, ""))
    return kept


def render(
    fit: "Fit",
    frames: Mapping[str, "pd.DataFrame"],
    pictures: Sequence[Picture],
    *,
    design: Sequence["Prediction"] = (),
    at_tests: Mapping[str, "Prediction"] | None = None,
    crossed: Mapping[str, "Prediction"] | None = None,
) -> str:
    """Write the report.

    Parameters
    ----------
    fit : Fit
    frames : mapping
        Of `scruton.report.tables.tables`.
    pictures : sequence of Picture
        In the order in which they shall stand; each goes to the section that its name belongs to.
    design : sequence of Prediction
        Predictions at the design Scruton numbers that were asked for.
    at_tests, crossed : mapping
        Predictions by test: for another setting at its Scruton number, and of it from the other peak tests.

    Returns
    -------
    str
        The page. Everything that came from the campaign's files is escaped.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    at_tests, crossed = at_tests or {}, crossed or {}
    section = fit.campaign.section
    cautions = [flag for one in design for flag in one.flags]
    context: dict[str, Any] = {
        "title": fit.campaign.title,
        "source": fit.campaign.source,
        "converged": fit.converged,
        "flags": list(fit.flags),
        "cautions": list(dict.fromkeys(cautions)),
        "heaving": section.motion is Motion.HEAVING,
        "unit": section.amplitude_unit,
        "width": stated(section.width),
        "depth": stated(section.depth),
        "law_n": "free" if fit.card.law_n is None else stated(fit.card.law_n),
        "discrepancy": discrepancy(fit),
        "sampler": fit.card.sampler,
        "answers": answers(fit, design),
        "design_table": design_table(fit, design),
        "test_table": test_table(fit, at_tests),
        "law_table": law_table(fit),
        "crossed_table": crossed_table(fit, crossed),
        "damping_table": damping_table(fit),
        "campaign_tables": campaign_tables(fit, frames),
        "ring_down_table": ring_down_table(fit, frames),
        "posterior_tables": posterior_tables(fit),
        "trial_table": trial_table(fit),
        "convergence_table": convergence_table(fit),
        "sections": by_section(within_size(pictures)),
        "has_tests": bool(fit.summary["tests"]),
        "csv": sorted(frames),
        "provenance": fit.summary["provenance"],
    }
    return environment.get_template("report.html.j2").render(context)


HEADLINE = "griffin"  # the figure that stands in the summary
# Which section a figure belongs to, by the start of its name; what is not listed goes to the last one.
SECTIONS = (
    ("records", ("records",)),
    ("still_air", ("ring_down",)),
    ("damping", ("aerodynamic",)),
    ("griffin", ("griffin", "reciprocal", "laws")),
    ("speed", ("lock_in",)),
    ("stability", ("stability",)),
    ("trial", ("trial",)),
    ("posterior", ("corner", "trace")),
)


def by_section(pictures: Sequence[Picture]) -> dict[str, list[Picture]]:
    """Sort pictures into the sections of the page; every one finds a place."""
    found: dict[str, list[Picture]] = {name: [] for name in ("headline", "other", *(name for name, _ in SECTIONS))}
    for one in pictures:
        place = next((name for name, starts in SECTIONS if one.name.startswith(starts)), "other")
        found["headline" if one.name == HEADLINE else place].append(one)
    return found


def answers(fit: "Fit", design: Sequence["Prediction"]) -> list[str]:
    """Sentences that answer what the report was asked."""
    found = []
    unit = fit.campaign.section.amplitude_unit
    for one in design:
        entry = one.to_json()
        median, interval = estimate(entry["amplitude"])
        found.append(
            f"At the design Scruton number {stated(one.scruton_number)} (structural damping ratio "
            f"{percent(one.damping_ratio)} on rig {one.rig}) the predicted stable amplitude is {median} {unit}, "
            f"90 % interval {interval} {unit}; at the model's scale {in_model_unit(fit, entry['amplitude'])}."
        )
    if found:
        return found
    for test in fit.summary["tests"]:
        if not test["peak"]:
            continue
        median, interval = estimate(test["parameters"]["a_star"])
        sc = number(test["parameters"]["scruton_number"]["median"], 3)
        found.append(
            f"Peak test {test['name']} (Sc = {sc}): the stable amplitude is {median} {unit}, 90 % interval {interval} "
            f"{unit}."
        )
    if found:
        return found
    for rig in fit.summary["rigs"]:
        median, interval = estimate(rig["parameters"]["damping_ratio"], 100.0)
        found.append(f"Rig {rig['name']}: the structural damping ratio is {median} %, 90 % interval {interval} %.")
    return found
