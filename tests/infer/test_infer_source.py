"""Which envelope feeds the samplers: that the card decides and the results say so, and that either one covers."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scruton.campaign import load_campaign
from scruton.campaign.schema import Kind, Motion, Record
from scruton.dynamics.cycles import EnvelopeData
from scruton.envelope import record_cycles
from scruton.errors import InputError
from scruton.infer.cards import load_card
from scruton.infer.fit import fit_campaign
from scruton.infer.models import WIND, WindPosterior
from scruton.infer.store import load_fit, write_fit
from scruton.simulate import Noise, Truth, simulate_record
from scruton.stats.priors import Prior
from scruton.stats.sampler import sample

QUICK = 'extends = "paper"\n[sampler]\nensembles = 2\nwalkers = 64\ndraws = 16\nmin_ess = 200\nmax_rhat = 1.05\n'


def card_with(folder, source):
    path = folder / "card.toml"
    path.write_text(f'{QUICK}[envelope]\nsource = "{source}"\n', encoding="utf-8")
    return path


def test_the_card_says_what_feeds_the_samplers(small_campaign, tmp_path):
    assert load_card().envelope_source == "regression"
    card = load_card(card_with(tmp_path, "front-end"))
    campaign = load_campaign(small_campaign)
    fit = fit_campaign(campaign, card, thorough=False)
    assert fit.summary["envelope_source"] == "front-end"
    assert fit.summary["provenance"]["settings"]["envelope_source"] == "front-end"
    record = campaign.tests[0].records[0]
    ours = record_cycles(record, campaign.rigs[0].frequency.mean)
    assert (fit.cycles[record.name].amplitude != ours.amplitude).all()
    np.testing.assert_allclose(fit.cycles[record.name].amplitude, ours.amplitude, rtol=0.03)
    low, high = fit.summary["tests"][0]["parameters"]["a_star"]["interval"]["0.95"]
    assert low * 0.98 < 0.0292 < high * 1.02
    write_fit(fit, tmp_path / "out")
    assert json.loads((tmp_path / "out" / "fit.json").read_text())["envelope_source"] == "front-end"
    again = load_fit(tmp_path / "out")
    np.testing.assert_array_equal(again.cycles[record.name].amplitude, fit.cycles[record.name].amplitude)


def test_another_source_is_refused(tmp_path):
    with pytest.raises(InputError, match="regression, front-end"):
        load_card(card_with(tmp_path, "hilbert"))


def records(truth, rng, sensor_noise):
    """A decay and a growth under 1 % turbulence, 500 samples a second."""
    a_star, rate = truth.balance()
    noise = Noise(turbulence=0.01, sensor_noise=sensor_noise * a_star)
    for kind, start in ((Kind.DECAY, rng.uniform(2.2, 2.5)), (Kind.GROWTH, rng.uniform(0.1, 0.2))):
        time, response = simulate_record(
            truth, initial_amplitude=start * a_star, duration=5.5 / rate, sample_rate=500.0,
            seed=int(rng.integers(2**32)), noise=noise,
        )  # fmt: skip
        yield Record(kind.value, Path("simulated.csv"), kind, time, response)


def raw_amplitude(record, frequency):
    """Eq. (3) with its noise left in, and the standard errors of a regression."""
    cycles, ours = record_cycles(record, frequency, "front-end"), record_cycles(record, frequency)
    ratio = 0.5 * np.sqrt(130.0) / (6.0 * 2.0 * np.pi * cycles.reference_frequency / 500.0)
    floor = cycles.noise_sd**2 * (1.0 + ratio**2)
    return replace(ours, amplitude=np.sqrt(cycles.amplitude**2 + floor))


SOURCES = {
    "regression": record_cycles,
    "front-end": lambda record, frequency: record_cycles(record, frequency, "front-end"),
    "raw": raw_amplitude,
}


@pytest.mark.slow
@pytest.mark.parametrize(("sensor_noise", "cases", "seed"), [(0.003, 60, 13), (0.01, 200, 2026), (0.02, 60, 13)])
def test_intervals_cover_from_either_source(sensor_noise, cases, seed, capsys):
    """90 % intervals of a* and lambda over pairs of records of the full equation; the raw Eq. (3) must fail.

    The model allows for gusts, set-points and a departure from the law, of which these truths have none: intervals may
    hold them more often than they say.
    """
    card, rng = load_card("paper"), np.random.default_rng(seed)
    settings = replace(card.sampler, ensembles=2, walkers=128)
    hits = {name: np.zeros(2) for name in SOURCES}
    width = {name: np.zeros(2) for name in SOURCES}
    bias = {name: np.zeros(2) for name in SOURCES}
    for case in range(cases):
        rate = 2 * np.pi * 8.0 * 0.01 * np.exp(0.4 * rng.standard_normal())
        a_star, xi, mass_ratio, K = 0.03 * np.exp(0.4 * rng.standard_normal()), 0.003, 1.2 * 0.075**2 / 7.0, 0.7
        speed = 2 * np.pi * 8.0 * 0.075 / K
        Y1 = 2.0 / mass_ratio * (K * xi - rate * 0.075 / speed)
        epsilon = -np.pi * K / (2.0 * mass_ratio) * rate * 0.075 / speed * a_star / Y1
        truth = Truth(Motion.HEAVING, 0.3, 0.075, 7.0, 8.0, xi, 1.2, speed, Y1, epsilon)
        np.testing.assert_allclose(truth.balance(), (a_star, rate), rtol=1e-6)
        pair = list(records(truth, rng, sensor_noise))
        for name, envelope in SOURCES.items():
            data = EnvelopeData.join({record.kind.value: envelope(record, 8.0) for record in pair})
            priors = (*(card.prior(of, Motion.HEAVING) for of in WIND[:-1]), Prior(WIND[-1], "lognormal", xi, 0.05))
            posterior = WindPosterior(priors, data, (), 2 * np.pi * 8.0)
            chain = sample(posterior, settings, np.random.SeedSequence(case)).chain[..., :2]
            wanted = np.log([a_star, rate / posterior.omega0])
            low, high = np.quantile(chain, [0.05, 0.95], axis=(0, 1))
            hits[name] += (low < wanted) & (wanted < high)
            width[name] += (high - low) / cases
            bias[name] += (chain.mean(axis=(0, 1)) - wanted) / chain.std(axis=(0, 1)) / cases
    with capsys.disabled():
        for name in SOURCES:
            print(f"\n{sensor_noise:g} {name}: holds {hits[name] / cases}, width {width[name]}, bias {bias[name]}")
    error = 3 * np.sqrt(0.9 * 0.1 / cases)
    for name in ("regression", "front-end"):
        assert (hits[name] / cases > 0.9 - error).all(), (name, hits[name] / cases)
    np.testing.assert_allclose(width["front-end"], width["regression"], rtol=0.15)
    if sensor_noise > 0.01:
        assert (hits["raw"] / cases).min() < 0.7, "a noise floor that is left in must be seen to fail"
