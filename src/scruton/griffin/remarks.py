"""What has to be said of a prediction: of its design, of the damping there, of its prior, of its laws."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from scruton.campaign.plausibility import damping_flag
from scruton.campaign.schema import Quantity
from scruton.griffin.discrepancy import one_rig
from scruton.griffin.thresholds import UNSETTLED, WIDE_DAMPING, X_TRUSTED
from scruton.infer.joint import CAMPAIGN, SCALES, failed, names_at_prior

if TYPE_CHECKING:
    import xarray as xr

    from scruton.griffin.predict import Prediction

_NONE = f"{0.0:.1%}"  # of the draws, as it is printed


def of_the_design(prediction: "Prediction") -> tuple[str, ...]:
    """How far it is from the tests, whether it makes sense, and draws that die or have no stable amplitude."""
    flags = []
    place = f"Sc = {prediction.scruton_number:.4g}"
    if abs(prediction.extrapolation_index) > X_TRUSTED:
        flags.append(
            f"{place}: extrapolation index x = {prediction.extrapolation_index:.2f} from the nearest test; beyond "
            f"|x| = {X_TRUSTED:g} laws of aerodynamic damping part, and the interval is that of the laws used: "
            + ", ".join(f"{law} ({share:.0%})" for law, share in prediction.laws.items() if share > 0.005)
            + (f"; {prediction.measured}" if prediction.measured else "")
        )
    if not prediction.covered_by:
        flags.append(f"{place}: an amplitude beyond the transients of every test: no record tells the damping there")
    if implausible := damping_flag(prediction.damping_ratio):
        flags.append(f"{place}: {implausible}")
    if prediction.scruton_number < 0.0:
        flags.append(f"{place}: a negative Scruton number has no physical meaning; it shows the trend only")
    if (dies := f"{prediction.dies:.1%}") != _NONE:
        error = f"MC error {prediction.dies_error:.1%}"
        flags.append(f"{place}: no vibration in {dies} of the draws ({error}); they are counted as zero amplitude")
    if (unbounded := f"{prediction.unbounded:.1%}") != _NONE:
        flags.append(f"{place}: no stable amplitude in {unbounded} of the draws; they are counted as infinitely large")
    return tuple(flags)


def of_the_damping(design: Quantity | float | None) -> tuple[str, ...]:
    """What has to be said of a design damping that is known to be hardly more than positive; empty otherwise."""
    if not isinstance(design, Quantity) or design.relative_sd <= WIDE_DAMPING:
        return ()
    low, high = design.interval(0.90)
    return (
        f"the standard deviation of the design damping is {design.relative_sd:.0%} of its mean: as a "
        f"lognormal it lies between {100.0 * low:.2g} % and {100.0 * high:.2g} % with 90 %",
    )


def prior_speaks(tree: "xr.DataTree") -> tuple[str, ...]:
    """What has to be said where the records leave the discrepancy between settings at its prior; empty otherwise."""
    scales = " and of ".join(SCALES[name] for name in names_at_prior(tree))
    if not scales:
        return ()
    remark = f"the band between settings is the card's prior: the posterior of {scales} equals it"
    return (f"{remark}, as it always does with one rig" if one_rig(tree) else remark,)


def unsettled_laws(tree: "xr.DataTree", laws: Mapping[str, float]) -> tuple[str, ...]:
    """What has to be said where the laws that answer, by their weights, did not all converge; empty otherwise.

    A law to which the records give nothing does not bring the verdict on a fit down, but has its share of the answer.
    """
    names = failed(tree)
    held = {label: weight for label, weight in laws.items() if f"{CAMPAIGN} {label}" in names}
    if round(sum(held.values()), 6) < UNSETTLED:
        return ()
    of_each = ", ".join(f"{label} ({weight:.0%})" for label, weight in held.items())
    return (
        f"laws whose posterior did not converge hold {sum(held.values()):.0%} of the weight of the answer: {of_each}; "
        "to mend it raise sampler.max_steps in the model card, and fit again",
    )
