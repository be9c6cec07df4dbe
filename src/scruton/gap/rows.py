"""A campaign's gap from its parameter rows alone: stable amplitude and relaxation rate of every test, nothing else.

A published table tells no more.  One row predicts the others through the shared (Y1, epsilon); each effect is asked how
much of the disagreement it would take away, and at what size.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE, Layout
from scruton.dynamics.effects.effect import SOME, Parameter, Variant
from scruton.dynamics.effects.terms import COLUMNS, HATS, Term
from scruton.dynamics.limit_cycle import amplitude_rates, limit_cycle_amplitude
from scruton.gap.thresholds import CLOSES_NOTHING


@dataclass(frozen=True, eq=False)
class Rows:
    """One row a test, (T,) arrays.

    Attributes
    ----------
    scruton_number, reduced_velocity : arrays
    omega : array
        Natural circular frequency [rad/s].
    damping_ratio : array
        Structural, as stated.
    aero_ratio, drive_ratio : arrays
        Linear aerodynamic damping and drive over those of the middle row for equal Y1 and epsilon.
    amplitude, rate : arrays
        Stable amplitude (A/D or rad) and relaxation rate [1/s].
    amplitude_sd, rate_sd : arrays
        Of their logarithms.
    """

    scruton_number: FloatArray
    reduced_velocity: FloatArray
    omega: FloatArray
    damping_ratio: FloatArray
    aero_ratio: FloatArray
    drive_ratio: FloatArray
    amplitude: FloatArray
    rate: FloatArray
    amplitude_sd: FloatArray
    rate_sd: FloatArray

    @property
    def middle(self) -> int:
        """Row with the middle Scruton number."""
        return int(np.argsort(self.scruton_number)[(len(self.scruton_number) - 1) // 2])


@dataclass(frozen=True)
class Closed:
    """How far one effect closes the gap between rows.

    Attributes
    ----------
    effect, form : str
    misfit_before, misfit_after : float
        Chi-square of the rows about the shared curve, without and with the effect.
    fraction : float
        Part of the misfit taken away.
    amplitude_errors : tuple of float
        Predicted over measured stable amplitude less one, row by row, with the effect.
    parameters : tuple of (str, float)
        Names and values, those of each member.
    penalised : float
        Misfit after, plus what the effect's size costs against its prior: the smaller, the more plausible.
    """

    effect: str
    form: str
    misfit_before: float
    misfit_after: float
    fraction: float
    amplitude_errors: tuple[float, ...]
    parameters: tuple[tuple[str, float], ...]
    penalised: float


def close_rows(rows: Rows) -> tuple[Closed, ...]:
    """Ask every catalogued effect how far it closes the gap, the most plausible first.

    Effects that leave the rows as they are, whatever their size, are left out.
    """
    layout = _layout(rows)
    null = _Problem(rows, layout)
    before = float(np.sum(null.misfit(null.fit()) ** 2))
    closed = []
    for effect in CATALOGUE.values():
        options = []
        for variant in effect.variants(layout):
            of_some = variant.scope.extent in SOME  # which, no score test says here
            if variant.scan or of_some or variant.refines or effect.channel == "frequency":  # for rows are few
                continue
            problem = _Problem(rows, layout, variant)
            x = problem.fit()
            after = float(np.sum(problem.misfit(x) ** 2))
            errors = tuple(float(e) for e in problem.predicted(x)[0] / rows.amplitude - 1.0)
            named = tuple(
                (p.name if p.size == 1 else f"{p.name}[{j}]", float(np.exp(value) if p.log else value))
                for p, part in problem.parts(x)
                for j, value in enumerate(part, 1)
            )
            penalised = after + float(np.sum(problem.prior(x) ** 2))
            fraction = 1.0 - after / before
            options.append(Closed(effect.name, variant.label, before, after, fraction, errors, named, penalised))
        best = min(options, key=lambda option: option.penalised, default=None)
        if best is not None and best.fraction > CLOSES_NOTHING:
            closed.append(best)
    # of two that say the same of rows, the last digit of a processor is not to tell which comes first
    return tuple(sorted(closed, key=lambda result: (round(result.penalised, 6), result.effect)))


def _layout(rows: Rows) -> Layout:
    count, m = len(rows.amplitude), rows.middle
    index = np.arange(count)
    return Layout(
        records=tuple(f"row {j + 1}" for j in range(count)), rig=index, test=index,
        direction=np.zeros(count, dtype=int),
        duration=np.ones(count), omega=rows.omega, largest=rows.amplitude, reduced_velocity=rows.reduced_velocity,
        scruton_number=rows.scruton_number, reference_amplitude=float(rows.amplitude[m]),
        reference_rate=float(rows.rate[m]), reference_omega=float(rows.omega[m]),
        knots=np.geomspace(rows.amplitude.min() / 3.0, rows.amplitude.max() * 3.0, HATS),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Problem:
    """Least squares of the rows in ln(stable amplitude), ln(relaxation rate) and an effect's own coordinates."""

    rows: Rows
    layout: Layout
    variant: Variant | None = None

    def parts(self, x: FloatArray) -> list[tuple[Parameter, FloatArray]]:
        """The effect's parameters with their coordinates."""
        parameters = self.variant.parameters if self.variant else ()
        ends = 2 + np.cumsum([p.size for p in parameters], dtype=int)
        return [(p, x[end - p.size : end]) for p, end in zip(parameters, ends, strict=True)]

    def predicted(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stable amplitudes as read, and relaxation rates, (T,) each."""
        rows, layout = self.rows, self.layout
        table = np.zeros((1, len(rows.amplitude), COLUMNS))
        still, rate = rows.omega * rows.damping_ratio, np.exp(x[1])
        table[0, :, Term.STRUCTURAL] = still
        table[0, :, Term.AERO] = (rate - still[rows.middle]) * rows.aero_ratio
        table[0, :, Term.DRIVE] = np.exp(x[0]) * rate * rows.drive_ratio
        if self.variant:
            padded = {p.name: (np.r_[np.exp(part) if p.log else part, 0.0], p.members) for p, part in self.parts(x)}
            self.variant.apply(table, {name: part[members][None] for name, (part, members) in padded.items()}, layout)
        knots = np.log(layout.knots)
        amplitude = limit_cycle_amplitude(table[0], knots, layout.reference_amplitude)
        amplitude = np.where(np.isfinite(amplitude) & (amplitude > 0.0), amplitude, 1e-3 * layout.reference_amplitude)
        step = 1e-4 * amplitude
        up, down = (amplitude_rates(table[0], (amplitude + s * step)[:, None], knots)[:, 0] for s in (1.0, -1.0))
        rate = np.maximum(-(up - down) / (2.0 * step), 1e-9)
        return amplitude * (1.0 + table[0, :, Term.GAIN]), rate

    def misfit(self, x: FloatArray) -> FloatArray:
        """Distances of the rows from what is predicted, in standard deviations, (2 T,)."""
        rows, (amplitude, rate) = self.rows, self.predicted(x)
        away = np.log(amplitude / rows.amplitude) / rows.amplitude_sd, np.log(rate / rows.rate) / rows.rate_sd
        return np.concatenate(away)

    def prior(self, x: FloatArray) -> FloatArray:
        """Distances of the effect's coordinates from their priors, in standard deviations."""
        return np.concatenate([np.zeros(0), *((part - p.location) / p.scale for p, part in self.parts(x))])

    def fit(self) -> FloatArray:
        """Coordinates at the optimum, with the priors of the effect."""
        rows, m, parameters = self.rows, self.rows.middle, self.variant.parameters if self.variant else ()
        first = [
            np.log(rows.amplitude[m]),
            np.log(rows.rate[m]),
            *(p.starts[0] for p in parameters for _ in range(p.size)),
        ]
        shift = np.arange(len(first)) > 1

        def residuals(x: FloatArray) -> FloatArray:
            cut = [1e3 * np.minimum(np.r_[part, 0.0][p.members], 0.0) for p, part in self.parts(x) if p.positive]
            return np.concatenate([self.misfit(x), self.prior(x), *cut])

        fits = [least_squares(residuals, first + s * shift) for s in ((0.0, -0.1, 0.1) if parameters else (0.0,))]
        return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def rows_text(closed: Sequence[Closed]) -> list[list[str]]:
    """Table of what each effect would close: effect, form, part closed, amplitude errors, parameters."""
    return [
        [
            row.effect, row.form, f"{row.fraction:.0%}",
            " ".join(f"{100 * e:+.0f}" for e in row.amplitude_errors),
            ", ".join(f"{name} {value:.3g}" for name, value in row.parameters[:3]),
        ]
        for row in closed
    ]  # fmt: skip
