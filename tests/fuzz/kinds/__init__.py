"""The kinds of input: one module each, with functions from a generator and a number to a case."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from numpy.random import Generator

from tests.fuzz.case import Case
from tests.fuzz.kinds import campaign, delimited, hdf5, matlab, options, packed, results, slips, tables
from tests.fuzz.stock import Stock


@dataclass(frozen=True)
class Kind:
    """How cases of a kind are made, and how many of them there are for one of the others."""

    make: Callable[[Generator, int, Path, Stock], Case]
    share: float = 1.0


KINDS: dict[str, Kind] = {
    "structure": Kind(campaign.structure, 1.5),
    "values": Kind(campaign.values, 1.5),
    "units": Kind(campaign.units, 1.0),
    "text": Kind(campaign.text, 1.0),
    "csv": Kind(delimited.make, 2.5),
    "mat5": Kind(matlab.make, 1.0),
    "mat73": Kind(hdf5.mat73, 0.7),
    "hdf5": Kind(hdf5.make, 1.2),
    "npz": Kind(packed.npz, 0.8),
    "tdms": Kind(packed.tdms, 0.6),
    "card": Kind(tables.card, 1.0),
    "bridge": Kind(tables.bridge, 1.0),
    "simulation": Kind(tables.simulation, 1.0),
    "options": Kind(options.make, 2.5),
    "results": Kind(results.fit, 0.8),
    "resumed": Kind(results.resumed, 0.6),
    "challenge": Kind(results.challenge, 0.6),
    "slips": Kind(slips.make, 3.8),
}
