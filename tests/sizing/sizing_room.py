"""A section whose posterior is known in closed form, and a bridge over it."""

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.griffin.curves import LawCurves
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.limits import RULES, Limit
from scruton.sizing.mode_shape import sine
from scruton.sizing.model import ModeModel

LIMIT = 0.04 / 0.3  # m


def at_most(amplitude):
    """A limit of so many metres."""
    return Limit(RULES["amplitude"], amplitude, f"{amplitude:g} m")


def laws(discrepancy=0.0, exponents=(-1.0,), weights=(1.0,), draws=1 << 13):
    """a* = 0.06551 (2 %), lambda/omega = 0.005139 (3 %), measured at xi = 0.00058; the Scruton number is xi itself."""
    z = ndtri(qmc.Sobol(2, rng=1).random(draws))
    amplitude = 0.06551 * np.exp(0.02 * z[:, 0])
    relaxation = 0.005139 * np.exp(0.03 * z[:, 1])
    rows = np.ones((len(exponents), 1))
    return LawCurves(
        0.00058, amplitude * rows, relaxation * rows, np.asarray(exponents)[:, None] * np.ones(draws),
        discrepancy * np.ones((len(exponents), draws)), np.asarray(weights, float),
        tuple(f"n={one:g}" for one in exponents),
    )  # fmt: skip


def mode_model(discrepancy=0.0, cov=0.0, coherence=None, shape=None, **options):
    mode = Mode("V1", Quantity(0.3), shape=shape or sine(), damping_ratio=Quantity(0.003, cov * 0.003))
    bridge = Bridge("bridge", Motion.HEAVING, 12.0, 3.0, 1.225, coherence or Quantity(1.0), (), (mode,))
    return ModeModel(laws(discrepancy, **options), np.ones(1), bridge, mode)
