"""What a diagnosis concludes, in words: what is named, what is not settled, how probable each is.

Everywhere the same: on the terminal by the names of files, in the report and its pictures by titles.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from scruton.gap.thresholds import SETTLED
from scruton.report.thresholds import NAMED_ABOVE, NAMED_LEAST
from scruton.report.wording import number, share

Title = Callable[[str], str]


def settled(gap: Mapping[str, Any]) -> bool:
    """Whether the verdict of a gap.json is named without the next: it is probable enough, and nothing is like it."""
    return _probable(gap) and not _alike(gap)


def _probable(gap: Mapping[str, Any]) -> bool:
    return bool(gap["probability"][gap["verdict"]] >= SETTLED)


def _alike(gap: Mapping[str, Any]) -> list[str]:
    """What the records cannot tell from an effect that is the verdict, of those whose probability is on record."""
    verdict = gap["verdict"]
    if verdict == "none":  # beside it stands what could be there and not be seen
        return []
    groups = (group for group in gap.get("indistinguishable", ()) if verdict in group)
    return [name for name in next(groups, ()) if name != verdict and name in gap["probability"]]


def odds(p: float) -> str:
    """The probability of what is settled."""
    return "above 0.99" if p > 0.99 else number(p, 2)


def doubted(gap: Mapping[str, Any], name: str) -> bool:
    """Whether a further effect is not settled; one whose probability is not on record is not."""
    return bool(gap.get("probability_also", {}).get(name, 1.0) < SETTLED)


def perhaps(gap: Mapping[str, Any], name: str, title: Title) -> str:
    """An effect that was found, with "perhaps" before one that stands beside the verdict and is not settled."""
    return f"perhaps {title(name)}" if doubted(gap, name) else title(name)


def conclusion(gap: Mapping[str, Any], title: Title, first: str = "{}") -> str:
    """What was found, or between what it is not settled, in a clause.

    `first` is how the verdict itself is written where it is settled.
    """
    sure = [_beside(gap, name, title) for name in gap["also"] if not doubted(gap, name)]
    weak = [_beside(gap, name, title) for name in gap["also"] if doubted(gap, name)]
    if not settled(gap):
        beside = f"; beside it {' and '.join([*sure, *weak])}" if sure or weak else ""
        return f"not settled: {_candidates(gap, title)}{beside}"
    named = " and ".join([first.format(title(gap["verdict"])), *sure])
    return named + (f"; not settled: beside it {' and '.join(weak)}" if weak else "")


def condition(gap: Mapping[str, Any], name: str) -> str:
    """What holds only if an unsettled verdict is true is said under this condition; empty where it is settled.

    `name` is what the verdict goes by.
    """
    return "" if settled(gap) else f"if it is {name}"


def likeliest(gap: Mapping[str, Any]) -> list[tuple[str, float]]:
    """The causes that are named where nothing is settled, with their probabilities: two, and others of some weight.

    Where one is probable enough and others are like it, those.  The second has next to none to be left out, unless
    nothing tells it from the verdict.
    """
    causes = sorted(((name, p) for name, p in gap["probability"].items() if name != "none"), key=lambda pair: -pair[1])
    others = _alike(gap)
    if _probable(gap) and others:
        return [(name, p) for name, p in causes if name in {gap["verdict"], *others}]
    second = [(name, p) for name, p in causes[1:2] if p >= NAMED_LEAST or name in others]
    return [*causes[:1], *second, *((name, p) for name, p in causes[2:] if p >= NAMED_ABOVE)]


def told_apart_by_nothing(gap: Mapping[str, Any]) -> list[list[str]]:
    """The groups that are shown of what these records cannot tell apart.

    Beside no gap stands what could be there and not be seen: only where it has some probability, else the list would
    name another cause than the sentence.
    """
    probability = gap["probability"]
    shown = (
        [name for name in group if "none" not in group or name == "none" or probability.get(name, 0.0) >= NAMED_LEAST]
        for group in gap["indistinguishable"]
    )
    return [group for group in shown if len(group) > 1]


def _beside(gap: Mapping[str, Any], name: str, title: Title) -> str:
    """A further effect with its probability, and what else may stand in its place where it is not settled."""
    p = gap.get("probability_also", {}).get(name)
    if p is None:
        return title(name)
    if not doubted(gap, name):
        return f"{title(name)} ({odds(p)})"
    others = sorted(gap.get("in_its_place", {}).get(name, {}).items(), key=lambda pair: -pair[1])
    rivals = [(one, of) for one, of in others if one not in (name, "none") and of >= NAMED_ABOVE]
    return f"perhaps {_with_shares([(name, p), *rivals], title)}"


def _candidates(gap: Mapping[str, Any], title: Title) -> str:
    """The likeliest causes with their shares, and that of no gap, which comes first where it leads."""
    named = _with_shares(likeliest(gap), title)
    none = _share(gap["probability"].get("none", 0.0))
    return f"no gap ({none}), or {named}" if gap["verdict"] == "none" else f"{named}; no gap {none}"


def _with_shares(causes: Iterable[tuple[str, float]], title: Title) -> str:
    return " or ".join(f"{title(name)} ({_share(p)})" for name, p in causes)


def _share(p: float) -> str:
    """A probability in whole per cent: nothing has none."""
    return share(p) if p >= 0.005 else "below 1 %"
