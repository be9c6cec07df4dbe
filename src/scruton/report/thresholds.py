"""What a report shows and what it leaves out: every threshold with its unit, its reason, and how it was set.

Set by judgement unless a line says otherwise: on how the pages of the shipped examples read, at the width of A4.
None of them enters a number; all numbers are in the files beside the report.
"""

# Sizes of files.
LARGEST_SVG_ON_PAGE = 350_000  # bytes; a larger drawing goes into the page as PNG
LARGEST_SVG_IN_PDF = 600_000  # bytes; a larger drawing goes in as PNG, which the reader's program shows faster
LARGEST_REPORT = 4_300_000  # bytes of pictures in the page, before the text: it is sent by mail
DOTS_PER_INCH = 200  # of PNG: print wants 150 to 300

# Rows and words.
SHARE_SHOWN = 0.005  # weight of a law: a smaller one would be shown as 0 %
NAMED_LEAST = 0.02  # probability, below which no cause is named beside a likelier one: as much is dealt out evenly
NAMED_ABOVE = 0.15  # probability, of a cause that is named in the sentence where nothing is settled
# Error of a held-out stable amplitude over the verdict's, and by how much it is smaller, from which the runner-up's is
# said to be the better one.
NEARER, NEARER_BY = 0.5, 0.01
# Error of the worst of the held-out stable amplitudes, and that over the median one, from which it is told beside it.
STAYS_OFF, STAYS_OFF_SHARE = 0.08, 3.0
PROBABILITY_SHOWN = 0.005  # of a cause of the gap: smaller ones are shown together
SIZES_SHOWN = 6  # parameters of an effect that the terminal lists; all of them are on the page and in gap.json
PLACES_SHOWN = 12  # places of the gap that the page lists; all of them are in gap.json
RISK_DRAWS = 1 << 14  # draws that a risk left by dampers is counted on, at the least: what its digits follow
SMALLEST_WRITTEN = 1e-4  # a bound that is smaller may be written as a zero beside others
TESTS_ABREAST = 6  # tests with a column of their own in the table of extrapolation; more would not fit the page

# Panels, lines and points of the figures.
PANELS_A_PAGE = 6
MOST_BANDS = 7  # tests whose bands are drawn, for as many colours tell apart; of more only the medians
MOST_RIG_BANDS = 4  # rigs whose bands are drawn through lock-in; of more only the medians
POINTS_LABELLED = 9  # points that get their name beside them
CHAINS_SHOWN = 6  # peak tests whose corner and trace plots a report holds
CURVE_POINTS = 150  # of a deterministic curve; a tenth of a millimetre on paper

# Which figures there are.
SPEEDS_APART = 1.005  # ratio of wind speeds of one rig from which they are several speeds
SCRUTON_NUMBERS_APART = 2.0  # ratio of tested Scruton numbers between which one is worth predicting

# The figure of the gap.
GAP_ROWS = 8  # tests or rigs that are drawn: as many as are legible on a page; of more, those farthest from nothing
GAP_BARS = (4, 7)  # probabilities shown: at least and at most
SMALL_EXCESS = 0.03  # of the reference relaxation rate: excess damping below it does not fill a panel

# Pages of the PDF: see scruton.report.pages.
MARGIN = 68.0  # pt above the text of a page, as the template has it
PAGE_HEIGHT = 704.0  # pt of text on a page of A4, less what rounding and the last space may take
EMPTY_PAGE = 0.2  # of a page: with the space below its last block less than the quarter that no page is to leave empty
PICTURE_SCALES = (1.0, 0.95, 0.9, 0.85, 0.8)  # of the width of the page: type of 7.5 pt stays 6 pt high
BLOCKS_WAITING = 2  # pictures that wait for text to fill a page, or blocks of text for pictures
PAGES_KEPT = 500  # of the best ways to break into pages, after every block; six times as many found none better
SHORT_TABLE = 8  # rows: it stays on one page, as the template has it
FEW_ROWS = 14  # rows: a table of no more breaks only where a page were left empty
LONG_CALLOUT = 700  # letters: a longer one may break, as the template has it
