"""Moves, ensembles, convergence and checkpoints on targets whose answer is known."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import emcee
import numpy as np
import pytest
from scipy import stats

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.stats import sampler
from scruton.stats.convergence import SamplerSettings, judge
from scruton.stats.moves import Sweep, Walkers, sweep
from scruton.stats.optimum import find_optimum
from scruton.stats.posterior import Block, Posterior
from scruton.stats.priors import Prior
from scruton.stats.sampler import Checkpoint, Ensembles, begins_anew, sample
from scruton.stats.student_t import Conditional, Mixture, StudentT, conditional, fit_mixture, maximum_likelihood
from scruton.stats.thresholds import ADAPTATIONS, EARLY

COVARIANCE = np.array([[1.0, 0.6, 0.0, 0.1], [0.6, 1.5, 0.2, 0.0], [0.0, 0.2, 0.5, 0.3], [0.1, 0.0, 0.3, 2.0]])
MEAN = np.array([1.0, -2.0, 0.5, 3.0])
# Of the same correlations but for that of the first and last, which have nothing to do with each other given the rest.
CHAIN = COVARIANCE.copy()
CHAIN[0, 3] = CHAIN[3, 0] = CHAIN[0, 1:3] @ np.linalg.solve(CHAIN[1:3, 1:3], CHAIN[1:3, 3])


@dataclass(frozen=True, eq=False)
class Normal(Posterior):
    """A correlated normal of known mean and covariance (times a flat prior)."""

    priors: tuple[Prior, ...] = tuple(Prior(f"x{i}", "uniform", -60.0, 60.0) for i in range(4))

    def log_likelihood(self, u):
        d = u - MEAN
        return -0.5 * np.einsum("wi,ij,wj->w", d, np.linalg.inv(COVARIANCE), d)


@dataclass(frozen=True, eq=False)
class Apart(Normal):
    """The same, of which x0 and x3 know nothing of each other given x1 and x2; nothing is possible where x0 > 40."""

    apart = (np.array([0]), np.array([3]))

    def log_parts(self, u):
        precision, d = np.linalg.inv(CHAIN), u - MEAN
        own = [-0.5 * precision[i, i] * d[:, i] ** 2 - d[:, i] * (d[:, [1, 2]] @ precision[i, [1, 2]]) for i in (0, 3)]
        rest = -0.5 * np.einsum("wi,ij,wj->w", d[:, [1, 2]], precision[1:3, 1:3], d[:, [1, 2]])
        own[0] = np.where(u[:, 0] > 40.0, -np.inf, own[0])
        return np.stack([rest + own[0] + own[1], *own], axis=1)

    def log_prob(self, u):
        return self.log_parts(u)[:, 0]


@dataclass(frozen=True, eq=False)
class Banana(Posterior):
    """A curved posterior that no Student-t fits: x0 ~ N(0, 1), x1 | x0 ~ N(x0^2, 0.3^2)."""

    priors: tuple[Prior, ...] = tuple(Prior(f"x{i}", "uniform", -60.0, 60.0) for i in range(2))

    def log_likelihood(self, u):
        return -0.5 * u[:, 0] ** 2 - 0.5 * ((u[:, 1] - u[:, 0] ** 2) / 0.3) ** 2


@dataclass(frozen=True, eq=False)
class TwoModes(Posterior):
    """Two far modes, the upper one of three quarters: no walker finds the way between them by steps."""

    priors: tuple[Prior, ...] = tuple(Prior(f"x{i}", "uniform", -60.0, 60.0) for i in range(2))

    def log_likelihood(self, u):
        low, high = (-0.5 * ((u - centre) ** 2).sum(1) / 0.01 for centre in (-20, 20))
        return np.logaddexp(low, high + np.log(3.0))


def run_move(move, steps=3000, walkers=40, seed=3):
    np.random.seed(seed)  # noqa: NPY002 - emcee's own generator is seeded this way
    sampler = emcee.EnsembleSampler(walkers, 4, Normal().log_prob, vectorize=True, moves=move)
    start = MEAN + np.linalg.cholesky(COVARIANCE).dot(np.random.randn(4, walkers)).T  # noqa: NPY002
    sampler.run_mcmc(start, steps)
    return sampler.get_chain(discard=200, thin=20, flat=True)


def only(**weight):
    return SamplerSettings(**({"independence": 0.0, "differential_evolution": 0.0, "stretch": 0.0} | weight))


def proposals(*blocks, shifts=(0.3,)):
    """Of each ensemble, or one of all: mixtures that are not the target."""
    scale = np.linalg.cholesky(COVARIANCE)

    def mixture(shift, block):
        parts = [StudentT(MEAN + shift, scale * 1.3), StudentT(MEAN - 1.0, scale * 0.8)]
        columns = np.r_[block.given, block.members]
        return Conditional(Mixture(np.array([0.7, 0.3]), tuple(p.marginal(columns) for p in parts)), *block[:2])

    return [[mixture(shift, block) for block in blocks] for shift in shifts]


NONE = np.arange(0)
ALL = Block(np.arange(4), NONE)
BLOCKS = Block(np.array([0, 2]), np.array([3, 1])), Block(np.array([1, 2, 3]), NONE)
LOCAL = only(differential_evolution=0.7, stretch=0.3)


def made(*blocks, settings=None, ensembles=2, shifts=(0.3,), target=None):
    assess = (target or Normal()).assess
    return sweep(blocks, proposals(*blocks, shifts=shifts), settings or SamplerSettings(), ensembles, assess)


IN_USE = {
    "independence": lambda: made(ALL, settings=only(independence=1.0)),
    "proposals of their own": lambda: made(ALL, settings=only(independence=1.0), shifts=(0.3, -0.2)),
    "differential evolution": lambda: made(ALL, settings=only(differential_evolution=1.0)),
    "stretch": lambda: made(ALL, settings=only(stretch=1.0), ensembles=1),
    "mixture": lambda: made(ALL),
    "blocks": lambda: made(*BLOCKS),
    "blocks, no proposals": lambda: made(*BLOCKS, settings=LOCAL),
}


def standardised(chain):
    return np.linalg.solve(np.linalg.cholesky(COVARIANCE), (chain - MEAN).T).T


REPEATS = ("proposals of their own", "blocks, no proposals")  # of what others use


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.slow) if one in REPEATS else one for one in IN_USE]
)
def test_every_move_in_use_samples_a_known_target(name):
    z = standardised(run_move(IN_USE[name]()))
    assert np.abs(z.mean(axis=0)).max() < 0.08
    assert np.abs(z.std(axis=0) - 1).max() < 0.04
    for i in range(4):
        assert stats.kstest(z[:, i], "norm").statistic < 0.04


@pytest.mark.thorough
@pytest.mark.parametrize(
    "settings",
    [SamplerSettings(), *(pytest.param(one, marks=pytest.mark.slow) for one in (only(independence=1.0), LOCAL))],
)
def test_blocks_that_are_apart_are_moved_at_once_and_accepted_one_by_one(settings):
    """With the second part swapped for the first, or one acceptance for both, this comes out another target."""
    shared = Block(np.array([1, 2]), np.array([0, 3]), times=2)
    own = [Block(np.array([i]), np.array([1, 2]), part) for part, i in enumerate((0, 3), 1)]
    move = made(shared, *own, settings=settings, target=Apart())
    assert len(move.turns) == 3
    rng = np.random.RandomState(3)
    start = MEAN + rng.standard_normal((40, 4)) @ np.linalg.cholesky(CHAIN).T
    sampler = emcee.EnsembleSampler(40, 4, Apart().log_prob, vectorize=True, moves=move)
    last = sampler.run_mcmc(emcee.State(start, random_state=rng.get_state()), 4000)
    np.testing.assert_allclose(last.log_prob, Apart().log_prob(last.coords), atol=1e-9)
    u = sampler.get_chain(discard=200, thin=20, flat=True)
    z = np.linalg.solve(np.linalg.cholesky(CHAIN), (u - MEAN).T).T
    assert np.abs(z.mean(axis=0)).max() < 0.08
    np.testing.assert_allclose(np.cov(z.T), np.eye(4), atol=0.08)


@dataclass(frozen=True, eq=False)
class About(Normal):
    """Three that lie within 0.1 of one that they share, standard normal, and have each a datum with an error of 2."""

    creeps = Block(np.array([0]), np.array([1, 2, 3]))
    carries = Block(np.array([0]), np.arange(0), carried=np.array([1, 2, 3]))
    together: bool = True

    @property
    def blocks(self):
        own = (Block(np.array([1, 2, 3]), np.array([0])),)
        return (self.creeps, self.carries, *own) if self.together else (self.creeps, *own)

    def log_likelihood(self, u):
        own = ((u[:, 1:] - u[:, :1]) / 0.1) ** 2 + (u[:, 1:] / 2.0) ** 2
        return -0.5 * (u[:, 0] ** 2 + own.sum(axis=1))


def test_what_lies_about_a_coordinate_is_carried_with_it():
    """The exact posterior, and an autocorrelation time as of independent draws where blocks alone creep."""
    moved = sample(About(), SamplerSettings(), np.random.SeedSequence(2))
    precision = np.diag([1.0 + 300.0, *[100.25] * 3])
    precision[0, 1:] = precision[1:, 0] = -100.0
    u = moved.chain.reshape(-1, 4)
    np.testing.assert_allclose(np.cov(u.T), np.linalg.inv(precision), rtol=0.1)
    np.testing.assert_allclose(u.mean(axis=0), 0.0, atol=0.05)
    assert moved.convergence.converged
    assert moved.convergence.tau.max() < 6.0
    creeping = sample(About(together=False), SamplerSettings(max_steps=500), np.random.SeedSequence(2))
    assert creeping.convergence.tau.max() > 20.0


def test_the_fit_to_draws_of_one_coordinate():
    x = np.random.default_rng(5).normal(3.0, 0.2, (2000, 1))
    wide = fit_mixture(x).parts[0]
    assert wide.centre == pytest.approx(3.0, abs=0.02)
    assert wide.cholesky.shape == (1, 1)


def test_what_is_apart_is_searched_at_once():
    """The same optimum and covariance by fewer points: those of two sets are asked for together."""
    found = find_optimum(Apart(), np.random.default_rng(0))
    np.testing.assert_allclose(found.centre, MEAN, atol=0.02)
    np.testing.assert_allclose(found.cholesky @ found.cholesky.T / 1.05**2, CHAIN, rtol=0.02, atol=0.02)


@pytest.mark.thorough
def test_this_test_of_moves_can_fail():
    """emcee's DESnookerMove is biased (sd about 0.86): the same check must see it."""
    z = standardised(run_move(emcee.moves.DESnookerMove()))
    assert np.abs(z.std(axis=0) - 1).max() > 0.06


def test_student_t_density_and_draws():
    t = StudentT(MEAN, np.linalg.cholesky(COVARIANCE), 6.0)
    x = t.draw(np.random.RandomState(0), 200000)
    want = stats.multivariate_t(MEAN, COVARIANCE, df=6)
    np.testing.assert_allclose(t.log_density(x[:5]), want.logpdf(x[:5]))
    np.testing.assert_allclose(np.cov(x.T), COVARIANCE * 6 / 4, atol=0.1)


def test_the_fit_to_draws_leaves_out_what_lies_far_away():
    rng = np.random.RandomState(1)
    x = StudentT(MEAN, np.linalg.cholesky(COVARIANCE), 5.0).draw(rng, 20000)
    x[:40] += 60.0  # walkers in a mode of their own
    fitted = maximum_likelihood(x, 5.0)
    np.testing.assert_allclose(fitted.cholesky @ fitted.cholesky.T, COVARIANCE, rtol=0.08, atol=0.04)
    assert np.cov(x.T)[0, 0] > 5.0 * COVARIANCE[0, 0]


def test_a_block_is_drawn_given_the_others():
    """Of a normal-like Student-t the conditional is the normal one, and the ratio that comes with it its densities'."""
    t, block, given = StudentT(MEAN, np.linalg.cholesky(COVARIANCE), 1e6), np.array([3, 1]), np.array([2, 0])
    x = np.tile(MEAN + np.array([1.0, 0.0, -0.7, 0.0]), (100000, 1))
    new = x.copy()
    new[:, block], ratio = conditional(t, block, given).draw(x, np.random.RandomState(2))
    inner = np.linalg.inv(COVARIANCE)[np.ix_(block, block)]
    across = np.linalg.inv(COVARIANCE)[np.ix_(block, [0, 2])]
    centre = MEAN[block] - np.linalg.solve(inner, across @ np.array([1.0, -0.7]))
    np.testing.assert_allclose(new[:, block].mean(axis=0), centre, atol=0.02)
    np.testing.assert_allclose(np.cov(new[:, block].T), np.linalg.inv(inner), atol=0.03)
    np.testing.assert_allclose(ratio, t.log_density(x) - t.log_density(new), rtol=1e-3, atol=1e-3)


def test_a_mixture_draws_a_part_as_often_as_what_is_given_says():
    """Two parts that differ in what is given: the conditional has each part's share at the place."""
    parts = StudentT(np.zeros(2), np.eye(2), 1e6), StudentT(np.array([2.0, 10.0]), np.eye(2), 1e6)
    whole = Conditional(Mixture(np.array([0.4, 0.6]), parts), np.array([1]), np.array([0]))
    x = np.tile([0.8, 0.0], (50000, 1))
    new, ratio = whole.draw(x, np.random.RandomState(3))
    odds = 0.6 * stats.norm.pdf(0.8, 2.0) / (0.4 * stats.norm.pdf(0.8))
    assert (new[:, 0] > 5.0).mean() == pytest.approx(odds / (1.0 + odds), abs=0.01)
    density = 1.0 / (1.0 + odds) * stats.norm.pdf(new[:, 0]) + odds / (1.0 + odds) * stats.norm.pdf(new[:, 0], 10.0)
    np.testing.assert_allclose(ratio, np.log(stats.norm.pdf(0.0) / (1.0 + odds) / density), rtol=1e-3, atol=1e-3)


def test_a_mixture_fits_what_no_student_t_does():
    rng = np.random.default_rng(6)
    x = rng.standard_normal((4000, 2)) * [1.0, 0.3]
    x[:, 1] += x[:, 0] ** 2
    fitted, one, half = fit_mixture(x[:2000]), maximum_likelihood(x[:2000], 5.0), x[2000:]
    assert np.logaddexp.reduce(fitted.log_terms(fitted.distances(half))).mean() > one.log_density(half).mean() + 0.3
    assert fitted.weight.sum() == pytest.approx(1.0)


def test_only_walkers_that_fill_no_volume_keep_the_old_proposals(monkeypatch):
    """What else goes wrong in a fit is not hidden."""
    rng, old = np.random.default_rng(7), [object()]
    full = rng.standard_normal((50, 20, 2))
    flat = full[..., :1] * [1.0, 0.0]

    def adapted(chain):
        ensembles = Ensembles(
            2, [Block(np.arange(2), np.arange(0))], old, chain[-1], np.zeros(20), None, [chain], [np.zeros(20)]
        )
        ensembles.adapt()
        assert not ensembles.chain
        return ensembles.proposals

    assert adapted(flat) is old
    assert isinstance(adapted(full)[0][0], Conditional)

    def broken(_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("scruton.stats.sampler.fit_mixture", broken)
    with pytest.raises(np.linalg.LinAlgError, match="Singular"):
        adapted(full)


def test_optimum_and_laplace_covariance():
    found = find_optimum(Normal(), np.random.default_rng(0))
    np.testing.assert_allclose(found.centre, MEAN, atol=0.02)
    np.testing.assert_allclose(found.cholesky @ found.cholesky.T / 1.05**2, COVARIANCE, rtol=0.02, atol=0.02)


def test_samples_of_a_known_target_and_their_effective_size():
    samples = sample(Normal(), SamplerSettings(), np.random.SeedSequence(5))
    assert samples.convergence.converged
    z = standardised(samples.chain.reshape(-1, 4))
    assert np.abs(z.mean(axis=0)).max() < 5 / np.sqrt(samples.convergence.ess_bulk.min())
    assert np.abs(z.std(axis=0) - 1).max() < 0.06


def test_a_poor_proposal_stalls_no_chain():
    """DE and stretch carry the run where the Student-t does not fit."""
    samples = sample(Banana(), SamplerSettings(max_rhat=1.02), np.random.SeedSequence(5))
    assert samples.convergence.converged
    x = samples.chain.reshape(-1, 2)
    assert x[:, 0].std() == pytest.approx(1.0, abs=0.1)
    assert x[:, 1].mean() == pytest.approx(1.0, abs=0.15)


def test_modes_that_ensembles_share_have_their_weights():
    """Each ensemble starts in one of them; what all have found is proposed to all."""
    samples = sample(TwoModes(), SamplerSettings(), np.random.SeedSequence(10))
    assert samples.convergence.converged
    assert np.mean(samples.chain[..., 0] > 0.0) == pytest.approx(0.75, abs=0.03)


def test_two_modes_are_not_called_converged():
    settings = SamplerSettings(max_steps=80)  # before anything is shared
    samples = sample(TwoModes(), settings, np.random.SeedSequence(10))
    verdict = samples.convergence
    assert not verdict.converged
    assert "Raise sampler.max_steps" in verdict.explain(samples.names, settings)


@pytest.mark.parametrize("most", [240, 400, 700, 1500])
def test_the_verdict_on_a_run_that_ends_at_its_limit_rests_on_a_third_of_it(most):
    """Proposals were fitted anew 131 steps before the limit of 4000, and the verdict was that of 99 steps."""
    settings = SamplerSettings(max_steps=most, min_ess=10**6)
    verdict = sample(Normal(), settings, np.random.SeedSequence(4)).convergence
    assert not verdict.converged
    assert verdict.steps >= 0.75 * most / 3.0 - 1.0


@pytest.mark.parametrize(("lacking", "last"), [(0.98, 500), (0.9, 400)])
def test_a_run_that_lacks_a_few_draws_at_its_limit_goes_on(tmp_path, monkeypatch, lacking, last):
    settings, steps = SamplerSettings(max_steps=400, min_ess=10**6), []

    def judged(*arguments):
        verdict, enough = judge(*arguments), steps[-1] > settings.max_steps
        draws = np.full(4, settings.min_ess * (1.1 if enough else lacking))
        return replace(verdict, ess_bulk=draws, ess_tail=draws, converged=enough)

    monkeypatch.setattr(sampler, "judge", judged)

    def run(checkpoint=None, stop=np.inf):
        steps.clear()

        def told(done, _):
            steps.append(done)
            if done >= stop:
                raise KilledError

        return sample(Normal(), settings, np.random.SeedSequence(4), checkpoint, told)

    whole = run()
    assert steps[-1] == last
    assert whole.convergence.converged == (last > settings.max_steps)
    checkpoint = Checkpoint(tmp_path / "run.npz", "a run")
    with pytest.raises(KilledError):
        run(checkpoint, settings.max_steps)
    assert run(checkpoint).chain.tobytes() == whole.chain.tobytes()


SOON = SamplerSettings(max_steps=400, min_ess=600.0)


@pytest.mark.parametrize(
    ("rounds", "total", "steps", "more", "expected", "anew"),
    [
        (EARLY - 1, 300, 10, 0.1, 500.0, True),  # the first rounds, whatever was reached
        (EARLY, 180, 80, 1.0, 150.0, True),  # most draws lack
        (EARLY, 180, 80, 1.0, 250.0, False),  # most are there, and what is left would be the shorter part
        (EARLY + 1, 180, 80, 1.0, 150.0, False),
        (EARLY + 1, 180, 90, 1.0, 250.0, True),  # half of all steps brought no verdict
        (EARLY, 180, 90, 0.9, 150.0, False),  # soon long enough
        (EARLY, 330, 80, 1.0, 150.0, False),  # no room for as many steps
        (ADAPTATIONS, 180, 90, 1.0, 150.0, False),
    ],
)
def test_proposals_are_fitted_anew_where_that_pays(rounds, total, steps, more, expected, anew):
    assert begins_anew(rounds, total, steps, more, expected, SOON) is anew


def test_one_seed_one_chain():
    one, two, other = (sample(Normal(), SamplerSettings(), np.random.SeedSequence(s)) for s in (1, 1, 2))
    assert one.chain.tobytes() == two.chain.tobytes()
    assert one.chain.tobytes() != other.chain.tobytes()


class KilledError(Exception):
    """Stands for a kill between two chunks."""


SEVERAL_CHUNKS = SamplerSettings(min_ess=12000, walkers=32)


@pytest.fixture(scope="module")
def whole():
    return sample(Banana(), SEVERAL_CHUNKS, np.random.SeedSequence(4))


@pytest.mark.parametrize("chunks", [2, 4])
def test_resumed_is_bit_for_bit_uninterrupted(tmp_path, whole, chunks):
    settings, seen = SEVERAL_CHUNKS, []

    def interrupt(steps, done):
        seen.append(steps)
        if len(seen) == chunks:
            raise KilledError

    checkpoint = Checkpoint(tmp_path / "c.npz", "print")
    with pytest.raises(KilledError):
        sample(Banana(), settings, np.random.SeedSequence(4), checkpoint, interrupt)
    resumed = sample(Banana(), settings, np.random.SeedSequence(4), checkpoint, lambda steps, _: seen.append(steps))
    assert seen[chunks] == seen[chunks - 1], "the second run went on from there, it did not start again"
    assert resumed.chain.tobytes() == whole.chain.tobytes()
    assert resumed.log_prob.tobytes() == whole.log_prob.tobytes()


def test_a_checkpoint_of_other_inputs_is_refused(tmp_path):
    sample(Normal(), SamplerSettings(), np.random.SeedSequence(4), Checkpoint(tmp_path / "c.npz", "one"))
    with pytest.raises(InputError, match="other data, another model card, seed or version"):
        sample(Normal(), SamplerSettings(), np.random.SeedSequence(4), Checkpoint(tmp_path / "c.npz", "two"))


def test_a_turn_is_made_by_its_chance() -> None:
    class Counted:
        made = 0

        def make(self, at: Walkers, rng: np.random.RandomState) -> FloatArray:
            self.made += 1
            return np.ones(len(at.coords))

    class Model(NamedTuple):
        random: np.random.RandomState

    def assess(u: FloatArray, _: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        return np.zeros((len(u), 1)), np.zeros((len(u), 0))

    always, often = Counted(), Counted()
    step = Sweep(assess, [([always], [1.0]), ([often], [1.0])], [1.0, 0.25])
    model, state = Model(np.random.RandomState(0)), emcee.State(np.zeros((4, 1)), log_prob=np.zeros(4))
    for _ in range(1000):
        _, accepted = step.propose(model, state)
        assert (accepted == 1.0).all()  # of the moves that were made
    assert always.made == 1000
    assert abs(often.made - 250) < 60
