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
from scruton.dynamics.effects.effect import Variant
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
    null, _ = _fit(rows, layout, None)
    before = float(np.sum(_misfit(rows, layout, None, null) ** 2))
    found = []
    for effect in CATALOGUE.values():
        options = []
        for variant in effect.variants(layout):
            if variant.scan or effect.channel == "frequency":
                continue
            x, _ = _fit(rows, layout, variant)
            after = float(np.sum(_misfit(rows, layout, variant, x) ** 2))
            cost = float(np.sum(_prior(variant, x) ** 2))
            amplitude, _ = _predicted(rows, layout, variant, x)
            options.append(
                Closed(
                    effect.name, variant.label, before, after, 1.0 - after / before,
                    tuple(float(e) for e in amplitude / rows.amplitude - 1.0), _named(variant, x), after + cost,
                )
            )  # fmt: skip
        best = min(options, key=lambda one: one.penalised, default=None)
        if best is not None and best.fraction > CLOSES_NOTHING:
            found.append(best)
    return tuple(sorted(found, key=lambda one: one.penalised))


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


def _split(variant: Variant, x: FloatArray) -> dict[str, FloatArray]:
    found, at = {}, 2
    for p in variant.parameters:
        part = np.exp(x[at : at + p.size]) if p.log else x[at : at + p.size]
        found[p.name] = np.r_[part, 0.0][p.members][None]
        at += p.size
    return found


def _prior(variant: Variant | None, x: FloatArray) -> FloatArray:
    if variant is None:
        return np.zeros(0)
    location = np.concatenate([np.full(p.size, p.location) for p in variant.parameters])
    scale = np.concatenate([np.full(p.size, p.scale) for p in variant.parameters])
    result: FloatArray = (x[2:] - location) / scale
    return result


def _named(variant: Variant, x: FloatArray) -> tuple[tuple[str, float], ...]:
    values = x[2:]
    names = [p.name if p.size == 1 else f"{p.name}[{j + 1}]" for p in variant.parameters for j in range(p.size)]
    logs = [p.log for p in variant.parameters for _ in range(p.size)]
    return tuple((n, float(np.exp(v) if log else v)) for n, v, log in zip(names, values, logs, strict=True))


def _predicted(rows: Rows, layout: Layout, variant: Variant | None, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Stable amplitudes as read, and relaxation rates, (T,) each."""
    count = len(rows.amplitude)
    table = np.zeros((1, count, COLUMNS))
    still = rows.omega * rows.damping_ratio
    aero = np.exp(x[1])
    table[0, :, Term.STRUCTURAL] = still
    table[0, :, Term.AERO] = aero * rows.aero_ratio
    table[0, :, Term.DRIVE] = np.exp(x[0]) * (aero + still[rows.middle]) * rows.drive_ratio
    if variant is not None:
        variant.apply(table, _split(variant, x), layout)
    knots = np.log(layout.knots)
    amplitude = limit_cycle_amplitude(table[0], knots, layout.reference_amplitude)
    amplitude = np.where(np.isfinite(amplitude) & (amplitude > 0.0), amplitude, 1e-3 * layout.reference_amplitude)
    step = 1e-4 * amplitude
    up, down = (
        np.array([amplitude_rates(table[0, j : j + 1], np.array([amplitude[j] + s * step[j]]), knots)[0, 0]
                  for j in range(count)])
        for s in (1.0, -1.0)
    )  # fmt: skip
    rate = np.maximum(-(up - down) / (2.0 * step), 1e-9)
    return amplitude * (1.0 + table[0, :, Term.GAIN]), rate


def _misfit(rows: Rows, layout: Layout, variant: Variant | None, x: FloatArray) -> FloatArray:
    amplitude, rate = _predicted(rows, layout, variant, x)
    return np.concatenate(
        [np.log(amplitude / rows.amplitude) / rows.amplitude_sd, np.log(rate / rows.rate) / rows.rate_sd]
    )


def _fit(rows: Rows, layout: Layout, variant: Variant | None) -> tuple[FloatArray, float]:
    m = rows.middle
    aero = max(float(rows.rate[m] - rows.omega[m] * rows.damping_ratio[m]), 0.05 * float(rows.rate[m]))
    starts = [np.r_[np.log(rows.amplitude[m]), np.log(aero)]]
    if variant is not None:
        first = np.concatenate([np.full(p.size, p.starts[0]) for p in variant.parameters])
        starts = [np.r_[starts[0], first], np.r_[starts[0], first - 0.1], np.r_[starts[0], first + 0.1]]

    def residuals(x: FloatArray) -> FloatArray:
        values = _split(variant, x) if variant else {}
        cut = [p.name for p in variant.parameters if p.positive] if variant else []
        low = [1e3 * min(value, 0.0) for name in cut for value in values[name][0]]
        return np.concatenate([_misfit(rows, layout, variant, x), _prior(variant, x), low])

    fits = [least_squares(residuals, start) for start in starts]
    best = min(fits, key=lambda one: float(one.cost))
    return np.asarray(best.x), float(best.cost)


def rows_text(closed: Sequence[Closed]) -> list[list[str]]:
    """Table of what each effect would close: effect, form, part closed, amplitude errors, parameters."""
    return [
        [
            one.effect, one.form, f"{one.fraction:.0%}",
            " ".join(f"{100 * e:+.0f}" for e in one.amplitude_errors),
            ", ".join(f"{name} {value:.3g}" for name, value in one.parameters[:3]),
        ]
        for one in closed
    ]  # fmt: skip
