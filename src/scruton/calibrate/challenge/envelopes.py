"""What the baselines see of a campaign: envelopes, stated damping, and how the wind force scales between records."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign import load_campaign
from scruton.gap.data import load_gap


@dataclass(frozen=True, eq=False)
class Envelopes:
    """What a baseline sees: one entry a record (R), or a rig where that is said."""

    time: tuple[FloatArray, ...]  # s
    amplitude: tuple[FloatArray, ...]  # over the middle test's last ones
    rig: np.ndarray
    direction: np.ndarray  # 1 growth, -1 decay, 0 otherwise
    wind: np.ndarray  # bool
    omega: FloatArray  # rad/s
    aero: FloatArray  # linear aerodynamic damping and drive over those of the middle test, for one Y1 and epsilon
    drive: FloatArray
    velocity: FloatArray  # reduced velocity less the mean, over half its range; zero where it does not differ
    damping: FloatArray  # of the rigs, as stated
    damping_sd: FloatArray  # relative

    @property
    def rate(self) -> float:
        """A relaxation rate to measure others by [1/s]: the damping of a typical rig, twice."""
        return float(2.0 * np.median(self.omega) * np.median(self.damping))


def load_envelopes(folder: Path) -> Envelopes:
    """Load a campaign and demodulate it; damping that is not stated is left to 0.4 per cent, give or take all of it."""
    data = load_gap(load_campaign(folder))
    layout = data.layout
    wind = layout.wind
    cycles = [data.cycles[name] for name in layout.records]
    scale = float(np.median(cycles[data.middle].amplitude[-10:])) if data.middle >= 0 else float(layout.largest.max())
    speed = np.where(wind, layout.reduced_velocity, np.nan)
    spread = np.ptp(speed[wind]) / 2.0 if wind.any() else 0.0
    place = (speed - np.mean(speed[wind])) / spread if spread > 0.0 else np.zeros(len(wind))
    return Envelopes(
        time=tuple(record.time - record.time[0] for record in cycles),
        amplitude=tuple(record.amplitude / scale for record in cycles),
        rig=layout.rig,
        direction=layout.direction,
        wind=wind,
        omega=layout.omega,
        aero=data.aero_ratio,
        drive=data.drive_ratio,
        velocity=np.where(wind, place, 0.0),
        damping=np.where(np.isfinite(data.damping), data.damping, 0.004),
        damping_sd=data.damping_sd,
    )
