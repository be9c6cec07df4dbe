"""Convergence as a verdict: nested R-hat over ensembles, bulk and tail ESS, autocorrelation, stuck walkers."""

import math
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray, end_to_end
from scruton.stats.ranks import FEWEST_DRAWS, effective_draws_of_mean, rank_statistics
from scruton.stats.thresholds import FEWEST_STEPS, LEAST_MORE, LONG_RUN, ROUGHLY, SPARE, STUCK_BELOW, TIMES_SPANNED

ONE_SD = np.array([0.1586553, 0.8413447])  # probabilities one standard deviation below and above, as arviz rounds them
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
        if not self.steps >= _shortest(self.tau.max()):
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

    def wanting(self, settings: SamplerSettings) -> float:
        """How much longer the run should be, over its length: a part where draws alone want, else as long again."""
        if not bool((self.rhat_nested < settings.max_rhat).all()) or self.stuck:
            return 1.0
        draws = settings.min_ess / float(min(self.ess_bulk.min(), self.ess_tail.min()))
        length = _shortest(self.tau.max()) / self.steps
        more = SPARE * max(draws, length) - 1.0
        return min(max(more, LEAST_MORE), 1.0) if math.isfinite(more) else 1.0


def _shortest(tau: float) -> float:
    """Steps that a run of this autocorrelation time has to keep."""
    return min(TIMES_SPANNED * float(tau), LONG_RUN)


def effective_draws(chain: FloatArray) -> float:
    """Effective draws of the slowest parameter as the scatter of the chains' means tells them: roughly, and at once."""
    scatter = chain.mean(axis=1).var(axis=0, ddof=1)
    spread = end_to_end(chain).var(axis=0)
    with np.errstate(all="ignore"):
        return float(np.min(len(chain) * spread / scatter))


def promising(chain: FloatArray, effective: float, settings: SamplerSettings) -> bool:
    """Whether the verdict on chains of about so many effective draws may be good: with room for a rough estimate."""
    chains, draws, _ = chain.shape
    enough = ROUGHLY * effective >= settings.min_ess and draws >= max(settings.draws, FEWEST_STEPS)
    return bool(enough and draws >= _shortest(chains * draws / (ROUGHLY * effective)))


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
    chains, draws, _ = chain.shape
    thin = -(-draws // MOST)
    chain, log_prob = chain[:, ::thin], log_prob[:, ::thin]
    bulk, tail, rhat = rank_statistics(chain, ensembles)
    mean = log_prob.mean(axis=1)
    stuck = int((mean < np.median(mean) - STUCK_BELOW).sum() + (mean > np.median(mean) + STUCK_BELOW).sum())
    # In a short run an honest walker may reject every proposal; in a long one it may not.
    frozen = (np.ptp(chain, axis=1).max(axis=1) == 0.0) & (draws >= LONG_RUN)
    tau = chains * draws / bulk  # in steps, whatever the thinning
    good = (
        bool(np.isfinite(rhat).all() and np.isfinite(bulk).all() and np.isfinite(tail).all())
        and bool((rhat < settings.max_rhat).all())
        and float(min(bulk.min(), tail.min())) >= settings.min_ess
        and draws >= _shortest(tau.max())
        and stuck == 0
        and not frozen.any()
    )
    return Convergence(rhat, bulk, tail, tau, draws, stuck + int(frozen.sum()), acceptance, good)


def by_chain(draws: FloatArray, chains: int) -> FloatArray:
    """Draws (S,), chain after chain, as (chains, draws); of one chain where a short run has kept another number."""
    return draws.reshape(chains if draws.size % chains == 0 else 1, -1)


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
    By the effective number of the draws, or for a quantile of the indicator that a draw lies below it (Vehtari et al.,
    Bayesian Analysis 16, 667, 2021): arviz's numbers, without the second that arviz takes to import.
    """
    if float(np.min(draws)) == float(np.max(draws)):
        return 0.0 if np.isfinite(draws.flat[0]) else float("nan")
    if np.isnan(draws).any() or draws.shape[1] < FEWEST_DRAWS:
        return float("nan")
    finite = draws[np.isfinite(draws)]
    reach = float(np.ptp(finite)) if finite.size else 0.0
    ceiling = float(finite.max()) + 1e3 * reach if finite.size else 1.0  # their rank is all that infinite draws have
    bounded = np.minimum(draws, ceiling)
    if probability is None:
        if not np.isfinite(draws).all():
            return float("inf")
        return float(np.std(draws, ddof=1) / np.sqrt(effective_draws_of_mean(draws)))
    if np.quantile(bounded, probability, method="inverted_cdf") == ceiling:
        return float("nan")
    from scipy.special import betaincinv

    ess = effective_draws_of_mean((bounded <= np.quantile(bounded, probability)).astype(float))
    low, high = betaincinv(ess * probability + 1.0, ess * (1.0 - probability) + 1.0, ONE_SD) * bounded.size - 1.0
    ordered = np.sort(bounded, axis=None)
    error = 0.5 * float(ordered[min(math.ceil(high), bounded.size - 1)] - ordered[max(math.floor(low), 0)])
    return error if error <= reach else float("inf")
