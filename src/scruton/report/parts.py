"""What other analyses bring to the report, each made by a function that may run in another process."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign import load_campaign
from scruton.errors import InputError
from scruton.griffin.curves import law_curves
from scruton.griffin.posterior import chosen_rig, motion_of, rig_mass_damping_draws
from scruton.griffin.validate import Whole, predict_left_out
from scruton.infer.cards import load_card
from scruton.infer.store import read_tree
from scruton.report.chapters.gap_words import gap_sentence
from scruton.report.charts import damper_chart, risk_chart
from scruton.report.conventions import conventions
from scruton.report.document import Picture
from scruton.report.failures import Failure, Failures
from scruton.report.figures import FigureWithCaption, figures_from
from scruton.report.figures.registry import contents
from scruton.report.figures.sizing import modes
from scruton.report.needs import governing
from scruton.report.wording import limit_text
from scruton.sizing.bridge import Bridge, load_bridge
from scruton.sizing.limits import limit
from scruton.sizing.model import ModeModel, stated_scruton_number, unit_cube
from scruton.sizing.size import sized

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.results import Fit
    from scruton.infer.sampling import Known


@dataclass(frozen=True, eq=False)
class Part:
    """An analysis in the report: content of its JSON file, its pictures, and what of those is missing.

    `charts` holds what interactive pictures are drawn from, by the name of the picture, be that there or not.  Of a
    bridge that was sized in both motions, `other` is the content of the other one's sizing.json; names of its pictures
    end with its motion.
    """

    content: Mapping[str, Any]
    pictures: Sequence[Picture] = ()
    failures: Sequence[Failure] = ()
    charts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    other: Mapping[str, Any] | None = None


def drawn(figure: FigureWithCaption) -> Picture:
    """A figure with the contents of its files."""
    svg, png = contents(figure, ("svg", "png"))
    return Picture(figure.name, figure.caption, figure.alt, svg, png)


def gap_part(campaign: Path, model: str = "default", design_sc: Sequence[float] = ()) -> Part:
    """Diagnose a campaign on disk, for Scruton numbers of a bridge (InputError where it cannot be read or is empty)."""
    # heavy, and mostly for another process: what is refused at once does not wait for it
    from scruton.gap.diagnose import examine
    from scruton.report.figures.gap import gap_figure

    diagnosis, content, findings, curves = examine(campaign, load_card(model), workers=1, design_sc=design_sc)
    failures = Failures()

    def pictures() -> list[Picture]:
        groups, alt = content["indistinguishable"], gap_sentence(content)
        return [drawn(gap_figure(diagnosis, findings, curves, groups=groups, alt=alt))]

    shown = failures.attempt("gap", "The figure of the gap", pictures, [])
    return Part(json.loads(json.dumps(content)), shown, failures.found)


def stated_scruton_numbers(bridge: Bridge) -> list[float]:
    """Scruton numbers of a bridge's modes that state a mass, each once: those of others need the fit."""
    stated = (stated_scruton_number(bridge, mode) for mode in bridge.modes)
    return sorted({number for number in stated if number is not None})


def whole_of(fit: "Fit", known: "Known | None" = None) -> Whole:
    """What the parts of a fitted campaign are fitted by; `known` is what the fit drew."""
    from scruton.infer.fit import known_of
    from scruton.infer.sampling import Known

    return Whole(
        fit.campaign, fit.card, fit.seed, fit.summary["tests"], fit.converged, known_of(fit.campaign, known or Known())
    )


def crossed_part(whole: Whole) -> dict[str, Any]:
    """Each peak test of a campaign predicted from the others, as `Prediction.to_json` has it; empty with one rig."""
    if len({test.rig for test in whole.campaign.tests}) < 2:
        return {}
    return {case.test: case.prediction.to_json() for case in predict_left_out(whole, singles=False)}


def check_bridge(campaign: Path, bridge: Path, limits: Sequence[str] = ()) -> Bridge:
    """Read a bridge: InputError for whatever is wrong with it, its limits or the campaign, before any work is done."""
    structure = load_bridge(bridge, load_campaign(campaign).section.motion)
    if not [*structure.limits, *map(limit, limits)]:
        raise InputError(bridge, "limits", "no limit", 'at least one, such as limits = ["jtg"]')
    return structure


def scruton_numbers_of(tree: "xr.DataTree", bridge: Path) -> list[float]:
    """Median Scruton number of every mode of a bridge, each once."""
    structure = load_bridge(bridge, motion_of(tree))
    laws, factor = law_curves(tree), rig_mass_damping_draws(tree, chosen_rig(tree, None))
    u = unit_cube(1 << 12, 0)
    draws = [ModeModel(laws, factor, structure, mode).draws(u) for mode in structure.modes]
    return sorted({float(f"{np.median(draw.scruton_number(0.0)):.4g}") for draw in draws})


@dataclass(frozen=True)
class Asked:
    """The file of a bridge that is to be sized, limits beside its own, and the folder of the other motion's fit."""

    bridge: Path
    limits: Sequence[str] = ()
    other: Path | None = None


def sizing_part(folder: Path, asked: Asked, seed: int = 0, fit: "Fit | None" = None) -> Part:
    """Size a bridge's damping from the fit in a folder (InputError without a test in wind, or if they do not suit).

    The `fit` is what lies in the folder, where it was read.
    """
    own = read_tree(folder) if fit is None else (fit.tree, fit.summary)
    folders = [folder, *([] if asked.other is None else [asked.other])]
    fits = [own, *map(read_tree, folders[1:])]
    for place, (_, summary) in zip((asked.bridge, asked.other), fits, strict=False):
        if not summary["tests"]:
            raise InputError(str(place), "", "a campaign without tests in wind", "a campaign with at least one test")
    bridges = [load_bridge(asked.bridge, motion_of(tree)) for tree, _ in fits]
    rules, settings = [*map(limit, asked.limits)], {"limits": list(asked.limits)}
    return part_of_sizing(*sized(folders, fits, bridges, rules, asked=settings, seed=seed))


def part_of_sizing(content: Mapping[str, Any], other: Mapping[str, Any] | None = None) -> Part:
    """The content of a sizing.json with its pictures, and that of the other motion where both were sized."""
    part = _part_of(content)
    if other is None:
        return part
    second, ending = _part_of(other), f"_{other['bridge']['motion']}"
    return Part(
        content,
        [*part.pictures, *(replace(picture, name=f"{picture.name}{ending}") for picture in second.pictures)],
        [*part.failures, *second.failures],
        {**part.charts, **{f"{name}{ending}": chart for name, chart in second.charts.items()}},
        other,
    )


def _part_of(content: Mapping[str, Any]) -> Part:
    failures = Failures()

    def charts() -> dict[str, Mapping[str, Any]]:
        found: dict[str, Mapping[str, Any]] = {}
        with conventions(content):
            for ending, mode in modes(content).items():
                what = f"probability of exceeding the limit of {limit_text(governing(mode))}"
                found[f"risk{ending}"] = risk_chart(mode, governing(mode)["curve"], what)
                if tool := damper_chart(mode):
                    found[f"damper{ending}"] = tool
        return found

    def pictures() -> list[Picture]:
        return [drawn(figure) for figure in figures_from("sizing", content)]

    shown = failures.attempt("sizing", "The figures of the sizing", pictures, [])
    answering = failures.attempt("sizing", "The charts of the sizing", charts, {})
    return Part(content, shown, failures.found, answering)
