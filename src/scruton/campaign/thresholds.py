"""What this room accepts, refuses and remarks on: every threshold with its unit, its reason, and how it was set.

Set by judgement unless a line says otherwise; the bounds of the readers are tried by `python -m tests.fuzz`.
"""

# Sizes of files: what is read before anybody knows whether it makes sense.
LARGEST_RECORD = 4 * 10**9  # bytes of one file of records: 20 million samples as text are half of a GB
LARGEST_TOML = 10**7  # bytes of one TOML file: thousands of tests
LARGEST_LOGO = 10**6  # bytes of the picture in the head of a report
LARGEST_TABLE = 10**7  # bytes of a CSV file beside a bridge: a mode shape, a wind rose

# TOML.
LARGEST_NUMBER = 1e15  # of any number; whole numbers beyond are no longer exact as doubles
DEEPEST_TOML = 16  # tables and lists within each other; campaigns, cards and bridges have four
MOST_TABLES = 10_000  # of one kind, such as tests
LONGEST_UNIT = 40  # characters of a unit: pint takes seconds for what nobody writes

# Text.
LONGEST_LINE = 10**6  # characters of a line: ten thousand columns or more
MOST_COLUMNS = 10_000
LONGEST_HEADING = 1_000  # characters; the time to look for a unit grows with the square

# What a packed file claims to hold.
LARGEST_ARRAY = 4 * 10**9  # bytes of one array once it is read: 20 million samples of 24 channels
SMALL_ARRAY = 10**8  # bytes; up to here a file may be packed as tightly as anything can be
PACKED = 100  # times smaller than what it holds: more than any record with noise in it
TIGHTEST = 1100  # what deflate can reach, on zeros alone
SLACK = 10**5  # bytes: fill values, headers
DEEPEST_MAT5 = 32  # structs and cells within each other
LONGEST_BLANK = 10_000  # characters of a text that is not in the file: SciPy makes blanks of it
MOST_LINKS = 16  # soft links of HDF5 on the way to one data set

# Records.
MIN_SAMPLES = 5  # what a five-point difference needs
SPARSEST = 20.0  # times the length that its samples fill: the longest that a record with gaps may last
SIZES = (1e-15, 1e9)  # of the largest response, A/D or rad; of wind speeds [m/s], too: no tunnel knows others
LATEST = 1e12  # s, of any time: clocks of computers count 1.7e9 s since 1970
RATES = (1e-9, 1e9)  # Hz, of samples
RATE_TOLERANCE = 0.01  # relative, between a stated sample rate and the file's own time

# Signals that are filtered or integrated; steps as in scruton.envelope.thresholds.
JITTER, GAP = 0.01, 1.75
BAND_EDGE = 0.2  # of an edge, beyond it: where a filter falls to nothing; hum at 50 Hz is gone from a band up to 40 Hz
END_CYCLES = 8.0  # by which both ends are led on: four times what a filter with these edges remembers
PREDICTOR = 128  # samples by which hum is led on: a lower order tells lines that are close together no longer apart
# Times f0: the band of an acceleration, without drift below and without the second harmonic above.
BAND = (0.5, 1.7)
# Times f0: what a band must hold. A narrower one rounds transients and makes the noise of neighbouring cycles one.
NARROWEST_BAND = (0.75, 1.3)

# Remarks.
LISTED = 6  # names that one line carries; a longer list hides the sentence before it
OVERLAP = 2  # samples: windows that follow each other may share the one between them
FAR = 2.0  # times beyond its bound a number is no longer unusual but a slip
LARGEST_SD = 0.3  # of the mean: what is known no better was not measured, or its sd has another unit

# Quantities.
NARROWEST_BETA = 1e7  # shape parameters of a beta distribution that is a normal one, whose quantiles can be had
