"""Stable amplitudes of a hypothesis, the density of records left out, and how far the gap shrinks."""

import json
from dataclasses import replace

import numpy as np
import pytest

from scruton.calibrate.challenge.case import simulate_case
from scruton.campaign.schema import Campaign
from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.limit_cycle import limit_cycle_amplitude
from scruton.gap.attribute import Candidate
from scruton.gap.check import check
from scruton.gap.data import load_gap
from scruton.gap.density import density, posterior_at_mode, posterior_without, restricted
from scruton.gap.diagnosis import NONE, Diagnosis, fit_null
from scruton.gap.held_out import halves, without
from scruton.gap.hypothesis import FittedHypothesis
from scruton.gap.shrink import shrink
from scruton.report.chapters.gap_tables import held_out_table
from scruton.report.chapters.gap_words import shrink_sentence
from scruton.report.wording import TERMINAL


def diagnosed(campaign: Campaign, effect: str | None, label: str = "", rival: str = "") -> Diagnosis:
    """A diagnosis by hand: the effect named, in one form, and one rival."""
    data, null = fit_null(load_gap(campaign))

    def fit(name: str, wanted: str) -> FittedHypothesis:
        variants = (UNKNOWN if name == "unknown" else CATALOGUE[name]).variants(data.layout)
        one = null.hypothesis.extended(next(v for v in variants if v.label.startswith(wanted)))
        return one.fit(
            one.start_from(null.mode, {p.name: np.full(p.size, p.starts[0]) for p in one.variants[-1].parameters})
        )

    fits = {effect: fit(effect, label)} if effect else {}
    if rival:
        fits[rival] = fit(rival, "")
    weights = {name: e.log_evidence - null.log_evidence for name, e in fits.items()} | {NONE: 0.0}
    final = fits[effect] if effect else null
    candidates = {name: Candidate(name, e.log_evidence, e) for name, e in fits.items()}
    found = (effect,) if effect else ()
    return Diagnosis(
        data, null, found, final, candidates, candidates, weights, {name: 1.0 / len(weights) for name in weights},
        (found,) if found else (), {effect or NONE: check(final)}, (),
    )  # fmt: skip


@pytest.fixture(scope="module")
def bent() -> tuple[Diagnosis, dict]:  # type: ignore[type-arg]
    campaign, answer = simulate_case(900, 1, "structural_damping_nonlinearity", 0.4)
    return diagnosed(campaign, "structural_damping_nonlinearity", "as A^2, in every rig alike", "fluid_memory"), answer


@pytest.fixture(scope="module")
def clean() -> Diagnosis:
    return diagnosed(simulate_case(900, 2, None, 0.0)[0], None, rival="structural_damping_nonlinearity")


def table(**terms: float) -> np.ndarray:
    row = np.zeros((1, COLUMNS))
    for name, value in terms.items():
        row[0, Term[name.upper()]] = value
    return row


KNOTS = np.linspace(-6.0, 0.0, HATS)


def test_the_bare_law_settles_at_drive_over_damping() -> None:
    assert limit_cycle_amplitude(table(structural=0.3, aero=0.7, drive=0.05), KNOTS, 0.05)[0] == pytest.approx(
        0.05, rel=1e-9
    )


def test_a_square_term_settles_at_the_root_of_its_cubic() -> None:
    a = limit_cycle_amplitude(table(structural=0.3, aero=0.7, drive=0.05, aero_square=200.0), KNOTS, 0.05)[0]
    roots = np.roots([200.0, 0.0, 1.0, -0.05])
    assert a == pytest.approx(float(roots[np.abs(roots.imag) < 1e-12].real[0]), rel=1e-9)


def test_friction_above_the_drive_lets_the_motion_die() -> None:
    assert limit_cycle_amplitude(table(aero=1.0, drive=0.05, friction=0.06, friction_width=1e-5), KNOTS, 0.05)[0] == 0.0


def test_of_two_stable_amplitudes_growth_reaches_the_smaller() -> None:
    # da/dt/a = 1/a (a - 0.01)(a - 0.02)(0.05 - a), up to a constant, by parts of the aerodynamic damping
    c, l1, l2, l3 = 0.01 * 0.02 * 0.05, 0.01 * 0.02 + 0.05 * 0.03, -0.08, 1.0
    row = table(drive=c, aero=l1, aero_linear=l2, aero_square=l3)
    assert limit_cycle_amplitude(row, KNOTS, 0.05)[0] == pytest.approx(0.01, rel=1e-6)


def test_friction_does_not_go_to_the_bridge(bent: tuple[Diagnosis, dict]) -> None:  # type: ignore[type-arg]
    diagnosis, answer = bent
    h, u, r = diagnosis.final.hypothesis, diagnosis.final.mode[None], diagnosis.data.middle
    here, there = h.stable_amplitude(u, r)[0], h.stable_amplitude(u, r, bridge=True)[0]
    rig = answer["rigs"][1]
    assert here == pytest.approx(rig["stable_amplitude"], rel=0.02)
    assert there == pytest.approx(rig["stable_amplitude_without"], rel=0.05)


def test_other_scruton_numbers_of_the_answer_are_predicted(bent: tuple[Diagnosis, dict]) -> None:  # type: ignore[type-arg]
    diagnosis, answer = bent
    for one in answer["held_out"]:
        a = diagnosis.final.hypothesis.stable_amplitude(
            diagnosis.final.mode[None], diagnosis.data.middle, scruton_number=one["scruton_number"]
        )[0]
        assert a == pytest.approx(one["stable_amplitude"], rel=0.03)


def test_leaving_cycles_out_leaves_priors_of_what_was_theirs(clean: Diagnosis) -> None:
    layout = clean.data.layout
    out = layout.test == 0
    known = posterior_without(clean.null, out)
    where = clean.null.hypothesis.slices[None, "detuning"].start + np.flatnonzero(out)
    assert np.allclose(known.mean[where], 0.0, atol=1e-6)
    assert np.allclose(np.sqrt(np.diag(known.covariance))[where], 0.02, rtol=1e-3)


def test_a_setting_without_records_has_gusts_like_the_others(clean: Diagnosis) -> None:
    out, slices = clean.data.layout.test == 0, clean.null.hypothesis.slices
    known = posterior_without(clean.null, out)
    sd = np.sqrt(np.diag(known.covariance))
    for name in ("scatter", "gust_scatter", "gust_time"):
        first, *others = range(slices[None, name].start, slices[None, name].start + 3)
        assert known.mean[first] == pytest.approx(known.mean[others].mean())
        assert sd[first] == pytest.approx(0.2 * np.sqrt(1.5))
    assert sd[slices[None, "set_point_scatter"]] < 0.81  # what the other settings say of it stays


def test_density_of_a_record_is_the_integral_that_importance_sampling_finds(clean: Diagnosis) -> None:
    """Laplace's joint density against sampling from a wide normal at the peak."""
    out = np.arange(len(clean.data.layout.records)) == 0
    known = posterior_without(clean.null, clean.data.layout.test == 0)
    scored = density(known, out)
    part = restricted(known.hypothesis, out)
    free = known.covariance[scored.where, scored.where] > 0.0
    inside = scored.where[free]
    prior = known.covariance[np.ix_(inside, inside)]
    posterior = 1.2 * np.linalg.inv(np.linalg.inv(prior) + scored.information[np.ix_(free, free)])
    rng = np.random.default_rng(3)
    root = np.linalg.cholesky(posterior)
    z = rng.standard_normal((4000, inside.size))
    u = np.repeat(scored.at[None], len(z), axis=0)
    u[:, inside] += z @ root.T

    def normal(x: np.ndarray, cov: np.ndarray) -> np.ndarray:
        solved = np.einsum("wi,ij,wj->w", x, np.linalg.inv(cov), x)
        return -0.5 * (solved + np.linalg.slogdet(2.0 * np.pi * cov)[1])

    like = np.concatenate([part.log_prob(chunk)[0] for chunk in np.array_split(u, 20)])
    log_w = like + normal(u[:, inside] - known.mean[inside], prior) - normal(z @ root.T, posterior)
    sampled = float(np.log(np.mean(np.exp(log_w - log_w.max()))) + log_w.max())
    assert not known.stated or out.sum() == 1
    stated = sum(-0.5 * np.log(2.0 * np.pi * sd**2) for sd in known.stated.values())
    if known.stated:
        at = np.array(list(known.stated))
        sds = np.array(list(known.stated.values()))
        log_w = log_w - 0.5 * np.sum((u[:, at] / sds) ** 2, axis=1) + stated
        sampled = float(np.log(np.mean(np.exp(log_w - log_w.max()))) + log_w.max())
    assert scored.value == pytest.approx(sampled, abs=0.4)


def test_shares_of_records_add_up(clean: Diagnosis) -> None:
    fold = clean.data.layout.test == 1
    scored = density(posterior_at_mode(clean.null, fold), fold)
    assert np.nansum(scored.shares) == pytest.approx(scored.value)
    assert np.isnan(scored.shares[~fold]).all()


def test_only_keeps_the_numbers_of_records(clean: Diagnosis) -> None:
    mask = clean.data.layout.test == 2
    part = restricted(clean.null.hypothesis, mask).data.channels
    assert set(part.record.tolist()) == set(np.flatnonzero(mask).tolist())


def test_the_right_effect_closes_the_gap_and_a_wrong_one_does_not(bent: tuple[Diagnosis, dict]) -> None:  # type: ignore[type-arg]
    found = shrink(bent[0])
    assert found["measurable"]
    assert found["held_out"]["fraction"] is not None
    assert found["held_out"]["fraction"] > 0.9
    assert found["held_out"]["interval90"] is not None
    assert found["held_out"]["interval90"][0] > 0.8
    assert found["fraction"] is not None
    assert found["fraction"] > 0.9
    assert found["runner_up"] is not None
    assert found["runner_up"]["fraction"] is not None
    assert found["runner_up"]["fraction"] < found["held_out"]["fraction"] - 0.2
    assert len(found["stable_amplitude"]) == 3
    before, after = (sum(s[key] for s in found["stable_amplitude"]) for key in ("error_before", "error_after"))
    assert before > 3.0 * after
    d = found["damping_discrepancy"]
    assert d is not None
    assert d["after"] < 0.5 * d["before"]
    assert d["held_out_after"] < 0.5 * d["held_out_before"]


def test_without_a_gap_there_is_nothing_to_measure(clean: Diagnosis) -> None:
    wrong = replace(clean, found=("structural_damping_nonlinearity",),
                    final=clean.singles["structural_damping_nonlinearity"].best)  # fmt: skip
    for diagnosis in (clean, wrong):
        found = shrink(diagnosis)
        assert not found["measurable"]
        assert found["held_out"]["fraction"] is None
        assert found["held_out"]["interval90"] is None


def test_the_object_of_the_file_is_plain_json(bent: tuple[Diagnosis, dict]) -> None:  # type: ignore[type-arg]
    found = json.loads(json.dumps(shrink(bent[0])))
    assert {"metric", "before", "after", "fraction", "interval90", "held_out", "runner_up", "stable_amplitude",
            "damping_discrepancy", "measurable"} <= set(found)  # fmt: skip
    assert {"records", "before", "after", "fraction", "interval90"} == set(found["held_out"])
    assert found["held_out"]["fraction"] == pytest.approx(
        1.0 - found["held_out"]["after"] / found["held_out"]["before"]
    )
    assert len(found["held_out"]["records"]) == 12


def test_one_rig_leaves_single_records_out() -> None:
    campaign, _ = simulate_case(900, 3, "aerodynamic_damping_nonlinearity", 0.4, "one-rig")
    found = shrink(diagnosed(campaign, "aerodynamic_damping_nonlinearity", "a part in A^2"))
    assert len(found["held_out"]["records"]) == 4
    assert found["stable_amplitude"] == found["not_foretold"] == []
    assert found["held_out"]["fraction"] is not None
    assert found["held_out"]["fraction"] > 0.5
    curves, head, levels = found["damping_discrepancy"], found["headline"], found["stable_amplitude_of_records"]
    assert curves["tests"] == []
    assert [one["record"] for one in curves["records"]] == found["held_out"]["records"]
    assert [one["record"] for one in levels] == found["held_out"]["records"], "all four settle"
    assert head == {
        "test": "test 1", "records": 4, "amplitudes": 4,
        "amplitude_before": np.median([one["error_before"] for one in levels]),
        "amplitude_after": np.median([one["error_after"] for one in levels]),
        "amplitude_worse": sum(one["error_after"] > one["error_before"] for one in levels),
        "damping_before": curves["held_out_before"], "damping_after": curves["held_out_after"],
        "damping_worse": sum(one["after"] > one["before"] for one in curves["records"]),
    }  # fmt: skip
    assert head["damping_after"] < 0.7 * head["damping_before"]
    assert curves["held_out_before"] != curves["before"], "held out is not in sample"
    said = shrink_sentence(found)
    assert said.startswith("Of the records of test 1 left out in turn, the damping curve is off by ")
    assert "the stable amplitude, which 4 of 4 show, by " in said
    assert "There is no other test to leave out: how it is at another Scruton number is not tested." in said
    table = held_out_table({"shrink": found}, TERMINAL, "A/D")
    assert [row[0] for row in table.rows] == found["held_out"]["records"]
    assert [row[3] for row in table.rows] == [f"{100.0 * one['error_before']:.1f} %" for one in levels]
    unsettled = found | {"stable_amplitude_of_records": levels[1:]}
    assert held_out_table({"shrink": unsettled}, TERMINAL, "A/D").rows[0][2:5] == (TERMINAL.missing,) * 3


def test_a_record_that_has_not_settled_shows_no_stable_amplitude() -> None:
    campaign, _ = simulate_case(900, 3, "aerodynamic_damping_nonlinearity", 0.4, "one-rig")
    (test,) = campaign.tests
    short = []
    for record in test.records[:3]:
        keep = record.time - record.time[0] < 0.2 * np.ptp(record.time)
        short.append(replace(record, time=record.time[keep], response=record.response[keep]))
    cut = replace(campaign, tests=(replace(test, records=(*short, *test.records[3:])),))
    found = shrink(diagnosed(cut, "aerodynamic_damping_nonlinearity", "a part in A^2"))
    assert found["stable_amplitude_of_records"] == [], "one alone has no other to be foretold by"
    assert set(found["headline"]) == {"test", "records", "damping_before", "damping_after", "damping_worse"}
    assert "stable amplitude" not in shrink_sentence({"headline": found["headline"]} | found | {"runner_up": None})


def test_what_every_test_has_by_its_own_is_foretold_of_none() -> None:
    campaign, _ = simulate_case(900, 6, "setting_dependence", 0.3)
    found = shrink(diagnosed(campaign, "setting_dependence", "Y1 of every test by its own"))
    assert found["not_foretold"] == ["setting_dependence"]
    said = shrink_sentence(found | {"measurable": True})
    assert "has values of its own in every test: of a test that is not there it says nothing" in said
    assert said.index("has values of its own") < said.index("Put into the model")


def test_the_test_that_stays_far_off_is_told_beside_the_median() -> None:
    """A gain beside a bent damping was lost: two tests were foretold to 0.2 %, and nothing was said of the third."""
    campaign, _ = simulate_case(900, 3, "aerodynamic_damping_nonlinearity", 0.3)
    found = shrink(diagnosed(campaign, "aerodynamic_damping_nonlinearity", "a part in A^2")) | {"measurable": True}
    errors = {one["test"]: one["error_after"] for one in found["stable_amplitude"]}
    worst = found["headline"]["worst"]
    assert worst == {"test": max(errors, key=errors.__getitem__), "error": max(errors.values())}
    assert "still by" not in shrink_sentence(found)
    for error, said in ((0.242, "(in test 3 still by 24 %)"), (None, "(in test 3 still by more than any measure)")):
        head = found["headline"] | {"worst": {"test": "test 3", "error": error}}
        assert said in shrink_sentence(found | {"headline": head})


def test_still_air_alone_has_no_stable_amplitude_but_a_damping_curve() -> None:
    campaign, _ = simulate_case(900, 1, "structural_damping_nonlinearity", 0.4)
    still = replace(campaign, tests=())
    found = shrink(diagnosed(still, "structural_damping_nonlinearity", "as A^2, in every rig alike"))
    assert found["stable_amplitude"] == []
    curves, head = found["damping_discrepancy"], found["headline"]
    assert curves["tests"] == []
    assert [one["record"] for one in curves["records"]] == found["held_out"]["records"]
    assert head == {
        "records": 6, "damping_before": curves["held_out_before"], "damping_after": curves["held_out_after"],
        "damping_worse": sum(one["after"] > one["before"] for one in curves["records"]),
    }  # fmt: skip
    assert head["damping_after"] < 0.5 * head["damping_before"]
    said = shrink_sentence(found)
    assert said.startswith("Of records left out in turn, the damping curve is off by ")
    assert " of the structural damping after" in said
    assert len(found["held_out"]["records"]) == 6
    assert found["held_out"]["fraction"] is not None
    assert found["held_out"]["fraction"] > 0.8


def test_what_cannot_be_told_from_the_verdict_runs_up_to_nothing() -> None:
    campaign, _ = simulate_case(900, 1, "structural_damping_nonlinearity", 0.4)
    still = replace(campaign, tests=())
    verdict, rival = "structural_damping_nonlinearity", "coulomb_friction"
    diagnosis = diagnosed(still, verdict, "as A^2, in every rig alike", rival)
    assert shrink(diagnosis)["runner_up"]["effect"] == rival
    assert shrink(diagnosis, alike=(verdict, rival))["runner_up"] is None


def test_of_one_record_in_still_air_either_half_of_the_amplitudes_is_foretold_from_the_other() -> None:
    campaign, _ = simulate_case(900, 1, "structural_damping_nonlinearity", 0.4)
    rig = replace(campaign.rigs[0], records=campaign.rigs[0].records[:1])
    alone = replace(campaign, rigs=(rig,), tests=())
    diagnosis = diagnosed(alone, "structural_damping_nonlinearity", "as A^2, in every rig alike")
    found = shrink(diagnosis)
    curves, head, name = found["damping_discrepancy"], found["headline"], rig.records[0].name
    large, small = curves["amplitudes"]
    assert (found["held_out"], curves["records"]) == (None, [])
    assert curves["after"] < curves["before"]
    assert curves["held_out_after"] < 0.5 * curves["held_out_before"]
    cycles = diagnosis.data.channels
    seen = cycles.amplitude[cycles.amplitude > 5.0 * cycles.standard_error]
    assert (small["amplitude"][0], large["amplitude"][1]) == (seen.min(), seen.max())
    assert small["amplitude"][1] == pytest.approx(np.sqrt(seen.min() * seen.max()), rel=0.1)
    assert large["amplitude"][0] == pytest.approx(np.sqrt(seen.min() * seen.max()), rel=0.1)
    assert head == {
        "record": name, "in_wind": False, "damping_before": curves["held_out_before"],
        "damping_after": curves["held_out_after"],
        "damping_worse": sum(one["after"] > one["before"] for one in (large, small)),
    }  # fmt: skip
    said = shrink_sentence(found)
    assert said.startswith(
        f"Of the large and the small amplitudes of {name} left out in turn, the damping curve is off"
    )
    assert " of the structural damping after" in said
    assert "no record can be left out" not in said
    table = held_out_table({"shrink": found}, TERMINAL, "A/D")
    assert [row[:2] for row in table.rows] == [(name, rig.name)] * 2
    assert "structural damping" in table.note


def test_what_is_left_out_of_the_only_record_is_foretold_without_it() -> None:
    """A model that has seen the cycles left out is another one; the cycles before and after them lie on one side."""
    campaign, _ = simulate_case(900, 1, "structural_damping_nonlinearity", 0.4)
    rig = replace(campaign.rigs[0], records=campaign.rigs[0].records[:1])
    data, null = fit_null(load_gap(replace(campaign, rigs=(rig,), tests=())))
    large, small = halves(data)
    assert np.array_equal(large, ~small)
    assert np.flatnonzero(large)[-1] < np.flatnonzero(small)[0], "a decay"
    spoiled = replace(
        null.hypothesis.null, data=replace(data, channels=replace(
            data.channels, amplitude=np.where(small, 3.0 * data.channels.amplitude, data.channels.amplitude),
        )),
    )  # fmt: skip
    other = replace(null, hypothesis=replace(null.hypothesis, null=spoiled))
    assert without(other, small) == pytest.approx(without(null, small))
    assert without(other, large) != pytest.approx(without(null, large))


def test_a_record_that_spans_little_says_nothing_of_other_amplitudes() -> None:
    campaign, _ = simulate_case(900, 1, "structural_damping_nonlinearity", 0.4)
    rig = replace(campaign.rigs[0], records=campaign.rigs[0].records[:1])
    data = load_gap(replace(campaign, rigs=(rig,), tests=()))
    largest = data.channels.amplitude.max()
    near = replace(data, channels=data.channels.keep(data.channels.amplitude > 0.6 * largest))
    few = replace(data, channels=data.channels.keep(np.arange(data.channels.size) % 20 == 0))
    assert len(halves(data)) == 2
    assert halves(near) == halves(few) == halves(load_gap(campaign)) == ()


@pytest.mark.parametrize(("seed", "told"), [(3, False), (7, True)])
def test_of_one_record_in_wind_a_damping_curve_is_foretold_if_its_transient_lasts(seed: int, told: bool) -> None:
    """Of three cycles below the middle of its amplitudes nothing is: what was in sample stood here as held out."""
    campaign, _ = simulate_case(900, seed, "aerodynamic_damping_nonlinearity", 0.4, "one-rig")
    (test,) = campaign.tests
    alone = replace(campaign, tests=(replace(test, records=test.records[:1]),))
    found = shrink(diagnosed(alone, "aerodynamic_damping_nonlinearity", "a part in A^2"))
    curves, head = found["damping_discrepancy"], found["headline"]
    assert (found["held_out"], curves["tests"]) == (None, [])
    assert found["stable_amplitude"] == found["stable_amplitude_of_records"] == []
    assert (curves["held_out_before"] is not None, head is not None, "amplitudes" in curves) == (told, told, told)
    if told:
        assert (head["record"], head["in_wind"]) == (test.records[0].name, True)
        assert " of the relaxation damping after" in shrink_sentence(found)


@pytest.mark.parametrize(
    ("error", "said"), [(0.0071, True), (0.034, True), (0.036, False), (0.5, False), (None, False)]
)
def test_a_runner_up_that_foretells_the_amplitude_better_is_said(error: float | None, said: bool) -> None:
    head = {"tests": 3, "amplitude_before": 0.086, "amplitude_after": 0.071, "amplitude_worse": 1}
    runner = {"effect": "wind_speed_drift", "fraction": 0.51, "amplitude_error": error}
    held = {"fraction": 0.87, "interval90": [0.7, 0.9]}
    entry = {"fraction": 0.9, "interval90": [0.8, 0.95], "held_out": held, "headline": head, "runner_up": runner}
    assert ("the verdict is not the best account" in shrink_sentence(entry)) == said
    small = entry | {"headline": head | {"amplitude_after": 0.009}, "runner_up": runner | {"amplitude_error": 0.001}}
    assert "not the best account" not in shrink_sentence(small), "less than one per cent apart"
