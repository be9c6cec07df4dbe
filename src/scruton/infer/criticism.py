"""Everything that a statistician asks of a fit, from its results alone, and what of the answers needs a look.

The checks themselves live in `replication` (prior and posterior predictive), `whiteness` (innovations) and
`sensitivity` (power scaling, identifiability, influence).  Here they are run over tests and records, and every answer
that is out of the ordinary becomes a flag with a sentence of its own.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.documents import as_json
from scruton.infer import replication, sensitivity
from scruton.infer import thresholds as limits
from scruton.infer.joint import curve_remark, doubted_remark
from scruton.infer.models import NOISE
from scruton.infer.replication import BandShare, PriorCheck
from scruton.infer.sensitivity import Influence, Moved, PredictionSensitivity, Scaling
from scruton.infer.store import stored_inputs
from scruton.shown import shown
from scruton.stats import whiteness
from scruton.stats.whiteness import Check

if TYPE_CHECKING:
    import xarray as xr

# Parameters whose prior is meant to speak, or of which nothing hangs: no flag where the data leave them where they are.
MEANT_TO_STAY = (
    *NOISE,
    "damping_ratio",
    "discrepancy_amplitude",
    "discrepancy_relaxation",
)
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class Flag:
    """One thing to look at.

    Attributes
    ----------
    check : str
        The part of the criticism that it comes from.
    where : str
        Test, record and parameter.
    text : str
        A sentence: what was found, and what it means.
    serious : bool
        Whether the fit is not to be trusted for it.
    """

    check: str
    where: str
    text: str
    serious: bool = False


def _facts(one: "Criticism") -> Mapping[str, object]:
    serious = sum(flag.serious for flag in one.flags)
    return {"ok": one.ok, "flags": len(one.flags), "serious": serious, "not_checked": len(one.missing)}


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Criticism:
    """The answers.

    Attributes
    ----------
    innovations, predictive : tuple of Check
        p-values adjusted over records.
    shares : tuple of BandShare
    prior : tuple of PriorCheck
    scaling : tuple of Scaling
    moved : tuple of Moved
        Of the tests; then those of the campaign model, whose `test` is empty.
    influence : tuple of Influence
    missing : tuple of str
        Checks that could not be made, with the reason.
    flags : tuple of Flag
    bands : mapping
        Prior predictive quantiles (5, 25, 50, 75, 95 %) of every (test, record), (5, N).
    model : str
        What was examined: the model that predicts.
    predictions : tuple of PredictionSensitivity
    """

    innovations: tuple[Check, ...]
    predictive: tuple[Check, ...]
    shares: tuple[BandShare, ...]
    prior: tuple[PriorCheck, ...]
    scaling: tuple[Scaling, ...]
    moved: tuple[Moved, ...]
    influence: tuple[Influence, ...]
    missing: tuple[str, ...]
    flags: tuple[Flag, ...]
    bands: Mapping[tuple[str, str], FloatArray] = field(default_factory=dict)
    model: str = ""
    predictions: tuple[PredictionSensitivity, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether nothing serious was found."""
        return not any(flag.serious for flag in self.flags)

    def rows(self) -> dict[str, list[dict[str, Any]]]:
        """Every answer as rows, by part."""
        parts: dict[str, Sequence[Any]] = {
            "innovations": self.innovations,
            "posterior_predictive": self.predictive,
            "predictive_bands": self.shares,
            "prior_predictive": self.prior,
            "prior_sensitivity": self.scaling,
            "identifiability": self.moved,
            "influence": self.influence,
            "prediction_sensitivity": self.predictions,
        }
        return {name: [asdict(row) for row in part] for name, part in parts.items()}

    def to_json(self) -> dict[str, Any]:
        """Everything but the bands, with null for numbers that are missing."""
        content = {"format": 1, "model": self.model, "ok": self.ok, "flags": self.flags, "missing": self.missing}
        return as_json(content | self.rows())  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False)
class RecordOf:
    """Where a transient record's cycles lie in the tree, and what they are."""

    test: str
    record: str
    index: np.ndarray
    time: FloatArray
    amplitude: FloatArray
    standard_error: FloatArray


def records(tree: "xr.DataTree") -> Iterator[RecordOf]:
    """Every transient record of every test, in the order of the tree."""
    if "observed_data" not in tree or "record" not in tree["constant_data"]:
        return
    constant = tree["constant_data"]
    test, record = (constant[key].to_numpy().astype(str) for key in ("record_test", "record"))
    arrays = [constant["time"], tree["observed_data"]["amplitude"], constant["standard_error"]]
    values = [np.asarray(array.to_numpy(), dtype=float) for array in arrays]
    for pair in dict.fromkeys(zip(test.tolist(), record.tolist(), strict=True)):
        index = np.flatnonzero((test == pair[0]) & (record == pair[1]))
        yield RecordOf(pair[0], pair[1], index, *(array[index] for array in values))


def criticise_tree(tree: "xr.DataTree", summary: Mapping[str, Any], *, seed: int = 0) -> Criticism:
    """Run every check that the results of a fit allow, on the model that predicts.

    Parameters
    ----------
    tree : DataTree
        With a group `posterior`; a campaign of still air alone has none.
    summary : mapping
        What fit.json holds.
    seed : int
        Of the prior predictive replicates, the only randomness.
    """
    missing = [] if "examined" in tree else ["sensitivity: the results hold no model that predicts; fit again"]
    judged = [record for record in records(tree) if record.time.size >= limits.FEWEST_CYCLES]
    if not judged:
        missing.append("innovations, predictive checks, influence: no transient record holds enough cycles")
    innovations: tuple[Check, ...] = ()
    if judged and "innovations" in tree:
        end_to_end = np.asarray(tree["innovations"]["amplitude"].to_numpy(), dtype=float).reshape(-1)
        amplitude = np.asarray(tree["observed_data"]["amplitude"].to_numpy(), dtype=float)
        whose = (tree["constant_data"][key].to_numpy().astype(str) for key in ("record_test", "record"))
        innovations = whiteness.judge(end_to_end, amplitude, *whose)
    elif judged:
        missing.append("whiteness of the innovations: the results do not hold them; fit again")
    predictive: list[Check] = []
    shares: list[BandShare] = []
    if judged and "posterior_predictive" in tree:
        group = tree["posterior_predictive"]
        runs = [group[name].to_numpy() for name in ("amplitude", "mean_amplitude")]
        runs = [run.reshape(-1, run.shape[-1]) for run in runs]
        for record in judged:
            replicate, mean = (run[:, record.index] for run in runs)
            checks, share = replication.posterior_check(
                record.test, record.record, record.time, record.amplitude, replicate, mean
            )
            predictive += checks
            shares += share
    elif judged:
        missing.append("posterior predictive: the results hold no free runs; fit again")
    prior, bands = _prior(tree, judged, seed) if judged and "prior" in tree else ((), {})
    scaling = sensitivity.power_scaling(tree)
    moved = sensitivity.identifiability(tree)
    if "inputs" in tree:
        moved = (*moved, *sensitivity.campaign_identifiability(tree, stored_inputs(tree)[1]))
    elif "campaign_posterior" in tree:
        missing.append("identifiability of the campaign model: the results hold no model card; fit again")
    influence = sensitivity.influences(tree)
    alone = [
        name for name in dict.fromkeys(record.test for record in judged) if name not in {row.test for row in influence}
    ]
    if alone:
        missing.append(f"influence: {', '.join(alone)} rests on one record, which cannot be left out")
    # What reweighting cannot tell is a check that could not be made, and no doubt about the record.
    untold = dict.fromkeys(f"{row.record} of {row.test}" for row in influence if not row.trusted)
    if untold:
        text = "so much of their test rests on them that reweighting cannot tell what the others say alone"
        missing.append(f"influence of {', '.join(untold)}: {text} (k-hat above {limits.TRUSTED_KHAT})")
    adjusted = whiteness.adjust(predictive, [replication.STATISTICS])
    flags: list[Flag] = []
    if not summary.get("converged", True):
        text = "the fit did not converge: what follows may judge draws that are not the posterior's"
        flags.append(Flag("sampling", "", text, True))
    if "campaign_posterior" in tree:
        flags += [Flag("laws", "", remark) for remark in (*doubted_remark(tree), *curve_remark(tree))]
    if "effect" in tree:
        effect = tree["effect"].attrs["effect"]
        missing.append(f"the curve with {effect}, which predicts: what follows examines the law without it")
    asked: dict[str, Sequence[Any]] = {
        "innovations": innovations,
        "posterior predictive": adjusted,
        "prior predictive": prior,
        "prior sensitivity": scaling,
        "identifiability": moved,
        "influence": influence,
    }
    for check, row in ((check, row) for check, rows in asked.items() for row in rows):
        own = (row.test or "campaign", getattr(row, "record", ""), getattr(row, "parameter", ""))
        flags += [Flag(check, ", ".join(filter(None, own)), *doubt) for doubt in _doubts(row)]
    return Criticism(
        innovations, adjusted, tuple(shares), prior, scaling, moved, influence, tuple(missing), tuple(flags), bands,
        _model(tree),
    )  # fmt: skip


def _model(tree: "xr.DataTree") -> str:
    """What is examined, in words."""
    if "examined" not in tree:
        return ""
    of = tree["examined"].attrs
    law, peaks = of["law"], int(of["peaks"])
    others = int(tree["examined"].sizes["test"]) - peaks
    words = f"the law {law}, which has the most weight in predictions, and the joint posterior of "
    words += f"{peaks} peak test{'s' if peaks > 1 else ''}"
    if "runs" in of:
        words += f"; free runs are of every law by its weight ({of['runs']})"
    return words + (f"; {others} at other wind speeds by the reference law" if others else "")


def _prior(
    tree: "xr.DataTree", judged: Sequence[RecordOf], seed: int
) -> tuple[tuple[PriorCheck, ...], dict[tuple[str, str], FloatArray]]:
    group, constant = tree["prior"].to_dataset(), tree["constant_data"]
    checks, bands = [], {}
    largest = max(float(record.amplitude.max()) for record in judged)
    for record in judged:
        draws = {str(name): group[name].sel(test=record.test).to_numpy().reshape(-1) for name in group.data_vars}
        rate = draws["relaxation_ratio"] * (2.0 * np.pi * float(constant["frequency"].sel(test=record.test)))
        n = tree["examined"].attrs["n"] if "examined" in tree else constant["law_n"]
        law = draws.get("law_exponent", np.full_like(rate, float(n)))
        prior = draws | {"a_star": draws["stable_amplitude"], "relaxation_rate": rate, "n": law}
        # A seed of its own for every record: leaving one out changes no number of another.
        rng = np.random.default_rng([seed, zlib.crc32(f"{record.test}/{record.record}".encode())])
        replicate = replication.prior_replicates(
            record.time, record.standard_error, float(record.amplitude[0]), prior, rng
        )
        checks.append(
            replication.prior_check(record.test, record.record, record.time, record.amplitude, replicate, rate, largest)
        )
        bands[record.test, record.record] = np.quantile(replicate, QUANTILES, axis=0)
    return tuple(checks), bands


_MEANING = {
    whiteness.MEMORY: "the innovations have a memory: the state relaxes otherwise than the model says",
    whiteness.TREND: "the innovations follow the amplitude: the law of damping has another shape",
    whiteness.LAW: "over all records the innovations bend with the amplitude: the law of damping has another shape, "
    "compare the weights of other laws",
    whiteness.MEAN: "the innovations are not centred: the filter expects too much or too little throughout",
    whiteness.VARIANCE: "the innovations are not of unit variance: scatter or noise differ between the records",
    whiteness.NORMALITY: "the innovations are not normal: heavy tails or outliers, look for cycles gone wrong",
}


def _doubts(row: Check | PriorCheck | Scaling | Moved | Influence) -> Iterator[tuple[str, bool]]:
    """What of one answer is out of the ordinary, in a sentence, and whether it is serious."""
    match row:
        case Check() if row.adjusted < limits.WORTH_A_LOOK:
            p = f"{row.adjusted:.1g}" if row.adjusted >= 1e-6 else "1e-6 or less"
            expected = f"{row.low:.3g} to {row.high:.3g} in 90 % of cases, p = {p}"
            if row.name in _MEANING:
                serious = row.name in whiteness.PREDICTABLE and row.adjusted < limits.SERIOUS_WHITENESS
                yield f"{_MEANING[row.name]} ({row.name} {row.value:.3g}, expected {expected})", serious
            else:
                side = "more" if row.value > 0.5 * (row.low + row.high) else "less"
                text = f"{row.name} {row.value:.3g} is {side} than the model produces ({expected})"
                yield text, row.adjusted < limits.SERIOUS_PREDICTIVE
        case PriorCheck():
            for what, p_value in (("time to half", row.p_half), ("final level", row.p_final)):
                if p_value < limits.WORTH_A_LOOK:
                    text = f"the prior under this law hardly admits the record's {what} (p = {p_value:.2g})"
                    yield f"{text}: mend one or the other", False
            if row.huge > limits.ABSURD:
                text = f"{row.huge:.0%} of the prior exceeds ten times the campaign's largest amplitude"
                yield f"{text}: it says too little", False
            if row.instant > limits.ABSURD:
                text = f"{row.instant:.0%} of the prior relaxes within one cycle"
                yield f"{text}, where no amplitude equation holds", False
        case Scaling(diagnosis=sensitivity.CONFLICT):
            both = f"both the card's priors ({row.prior:.2f}) and the records ({row.likelihood:.2f})"
            yield (
                f"prior-data conflict: the posterior follows {both}; ask whether the prior or the model is wrong",
                False,
            )
        case Scaling(diagnosis=sensitivity.WEAK):
            text = f"the card's priors ({row.prior:.2f}) rather than the records ({row.likelihood:.2f})"
            yield f"weak likelihood: the posterior follows {text}", False
        case Moved() if row.parameter not in MEANT_TO_STAY and row.ratio > limits.BARELY_MOVED:
            yield f"{row.verdict}: its posterior sd is {row.ratio:.2f} of the prior's", False
        case Influence(trusted=True) if abs(row.shift) > limits.MOVES or abs(row.z) > limits.DISAGREES:
            text = f"leaving this record out moves the posterior by {row.shift:+.1f} of its sds"
            if abs(row.z) > limits.DISAGREES:
                text += f": it disagrees with the other records (z = {row.z:.1f})"
            yield text, False
