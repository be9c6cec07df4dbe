"""Free runs of the fitted model: the curve that a draw implies, and records that it would produce."""

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.curved_filter import advance
from scruton.dynamics.equation import flow_above_floor
from scruton.dynamics.moments import noise_moments
from scruton.infer.models import WindPosterior

RUNS = 250


def free_runs(posterior: WindPosterior, chain: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Run the model from the start of every record, never corrected by the data on the way.

    Parameters
    ----------
    posterior : WindPosterior
    chain : (chains, draws, d) array
        Sampled coordinates; `RUNS` of them are used, spread evenly.
    rng : Generator

    Returns
    -------
    mean, replicate : (RUNS, N) arrays
        The amplitude without noise, and a replicate of the data with turbulence and sensor noise.

    Notes
    -----
    The initial state of a record is drawn from its distribution after the record's first amplitude.
    """
    flat = chain.reshape(-1, chain.shape[-1])
    u = flat[np.linspace(0, len(flat) - 1, RUNS).round().astype(int)]
    state_space = posterior.state_space(u)
    data = posterior.data
    size = (RUNS, data.size)
    first = rng.standard_normal(size)  # used at the first cycle of a record only
    mean, replicate = np.empty(size), np.empty(size)
    _run(
        data.amplitude, data.standard_error, data.gap, data.period, *state_space, posterior.exponents(u),
        posterior.initial_sd**2, first, rng.standard_normal((4, *size)), mean, replicate,
    )  # fmt: skip
    return mean, replicate


@njit(cache=True)
def _free(state, h, a_star, lam, q2, g2, fade, n, dt, one, two):  # type: ignore[no-untyped-def]
    """State and gust after dt without noise, and what two standard normal numbers add to them."""
    new, p, kept, p_h, p_hh = advance(state, 0.0, h, 0.0, 0.0, a_star, lam, q2, g2, fade, n, dt)
    turn = np.sqrt(p_hh) * two
    along = p_h / p_hh if p_hh > 0.0 else 0.0
    return new, along * turn + np.sqrt(max(p - along * p_h, 0.0)) * one, kept + turn


@njit(cache=True)
def _run(  # type: ignore[no-untyped-def]
    y, se, gap, period, a_star, lam, q, r, gust, fade, offset, n, p0, first, noise, mean, replicate
):
    for w in range(a_star.size):
        curve, state = 0.0, 0.0
        q2, g2, h = q[w] * q[w], gust[w] * gust[w], 0.0
        level = a_star[w]
        for k in range(y.size):
            dt = period[k]
            blur = r[w] * se[k]
            r2 = blur * blur
            if gap[k] < 0.0:
                # The first amplitude is that of mid-cycle: draw it, and carry it on for half a cycle.
                gain = p0 / (p0 + r2)
                curve = gain * y[k] + np.sqrt(gain * r2) * first[w, k]
                state = curve
                mean[w, k] = curve
                replicate[w, k] = state + np.sqrt(r2) * noise[0, w, k]
                curve, _ = flow_above_floor(curve, a_star[w], np.exp(-0.5 * lam[w] * dt), n[w])
                h = gust[w] * noise[3, w, k]
                level = a_star[w] + offset[w] * first[w, k + 1]
                state, kick, h = _free(
                    state, h, level, lam[w], q2, g2, fade[w], n[w], 0.5 * dt, noise[1, w, k], noise[2, w, k]
                )
                state += kick
                continue
            if gap[k] > 0.0:
                curve, _ = flow_above_floor(curve, a_star[w], np.exp(-lam[w] * gap[k]), n[w])
                state, kick, h = _free(
                    state, h, level, lam[w], q2, g2, fade[w], n[w], gap[k], first[w, k], noise[3, w, k]
                )
                state += kick
            middle, _ = flow_above_floor(curve, a_star[w], np.exp(-0.5 * lam[w] * dt), n[w])
            end, _ = flow_above_floor(curve, a_star[w], np.exp(-lam[w] * dt), n[w])
            mean[w, k] = (curve + 4.0 * middle + end) / 6.0
            curve = end
            half, _ = flow_above_floor(state, level, np.exp(-0.5 * lam[w] * dt), n[w])
            new, kick, h = _free(state, h, level, lam[w], q2, g2, fade[w], n[w], dt, noise[1, w, k], noise[2, w, k])
            # The noise of the cycle enters its mean by its covariance with the state at the end, about one half.
            e, c, z = noise_moments(lam[w], dt)
            rest = max(z - c * c / e, 0.0) * q2
            replicate[w, k] = (state + 4.0 * half + new) / 6.0 + c / e * kick + np.sqrt(rest + r2) * noise[0, w, k]
            state = new + kick
