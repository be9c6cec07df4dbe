"""The posterior of a trial function: that it converges, and that integrating a and c out changes nothing."""

from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scruton.campaign import load_campaign
from scruton.campaign.schema import Motion
from scruton.dynamics.cycles import EnvelopeData
from scruton.envelope import demodulate, record_cycles
from scruton.errors import InputError
from scruton.infer.cards import load_card
from scruton.infer.fit import TRIAL_PRIORS
from scruton.infer.models import TrialPosterior
from scruton.stats.posterior import Posterior
from scruton.stats.sampler import sample

CARD = load_card()
EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rectangle-4to1"


def trial(cycles):
    """The posterior that a fit samples."""
    data = EnvelopeData.join({"record": cycles})
    priors = tuple(replace(CARD.prior(of, Motion.HEAVING), name=name) for name, of in TRIAL_PRIORS.items())
    amplitude = CARD.prior("trial_amplitude", Motion.HEAVING)
    return TrialPosterior(priors, amplitude, data, 2 * np.pi * cycles.reference_frequency, float(data.amplitude.max()))


def wake_oscillator(coupling, epsilon, start, duration, frequency=8.0, rate=400):
    """Growth of a body on springs with a van der Pol wake (Facchinetti, de Langre and Biolley, 2004), at lock-in.

    y'' + 2 xi w y' + w^2 y = M w^2 q,   q'' + epsilon w (q^2 - 1) q' + w^2 q = A y'',   A = 12, xi = 0.2 %
    """
    w = 2 * np.pi * frequency

    def motion(_, state):
        y, v, q, p = state
        acceleration = -0.004 * w * v - w * w * (y - coupling * q)
        return [v, acceleration, p, -epsilon * w * (q * q - 1) * p - w * w * q + 12.0 * acceleration]

    time = np.arange(0.0, duration, 1.0 / rate)
    found = solve_ivp(motion, (0.0, duration), [0.0, 0.0, start, 0.0], t_eval=time, rtol=1e-7, atol=1e-10)
    return time, found.y[0] + 2e-4 * np.random.default_rng(0).standard_normal(time.size)


@pytest.mark.parametrize(
    "wake", [(5e-4, 0.3, 0.1, 20.0), (2e-4, 0.05, 0.1, 40.0), (1e-4, 0.02, 0.02, 40.0)], ids=["fast", "slow", "slower"]
)
def test_growths_of_a_wake_oscillator_converge(wake):
    """With a and c sampled, one ensemble of four kept a mode of its own in each: nested R-hat 1.585."""
    posterior = trial(demodulate(*wake_oscillator(*wake)))
    verdict = sample(posterior, CARD.sampler, np.random.SeedSequence(1)).convergence
    assert verdict.converged
    assert verdict.steps <= 200
    assert verdict.acceptance > 0.3


def test_a_trial_function_is_found_again():
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 12.0, 0.002)
    truth = [0.05, -0.001, 0.07, -0.5]
    a, b, c, d = truth
    curve = a * np.exp(b * t) + c * np.exp(d * t)
    posterior = trial(demodulate(t, curve * np.cos(16 * np.pi * t) + 1e-3 * rng.standard_normal(t.size)))
    samples = sample(posterior, CARD.sampler, np.random.SeedSequence(3))
    found = posterior.constants(samples.chain, np.random.default_rng(0))
    assert (found[1] > found[3]).all()
    time = posterior.data.time - posterior.data.time[0]
    found_curve = found[0][..., None] * np.exp(found[1][..., None] * time)
    found_curve += found[2][..., None] * np.exp(found[3][..., None] * time)
    low, high = np.quantile(found_curve, [0.01, 0.99], axis=(0, 1))
    true_curve = np.interp(posterior.data.time, t, curve)
    assert ((low < true_curve) & (true_curve < high)).mean() > 0.8


def test_constants_are_drawn_from_a_seed():
    posterior = trial(demodulate(*wake_oscillator(5e-4, 0.3, 0.1, 20.0)))
    u = posterior.prior_draws(np.random.default_rng(0), 12).reshape(3, 4, -1)
    one, again, other = (posterior.constants(u, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert one[0].shape == (3, 4)
    assert (one[0] != other[0]).all()
    assert (one[1] == other[1]).all()


class Sampled(Posterior):
    """The same posterior with a and c among what is sampled, its likelihood by a plain filter of the residual."""

    def __init__(self, integrated):
        self.integrated = integrated

    @cached_property
    def priors(self):
        of = self.integrated.amplitude
        return (*self.integrated.priors, *(replace(of, name=name) for name in ("a", "c")))

    def log_likelihood(self, u):
        of, data, named = self.integrated, self.integrated.data, self.named(u)
        (b, d), (sd, rate), r = of.rates(u), of.residual(u), np.exp(named["noise_factor"])
        state, variance, total = np.zeros(len(u)), sd**2, np.zeros(len(u))
        time = data.time - data.time[0]
        for k in range(data.size):
            if k:
                forget = np.exp(-rate * (time[k] - time[k - 1]))
                state, variance = state * forget, sd**2 + forget**2 * (variance - sd**2)
            s = variance + (r * data.standard_error[k]) ** 2
            curve = of.scale * (named["a"] * np.exp(b * time[k]) + named["c"] * np.exp(d * time[k]))
            v = data.amplitude[k] - curve - state
            total -= 0.5 * (v**2 / s + np.log(2 * np.pi * s))
            state, variance = state + variance / s * v, variance * (1 - variance / s)
        return total

    def guesses(self, rng, size):
        u = self.integrated.guesses(rng, size)
        a, _, c, _ = self.integrated.constants(u, rng)
        return np.column_stack([u, a / self.integrated.scale, c / self.integrated.scale])


def test_sampling_a_and_c_gives_the_same_posterior():
    settings = replace(CARD.sampler, ensembles=2, walkers=128, draws=32, min_ess=4000)
    campaign = load_campaign(EXAMPLE)
    test = campaign.test("Sc 78.1")
    record = next(record for record in test.records if record.kind == "decay")
    posterior = trial(record_cycles(record, campaign.rig(test.rig).frequency.mean))
    integrated = sample(posterior, settings, np.random.SeedSequence(1))
    a, b, c, d = posterior.constants(integrated.chain, np.random.default_rng(1))
    slow = Sampled(posterior)
    sampled = sample(slow, settings, np.random.SeedSequence(2))
    assert integrated.convergence.converged
    assert sampled.convergence.converged
    assert integrated.convergence.acceptance > sampled.convergence.acceptance
    named, names = slow.named(sampled.chain), ("trial_residual", "trial_residual_rate", "noise_factor")
    want = [named["a"] * posterior.scale, slow.integrated.rates(sampled.chain)[0], named["c"] * posterior.scale]
    want += [slow.integrated.rates(sampled.chain)[1], *(named[name] for name in names)]
    got = [a, b, c, d, *(posterior.named(integrated.chain)[name] for name in names)]
    for one, other in zip(got, want, strict=True):
        assert abs(np.median(one) - np.median(other)) < 0.1 * other.std()
        low, high = np.quantile(one, [0.05, 0.95])
        assert 0.88 < ((low < other) & (other < high)).mean() < 0.92


def test_a_card_gives_a_and_c_a_normal_prior(tmp_path):
    path = tmp_path / "card.toml"
    path.write_text(
        'extends = "default"\n[priors.trial_amplitude]\nfamily = "uniform"\nlow = -3.0\nhigh = 3.0\n'
        'unit = "largest amplitude of the record"\nreason = "bounded"\n'
    )
    with pytest.raises(InputError, match="normal"):
        load_card(path)
