"""What a calibration shows: coverage, ranks and checks of the law, from the records of its campaigns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
        return {name: {one: fields["rank"] for one, fields in table.items()} for name, table in self.scores.items()}

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
    scores = {}
    for name in (regime.name for regime in regimes if not regime.weighs_laws):
        mine = [record["scores"] for record in good[name]]
        scores[name] = {
            quantity: {key: np.array([one[quantity][key] for one in mine]) for key in first}
            for quantity, first in (mine[0] if mine else {}).items()
        }
    failed = {name: tuple(str(one["failed"]) for one in mine if "failed" in one) for name, mine in records.items()}
    unconverged = {name: sum(not record["converged"] for record in mine) for name, mine in good.items()}
    laws = tuple(law_check(regime.name, good[regime.name]) for regime in regimes if regime.weighs_laws)
    bare = CalibrationResult(folder, settings, regimes, scores, (), (), (), design, laws, failed, unconverged)
    ranks, left_out = bare.ranks, {(row.regime, row.quantity) for row in design if row.left_out}
    return replace(
        bare, cells=cells(ranks, left_out), pooled=pooled(ranks, left_out), uniformity=uniformity(ranks, left_out)
    )
