"""`load_campaign`: from a folder with a campaign.toml to a `Campaign`."""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scruton.campaign import units
from scruton.campaign.columns import file_path
from scruton.campaign.files import Files
from scruton.campaign.quantity import Quantity
from scruton.campaign.records import RECORD_KEYS, read_record, read_sweep
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Fluid, Kind, Motion, Record, Rig, Section, Sweep, Test
from scruton.campaign.series import each_test
from scruton.campaign.spelling import nearest, show
from scruton.campaign.thresholds import LARGEST_TOML
from scruton.campaign.title_block import read_title_block
from scruton.campaign.toml import Field, Table, anything, choice, flag, number, parse_toml, stated, text, toml_text
from scruton.errors import InputError

FILE_NAME = "campaign.toml"
FORMAT = 1
STILL_AIR = (Kind.FREE_DECAY,)
IN_WIND = (Kind.GROWTH, Kind.DECAY, Kind.STEADY)


def _damping_ratio(table: Table, key: str) -> Quantity:
    ratio = table.quantity(key, units.DAMPING_RATIO)
    if ratio.mean > 1.0:
        raise table.error(key, f"{ratio.mean:g}", "a ratio below 1, not in percent: 0.0058 is 0.58 %")
    return ratio


UNFILLED = "FILL IN"  # in a comment, the mark of a line that `scruton init` could not fill
_TOP_KEYS = ("format", "title", "source", "section", "defaults", "rigs", "tests", "sweeps", "report")
_SECTION = {
    "motion": choice(Motion),
    "width": number(units.LENGTH),
    "depth": number(units.LENGTH),
    "fluid": choice(Fluid, Fluid.AIR),
}
_RIG = {
    "name": text('a name, such as name = "1#"'),
    "mass": anything(),
    "inertia": anything(),
    "frequency": stated(units.FREQUENCY),
    "damping_ratio": Field(_damping_ratio, None),
    "records": anything(),
}
_TEST = {
    "name": text('a name, such as name = "Sc 1.9"'),
    "rig": text("the name of a rig"),
    "air_density": stated(units.DENSITY),
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


def load_campaign(path: Path, problems: list[InputError] | None = None, *, whole: bool = False) -> Campaign:
    """Read a campaign and every record that it names.

    Parameters
    ----------
    path : Path
        The folder with a campaign.toml, or the TOML file itself.
    problems : list of InputError, optional
        Where given, what is wrong with single records or sweeps is appended here and these are left out, so that
        all of it can be shown at once; else the first is raised.
    whole : bool
        Leave `start` and `stop` aside: every record is as long as its file.

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
    data = files.read(path, LARGEST_TOML)
    top = Table(path, "", parse_toml(data, path))
    _refuse_unfilled(data, path)
    top.check_keys(_TOP_KEYS)
    top = _with_defaults(top)
    top.check_format(FORMAT)
    if "section" not in top:
        raise top.error("section", "nothing", "a table [section] with motion, width and depth")
    section = Section(**top.table("section").read(_SECTION))
    rigs, tests, sweeps = top.tables("rigs"), top.tables("tests"), top.tables("sweeps")
    tests = tuple(test for table in tests for test in each_test(table, files))
    if not rigs:
        raise top.error("rigs", "nothing", "at least one [[rigs]]")
    reading = _Reading(section, files, problems, _record_names([*rigs, *tests], files), whole)
    read_rigs = tuple(reading.rig(table) for table in rigs)
    _check_names(rigs, "rig")
    by_name = {rig.name: rig for rig in read_rigs}
    read_tests = tuple(reading.test(table, by_name) for table in tests)
    _check_names(tests, "test")
    peaks: dict[str, str] = {}
    for table, test in zip(tests, read_tests, strict=True):
        if test.peak and (before := peaks.setdefault(test.rig, test.name)) != test.name:
            raise table.error("peak", f'true, as in test "{before}" of the same rig', "one peak test a rig")
    return Campaign(
        path=path,
        title=text(default=path.resolve().parent.name).read(top, "title"),
        source=text(default="", blank=True).read(top, "source"),
        section=section,
        rigs=read_rigs,
        tests=read_tests,
        sweeps=tuple(reading.sweeps(sweeps, by_name)),
        sha256=files.sha256,
        remarks=tuple(_odd_units(top)),
        title_block=read_title_block(top.table("report"), files),
    )


def _refuse_unfilled(data: bytes, path: Path) -> None:
    """Raise InputError for lines that `scruton init` left to be filled in: each with its number and its spelling."""
    lines = enumerate(toml_text(data, path).splitlines(), start=1)
    left = [(i, line.strip(" \t#")) for i, line in lines if line.lstrip().startswith("#") and UNFILLED in line]
    if left:
        more = "" if len(left) == 1 else f"; lines {', '.join(str(i) for i, _ in left[1:])}, too"
        wanted = f"the value in place, and the # before it gone: {left[0][1].partition('#')[0].strip()}{more}"
        raise InputError(path, f"line {left[0][0]}", f"a line that is marked {UNFILLED}", wanted)


def _with_defaults(top: Table) -> Table:
    """Give every record and every test what [defaults.records] and [defaults.tests] say and they do not."""
    defaults = top.table("defaults")
    defaults.check_keys(("records", "tests"))
    records, tests = defaults.table("records"), defaults.table("tests")
    records.check_keys([key for key in RECORD_KEYS if key != "file"])
    tests.check_keys([key for key in _TEST if key not in ("name", "records", "peak")])

    def test(own: Mapping[str, Any]) -> dict[str, Any]:
        usual = dict(tests.values)
        if {"wind_speed", "reduced_velocity"} & set(own):  # either says the wind
            usual = {key: value for key, value in usual.items() if key not in ("wind_speed", "reduced_velocity")}
        return {**usual, **own}

    def filled(owner: Table, own: Mapping[str, Any]) -> dict[str, Any]:
        inner = [{**records.values, **record.values} for record in owner.tables("records")]
        return {**own, "records": inner} if "records" in owner else dict(own)

    values = {key: value for key, value in top.values.items() if key != "defaults"}
    if records.values or tests.values:
        values |= {"rigs": [filled(rig, rig.values) for rig in top.tables("rigs")]}
        values |= {"tests": [filled(one, test(one.values)) for one in top.tables("tests")]} if "tests" in top else {}
    return Table(top.file, top.field, values, top.wording)


@dataclass
class _Reading:
    """What reading records takes along: where to, under which names, and what was seen before."""

    section: Section
    files: Files
    problems: list[InputError] | None
    names: dict[str, str]  # by field
    whole: bool  # without start and stop
    seen: dict[str, str] = field(default_factory=dict)  # fingerprint of a record to its field

    def each[T](self, tables: Iterable[Table], read: Callable[..., T], *more: Any) -> Iterator[T]:
        """Read what can be read; where problems are gathered, leave the rest out."""
        for table in tables:
            try:
                yield read(table, *more)
            except InputError as error:
                if self.problems is None:
                    raise
                self.problems.append(error)

    def records(self, owner: Table, frequency: float, kinds: Sequence[Kind]) -> tuple[Record, ...]:
        def read(table: Table) -> Record:
            where = {key: value for key, value in table.values.items() if key not in ("kind", "scale", "band")}
            if isinstance(where.get("file"), str):
                where["file"] = self.files.key(file_path(table, self.files.folder))
            fingerprint = json.dumps(where, sort_keys=True, default=str)
            before = self.seen.setdefault(fingerprint, table.field)
            if before != table.field:  # the very same samples would count twice
                raise InputError(table.file, table.field, f"the same record as {before}", "each record once")
            name = self.names.get(table.field, "")
            if self.whole:
                values = {key: value for key, value in table.values.items() if key not in ("start", "stop")}
                table = Table(table.file, table.field, values, table.wording)
            return read_record(table, name, self.section, frequency, self.files, kinds)

        return tuple(self.each(owner.tables("records"), read))

    def rig(self, table: Table) -> Rig:
        """Read a rig; its mass per unit length, or for torsion the inertia, goes under either name."""
        values, heaving = table.read(_RIG), self.section.motion is Motion.HEAVING
        if "inertia" in table and heaving:
            raise table.error("inertia", "the inertia of a heaving section", 'its mass, such as mass = "7.089 kg/m"')
        if "mass" in table and "inertia" in table:
            raise table.error("inertia", "both mass and inertia", "one of the two")
        key = "inertia" if "inertia" in table else "mass"
        mass = table.quantity(key, units.MASS if heaving else units.INERTIA) if key in table else None
        if values["damping_ratio"] is None and not table.tables("records"):
            raise table.error("damping_ratio", "nothing, and no free-decay record either", "one of the two")
        records = self.records(table, values["frequency"].mean, STILL_AIR)
        return Rig(values["name"], values["frequency"], mass, values["damping_ratio"], records)

    def test(self, table: Table, rigs: Mapping[str, Rig]) -> Test:
        values, section = table.read(_TEST), self.section
        rig = _rig_of(table, rigs)
        if rig.mass is None:
            what = 'a mass, such as mass = "7.089 kg/m"'
            if section.motion is Motion.TORSIONAL:
                what = 'an inertia, such as inertia = "0.183 kg*m^2/m"'
            wanted = f'a rig with {what} in rig "{rig.name}"'
            raise table.error("rig", f'"{rig.name}", which has no mass', wanted)
        stable = None
        if "stable_amplitude" in table:
            place = table.at("stable_amplitude")
            stable = units.parse_amplitude(values["stable_amplitude"], section, table.file, place)
        if "wind_speed" in table and "reduced_velocity" in table:
            raise table.error("wind_speed", "both wind_speed and reduced_velocity", "one of the two")
        if "reduced_velocity" in table:  # the uncertainty of f0 is left out: U/(f0 D) is what was set
            reduced = table.quantity("reduced_velocity", units.REDUCED_VELOCITY)
            scale = rig.frequency.mean * section.depth
            speed = Quantity(reduced.mean * scale, None if reduced.sd is None else reduced.sd * scale)
        else:
            speed = table.quantity("wind_speed", units.SPEED)
        records = self.records(table, rig.frequency.mean, IN_WIND)
        return Test(values["name"], rig.name, values["air_density"], speed, values["peak"], stable, records)

    def sweeps(self, tables: Iterable[Table], rigs: Mapping[str, Rig]) -> Iterator[Sweep]:
        for table in tables:
            frequency = _rig_of(table, rigs).frequency.mean
            yield from self.each([table], read_sweep, self.section, frequency, self.files)


def _rig_of(table: Table, rigs: Mapping[str, Rig]) -> Rig:
    name = table.text("rig", "the name of a rig")
    if name not in rigs:
        raise table.error("rig", show(name), f"the name of a rig, {nearest(name, rigs)}")
    return rigs[name]


def _odd_units(table: Table) -> Iterator[Remark]:
    """Remark on units that no laboratory uses, wherever a quantity stands."""
    for key, value in table.values.items():
        place = table.at(key)
        if isinstance(value, str) and (key in _QUANTITIES or table.field.endswith(".units")):
            odd = units.odd_unit(value)
            if odd is not None:
                text = f"{show(value)} has {odd}; was another one meant?"
                yield Remark(Severity.DOUBT, "unit", "", place, text, "a unit that no laboratory uses")
        within = value if isinstance(value, list) else [value]
        for i, inner in enumerate(within):
            if isinstance(inner, Mapping):
                yield from _odd_units(Table(table.file, f"{place}[{i}]" if within is value else place, inner))


_BROKEN = re.compile("[\\x00-\\x1f\\x7f-\\x9f\\u2028\\u2029]")  # control characters, and ends of lines


def _check_names(tables: Sequence[Table], what: str) -> None:
    first: dict[object, str] = {}
    for table in tables:
        if _BROKEN.search(name := str(table.values["name"])):
            raise table.error("name", repr(name), "a name on one line, without control characters")
        before = first.setdefault(table.values["name"], table.at("name"))
        if before != table.at("name"):
            raise table.error("name", f"{show(table.values['name'])}, as in {before}", f"another name for each {what}")


def _record_names(owners: Sequence[Table], files: Files) -> dict[str, str]:
    """Name every record: the file's name, longer where two folders hold that name, numbered where it is used often."""
    keys = {
        table.field: files.key(files.folder / file)
        for owner in owners
        for table in owner.tables("records")
        if isinstance(file := table.values.get("file"), str)
    }
    uses = Counter(keys.values())
    folders = Counter(Path(key).name for key in uses)
    count: Counter[str] = Counter()
    names = {}
    for place, key in keys.items():
        count[key] += 1
        short = Path(key).name if folders[Path(key).name] == 1 else key
        names[place] = short if uses[key] == 1 else f"{short}#{count[key]}"
    return names
