"""What fitting gives: one result a rig, a test, a record and a law, and the `Fit` that holds all of a campaign."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Record, Rig, Test
from scruton.envelope import Cycles, FrontEnd, RingDown
from scruton.infer.cards import ModelCard
from scruton.infer.hierarchy import CampaignPosterior
from scruton.infer.joint import CAMPAIGN, RIG, TEST
from scruton.infer.models import TrialPosterior, WindPosterior
from scruton.infer.steady import SteadyVerdict
from scruton.infer.thresholds import COARSENED, FAVOURED
from scruton.shown import shown
from scruton.stats.posterior import Posterior
from scruton.stats.priors import Prior
from scruton.stats.samples import Samples

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

TRIAL = "trial function of"  # how the posterior of one record's trial function is named, before the record


@dataclass(frozen=True, eq=False)
class RigResult:
    """One rig: its posterior of xi_s, sampled from ring-downs or drawn from what the laboratory states.

    Where ring-downs show that xi_s varies with amplitude they are `varying`, and `damping` is drawn over all of theirs.
    """

    rig: Rig
    posterior: Posterior | None
    samples: Samples | None
    damping: FloatArray  # (chains, draws)
    prior: Prior
    varying: RingDown | None = None


@dataclass(frozen=True, eq=False)
class TestResult:
    """One test in wind; `stated` and `derived` are draws by name, (chains, draws): what is known, what follows."""

    __test__ = False

    test: Test
    rig: Rig
    posterior: WindPosterior
    samples: Samples
    stated: Mapping[str, FloatArray]
    wind_frequency: float
    derived: Mapping[str, FloatArray]
    steady: tuple[SteadyVerdict, ...] = ()


@dataclass(frozen=True, eq=False)
class TrialResult:
    """The trial-function constants of one record, with those of the residual, as `derived`, (chains, draws) each."""

    record: Record
    test: Test
    posterior: TrialPosterior
    samples: Samples
    derived: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class LawResult:
    """The campaign model under one law, sampled.

    Attributes
    ----------
    label : str
        "n=-1", or "n free".
    posterior, samples
    derived : mapping
        (chains, draws) arrays of the shared curve, (chains, draws, tests) arrays of the tests; see `derive`.
    roughly : bool
        Whether a part of the card's effective draws was enough.
    """

    label: str
    posterior: CampaignPosterior
    samples: Samples
    derived: Mapping[str, FloatArray]
    roughly: bool = False


@dataclass(frozen=True)
class Weighing:
    """How the weights of the laws came about.

    Attributes
    ----------
    stacked : bool
        By stacking, not by evidence.
    shared : float
        Part of the weight that goes by neither.
    by_rigs : bool
        Whether that goes by what each law says of a rig from the others; in equal shares if not.
    why : str
        The reason for it, a clause.
    doubted : bool
        Whether no law of the card holds.
    displaced : bool
        Whether that is for the structural damping, of which no test's own flag knows.
    """

    stacked: bool = False
    shared: float = 0.0
    by_rigs: bool = False
    why: str = ""
    doubted: bool = False
    displaced: bool = False

    @property
    def name(self) -> str:
        """What it goes by: evidence or stacking, and beside it rigs left out or equal shares."""
        shared = ", rigs left out" if self.by_rigs else ", equal shares"
        return ("stacking" if self.stacked else "evidence") + (shared if self.shared else "")

    @property
    def sentence(self) -> str:
        """What a reader of the weights has to know."""
        evidence = f"prior times evidence to the power of {1.0 / COARSENED:g}"
        by = "what each law says of records and rigs left out (stacking)" if self.stacked else evidence
        if not self.shared:
            return f"Weights of the laws: by {by}."
        other = "by the stable amplitude of each rig that the law foretells from the others"
        return (
            f"Weights of the laws: {1.0 - self.shared:.0%} by {by}, {self.shared:.0%} "
            f"{other if self.by_rigs else 'in equal shares'}, since {self.why}."
        )


@dataclass(frozen=True, eq=False)
class LawWeights:
    """Every law of the card against the others, (K,) each; the reference law first.

    Attributes
    ----------
    labels : tuple of str
    prior, weight : array
        Prior probability, and the weight that predictions use: the posterior probability until the weights are settled.
    log_evidence, error : array
        Of a law that was not sampled, by Laplace's approximation and without an error; NaN where there is one law.
    sampled : array of bool
    stacking : array
        Weights by stacking whose units are a record and a rig left out; NaN where they were not asked for, one law
        alone was sampled, or no evidence without one is reliable. A law that was not sampled beside others has none.
    unscored : tuple of str
        Records and rigs that take no part in stacking: the evidence without them is not reliable.
    rule : Weighing
        How `weight` came about.
    common : array
        What of `weight` neither evidence nor stacking gave.
    """

    labels: tuple[str, ...]
    prior: FloatArray
    weight: FloatArray
    log_evidence: FloatArray
    error: FloatArray
    sampled: np.ndarray
    stacking: FloatArray
    unscored: tuple[str, ...] = ()
    rule: Weighing = field(default_factory=Weighing)
    common: FloatArray | float = 0.0

    @property
    def told(self) -> FloatArray:
        """The part of `weight` that evidence or stacking gave, (K,)."""
        return np.asarray(self.weight - self.common)

    @property
    def flag(self) -> str:
        """A sentence where the data favour another law than the first: by evidence, not by the laws' prior weights."""
        best = int(np.argmax(self.log_evidence)) if len(self.labels) > 1 else 0
        gap = float(self.log_evidence[best] - self.log_evidence[0])
        if best == 0 and self.rule.displaced:
            return (
                f"no law of the card holds, since {self.rule.why}; Y1, epsilon, that damping and amplitudes beyond the "
                "tested Scruton numbers rest on a law that contradicts it"
            )
        if best == 0 or gap - 2.0 * float(np.nansum(self.error[[0, best]])) < FAVOURED:
            return ""
        first, other = self.labels[0], self.labels[best]
        higher = (
            f"{gap:.1f} higher" if np.isfinite(gap) else "far higher"
        )  # the first has none where it was not sampled
        favoured = f"the records favour the law {other} over {first}: log evidence {higher}"
        if self.rule.doubted:
            favoured = (
                f"no law of the card holds, since {self.rule.why}; the log evidence of {other}, {higher} than "
                f"that of {first}, makes it the nearer, not the true one"
            )
        return (
            f"{favoured}. What is inferred under {first}, Y1 and epsilon among it, describes these records badly; "
            "predictions weigh the laws"
        )


@dataclass(frozen=True, eq=False)
class PeakResult:
    """The campaign model of the peak tests: the laws that were sampled, and the weights of all."""

    tests: tuple[str, ...]
    laws: tuple[LawResult, ...]
    weights: LawWeights


@dataclass(frozen=True, eq=False)
class Sampled:
    """Every posterior of a campaign, and the envelopes that they are of.

    `cycles` goes by record, `ringdowns` by rig; `joint` is None without a test in wind.
    """

    campaign: Campaign
    card: ModelCard
    cycles: Mapping[str, Cycles]
    ringdowns: Mapping[str, RingDown]
    rigs: tuple[RigResult, ...]
    tests: tuple[TestResult, ...]
    joint: PeakResult | None
    trials: tuple[TrialResult, ...]

    @property
    def peaks(self) -> tuple[str, ...]:
        """Names of the peak tests."""
        return self.joint.tests if self.joint else ()

    @property
    def samples(self) -> dict[str, Samples]:
        """Draws of every posterior that was sampled, by its name."""
        named = {f"{RIG} {result.rig.name}": result.samples for result in self.rigs if result.samples}
        named |= {f"{TEST} {result.test.name}": result.samples for result in self.tests}
        named |= {f"{CAMPAIGN} {law.label}": law.samples for law in (self.joint.laws if self.joint else ())}
        return named | {f"{TRIAL} {trial.record.name}": trial.samples for trial in self.trials}


def _facts(one: "Fit") -> Mapping[str, object]:
    unit, facts = one.summary["amplitude_unit"], {"title": one.campaign.title, "converged": str(one.converged)}
    for test in one.summary["tests"]:
        low, high = test["parameters"]["a_star"]["interval"]["0.90"]
        facts[test["name"]] = f"stable amplitude {test['parameters']['a_star']['median']:.4g} "
        facts[test["name"]] += f"({low:.4g} .. {high:.4g}) {unit}"
    return facts | {"flags": str(len(one.flags))}


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Fit:
    """Everything that a fit knows; what `predict` and `report` need of it is in `tree` and `summary`.

    Attributes
    ----------
    campaign : Campaign
    card : ModelCard
    tree : xarray.DataTree
        Its groups are those of `scruton.infer.result_schema.SCHEMA`; the provenance is a JSON text among its
        attributes.
    cycles, front_ends : mapping
        By record name: the envelope that fed inference; the deterministic result of Eqs. (2) to (8). Of a fit that
        was loaded they are computed when they are asked for.
    ringdowns : mapping
        By rig name.
    convergence : pandas.DataFrame
        One row per parameter of every posterior.
    flags : tuple of str
        What the reader must know before trusting a number; those of an unconverged run come first.
    converged : bool
    summary : dict
        The content of fit.json.
    """

    campaign: Campaign
    card: ModelCard
    tree: "xr.DataTree"
    cycles: Mapping[str, Cycles]
    ringdowns: Mapping[str, RingDown]
    front_ends: Mapping[str, FrontEnd]
    convergence: "pd.DataFrame"
    flags: tuple[str, ...]
    converged: bool
    summary: dict[str, Any]

    @property
    def seed(self) -> int:
        """The seed of the run, from which what is drawn of its results comes, too."""
        return int(self.summary["provenance"]["seed"])
