"""What decides in inference: which records speak, which laws are sampled, what is worth a look.

Each stands under its reason, with its unit beside it.  How a group was set stands above it; set by judgement are all
others, unless their own line says otherwise.
"""

from math import log

# Damping varies where it changes by this from the outer end of one band of amplitude to that of another, and their
# means differ by so many errors. Of rigs whose damping is constant 2 % or fewer are said to vary, of those in which it
# grows by a third up to the largest amplitude 91 to 96 % (by the difference of the means alone 1 and 21 to 27 %; 250
# simulated rigs each, with one to three ring-downs, on a seed that chose nothing).
DAMPING_VARIATION = 0.2  # of the mean
DAMPING_CERTAINTY = 3.0  # joint standard errors
# Error of a band's damping that its scatter cannot show.
BAND_FLOOR = 0.02  # relative
# Innovations are not white below this, adjusted over the records.
NOT_WHITE = 0.01  # p-value
# Below this a steady amplitude is not known, however long the record: calibration of the sensor, drift of the wind.
STEADY_FLOOR = 0.005  # relative

# A cycle's amplitude is told from the noise of the sensor beyond this.
SEEN = 3.0  # standard errors

# A stated stable amplitude contradicts the records where it is off by this and outside their 95 % interval.  Of 30 that
# another simulator stated three were, the three whose tests the posterior misses by more than 4 %.
STATED_OFF = 1.04  # ratio
# The reference law does not hold where the drift departs from it by this, one e-fold from the stable amplitude, with
# 95 % certainty.
DEPARTS = 0.1  # over the drift
# Records of one test are not of one wind where their stable amplitudes scatter by this with 95 % certainty: a wind that
# is set anew to 0.3 % moves them by 1 % at most.
SET_APART = 0.01
# A law that holds displaces what is known of the structural damping less than chance does in one campaign of a hundred.
DISPLACED = 0.01  # p-value
# A rig whose stable amplitude is off what every other rig foretells by more, with 95 % certainty, is named, where the
# scatter between settings seldom puts a rig as far off. Of the rigs in the paper's Table 5 one foretells another to
# 21 %. Rigs that scatter as the card has it are then named in 2 to 5 % of campaigns of two to six rigs (by the ratio
# alone in 4 to 15 %), at a scatter of 20 % in 6 to 23 % (16 to 43 %); one that is 1.5 times off others that agree to
# 2 % in 71 % of two, 79 of three, 91 of four and more (600 simulated campaigns each, on a seed that chose nothing).
OFF_CURVE = 1.25  # ratio
CHANCE = 0.05  # probability
# Two groups of rigs lie on two curves where every rig of one is off every rig of the other by more, and they are so on
# the average with 95 % certainty: by two of the 20 % by which rigs of one curve may be off it.
GROUPS_APART = 1.5  # ratio
# Odds at which the data speak against the reference law: 20 to 1, which a true law meets once in twenty at most.
FAVOURED = log(20.0)  # in log evidence
# A law this far below the best by Laplace's approximation, which is good to one or two, is sampled roughly, if at all.
BEYOND_DOUBT = 15.0  # in log evidence
# Laws are approximations, and a body's own may lie between two: log evidences between them count by one over this, as
# if so many times fewer cycles had been measured (a coarsened posterior; Miller and Dunson, JASA 114, 2019).
COARSENED = 4.0
# With several rigs a law is not sampled whose odds, so counted, are a thousandth of the best one's at most.
HOPELESS = COARSENED * log(1000.0)  # in log evidence
# Of the effective draws that the card asks for, a law beyond doubt gets this part where it is sampled all the same.
ROUGH_PART = 0.2  # -
# Gusts of a tunnel are no larger, nor is its wind set worse: a larger one acts as this.
MOST_GUSTS, MOST_SET_POINT = 0.06, 0.03  # sd over the stable amplitude

# Part of the weight of the laws that the evidence between them does not decide. Where no law of the card holds it goes
# by the stable amplitudes of rigs that are left out, with one rig evenly: among four laws 10 % each. With one rig where
# a law holds, 5 % each: no less than lies beyond either end of a 90 % interval. Dealt out evenly from three rigs, a law
# that misses them said of a setting at which a vibration was measured (coherence loss) that it may be dead.
LAWS_SHARE_DOUBTED, LAWS_SHARE_ALONE = 0.4, 0.2  # of the weight

# A law to which evidence and stacking give less carries no weight: what is inferred under it alone predicts little.
CARRIES = 0.05  # of the weight

# Where structural damping falls so fast with amplitude that nothing is stable, the rate is this part of the law's.
LEAST_RATE = 0.02  # of lambda

# An adjusted p-value below this is worth a look.
WORTH_A_LOOK = 0.01  # p-value
# Below this, predictable innovations make a fit one not to be trusted; below that, a statistic of the replicates does.
SERIOUS_WHITENESS = 0.01  # p-value
SERIOUS_PREDICTIVE = 0.002  # p-value
# A prior more of whose draws are absurd says too little.
ABSURD = 0.5  # share
# One record moves a posterior where leaving it out shifts it by this, and disagrees with the others beyond that.
MOVES = 2.0  # posterior sd
DISAGREES = 3.0  # its own sd
# A record with fewer is not judged by its replicates.
FEWEST_CYCLES = 12  # cycles
# A posterior that moves by this follows the factor that was scaled. From Kallioinen et al., Statistics and Computing
# 34, 57 (2024), Section 3.2.
SENSITIVE = 0.05  # Jensen-Shannon distance per doubling
# Beyond the first the data did not move a parameter, beyond the second barely.
NOT_MOVED = 0.8  # posterior over prior sd
BARELY_MOVED = 0.5  # posterior over prior sd
# And that stayed where its prior is: then its posterior equals its prior.
SAME_PLACE = 0.25  # prior sd
# Shape of the weights' tail beyond which reweighting cannot tell what a refit would. From Vehtari et al., JMLR 25
# (2024).
TRUSTED_KHAT = 0.7  # -

# Below it there is no lock-in, and a logarithm would be one of noise. Records beyond the edge of lock-in buffet at
# some 5 % of the peak.
OUTSIDE_LOCK_IN = 0.1  # of a rig's largest amplitude
# With fewer draws in which the relaxation at zero damping is positive a test at another speed says nothing of it.
STRONG = 0.1  # share of the draws
# Reduced velocities that differ by less are one, and with fewer there is no curve against the wind speed.
DISTINCT_SPEEDS = 1.005  # ratio
FEWEST_SPEEDS = 3  # distinct reduced velocities
# A sweep states no uncertainty: calibration, and reading a modulated amplitude.
SWEEP_LOG_SD = 0.02  # sd of ln amplitude
# Below it the linearised law is not to be trusted.
FEW_DRAWS = 200.0  # effective draws
# Part of the discrepancy that all tests of a rig share: thirty points of one sweep are no thirty settings.
COMMON = 0.5  # of the variance

# Set on simulated records of the full equation: 120 clean ones, then 200 clean and 200 gusty that they were not set on
# (`scruton.infer.steady`). Smallest of Ljung-Box on a lock-in record whose fluctuations are used.
WHITE = 0.001  # p-value
# Largest of slow gusts against none.
GUST_ODDS = 1.0  # Bayes factor
# Fewest in a lock-in record: the relative error of a rate is about (2/N)^0.5 after N, 26 % at 30.
RELAXATIONS = 30.0  # relaxation times
# Largest of the logarithm of the rate.
RATE_SD = 0.5  # posterior over prior sd
# Of amplitude noise to phase noise, which scattered by 8 % over clean records.
AGREE = 1.25  # ratio, either way
# Of the amplitude that the wind aims at, in the gusts that a record is accused of: what would pass for its own
# scatter, and outlasts the relaxation.
GUST_SIZE = 1.1  # sd over the record's
GUST_TIMES = (4.0, 7.0, 10.0)  # relaxation times

# Without them nothing is judged of a lock-in record.
FEWEST_ADJACENT = 40  # adjacent cycles
# A lock-in record that starts farther from where it stays has not settled, until it has come as near as that.
NOT_SETTLED = 4.0  # sd
SETTLED = 1.0  # sd
# Amplitude and phase are compared up to this frequency, well below the sensor noise.
PHASE_BAND = 3.0  # relaxation rates

# Of walkers, draws, steps and the like that a card may ask for: beyond, memory and patience end.
MOST_SAMPLED = 1e7  # -

# So often in a row a sweep of the campaign model moves what no record is read for, and then the discrepancies alone, to
# each move of the tests' own: it costs little beside a likelihood. With 3 and 0 the slowest coordinate of the campaign
# model of `examples/closed-box-heaving` forgets in nearly twice the steps that it takes with 6 and 3, with 3 and 3 in
# about as many; that of `examples/rectangle-4to1` in as many whatever they are (`scruton fit`, seeds 0 and 1).
TURNS_OF_THE_SHARED, TURNS_OF_THE_SCALES = 6, 3  # -

# Chance that a step moves the set-point scatters of all tests together with what they lie about, which costs as much as
# the moves of the tests' own. At one in two they forget themselves about as soon as the tests' rates, at one in four
# later (`scruton fit` of `examples/rectangle-4to1`, seeds 0 to 2, and of `examples/closed-box-heaving`, 0 and 1).
CHANCE_OF_ALL = 0.5  # -

# The rates of so many tests at most are moved together with the departure from the law that tests share. With three
# rigs (`examples/rectangle-4to1`, nine seeds) a fit takes 188 steps for 212, with seven (`closed-box-heaving`, four)
# 218 for 234; more rates than that would ask for more walkers, too.
FEW_RATES = 10  # tests

# Of the variance of a test's departure from the law, what the tests of a campaign share: a law that is not the body's
# departs alike in all of them, over the stable amplitude; what sits at one amplitude does not. By judgement.
DEPARTURE_IN_COMMON = 0.5  # -

# Of the variance of the logarithm of a test's set-point scatter, what the tests of a campaign share: one tunnel sets
# its wind by one means, and what that does to the amplitude differs between settings by a third or so. By judgement.
SET_POINT_IN_COMMON = 0.86
