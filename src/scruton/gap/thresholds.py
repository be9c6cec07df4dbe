"""Every threshold of the diagnosis: its value, unit, reason, and how it was set.

"Judgement" means that no record of a computation is left.
"""

import numpy as np

# ---- the verdict
# Nats that a further effect must gain beside those found.  Judgement.
SECOND_NATS = 8.0
# Part of the first effect's gain that a further one must gain on top: forms differ, and the difference is no second
# effect.  Judgement.
SECOND_SHARE = 0.04
# Size of a further effect, relative to the relaxation damping, below which it is nobody's concern.  Judgement.
SMALLEST = 0.025
# Nats by which several effects must beat one generic term, for each beyond the first.  Judgement.
CHAIN_NATS = 10.0
# Nats over chance of a line in the spectrum beside the response.  Judgement.
LINE_NATS = 30.0
# Nats of colour and level that noise and fitting leave in the innovations.  Judgement.
ALLOWED_EXCESS = 4.0
# Part of the gain that may be left, for the form of an effect is never quite its form.  Judgement.
ALLOWED_SHARE = 0.12
# Nats by which the generic term must lead a catalogued effect.  Judgement.
PREFERENCE_NATS = 5.0
# Part of the generic term's gain that it must lead by on top.  Judgement.
PREFERENCE_SHARE = 0.12
# Part of a further effect's gain by which it may stay behind the generic term.  Judgement.
FURTHER_SHARE = 0.15
# Nats: effects that close are one group.  Judgement.
GROUP_NATS = 4.0
# Evidence of some effect against none is divided by this: how often such a lead is wrong.  Counted on
# simulated campaigns of `scruton challenge make`; command and seed were not kept.
ANY_TEMPERATURE = 2.5
# Evidence of one effect against another, whose forms are never quite those of nature.  Likewise.
TEMPERATURE = 4.0
# Effects at once.  Judgement.
MOST_EFFECTS = 3

# ---- which variants are fitted
# Variants of an effect, at most.  Time.
MOST_FITS = 4
# Nats behind the best score test of its effect at which a variant is still fitted.  Judgement.
FIT_WITHIN = 6.0
# Part of the best score test's gain added to that, for score tests hold to second order.  Judgement.
FIT_SHARE = 0.4
# Nats: score tests below are taken at their word.  Judgement.
HOPELESS = -1.0
# Beats in a record, at least, for a force off the response: slower ones are a drift.  Judgement.
FEWEST_BEATS = 1.5

# ---- the absolute check
# Lags of the Ljung-Box test.  Judgement.
LAGS = 6
# Parts of a record whose means and variances are compared.  Judgement.
BLOCKS = 4
# Cycles of a record, at least.  Judgement.
FEWEST_CYCLES = 16
# Standard deviations of chi-square that count as noise.  Judgement.
EXCESS_SIGMAS = 2.5
# Part of a kurtosis' standard errors that counts: its distribution has a heavy right tail.  Judgement.
KURTOSIS_SHARE = 0.6

# ---- where
# Probability that any curve of a campaign leaves zero by chance.  Stated.
CURVE_FALSE = 0.1
# Probability that any record of a campaign without a gap shows one kind of scatter.  Stated.
SCATTER_FALSE = 0.03
# Probability that any member of a campaign without a gap shows one kind of contrast.  Stated.
CONTRAST_FALSE = 0.03
# Cycles of a record whose scatter is looked at, at least.  Judgement.
FEWEST_CYCLES_OF_SCATTER = 24
# Cycles about a knot that informs it.  Judgement.
FEWEST_CYCLES_OF_A_KNOT = 4
# ln(amplitude) that a place covers at least.  Judgement.
SHORTEST_PLACE = 0.1
# Times the tolerated stiffness, in wind: gusts move phase and amplitude together.  Judgement.
STIFFNESS_IN_WIND = 2.0
# Growth ratio (damping ratio of growth) beyond which the frequency falls by half its square.  Second-order expansion.
FAST_GROWTH = 0.03
# Of a record's largest amplitude: where its wave would be bent.  Judgement.
HIGH_AMPLITUDE = 0.8
# Findings that are listed.  Judgement.
MOST_FINDINGS = 12
# Findings of one quantity, at most, before those of others have had their turn.  Judgement.
MOST_OF_A_QUANTITY = 3
# Of the largest gain of any effect: places that an effect of less would explain are echoes of another.  Judgement.
ECHO = 0.6
# Of the largest place of an effect, below which another is none.  Judgement.
NEGLIGIBLE_PLACE = 1e-3
# Records of an effect that are listed one by one.  Judgement.
MOST_RECORDS_OF_AN_EFFECT = 6

# ---- what the data cannot tell, and advice
# Standard deviations below which a signature is not seen.  Convention.
BLIND = 2.0
# Of the relaxation damping: size of an effect that was not found.  The challenge's usual severity.
USUAL_SIZE = 0.2
# Standard deviations that a further record should give: odds of a hundred at the temperature.
WANTED = float(np.sqrt(2.0 * TEMPERATURE * np.log(100.0)))
# Nats behind the verdict: then the fits themselves have told them apart.  Judgement.
FAR_BEHIND = 10.0
# Rivals that advice is given against.  Judgement.
MOST_RIVALS = 3
# Relative error of a static calibration.  Practice.
CALIBRATION_ERROR = 0.005
# Effort of a record against a still-air decay.  Judgement.
COSTS = {"still": 1.0, "calibration": 2.0, "repeat": 2.0, "far": 2.5, "scruton": 6.0}
# Of the relaxation damping: friction that no record in wind shows.  Judgement.
INVISIBLE_FRICTION = 0.1
# Relative: a gain of all channels alike.  Judgement.
INVISIBLE_GAIN = 0.05
# Relative uncertainty of the mass where none is stated.  Judgement.
UNKNOWN_MASS = 0.02
# Standard deviations of a bound.  Convention.
BOUND_SIGMAS = 2.0

# ---- how far the gap shrinks
# Nats that the null model must fall short by, beyond what a right one would.  A prototype gave shares of 1 to 4 of
# gaps that were weaker.
MEASURABLE_NATS = 10.0
# sd of ln(scatter) of a test about that of the others, where it is not known.  Judgement.
SCATTER_LIKE_OTHERS = 0.2
# Part of a record's cycles at its end that is steady.  Judgement.
TAIL = 0.2

# ---- rows of a table
# Part of the misfit, below which an effect closes nothing.  Judgement.
CLOSES_NOTHING = 0.005
# sd of ln(amplitude) read off a record, where none is stated.  Judgement.
SD_AMPLITUDE = 0.02
# sd of ln(relaxation rate) from its slope, where none is stated.  Judgement.
SD_RATE = 0.05
