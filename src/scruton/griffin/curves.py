"""The Griffin curve that the peak tests share: its draws, law by law and laws mixed, and with an effect in it."""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import COLUMNS, Term
from scruton.dynamics.laws import amplitude_ratio, extrapolation_index
from scruton.errors import InputError
from scruton.griffin.coverage import Coverage, coverage_of
from scruton.griffin.law_free import LawFree, law_free
from scruton.infer.joint import doubted, law_weights, mixed, told_weights
from scruton.infer.thresholds import CARRIES

if TYPE_CHECKING:
    import xarray as xr

PORTION = 16  # Scruton numbers that are computed at once: of 8,192 draws a whole figure's take 200 MB on the way


def portions(count: int, at_once: int = PORTION) -> Iterator[slice]:
    """Columns of Scruton numbers that are computed at once, one portion after the other."""
    return (slice(first, first + at_once) for first in range(0, count, at_once))


@dataclass(frozen=True, eq=False)
class Setting:
    """Where a new setting is to be expected, beside what the laws say of it; (S, n_sc) arrays.

    Attributes
    ----------
    shift : array
        ln(amplitude) of the curve less that by the laws: what the measured damping moves it by.
    spread : array
        Standard deviation of ln(amplitude) of a new setting about the curve.
    weight : array
        Of the measured damping, from 0 to 1.
    """

    shift: FloatArray
    spread: FloatArray
    weight: FloatArray

    def off(self, z: FloatArray) -> FloatArray:
        """ln(amplitude) of settings whose standardised deviation is z, (S,), less that by the laws, (S, n_sc)."""
        return np.asarray(self.shift + self.spread * z[:, None])


@dataclass(frozen=True, eq=False)
class SharedCurve:
    """Draws of the Griffin curve that the peak tests share, laws mixed by their weights; (S,) arrays.

    `amplitude` and `relaxation` are A and Sc_lambda at the Scruton number `reference`; `discrepancy` is tau.  Where the
    fit carries an unmodelled effect that was found, `effect` has its amplitude equation, and the curve is that one's.
    `measured` is the curve by the measured damping, `sample` which of its draws goes with each; None for laws alone.
    """

    reference: float
    amplitude: FloatArray
    relaxation: FloatArray
    n: FloatArray
    discrepancy: FloatArray
    laws: Mapping[str, float]
    effect: "EffectCurve | None" = None
    coverage: Coverage | None = None
    measured: LawFree | None = None
    sample: NDArray[np.integer] | None = None

    def index(self, scruton_numbers: FloatArray, tested: FloatArray | float) -> FloatArray:
        """Extrapolation index from the Scruton number of a test, by the law of each draw, (S, n_sc)."""
        return extrapolation_index(np.atleast_1d(scruton_numbers), tested, self._relaxation_at(tested))

    def _relaxation_at(self, tested: FloatArray | float) -> FloatArray:
        relaxation = self.relaxation[:, None]
        return np.maximum(relaxation - self.n[:, None] * (tested - self.reference), 1e-3 * relaxation)

    @cached_property
    def _relaxation_at_tests(self) -> "list[FloatArray]":
        assert self.coverage is not None
        return [self._relaxation_at(tested) for tested in self.coverage.passed]

    def index_of_nearest(self, scruton_number: float) -> float:
        """Median extrapolation index from the test that is nearest by it; from the reference where none is known.

        The one definition of x: of an uncertain Scruton number it is that of the median, as of a prediction there.
        """
        tested = [self.reference] if self.coverage is None else self.coverage.passed
        at = np.full((1, 1), scruton_number)
        return min((float(np.median(self.index(at, sc))) for sc in tested), key=abs)

    def setting(self, scruton_numbers: FloatArray, amplitude: FloatArray) -> Setting:
        r"""Where a new setting is to be expected whose amplitude by the laws is given, (S, n_sc).

        Notes
        -----
        The laws' amplitude is off by a variance that walks away with the distance from what was tested,
        :math:`d\,\tau^2` (`Coverage.variance`); the one by the measured damping by that of the setting that it was
        measured at, :math:`\tau^2`, and its own, v.  Each is weighed by its precision.
        """
        tau, nothing = self.discrepancy[:, None], np.zeros(amplitude.shape)
        if self.coverage is None:
            return Setting(nothing, np.broadcast_to(tau, amplitude.shape), nothing)
        away, sc = np.full(amplitude.shape, np.inf), np.atleast_1d(scruton_numbers)
        for tested, relaxation in zip(self.coverage.passed, self._relaxation_at_tests, strict=True):
            np.minimum(away, np.abs(extrapolation_index(sc, tested, relaxation)), out=away)
        with np.errstate(divide="ignore"):
            log = np.log(amplitude)
        variance = self.coverage.variance(away, log)
        if self.measured is None or self.sample is None:
            return Setting(nothing, tau * np.sqrt(variance), nothing)
        found, own = self.measured.log_amplitude(np.broadcast_to(sc, amplitude.shape), self.sample)
        walk = variance - 1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            off = found - log
            weight = walk * tau**2 / (variance * tau**2 + own)
            known = np.isfinite(off) & (weight > 0.0)  # without a discrepancy the laws hold everywhere
            shift = np.where(known, weight * off, 0.0)
        weight = np.where(known, weight, 0.0)
        return Setting(shift, tau * np.sqrt(1.0 + (1.0 - weight) ** 2 * walk + weight**2), weight)

    def predictive(self, scruton_numbers: FloatArray, z: FloatArray) -> FloatArray:
        """Stable amplitude of a new setting whose standardised deviation is z, (S,), on (S, n_sc)."""
        grid = np.atleast_1d(scruton_numbers)
        found = np.empty((len(self.n), grid.shape[-1]))
        for columns in portions(grid.shape[-1]):
            by_laws = self.at(grid[..., columns])
            found[:, columns] = by_laws * np.exp(self.setting(grid[..., columns], by_laws).off(z))
        return found

    def at(self, scruton_numbers: FloatArray) -> FloatArray:
        """Stable amplitude by the laws, (S, n_sc), at (n_sc,) or (S, n_sc) Scruton numbers; see `setting`."""
        if self.effect is not None:
            return self.effect.at(scruton_numbers)
        x = (np.atleast_1d(scruton_numbers) - self.reference) / self.relaxation[:, None]
        return np.asarray(self.amplitude[:, None] * amplitude_ratio(x, self.n[:, None]))


@dataclass(frozen=True, eq=False)
class EffectCurve:
    """Draws of the amplitude equation with an effect that was found, (S, COLUMNS), and what Sc means in it."""

    coefficients: FloatArray
    omega0: float
    mass_damping_factor: float
    largest: float

    def at(self, scruton_numbers: FloatArray) -> FloatArray:
        """Stable amplitude, (S, n_sc), at (n_sc,) or (S, n_sc) Scruton numbers."""
        from scruton.dynamics.limit_cycle import limit_cycle_amplitude

        sc = np.atleast_2d(np.asarray(scruton_numbers, dtype=float))
        sc = np.broadcast_to(sc, (len(self.coefficients), sc.shape[1]))
        amplitude = np.empty(sc.shape)
        for j in range(sc.shape[1]):
            rows = self.coefficients.copy()
            rows[:, Term.STRUCTURAL] = self.omega0 * sc[:, j] / self.mass_damping_factor
            amplitude[:, j] = limit_cycle_amplitude(rows, None, self.largest)
        return amplitude

    def excitation(self, amplitude: FloatArray, *, driven: bool = True) -> FloatArray:
        """Scruton number that holds a section at (A,) amplitudes, stable or not, (S, A), with its drive or without."""
        from scruton.dynamics.effects.terms import HATS
        from scruton.dynamics.limit_cycle import amplitude_rates

        rows = self.coefficients.copy()
        rows[:, Term.STRUCTURAL] = 0.0
        rows[:, Term.DRIVE] *= driven
        rate = amplitude_rates(rows, amplitude, np.linspace(0.0, 1.0, HATS)) / amplitude
        return np.asarray(rate * self.mass_damping_factor / self.omega0)

    @property
    def drive(self) -> FloatArray:
        """Constant drive c, as a Scruton number times an amplitude, (S,)."""
        return np.asarray(self.coefficients[:, Term.DRIVE] * self.mass_damping_factor / self.omega0)


@dataclass(frozen=True, eq=False)
class LawCurves:
    """Draws of the shared curve under each law, (L, S) arrays as of `SharedCurve`, before any law is chosen.

    `discrepancy`, tau, is the standard deviation of ln(amplitude) of a setting about the curve.  The weights of the
    laws, (L,), sum to one.  Where the fit carries an unmodelled `effect`, L is 1.  `measured` as of `SharedCurve`.
    """

    reference: float
    amplitude: FloatArray
    relaxation: FloatArray
    n: FloatArray
    discrepancy: FloatArray
    weights: FloatArray
    labels: tuple[str, ...]
    effect: "EffectCurve | None" = None
    coverage: Coverage | None = None
    measured: LawFree | None = None

    def choose(self, law: "np.ndarray[Any, Any]", draw: "np.ndarray[Any, Any]") -> SharedCurve:
        """Curve whose i-th draw is draw `draw[i]` of law `law[i]`."""
        effect = self.effect and replace(self.effect, coefficients=self.effect.coefficients[draw])
        return SharedCurve(
            self.reference, self.amplitude[law, draw], self.relaxation[law, draw], self.n[law, draw],
            self.discrepancy[law, draw], dict(zip(self.labels, self.weights.tolist(), strict=True)), effect,
            self.coverage, self.measured, draw % len(self.measured.scruton_number) if self.measured else None,
        )  # fmt: skip


def law_curves(tree: "xr.DataTree", *, law_n: float | None = None, near: float | None = None) -> LawCurves:
    """Draws of the curve that the peak tests share, law by law; `law_n` as of `predict`.

    The measured damping has no say where one law is asked for, nor where an effect is in the curve.  A law that has no
    curve of its own, see `what_if`, starts from one test, the nearest to the Scruton number `near`: see `Start`.

    Raises
    ------
    InputError
        If the tree holds no campaign posterior.
    """
    if "campaign_posterior" not in tree:
        raise InputError("posterior", "", "no campaign posterior", "a fit of at least one test in wind")
    group = tree["campaign_posterior"]
    labels, weights = law_weights(tree)

    def draws(name: str) -> FloatArray:
        return np.asarray(group[name].to_numpy(), dtype=float).reshape(len(labels), -1)

    coverage = coverage_of(tree)
    reference = float(group.attrs["reference_scruton_number"])
    amplitude, relaxation, n, discrepancy = map(
        draws, ("reference_amplitude", "reference_relaxation", "n", "discrepancy_amplitude")
    )
    if "effect" in tree and law_n is None:
        carried = tree["effect"]
        rows = np.resize(carried["coefficient"].to_numpy(), (n.shape[1], carried.sizes["term"]))
        table = np.zeros((n.shape[1], COLUMNS))
        table[:, [Term[str(name).upper()] for name in carried["term"].to_numpy()]] = rows
        effect = EffectCurve(
            table, *(float(carried.attrs[key]) for key in ("omega0", "mass_damping_factor", "largest"))
        )
        names = [str(carried.attrs["effect"]), *np.atleast_1d(carried.attrs["also"]).tolist()]
        # The reference law's curve, and what is unknown added to the discrepancy.
        tau = np.hypot(discrepancy[:1], float(carried.attrs["discrepancy_sd"]))
        label = f"{labels[0]} with " + " and ".join(names)
        return LawCurves(reference, amplitude[:1], relaxation[:1], n[:1], tau, np.ones(1), (label,), effect, coverage)
    kept = list(range(len(labels)))
    if law_n is not None:
        if what_if(tree, law_n):
            start = nearest_start(starts(tree), reference if near is None else near)
            return start.curves(law_n, mixed(weights, n.shape[1]), discrepancy, coverage)
        kept, labels = [k for k in kept if np.all(n[k] == law_n)][:1], [f"n={law_n:g}"]
    return LawCurves(
        reference, amplitude[kept], relaxation[kept], n[kept], discrepancy[kept], weights[kept] / weights[kept].sum(),
        tuple(labels), coverage=coverage, measured=law_free(tree) if law_n is None else None,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Start:
    """One peak test, which a law without a curve of its own starts from: its draws in the model that predicts, (S,).

    The laws that were fitted are mixed by their weights; `relaxation` is Sc_lambda there.
    """

    test: str
    scruton_number: FloatArray
    amplitude: FloatArray
    relaxation: FloatArray

    def index(self, scruton_numbers: FloatArray | float) -> FloatArray:
        """Median extrapolation index from this test, shaped as the argument."""
        sc = np.asarray(scruton_numbers, dtype=float)[..., None]
        return np.asarray(np.median(extrapolation_index(sc, self.scruton_number, self.relaxation), axis=-1))

    def curves(self, n: float, law: "np.ndarray[Any, Any]", discrepancy: FloatArray, coverage: Coverage) -> LawCurves:
        """The curve of the exponent `n` through the stable amplitude here.

        `law` (S,) says which of the laws' `discrepancy` (L, S) each draw has.
        """
        here = float(np.median(self.scruton_number))
        away = here - self.scruton_number
        amplitude = self.amplitude * amplitude_ratio(away / self.relaxation, n)
        relaxation = np.maximum(self.relaxation - n * away, 1e-3 * self.relaxation)
        return LawCurves(
            here, amplitude[None], relaxation[None], np.full((1, law.size), n),
            discrepancy[law, np.arange(law.size)][None], np.ones(1), (f"n={n:g}",),
            coverage=replace(coverage, start=here),
        )  # fmt: skip


def starts(tree: "xr.DataTree") -> list[Start]:
    """Every peak test as the start of a law without a curve of its own."""
    group, constant = tree["campaign_posterior"], tree["constant_data"]
    _, weights = law_weights(tree)
    found = []
    for test in map(str, group["peak_test"].to_numpy()):
        sc, amplitude, factor, rate = (
            np.asarray(group[name].sel(peak_test=test).to_numpy(), dtype=float).reshape(len(weights), -1)
            for name in ("scruton_number", "a_star", "mass_damping_factor", "relaxation_rate")
        )
        omega0 = 2.0 * np.pi * float(constant["frequency"].sel(test=test))
        law, draw = mixed(weights, sc.shape[1]), np.arange(sc.shape[1])
        found.append(Start(test, sc[law, draw], amplitude[law, draw], (factor * rate / omega0)[law, draw]))
    return found


def nearest_start(found: "Sequence[Start]", near: float) -> Start:
    """The test that a Scruton number is nearest to, by the extrapolation index."""
    return min(found, key=lambda start: abs(float(start.index(near))))


def what_if(tree: "xr.DataTree", law_n: float | None) -> tuple[str, ...]:
    """Why a law that is asked for has no curve of its own, in one sentence; empty where it has.

    That is where it was fitted, carries weight, and some law of the card holds: else its curve misses the tests.
    """
    if law_n is None:
        return ()
    group = tree["campaign_posterior"]
    labels, n = group["law"].to_numpy(), group["n"].to_numpy()
    label = next((str(labels[k]) for k in range(len(labels)) if np.all(n[k] == law_n)), "")
    if not label:
        why = "was not fitted"
    elif (weight := told_weights(tree)[label]) < CARRIES:
        why = f"has next to no weight in the fit ({weight:.1g})"
    elif doubted(tree):
        why = "does not hold, nor does another of the card"
    else:
        return ()
    return (
        f"the law n = {law_n:g} {why}: its curve is a what-if, from the stable amplitude and the relaxation that the "
        "fit found at the nearest test",
    )


def shared_curve(
    tree: "xr.DataTree", *, law_n: float | None = None, near: float | None = None, seed: int = 0
) -> SharedCurve:
    """Draws of the shared curve: each draw from one law, as many of each as it has weight; see `law_curves`."""
    laws = law_curves(tree, law_n=law_n, near=near)
    size = laws.n.shape[1]
    # Systematic allocation: as many draws of a law as its weight says, to one; scattered, since chains are ordered.
    rng = stream(seed, "laws")
    place = np.searchsorted(np.cumsum(laws.weights), (np.arange(size) + rng.random()) / size)
    curve = laws.choose(rng.permutation(np.minimum(place, len(laws.labels) - 1)), np.arange(size))
    return replace(curve, laws={label: weight for label, weight in curve.laws.items() if weight})


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Random numbers of their own for each purpose, which nothing else that starts from the same seed shares."""
    return np.random.default_rng([seed, zlib.crc32(f"griffin: {purpose}".encode())])
