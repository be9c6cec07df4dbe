"""`scruton validate`: every rig's stable amplitude predicted without its own records, as a table and a picture."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.app.run import Outcome, Run, default_folder
from scruton.campaign import load_campaign
from scruton.cells import safe_frame
from scruton.documents import as_json, write_text
from scruton.report.render_text import render_text
from scruton.report.summaries import validation_summary
from scruton.terminal import DONE, NOT_TRUSTED

if TYPE_CHECKING:
    from scruton.griffin.validate import Validation

JSON, CSV = "validation.json", "validation.csv"
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
    from scruton.report.figures import save
    from scruton.report.figures.predictions import validation_figure

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
        figures = save(validation_figure(found), work.new, formats=("svg", "png"))
        _write_csv(work.new / CSV, found)
        work.write(JSON, content)
        paths = work.published([work.new / JSON, work.new / CSV, *figures])
    trusted = all(one.trusted for one in found)
    summary = validation_summary(campaign.title, campaign.section.amplitude_unit, found, coverage(found))
    return Outcome(render_text(summary), paths, code=DONE if trusted else NOT_TRUSTED)


def coverage(found: Sequence["Validation"]) -> dict[str, float]:
    """Share of what was found that lies inside the intervals of 50, 90 and 95 %."""
    return {f"{p:.2f}": float(np.mean([one.inside(p) for one in found])) for p in NOMINAL}


def _entry(one: "Validation") -> dict[str, Any]:
    return {
        "test": one.test,
        "from": list(one.source),
        "prediction": one.prediction.to_json(),
        "found": one.amplitude,
        "measured": one.measured,
        "error": as_json(one.error),
        "factor": as_json(one.factor),
        "z": one.z,
        "log_score": as_json(one.log_score),
        "inside": {f"{p:.2f}": bool(one.inside(p)) for p in NOMINAL},
        "trusted": one.trusted,
    }


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
