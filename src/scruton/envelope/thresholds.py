"""Numbers that decide something in this room: unit, reason, and how each was set.

Where nothing else is said, a value was set by judgement, without a run to show for it.
"""

# Sampling: relative departures and multiples of the usual step.

# Steps that vary by less count as equal; more is remarked on.
JITTER = 0.01

# A step so many times the usual one misses at least a sample.
GAP = 1.75

# Samples per cycle from which a second harmonic can be told apart, and a third.
SECOND_HARMONIC, THIRD_HARMONIC = 10.0, 12.0

# Demodulation: amplitudes over their standard errors.

# |z| is used as it is from here on; its bias is then 1/60 of a standard error (Rice: sigma^2/2a).
CLEAR = 30.0

# Signal to noise that an average must reach before its direction is used.
RELIABLE = 8.0

# Cycles stand out of the noise for what is measured across them: lines close by, and drift of the frequency.
STANDS_OUT_OF_NOISE = 4.0

# A ring-down has ended where it has sunk to this.
VISIBLE = 4.0

# Cycles that the slope of a ring-down needs.
FEWEST_CYCLES = 4

# Clipping.

# Part of the largest reading that counts as its top.
TOP = 0.02

# Times the samples that a sine has at its top; a strong third harmonic reaches 1.4.
CROWDED = 1.6

# Equal readings in a row at the extreme.
RUN = 3

# Lines of the spectrum.

# Height of a line over the median around it; noise reaches 3 to 4.
STANDS_OUT = 5.0

# Height of a line over its mirror image: a second line lies on one side of the main one, a modulation on both.
ONE_SIDED = 2.0

# Of the frequency: nearer lines are sought in the cycles, farther ones in the record.
CLOSE_LINE = 0.4

# What is noted of a record by itself.

# Times the stable amplitude: from lower, the rate of a decay is hardly told from turbulence; from higher, a growth does
# not show the damping at small amplitude.
DECAY_FROM, GROWTH_FROM = 1.5, 0.3

# Relaxation times below which the stable amplitude is an extrapolation: exp(-3) is 5 %.
RELAXATIONS = 3.0

# Of the largest amplitude: offset of a signal, and change of its mean over the record.
OFFSET, MEAN_DRIFT = 0.1, 0.1

# Of the frequency: its range over the record.
FREQUENCY_DRIFT = 0.01

# Of the height of the main line.
SECOND_LINE = 0.05

# Records against what is stated, and against each other.

# Relative, of a damping ratio that is stated without a standard deviation: ring-downs repeat to that.
STATED_SD = 0.1

# Of f0: a rig is retuned by less, and amplitude moves it by less, between stating and plucking.
STILL_FREQUENCY = 0.02

# Of f0: added mass and lock-in of the sections at hand move it by up to 3 %.
WIND_FREQUENCY = 0.08

# Samples per stated cycle: six is what demodulation needs, and a thinned record has no harmonic to check.
FINE = 8.0

# Samples per stated cycle: below, with the filter's margin, a line is an alias.
NYQUIST = 2.2

# Of the first amplitude: growths of a tenth are no turbulence that a fitted exponential follows.
TREND = 1.1

# Factor between growth and decay of one test: turbulence and drift differ by a tenth from record to record.
LEVELS = 1.25

# The same where a record ends before it has settled: what it heads for erred by factors up to 6 in `challenge make
# --cases 90 --seed 5`.
EXTRAPOLATED = 7.0

# Relaxation times after which a transient has shown its stable amplitude to 5 %.
SETTLED = 3.0

# Relative error of a band of damping that its scatter cannot show.
BAND_FLOOR = 0.02

# Relative standard error above which a band of damping contradicts nobody.
CLEAR_BAND = 0.1

# Joint standard deviations.
SIGMAS = 3.0

# Factor by which damping never changes between stating and plucking.
DAMPING_FACTOR = 2.0

# Of the samples, in stretches that do not move.
DEAD = 1.0 / 3.0

# Cycles without any change after which the signal does not move.
STILL = 0.5
