"""What all verbs share: options of one meaning, lines of 80 letters, --json in place of tables, --quiet: paths."""

import json
import shutil
from importlib import import_module
from pathlib import Path

import pytest

from scruton.app.verbs import TESTS, VERBS, WHOLE_FIT, Argument
from scruton.cells import columns
from scruton.cli import main, parser, say
from scruton.sizing.limits import RULES

EXAMPLE = Path(__file__).parents[2] / "examples" / "rectangle-4to1"
LEAVES = [(verb.name,) for verb in VERBS if verb.work] + [(v.name, s.name) for v in VERBS for s in v.steps]
# verbs that cost a second or two, of a campaign and of the results of a fit; what they print, and where the JSON is
CHEAP = {
    ("check", "{example}"): {"title", "rigs", "tests", "records", "sweeps", "warnings", "unusable"},
    ("check", "{example}", "--test", "Sc 1.9"): {"title"},
    ("identify", "{example}"): {"identified"},
    ("models",): {"cards"},
    ("models", "show", "paper"): {"name", "priors"},
    ("predict", "{fit}", "--sc", "30", "--damping", "0.004"): {"predictions"},
    ("init", "{copy}"): {"paths"},
    ("compare", "{fit}", "{fit}", "--sc", "30", "--html", "{page}"): {"sides", "inputs", "differences"},
    ("size", "{fit}", "--limit", "0.1", "-o", "{out}"): {"modes", "flags", "provenance"},
    ("criticise", "{fit}", "-o", "{out}"): {"flags", "ok", "provenance"},
}
DOCUMENTS = {("models", "show", "paper")}  # printed as they are, to be kept in a file


@pytest.fixture
def run(tmp_path, quick_results, capsys, monkeypatch):
    """Run a verb once, and print what it says in each of the three ways."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("scruton.app.criticise._figures", lambda *_: [])
    monkeypatch.setattr("scruton.report.figures.save", lambda *_, **__: [])

    def do(*words):
        shutil.copytree(EXAMPLE, tmp_path / "copy", ignore=shutil.ignore_patterns("campaign.toml"))
        places = {"example": EXAMPLE, "fit": quick_results, "copy": tmp_path / "copy", "out": tmp_path / "out",
                  "page": tmp_path / "page.html"}  # fmt: skip
        asked = parser().parse_args([word.format(**places) for word in words])
        module, name = asked.work.split(":")
        outcome = getattr(import_module(f"scruton.app.{module}"), name)(asked)
        assert outcome.code in (0, 1)
        said = []
        for quiet, as_json in ((False, False), (False, True), (True, False)):
            say(outcome, quiet=quiet, as_json=as_json)
            said.append(capsys.readouterr().out)
        return said

    return do


@pytest.mark.thorough
@pytest.mark.parametrize("words", list(CHEAP), ids=" ".join)
def test_lines_fit_a_terminal_and_json_and_quiet_mean_the_same(run, words, tmp_path):
    text, as_json, quiet = run(*words)
    paths = [line for line in text.splitlines() if line and Path(line).exists()]
    long = [line for line in text.splitlines() if len(line) > 80 and str(tmp_path) not in line]
    assert words in DOCUMENTS or not long
    assert set(json.loads(as_json)) >= CHEAP[words]
    assert quiet.splitlines() == paths


@pytest.mark.parametrize("words", LEAVES, ids=" ".join)
def test_every_verb_takes_the_shared_options_and_its_help_fits(words, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit) as ended:
        main([*words, "--help"])
    text = capsys.readouterr().out
    assert ended.value.code == 0
    assert {"--seed", "--quiet", "--json", "--jobs"} <= set(text.replace("[", " ").replace("]", " ").split())
    assert max(map(len, text.splitlines())) <= 80
    assert "--workers" not in text


def leaves():
    return [one for verb in VERBS for one in (verb, *verb.steps) if one.work]


def flat(verb):
    return [one for entry in verb.arguments for one in ((entry,) if isinstance(entry, Argument) else entry)]


def test_options_of_one_name_are_one_and_the_same():
    shared = {"--test", "--scheduler", "--model", "--sc", "--strict", "--tls-ca", "--tls-cert", "--tls-key"}
    for name in shared:
        found = [one.settings for verb in leaves() for one in flat(verb) if name in one.names and one is not WHOLE_FIT]
        assert len(found) > 1
        assert all(one == found[0] for one in found), name
    spread = {verb.name for verb in leaves() if any("--scheduler" in one.names for one in flat(verb))}
    assert spread == {"validate", "batch", "calibrate", "make", "run", "score"}
    campaigns = {verb.name for verb in leaves() if TESTS in flat(verb)}
    assert campaigns == {"check", "identify", "fit", "report", "compare", "validate", "batch", "diagnose"}
    assert {verb.name for verb in leaves() if WHOLE_FIT in flat(verb)} == {"predict", "size", "criticise"}


def test_jobs_are_taken_everywhere():
    read = parser().parse_args
    for words in (["fit", "x"], ["size", "x"], ["criticise", "x"], ["predict", "x"], ["init", "x"], ["check", "x"]):
        assert read([*words, "--jobs", "3"]).jobs == 3


def test_the_old_name_of_jobs_is_understood():
    read = parser().parse_args
    assert read(["diagnose", "x", "--workers", "3"]).jobs == read(["diagnose", "x", "--jobs", "3"]).jobs == 3
    assert read(["diagnose", "x"]).jobs == 2


def test_check_does_not_praise_what_it_cannot_use(tmp_path, capsys):
    shutil.copytree(EXAMPLE, tmp_path / "c")
    for path in (tmp_path / "c").glob("*.csv"):
        path.write_text("time [s],displacement [mm]\n0,1\n", encoding="utf-8")
    assert main(["check", str(tmp_path / "c")]) == 2
    text = capsys.readouterr().out
    assert "12 records cannot be used" in text
    assert "No warnings" not in text
    assert main(["check", str(tmp_path / "c"), "--quiet"]) == 2
    captured = capsys.readouterr()
    assert (captured.out, captured.err.count("scruton: ")) == ("", 12)


@pytest.mark.thorough
@pytest.mark.usefixtures("no_figures")
def test_a_second_sizing_stands_beside_the_first(quick_results, tmp_path, capsys):
    shutil.copytree(quick_results, tmp_path / "fit")
    for limit, place in (("0.1", "sizing"), ("0.08", "sizing-3")):
        assert main(["size", str(tmp_path / "fit"), "--limit", limit, "--quiet"]) == 0
        assert capsys.readouterr().out == f"{tmp_path / 'fit' / place / 'sizing.json'}\n"
        shutil.copytree(tmp_path / "fit" / "sizing", tmp_path / "fit" / "sizing-2", dirs_exist_ok=True)  # as by another
    first, second = ((tmp_path / "fit" / name / "sizing.json").read_text() for name in ("sizing", "sizing-3"))
    assert "0.1" in first
    assert "0.08" in second
    assert first != second


def test_criticise_ends_in_four_lines(run):
    verdict, title, gist, place = run("criticise", "{fit}", "-o", "{out}")[0].splitlines()
    assert verdict.startswith("Nothing found") or "to look at, " in verdict
    assert title
    assert gist.startswith(("First of them: ", "Examined: "))
    whole = Path(place).read_text(encoding="utf-8")
    assert "Innovations of the filter" in whole
    assert max(map(len, whole.splitlines())) > 80, "the file is as wide as its tables"


def test_a_wide_table_loses_nothing():
    header = ("record", "kind of record", "what is said", *(f"quantity {i}" for i in range(8)))
    row = (
        "a.csv",
        "free-decay",
        "a sentence of many words that a line may well break",
        *(f"0.{i}2345" for i in range(8)),
    )
    left = [True] + [False] * 10
    whole, narrow = columns(header, [row, row], left), columns(header, [row, row], left, 60)
    assert len(whole.splitlines()) == 4
    assert max(map(len, narrow.splitlines())) <= 60
    for word in {word for word in whole.split() if set(word) != {"-"}}:
        assert narrow.count(word) >= whole.count(word), word
    assert columns(header, [row], left, 400) == columns(header, [row], left)
    # a word that no line holds is broken, not lost
    broken = columns(("name", "x"), [("n" * 70, "1")], [True, False], 40)
    assert broken.count("n") == 71
    assert max(map(len, broken.splitlines())) <= 40


@pytest.mark.parametrize("words", [("check", "{example}"), ("compare", "{fit}", "{fit}")], ids=" ".join)
def test_a_page_replaces_pages_alone(words, quick_results, tmp_path, capsys):
    asked = [word.format(example=EXAMPLE, fit=quick_results) for word in words]
    record, page = tmp_path / "sc1p9_decay.csv", tmp_path / "page.html"
    record.write_text("time [s],displacement [mm]\n0,1\n", encoding="utf-8")
    assert main([*asked, "--html", str(record)]) == 2
    assert "sc1p9_decay.csv: --html: found a file that is there and no page of scruton's" in capsys.readouterr().err
    assert record.read_text(encoding="utf-8") == "time [s],displacement [mm]\n0,1\n"
    assert main([*asked, "--html", str(page)]) in (0, 1)
    page.write_text(page.read_text(encoding="utf-8") + "<!-- old -->", encoding="utf-8")
    assert main([*asked, "--html", str(page)]) in (0, 1)
    assert "<!-- old -->" not in page.read_text(encoding="utf-8"), "its own page is made anew"


@pytest.mark.parametrize(
    "words", [("score", "x", "y", "--markdown"), ("tune", "x", "-o")], ids=lambda words: " ".join(words)
)
def test_a_named_file_of_challenge_is_kept(words, tmp_path, capsys):
    notes = tmp_path / "notes.md"
    notes.write_text("mine", encoding="utf-8")
    assert main(["challenge", *words, str(notes)]) == 2
    assert "--force to replace it" in capsys.readouterr().err
    assert notes.read_text(encoding="utf-8") == "mine"


def test_the_inertia_of_a_torsional_rig_is_named_with_its_unit(capsys):
    assert main(["check", str(EXAMPLE.parent / "closed-box-torsional")]) == 0
    assert "inertia [kg m^2/m]" in capsys.readouterr().out
    assert main(["check", str(EXAMPLE)]) == 0
    assert "mass [kg/m]" in capsys.readouterr().out


def test_the_help_of_limit_names_every_rule():
    of_size = next(verb for verb in VERBS if verb.name == "size")
    limit = next(one for one in of_size.arguments if isinstance(one, Argument) and "--limit" in one.names)
    of_a_bare_value = {"amplitude", "angle", "amplitude-over-depth"}
    assert [name for name in RULES if name not in of_a_bare_value and f'"{name}' not in limit.settings["help"]] == []
