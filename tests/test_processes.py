"""Work in several processes, and what is told of it."""

import io
import os
import sys
from concurrent.futures.process import BrokenProcessPool

import pytest

from scruton.processes import completed
from scruton.progress import Bar


def doubled(number: int) -> tuple[int, int]:
    return 2 * number, os.getpid()


def dies() -> None:
    os._exit(3)


def test_one_job_is_done_here_and_several_elsewhere() -> None:
    tasks = [(number,) for number in range(5)]
    here, beside = list(completed(doubled, tasks, 1)), list(completed(doubled, tasks, 2))
    assert [value for value, _ in here] == sorted(value for value, _ in beside) == [0, 2, 4, 6, 8]
    assert {process for _, process in here} == {os.getpid()}
    assert os.getpid() not in {process for _, process in beside}


def test_a_process_that_dies_is_told_and_takes_nothing_of_this_one() -> None:
    with pytest.raises(BrokenProcessPool):
        list(completed(dies, [()], 1, apart=True))


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("quiet", "stream", "seen"), [(False, Terminal, True), (True, Terminal, False), (False, io.StringIO, False)]
)
def test_the_bar_is_one_line_with_the_time_left_and_goes_when_it_ends(monkeypatch, quiet, stream, seen) -> None:
    monkeypatch.setattr(sys, "stderr", stream())
    with Bar(quiet) as bar:
        for stage in ("rig 1", "a test with a name that no line of eighty letters can hold"):
            bar(stage, 0.0)
            bar(stage, 0.5, ", 1 failed")
            bar(stage, 1.0, ", 1 failed")
    shown = sys.stderr.getvalue()
    assert "\n" not in shown
    assert bool(shown) == seen
    if seen:
        lines = [line.rstrip() for line in shown.split("\r")]
        assert f"  [{'#' * 24}] rig 1, 1 failed, 00:00 left" in lines
        assert f"  [{'.' * 24}] rig 1, ? left" in lines
        assert f"  [{'#' * 24}] a test with a name that no line o..., 00:00 left" in lines
        assert max(map(len, lines)) < 80
        assert not lines[-1], "it takes itself away"
        assert not set(shown) & {"\x1b"}
