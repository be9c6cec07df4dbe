"""Structural damping as tests take it: one constant a rig, or xi_s(A) where its ring-downs show that it varies."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Rig
from scruton.envelope import Cycles, RingDown
from scruton.infer.cards import ModelCard
from scruton.infer.front import damping_varies
from scruton.infer.results import RigResult, TestResult
from scruton.infer.thresholds import BAND_FLOOR
from scruton.infer.varying import VaryingDamping
from scruton.said import damping, listed, said
from scruton.stats.priors import Prior

_GRID = 200  # amplitudes, evenly spaced in ln A, over which the variation is averaged
_LAST = 10  # cycles that a record's level is the mean of


def stated_damping(rig: Rig, card: ModelCard, campaign: Campaign) -> Prior:
    """Prior of xi_s: what the laboratory states, with the card's relative uncertainty where it states none."""
    if rig.damping_ratio is None:
        return replace(card.prior("structural_damping", campaign.section.motion), name="damping_ratio")
    stated = rig.damping_ratio.or_relative_sd(card.damping_relative_sd)
    log_sd = max(stated.log_sd, 1e-6)  # a distribution, even of what is stated to be certain
    return Prior("damping_ratio", "lognormal", stated.median, log_sd, "-", f"as stated for rig {rig.name}")


def _curve(ringdown: RingDown) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The logarithms of A and of xi_s(A), and the standard error of the latter, where the ring-downs tell xi_s."""
    known = ringdown.curve_damping_ratio > 2.0 * ringdown.curve_sd
    error = np.hypot(ringdown.curve_sd / np.where(known, ringdown.curve_damping_ratio, 1.0), BAND_FLOOR)
    return np.log(ringdown.curve_amplitude[known]), np.log(ringdown.curve_damping_ratio[known]), error[known]


def draws_over_amplitudes(ringdown: RingDown, rng: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """xi_s(A) with its error, A drawn evenly in ln A over the ring-downs: what is known of it at no amplitude said."""
    amplitude, damping, error = _curve(ringdown)
    at = rng.uniform(amplitude[0], amplitude[-1], shape)
    z = rng.standard_normal(shape)
    return np.asarray(np.exp(np.interp(at, amplitude, damping) + np.interp(at, amplitude, error) * z))


def ends(records: Sequence[Cycles]) -> list[float]:
    """Amplitude at which each record ends, A/D or rad."""
    return [max(float(cycles.amplitude[-_LAST:].mean()), 1e-9) for cycles in records]


def varying_of(rig: RigResult) -> VaryingDamping | None:
    """xi_s(A) of a rig for the drift of its tests; None where one constant will do."""
    if rig.varying is None:
        return None
    amplitude, damping, _ = _curve(rig.varying)
    return VaryingDamping(amplitude, np.exp(damping))


def damping_prior(rig: RigResult, records: Sequence[Cycles], unit: str) -> Prior:
    """Prior of xi_s in a test: the posterior of its rig, or xi_s(A) where it varies.

    Parameters
    ----------
    rig : RigResult
    records : sequence of Cycles
        Of the test.
    unit : str
        Of amplitudes, for the reason.

    Returns
    -------
    Prior
        Lognormal.  Where damping varies, about xi_s at the amplitude where the records end, which is the stable one;
        its logarithmic standard deviation is the root of the squares of the curve's error there and of the root mean
        square of ln xi_s(A) - ln xi_s(A*), evenly in ln A over the amplitudes where the records end.  Beyond the
        ring-downs xi_s is held constant, and is as uncertain as if it varied there as on the near side of their end.
    """
    if rig.varying is None:
        log = np.log(rig.damping)
        return _lognormal(float(log.mean()), float(log.std()), f"posterior of rig {rig.rig.name}")
    amplitude, damping, error = _curve(rig.varying)
    bottom, top = amplitude[0], amplitude[-1]
    last = np.log(ends(records))
    at = float(np.median(last))
    covered = np.linspace(last.min(), last.max(), _GRID)
    covered = np.where(covered > top, 2.0 * top - covered, np.where(covered < bottom, 2.0 * bottom - covered, covered))
    middle = float(np.interp(at, amplitude, damping))
    departure = np.interp(covered, amplitude, damping) - middle
    spread = float(np.hypot(np.interp(at, amplitude, error), np.sqrt(np.mean(departure**2))))
    beyond = not bottom <= at <= top
    where = f"at {np.exp(at):.3g} {unit}{', beyond its ring-downs' if beyond else ''}"
    return _lognormal(middle, spread, f"xi_s(A) of rig {rig.rig.name} {where}")


def _lognormal(log_mean: float, log_sd: float, reason: str) -> Prior:
    return Prior("damping_ratio", "lognormal", float(np.exp(log_mean)), max(log_sd, 1e-6), "-", reason)


def varying_damping(campaign: Campaign, rigs: Mapping[str, RigResult], tests: Sequence[TestResult]) -> list[str]:
    """Rigs whose still-air damping depends on the amplitude, and what was made of it: one sentence each."""
    unit = campaign.section.amplitude_unit
    lines: list[str] = []
    for name, rig in rigs.items():
        if rig.varying is None:
            continue
        bands = [rig.varying.bands[i] for i in damping_varies(rig.varying) or ()]
        texts = listed(
            [damping(band.damping_ratio), f" at {band.lower:.3g} to {band.upper:.3g} {unit}"] for band in bands
        )
        low, high = np.quantile(rig.damping, [0.05, 0.95]).tolist()
        priors = {one.test.name: one.posterior.prior("damping_ratio") for one in tests if one.rig.name == name}
        used = [
            (f"; test {test} takes ", damping(prior.first), f" ± {100 * prior.second:.2g} % of that, {prior.reason}")
            for test, prior in priors.items()
        ]
        lines.append(
            said(
                f"rig {name}: structural damping varies with amplitude (",
                texts,
                "). No constant stands for it: its posterior, ",
                damping(low),
                " to ",
                damping(high),
                ", is over all amplitudes of the ring-downs",
                *used,
                "; the drift of its transients has xi_s(A) in it",
                ". Eq. (6) takes the measured xi_s(A)",
            )
        )
    return lines
