"""Model cards: the TOML files that name a law, its priors with a reason for each, likelihood, discrepancy, sampler."""

import difflib
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

from scruton.campaign.bounded import LARGEST_TOML, parse_toml, read_bytes, toml_text
from scruton.campaign.schema import Motion
from scruton.campaign.units import show
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.errors import InputError
from scruton.stats.priors import FAMILIES, Prior
from scruton.stats.settings import SamplerSettings

# Parameters that a card gives a prior; those that depend on the motion have one table each.
PRIOR_NAMES = (
    "stable_amplitude",
    "relaxation_ratio",
    "amplitude_scatter",
    "noise_factor",
    "structural_damping",
    "still_air_scatter",
    "trial_amplitude",
    "trial_slow_rate",
    "trial_rate_gap",
    "trial_residual",
    "trial_residual_rate",
    "discrepancy_amplitude",
    "discrepancy_relaxation",
    "speed_scale_amplitude",
    "speed_scale_relaxation",
    "speed_length",
    "speed_shift",
)
# Of the null model that unmodelled effects are weighed against: the tables [diagnosis.NAME].
NULL_PRIOR_NAMES = (
    "stable_amplitude",
    "aerodynamic_rate",
    "scatter",
    "phase_scatter",
    "still_air_scatter",
    "noise",
    "detuning",
    "third",
    "third_noise",
    "stiffness",
    "stiffness_in_wind",
    "gain",
)
EXPONENT = "law_exponent"  # has a prior where the law is free, and only then
AVERAGING = ("evidence", "stacking")

# The unit that each prior is in. The program takes the number as it stands: a card that says another unit has a number
# that means another thing.
UNITS = {
    "stable_amplitude": "A/D or rad",  # one prior for both motions
    "stable_amplitude.heaving": "A/D",
    "stable_amplitude.torsional": "rad",
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
    "diagnosis.stable_amplitude": "amplitude at the end of the records",
    "diagnosis.aerodynamic_rate": "omega",
}
BARE = "-"  # of every other
MOST_SAMPLED = 1e7  # of walkers, draws, steps and the like: beyond, memory and patience end

# Parameters that may have either sign.
SIGNED = (
    "trial_amplitude",
    "trial_slow_rate",
    EXPONENT,
    *(f"diagnosis.{name}" for name in ("detuning", "third", "stiffness", "stiffness_in_wind", "gain")),
)


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
    folder = files("scruton") / "models"
    return {
        Path(str(one)).stem: Path(str(one)) for one in sorted(folder.iterdir(), key=str) if str(one).endswith(".toml")
    }


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
    table, text = _read(path, shipped, ())
    return _Reader(path).card(table, text)


def _read(path: Path, shipped: Mapping[str, Path], seen: tuple[Path, ...]) -> tuple[dict[str, Any], str]:
    """Table and text of a card; of one that extends another, both texts and the tables merged."""
    wanted = "a model card such as the shipped default.toml"
    text = toml_text(read_bytes(path, LARGEST_TOML, wanted), path)
    table = parse_toml(text, path, wanted)
    if "extends" not in table:
        return table, text
    name = str(table.pop("extends"))
    base = shipped.get(name, path.parent / name)
    if "\0" in name or not base.is_file() or base in (*seen, path):
        raise InputError(path, "extends", repr(name), f"another card's path, or one of: {', '.join(shipped)}")
    below, base_text = _read(base, shipped, (*seen, path))
    return _merge(below, table), f"{base_text}\n# ---- extended by {path.name}\n{text}"


def _merge(base: dict[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Values of `over` where it has any; a prior that names its family replaces the other whole."""
    found = dict(base)
    for key, value in over.items():
        whole = not isinstance(value, dict) or not isinstance(found.get(key), dict) or "family" in value
        found[key] = value if whole else _merge(found[key], value)
    return found


def _toml(table: Mapping[str, Any]) -> str:
    import tomli_w

    return tomli_w.dumps(table)


class _Reader:
    """Turns the table of a card into a ModelCard; every complaint names the file and the field."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def card(self, table: dict[str, Any], text: str) -> ModelCard:
        sections = (
            "format",
            "name",
            "title",
            "law",
            "priors",
            "likelihood",
            "structural_damping",
            "sampler",
            "effects",
            "diagnosis",
        )
        self.known("", table, sections)
        if table.get("format") != 1:
            raise InputError(self.path, "format", repr(table.get("format")), "format = 1")
        likelihood = self.table(table, "likelihood", ("kind", "initial_amplitude_sd"))
        if likelihood.get("kind") != "state-space":
            raise InputError(self.path, "likelihood.kind", repr(likelihood.get("kind")), 'kind = "state-space"')
        damping = self.table(table, "structural_damping", ("relative_sd", "reason"))
        laws, weights, averaging = self.law(self.table(table, "law", ("n", "prior_weights", "averaging", "reason")))
        prior_none, effect_weights = self.effects(table)
        names = PRIOR_NAMES if laws else (*PRIOR_NAMES, EXPONENT)
        return ModelCard(
            name=self.text(table, "name", self.path.stem),
            title=self.text(table, "title", ""),
            laws=laws,
            law_weights=weights,
            averaging=averaging,
            priors=self.priors(self.table(table, "priors", (*PRIOR_NAMES, EXPONENT)), names),
            initial_amplitude_sd=self.number("likelihood", likelihood, "initial_amplitude_sd", low=1e-6),
            damping_relative_sd=self.number("structural_damping", damping, "relative_sd", low=1e-6, high=2.0),
            sampler=self.sampler(self.table(table, "sampler", tuple(f.name for f in fields(SamplerSettings)))),
            prior_none=prior_none,
            effect_weights=effect_weights,
            null_priors=self.null_priors(table),
            reasons={
                "law": str(table["law"].get("reason", "")),
                "structural_damping": str(damping.get("reason", "")),
            },
            text=text,
            resolved=_toml(table),
        )

    def effects(self, table: Mapping[str, Any]) -> tuple[float, dict[str, float]]:
        """Prior probability of no gap, and the relative weights of effects; the table may be left out."""
        if "effects" not in table:
            return 0.5, {}
        entry = self.table(dict(table), "effects", ("prior_none", "weights", "reason"))
        none = self.number("effects", {"prior_none": entry.get("prior_none", 0.5)}, "prior_none", 0.01, 0.99)
        names = (*CATALOGUE, UNKNOWN.name)
        weights = self.table(entry, "weights", names) if "weights" in entry else {}
        return none, {name: self.number("effects.weights", weights, name, 0.0, 1e6) for name in weights}

    def null_priors(self, table: Mapping[str, Any]) -> Mapping[str, Prior]:
        """Priors of the null model; a card that extends none may leave the table out, and has the shipped ones."""
        if "diagnosis" not in table:
            return load_card().null_priors
        entry = self.table(table, "diagnosis", NULL_PRIOR_NAMES)
        found = {}
        for name in NULL_PRIOR_NAMES:
            field = f"diagnosis.{name}"
            if not isinstance(entry.get(name), dict):
                raise InputError(self.path, field, repr(entry.get(name)), f"a table [{field}]")
            found[name] = self.prior(field, field, entry[name])
            if found[name].family.endswith("uniform"):
                raise InputError(self.path, f"{field}.family", repr(found[name].family), "normal or lognormal")
        return found

    def law(self, table: Mapping[str, Any]) -> tuple[tuple[float, ...], tuple[float, ...], str]:
        """Exponents, prior weights and averaging; no exponents where n is free."""
        averaging = table.get("averaging", AVERAGING[0])
        if averaging not in AVERAGING:
            raise InputError(self.path, "law.averaging", repr(averaging), f"one of: {', '.join(AVERAGING)}")
        n = table.get("n")
        if n == "free":
            return (), (), str(averaging)
        several = n if isinstance(n, list) and n else [n]
        wanted = 'a number from -2 to 12, a list of such numbers, or "free"'
        for one in several:
            if isinstance(one, bool) or not isinstance(one, int | float) or not -2.0 <= one <= 12.0:
                raise InputError(self.path, "law.n", repr(n), wanted)
        if len(set(several)) < len(several):
            raise InputError(self.path, "law.n", repr(n), "every law once")
        weights = table.get("prior_weights", [1.0 / len(several)] * len(several))
        good = isinstance(weights, list) and len(weights) == len(several)
        good = good and all(isinstance(w, int | float) and not isinstance(w, bool) and w > 0 for w in weights)
        if not good:
            raise InputError(self.path, "law.prior_weights", repr(weights), f"{len(several)} positive numbers")
        total = float(sum(weights))
        return tuple(map(float, several)), tuple(float(w) / total for w in weights), str(averaging)

    def known(self, field: str, table: Mapping[str, Any], names: tuple[str, ...]) -> None:
        for key in table:
            if key not in names:
                near = difflib.get_close_matches(key, names, 1)
                hint = f"did you mean '{near[0]}'?" if near else f"one of: {', '.join(names)}"
                raise InputError(self.path, f"{field}.{key}".lstrip("."), "an unknown key", hint)

    def table(self, parent: Mapping[str, Any], name: str, keys: tuple[str, ...]) -> dict[str, Any]:
        table = parent.get(name)
        if not isinstance(table, dict):
            raise InputError(self.path, name, "nothing" if table is None else repr(table), f"a table [{name}]")
        self.known(name, table, keys)
        return table

    def text(self, table: Mapping[str, Any], key: str, default: str) -> str:
        value = table.get(key, default)
        if not isinstance(value, str):
            raise InputError(self.path, key, show(value), "a text")
        return value

    def number(
        self,
        field: str,
        table: Mapping[str, Any],
        key: str,
        low: float = float("-inf"),
        high: float = float("inf"),
    ) -> float:
        value = table.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise InputError(self.path, f"{field}.{key}", repr(value), f"a number from {low:g} to {high:g}")
        return float(value)

    def priors(self, table: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Prior]:
        found: dict[str, Prior] = {}
        for name in names:
            entry = table.get(name)
            if not isinstance(entry, dict):
                raise InputError(self.path, f"priors.{name}", repr(entry), f"a table [priors.{name}]")
            if "family" in entry:
                found[name] = self.prior(name, f"priors.{name}", entry)
                continue
            for motion in Motion:
                field = f"priors.{name}.{motion.value}"
                if not isinstance(entry.get(motion.value), dict):
                    raise InputError(self.path, field, repr(entry.get(motion.value)), f"a table [{field}]")
                found[f"{name}.{motion.value}"] = self.prior(name, field, entry[motion.value])
        return found

    def prior(self, name: str, field: str, entry: Mapping[str, Any]) -> Prior:
        family = entry.get("family")
        # What must be positive is sampled by its logarithm; only a few parameters may have either sign.
        allowed = [one for one, (_, logarithmic) in FAMILIES.items() if logarithmic == (name not in SIGNED)]
        if family not in allowed:
            raise InputError(self.path, f"{field}.family", repr(family), f"one of: {', '.join(allowed)}")
        (one, two), _ = FAMILIES[family]
        self.known(field, entry, ("family", one, two, "unit", "reason"))
        for key in ("unit", "reason"):
            if not isinstance(entry.get(key), str) or not entry[key].strip():
                found = show(entry[key]) if entry.get(key) else "nothing"
                raise InputError(self.path, f"{field}.{key}", found, f"a {key}: every prior says its {key}")
        self.unit(name, field, entry["unit"])
        try:
            return Prior(
                name,
                family,
                self.number(field, entry, one),
                self.number(field, entry, two),
                entry["unit"],
                entry["reason"],
            )
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError(self.path, field, str(error), "numbers that make a distribution") from error

    def unit(self, name: str, field: str, found: str) -> None:
        """Raise InputError where a prior is in another unit than its parameter is."""
        motion = field.rpartition(".")[2]
        wanted = UNITS.get(f"{name}.{motion}", UNITS.get(name, BARE))
        if " ".join(found.split()) not in (wanted, *wanted.split(" or ")):
            raise InputError(self.path, f"{field}.unit", f'"{found}"', f'unit = "{wanted}", the one that {name} is in')

    def sampler(self, table: Mapping[str, Any]) -> SamplerSettings:
        values: dict[str, Any] = {}
        for one in fields(SamplerSettings):
            if one.name not in table:
                continue
            whole = one.type is int
            value = self.number("sampler", table, one.name, low=0.0, high=MOST_SAMPLED)
            if whole and value != int(value):
                raise InputError(self.path, f"sampler.{one.name}", repr(value), "a whole number")
            values[one.name] = int(value) if whole else value
        settings = SamplerSettings(**values)
        for name, low in (("ensembles", 2), ("walkers", 14), ("draws", 8), ("max_steps", 100)):
            if getattr(settings, name) < low:
                raise InputError(self.path, f"sampler.{name}", str(getattr(settings, name)), f"at least {low}")
        if settings.draws > settings.max_steps // 2:
            raise InputError(self.path, "sampler.draws", str(settings.draws), "at most half of max_steps")
        if settings.differential_evolution + settings.stretch <= 0:
            raise InputError(
                self.path,
                "sampler.stretch",
                "0",
                "some differential evolution or stretch beside the independence move",
            )
        return settings
