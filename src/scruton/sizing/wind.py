"""The table [wind] of a `bridge.toml`: hours a year by wind speed, and classes of turbulence."""

from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import read_bytes
from scruton.campaign.schema import Motion
from scruton.campaign.thresholds import LARGEST_TABLE
from scruton.campaign.toml import Table, anything, number
from scruton.campaign.units import SPEED, Dimension
from scruton.errors import InputError
from scruton.sizing.number_table import read_table
from scruton.sizing.transfer import TurbulenceClass, read_turbulence

_REACH = 18.0  # of -ln(1 - probability) of the wind speed: half a second a year lies beyond


@dataclass(frozen=True, eq=False)
class Wind:
    """Hours a year of wind from directions that matter, by class of speed with the upper end [m/s]; (N,), rising.

    `turbulence` has its classes of turbulence, at every speed alike; empty: as in the tunnel.  The hours come from a
    file, `rose`, or from a Weibull distribution (scale in m/s), and have the `share` of the time in them.
    """

    speed: FloatArray
    hours: FloatArray
    turbulence: tuple[TurbulenceClass, ...] = ()
    share: float = 1.0
    rose: str | None = None
    weibull_scale: float | None = None
    weibull_shape: float | None = None

    def between(self, low: float, high: float) -> float:
        """Hours a year with speeds from `low` to `high` [m/s]."""
        edges = np.concatenate(([0.0], self.speed))
        total = np.concatenate(([0.0], np.cumsum(self.hours)))
        return float(np.interp(high, edges, total) - np.interp(low, edges, total))


def read_wind(table: Table, motion: Motion, width: float, depth: float, digests: dict[str, str]) -> Wind:
    """Read `[wind]`: a rose from a file, whose digest is added, or a Weibull distribution, and classes of turbulence.

    Raises
    ------
    InputError
        For what is no rose, no distribution or no class.
    """
    table.check_keys(_WIND)
    classes = read_turbulence(table, motion, width, depth)
    share = _WIND["share"].read(table, "share")
    if "rose" in table:
        for key in ("weibull_scale", "weibull_shape"):
            if key in table:
                raise table.refusal(key, "either a rose or a Weibull distribution")
        path = table.file.parent / table.text("rose", "a CSV file")
        wanted = "one header line, then upper speed [m/s] and hours a year of each class, speeds rising"
        rows = read_table(path, wanted, (SPEED,))
        if rows.shape[1] != 2:
            raise InputError(path, "", f"rows of {rows.shape[1]} columns", wanted)
        bad = ~(np.isfinite(rows).all(axis=1) & (rows[:, 1] >= 0.0) & (np.diff(rows[:, 0], prepend=0.0) > 0.0))
        if bad.any():
            k = int(np.argmax(bad))
            found = f"{rows[k, 0]:g} m/s and {rows[k, 1]:g} hours"
            raise InputError(
                path, f"row {k + 1}", found, f"a speed above that before, and hours of zero or more; {wanted}"
            )
        if not 0.0 < rows[:, 1].sum() <= 8790.0:
            raise InputError(path, "hours", f"{rows[:, 1].sum():g} hours in all", "up to the 8,766 of a year")
        digests[table.text("rose", "a CSV file")] = sha256(read_bytes(path, LARGEST_TABLE)).hexdigest()
        return Wind(rows[:, 0], share * rows[:, 1], classes, share=share, rose=table.text("rose", "a CSV file"))
    scale, shape = (_WIND[key].read(table, key) for key in ("weibull_scale", "weibull_shape"))
    # Fine where the hours are, and on to where no second of a year is left, which is far out for a small shape.
    ratio = np.linspace(0.0, 6.0, 601)
    last = _REACH ** (1.0 / shape)
    if last > 6.0:
        ratio = np.concatenate((ratio, np.geomspace(6.0, last, 600)[1:]))
    hours = share * 8766.0 * np.diff(-np.exp(-(ratio**shape)))
    return Wind(scale * ratio[1:], hours, classes, share=share, weibull_scale=scale, weibull_shape=shape)


_SHARE = Dimension("a bare number", "", 0.5)
_SHAPE = Dimension("a shape parameter, a bare number", "", 2.0)
_SHAPES = "a shape parameter between 0.5 and 20; winds have about 2"
_SHARES = "the part of the time from directions that matter, up to 1"

_WIND = {
    "rose": anything(),
    "turbulence": anything(),
    "weibull_scale": number(SPEED),
    "weibull_shape": number(_SHAPE, good=lambda shape: 0.5 <= shape <= 20.0, wanted=_SHAPES),
    "share": number(_SHARE, 1.0, good=lambda share: share <= 1.0, wanted=_SHARES),
}
