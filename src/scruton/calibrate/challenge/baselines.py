"""Diagnoses to beat: each from a campaign's envelopes alone, none with a model of what the scatter does to them.

Each takes a case's folder and gives the fields of gap.json that it can: run them as
`run_challenge(folder, out, diagnose=BASELINES[name])` and score them as any other.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter
from scipy.special import logsumexp
from scipy.stats import chi2

from scruton.arrays import FloatArray
from scruton.calibrate.challenge.envelopes import Envelopes, load_envelopes
from scruton.calibrate.challenge.independent import criteria
from scruton.calibrate.thresholds import CHI_SQUARE_BINS, CHI_SQUARE_LEVEL, CYCLES_OF_A_BIN, SPARSE_COEFFICIENT

_POWERS = (0, 1, 2, 3, 5)


def bic(folder: Path) -> dict[str, Any]:
    """BIC of least-squares fits to the envelopes, as if their errors were independent; knows no `unknown`.

    Of the catalogue it lacks `stiffness_nonlinearity` and `vortex_shedding_forcing`.
    """
    table = criteria(load_envelopes(folder))
    logs = np.array([-0.5 * value for value in table.values()])
    probability = dict(zip(table, np.exp(logs - logsumexp(logs)).tolist(), strict=True))
    return _gap(max(probability, key=probability.__getitem__), probability)


def sparse(folder: Path) -> dict[str, Any]:
    """Sparse regression of da/dt on 1, a, a^2, a^3, a^5, in still air and in wind (STLSQ: Brunton et al., PNAS 2016).

    A constant in still air is friction, a power structural nonlinearity, a linear part beyond the stated damping an
    error of that; powers in wind are aerodynamic nonlinearity. The strongest has it; no probability.
    """
    size = _sparse(load_envelopes(folder))
    name = max(size, key=size.__getitem__)
    return _gap(name if size[name] > 0.0 else "none", {})


def chi_square(folder: Path) -> dict[str, Any]:
    """Chi-square of the null model against the binned damping curves: `none` or `unknown`, no probability."""
    e = load_envelopes(folder)
    rigs = len(e.damping)
    rows, values = [], []
    for r, (t, a) in enumerate(zip(e.time, e.amplitude, strict=True)):
        for x, y, se in _binned(t, a):
            row = np.zeros(rigs + 2)
            row[e.rig[r]] = e.omega[r] * e.damping[e.rig[r]]
            if e.wind[r]:
                row[rigs:] = e.aero[r], -e.drive[r] / x
            rows.append(row / se)
            values.append((y - row[e.rig[r]]) / se)
    prior = np.hstack([np.diag(1.0 / e.damping_sd), np.zeros((rigs, 2))])
    X, y = np.vstack([*rows, prior]), np.r_[values, np.zeros(rigs)]
    if not e.wind.any():
        X = X[:, :rigs]
    misfit = float(np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2))
    return _gap("unknown" if chi2.sf(misfit, len(values) - X.shape[1] + rigs) < CHI_SQUARE_LEVEL else "none", {})


BASELINES = {"bic": bic, "sparse": sparse, "chi-square": chi_square}


def _gap(verdict: str, probability: dict[str, float]) -> dict[str, Any]:
    groups = [] if verdict in ("none", "unknown") else [[verdict]]
    return {
        "format": 1, "verdict": verdict, "also": [], "probability": probability, "indistinguishable": groups,
        "where": [], "shrink": {}, "effects": {}, "advice": [],
    }  # fmt: skip


def _binned(t: FloatArray, a: FloatArray) -> list[tuple[float, float, float]]:
    """Amplitude, damping rate -d ln a/dt and its standard error, in stretches of a record, from cycle to cycle."""
    rows = []
    decrement = -np.diff(np.log(np.maximum(a, 1e-9))) / np.diff(t)
    for part in np.array_split(np.arange(decrement.size), min(CHI_SQUARE_BINS, max(decrement.size // 5, 1))):
        if part.size >= CYCLES_OF_A_BIN:
            se = float(decrement[part].std(ddof=1)) / np.sqrt(part.size)
            # The law has a part in 1/a: its mean is that of 1/a.
            rows.append((float(1.0 / np.mean(1.0 / a[part])), float(decrement[part].mean()), max(se, 1e-9)))
    return rows


def _sparse(e: Envelopes) -> dict[str, float]:
    """Largest coefficient of each effect at a = 1 over the relaxation rate there, after thresholding."""
    rows, values = [], []
    for r, (t, a) in enumerate(zip(e.time, e.amplitude, strict=True)):
        window = min(11, (t.size - 1) // 2 * 2 + 1)
        if window < 5:
            continue
        smooth = savgol_filter(a, window, 2)
        slope = savgol_filter(a, window, 2, deriv=1, delta=float(np.median(np.diff(t))))
        library = np.stack([smooth**k for k in _POWERS], axis=1)
        scale = np.array([e.drive[r], *[e.aero[r]] * (len(_POWERS) - 1)]) if e.wind[r] else np.zeros(len(_POWERS))
        inner = slice(window // 2, t.size - window // 2)
        rows.append(np.hstack([library, library * scale])[inner])
        values.append((slope + e.omega[r] * e.damping[e.rig[r]] * smooth)[inner])
    X, y = np.vstack(rows), np.concatenate(values)
    n = len(_POWERS)
    drive, linear = n, n + 1  # in wind: the null model itself
    law = np.isin(np.arange(2 * n), (drive, linear))
    active = np.any(X != 0.0, axis=0)
    for _ in range(10):
        c = np.zeros(2 * n)
        c[active] = np.linalg.lstsq(X[:, active], y, rcond=None)[0]
        rate = max(abs(float(c[drive])), e.rate)  # n = -1: the drive at the stable amplitude is the relaxation rate
        keep = active & ((np.abs(c) >= SPARSE_COEFFICIENT * rate) | law)
        if np.array_equal(keep, active):
            break
        active = keep
    still, wind = np.split(np.abs(c) / rate, 2)
    groups = {
        "coulomb_friction": still[:1],
        "structural_damping_error": still[1:2],
        "structural_damping_nonlinearity": still[2:],
        "aerodynamic_damping_nonlinearity": wind[2:],
    }
    return {name: float(group.max()) for name, group in groups.items()}
