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

import tempfile
import zlib
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign import Campaign, load_campaign
from scruton.campaign.bounded import LARGEST_TOML, parse_toml, read_bytes, toml_text
from scruton.campaign.readers import is_delimited
from scruton.campaign.records import MIN_SAMPLES
from scruton.campaign.schema import Motion
from scruton.campaign.tables import Table
from scruton.campaign.units import show
from scruton.documents import replace_file
from scruton.errors import InputError
from scruton.simulate.disturbances import Disturbances
from scruton.simulate.equation import STEPS_PER_CYCLE
from scruton.simulate.motion import simulate_record
from scruton.simulate.truth import FORCES, Truth

LARGEST = 1e12  # of any number, in its unit
MOST_STEPS = 1e8  # of the integration of one record

_SIMULATION = {
    "sample_rate": None,
    "turbulence": 0.0,
    "sensor_noise": 0.0,
    "quantum": 0.0,
    "gust_intensity": 0.0,
    "gust_time": 1.0,
}
_TRUTH = ("Y1", "epsilon", "Y2", "force")


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
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".simulating-") as temporary:
        folder = Path(temporary)
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
        _write_toml(folder / "campaign.toml", content)
        _loaded(spec, folder)
        _refuse_files(out, (path.name for path in folder.iterdir()), force=force)
        out.mkdir(exist_ok=True)
        for path in sorted(folder.iterdir()):
            replace_file(path, out / path.name)  # one step each, the campaign.toml among the first
    return out


def _refuse_files(out: Path, names: Iterable[str], *, force: bool) -> None:
    """Refuse to write over what lies in the folder, a measured record perhaps, unless told to."""
    found = sorted(name for name in names if (out / name).exists())
    if found and not force:
        wanted = "an empty folder, or --force to replace what lies in it"
        raise InputError(out, "-o", f"{', '.join(found[:4])}{', ...' if len(found) > 4 else ''}", wanted)


def _read(spec: Path) -> dict[str, Any]:
    """Read the specification; its rigs, tests and records are lists of tables, whatever else they are."""
    wanted = "a TOML file that specifies a simulated campaign"
    content = parse_toml(toml_text(read_bytes(spec, LARGEST_TOML, wanted), spec), spec, wanted)
    top = Table(spec, "", content)
    for key in ("rigs", "tests"):
        for owner in top.tables(key):
            owner.text("name", "a name")
            owner.tables("records")
    return content


def _number(spec: Path, field: str, value: Any, *, low: float = 0.0) -> float:
    """Read a number from `low` to `LARGEST`; "200 Hz" and "40 s" are read too."""
    text = value.split() if isinstance(value, str) else []
    if len(text) == 2 and text[1] in ("Hz", "s"):
        try:
            value = float(text[0])
        except ValueError:
            value = None
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= LARGEST:
        raise InputError(spec, field, repr(value), f"a number of at least {low:g}, at most {LARGEST:g}")
    return float(value)


def _settings(spec: Path, content: dict[str, Any]) -> dict[str, float]:
    table = content.pop("simulation", None)
    if not isinstance(table, dict):
        raise InputError(spec, "simulation", repr(table), "a table [simulation] with sample_rate and the noise")
    for key in table:
        if key not in _SIMULATION:
            raise InputError(spec, f"simulation.{key}", "an unknown key", f"one of: {', '.join(_SIMULATION)}")
    return {key: _number(spec, f"simulation.{key}", table.get(key, default)) for key, default in _SIMULATION.items()}


def _truths(spec: Path, content: dict[str, Any]) -> list[dict[str, Any]]:
    found = []
    for i, test in enumerate(content.get("tests", [])):
        field = f"tests[{i}].truth"
        table = test.pop("truth", None)
        if not isinstance(table, dict) or not {"Y1", "epsilon"} <= set(table) <= set(_TRUTH):
            raise InputError(spec, field, repr(table), "truth = { Y1 = -6.3, epsilon = 0.038 }")
        truth: dict[str, Any] = {
            key: _number(spec, f"{field}.{key}", table.get(key, 0.0), low=-LARGEST) for key in ("Y1", "epsilon", "Y2")
        }
        truth["force"] = table.get("force", "paper")
        if truth["force"] not in FORCES:
            raise InputError(spec, f"{field}.force", repr(truth["force"]), f"one of: {', '.join(FORCES)}")
        found.append(truth)
    return found


def _disturbances(spec: Path, place: str, table: Any) -> dict[str, Any]:
    """Read fields of `Disturbances`: numbers, names of forms, true or false."""
    field = f"{place}.disturbances"
    if not isinstance(table, dict):
        raise InputError(spec, field, repr(table), "a table, disturbances = { friction = 0.5 }")
    defaults = {one.name: one.default for one in fields(Disturbances)}
    found: dict[str, Any] = {}
    for key, value in table.items():
        if key not in defaults:
            raise InputError(spec, f"{field}.{key}", "an unknown key", f"some of: {', '.join(defaults)}")
        if isinstance(defaults[key], float):
            found[key] = _number(spec, f"{field}.{key}", value, low=-LARGEST)
        elif isinstance(value, type(defaults[key])):
            found[key] = value
        else:
            raise InputError(spec, f"{field}.{key}", repr(value), f"a value such as {defaults[key]!r}")
    try:
        Disturbances(**found)
    except ValueError as error:
        raise InputError(spec, field, f"what cannot be ({error})", "values as the documentation lists them") from error
    return found


def _without_records(spec: Path, content: dict[str, Any], folder: Path) -> Campaign:
    """Let the campaign's own loader check everything but the records, and give the numbers in SI."""
    _write_toml(folder / "campaign.toml", content)
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
        "damping_ratio": _number(spec, f"rigs[{place}].true_damping_ratio", ratio),
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
    kept = {key: value for key, value in record.items() if key not in ("duration", "initial_amplitude", "disturbances")}
    own = _disturbances(spec, field, record.get("disturbances", {}))
    duration = _number(spec, f"{field}.duration", record.get("duration"))
    samples = duration * settings["sample_rate"]
    if not MIN_SAMPLES <= samples <= MOST_STEPS or duration * truth.frequency * STEPS_PER_CYCLE > MOST_STEPS:
        found = f"{samples:.4g} samples of {duration * truth.frequency:.4g} cycles"
        raise InputError(spec, f"{field}.duration", found, f"{MIN_SAMPLES} samples or more, and at most {MOST_STEPS:g}")
    amplitude = _number(spec, f"{field}.initial_amplitude", record.get("initial_amplitude"))
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
    _write_csv(folder / record["file"], time, response, truth)
    return kept


def _write_csv(path: Path, time: FloatArray, response: FloatArray, truth: Truth) -> None:
    """Six significant digits of the largest reading: finer than any sensor, and small files."""
    if truth.motion is Motion.TORSIONAL:
        header, values = "time [s],rotation [rad]", response
    else:
        header, values = "time [s],displacement [mm]", response * truth.depth * 1e3
    decimals = max(0, 5 - int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-12)))))
    stamps = max(4, int(np.ceil(-np.log10(time[1] - time[0]))) + 2)
    lines = [f"{t:.{stamps}f},{y:.{decimals}f}" for t, y in zip(time.tolist(), values.tolist(), strict=True)]
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8", newline="\n")


def _write_toml(path: Path, content: dict[str, Any]) -> None:
    import tomli_w

    path.write_text(tomli_w.dumps(content), encoding="utf-8", newline="\n")
