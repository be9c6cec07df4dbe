"""What a command or a call is given: objects or paths, and numbers that are checked before any work is done."""

from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.app.options import check_writable
from scruton.app.thresholds import EXPONENTS, LARGEST_SC, LARGEST_SEED
from scruton.campaign import Campaign, load_campaign, tests_named, tests_used
from scruton.campaign.spelling import several
from scruton.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.cards import ModelCard
    from scruton.infer.results import Fit

    Fitted = Fit | xr.DataTree | Path | str  # a fit, its tree, or the folder of one


def check_given(
    call: str,
    *,
    seed: Any = 0,
    law_n: Any = None,
    scruton_numbers: Iterable[Any] = (),
    out: Path | str | None = None,
) -> None:
    """Refuse what no verb takes, as the command line does; `call` is where it was given."""
    whole = isinstance(seed, Integral) and not isinstance(seed, bool | np.bool_)
    if not whole or not 0 <= seed <= LARGEST_SEED:
        raise InputError(call, "seed", repr(seed), f"a whole number, zero or more, up to {LARGEST_SEED}")
    numbers: list[tuple[str, Any, tuple[float, float]]] = []
    if law_n is not None:
        numbers.append(("law_n", law_n, EXPONENTS))
    numbers += [("scruton_numbers", one, (-LARGEST_SC, LARGEST_SC)) for one in scruton_numbers]
    for name, value, (low, high) in numbers:
        if not (isinstance(value, Real) and low <= float(value) <= high):  # nor is NaN
            raise InputError(call, name, repr(value), f"a number from {low:g} to {high:g}")
    if out is not None:
        check_writable(Path(out), "out")


def given_campaign(campaign: Campaign | Path | str, tests: str | Sequence[str] = ()) -> Campaign:
    """The campaign, with these tests alone if there are any."""
    loaded = load_campaign(Path(campaign)) if isinstance(campaign, Path | str) else campaign
    if not isinstance(loaded, Campaign):
        raise InputError("campaign", "", f"a {type(campaign).__name__}", "a Campaign, its folder, or its campaign.toml")
    return tests_used(loaded, tests) if several(tests) else loaded


def asked_campaign(asked: Namespace) -> tuple[Campaign, tuple[str, ...]]:
    """The campaign of the command line, of the tests alone that it names, and their names; InputError for bad input."""
    campaign = load_campaign(asked.campaign)
    if getattr(asked, "strict", False):  # a batch does not ask
        from scruton.envelope import usable

        usable(campaign, strict=True)
    names = tests_named(campaign, asked.tests)
    return (tests_used(campaign, names) if names else campaign), names


def given_card(card: "ModelCard | Path | str") -> "ModelCard":
    """The model card."""
    from scruton.infer.cards import load_card

    return load_card(card) if isinstance(card, Path | str) else card


def read_results(fit: "Fit | Path | str") -> "tuple[xr.DataTree, Mapping[str, Any]]":
    """The tree and the summary of a fit."""
    from scruton.infer.store import read_tree

    if isinstance(fit, Path | str):
        return read_tree(Path(fit))
    if not hasattr(fit, "tree"):
        raise InputError("fit", "", f"a {type(fit).__name__}", "a Fit, or the folder of one")
    return fit.tree, fit.summary


def check_in_wind(tree: "xr.DataTree", where: Path | str) -> None:
    """Refuse a fit of still air alone, which lies `where`."""
    if "posterior" not in tree:
        wanted = "a fit of at least one test in wind: still air says nothing of the law"
        raise InputError(where, "", "a campaign without tests in wind", wanted)


def given_tree(fit: "Fitted") -> "xr.DataTree":
    """The tree of a fit."""
    import xarray as xr

    return fit if isinstance(fit, xr.DataTree) else read_results(fit)[0]
