"""`load_campaign`: from a folder with a campaign.toml to a `Campaign`."""

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from scruton.campaign.columns import file_path
from scruton.campaign.files import Files
from scruton.campaign.quantity import Quantity
from scruton.campaign.records import read_record, read_sweep
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Fluid, Kind, Motion, Record, Rig, Section, Sweep, Test
from scruton.campaign.spelling import nearest, show
from scruton.campaign.thresholds import LARGEST_TOML
from scruton.campaign.toml import Table, anything, choice, flag, number, parse_toml, stated, text
from scruton.campaign.units import (
    DAMPING_RATIO,
    DENSITY,
    FREQUENCY,
    INERTIA,
    LENGTH,
    MASS,
    REDUCED_VELOCITY,
    SPEED,
    odd_unit,
    parse_amplitude,
)
from scruton.errors import InputError

FILE_NAME = "campaign.toml"
FORMAT = 1
STILL_AIR = (Kind.FREE_DECAY,)
IN_WIND = (Kind.GROWTH, Kind.DECAY, Kind.STEADY)

_TOP_KEYS = ("format", "title", "source", "section", "rigs", "tests", "sweeps")
_SECTION = {
    "motion": choice(Motion),
    "width": number(LENGTH),
    "depth": number(LENGTH),
    "fluid": choice(Fluid, Fluid.AIR),
}
_RIG = {
    "name": text('a name, such as name = "1#"'),
    "mass": anything(),
    "inertia": anything(),
    "frequency": stated(FREQUENCY),
    "damping_ratio": stated(
        DAMPING_RATIO, None, good=lambda ratio: ratio <= 1.0,
        wanted="a ratio below 1, not in percent: 0.0058 is 0.58 %",
    ),
    "records": anything(),
}  # fmt: skip
_TEST = {
    "name": text('a name, such as name = "Sc 1.9"'),
    "rig": text("the name of a rig"),
    "air_density": stated(DENSITY),
    "wind_speed": anything(),
    "reduced_velocity": anything(),
    "peak": flag(None),
    "stable_amplitude": anything(),
    "records": anything(),
}

# Keys of quantities with a unit, wherever they stand.
_QUANTITIES = frozenset(
    ("width", "depth", "mass", "inertia", "frequency", "air_density", "wind_speed", "stable_amplitude", "sample_rate",
     "start", "stop", "mean", "sd")
)  # fmt: skip


def load_campaign(path: Path, problems: list[InputError] | None = None) -> Campaign:
    """Read a campaign and every record that it names.

    Parameters
    ----------
    path : Path
        The folder with a campaign.toml, or the TOML file itself.
    problems : list of InputError, optional
        Where given, what is wrong with single records or sweeps is appended here and these are left out, so that
        all of it can be shown at once; else the first is raised.

    Returns
    -------
    Campaign
        In SI units; displacements divided by the depth; `path` is that of the TOML file; `sha256` has every file
        that was read, by its path relative to the folder.

    Raises
    ------
    InputError
        Whatever is wrong with the TOML file; with a record, where `problems` is None.
    """
    path = Path(path)
    if path.is_dir():
        path = path / FILE_NAME
    if not path.exists():
        raise InputError(path, "", "no such file", f"a folder with a {FILE_NAME}, or the path of one")
    files = Files(path.parent)
    top = Table(path, "", parse_toml(files.read(path, LARGEST_TOML), path))
    top.check_keys(_TOP_KEYS)
    top.check_format(FORMAT)
    section = _section(top)
    rigs, tests, sweeps = top.tables("rigs"), top.tables("tests"), top.tables("sweeps")
    if not rigs:
        raise top.error("rigs", "nothing", "at least one [[rigs]]")
    reading = _Reading(section, files, problems, _record_names([*rigs, *tests], files))
    read_rigs = tuple(_rig(table, reading) for table in rigs)
    _check_names(rigs, "rig")
    by_name = {rig.name: rig for rig in read_rigs}
    read_tests = tuple(_test(table, by_name, reading) for table in tests)
    _check_names(tests, "test")
    _check_peaks(tests, read_tests)
    return Campaign(
        path=path,
        title=text(default=path.resolve().parent.name).read(top, "title"),
        source=text(default="", blank=True).read(top, "source"),
        section=section,
        rigs=read_rigs,
        tests=read_tests,
        sweeps=tuple(sweep for table in sweeps for sweep in _sweep(table, by_name, reading)),
        sha256=files.sha256,
        remarks=tuple(_odd_units(top)),
    )


@dataclass
class _Reading:
    """What reading records takes along: where to, under which names, and what was seen before."""

    section: Section
    files: Files
    problems: list[InputError] | None
    names: dict[str, str]  # by field
    seen: dict[str, str] = field(default_factory=dict)  # fingerprint of a record to its field

    def report(self, error: InputError) -> None:
        if self.problems is None:
            raise error
        self.problems.append(error)

    def records(self, owner: Table, kinds: Collection[Kind]) -> tuple[Record, ...]:
        found = []
        for table in owner.tables("records"):
            try:
                self._check_new(table)
                found.append(read_record(table, self.names.get(table.field, ""), self.section, self.files, kinds))
            except InputError as error:
                self.report(error)
        return tuple(found)

    def _check_new(self, table: Table) -> None:
        """Raise InputError where the very same samples were named before: they would count twice."""
        where = {key: value for key, value in table.values.items() if key != "kind"}
        if isinstance(where.get("file"), str):
            where["file"] = self.files.key(file_path(table, self.files.folder))
        fingerprint = json.dumps(where, sort_keys=True, default=str)
        before = self.seen.setdefault(fingerprint, table.field)
        if before != table.field:
            raise InputError(table.file, table.field, f"the same record as {before}", "each record once")


def _odd_units(table: Table) -> Iterator[Remark]:
    """Remark on units that no laboratory uses, wherever a quantity stands."""
    for key, value in table.values.items():
        place = table.at(key)
        if isinstance(value, str) and (key in _QUANTITIES or table.field.endswith(".units")):
            found = odd_unit(value)
            if found is not None:
                yield Remark(
                    Severity.DOUBT, "unit", "", place, f"{show(value)} has {found}; was another one meant?",
                    "a unit that no laboratory uses",
                )  # fmt: skip
        elif isinstance(value, Mapping):
            yield from _odd_units(Table(table.file, place, value))
        elif isinstance(value, list):
            for i, inner in enumerate(value):
                if isinstance(inner, Mapping):
                    yield from _odd_units(Table(table.file, f"{place}[{i}]", inner))


def _section(top: Table) -> Section:
    if "section" not in top:
        raise top.error("section", "nothing", "a table [section] with motion, width and depth")
    return Section(**top.table("section").read(_SECTION))


def _rig(table: Table, reading: _Reading) -> Rig:
    values = table.read(_RIG)
    mass = _mass(table, reading.section.motion)
    if values["damping_ratio"] is None and not table.tables("records"):
        raise table.error("damping_ratio", "nothing, and no free-decay record either", "one of the two")
    records = reading.records(table, STILL_AIR)
    return Rig(values["name"], values["frequency"], mass, values["damping_ratio"], records)


def _mass(table: Table, motion: Motion) -> Quantity | None:
    """Mass per unit length, or for torsion the inertia, under either name."""
    if "inertia" in table and motion is Motion.HEAVING:
        raise table.error("inertia", "the inertia of a heaving section", 'its mass, such as mass = "7.089 kg/m"')
    if "mass" in table and "inertia" in table:
        raise table.error("inertia", "both mass and inertia", "one of the two")
    key = "inertia" if "inertia" in table else "mass"
    return table.quantity(key, MASS if motion is Motion.HEAVING else INERTIA) if key in table else None


def _test(table: Table, rigs: dict[str, Rig], reading: _Reading) -> Test:
    values = table.read(_TEST)
    rig, section = _rig_of(table, rigs), reading.section
    if rig.mass is None:
        what = 'a mass, such as mass = "7.089 kg/m"'
        if section.motion is Motion.TORSIONAL:
            what = 'an inertia, such as inertia = "0.183 kg*m^2/m"'
        wanted = f'a rig with {what} in rig "{rig.name}"'
        raise table.error("rig", f'"{rig.name}", which has no mass', wanted)
    stable = None
    if "stable_amplitude" in table:
        stable = parse_amplitude(values["stable_amplitude"], section, table.file, table.at("stable_amplitude"))
    return Test(
        name=values["name"],
        rig=rig.name,
        air_density=values["air_density"],
        wind_speed=_wind_speed(table, rig, section),
        peak=values["peak"],
        stable_amplitude=stable,
        records=reading.records(table, IN_WIND),
    )


def _wind_speed(table: Table, rig: Rig, section: Section) -> Quantity:
    """Wind speed [m/s], stated or from U/(f0 D); the uncertainty of f0 is left out: U/(f0 D) is what was set."""
    if "wind_speed" in table and "reduced_velocity" in table:
        raise table.error("wind_speed", "both wind_speed and reduced_velocity", "one of the two")
    if "reduced_velocity" not in table:
        return table.quantity("wind_speed", SPEED)
    reduced = table.quantity("reduced_velocity", REDUCED_VELOCITY)
    scale = rig.frequency.mean * section.depth
    return Quantity(reduced.mean * scale, None if reduced.sd is None else reduced.sd * scale)


def _sweep(table: Table, rigs: dict[str, Rig], reading: _Reading) -> tuple[Sweep, ...]:
    rig = _rig_of(table, rigs)
    try:
        return (read_sweep(table, reading.section, rig.frequency.mean, reading.files),)
    except InputError as error:
        reading.report(error)
        return ()


def _rig_of(table: Table, rigs: dict[str, Rig]) -> Rig:
    name = table.text("rig", "the name of a rig")
    if name not in rigs:
        raise table.error("rig", show(name), f"the name of a rig, {nearest(name, rigs)}")
    return rigs[name]


def _check_names(tables: Sequence[Table], what: str) -> None:
    first: dict[object, str] = {}
    for table in tables:
        before = first.setdefault(table.values["name"], table.at("name"))
        if before != table.at("name"):
            raise table.error("name", f"{show(table.values['name'])}, as in {before}", f"another name for each {what}")


def _check_peaks(tables: Sequence[Table], tests: Sequence[Test]) -> None:
    first: dict[str, str] = {}
    for table, test in zip(tables, tests, strict=True):
        if test.peak:
            before = first.setdefault(test.rig, test.name)
            if before != test.name:
                raise table.error("peak", f'true, as in test "{before}" of the same rig', "one peak test a rig")


def _record_names(owners: Sequence[Table], files: Files) -> dict[str, str]:
    """Name every record: the file's name, longer where two folders hold that name, numbered where it is used often."""
    keys = {
        table.field: files.key(files.folder / file)
        for owner in owners
        for table in owner.tables("records")
        if isinstance(file := table.values.get("file"), str)
    }
    last = {key: Path(key).name for key in keys.values()}
    folders = Counter(last.values())
    uses = Counter(keys.values())
    count: Counter[str] = Counter()
    names = {}
    for place, key in keys.items():
        count[key] += 1
        short = last[key] if folders[last[key]] == 1 else key
        names[place] = short if uses[key] == 1 else f"{short}#{count[key]}"
    return names
