"""`scruton diagnose`: gap.json, its text for the terminal and its picture."""

from argparse import Namespace

from scruton.app.run import Outcome, Run, default_folder
from scruton.campaign import load_campaign
from scruton.gap.results import RESULT
from scruton.report.chapters.gap import gap_summary
from scruton.report.render_text import render_text


def run(arguments: Namespace) -> Outcome:
    """Diagnose a campaign into a folder.

    Raises
    ------
    InputError
        For bad input, or a folder that holds a diagnosis already; nothing is written then.
    """
    from scruton.gap.run import examine
    from scruton.infer.cards import load_card
    from scruton.report.figures import save
    from scruton.report.figures.gap import gap_figure

    campaign, card = load_campaign(arguments.campaign), load_card(arguments.model)
    claim = Run(
        arguments.out or default_folder(arguments.campaign) / "gap",
        "diagnose",
        arguments,
        sha256=campaign.sha256 or {},
        card=card,
        settings={"thorough": arguments.thorough},
        results=(RESULT,),
    )
    with claim as work:
        diagnosis, content, findings, curves = examine(
            campaign, card, workers=arguments.workers, thorough=arguments.thorough, progress=work.bar
        )
        pictures = save(gap_figure(diagnosis, findings, curves).figure, work.new, "gap", formats=("svg", "png"))
        work.write(RESULT, content)
        return Outcome(render_text(gap_summary(content)), work.published([work.new / RESULT, *pictures]))
