"""What the command line accepts, and how long it waits: every threshold with its unit, its reason, and how it was set.

Set by judgement unless a line says otherwise; the bounds of options are tried by `python -m tests.fuzz`.
"""

# Options.
LARGEST_SEED = 2**63 - 1  # the largest whole number that the files of results hold
MOST = 100_000  # processes, threads, campaigns: more is a slip of the pen
LONGEST_PATH = 3_000  # bytes, of a folder for results: systems end at 4,096, and names inside need their part
LARGEST_SC = 1e6  # Scruton number, of either sign; bridges have 1 to 200
EXPONENTS = (-2.0, 12.0)  # of the law, as in a model card

# Processes and schedulers.
LARGEST_CERTIFICATE = 10**6  # bytes of a PEM file: those in use have some thousands
REACH = 5  # s, to reach a scheduler and to see its first worker
PATIENCE = 60  # s without any worker before what is left is given up
POLL = 1  # s between looks at how many workers there are
ALLOWED_DEATHS = 1  # of the worker that does a task: it may have died of something else: one more chance

# What is shown.
SHARE_SHOWN = 0.005  # weight of a law: a smaller one would be shown as 0 %
