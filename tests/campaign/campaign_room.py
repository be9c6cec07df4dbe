"""A small campaign that tests bend to their needs."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scruton.campaign import Campaign, load_campaign

DEPTH = 0.075
TIME = np.arange(200) / 100.0
DISPLACEMENT = 0.005 * np.exp(-0.3 * TIME) * np.cos(50.0 * TIME)  # m

HEAVING = """
format = 1
title = "A rectangle"
source = "made up"

[section]
motion = "heaving"
width = "0.300 m"
depth = "75 mm"

[[rigs]]
name = "1#"
mass = "7.089 +/- 0.03 kg/m"
frequency = "7.97 Hz"
damping_ratio = { mean = 0.00058, sd = 0.00003 }

[[tests]]
name = "Sc 1.9"
rig = "1#"
air_density = "1.19 kg/m^3"
wind_speed = "5.735 m/s"
stable_amplitude = 0.06551
"""

TORSIONAL = """
format = 1
title = "A deck"

[section]
motion = "torsional"
width = "0.600 m"
depth = "0.060 m"

[[rigs]]
name = "1#"
mass = "0.183 kg*m^2/m"
frequency = "7.257 Hz"
damping_ratio = 0.00421

[[tests]]
name = "A"
rig = "1#"
air_density = "1.213 kg/m^3"
reduced_velocity = 10.0
"""


def record(file: str, *lines: str, kind: str = "decay", owner: str = "tests") -> str:
    """Spell a record's table."""
    return "\n".join([f"[[{owner}.records]]", f'file = "{file}"', f'kind = "{kind}"', *lines, ""])


def csv(header: str = "time [s],displacement [m]", *columns: np.ndarray) -> str:
    """Spell a CSV file; numbers in full, so that they come back exactly."""
    rows = zip(*(columns or (TIME, DISPLACEMENT)), strict=True)
    return header + "\n" + "".join(",".join(repr(float(value)) for value in row) + "\n" for row in rows)


@dataclass(frozen=True)
class Room:
    """A folder for one campaign."""

    folder: Path

    def load(self, toml: str, files: dict[str, str | bytes] | None = None, problems: list | None = None) -> Campaign:
        """Write the campaign and load it."""
        for name, content in (files or {}).items():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        (self.folder / "campaign.toml").write_text(toml, encoding="utf-8")
        return load_campaign(self.folder, problems)

    def record(self, file: str, content: str | bytes, *lines: str, kind: str = "decay", toml: str = HEAVING):
        """Load a campaign with one record in its test; return the record."""
        return self.load(toml + record(file, *lines, kind=kind), {file: content}).tests[0].records[0]
