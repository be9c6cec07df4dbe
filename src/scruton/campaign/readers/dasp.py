"""Reader of a channel that DASP recorded: samples in a .sts file, rate, sensitivity and unit in the .tsp beside it.

The maker publishes no description; this is what two public readers of such files agree on.  The first line of a .tsp is
fields parted by commas, of which the first is the rate [Hz], the sixth a gain, the eighth the sensitivity, and the last
the unit in quotes; a section may state the gain once more.
"""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scruton.campaign.bounded import read_bytes
from scruton.campaign.readers.columns import Clock, Column, Container
from scruton.campaign.thresholds import LARGEST_TOML
from scruton.errors import InputError

NAME = "signal"
_GAIN = re.compile(r"'?ChNodeGain'?\s*=\s*(?P<gain>[-+.\deE]+)")


@dataclass(frozen=True, eq=False)
class Dasp(Container):
    """The one channel of a file."""

    channel: Column

    def column(self, name: str) -> Column:
        """Read the channel."""
        if name != NAME:
            raise self.error(name, "no such variable", f'"{NAME}", the one channel of the file')
        return self.channel


def open_dasp(data: bytes, path: Path) -> Dasp:
    """Open a .sts file (InputError where its .tsp is missing, or cannot be understood)."""
    beside = path.with_suffix(".tsp")
    text = read_bytes(beside, LARGEST_TOML, "the .tsp file of the same name").decode("gbk", errors="replace")
    fields = next(csv.reader(text.splitlines()[:1], skipinitialspace=True), [])
    try:
        rate, gain, sensitivity, unit = float(fields[0]), float(fields[5]), float(fields[7]), fields[-1].strip()
    except (IndexError, ValueError):
        found = "a first line without rate, gain and sensitivity"
        raise InputError(beside, "", found, "a .tsp file as DASP writes it; or export the channel as text") from None
    stated = _GAIN.search(text)
    if stated is not None and float(stated["gain"]) != gain:
        found = f"two gains, {gain:g} and ChNodeGain = {float(stated['gain']):g}"
        raise InputError(beside, "", found, "one; export the channel as text, which has it applied")
    if not (rate > 0.0 and gain * sensitivity != 0.0):
        raise InputError(beside, "", f"rate {rate:g}, gain {gain:g}, sensitivity {sensitivity:g}", "none of them zero")
    if len(data) % 4:
        raise InputError(path, "", f"{len(data)} bytes", "a multiple of 4, the bytes of a sample")
    values = np.frombuffer(data, "<f4").astype(np.float64) / (gain * sensitivity)
    return Dasp(path, (NAME,), Column(NAME, values, unit or None, clock=Clock(0.0, 1.0 / rate)))
