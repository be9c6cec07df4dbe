"""What the command line accepts, and how long it waits: every threshold with its unit, its reason, and how it was set.

Set by judgement unless a line says otherwise; the bounds of options are tried by `python -m tests.fuzz`.
"""

# Options.
LARGEST_SEED = 2**63 - 1  # the largest whole number that the files of results hold
MOST = 100_000  # processes, threads, campaigns: more is a slip of the pen
LONGEST_PATH = 3_000  # bytes, of a folder for results: systems end at 4,096, and names inside need their part
LARGEST_SC = 1e6  # Scruton number, of either sign; bridges have 1 to 200
EXPONENTS = (-2.0, 12.0)  # of the law, as in a model card

# What the stages of a fit cost, seconds of a processor on the shipped example and on parts of it: the line of progress
# weighs them, and nothing else does.
COST_RIG, COST_TEST, COST_TRIAL = 0.3, 0.5, 0.25  # each
COST_LAW, COST_LAW_LEAST = 1.7, 3.5  # each law that is sampled, by peak test; and at least
COST_SPEEDS, COST_EFFECT = 1.0, 5.0
COST_OTHER = 0.2  # a posterior without one record, and whatever else there is
