"""The verbs from Python: paths as strings, results in brief, figures in axes of one's own."""

import inspect
import logging
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import scruton
from scruton import plot
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Kind
from scruton.documents import write_document
from scruton.errors import InputError
from scruton.infer.store import write_fit
from tests.report.fake_fit import fake_fit

VERBS = (
    "load_campaign",
    "check",
    "fit",
    "load_fit",
    "predict",
    "diagnose",
    "size",
    "criticise",
    "validate",
    "identify",
    "load_bridge",
)
BRIDGE = """
format = 1
title = "A bridge"
width = "12 m"
depth = "3 m"
limits = ["jtg"]

[[modes]]
name = "V1"
frequency = "0.30 Hz"
mass = "20000 kg/m"
length = "400 m"
damping_ratio = 0.003
"""


@pytest.fixture(scope="module")
def fit():
    return fake_fit()


@pytest.fixture(scope="module")
def folder(fit, tmp_path_factory):
    place = tmp_path_factory.mktemp("calls")
    write_fit(fit, place / "fit")
    (place / "bridge.toml").write_text(BRIDGE, encoding="utf-8")
    return place


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_is_typed_and_documented(name):
    verb = getattr(scruton, name)
    assert "Raises" in inspect.getdoc(verb)
    signature = inspect.signature(verb)
    assert signature.return_annotation is not inspect.Signature.empty
    for parameter in signature.parameters.values():
        assert parameter.annotation is not inspect.Signature.empty, parameter.name
        assert parameter.name in inspect.getdoc(verb), parameter.name


@pytest.mark.parametrize("first", ["scruton.report", "import scruton.report.build", "from scruton.report import call"])
def test_the_report_can_be_called_whatever_was_imported_before(first):
    code = f"import scruton\n{first}\nassert callable(scruton.report)\nimport scruton.report.document as d\nd.Code"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_campaign_is_checked_by_its_path(small_campaign):
    found = scruton.check(str(small_campaign))
    assert list(found.records.index) == ["still.csv", "decay.csv", "growth.csv"]
    assert found.records.loc["growth.csv", "frequency"] == pytest.approx(7.87, rel=0.01)
    assert found.problems == ()
    assert scruton.load_campaign(str(small_campaign)).title == found.campaign.title


def test_a_record_that_cannot_be_used_stops_nothing(small_campaign, tmp_path):
    for path in small_campaign.iterdir():
        if path.is_file():
            (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "growth.csv").write_text("time [s],y [m]\n0,nothing\n", encoding="utf-8")
    found = scruton.check(tmp_path)
    assert len(found.problems) == 1
    assert "growth.csv" in str(found.problems[0])


def test_a_prediction_is_the_same_from_fit_tree_and_folder(fit, folder):
    medians = {scruton.predict(of, 30.0).median for of in (fit, fit.tree, folder / "fit", str(folder / "fit"))}
    assert len(medians) == 1
    assert scruton.predict(fit, damping_ratio=0.009).median > 0.0
    with pytest.raises(InputError, match="no design or two"):
        scruton.predict(fit)


def test_a_design_is_one_number_or_a_text(fit):
    spread = scruton.predict(fit, damping_ratio="0.009 +/- 0.003")
    assert spread.median == scruton.predict(fit, damping_ratio=Quantity(0.009, 0.003)).median
    for given in ({"scruton_number": [20, 30]}, {"scruton_number": np.array([20.0, 30.0])}, {"damping_ratio": [0.1]},
                  {"damping_ratio": "much"}, {"scruton_number": "much"}):  # fmt: skip
        with pytest.raises(InputError, match=f"prediction: {next(iter(given))}: found .*much|one call each"):
            scruton.predict(fit, **given)


def test_a_name_by_itself_is_one_name_everywhere(fit, folder, small_campaign, monkeypatch):
    seen = []

    def sampled(campaign, *_, **more):
        seen.append(([test.name for test in campaign.tests], more.get("asked", {}).get("tests")))
        return fit

    monkeypatch.setattr("scruton.infer.fit.fit_campaign", sampled)
    campaign = scruton.load_campaign(small_campaign)
    scruton.fit(campaign, tests="Sc 21.7")
    scruton.fit(campaign, tests=["Sc 21.7"])
    assert seen == [(["Sc 21.7"], ["Sc 21.7"])] * 2
    with pytest.raises(InputError, match='no test "Sc 2"'):
        scruton.fit(campaign, tests="Sc 2")
    with pytest.raises(InputError, match='no test "Sc 2"'):
        scruton.validate(campaign, tests="Sc 2")
    with pytest.raises(InputError, match='no test "Sc 2"'):
        scruton.diagnose(campaign, tests="Sc 2")
    assert len(scruton.check(campaign, tests="Sc 21.7").campaign.tests) == 1
    names = [one.of for one in scruton.compare(fit, fit, tests="Sc 1.9").differences if one.name == "a_star"]
    assert names == ["Sc 1.9"]
    bridge = scruton.load_bridge(folder)
    assert {one.rule for one in scruton.size(fit, bridge, "kd").modes[0].limits} == {"jtg", "kd"}


def test_objects_do_where_paths_do(fit, folder, small_campaign):
    by_path, in_hand = scruton.check(small_campaign), scruton.check(scruton.load_campaign(small_campaign))
    assert in_hand.warnings == by_path.warnings
    assert in_hand.records.equals(by_path.records)
    found, same = scruton.compare(fit, str(folder / "fit")), scruton.compare(fit, fit, scruton_numbers=30.0)
    assert {one.verdict for one in (*found.differences, *same.differences)} == {"alike"}
    assert "amplitude" in {one.name for one in same.differences}


def test_the_quick_estimation_has_a_function(small_campaign, caplog):
    rows = scruton.identify(small_campaign)
    assert [row.record for row in rows] == ["decay.csv", "growth.csv"]
    assert rows[0].Y1 == scruton.check(small_campaign).identified[0].Y1
    assert scruton.identify(small_campaign, "polynomial 8", tests="Sc 21.7")[0].Y1 != rows[0].Y1
    with pytest.raises(InputError, match='found "spline"; wanted one of: "second-order exponential", "polynomial"'):
        scruton.identify(small_campaign, "spline")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda campaign, _: scruton.fit(campaign, seed=-1), "fit: seed: found -1; wanted a whole number, zero"),
        (lambda campaign, _: scruton.fit(campaign, seed="a"), "fit: seed: found 'a'"),
        (lambda campaign, _: scruton.fit(campaign, out=campaign / "campaign.toml"), "campaign.toml: out: found a file"),
        (lambda _, fit: scruton.fit(fit), "campaign: found a Fit; wanted a Campaign, its folder, or its campaign.toml"),
        (lambda campaign, _: scruton.validate(campaign, seed=1.5), "validation: seed: found 1.5"),
        (lambda campaign, _: scruton.diagnose(campaign, scruton_numbers="x"), "diagnosis: scruton_numbers: found 'x'"),
        (lambda _, fit: scruton.predict(fit, 30.0, law_n=np.inf), "prediction: law_n: found inf; wanted a number"),
        (lambda _, fit: scruton.predict(fit, 30.0, seed=1.5), "prediction: seed: found 1.5"),
        (lambda _, fit: scruton.criticise(fit, [1.0, np.nan]), "criticism: scruton_numbers: found nan"),
        (lambda *_: scruton.predict(None, 30.0), "fit: found a NoneType; wanted a Fit, or the folder of one"),
        (lambda *_: scruton.load_bridge("x", "swaying"), "bridge: motion: found 'swaying'; wanted one of: heaving"),
    ],
)  # fmt: skip
def test_what_no_call_takes_is_refused_before_any_work(fit, small_campaign, monkeypatch, call, message):
    """A folder that cannot be written to lost a whole fit; a law that is no number gave a prediction of none."""
    monkeypatch.setattr("scruton.infer.fit.fit_campaign", None)
    with pytest.raises(InputError, match=message):
        call(small_campaign, fit)


def test_the_quick_estimation_says_why_no_transient_is_left(small_campaign):
    campaign = scruton.load_campaign(small_campaign)
    (test,) = campaign.tests
    decay, growth = test.records
    noise = replace(decay, response=np.random.default_rng(2).standard_normal(decay.time.size))
    stands = replace(growth, kind=Kind.STEADY)
    with pytest.raises(InputError, match=r"no transient decay\.csv: set aside: no .*; wanted a growth or a decay"):
        scruton.identify(replace(campaign, tests=(replace(test, records=(noise, stands)),)))
    with pytest.raises(InputError, match=r"decay\.csv: tests\[0\]\.records\[0\]: found no line in the spectrum"):
        scruton.identify(replace(campaign, tests=(replace(test, records=(noise,)),)))


def test_a_fit_carries_an_effect(fit, monkeypatch, small_campaign):
    seen = []
    monkeypatch.setattr("scruton.infer.fit.fit_campaign", lambda *_, **__: fit)
    monkeypatch.setattr(
        "scruton.app.fit.carry", lambda fit, read, effect, seed, _: seen.append((fit, read.title, effect, seed))
    )
    scruton.fit(small_campaign, effect="auto", seed=3)
    assert seen == [(fit, scruton.load_campaign(small_campaign).title, "auto", 3)]
    with pytest.raises(InputError, match='fit: effect: found "friction"; wanted "coulomb_friction"'):
        scruton.fit(small_campaign, effect="friction")


@pytest.fixture(scope="module")
def sizing(fit, folder):
    return scruton.size(fit, folder)


@pytest.fixture(scope="module")
def strict_sizing(fit, folder):
    return scruton.size(fit, scruton.load_bridge(str(folder / "bridge.toml")), ["0.001 m"])


def test_a_bridge_is_sized_by_its_path(folder, sizing, strict_sizing):
    assert sizing.to_json() == scruton.size(str(folder / "fit"), str(folder / "bridge.toml")).to_json()
    assert strict_sizing.modes[0].governing != sizing.modes[0].governing
    drawn = plot.risk(sizing)
    assert drawn.axes[0].get_xlabel().startswith("Added damping")
    with pytest.raises(InputError, match="V9"):
        plot.risk(sizing, mode="V9")


def test_a_sizing_is_found_in_the_folder_of_its_fit(fit, sizing, strict_sizing, tmp_path):
    write_fit(fit, tmp_path)
    with pytest.raises(InputError, match="found nothing; wanted a folder that `scruton size` wrote"):
        plot.risk(tmp_path)
    for name, one in (("sizing", sizing), ("sizing-2", strict_sizing)):
        (tmp_path / name).mkdir()
        write_document(tmp_path / name / "sizing.json", one.to_json())
    assert plot.risk(tmp_path).axes[0].get_xlabel().startswith("Added damping")
    last = scruton.load_sizing(tmp_path / "sizing-2").to_json()
    assert scruton.load_sizing(str(tmp_path)).to_json() == last
    assert scruton.load_sizing(tmp_path / "sizing").to_json() != last


def test_results_show_themselves_in_brief(fit, folder, sizing, small_campaign):
    results = [
        fit,
        fit.campaign,
        fit.card,
        scruton.predict(fit, 30.0),
        scruton.load_bridge(folder),
        scruton.check(small_campaign),
    ]
    results.append(sizing)
    for result in results:
        assert repr(result).startswith(f"{type(result).__name__}(")
        assert len(repr(result)) < 400, type(result)
        assert result._repr_html_().startswith("<table>")
    assert "&lt;b&gt;with&lt;/b&gt;" in results[5]._repr_html_(), "what a laboratory writes is text"


def within(value, depth=8):
    """Everything that a user can reach from a result."""
    parts = []
    if is_dataclass(value) and not isinstance(value, type):
        yield value
        parts = [getattr(value, field.name) for field in fields(value)]
    elif isinstance(value, Mapping):
        parts = list(value.values())[:5]
    elif isinstance(value, tuple | list):
        parts = value[:5]
    for one in parts if depth else ():
        yield from within(one, depth - 1)


def test_what_results_consist_of_is_brief_too(fit, folder, sizing, small_campaign):
    checked = scruton.check(small_campaign)
    results = (fit, sizing, scruton.load_bridge(folder), checked, checked.identified)
    found = {type(one): repr(one) for one in within(results)}
    assert len(found) > 30
    assert {kind.__name__: len(line) for kind, line in found.items() if len(line) > 400} == {}
    mode = scruton.load_bridge(folder).modes[0]
    assert repr(mode).startswith("Mode(name=V1, frequency=")
    assert "name=V1" in repr(sizing.modes[0])


def test_flags_and_stages_are_logged(monkeypatch, caplog, fit, small_campaign):
    from dataclasses import replace

    def sampled(*_, report, **__):
        report("test Sc 21.7", 0.1)
        report("test Sc 21.7", 0.9)
        return replace(fit, flags=("look at this",))

    monkeypatch.setattr("scruton.infer.fit.fit_campaign", sampled)
    with caplog.at_level(logging.INFO, logger="scruton"):
        scruton.fit(str(small_campaign))
    said = [(one.levelname, one.getMessage()) for one in caplog.records]
    assert said == [("INFO", "test Sc 21.7"), ("WARNING", "look at this")]


# --- figures ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["griffin", "griffin_reciprocal", "records", "trace", "laws", "aerodynamic_damping"])
def test_a_figure_goes_where_it_is_put(fit, name):
    drawn = getattr(plot, name)(fit)
    panels = [axes for axes in drawn.axes if axes.get_visible()]
    assert panels
    figure = Figure(layout="constrained")
    left, right = figure.subplots(1, 2)
    getattr(plot, name)(fit, ax=right)
    figure.draw_without_rendering()
    assert not left.has_data()
    assert left.get_visible()
    there = [axes for axes in figure.axes if axes is not left and axes.get_visible()]
    assert len(there) == len(panels)
    middle = left.get_window_extent().x1
    assert all(axes.get_window_extent().x0 > middle for axes in there)
    assert {axes.get_ylabel() for axes in there} == {axes.get_ylabel() for axes in panels}


def test_one_panel_is_drawn_in_the_axes_themselves(fit):
    figure = Figure()
    axes = figure.add_subplot()
    assert plot.griffin(fit, axes) is figure
    assert figure.axes[0] is axes
    assert axes.get_legend() is not None
    assert not figure.legends


def test_the_style_of_the_user_stays(fit):
    before = dict(mpl.rcParams)
    plot.griffin(fit, Figure().add_subplot())
    assert dict(mpl.rcParams) == before


def test_a_figure_works_from_disk(folder):
    assert plot.griffin(str(folder / "fit")).axes[0].get_xlabel().startswith("Scruton")


def test_every_figure_of_the_register_has_its_function():
    from scruton.report.figures.registry import registered

    known = {name.replace("-", "_") for name in registered()} - {"gap"}
    assert set(plot.__all__) - {"prior_curves"} == known


def test_two_fits_are_drawn_in_one(fit, folder):
    axes = plot.compare(fit, folder / "fit").axes[0]
    lines = {line.get_label(): line.get_ydata() for line in axes.get_lines()}
    np.testing.assert_array_equal(lines["A, predictive"], lines["B, predictive"])


def test_what_cannot_be_drawn_is_said(fit):
    from dataclasses import replace

    still = replace(fit, tree=fit.tree.drop_nodes("posterior"))
    with pytest.raises(InputError, match="no peak test"):
        plot.compare(fit, still)
    with pytest.raises(InputError, match="page 9"):
        plot.records(fit, page=9)
    with pytest.raises(InputError, match="nobody"):
        plot.trace(fit, test="nobody")
