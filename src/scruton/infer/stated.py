"""Mass, density, wind speed and frequency with their uncertainty, and the quantities derived from every draw."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Quantity, Rig, Section, Test
from scruton.dynamics import Setting, force_parameters
from scruton.infer.models import NOISE, WindPosterior


@dataclass(frozen=True, eq=False)
class StatedDraws:
    """Draws of what the records do not inform: (chains, draws) arrays, constant where no sd is stated.

    Mass and frequency belong to the rig and are the same draws in all its tests.
    """

    mass: FloatArray
    frequency: FloatArray
    air_density: FloatArray
    wind_speed: FloatArray


def draw_stated(
    campaign: Campaign,
    test: Test,
    rig: Rig,
    seed_of: Callable[[str], np.random.SeedSequence],
    shape: tuple[int, ...],
) -> StatedDraws:
    """Draw mass, frequency, density and wind speed, as `Quantity` reads what is stated."""
    assert rig.mass is not None, "the loader refuses a test whose rig has no mass"

    def draws(name: str, quantity: Quantity) -> FloatArray:
        return quantity.draw(np.random.default_rng(seed_of(name)), shape)

    return StatedDraws(
        draws(f"mass of {rig.name}", rig.mass),
        draws(f"frequency of {rig.name}", rig.frequency),
        draws(f"air density of {test.name}", test.air_density),
        draws(f"wind speed of {test.name}", test.wind_speed),
    )


def derive(
    section: Section, stated: StatedDraws, posterior: WindPosterior, chain: FloatArray, wind_frequency: float
) -> Mapping[str, FloatArray]:
    """Every quantity of a test in its own unit, (chains, draws) each.

    Y1 and epsilon are derived only under the paper's law (n = -1): other laws have parameters of their own.
    """
    natural = posterior.natural(chain)
    a_star, damping = natural["stable_amplitude"], natural["damping_ratio"]
    rate = natural["relaxation_ratio"] * posterior.omega0
    setting = Setting(
        motion=section.motion,
        width=section.width,
        depth=section.depth,
        mass=stated.mass,
        air_density=stated.air_density,
        wind_speed=stated.wind_speed,
        frequency=stated.frequency,
        wind_frequency=wind_frequency * stated.frequency / stated.frequency.mean(),
        damping_ratio=damping,
    )
    sc = setting.scruton_number
    found = {
        "a_star": a_star,
        "relaxation_rate": rate,
        **{name: natural[name] for name in NOISE},
        "damping_ratio": damping,
        "scruton_number": sc,
        "relaxation_scruton_number": sc * natural["relaxation_ratio"] / damping,
        "mass_damping_factor": sc / damping,
    }
    if posterior.n is None:
        found["law_exponent"] = natural["law_exponent"]
    if posterior.n == -1.0:
        found["Y1"], found["epsilon"] = force_parameters(a_star, rate, setting)
    return found
