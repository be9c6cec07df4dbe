"""What decides in this room: every threshold with its unit, its reason, and how it was set.

Where no command is named, a number was set by judgement when the code was written: no study of it is on record.
"""

import numpy as np

from scruton.campaign.schema import Motion

# Coverage and ranks (standard errors): a study has hundreds of cells, of which none may lie beyond by chance.
LIMIT = 4.0
# The same for a p-value: two-sided probability of a normal deviate beyond `LIMIT` (computed).
LIMIT_P = 6.334e-5
# Expected posterior sd over prior sd above which a design cannot inform a quantity. Judgement: half.
UNINFORMED = 0.5

# A campaign outside the family is drawn again unless every rig's stable amplitude [A/D] and relaxation rate over omega0
# lie within these: the slowest relaxes four times in 250 cycles, the longest record. Judgement.
OUTSIDE_AMPLITUDE, OUTSIDE_RELAXATION = (0.003, 0.3), (0.0025, 0.05)

# What the blind challenge is made of. Cases of a block without an effect, and with two: 25 blocks are 200 and 150.
WITHOUT_EFFECT, WITH_TWO = 8, 6
# Severity [-] from which two effects at once can be told apart. Judgement.
SEVERE_ENOUGH_FOR_TWO = 0.2
# Correlation with the reduced velocity below which tests differ without order: a tenth of the variance. Judgement.
MOST_ORDER = 0.3
# A body is kept when each of its rigs lies within these without effects: stable amplitude [A/D or rad], relaxation rate
# over circular frequency, Scruton number, damping ratio, Y1. Judgement: what section models are published with.
_EITHER = {"relaxation": (0.0035, 0.03), "scruton_number": (7.0, 110.0), "damping_ratio": (3e-4, 0.03)}
USUAL = {
    Motion.HEAVING: {"amplitude": (0.010, 0.15), "Y1": (-60.0, -3.0), **_EITHER},
    Motion.TORSIONAL: {"amplitude": (np.deg2rad(1.0), np.deg2rad(5.0)), "Y1": (-15.0, -0.5), **_EITHER},
}
# A case is kept when its limit cycle lies within these: amplitude over the ends of the usual range, amplitude and
# relaxation rate over those without the effects. Judgement: a laboratory would not have published anything else.
FAIR_RANGE, FAIR_AMPLITUDE, FAIR_RATE = (0.6, 1.3), (0.4, 2.5), (0.25, 4.0)
# A wake oscillator's motion is steady where the halves of its end differ by less than the first, and it is one limit
# cycle where growth and decay end within the second, over the stable amplitude without it. Judgement.
STEADY, SAME_CYCLE = 0.02, 0.03

# The score. Severity [-] above which a case counts as severe: between the severities that are made, 0.1 and 0.2.
SEVERE = 0.15
# Probability above which a wrong effect misleads.  Judgement.
CERTAIN = 0.9
# Relative change of a stable amplitude by the effect, above which its prediction is scored: smaller ones drown in
# the scatter of the records (0.5 to 1.5 %). Judgement.
MOVED = 0.03
# A probability of zero counts as this in the log score. Judgement: one in a million.
LEAST_PROBABILITY = 1e-6
# Temperatures that `challenge tune` looks among: an evidence is never taken for more than it says. Judgement.
COLDEST, HOTTEST = (1.0, 1.0), 50.0  # against none and between effects
# Shares of the probability that are dealt out evenly, among which it looks. Judgement, of the least: a study of
# simulated records is no evidence for better odds than fifty to one on measured ones.
FLOORS = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15)
# Bins of the reliability diagram, of equal count. Judgement.
RELIABILITY_BINS = 10

# The baselines. STLSQ: coefficient over the relaxation rate below which it is none. Judgement.
SPARSE_COEFFICIENT = 0.06
# Level of the chi-square test. Convention.
CHI_SQUARE_LEVEL = 0.01
# Bins of amplitude of one record, each of four cycles or more. Judgement.
CHI_SQUARE_BINS, CYCLES_OF_A_BIN = 8, 4

# What is wanted of a diagnosis, rates but for sizes, ratios and seconds: goals, not measurements. docs/diagnosis.md has
# them beside what was reached (the newest by `challenge make --cases 570 --seed 2110`).
WANTED = {
    "top-1, s >= 20 %": 0.96,
    "truth in the group, s >= 20 %": 0.99,
    "mean group size, s >= 20 %": 1.3,
    "top-1, s = 10 %": 0.88,
    "truth in the group, s = 10 %": 0.94,
    "mean group size, s = 10 %": 1.3,
    "no effect, called something else": 0.02,
    "outside the catalogue, called unknown, s >= 20 %": 0.95,
    "outside the catalogue, called unknown, s = 10 %": 0.80,
    "outside the catalogue, given to an effect with more than 0.9": 0.03,
    "catalogued, called unknown": 0.03,
    "calibration error of the verdict's probability": 0.04,
    "held-out stable amplitude, error before over after, s >= 20 %": 5.0,
    "median held-out shrink, verdict right": 0.85,
    "two at once, both named, s >= 20 %": 0.90,
    "seconds a campaign, one process (median)": 15.0,
}
# Of one rig without still-air records: that the truth is in a group of at most six.
WANTED_OF_ONE_RIG = {
    "truth in the group, s >= 20 %": 0.95,
    "mean group size, s >= 20 %": 6.0,
    "truth in the group, s = 10 %": 0.95,
    "mean group size, s = 10 %": 6.0,
    "seconds a campaign, one process (median)": 15.0,
}
