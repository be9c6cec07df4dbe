"""The whole calibration: regimes, processes, resumption, and what comes out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate import store
from scruton.calibrate.coverage import (
    Cell,
    LawCheck,
    Pooled,
    Ranks,
    Uniformity,
    cells,
    law_check,
    pooled,
    uniformity,
)
from scruton.calibrate.identifiability import Identifiability, identifiability
from scruton.calibrate.one import run_one
from scruton.calibrate.regimes import Regime, chosen
from scruton.errors import InputError
from scruton.infer.cards import ModelCard, load_card
from scruton.processes import completed
from scruton.progress import Progress
from scruton.provenance import versions


@dataclass(frozen=True, eq=False)
class CalibrationResult:
    """What a calibration shows.

    Attributes
    ----------
    folder : Path
    settings : mapping
        Seed, model card, versions.
    regimes : tuple of Regime
    scores : mapping
        Regime to quantity to the fields of `scruton.calibrate.quantities.Score`, (campaigns,) each, in their order.
    cells, pooled, uniformity, identifiability, laws
        See `scruton.calibrate.coverage` and `scruton.calibrate.identifiability`.
    failed : mapping
        Regime to the reasons of campaigns that could not be fitted.
    unconverged : mapping
        Regime to the number of campaigns whose sampling did not converge; they count in all tables.
    """

    folder: Path
    settings: Mapping[str, Any]
    regimes: tuple[Regime, ...]
    scores: Mapping[str, Mapping[str, Mapping[str, FloatArray]]]
    cells: tuple[Cell, ...]
    pooled: tuple[Pooled, ...]
    uniformity: tuple[Uniformity, ...]
    identifiability: tuple[Identifiability, ...]
    laws: tuple[LawCheck, ...]
    failed: Mapping[str, tuple[str, ...]]
    unconverged: Mapping[str, int]

    @property
    def ranks(self) -> Ranks:
        """Ranks of the truths."""
        return _ranks(self.scores)

    @property
    def calibrated(self) -> bool:
        """Whether no cell and no set of ranks lies beyond four standard errors, and no campaign failed."""
        beyond = [one.beyond for one in self.cells] + [one.beyond for one in self.uniformity]
        return not any(beyond) and not any(self.failed.values())


def run_calibration(
    out: Path,
    *,
    regimes: Sequence[str] | None = None,
    campaigns: int = 500,
    seed: int = 0,
    jobs: int = 1,
    force: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
    model: str = "default",
) -> CalibrationResult:
    """Simulate and fit campaigns whose truths come from the prior, and see how often the intervals hold them.

    Parameters
    ----------
    out : Path
        Folder for the results; every campaign is kept as soon as it is done.
    regimes : sequence of str, optional
        Some of `REGIMES`; all by default.
    campaigns : int
        In every regime.
    seed : int
        The one source of randomness; results do not depend on `jobs`.
    jobs : int
        Processes.
    force, resume : bool
        Replace the results that lie in the folder, or go on with them.
    progress : callable, optional
        Told the regime, and the fraction of its campaigns that is done.
    model : str
        Model card: a shipped name or a TOML file. A regime replaces some of its priors; see `Regime.card`.

    Raises
    ------
    InputError
        For unknown regimes, a card that cannot be read, or a folder that holds results.
    """
    if campaigns < 2:
        raise InputError("calibration", "campaigns", str(campaigns), "at least 2")
    if jobs < 1:
        raise InputError("calibration", "jobs", str(jobs), "at least 1")
    wanted, base = chosen(regimes), load_card(model)
    settings = _settings(seed, base)
    with store.workspace(out, settings, force=force, resume=resume) as work:
        store.begin(work, settings)
        design = tuple(row for one in wanted if not one.weighs_laws for row in identifiability(one, one.card(base)))
        done = {one.name: store.load(work.new, one.name) for one in wanted}
        # Campaign by campaign through all regimes, so that a run that is stopped early tells something of each.
        tasks = [(one.name, i) for i in range(campaigns) for one in wanted if i not in done[one.name]]
        for record in completed(run_one, [(*task, seed, base) for task in tasks], jobs):
            store.append(work.new, record)
            mine = done[record["regime"]]
            mine[record["index"]] = record
            if progress:
                progress(record["regime"], len(mine) / campaigns)
        for mine in done.values():
            store.put_in_order(work.new, mine)
        kept = {name: [mine[i] for i in range(campaigns)] for name, mine in done.items()}
        result = summarise(out, settings, wanted, kept, design)
        from scruton.calibrate.tables import write_tables

        write_tables(result, work.new)
        work.publish()
    return result


def summarise(
    folder: Path,
    settings: Mapping[str, Any],
    regimes: tuple[Regime, ...],
    records: Mapping[str, Sequence[Mapping[str, Any]]],
    design: tuple[Identifiability, ...],
) -> CalibrationResult:
    """Turn the campaigns' records into coverage, ranks and law checks."""
    good = {name: [one for one in mine if "failed" not in one] for name, mine in records.items()}
    scores = {one.name: _columns(good[one.name]) for one in regimes if not one.weighs_laws}
    ranks = _ranks(scores)
    left_out = {(row.regime, row.quantity) for row in design if row.left_out}
    return CalibrationResult(
        folder, settings, regimes, scores, cells(ranks, left_out), pooled(ranks, left_out), uniformity(ranks, left_out),
        design,
        tuple(law_check(one.name, good[one.name]) for one in regimes if one.weighs_laws),
        {name: tuple(str(one["failed"]) for one in mine if "failed" in one) for name, mine in records.items()},
        {name: sum(not one["converged"] for one in mine) for name, mine in good.items()},
    )  # fmt: skip


def _columns(records: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, FloatArray]]:
    """Scores of many campaigns, by quantity and field."""
    if not records:
        return {}
    return {
        name: {key: np.array([one["scores"][name][key] for one in records]) for key in first}
        for name, first in records[0]["scores"].items()
    }


def _ranks(scores: Mapping[str, Mapping[str, Mapping[str, FloatArray]]]) -> Ranks:
    return {regime: {name: one["rank"] for name, one in table.items()} for regime, table in scores.items()}


def _settings(seed: int, card: ModelCard) -> dict[str, Any]:
    return {"seed": seed, "model": card.name, "model_sha256": card.sha256, "versions": versions()}
