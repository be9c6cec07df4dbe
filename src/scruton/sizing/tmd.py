r"""What a tuned mass damper does to a vortex-induced vibration: its impedance at the frequency of the response.

A mode of unit frequency carries dampers of mass ratio mu, frequency ratio f and damping ratio zeta.  In a limit cycle
of frequency g the mass of a damper moves by T times the mode,

.. math:: T(g) = \frac{f^2 + 2i\zeta f g}{f^2 - g^2 + 2i\zeta f g},

and the balance of harmonics splits into a real part, which gives g, and an imaginary part, which gives the damping that
the dampers add:

.. math:: 1 - g^2 - g^2 \sum \mu \, \mathrm{Re}\, T = 0, \qquad
   \xi_\mathrm{add} = -\tfrac12 g \sum \mu \, \mathrm{Im}\, T = \sum \frac{\mu \zeta f g^4}
   {(f^2 - g^2)^2 + (2 \zeta f g)^2} .

The stable amplitude is that of the Griffin curve at xi_s + xi_add; under the paper's law also over g, since a force of
constant size gives less amplitude at a higher frequency (`scruton.sizing.tmd_draws.frequency_power`).  Against 196
integrations of the equations of motion (mass ratios of 0.2 to 2 %, damping ratios of 0.35 to 1.6 sqrt(mu), frequencies
off by up to 5 %) this is within 1 % in 92 of 100 and within 3 % in all; leaving g out costs up to 8 %.  The damping of
the eigenvalues answers another question, how fast a free vibration dies, and errs by tens of per cent.

Several frequencies.  A lightly damped damper near tuning splits the mode, and the first equation has up to 2k + 1
roots for k dampers.  Which of them is a limit cycle?  Replace the force of the wind by a negative damping that cancels
as much as the force does at a given amplitude; every root is then a negative damping, xi_s + xi_add, at which a pole
of the linear system of mode and dampers reaches the imaginary axis.  The root of least damping is the first to be
reached when the negative damping grows from nothing.  It is stable: the force of the wind loses its grip as the
amplitude grows, and its grip on a small vibration at another frequency is weaker still (half for a force of constant
size, less than the whole for a cubic one), where no pole has reached the axis.  Roots between two others, near an
antiresonance, are unstable.  Another outer root can be stable as well; with a force of constant size, while its total
damping is less than about twice the least.  In simulations with a sign, growth from rest ended at the root of least
damping in 496 cases of 496, also where two roots were all but equal; release of the bridge from far above ended at the
other root only where their total dampings lay within a fifth of each other, and otherwise only dampers that swing
widely at the start, while the bridge does not, lead there.  The amplitude is smaller there.  So `respond` takes the
root of least damping.  It is continuous in the detuning; frequency and stroke jump where two roots change places.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scruton.arrays import FloatArray
from scruton.compiled import njit
from scruton.errors import InputError


@dataclass(frozen=True)
class TunedMass:
    """One damper, as ratios to the mode that it serves.

    Attributes
    ----------
    mass_ratio : float
        mu = m phi^2/M: the damper's mass, the mode shape where it hangs, the modal mass.
    frequency_ratio : float
        Its own frequency over the mode's.
    damping_ratio : float
        Its own damping ratio, between 0 and 1.

    Raises
    ------
    InputError
        If a ratio is out of range.
    """

    mass_ratio: float
    frequency_ratio: float
    damping_ratio: float

    def __post_init__(self) -> None:
        for name in ("mass_ratio", "frequency_ratio"):
            positive(name, getattr(self, name))
        if not 0.0 < self.damping_ratio < 1.0:
            raise InputError("damper", "damping_ratio", f"{self.damping_ratio:g}", "a number between 0 and 1, as 0.08")


@dataclass(frozen=True)
class Response:
    """What dampers do in the limit cycle.

    Attributes
    ----------
    added_damping, frequency : (...) array
        Damping ratio added to the mode, and frequency of the response over the mode's true one.
    stroke : (dampers, ...) array
        Amplitude of each damper's mass relative to the bridge, over the mode's amplitude where it hangs.
    """

    added_damping: FloatArray
    frequency: FloatArray
    stroke: FloatArray


def respond(mass_ratio: FloatArray, frequency_ratio: FloatArray, damping_ratio: FloatArray) -> Response:
    """Added damping, frequency and stroke in the limit cycle of least damping, of draws with ratios of their own.

    Parameters
    ----------
    mass_ratio, frequency_ratio, damping_ratio : arrays
        Broadcast to (dampers, S); the frequencies over the mode's true one.  The damping ratio may be 1 or more: that
        of a damper which friction all but holds.
    """
    mu, f, zeta = np.broadcast_arrays(mass_ratio, frequency_ratio, damping_ratio)
    if len(mu) == 1:
        added, frequency = np.empty(mu.shape[1]), np.empty(mu.shape[1])
        _one_damper(*(np.ascontiguousarray(each[0]) for each in (mu, f, zeta)), added, frequency)
    else:
        # Eigenvalues of a real matrix are exactly real or come in exact pairs.  A pair that rounding takes off the axis
        # where two roots merge is no loss: a root of less damping stands elsewhere.
        values = np.linalg.eigvals(_balance_matrix(mu, f, zeta))  # (draws, 2 dampers + 1)
        real = (values.imag == 0.0) & (values.real > -1.0)
        g = np.sqrt(np.where(real, 1.0 + values.real, 1.0))
        shares = (mu * zeta * f)[:, :, None] * g**4 / resonance(f[:, :, None], zeta[:, :, None], g)
        total = np.where(real, np.sum(shares, axis=0), np.inf)
        least = np.argmin(total, axis=1)[:, None]
        added, frequency = (np.take_along_axis(each, least, axis=1)[:, 0] for each in (total, g))
    stroke = frequency**2 / np.sqrt(resonance(f, zeta, frequency))
    return Response(added, frequency, stroke)


def ratios_of(dampers: Sequence[TunedMass]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Give mass, frequency and damping ratios, (dampers, 1) each."""
    mu, f, zeta = np.array([(d.mass_ratio, d.frequency_ratio, d.damping_ratio) for d in dampers]).T[:, :, None]
    return mu, f, zeta


def den_hartog(mass_ratio: float) -> TunedMass:
    """Least peak under a harmonic force on an undamped mode: f = 1/(1 + mu), zeta^2 = 3 mu/(8 (1 + mu)^3)."""
    mu = positive("mass_ratio", mass_ratio)
    return TunedMass(mu, 1.0 / (1.0 + mu), float(np.sqrt(3.0 * mu / (8.0 * (1.0 + mu) ** 3))))


def positive(name: str, value: float) -> float:
    """Return a value that is positive and finite, or raise InputError with its name."""
    if not (np.isfinite(value) and value > 0.0):
        raise InputError("damper", name, f"{value:g}", "a finite number greater than 0")
    return float(value)


def check_detuning(detuning: ArrayLike) -> FloatArray:
    """Return detunings as an array, or raise InputError."""
    error = np.asarray(detuning, dtype=float)
    bad = error[~(np.isfinite(error) & (error > -1.0))]
    if bad.size:
        raise InputError("damper", "detuning", f"{bad[0]:g}", "finite relative errors of the frequency, as 0.02")
    return error


def resonance(f: FloatArray, zeta: FloatArray, g: FloatArray) -> FloatArray:
    """(f^2 - g^2)^2 + (2 zeta f g)^2, the square of g^2 over the stroke."""
    return np.asarray((f**2 - g**2) ** 2 + (2.0 * zeta * f * g) ** 2)


@njit(cache=True, error_model="numpy")
def _one_damper(mu, f, zeta, added, frequency):  # type: ignore[no-untyped-def]
    """Fill in what one damper adds, and where: the balance is a cubic in x = g^2.  All (S,)."""
    for i in range(mu.size):
        square, loss = f[i] * f[i], zeta[i] * zeta[i]
        a, constant = square * (1.0 - 2.0 * loss), square * (4.0 * loss - 1.0)
        c2, c1, c0 = mu[i] * constant - 1.0 - 2.0 * a, (1.0 + mu[i]) * square * square + 2.0 * a, -(square * square)
        third = -c2 / 3.0
        p, q = c1 - 3.0 * third * third, c0 + c1 * third + (c2 + third) * third * third
        depth = max(-p / 3.0, 0.0)
        cosine = -0.5 * q / (max(depth, 1e-100) * np.sqrt(max(depth, 1e-100)))
        three = depth > 0.0 and abs(cosine) <= 1.0
        angle = np.arccos(cosine) / 3.0 if three else 0.0
        outer = np.cbrt(-0.5 * q - np.copysign(np.sqrt(max(0.25 * q * q + p * p * p / 27.0, 0.0)), q))
        added[i], frequency[i] = np.inf, 1.0
        for root in range(3 if three else 1):
            if three:
                x = third + 2.0 * np.sqrt(depth) * np.cos(angle + 2.0 * root * np.pi / 3.0)
            else:
                x = third + outer - (p / (3.0 * outer) if outer != 0.0 else 0.0)
            for _ in range(4):  # Newton's steps: cancellation takes digits off both forms
                slope = (3.0 * x + 2.0 * c2) * x + c1
                if abs(slope) > 1e-9:
                    x -= (((x + c2) * x + c1) * x + c0) / slope
            if x > 0.0:
                share = mu[i] * zeta[i] * f[i] * x * x / ((square - x) * (square - x) + 4.0 * loss * square * x)
                if share < added[i]:
                    added[i], frequency[i] = share, np.sqrt(x)


def _balance_matrix(mu: FloatArray, f: FloatArray, zeta: FloatArray) -> FloatArray:
    """Matrices (draws, 2 dampers + 1, 2 dampers + 1) whose real eigenvalues are g^2 - 1 at the roots of the balance.

    In x = g^2 the share of a damper, x Re T, is a constant and a fraction over x^2 - 2 a x + f^4, that is a block of
    two rows.  One polynomial in x has the same roots, but loses them to rounding from a dozen dampers on.
    """
    count, draws = f.shape
    mu, square, loss = mu.T, f.T**2, zeta.T**2
    a = square * (1.0 - 2.0 * loss)
    constant = square * (4.0 * loss - 1.0)
    slope = 1.0 + 2.0 * constant * a / square**2  # in units of f^4, as the level: rows of like size
    matrix = np.zeros((draws, 2 * count + 1, 2 * count + 1))
    first, second = 1 + 2 * np.arange(count), 2 + 2 * np.arange(count)
    matrix[:, 0, 0] = -np.sum(mu * constant, axis=1)
    matrix[:, 0, first] = np.sqrt(mu) * constant
    matrix[:, 0, second] = -np.sqrt(mu) * slope * square
    matrix[:, second, 0] = np.sqrt(mu) * square
    matrix[:, first, first] = -1.0
    matrix[:, second, second] = 2.0 * a - 1.0
    matrix[:, first, second], matrix[:, second, first] = square, -square
    return matrix
