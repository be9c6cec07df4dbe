"""What fitting gives: one result a rig, a test and a record, and the `Fit` that holds all of a campaign."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Record, Rig, Test
from scruton.envelope import Cycles, FrontEnd, RingDown
from scruton.infer.cards import ModelCard
from scruton.infer.models import TrialPosterior, WindPosterior
from scruton.infer.settings import Carried
from scruton.stats.posterior import Posterior
from scruton.stats.priors import Prior
from scruton.stats.sampler import Samples

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from scruton.infer.steady import SteadyVerdict


@dataclass(frozen=True, eq=False)
class Fit:
    """Everything that a fit knows; what `predict` and `report` need of it is in `tree` and `summary`.

    Attributes
    ----------
    campaign : Campaign
    card : ModelCard
    tree : xarray.DataTree
        posterior, campaign_posterior, laws, speeds, innovations, rig_posterior,
        trial_function, posterior_predictive, prior, log_likelihood, log_prior,
        sample_stats, observed_data, constant_data; the provenance is a JSON text among its attributes.
    cycles, front_ends : mapping
        By record name: the envelope that fed inference; the deterministic result of Eqs. (2) to (8).
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


@dataclass(frozen=True, eq=False)
class RigResult:
    """One rig: its posterior of xi_s, sampled from ring-downs or drawn from what the laboratory states."""

    rig: Rig
    posterior: Posterior | None
    samples: Samples | None
    damping: FloatArray  # (chains, draws)
    prior: Prior


@dataclass(frozen=True, eq=False)
class TestResult:
    """One test in wind."""

    __test__ = False

    test: Test
    rig: Rig
    posterior: WindPosterior
    samples: Samples
    carried: Carried
    wind_frequency: float
    derived: Mapping[str, FloatArray]
    steady: "tuple[SteadyVerdict, ...]" = ()


@dataclass(frozen=True, eq=False)
class TrialResult:
    """The trial-function constants of one record."""

    record: Record
    test: Test
    posterior: TrialPosterior
    samples: Samples
