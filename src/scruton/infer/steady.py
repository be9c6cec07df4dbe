r"""Whether the fluctuations of a lock-in record say how fast the vibration relaxes.

Under broad-band turbulence the amplitude obeys :math:`da = \lambda(a^* - a)\,dt + q\,dW`, so a record without any
release tells the relaxation rate.  Gusts that outlast the relaxation make the same amplitude wander more slowly, and a
rate read off it is then too small; nor could a model with gusts tell it, as the spectrum of what follows a gust does
not change where the rates of the two are exchanged.  The fluctuations are used only where four conditions hold, under
broad-band turbulence alone.  Thresholds are from
records of the full equation of motion (heaving, lambda/omega0 0.006 to 0.03, 60 to 200 relaxation times, turbulence
making 1 to 3 % amplitude scatter), with and without gusts of 1 to 3 % of the wind that last 2 to 10 relaxation times:

* *white innovations*: Ljung-Box p of at least 0.001.  Of 120 clean records 2 % fell below 0.01 and none below 0.001.
  It catches misfits of any kind but is blind to most gusts (9 % of those that spoilt the rate): a smaller rate mimics
  them.
* *no slow gusts*: the spectrum of the amplitude is not more probable with gusts than without (Bayes factor at most 1).
  It accused 5 % of 200 clean records, and 82 % of the gusty ones whose 90 % interval of the rate missed the truth.
* *relaxation times*: 30, by the 5 % quantile of the rate, and a posterior of its logarithm at most half as wide as the
  prior.  The relative error of a rate is about (2/N)^0.5 after N relaxation times, 26 % at 30.
* *amplitude against phase*: the noise that moves the amplitude turns the phase by a dphi = q dW'.  The ratio of the two
  scattered by 8 % over clean records; where the whole of its 90 % interval lies beyond a factor 1.25, something other
  than broad-band turbulence is at work, such as a frequency that drifts with the wind.

Over 200 clean records that the thresholds were not chosen on, 95 % were usable, and the 90 % intervals of the rate
covered the truth in 88 % of these.  Over 200 gusty ones the interval missed it in 92 %, and 85 % of those were refused.
What slips through has a rate too small by a factor 0.6 in the median: gusts as strong as the turbulence, in a section
whose frequency does not answer to the wind, leave hardly a trace.  Where it does (Y2 = 20), 96 % are refused.
Gusts of 0.2 to 1 relaxation times spoil the rate in 7 records of 10, and only 59 % of those are refused.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray, end_to_end
from scruton.dynamics.cycles import EnvelopeData
from scruton.envelope import Cycles, beats, swing
from scruton.envelope.phase_diffusion import periodogram, phase_steps, step_spectrum, unbroken
from scruton.envelope.thresholds import SWING
from scruton.infer import thresholds as limits
from scruton.infer.models import NOISE, WindPosterior
from scruton.stats.priors import Prior
from scruton.stats.samples import Samples
from scruton.stats.whiteness import lags_of, ljung_box

_BAND = 1.645  # 90 % of a normal
_LEAST_LINES = 20


@dataclass(frozen=True)
class Condition:
    """One condition on a steady record.

    Attributes
    ----------
    name : str
    holds : bool
    value : float
        NaN where it cannot be computed, and then the condition does not hold.
    low, high : float
        What is allowed.
    sentence : str
        Finding and bound, in plain English.
    """

    name: str
    holds: bool
    value: float
    low: float
    high: float
    sentence: str


@dataclass(frozen=True, eq=False)
class SteadyVerdict:
    """What a steady record may be used for.

    Attributes
    ----------
    record : str
    conditions : tuple of Condition
    cycles : Cycles
        What may enter the likelihood: the record from where it has settled.
    left_out : int
        Cycles before that.
    settled : bool
        Whether the amplitude stands; else its mean is known to no better than what it swings by.
    """

    record: str
    conditions: tuple[Condition, ...]
    cycles: Cycles
    left_out: int = 0
    settled: bool = True

    @property
    def usable(self) -> bool:
        """Whether its cycles may enter the state-space likelihood."""
        return all(condition.holds for condition in self.conditions)

    def explain(self) -> str:
        """One sentence: used, or why not."""
        verdict = "are used" if self.usable else "are not used (only the mean amplitude is)"
        why = "; ".join(condition.sentence for condition in self.conditions if self.usable or not condition.holds)
        start = f" (its first {self.left_out} cycles, which had not settled, are left out)" if self.left_out else ""
        return f"record {self.record}: lock-in fluctuations {verdict}: {why}{start}"


def stationary_part(cycles: Cycles) -> Cycles:
    """Leave out the start of a steady record that begins far from where it stays.

    Such a start is a release, which the user may declare as growth or decay.  Here it would dominate the rate
    and speak for the shape of the law, and a steady record is judged on its fluctuations alone.
    """
    a = cycles.amplitude
    late = a[a.size // 2 :]
    off = np.abs(a - np.median(late)) / max(float(late.std()), 1e-300)
    if not np.median(off[:3]) > limits.NOT_SETTLED:
        return cycles
    return cycles.part(slice(int(np.argmax(off <= limits.SETTLED)), None))


def steady_posterior(
    name: str, cycles: Cycles, priors: Sequence[Prior], omega0: float, initial_sd: float = 1.0
) -> WindPosterior:
    """Posterior of one steady record by itself without gusts, linear about its stable amplitude (n = -1).

    Parameters
    ----------
    name : str
        The record.
    cycles : Cycles
        All of it.
    priors : sequence of Prior
        Of the parameters `models.WIND`; those of an exponent, of gusts, set-points and departures are not used.
    omega0 : float
        Natural circular frequency in still air [rad/s].
    initial_sd : float
        Prior of the initial amplitude.
    """
    data = EnvelopeData.join({name: stationary_part(cycles)})
    calm = (p for p in priors if p.name in ("stable_amplitude", "relaxation_ratio", *NOISE[:2], "damping_ratio"))
    return WindPosterior(tuple(calm), data, (), omega0, -1.0, initial_sd)


def judge_steady(name: str, cycles: Cycles, samples: Samples, posterior: WindPosterior) -> SteadyVerdict:
    """Judge whether the fluctuations of a steady record may enter the likelihood.

    Parameters
    ----------
    name : str
        The record.
    cycles : Cycles
        All of it, as given to `steady_posterior`.
    samples : Samples
        Of that posterior.
    posterior : WindPosterior
        From `steady_posterior`.

    Raises
    ------
    ValueError
        If the posterior is of other cycles.
    """
    kept = stationary_part(cycles)
    left_out = cycles.time.size - kept.time.size
    if ends := beats(kept):
        low, high = ends
        text = f"the amplitude rises and falls to the end, between {low:.3g} and {high:.3g}: no one value is stable"
        one = Condition("one stable amplitude", False, high / low, 1.0, float("inf"), text)
        return SteadyVerdict(name, (one,), kept, left_out, settled=False)
    if posterior.data.size != kept.time.size:
        raise ValueError(
            f"the posterior holds {posterior.data.size} cycles and record {name} {kept.time.size}: "
            "make it with steady_posterior"
        )
    draws = end_to_end(samples.chain)
    _, rate, q, r, *_ = posterior.state_space(draws)
    run = kept.part(unbroken(kept))
    if run.time.size < limits.FEWEST_ADJACENT:
        text = f"it holds only {run.time.size} adjacent cycles (at least {limits.FEWEST_ADJACENT})"
        short = Condition(
            "adjacent cycles", False, float(run.time.size), float(limits.FEWEST_ADJACENT), float("inf"), text
        )
        return SteadyVerdict(name, (short,), kept, left_out)
    error = float(np.median(r) * np.sqrt(np.mean(run.standard_error**2)))
    conditions = (
        _white(posterior, draws),
        _gusts(run, posterior, np.log(q), error),
        _long(kept, rate, posterior.named(draws)["relaxation_ratio"], posterior.prior("relaxation_ratio")),
        _phase(run, float(np.median(rate)), np.log(q), error),
    )
    return SteadyVerdict(name, conditions, kept, left_out)


def judge_swings(transients: Mapping[str, Cycles]) -> list[SteadyVerdict]:
    """What the transients of a test may be used for that swing past their stable amplitude.

    No damping that depends on the amplitude alone does that: they say nothing of the law, and only where they stand,
    like lock-in, of the stable amplitude.  Where half of them swing, what makes them do so is at work in all.

    Parameters
    ----------
    transients : mapping of str to Cycles
        By name of the record.
    """
    found = {name: swing(cycles) for name, cycles in transients.items()}
    if 2 * sum(one is not None for one in found.values()) >= len(found):
        found = {name: one or swing(transients[name], anyway=True) for name, one in found.items()}
    verdicts = []
    for name, one in found.items():
        if one is not None:
            text = f"the amplitude passes the one where it comes to stand by {one.beyond:.0%} (at most {SWING:.0%})"
            text += ", others of the test by more" if one.beyond <= SWING else ""
            condition = Condition("comes to stand from one side", False, one.beyond, 0.0, SWING, text)
            left_out = transients[name].time.size - one.standing.time.size
            verdicts.append(SteadyVerdict(name, (condition,), one.standing, left_out, one.settled))
    return verdicts


def gust_log_odds(
    amplitude: FloatArray, period: float, rate: FloatArray, weight: FloatArray, q: FloatArray, error: float
) -> float:
    r"""Log Bayes factor of slow gusts against broad-band turbulence alone, by Whittle's likelihood.

    Gusts move the amplitude that the section tends to, as an Ornstein-Uhlenbeck process of standard deviation
    `GUST_SIZE` times the record's and of one of the times `GUST_TIMES`; the section follows at its relaxation rate.

    Parameters
    ----------
    amplitude : (N,) array
        Means over adjacent cycles.
    period : float
        Of one cycle [s].
    rate, weight : (L,) arrays
        Relaxation rates [1/s], and their prior weights.
    q : (Q,) array
        Process noise, equally probable.
    error : float
        Of one amplitude.

    Notes
    -----
    The rate is unknown under both: a faster one makes room for gusts.  What tells them apart is the bend of the
    spectrum (gusts fall off with the fourth power of frequency beyond the rate), and the prior of the rate.
    """
    from scipy.special import logsumexp

    angle, power, count = _binned(*periodogram(amplitude))
    cosine = np.cos(angle)
    response = _relaxing(rate, period, cosine)
    calm = response[:, None, :] * (q**2 / (2.0 * rate[:, None]))[:, :, None] + error**2
    log_weight = np.log(weight)[:, None]

    def evidence(spectrum: FloatArray) -> float:
        like = -(count * (np.log(spectrum) + power / spectrum)).sum(axis=-1)
        return float(logsumexp(like + log_weight))

    variance = limits.GUST_SIZE**2 * float(amplitude.var())
    gusty = []
    for time in limits.GUST_TIMES:
        k = 1.0 / time
        followed = (_relaxing(k * rate, period, cosine) - k * response) / (1.0 - k * k)
        gusty.append(evidence(calm + variance * followed[:, None, :]))
    return float(logsumexp(gusty) - np.log(len(gusty))) - evidence(calm)


def phase_noise(cycles: Cycles, highest: float, error: float) -> tuple[float, float, int]:
    """Log intensity of the phase's random walk times the amplitude, its standard deviation, and the lines it is from.

    Parameters
    ----------
    cycles : Cycles
        Without a gap.
    highest : float
        Angle per cycle up to which the spectrum is used: a walk seen at lags of pi/highest cycles and more.
    error : float
        Of one amplitude.

    Returns
    -------
    mean, sd : float
        Of ln q, amplitude per sqrt(s), with a flat prior over its logarithm.
    lines : int
    """
    angle, power = periodogram(phase_steps(cycles))
    slope, floor = step_spectrum(angle, 1.0 / cycles.reference_frequency, error)
    lines = int(np.clip(np.count_nonzero(angle <= highest), min(_LEAST_LINES, angle.size), angle.size))
    angle, power, slope, floor = (array[:lines] for array in (angle, power, slope, floor))
    centre = 0.5 * np.log(np.mean(power / slope))
    log_q = centre + np.linspace(-3.0, 1.5, 901)
    spectrum = np.exp(2.0 * log_q)[:, None] * slope + floor
    like = -(np.log(spectrum) + power / spectrum).sum(axis=1)
    weight = np.exp(like - like.max())
    weight /= weight.sum()
    mean = float(weight @ log_q)
    return mean, float(np.sqrt(weight @ (log_q - mean) ** 2)), lines


def _relaxing(rate: FloatArray, period: float, cosine: FloatArray) -> FloatArray:
    """Spectrum of the cycle means of an Ornstein-Uhlenbeck process of unit variance, (rates, angles)."""
    x = rate[:, None] * period
    forget, lost = np.exp(-x), -np.expm1(-x)
    first = 2.0 * (x - lost) / x**2
    others = 2.0 * (lost / x) ** 2 * (cosine - forget) / (1.0 - 2.0 * forget * cosine + forget**2)
    return np.asarray(first + others, dtype=np.float64)


def _binned(angle: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean angle, mean power and number of lines in bins: single lines first, then 6 % wide."""
    edges = list(range(min(80, angle.size)))
    while edges and edges[-1] < angle.size:
        edges.append(max(edges[-1] + 1, int(1.06 * edges[-1])))
    bounds = np.unique(np.minimum(edges, angle.size))
    count = np.diff(bounds)
    starts = bounds[:-1]
    return np.add.reduceat(angle, starts) / count, np.add.reduceat(power, starts) / count, count.astype(np.float64)


def _white(posterior: WindPosterior, draws: FloatArray) -> Condition:
    x, bound = posterior.standardised(draws)[1:], limits.WHITE
    lags = lags_of(x.size)
    _, p = ljung_box(x, lags)
    holds = bool(p >= bound)
    text = f"innovations are {'' if holds else 'not '}white (Ljung-Box p = {p:.2g} over {lags} lags, bound {bound:g})"
    return Condition("white innovations", holds, p, bound, 1.0, text)


def _gusts(run: Cycles, posterior: WindPosterior, log_q: FloatArray, error: float) -> Condition:
    period = 1.0 / run.reference_frequency
    ratio, damping = posterior.prior("relaxation_ratio"), posterior.prior("damping_ratio")
    # From what structural damping alone would do (Y1 < 0), to half a radian a cycle: nothing relaxes faster.
    log_ratio = np.linspace(
        damping.location, max(np.log(0.5 / (period * posterior.omega0)), damping.location + 0.5), 40
    )
    weight = np.exp(ratio.log_density(log_ratio))
    if not np.any(weight > 0.0):
        weight = np.ones_like(weight)
    q = np.exp(log_q.mean() + max(float(log_q.std()), 0.02) * np.linspace(-3.0, 3.0, 13))
    rate = np.exp(log_ratio) * posterior.omega0
    with np.errstate(divide="ignore"):
        log_odds = gust_log_odds(run.amplitude, period, rate, weight, q, error)
    odds = float(np.exp(np.clip(log_odds, -700.0, 700.0)))
    holds = bool(odds <= limits.GUST_ODDS)
    than = f"{limits.GUST_TIMES[0]:g} to {limits.GUST_TIMES[-1]:g} relaxation times"
    text = f"gusts that last {than} are {'no more' if holds else 'more'} probable than none (odds {odds:.2g})"
    return Condition("no slow gusts", holds, odds, 0.0, limits.GUST_ODDS, text)


def _long(cycles: Cycles, rate: FloatArray, log_ratio: FloatArray, prior: Prior) -> Condition:
    length = float(cycles.time[-1] - cycles.time[0]) + 1.0 / cycles.reference_frequency
    times, least = length * float(np.quantile(rate, 0.05)), limits.RELAXATIONS
    moved, most = float(log_ratio.std()) / prior.scale, limits.RATE_SD
    text = (
        f"its fluctuations alone leave it as few as {times:.0f} relaxation times, by the 5 % quantile of the rate that "
        f"they tell (at least {least:g} wanted)"
    )
    if moved > most:
        text = f"the rate is hardly known: its posterior is {moved:.2f} times as wide as its prior (at most {most:g})"
    return Condition("relaxation times", times >= least and moved <= most, times, least, float("inf"), text)


def _phase(run: Cycles, rate: float, log_q: FloatArray, error: float) -> Condition:
    name, low, high = "amplitude against phase", 1.0 / limits.AGREE, limits.AGREE
    if not np.ptp(run.phase) > 0.0:
        text = "the phase is not known, as the file holds an envelope, so the noise cannot be checked against it"
        return Condition(name, False, float("nan"), low, high, text)
    mean, sd, lines = phase_noise(run, limits.PHASE_BAND * rate / run.reference_frequency, error)
    difference, width = float(log_q.mean()) - mean, _BAND * float(np.hypot(sd, log_q.std()))
    value, least, most = (float(np.exp(difference + margin)) for margin in (0.0, -width, width))
    holds = bool(least <= high and most >= low)
    text = (
        f"amplitude noise is {value:.2f} times phase noise, 90 % interval {least:.2f} to {most:.2f} over {lines} lines "
        f"({low:.2g} to {high:.3g} wanted)"
    )
    if not holds:
        text += ": the frequency wanders" if value < 1.0 else ": more than broad-band turbulence moves the amplitude"
    return Condition(name, holds, value, low, high, text)
