"""Monte Carlo errors of medians and of the ends of 90 % intervals, beside them or the largest of a table below it."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.posterior import printed_draws, test_names
from scruton.infer.joint import joint_draws
from scruton.report.wording import PAGE, Notation
from scruton.stats.convergence import by_chain, monte_carlo_error

if TYPE_CHECKING:
    import xarray as xr

    from scruton.griffin import Prediction

Errors = Sequence[float | None]  # of the median and of both ends; None where there is no such end

MEANING = "MC errors: Monte Carlo standard errors of the median and of the interval's ends."
MEANING_AT_90 = "MC errors are the Monte Carlo standard errors of the median and of the ends of the 90 % interval."


def errors_of(draws: FloatArray, chains: int, level: float = 0.90) -> Errors:
    """Monte Carlo standard errors of the median and of both ends of an interval of draws (S,), chain after chain."""
    rows = by_chain(draws, chains)
    return [known(monte_carlo_error(rows, p)) for p in (0.5, 0.5 - level / 2, 0.5 + level / 2)]


def errors_of_prediction(prediction: "Prediction") -> Errors:
    """The same of a prediction."""
    return [known(prediction.error(p)) for p in (0.5, 0.05, 0.95)]


def errors_of_rigs(tree: "xr.DataTree") -> dict[str, Errors]:
    """Those of the structural damping ratio, by rig."""
    damping = tree["rig_posterior"]["damping_ratio"].transpose("rig", "chain", "draw")
    return {
        str(name): errors_of(draws.to_numpy().reshape(-1), damping.sizes["chain"])
        for name, draws in zip(damping["rig"].to_numpy(), damping, strict=True)
    }


def errors_of_test(tree: "xr.DataTree", test: str, names: Iterable[str], level: float = 0.90) -> dict[str, Errors]:
    """Those of parameters that are printed of a test, by name."""
    draws, chains = printed_draws(tree, test), int(tree["posterior"].sizes["chain"])
    return {name: errors_of(draws[name], chains, level) for name in names if name in draws}


def errors_of_shared(tree: "xr.DataTree", names: Iterable[str]) -> dict[str, Errors]:
    """Those of what the peak tests share, by name."""
    shared: Mapping[str, FloatArray] = joint_draws(tree).shared if test_names(tree) else {}
    chains = int(tree["campaign_posterior"].sizes["chain"]) if shared else 1
    return {name: errors_of(shared[name], chains) for name in names if name in shared}


def written(errors: Errors | None, of: Notation, factor: float = 1.0) -> str:
    """The three of them, of what is shown by a factor; a page, which writes powers of ten, parts them by commas.

    What has no spread has none.
    """
    if not any(errors or ()):
        return of.missing
    return (" " if of.plain else ", ").join(of.number(None if one is None else factor * one, 2) for one in errors or ())


def at_most(every: Iterable[Errors], of: Notation, factor: float = 1.0, what: str = "") -> str:
    """Under a table a sentence: the largest of its medians, and of the ends of its intervals; empty without any."""
    rows = np.array([[np.nan if one is None else factor * one for one in errors] for errors in every if errors])
    if not np.isfinite(rows).any():
        return ""
    columns = (column[np.isfinite(column)] for column in (rows[:, 0], rows[:, 1:].reshape(-1)))
    median, end = (of.number(float(column.max()), 2) if column.size else of.missing for column in columns)
    return f"Monte Carlo errors{what and f' {what}'} at most {median} of medians, {end} of the ends of intervals."


def in_brackets(errors: Errors | None, factor: float = 1.0) -> str:
    """In a sentence of a page, after a median and its interval; empty where they are not known."""
    known = any(errors or ())
    return f" (Monte Carlo errors {written(errors, PAGE, factor)})" if known else ""


def known(error: float) -> float | None:
    """An error, or None where it is not known."""
    return error if math.isfinite(error) else None
