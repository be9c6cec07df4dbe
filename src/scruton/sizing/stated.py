"""Quantities of a bridge as they are stated: a number, "x +/- s", or a table of what is known of a distribution."""

import sys
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from scruton.campaign.quantity import FAMILIES, Quantity
from scruton.campaign.spelling import show
from scruton.campaign.toml import Table, bare
from scruton.campaign.units import Dimension
from scruton.sizing.thresholds import LARGEST_COV


def uncertain(table: Table, key: str, dimension: Dimension, cov: float = 0.0, family: str = "lognormal") -> Quantity:
    """Read a number, "x +/- s", or a table of mean or median, sd or cov, minimum, distribution.

    Parameters
    ----------
    cov : float
        Coefficient of variation where none is stated.
    family : str
        Distribution where none is stated.

    Raises
    ------
    InputError
        For what is no quantity of the dimension, or no distribution.
    """
    value = table.values.get(key)
    if not isinstance(value, Mapping):
        stated = table.quantity(key, dimension).or_relative_sd(cov)
        return _checked(replace(stated, family=family if stated.sd else "known"), table, key)
    inner = table.table(key)
    inner.check_keys(("mean", "median", "sd", "cov", "minimum", "distribution"))
    family = inner.choice("distribution", FAMILIES) if "distribution" in inner else family
    if ("mean" in inner) == ("median" in inner):
        raise table.error(key, show(value), "either mean or median")
    if "sd" in inner and "cov" in inner:
        raise table.error(key, show(value), "either sd or cov")
    centre = inner.number("median" if "median" in inner else "mean", dimension)
    if "sd" in inner:
        spread = inner.number("sd", dimension) / centre
    else:
        spread = bare(0.0, sys.float_info.max, cov, "a bare number, zero or more").read(inner, "cov")
    if family == "lognormal" and "median" in inner:
        if "sd" in inner:  # sd^2 = median^2 w (w - 1) with w = 1 + cov^2
            spread = float(np.sqrt(0.5 * (np.sqrt(1.0 + 4.0 * spread**2) - 1.0)))
        centre *= float(np.sqrt(1.0 + spread**2))
    elif family == "beta" and "median" in inner:
        raise table.error(key, show(value), "the mean of a beta distribution, not its median")
    # in the unit of the mean, as it is written; a bare zero cuts off nothing
    minimum = inner.number("minimum", dimension) if inner.values.get("minimum", 0) != 0 else 0.0
    return _checked(Quantity(centre, spread * centre, family if spread > 0.0 else "known", minimum), table, key)


def _checked(value: Quantity, table: Table, key: str) -> Quantity:
    sd, is_beta = value.sd or 0.0, value.family == "beta" and not value.certain
    for good, wanted in (
        (key not in ("damping_ratio", "coherence") or value.mean <= 1.0, "a bare number up to 1"),
        (sd <= LARGEST_COV * value.mean, f"a standard deviation up to {LARGEST_COV:g} times the mean"),
        (not is_beta or value.mean < 1.0, "a mean between 0 and 1: beta is a distribution of fractions"),
        (not is_beta or sd**2 < value.mean * (1.0 - value.mean), "a standard deviation that fits between 0 and 1"),
        (value.minimum < value.mean, "a minimum below the mean"),
    ):
        if not good:
            raise table.refusal(key, wanted)
    return value
