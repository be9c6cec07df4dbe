"""Wakes that are oscillators themselves, beside linear damping: what holds a section, and what its transients show.

Nothing of it is the model's.  The excitation at an amplitude is the mean work of a wake under motion that is held; what
transients show is read from both oscillators together, let go at 0.2 and 1.8 times the stable amplitude, so that the
wake lags behind the amplitude and growth and decay differ.  Rates are by the phase, forces in Scruton numbers, and
A/D = 0.05 at Sc = 20.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from chains import FACTOR, LIFT, STALL, pull, stepped
from scipy.optimize import least_squares

STEPS = 48  # a cycle
STEP = 2.0 * np.pi / STEPS


@dataclass(frozen=True)
class Wake:
    """A lift q with q'' = pull(q, q', y'') and the force lift q - stall y'."""

    pull: Callable
    lift: float
    stall: float

    @cached_property
    def _held(self):
        """Amplitudes, and the excitation of the wake under harmonic motion of each, (K,) and (K,)."""
        amplitudes = np.geomspace(2e-4, 0.4, 90)

        def driven(phase, q, rate):
            return 1.0, rate, self.pull(q, rate, -amplitudes * np.cos(phase))

        state, work, cycles = (0.0, np.zeros(90), np.full(90, -2.0)), np.zeros(90), 80
        for k in range(3 * cycles * STEPS):
            if k >= 2 * cycles * STEPS:
                work -= state[1] * amplitudes * np.sin(state[0])
            state = stepped(driven, state, STEP)
        return amplitudes, self.lift * work / (cycles * STEPS) / (0.5 * amplitudes**2) - self.stall

    def excitation(self, amplitude):
        """Scruton number that holds a section at an amplitude A/D."""
        amplitudes, held = self._held
        return np.interp(np.log(amplitude), np.log(amplitudes), held)

    def on_curve(self, sc):
        """Amplitude A/D that a section comes to at a Scruton number."""
        amplitudes, held = self._held
        return float(np.exp(np.interp(-sc, -held, np.log(amplitudes))))

    @cache  # noqa: B019
    def shown(self, sc):
        """What transients of a test show: its relaxation in Scruton numbers, and an exponent, by least squares."""

        def slope(y, v, q, rate):
            acceleration = -y + 2.0 / FACTOR * (self.lift * q - (self.stall + sc) * v)
            return v, acceleration, rate, self.pull(q, rate, acceleration)

        stable, seen = self.on_curve(sc), []
        state = (stable * np.array([0.2, 1.8]), np.zeros(2), np.zeros(2), np.full(2, -2.0))
        for k in range(360 * STEPS):
            if k % STEPS == 0:
                seen.append(np.hypot(state[0], state[1]))
            state = stepped(slope, state, STEP)
        ratio = np.array(seen)[10:] / stable  # the wake's own start is over
        rates = FACTOR * np.diff(np.log(ratio), axis=0) / (2.0 * np.pi)
        at = np.sqrt(ratio[1:] * ratio[:-1])
        on_the_way = np.abs(np.log(at)) > 0.02
        at, rates = at[on_the_way], rates[on_the_way]

        def misfit(values):
            strength, n = values
            return at * (rates + strength * (at**n - 1.0) / n)

        strength, n = least_squares(misfit, (60.0, 0.5), bounds=([0.0, -1.5], [np.inf, 4.0])).x
        return float(strength), float(n)


FACCHINETTI = Wake(pull, LIFT, STALL)
RAYLEIGH = Wake(lambda q, rate, motion: 0.3 * (1.0 - rate * rate) * rate - q + 12.0 * motion, 1.179, 20.0)
