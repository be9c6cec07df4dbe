r"""Truths from the prior: the hierarchical campaign model written down once more, from standard normals forward.

Nothing here is taken from the code that fits: what is drawn is what the documentation of the model says,

.. math:: \ln a^*_j = \ln A(Sc_j) + \tau z_j, \qquad \ln G_j = \ln G + \kappa w_j, \qquad G = R_{ref} + n\,Sc_{ref}

with :math:`A(Sc) = A_{ref}(1 - n x)^{1/n}`, :math:`x = (Sc - Sc_{ref})/R_{ref}`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from scruton.arrays import FloatArray
from scruton.calibrate.regimes import AIR_DENSITY, DEPTH, FREQUENCY, REDUCED_VELOCITY, Regime
from scruton.campaign.schema import Motion, Quantity
from scruton.dynamics import Setting, amplitude_ratio, ehsan_scanlan_parameters, force_parameters
from scruton.infer.cards import ModelCard
from scruton.stats import Coordinates

# Normals of the curve, and of every test.
SHARED = Coordinates(
    dict.fromkeys(("stable_amplitude", "relaxation_ratio", "discrepancy_amplitude", "discrepancy_relaxation"))
)
OWN = Coordinates(dict.fromkeys(("amplitude", "relaxation", "damping", "mass", "density")))
_TRIES = 1000


@dataclass(frozen=True, eq=False)
class Drawn:
    """Draws of the campaign model, of the prior or of a posterior: (S,) arrays of the curve, (S, J) of the tests."""

    n: FloatArray  # law of every draw
    reference_scruton_number: float
    reference_amplitude: FloatArray  # A_ref [A/D or rad]
    reference_relaxation: FloatArray  # R_ref, the Scruton number that belongs to the relaxation rate there
    discrepancy_amplitude: FloatArray  # tau
    a_star: FloatArray  # A/D or rad
    relaxation_rate: FloatArray  # 1/s
    damping_ratio: FloatArray
    mass_damping_factor: FloatArray
    Y1: FloatArray  # of a posterior, NaN unless n = -1
    epsilon: FloatArray


def omega0(motion: Motion) -> float:
    """Natural circular frequency [rad/s] of every rig."""
    return 2.0 * np.pi * FREQUENCY[motion]


def wind_speed(motion: Motion) -> float:
    """Wind speed [m/s] of every test."""
    return REDUCED_VELOCITY * FREQUENCY[motion] * DEPTH


def setting(regime: Regime, mass: FloatArray, air_density: FloatArray, damping_ratio: FloatArray) -> Setting:
    """Settings of all tests; the force has no stiffness, so that the frequency in the wind is that in still air."""
    motion = regime.motion
    return Setting(
        motion=motion, width=regime.width, depth=DEPTH, mass=mass, air_density=air_density,
        wind_speed=wind_speed(motion), frequency=FREQUENCY[motion], wind_frequency=FREQUENCY[motion],
        damping_ratio=damping_ratio,
    )  # fmt: skip


def stated(regime: Regime) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass, density as stated, and the damping ratios that give the regime's Scruton numbers, (J,) each."""
    tests = len(regime.scruton_numbers)
    mass, density = np.full(tests, regime.mass), np.full(tests, AIR_DENSITY)
    factor = setting(regime, mass, density, np.zeros(tests)).mass_damping_factor
    return mass, density, np.asarray(regime.scruton_numbers) / factor


def scattered(relative_sd: float, z: FloatArray) -> FloatArray:
    """What is true over what is stated, with this relative sd as `Quantity` reads it, from standard normals."""
    stated = Quantity(1.0, relative_sd)
    return np.asarray(stated.median * np.exp(stated.log_sd * z))


def from_normals(z: FloatArray, regime: Regime, card: ModelCard) -> tuple[Drawn, Setting, np.ndarray]:
    """Campaigns that standard normals (S, d) stand for; see `draw_normals`.

    Returns
    -------
    drawn : Drawn
    setup : Setting
        As they truly are, (S, J) each.
    possible : (S,) array of bool
        Whether every test has a stable amplitude, for n < 0 at zero damping too; what is not is drawn again.
    """
    tests, n = len(regime.scruton_numbers), regime.n
    shared = []
    for name, column in SHARED.items():
        prior, normal = card.prior(name, regime.motion), z[:, column]
        uniform = prior.family.endswith("uniform")
        off = np.sqrt(3.0) * prior.scale * (2.0 * ndtr(normal) - 1.0) if uniform else prior.scale * normal
        shared.append(prior.from_sampled(prior.location + off))
    amplitude, ratio, tau, kappa = shared
    if regime.miss is not None:
        tau = kappa = np.full(len(z), regime.miss)
    deviates = OWN.of(z[:, SHARED.stop :].reshape(len(z), tests, OWN.size))
    nominal = stated(regime)
    factor = setting(regime, *nominal).mass_damping_factor
    reference = float(np.exp(np.log(regime.scruton_numbers).mean()))
    relaxation = ratio * float(np.exp(np.log(factor).mean()))
    errors = (("mass", regime.mass_sd), ("density", regime.density_sd), ("damping", regime.damping_sd))
    mass, density, xi = (mean * scattered(sd, deviates[name]) for mean, (name, sd) in zip(nominal, errors, strict=True))
    setup = setting(regime, mass, density, xi)
    sc = setup.scruton_number
    with np.errstate(all="ignore"):
        curve = amplitude[:, None] * amplitude_ratio((sc - reference) / relaxation[:, None], n)
        a_star = curve * np.exp(tau[:, None] * deviates["amplitude"])
        at_zero = max(n, 0.0) * sc
        strength = relaxation[:, None] - n * (sc - reference) + at_zero
        shifted = strength * np.exp(kappa[:, None] * deviates["relaxation"]) - at_zero
        rate = shifted / setup.mass_damping_factor * omega0(regime.motion)
        possible = np.isfinite(a_star) & (a_star > 0.0) & (rate > 0.0)
        if n < 0.0:  # as the paper has it, Y1 < 0; the prior of a fit admits either sign
            possible &= (shifted + n * sc > 0.0) & (relaxation + n * reference > 0.0)[:, None]
        forces = (ehsan_scanlan_parameters if n == 2.0 else force_parameters)(a_star, rate, setup)
    drawn = Drawn(
        np.full(len(z), n), reference, amplitude, relaxation, tau, a_star, rate, xi, setup.mass_damping_factor, *forces
    )
    return drawn, setup, possible.all(axis=1)


def draw_normals(rng: np.random.Generator, regime: Regime, card: ModelCard, size: int) -> FloatArray:
    """Draw standard normals whose campaigns are possible, (size, d); those that are not are drawn again whole."""
    dimension = SHARED.size + OWN.size * len(regime.scruton_numbers)
    kept: list[FloatArray] = []
    for _ in range(_TRIES):
        z = rng.standard_normal((2 * size + 8, dimension))
        kept.append(z[from_normals(z, regime, card)[2]])
        if sum(map(len, kept)) >= size:
            return np.concatenate(kept)[:size]
    raise ValueError(f"regime {regime.name}: its priors allow hardly any campaign with a stable amplitude")
