"""Steady records: what fluctuates under broad-band turbulence tells the rate, what gusts move does not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scruton.calibrate.bodies import draw_campaign
from scruton.calibrate.campaigns import simulate_campaign
from scruton.calibrate.regimes import REGIMES
from scruton.campaign import load_campaign
from scruton.campaign.schema import Kind, Motion
from scruton.dynamics import Setting, force_parameters
from scruton.envelope import Cycles, cycles_from_envelope, demodulate, record_cycles, ring_down
from scruton.envelope.phase_diffusion import periodogram, phase_steps, step_spectrum, unbroken
from scruton.infer.cards import ModelCard, load_card
from scruton.infer.fit import fit_campaign, steady_amplitude
from scruton.infer.models import WIND
from scruton.infer.sampling import Sampling
from scruton.infer.steady import (
    SteadyVerdict,
    _relaxing,
    gust_log_odds,
    judge_steady,
    phase_noise,
    stationary_part,
    steady_posterior,
)
from scruton.simulate import Noise, Truth, simulate_record
from scruton.stats.priors import Prior

FREQUENCY, DAMPING = 8.0, 0.004
OMEGA0 = 2.0 * np.pi * FREQUENCY
PLACE = Setting(Motion.HEAVING, 0.3, 0.075, 7.3, 1.22, 5.1, FREQUENCY, FREQUENCY, DAMPING)


def quick_card(max_steps: int = 4000) -> ModelCard:
    card = load_card("paper")
    return replace(card, sampler=replace(card.sampler, ensembles=2, walkers=64, max_steps=max_steps))


def priors(damping: float = DAMPING) -> tuple[Prior, ...]:
    card = quick_card()
    mine = Prior("damping_ratio", "lognormal", damping, 0.05)
    return (*(card.prior(one, Motion.HEAVING) for one in WIND[:-1]), mine)


def record(
    seed: int, *, ratio: float = 0.02, times: float = 100.0, start: float = 1.0, Y2: float = 0.0, **options: float
) -> Cycles:
    """Envelope of a lock-in record from the full equation of motion; times in relaxation times."""
    rate = ratio * OMEGA0
    Y1, epsilon = force_parameters(0.03, rate, PLACE)
    truth = Truth(
        Motion.HEAVING, 0.3, 0.075, 7.3, FREQUENCY, DAMPING, 1.22, 5.1, float(Y1), float(epsilon), Y2
    )  # fmt: skip
    if "gust_time" in options:
        options["gust_time"] /= rate
    time, response = simulate_record(
        truth, initial_amplitude=start * truth.balance()[0], duration=times / rate, sample_rate=28 * FREQUENCY,
        seed=seed, noise=Noise(**{"turbulence": 0.02, "sensor_noise": 0.0002} | options),
    )  # fmt: skip
    return demodulate(time, response)


def verdict(cycles: Cycles, seed: int = 0, damping: float = DAMPING) -> tuple[SteadyVerdict, np.ndarray]:
    """The verdict on a record, and the draws of ln(lambda/omega0) of it by itself."""
    posterior = steady_posterior("x.csv", cycles, priors(damping), OMEGA0)
    samples = Sampling(quick_card(), seed).run("x.csv", posterior)
    return judge_steady("x.csv", cycles, samples, posterior), samples.chain[..., 1].ravel()


def failed(one: SteadyVerdict) -> set[str]:
    return {condition.name for condition in one.conditions if not condition.holds}


def walk(rng: np.random.Generator, size: int, rate: float, substeps: int = 40) -> np.ndarray:
    """Cycle means of dx = -rate x dt + dW, cycles of one second, by small steps."""
    noise = rng.standard_normal((size + 200) * substeps) / np.sqrt(substeps)
    x = np.empty(noise.size)
    x[0] = 0.0
    keep = 1.0 - rate / substeps
    for i in range(1, noise.size):
        x[i] = keep * x[i - 1] + noise[i]
    return x.reshape(-1, substeps).mean(axis=1)[200:]


def fake(amplitude: np.ndarray, phase: np.ndarray, error: float) -> Cycles:
    n = amplitude.size
    flat = np.ones(n)
    return Cycles(np.arange(n) + 0.5, amplitude, error * flat, phase, flat, 0.01 * flat, 1.0, error)


def test_periodogram_of_white_noise_has_its_variance() -> None:
    angle, power = periodogram(np.random.default_rng(1).normal(5.0, 3.0, 4001))
    assert angle.size == 2000
    assert 0.0 < angle.min() < angle.max() < np.pi
    assert power.mean() == pytest.approx(9.0, rel=0.1)


def test_step_spectrum_is_that_of_a_walk_averaged_over_its_cycles_with_noise() -> None:
    rng = np.random.default_rng(2)
    a, q, error, powers = 2.0, 0.1, 0.02, []
    for _ in range(40):
        phase = q / a * walk(rng, 512, 0.0) + error / a * rng.standard_normal(512)
        angle, power = periodogram(phase_steps(fake(np.full(512, a), phase, error)))
        powers.append(power)
    slope, floor = step_spectrum(angle, 1.0, error)
    ratio = np.mean(powers, axis=0) / (q**2 * slope + floor)
    for part in np.array_split(ratio, 5):
        assert part.mean() == pytest.approx(1.0, abs=0.06)


def test_phase_noise_finds_the_intensity_with_its_standard_error() -> None:
    rng, z = np.random.default_rng(3), []
    for _ in range(60):
        phase = 0.3 * np.arange(600) + 0.05 * walk(rng, 600, 0.0) + 0.01 * rng.standard_normal(600)
        mean, sd, lines = phase_noise(fake(np.full(600, 2.0), phase, 0.02), 0.3, 0.02)
        z.append((mean - np.log(0.1)) / sd)
    assert lines == 28
    assert abs(np.mean(z)) < 0.4
    assert 0.75 < np.std(z) < 1.25


def test_the_longest_run_without_a_gap_is_taken() -> None:
    one = fake(np.ones(50), np.zeros(50), 0.1)
    gapped = replace(one, time=one.time + 3.0 * (one.time > 20.0))
    assert unbroken(one) == slice(0, 50)
    assert unbroken(gapped) == slice(20, 50)


def test_spectrum_of_a_relaxing_amplitude_is_that_of_its_small_steps() -> None:
    rng, powers = np.random.default_rng(5), []
    for _ in range(40):
        angle, power = periodogram(walk(rng, 400, 0.3, substeps=40) * np.sqrt(0.6))
        powers.append(power)
    ratio = np.mean(powers, axis=0) / _relaxing(np.array([0.3]), 1.0, np.cos(angle))[0]
    for part in np.array_split(ratio, 4):
        assert part.mean() == pytest.approx(1.0, abs=0.06)


def test_a_broken_record_is_not_judged() -> None:
    cycles = record(11, times=40.0)
    gaps = 5.0 * (np.arange(cycles.time.size) // 25) / cycles.reference_frequency
    found, _ = verdict(replace(cycles, time=cycles.time + gaps))
    assert "it holds only 25 adjacent cycles (at least 40)" in found.explain()


def test_gust_odds_speak_for_what_made_the_record() -> None:
    rng = np.random.default_rng(4)
    rate = np.geomspace(0.02, 0.5, 24)
    calm, gusty = [], []
    for _ in range(6):
        own = walk(rng, 1500, 0.1)
        wind = 2.0 * np.sqrt(5.0) * np.sqrt(2 * 0.0125) * walk(rng, 1500, 0.0125)
        followed = np.zeros(1500)
        for k in range(1, 1500):
            followed[k] = followed[k - 1] + (1 - np.exp(-0.1)) * (wind[k] - followed[k - 1])
        q = np.exp(np.linspace(-0.1, 0.1, 9))
        calm.append(gust_log_odds(own, 1.0, rate, np.ones(24), q, 1e-3))
        gusty.append(gust_log_odds(own + followed, 1.0, rate, np.ones(24), q, 1e-3))
    assert np.median(calm) < 0.0
    assert min(gusty) > 0.0


def test_a_clean_record_is_usable_and_tells_the_rate() -> None:
    found, log_ratio = verdict(record(11))
    assert found.usable, found.explain()
    low, high = np.exp(np.quantile(log_ratio, [0.025, 0.975]))
    assert low < 0.02 < high
    assert "record x.csv: lock-in fluctuations are used: innovations are white" in found.explain()


def test_slow_gusts_are_found_and_said() -> None:
    found, log_ratio = verdict(record(12, gust_intensity=0.025, gust_time=6.0))
    assert np.exp(np.quantile(log_ratio, 0.95)) < 0.02  # they would have spoilt the rate
    assert "no slow gusts" in failed(found)
    said = found.explain()
    assert said.startswith("record x.csv: lock-in fluctuations are not used (only the mean amplitude is): ")
    assert "gusts that last 4 to 10 relaxation times are more probable than none (odds " in said


def test_gusts_that_move_the_frequency_fail_the_comparison_with_the_phase() -> None:
    found, _ = verdict(record(13, gust_intensity=0.02, gust_time=6.0, Y2=30.0))
    assert "amplitude against phase" in failed(found)
    ratio = next(one for one in found.conditions if one.name == "amplitude against phase")
    assert ratio.value < ratio.low
    assert ratio.sentence.endswith(": the frequency wanders")


def test_a_short_record_is_not_enough() -> None:
    found, _ = verdict(record(14, times=20.0))
    assert "relaxation times" in failed(found)
    assert "(at least 30 wanted)" in found.explain()


def test_innovations_that_are_not_white_are_said_with_their_p() -> None:
    cycles = record(15)
    beat = 0.04 * np.cos(2 * np.pi * np.arange(cycles.time.size) / 9.0)
    found, _ = verdict(replace(cycles, amplitude=cycles.amplitude * (1 + beat)))
    assert "white innovations" in failed(found)
    assert "innovations are not white (Ljung-Box p = " in found.explain()


def test_an_envelope_without_phase_gives_the_mean_alone() -> None:
    cycles = record(11)
    known = cycles_from_envelope(cycles.time, cycles.amplitude, cycles.reference_frequency)
    found, _ = verdict(known)
    assert not found.usable
    assert "the phase is not known" in found.explain()


def test_a_start_that_has_not_settled_is_left_out() -> None:
    cycles = record(16, start=2.0)
    found, _ = verdict(cycles)
    assert 10 < found.left_out < 60
    assert found.cycles.time.size == cycles.time.size - found.left_out
    assert found.usable, found.explain()
    assert f"its first {found.left_out} cycles, which had not settled, are left out" in found.explain()
    assert stationary_part(record(11)).time.size == record(11).time.size


def test_a_posterior_of_other_cycles_is_refused() -> None:
    cycles = record(11, times=40.0)
    posterior = steady_posterior("x.csv", cycles, priors(), OMEGA0)
    samples = Sampling(quick_card(), 0).run("x.csv", posterior)
    with pytest.raises(ValueError, match=r"record x\.csv .* make it with steady_posterior"):
        judge_steady("x.csv", record(11), samples, posterior)


@pytest.mark.slow
def test_verdicts_over_many_records() -> None:
    """Clean records are used and their rate is right; gusty ones that would spoil it mostly are not used."""

    def study(seed: int, gusty: bool) -> tuple[bool, bool]:
        rng = np.random.default_rng([seed, gusty])
        ratio = float(np.exp(rng.uniform(np.log(0.006), np.log(0.03))))
        options = {
            "times": rng.uniform(60, 200), "turbulence": rng.uniform(0.01, 0.03),
            "sensor_noise": 0.03 * rng.uniform(0.002, 0.01),
        }  # fmt: skip
        if gusty:
            options |= {"gust_intensity": rng.uniform(0.01, 0.03), "gust_time": rng.uniform(2.0, 10.0)}
        found, log_ratio = verdict(record(seed, ratio=ratio, **options), seed)
        low, high = np.quantile(log_ratio, [0.05, 0.95])
        return found.usable, bool(low < np.log(ratio) < high)

    clean = np.array([study(seed, False) for seed in range(7000, 7100)])
    usable = clean[:, 0]
    assert usable.mean() >= 0.9
    assert 0.82 <= clean[usable, 1].mean() <= 0.97
    gusts = np.array([study(seed, True) for seed in range(8000, 8100)])
    spoilt = ~gusts[:, 1]
    assert spoilt.mean() > 0.7
    assert np.mean(~gusts[spoilt, 0]) >= 0.75


@pytest.mark.real
def test_the_measured_lock_in_records_are_not_used(shared_data: Callable[[str], Path]) -> None:
    campaign = load_campaign(shared_data("cylinder-in-wind"))
    frequency = {rig.name: rig.frequency.mean for rig in campaign.rigs}
    damping = {
        rig.name: ring_down([record_cycles(one, frequency[rig.name]) for one in rig.records]).damping_ratio
        for rig in campaign.rigs
    }
    for rig in campaign.rigs:
        steady = {
            one.name: record_cycles(one, frequency[rig.name])
            for test in campaign.tests
            if test.rig == rig.name
            for one in test.records
            if one.kind is Kind.STEADY
        }
        name, cycles = max(steady.items(), key=lambda item: float(item[1].amplitude.mean()))
        posterior = steady_posterior(name, cycles, priors(damping[rig.name]), 2 * np.pi * frequency[rig.name])
        # The posterior piles up where structural damping alone would relax: a rough run is enough to refuse.
        samples = Sampling(quick_card(200), 0).run(name, posterior)
        found = judge_steady(name, cycles, samples, posterior)
        assert not found.usable, found.explain()
        assert {"white innovations", "no slow gusts", "amplitude against phase"} <= failed(found)
        assert found.explain().endswith(": the frequency wanders")


def test_of_records_that_swing_past_their_stable_amplitude_only_where_they_stand_counts():
    regime, base = REGIMES["memory-one-rig"], quick_card()
    drawn, setup, body = draw_campaign(regime, regime.card(base), *np.random.SeedSequence(5).spawn(2))
    campaign = simulate_campaign(regime, drawn, setup, np.random.SeedSequence(6), body.rigs)
    fit = fit_campaign(campaign, base, seed=1, thorough=False)
    [test] = fit.summary["tests"]
    assert [(one["used"], one["conditions"][0]["name"]) for one in test["lock_in"]] == [
        (False, "comes to stand from one side")
    ] * len(campaign.tests[0].records)
    low, high = test["parameters"]["a_star"]["interval"]["0.90"]
    assert low < drawn.a_star[0, 0] < high < 1.1 * low
    assert sum("passes the one where it comes to stand" in flag for flag in fit.flags) == 1, "alike, in one sentence"
    assert not any("filed as" in flag for flag in fit.flags)
    assert any("no growth or decay record" in flag for flag in fit.flags), "nothing tells the rate"


def test_of_a_record_that_beats_the_mean_counts_and_is_known_to_no_better_than_what_it_beats_by():
    t, nothing = np.arange(480) / 8.0, np.zeros(480)
    amplitude = 0.010 - 0.008 * np.cos(2 * np.pi * t / 7.3)
    cycles = Cycles(t, amplitude, np.full(480, 1e-4), nothing, np.full(480, 8.0), nothing, 8.0, 1e-4)
    posterior = steady_posterior("beats", cycles, priors(), OMEGA0)
    samples = Sampling(quick_card(20), 0).run("beats", posterior)
    found = judge_steady("beats", cycles, samples, posterior)
    assert not found.usable
    assert "no one value is stable" in found.explain()
    mean = steady_amplitude(found)
    assert mean.standard_error == pytest.approx(amplitude.std(), rel=0.1)
