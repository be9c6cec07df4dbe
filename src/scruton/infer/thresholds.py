"""What decides in inference: which records speak, which laws are sampled, what is worth a look.

Each stands under its reason and how it was set, with its unit beside it.
"""

from math import log

# Two bands of amplitude differ in damping where they are apart by this, Set by judgement.
DAMPING_VARIATION = 0.2  # of the mean

# and by these. Set by judgement.
DAMPING_CERTAINTY = 3.0  # joint standard errors

# Error of a band's damping that its scatter cannot show. Set by judgement.
BAND_FLOOR = 0.02  # relative

# Innovations are not white below this, adjusted over the records. Set by judgement.
NOT_WHITE = 0.01  # p-value

# Below this a steady amplitude is not known, however long the record: calibration of the sensor, drift of the wind.
# Set by judgement.
STEADY_FLOOR = 0.005  # relative

# Odds at which the data speak against the reference law: 20 to 1, which a true law meets once in twenty at most. Set
# by judgement.
FAVOURED = log(20.0)  # in log evidence

# A law this far below the best by Laplace's approximation, which is good to one or two, is not sampled. Set by
# judgement.
HOPELESS = 15.0  # in log evidence

# An adjusted p-value below this is worth a look. Set by judgement.
WORTH_A_LOOK = 0.01  # p-value

# Below this, predictable innovations make a fit one not to be trusted. Set by judgement.
SERIOUS_WHITENESS = 0.01  # p-value

# Below this, a statistic of the replicates does. Set by judgement.
SERIOUS_PREDICTIVE = 0.002  # p-value

# A prior more of whose draws are absurd says too little. Set by judgement.
ABSURD = 0.5  # share

# One record moves a posterior where leaving it out shifts it by this. Set by judgement.
MOVES = 2.0  # posterior sd

# One record disagrees with the others beyond this. Set by judgement.
DISAGREES = 3.0  # its own sd

# A record with fewer is not judged by its replicates. Set by judgement.
FEWEST_CYCLES = 12  # cycles

# A posterior that moves by this follows the factor that was scaled. From Kallioinen et al., Statistics and Computing
# 34, 57 (2024), Section 3.2.
SENSITIVE = 0.05  # Jensen-Shannon distance per doubling

# Beyond it the data did not move a parameter, Set by judgement.
NOT_MOVED = 0.8  # posterior over prior sd

# beyond this barely. Set by judgement.
BARELY_MOVED = 0.5  # posterior over prior sd

# Shape of the weights' tail beyond which reweighting cannot tell what a refit would. From Vehtari et al., JMLR 25
# (2024).
TRUSTED_KHAT = 0.7  # -

# Below it there is no lock-in, and a logarithm would be one of noise. Records beyond the edge of lock-in buffet at
# some 5 % of the peak. Set by judgement.
OUTSIDE_LOCK_IN = 0.1  # of a rig's largest amplitude

# Reduced velocities that differ by less are one. Set by judgement.
DISTINCT_SPEEDS = 1.005  # ratio

# With fewer there is no curve against the wind speed. Set by judgement.
FEWEST_SPEEDS = 3  # distinct reduced velocities

# A sweep states no uncertainty: calibration, and reading a modulated amplitude. Set by judgement.
SWEEP_LOG_SD = 0.02  # sd of ln amplitude

# Below it the linearised law is not to be trusted. Set by judgement.
FEW_DRAWS = 200.0  # effective draws

# Part of the discrepancy that all tests of a rig share: thirty points of one sweep are no thirty settings. Set by
# judgement.
COMMON = 0.5  # of the variance

# Smallest of Ljung-Box on a lock-in record whose fluctuations are used. Set on simulated records of the full
# equation: 120 clean ones, then 200 clean and 200 gusty that it was not set on (`scruton.infer.steady`).
WHITE = 0.001  # p-value

# Largest of slow gusts against none. Set on simulated records of the full equation: 120 clean ones, then 200 clean
# and 200 gusty that it was not set on (`scruton.infer.steady`).
GUST_ODDS = 1.0  # Bayes factor

# Fewest in a lock-in record: the relative error of a rate is about (2/N)^0.5 after N, 26 % at 30. Set on simulated
# records of the full equation: 120 clean ones, then 200 clean and 200 gusty that it was not set on
# (`scruton.infer.steady`).
RELAXATIONS = 30.0  # relaxation times

# Largest of the logarithm of the rate. Set on simulated records of the full equation: 120 clean ones, then 200 clean
# and 200 gusty that it was not set on (`scruton.infer.steady`).
RATE_SD = 0.5  # posterior over prior sd

# Of amplitude noise to phase noise, which scattered by 8 % over clean records. Set on simulated records of the full
# equation: 120 clean ones, then 200 clean and 200 gusty that it was not set on (`scruton.infer.steady`).
AGREE = 1.25  # ratio, either way

# Of the amplitude that the wind aims at, in the gusts that a record is accused of: what would pass for its own
# scatter, Set on simulated records of the full equation: 120 clean ones, then 200 clean and 200 gusty that it was not
# set on (`scruton.infer.steady`).
GUST_SIZE = 1.1  # sd over the record's

# and outlasts the relaxation. Set on simulated records of the full equation: 120 clean ones, then 200 clean and 200
# gusty that it was not set on (`scruton.infer.steady`).
GUST_TIMES = (4.0, 7.0, 10.0)  # relaxation times

# Without them nothing is judged of a lock-in record. Set by judgement.
FEWEST_ADJACENT = 40  # adjacent cycles

# A lock-in record that starts farther from where it stays has not settled, Set by judgement.
NOT_SETTLED = 4.0  # sd

# until it has come as near as this. Set by judgement.
SETTLED = 1.0  # sd

# Amplitude and phase are compared up to this frequency, well below the sensor noise. Set by judgement.
PHASE_BAND = 3.0  # relaxation rates
