"""`bridge.toml`: the bridge that the section model stands for, its modes, limits, wind and costs."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.bounded import read_bytes
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.campaign.spelling import show
from scruton.campaign.thresholds import LARGEST_TABLE, LARGEST_TOML
from scruton.campaign.toml import Field, Table, anything, flag, is_number, number, parse_toml, text, whole
from scruton.campaign.units import DENSITY, FREQUENCY, INERTIA, LENGTH, MASS, Dimension
from scruton.errors import InputError
from scruton.griffin.posterior import names_of
from scruton.shown import fields_in_brief, shown
from scruton.sizing.damper_request import DamperRequest, RiskOf, read_damper
from scruton.sizing.limits import Limit, limit
from scruton.sizing.mode_shape import ModeShape, read_shape, sine, uniform
from scruton.sizing.number_table import read_table
from scruton.sizing.stated import uncertain as _uncertain
from scruton.sizing.thresholds import DAMPING_COV, DAMPING_TEST_COV, FREQUENCY_COV, MEASURED_FREQUENCY_COV
from scruton.sizing.transfer import Transfer, amplitude_of_coherence, read_transfer
from scruton.sizing.wind import Wind, read_wind

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 1
AIR_DENSITY = 1.225  # kg/m^3, sea level, 15 degrees
# Steel box girders: median 0.3 %, as measured on one suspension bridge's modes and as designs assume.
DAMPING = Quantity(0.003 * float(np.sqrt(1.0 + DAMPING_COV**2)), 0.003 * DAMPING_COV * 1.0966, minimum=0.001)
_SHARE = Dimension("a bare number", "", 0.5)


@dataclass(frozen=True)
class Given:
    """Where a quantity of a mode is from, if not from its own place in bridge.toml.

    Attributes
    ----------
    origin : str
        "command line" or "identified".
    source : str
        The option as it was written; or the field of the mode that says it.
    spread : bool or None
        Whether its standard deviation was stated with the option; None where it is for the field to say.
    """

    origin: str
    source: str
    spread: bool | None = None


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Mode:
    """One mode of the bridge: its name, shape and structural damping ratio, and what is not plain.

    Attributes
    ----------
    frequency : Quantity
        [Hz]; its spread is what a damper's tuning has to live with.  As identified, where it was, as the damping.
    mass : Quantity or None
        Equivalent mass m [kg/m], or inertia [kg m^2/m] for torsion; None: the mass ratio of the section model.
    modal_mass : float or None
        Generalised mass for a shape of largest value 1 [kg], or [kg m^2]; dampers of stated mass need it.
    lock_in : (float, float) or None
        Reduced velocities U/(fD) between which the mode locks in.
    modal_mass_cov : float or None
        Coefficient of variation of the modal mass, where it is stated; None: it varies as `mass`, if that does.
    designed : (Quantity, Quantity) or None
        Frequency and damping ratio that were assumed before either was identified on the bridge.
    lock_in_shape : (2, N) array or None
        Reduced velocities, rising, and amplitudes there, in any unit.
    length : float or None
        Of the span [m], where it is stated.
    half_waves : int or None
        Of a sine.
    given : mapping
        What is not from its own place in bridge.toml: "frequency", "damping_ratio", "designed[1]".
    """

    name: str
    frequency: Quantity
    mass: Quantity | None = None
    modal_mass: float | None = None
    shape: ModeShape = field(default_factory=sine)
    damping_ratio: Quantity = DAMPING
    lock_in: tuple[float, float] | None = None
    modal_mass_cov: float | None = None
    designed: tuple[Quantity, Quantity] | None = None
    lock_in_shape: FloatArray | None = None
    length: float | None = None
    half_waves: int | None = None
    given: Mapping[str, Given] = field(default_factory=dict)


@dataclass(frozen=True)
class Cost:
    """Costs in one currency.

    Attributes
    ----------
    fixed, per_kg, per_percent : float
        Of any damper at all, of its mass, and of one percentage point of added damping where that is what is bought.
    failure : float
        Of a bridge that exceeds its limit.
    """

    currency: str = ""
    fixed: float = 0.0
    per_kg: float = 0.0
    per_percent: float = 0.0
    failure: float = 0.0


def _facts(one: "Bridge") -> Mapping[str, object]:
    return {
        "title": one.title, "motion": one.motion.value, "modes": ", ".join(mode.name for mode in one.modes),
        "limits": ", ".join(limit.text for limit in one.limits),
    }  # fmt: skip


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Bridge:
    """A bridge of one cross-section.

    Attributes
    ----------
    coherence : Quantity
        Factor of the amplitude for force that is not coherent along the span.
    coherence_amplitude : Quantity or None
        A_c, A/D or rad: strips that move by A feel 1 - exp(-A/A_c) of the drive.
    transfer : Transfer or None
        Factors of the amplitude between tunnel and site; None: none, as for the section model itself.
    sha256, documents : mapping
        Digest and text of bridge.toml and of every file that it names.
    others : tuple of str
        Modes of the other motion in the same file, which another fit sizes.
    """

    title: str
    motion: Motion
    width: float
    depth: float
    air_density: float
    coherence: Quantity
    limits: tuple[Limit, ...]
    modes: tuple[Mode, ...]
    wind: Wind | None = None
    coherence_amplitude: Quantity | None = None
    transfer: Transfer | None = None
    damper: DamperRequest = field(default_factory=DamperRequest)
    cost: Cost | None = None
    sha256: Mapping[str, str] = field(default_factory=dict)
    documents: Mapping[str, str] = field(default_factory=dict)
    others: tuple[str, ...] = ()


def load_bridge(path: Path, motion: Motion) -> Bridge:
    """Read a `bridge.toml`.

    Parameters
    ----------
    path : Path
        The file, or the folder that holds a bridge.toml.
    motion : Motion
        Of the section model, and so of the modes: where some state the one and some the other motion, only those of
        this one are read, with the limits that speak of it.

    Raises
    ------
    InputError
        Whatever is wrong with the file.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "bridge.toml"
    data = read_bytes(path, LARGEST_TOML, "a bridge.toml")
    digests = {path.name: sha256(data).hexdigest()}
    top = Table(path, "", parse_toml(data, path))
    top.check_keys(_TOP)
    top.check_format(FORMAT)
    tables = top.tables("modes")
    of = [table.choice("motion", list(Motion)) if "motion" in table else "" for table in tables]
    both = motion.value in of and len(set(of) - {""}) > 1
    if both and "" in of:
        raise tables[of.index("")].error("motion", "nothing", "heaving or torsional: this bridge has modes of both")
    modes = tuple(
        _mode(table, motion, digests) for table, its in zip(tables, of, strict=True) if not both or its == motion.value
    )
    if not modes:
        raise top.error("modes", "nothing", "at least one [[modes]]")
    others = tuple(
        table.text("name", "a name") for table, its in zip(tables, of, strict=True) if both and its != motion
    )
    names = [*(mode.name for mode in modes), *others]
    if len(set(names)) < len(names):
        raise top.error("modes", f'the name "{max(names, key=names.count)}" twice', "a name of its own for each mode")
    values = {key: field.read(top, key) for key, field in _TOP.items()}
    wind = read_wind(top.table("wind"), motion, values["width"], values["depth"], digests) if "wind" in top else None
    damper = top.table("damper")
    request = read_damper(damper)
    if unknown := set(request.positions) - {"", *names}:
        raise damper.error("position", f'a mode "{min(unknown)}"', f"one of: {', '.join(names)}")
    for i, mode in enumerate(modes if request.risk_of is RiskOf.ANY else ()):
        if mode.modal_mass is None:
            wanted = 'a mass and a length, or a modal_mass: damper.risk_of = "any" counts each damper in every mode'
            raise InputError(path, f"modes[{i}]", "no modal mass", wanted)
    if "lever_arm" in damper and motion is Motion.HEAVING and not both:
        raise damper.error("lever_arm", "a lever arm against heaving", "none: it is that of dampers against torsion")
    values |= {"title": values["title"] or path.resolve().parent.name, "modes": modes, "wind": wind, "damper": request}
    if both:
        values["limits"] = tuple(rule for rule in values["limits"] if motion in rule.rule.functions)
        values["others"] = others
    for i, rule in enumerate(values["limits"]):
        rule.check(motion, str(path), f"limits[{i}]")
    values["transfer"] = read_transfer(top)
    values["coherence_amplitude"] = amplitude_of_coherence(top, motion, values["depth"], both=both)
    values["cost"] = Cost(**top.table("cost").read(_COST)) if "cost" in top else None
    del values["format"]
    texts = {
        name: read_bytes(path.parent / name, LARGEST_TABLE).decode("utf-8-sig", errors="replace") for name in digests
    }
    return Bridge(**values, motion=motion, sha256=digests, documents=texts)


def stand_in(tree: "xr.DataTree", motion: Motion, rig: str) -> Bridge:
    """The section model itself as a bridge, for an answer before there is one: its depth, frequency and mass ratio."""
    data = tree["constant_data"]
    frequency = float(data["frequency"].to_numpy()[names_of(data["rig"]).index(rig)])
    mode = Mode("section", Quantity(frequency), shape=uniform())
    return Bridge(
        "the section model itself", motion, float(data["width"]), float(data["depth"]), AIR_DENSITY, Quantity(1.0), (),
        (mode,),
    )  # fmt: skip


def _mode(table: Table, motion: Motion, digests: dict[str, str]) -> Mode:
    table.check_keys(_MODE)
    if "motion" in table and table.choice("motion", list(Motion)) != motion.value:
        raise table.error("motion", show(table.values["motion"]), f'"{motion.value}", the motion of the section model')
    key, other, dimension = ("mass", "inertia", MASS) if motion is Motion.HEAVING else ("inertia", "mass", INERTIA)
    if other in table:
        raise table.error(other, f"{other}, for a {motion.value} mode", key)
    name, half_waves = text('a name: "sine", "uniform" or a CSV file', "sine").read(table, "shape"), None
    if name == "sine":
        half_waves = whole(1, 100, 1).read(table, "half_waves")
        shape = sine(half_waves)
    elif "half_waves" in table:
        raise table.refusal("half_waves", 'none: it belongs to shape = "sine"')
    elif name == "uniform":
        shape = uniform()
    else:
        shape = replace(read_shape(table.file.parent / name), name=name)
        digests[name] = sha256(read_bytes(table.file.parent / name, LARGEST_TABLE)).hexdigest()
    mass = _uncertain(table, key, dimension) if key in table else None
    values = {key: field.read(table, key) for key, field in _MODE.items()}
    length = table.number("length", LENGTH) if "length" in table else None
    modal, spread = values["modal_mass"], None
    if modal is not None:
        modal, spread = modal.mean, modal.relative_sd if modal.sd is not None else None
    elif length is not None and mass is not None:
        modal = mass.mean * length * shape.integral(2.0)
    mode = Mode(
        values["name"], values["frequency"], mass, modal, shape, values["damping_ratio"], values["lock_in"], spread,
        lock_in_shape=_lock_in_shape(table, digests) if "lock_in_shape" in table else None,
        length=length, half_waves=half_waves,
    )  # fmt: skip
    return identified(mode, values["identified_frequency"], values["identified_damping_ratio"])


def identified(
    mode: Mode, frequency: Quantity | None, damping_ratio: Quantity | None, option: str | None = None
) -> Mode:
    """The mode as it was identified on the bridge, which takes the place of what was assumed of it.

    `option` says it on the command line; None: fields of bridge.toml do.
    """
    said = {"frequency": frequency, "damping_ratio": damping_ratio}
    given = {
        key: Given("identified", option or f"identified_{key}", quantity.sd is not None if option else None)
        for key, quantity in said.items()
        if quantity is not None
    }
    if not given:
        return mode
    if mode.designed is None and "damping_ratio" in mode.given:
        given = {"designed[1]": mode.given["damping_ratio"]} | given
    found, damping = frequency or mode.frequency, damping_ratio or mode.damping_ratio
    return replace(
        mode, frequency=found.or_relative_sd(MEASURED_FREQUENCY_COV),
        damping_ratio=damping.or_relative_sd(DAMPING_TEST_COV),
        designed=mode.designed or (mode.frequency, mode.damping_ratio), given={**mode.given, **given},
    )  # fmt: skip


def with_damping(bridge: "Bridge", damping_ratio: Quantity, option: str) -> "Bridge":
    """The bridge with a damping ratio of the command line in every mode; 45 % where no uncertainty is stated."""
    given = Given("command line", option, damping_ratio.sd is not None)
    modes = tuple(
        replace(
            mode, damping_ratio=damping_ratio.or_relative_sd(DAMPING_COV), given={**mode.given, "damping_ratio": given}
        )
        for mode in bridge.modes
    )
    return replace(bridge, modes=modes)


def _lock_in_shape(table: Table, digests: dict[str, str]) -> FloatArray:
    name = table.text("lock_in_shape", "a CSV file")
    path, wanted = table.file.parent / name, "one header line, then reduced velocity and amplitude, velocities rising"
    rows = read_table(path, wanted)
    usable = rows.shape[1] == 2 and len(rows) > 1 and np.isfinite(rows).all() and (rows >= 0.0).all()
    if not usable or not (np.diff(rows[:, 0]) > 0.0).all() or not rows[:, 1].max() > 0.0:
        found = f"rows of {rows.shape[1]} columns, numbers below zero, or velocities that do not rise"
        raise InputError(path, "", found, wanted)
    digests[name] = sha256(read_bytes(path, LARGEST_TABLE)).hexdigest()
    return np.asarray(rows.T)


def _pair(table: Table, key: str) -> tuple[float, float]:
    value = table.values[key]
    wanted = f"two rising numbers U/(fD), such as {key} = [8.0, 11.0]"
    if not isinstance(value, list) or len(value) != 2 or not all(map(is_number, value)):
        raise table.refusal(key, wanted)
    low, high = (float(speed) for speed in value)
    if not 0.0 <= low < high < np.inf:
        raise table.error(key, f"[{low:g}, {high:g}]", wanted)
    return low, high


def _limits(table: Table, key: str) -> tuple[Limit, ...]:
    texts = table.values[key]
    if not isinstance(texts, list) or not all(isinstance(rule, str) for rule in texts):
        raise table.refusal(key, 'a list of limits, such as limits = ["jtg", "0.1 m"]')
    return tuple(limit(rule, str(table.file), f"limits[{i}]") for i, rule in enumerate(texts))


_DAMPING_RATIO = Dimension("a damping ratio, a bare number", "", 0.003)
_MONEY = Dimension("an amount of money, a bare number", "", 1e6, positive=False, largest=1e15)
_AMOUNT = number(_MONEY, 0.0, good=lambda amount: amount >= 0.0, wanted="an amount of zero or more")

_TOP = {
    "format": anything(),
    "title": text(default=""),
    "width": number(LENGTH),
    "depth": number(LENGTH),
    "air_density": number(DENSITY, AIR_DENSITY),
    "coherence": Field(lambda table, key: _uncertain(table, key, _SHARE, family="beta"), Quantity(1.0)),
    "limits": Field(_limits, ()),
    **dict.fromkeys(("modes", "wind", "damper", "cost", "transfer", "coherence_amplitude"), anything()),
}
_MODE = {
    "name": text("a name"),
    "motion": anything(),
    "measured": flag(False),
    "frequency": Field(
        lambda table, key: _uncertain(
            table, key, FREQUENCY, MEASURED_FREQUENCY_COV if table.values.get("measured") is True else FREQUENCY_COV
        )
    ),
    "identified_frequency": Field(lambda table, key: _uncertain(table, key, FREQUENCY, MEASURED_FREQUENCY_COV), None),
    "identified_damping_ratio": Field(
        lambda table, key: _uncertain(table, key, _DAMPING_RATIO, DAMPING_TEST_COV), None
    ),
    **dict.fromkeys(("mass", "inertia", "length"), anything()),
    "modal_mass": Field(lambda table, key: table.quantity(key, Dimension("a modal mass", "kg", 2e6)), None),
    "shape": anything(),
    "half_waves": anything(),
    "damping_ratio": Field(lambda table, key: _uncertain(table, key, _DAMPING_RATIO, DAMPING_COV), DAMPING),
    "lock_in": Field(_pair, None),
    "lock_in_shape": anything(),
}
_COST = {
    "currency": text(default="", blank=True),
    **dict.fromkeys(("fixed", "per_kg", "per_percent", "failure"), _AMOUNT),
}
