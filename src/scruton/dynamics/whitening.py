"""What a cycle's innovation foretells of the next one's: a filter's noise that is not quite white.

Turbulence that lasts some cycles makes neighbours alike, a zero that wanders within a cycle makes them unlike.
"""

import numpy as np

from scruton.compiled import njit
from scruton.dynamics.effects.terms import Term

CORRELATIONS = (int(Term.CORRELATION), int(Term.PHASE_CORRELATION))  # of the first channels, in their order


@njit(cache=True, error_model="numpy", nogil=True)
def _take_off(v, s, rho):  # type: ignore[no-untyped-def]
    """In place, (N,) each, with correlations rho of each but the first with the one before."""
    before, sd = v[0], np.sqrt(s[0])
    for k in range(1, v.size):
        here, own = v[k], np.sqrt(s[k])
        v[k] = here - rho[k] * own / sd * before
        s[k] *= 1.0 - rho[k] * rho[k]
        before, sd = here, own


@njit(cache=True, error_model="numpy", nogil=True)
def whiten(gap, record, table, innovation, variance):  # type: ignore[no-untyped-def]
    """Take off what the cycle before foretells, in place: innovations and variances (W, C N), channel by channel.

    Their correlations, at most one in size, are those of the table (W, R, COLUMNS).  A record's first cycle, which the
    filter starts from, and one with nothing to tell (0, 1) foretell nothing; nor does what lies before a gap.
    """
    size = gap.size
    neighbours, foretold = np.zeros(size), np.empty(size)
    for channel, column in enumerate(CORRELATIONS):
        low = channel * size
        told = (innovation[0, low : low + size] != 0.0) | (variance[0, low : low + size] != 1.0)
        for k in range(1, size):
            neighbours[k] = gap[k] == 0.0 and gap[k - 1] >= 0.0 and told[k] and told[k - 1]
        for w in range(len(table)):
            v, s = innovation[w, low : low + size], variance[w, low : low + size]
            for k in range(1, size):
                foretold[k] = neighbours[k] * table[w, record[k], column]
            _take_off(v, s, foretold)
