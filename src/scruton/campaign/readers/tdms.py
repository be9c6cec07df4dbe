"""Reader of LabVIEW measurement files (.tdms), through nptdms, which is an optional extra."""

import io
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scruton.campaign.readers.columns import Clock, Column, Container, optional
from scruton.campaign.spelling import nearest

if TYPE_CHECKING:
    from nptdms import TdmsChannel


@dataclass(frozen=True, eq=False)
class Tdms(Container):
    """Channels by "Group/Channel"; the channel's name alone where it is the only one of that name."""

    channels: "Mapping[str, TdmsChannel]"
    size: int  # bytes of the file

    def column(self, name: str) -> Column:
        """Read a channel by its name."""
        alike = [channel for channel in self.channels.values() if channel.name == name]
        if name not in self.channels and len(alike) != 1:
            what = f"{len(alike)} channels of this name" if alike else "no such channel"
            raise self.error(name, what, nearest(name, self.names))
        channel = self.channels[name] if name in self.channels else alike[0]
        if len(channel) > self.size:  # a value takes a byte at least
            what = f"{len(channel):,} values in a file of {self.size:,} bytes"
            raise self.error(name, what, "a file that holds all of its samples")
        properties = channel.properties
        step = float(properties.get("wf_increment", 0.0))
        # LabVIEW writes a step of 1 with no unit where it knows no clock; only a real increment is a time axis.
        clock = Clock(float(properties.get("wf_start_offset", 0.0)), step) if step > 0.0 else None
        unit = str(properties.get("unit_string", "")).strip() or None
        return Column(name, self.vector(name, np.asarray(channel[:])), unit, clock=clock)


def open_tdms(data: bytes, path: Path) -> Tdms:
    """Open a measurement file (InputError where nptdms is not installed)."""
    with optional("nptdms", "tdms", path, "a TDMS file"):
        from nptdms import TdmsFile
    logging.getLogger("nptdms.types").setLevel(logging.CRITICAL)  # it would print the bytes of a damaged name
    groups = TdmsFile.open(io.BytesIO(data)).groups()
    channels = {f"{group.name}/{channel.name}": channel for group in groups for channel in group.channels()}
    return Tdms(path, tuple(channels), channels, len(data))
