"""Other samplers on the same posterior: nutpie through PyMC, and dynesty.

nutpie runs twice.  "By hand" gives it the best likelihood that it can use: the same filter, compiled, with its exact
gradient in the same sweep, written out by hand and handed to PyTensor as an operation.  "By PyTensor" is what one
writes who trusts the machine to differentiate: the filter as a scan.  dynesty calls the compiled filter too, one point
at a time, as it asks for it.
"""

from collections.abc import Callable
from math import exp, sqrt

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.moments import LOG_2PI, mean_weight, noise_moments
from scruton.infer.models import WindPosterior

LIVE_POINTS = 250
_DELTA = 1e-5  # relative step in lambda for the four coefficients, which are computed once a call


@njit(cache=True, fastmath=True, error_model="numpy")
def value_and_gradient(y, se, period, theta, p0):  # type: ignore[no-untyped-def]
    """Log likelihood of one record and its gradient in theta = (a*, lambda, q, r): n = -1, cycles of one period."""
    a_star, lam, q, r = theta[0], theta[1], theta[2], theta[3]
    phi, weight = np.exp(-lam * period), mean_weight(lam, period)
    end, cross, mean = noise_moments(lam, period)
    up, down = lam * (1.0 + _DELTA), lam * (1.0 - _DELTA)
    width = up - down
    phi_l, weight_l = -period * phi, (mean_weight(up, period) - mean_weight(down, period)) / width
    end_u, cross_u, mean_u = noise_moments(up, period)
    end_d, cross_d, mean_d = noise_moments(down, period)
    q2, r2 = q * q, r * r
    # Derivatives of the coefficients in (a*, lambda, q, r).
    end_l, cross_l, mean_l = (
        q2 * (end_u - end_d) / width,
        q2 * (cross_u - cross_d) / width,
        q2 * (mean_u - mean_d) / width,
    )
    end_q, cross_q, mean_q = 2.0 * q * end, 2.0 * q * cross, 2.0 * q * mean
    end, cross, mean = q2 * end, q2 * cross, q2 * mean
    d, p = -a_star, p0  # deviation of the filtered mean from a*, and its variance
    d_a, d_l, d_q, d_r = -1.0, 0.0, 0.0, 0.0
    p_l, p_q, p_r = 0.0, 0.0, 0.0
    total, g_a, g_l, g_q, g_r = 0.0, 0.0, 0.0, 0.0, 0.0
    w2, fw, f2 = weight * weight, phi * weight, phi * phi
    w2_l, fw_l, f2_l = 2.0 * weight * weight_l, phi_l * weight + phi * weight_l, 2.0 * phi * phi_l
    product = 1.0
    for k in range(y.size):
        s2 = se[k] * se[k]
        s = w2 * p + mean + r2 * s2
        s_l, s_q, s_r = w2 * p_l + w2_l * p + mean_l, w2 * p_q + mean_q, w2 * p_r + 2.0 * r * s2
        c = fw * p + cross
        c_l, c_q, c_r = fw * p_l + fw_l * p + cross_l, fw * p_q + cross_q, fw * p_r
        v = y[k] - a_star - weight * d
        v_a, v_l, v_q, v_r = -1.0 - weight * d_a, -weight * d_l - weight_l * d, -weight * d_q, -weight * d_r
        inverse = 1.0 / s
        z = v * inverse
        half = 0.5 * (inverse - z * z)
        g_a -= z * v_a
        g_l -= z * v_l + half * s_l
        g_q -= z * v_q + half * s_q
        g_r -= z * v_r + half * s_r
        total += v * z
        product *= s
        if k % 8 == 7:
            total += np.log(product)
            product = 1.0
        gain = c * inverse
        gain_l, gain_q, gain_r = (
            (c_l - gain * s_l) * inverse,
            (c_q - gain * s_q) * inverse,
            (c_r - gain * s_r) * inverse,
        )
        d_a = phi * d_a + gain * v_a
        d_l = phi * d_l + phi_l * d + gain * v_l + gain_l * v
        d_q = phi * d_q + gain * v_q + gain_q * v
        d_r = phi * d_r + gain * v_r + gain_r * v
        d = phi * d + gain * v
        p_l = f2 * p_l + f2_l * p + end_l - gain_l * c - gain * c_l
        p_q = f2 * p_q + end_q - gain_q * c - gain * c_q
        p_r = f2 * p_r - gain_r * c - gain * c_r
        p = f2 * p + end - gain * c
    value = -0.5 * (total + np.log(product) + y.size * LOG_2PI)
    return value, np.array([g_a, g_l, g_q, g_r])


def nutpie_sampler(
    posterior: WindPosterior, gradient: str = "by hand"
) -> Callable[[int, int, int], tuple[FloatArray, int]]:
    """Compile the posterior for nutpie; the function returned takes (tune, draws, seed).

    It gives (chains, draws, d), and how often the likelihood was asked for with its gradient for these draws.
    """
    import nutpie
    import pymc as pm
    import pytensor.tensor as pt

    location, scale = _normal_priors(posterior)
    with pm.Model() as model:
        u = pm.Normal("u", location, scale, shape=len(location))
        a_star, lam = pt.exp(u[0]), pt.exp(u[1]) * posterior.omega0
        theta = (a_star, lam, pt.exp(u[2]) * a_star * pt.sqrt(2.0 * lam), pt.exp(u[3]))
        build = {"by hand": _compiled_filter, "by PyTensor": _scanned_filter}[gradient]
        pm.Potential("likelihood", build(posterior, *theta))
        pm.Potential("negative Y1", pt.switch(u[1] > u[4], 0.0, -np.inf))
    compiled = nutpie.compile_pymc_model(model)

    def run(tune: int, draws: int, seed: int) -> tuple[FloatArray, int]:
        tree = nutpie.sample(
            compiled, tune=tune, draws=draws, chains=4, cores=1, seed=seed, progress_bar=False, save_warmup=False
        )
        chain: FloatArray = tree["posterior"]["u"].values
        return chain, int(tree["sample_stats"]["n_steps"].sum())

    return run


def _normal_priors(posterior: WindPosterior) -> tuple[FloatArray, FloatArray]:
    return np.array([one.location for one in posterior.priors]), np.array([one.scale for one in posterior.priors])


def _compiled_filter(posterior: WindPosterior, *theta):  # type: ignore[no-untyped-def]
    import pytensor.tensor as pt
    from pytensor.graph.basic import Apply
    from pytensor.graph.op import Op
    from pytensor.link.numba.dispatch import basic as numba_basic

    data = posterior.data
    y, se, period, p0 = data.amplitude, data.standard_error, float(data.period[0]), posterior.initial_sd**2

    class Envelope(Op):
        """(log likelihood, its gradient) of theta."""

        __props__ = ()

        def make_node(self, theta):  # type: ignore[no-untyped-def]
            return Apply(self, [pt.as_tensor(theta)], [pt.dscalar(), pt.dvector()])

        def perform(self, node, inputs, outputs):  # type: ignore[no-untyped-def]
            value, outputs[1][0] = value_and_gradient(y, se, period, inputs[0], p0)
            outputs[0][0] = np.asarray(value)

        def pullback(self, inputs, outputs, cotangents):  # type: ignore[no-untyped-def]
            return [cotangents[0] * outputs[1]]

    @numba_basic.register_funcify_and_cache_key(Envelope)
    def _(op, **kwargs):  # type: ignore[no-untyped-def]
        @numba_basic.numba_njit
        def both(theta):  # type: ignore[no-untyped-def]
            value, gradient = value_and_gradient(y, se, period, theta, p0)
            return np.asarray(value), gradient

        return both, None

    return Envelope()(pt.stack(theta))[0]


def _scanned_filter(posterior: WindPosterior, a_star, lam, q, r):  # type: ignore[no-untyped-def]
    import pytensor
    import pytensor.tensor as pt

    data = posterior.data
    period = float(data.period[0])
    x = lam * period
    one, two = -pt.expm1(-x), -pt.expm1(-2.0 * x)
    phi, weight = pt.exp(-x), one / x
    end, cross = q**2 * two / (2.0 * lam), q**2 * one**2 / (2.0 * lam * x)
    mean = q**2 * (period - 2.0 * one / lam + two / (2.0 * lam)) / x**2

    def step(y, s2, d, p, a_star, phi, weight, end, cross, mean, r2):  # type: ignore[no-untyped-def]
        s = weight**2 * p + mean + r2 * s2
        c = phi * weight * p + cross
        v = y - a_star - weight * d
        return phi * d + c / s * v, phi**2 * p + end - c * c / s, -0.5 * (v * v / s + pt.log(s) + LOG_2PI)

    *_, terms = pytensor.scan(
        step,
        sequences=[pt.as_tensor(data.amplitude), pt.as_tensor(data.standard_error**2)],
        outputs_info=[-a_star, posterior.initial_sd**2 * pt.ones_like(a_star), None],
        non_sequences=[a_star, phi, weight, end, cross, mean, r**2],
        return_updates=False,
    )
    return terms.sum()


def dynesty_sampler(posterior: WindPosterior) -> Callable[[int], tuple[FloatArray, FloatArray]]:
    """Set dynesty up; the function returned takes a seed and gives points (S, d) and their weights (S,)."""
    import dynesty
    from scipy.special import ndtri

    location, scale = _normal_priors(posterior)
    data = posterior.data
    y, se, period, p0 = data.amplitude, data.standard_error, float(data.period[0]), posterior.initial_sd**2

    def transform(cube: FloatArray) -> FloatArray:
        point: FloatArray = location + scale * ndtri(cube)
        return point

    def likelihood(u: FloatArray) -> float:
        if not u[1] > u[4]:
            return -1e300
        a_star, lam = exp(u[0]), exp(u[1]) * posterior.omega0
        theta = np.array([a_star, lam, exp(u[2]) * a_star * sqrt(2.0 * lam), exp(u[3])])
        value: float = value_and_gradient(y, se, period, theta, p0)[0]
        return value

    def run(seed: int) -> tuple[FloatArray, FloatArray]:
        # The quickest of its settings here: one bounding ellipsoid, random walks, few live points.
        sampler = dynesty.NestedSampler(
            likelihood, transform, len(location), nlive=LIVE_POINTS, bound="single", sample="rwalk",
            rstate=np.random.default_rng(seed),
        )  # fmt: skip
        sampler.run_nested(print_progress=False)
        return sampler.results.samples, sampler.results.importance_weights()

    return run
