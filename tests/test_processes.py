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
    ("quiet", "stream", "lines"), [(False, Terminal, 2), (True, Terminal, 0), (False, io.StringIO, 0)]
)
def test_the_bar_has_a_line_for_each_stage_with_the_time_left(monkeypatch, quiet, stream, lines) -> None:
    monkeypatch.setattr(sys, "stderr", stream())
    with Bar(quiet) as bar:
        for stage in ("rig 1", "test A"):
            bar(stage, 0.0)
            bar(stage, 0.5, ", 1 failed")
            bar(stage, 1.0, ", 1 failed")
    shown = sys.stderr.getvalue()
    assert shown.count("\n") == lines
    if lines:
        ended = [line.rsplit("\r", 1)[-1] for line in shown.split("\n")[:-1]]
        assert ended == [f"  [{'#' * 24}] {stage}, 1 failed, 00:00 left" for stage in ("rig 1", "test A")]
        assert f"  [{'.' * 24}] rig 1, ? left" in shown
        assert not set(shown) & {"\x1b"}
