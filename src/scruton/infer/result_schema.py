"""The layout of a fit's results: every group and variable of posterior.nc, stated once.

What writes the results, what reads them back and what makes them up for tests are all built on `SCHEMA`; a variable
that does not stand here cannot be written, and results that lack a group's variables are not read.

A chain is one ensemble: its walkers, each a run of its own, lie end to end (`joined`).  The ensembles are independent,
so that R-hat over chains compares what it should.  An autocorrelation that is averaged along a chain holds the pairs
within a walker and, weighted with zero, those across two of them: what comes out is the variance of a mean over walkers
that were each so long, and hence the right effective number of draws.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.arrays import FloatArray

if TYPE_CHECKING:
    import xarray as xr

EITHER = "A/D or rad"  # unit of amplitudes: of heaving, of torsion
_TEST, _RIG, _CYCLE, _LAW = ("test",), ("rig",), ("cycle",), ("law",)
_DRAW = ("chain", "draw")
_DRAWS_OF_TEST, _DRAWS_OF_CYCLE, _DRAWS_OF_RECORD = ((*_DRAW, axis) for axis in ("test", "cycle", "record"))
_DRAWS_OF_LAW, _DRAWS_OF_PEAK = ("law", *_DRAW), ("law", *_DRAW, "peak_test")


@dataclass(frozen=True)
class Variable:
    """One variable of a group.

    Attributes
    ----------
    name : str
    dims : tuple of str
    kind : {"f", "i", "b", "U"}
        Of its numpy dtype: float64, int64, bool or text.
    unit, meaning : str
    optional : bool
        Whether a fit may lack it while it has the group.
    """

    name: str
    dims: tuple[str, ...]
    kind: str
    unit: str
    meaning: str
    optional: bool = False


def _parameters(dims: tuple[str, ...], meaning: str) -> tuple[Variable, ...]:
    """The parameters of a test in wind, by the names of their priors."""
    names = (
        "stable_amplitude", "relaxation_ratio", "amplitude_scatter", "noise_factor", "gust_scatter", "gust_time",
        "set_point_scatter", "departure_scale", "damping_ratio",
    )  # fmt: skip
    free = Variable("law_exponent", dims, "f", "", meaning, optional=True)
    return (*(Variable(name, dims, "f", "", meaning) for name in names), free)


def _of_test(dims: tuple[str, ...], *, forces_may_lack: bool) -> tuple[Variable, ...]:
    """What follows from the parameters of a test."""
    return (
        Variable("a_star", dims, "f", EITHER, "stable amplitude"),
        Variable("relaxation_rate", dims, "f", "1/s", "lambda"),
        Variable("amplitude_scatter", dims, "f", "-", "stationary sd that turbulence gives the amplitude, over a_star"),
        Variable("noise_factor", dims, "f", "-", "sensor noise over the standard errors of the cycles"),
        Variable("gust_scatter", dims, "f", "-", "sd that slow gusts give the stable amplitude, over a_star"),
        Variable("gust_time", dims, "f", "1/lambda", "correlation time of the gusts, in relaxation times"),
        Variable("departure_scale", dims, "f", "-", "sd of the drift about the law, over it, one e-fold from a_star"),
        Variable("set_point_scatter", dims, "f", "-", "sd of the stable amplitude from record to record, over a_star"),
        Variable("damping_ratio", dims, "f", "-", "structural damping xi_s"),
        Variable("scruton_number", dims, "f", "-", "Sc"),
        Variable("mass_damping_factor", dims, "f", "-", "Sc per unit of damping ratio"),
        Variable("Y1", dims, "f", "-", "Eq. (9); under n = -1 alone", forces_may_lack),
        Variable("epsilon", dims, "f", "-", "Eq. (9); under n = -1 alone", forces_may_lack),
    )


def _derived(dims: tuple[str, ...]) -> tuple[Variable, ...]:
    """What follows from the parameters of a test that is fitted alone."""
    return (
        *_of_test(dims, forces_may_lack=True),
        Variable("relaxation_scruton_number", dims, "f", "-", "Sc_lambda, of the relaxation rate"),
        Variable("law_exponent", dims, "f", "-", "n, where it is free", optional=True),
    )


def _optional(variable: Variable) -> Variable:
    return replace(variable, optional=True)


def _diagnostics(of: tuple[str, ...]) -> tuple[Variable, ...]:
    """What the sampler says of itself, of its run before that was thinned."""
    each = (*of, "parameter")
    stated = (
        Variable("acceptance_rate", of, "f", "-", "share of the proposals that were accepted"),
        Variable("steps", of, "i", "-", "kept a walker, before thinning"),
        Variable("stuck_walkers", of, "i", "-", "walkers in a mode of their own"),
        Variable("converged", of, "b", "-", "the verdict"),
        Variable("autocorrelation_time", each, "f", "-", "integrated, in steps of a walker"),
        Variable("ess_bulk", each, "f", "-", "effective draws of the run"),
        Variable("ess_tail", each, "f", "-", "effective draws of the run in the tails"),
        Variable("rhat_nested", each, "f", "-", "nested R-hat over the ensembles"),
    )
    return tuple(_optional(variable) for variable in stated)


_SHARED_NAMES = {variable.name for variable in _parameters((), "")}
_CURVE = (
    ("n", "-", "exponent of the law"),
    ("reference_amplitude", EITHER, "of the shared curve, at the reference Sc"),
    ("reference_relaxation", "-", "Sc_lambda of the shared curve there"),
    ("discrepancy_amplitude", "-", "tau, sd of ln a_star between settings"),
    ("discrepancy_relaxation", "-", "kappa, sd of ln G between settings"),
)


def _campaign(curve: tuple[str, ...], tests: tuple[str, ...]) -> tuple[Variable, ...]:
    """The campaign model: its curve and its peak tests."""
    of_curve = (Variable(name, curve, "f", unit, meaning) for name, unit, meaning in _CURVE)
    return (*of_curve, *_of_test(tests, forces_may_lack=False))


MODEL = "campaign_model"
EXAMINED_LIKELIHOOD = "examined_log_likelihood"
SCHEMA: Mapping[str, tuple[Variable, ...]] = {
    "rig_posterior": (Variable("damping_ratio", (*_DRAW, "rig"), "f", "-", "structural damping xi_s in still air"),),
    "posterior": _derived(_DRAWS_OF_TEST),
    "examined": (
        # The model that predicts, under the law with the most weight: the joint posterior of the peak tests, and of
        # other tests their own.
        *_of_test(_DRAWS_OF_TEST, forces_may_lack=True),
        Variable("law_exponent", _DRAWS_OF_TEST, "f", "-", "n, where it is free", optional=True),
        Variable("lp_prior", _DRAWS_OF_TEST, "f", "-", "log density of the priors of amplitude, relaxation and n"),
        Variable("lp_noise", _DRAWS_OF_TEST, "f", "-", "log density of the priors of noise and discrepancies"),
        Variable("lp_still_air", _DRAWS_OF_TEST, "f", "-", "log density of what still air says of xi_s"),
        Variable("lp_records", _DRAWS_OF_TEST, "f", "-", "log likelihood of the records in wind, up to a constant"),
    ),
    "sample_stats": (
        Variable("lp", _DRAWS_OF_TEST, "f", "-", "log posterior up to a constant"),
        *_diagnostics(_TEST),
    ),
    "log_prior": _parameters(_DRAWS_OF_TEST, "log prior density of the sampled coordinate"),
    "prior": (
        *_parameters(_DRAWS_OF_TEST, "draws of the prior within the constraint"),
        *(_optional(one) for one in _derived(_DRAWS_OF_TEST) if one.name not in _SHARED_NAMES),
    ),
    "prior_predictive": (Variable("amplitude", _DRAWS_OF_CYCLE, "f", EITHER, "records that the prior alone expects"),),
    "log_likelihood": (Variable("records", _DRAWS_OF_TEST, "f", "-", "of all records of a test, up to a constant"),),
    EXAMINED_LIKELIHOOD: (
        # Of the draws of `examined`, as all that follows by cycle.
        Variable("amplitude", _DRAWS_OF_CYCLE, "f", "-", "of every cycle given those before it, thinned"),
        Variable("steady", _DRAWS_OF_TEST, "f", "-", "of the steady amplitudes of a test"),
    ),
    "posterior_predictive": (
        Variable("amplitude", _DRAWS_OF_CYCLE, "f", EITHER, "free runs with turbulence and sensor noise"),
        Variable("mean_amplitude", _DRAWS_OF_CYCLE, "f", EITHER, "the same without noise"),
    ),
    "innovations": (Variable("amplitude", _CYCLE, "f", "-", "standardised, at the posterior median"),),
    "observed_data": (Variable("amplitude", _CYCLE, "f", EITHER, "one a cycle"),),
    "constant_data": (
        Variable("width", (), "f", "m", "B"),
        Variable("depth", (), "f", "m", "D"),
        Variable("law_n", (), "f", "-", "exponent of the reference law; NaN where it is free"),
        Variable("motion", (), "U", "", "heaving or torsional"),
        Variable("amplitude_unit", (), "U", "", "A/D or rad"),
        Variable("mass", _TEST, "f", "kg/m or kg m", "effective, per unit length", optional=True),
        Variable("air_density", _TEST, "f", "kg/m^3", "", optional=True),
        Variable("wind_speed", _TEST, "f", "m/s", "U", optional=True),
        Variable("frequency", _TEST, "f", "Hz", "f0, in still air", optional=True),
        Variable("wind_frequency", _TEST, "f", "Hz", "of the vibration in wind", optional=True),
        Variable("rig", _TEST, "U", "", "name", optional=True),
        Variable("peak", _TEST, "i", "", "1 for the peak tests of the rigs", optional=True),
        Variable("stable_amplitude", _TEST, "f", EITHER, "as measured; NaN where it is not", optional=True),
        Variable("stable_amplitude_sd", _TEST, "f", EITHER, "of the measured one", optional=True),
        Variable("transient_low", _TEST, "f", EITHER, "lowest of its transients; NaN without one", optional=True),
        Variable("transient_high", _TEST, "f", EITHER, "highest of its transients; NaN without one", optional=True),
        Variable("time", _CYCLE, "f", "s", "middle of the cycle", optional=True),
        Variable("standard_error", _CYCLE, "f", EITHER, "of the amplitude of the cycle", optional=True),
        Variable("record", _CYCLE, "U", "", "name of the record", optional=True),
        Variable("record_test", _CYCLE, "U", "", "name of its test", optional=True),
    ),
    "campaign_posterior": _campaign(_DRAWS_OF_LAW, _DRAWS_OF_PEAK),
    # The campaign model under the law with the most weight, as ArviZ reads a model: all groups of the same draws.
    MODEL: (),
    f"{MODEL}/posterior": tuple(map(_optional, _campaign(_DRAW, _DRAWS_OF_TEST))),
    f"{MODEL}/prior": tuple(map(_optional, _campaign(_DRAW, _DRAWS_OF_TEST))),
    f"{MODEL}/sample_stats": (Variable("lp", _DRAW, "f", "-", "log posterior up to a constant"), *_diagnostics(())),
    f"{MODEL}/log_prior": (
        Variable("curve", _DRAW, "f", "-", "log prior density of the shared curve"),
        Variable("discrepancy", _DRAW, "f", "-", "log prior density of the scales between settings"),
        Variable("noise", _DRAWS_OF_TEST, "f", "-", "log prior density of noise and departure"),
        Variable("damping_ratio", _DRAWS_OF_TEST, "f", "-", "log density of what still air says of xi_s"),
    ),
    f"{MODEL}/log_likelihood": (
        Variable("amplitude", _DRAWS_OF_CYCLE, "f", "-", "of every cycle given those before it", optional=True),
        Variable("steady", _DRAWS_OF_TEST, "f", "-", "of the steady amplitudes of a test"),
    ),
    f"{MODEL}/posterior_predictive": (
        Variable("amplitude", _DRAWS_OF_CYCLE, "f", EITHER, "of every cycle given those observed before it"),
    ),
    f"{MODEL}/prior_predictive": (
        Variable("amplitude", _DRAWS_OF_CYCLE, "f", EITHER, "records that the prior alone expects"),
    ),
    f"{MODEL}/observed_data": (Variable("amplitude", _CYCLE, "f", EITHER, "one a cycle"),),
    "law_free": (
        Variable("level_amplitude", ("test", "level"), "f", EITHER, "that the test's transients went through"),
        Variable(
            "level_scruton_number",
            ("sample", "test", "level"),
            "f",
            "-",
            "Sc at which it would be stable, by the damping measured there",
        ),
    ),
    # The drift of the model that predicts over that of its law, for some of the draws that are printed.
    "departure": (
        Variable("draw_number", ("sample", "test"), "i", "-", "place among the draws of the test, chain after chain"),
        Variable("column", ("sample", "test", "ramp"), "f", "-", "theta; zero for a test without transients"),
        Variable("shared_column", ("sample", "ramp"), "f", "-", "of peak tests, shared, over its scale", optional=True),
        # Where structural damping varies with amplitude in some rig.
        Variable("rate_ratio", ("sample", "test"), "f", "-", "lambda of the whole drift over the law's", optional=True),
        Variable("structural_amplitude", ("test", "point"), "f", EITHER, "NaN where xi_s is constant", optional=True),
        Variable("structural_damping", ("test", "point"), "f", "-", "xi_s(A) there", optional=True),
    ),
    "laws": (
        Variable("prior_weight", _LAW, "f", "-", "of the card"),
        Variable("weight", _LAW, "f", "-", "that predictions use"),
        Variable("common_weight", _LAW, "f", "-", "of it, what neither evidence nor stacking gave", optional=True),
        Variable("stacking_weight", _LAW, "f", "-", "NaN where stacking was not asked for"),
        Variable("log_evidence", _LAW, "f", "-", "by bridge sampling; by Laplace's approximation where not sampled"),
        Variable("log_evidence_error", _LAW, "f", "-", "standard error; NaN where not sampled"),
        Variable("sampled", _LAW, "f", "-", "1 for laws that were sampled"),
    ),
    "trial_function": (
        Variable("a", _DRAWS_OF_RECORD, "f", EITHER, "Eq. (4)"),
        Variable("b", _DRAWS_OF_RECORD, "f", "1/s", "Eq. (4)"),
        Variable("c", _DRAWS_OF_RECORD, "f", EITHER, "Eq. (4)"),
        Variable("d", _DRAWS_OF_RECORD, "f", "1/s", "Eq. (4); d < b"),
        Variable("residual_sd", _DRAWS_OF_RECORD, "f", EITHER, "stationary sd of the residual"),
        Variable("residual_rate", _DRAWS_OF_RECORD, "f", "1/s", "at which the residual forgets"),
        Variable("origin", ("record",), "f", "s", "time that t is counted from"),
        Variable("end", ("record",), "f", "s", "of the last cycle"),
        Variable("record_test", ("record",), "U", "", "name of the record's test"),
    ),
    "speeds": (
        *(Variable(name, (*_DRAW, "velocity"), "f", "-", "of the peak") for name in ("ln_amplitude", "ln_relaxation")),
        Variable("scale_amplitude", _DRAW, "f", "-", "s_A"),
        Variable("scale_relaxation", _DRAW, "f", "-", "s_G"),
        Variable("length", _DRAW, "f", "U/(f0 D)", "l"),
        Variable("scale_shift", _DRAW, "f", "-", "s_v"),
        Variable("discrepancy_amplitude", _DRAW, "f", "-", "tau"),
        Variable("discrepancy_relaxation", _DRAW, "f", "-", "kappa"),
        Variable("shift", (*_DRAW, "rig"), "f", "-", "of ln v"),
        Variable("rig_low", _RIG, "f", "U/(f0 D)", "least that is worth drawing"),
        Variable("rig_high", _RIG, "f", "U/(f0 D)", "largest that is worth drawing"),
        Variable("point_velocity", ("point",), "f", "U/(f0 D)", "of the tests and sweeps used"),
        Variable("point_scruton_number", ("point",), "f", "-", "Sc"),
        Variable("point_rig", ("point",), "U", "", "name"),
    ),
    "convergence": (
        Variable("posterior", ("row",), "U", "", "name of the posterior that was sampled"),
        Variable("parameter", ("row",), "U", "", "name of the parameter"),
        Variable("rhat_nested", ("row",), "f", "-", "nested R-hat over the ensembles"),
        Variable("ess_bulk", ("row",), "f", "-", "effective draws"),
        Variable("ess_tail", ("row",), "f", "-", "effective draws in the tails"),
        Variable("tau", ("row",), "f", "steps", "integrated autocorrelation time"),
        Variable("steps", ("row",), "i", "-", "kept a walker"),
        Variable("acceptance", ("row",), "f", "-", "share of the proposals"),
        Variable("stuck", ("row",), "i", "-", "walkers in a mode of their own"),
        Variable("converged", ("row",), "b", "-", "the verdict on the posterior"),
    ),
    "inputs": (
        Variable("document", (), "U", "", "JSON: campaign and resolved model card, see `scruton.infer.store`"),
        Variable("numbers", ("number",), "f", "", "the records that the document refers to, end to end"),
    ),
}

# What the labels along the dimensions are: unit and long name.
COORDINATES = {
    "chain": ("1", "chain: an ensemble, its walkers end to end"),
    "draw": ("1", "draw of a chain"),
    "ensemble": ("1", "ensemble that started by itself"),
    "walker": ("1", "walker of the ensemble"),
    "test": ("1", "name of the test"),
    "peak_test": ("1", "name of the peak test"),
    "rig": ("1", "name of the rig"),
    "record": ("1", "name of the record"),
    "cycle": ("1", "cycle of the records, end to end"),
    "law": ("1", "law of aerodynamic damping"),
    "parameter": ("1", "name of the parameter"),
    "point": ("1", "test, or point of a sweep"),
    "velocity": ("U/(f0 D)", "reduced velocity"),
}


def joined(draws: FloatArray, ensemble: np.ndarray) -> FloatArray:
    """Draws of walkers, (walkers, draws, ...), as one chain an ensemble, its walkers end to end, (ensembles, S, ...).

    Parameters
    ----------
    draws : (walkers, draws, ...) array
    ensemble : (walkers,) array of int
        Of each walker; those of one ensemble are neighbours, and all ensembles are of one size.
    """
    return draws.reshape(len(np.unique(ensemble)), -1, *draws.shape[2:])


def dataset(group: str, values: Mapping[str, Any], **coordinates: Any) -> "xr.Dataset":
    """One group of the results, laid out as `SCHEMA` has it, its variables with their units and long names.

    Parameters
    ----------
    group : str
    values : mapping
        Arrays by the names of the group's variables.
    **coordinates
        Labels by dimension; chains, draws and cycles are counted where none are given.  Labels along another
        dimension are a pair, (dimension, labels).  With the `ensemble` of every walker, (walkers,), the values are
        draws by walker, and are `joined`; `walker` then numbers the walkers along a chain.

    Raises
    ------
    KeyError
        If the group has no such variable.
    """
    import xarray as xr

    known, labels = {variable.name: variable for variable in SCHEMA[group]}, dict(coordinates)
    laid_out = xr.Dataset({name: (known[name].dims, value) for name, value in values.items()})
    if (ensemble := labels.pop("ensemble", None)) is not None:
        walkers = len(ensemble) // len(np.unique(ensemble))
        laid_out = xr.Dataset({name: _joined(value, ensemble) for name, value in laid_out.data_vars.items()})
        labels["ensemble"] = ("chain", np.unique(ensemble))
        labels["walker"] = ("draw", np.repeat(np.arange(walkers), laid_out.sizes["draw"] // walkers))
    counted = {name: np.arange(size) for name, size in laid_out.sizes.items() if name in ("chain", "draw", "cycle")}
    if group == "constant_data":
        counted = {}
    for name, column in laid_out.data_vars.items():
        variable = known[str(name)]
        column.attrs["units"] = "1" if variable.unit in ("", "-") else variable.unit
        column.attrs["long_name"] = variable.meaning or str(name).replace("_", " ")
    labelled = laid_out.assign_coords({**counted, **labels})
    for label, column in labelled.coords.items():
        column.attrs["units"], column.attrs["long_name"] = COORDINATES[str(label)]
    return labelled


def _joined(column: "xr.DataArray", ensemble: np.ndarray) -> tuple[Any, FloatArray]:
    if "chain" not in column.dims:
        return column.dims, column.to_numpy()
    first = column.transpose("chain", "draw", ...)
    last = [name for name in column.dims if name not in first.dims[:2]]
    moved = joined(first.to_numpy(), ensemble)
    axes = [(*first.dims[:2], *last).index(name) for name in column.dims]
    return column.dims, np.ascontiguousarray(moved.transpose(axes))


def group_of(tree: "xr.DataTree", group: str) -> "xr.DataTree | None":
    """A group of a tree by its path; None where there is none."""
    node: xr.DataTree | None = tree
    for name in group.split("/"):
        node = None if node is None else node.children.get(name)
    return node


def faults(tree: "xr.DataTree") -> list[str]:
    """What of a tree is not laid out as `SCHEMA` has it, one sentence each; groups may be missing."""
    sentences = []
    for group, variables in SCHEMA.items():
        node = group_of(tree, group)
        if node is None:
            continue
        stored = {str(name): (one.dims, one.dtype) for name, one in node.to_dataset().variables.items()}
        sentences += group_faults(group, variables, stored)
    return sentences


def group_faults(
    group: str, variables: Sequence[Variable], stored: Mapping[str, "tuple[tuple[Hashable, ...], np.dtype[Any]]"]
) -> list[str]:
    """What of one group is not laid out so, by the dimensions and the types of what is stored."""
    sentences = []
    for variable in variables:
        if variable.name not in stored:
            if not variable.optional:
                sentences.append(f"group {group} lacks {variable.name}")
            continue
        dims, dtype = stored[variable.name]
        kind = "U" if dtype.kind in "OT" else dtype.kind
        if dims != variable.dims or kind != variable.kind:
            sentences.append(f"{group}/{variable.name} is {dtype} by {dims}, not {variable.kind} by {variable.dims}")
    return sentences
