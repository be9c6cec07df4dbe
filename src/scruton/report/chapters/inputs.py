"""Every input, of the campaign and of the bridge, as stated or by default, with its source."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from scruton.campaign.schema import Quantity
from scruton.report.chapters.material import Material
from scruton.report.conventions import DAMPING, damping_words, shown_in, with_unit
from scruton.report.document import Table
from scruton.report.wording import number, stated
from scruton.sizing.limits import limit
from scruton.sizing.limits.rule import limit_words

_HEADER = ("input", "value", "stated or default", "source")
# Units of numbers in SI, by the last of their names; none where it is not here.
_UNITS = {
    "frequency": "Hz", "mass": "kg/m", "inertia": "kg m²/m", "width": "m", "depth": "m", "air_density": "kg/m³",
    "largest_stroke": "m", "lever_arm": "m", "end_stop": "m", "start_acceleration": "m/s²", "length": "m",
    "weibull_scale": "m/s", "damping_ratio": DAMPING,
}  # fmt: skip
# Keys that say little without their table.
_KEYS = {
    "risk_of": "the risk is that of", "stop_stiffness": "stiffness of the end stops over that of the spring",
    "per_kg": "cost per kg", "per_percent": "cost per % of damping", "beta": "correction βₜ of turbulence",
    "kept_detuning": "detuning for which the risk is kept",
}  # fmt: skip
_PARTS = ("mean", "sd", "family", "minimum")
Row = tuple[str, str, str, str]


def inputs_table(material: Material) -> Table:
    """One table of them all."""
    of_bridge = dict.fromkeys(row for content in material.sizings for row in _of_bridge(content))
    rows = [*_of_campaign(material), *of_bridge]
    note = "Numbers of the model card, each with its reason, are those of the card below."
    return Table("inputs", "Inputs, stated or by default", _HEADER, rows, note, (False, False, False, False))


def _of_campaign(material: Material) -> Iterator[Row]:
    campaign, card = material.fit.campaign, material.fit.card
    file, relative = "campaign.toml", card.damping_relative_sd
    mass = "mass" if material.heaving else "inertia"
    for key in ("width", "depth"):
        yield f"section, {key}", _value(getattr(campaign.section, key), key), "stated", file
    for rig in campaign.rigs:
        for key, quantity in ((mass, rig.mass), ("frequency", rig.frequency), ("damping_ratio", rig.damping_ratio)):
            if quantity is None:
                continue
            origin, source, shown = "stated", file, quantity
            if key == "damping_ratio" and quantity.sd is None:
                origin, shown = "stated; sd by default", quantity.or_relative_sd(relative)
                source = f"{file}; sd of the model card, {100.0 * relative:g} %"
            yield f"rig {rig.name}, {_words(key)}", _quantity(shown, key), origin, source
    for test in campaign.tests:
        for key, unit in (("air_density", "air_density"), ("wind_speed", "weibull_scale")):
            yield f"test {test.name}, {_words(key)}", _quantity(getattr(test, key), unit), "stated", file


def _quantity(quantity: Quantity, key: str) -> str:
    return _value(quantity.mean, key, quantity.sd)


def _value(value: Any, key: str, sd: float | None = None) -> str:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return str(value)
    unit = _UNITS.get(key, "")
    factor, unit = shown_in(unit) if unit == DAMPING else (1.0, unit)
    text = stated(factor * value) + (f" ± {number(factor * sd, 2)}" if sd else "")
    return with_unit(text, unit)


def _words(key: str) -> str:
    return damping_words() if key == "damping_ratio" else _KEYS.get(key, key.replace("_", " "))


def _of_bridge(sizing: Mapping[str, Any]) -> Iterator[Row]:
    """The numbers of a bridge, a row each; mean, standard deviation and family of one together."""
    found: dict[str, dict[str, Mapping[str, Any]]] = {}
    for one in sizing.get("inputs", {}).get("numbers", ()):
        stem, _, last = one["name"].rpartition(".")
        name, part = (stem, last) if last in _PARTS and stem else (one["name"], "mean")
        found.setdefault(name, {})[part] = one
    modes = [mode["name"] for mode in sizing.get("modes", ())]
    for name, parts in found.items():
        main = parts.get("mean") or next(iter(parts.values()))
        key = name.rpartition(".")[2]
        number_of = main["value"]
        if main["origin"] == "default" and isinstance(number_of, float):  # computed, as a mean of a median and a cov
            number_of = float(f"{number_of:.4g}")
        value = _value(number_of, key, parts["sd"]["value"] if "sd" in parts else None)
        if "family" in parts:
            value += f", {parts['family']['value']}"
        default = [part for part, one in parts.items() if one["origin"] == "default"]
        others = [one["origin"] for one in parts.values() if one["origin"] != "default"]
        origin = others[0] if others else "default"
        if others and default:
            origin += f"; {' and '.join(default)} by default"
        sources = dict.fromkeys(one["source"] for one in parts.values() if one["source"])
        source = "; ".join(sources) or "bridge.toml"
        if name.startswith("limits["):
            value = limit_words(number_of, limit(number_of).rule.title)
            value, source = (text.replace("^2", "²") for text in (value, source))
        yield _name(name, modes), value, origin, source


def _name(name: str, modes: list[str]) -> str:
    """A place in bridge.toml in words: "modes[0].mass" is "mode V1, mass"."""
    if name.startswith("program."):
        return name.replace(".", ", ").replace("_", " ")
    if place := re.match(r"limits\[(\d+)\]$", name):
        return f"bridge, limit {int(place[1]) + 1}"
    place = re.match(r"modes\[(\d+)\]\.", name)
    words = [_words(part) for part in name[place.end() if place else 0 :].split(".")]
    if place:
        index = int(place[1])
        words.insert(0, f"mode {modes[index] if index < len(modes) else index + 1}")
    return ", ".join(["bridge", *words] if not place else words)
