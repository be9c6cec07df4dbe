"""A tuned mass damper for one mode from 4,000 draws, and the whole sizing of two modes."""

import time

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from benchmarks.result import Figure
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.griffin.curves import LawCurves
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.limits import RULES, Limit
from scruton.sizing.model import ModeModel, unit_cube
from scruton.sizing.risk import risk, shares
from scruton.sizing.tmd_design import design
from scruton.sizing.tmd_tuning import TuningDraws

DRAWS, DESIGN_LIMIT = 4000, 5.0  # seconds
LIMIT = 0.04 / 0.3  # m


def model() -> ModeModel:
    """Section of Table 5's first row, a sine, 20 % discrepancy, uncertain damping and frequency."""
    z = ndtri(qmc.Sobol(2, rng=1).random(1 << 13))
    ones = np.ones((1, 1 << 13))
    laws = LawCurves(
        0.00058, 0.06551 * np.exp(0.02 * z[:, 0]) * ones, 0.005139 * np.exp(0.03 * z[:, 1]) * ones, -ones, 0.2 * ones,
        np.ones(1), ("n=-1",),
    )  # fmt: skip
    mode = Mode("V1", Quantity(0.3, 0.003, "normal"), damping_ratio=Quantity(0.003, 0.00135))
    return ModeModel(laws, np.ones(1), Bridge("b", Motion.HEAVING, 12.0, 3.0, 1.225, Quantity(1.0), (), (mode,)), mode)


def run() -> list[Figure]:
    one = model()
    draws = one.draws(unit_cube(4096, 0)[:DRAWS])
    figures = []
    for number, limit in ((1, DESIGN_LIMIT), (2, DESIGN_LIMIT)):
        start = time.perf_counter()
        tuning = TuningDraws(draws.amplitude, LIMIT, draws.detuning, number)
        design(tuning, risk=0.05, modal_mass=4e6, frequency=0.3)
        text = f"least mass of {number} tuned mass damper(s), {DRAWS} draws"
        figures.append(Figure(text, time.perf_counter() - start, "s", limit))
    start = time.perf_counter()
    risk(one, Limit(RULES["amplitude"], LIMIT, "0.133 m"))
    figures.append(Figure("risk curve with its band", time.perf_counter() - start, "s"))
    start = time.perf_counter()
    shares(one, LIMIT)
    figures.append(Figure("shares of variance", time.perf_counter() - start, "s"))
    return figures
