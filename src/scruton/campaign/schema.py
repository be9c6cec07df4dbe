"""What a campaign is, in SI units and frozen: one body, the rigs it hung in, the tests made in the wind.

Nothing here reads a file or knows a unit; `scruton.campaign.load` does both and builds these.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from math import degrees
from pathlib import Path
from typing import Any

from scruton.arrays import FloatArray
from scruton.campaign.quantity import Quantity as Quantity
from scruton.campaign.remarks import Remark
from scruton.shown import fields_in_brief, shown


class Motion(StrEnum):
    """The degree of freedom that the section moves in."""

    HEAVING = "heaving"
    TORSIONAL = "torsional"

    def amplitude_text(self, amplitude: float) -> str:
        """Write an amplitude, in A/D or [rad], as a reader meets it: in A/D, or in degrees."""
        return f"{amplitude:.3g} A/D" if self is Motion.HEAVING else f"{degrees(amplitude):.3g} deg"


class Kind(StrEnum):
    """What happens in a record: FREE_DECAY in still air, the others in wind."""

    FREE_DECAY = "free-decay"
    GROWTH = "growth"  # grow-to-resonance, GTR
    DECAY = "decay"  # decay-to-resonance, DTR
    STEADY = "steady"  # lock-in without any release


class Fluid(StrEnum):
    """What flows past the section."""

    AIR = "air"
    WATER = "water"


@dataclass(frozen=True)
class Section:
    """The body: `width` is B [m], along the wind; `depth` is D [m], across it; `fluid` is what flows past it."""

    motion: Motion
    width: float
    depth: float
    fluid: Fluid = Fluid.AIR

    @property
    def amplitude_unit(self) -> str:
        """Unit of every amplitude in the program: A/D for heaving, rad for torsional."""
        return "A/D" if self.motion is Motion.HEAVING else "rad"


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Record:
    """One time history.

    Attributes
    ----------
    name : str
        Unique in the campaign: the file's name, with a suffix where one file holds several records.
    path : Path
        The file it was read from.
    kind : Kind
    time : (N,) array
        Seconds, strictly increasing, as in the file (not shifted to zero).
    response : (N,) array
        y/D (heaving, dimensionless) or rotation [rad] (torsional), or its amplitude if `is_envelope`.
    is_envelope : bool
        True where the file holds an amplitude that was extracted elsewhere.
    field : str
        Where the record is named in campaign.toml, for error messages: "tests[0].records[1]".
    band : (low, high) or None
        Edges [Hz] of the band that `response` holds, where it was filtered, or integrated from a velocity or an
        acceleration; its noise lies there, too.
    """

    name: str
    path: Path
    kind: Kind
    time: FloatArray
    response: FloatArray
    is_envelope: bool = False
    field: str = ""
    band: tuple[float, float] | None = None


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Rig:
    """One mass-damping setting of the suspension.

    `mass` is kg/m (heaving) or kg m^2/m (torsional, inertia per unit length), None for a rig that no test
    uses; `frequency` is f0 [Hz] in still air; `damping_ratio` is xi_s as stated, None if only ring-downs tell it.
    """

    name: str
    frequency: Quantity
    mass: Quantity | None = None
    damping_ratio: Quantity | None = None
    records: tuple[Record, ...] = ()


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Test:
    """One rig in one wind.

    `air_density` kg/m^3, `wind_speed` m/s; `peak` as the file states it (None where it does not);
    `stable_amplitude` is A/D or rad.
    """

    __test__ = False  # not a pytest class

    name: str
    rig: str
    air_density: Quantity
    wind_speed: Quantity
    peak: bool | None = None
    stable_amplitude: Quantity | None = None
    records: tuple[Record, ...] = ()


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Sweep:
    """Steady amplitudes against wind speed for one rig: `wind_speed` [m/s] and `amplitude` (A/D or rad), (M,)."""

    rig: str
    air_density: Quantity
    wind_speed: FloatArray
    amplitude: FloatArray
    path: Path


@dataclass(frozen=True)
class TitleBlock:
    """What stands in the head of a report, each as it is written; empty where it is left out.

    `colour` is "#rrggbb"; `logo` is the picture as a data URI. `damping` ("ratio", which None is, or "decrement") and
    `scruton_number` ("paper", which None is, or "eurocode") say what a reader is shown: files keep the first of each.
    """

    project: str = ""
    client: str = ""
    author: str = ""
    checker: str = ""
    revision: str = ""
    date: str = ""
    colour: str = ""
    logo: str = ""
    damping: str | None = None
    scruton_number: str | None = None

    @property
    def lines(self) -> list[tuple[str, str]]:
        """Label and text of everything that is stated and read."""
        names = (field.name for field in fields(self) if field.default == "" and field.name not in ("colour", "logo"))
        return [(name.capitalize(), value) for name in names if (value := getattr(self, name))]


def _facts(one: "Campaign") -> Mapping[str, object]:
    section, records = one.section, sum(len(rig.records) for rig in one.rigs)
    records += sum(len(test.records) for test in one.tests)
    size = f"{section.motion.value}, B = {section.width:g} m, D = {section.depth:g} m"
    counts = {"rigs": len(one.rigs), "tests": len(one.tests), "records": records, "sweeps": len(one.sweeps)}
    return {"title": one.title, "section": size, **counts}


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Campaign:
    """A whole campaign.

    `sha256` maps every file that was read to the digest of its bytes; `remarks` are about the spelling of
    campaign.toml, which the numbers in SI do not tell any more.
    """

    path: Path
    title: str
    source: str
    section: Section
    rigs: tuple[Rig, ...]
    tests: tuple[Test, ...] = ()
    sweeps: tuple[Sweep, ...] = ()
    sha256: Mapping[str, str] | None = None
    remarks: tuple[Remark, ...] = ()
    title_block: TitleBlock = field(default_factory=TitleBlock)

    @property
    def conventions(self) -> dict[str, Any]:
        """What a reader is shown otherwise than files have it, by `[report]`; empty where nothing is.

        "damping" is "decrement"; "scruton_number" is "eurocode", 4 pi m xi/(rho D^2), with "scruton_factor", what the
        paper's is multiplied by for it: B/D. EN 1991-1-4 has none for torsion: there it is the paper's.
        """
        block, section = self.title_block, self.section
        asked: dict[str, Any] = {}
        if block.damping not in (None, "ratio"):
            asked["damping"] = block.damping
        if block.scruton_number not in (None, "paper"):
            factor = section.width / section.depth if section.motion is Motion.HEAVING else 1.0
            asked |= {"scruton_number": block.scruton_number, "scruton_factor": factor}
        return asked

    def rig(self, name: str) -> Rig:
        """Return the rig called `name` (KeyError if there is none)."""
        return {rig.name: rig for rig in self.rigs}[name]

    def test(self, name: str) -> Test:
        """Return the test called `name` (KeyError if there is none)."""
        return {test.name: test for test in self.tests}[name]

    def reduced_velocity(self, test: Test) -> float:
        """U/(f0 D) of a test, with the still-air frequency of its rig."""
        return test.wind_speed.mean / (self.rig(test.rig).frequency.mean * self.section.depth)

    def records(self) -> Iterator[tuple[Record, Rig, Test | None]]:
        """Every record with its rig and, in wind, its test; still air first."""
        for rig in self.rigs:
            yield from ((record, rig, None) for record in rig.records)
        for test in self.tests:
            yield from ((record, self.rig(test.rig), test) for record in test.records)
