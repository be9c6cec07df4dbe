"""`scruton fit`: posterior.nc and fit.json."""

import shlex
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.given import asked_campaign
from scruton.app.run import Outcome, Run, default_folder
from scruton.app.thresholds import (
    COST_EFFECT,
    COST_LAW,
    COST_LAW_LEAST,
    COST_OTHER,
    COST_RIG,
    COST_SPEEDS,
    COST_TEST,
    COST_TRIAL,
)
from scruton.campaign import Campaign
from scruton.campaign.schema import Kind
from scruton.progress import Progress, Stages
from scruton.report.render_text import render_text
from scruton.report.summaries import fit_summary
from scruton.terminal import DONE, NOT_TRUSTED, line_width

if TYPE_CHECKING:
    from scruton.infer.cards import ModelCard
    from scruton.infer.results import Fit
    from scruton.infer.sampling import Known

EFFECT = "effect"  # the stage of progress in which a fit is given one
# Files and folders that say that a fit or its report lies in a folder, whoever wrote them.
RESULTS = ("posterior.nc", "fit.json", "report.html", "report.pdf", "report.json", "gap.json", "sizing.json")


@dataclass(frozen=True, eq=False)
class FitTask:
    """A fit that was asked for: its inputs are read and checked, and nothing is done yet."""

    campaign: Campaign  # restricted to the tests in `names`, where there are any
    card: "ModelCard"
    names: tuple[str, ...]
    seed: int
    effect: str | None
    folder: Path  # for the results

    @classmethod
    def of(cls, asked: Namespace) -> "FitTask":
        """Read the campaign and the card that the command line asks for; InputError for bad input."""
        from scruton.infer.cards import load_card

        campaign, names = asked_campaign(asked)
        folder = asked.out if asked.out is not None else default_folder(asked.campaign)
        return cls(campaign, load_card(asked.model), names, asked.seed, asked.effect, folder)

    def claim(self, arguments: Namespace, sha256: Mapping[str, str] = {}, settings: Mapping[str, Any] = {}) -> Run:
        """The run, to be entered; `sha256` and `settings` are those beside the fit's own."""
        files = {**(self.campaign.sha256 or {}), **sha256}
        all_settings = {"tests": list(self.names), "effect": self.effect, **settings}
        return Run(self.folder, "fit", arguments, sha256=files, card=self.card, settings=all_settings, results=RESULTS)

    def fit(self, work: Run, known: "Known | None" = None) -> "Fit":
        """Fit, with checkpoints in the folder; an effect (or "auto": what diagnosis finds) goes into the tree.

        What is drawn is added to what is `known`.
        """
        from scruton.infer.fit import fit_campaign

        card, effect = self.card, self.effect
        tests = "".join(f" --test {shlex.quote(name)}" for name in self.names)
        command = f"fit --seed {self.seed} --model {card.name}{tests}" + (f" --effect {effect}" if effect else "")
        stages = Stages(work.bar, self.costs(), self._unforeseen)
        fit = fit_campaign(
            self.campaign, card, seed=self.seed, checkpoints=work.checkpoints, report=stages, known=known,
            asked={"command": command, "tests": list(self.names)},
        )  # fmt: skip
        if effect is not None:
            carry(fit, self.campaign, effect, self.seed, stages.within(EFFECT))
        work.bar.end()
        return fit

    def costs(self) -> dict[str, float]:
        """What the stages of the fit are expected to cost, by the names that it tells, in their order."""
        from scruton.infer.fit import LOCK_IN
        from scruton.infer.joint import CAMPAIGN, RIG, TEST
        from scruton.infer.results import TRIAL
        from scruton.infer.speeds import NAME as SPEEDS
        from scruton.infer.thresholds import FEWEST_SPEEDS

        campaign, tests = self.campaign, [test for test in self.campaign.tests if test.records]
        found = {f"{RIG} {rig.name}": COST_RIG for rig in campaign.rigs if rig.records}
        for test in tests:
            found |= {f"{LOCK_IN} {one.name}": COST_TEST for one in test.records if one.kind is Kind.STEADY}
            found[f"{TEST} {test.name}"] = COST_TEST
        # with several settings mostly one law is left, of one setting all are sampled
        laws = [f"n={n:g}" for n in self.card.laws] or ["n free"]
        of_the_laws = laws[:1] if self._settings > 1 else laws
        found |= {f"{CAMPAIGN} {law}": self._unforeseen(CAMPAIGN) for law in of_the_laws if tests}
        transients = (one for test in tests for one in test.records if one.kind is not Kind.STEADY)
        found |= {f"{TRIAL} {one.name}": COST_TRIAL for one in transients}
        speeds = {round(test.wind_speed.mean / campaign.rig(test.rig).frequency.mean, 3) for test in tests}
        if campaign.sweeps or len(speeds) >= FEWEST_SPEEDS:
            found[SPEEDS] = COST_SPEEDS
        return found | ({} if self.effect is None else {EFFECT: COST_EFFECT})

    @property
    def _settings(self) -> int:
        return len({test.rig for test in self.campaign.tests if test.records})

    def _unforeseen(self, stage: str) -> float:
        from scruton.infer.joint import CAMPAIGN

        law = max(COST_LAW * self._settings, COST_LAW_LEAST)
        return law if stage.startswith(CAMPAIGN) else COST_OTHER


def carry(fit: "Fit", campaign: Campaign, effect: str, seed: int, progress: Progress) -> None:
    """Put an effect, or with "auto" what diagnosis finds, into the tree and the summary of a fit: predictions carry it.

    Diagnosed is the campaign as it was read: a fit leaves out what a diagnosis needs, cycles that are clipped.

    InputError for an effect that these records do not support.
    """
    from scruton.gap.bands import attach
    from scruton.gap.data import load_gap
    from scruton.gap.diagnosis import NONE, diagnose_data

    card = fit.card
    data = load_gap(campaign, card)
    diagnosis = diagnose_data(
        data, data.campaign, prior=card.effect_weights, prior_none=card.prior_none,
        progress=progress,
    )  # fmt: skip
    names = attach(fit.tree, diagnosis, effect, seed) or (NONE,)
    fit.summary["effect"] = {
        "asked": effect, "used": names[0], "also": list(names[1:]),
        "probability": diagnosis.also.get(names[0], diagnosis.probability.get(names[0], 0.0)),
    }  # fmt: skip


def run(arguments: Namespace) -> Outcome:
    """Fit a campaign into a folder; InputError for bad input: nothing is written then."""
    from scruton.infer.sampling import Known
    from scruton.infer.store import write_fit
    from scruton.processes import SecondProcess

    task = FitTask.of(arguments)
    with task.claim(arguments) as work, SecondProcess(beside=arguments.jobs > 1) as second:
        fit = task.fit(work, Known(second=second))
        paths = work.published(write_fit(fit, work.new))
    return Outcome(
        render_text(fit_summary(fit), line_width()), paths, fit.flags, DONE if fit.converged else NOT_TRUSTED
    )
