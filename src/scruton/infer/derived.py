"""What follows from the parameters of a test in wind, of draws of its posterior or of its prior."""

from collections.abc import Mapping

from scruton.arrays import FloatArray
from scruton.campaign.schema import Section
from scruton.dynamics import Setting, force_parameters
from scruton.infer.models import NOISE, WindPosterior


def derive(
    section: Section,
    stated: Mapping[str, FloatArray],
    posterior: WindPosterior,
    chain: FloatArray,
    wind_frequency: float,
) -> Mapping[str, FloatArray]:
    """Every quantity of a test in its own unit, (...) each, from draws of the parameters, (..., d), and the `stated`.

    Y1 and epsilon are derived only under the paper's law (n = -1): other laws have parameters of their own.
    """
    natural = posterior.natural(chain)
    a_star, damping = natural["stable_amplitude"], natural["damping_ratio"]
    rate = natural["relaxation_ratio"] * posterior.omega0
    setting = Setting(
        section.motion, section.width, section.depth, damping_ratio=damping,
        wind_frequency=wind_frequency * stated["frequency"] / stated["frequency"].mean(), **stated,
    )  # fmt: skip
    sc = setting.scruton_number
    derived = {
        "a_star": a_star,
        "relaxation_rate": rate,
        **{name: natural[name] for name in NOISE},
        "damping_ratio": damping,
        "scruton_number": sc,
        "relaxation_scruton_number": sc * natural["relaxation_ratio"] / damping,
        "mass_damping_factor": sc / damping,
    }
    if posterior.n is None:
        derived["law_exponent"] = natural["law_exponent"]
    if posterior.n == -1.0:
        derived["Y1"], derived["epsilon"] = force_parameters(a_star, rate, setting)
    return derived
