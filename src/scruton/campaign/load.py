"""`load_campaign`: from a folder with a campaign.toml to a `Campaign`."""

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from scruton.campaign.bounded import LARGEST_TOML, parse_toml, toml_text
from scruton.campaign.columns import file_path
from scruton.campaign.files import Files
from scruton.campaign.records import read_record, read_sweep
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Fluid, Kind, Motion, Quantity, Record, Rig, Section, Sweep, Test
from scruton.campaign.tables import Table, nearest
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
    show,
)
from scruton.errors import InputError

FILE_NAME = "campaign.toml"
FORMAT = 1
STILL_AIR = (Kind.FREE_DECAY,)
IN_WIND = (Kind.GROWTH, Kind.DECAY, Kind.STEADY)

_TOP_KEYS = ("format", "title", "source", "section", "rigs", "tests", "sweeps")
_SECTION_KEYS = ("motion", "width", "depth", "fluid")
_RIG_KEYS = ("name", "mass", "inertia", "frequency", "damping_ratio", "records")
_TEST_KEYS = (
    "name", "rig", "air_density", "wind_speed", "reduced_velocity", "peak", "stable_amplitude", "records",
)  # fmt: skip


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
    top = Table(path, "", parse_toml(toml_text(files.read(path, LARGEST_TOML), path), path))
    top.check_keys(_TOP_KEYS)
    version = top.required("format", f"format = {FORMAT}")
    if version != FORMAT or isinstance(version, bool | float):
        raise top.error("format", show(version), f"format = {FORMAT}, the one that this version reads")
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
        title=top.text("title", "a text", default=path.resolve().parent.name),
        source=top.text("source", "a text", default=""),
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
            for i, one in enumerate(value):
                if isinstance(one, Mapping):
                    yield from _odd_units(Table(table.file, f"{place}[{i}]", one))


def _section(top: Table) -> Section:
    if "section" not in top:
        raise top.error("section", "nothing", "a table [section] with motion, width and depth")
    table = top.table("section")
    table.check_keys(_SECTION_KEYS)
    motion = Motion(table.choice("motion", [one.value for one in Motion]))
    fluid = Fluid(table.choice("fluid", [one.value for one in Fluid])) if "fluid" in table else Fluid.AIR
    return Section(motion, table.number("width", LENGTH), table.number("depth", LENGTH), fluid)


def _rig(table: Table, reading: _Reading) -> Rig:
    table.check_keys(_RIG_KEYS)
    name = table.text("name", 'a name, such as name = "1#"')
    frequency = table.quantity("frequency", FREQUENCY)
    mass = _mass(table, reading.section.motion)
    damping_ratio = table.quantity("damping_ratio", DAMPING_RATIO) if "damping_ratio" in table else None
    if damping_ratio is not None and damping_ratio.mean > 1.0:
        raise table.error(
            "damping_ratio", f"{damping_ratio.mean:g}", "a ratio below 1, not in percent: 0.0058 is 0.58 %"
        )
    if damping_ratio is None and not table.tables("records"):
        raise table.error("damping_ratio", "nothing, and no free-decay record either", "one of the two")
    return Rig(name, frequency, mass, damping_ratio, reading.records(table, STILL_AIR))


def _mass(table: Table, motion: Motion) -> Quantity | None:
    """Mass per unit length, or for torsion the inertia, under either name."""
    if "inertia" in table and motion is Motion.HEAVING:
        raise table.error("inertia", "the inertia of a heaving section", 'its mass, such as mass = "7.089 kg/m"')
    if "mass" in table and "inertia" in table:
        raise table.error("inertia", "both mass and inertia", "one of the two")
    key = "inertia" if "inertia" in table else "mass"
    return table.quantity(key, MASS if motion is Motion.HEAVING else INERTIA) if key in table else None


def _test(table: Table, rigs: dict[str, Rig], reading: _Reading) -> Test:
    table.check_keys(_TEST_KEYS)
    name = table.text("name", 'a name, such as name = "Sc 1.9"')
    rig = _rig_of(table, rigs)
    if rig.mass is None:
        wanted = f'a rig with a mass, such as mass = "7.089 kg/m" in rig "{rig.name}"'
        if reading.section.motion is Motion.TORSIONAL:
            wanted = f'a rig with an inertia, such as inertia = "0.183 kg*m^2/m" in rig "{rig.name}"'
        raise table.error("rig", f'"{rig.name}", which has no mass', wanted)
    peak = table.values.get("peak")
    if peak is not None and not isinstance(peak, bool):
        raise table.error("peak", show(peak), "true or false")
    stable = None
    if "stable_amplitude" in table:
        key = "stable_amplitude"
        stable = parse_amplitude(table.values[key], reading.section, table.file, table.at(key))
    return Test(
        name=name,
        rig=rig.name,
        air_density=table.quantity("air_density", DENSITY),
        wind_speed=_wind_speed(table, rig, reading.section),
        peak=peak,
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
