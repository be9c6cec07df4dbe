r"""A mode in a lock-in wind with a damper that rubs and strikes: the equations of motion, many cases at once.

.. math:: \ddot y + 2\xi\dot y + y = w(y, \dot y) + \mu\,p, \qquad
   \ddot r + \ddot y = -p, \qquad
   p = 2\zeta f\dot r + f^2 r + F\,\mathrm{sign}\,\dot r + \kappa f^2 (r - s\,\mathrm{sign}\,r)\ \text{where}\ |r| > s .

Time is in units of 1/omega.  A step is split: wind, friction and stops each have a flow that is known, half of it
before and after the exact flow of the linear rest; friction stops a damper that it can hold.  Second order in the
step, first order where a damper is held.
"""

import numpy as np
from scipy.linalg import expm


def constant_force(size):
    """Wind of constant size along the velocity, the paper's law beside its linear part."""
    return lambda x, v, h: v + h * size * np.sign(v)


def force_by_displacement(drive, strength, n):
    """Wind 2 (drive - strength |y|^n) v: Ehsan and Scanlan's for n = 2."""
    return lambda x, v, h: v * np.exp(2.0 * h * (drive - strength * np.abs(x) ** n))


def settle(wind, xi, mu, f, zeta, *, cycles, start, friction=0.0, stop=np.inf, stiffness=0.0, steps=160):
    """Amplitude, frequency and stroke at the end, (N,) each, and how unsteady the amplitude still is.

    `wind` is the flow of the mode's velocity over a time h; all else are numbers or (N,) arrays, but `steps`, the
    number of them to a cycle.
    """
    xi, mu, f, zeta, friction, stop, start = np.broadcast_arrays(xi, mu, f, zeta, friction, stop, start)
    h = 2.0 * np.pi / steps
    rates = np.zeros((xi.size, 4, 4))  # of y, r, and their velocities
    rates[:, 0, 2] = rates[:, 1, 3] = 1.0
    rates[:, 2] = np.stack([-np.ones_like(xi), mu * f**2, -2.0 * xi, 2.0 * mu * zeta * f], axis=1)
    rates[:, 3] = -rates[:, 2] - np.stack([0.0 * f, f**2, 0.0 * f, 2.0 * zeta * f], axis=1)
    flow = np.ascontiguousarray(expm(h * rates).transpose(1, 2, 0))
    state = np.zeros((4, xi.size))
    state[0] = start
    last = 20 * steps
    rows = np.empty((last, 2, xi.size))
    total = int(cycles * steps)
    rubs, strikes = bool(np.any(friction > 0.0)), bool(np.any(np.isfinite(stop)))

    def others(h):
        y, r, v, u = state
        if rubs:
            slower = np.sign(u) * np.minimum(np.abs(u), h * friction * (1.0 + mu))
            state[3] = u - slower
            state[2] = v + mu / (1.0 + mu) * slower
        if strikes:
            push = h * stiffness * f**2 * np.sign(r) * np.maximum(np.abs(r) - stop, 0.0)
            state[2] += mu * push
            state[3] -= (1.0 + mu) * push
        pushed = wind(y, state[2], h)
        state[3] -= pushed - state[2]
        state[2] = pushed

    for k in range(total):
        others(0.5 * h)
        state = (flow * state).sum(axis=1)
        others(0.5 * h)
        if k >= total - last:
            rows[k - total + last] = state[:2]
    peaks = np.abs(rows).reshape(20, steps, 2, -1).max(axis=1)
    y = rows[:, 0]
    up = (y[:-1] < 0.0) & (y[1:] >= 0.0)
    frequency = np.empty(xi.size)
    for i in range(xi.size):
        at = np.flatnonzero(up[:, i])
        times = at - y[at, i] / (y[at + 1, i] - y[at, i])
        frequency[i] = steps * (times.size - 1) / (times[-1] - times[0])
    size = np.median(peaks, axis=0)
    return size[0], frequency, size[1], np.ptp(peaks[:, 0], axis=0) / size[0]
