"""The verbs from Python: what the command line does, on results in hand or in a folder, without a file being written.

Where a campaign, a fit, a card or a bridge is asked for, its path does, too; where several names, limits or numbers
are, one by itself.  Progress and warnings go to the logger
"scruton", by the standard `logging`: progress as INFO, what must be known before trusting a number as WARNING.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.app.given import check_given, given_campaign, given_card, given_tree, read_results
from scruton.campaign import Campaign, tests_named
from scruton.campaign import load_campaign as _load_campaign
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.campaign.spelling import several
from scruton.errors import InputError

if TYPE_CHECKING:
    from scruton.app.given import Fitted
    from scruton.dynamics.identify import Identified
    from scruton.gap.results import SavedDiagnosis
    from scruton.griffin import Prediction
    from scruton.griffin.validate import Validation
    from scruton.infer.cards import ModelCard
    from scruton.infer.criticism import Criticism
    from scruton.infer.results import Fit
    from scruton.sizing.bridge import Bridge
    from scruton.sizing.limits import Limit
    from scruton.sizing.results import Sizing

_log = logging.getLogger("scruton")


def load_campaign(path: Path | str) -> Campaign:
    """Read a campaign and every record that it names.

    Parameters
    ----------
    path : Path or str
        The folder with a campaign.toml, or the file itself.

    Raises
    ------
    InputError
        Whatever is wrong with the first file that cannot be used.
    """
    return _load_campaign(Path(path))


def fit(
    campaign: Campaign | Path | str,
    card: "ModelCard | Path | str" = "default",
    *,
    tests: str | Sequence[str] = (),
    effect: str | None = None,
    seed: int = 0,
    out: Path | str | None = None,
) -> "Fit":
    """Sample every posterior of a campaign, as `scruton fit` does.

    Parameters
    ----------
    campaign : Campaign, Path or str
    card : ModelCard, Path or str
        A model card, the name of a shipped one, or its file.
    tests : str or sequence of str
        Use these tests alone; all if left out.
    effect : str, optional
        An unmodelled effect that predictions carry, or "auto": what diagnosis finds.
    seed : int
        Of all randomness.
    out : Path or str, optional
        Folder to write posterior.nc and fit.json to, for `load_fit`.

    Returns
    -------
    Fit
        Also where it has not converged: `Fit.converged` says so, and the log.

    Raises
    ------
    InputError
        If the campaign holds nothing to fit, a record cannot be used, or the records do not support the effect.
    """
    from scruton.app.fit import carry
    from scruton.app.options import check_effect_name
    from scruton.infer.fit import fit_campaign
    from scruton.infer.store import write_fit

    check_given("fit", seed=seed, out=out)
    if effect is not None:
        check_effect_name(effect, "effect", "fit")
    loaded, told = given_campaign(campaign, tests), _Told()
    asked = {"command": "fit", "tests": [test.name for test in loaded.tests] if several(tests) else []}
    found = fit_campaign(loaded, given_card(card), seed=seed, report=told, asked=asked)
    if effect is not None:
        carry(found, loaded, effect, seed, told)
    for flag in found.flags:
        _log.warning("%s", flag)
    if out is not None:
        write_fit(found, Path(out))
    return found


def predict(
    fit: "Fitted",
    scruton_number: float | None = None,
    *,
    damping_ratio: float | str | Quantity | None = None,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
) -> "Prediction":
    """Predict the stable amplitude at a design Scruton number, or at a design damping ratio.

    Parameters
    ----------
    fit : Fit, DataTree, Path or str
        A fit with at least one test in wind, its tree, or its folder.
    scruton_number : float, optional
        Design Sc; either this or `damping_ratio`.
    damping_ratio : float, str or Quantity, optional
        Design structural damping ratio, such as "0.003 +/- 0.001".
    rig, law_n, seed
        As of `scruton.griffin.predict`.

    Raises
    ------
    InputError
        As `scruton.griffin.predict`.
    """
    from scruton.app.options import parse_damping
    from scruton.griffin import predict

    check_given("prediction", seed=seed, law_n=law_n)
    if isinstance(damping_ratio, str):
        damping_ratio = parse_damping(damping_ratio, "damping_ratio", "prediction")
    return predict(
        given_tree(fit), scruton_number=scruton_number, damping_ratio=damping_ratio, rig=rig, law_n=law_n, seed=seed
    )


def diagnose(
    campaign: Campaign | Path | str,
    card: "ModelCard | Path | str" = "default",
    *,
    tests: str | Sequence[str] = (),
    thorough: bool = False,
    scruton_numbers: float | Sequence[float] = (),
) -> "SavedDiagnosis":
    """Ask where the null model and the records part, which effect explains it, and how far the gap shrinks with it.

    Parameters
    ----------
    campaign : Campaign, Path or str
    card : ModelCard, Path or str
        As of `fit`.
    tests : str or sequence of str
        These alone; all if left out.
    thorough : bool
        The evidence of the leaders by bridge sampling, too.
    scruton_numbers : float or sequence of float
        Of the bridge: where it is said what the verdict moves.  The middle one of the tests if left out.

    Returns
    -------
    SavedDiagnosis
        As `load_diagnosis` gives it.

    Raises
    ------
    InputError
        If the campaign cannot be read or holds no record.
    """
    from scruton.gap.diagnose import examine
    from scruton.gap.results import SavedDiagnosis

    check_given("diagnosis", scruton_numbers=several(scruton_numbers))
    _, content, _, _ = examine(
        given_campaign(campaign, tests), given_card(card),
        thorough=thorough, design_sc=list(several(scruton_numbers)), progress=_Told(),
    )  # fmt: skip
    return SavedDiagnosis.of(content)


def load_bridge(path: Path | str, motion: Motion | str = Motion.HEAVING) -> "Bridge":
    """Read a bridge.toml.

    Parameters
    ----------
    path : Path or str
        The file, or the folder that holds it.
    motion : {"heaving", "torsional"} or Motion
        Of the section model, and so of the modes.

    Raises
    ------
    InputError
        Whatever is wrong with the file.
    """
    from scruton.sizing.bridge import load_bridge

    if motion not in list(Motion):
        raise InputError("bridge", "motion", repr(motion), f"one of: {', '.join(Motion)}")
    return load_bridge(Path(path), Motion(motion))


def load_sizing(folder: Path | str) -> "Sizing":
    """Read back what `scruton size` found, as `scruton.sizing.results.load_sizing`.

    Parameters
    ----------
    folder : Path or str
        That holds a sizing.json, or the folder of a fit with sizings in it: the last one.

    Raises
    ------
    InputError
        If there is none, or it is not as it was written.
    """
    from scruton.report.saved import sizings_beside
    from scruton.sizing.results import load_sizing

    there = sizings_beside(Path(folder))
    if not there:
        raise InputError(folder, "sizing.json", "nothing", "a folder that `scruton size` wrote, or that of its fit")
    return load_sizing(there[0].parent)


def size(
    fit: "Fitted",
    bridge: "Bridge | Path | str",
    limits: "Limit | str | Sequence[Limit | str]" = (),
    *,
    rig: str | None = None,
    law_n: float | None = None,
    seed: int = 0,
) -> "Sizing":
    """Size the damping of a bridge: what it needs, the dampers that give it, and the risk that they leave.

    Parameters
    ----------
    fit : Fit, DataTree, Path or str
        As of `predict`.
    bridge : Bridge, Path or str
    limits : Limit, str or sequence of them
        Beside those that the bridge names, such as "jtg" or "0.13 m".
    rig, law_n, seed
        As of `scruton.sizing.study.size`.

    Raises
    ------
    InputError
        Without a limit; where a limit or the bridge does not suit the section's motion.
    """
    from scruton.griffin.posterior import motion_of, test_names
    from scruton.sizing.bridge import load_bridge
    from scruton.sizing.limits import limit
    from scruton.sizing.study import size

    check_given("sizing", seed=seed, law_n=law_n)
    tree = given_tree(fit)
    if not test_names(tree):
        raise InputError("posterior", "", "no test in wind", "a fit of at least one test: still air says nothing of it")
    structure = load_bridge(Path(bridge), motion_of(tree)) if isinstance(bridge, Path | str) else bridge
    rules = [limit(rule) if isinstance(rule, str) else rule for rule in several(limits)]
    return size(tree, structure, rules, rig=rig, law_n=law_n, seed=seed, progress=_Told())


def criticise(fit: "Fit | Path | str", scruton_numbers: float | Sequence[float] = (), *, seed: int = 0) -> "Criticism":
    """Ask of a fit what a statistician asks: predictive checks, innovations, priors, identifiability, influence.

    Parameters
    ----------
    fit : Fit, Path or str
        Of at least one test in wind.
    scruton_numbers : float or sequence of float
        At which the dependence of predictions on the card is told, beside those of the tests.
    seed : int
        Of replicates and predictions.

    Raises
    ------
    InputError
        If there is no test in wind.
    """
    from scruton.griffin.sensitivity import points_of, prediction_sensitivity
    from scruton.infer.criticism import criticise_tree

    check_given("criticism", seed=seed, scruton_numbers=several(scruton_numbers))
    tree, summary = read_results(fit)
    if "posterior" not in tree:
        wanted = "a fit of at least one test in wind: still air says nothing of the law"
        raise InputError("posterior", "", "a campaign without tests in wind", wanted)
    found = criticise_tree(tree, summary, seed=seed)
    if "campaign_posterior" not in tree:
        return found
    points = points_of(tree, list(several(scruton_numbers)))
    return replace(found, predictions=prediction_sensitivity(tree, points, seed=seed))


def validate(
    campaign: Campaign | Path | str,
    card: "ModelCard | Path | str" = "default",
    *,
    tests: str | Sequence[str] = (),
    singles: bool = True,
    seed: int = 0,
) -> "list[Validation]":
    """Predict every peak test from the others, and from each single one; each prediction is by a fit of its own.

    Parameters
    ----------
    campaign : Campaign, Path or str
        With peak tests of two rigs or more.
    card : ModelCard, Path or str
        As of `fit`.
    tests, singles, seed
        As of `scruton.griffin.validate.validate`.

    Raises
    ------
    InputError
        If fewer than two rigs were tested in wind, or one of the `tests` is no peak test.
    """
    from scruton.griffin.validate import validate

    check_given("validation", seed=seed)
    loaded, named = given_campaign(campaign), given_card(card)
    return validate(loaded, named, tests=tests_named(loaded, tests), seed=seed, singles=singles, progress=_Told())


def identify(
    campaign: Campaign | Path | str, trial: str = "second-order exponential", *, tests: str | Sequence[str] = ()
) -> "list[Identified]":
    """Estimate as the paper does, without any sampling: a row of its Table 5 for every growth or decay in wind.

    Parameters
    ----------
    campaign : Campaign, Path or str
    trial : str
        Trial function: "second-order exponential", "polynomial 8", "cubic spline 12" (knots).
    tests : str or sequence of str
        These alone; all if left out.

    Returns
    -------
    list of Identified
        Why a record gives no row is logged.

    Raises
    ------
    InputError
        Where no record gives a row, or there is no such trial function.
    """
    from scruton.app.identify import check_trial, rows_of

    check_trial(trial, "identify", "trial")
    rows, left = rows_of(given_campaign(campaign, tests), trial)
    for reason in left:
        _log.warning("%s", reason)
    return rows


class _Told:
    """Progress for the log: each stage once, as it begins."""

    def __init__(self) -> None:
        self._last = ""

    def __call__(self, stage: str, done: float) -> None:
        if stage != self._last:
            self._last = stage
            _log.info("%s", stage)
