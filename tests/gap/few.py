"""A diagnosis among a few effects: what a rule is about, and its nearest rivals, not the whole catalogue."""

from scruton.dynamics.effects import CATALOGUE


def among(*names: str) -> dict[str, float]:
    """Prior weights that leave the catalogue's other effects out; the unknown stays in, as none does."""
    unheard = set(names) - set(CATALOGUE)
    assert not unheard, unheard
    assert len(names) > 1, "beside what is found, and what does the same, another is looked for"
    return {name: 0.0 for name in CATALOGUE if name not in names}
