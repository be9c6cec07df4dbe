"""`scruton validate`: every rig's stable amplitude predicted without its own records, as a table and a picture."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.app.run import Outcome, Run, default_folder
from scruton.app.thresholds import SHARE_SHOWN
from scruton.campaign import Campaign, load_campaign
from scruton.cells import safe_frame
from scruton.documents import write_text
from scruton.report.text import number, table
from scruton.terminal import DONE, NOT_TRUSTED

if TYPE_CHECKING:
    from scruton.griffin.validate import Validation
    from scruton.report.figures.style import FigureWithCaption

JSON, CSV, FIGURE = "validation.json", "validation.csv", "validation"
NOMINAL = (0.50, 0.90, 0.95)


def run(arguments: Namespace) -> Outcome:
    """Validate a campaign into a folder; not trusted where a fit has not converged.

    Raises
    ------
    InputError
        For bad input, or a folder that holds a validation already; nothing is written then.
    """
    from scruton.griffin.validate import validate
    from scruton.infer.cards import load_card
    from scruton.report.figures.save import save

    campaign, card = load_campaign(arguments.campaign), load_card(arguments.model)
    claim = Run(
        arguments.out or default_folder(arguments.campaign) / "validation",
        "validate",
        arguments,
        sha256=campaign.sha256 or {},
        card=card,
        settings={},
        results=(JSON,),
    )
    with claim as work:
        found = validate(campaign, card, seed=arguments.seed, progress=work.bar, checkpoints=work.checkpoints)
        content = {
            "format": 1,
            "title": campaign.title,
            "unit": campaign.section.amplitude_unit,
            "validations": [_entry(one) for one in found],
            "coverage": coverage(found),
        }
        figures = save(validation_figure(campaign, found), work.new, formats=("svg", "png"))
        _write_csv(work.new / CSV, found)
        work.write(JSON, content)
        paths = work.published([work.new / JSON, work.new / CSV, *figures])
    trusted = all(one.trusted for one in found)
    return Outcome(validation_text(campaign, found), paths, code=DONE if trusted else NOT_TRUSTED)


def coverage(found: Sequence["Validation"]) -> dict[str, float]:
    """Share of what was found that lies inside the intervals of 50, 90 and 95 %."""
    return {f"{p:.2f}": float(np.mean([one.inside(p) for one in found])) for p in NOMINAL}


def validation_text(campaign: Campaign, found: Sequence["Validation"]) -> str:
    """Table for the terminal."""
    unit = campaign.section.amplitude_unit
    header = ["test", "from", f"predicted [{unit}]", "90 % interval", "found", "error", "factor", "z", "log score", ""]
    parts = [campaign.title, table(header, [_row(one) for one in found])]
    inside = ", ".join(f"{float(p):.0%}: {share:.0%}" for p, share in coverage(found).items())
    parts.append(
        f"{len(found)} predictions. Inside their intervals of {inside}. Factor: how far the 90 % interval reaches from "
        "its median. Log score: log density of ln(amplitude), larger is better."
    )
    laws = sorted({label for one in found for label, weight in one.prediction.laws.items() if weight > SHARE_SHOWN})
    parts.append(f"Laws used: {', '.join(laws)}.")
    return "\n\n".join(parts)


def validation_figure(campaign: Campaign, found: Sequence["Validation"]) -> "FigureWithCaption":
    """Predicted over found, one line a prediction, with its 50 and 90 % intervals."""
    from scruton.report.figures.style import (
        BLACK,
        GREY,
        LIGHT,
        FigureWithCaption,
        house_style,
        look,
        new_figure,
        shorten,
    )

    tests = list(dict.fromkeys(one.test for one in found))
    with house_style():
        figure = new_figure(24.0 + 7.0 * len(found))
        axes = figure.subplots()
        axes.axvline(1.0, color=GREY, lw=0.8, zorder=1)
        axes.axvspan(1.0 / 1.25, 1.25, color=LIGHT, alpha=0.35, lw=0, zorder=0)
        labels = []
        for row, one in enumerate(found):
            style = look(tests.index(one.test))
            for probability, width in ((0.90, 1.2), (0.50, 3.6)):
                low, high = (bound / one.amplitude for bound in one.prediction.interval(probability))
                axes.plot([max(low, 1e-3), min(high, 1e3)], [row, row], color=style.colour, lw=width, zorder=2)
            axes.plot(
                [one.prediction.median / one.amplitude], [row], marker=style.marker, color=BLACK, ms=4.5, zorder=3
            )
            origin = "all others" if len(one.source) > 1 or len(tests) == 2 else shorten(one.source[0], 22)
            labels.append(f"{shorten(one.test, 22)} from {origin}")
        reach = [one.factor * max(1.0 + one.error, 1.0 / (1.0 + one.error)) for one in found if one.error > -1.0]
        limit = float(np.clip(1.15 * max([1.5, *[r for r in reach if np.isfinite(r)]]), 1.6, 10.0))
        axes.set_xscale("log")
        axes.set_xlim(1.0 / limit, limit)
        ticks = [
            t for t in (0.1, 0.2, 0.33, 0.5, 0.67, 0.8, 1.0, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0) if 1 / limit < t < limit
        ]
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.minorticks_off()
        axes.set_yticks(range(len(labels)), labels)
        axes.set_ylim(len(labels) - 0.4, -0.6)
        axes.set_xlabel("Predicted over found stable amplitude [-]")
        axes.grid(axis="y", visible=False)
    measured = sum(one.measured for one in found)
    return FigureWithCaption(
        figure,
        FIGURE,
        "Stable amplitudes predicted without the records of the test predicted, over what was found: median, 50 % "
        "(thick) and 90 % interval (thin). Shaded: within a factor of 1.25. "
        + (
            "What was found is measured."
            if measured == len(found)
            else "What was not measured is the test's posterior."
        ),
        "; ".join(
            f"{one.test} from {', '.join(one.source)}: {one.error:+.0%}, {'inside' if one.inside() else 'outside'} 90 %"
            for one in found
        ),
    )


def _row(one: "Validation") -> list[str]:
    low, high = one.prediction.interval(0.90)
    return [
        one.test, ", ".join(one.source), number(one.prediction.median), f"{number(low)} .. {number(high)}",
        number(one.amplitude), f"{100 * one.error:+.0f} %", number(one.factor, 3), f"{one.z:+.2f}",
        f"{one.log_score:.2f}", "inside" if one.inside() else "OUTSIDE",
    ]  # fmt: skip


def _entry(one: "Validation") -> dict[str, Any]:
    return {
        "test": one.test,
        "from": list(one.source),
        "prediction": one.prediction.to_json(),
        "found": one.amplitude,
        "measured": one.measured,
        "error": _finite(one.error),
        "factor": _finite(one.factor),
        "z": one.z,
        "log_score": _finite(one.log_score),
        "inside": {f"{p:.2f}": bool(one.inside(p)) for p in NOMINAL},
        "trusted": one.trusted,
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _write_csv(path: Path, found: Sequence["Validation"]) -> None:
    import pandas as pd

    rows = []
    for one in found:
        low, high = one.prediction.interval(0.90)
        rows.append(
            {
                "test": one.test, "from": ", ".join(one.source), "Sc [-]": one.prediction.scruton_number,
                "unit": one.prediction.unit, "median": one.prediction.median, "q05": low, "q95": high,
                "found": one.amplitude, "measured": one.measured, "error": one.error, "factor": one.factor,
                "z": one.z, "log score": one.log_score, "inside 90 %": one.inside(),
            }
        )  # fmt: skip
    write_text(path, safe_frame(pd.DataFrame(rows)).to_csv(index=False))
