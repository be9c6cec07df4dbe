"""Model cards: the TOML files that name a law, its priors with a reason for each, likelihood, discrepancy, sampler."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

import tomli_w

from scruton.campaign.schema import Motion
from scruton.campaign.spelling import did_you_mean, show
from scruton.campaign.toml import Field, Table, Wording, anything, bare, is_number, read_toml, text, toml_text, valid
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.envelope.inspection import REGRESSION, SOURCES
from scruton.errors import InputError
from scruton.infer.thresholds import MOST_SAMPLED
from scruton.shown import shown
from scruton.stats.convergence import SamplerSettings
from scruton.stats.priors import FAMILIES, Prior

# Parameters that a card gives a prior, with the unit that it is in; some have a table for each motion. The program
# takes the number as it stands: a card that says another unit has a number that means another thing.
EXPONENT = "law_exponent"  # has a prior where the law is free, and only then
UNITS = {
    "stable_amplitude": "A/D or rad",  # one prior for both motions
    **dict.fromkeys(("relaxation_ratio", "amplitude_scatter", "noise_factor", "gust_scatter", "departure_scale"), "-"),
    "gust_time": "relaxation times",
    **dict.fromkeys(("set_point_scatter", "structural_damping"), "-"),
    "still_air_scatter": "-",
    "trial_amplitude": "largest amplitude of the record",
    "trial_slow_rate": "omega",
    "trial_rate_gap": "omega",
    "trial_residual": "largest amplitude of the record",
    "trial_residual_rate": "omega",
    "discrepancy_amplitude": "ln amplitude",
    "discrepancy_relaxation": "ln relaxation at zero damping",
    "speed_scale_amplitude": "ln amplitude",
    "speed_scale_relaxation": "ln relaxation at zero damping",
    "speed_length": "U/(f0 D)",
    "speed_shift": "ln U/(f0 D)",
    EXPONENT: "-",
}
# The same of the null model that unmodelled effects are weighed against: the tables [diagnosis.NAME].
NULL_UNITS = {
    "stable_amplitude": "amplitude at the end of the records",
    "aerodynamic_rate": "omega",
    **dict.fromkeys(("scatter", "phase_scatter", "still_air_scatter", "noise", "record_noise"), "-"),
    **dict.fromkeys(("detuning", "third", "third_noise", "gain", "correlation"), "-"),
    **dict.fromkeys(("stiffness", "stiffness_in_wind", "frequency_trend", "frequency_loss", "off_curve"), "-"),
    **{name: UNITS[name] for name in ("gust_scatter", "gust_time", "set_point_scatter")},
}
# Cards that were written before these were parameters say nothing of them, and have the shipped priors.
LATER = (
    *("gust_scatter", "gust_time", "set_point_scatter", "departure_scale"),
    *("frequency_trend", "frequency_loss", "off_curve", "record_noise", "correlation"),
)
UNITS_BY_MOTION = {"stable_amplitude.heaving": "A/D", "stable_amplitude.torsional": "rad"}
# Parameters that may have either sign; all others must be positive, and are sampled by their logarithm.
SIGNED = {
    *("trial_amplitude", "trial_slow_rate", EXPONENT, "detuning", "third", "gain"),
    *("stiffness", "stiffness_in_wind", "frequency_trend", "frequency_loss", "off_curve", "correlation"),
}
# Enters linearly and is integrated out, which only a normal prior allows.
LINEAR = "trial_amplitude"


def _facts(one: "ModelCard") -> Mapping[str, object]:
    return {"name": one.name, "title": one.title, "laws": ", ".join(f"n={n:g}" for n in one.laws)}


@shown(_facts)
@dataclass(frozen=True)
class ModelCard:
    """A model as its card states it.

    Attributes
    ----------
    name, title : str
    laws : tuple of float
        Exponents of the n-family that are weighed against each other, the reference law first; -1 is the paper's.
        Empty where n is free.
    law_weights : tuple of float
        Their prior probabilities.
    averaging : {"evidence", "stacking"}
        What weighs them.
    priors : mapping
        By parameter, or "parameter.motion" where heaving and torsional differ.
    envelope_source : {"regression", "front-end"}
        What the samplers are fed with: a regression of every cycle, or the amplitude of Eq. (3).
    initial_amplitude_sd : float
        Normal prior of each record's initial amplitude, A/D or rad.
    damping_relative_sd : float
        Relative uncertainty of a damping ratio that the laboratory states without any.
    sampler : SamplerSettings
    prior_none : float
        Prior probability that a campaign has no gap.
    null_priors : mapping
        Priors of the null model that effects are weighed against, by parameter.
    effect_weights : mapping
        Relative prior weight of unmodelled effects and of "unknown", where it is not 1; 0 leaves an effect out.
    reasons : mapping
        Why, for what is not a prior.
    text : str
        The card as it was written, below those that it extends.
    resolved : str
        All that it says, as one card in TOML that extends no other; without comments.
    """

    name: str
    title: str
    laws: tuple[float, ...]
    law_weights: tuple[float, ...]
    averaging: str
    priors: Mapping[str, Prior]
    envelope_source: str
    initial_amplitude_sd: float
    damping_relative_sd: float
    sampler: SamplerSettings
    prior_none: float
    effect_weights: Mapping[str, float]
    null_priors: Mapping[str, Prior]
    reasons: Mapping[str, str]
    text: str
    resolved: str

    def prior(self, name: str, motion: Motion) -> Prior:
        """Return the prior of a parameter, for this motion."""
        return self.priors.get(name) or self.priors[f"{name}.{motion.value}"]

    @property
    def law_n(self) -> float | None:
        """Exponent of the reference law; None where n is free."""
        return self.laws[0] if self.laws else None

    @property
    def exponent(self) -> Prior | None:
        """Prior of n where it is free."""
        return None if self.laws else self.priors[EXPONENT]

    @property
    def sha256(self) -> str:
        """Digest of the card's text."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def shipped_cards() -> dict[str, Path]:
    """Return the cards that come with the package, by name."""
    paths = (Path(str(file)) for file in sorted((files("scruton") / "models").iterdir(), key=str))
    return {file.stem: file for file in paths if file.name.endswith(".toml")}


def load_card(name_or_path: str | Path = "default") -> ModelCard:
    """Read a model card, by the name of a shipped one or by its path.

    Raises
    ------
    InputError
        If there is no such card, or it does not say what a card must.
    """
    shipped = shipped_cards()
    path = shipped.get(str(name_or_path), Path(name_or_path))
    if not path.exists():
        raise InputError(path, "", "no such model card", f"the path of a card, or one of: {', '.join(shipped)}")
    table, content = _read(path, shipped, ())
    # Cards are read by people who know Python: values are shown as it shows them.
    return _card(Table(path, "", table, Wording(repr, "an unknown key", did_you_mean)), content)


def _read(path: Path, shipped: Mapping[str, Path], seen: tuple[Path, ...]) -> tuple[dict[str, Any], str]:
    """Table and text of a card; of one that extends another, both texts and the tables merged."""
    data, table = read_toml(path, "a model card such as the shipped default.toml")
    content = toml_text(data, path)
    if "extends" not in table:
        return table, content
    name = str(table.pop("extends"))
    base = shipped.get(name, path.parent / name)
    if "\0" in name or not base.is_file() or base in (*seen, path):
        raise InputError(path, "extends", repr(name), f"another card's path, or one of: {', '.join(shipped)}")
    below, base_content = _read(base, shipped, (*seen, path))
    return _merge(below, table), f"{base_content}\n# ---- extended by {path.name}\n{content}"


def _merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Values of `over` where it has any; a prior that names its family replaces the other whole."""
    merged = dict(base)
    for key, value in over.items():
        whole = not isinstance(value, dict) or not isinstance(merged.get(key), dict) or "family" in value
        merged[key] = value if whole else _merge(merged[key], value)
    return merged


def _whole(table: Table, key: str) -> int:
    value = bare(0.0, MOST_SAMPLED).read(table, key)
    if value != int(value):
        raise table.error(key, repr(float(value)), "a whole number")
    return int(value)


_AVERAGING = ("evidence", "stacking")
_SOURCES = tuple(SOURCES)
_SECTIONS = {
    "law": {
        "n": anything(),
        "prior_weights": anything(),
        "averaging": valid(lambda name: name in _AVERAGING, f"one of: {', '.join(_AVERAGING)}", _AVERAGING[0]),
        "reason": anything(),
    },
    "envelope": {
        "source": valid(lambda name: name in _SOURCES, f"one of: {', '.join(_SOURCES)}", REGRESSION),
        "reason": anything(),
    },
    "likelihood": {
        "kind": valid(lambda kind: kind == "state-space", 'kind = "state-space"'),
        "initial_amplitude_sd": bare(low=1e-6),
    },
    "structural_damping": {"relative_sd": bare(1e-6, 2.0), "reason": anything()},
    "sampler": {
        field.name: Field(_whole, field.default) if field.type is int else bare(0.0, MOST_SAMPLED, field.default)
        for field in fields(SamplerSettings)
    },
    "effects": {"prior_none": bare(0.01, 0.99, 0.5), "weights": anything(), "reason": anything()},
}
_WEIGHTS = {name: bare(0.0, 1e6, None) for name in (*CATALOGUE, UNKNOWN.name)}
_SMALLEST = {"ensembles": 2, "walkers": 14, "draws": 8, "max_steps": 100}


def _section(table: Table, key: str) -> Table:
    return table.inner(key, f"a table [{table.at(key)}]", absent="nothing")


def _card(top: Table, content: str) -> ModelCard:
    top.check_keys(("format", "name", "title", "law", "priors", *list(_SECTIONS)[1:], "diagnosis"))
    valid(lambda version: version == 1, "format = 1").read(top, "format")
    likelihood = _section(top, "likelihood").read(_SECTIONS["likelihood"])
    damping, law = _section(top, "structural_damping"), _section(top, "law")
    relative_sd = damping.read(_SECTIONS["structural_damping"])["relative_sd"]
    laws, law_weights, averaging = _laws(law)
    prior_none, effect_weights = 0.5, {}
    if "effects" in top:
        effects = _section(top, "effects")
        prior_none = effects.read(_SECTIONS["effects"])["prior_none"]
        if "weights" in effects:
            stated = _section(effects, "weights")
            weights = stated.read(_WEIGHTS)
            effect_weights = {name: weights[name] for name in stated.values}
            if all(effect_weights.get(name) == 0.0 for name in CATALOGUE):
                raise effects.refusal("weights", "an effect of the catalogue at least whose weight is not 0")
    return ModelCard(
        name=text("a text", top.file.stem, blank=True).read(top, "name"),
        title=text("a text", "", blank=True).read(top, "title"),
        laws=laws,
        law_weights=law_weights,
        averaging=averaging,
        priors=_priors(_section(top, "priors"), UNITS, left_out=(EXPONENT,) if laws else ()),
        envelope_source=top.table("envelope").read(_SECTIONS["envelope"])["source"],
        initial_amplitude_sd=likelihood["initial_amplitude_sd"],
        damping_relative_sd=relative_sd,
        sampler=_sampler(_section(top, "sampler")),
        prior_none=prior_none,
        effect_weights=effect_weights,
        # A card that extends none may leave the null model out, and has the shipped one.
        null_priors=_priors(_section(top, "diagnosis"), NULL_UNITS) if "diagnosis" in top else load_card().null_priors,
        reasons={table.field: str(table.values.get("reason", "")) for table in (law, damping)},
        text=content,
        resolved=tomli_w.dumps(dict(top.values)),
    )


def _laws(table: Table) -> tuple[tuple[float, ...], tuple[float, ...], str]:
    """Exponents, prior weights and averaging; no exponents where n is free."""
    values = table.read(_SECTIONS["law"])
    n = values["n"]
    if n == "free":
        return (), (), values["averaging"]
    several = n if isinstance(n, list) and n else [n]
    for exponent in several:
        if not is_number(exponent) or not -2.0 <= exponent <= 12.0:
            raise table.refusal("n", 'a number from -2 to 12, a list of such numbers, or "free"')
    if len(set(several)) < len(several):
        raise table.refusal("n", "every law once")
    weights = table.values.get("prior_weights", [1.0 / len(several)] * len(several))
    good = isinstance(weights, list) and len(weights) == len(several)
    if not good or not all(is_number(weight) and weight > 0 for weight in weights):
        raise table.refusal("prior_weights", f"{len(several)} positive numbers")
    total = float(sum(weights))
    return tuple(map(float, several)), tuple(float(weight) / total for weight in weights), values["averaging"]


def _priors(table: Table, units: Mapping[str, str], left_out: tuple[str, ...] = ()) -> dict[str, Prior]:
    """Priors of the parameters in `units`; those of the null model are one for both motions, and have no bounds."""
    table.check_keys(units)
    priors: dict[str, Prior] = {}
    for name in units:
        if name in left_out:
            continue
        if name in LATER and name not in table:
            shipped = load_card()
            priors[name] = (shipped.null_priors if units is NULL_UNITS else shipped.priors)[name]
            continue
        entry = table.inner(name, f"a table [{table.at(name)}]")
        if "family" in entry or units is NULL_UNITS:
            priors[name] = _prior(name, entry, units[name])
            if units is NULL_UNITS and priors[name].family.endswith("uniform"):
                raise entry.refusal("family", "normal or lognormal")
            continue
        for motion in Motion:
            by_motion = entry.inner(motion, f"a table [{entry.at(motion)}]")
            priors[f"{name}.{motion}"] = _prior(name, by_motion, UNITS_BY_MOTION.get(f"{name}.{motion}", units[name]))
    return priors


def _prior(name: str, table: Table, wanted: str) -> Prior:
    family = table.values.get("family")
    allowed = [candidate for candidate, (_, logarithmic) in FAMILIES.items() if logarithmic == (name not in SIGNED)]
    allowed = ["normal"] if name == LINEAR else allowed
    if family not in allowed:
        raise table.refusal("family", f"one of: {', '.join(allowed)}")
    (first, second), _ = FAMILIES[family]
    table.check_keys(("family", first, second, "unit", "reason"))
    for key in ("unit", "reason"):
        value = table.values.get(key)
        if not isinstance(value, str) or not value.strip():
            raise table.error(key, show(value) if value else "nothing", f"a {key}: every prior says its {key}")
    unit, reason = table.values["unit"], table.values["reason"]
    if " ".join(unit.split()) not in (wanted, *wanted.split(" or ")):
        raise table.error("unit", f'"{unit}"', f'unit = "{wanted}", the one that {name} is in')
    numbers = [bare().read(table, key) for key in (first, second)]
    try:
        return Prior(name, family, numbers[0], numbers[1], unit, reason)
    except ValueError as error:
        raise InputError(table.file, table.field, str(error), "numbers that make a distribution") from error


def _sampler(table: Table) -> SamplerSettings:
    settings = SamplerSettings(**table.read(_SECTIONS["sampler"]))
    for name, low in _SMALLEST.items():
        if getattr(settings, name) < low:
            raise table.error(name, str(getattr(settings, name)), f"at least {low}")
    if settings.draws > settings.max_steps // 2:
        raise table.error("draws", str(settings.draws), "at most half of max_steps")
    if settings.differential_evolution + settings.stretch <= 0:
        raise table.error("stretch", "0", "some differential evolution or stretch beside the independence move")
    return settings
