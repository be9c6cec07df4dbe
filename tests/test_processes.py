"""What is told of work in progress."""

import io
import sys
from pathlib import Path

import pytest

from scruton.progress import Bar, Stages
from tests.terminals import at_a_terminal


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


def test_stages_are_one_total_that_never_goes_back() -> None:
    told: list[tuple[str, float]] = []
    stages = Stages(lambda stage, done: told.append((stage, done)), {"a": 1.0, "b": 1.0, "c": 6.0, "d": 2.0}, len)
    stages("a", 0.5)
    stages("a", 1.0)
    stages("c", 0.5)  # b is passed over
    stages("xx", 0.0)  # nobody expected it, and it costs 2
    stages("xx", 1.0)
    stages.within("d")("a part of d", 0.5)
    stages("d", 1.0)
    done = [fraction for _, fraction in told]
    assert told[:3] == [("a", 0.05), ("a", 0.1), ("c", 0.5)]
    assert done == sorted(done)
    assert told[4:] == [("xx", 10 / 12), ("a part of d", 11 / 12), ("d", 1.0)]


def test_the_time_left_is_that_of_all_stages(monkeypatch) -> None:
    now = [1.0]
    monkeypatch.setattr("tqdm.std.time", lambda: now[0])
    monkeypatch.setattr(sys, "stderr", Terminal())
    with Bar(quiet=False) as bar:
        bar("a", 0.0)
        for stage, done in (("a", 0.1), ("b", 0.2), ("c", 0.5)):
            now[0] = 1.0 + 100.0 * done
            bar(stage, done)
        bar("anew", 0.0)
    shown = sys.stderr.getvalue()
    assert "b, 01:20 left" in shown
    assert "c, 00:50 left" in shown
    assert "anew, ? left" in shown


def test_a_terminal_that_tells_no_size_sees_the_line(tmp_path: Path) -> None:
    """As that of a container, or of a serial line: zero columns by zero lines."""
    code, seen = at_a_terminal(
        ["-c", "from scruton.progress import Bar\nwith Bar(False) as bar: bar('a stage', 0.0); bar('a stage', 0.5)"],
        [], tmp_path, program=(),
    )  # fmt: skip
    assert (code, "a stage" in seen) == (0, True)
