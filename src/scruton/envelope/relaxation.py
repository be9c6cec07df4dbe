"""How fast an envelope relaxes towards its stable amplitude, from one exponential."""

from dataclasses import dataclass

import numpy as np

from scruton.envelope.types import Cycles

_SLOWEST, _FASTEST = 0.1, 200.0  # rates that are looked for, times the record length


@dataclass(frozen=True)
class Relaxation:
    """a(t) = stable + (first - stable) exp(-rate t), t from the first cycle.

    Where the record does not bend, `rate` [1/s] lies at the end of its range, a tenth of the inverse record length, and
    `stable_amplitude` says nothing.
    """

    stable_amplitude: float
    first_amplitude: float
    rate: float
    residual_sd: float
    bends: bool

    @property
    def time(self) -> float:
        """Relaxation time [s]."""
        return 1.0 / self.rate


def relaxation(cycles: Cycles) -> Relaxation:
    """Fit one exponential towards a constant to the amplitude of every cycle, by least squares.

    The rate is searched on a grid from a tenth to two hundred times the inverse record length, then between the
    grid's points; the two amplitudes are linear. This is the closed form of the amplitude equation with n = -1.
    """
    from scipy.optimize import minimize_scalar

    t, a = cycles.time - cycles.time[0], cycles.amplitude
    length = float(t[-1])

    def project(log_rate: float) -> tuple[np.ndarray, float]:
        e = np.exp(-np.exp(log_rate) * t / length)
        design = np.stack([1.0 - e, e], axis=1)
        linear = np.linalg.lstsq(design, a, rcond=None)[0]
        return linear, float(np.sum((a - design @ linear) ** 2))

    grid = np.linspace(np.log(_SLOWEST), np.log(_FASTEST), 40)
    best = int(np.argmin([project(x)[1] for x in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    log_rate = float(minimize_scalar(lambda x: project(x)[1], bounds=(low, high), method="bounded").x)
    (stable, first), squares = project(log_rate)
    rate, sd = float(np.exp(log_rate)) / length, float(np.sqrt(squares / len(t)))
    return Relaxation(float(stable), float(first), rate, sd, bends=best > 0)
