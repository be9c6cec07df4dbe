"""Numbers that decide something in this room: unit, reason, and how each was set.

Where nothing else is said, a value was set by judgement, without a run to show for it.
"""

# Coefficient of variation of a design damping ratio that is stated without one: what repeated measurements scatter by.
DAMPING_COV = 0.45

# Coefficient of variation of a frequency that is stated without one: calculated against built.
FREQUENCY_COV = 0.02

# Coefficients of variation of the factors between tunnel and site where none is stated, each about one. The handbook's
# factor of turbulence is 0.57 to 0.93 for 5 to 12 % of it at B/D = 4, 0.15 (sd) of the logarithm about its middle; of
# Reynolds number and details what is published says that they err, not by how much: as much, and somewhat less.
TURBULENCE_COV = 0.15
REYNOLDS_COV = 0.15
DETAILS_COV = 0.10

# Coefficient of variation of anything; more is a slip of the pen.
LARGEST_COV = 10.0

# Of the span, between the points of a mode shape; no curve passes through what is closer.
CLOSEST_POINTS = 1e-9

# Damping ratio. More cannot be added to a bridge: required damping beyond it is "not achievable".
LARGEST_ADDED = 0.05

# Of the draws, that need no more than can be added: of fewer no shares of the variance of what is needed are told.
LEAST_VARIED = 0.05

# Factor between the damping ratios that a law and the measured damping require, from which it is said that the law
# decides; and the damping ratio by which they must differ at least: what no one would build differently.
LAWS_PART, LEAST_PARTED = 1.25, 0.0002

# Sd of ln(amplitude) of a setting about the curve, that damping is sized for where one rig was tested: what settings of
# one body were seen to miss it by at the worst.
ONE_RIG = 0.20

# Exponent n. Below it the force of the wind on strips near a node of the mode has no finite sum.
LEAST_EXPONENT = -2.0

# Of the reduced velocities of the peak tests: how far lock-in reaches beyond them where a mode states no range.
LOCK_IN_MARGIN = 0.1

# Of a mode's largest movement. A damper that moves less is remarked on: its mass grows with the inverse square.
NEAR_NODE = 0.2

# Of a mode's largest movement. A damper that moves less stands at a node, and is refused.
AT_NODE = 1e-6

# Standard errors of a probability on as many independent draws as check a damper, by which it has to leave less risk
# than is asked for, so that other draws keep it, too: with 2, one set in a dozen of half as many
# left more (tests/sizing/test_sizing_dampers.py).
RISK_MARGIN = 3.0

# Least risk that dampers are sized for: of the 16,384 draws of all modes the 16 that may exceed it are four
# standard errors from none, and RISK_MARGIN of them are kept free.
LEAST_RISK = 0.001

# Of the largest stroke, by which a damper of given mass may miss it.
STROKE_TOLERANCE = 0.01

# Of the least expected cost by mass: what a mass between those looked at may save unnoticed. It is told to two digits.
COST_RESOLVED = 0.02

# Coefficient of variation of a structural damping ratio from free decays or ambient vibration of the finished bridge.
DAMPING_TEST_COV = 0.15

# Coefficient of variation of a steady amplitude in the tunnel.
STEADY_COV = 0.01

# Coefficient of variation, by what is stated of a bridge: more is remarked on. A frequency is calculated to a few per
# cent; damping scatters by half.
ODD_COV = {"frequency": 0.1, "mass": 0.3, "inertia": 0.3, "coherence": 0.5, "damping_ratio": 1.0}

# Of the distribution of a coherence: more above 1 is remarked on.
ODD_SHARE = 0.02

# Coefficient of variation of a frequency that was identified on the finished bridge: ambient vibration, over seasons.
MEASURED_FREQUENCY_COV = 0.005

# Coefficient of variation of a modal mass that is stated without one: self-weight against drawings, and the shape.
MODAL_MASS_COV = 0.05

# m. The stroke of a damper where none is stated: what there is room for between girder webs.
LARGEST_STROKE = 1.0

# Mass ratio. The lightest damper that is offered where none is stated: a lighter one lives by its tuning.
SMALLEST_MASS_RATIO = 0.005

# Relative error of the frequency, either way, at which the risk asked for is kept where none is stated.
KEPT_DETUNING = 0.02

# Relative errors of a delivered damper, either way, where none are stated.
FREQUENCY_TOLERANCE, DAMPING_TOLERANCE, MASS_TOLERANCE = 0.01, 0.2, 0.02

# Of the end stops over the damper's own spring where it is not stated: rubber buffers.
STOP_STIFFNESS = 10.0
