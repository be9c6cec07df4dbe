"""What a calibration shows: coverage of central intervals, one by one and pooled, uniform ranks, checks of the law."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.calibrate.identifiability import Identifiability
from scruton.calibrate.quantities import INTERVALS, kind_of
from scruton.calibrate.regimes import Regime
from scruton.calibrate.thresholds import LIMIT, LIMIT_P

EVERYTHING = "all"

Ranks = Mapping[str, Mapping[str, FloatArray]]  # regime -> quantity -> (campaigns,)
Key = tuple[str, str]  # regime, quantity


@dataclass(frozen=True)
class Cell:
    """Coverage of one interval of one quantity in one regime.

    Attributes
    ----------
    regime, quantity : str
    interval : float
        Nominal probability.
    campaigns : int
    coverage : float
    standard_error : float
        Binomial, at the nominal probability.
    left_out : bool
        Not identifiable by design, and no part of any verdict.
    """

    regime: str
    quantity: str
    interval: float
    campaigns: int
    coverage: float
    standard_error: float
    left_out: bool = False

    @property
    def z(self) -> float:
        """Deviation from nominal in standard errors."""
        return (self.coverage - self.interval) / self.standard_error

    @property
    def beyond(self) -> bool:
        """Whether the cell fails: further than four standard errors from nominal."""
        return not self.left_out and abs(self.z) > LIMIT


@dataclass(frozen=True)
class Pooled:
    """Coverage over all regimes, of one quantity or of all.

    `standard_error` is from the scatter between campaigns, whose quantities are not independent of each other.
    """

    quantity: str
    interval: float
    campaigns: int
    coverage: float
    standard_error: float

    @property
    def points(self) -> float:
        """Deviation from nominal in percentage points."""
        return 100.0 * (self.coverage - self.interval)


@dataclass(frozen=True)
class Uniformity:
    """Whether the ranks of one quantity in one regime are uniform.

    `p_value` is of a chi-square test over `bins` equal bins, `ecdf_deviation` the largest distance of the ranks'
    distribution function from the diagonal.
    """

    regime: str
    quantity: str
    campaigns: int
    bins: int
    p_value: float
    ecdf_deviation: float
    left_out: bool = False

    @property
    def beyond(self) -> bool:
        """Whether the ranks fail: less probable than a normal deviate beyond four."""
        return not self.left_out and self.p_value < LIMIT_P


def covered(rank: FloatArray, probability: float) -> np.ndarray:
    """Whether the central interval of this probability holds the truth whose rank is given, same shape."""
    return np.asarray(np.abs(np.asarray(rank) - 0.5) <= 0.5 * probability)


def cells(ranks: Ranks, left_out: Collection[Key] = ()) -> tuple[Cell, ...]:
    """Coverage of every interval of every quantity in every regime."""
    return tuple(
        Cell(
            regime, name, p, len(rank), float(covered(rank, p).mean()), float(np.sqrt(p * (1.0 - p) / len(rank))),
            (regime, name) in left_out,
        )
        for regime, table in ranks.items()
        for name, rank in table.items()
        if len(rank)
        for p in INTERVALS
    )  # fmt: skip


def pooled(ranks: Ranks, left_out: Collection[Key] = ()) -> tuple[Pooled, ...]:
    """Coverage over regimes by kind of quantity, and over everything, which comes first."""
    kept = {
        regime: {name: rank for name, rank in table.items() if len(rank) and (regime, name) not in left_out}
        for regime, table in ranks.items()
    }
    kinds = dict.fromkeys(kind_of(name) for table in ranks.values() for name in table)
    rows = []
    for kind in (EVERYTHING, *kinds):
        tables = [[rank for name, rank in t.items() if kind in (EVERYTHING, kind_of(name))] for t in kept.values()]
        for p in INTERVALS if any(tables) else ():
            each = np.concatenate([covered(np.stack(part), p).mean(axis=0) for part in tables if part])  # by campaign
            error = float(each.std(ddof=1) / np.sqrt(each.size)) if each.size > 1 else float("nan")
            rows.append(Pooled(kind, p, each.size, float(each.mean()), error))
    return tuple(rows)


def uniformity(ranks: Ranks, left_out: Collection[Key] = ()) -> tuple[Uniformity, ...]:
    """Test the ranks of every quantity in every regime."""
    from scipy.stats import chisquare, ks_1samp, uniform

    rows = []
    for regime, name, rank in ((regime, *entry) for regime, table in ranks.items() for entry in table.items()):
        if len(rank):
            bins = int(np.clip(len(rank) // 5, 2, 20))
            counts, _ = np.histogram(rank, bins=bins, range=(0.0, 1.0))
            p, distance = float(chisquare(counts).pvalue), float(ks_1samp(rank, uniform.cdf).statistic)
            rows.append(Uniformity(regime, name, len(rank), bins, p, distance, (regime, name) in left_out))
    return tuple(rows)


@dataclass(frozen=True)
class Sharpness:
    """Coverage of the closed 90 % interval of one quantity, tests taken together, and how sharp it is.

    Attributes
    ----------
    intervals : int
    coverage : float
    factor : float
        Median of the upper end over the lower; inf where the lower is zero.
    interval_score : float
        Mean interval score over the truth; see `scruton.calibrate.quantities.held`.
    reaches_zero : float
        Share of the intervals that hold zero amplitude though there is vibration.
    """

    intervals: int
    coverage: float
    factor: float
    interval_score: float
    reaches_zero: float


@dataclass(frozen=True)
class LawCheck:
    """What a regime that weighs laws shows.

    Attributes
    ----------
    regime : str
    campaigns : int
    flagged : float
        Share of campaigns in which the fit said that the data speak against the first law; NaN where it never says.
    weights : tuple of float
        Mean weight of every law.
    quantities : mapping
        Of the law-averaged posterior or prediction, by quantity.
    """

    regime: str
    campaigns: int
    flagged: float
    weights: tuple[float, ...]
    quantities: Mapping[str, Sharpness]


def law_check(regime: Regime, records: Sequence[Mapping[str, Any]]) -> LawCheck:
    """Summarise the records that `scruton.calibrate.campaigns.run_campaign` gives in a regime that weighs laws."""
    flags = [bool(record["law_flag"]) for record in records if record["law_flag"] is not None]
    weights = np.mean([record["weights"] for record in records], axis=0).tolist() if records else ()
    # Every test has a place of its own on the curve of a law; outside the family they stand for each other.
    scores: dict[str, list[Mapping[str, Any]]] = {}
    for record in records:
        for name, score in record["scores"].items():
            scores.setdefault(kind_of(name) if regime.outside else name, []).append(score)
    quantities = {
        name: Sharpness(
            len(alike),
            float(np.mean([score["inside"]["0.9"] for score in alike])),
            float(np.median([score["factor"] for score in alike])),
            float(np.mean([score["interval_score"] for score in alike])),
            float(np.mean([score["truth"] > 0.0 and np.isinf(score["factor"]) for score in alike])),
        )
        for name, alike in scores.items()
    }
    flagged = float(np.mean(flags)) if flags else float("nan")
    return LawCheck(regime.name, len(records), flagged, tuple(weights), quantities)


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
        See `Cell`, `Pooled`, `Uniformity`, `Identifiability` and `LawCheck`.
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
        return {name: {key: fields["rank"] for key, fields in table.items()} for name, table in self.scores.items()}

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
    good = {name: [record for record in runs if "failed" not in record] for name, runs in records.items()}
    scores = {}
    for name in (regime.name for regime in regimes if not regime.weighs_laws):
        scored = [record["scores"] for record in good[name]]
        scores[name] = {
            quantity: {key: np.array([score[quantity][key] for score in scored]) for key in first}
            for quantity, first in (scored[0] if scored else {}).items()
        }
    failed = {name: tuple(str(row["failed"]) for row in runs if "failed" in row) for name, runs in records.items()}
    unconverged = {name: sum(not record["converged"] for record in runs) for name, runs in good.items()}
    laws = tuple(law_check(regime, good[regime.name]) for regime in regimes if regime.weighs_laws)
    result = CalibrationResult(folder, settings, regimes, scores, (), (), (), design, laws, failed, unconverged)
    ranks, left_out = result.ranks, {(row.regime, row.quantity) for row in design if row.left_out}
    return replace(
        result, cells=cells(ranks, left_out), pooled=pooled(ranks, left_out), uniformity=uniformity(ranks, left_out)
    )
