r"""The hierarchical campaign model: the peak tests of all rigs, joined by one Griffin curve and a discrepancy.

The tests share the curve of law n through a reference Scruton number,

.. math:: A(Sc) = A_{ref}\,(1 - n x)^{1/n}, \quad x = (Sc - Sc_{ref})/R_{ref}, \quad
   Sc_\lambda(Sc) = R_{ref} - n\,(Sc - Sc_{ref})

with Sc_lambda the Scruton number that belongs to the relaxation rate.  Test j lies off the shared curve by

.. math:: \ln a^*_j = \ln A(Sc_j) + \tau z_j, \qquad \ln G_j = \ln G(Sc_j) + \kappa w_j, \quad
   G = Sc_\lambda + \max(n, 0)\, Sc

with z, w standard normal, and so will the next setting.  G stands for the strength of the wind: for n > 0 it is the
relaxation at zero damping, the same along the curve; for n <= 0 the relaxation itself, since a law n < 0 need have no
stable amplitude there, as a section that builds up by itself has none.  Amplitudes of different settings lie on one
curve more closely than the slopes of their transients say, hence two scales; the card has their priors, two rigs or
more inform them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scruton.arrays import FloatArray, IntArray
from scruton.dynamics.departure import COLUMNS
from scruton.dynamics.laws import amplitude_ratio
from scruton.infer.alike import of_each
from scruton.infer.in_common import COMMON, InCommon, departure_blocks
from scruton.infer.models import NOISE, SHARED_DEPARTURE, WIND
from scruton.infer.peak_test import PeakTest
from scruton.infer.thresholds import TURNS_OF_THE_SCALES, TURNS_OF_THE_SHARED
from scruton.stats.posterior import Block, Coordinates, Posterior, Values
from scruton.stats.priors import Prior, finite_exp, normal_log_density

SET_POINT = "set_point_scatter"
SHARED = ("reference_amplitude", "reference_relaxation_ratio", "discrepancy_amplitude", "discrepancy_relaxation")
_BEYOND_RECORDS = ("damping_ratio", "mass_factor", "w")  # the likelihood of a test's transients does not know them
_OF_A_MEAN = ("gust_scatter", "gust_time", SET_POINT)  # by which the mean of a lock-in record strays


@dataclass(frozen=True, eq=False)
class CampaignPosterior(Posterior):
    """Joint posterior of the peak tests.

    Sampled: the logarithms of A_ref, R_ref over the reference mass-damping factor, tau and kappa; n where it is free;
    with several tests the set-point scatter that theirs lie about (`InCommon`); and for every test those of a*,
    lambda/omega0, scatter, noise factor, xi_s, and the standardised deviation of the mass-damping factor.  Where a
    test's records say nothing of lambda its coordinate is w_j instead: no discrepancy squeezes it.  Tests whose `wind`
    shares its departure from the law with the others' have z in common, what they share of it.

    Attributes
    ----------
    tests : sequence of PeakTest
    shared : tuple of Prior
        Of A_ref, of lambda/omega0 at the reference, of tau and of kappa.
    n : float
        The law; ignored where `exponent` is given.
    exponent : Prior, optional
        Prior of n, where n is free.
    """

    tests: Sequence[PeakTest]
    shared: tuple[Prior, ...]
    n: float = -1.0
    exponent: Prior | None = None

    @cached_property
    def reference(self) -> tuple[float, float]:
        """Fixed reference: Scruton number and mass-damping factor, geometric means over what is known of the rigs."""
        factor = np.array([test.mass_damping_factor for test in self.tests])
        damping = np.array([test.wind.prior("damping_ratio").location for test in self.tests])
        return float(np.exp(np.mean(np.log(factor) + damping))), float(np.exp(np.log(factor).mean()))

    @cached_property
    def priors(self) -> tuple[Prior, ...]:  # type: ignore[override]
        """One a coordinate; a* and lambda follow the curve."""
        priors = [replace(prior, name=name) for name, prior in zip(SHARED, self.shared, strict=True)]
        priors += [self.exponent] if self.exponent else []
        priors += [self.in_common.prior] if self.in_common else []
        if SHARED_DEPARTURE in self.shared_coordinates:
            priors += [Prior(f"{SHARED_DEPARTURE} {k}", "normal", 0.0, 1.0) for k in range(1, COLUMNS + 1)]
        for test in self.tests:
            for name in test.parameters:
                prior = test.wind.prior(name) if name in WIND else Prior(name, "normal", 0.0, 1.0)
                priors.append(replace(prior, name=f"{name} of {test.name}"))
        return tuple(priors)

    @cached_property
    def shared_coordinates(self) -> Coordinates:
        """Where stands what all tests share; with several also what they have in common beside the curve."""
        free = ("law_exponent",) if self.exponent else ()
        common = (COMMON,) if len(self.tests) > 1 else ()
        departure = {SHARED_DEPARTURE: COLUMNS} if any(test.wind.shares for test in self.tests) else {}
        return Coordinates(dict.fromkeys((*SHARED, *free, *common)) | departure)

    @cached_property
    def own_coordinates(self) -> tuple[Coordinates, ...]:
        """Where the parameters of every test stand, by the names of `PeakTest.parameters`."""
        layouts: list[Coordinates] = []
        start = self.shared_coordinates.stop
        for test in self.tests:
            layouts.append(Coordinates(dict.fromkeys(test.parameters), start))
            start = layouts[-1].stop
        return tuple(layouts)

    @cached_property
    def in_common(self) -> InCommon | None:
        """What the set-point scatters of several tests have in common."""
        one, columns = self.tests[0], self._columns[SET_POINT][1]
        return InCommon(one.wind.prior(SET_POINT), columns) if columns.size > 1 else None

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """What no record is read for, the discrepancies by themselves, what tests share, and each test's own.

        Given the shared curve tests know nothing of each other, and given their amplitudes and rates it knows nothing
        of their noise, unless the law is sampled, too, or no record tells the rate and so how long gusts last.  What
        costs no likelihood is moved several times as often; discrepancies follow squares, of which no regression knows.
        """
        all_share = self.shared_coordinates
        shared = np.arange(all_share.stop)
        own: list[Block] = []
        free, levels = [], []
        for j, (test, layout) in enumerate(zip(self.tests, self.own_coordinates, strict=True), 1):
            noise = NOISE if self.exponent else () if test.relaxes else _OF_A_MEAN
            beyond = np.array([layout[name] for name in _BEYOND_RECORDS if name in layout], dtype=int)
            own.append(Block(np.setdiff1d(self.apart[j - 1], beyond), np.r_[shared, beyond], j))
            free += beyond.tolist()
            levels += [layout[name] for name in ("stable_amplitude", "relaxation_ratio", *noise) if name in layout]
        curve = [all_share[name] for name in (*SHARED, "law_exponent") if name in all_share]
        common: tuple[Block, ...] = self.in_common.blocks(np.array([all_share[COMMON]])) if self.in_common else ()
        if SHARED_DEPARTURE in all_share:
            names = "stable_amplitude", "relaxation_ratio", "departure_scale"
            of_tests = (self._columns[name][1] for name in names)
            common += departure_blocks(shared[all_share[SHARED_DEPARTURE]], np.array(curve), *of_tests)
        joint = Block(
            np.array([*curve, *free]), np.array(levels, dtype=int), times=TURNS_OF_THE_SHARED, unread=not self.exponent
        )
        return joint, Block(shared[2:4], np.arange(0), times=TURNS_OF_THE_SCALES, unread=True), *common, *own

    def _each(self, u: FloatArray) -> Iterator[tuple[PeakTest, Values]]:
        """Every test with its coordinates by name."""
        return ((test, layout.of(u)) for test, layout in zip(self.tests, self.own_coordinates, strict=True))

    @cached_property
    def _columns(self) -> dict[str, tuple[IntArray, IntArray]]:
        """By the name of a parameter the tests that have it and its columns."""
        return {
            name: (
                np.array([j for j, layout in enumerate(self.own_coordinates) if name in layout], dtype=int),
                np.array([layout[name] for layout in self.own_coordinates if name in layout], dtype=int),
            )
            for name in dict.fromkeys((*WIND, *_BEYOND_RECORDS))
        }

    def of_tests(self, u: FloatArray, name: str) -> FloatArray:
        """One coordinate of every test, (W, J); zero where a test has none of that name."""
        tests, columns = self._columns[name]
        if tests.size == len(self.tests):
            return np.asarray(u[:, columns])
        found = np.zeros((len(u), len(self.tests)))
        found[:, tests] = u[:, columns]
        return found

    @cached_property
    def _relaxes(self) -> np.ndarray:
        """`PeakTest.relaxes` of every test, (J,)."""
        return np.array([test.relaxes for test in self.tests])

    @cached_property
    def apart(self) -> tuple[IntArray, ...]:
        """The coordinates of each test, which meet those of the others in the shared curve alone."""
        return tuple(np.arange(layout.start, layout.stop) for layout in self.own_coordinates)

    def without(self, record: str) -> "CampaignPosterior":
        """The same model of all records but one."""
        tests = [replace(test, wind=replace(test.wind, data=test.wind.data.without(record))) for test in self.tests]
        return replace(self, tests=tests)

    def without_test(self, name: str) -> "CampaignPosterior":
        """The same model of all tests but one."""
        return replace(self, tests=[test for test in self.tests if test.name != name])

    def exponents(self, u: FloatArray) -> FloatArray:
        """N of every walker, (W,)."""
        return self.named(u)["law_exponent"] if self.exponent else np.full(len(u), self.n)

    def curve(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A_ref, R_ref and n of the shared curve, (W,) each."""
        log = self.named(u)
        relaxation = self.reference[1] * finite_exp(log["reference_relaxation_ratio"])
        return np.exp(log["reference_amplitude"]), relaxation, self.exponents(u)

    def _strength(self, relaxation: FloatArray, n: FloatArray, sc: FloatArray) -> FloatArray:
        """G at Scruton numbers on the curve whose relaxation at the reference is given."""
        return np.asarray(relaxation - n * (sc - self.reference[0]) + np.maximum(n, 0.0) * sc)

    def settings(self, u: FloatArray) -> dict[str, FloatArray]:
        """Every test's parameters but its noise in their own units, by name, (W, J) each; NaN where there are none.

        Beside those of a test in wind its mass_damping_factor, scruton_number, relaxation, the Scruton number that
        belongs to the relaxation rate, strength, which is G_j, and on_curve, that of the shared curve there.
        """
        _, reference, n = (value[:, None] for value in self.curve(u))
        names = "stable_amplitude", "relaxation_ratio", *_BEYOND_RECORDS
        of = {name: self.of_tests(u, name) for name in names}
        factor, log_sd = np.array([(test.mass_damping_factor, test.factor_log_sd) for test in self.tests]).T
        factor = factor * np.exp(log_sd * of["mass_factor"])
        damping, ratio = finite_exp(of["damping_ratio"]), np.exp(of["relaxation_ratio"])
        sc, at_zero = factor * damping, np.maximum(n, 0.0)
        strength, on_curve = factor * ratio + at_zero * sc, self._strength(reference, n, sc)
        if not self._relaxes.all():
            told = on_curve * finite_exp(finite_exp(self.named(u)["discrepancy_relaxation"])[:, None] * of["w"])
            relaxation = told - at_zero * sc
            strength = np.where(self._relaxes, strength, told)
            ratio = np.where(self._relaxes, ratio, np.where(relaxation > 0.0, relaxation, np.nan) / factor)
        s = {"a_star": np.exp(of["stable_amplitude"]), "relaxation_ratio": ratio, "damping_ratio": damping}
        s |= {"mass_damping_factor": factor, "strength": strength, "on_curve": on_curve}
        return s | {"scruton_number": sc, "relaxation": factor * ratio}

    def _deviations(self, u: FloatArray, s: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Deviations of ln a* and ln G from the shared curve, (W, J) each; NaN off the constraint."""
        a_ref, relaxation, n = (value[:, None] for value in self.curve(u))
        x = (s["scruton_number"] - self.reference[0]) / relaxation
        with np.errstate(all="ignore"):
            amplitude = np.log(s["a_star"]) - np.log(a_ref * amplitude_ratio(x, n))
            return amplitude, np.log(s["strength"]) - np.log(s["on_curve"])

    def amplitude_density(self, u: FloatArray) -> FloatArray:
        """Log density of the stable amplitude of every test about the shared curve, (W, J)."""
        amplitude, _ = self._deviations(u, self.settings(u))
        return normal_log_density(amplitude, self.named(u)["discrepancy_amplitude"][:, None])

    def inside(self, u: FloatArray) -> np.ndarray:
        """A stable amplitude at every tested setting, (W,) of bool."""
        s = self.settings(u)
        return np.asarray(_stable(s, *self._deviations(u, s)).all(axis=1))

    def log_prior(self, u: FloatArray) -> FloatArray:
        """Log prior density of the coordinates without the joint constraint, (W,); -inf where a parameter is none."""
        return np.asarray(self._prior_parts(u)[0].sum(axis=1))

    def _prior_parts(self, u: FloatArray) -> tuple[FloatArray, np.ndarray, dict[str, FloatArray]]:
        """Log prior of what is shared and of every test, (W, 1 + J), which tests are stable, (W, J), their settings."""
        s = self.settings(u)
        deviations = self._deviations(u, s)
        terms = self._terms(u, *deviations)
        starts = [0, *(layout.start for layout in self.own_coordinates)]
        parts = np.add.reduceat(terms, starts, axis=1)
        parts[:, 1:] += self._log_jacobians(s)
        return np.where(np.isnan(parts), -np.inf, parts), _stable(s, *deviations), s

    def log_prob(self, u: FloatArray) -> FloatArray:
        """Log posterior up to a constant, (W,); -inf outside the support, never NaN."""
        return self.log_parts(u)[:, 0]

    def log_parts(self, u: FloatArray) -> FloatArray:
        """Log posterior and what of it each test has a say in, (W, 1 + J); see `Posterior.log_parts`."""
        return self.assess(u)[0]

    def assess(self, u: FloatArray, told: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """`log_parts`, and the log likelihood of every test, (W, J); see `Posterior.assess`."""
        parts, stable, s = self._prior_parts(u)
        alive = stable & np.isfinite(parts[:, 1:]) & np.isfinite(parts[:, :1])
        told = self._log_likelihoods(u, s, alive, told)
        parts[:, 1:] += told
        parts[:, 0] = parts.sum(axis=1)
        return parts, told

    def log_prior_terms(self, u: FloatArray) -> FloatArray:
        """Log prior of every parameter given those before it, (W, d): of ln G_j where lambda is the coordinate.

        `log_prior` is their sum and what the coordinates stretch them by, which is no part of any prior.
        """
        s = self.settings(u)
        return self._terms(u, *self._deviations(u, s))

    def _terms(self, u: FloatArray, amplitude: FloatArray, strength: FloatArray) -> FloatArray:
        """`log_prior_terms` from the deviations of the tests."""
        terms, log = super().log_prior_terms(u), self.named(u)
        tau, kappa = (log[name][:, None] for name in SHARED[2:])
        terms[:, self._columns["stable_amplitude"][1]] = normal_log_density(amplitude, tau)
        terms[:, self._columns["relaxation_ratio"][1]] = normal_log_density(strength[:, self._relaxes], kappa)
        if self.in_common:
            terms[:, self.in_common.columns] = self.in_common.log_density(u, log[self.in_common.prior.name])
        return terms

    def _log_jacobians(self, s: dict[str, FloatArray]) -> FloatArray:
        """Log volume of every ln G_j over that of its coordinate, (W, J)."""
        with np.errstate(all="ignore"):
            return np.asarray(np.where(self._relaxes, np.log(s["relaxation"] / s["strength"]), 0.0))

    def log_likelihood(self, u: FloatArray) -> FloatArray:
        """Sum of the tests' log likelihoods, (W,)."""
        s = {} if self._relaxes.all() else self.settings(u)
        return self._log_likelihoods(u, s, np.ones((len(u), len(self.tests)), dtype=bool)).sum(axis=1)

    def _log_likelihoods(
        self, u: FloatArray, s: dict[str, FloatArray], asked: np.ndarray, told: FloatArray | None = None
    ) -> FloatArray:
        """Log likelihood of every test where it is asked for, (W, J), and -inf elsewhere.

        Of tests that relax it is as `told`, where it is: the others' is cheap, and the curve is in it.
        """
        asks = [told is None or not test.relaxes for test in self.tests]
        found = np.full(asked.shape, -np.inf) if told is None else told
        if any(asks):
            s = s | {"damping_ratio": np.ones(asked.shape)}  # no record is read for it
            found = found.copy()
            with np.errstate(all="ignore"):
                for j, (test, v) in enumerate(self._winds(u, s)):
                    if asks[j]:
                        rows = asked[:, j]
                        found[rows, j] = of_each(test.wind.log_likelihood, v[rows])
        return np.where(asked & np.isfinite(found), found, -np.inf)

    def winds(self, u: FloatArray) -> Iterator[tuple[PeakTest, FloatArray]]:
        """Every test with the coordinates of its `wind`, (W, d)."""
        return self._winds(u, self.settings(u))

    def _winds(self, u: FloatArray, s: dict[str, FloatArray]) -> Iterator[tuple[PeakTest, FloatArray]]:
        """`winds` from what the coordinates do not say as they are: damping ratios, and rates that no record tells."""
        of = {name: self.of_tests(u, name) for name in WIND} | {"damping_ratio": np.log(s["damping_ratio"])}
        if not self._relaxes.all():
            of["relaxation_ratio"] = np.where(self._relaxes, of["relaxation_ratio"], np.log(s["relaxation_ratio"]))
        for j, test in enumerate(self.tests):
            v = np.empty((len(u), test.wind.coordinates.size))
            log = test.wind.named(v)
            for name in WIND:
                log[name] = of[name][:, j]
            if self.exponent:
                log["law_exponent"] = self.exponents(u)
            if test.wind.shares:
                log[SHARED_DEPARTURE] = self.shared_coordinates.of(u)[SHARED_DEPARTURE]
            yield test, v

    def prior_sample(self, rng: np.random.Generator, size: int) -> tuple[FloatArray, np.ndarray]:
        """Draws of the generative prior and whether each satisfies the constraint; see `Posterior.prior_sample`."""
        u = np.stack([prior.draw(rng, size) for prior in self.priors], axis=1)
        z = rng.standard_normal((2, size, len(self.tests)))
        n, log = self.exponents(u), self.named(u)
        if self.in_common:
            self.in_common.spread_about(u, log[self.in_common.prior.name])
        good, sc_ref = np.ones(size, dtype=bool), self.reference[0]
        with np.errstate(all="ignore"):
            a_ref, relaxation, _ = self.curve(u)
            for j, (test, values) in enumerate(self._each(u)):
                off = test.factor_log_sd * values["mass_factor"] if test.factor_log_sd else np.zeros(size)
                factor = test.mass_damping_factor * np.exp(off)
                sc = factor * np.exp(values["damping_ratio"])
                deviation = np.exp(log["discrepancy_amplitude"]) * z[0, :, j]
                values["stable_amplitude"] = np.log(a_ref * amplitude_ratio((sc - sc_ref) / relaxation, n)) + deviation
                good &= np.isfinite(values["stable_amplitude"])
                if test.relaxes:
                    off_curve = np.exp(np.exp(log["discrepancy_relaxation"]) * z[1, :, j])
                    own = self._strength(relaxation, n, sc) * off_curve - np.maximum(n, 0.0) * sc
                    values["relaxation_ratio"] = np.log(own / factor)
                    good &= np.isfinite(values["relaxation_ratio"])
        good[good] = self.inside(u[good])
        return u, good

    def guesses(self, rng: np.random.Generator, size: int) -> FloatArray:
        """Prior draws whose tests are put where their own records see them, and the shared curve near them."""
        u = self.prior_draws(rng, size)
        n = self.exponents(u)[:, None]
        for test, values in self._each(u):
            near = test.wind.named(test.draws[rng.integers(0, len(test.draws), size)])
            for name in WIND:
                if name in test.parameters:
                    values[name] = near[name]
        s, log = self.settings(u), self.named(u)
        if self.in_common:
            log[self.in_common.prior.name] = self.in_common.guess(u, rng)
        sc, factor = self.reference
        known = [j for j, test in enumerate(self.tests) if test.relaxes]
        if known:
            # The curve through each test's own relaxation, where they agree with a positive one.
            at_zero = np.maximum(n, 0.0) * sc
            strength = (s["relaxation"] + n * (s["scruton_number"] - sc))[:, known] + at_zero
            strength = np.log(np.maximum(strength, 1e-3)).mean(axis=1)
            above = np.exp(strength + 0.3 * rng.standard_normal(size)) - at_zero[:, 0]
            ratio = np.log(np.maximum(above, 1e-12) / factor)
            log["reference_relaxation_ratio"] = np.where(above > 0.0, ratio, log["reference_relaxation_ratio"])
        x = (s["scruton_number"] - sc) / self.curve(u)[1][:, None]
        with np.errstate(all="ignore"):
            level = (np.log(s["a_star"]) - np.log(amplitude_ratio(x, n))).mean(axis=1)
        level = np.where(np.isfinite(level), level, log["reference_amplitude"])
        log["reference_amplitude"] = level + 0.05 * rng.standard_normal(size)
        return u


def _stable(s: dict[str, FloatArray], amplitude: FloatArray, strength: FloatArray) -> np.ndarray:
    """Whether each test has a stable amplitude and a positive strength of the wind, (W, J) of bool."""
    return np.asarray(np.isfinite(amplitude) & np.isfinite(strength) & (s["relaxation_ratio"] > 0.0))
