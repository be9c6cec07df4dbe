"""`scruton fit`: posterior.nc, fit.json and their tables for the terminal."""

import shlex
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.options import check_effect_name
from scruton.app.run import Outcome, Run, default_folder
from scruton.campaign import Campaign, load_campaign, tests_named, tests_used
from scruton.progress import Progress
from scruton.report.render_text import render_text
from scruton.report.summaries import fit_summary
from scruton.terminal import DONE, NOT_TRUSTED

if TYPE_CHECKING:
    from scruton.infer.cards import ModelCard
    from scruton.infer.results import Fit

# Files and folders that say that a fit or its report lies in a folder, whoever wrote them.
RESULTS = ("posterior.nc", "fit.json", "report.html", "report.pdf", "report.json", "gap.json", "sizing.json")


def run(arguments: Namespace) -> Outcome:
    """Fit a campaign into a folder.

    With --effect (its name, or "auto" for what diagnosis finds) the predictions carry that unmodelled effect.

    Raises
    ------
    InputError
        For bad input; nothing is written then.
    """
    from scruton.infer.store import write_fit

    task = FitTask.asked(arguments)
    with task.claim(arguments) as work:
        fit = task.fit(work)
        paths = work.published(write_fit(fit, work.new))
    lines = [f"{name:10} {path}" for name, path in zip(("posterior:", "summary:"), paths, strict=True)]
    return Outcome(render_text(fit_summary(fit)), lines, fit.flags, DONE if fit.converged else NOT_TRUSTED)


@dataclass(frozen=True, eq=False)
class FitTask:
    """A fit that was asked for: its inputs are read and checked, and nothing is done yet.

    Attributes
    ----------
    campaign : Campaign
        Restricted to the tests in `names`, where there are any.
    card : ModelCard
    names : tuple of str
    seed : int
    effect : str or None
    folder : Path
        For the results.
    """

    campaign: Campaign
    card: "ModelCard"
    names: tuple[str, ...]
    seed: int
    effect: str | None
    folder: Path

    @classmethod
    def of(
        cls,
        path: Path,
        out: Path | None,
        *,
        model: str,
        tests: str | Sequence[str] | None = None,
        seed: int,
        effect: str | None = None,
    ) -> "FitTask":
        """Read the campaign and the card; InputError for bad input."""
        from scruton.infer.cards import load_card

        check_effect_name(effect)
        campaign = load_campaign(path)
        names = tests_named(campaign, tests)
        if names:
            campaign = tests_used(campaign, names)
        return cls(campaign, load_card(model), names, seed, effect, out if out is not None else default_folder(path))

    @classmethod
    def asked(cls, arguments: Namespace) -> "FitTask":
        """The fit that the command line asks for."""
        return cls.of(
            arguments.campaign, arguments.out, model=arguments.model, tests=arguments.tests, seed=arguments.seed,
            effect=arguments.effect,
        )  # fmt: skip

    def claim(
        self,
        arguments: Namespace,
        *,
        sha256: Mapping[str, str] | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> Run:
        """The run, to be entered; `sha256` and `settings` are those beside the fit's own."""
        return Run(
            self.folder,
            "fit",
            arguments,
            sha256={**(self.campaign.sha256 or {}), **(sha256 or {})},
            card=self.card,
            settings={"tests": list(self.names), "effect": self.effect, **(settings or {})},
            results=RESULTS,
        )

    def fit(self, work: Run) -> "Fit":
        """Fit, with checkpoints in the folder."""
        from scruton.infer.fit import fit_campaign

        fit = fit_campaign(
            self.campaign,
            self.card,
            seed=self.seed,
            checkpoints=work.checkpoints,
            report=work.bar,
            command=f"fit --seed {self.seed} --model {self.card.name}"
            + "".join(f" --test {shlex.quote(name)}" for name in self.names)
            + (f" --effect {self.effect}" if self.effect else ""),
            only=self.names,
        )
        if self.effect is not None:
            _carry_effect(fit, self.effect, self.card, self.seed, work.bar)
        work.bar.end()
        return fit


def _carry_effect(fit: "Fit", effect: str, card: "ModelCard", seed: int, progress: Progress) -> None:
    """Diagnose the campaign and put the effect into the tree of the fit."""
    from scruton.gap.bands import attach
    from scruton.gap.data import load_gap
    from scruton.gap.diagnosis import diagnose_data

    data = load_gap(fit.campaign, card)
    diagnosis = diagnose_data(
        data, fit.campaign, prior=card.effect_weights, prior_none=card.prior_none, progress=progress
    )
    name = attach(fit.tree, diagnosis, effect, seed)
    fit.summary["effect"] = {
        "asked": effect, "used": name, "also": list(diagnosis.found[1:]) if name == diagnosis.verdict else [],
        "probability": diagnosis.probability.get(name, 0.0),
    }  # fmt: skip
