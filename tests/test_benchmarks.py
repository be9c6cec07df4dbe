"""The benchmarks run, and the likelihood that the peers are given is ours, with its true gradient."""

import numpy as np
import pytest

from benchmarks import commands, effects, fit, front_end, likelihood, peers, problem
from benchmarks.result import Figure


def theta(posterior, u):
    return np.array([float(one[0]) for one in posterior.state_space(u[None])])


def test_the_likelihood_of_the_peers_is_ours():
    posterior = problem.posterior()
    data = posterior.data
    for u in posterior.prior_draws(np.random.default_rng(0), 20):
        value, _ = peers.value_and_gradient(
            data.amplitude, data.standard_error, data.period[0], theta(posterior, u), posterior.initial_sd**2
        )
        np.testing.assert_allclose(value, posterior.log_likelihood(u[None])[0], rtol=1e-9)


def test_the_gradient_of_the_peers_is_exact():
    posterior = problem.posterior()
    data = posterior.data
    arguments = (data.amplitude, data.standard_error, data.period[0])
    at = theta(posterior, np.log([0.03, 0.015, 0.02, 1.1, 0.0065]))
    _, gradient = peers.value_and_gradient(*arguments, at, 1.0)
    for i in range(4):
        step = np.zeros(4)
        step[i] = 1e-6 * at[i]
        up, down = (peers.value_and_gradient(*arguments, at + sign * step, 1.0)[0] for sign in (1.0, -1.0))
        np.testing.assert_allclose(gradient[i], (up - down) / (2.0 * step[i]), rtol=1e-4)


def test_one_fit_reaches_convergence(monkeypatch):
    monkeypatch.setattr(fit, "REPEATS", 1)
    monkeypatch.setattr(fit, "fit_campaign", lambda *_, **__: None)  # of which it tells the time alone
    figures = {figure.name: figure for figure in fit.run()}
    assert all(figure.met for name, figure in figures.items() if "ESS" in name or "R-hat" in name)


def test_the_likelihood_is_timed():
    assert 0.0 < likelihood.cost(1200, 16) < 1.0


@pytest.mark.parametrize("terms", effects.TERMS.values(), ids=effects.TERMS)
def test_every_effect_is_timed(terms):
    assert 0.0 < effects.cost(terms, 5, cycles=50) < 1.0


def test_the_long_record_is_what_it_says():
    time, response = front_end.record(5000)
    assert time[-1] == 4999 / front_end.RATE
    assert 0.9 < np.abs(response[:200]).max() / problem.FIRST_AMPLITUDE < 1.1


def test_a_missed_limit_is_said():
    assert "MISSED" in str(Figure("time", 2.0, "s", 1.0))
    assert "MISSED" in str(Figure("ratio", 2.0, "times", 10.0, at_least=True))
    assert "MISSED" not in str(Figure("time", 0.5, "s", 1.0))


def test_a_command_that_is_measured_ran_and_one_that_broke_ends_the_benchmark():
    seconds, memory = commands.spent("models")
    assert seconds > 0.1
    assert memory > 10.0
    with pytest.raises(SystemExit, match="ended with 2"):
        commands.spent("check", "no such campaign")
