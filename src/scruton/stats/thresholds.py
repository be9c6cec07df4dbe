"""Numbers that decide something in this room: unit, reason, and how each was set.

Where nothing else is said, a value was set by judgement, without a run to show for it.
"""

# A walker whose mean lies this far below (or above) the median walker's is not in the same mode.
STUCK_BELOW = 20.0  # in log posterior

# A run this long need not span so many autocorrelation times, and no walker of it may have rejected every proposal.
LONG_RUN = 100  # steps

# A shorter run must span these. One that has not yet left its start looks converged, ensemble for ensemble; but its
# autocorrelation time then grows with its length.
TIMES_SPANNED = 6.0  # autocorrelation times

# A rough number of effective draws may be so much larger in truth.
ROUGHLY = 2.0  # -

# A run that wants draws alone goes on for as many steps as seem to be wanted, times this, and for this part at least.
SPARE = 1.2  # -
LEAST_MORE = 0.25  # of its length

# Shorter chains are not judged: what they say of the autocorrelation is too good.
FEWEST_STEPS = 15  # steps

# Error that the prior mass of a constraint is known to: small beside that of an evidence.
PRIOR_MASS_ERROR = 0.01  # relative

# A Student-t is fitted to weighted draws worth these for each dimension; fewer say nothing of a covariance.
DRAWS_A_DIMENSION = 10  # effective draws

# As many times the rounds asked for may a poor start need.
MORE_ROUNDS = 3  # times

# Largest shape of the tail of importance weights whose error can be believed. From Vehtari et al., JMLR 25 (2024).
GOOD_PARETO_K = 0.7  # -

# Fewest independent draws on which an error rests.
GOOD_SIZE = 100.0  # draws

# Largest sd of the weighted draws over that of their proposal: a narrower one sees only its own surroundings.
GOOD_WIDENING = 1.15  # -

# The proposal is a little wider than the Laplace approximation, as independence moves want it.
WIDEN = 1.05  # -

# Searches that end nearer to each other have found one optimum: rounding leaves less than a hundredth between them.
SAME_OPTIMUM = 5.0  # posterior sds

# An optimum no lower than this is worth an ensemble's start: less weight than one in 20,000, unless it is far wider.
WORTH_A_START = 10.0  # in log posterior

# A search that lies lower than is of any use is given up where 25 steps bring less than this part of what it lacks: of
# laws a hundred nats behind, whose optimum lies at the rim of what has a stable amplitude, they bring 2 to 10 nats.
GIVES_UP = 0.2  # of the log posterior that lacks

# Scale of the walkers' start over that of the proposal, so that ensembles that agree have mixed.
OVERDISPERSED = 1.5  # -

# No walker starts this far below the optimum.
FAR_BELOW = 25.0  # in log posterior

# So often does a run that has not converged fit its proposals to its draws and start again.
ADAPTATIONS = 8  # times

# The first of them at once, the next where the run has not a third of the draws that it wants, the others where it is
# not soon long enough and half of all. The campaign model of `examples/rectangle-4to1` takes 150 steps (nine seeds)
# where a fourth at once makes it 188; of eight others four take a tenth to a quarter fewer, three as many, one a tenth
# more.
EARLY = 3  # times
FAR_FROM_ENOUGH = 3.0  # times

# Ensembles whose means scatter by less have met, and share their proposals.
MET = 0.3  # posterior sds

# As much weight have DE and stretch beside a proposal that was fitted to draws: a curved posterior in two dimensions
# (`tests/stats/test_stats_sampler.py`) is called converged at 0.97 to 0.99 of its width, and at 0.82 to 0.95 with 1.
MORE_LOCAL = 5.0  # times

# A record with fewer is not judged.
FEWEST_INNOVATIONS = 12  # innovations

# The Ljung-Box test looks at a fifth as many lags as there are innovations, and at most at these.
MOST_LAGS = 20  # lags
