r"""The amplitude equation with every term that an effect may add, as a table of coefficients for each record.

.. math:: \dot a = -s_1 a - s_2 a^2 - s_3 a^3 - F\frac{a}{\sqrt{a^2 + a_F^2}}
          - (1 + \gamma\tau)\,(l_1 + l_2 a + l_3 a^2 + l_5 a^4)\,a_\ell^{*}
          + (1 + 2\gamma\tau)\,c\,(1 - e^{-a_\ell/a_c}) + F_c\cos\chi + F_s\sin\chi + q\,\dot W

with tau the time in the record from -1/2 to 1/2, a_l the amplitude that the wake remembers, and chi the angle between
the shedding and the response.  The reading is gain times the (clipped) mean of a over a cycle.  An effect is an object
that fills some of these coefficients from its parameters: it knows no data and no inference.
"""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np

from scruton.arrays import FloatArray

IntArray = np.ndarray
HATS = 8  # hat functions in ln(amplitude) of the generic damping discrepancy


class Term(IntEnum):
    """Columns of the table of coefficients, for one record; amplitudes are A/D or rad."""

    STRUCTURAL = 0  # s1 [1/s]
    STRUCTURAL_LINEAR = 1  # s2 [1/s per amplitude]
    STRUCTURAL_SQUARE = 2  # s3 [1/s per amplitude^2]
    FRICTION = 3  # F [amplitude/s]
    FRICTION_WIDTH = 4  # a_F
    AERO = 5  # l1 [1/s]
    DRIVE = 6  # c [amplitude/s]
    AERO_LINEAR = 7  # l2
    AERO_SQUARE = 8  # l3
    AERO_FOURTH = 9  # l5
    COHERENCE = 10  # a_c; 0: none lost
    TREND = 11  # gamma: relative change of the wind speed over the record, linear
    LAG = 12  # [s]
    LAG_KIND = 13  # 0: the wake's amplitude sets the force; 1: it sets the damping
    LAG_START = 14  # amplitude that the wake remembers at the release, over that of the release
    FORCE_COS = 15  # [amplitude/s]
    FORCE_SIN = 16
    FORCE_RATE = 17  # circular frequency of the shedding minus that of the demodulation [rad/s]
    GAIN = 18  # reading over truth, minus 1
    CLIP = 19  # level of saturation; 0: none
    CLIP_SOFT = 20  # 0: hard, 1: tanh, 2: z/(1 + z^8)^(1/8)
    SCATTER = 21  # q [amplitude/s^0.5]
    NOISE = 22  # factor on standard errors
    DETUNING = 23  # frequency over that of the demodulation, minus 1
    STIFFNESS = 24  # relative change of frequency per amplitude^2
    PHASE_SCATTER = 25  # q of the phase times amplitude [amplitude/s^0.5]
    THIRD = 26  # in-phase third harmonic over the amplitude
    THIRD_NOISE = 27  # factor on its standard errors
    JUMP = 28  # relative change of the drive, from some moment on
    JUMP_TIME = 29  # [s] after the first cycle
    LINE_COS = 30  # a second oscillation in the reading, amplitude
    LINE_SIN = 31
    LINE_RATE = 32  # [rad/s] against the demodulation
    LINE_DECAY = 33  # [1/s]
    STIFFNESS_LINEAR = 34  # relative change of frequency per amplitude
    JUMP_RATE = 35  # added damping rate from that moment on [1/s]
    TREND_SINE = 36  # the same, along half a sine
    TREND_DRIVE = 37  # relative change of the drive alone over the record, linear
    HAT = 38  # first of HATS excess damping rates [1/s]


COLUMNS = int(Term.HAT) + HATS


class Belongs(StrEnum):
    """Whose a coefficient or an effect is; what is the wind's goes to a bridge, nothing else does."""

    RIG = "rig"  # springs, clamps, dampers
    WIND = "wind"  # what the section and the flow would do anywhere
    RUN = "run"  # the tunnel during one record
    SENSOR = "sensor"  # the reading


# Every column stands here: one that is new belongs to nobody until it is said whose it is.
BELONGS: dict[Term, Belongs] = {
    **dict.fromkeys(
        (Term.STRUCTURAL, Term.STRUCTURAL_LINEAR, Term.STRUCTURAL_SQUARE, Term.FRICTION, Term.FRICTION_WIDTH,
         Term.DETUNING, Term.STIFFNESS, Term.STIFFNESS_LINEAR),
        Belongs.RIG,
    ),
    **dict.fromkeys(
        (Term.AERO, Term.DRIVE, Term.AERO_LINEAR, Term.AERO_SQUARE, Term.AERO_FOURTH, Term.COHERENCE, Term.LAG,
         Term.LAG_KIND, Term.LAG_START, Term.FORCE_COS, Term.FORCE_SIN, Term.FORCE_RATE, Term.SCATTER,
         Term.PHASE_SCATTER),
        Belongs.WIND,
    ),
    **dict.fromkeys(
        (Term.TREND, Term.TREND_SINE, Term.TREND_DRIVE, Term.JUMP, Term.JUMP_TIME, Term.JUMP_RATE), Belongs.RUN
    ),
    **dict.fromkeys(
        (Term.GAIN, Term.CLIP, Term.CLIP_SOFT, Term.NOISE, Term.THIRD, Term.THIRD_NOISE, Term.LINE_COS, Term.LINE_SIN,
         Term.LINE_RATE, Term.LINE_DECAY),
        Belongs.SENSOR,
    ),
    Term.HAT: Belongs.WIND,  # what nobody has named goes to the bridge, for want of knowing better
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Layout:
    """What an effect may know of a campaign.

    Attributes
    ----------
    records : (R,) tuple of str
        Names.
    rig, test : (R,) arrays of int
        Rig of each record; its test, or -1 in still air.
    direction : (R,) array of int
        1 growth, -1 decay in wind, 0 still air or steady.
    duration : (R,) array
        s.
    omega : (R,) array
        Natural circular frequency of the record's rig [rad/s].
    largest : (R,) array
        Largest amplitude of the record.
    reduced_velocity : (R,) array
        U/(f0 D), NaN in still air.
    scruton_number : (R,) array
        As stated; NaN in still air.
    reference_amplitude, reference_rate : float
        Stable amplitude (or typical amplitude in still air) and relaxation rate [1/s] to which sizes are referred.
    reference_omega : float
        Natural circular frequency that belongs to `reference_rate`.
    knots : (HATS,) array
        Amplitudes at which the generic discrepancy has its knots.
    """

    records: tuple[str, ...]
    rig: IntArray
    test: IntArray
    direction: IntArray
    duration: FloatArray
    omega: FloatArray
    largest: FloatArray
    reduced_velocity: FloatArray
    scruton_number: FloatArray
    reference_amplitude: float
    reference_rate: float
    reference_omega: float
    knots: FloatArray

    @property
    def wind(self) -> IntArray:
        """Whether each record was made in wind, (R,) of bool."""
        found: IntArray = self.test >= 0
        return found

    @property
    def rate(self) -> FloatArray:
        """The reference rate at every rig's own frequency [1/s], (R,): equal damping ratios."""
        return self.reference_rate * self.omega / self.reference_omega

    def everywhere(self) -> IntArray:
        """Members for one value in all records."""
        return np.zeros(len(self.records), dtype=np.intp)

    def in_wind(self) -> IntArray:
        """Members for one value in all records in wind."""
        return np.where(self.wind, 0, -1)

    def by_rig(self) -> IntArray:
        """Members for one value for each rig."""
        return compact(self.rig)

    def by_test(self) -> IntArray:
        """Members for one value for each test in wind."""
        return compact(self.test)

    def only(self, mask: IntArray) -> IntArray:
        """Members for one value in the records of a mask."""
        return np.where(mask, 0, -1)

    def each(self, mask: IntArray) -> IntArray:
        """Members for a value of its own in each record of a mask."""
        found = np.full(len(self.records), -1, dtype=np.intp)
        found[mask] = np.arange(int(np.count_nonzero(mask)))
        return found


def compact(members: IntArray) -> IntArray:
    """Renumber members from zero without holes; -1 stays."""
    found = np.full(members.shape, -1, dtype=np.intp)
    inside = members >= 0
    found[inside] = np.unique(members[inside], return_inverse=True)[1]
    return found
