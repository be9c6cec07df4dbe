"""Motion under any drift, by small steps, and the likelihood of its cycles by a point-mass filter: slow and obvious."""

import numpy as np
from scipy.stats import norm


def motion(rng, rate, q, se, start, *, period=0.125, cycles=100, steps=200):
    """Readings of cycles: means of an Euler-Maruyama path with the noise-induced drift, plus sensor noise."""
    a, y, h = start, [], period / steps
    for _ in range(cycles):
        mean = 0.0
        for _ in range(steps):
            mean += a / steps
            a += h * (rate(a) + q**2 / (2 * a)) + q * np.sqrt(h) * rng.standard_normal()
        y.append(mean + se * rng.standard_normal())
    return np.array(y)


def grid_log_likelihood(data, rate, q, r, sd0, points=321, steps=200):
    """Point-mass filter: the state's density on a moving grid, moments of each cycle by small Euler steps.

    It starts where the fast filters do for a diffuse state: the first amplitude is the state half a cycle
    before the end of the first cycle.
    """
    d = 1e-4 * np.median(data.amplitude)

    def moments(x, dt):
        """Mean and covariance of (state at the end, mean over dt) from each grid point, second order."""
        h = dt / steps
        m, s, p, c, v = x.copy(), np.zeros_like(x), np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
        for _ in range(steps):
            f, up, dn = (rate(m + e) + q**2 / (2 * (m + e)) for e in (0.0, d, -d))
            f1, f2 = (up - dn) / (2 * d), (up - 2 * f + dn) / d**2
            s, v = s + h * m, v + 2 * h * c
            c = c + h * (f1 * c + p)
            m, p = m + h * (f + 0.5 * f2 * p), p + h * (2 * f1 * p + q**2)
        return m, s / dt, p, c / dt, v / dt**2

    total = 0.0
    grid = density = None
    for y, se, gap, period in zip(data.amplitude, data.standard_error, data.gap, data.period, strict=True):
        r2 = (r * se) ** 2
        if gap < 0:
            total += norm.logpdf(y, 0, np.sqrt(sd0**2 + r2))
            gain = sd0**2 / (sd0**2 + r2)
            centre, sd = gain * y, np.sqrt(gain * r2)
            grid = np.linspace(max(centre - 7 * sd, 0.02 * centre), centre + 7 * sd, points)
            density = norm.pdf(grid, centre, sd)
            density /= density.sum()
            means, _, variances, _, _ = moments(grid, 0.5 * period)
        else:
            m, z, p, c, v = moments(grid, period)
            s = v + r2
            like = norm.pdf(y, z, np.sqrt(s)) * density
            total += np.log(like.sum())
            density = like / like.sum()
            means, variances = m + c / s * (y - z), p - c**2 / s
        centre = (density * means).sum()
        sd = np.sqrt((density * (variances + (means - centre) ** 2)).sum())
        new = np.linspace(max(centre - 7 * sd, 0.02 * centre), centre + 7 * sd, points)
        density = norm.pdf(new[:, None], means[None, :], np.sqrt(variances)[None, :]) @ density
        density /= density.sum()
        grid = new
    return total
