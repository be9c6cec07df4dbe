"""A synthetic campaign on disk, from a specification that is a campaign.toml with the truth in it.

The specification is the campaign.toml that shall come out, with these additions:

* `[simulation]`: `sample_rate` [Hz]; optional `turbulence` (scatter of the amplitude over the stable amplitude),
  `sensor_noise` and `quantum` (A/D or rad), `gust_intensity`, `gust_time` [s] and `set_point` (of the wind speed);
* every rig may carry `true_damping_ratio`, where the truth differs from what the laboratory states;
* every test carries `truth = { Y1 = ..., epsilon = ... }`, with `Y2`, `force` ("paper", "ehsan-scanlan" or
  "power") and the `exponent` of "power" optional;
* every record carries `duration` [s] and `initial_amplitude`: A/D or rad in still air, multiples of the stable
  amplitude in wind;
* a rig, for all its records, and a record may carry `disturbances = { friction = 0.5, ... }`: fields of
  `scruton.simulate.Disturbances`.
"""

import zlib
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.campaign import Campaign, load_campaign
from scruton.campaign.readers import is_delimited
from scruton.campaign.schema import Section
from scruton.campaign.spelling import show
from scruton.campaign.thresholds import MIN_SAMPLES
from scruton.campaign.toml import Field, Table, Wording, is_number, read_toml, valid
from scruton.campaign.write import write_record, write_toml
from scruton.errors import InputError
from scruton.simulate.disturbances import Disturbances
from scruton.simulate.equation import STEPS_PER_CYCLE
from scruton.simulate.motion import Noise, simulate_record
from scruton.simulate.thresholds import LARGEST, MOST_STEPS
from scruton.simulate.truth import FORCES, Truth
from scruton.workspace import Workspace, digest

_OWNERS = ("rigs", "tests")
_RECORD = ("duration", "initial_amplitude", "disturbances")  # what a record says beyond campaign.toml


def write_campaign(spec: Path, out: Path, *, seed: int, force: bool = False) -> Path:
    """Simulate every record of a specification and write the campaign.

    Parameters
    ----------
    spec : Path
        The specification.
    out : Path
        Folder for the campaign; nothing is written unless all of it can be.
    seed : int
        The same specification and seed give the same bytes.
    force : bool
        Replace a campaign that lies in the folder.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For a specification that makes no campaign, or a folder that holds one already.
    """
    _refuse_files(out, ["campaign.toml"], force=force)
    _, content = read_toml(spec, "a TOML file that specifies a simulated campaign")
    settings, forces, damping, disturbed, records = _taken_out(spec, content)
    # What lies in the folder is refused here, file by file: a measured record counts like a result.
    inputs = {spec.name: digest(spec)}
    with Workspace(out, "simulate", inputs=inputs, settings={"seed": seed}, force=True) as work:
        folder = work.new
        # The campaign's own loader checks everything but the records, and gives the numbers in SI.
        campaign = _loaded(spec, folder, content)
        names = [rig.name for rig in campaign.rigs]
        for (key, i), entries in records.items():
            rig = i if key == "rigs" else names.index(campaign.tests[i].rig)
            truth = _truth(spec, campaign, rig, damping[rig])
            if key == "tests":
                wind = campaign.tests[i]
                truth = replace(truth, air_density=wind.air_density.mean, wind_speed=wind.wind_speed.mean, **forces[i])
            for j, record in enumerate(entries):
                table = Table(spec, f"{key}[{i}].records[{j}]", record)
                _write_record(table, truth, settings, folder, seed, disturbed[rig])
            kept = [{name: value for name, value in record.items() if name not in _RECORD} for record in entries]
            content[key][i] |= {"records": kept} if kept else {}
        _loaded(spec, folder, content)
        _refuse_files(out, (path.name for path in folder.iterdir()), force=force)
        work.publish()
    return out


def _refuse_files(out: Path, names: Iterable[str], *, force: bool) -> None:
    """Refuse to write over what lies in the folder, a measured record perhaps, unless told to."""
    present = sorted(name for name in names if (out / name).exists())
    if present and not force:
        wanted = "an empty folder, or --force to replace what lies in it"
        raise InputError(out, "-o", f"{', '.join(present[:4])}{', ...' if len(present) > 4 else ''}", wanted)


def _number(default: float | None = None, low: float = 0.0) -> Field:
    """Declare a number from `low` to `LARGEST`; "200 Hz" and "40 s" are read too."""

    def read(table: Table, key: str) -> float:
        value = table.values.get(key, default)
        words = value.split() if isinstance(value, str) else []
        if len(words) == 2 and words[1] in ("Hz", "s"):
            try:
                value = float(words[0])
            except ValueError:
                value = None
        if not is_number(value) or not low <= value <= LARGEST:
            raise table.error(key, repr(value), f"a number of at least {low:g}, at most {LARGEST:g}")
        return float(value)

    return Field(read)


def _value_like(example: Any) -> Field:
    """Declare a field of `Disturbances`: a number, the name of a form, true or false."""
    if isinstance(example, float):
        return _number(low=-LARGEST)

    return valid(lambda value: isinstance(value, type(example)), f"a value such as {example!r}")


_SIMULATION = {"sample_rate": _number()} | {name: _number(usual) for name, usual in vars(Noise()).items()}
_TRUTH = {
    "Y1": _number(low=-LARGEST),
    "epsilon": _number(low=-LARGEST),
    "Y2": _number(0.0, low=-LARGEST),
    "exponent": _number(0.0),
    "force": valid(lambda force: isinstance(force, str) and force in FORCES, f"one of: {', '.join(FORCES)}", "paper"),
}
_DISTURBANCES = {part.name: _value_like(part.default) for part in fields(Disturbances)}


def _taken_out(spec: Path, content: dict[str, Any]) -> tuple[Any, ...]:
    """Take out of a specification what campaign.toml does not have.

    That is: what stands in [simulation]; forces by test; damping ratios and disturbances by rig; and the records, by
    "rigs" or "tests" and number.
    """
    top = Table(spec, "", content)
    for owner in (table for key in _OWNERS for table in top.tables(key)):
        owner.text("name", "a name")
        owner.tables("records")
    one_of = Wording(repr, "an unknown key", lambda key, known: f"one of: {', '.join(known)}")
    stated = Table(spec, "", {"simulation": content.pop("simulation", None)}, one_of)
    settings = stated.inner("simulation", "a table [simulation] with sample_rate and the noise").read(_SIMULATION)
    forces = []
    for i, test in enumerate(content.get("tests", [])):
        truth = test.pop("truth", None)
        if not isinstance(truth, dict) or not {"Y1", "epsilon"} <= set(truth) <= set(_TRUTH):
            raise InputError(spec, f"tests[{i}].truth", repr(truth), "truth = { Y1 = -6.3, epsilon = 0.038 }")
        forces.append(Table(spec, f"tests[{i}].truth", truth, one_of).read(_TRUTH))
    rigs = content.get("rigs", [])
    damping = [rig.pop("true_damping_ratio", None) for rig in rigs]
    disturbed = [_disturbances(Table(spec, f"rigs[{i}]", rig)) for i, rig in enumerate(rigs)]
    for rig in rigs:
        rig.pop("disturbances", None)
    owners = [(key, i, entry) for key in _OWNERS for i, entry in enumerate(content.get(key, []))]
    return settings, forces, damping, disturbed, {(key, i): entry.pop("records", []) for key, i, entry in owners}


def _disturbances(owner: Table) -> dict[str, Any]:
    """Read fields of `Disturbances`: numbers, names of forms, true or false."""
    if "disturbances" not in owner:
        return {}
    wording = Wording(repr, "an unknown key", lambda key, known: f"some of: {', '.join(known)}")
    table = replace(owner, wording=wording).inner("disturbances", "a table, disturbances = { friction = 0.5 }")
    table.check_keys(_DISTURBANCES)
    values = {key: _DISTURBANCES[key].read(table, key) for key in table.values}
    try:
        Disturbances(**values)
    except ValueError as error:
        wanted = "values as the documentation lists them"
        raise owner.error("disturbances", f"what cannot be ({error})", wanted) from error
    return values


def _loaded(spec: Path, folder: Path, content: dict[str, Any]) -> Campaign:
    """Write campaign.toml and load it."""
    write_toml(folder / "campaign.toml", content)
    try:
        return load_campaign(folder)
    except InputError as error:
        raise InputError(spec, error.field, error.found, error.wanted) from error


def _truth(spec: Path, campaign: Campaign, number: int, damping: Any) -> Truth:
    """A rig in still air."""
    rig, section = campaign.rigs[number], campaign.section
    if damping is None and rig.damping_ratio is None:
        raise InputError(spec, f"rigs[{number}].damping_ratio", "nothing", "a damping_ratio, or a true_damping_ratio")
    ratio = rig.damping_ratio.mean if damping is None and rig.damping_ratio else damping
    key = "true_damping_ratio"
    return Truth(
        section.motion, section.width, section.depth, rig.mass.mean if rig.mass else 1.0, rig.frequency.mean,
        _number().read(Table(spec, f"rigs[{number}]", {key: ratio}), key),
    )  # fmt: skip


def _write_record(
    table: Table, truth: Truth, settings: dict[str, Any], folder: Path, seed: int, common: dict[str, Any]
) -> None:
    name = table.values.get("file")
    if not (isinstance(name, str) and name.isprintable() and Path(name).name == name and is_delimited(Path(name))):
        raise table.error("file", show(name or table.values), 'file = "name.csv", a plain name')
    single = _disturbances(table)
    duration = _number().read(table, "duration")
    samples = duration * settings["sample_rate"]
    if not MIN_SAMPLES <= samples <= MOST_STEPS or duration * truth.frequency * STEPS_PER_CYCLE > MOST_STEPS:
        found = f"{samples:.4g} samples of {duration * truth.frequency:.4g} cycles"
        raise table.error("duration", found, f"{MIN_SAMPLES} samples or more, and at most {MOST_STEPS:g}")
    amplitude = _number().read(table, "initial_amplitude")
    try:
        time, response = simulate_record(
            truth,
            initial_amplitude=amplitude if truth.still else amplitude * truth.balance()[0],
            duration=duration,
            sample_rate=settings["sample_rate"],
            seed=np.random.SeedSequence([seed, zlib.crc32(name.encode())]),
            noise=Noise(**{key: value for key, value in settings.items() if key != "sample_rate"}),
            disturbances=Disturbances(**{**common, **single}),
        )
    except ArithmeticError as error:
        found, wanted = f"numbers that cannot be simulated ({error})", "those of a tunnel"
        raise InputError(table.file, table.field, found, wanted) from error
    except ValueError as error:
        found, wanted = f"a record that cannot be simulated ({error})", "a force with a stable amplitude"
        raise InputError(table.file, table.field, found, wanted) from error
    if not np.isfinite(response).all():
        found = "a motion that grows beyond all numbers"
        raise InputError(table.file, table.field, found, "one that stays finite")
    section = Section(truth.motion, truth.width, truth.depth)
    # six digits: finer than any sensor, and small files
    write_record(folder / name, section, response, time, digits=6, angle="rad")
