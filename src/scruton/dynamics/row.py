"""Rows of the array in which walkers stand side by side in the filter with effects; the first are the coefficients."""

from scruton.dynamics.effects.terms import COLUMNS

LANES = 16  # walkers side by side
(
    # the amplitude, the wake's, gust and offset of the drive, and their covariances; the phase and its variance
    M, P, LAGGED, H, OFF, P_H, P_O, P_HH, P_HO, P_OO, ANGLE, ANGLE_P,
    # of a record: squares of the scatters, the gust's rate, terms that are no polynomial
    Q2, G2, FADE, ROUGH,
    # the weather in a cycle: wind, still-air damping, drive; a second line in the reading; shedding in phase and out
    WIND, STILL, DRIVE, LINE, FORCE, SIDE,
    # the way through a cycle: drift that noise induces, end, middle, rate at which deviations fade, half of their loss
    DRIFT, END, MIDDLE, RATE, HALF_LOSS,
    # of a stage of that way, where terms are rough: coefficients of 1, a, a^2, a^3, a^5, amplitude, da/dt, derivative
    K0, K1, K2, K3, K5, AT, RISES, BENDS, RISES_0, RISES_1, RISES_2, BENDS_0, BENDS_1,
    # what is left of a deviation at the end and in the middle, of a gust; what gust and offset do to state and mean
    PHI, HALF, KEEP, PUSH, PUSH_MEAN, HOLD, HOLD_MEAN,
    # covariances of state D, gust H and mean M that a gust of unit standard deviation builds up, and unit white noise
    DD, DH, HH, DM, HM, MM, Q_END, Q_CROSS, Q_MEAN, FAR,
    # what is seen: mean amplitude, its reading and the slope of that, its third harmonic; innovation and variance
    LEVEL, SHOWN, STEEP, THIRD, V, S,
    NODE,  # what is left of a gust at each of Gauss's nodes
) = range(COLUMNS, COLUMNS + 64)  # fmt: skip
ROWS = NODE + 5
