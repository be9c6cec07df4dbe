"""Two fits side by side: what differs between them beyond Monte Carlo error, and what does not."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.select import names_meant
from scruton.errors import InputError
from scruton.griffin.posterior import motion_of, printed_draws, test_names
from scruton.griffin.predict import predict
from scruton.griffin.thresholds import BEYOND_ERROR, WIDTH_APART
from scruton.stats.convergence import monte_carlo_error

if TYPE_CHECKING:
    import xarray as xr

COMPARED = ("scruton_number", "a_star", "relaxation_rate", "Y1", "epsilon")  # of a test, by their names in fit.json
ALIKE, MOVED, APART = "alike", "moved", "apart"
WIDER, NARROWER = "wider", "narrower"
# Standard error of the width of a 90 % interval over that of the median, of a normal distribution: each end's is
# (0.05 * 0.95)^0.5 / 0.1031 where the median's is 0.5 / 0.3989, and the two ends are nearly independent.
_ERROR_OF_WIDTH = 2.3


@dataclass(frozen=True)
class Side:
    """A quantity in one of the two: median, 90 % interval, and the Monte Carlo standard error of the median."""

    median: float
    low: float
    high: float
    error: float


@dataclass(frozen=True)
class Difference:
    """A quantity in both; None on the side that does not have it.

    Attributes
    ----------
    name : str
        Of the quantity, as fit.json has it; "amplitude" of a prediction, "weight" of a law, "required_damping".
    of : str
        The rig, the test, the Scruton number, the law or the mode.
    unit : str
        "-" where there is none.
    """

    name: str
    of: str
    unit: str
    first: Side | None
    second: Side | None

    @property
    def verdict(self) -> str:
        """Either "alike" within Monte Carlo error, "moved" beyond it, or "apart" as 90 % intervals; "" of one side."""
        a, b = self.first, self.second
        if a is None or b is None:
            return ""
        if (a.low < a.high or b.low < b.high) and (a.low > b.high or b.low > a.high):  # a weight has no interval
            return APART
        return MOVED if abs(b.median - a.median) > BEYOND_ERROR * float(np.hypot(a.error, b.error)) else ALIKE

    @property
    def width_ratio(self) -> float:
        """Width of the 90 % interval of the second over that of the first; NaN where there are not both."""
        a, b = self.first, self.second
        # the ends of a required damping are those of the confidences that were asked for, no interval of its own
        if a is None or b is None or self.name == "required_damping" or not (a.low < a.high and b.low < b.high):
            return math.nan
        return (b.high - b.low) / (a.high - a.low)

    @property
    def spread(self) -> str:
        """Either "wider" or "narrower" where the second interval is so by half and beyond Monte Carlo error; or ""."""
        a, b, ratio = self.first, self.second, self.width_ratio
        if a is None or b is None or math.isnan(ratio):
            return ""
        error = _ERROR_OF_WIDTH * math.hypot(a.error / (a.high - a.low), b.error / (b.high - b.low))
        if not abs(math.log(ratio)) > max(math.log(WIDTH_APART), BEYOND_ERROR * error):
            return ""
        return WIDER if ratio > 1.0 else NARROWER

    @property
    def change(self) -> float:
        """Relative change of the median from the first to the second; NaN where there is none."""
        a, b = self.first, self.second
        return b.median / a.median - 1.0 if a is not None and b is not None and a.median else float("nan")


def differences(
    first: "tuple[xr.DataTree, Mapping[str, Any]]",
    second: "tuple[xr.DataTree, Mapping[str, Any]]",
    *,
    tests: Sequence[str] = (),
    scruton_numbers: Sequence[float] = (),
    seed: int = 0,
) -> tuple[Difference, ...]:
    """Compare what two fits say of rigs and tests of one name, of the laws, and at design Scruton numbers.

    Parameters
    ----------
    first, second : (DataTree, mapping)
        As `read_tree` gives them.
    tests : sequence of str
        Only these, each a name or names with commas between them; all if left out.
    scruton_numbers : sequence of float
        To predict the stable amplitude at.
    seed : int
        Of the predictions.

    Raises
    ------
    InputError
        If one is of heaving and the other of torsion, or neither has a test of a name that is asked for.
    """
    trees, summaries = (first[0], second[0]), (first[1], second[1])
    motions = [motion_of(tree) for tree in trees]
    if motions[0] != motions[1]:
        wanted = "two of one motion: amplitudes of the others have nothing in common"
        raise InputError("command line", "", f"a fit of {motions[0].value} and one of {motions[1].value}", wanted)
    names = list(dict.fromkeys(name for tree in trees for name in test_names(tree)))
    chosen = names_meant(tests, names, "command line", "--test")
    unit = str(summaries[0]["amplitude_unit"])
    found = [_of_rigs(trees, summaries)]
    found += [_of_tests(trees, chosen or names, unit), _of_laws(summaries)]
    if all(map(test_names, trees)):
        found.append(_of_predictions(trees, scruton_numbers, unit, seed))
    return tuple(one for part in found for one in part)


def _of_rigs(trees: "Sequence[xr.DataTree]", summaries: Sequence[Mapping[str, Any]]) -> Iterator[Difference]:
    for name in dict.fromkeys(rig["name"] for summary in summaries for rig in summary["rigs"]):
        yield _both("damping_ratio", name, "-", [_rig_draws(tree, name) for tree in trees])


def _rig_draws(tree: "xr.DataTree", name: str) -> FloatArray | None:
    if "rig_posterior" not in tree or name not in tree["rig_posterior"]["rig"].to_numpy():
        return None
    return np.asarray(tree["rig_posterior"]["damping_ratio"].sel(rig=name).transpose("chain", "draw").to_numpy())


def _of_tests(trees: "Sequence[xr.DataTree]", names: Sequence[str], unit: str) -> Iterator[Difference]:
    units = {"a_star": unit, "relaxation_rate": "1/s"}
    drawn = [{name: printed_draws(tree, name) for name in test_names(tree)} for tree in trees]
    for key in COMPARED:
        for name in names:
            sides = [draws[name].get(key) if name in draws else None for draws in drawn]
            if any(side is not None for side in sides):
                pair = [None if side is None else _chains(side, tree) for side, tree in zip(sides, trees, strict=True)]
                yield _both(key, name, units.get(key, "-"), pair)


def _chains(draws: FloatArray, tree: "xr.DataTree") -> FloatArray:
    """Draws (S,) by the chains that they come from, one after the other."""
    count = int(tree["posterior"].sizes["chain"])
    return draws.reshape(count if draws.size % count == 0 else 1, -1)


def _of_laws(summaries: Sequence[Mapping[str, Any]]) -> Iterator[Difference]:
    weighed = [summary["laws"].get("weights", {}) for summary in summaries]
    for law in dict.fromkeys(law for weights in weighed for law in weights):
        yield Difference("weight", law, "-", *(_weight(weights, law) for weights in weighed))


def _weight(weights: Mapping[str, Any], law: str) -> Side | None:
    """The weight of a law; its error is that of the log evidences, of which the weight is the logistic function."""
    if law not in weights:
        return None
    weight = float(weights[law]["weight"])
    errors = [entry["log_evidence_error"] or 0.0 for entry in weights.values()]
    return Side(weight, weight, weight, weight * (1.0 - weight) * float(np.hypot.reduce(errors)))


def _of_predictions(
    trees: "Sequence[xr.DataTree]", scruton_numbers: Sequence[float], unit: str, seed: int
) -> Iterator[Difference]:
    for sc in scruton_numbers:
        made = [predict(tree, scruton_number=float(sc), seed=seed) for tree in trees]
        sides = (Side(one.median, *one.interval(0.90), one.error(0.5)) for one in made)
        yield Difference("amplitude", f"Sc {sc:g}", unit, *sides)


def _both(name: str, of: str, unit: str, draws: Sequence[FloatArray | None]) -> Difference:
    return Difference(name, of, unit, *(None if one is None else _side(one) for one in draws))


def _side(draws: FloatArray) -> Side:
    """Summarise draws (chains, draws)."""
    low, median, high = map(float, np.quantile(draws, (0.05, 0.5, 0.95)))
    return Side(median, low, high, monte_carlo_error(draws, 0.5))
