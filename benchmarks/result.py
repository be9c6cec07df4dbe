"""What a benchmark hands back: figures, some of which must stay within a limit."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One measured number; `limit` is what it must stay below, or above where `at_least`."""

    name: str
    value: float
    unit: str
    limit: float | None = None
    at_least: bool = False

    @property
    def met(self) -> bool:
        if self.limit is None:
            return True
        return self.value >= self.limit if self.at_least else self.value < self.limit

    def __str__(self) -> str:
        text = f"  {self.name:<68} {self.value:>9.4g} {self.unit}"
        if self.limit is None:
            return text
        wanted = f"{'at least' if self.at_least else 'under'} {self.limit:g}"
        return f"{text:<92} wanted {wanted}{'' if self.met else '   MISSED'}"
