"""Reader of LabVIEW measurement files (.tdms), through nptdms, which is an optional extra."""

import io
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.readers.columns import Clock, Column, as_column, readable
from scruton.campaign.tables import nearest
from scruton.errors import InputError

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile


@dataclass(frozen=True, eq=False)
class Tdms:
    """Channels by "Group/Channel"; the channel's name alone where it is the only one of that name."""

    path: Path
    file: "TdmsFile"
    size: int  # bytes of the file

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels, "Group/Channel"."""
        return tuple(name for name, _ in self._channels())

    def read(self, names: Sequence[str | int]) -> tuple[Column, ...]:
        """Read channels by name."""
        return tuple(self._column(str(name)) for name in names)

    def _channels(self) -> "list[tuple[str, TdmsChannel]]":
        return [
            (f"{group.name}/{channel.name}", channel) for group in self.file.groups() for channel in group.channels()
        ]

    def _column(self, name: str) -> Column:
        channels = self._channels()
        found = [one for full, one in channels if full == name] or [one for _, one in channels if one.name == name]
        if len(found) != 1:
            what = f"{len(found)} channels of this name" if found else "no such channel"
            raise InputError(self.path, name, what, nearest(name, self.names))
        channel = found[0]
        if len(channel) > self.size:  # a value takes a byte at least
            what = f"{len(channel):,} values in a file of {self.size:,} bytes"
            raise InputError(self.path, name, what, "a file that holds all of its samples")
        values = as_column(np.asarray(channel[:]), self.path, name)
        properties = channel.properties
        step = float(properties.get("wf_increment", 0.0))
        # LabVIEW writes a step of 1 with no unit where it knows no clock; only a real increment is a time axis.
        clock = Clock(float(properties.get("wf_start_offset", 0.0)), step) if step > 0.0 else None
        unit = str(properties.get("unit_string", "")).strip()
        return Column(name, values, unit or None, clock=clock)


def open_tdms(data: bytes, path: Path) -> Tdms:
    """Open a measurement file (InputError if it cannot be, or where nptdms is not installed)."""
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise InputError(
            path, "", "a TDMS file, and no package that reads it", "nptdms: pip install 'scruton[tdms]'"
        ) from None
    logging.getLogger("nptdms.types").setLevel(logging.CRITICAL)  # it would print the bytes of a damaged name
    with readable(path, "a TDMS file as LabVIEW writes it"):
        return Tdms(path, TdmsFile.open(io.BytesIO(data)), len(data))
