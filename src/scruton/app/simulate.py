"""`scruton simulate`: a synthetic campaign on disk."""

from argparse import Namespace

from scruton.app.run import Outcome
from scruton.simulate import write_campaign


def run(arguments: Namespace) -> Outcome:
    """Write a campaign from the full equation of motion; nothing is written unless all of it can be.

    Raises
    ------
    InputError
        For a specification that makes no campaign, or a folder that holds one already.
    """
    folder = write_campaign(arguments.spec, arguments.out, seed=arguments.seed, force=arguments.force)
    return Outcome(lines=[f"campaign: {folder}"])
