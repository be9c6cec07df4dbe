"""What the command line accepts, and how long it waits: every threshold with its unit, its reason, and how it was set.

Set by judgement unless a line says otherwise; the bounds of options are tried by `python -m tests.fuzz`.
"""

# Options.
LARGEST_SEED = 2**63 - 1  # the largest whole number that the files of results hold
MOST = 100_000  # processes, threads, campaigns: more is a slip of the pen
LONGEST_PATH = 3_000  # bytes, of a folder for results: systems end at 4,096, and names inside need their part
LARGEST_SC = 1e6  # Scruton number, of either sign; bridges have 1 to 200
EXPONENTS = (-2.0, 12.0)  # of the law, as in a model card
