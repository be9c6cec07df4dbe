"""Parts of a campaign: the tests that a user names, and the peak test of every rig."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from scruton.campaign.schema import Campaign, Test
from scruton.campaign.tables import nearest
from scruton.errors import InputError


def tests_used(campaign: Campaign, names: Sequence[str]) -> Campaign:
    """Return the campaign with only the tests called `names`, in the campaign's order; rigs and sweeps stay.

    Raises
    ------
    InputError
        A name that no test has.
    """
    known = [test.name for test in campaign.tests]
    for name in names:
        if name not in known:
            raise InputError(campaign.path, "tests", f'no test "{name}"', nearest(name, known))
    return replace(campaign, tests=tuple(test for test in campaign.tests if test.name in names))


tests_used.__test__ = False  # type: ignore[attr-defined]  # pytest would take it for a test


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
