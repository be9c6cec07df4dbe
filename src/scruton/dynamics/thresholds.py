"""What this room decides by: every threshold with its unit, its reason, and how it was set.

Set by judgement unless a line says otherwise; the filters' tests against a grid filter hold with them.
"""

MISSING_CYCLE = 0.25  # periods between two cycles: less is rounding of the time stamps, more a cycle that is missing
FAINT = 3.0  # standard errors of an amplitude below which it tells no phase

# Where a filtered mean that strays towards zero is held: laws other than the paper's live on a > 0.
FLOOR = 1e-6  # of the stable amplitude
PLAIN_FLOOR = 1e-6  # of the largest amplitude of the data: the plain filter knows no stable amplitude

# Limit cycles.
RANGE = (0.004, 8.0)  # of a typical amplitude: where a stable one is looked for
