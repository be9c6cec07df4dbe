"""Free runs: what the model of a test in wind would have done from the first amplitude of every record on."""

import numpy as np

from scruton.arrays import FloatArray, end_to_end
from scruton.compiled import njit
from scruton.dynamics.departure import ROUGH, factor_at
from scruton.dynamics.equation import flow_above_floor
from scruton.dynamics.moments import noise_moments
from scruton.dynamics.step_filter import advance
from scruton.infer.models import WindPosterior

RUNS = 250  # free runs of a test


def free_runs(
    posterior: WindPosterior, chain: FloatArray, rng: np.random.Generator, runs: int = RUNS
) -> tuple[FloatArray, FloatArray]:
    """Run the model under some draws, spread evenly, from the start of every record, never corrected on the way.

    Gives the amplitude without noise and a replicate of the data with turbulence and sensor noise, (runs, N) each.
    The initial state of a record is drawn from its distribution after the record's first amplitude.
    """
    flat = end_to_end(chain)
    u = flat[np.linspace(0, len(flat) - 1, runs).round().astype(int)]
    data = posterior.data
    size = (runs, data.size)
    first = rng.standard_normal(size)  # used at the first cycle of a record only
    mean, replicate = np.empty(size), np.empty(size)
    a_star, lam, q, r, wind = posterior.state_space(u)
    theta = np.concatenate([np.zeros((runs, 1)), posterior.departures(u, rng)], axis=1)
    _run(
        data.amplitude, data.standard_error, data.gap, data.period, a_star, lam, q, r, *wind.sizes, theta,
        posterior.exponents(u), posterior.initial_sd**2, first, rng.standard_normal((6, *size)), mean, replicate,
    )  # fmt: skip
    return mean, replicate


@njit(cache=True)
def _free(state, h, level, lam, q2, g2, fade, theta, n, dt, one, two):  # type: ignore[no-untyped-def]
    """State and gust after dt, and what two standard normal numbers add to the state."""
    here = lam * factor_at(state, level, theta)
    new, p, kept, p_h, p_hh = advance(state, 0.0, h, 0.0, 0.0, level, lam, here, q2, g2, fade, n, dt)
    turn = np.sqrt(p_hh) * two
    along = p_h / p_hh if p_hh > 0.0 else 0.0
    return new, along * turn + np.sqrt(max(p - along * p_h, 0.0)) * one, kept + turn


@njit(cache=True)
def _run(  # type: ignore[no-untyped-def]
    y, se, gap, period, a_star, lam, q, r, gust, fade, set_point, departure, theta, n, p0, first, noise, mean, replicate
):
    for w in range(a_star.size):
        curve, state, h, level = 0.0, 0.0, 0.0, a_star[w]
        q2, g2 = q[w] * q[w], gust[w] * gust[w]
        # What a wake remembers, and what the departure does between its knots: as the filters have them.
        at_start, rough = np.hypot(gust[w], departure[w] * departure[w] * a_star[w]), ROUGH * departure[w]
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
                here = lam[w] * factor_at(curve, a_star[w], theta[w])
                curve, _ = flow_above_floor(curve, a_star[w], np.exp(-0.5 * here * dt), n[w])
                h, level = at_start * noise[3, w, k], a_star[w] + set_point[w] * noise[4, w, k]
                bent = rough * noise[5, w, k] * (curve - state)
                state, kick, h = _free(
                    state, h, level, lam[w], q2, g2, fade[w], theta[w], n[w], 0.5 * dt, noise[1, w, k], noise[2, w, k]
                )
                state += kick + bent
                continue
            if gap[k] > 0.0:
                here = lam[w] * factor_at(curve, a_star[w], theta[w])
                curve, _ = flow_above_floor(curve, a_star[w], np.exp(-here * gap[k]), n[w])
                state, kick, h = _free(
                    state, h, level, lam[w], q2, g2, fade[w], theta[w], n[w], gap[k], first[w, k], noise[3, w, k]
                )
                state += kick
            here = lam[w] * factor_at(curve, a_star[w], theta[w])
            middle, _ = flow_above_floor(curve, a_star[w], np.exp(-0.5 * here * dt), n[w])
            end, _ = flow_above_floor(curve, a_star[w], np.exp(-here * dt), n[w])
            mean[w, k] = (curve + 4.0 * middle + end) / 6.0
            curve = end
            here = lam[w] * factor_at(state, level, theta[w])
            half, _ = flow_above_floor(state, level, np.exp(-0.5 * here * dt), n[w])
            end, _ = flow_above_floor(state, level, np.exp(-here * dt), n[w])
            bent = rough * noise[5, w, k] * (end - state)
            new, kick, h = _free(
                state, h, level, lam[w], q2, g2, fade[w], theta[w], n[w], dt, noise[1, w, k], noise[2, w, k]
            )
            # The noise of the cycle enters its mean by its covariance with the state at the end, about one half.
            e, c, z = noise_moments(lam[w], dt)
            rest = max(z - c * c / e, 0.0) * q2
            # Half of what a gust has pushed and the departure has bent by the end is there at its middle.
            half += 0.5 * (new - end + bent)
            seen = (state + 4.0 * half + new + bent) / 6.0
            replicate[w, k] = seen + c / e * kick + np.sqrt(rest + r2) * noise[0, w, k]
            state = new + kick + bent
