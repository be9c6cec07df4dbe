"""What a calibration shows: coverage, ranks and checks of the law, from the records of its campaigns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.coverage import Cell, LawCheck, Pooled, Ranks, Uniformity, cells, law_check, pooled, uniformity
from scruton.calibrate.identifiability import Identifiability
from scruton.calibrate.regimes import Regime


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
        beyond = [*(cell.beyond for cell in self.cells), *(ranks.beyond for ranks in self.uniformity)]
        return not any(beyond) and not any(self.failed.values())


def summarise(
    folder: Path,
    settings: Mapping[str, Any],
    regimes: tuple[Regime, ...],
    records: Mapping[str, Sequence[Mapping[str, Any]]],
    design: tuple[Identifiability, ...],
) -> CalibrationResult:
    """Turn the campaigns' records into coverage, ranks and law checks."""
    good = {name: [record for record in mine if "failed" not in record] for name, mine in records.items()}
    scores = {regime.name: _columns(good[regime.name]) for regime in regimes if not regime.weighs_laws}
    ranks = _ranks(scores)
    left_out = {(row.regime, row.quantity) for row in design if row.left_out}
    return CalibrationResult(
        folder, settings, regimes, scores, cells(ranks, left_out), pooled(ranks, left_out), uniformity(ranks, left_out),
        design,
        tuple(law_check(regime.name, good[regime.name]) for regime in regimes if regime.weighs_laws),
        {name: tuple(str(record["failed"]) for record in mine if "failed" in record) for name, mine in records.items()},
        {name: sum(not record["converged"] for record in mine) for name, mine in good.items()},
    )  # fmt: skip


def _columns(records: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, FloatArray]]:
    """Scores of many campaigns, by quantity and field."""
    return {
        name: {key: np.array([record["scores"][name][key] for record in records]) for key in first}
        for name, first in (records[0]["scores"] if records else {}).items()
    }


def _ranks(scores: Mapping[str, Mapping[str, Mapping[str, FloatArray]]]) -> Ranks:
    return {regime: {name: fields["rank"] for name, fields in table.items()} for regime, table in scores.items()}
