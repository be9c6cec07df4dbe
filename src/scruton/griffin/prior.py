r"""What a model card says before any record: Griffin curves drawn from its priors alone.

The curve is the one that the tests of a campaign share, :math:`A = A_{ref}(1 - n x)^{1/n}`, with A_ref and
lambda/omega0 drawn from the priors at a reference setting, and n from the weights of the laws or from its prior.
"""

from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Motion
from scruton.dynamics.laws import amplitude_ratio
from scruton.griffin.bands import GriffinBand, band
from scruton.griffin.thresholds import X_TRUSTED
from scruton.infer.cards import ModelCard

REACH = 4.0  # of the curves, over the reference Scruton number
_POINTS = 61


@dataclass(frozen=True)
class Reference:
    """The setting at which the priors are drawn: its Scruton number and structural damping ratio."""

    motion: Motion
    scruton_number: float
    damping_ratio: float

    @property
    def mass_damping_factor(self) -> float:
        """Scruton number per unit of damping ratio."""
        return self.scruton_number / self.damping_ratio

    @property
    def unit(self) -> str:
        """Unit of the amplitude."""
        return "rad" if self.motion is Motion.TORSIONAL else "A/D"


# Rig 6# of the rectangle (Table 1 of the paper) and rig 1# of the closed box in torsion (Table 3).
REFERENCES = {
    Motion.HEAVING: Reference(Motion.HEAVING, 21.7, 0.0065),
    Motion.TORSIONAL: Reference(Motion.TORSIONAL, 0.771, 0.00421),
}


@dataclass(frozen=True, eq=False)
class PriorCurves:
    """Griffin curves from the priors of a card, and their band.

    Attributes
    ----------
    scruton_number : (n,) array
        From zero to some times the reference.
    amplitude : (S, n) array
        A/D or rad, one curve a draw; zero where vibration dies, inf where no amplitude is stable.
    exponent : (S,) array
        The law of every draw.
    relaxation_ratio : (S,) array
        lambda/omega0 at the reference.
    """

    reference: Reference
    scruton_number: FloatArray
    amplitude: FloatArray
    exponent: FloatArray
    relaxation_ratio: FloatArray
    band: GriffinBand


def prior_curves(card: ModelCard, reference: Reference, *, seed: int = 0, draws: int = 4000) -> PriorCurves:
    """Draw Griffin curves from the priors of a model card.

    Parameters
    ----------
    reference : Reference
        The setting that the priors of a* and lambda/omega0 are taken to be about, its damping ratio as known.
    draws : int
        Curves.
    """
    rng = np.random.default_rng(seed)
    if card.exponent:
        exponent = card.exponent.from_sampled(card.exponent.draw(rng, draws))
    else:
        exponent = np.asarray(rng.choice(card.laws, draws, p=card.law_weights), dtype=np.float64)
    relaxation = card.prior("relaxation_ratio", reference.motion)
    ratio = relaxation.from_sampled(relaxation.draw(rng, draws))
    stable = card.prior("stable_amplitude", reference.motion)
    level = stable.from_sampled(stable.draw(rng, draws))
    sc = np.linspace(0.0, REACH * reference.scruton_number, _POINTS)
    # x = (Sc - Sc_ref)/Sc_lambda, with Sc_lambda the Scruton number that belongs to lambda.
    x = (sc - reference.scruton_number) / (reference.mass_damping_factor * ratio[:, None])
    amplitude: FloatArray = level[:, None] * amplitude_ratio(x, exponent[:, None])
    whole = band(sc, amplitude, reference.unit, card.name, np.median(np.abs(x), axis=0) > X_TRUSTED)
    return PriorCurves(reference, sc, amplitude, exponent, ratio, whole)
