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


def gusty_innovations(data, rate, q, r, *, gust, fade, offset, steps=400):
    """Innovations and variances of a linearised filter of (amplitude, gust, offset, integral of the amplitude).

    Mean and covariance by small Euler steps; the drive's gust (of standard deviation `gust`, forgotten at the rate
    `fade`) and its offset in a record add to da/dt.  The first cycle fixes a diffuse state, as above.
    """
    d, found = 1e-5 * np.median(data.amplitude), []
    mean = covariance = None

    def moved(x, p, time):
        h, diffusion = time / steps, np.diag([q**2, 2 * fade * gust**2, 0.0, 0.0])
        for _ in range(steps):
            slope = (rate(x[0] + d) - rate(x[0] - d)) / (2 * d)
            along = np.array([[slope, 1, 1, 0], [0, -fade, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0]])
            flow = np.eye(4) + h * along + 0.5 * h * h * along @ along
            middle = x[0] + 0.5 * h * (rate(x[0]) + x[1] + x[2])
            x = x + h * np.array([rate(middle) + q**2 / (2 * middle) + x[1] + x[2], -fade * x[1], 0.0, middle])
            p = flow @ p @ flow.T + h * diffusion
        return x, p

    for y, se, gap, period in zip(data.amplitude, data.standard_error, data.gap, data.period, strict=True):
        r2 = (r * se) ** 2
        if gap < 0:
            found.append((np.nan, np.nan))
            mean, covariance = moved(np.array([y, 0.0, 0.0, 0.0]), np.diag([r2, gust**2, offset**2, 0.0]), 0.5 * period)
            continue
        if gap > 0:
            mean, covariance = moved(mean, covariance, gap)
        mean[3] = covariance[3, :] = covariance[:, 3] = 0.0
        mean, covariance = moved(mean, covariance, period)
        v, s = y - mean[3] / period, covariance[3, 3] / period**2 + r2
        gain = covariance[3] / period / s
        mean, covariance = mean + gain * v, covariance - s * np.outer(gain, gain)
        found.append((v, s))
    return np.array(found).T
