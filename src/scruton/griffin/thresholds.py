"""Numbers that decide something in this room: unit, reason, and how each was set.

Where nothing else is said, a value was set by judgement, without a run to show for it.
"""

# Extrapolation index |x| beyond which a curve counts as extrapolated. From the closed forms, the amplitudes by laws of
# aerodynamic damping from n = -1 to 2 differ by at most 1.6 % at x = 0.1, 7.6 % at 0.2 (5.6 % at -0.2) and 22 % at 0.3.
X_TRUSTED = 0.3

# How fast the Griffin curve may leave its law: variance of the discrepancy per unit of the extrapolation index, and per
# e-fold of amplitude, beyond what the tests cover, over that of a setting; and where it stops to grow. Judged, and then
# held against 21 campaigns outside the family (`benchmarks.new_settings`): from 0 to 1 their log score is the same to
# 0.4 nats, at 2 it is less by 0.9 and at 4 by 3.2.
WALK, FARTHEST = 1.0, 4.0

# Relative standard deviation of a design damping from which it is said: codes give 0.3 to 0.45.
WIDE_DAMPING = 0.5

# Part of the weight of the laws from which it is said that they did not converge: a requirement at 95 % confidence may
# rest on one twentieth of the draws alone, and one idle law of four has as much with one rig.
UNSETTLED = 0.05

# Part of the draws that must have an amplitude for a band to be given.
ENOUGH_DRAWS = 0.9

# Of two fits: how many Monte Carlo standard errors apart medians differ by more than the sampling. Some thirty are
# compared at once: at four, one pair of alike fits in five hundred has one that seems to differ.
BEYOND_ERROR = 4.0

# By what factor their 90 % intervals differ from which it is said: less changes no decision, and the error of a width
# is some 5 % at 400 effective draws.
WIDTH_APART = 1.5
