"""What the data cannot tell, which record would, and what no record in wind shows."""

from dataclasses import replace

import numpy as np
import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.gap.advise import _records, advise, confusions
from scruton.gap.attribute import Candidate, weigh
from scruton.gap.check import check
from scruton.gap.data import load_gap
from scruton.gap.diagnosis import NONE, Diagnosis, _groups, fit_null
from scruton.gap.further_record import FurtherRecord, expected, in_layout_of, separation, transplanted, with_record
from scruton.gap.hypothesis import Hypothesis
from scruton.gap.invisible import invisible
from scruton.gap.lines import SecondLine
from scruton.gap.meaning import describe_unknown, meaning
from scruton.gap.probability import probabilities
from scruton.gap.search import Place
from scruton.gap.thresholds import WANTED


def weighed(effect: str | None, names: tuple[str, ...], index: int, design: str, severity: float = 0.3) -> Diagnosis:
    """A diagnosis over some effects alone, without the absolute check."""
    campaign, _ = simulate_case(900, index, effect, severity if effect else 0.0, design)
    data, null = fit_null(load_gap(campaign))
    effects = [UNKNOWN if name == UNKNOWN.name else CATALOGUE[name] for name in names]
    found = weigh(null, effects, workers=1)
    gains = {name: c.log_evidence - null.log_evidence for name, c in found.items()} | {NONE: 0.0}
    verdict = effect or NONE
    final = found[effect].best if effect else null
    assert final is not None
    return Diagnosis(
        data, null, (effect,) if effect else (), final, found, found, gains, probabilities(gains, {}, 0.5),
        _groups(gains, verdict), {verdict: check(final)}, (),
    )  # fmt: skip


@pytest.fixture(scope="module")
def alone() -> Diagnosis:
    """One rig, no still air: structural and aerodynamic damping cannot be told apart."""
    names = ("structural_damping_nonlinearity", "aerodynamic_damping_nonlinearity", "fluid_memory", "wind_speed_drift")
    return weighed("structural_damping_nonlinearity", names, 11, "one-rig")


@pytest.fixture(scope="module")
def full() -> Diagnosis:
    names = ("structural_damping_nonlinearity", "aerodynamic_damping_nonlinearity", "fluid_memory")
    return weighed("structural_damping_nonlinearity", names, 11, "full")


@pytest.fixture(scope="module")
def nothing() -> Diagnosis:
    return weighed(None, ("coulomb_friction", "structural_damping_error"), 5, "one-rig")


def test_without_still_air_structure_and_wind_are_one_group(alone: Diagnosis) -> None:
    first = confusions(alone)[0]
    assert first[0] == "structural_damping_nonlinearity"
    assert "aerodynamic_damping_nonlinearity" in first
    assert "wind_speed_drift" not in first


def test_still_air_separates_them(full: Diagnosis) -> None:
    assert confusions(full)[0] == ("structural_damping_nonlinearity",)


def test_advice_is_the_still_air_decay_that_is_missing(alone: Diagnosis) -> None:
    lines = advise(alone)
    against = [line for line in lines if "from aerodynamic_damping_nonlinearity" in line]
    assert len(against) == 1
    assert against[0].startswith("a free decay of rig 1 in still air")


def test_advice_asks_for_nothing_more_where_all_is_told(full: Diagnosis) -> None:
    (line,) = advise(full)
    assert "no further record is needed" in line


def test_friction_hides_behind_none_in_wind_alone(nothing: Diagnosis) -> None:
    first = confusions(nothing)[0]
    assert first[0] == NONE
    assert "coulomb_friction" in first
    assert any("still air" in line and "coulomb_friction" in line for line in advise(nothing))


def test_what_is_nearly_as_probable_is_not_told_apart(full: Diagnosis, nothing: Diagnosis) -> None:
    """Odds of ten by convention; where nothing is found and that is in doubt, the doubt is what to settle first."""
    odds = {"structural_damping_nonlinearity": 0.8, "fluid_memory": 0.11, "aerodynamic_damping_nonlinearity": 0.07}
    doubted = replace(full, probability=odds | {NONE: 0.02})
    assert confusions(doubted)[0] == ("structural_damping_nonlinearity", "fluid_memory")
    likely = {NONE: 0.5, "coulomb_friction": 0.4, "structural_damping_error": 0.1, "fluid_memory": 0.04}
    assert confusions(replace(nothing, probability=likely))[0][:2] == (NONE, "coulomb_friction")
    lines = advise(replace(nothing, probability=likely))
    assert "would tell coulomb_friction as fitted from none" in lines[0]
    assert sum("coulomb_friction" in line for line in lines) == 1
    assert not any("as fitted" in line for line in advise(replace(nothing, probability=likely | {NONE: 0.9})))


def test_a_record_in_wind_tells_less_than_one_in_still_air(alone: Diagnosis) -> None:
    """Friction's twin: the separation is computed, so that it must be small where physics says so."""
    rival = alone.rivals["aerodynamic_damping_nonlinearity"].best
    assert rival is not None
    truth = alone.final.hypothesis, alone.final.mode
    extras = list(_records(alone))
    still = [separation(truth, rival, one) for one in extras if one.still]
    wind = [separation(truth, rival, one) for one in extras if not one.still and one.damping == 1.0]
    assert min(still) > WANTED > max(wind)


def test_a_hypothesis_is_not_told_from_itself(full: Diagnosis) -> None:
    final = full.final
    for extra in list(_records(full))[:6]:
        same = separation((final.hypothesis, final.mode), final, extra)
        assert same == pytest.approx(0.0, abs=1e-9)


def test_a_record_that_nothing_can_be_foreseen_of_is_left_out(full: Diagnosis) -> None:
    final = full.final
    (extra, *_) = _records(full)
    with pytest.raises(LookupError, match="no finite prediction"):
        separation((final.hypothesis, np.full_like(final.mode, np.nan)), final, extra)


def test_the_expected_record_is_what_the_filter_expects(full: Diagnosis) -> None:
    """Innovations of a noise-free run through the filter vanish, against its own standard deviations."""
    r = full.data.middle
    extra = FurtherRecord("", 1.0, r, False, 0.3 * full.data.layout.reference_amplitude, 80)
    data = with_record(full.data, extra)
    hypothesis = in_layout_of(data, full.final.hypothesis)
    u, _ = transplanted(full.final.hypothesis, hypothesis, full.final.mode, full.final.covariance)
    channels = expected(hypothesis, u, extra)
    told = Hypothesis(replace(hypothesis.null, data=replace(data, channels=channels)), hypothesis.variants)
    v, s = told.innovations(u[None])
    z = (v / np.sqrt(s))[0][1:]
    assert np.max(np.abs(z)) < 0.2


def test_old_records_keep_their_coefficients_beside_a_new_one(full: Diagnosis) -> None:
    for extra in (one for one in _records(full) if one.damping == 1.0):
        data = with_record(full.data, extra)
        hypothesis = in_layout_of(data, full.final.hypothesis)
        u, _ = transplanted(full.final.hypothesis, hypothesis, full.final.mode, full.final.covariance)
        before = full.final.hypothesis.table(full.final.mode[None])[0]
        assert np.allclose(hypothesis.table(u[None])[0, :-1], before, rtol=1e-12)


def test_other_damping_moves_the_expected_stable_amplitude(full: Diagnosis) -> None:
    r = full.data.middle
    ends = []
    for damping in (0.5, 1.0, 2.0):
        extra = FurtherRecord("", 1.0, r, False, full.data.layout.reference_amplitude, 400, damping)
        data = with_record(full.data, extra)
        hypothesis = in_layout_of(data, full.final.hypothesis)
        u, _ = transplanted(full.final.hypothesis, hypothesis, full.final.mode, full.final.covariance)
        ends.append(expected(hypothesis, u, extra).amplitude[-1])
    assert ends[0] > ends[1] > ends[2]


def test_what_is_invisible_is_listed_with_bounds(alone: Diagnosis, full: Diagnosis) -> None:
    without, beside = ({one["name"]: one for one in invisible(d)} for d in (alone, full))
    assert set(without) == {"friction_everywhere", "damping_constant", "gain_common", "mass"}
    assert without["friction_everywhere"]["bound"] > 5.0
    assert beside["friction_everywhere"]["bound"] < 1.0
    assert beside["damping_constant"]["bound"] <= without["damping_constant"]["bound"]
    assert all(f"{one['bound']:.2g} %" in one["text"] for one in without.values())
    assert without["gain_common"]["bound"] == beside["gain_common"]["bound"] == 5.0


def test_still_air_alone_has_no_bridge_to_speak_of(full: Diagnosis) -> None:
    campaign = replace(full.data.campaign, tests=())
    data, null = fit_null(load_gap(campaign))
    still = replace(full, data=data, null=null, final=null, found=(), rivals={}, singles={}, groups=())
    assert invisible(still) == []
    assert confusions(still)[0][0] == NONE
    assert advise(still)


@pytest.fixture(scope="module")
def lined(nothing: Diagnosis) -> Diagnosis:
    """A cause that is unknown for a line beside the response alone: no generic term gains anything."""
    record = nothing.data.layout.records[1]
    frequency = nothing.data.cycles[record].reference_frequency
    lines = (SecondLine(record, 1.5 * frequency, 0.002, 90.0), SecondLine(record, 2.0 * frequency, 0.001, 20.0))
    probability = {NONE: 0.05, UNKNOWN.name: 0.95}
    unfit = {UNKNOWN.name: Candidate(UNKNOWN.name, nothing.null.log_evidence - 1.0, None)}
    return replace(
        nothing, found=(UNKNOWN.name,), probability=probability, lines=lines, singles={**nothing.singles, **unfit},
        log_weights={**nothing.log_weights, UNKNOWN.name: 60.0},
    )  # fmt: skip


def test_a_line_beside_the_response_is_what_an_unknown_cause_is_known_by(lined: Diagnosis) -> None:
    record, data = lined.data.layout.records[1], lined.data
    seen = describe_unknown(lined, ())
    frequency = 1.5 * data.cycles[record].reference_frequency
    relative = 100.0 * 0.002 / float(np.median(data.cycles[record].amplitude))
    assert seen["records"] == [record]
    assert seen["lines"] == [{"record": record, "frequency": frequency, "amplitude": 0.002}]
    words = (
        f"{frequency:.4g} Hz in {record} (1.5 times the frequency of the response, {relative:.2g} % of its amplitude)"
    )
    assert words in seen["text"]
    assert meaning(lined)["text"].startswith("It has no equation, and moves no stable amplitude.")
    lines = advise(lined)
    assert words in lines[0]
    assert "second sensor" in lines[0]
    assert "`band`" in lines[1]
    assert not any("a repeat of" in line for line in lines)


def test_what_could_not_be_tested_is_not_called_white(lined: Diagnosis) -> None:
    mark = lined.checks[NONE]
    for colour, coloured, words in ((np.nan, None, "is not tested"), (0.5, False, "white"), (1e-9, True, "lasts")):
        seen = describe_unknown(replace(lined, checks={NONE: replace(mark, colour=colour)}), ())
        assert seen["coloured"] is coloured
        assert words in seen["text"]


def test_without_a_form_the_record_that_misses_most_is_to_be_repeated(lined: Diagnosis) -> None:
    blank = replace(lined, lines=())
    v, s = blank.null.hypothesis.innovations(blank.null.mode[None])
    channels = blank.data.channels
    excess = (v[0] ** 2 / s[0] - 1.0)[: channels.size]
    worst = max(range(len(blank.data.layout.records)), key=lambda r: float(excess[channels.record == r].sum()))
    assert advise(blank)[0].startswith(f"a repeat of {blank.data.layout.records[worst]},")
    assert describe_unknown(blank, ())["form"] == "none of the generic terms"


def test_a_further_effect_that_is_not_settled_has_advice_of_its_own(full: Diagnosis) -> None:
    name = "fluid_memory"
    beside = {name: {name: 0.3, "wind_speed_drift": 0.25, "sensor_gain_error": 0.02, full.verdict: 0.25, "none": 0.4}}
    doubted = replace(full, found=(full.verdict, name), beside=beside, places={name: Place(full.null, full.singles)})
    (line,) = [one for one in advise(doubted) if f"{name} beside {full.verdict}" in one or f"whether {name}" in one]
    assert "would tell" in line
    sure = replace(doubted, beside={name: {name: 0.9}})
    assert not any(f"{name} beside" in one or f"whether {name}" in one for one in advise(sure))
    assert confusions(doubted)[1] == (name, "wind_speed_drift"), "what it is not ten times as probable as"
    assert not any(name in group for group in confusions(sure)[1:])


def test_what_no_record_would_tell_is_no_advice(full: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scruton.gap.advise.separation", lambda *_: 0.0)
    monkeypatch.setattr("scruton.gap.advise.readings", lambda _table, amplitude: amplitude)
    near = {name: full.log_weights[full.verdict] - 1.0 for name in full.log_weights if name != full.verdict}
    close = replace(full, log_weights={**full.log_weights, **near}, probability={full.verdict: 0.9})
    (line,) = advise(close)
    assert line.startswith(f"no single further record would tell {full.verdict} from ")
    assert not any("no single" in one for one in advise(replace(close, probability={full.verdict: 0.5})))


def test_no_rig_with_less_damping_than_the_barest_is_asked_for(full: Diagnosis) -> None:
    layout = full.data.layout
    own = layout.scruton_number[full.data.middle]
    asked = [one.damping * own for one in _records(full) if one.damping != 1.0]
    assert asked
    assert min(asked) > layout.scruton_number[layout.wind].min()
