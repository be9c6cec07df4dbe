"""The model that predicts: the joint posterior of the peak tests, of the law or the laws that carry weight.

What is printed of a test comes from here: what one test says alone, under the reference law, predicts nothing.
"""

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from scruton.arrays import FloatArray, IntArray
from scruton.infer.thresholds import CARRIES, NOT_MOVED, SAME_PLACE
from scruton.stats.priors import Prior

if TYPE_CHECKING:
    import xarray as xr

    from scruton.infer.results import LawWeights

CAMPAIGN = "campaign,"  # how the posterior of the campaign model is named, before the law
TEST, RIG = "test", "rig"  # and those of a test alone and of a rig in still air, before its name
REFERENCE = -1.0  # the law that Y1 and epsilon belong to
FORCES = ("Y1", "epsilon")
# Scales of the discrepancy between settings, and how they are spoken of.
SCALES = {"discrepancy_amplitude": "tau", "discrepancy_relaxation": "kappa"}


def evenly(total: int, wanted: int) -> IntArray:
    """Places of so many draws among all, spread evenly, (wanted,); all of them in order where as many are wanted."""
    return np.floor((np.arange(wanted) + 0.5) * total / max(wanted, 1)).astype(int)


def mixed(weights: FloatArray, size: int) -> IntArray:
    """Law that each of `size` draws of the laws' mixture is of, (size,): as many of each as its weight says.

    Multiples of the golden ratio are spread so evenly that nothing is left to chance: neither how many draws a law
    gives, to one or two, nor that it gives some of every chain.
    """
    share = np.cumsum(weights) / np.sum(weights)
    place = (np.arange(size) + 0.5) * 0.5 * (np.sqrt(5.0) - 1.0) % 1.0
    return np.asarray(np.minimum(np.searchsorted(share, place, side="right"), len(weights) - 1))


def law_weights(tree: "xr.DataTree") -> tuple[list[str], FloatArray]:
    """Labels of the laws that were sampled and their weights, (L,), which sum to one."""
    labels = [str(label) for label in tree["campaign_posterior"]["law"].to_numpy()]
    weights = np.asarray(tree["laws"]["weight"].sel(law=labels).to_numpy(), dtype=float)
    return labels, weights / weights.sum()


def told_weights(tree: "xr.DataTree") -> dict[str, float]:
    """What of its weight evidence or stacking gave each law that was sampled."""
    labels, weights = law_weights(tree)
    if "common_weight" in tree["laws"]:
        weights = weights - tree["laws"]["common_weight"].sel(law=labels).to_numpy()
    return dict(zip(labels, weights.tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class Joint:
    """Draws of the model that predicts, (S,) each by name.

    Attributes
    ----------
    shared : mapping
        Of the shared curve and the scales of the discrepancy.
    tests : mapping
        Of every peak test.
    at_prior : tuple of str
        Scales of the discrepancy that the records leave at their prior.
    """

    shared: Mapping[str, FloatArray] = field(default_factory=dict)
    tests: Mapping[str, Mapping[str, FloatArray]] = field(default_factory=dict)
    at_prior: tuple[str, ...] = ()


_SOURCES = ("campaign_posterior", "laws", "constant_data")
_KEPT: list[tuple[list["weakref.ref[xr.DataTree]"], Joint]] = []  # the last one: a report asks a hundred times


def joint_draws(tree: "xr.DataTree") -> Joint:
    """Draws of the model that predicts; nothing for a tree without a campaign posterior.

    Laws are mixed by their weights.  Y1 and epsilon are parameters of the law n = -1 and come from its draws alone,
    whatever its weight; they are missing where it was not sampled.  The exponent is among a test's where it is free.
    """
    if "campaign_posterior" not in tree:
        return Joint()
    groups = [cast("xr.DataTree", tree[name]) for name in _SOURCES if name in tree]
    joint = next((joint for kept, joint in _KEPT if _same(kept, groups)), None)
    if joint is None:
        joint = _mixed(tree)
        _KEPT[:] = [([weakref.ref(group) for group in groups], joint)]
    return replace(joint, at_prior=names_at_prior(tree))  # an attribute, which may be set later


def _same(kept: "Sequence[weakref.ref[xr.DataTree]]", groups: "Sequence[xr.DataTree]") -> bool:
    return len(kept) == len(groups) and all(ref() is group for ref, group in zip(kept, groups, strict=True))


def _mixed(tree: "xr.DataTree") -> Joint:
    group, constant = tree["campaign_posterior"].to_dataset(), tree["constant_data"]
    _, weights = law_weights(tree)
    size = group["n"].isel(law=0).size
    law, draw = mixed(weights, size), np.arange(size)
    n = group["n"].to_numpy().reshape(len(weights), size)
    paper = np.flatnonzero((n == REFERENCE).all(axis=1))

    def of(values: "xr.DataArray", *, reference: bool = False) -> FloatArray:
        rows = values.transpose("law", "chain", "draw").to_numpy().reshape(len(weights), size)
        return np.asarray(rows[paper[0]] if reference else rows[law, draw], dtype=float)

    shared = {str(name): of(values) for name, values in group.data_vars.items() if "peak_test" not in values.dims}
    tests: dict[str, dict[str, FloatArray]] = {}
    for test in group["peak_test"].to_numpy() if "peak_test" in group.dims else ():
        own = group.sel(peak_test=test)
        values = {
            str(name): of(own[name], reference=name in FORCES)
            for name, column in group.data_vars.items()
            if "peak_test" in column.dims and (name not in FORCES or paper.size)
        }
        omega0 = 2.0 * np.pi * float(constant["frequency"].sel(test=test))
        values["relaxation_scruton_number"] = values["mass_damping_factor"] * values["relaxation_rate"] / omega0
        if np.isnan(constant["law_n"]):
            values["law_exponent"] = shared["n"]
        tests[str(test)] = values
    return Joint(shared, tests)


def reference_holds(weights: "LawWeights") -> bool:
    """Whether the law that Y1 and epsilon belong to carries weight in predictions, and nothing speaks against it."""
    label = f"n={REFERENCE:g}"
    if label not in weights.labels or (weights.flag and weights.labels[0] == label):
        return False
    return bool(weights.told[weights.labels.index(label)] > CARRIES)


def reference_remark(weights: "LawWeights") -> str:
    """A sentence where the law of Y1 and epsilon was sampled and carries no weight, and no flag says it yet."""
    if weights.flag or reference_holds(weights) or f"n={REFERENCE:g}" not in weights.labels:
        return ""
    return (
        f"Y1 and epsilon are parameters of the law n={REFERENCE:g}, to which the records give no weight and which does "
        "not hold; other numbers are those of the laws that do"
    )


def left_at_prior(draws: Mapping[str, FloatArray], priors: Mapping[str, Prior]) -> tuple[str, ...]:
    """Parameters whose posterior equals their prior in the sampled coordinate, in width and in place.

    Parameters
    ----------
    draws : mapping
        Positive draws, (S,) each, by name.
    priors : mapping
        By the same names.
    """
    names = []
    for name, prior in priors.items():
        log = np.log(draws[name])
        if log.std() > NOT_MOVED * prior.scale and abs(log.mean() - prior.location) < SAME_PLACE * prior.scale:
            names.append(name)
    return tuple(names)


def scales_remark(joint: Joint) -> str:
    """A sentence where the scales of the discrepancy are left at their prior; else empty."""
    if not joint.at_prior:
        return ""
    rigs = len(joint.tests)
    stated = "; ".join(
        f"{SCALES[name]} {np.median(draws):.2g}, 90 % " + "{:.2g} to {:.2g}".format(*np.quantile(draws, [0.05, 0.95]))
        for name, draws in ((name, joint.shared[name]) for name in joint.at_prior)
    )
    say = "one rig says" if rigs == 1 else f"{rigs} rigs say next to"
    return (
        f"discrepancy between settings: the posterior equals the card's prior ({stated}), of which {say} nothing: the "
        "band of another setting is that prior's"
    )


def names_at_prior(tree: "xr.DataTree") -> tuple[str, ...]:
    """The scales of the discrepancy that a fit left at their prior."""
    text = str(tree["campaign_posterior"].attrs.get("left_at_prior", ""))
    return tuple(text.split(",")) if text else ()


def curve_remark(tree: "xr.DataTree") -> tuple[str, ...]:
    """What a fit found of rigs that lie off its curve, and of amplitudes that are stated otherwise."""
    attributes = tree["campaign_posterior"].attrs
    return tuple(line for name in ("off_curve", "off_stated") for line in str(attributes.get(name, "")).splitlines())


def doubted(tree: "xr.DataTree") -> str:
    """Why no law of the card holds, in a clause; empty where one does, and of fits that do not know it."""
    return str(tree["laws"].attrs.get("doubted", "")) if "laws" in tree else ""


def doubted_remark(tree: "xr.DataTree") -> tuple[str, ...]:
    """What has to be said where no law of the card holds; empty otherwise."""
    if not (why := doubted(tree)):
        return ()
    return (f"no law of the card holds, since {why}: trust amplitudes at and between tested Scruton numbers alone",)


def failed(tree: "xr.DataTree") -> list[str]:
    """Names of all posteriors that did not converge; none where a fit does not say."""
    if "convergence" not in tree:
        return []
    table = tree["convergence"]
    names = table["posterior"].to_numpy()[~table["converged"].to_numpy().astype(bool)]
    return list(dict.fromkeys(map(str, names)))


def unconverged(tree: "xr.DataTree") -> list[str]:
    """Names of the posteriors that did not converge though predictions or tables rest on them.

    Little rests on the campaign model under a law to which the records give no weight, and nothing, where that is the
    reference law, on what a peak test says alone under it; but the model over wind speeds takes every test's own.
    """
    laws = told_weights(tree) if "laws" in tree else {}
    idle = {f"{CAMPAIGN} {label}" for label, weight in laws.items() if weight <= CARRIES}
    if laws and "speeds" not in tree and not np.isnan(n := float(tree["constant_data"]["law_n"])):
        carried = laws.get(f"n={n:g}", 0.0) > CARRIES
        peaks = () if carried else tree["campaign_posterior"]["peak_test"].to_numpy()
        idle |= {f"{TEST} {name}" for name in peaks}
    return [name for name in failed(tree) if name not in idle]
