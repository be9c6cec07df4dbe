"""What is remarked about a campaign: who makes a slip finds it here, worst first, and alike slips in one line."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from scruton.campaign.spelling import figure
from scruton.campaign.thresholds import LISTED
from scruton.said import DAMPING, Said, Value, damping, said

WRITTEN: Mapping[str, Callable[[float], str | Value]] = {DAMPING: damping}  # by kind; others with two digits


class Severity(IntEnum):
    """How much a remark is to be minded."""

    NOTE = 1  # a property of a record that a fit allows for
    DOUBT = 2  # a slip perhaps: somebody has to look
    SERIOUS = 3  # a slip, or results that rest on one


@dataclass(frozen=True)
class Remark:
    """One thing that looks wrong with one record, rig, test or other part of a campaign.

    Attributes
    ----------
    severity : Severity
    kind : str
        Remarks of one kind about several subjects fold into one line.
    of : str
        What the subject is: "record", "rig", "test", "sweep", ... ; empty where the name says all.
    name : str
        The subject's name.
    text : str
        The sentence, without its subject, with a full stop.
    alike : str
        The same of several subjects at once, without a full stop; `{}` stands for the range of their values, as
        part of the text or as a value of its kind.
    value : float
        The number in question, NaN where there is none.
    excess : float
        How many times its limit the number is, 1 or more: the worse of two remarks has the larger one.
    """

    severity: Severity
    kind: str
    of: str
    name: str
    text: str
    alike: str
    value: float = math.nan
    excess: float = 1.0

    @property
    def sentence(self) -> Said:
        """The remark with its subject: a record goes by its name alone."""
        return said(f"{self.name if self.of in ('record', '') else f'{self.of} {self.name}'}: ", self.text)


def sentences(remarks: Iterable[Remark], least: Severity = Severity.NOTE) -> list[Said]:
    """Rank remarks, fold those that are alike, and say each in one sentence.

    Parameters
    ----------
    remarks : iterable of Remark
    least : Severity
        Remarks below it are left out.

    Returns
    -------
    list of Said
        Worst first: by severity, then by the largest excess.
    """
    groups: dict[tuple[str, str, str], list[Remark]] = {}
    for remark in remarks:
        if remark.severity >= least:
            groups.setdefault((remark.kind, remark.of, remark.alike), []).append(remark)
    ranked = [sorted(group, key=_badness, reverse=True) for group in groups.values()]
    return [_said(group) for group in sorted(ranked, key=lambda group: _badness(group[0]), reverse=True)]


def _badness(remark: Remark) -> tuple[int, float]:
    return remark.severity, remark.excess


def _said(group: Sequence[Remark]) -> Said:
    mark = "serious: " if group[0].severity is Severity.SERIOUS else ""
    if len(group) == 1:
        return said(mark, group[0].sentence)
    names = list(dict.fromkeys(remark.name for remark in group))
    listed = ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")
    what = f"{group[0].of}{'' if len(names) == 1 else 's'}"
    return said(mark, _with_range(group), f" in {len(names)} {what}: {listed}.")


def _with_range(group: Sequence[Remark]) -> Iterator[str | Value]:
    """What alike remarks say, with the range of their numbers in its place."""
    numbers = [remark.value for remark in group]
    for part in said(group[0].alike).parts:
        text, write = (part, figure) if isinstance(part, str) else (part.text, WRITTEN.get(part.kind, figure))
        if "{}" not in text:
            yield part
            continue
        before, after = text.split("{}")
        low, high = write(min(numbers)), write(max(numbers))
        yield from (before, low, *([] if low == high else [" to ", high]), after)
