"""Convergence as a verdict: nested R-hat over ensembles, bulk and tail ESS, autocorrelation, stuck walkers."""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.stats.thresholds import FEWEST_STEPS, LONG_RUN, ROUGHLY, STUCK_BELOW, TIMES_SPANNED

MOST = 64  # draws a walker that the diagnostics look at; of a longer run evenly thinned ones, which say as much


@dataclass(frozen=True)
class SamplerSettings:
    """How long to sample and with which moves; see `scruton.stats.sampler`."""

    ensembles: int = 4
    walkers: int = 256
    draws: int = 8
    min_ess: float = 1000.0
    max_rhat: float = 1.01
    max_steps: int = 4000
    independence: float = 0.9
    differential_evolution: float = 0.07
    stretch: float = 0.03


@dataclass(frozen=True, eq=False)
class Convergence:
    """The verdict on one posterior.

    Attributes
    ----------
    rhat_nested, ess_bulk, ess_tail, tau : (d,) arrays
        By parameter; `tau` is the integrated autocorrelation time in steps of a walker.
    steps : int
        Steps kept per walker.
    stuck : int
        Walkers in a mode of their own.
    acceptance : float
        Fraction of accepted proposals.
    """

    rhat_nested: FloatArray
    ess_bulk: FloatArray
    ess_tail: FloatArray
    tau: FloatArray
    steps: int
    stuck: int
    acceptance: float
    converged: bool

    def explain(self, names: tuple[str, ...], settings: SamplerSettings) -> str:
        """Say in one sentence what is wrong and what to do; empty when converged."""
        if self.converged:
            return ""
        faults = []
        for name, rhat, bulk, tail in zip(names, self.rhat_nested, self.ess_bulk, self.ess_tail, strict=True):
            if not rhat < settings.max_rhat:
                faults.append(f"nested R-hat of {name} is {rhat:.3f} (wanted < {settings.max_rhat:g})")
            elif not min(bulk, tail) >= settings.min_ess:
                faults.append(f"{name} has {min(bulk, tail):.0f} effective draws (wanted {settings.min_ess:g})")
        if not self.steps >= min(TIMES_SPANNED * self.tau.max(), LONG_RUN):
            faults.append(
                f"the run spans {self.steps / self.tau.max():.1f} autocorrelation times (wanted {TIMES_SPANNED:g})"
            )
        if self.stuck:
            faults.append(f"{self.stuck} walkers are stuck in a mode of their own")
        return (
            f"not converged after {self.steps} steps: {'; '.join(faults) or 'no finite autocorrelation time'}. "
            "Raise sampler.max_steps in the model card; if walkers are stuck, look whether the record is what "
            "its kind says and choose the transient with start and stop."
        )


def effective_draws(chain: FloatArray) -> float:
    """Effective draws of the slowest parameter as the scatter of the chains' means tells them: roughly, and at once."""
    scatter = chain.mean(axis=1).var(axis=0, ddof=1)
    spread = chain.reshape(-1, chain.shape[-1]).var(axis=0)
    with np.errstate(all="ignore"):
        return float(np.min(len(chain) * spread / scatter))


def promising(chain: FloatArray, effective: float, settings: SamplerSettings) -> bool:
    """Whether the verdict on chains of about so many effective draws may be good: with room for a rough estimate."""
    chains, draws, _ = chain.shape
    enough = ROUGHLY * effective >= settings.min_ess and draws >= max(settings.draws, FEWEST_STEPS)
    return bool(enough and draws >= min(TIMES_SPANNED * chains * draws / (ROUGHLY * effective), LONG_RUN))


def judge(
    chain: FloatArray, log_prob: FloatArray, ensembles: int, acceptance: float, settings: SamplerSettings
) -> Convergence:
    """Judge the kept part of a run.

    Parameters
    ----------
    chain : (chains, draws, d) array
        Walkers of all ensembles; those of one ensemble are neighbours.
    log_prob : (chains, draws) array
    """
    from arviz_stats.base import array_stats

    chains, draws, _ = chain.shape
    thin = -(-draws // MOST)
    chain, log_prob = chain[:, ::thin], log_prob[:, ::thin]
    ids = np.repeat(np.arange(ensembles), chains // ensembles)
    axes = {"chain_axis": 0, "draw_axis": 1}
    bulk = np.atleast_1d(array_stats.ess(chain, method="bulk", **axes))
    tail = np.atleast_1d(array_stats.ess(chain, method="tail", prob=(0.05, 0.95), **axes))
    rhat = np.atleast_1d(array_stats.rhat_nested(chain, superchain_ids=ids, **axes))
    mean = log_prob.mean(axis=1)
    stuck = int((mean < np.median(mean) - STUCK_BELOW).sum() + (mean > np.median(mean) + STUCK_BELOW).sum())
    # In a short run an honest walker may reject every proposal; in a long one it may not.
    frozen = (np.ptp(chain, axis=1).max(axis=1) == 0.0) & (draws >= LONG_RUN)
    tau = chains * draws / bulk  # in steps, whatever the thinning
    good = (
        bool(np.isfinite(rhat).all() and np.isfinite(bulk).all() and np.isfinite(tail).all())
        and bool((rhat < settings.max_rhat).all())
        and float(min(bulk.min(), tail.min())) >= settings.min_ess
        and draws >= min(TIMES_SPANNED * float(tau.max()), LONG_RUN)
        and stuck == 0
        and not frozen.any()
    )
    return Convergence(rhat, bulk, tail, tau, draws, stuck + int(frozen.sum()), acceptance, good)


def monte_carlo_error(draws: FloatArray, probability: float | None = None) -> float:
    """Monte Carlo standard error of a quantile of draws, or of their mean where no probability is given.

    Parameters
    ----------
    draws : (chains, draws) array
        Some may be infinite.

    Returns
    -------
    float
        NaN where the quantile is infinite; inf where it may be so within its error.

    Notes
    -----
    arviz's: by the effective number of the draws, or for a quantile of the indicator that a draw lies below it
    (Vehtari et al., Bayesian Analysis 16, 667, 2021).
    """
    from arviz_stats.base import array_stats

    if float(np.min(draws)) == float(np.max(draws)):
        return 0.0 if np.isfinite(draws.flat[0]) else float("nan")
    finite = draws[np.isfinite(draws)]
    reach = float(np.ptp(finite)) if finite.size else 0.0
    ceiling = float(finite.max()) + 1e3 * reach if finite.size else 1.0  # their rank is all that infinite draws have
    bounded = np.minimum(draws, ceiling)
    axes = {"chain_axis": 0, "draw_axis": 1}
    if probability is None:
        return float(array_stats.mcse(draws, method="mean", **axes)) if np.isfinite(draws).all() else float("inf")
    if np.quantile(bounded, probability, method="inverted_cdf") == ceiling:
        return float("nan")
    error = float(array_stats.mcse(bounded, method="quantile", prob=probability, **axes))
    return error if error <= reach else float("inf")
