"""What other analyses bring to the report, each made by a function that may run in another process."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.provenance import provenance
from scruton.report.document import Picture
from scruton.report.failures import Failure, Failures

if TYPE_CHECKING:
    from scruton.griffin import Prediction
    from scruton.infer.results import Fit
    from scruton.report.figures import FigureWithCaption
    from scruton.sizing.bridge import Bridge

KINDS = ("svg", "png")


@dataclass(frozen=True, eq=False)
class Part:
    """An analysis in the report.

    Attributes
    ----------
    content : mapping
        What goes to its JSON file, and what its chapter is written from.
    pictures : sequence of Picture
    charts : mapping
        Interactive charts, as of `scruton.report.charts`, by the name of the picture that each stands for.
    failures : sequence of Failure
        Pictures and charts that are missing.
    """

    content: Mapping[str, Any]
    pictures: Sequence[Picture] = ()
    charts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    failures: Sequence[Failure] = ()


def drawn(figure: "FigureWithCaption") -> Picture:
    """A figure with the contents of its files."""
    from scruton.report.figures.save import contents

    svg, png = contents(figure, KINDS)
    return Picture(figure.name, figure.caption, figure.alt, svg, png)


def gap_part(campaign: Path, model: str = "default", workers: int = 1) -> Part:
    """Diagnose a campaign on disk.

    Raises
    ------
    InputError
        If the campaign cannot be read or holds no record.
    """
    import json

    from scruton.gap.run import examine
    from scruton.infer.cards import load_card
    from scruton.report.chapters.gap import gap_sentence
    from scruton.report.figures.gap import gap_figure

    diagnosis, content, findings, curves = examine(campaign, load_card(model), workers=workers)
    failures = Failures()

    def pictures() -> tuple[Picture, ...]:
        return (drawn(gap_figure(diagnosis, findings, curves, alt=gap_sentence(content))),)

    shown = failures.attempt("gap", "The figure of the gap", pictures, ())
    return Part(json.loads(json.dumps(content)), shown, failures=failures.found)


def crossed_part(
    campaign: Path, model: str = "default", tests: Sequence[str] = (), seed: int = 0
) -> "dict[str, Prediction]":
    """Each peak test of a campaign on disk predicted from the others; empty where there are none.

    Raises
    ------
    InputError
        If the campaign cannot be read.
    """
    from scruton.campaign import load_campaign, tests_used
    from scruton.griffin.validate import validate
    from scruton.infer.cards import load_card

    loaded = load_campaign(campaign)
    if tests:
        loaded = tests_used(loaded, tests)
    if len({one.rig for one in loaded.tests}) < 2:
        return {}
    return {one.test: one.prediction for one in validate(loaded, load_card(model), seed=seed, singles=False)}


def check_bridge(campaign: Path, bridge: Path, limits: Sequence[str] = ()) -> "Bridge":
    """Read a bridge, to refuse what is wrong with it before any work is done.

    Raises
    ------
    InputError
        Whatever is wrong with the bridge, its limits or the campaign.
    """
    from scruton.campaign import load_campaign
    from scruton.errors import InputError
    from scruton.sizing.bridge import load_bridge
    from scruton.sizing.limits import limit

    found = load_bridge(bridge, load_campaign(campaign).section.motion)
    if not [*found.limits, *map(limit, limits)]:
        raise InputError(bridge, "limits", "no limit", 'at least one, such as limits = ["jtg"]')
    return found


def scruton_numbers_of(fit: "Fit", bridge: Path) -> list[float]:
    """Median Scruton number of every mode of a bridge, each once."""
    from scruton.griffin.curves import law_curves
    from scruton.griffin.posterior import chosen_rig, rig_mass_damping_draws
    from scruton.sizing.bridge import load_bridge
    from scruton.sizing.model import ModeModel, unit_cube

    stands = load_bridge(bridge, fit.campaign.section.motion)
    laws, factor = law_curves(fit.tree), rig_mass_damping_draws(fit.tree, chosen_rig(fit.tree, None))
    u = unit_cube(1 << 12, 0)
    draws = [ModeModel(laws, factor, stands, mode).draws(u) for mode in stands.modes]
    return sorted({float(f"{np.median(one.scruton_number(0.0)):.4g}") for one in draws})


def sizing_origin(
    folder: Path, summary: Mapping[str, Any], bridge: "Bridge", *, seed: int, settings: Mapping[str, Any]
) -> dict[str, Any]:
    """What a sizing was made from: the fit in a folder with all that it was made from, and the bridge."""
    from scruton.infer.store import provenance_of

    fit, fitted = provenance_of(folder, summary), summary["provenance"]
    return {
        **provenance(
            "size", seed=seed, sha256={**fitted["sha256"], **fit, **bridge.sha256}, settings=settings,
            card={key: fitted["card"][key] for key in ("name", "sha256")},
        ),
        "fit_sha256": fit, "bridge_sha256": dict(bridge.sha256), "limits": list(settings["limits"]),
    }  # fmt: skip


def sizing_part(folder: Path, bridge: Path, limits: Sequence[str] = (), seed: int = 0) -> Part:
    """Size the damping of a bridge from the fit in a folder.

    Raises
    ------
    InputError
        If the fit holds no test in wind, or the bridge does not suit it.
    """
    from scruton.errors import InputError
    from scruton.griffin.posterior import motion_of
    from scruton.infer.store import read_tree
    from scruton.report.charts import risk_chart
    from scruton.report.figures import figures_from
    from scruton.report.figures.sizing import governing, modes
    from scruton.sizing.bridge import load_bridge
    from scruton.sizing.limits import limit
    from scruton.sizing.run import size

    tree, summary = read_tree(folder)
    if not summary["tests"]:
        raise InputError(bridge, "", "a campaign without tests in wind", "a campaign with at least one test")
    stands = load_bridge(bridge, motion_of(tree))
    content = size(tree, stands, [limit(one) for one in limits], seed=seed).to_json()
    content["provenance"] = sizing_origin(folder, summary, stands, seed=seed, settings={"limits": list(limits)})
    failures = Failures()

    def charts() -> dict[str, Mapping[str, Any]]:
        return {
            f"risk{ending}": risk_chart(mode, decisive["curve"], f"probability of exceeding {decisive['rule']}")
            for ending, mode in modes(content).items()
            for decisive in [governing(mode)]
        }

    def pictures() -> tuple[Picture, ...]:
        return tuple(drawn(one) for one in figures_from("sizing", content))

    shown = failures.attempt("sizing", "The figures of the sizing", pictures, ())
    answering = failures.attempt("sizing", "The charts of the sizing", charts, {})
    return Part(content, shown, answering, failures.found)
