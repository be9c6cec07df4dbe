"""Leave a test out: every rig's stable amplitude predicted from the others, and from each single one."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign import peak_tests, tests_used
from scruton.campaign.schema import Campaign
from scruton.errors import InputError
from scruton.griffin.predict import Prediction, predict
from scruton.progress import Progress
from scruton.shown import shown
from scruton.workers import HERE, Workers

if TYPE_CHECKING:
    from scruton.infer.cards import ModelCard
    from scruton.infer.sampling import Known


def _facts(one: "Validation") -> Mapping[str, object]:
    low, high = one.prediction.interval(0.90)
    return {
        "test": one.test, "source": ", ".join(one.source), "predicted": f"{one.prediction.median:.4g}",
        "interval90": f"{low:.4g} .. {high:.4g}", "found": f"{one.amplitude:.4g} {one.prediction.unit}",
        "trusted": one.trusted,
    }  # fmt: skip


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Validation:
    """The stable amplitude of one peak test, predicted without its own records from those of others, `source`.

    Attributes
    ----------
    amplitude : float
        What was found there, A/D or rad.
    measured : bool
        Whether the campaign states it; else it is the median of the test's own posterior.
    trusted : bool
        Whether the fit that predicts has converged.
    """

    test: str
    source: tuple[str, ...]
    prediction: Prediction
    amplitude: float
    measured: bool
    trusted: bool

    @property
    def error(self) -> float:
        """Median predicted over found, less one."""
        return self.prediction.median / self.amplitude - 1.0

    @property
    def factor(self) -> float:
        """How far the 90 % interval reaches from its median, as the larger factor of both sides."""
        low, high = self.prediction.interval(0.90)
        median = self.prediction.median
        return float(max(median / low if low > 0.0 else np.inf, high / median if median > 0.0 else np.inf))

    def inside(self, probability: float = 0.90) -> bool:
        """Whether the interval of this probability holds what was found."""
        low, high = self.prediction.interval(probability)
        return low <= self.amplitude <= high

    @property
    def z(self) -> float:
        """Normal score of what was found among the predictive draws, within what their number can tell."""
        from scipy.special import ndtri

        draws = self.prediction.draws
        rank = np.mean(draws < self.amplitude) + 0.5 * np.mean(draws == self.amplitude)
        edge = 0.5 / len(draws)
        return float(ndtri(np.clip(rank, edge, 1.0 - edge)))

    @property
    def log_score(self) -> float:
        """Log predictive density of ln(amplitude) at what was found, by a kernel estimate over the living draws."""
        from scipy.stats import gaussian_kde

        draws = self.prediction.draws
        alive = np.log(draws[np.isfinite(draws) & (draws > 0.0)])
        if len(alive) < 10 or np.ptp(alive) == 0.0:
            return -np.inf
        density = float(gaussian_kde(alive)(np.log(self.amplitude))[0]) * len(alive) / len(draws)
        return float(np.log(density)) if density > 0.0 else -np.inf


Source = tuple[str, ...]


def crossed(peaks: Sequence[str], targets: Sequence[str], *, singles: bool = True) -> list[tuple[str, Source]]:
    """Who is predicted from whom: every target from all other peaks, and from each single one where there are more."""
    plan = [(test, tuple(other for other in peaks if other != test)) for test in peaks if test in targets]
    if singles and len(peaks) > 2:
        plan += [(test, (other,)) for other in peaks for test in peaks if test in targets and test != other]
    return plan


def fits_needed(campaign: Campaign, tests: Sequence[str] = (), *, singles: bool = True) -> int:
    """How many fits `validate` makes: one of all tests, and one for every set of tests that predicts.

    Raises
    ------
    InputError
        If fewer than two rigs were tested in wind.
    """
    rigs = list(dict.fromkeys(test.rig for test in campaign.tests if test.records))
    _check_several(rigs, campaign)
    targets = [campaign.test(name).rig for name in tests] or rigs
    return 1 + len({source for _, source in crossed(rigs, targets, singles=singles)})


def validate(
    campaign: Campaign,
    card: "ModelCard",
    *,
    tests: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
    singles: bool = True,
    checkpoints: Path | None = None,
    workers: Workers = HERE,
) -> list[Validation]:
    """Predict every peak test from the other peak tests, and from each one of them.

    Parameters
    ----------
    campaign : Campaign
        With peak tests of two rigs or more.
    tests : sequence of str
        Predict only these peak tests; all if left out. The others predict them still.
    progress : callable, optional
        Told what is being predicted and the fraction done.
    singles : bool
        False leaves out predictions from single tests.
    checkpoints : Path, optional
        Folder for checkpoints of every fit, to be removed by the caller once the results are written.
    workers : Workers, optional
        Who makes the fits, once that of all tests is there; by default this process.

    Returns
    -------
    list of Validation
        First from all others, then from single tests, in the order of the rigs.

    Raises
    ------
    InputError
        If fewer than two rigs were tested in wind, or one of the `tests` is not the peak test of its rig.

    Notes
    -----
    Each prediction is by a fit of its own, laws and discrepancies included, that never sees the records of the test
    that it predicts; `fits_needed` says how many there are.  What was found is the stable amplitude that the campaign
    states, else the posterior of the test.
    """
    from scruton.infer.fit import fit_campaign
    from scruton.infer.sampling import Known

    _check_several({test.rig for test in campaign.tests if test.records}, campaign)  # before anything is fitted
    if progress:
        progress("fits", 0.0)
    known = Known()
    place = _place(checkpoints, 0)
    fit = fit_campaign(campaign, card, seed=seed, thorough=False, checkpoints=place, known=known)
    whole = Whole(campaign, card, seed, fit.summary["tests"], fit.converged, known)
    return predict_left_out(
        whole, tests=tests, progress=progress, singles=singles, checkpoints=checkpoints, workers=workers
    )


@dataclass(frozen=True, eq=False)
class Whole:
    """A fit of all tests, from which its parts start: what it found of each test, as fit.json has it, and its draws."""

    campaign: Campaign
    card: "ModelCard"
    seed: int
    tests: Sequence[Mapping[str, Any]]
    converged: bool
    known: "Known"


def predict_left_out(
    whole: Whole,
    *,
    tests: Sequence[str] = (),
    progress: Progress | None = None,
    singles: bool = True,
    checkpoints: Path | None = None,
    workers: Workers = HERE,
) -> list[Validation]:
    """As `validate`, of a campaign that is fitted already; what a part shares with it is not drawn again."""
    campaign = whole.campaign
    tell: Progress = progress or (lambda _what, _done: None)
    total = fits_needed(campaign, tests, singles=singles)
    # What a test says alone: its joint posterior knows of the others.
    fitted = {test["name"]: test.get("alone", test["parameters"]) for test in whole.tests}
    with_records = tests_used(campaign, tuple(fitted))
    peaks = [test.name for test in peak_tests(with_records, {k: v["a_star"]["median"] for k, v in fitted.items()})]
    _check_several(peaks, campaign)
    for name in tests:
        if name not in peaks:
            wanted = f"the peak test of a rig, one of: {', '.join(peaks)}"
            raise InputError(campaign.path, "tests", f'"{name}" at another wind speed', wanted)
    plan = crossed(peaks, tests or peaks, singles=singles)
    by_source: dict[Source, list[str]] = {}
    for test, source in plan:
        by_source.setdefault(source, []).append(test)
    sources = list(by_source)
    sc = {test: fitted[test]["scruton_number"]["median"] for test in peaks}
    tasks = [
        (_part(whole, source), _place(checkpoints, number), [sc[test] for test in by_source[source]])
        for number, source in enumerate(sources, start=1)
    ]
    predicted: dict[tuple[str, Source], tuple[Prediction, bool]] = {}
    tell("fits", 1 / total)
    for done, (index, (predictions, trusted)) in enumerate(workers.values(_predicted, tasks), start=2):
        source = sources[index]
        predicted |= {(test, source): (one, trusted) for test, one in zip(by_source[source], predictions, strict=True)}
        tell("fits", min(done / total, 1.0))
    validations = []
    for test, source in plan:
        stated, (prediction, trusted) = campaign.test(test).stable_amplitude, predicted[test, source]
        amplitude = stated.mean if stated is not None else fitted[test]["a_star"]["median"]
        trusted = trusted and whole.converged
        validations.append(Validation(test, source, prediction, amplitude, stated is not None, trusted))
    return validations


def _check_several(rigs: Collection[str], campaign: Campaign) -> None:
    if len(rigs) < 2:
        found = f"{len(rigs) or 'no'} rig{'' if len(rigs) == 1 else 's'} with records in wind"
        raise InputError(campaign.path, "tests", found, "two or more: one predicts the other")


def _place(checkpoints: Path | None, number: int) -> Path | None:
    return None if checkpoints is None else checkpoints.absolute() / f"{number}"


def _part(whole: Whole, source: Source) -> Whole:
    """The campaign of some tests, and what is known of them and of their rigs."""
    from scruton.infer.fit import known_of

    campaign = tests_used(whole.campaign, source)
    return replace(whole, campaign=campaign, known=known_of(campaign, whole.known))


def _predicted(task: tuple[Whole, Path | None, list[float]]) -> tuple[list[Prediction], bool]:
    """Fit some tests and predict at the Scruton numbers of others; whether the fit has converged."""
    from scruton.infer.fit import fit_campaign
    from scruton.infer.sampling import Known

    part, checkpoints, scruton_numbers = task
    fit = fit_campaign(
        part.campaign, part.card, seed=part.seed, thorough=False, checkpoints=checkpoints, known=Known(part.known)
    )
    return [predict(fit.tree, scruton_number=sc, seed=part.seed) for sc in scruton_numbers], fit.converged
