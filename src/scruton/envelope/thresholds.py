"""Numbers that decide something here: unit, reason, and how each was set; by judgement where nothing is said."""

# Sampling: relative departures and multiples of the usual step.
JITTER = 0.01  # steps that vary by less count as equal; more is remarked on
GAP = 1.75  # a step so many times the usual one misses at least a sample
# Samples per cycle from which a second harmonic can be told apart, and a third.
SECOND_HARMONIC, THIRD_HARMONIC = 10.0, 12.0
# Third harmonic over the first, from which it leaks into amplitudes: of 12 samples it does by a tenth.
BENT, MOST_HARMONICS = 0.02, 5
MOST_CHANGE = 0.5  # of the amplitude in a cycle, and turn [rad], of a wave whose third harmonic is measured
# Of a third harmonic in quadrature, that may show in phase: 0.25 to 0.65 where releases decay by a fifth in a cycle
# under a damping that grows as A^4 (`scruton challenge make --cases 20 --seed 9431`, case-0019).
LEAKS = 0.5

# Demodulation: amplitudes over their standard errors.
CLEAR = 30.0  # |z| is used as it is from here on; its bias is then 1/60 of a standard error (Rice: sigma^2/2a)
RELIABLE = 8.0  # signal to noise that an average must reach before its direction is used
# Cycles stand out of the noise for what is measured across them: lines close by, and drift of the frequency.
STANDS_OUT_OF_NOISE = 4.0
VISIBLE = 4.0  # a ring-down has ended where it has sunk to this
FEWEST_CYCLES = 4  # cycles that the slope of a ring-down needs

# Clipping.
TOP = 0.02  # part of the largest reading that counts as its top
CROWDED = 1.6  # times the samples that a sine has at its top; a strong third harmonic reaches 1.4
SWEPT = 1.5  # times the range of the motion: a record of more is of a mean that drifts
RUN = 3  # equal readings in a row at the extreme
FINEST_QUANTUM = 3e-5  # of the largest reading (16 bits): of finer ones a few that happen to agree would prove much
UNEVEN = 0.02  # of the largest reading: neighbours of an even crest differ by less, growth and noise included

# Log likelihood ratio [nats] from which the readings at the extreme are an end of the range and no chance. Where
# nothing is clipped (records measured, those of `examples`, 30 simulated campaigns) 0.5 was the most; 400 and more
# where some thirty crests are.
CUT_OFF = 10.0
# Half-widths of the crests that are looked at [rad], of cycles laid over each other, in which a plateau bends by less
# than this part of what a sine does; the fewest samples there, and the fewest cycles of a record. How sure that is
# [nats] is set, and not far beyond what counts: a spring, too, may flatten crests.
PLATEAUS, LEVEL = (0.6, 0.45, 0.3), 0.1
FEWEST_ON_A_PLATEAU, FEWEST_FOLDED = 40, 12
PLATEAU_NATS = 20.0

# Lines of the spectrum.
STANDS_OUT = 5.0  # height of a line over the median around it; noise reaches 3 to 4
# Height of a line over its mirror image: a second line lies on one side of the main one, a modulation on both.
ONE_SIDED = 2.0
CLOSE_LINE = 0.4  # of the frequency: nearer lines are sought in the cycles, farther ones in the record

# Periodograms of a band's noise: lines between it and the motion, of which the window's own width takes 4; how near it
# they begin, in parts of the way to the nearer edge; times the expected height from which a line is another motion.
BAND_LENGTH, BAND_SKIRT, BAND_OUTLIER = 6.0, 0.25, 8.0
# The line that is followed: one so near the frequency stated, in parts of it, goes before a higher one elsewhere (hum,
# another motion) that is up to so many times its height.
NEAR, OVERTOPS = 0.2, 30.0

# A phase that slips from one cycle to the next, beside the median of so many on either side: by this angle [rad] and so
# many times what noise and turbulence turn it by there, which is no less than this; the fewest cycles of a record. Of
# 7,105 records of seven simulators 46 do, of six campaigns: samples that were lost or held, joined pieces, other modes;
# of those of the examples and of laboratories none. What else turned most, by 0.38, are blows of a quarter of the
# amplitude; a growth's first cycles turn by more, 6 times what is usual there.
SLIP, SLIP_SIGMAS, SLIP_SD, SLIP_BESIDE, FEWEST_FOR_SLIPS = 0.4, 12.0, 0.03, 6, 16

# Other modes that a release sets going, and that are taken out of a record: at most so many; nats over chance of each;
# how far from the frequency, and from its harmonics, in parts of these; turns within the record; its amplitude over
# that of the motion (a larger one is of a motion of two modes), and from where it is no mishap of a release; rates of
# decay times the length of the record from which it dies away (below, it may last), and its largest damping ratio; the
# part of its line that may be left.
MODES, MODE_NATS = 4, 30.0
MODE_APART, MODE_OF_HARMONIC, MODE_TURNS = 0.15, 0.0075, 4.0
MODE_SIZES, LARGE_MODE = (0.002, 0.1), 0.07
MODE_FALLS, MODE_DAMPING, MODE_LEAVES = 0.3, 0.05, 0.2
# Other modes that are kept up: nats over chance; amplitude over the largest of the motion, as above; half the width of
# the band that is taken out, in parts of their frequency; how far from the motion's they are at least, farther than
# shedding beats with it.
LASTING_NATS, LASTING_SIZES, LASTING_WIDTH, LASTING_APART = 30.0, (0.002, 0.1), 0.04, 0.24

# What is noted of a record by itself.
# Times the stable amplitude: from lower, the rate of a decay is hardly told from turbulence; from higher, a growth does
# not show the damping at small amplitude.
DECAY_FROM, GROWTH_FROM = 1.5, 0.3
RELAXATIONS = 3.0  # relaxation times below which the stable amplitude is an extrapolation: exp(-3) is 5 %
OFFSET, MEAN_DRIFT = 0.1, 0.1  # of the largest amplitude: offset of a signal, and change of its mean over the record
FREQUENCY_DRIFT = 0.01  # of the frequency: its range over the record
COARSE = 0.01  # of the amplitude: what the steps of its readings leave it off by
SECOND_LINE = 0.05  # of the height of the main line

# Records against what is stated, and against each other.
STATED_SD = 0.1  # relative, of a damping ratio that is stated without a standard deviation: ring-downs repeat to that
STILL_FREQUENCY = 0.02  # of f0: a rig is retuned by less, and amplitude moves it by less, between stating and plucking
ANOTHER_MOTION = 0.2  # of f0, as NEAR: no section is retuned by more, nor does anybody mistype its frequency so
WIND_FREQUENCY = 0.08  # of f0: added mass and lock-in of the sections at hand move it by up to 3 %
OTHER_RIGS = 0.025  # of f0, beside what the wind does to other rigs: of 380 campaigns two have more, of wrong clocks
ONE_TEST = (
    0.02  # range of the frequencies of one test: a stiffness that bends by 1 % between growth and decay is at most that
)
FINE = 8.0  # samples per stated cycle: six is what demodulation needs, and a thinned record has no harmonic to check
NYQUIST = 2.2  # samples per stated cycle: below, with the filter's margin, a line is an alias
A_THOUSAND = 0.15  # a line so near a thousandth of f0 is of a time in ms: nothing else is as likely
BETWEEN = 1.5  # of both ends of a transient: above, it begins or ends within its record
TREND = 1.1  # of the first amplitude: growths of a tenth are no turbulence that a fitted exponential follows
# Factor between growth and decay of one test: turbulence and drift differ by a tenth from record to record.
LEVELS = 1.25
# The same where a record ends before it has settled: what it heads for erred by factors up to 6 in `challenge make
# --cases 90 --seed 5`.
EXTRAPOLATED = 7.0
# Factor from which it is another unit: mm for cm is 10, and no two stable amplitudes of one section are so far apart.
ANOTHER_UNIT = 9.0
ONE_SPEED = 0.005  # of the wind speed: a sweep and a test that differ by less are of one
SETTLED = 3.0  # relaxation times after which a transient has shown its stable amplitude to 5 %
# Or what it changes by, in ln A from one eighth of the record to the next at the end, over what it changed by in all,
# and over what it would have to change by yet. Closed forms of n = -1 to 2, from 0.001 to 10 times their one level and
# over 0.02 to 40 relaxation times, come so near to rest away from it only where they lie a factor EXTRAPOLATED off.
STILL_MOVES = 0.05
BAND_FLOOR = 0.02  # relative error of a band of damping that its scatter cannot show
CLEAR_BAND = 0.1  # relative standard error above which a band of damping contradicts nobody
SIGMAS = 3.0  # joint standard deviations
ANOTHER_DAMPING = 30.0  # factor from which per cent, a hundred times a ratio, or another rig's are stated
DAMPING_FACTOR = 2.0  # factor by which damping never changes between stating and plucking
# Stretches that stand still amid motion: cycles (a wave that is clipped hard stands for half of one), and quanta that
# the cycle beside them moves by (a decay that sinks into its rounding moves by one or two).
HELD, MOVES = 1.0, 8.0
# A model that is held before it is let go: a cycle at rest shows at most so many standard errors of its amplitude, or
# so much of the largest of a decay; the second one after that shows at least AT_ONCE; and the line through LET_GO_OVER
# cycles stands LET_GO above rest.
AT_REST, AT_REST_OF_A_DECAY, AT_ONCE, LET_GO = 4.0, 0.2, 12.0, 6.0
LET_GO_OVER = 4  # cycles
FEWEST_AT_REST = 3  # cycles, of whose amplitudes before a jump the median is what hum makes of them
MOVED = 0.3  # of the amplitude that follows: by so much it is away from where it was held
# It is let go within the first cycle where that lacks so many errors, so much of the line, of which another mode takes
# a tenth, and so much of what the line rises by in a cycle.
LET_GO_IN_IT, LACKS, LACKS_GROWING = 10.0, 0.15, 1.5
FEWEST_IN_A_CYCLE = 5  # samples
COARSE_ENVELOPE = 0.7  # cycles between the samples of an envelope beyond which each is a cycle's own
# Cycles at either end of an envelope that a filter may have rounded, by how much (over noise, and over the amplitude:
# half a step beyond the samples is foretold), and what is left.
MOST_ROUNDED, ROUNDED_SIGMAS, ROUNDED_LEAST, FEWEST_LEFT = 3, 3.5, 0.005, 8
# Single readings far off: times what one in a hundred is off, and of the range that the record moves over. More than so
# many are no slips of the cable but something of the motion.
OUTLIES, OUTLIES_MOTION, MOST_OUTLIERS = 8.0, 0.25, 10

# Records in wind that are of no vortex-induced vibration: from five standard deviations of the prior of the first
# amplitude (A/D or rad) the filter is asked for what its model excludes.
NO_VORTEX = 5.0
# A decay has died out where its last quarter is below DIES of its largest amplitude, and is in the noise or scatters by
# DISORDER of its mean: noise in a narrow band scatters by 0.52, a stable amplitude under 6 % of gusts by less than 0.1.
DIES, DISORDER = 0.03, 0.3

# Transients that pass the amplitude where they come to stand, by more than gusts make them. Of records of `scruton
# calibrate` with seed 7 all 30 whose air remembers 1 to 4 relaxation times pass it by 20 to 250 %, and none of 120
# under turbulence and gusts of up to 3 %, nor of 36 of wake oscillators, by so much.
SWING = 0.12  # of the standing amplitude; 4 sd of slow gusts of 3 %
SWING_SIGMAS = 4.0  # scatter of the amplitude where it stands
# Where the last two quarters differ by more the amplitude swings still; to the last half one that stays may have such
# excursions by chance, which is why more is asked.
UNSETTLED = 0.1  # of the standing amplitude
UNSETTLED_SWING, UNSETTLED_SIGMAS = 0.24, 3.0  # as SWING and SWING_SIGMAS
STANDING = 0.05  # of the standing amplitude: as near it stands
# An amplitude that beats has no one stable value: scatter of its logarithm over the second half of a record, and how
# often it passes the median there. Gusts of 6 %, the most there are, scatter it by less than 0.1.
BEATS, PASSES = 0.2, 4
FEWEST_STANDING = 5  # cycles of the last quarter

# A growth whose lowest cycle lies below so much of its first, in its first half, falls before it grows.
FALLS = 0.5  # of the first amplitude
# A decay whose first cycle lies below so much of its largest, in its first half, is pushed before it decays.
RISES = 0.7  # of the largest amplitude
# Log of the noise's power at 0.4 of the response's frequency, where offsets see that of a random walk, over that at 1.4
# of it, where second harmonics do, beyond which the offset wanders: white noise has 0, a random walk 2.6.
WANDERS = 1.2
OFFSET_SHARE = 0.27  # of ln(1.4/1) in ln(1.4/0.4): where between these two the response's frequency lies
