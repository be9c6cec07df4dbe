"""`scruton report RESULTS`: a report of what lies in a folder, in which nothing is sampled."""

import json

import pytest
from fake_fit import fake_fit
from fake_parts import GAP, sizing

from scruton.cli import main
from scruton.documents import read_json, write_document
from scruton.infer.store import provenance_of, read_tree, write_fit
from scruton.report.figures.registry import FigureWithCaption


@pytest.fixture
def results(tmp_path, monkeypatch, no_figures):
    """A fit in a folder, and no sampling anywhere."""
    fit = fake_fit(growth=False, sweeps=False)
    fit.summary["provenance"]["sha256"] = {"record.csv": "11" * 32}
    write_fit(fit, tmp_path / "fit")
    _, summary = read_tree(tmp_path / "fit")

    def sampled(*_, **__):
        raise AssertionError("sampled")

    monkeypatch.setattr("scruton.stats.sampler.sample", sampled)
    monkeypatch.setattr("scruton.report.figures.all_figures", lambda *_: list[FigureWithCaption]())
    return tmp_path / "fit", summary


def prediction(median):
    interval = {level: [0.9 * median, 1.1 * median] for level in ("0.50", "0.90", "0.95")}
    return {"sc": 21.7, "damping_ratio": 0.003, "amplitude": {"unit": "A/D", "median": median, "interval": interval}}


def test_what_lies_beside_the_fit_is_in_the_report(results):
    folder, summary = results
    origin = {"sha256": dict(summary["provenance"]["sha256"])}
    (folder / "gap").mkdir()
    write_document(folder / "gap" / "gap.json", GAP | {"format": 1, "provenance": origin})
    for kind in ("svg", "png"):
        (folder / "gap" / f"gap.{kind}").write_bytes(b"<svg/>")
    made_from = {"fit_sha256": provenance_of(folder, summary), "bridge_sha256": {}}
    (folder / "sizing").mkdir()
    write_document(folder / "sizing" / "sizing.json", sizing() | {"format": 1, "provenance": made_from})
    (folder / "validation").mkdir()
    tests = [test["name"] for test in summary["tests"]]
    cases = [
        {"test": name, "from": [other for other in tests if other != name], "prediction": prediction(0.0302)}
        for name in tests
    ]
    single = {"test": tests[0], "from": tests[1:2], "prediction": prediction(9.0)}
    (folder / "validation" / "validation.json").write_text(json.dumps({"validations": [*cases, single]}))

    assert main(["report", str(folder), "--quiet"]) in (0, 1)
    report = read_json(folder / "report" / "report.json")
    assert report["gap"]["verdict"] == "coulomb_friction"
    assert report["sizing"]["bridge"]["title"] == "A bridge"
    assert {entry["amplitude"]["median"] for entry in report["crossed"].values()} == {0.0302}
    assert (folder / "report" / "figures" / "gap.svg").read_bytes() == b"<svg/>"
    page = (folder / "report" / "report.html").read_text(encoding="utf-8")
    assert "predicted from the other peak tests" in page
    assert "against amplitude for every test shown and, beside it" in page
    assert "{every}" not in page


def test_a_fit_alone_has_a_report_without_them(results):
    folder, _ = results
    main(["report", str(folder), "--quiet", "--sc", "30"])
    report = read_json(folder / "report" / "report.json")
    assert "gap" not in report
    assert not report["crossed"]
    assert report["predictions"][0]["sc"] == 30.0


@pytest.mark.parametrize("options", [["--effect", "auto"], ["--model", "x.toml"], ["--test", "Sc 1.9"], ["--resume"]])
def test_options_of_a_campaign_are_refused(results, capsys, options):
    folder, _ = results
    assert main(["report", str(folder), *options]) == 2
    assert f"{options[0]}: " in capsys.readouterr().err
    assert not (folder / "report").exists()


def test_a_diagnosis_of_other_records_is_refused(results, capsys):
    folder, summary = results
    origin = dict.fromkeys(summary["provenance"]["sha256"], "00" * 32)
    write_document(folder / "gap.json", GAP | {"format": 1, "provenance": {"sha256": origin}})
    assert main(["report", str(folder)]) == 2
    assert "a diagnosis of another" in capsys.readouterr().err


@pytest.mark.parametrize("where", ["gap.json", "gap/gap.json"])
def test_a_prediction_says_whether_it_contains_what_was_found(results, capsys, where):
    folder, summary = results
    (folder / where).parent.mkdir(exist_ok=True)
    meaning = {"command": "--effect auto", "moves": "It moves by 5 %.", "remarks": [], "text": ""}
    found = GAP | {"format": 1, "indistinguishable": [], "meaning": meaning}
    origin = summary["provenance"]["sha256"]
    write_document(folder / where, found | {"provenance": {"sha256": origin}})
    assert main(["predict", str(folder), "--sc", "30"]) in (0, 1)
    said = " ".join(capsys.readouterr().out.split())
    assert "Diagnosis: The null model and the records part. What explains it: dry friction" in said
    assert said.endswith("These numbers do not contain it: `--effect auto` puts it in. It moves by 5 %.")
    main(["predict", str(folder), "--sc", "30", "--json"])
    assert set(json.loads(capsys.readouterr().out)) == {"predictions"}
    write_document(folder / where, found | {"provenance": {"sha256": dict.fromkeys(origin, "00" * 32)}})
    assert main(["predict", str(folder), "--sc", "30"]) in (0, 1), "one of other records is no matter of a prediction"
    assert "Diagnosis" not in capsys.readouterr().out


def test_a_sizing_from_another_fit_is_refused(results, capsys):
    folder, _ = results
    write_document(folder / "sizing.json", sizing() | {"format": 1, "provenance": {"fit_sha256": {}}})
    assert main(["report", str(folder)]) == 2
    assert "a sizing from another fit" in capsys.readouterr().err


def sized(folder, summary, required):
    """Leave a sizing of this fit there."""
    folder.mkdir(exist_ok=True)
    fit = folder if (folder / "fit.json").exists() else folder.parent
    made_from = {"fit_sha256": provenance_of(fit, summary), "bridge_sha256": {}}
    write_document(folder / "sizing.json", sizing(required) | {"format": 1, "provenance": made_from})


def reported(folder):
    return read_json(folder / "report" / "report.json")["sizing"]["modes"][0]["limits"][0]["required"]["0.95"]


def test_of_several_sizings_the_last_is_reported_and_named(results, capsys):
    folder, summary = results
    for name, required in (("", 0.001), ("sizing", 0.002), ("sizing-2", 0.003), ("sizing-10", 0.004)):
        sized(folder / name, summary, required)
    write_document(folder / "sizing-10" / "sizing.json", sizing() | {"format": 1, "provenance": {"fit_sha256": {}}})
    main(["report", str(folder), "--quiet"])
    assert reported(folder) == 0.003, "that of sizing-10 is of another fit"
    said = capsys.readouterr().err
    assert f"the sizing is that of {folder / 'sizing-2'}; {folder / 'sizing-10'} and " in said
    assert "--sizing DIR takes it" in said
    main(["report", str(folder), "--quiet", "--force", "--sizing", str(folder / "sizing")])
    assert reported(folder) == 0.002
    assert main(["report", str(folder), "--force", "--sizing", str(folder / "none")]) == 2
    assert "no sizing.json" in capsys.readouterr().err


@pytest.fixture
def drawings(monkeypatch):
    """How often the figures of the fit, of which there is one, were drawn."""
    from matplotlib.figure import Figure

    calls = []

    def drawn(*_):
        calls.append("drawn")
        return [FigureWithCaption(Figure((1.0, 1.0)), "records", "a caption", "an alternative")]

    monkeypatch.setattr("scruton.report.figures.all_figures", drawn)
    return calls


def pictures(folder):
    return {path.name: path.read_bytes() for path in (folder / "figures").iterdir()}


def test_figures_of_the_same_fit_are_drawn_once(results, drawings, tmp_path):
    folder, _ = results
    main(["report", str(folder), "--quiet"])
    main(["report", str(folder), "--quiet", "--sc", "30", "-o", str(tmp_path / "again")])
    assert len(drawings) == 1
    assert pictures(tmp_path / "again") == pictures(folder / "report")
    page = (tmp_path / "again" / "report.html").read_text(encoding="utf-8")
    assert "a caption" in page
    assert "an alternative" in page
    assert (
        read_json(tmp_path / "again" / "report.json")["drawn"] == read_json(folder / "report" / "report.json")["drawn"]
    )


@pytest.mark.parametrize("spoilt", ["picture", "note", "fit", "code"])
def test_figures_are_drawn_anew_where_anything_they_are_made_of_changed(results, drawings, spoilt, monkeypatch):
    folder, summary = results
    main(["report", str(folder), "--quiet"])
    before = pictures(folder / "report")
    if spoilt == "picture":
        (folder / "report" / "figures" / "records.svg").write_bytes(b"<svg/>")
    elif spoilt == "note":
        (folder / "report" / "report.json").write_text("{}")
    elif spoilt == "fit":
        write_document(folder / "fit.json", summary | {"flags": ["another"]})
    else:
        monkeypatch.setattr("scruton.report.kept.code_sha256", lambda: "of other code")
    main(["report", str(folder), "--quiet", "--force", "-o", str(folder / "new")])
    assert len(drawings) == 2
    assert pictures(folder / "new") == before


def test_one_sizing_needs_no_word(results, capsys):
    folder, summary = results
    sized(folder / "sizing", summary, 0.002)
    main(["report", str(folder), "--quiet"])
    assert reported(folder) == 0.002
    assert "the sizing is that of" not in capsys.readouterr().err
