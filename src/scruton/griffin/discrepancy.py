"""Predictions from one rig, at a discrepancy between settings that is stated instead of left to the card's prior."""

from typing import TYPE_CHECKING

import numpy as np

from scruton.dynamics.laws import amplitude_ratio

if TYPE_CHECKING:
    import xarray as xr

STATED = (0.10, 0.20)  # standard deviations of ln(amplitude) that a prediction from one rig is stated at


def one_rig(tree: "xr.DataTree") -> bool:
    """Whether a single peak test stands behind the curve: it says nothing of the discrepancy between settings."""
    return int(tree["campaign_posterior"].sizes.get("peak_test", 0)) == 1


def with_discrepancy(tree: "xr.DataTree", tau: float) -> "xr.DataTree":
    r"""The posterior of one rig where the discrepancy of the amplitude is known to be `tau`.

    Notes
    -----
    The test's own amplitude does not depend on tau, and its standardised deviation from the curve,
    :math:`z = (\ln a^* - \ln A(Sc))/\tau`, keeps its prior: the curve moves to where the same z puts it,

    .. math:: \ln A_{ref} \to \ln A_{ref} + (\tau'/\tau - 1)\,(\ln A(Sc) - \ln a^*)
    """
    import xarray as xr

    group = tree["campaign_posterior"].to_dataset()
    tested = group.isel(peak_test=0)
    x = (tested["scruton_number"] - group.attrs["reference_scruton_number"]) / group["reference_relaxation"]
    ratio = xr.apply_ufunc(amplitude_ratio, x, group["n"])
    off = np.log(group["reference_amplitude"] * ratio / tested["a_star"])
    moved = group["reference_amplitude"] * np.exp((tau / group["discrepancy_amplitude"] - 1.0) * off)
    known = xr.full_like(group["discrepancy_amplitude"], tau)
    changed = tree.copy()
    changed["campaign_posterior"] = xr.DataTree(
        group.assign(reference_amplitude=moved.transpose(*known.dims), discrepancy_amplitude=known)
    )
    return changed
