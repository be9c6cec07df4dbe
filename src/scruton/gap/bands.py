"""What was found goes back into the bands: draws of the amplitude equation with the effect, for predictions."""

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.terms import Term
from scruton.dynamics.limit_cycle import transferred
from scruton.errors import InputError
from scruton.gap.diagnosis import UNKNOWN, Diagnosis
from scruton.gap.hypothesis import FittedHypothesis

if TYPE_CHECKING:
    import xarray as xr

AUTO = "auto"
GROUP = "effect"


def chosen(diagnosis: Diagnosis, effect: str) -> tuple[tuple[str, ...], FittedHypothesis | None]:
    """Names of the effects to use, strongest first, and a hypothesis with them and no others.

    All that was found for "auto", nothing where there is no gap; else the effect asked for alone, whatever else was
    found: in the form that it has there, fitted anew, for the law takes up what is left out. An unknown cause has no
    equation: the hypothesis is that of the effects beside it.

    Raises
    ------
    InputError
        For a name that is not in the catalogue, or an effect that cannot act in these records.
    """
    if effect == AUTO:
        return diagnosis.found, _with(diagnosis, diagnosis.found) if diagnosis.found else None
    if effect not in CATALOGUE:
        raise InputError("command line", "--effect", repr(effect), f"auto, or one of: {', '.join(CATALOGUE)}")
    single = diagnosis.singles[effect].best if effect in diagnosis.singles else None
    best = _with(diagnosis, (effect,)) if effect in diagnosis.found else single
    if best is None:
        backed = [name for name, found in diagnosis.singles.items() if found.best is not None and name in CATALOGUE]
        told = f"; they back {', '.join(backed)}" if backed else ""
        raise InputError("command line", "--effect", effect, f"an effect that these records give any support{told}")
    return (effect,), best


def _with(diagnosis: Diagnosis, names: Collection[str]) -> FittedHypothesis:
    """The null model with those of the effects found that are named, and no generic term."""
    final, fit = diagnosis.final, diagnosis.null
    variants = final.hypothesis.variants
    wanted = [i for i, one in enumerate(variants) if one.effect in names and one.effect != UNKNOWN]
    if len(wanted) == len(variants):
        return final
    for i in wanted:
        start = {p.name: final.value(p.name, i)[0] for p in variants[i].parameters}
        fit = fit.with_variants(variants[i], start=start)
    return fit


def posterior_draws(fit: FittedHypothesis, rng: np.random.Generator, size: int) -> FloatArray:
    """Draws of the Laplace approximation, (size, d), those outside of a prior's cut drawn again."""
    root, kept = np.linalg.cholesky(fit.covariance), np.empty((0, fit.mode.size))
    for _ in range(1000):
        u = fit.mode + rng.standard_normal((size, fit.mode.size)) @ root.T
        kept = np.concatenate([kept, u[(u[:, fit.hypothesis.positive] >= 0.0).all(axis=1)]])
        if len(kept) >= size:
            return kept[:size]
    raise ValueError("the effect's size is negative almost surely: its records contradict it")


def discrepancy_of_the_unknown(diagnosis: Diagnosis) -> float:
    """Standard deviation of ln(amplitude) that a gap of unknown cause adds.

    The stable amplitudes with the generic term differ by as much from those of what else was found, which has an
    equation, or of the null model; the root mean square over the tests.
    """
    if diagnosis.verdict != UNKNOWN:
        return 0.0
    fits, differences = (diagnosis.base or diagnosis.null, diagnosis.final), []
    for r in diagnosis.data.first_in_wind.values():
        before, after = (fit.hypothesis.stable_amplitude(fit.mode[None], r)[0] for fit in fits)
        if before > 0.0 and after > 0.0 and np.isfinite(before * after):
            differences.append(np.log(after / before))
    return float(np.sqrt(np.mean(np.square(differences)))) if differences else 0.0


def attach(tree: "xr.DataTree", diagnosis: Diagnosis, effect: str, seed: int) -> tuple[str, ...]:
    """Add the group `effect` to a tree of posteriors, so that predictions and bands carry it.

    The group holds draws of the amplitude equation's coefficients at the middle setting, without what belongs to the
    rig or its sensors: those do not go to the bridge.  An unknown cause has no equation: it widens the bands by the
    discrepancy that was found.

    Returns
    -------
    tuple of str
        The effects that the group carries, strongest first; none without a group.
    """
    import xarray as xr

    names, fit = chosen(diagnosis, effect)
    if fit is None or diagnosis.data.middle < 0:
        return ()
    layout, middle = diagnosis.data.layout, diagnosis.data.middle
    group = tree["campaign_posterior"]
    size = int(group.sizes["chain"] * group.sizes["draw"])
    rng = np.random.default_rng([seed, 0x6A])
    attributes = {
        "effect": names[0], "also": list(names[1:]), "omega0": float(layout.omega[middle]),
        "largest": float(layout.largest.max()), "discrepancy_sd": 0.0,
        "mass_damping_factor": float(layout.scruton_number[middle] / diagnosis.data.nominal_damping[middle]),
    }  # fmt: skip
    if UNKNOWN in names:
        attributes["discrepancy_sd"] = discrepancy_of_the_unknown(diagnosis)
    rows = transferred(fit.hypothesis.table(posterior_draws(fit, rng, size))[:, middle])
    tree[GROUP] = xr.DataTree(
        xr.Dataset({"coefficient": (("sample", "term"), rows[:, [int(t) for t in Term]])},
                   coords={"term": [t.name.lower() for t in Term]}, attrs=attributes)
    )  # fmt: skip
    return names
