r"""The amplitude equation with every term that an effect may add, as a table of coefficients for each record.

.. math:: \dot a = -(s_1 + w\,(1 - e^{-r(\tau + 1/2)}))\,a - s_2 a^2 - s_3 a^3 - F\frac{a}{\sqrt{a^2 + a_F^2}}
          - (1 + \gamma\tau)\,(l_1 + l_2 a + l_3 a^2 + l_5 a^4 - k a^n)\,a_\ell^{*}
          + (1 + 2\gamma\tau)\,c\,(1 - e^{-a_\ell/a_c}) + p\,(a_\ell - a)
          + F_c\cos\chi + F_s\sin\chi + h + o + q\,\dot W

with tau the time in the record from -1/2 to 1/2, a_l the amplitude that the wake remembers, chi the angle between
the shedding and the response, h slow gusts of the drive (Ornstein-Uhlenbeck), and o what it is off by in a record.
The wind has other courses than the straight one, gamma tau, too.
Friction that builds up over a displacement has another form (`scruton.dynamics.friction`).
The reading is gain times the (clipped) mean of a over a cycle.  An effect is an object that fills some of these
coefficients from its parameters: it knows no data and no inference.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from scruton.arrays import FloatArray

IntArray = np.ndarray
HATS = 8  # hat functions in ln(amplitude) of the generic damping discrepancy


class Belongs(StrEnum):
    """Whose a coefficient or an effect is; what is the wind's goes to a bridge, nothing else does."""

    RIG = "rig"  # springs, clamps, dampers
    WIND = "wind"  # what the section and the flow would do anywhere
    RUN = "run"  # the tunnel during one record
    SENSOR = "sensor"  # the reading


_RIG, _WIND, _RUN, _SENSOR = Belongs


class Term(IntEnum):
    """Columns of the table of coefficients, for one record, each with whose it is; amplitudes are A/D or rad."""

    belongs: Belongs

    def __new__(cls, column: int, belongs: Belongs) -> Self:
        """One column and its owner: one that is new says whose it is."""
        term = int.__new__(cls, column)
        term._value_, term.belongs = column, belongs
        return term

    STRUCTURAL = 0, _RIG  # s1 [1/s]
    STRUCTURAL_LINEAR = 1, _RIG  # s2 [1/s per amplitude]
    STRUCTURAL_SQUARE = 2, _RIG  # s3 [1/s per amplitude^2]
    FRICTION = 3, _RIG  # F [amplitude/s]
    FRICTION_WIDTH = 4, _RIG  # a_F; of Dahl's friction the displacement over which it builds up
    AERO = 5, _WIND  # l1 [1/s]
    DRIVE = 6, _WIND  # c [amplitude/s]
    AERO_LINEAR = 7, _WIND  # l2
    AERO_SQUARE = 8, _WIND  # l3
    AERO_FOURTH = 9, _WIND  # l5
    COHERENCE = 10, _WIND  # a_c; 0: none lost
    TREND = 11, _RUN  # gamma: relative change of the wind speed over the record, linear
    LAG = 12, _WIND  # [s]
    LAG_KIND = 13, _WIND  # 0: the wake's amplitude sets the force; 1: it sets the damping; 2, 3: neither, see LATE
    LAG_START = 14, _WIND  # amplitude that the wake remembers at the release, over that of the release
    FORCE_COS = 15, _WIND  # [amplitude/s]
    FORCE_SIN = 16, _WIND
    FORCE_RATE = 17, _WIND  # circular frequency of the shedding minus that of the demodulation [rad/s]
    GAIN = 18, _SENSOR  # reading over truth, minus 1
    CLIP = 19, _SENSOR  # level of saturation; 0: none
    # 1: tanh, 2: z/(1 + z^8)^(1/8), p > 2.5: z/(1 + z^p)^(1/p); 0: hard on both sides, -s: the other at CLIP/(1 - s);
    # -2, -3: no saturation, but play, or a dead zone, of half the width CLIP
    CLIP_SOFT = 20, _SENSOR
    SCATTER = 21, _WIND  # q [amplitude/s^0.5]
    NOISE = 22, _SENSOR  # factor on standard errors
    DETUNING = 23, _RIG  # frequency over that of the demodulation, minus 1
    STIFFNESS = 24, _RIG  # relative change of frequency per amplitude^2
    PHASE_SCATTER = 25, _WIND  # q of the phase times amplitude [amplitude/s^0.5]
    THIRD = 26, _SENSOR  # in-phase third harmonic over the amplitude
    THIRD_NOISE = 27, _SENSOR  # factor on its standard errors
    JUMP = 28, _RUN  # relative change of the drive, from some moment on
    JUMP_TIME = 29, _RUN  # [s] after the first cycle
    LINE_COS = 30, _SENSOR  # a second oscillation in the reading, amplitude
    LINE_SIN = 31, _SENSOR
    LINE_RATE = 32, _SENSOR  # [rad/s] against the demodulation
    LINE_DECAY = 33, _SENSOR  # [1/s]
    STIFFNESS_LINEAR = 34, _RIG  # relative change of frequency per amplitude
    JUMP_RATE = 35, _RUN  # added damping rate from that moment on [1/s]: in results of earlier versions
    TREND_SINE = 36, _RUN  # the same, along half a sine
    TREND_DRIVE = 37, _RUN  # relative change of the drive alone over the record, linear
    GUST = 38, _RUN  # standard deviation of the drive's slow gusts [amplitude/s]
    GUST_RATE = 39, _RUN  # at which they forget themselves [1/s]
    SET_POINT = 40, _RUN  # standard deviation of the drive from record to record [amplitude/s]
    TREND_ARCH = 41, _RUN  # relative change of the wind speed in the middle of the record, along half a sine
    STIFFNESS_FOURTH = 42, _RIG  # relative change of frequency per amplitude^4
    HAT = 43, _WIND  # first of HATS excess damping rates [1/s]; what nobody has named goes to the bridge, too
    BUMP = 43 + HATS, _WIND  # excess damping rate near one amplitude, at its largest [1/s]
    BUMP_AT = 44 + HATS, _WIND  # ln of that amplitude
    BUMP_WIDTH = 45 + HATS, _WIND  # standard deviation in ln(amplitude)
    FRICTION_SPRING = 46 + HATS, _RIG  # pi F/(2 omega) of Dahl's friction [amplitude]; 0: F a/sqrt(a^2 + a_F^2)
    LATE = 47 + HATS, _WIND  # p: of the drive, what follows the amplitude late [1/s]; of kind 3 c p/a follows so
    WARMING = 48 + HATS, _RIG  # w: structural damping that a record gains as it goes on [1/s]
    WARMING_PACE = 49 + HATS, _RIG  # duration of the record over the time in which it does
    FREQUENCY_TREND = 50 + HATS, _RUN  # relative change of the frequency over the record, linear
    FREQUENCY_LOSS = 51 + HATS, _WIND  # relative loss of frequency over (da/dt/(a omega))^2
    TREND_DRIVE_ARCH = 52 + HATS, _RUN  # relative change of the drive alone in the middle of the record
    STRUCTURAL_RISE = 53 + HATS, _RIG  # s: damping rate s a^p/(a^p + a_s^p), which levels off [1/s]
    STRUCTURAL_KNEE = 54 + HATS, _RIG  # a_s
    STRUCTURAL_POWER = 55 + HATS, _RIG  # p, that it begins as; 0: s (1 - exp(-a/a_s))
    FRICTION_POWER = 56 + HATS, _RIG  # of the amplitude, that friction goes with: F is what it is at one
    LAW_POWER = 57 + HATS, _WIND  # k: growth k a^n at the rate of the amplitude [1/s per amplitude^n]
    LAW_EXPONENT = 58 + HATS, _WIND  # n
    COHERENCE_POWER = 59 + HATS, _WIND  # p: the drive goes as x/(1 + x^p)^(1/p), x = a/a_c; 0: 1 - exp(-x)
    COHERENCE_FLOOR = 60 + HATS, _WIND  # share of the drive that is never lost
    FRICTION_HUMP = 61 + HATS, _RIG  # h: friction is 1 + h/(1 + (a/a_h)^2) times what it is at speed (Stribeck)
    FRICTION_HUMP_AT = 62 + HATS, _RIG  # a_h
    FORCE_TWICE = 63 + HATS, _WIND  # 1: what is forced is the stiffness, near twice the frequency: FORCE_... in [1/s]
    CORRELATION = 64 + HATS, _RUN  # of a cycle's innovation of the amplitude with that of the cycle before
    PHASE_CORRELATION = 65 + HATS, _RUN  # the same of the phase
    TREND_SETTLING = 66 + HATS, _RUN  # relative change of the wind speed that a record gains as it goes on
    TREND_DRIVE_SETTLING = 67 + HATS, _RUN  # the same of the drive alone
    TREND_PACE = 68 + HATS, _RUN  # duration of the record over the time in which it does


COLUMNS = int(Term.TREND_PACE) + 1
BELONGS: dict[Term, Belongs] = {term: term.belongs for term in Term}


class CutOff(NamedTuple):
    """Where the wave of a record is seen to be cut off.

    Attributes
    ----------
    level : float
        Amplitude from which it is on one side [A/D or rad].
    other : float
        That level over the other side's, at most one; 0 where that is not cut off.
    nats : float
        How surely.
    """

    level: float
    other: float
    nats: float


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
        U/(f D) with the frequency in wind, NaN in still air.
    scruton_number : (R,) array
        As stated; NaN in still air.
    reference_amplitude, reference_rate : float
        Stable amplitude (or typical amplitude in still air) and relaxation rate [1/s] to which sizes are referred.
    reference_omega : float
        Natural circular frequency that belongs to `reference_rate`.
    knots : (HATS,) array
        Amplitudes at which the generic discrepancy has its knots.
    cut_off : mapping
        Of records whose wave is seen to be cut off, by number.
    unstated : frozenset of int
        Rigs whose structural damping nobody states, by number.
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
    cut_off: Mapping[int, CutOff] = field(default_factory=dict)
    unstated: frozenset[int] = frozenset()

    @property
    def wind(self) -> IntArray:
        """Whether each record was made in wind, (R,) of bool."""
        wind: IntArray = self.test >= 0
        return wind

    @cached_property
    def largest_of_rig(self) -> FloatArray:
        """Largest amplitude of each record's rig in still air, or in wind where that rig has no such record, (R,)."""
        still = np.array([self.largest[(self.rig == rig) & ~self.wind].max(initial=0.0) for rig in self.rig])
        return np.where(still > 0.0, still, [self.largest[self.rig == rig].max() for rig in self.rig])

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
        return compact(np.where(mask, np.arange(len(self.records)), -1))


def compact(members: IntArray) -> IntArray:
    """Renumber members from zero without holes; -1 stays."""
    numbers = np.full(members.shape, -1, dtype=np.intp)
    inside = members >= 0
    numbers[inside] = np.unique(members[inside], return_inverse=True)[1]
    return numbers
