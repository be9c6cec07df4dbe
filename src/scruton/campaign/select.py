"""Parts of a campaign: the tests that a user names, and the peak test of every rig."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from scruton.campaign.schema import Campaign, Test
from scruton.campaign.spelling import nearest, several
from scruton.errors import InputError


def tests_named(campaign: Campaign, wanted: str | Sequence[str] | None) -> tuple[str, ...]:
    """Names of the tests that a user wants, each once, in the campaign's order.

    Parameters
    ----------
    campaign : Campaign
    wanted : str, sequence of str or None
        Each the name of a test, or names with commas between them.  Names may hold commas themselves: a text that is
        a name as a whole is that test, and of several names that begin at one place the longest is meant.  None: none.

    Raises
    ------
    InputError
        A name that no test has.
    """
    return names_meant(several(wanted), [test.name for test in campaign.tests], campaign.path, "tests")


def names_meant(texts: str | Sequence[str], names: Sequence[str], where: Path | str, field: str) -> tuple[str, ...]:
    """Those of the names of tests that texts mean, each once and in their order, as of `tests_named`.

    InputError at this place for a name that is none of them.
    """
    known = {_spaced(name): name for name in names}
    chosen = {name for text in several(texts) for name in _split(text, known, where, field)}
    return tuple(name for name in names if name in chosen)


def _split(text: str, known: Mapping[str, str], where: Path | str, field: str) -> list[str]:
    """Split a text at commas into names, the longest first."""
    if text in known.values():
        return [text]
    parts = [part.strip() for part in text.split(",")]
    names: list[str] = []
    while parts:
        ends = (i for i in range(len(parts), 0, -1) if _spaced(",".join(parts[:i])) in known)
        end = next(ends, 0)
        if not end:
            raise InputError(where, field, f'no test "{parts[0]}"', nearest(parts[0], known.values()))
        names.append(known[_spaced(",".join(parts[:end]))])
        parts = parts[end:]
    return names


def _spaced(name: str) -> str:
    """A name with one way of setting blanks."""
    return ", ".join(" ".join(part.split()) for part in name.split(","))


def tests_used(campaign: Campaign, wanted: str | Sequence[str]) -> Campaign:
    """Return the campaign with only the tests that are `wanted`, in the campaign's order; rigs and sweeps stay.

    Raises
    ------
    InputError
        As `tests_named`.
    """
    names = tests_named(campaign, wanted)
    return replace(campaign, tests=tuple(test for test in campaign.tests if test.name in names))


# pytest would take them for tests
tests_named.__test__ = False  # type: ignore[attr-defined]
tests_used.__test__ = False  # type: ignore[attr-defined]


def peak_tests(campaign: Campaign, amplitudes: Mapping[str, float] | None = None) -> tuple[Test, ...]:
    """Find the test of largest amplitude of every rig that has tests.

    Parameters
    ----------
    campaign : Campaign
    amplitudes : mapping of str to float, optional
        Amplitude (A/D or rad) by the name of a test, for tests that state no stable amplitude.

    Returns
    -------
    tuple of Test
        One a rig, in the order of the rigs: the one that says `peak = true`; else the one with the largest
        amplitude, stated or given (a stated one goes first); else the first in the file.
    """
    given = amplitudes or {}

    def size(test: Test) -> float:
        if test.stable_amplitude is not None:
            return test.stable_amplitude.mean
        return given.get(test.name, 0.0)

    peaks = []
    for rig in campaign.rigs:
        # A test that says `peak = false` is one only if all of them do.
        tests = [test for test in campaign.tests if test.rig == rig.name]
        tests = [test for test in tests if test.peak is not False] or tests
        if tests:
            peaks.append(next((test for test in tests if test.peak), None) or max(tests, key=size))
    return tuple(peaks)
