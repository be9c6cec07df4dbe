"""`scruton size`: of one fit, or with --other heaving and torsion of one bridge."""

from argparse import Namespace
from pathlib import Path

from scruton.app import predict
from scruton.app.run import Outcome, Run
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL
from scruton.terminal import DONE, NOT_TRUSTED, line_width


def size(arguments: Namespace) -> Outcome:
    """Size the damping of one fit, or with --other of both: that one's sizing.json in a folder of its motion's name.

    InputError as of `scruton.app.predict.size`.
    """
    if arguments.other is None:
        return predict.size(arguments)
    from scruton.infer.store import provenance_of
    from scruton.report.chapters.sizing import sizing_summary
    from scruton.report.chapters.together import as_fraction, both_blocks
    from scruton.sizing.both import check_other, sized_both
    from scruton.sizing.results import RESULT

    check_other(arguments.other, arguments.bridge, "command line", "--")
    folder, rules, asked = predict.asked_of(arguments)
    folders = arguments.results, arguments.other
    fits = [predict.read_fit(results, arguments.effect, "a fit of at least one test") for results in folders]
    bridges = [predict.bridge_of(tree, arguments) for tree, _ in fits]
    settings = predict.settings_of(arguments)
    inputs = dict(bridges[0].sha256)
    for bridge, results, (_, summary) in zip(bridges, folders, fits, strict=True):
        made = provenance_of(results, summary)
        inputs |= {f"{bridge.motion.value}: {name}": digest for name, digest in made.items()}
    with Run(folder, "size", arguments, sha256=inputs, settings=settings, results=(RESULT,)) as work:
        contents = sized_both(
            folders, fits, bridges, rules, asked=settings,
            rig=arguments.rig, law_n=arguments.law, seed=arguments.seed, progress=work.bar, offers=asked,
        )  # fmt: skip
        written: list[Path] = []
        for content, part in zip(contents, ("", bridges[1].motion.value), strict=True):
            written += predict.write_sizing(work, content, part)
        paths = work.published(written)
    told = [*map(sizing_summary, contents), both_blocks(contents[0], "", as_fraction, TERMINAL)]
    text = "\n\n".join(render_text(blocks, line_width()) for blocks in told)
    untrusted = any(content["unconverged"] for content in contents)
    return Outcome(text, paths, code=NOT_TRUSTED if untrusted else DONE)
