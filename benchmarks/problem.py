"""One test of 120 cycles, as it leaves the demodulation: the problem that every sampler here is given."""

from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Kind, Motion, Quantity, Record, Rig, Section, Test
from scruton.dynamics.cycles import EnvelopeData
from scruton.infer.cards import load_card
from scruton.infer.models import WindPosterior
from scruton.stats.priors import Prior

FREQUENCY = 7.87  # Hz
A_STAR, RATIO, SCATTER, NOISE = 0.0292, 0.0136, 0.02, 2e-4  # the 4:1 rectangle at Sc = 21.7, in mild turbulence
FIRST_AMPLITUDE = 0.08
DAMPING = 0.0065


def envelope(cycles: int, seed: int = 1) -> tuple[FloatArray, FloatArray]:
    """Times and amplitudes of a decay to resonance: an exact Ornstein-Uhlenbeck path, its mean over every cycle."""
    rng, inner = np.random.default_rng(seed), 64
    lam = RATIO * 2.0 * np.pi * FREQUENCY
    step = 1.0 / (FREQUENCY * inner)
    forget = np.exp(-lam * step)
    kicks = SCATTER * A_STAR * np.sqrt(1.0 - forget**2) * rng.standard_normal(cycles * inner)
    path = np.empty(cycles * inner + 1)
    path[0] = FIRST_AMPLITUDE - A_STAR
    for k, kick in enumerate(kicks):
        path[k + 1] = forget * path[k] + kick
    middles = 0.5 * (path[1:] + path[:-1])
    amplitude = A_STAR + middles.reshape(cycles, inner).mean(axis=1) + NOISE * rng.standard_normal(cycles)
    return (np.arange(cycles) + 0.5) / FREQUENCY, amplitude


def data(cycles: int) -> EnvelopeData:
    """Build the envelope as the filter reads it."""
    time, amplitude = envelope(cycles)
    gap = np.zeros(cycles)
    gap[0] = -1.0
    return EnvelopeData(
        amplitude, np.full(cycles, NOISE), gap, np.full(cycles, 1.0 / FREQUENCY), time, np.full(cycles, "decay")
    )


class TurbulenceAlone(WindPosterior):
    """A test in wind without gusts: all that the likelihoods know which are written out for the peers."""

    def state_space(self, u: FloatArray) -> tuple[FloatArray, ...]:
        """(a_star, lambda [1/s], q, r) of the filter from coordinates, each (W,)."""
        value = self.natural(u)
        a_star, lam = value["stable_amplitude"], value["relaxation_ratio"] * self.omega0
        return a_star, lam, value["amplitude_scatter"] * a_star * np.sqrt(2.0 * lam), value["noise_factor"]


def posterior(cycles: int = 120) -> WindPosterior:
    """Build the posterior of (ln a*, ln lambda/omega0, ln scatter, ln noise factor, ln xi_s) with the default card."""
    card = load_card()
    names = ("stable_amplitude", "relaxation_ratio", "amplitude_scatter", "noise_factor")
    priors = [card.prior(name, Motion.HEAVING) for name in names]
    damping = Prior("damping_ratio", "lognormal", DAMPING, 0.03, "-", "ring-downs")
    return TurbulenceAlone((*priors, damping), data(cycles), (), 2.0 * np.pi * FREQUENCY)


def campaign(cycles: int = 120) -> Campaign:
    """Build the same test as a campaign in memory, its envelope extracted already."""
    time, amplitude = envelope(cycles)
    record = Record("decay.csv", Path("decay.csv"), Kind.DECAY, time, amplitude, is_envelope=True)
    rig = Rig("6#", Quantity(FREQUENCY), Quantity(7.292), Quantity(DAMPING, 0.03 * DAMPING))
    test = Test("Sc 21.7", "6#", Quantity(1.22), Quantity(5.04), records=(record,))
    section = Section(Motion.HEAVING, 0.300, 0.075)
    return Campaign(Path("benchmark"), "One test of 120 cycles", "simulated", section, (rig,), (test,))
