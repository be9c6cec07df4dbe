"""A synthetic campaign on disk, from a specification that is a campaign.toml with the truth in it.

The specification is the campaign.toml that shall come out, with these additions:

* `[simulation]`: `sample_rate` [Hz]; optional `turbulence` (scatter of the amplitude over the stable amplitude),
  `sensor_noise` and `quantum` (A/D or rad), `gust_intensity` and `gust_time` [s];
* every rig may carry `true_damping_ratio`, where the truth differs from what the laboratory states;
* every test carries `truth = { Y1 = ..., epsilon = ... }`, with `Y2` and `force` ("paper" or "ehsan-scanlan") optional;
* every record carries `duration` [s] and `initial_amplitude`: A/D or rad in still air, multiples of the stable
  amplitude in wind;
* a rig, for all its records, and a record may carry `disturbances = { friction = 0.5, ... }`: fields of
  `scruton.simulate.Disturbances`.
"""

import zlib
from collections.abc import Iterable
from dataclasses import fields
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
from scruton.simulate.motion import simulate_record
from scruton.simulate.thresholds import LARGEST, MOST_STEPS
from scruton.simulate.truth import FORCES, Truth
from scruton.workspace import Workspace, digest

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
    content = _read(spec)
    settings = _settings(spec, content)
    truths = _truths(spec, content)
    planned = [
        (key, i, entry.pop("records", [])) for key in ("rigs", "tests") for i, entry in enumerate(content.get(key, []))
    ]
    damping = [rig.pop("true_damping_ratio", None) for rig in content.get("rigs", [])]
    disturbed = {
        rig.get("name"): _disturbances(spec, f"rigs[{i}]", rig.pop("disturbances", {}))
        for i, rig in enumerate(content.get("rigs", []))
    }
    inputs = {spec.name: digest(spec)}
    # What lies in the folder is refused here, file by file: a measured record counts like a result.
    with Workspace(out, "simulate", inputs=inputs, settings={"seed": seed}, force=True) as work:
        folder = work.new
        campaign = _without_records(spec, content, folder)
        for key, i, records in planned:
            place = f"{key}[{i}]"
            truth = _truth(spec, campaign, key, i, damping, truths)
            common = disturbed[campaign.rigs[i].name if key == "rigs" else campaign.tests[i].rig]
            kept = []
            for j, record in enumerate(records):
                kept.append(_write_record(spec, f"{place}.records[{j}]", record, truth, settings, folder, seed, common))
            if kept:
                content[key][i]["records"] = kept
        write_toml(folder / "campaign.toml", content)
        _loaded(spec, folder)
        _refuse_files(out, (path.name for path in folder.iterdir()), force=force)
        work.publish()
    return out


def _refuse_files(out: Path, names: Iterable[str], *, force: bool) -> None:
    """Refuse to write over what lies in the folder, a measured record perhaps, unless told to."""
    found = sorted(name for name in names if (out / name).exists())
    if found and not force:
        wanted = "an empty folder, or --force to replace what lies in it"
        raise InputError(out, "-o", f"{', '.join(found[:4])}{', ...' if len(found) > 4 else ''}", wanted)


def _read(spec: Path) -> dict[str, Any]:
    """Read the specification; its rigs, tests and records are lists of tables, whatever else they are."""
    _, content = read_toml(spec, "a TOML file that specifies a simulated campaign")
    top = Table(spec, "", content)
    for key in ("rigs", "tests"):
        for owner in top.tables(key):
            owner.text("name", "a name")
            owner.tables("records")
    return content


def _listed(before: str) -> Wording:
    return Wording(repr, "an unknown key", lambda key, known: f"{before}: {', '.join(known)}")


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


_SIMULATION = {
    "sample_rate": _number(),
    "turbulence": _number(0.0),
    "sensor_noise": _number(0.0),
    "quantum": _number(0.0),
    "gust_intensity": _number(0.0),
    "gust_time": _number(1.0),
}
_TRUTH = {
    "Y1": _number(low=-LARGEST),
    "epsilon": _number(low=-LARGEST),
    "Y2": _number(0.0, low=-LARGEST),
    "force": valid(lambda force: isinstance(force, str) and force in FORCES, f"one of: {', '.join(FORCES)}", "paper"),
}
_DISTURBANCES = {part.name: _value_like(part.default) for part in fields(Disturbances)}


def _settings(spec: Path, content: dict[str, Any]) -> dict[str, float]:
    top = Table(spec, "", {"simulation": content.pop("simulation", None)}, _listed("one of"))
    return top.inner("simulation", "a table [simulation] with sample_rate and the noise").read(_SIMULATION)


def _truths(spec: Path, content: dict[str, Any]) -> list[dict[str, Any]]:
    truths = []
    for i, test in enumerate(content.get("tests", [])):
        stated = test.pop("truth", None)
        if not isinstance(stated, dict) or not {"Y1", "epsilon"} <= set(stated) <= set(_TRUTH):
            raise InputError(spec, f"tests[{i}].truth", repr(stated), "truth = { Y1 = -6.3, epsilon = 0.038 }")
        truths.append(Table(spec, f"tests[{i}].truth", stated, _listed("one of")).read(_TRUTH))
    return truths


def _disturbances(spec: Path, place: str, stated: Any) -> dict[str, Any]:
    """Read fields of `Disturbances`: numbers, names of forms, true or false."""
    owner = Table(spec, place, {"disturbances": stated}, _listed("some of"))
    table = owner.inner("disturbances", "a table, disturbances = { friction = 0.5 }")
    table.check_keys(_DISTURBANCES)
    values = {key: _DISTURBANCES[key].read(table, key) for key in table.values}
    try:
        Disturbances(**values)
    except ValueError as error:
        wanted = "values as the documentation lists them"
        raise owner.error("disturbances", f"what cannot be ({error})", wanted) from error
    return values


def _without_records(spec: Path, content: dict[str, Any], folder: Path) -> Campaign:
    """Let the campaign's own loader check everything but the records, and give the numbers in SI."""
    write_toml(folder / "campaign.toml", content)
    return _loaded(spec, folder)


def _loaded(spec: Path, folder: Path) -> Campaign:
    try:
        return load_campaign(folder)
    except InputError as error:
        raise InputError(spec, error.field, error.found, error.wanted) from error


def _truth(spec: Path, campaign: Campaign, key: str, i: int, damping: list[Any], truths: list[dict[str, Any]]) -> Truth:
    rig = campaign.rigs[i] if key == "rigs" else campaign.rig(campaign.tests[i].rig)
    place = campaign.rigs.index(rig)
    stated = damping[place]
    if stated is None and rig.damping_ratio is None:
        raise InputError(spec, f"rigs[{place}].damping_ratio", "nothing", "a damping_ratio, or a true_damping_ratio")
    ratio = rig.damping_ratio.mean if stated is None and rig.damping_ratio else stated
    body: dict[str, Any] = {
        "motion": campaign.section.motion,
        "width": campaign.section.width,
        "depth": campaign.section.depth,
        "mass": rig.mass.mean if rig.mass else 1.0,
        "frequency": rig.frequency.mean,
        "damping_ratio": _number().read(
            Table(spec, f"rigs[{place}]", {"true_damping_ratio": ratio}), "true_damping_ratio"
        ),
    }
    if key == "rigs":
        return Truth(**body)
    test = campaign.tests[i]
    return Truth(**body, air_density=test.air_density.mean, wind_speed=test.wind_speed.mean, **truths[i])


def _write_record(
    spec: Path,
    field: str,
    record: dict[str, Any],
    truth: Truth,
    settings: dict[str, Any],
    folder: Path,
    seed: int,
    common: dict[str, Any],
) -> dict[str, Any]:
    name = record.get("file")
    plain = isinstance(name, str) and name.isprintable() and Path(name).name == name and is_delimited(Path(name))
    if not plain:
        raise InputError(spec, f"{field}.file", show(name or record), 'file = "name.csv", a plain name')
    table = Table(spec, field, record)
    kept = {key: value for key, value in record.items() if key not in _RECORD}
    own = _disturbances(spec, field, record.get("disturbances", {}))
    duration = _number().read(table, "duration")
    samples = duration * settings["sample_rate"]
    if not MIN_SAMPLES <= samples <= MOST_STEPS or duration * truth.frequency * STEPS_PER_CYCLE > MOST_STEPS:
        found = f"{samples:.4g} samples of {duration * truth.frequency:.4g} cycles"
        raise table.error("duration", found, f"{MIN_SAMPLES} samples or more, and at most {MOST_STEPS:g}")
    amplitude = _number().read(table, "initial_amplitude")
    try:
        if not truth.still:
            amplitude *= truth.balance()[0]
        time, response = simulate_record(
            truth,
            initial_amplitude=amplitude,
            duration=duration,
            seed=np.random.SeedSequence([seed, zlib.crc32(record["file"].encode())]),
            disturbances=Disturbances(**{**common, **own}),
            **settings,
        )
    except ArithmeticError as error:
        raise InputError(spec, field, f"numbers that cannot be simulated ({error})", "those of a tunnel") from error
    except ValueError as error:
        raise InputError(
            spec, field, f"a record that cannot be simulated ({error})", "a force with a stable amplitude"
        ) from error
    if not np.isfinite(response).all():
        raise InputError(spec, field, "a motion that grows beyond all numbers", "one that stays finite")
    section = Section(truth.motion, truth.width, truth.depth)
    # six digits: finer than any sensor, and small files
    write_record(folder / record["file"], section, response, time, digits=6, angle="rad")
    return kept
