"""A first look at a campaign, before any sampling: what its records show, and the paper's own quick estimation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from scruton.campaign import Campaign, load_campaign, peak_tests, tests_used
from scruton.campaign.remarks import sentences
from scruton.dynamics.identify import Identified, identify
from scruton.envelope import Inspection, RecordQuality, gather, review
from scruton.envelope.consistency import of_other_units
from scruton.envelope.natural_frequency import retuned
from scruton.errors import InputError
from scruton.shown import shown

if TYPE_CHECKING:
    import pandas as pd


@shown(
    lambda one: {
        "title": one.campaign.title, "records": len(one.qualities), "warnings": len(one.warnings),
        "cannot_be_used": len(one.problems),
    }
)  # fmt: skip
@dataclass(frozen=True, eq=False)
class Check:
    """What `check` found.

    Attributes
    ----------
    campaign : Campaign
    warnings : tuple of str
        Worst first.
    problems : tuple of InputError
        A record that cannot be used, each; and what a fit would refuse them together for.
    inspection : Inspection
        Cycles, qualities and ring-downs; its campaign is without the records that were set aside.
    """

    campaign: Campaign
    warnings: tuple[str, ...]
    problems: tuple[InputError, ...]
    inspection: Inspection

    @property
    def qualities(self) -> Mapping[str, RecordQuality]:
        """Of every record that can be used, by name."""
        return self.inspection.qualities

    @cached_property
    def identified(self) -> tuple[Identified, ...]:
        """The paper's own procedure, Eqs. (2) to (8) and (16) to (20), of every transient record that it suits."""
        return tuple(found for found in identify(self.inspection) if isinstance(found, Identified))

    @cached_property
    def peaks(self) -> frozenset[str]:
        """Names of the tests that are the peak of their rig: as stated, else of the largest amplitude, as for a fit.

        None of a rig whose amplitudes are not known.
        """
        cycles, tests = self.inspection.cycles, self.campaign.tests
        ends = {
            test.name: [cycles[one.name].settled_amplitude for one in test.records if one.name in cycles]
            for test in tests
        }
        levels = {name: median(of) for name, of in ends.items() if of}
        known = {test.rig for test in tests if test.peak or test.name in levels or test.stable_amplitude is not None}
        return frozenset(test.name for test in peak_tests(self.campaign, levels) if test.rig in known)

    @property
    def records(self) -> "pd.DataFrame":
        """A row for every record: length [s], rate [Hz], cycles, frequency [Hz], signal over noise."""
        import pandas as pd

        fields = ("duration", "sample_rate", "cycles", "frequency", "signal_to_noise")
        rows = {name: {key: getattr(one, key) for key in fields} for name, one in self.qualities.items()}
        return pd.DataFrame.from_dict(rows, orient="index", columns=list(fields))


def check(campaign: Campaign | Path | str, tests: str | Sequence[str] | None = None) -> Check:
    """Read a campaign and look at every record; one that cannot be used stops nothing.

    Parameters
    ----------
    campaign : Campaign, Path or str
        One that was read, its folder, or the campaign.toml itself.
    tests : str or sequence of str, optional
        These alone.

    Raises
    ------
    InputError
        If campaign.toml itself cannot be used, or has no such test.
    """
    problems: list[InputError] = []
    loaded = campaign if isinstance(campaign, Campaign) else load_campaign(Path(campaign), problems)
    if tests is not None:
        loaded = tests_used(loaded, tests)
    inspection = gather(loaded, problems)
    problems += _refused(inspection)
    return Check(loaded, tuple(sentences(review(inspection))), tuple(problems), inspection)


def _refused(inspection: Inspection) -> Iterator[InputError]:
    """What a fit would refuse of records that can each be used, as it would say it."""
    if not inspection.cycles:
        return
    try:
        retuned(inspection.campaign, inspection.cycles, refuse=True)
    except InputError as fault:
        yield fault
    else:
        yield from of_other_units(inspection)
