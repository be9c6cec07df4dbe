"""`scruton validate`, `scruton diagnose` and `scruton simulate`: what is made of, or for, a whole campaign."""

from argparse import Namespace

import numpy as np

from scruton.app.given import asked_campaign
from scruton.app.run import Outcome, Run, default_folder, workers_of
from scruton.campaign import load_campaign, tests_named
from scruton.cells import safe_frame
from scruton.documents import as_json, write_text
from scruton.report.conventions import conventions
from scruton.report.render_text import render_text
from scruton.terminal import DONE, NOT_TRUSTED, line_width

JSON, CSV = "validation.json", "validation.csv"
NOMINAL = (0.50, 0.90, 0.95)


def validate(arguments: Namespace) -> Outcome:
    """Predict every rig's stable amplitude without its own records; not trusted where a fit has not converged.

    InputError for bad input, or a folder that holds a validation already; nothing is written then.
    """
    import pandas as pd

    from scruton.griffin.validate import fits_needed, validate
    from scruton.infer.cards import load_card
    from scruton.report.figures import save
    from scruton.report.figures.predictions import validation_figure
    from scruton.report.summaries import validation_summary

    campaign, card = load_campaign(arguments.campaign), load_card(arguments.model)
    unit, folder = campaign.section.amplitude_unit, arguments.out or default_folder(arguments.campaign) / "validation"
    tests, singles = tests_named(campaign, arguments.tests), not arguments.no_singles
    settings, workers = {"tests": list(tests), "singles": singles}, workers_of(arguments)
    claim = Run(
        folder, "validate", arguments, sha256=campaign.sha256 or {}, card=card, settings=settings, results=(JSON,)
    )
    with claim as work:
        work.bar.say(f"{fits_needed(campaign, tests, singles=singles)} fits, the first of all tests")
        validations = validate(
            campaign, card, tests=tests, seed=arguments.seed, progress=work.bar, singles=singles,
            checkpoints=work.checkpoints, workers=workers,
        )  # fmt: skip
        # share of what was found that lies inside the intervals
        coverage = {f"{p:.2f}": float(np.mean([case.inside(p) for case in validations])) for p in NOMINAL}
        entries, rows = [], []
        for case in validations:
            known = {"found": case.amplitude, "measured": case.measured, "error": case.error, "factor": case.factor}
            inside = {f"{p:.2f}": bool(case.inside(p)) for p in NOMINAL}
            entries.append(
                {"test": case.test, "from": case.source, "prediction": case.prediction.to_json(), **known, "z": case.z,
                 "log_score": case.log_score, "inside": inside, "trusted": case.trusted}
            )  # fmt: skip
            low, high = case.prediction.interval(0.90)
            rows.append(
                {"test": case.test, "from": ", ".join(case.source), "Sc [-]": case.prediction.scruton_number,
                 "unit": case.prediction.unit, "median": case.prediction.median, "q05": low, "q95": high,
                 "median MC error": case.prediction.error(0.5), "q05 MC error": case.prediction.error(0.05),
                 "q95 MC error": case.prediction.error(0.95), **known,
                 "z": case.z, "log score": case.log_score,
                 "extrapolation index x": case.prediction.extrapolation_index,
                 "peak tests that cover the amplitude": case.prediction.covered_by, "inside 90 %": case.inside()}
            )  # fmt: skip
        content = {"format": 1, "title": campaign.title, "unit": unit}
        content |= {"validations": as_json(entries), "coverage": coverage}
        figures = save(validation_figure(validations), work.new, formats=("svg", "png"))
        write_text(work.new / CSV, safe_frame(pd.DataFrame(rows)).to_csv(index=False))
        work.write(JSON, content)
        paths = work.published([work.new / JSON, work.new / CSV, *figures])
    text = render_text(validation_summary(campaign.title, unit, validations, coverage), line_width())
    return Outcome(text, paths, code=DONE if all(case.trusted for case in validations) else NOT_TRUSTED)


def diagnose(arguments: Namespace) -> Outcome:
    """Diagnose a campaign into a folder: gap.json, its text for the terminal and its picture.

    InputError for bad input, or a folder that holds a diagnosis already; nothing is written then.
    """
    from scruton.gap.diagnose import examine
    from scruton.gap.results import RESULT
    from scruton.infer.cards import load_card
    from scruton.report.chapters.gap import gap_summary
    from scruton.report.figures import save
    from scruton.report.figures.gap import gap_figure

    campaign, names = asked_campaign(arguments)
    card, thorough = load_card(arguments.model), arguments.thorough
    folder = arguments.out or default_folder(arguments.campaign) / "gap"
    settings = {"thorough": thorough, "tests": list(names), **({"sc": arguments.sc} if arguments.sc else {})}
    claim = Run(
        folder, "diagnose", arguments, sha256=campaign.sha256 or {}, card=card, settings=settings, results=(RESULT,)
    )
    with claim as work:
        diagnosis, content, findings, curves = examine(
            campaign, card, workers=arguments.jobs, thorough=thorough, design_sc=arguments.sc, progress=work.bar
        )
        drawing = gap_figure(diagnosis, findings, curves, groups=content["indistinguishable"]).figure
        pictures = save(drawing, work.new, "gap", formats=("svg", "png"))
        work.write(RESULT, content)
        paths = work.published([work.new / RESULT, *pictures])
        with conventions(campaign):
            blocks = gap_summary(content, campaign.section.amplitude_unit)
        return Outcome(render_text(blocks, line_width()), paths, content["set_aside"] + content["doubts"])


def simulate(arguments: Namespace) -> Outcome:
    """Write a campaign from the full equation of motion; nothing is written unless all of it can be.

    InputError for a specification that makes no campaign, or a folder that holds one already.
    """
    from scruton.simulate import write_campaign

    folder = write_campaign(arguments.spec, arguments.out, seed=arguments.seed, force=arguments.force)
    return Outcome(paths=[folder])
