"""What is told of work in progress."""

import io
import sys

import pytest

from scruton.progress import Bar


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
