"""What the terminal sees, and what the system refuses: messages with exit code 2, never a traceback."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from scruton.cli import main
from scruton.errors import InputError
from scruton.terminal import guarded, harmless

ESCAPE = "\x1b]0;owned\x07\x1b[31m\x9b2J\u202e"


@pytest.fixture
def campaign(small_campaign: Path, tmp_path: Path) -> Path:
    """A copy that may be spoilt."""
    return Path(shutil.copytree(small_campaign, tmp_path / "campaign"))


def retitled(campaign: Path, title: str) -> Path:
    path = campaign / "campaign.toml"
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("title")]
    path.write_text(f'title = "{title}"\n' + "\n".join(lines), encoding="utf-8")
    return campaign


def scruton(*arguments: object, **options: object) -> subprocess.CompletedProcess[bytes]:
    """Run the command in a process of its own."""
    command = [sys.executable, "-m", "scruton", *map(str, arguments)]
    return subprocess.run(command, timeout=120, check=False, **{"capture_output": True, **options})  # type: ignore[call-overload]


def test_control_characters_are_shown_as_escapes() -> None:
    assert harmless(f"a{ESCAPE}\tb\n") == "a\\x1b]0;owned\\x07\\x1b[31m\\x9b2J\\u202e\tb\n"
    assert harmless("naïve 桥 ±") == "naïve 桥 ±"


def test_no_control_character_of_a_file_reaches_the_terminal(campaign: Path, capsys: pytest.CaptureFixture) -> None:
    quoted = "".join(f"\\u{ord(sign):04x}" for sign in ESCAPE)
    assert main(["check", str(retitled(campaign, f"a{quoted}"))]) == 0
    text = (campaign / "campaign.toml").read_text(encoding="utf-8")
    assert main(["check", str(retitled(campaign, f"a{quoted}") / "x\x1b[2J")]) == 2
    (campaign / "campaign.toml").write_text(text.replace("kind = ", f'"k{quoted}" = 1\nkind = ', 1), encoding="utf-8")
    assert main(["check", str(campaign)]) == 2
    with pytest.raises(SystemExit):
        main(["check", "--\x1b[2J"])
    out, err = capsys.readouterr()
    assert "\\x1b]0;owned" in out + err
    assert not set(out + err) & set("\x1b\x07\x9b\u202e")


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-8"])
def test_a_terminal_that_lacks_a_character_shows_its_escape(campaign: Path, encoding: str) -> None:
    found = scruton("check", retitled(campaign, "桥梁 ±"), env=os.environ | {"PYTHONIOENCODING": encoding})
    assert (found.returncode, found.stderr) == (0, b"")
    first = {"cp1252": b"\\u6865\\u6881 \xb1", "ascii": b"\\u6865\\u6881 \\xb1", "utf-8": "桥梁 ±".encode()}[encoding]
    assert found.stdout.splitlines()[0] == first


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", [["models"], ["--help"], ["models", "--help"]])
def test_a_full_disk_is_a_message(arguments: list[str], unbuffered: str) -> None:
    with Path("/dev/full").open("wb") as full:
        environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
        found = scruton(*arguments, capture_output=False, stdout=full, stderr=subprocess.PIPE, env=environment)
    assert found.returncode == 2
    assert found.stderr.count(b"\n") == 1
    assert b"standard output: found an error (No space left on device)" in found.stderr


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_closed_pipe_is_quiet(unbuffered: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    found = scruton(
        "models", capture_output=False, stdout=writing, stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
    )  # fmt: skip
    os.close(writing)
    assert (found.returncode, found.stderr) == (0, b"")


@pytest.mark.parametrize("place", ["campaign", "out", "model", "bridge", "results", "spec"])
def test_paths_that_the_system_refuses(small_campaign: Path, tmp_path: Path, capsys, place: str) -> None:
    long = str(tmp_path / ("a" * 5_000))
    out = str(tmp_path / "out")
    arguments = {
        "campaign": ["fit", long, "-o", out],
        "out": ["fit", str(small_campaign), "-o", long],
        "model": ["fit", str(small_campaign), "-o", out, "--model", long],
        "bridge": ["report", str(small_campaign), "-o", out, "--bridge", long],
        "results": ["predict", long, "--sc", "30"],
        "spec": ["simulate", long, "-o", out],
    }[place]
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert err.startswith("scruton: ")
    assert "wanted" in err
    assert len(err) < 5_000
    assert not (tmp_path / "out").exists()


def failing(error: BaseException):
    def run() -> int:
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (InputError("f", "x", "1", "2"), 2, "f: x: found 1; wanted 2."),
        (PermissionError(13, "Permission denied", "some/file"), 2, "some/file: found an error (Permission denied)"),
        (OSError("odd"), 2, "the system: found an error (odd)"),
        (MemoryError(), 2, "too little memory"),
        (RecursionError(), 2, "nested too deeply"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (BrokenPipeError(), 0, ""),
    ],
)
def test_what_fails_is_said(capsys, error: BaseException, code: int, words: str) -> None:
    assert guarded(failing(error)) == code
    assert words in capsys.readouterr().err


def test_errors_of_the_program_stay_tracebacks() -> None:
    with pytest.raises(ZeroDivisionError):
        guarded(failing(ZeroDivisionError()))


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["chek", "x"], "check"),
        (["reprot", "x"], "report"),
        (["challenge", "scor", "a", "b"], "score"),
        (["check", "x", "--quite"], "--quiet"),
        (["fit", "x", "--sed=3"], "--seed"),
        (["challenge", "make", "-o", "x", "--design", "ful"], "full"),
    ],
)
def test_a_misspelt_word_gets_the_nearest(capsys, arguments: list[str], meant: str) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert f'did you mean "{meant}"?' in capsys.readouterr().err


@pytest.mark.parametrize("words", [["xyzzy"], ["fit", "x", "--wrkers", "3"], ["diagnose", "x", "--wrkers", "3"]])
def test_a_word_like_no_other_of_its_verb_gets_none(capsys, words: list[str]) -> None:
    with pytest.raises(SystemExit):
        main(words)
    assert "did you mean" not in capsys.readouterr().err


def test_an_unknown_option_shows_the_options_of_its_verb(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["predict", "x", "--scr", "3", "--bogus"])
    assert capsys.readouterr().err.startswith("usage: scruton predict ")


@pytest.mark.parametrize("verb", ["predict", "size", "criticise"])
def test_a_fit_as_a_whole_says_why_it_takes_no_test(capsys, verb: str) -> None:
    assert main([verb, "x", "--test", "a"]) == 2
    assert 'command line: --test: found "a"; wanted a fit of these tests alone' in capsys.readouterr().err


NOW = ["fit", "{campaign}", "-o", "{out}"]
REPORT = ["report", "{campaign}", "-o", "{out}"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([*NOW, "--effect", "friction"], ["--effect", '"friction"', 'wanted "coulomb_friction"']),
        ([*REPORT, "--effect", "friction"], ["--effect", '"coulomb_friction"']),
        (["predict", "{campaign}", "--sc", "3", "--effect", "friction"], ["--effect", '"coulomb_friction"']),
        (["size", "{campaign}", "--effect", "friction"], ["--effect", '"coulomb_friction"']),
        ([*NOW, "--effect", ""], ["--effect"]),
        ([*NOW, "--seed", "-1"], ["--seed", "found -1"]),
        ([*NOW, "--seed", "9" * 400], ["--seed", "a number of 400 digits"]),
        ([*NOW, "--tests", "Sc 22"], ["tests", "Sc 21.7"]),
        ([*NOW, "--test", "Sc 22"], ["tests", "Sc 21.7"]),
        ([*NOW, "--tests", ""], ["tests", 'no test ""']),
        ([*NOW, "--model", "defualt"], ["no such model card"]),
        ([*REPORT, "--sc", "inf"], ["--sc", "found inf"]),
        ([*REPORT, "--sc", "1e300"], ["--sc", "found 1e+300"]),
        ([*REPORT, "--bridge", "none.toml"], ["none.toml", "no such file"]),
        ([*REPORT, "--limit", "jtg"], ["--limit", "--bridge"]),
        (["size", "{campaign}", "--limit", "jgt"], ["--limit", '"jtg"']),
        (["size", "{campaign}", "--limit", "1e300 m"], ["--limit", "which no measurement has"]),
        (["size", "{campaign}", "--damping", "2"], ["--damping"]),
        (["size", "{campaign}", "--law", "nan"], ["--law", "found nan"]),
        (["identify", "{campaign}", "--trial", "spline"], ["--trial", 'found "spline"; wanted one of: "second-order']),
        (["predict", "{campaign}", "--sc", "3", "--law", "1e9"], ["--law", "-2 to 12"]),
        (["batch", "{campaign}", "-o", "{out}", "--jobs", "0"], ["--jobs", "found 0"]),
        (["batch", "{campaign}", "-o", "{out}", "--tls-ca", "x"], ["--tls-ca", "no --scheduler"]),
        (["batch", "{campaign}", "-o", "{out}", "--tls-ca", "x", "--scheduler", "tcp://a:1"], ["--tls-ca", "tls://"]),
        (["batch", "{campaign}", "-o", "{out}", "--tls-ca", "x", "--scheduler", "tls://a:1"], ["x", "no such file"]),
        (["diagnose", "{campaign}", "-o", "{out}", "--workers", "0"], ["--jobs", "found 0"]),
        (["calibrate", "-o", "{out}", "--campaigns", "0"], ["--campaigns", "found 0"]),
        (["calibrate", "-o", "{out}", "--jobs", "-1"], ["--jobs", "found -1"]),
        (["challenge", "make", "-o", "{out}", "--cases", "0"], ["--cases", "found 0"]),
        (["challenge", "make", "-o", "{out}", "--turbulence", "nan,1"], ["--turbulence", "2 numbers"]),
        (["fit", "{campaign}", "-o", "{campaign}/campaign.toml/x"], ["-o", "a file"]),
    ],
)  # fmt: skip
def test_options_are_checked_before_anything_is_sampled(
    small_campaign: Path,
    tmp_path: Path,
    capsys,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    words: list[str],
) -> None:
    monkeypatch.setattr("scruton.infer.fit.fit_campaign", lambda *_, **__: pytest.fail("it samples"))
    monkeypatch.setattr("scruton.processes.SecondProcess.begin", lambda *_, **__: None)
    code = main([one.format(campaign=small_campaign, out=tmp_path / "out") for one in arguments])
    err = capsys.readouterr().err
    assert code == 2, err
    for word in ("found", "wanted", *words):
        assert word in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (["--tests", "light, 3.1 m/s"], ["light, 3.1 m/s"]),
        (["--test", "light, 3.1 m/s"], ["light, 3.1 m/s"]),
        (["--tests", "light, 3.1 m/s,light"], ["light, 3.1 m/s", "light"]),
        (["--test", "light", "--test", "light, 3.1 m/s"], ["light, 3.1 m/s", "light"]),
        ([], []),
    ],
)
@pytest.mark.parametrize("verb", ["fit", "report"])
def test_tests_are_named_whole_or_in_a_list(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str, given: list[str], names: list[str]
) -> None:
    path = campaign / "campaign.toml"
    text = path.read_text(encoding="utf-8").replace('"Sc 21.7"', '"light, 3.1 m/s"')
    other = '\n[[tests]]\nname = "light"\nrig = "6#"\nair_density = "1.2 kg/m^3"\nwind_speed = "3 m/s"\n'
    path.write_text(text + other, encoding="utf-8")
    seen: list[list[str]] = []

    def fit(*_: object, asked: dict[str, Any], **__: object) -> None:
        seen.append(asked["tests"])
        assert [one.replace("'", "") for one in asked["command"].split(" --test ")[1:]] == names
        raise InputError("", "", "", "")

    monkeypatch.setattr("scruton.infer.fit.fit_campaign", fit)
    monkeypatch.setattr("scruton.processes.SecondProcess.begin", lambda *_, **__: None)
    assert main([verb, str(campaign), "-o", str(tmp_path / "out"), *given]) == 2
    assert seen == [names]
