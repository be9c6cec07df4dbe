"""What the simulator refuses and where it bounds a force: every threshold with its unit, and its reason.

All are set by judgement.
"""

LARGEST = 1e12  # of any number of a specification, in its unit: no tunnel knows larger ones
MOST_STEPS = 1e8  # of the integration of one record: some seconds
LEAST_WIND = 0.05  # of the stated wind speed: gusts do not turn the wind round
LAGGED = (0.2, 5.0)  # amplitude over that which the wake remembers: bounds of what memory does to the force
