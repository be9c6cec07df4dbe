"""Hours of vibration in a year, in rows and sentences, from the content of sizing.json."""

from collections.abc import Callable
from typing import Any

from scruton.report.needs import Content


def hours_rows(content: Content, between: str, velocity: Callable[..., str], hours: Callable[..., str]) -> list[Any]:
    """One row a mode: reduced velocities of lock-in and whether they are assumed, hours in it and beyond the limit."""
    yearly = content["all_modes"].get("hours")
    if not yearly:
        return []
    columns = (yearly[key] for key in ("lock_in", "assumed", "a_year", "exceeding_a_year"))
    ends = zip(yearly.get("exceeding_low", ()), yearly.get("exceeding_high", ()), strict=True)
    interval = [f" ({hours(low)}{between}{hours(high)})" for low, high in ends]
    rows = [
        [name, between.join(map(velocity, bounds)) + (" (assumed)" if assumed else ""), hours(a_year), hours(beyond)]
        for name, bounds, assumed, a_year, beyond in zip(content["all_modes"]["names"], *columns, strict=True)
    ]
    for row, ends_of in zip(rows, interval, strict=False):  # an earlier sizing has none
        row[-1] += ends_of
    left = [yearly["exceeding_with"][key] for key in hours_left(content).values()]
    return [(*row, *(hours(of[k]) for of in left)) for k, row in enumerate(rows)]


def hours_left(content: Content) -> dict[str, str]:
    """Headings of the hours that are left with what is done about it, and where they stand."""
    found = (content["all_modes"].get("hours") or {}).get("exceeding_with", {})
    headings = {"with the required damping": "with_required_damping", "with all dampers": "with_dampers"}
    return {heading: key for heading, key in headings.items() if key in found}


def hours_note(content: Content) -> str:
    """What the amplitude against the wind speed was taken from, in a sentence a source."""
    every = content["all_modes"]
    of: dict[str, list[str]] = {}
    for name, shape in zip(every["names"], (every.get("hours") or {}).get("shape", ()), strict=False):
        of.setdefault(shape, []).append(name)
    return " ".join(f"Amplitude over the lock-in range, {', '.join(names)}: {shape}." for shape, names in of.items())
