"""A table of campaign.toml that knows where it stands, so that whatever is wrong in it can be said with its place."""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from scruton.campaign.schema import Quantity
from scruton.campaign.units import Dimension, parse_quantity, show
from scruton.errors import InputError

MOST_TABLES = 10_000  # of one kind, such as tests


def nearest(word: str, known: Iterable[str]) -> str:
    """Name what is known, the nearest to `word` first: '"mass" (known: frequency, mass, name)'."""
    names = list(known)
    close = get_close_matches(word.lower(), [name.lower() for name in names], n=1, cutoff=0.5)
    listed = ", ".join(names) if len(names) <= 16 else ", ".join(names[:16]) + ", ..."
    if not close:
        return f"one of: {listed}" if names else "none"
    best = next(name for name in names if name.lower() == close[0])
    return f'"{best}"' + (f" (known: {listed})" if len(names) > 1 else "")


@dataclass(frozen=True)
class Table:
    """A TOML table, the file it stands in and its place there ("tests[0].records[1]"; empty for the whole file)."""

    file: Path
    field: str
    values: Mapping[str, object]

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def at(self, key: str) -> str:
        """Return the place of `key`."""
        return f"{self.field}.{key}" if self.field else key

    def _header(self, key: str) -> str:
        return re.sub(r"\[\d+\]", "", self.at(key))

    def error(self, key: str, found: str, wanted: str) -> InputError:
        """Build an error about `key`."""
        return InputError(self.file, self.at(key), found, wanted)

    def check_keys(self, known: Collection[str]) -> None:
        """Raise InputError for the first key that is not known, with the nearest that is."""
        for key in self.values:
            if key not in known:
                raise self.error(key, "a key that is not known", nearest(key, known))

    def text(self, key: str, wanted: str, default: str | None = None) -> str:
        """Return a text that is not empty; `default` where the key is absent, an error where that is None."""
        if key not in self and default is not None:
            return default
        value = self.required(key, wanted)
        if not isinstance(value, str) or not (value.strip() or default == ""):
            raise self.error(key, show(value), wanted)
        return value

    def required(self, key: str, wanted: str) -> object:
        """Return a value of any type, or raise InputError where it is absent."""
        if key not in self:
            raise self.error(key, "nothing", wanted)
        return self.values[key]

    def choice(self, key: str, known: Collection[str]) -> str:
        """Return one of the `known` words."""
        value = self.required(key, f"one of: {', '.join(known)}")
        if not isinstance(value, str) or value not in known:
            word = value if isinstance(value, str) else ""
            raise self.error(key, show(value), nearest(word, known))
        return value

    def quantity(self, key: str, dimension: Dimension) -> Quantity:
        """Return a quantity that must be there."""
        value = self.required(key, f"{dimension.name}, such as {key} = {dimension.spelling}")
        return parse_quantity(value, dimension, self.file, self.at(key))

    def number(self, key: str, dimension: Dimension) -> float:
        """Return the value [SI] of a quantity that must be there and carries no uncertainty."""
        value = self.quantity(key, dimension)
        if value.sd is not None:
            raise self.error(key, "a standard deviation", f"{dimension.name} without one")
        return value.mean

    def table(self, key: str) -> "Table":
        """Return the table `key`, empty where it is absent."""
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, show(value), f"one table, [{self._header(key)}] or {key} = {{ ... }}")
        return Table(self.file, self.at(key), value)

    def tables(self, key: str) -> "tuple[Table, ...]":
        """Return the list of tables `key`, empty where it is absent."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(one, Mapping) for one in value):
            raise self.error(key, show(value), f"a list of tables, each under [[{self._header(key)}]]")
        if len(value) > MOST_TABLES:
            raise self.error(key, f"{len(value):,} tables", f"at most {MOST_TABLES:,}")
        return tuple(Table(self.file, f"{self.at(key)}[{i}]", one) for i, one in enumerate(value))
