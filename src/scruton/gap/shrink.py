"""How far the gap shrinks once the effect is in the model: on the records used, and on Scruton numbers left out."""

from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.documents import as_json
from scruton.dynamics.effects import CATALOGUE, UNKNOWN, Term
from scruton.dynamics.effects.effect import TRENDS, Extent, Scope
from scruton.dynamics.effects.generic import discrepancy
from scruton.dynamics.effects.terms import Belongs
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.dynamics.reading import inverse_reading
from scruton.envelope.thresholds import SETTLED
from scruton.gap.data import GapData, settled_end
from scruton.gap.density import NormalPosterior, density, parameters_spent, posterior_at_mode
from scruton.gap.diagnosis import Diagnosis
from scruton.gap.finding import amplitudes_in
from scruton.gap.held_out import folds, halves, left_out, without
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.thresholds import MEASURABLE_NATS

METRIC = (
    "joint log predictive density of whole records, nats short of the ceiling that the noise sets; held out: "
    "parameters from the other Scruton numbers and still air alone"
)
_RESAMPLES = 2000
_BAND = 40  # points of a damping curve
_ITERATIONS = 8  # of the fit of the measured curves


def shrink(diagnosis: Diagnosis, *, alike: Collection[str] = (), workers: int = 2) -> dict[str, Any]:
    """Measure the gap before and after the effects found, on the records used and on records held out.

    Every Scruton number is left out in turn (all records in wind of its test; every record in turn where there is one
    test, or only still air).  A hypothesis is fitted to the rest.  What is left out is scored by the joint density
    of all its cycles, all records of a test at once, parameters integrated over what the rest says of them, normal
    about the optimum.  What is its own alone (detuning, reading, imperfections within the tolerances, an effect's
    parameter of one record) is integrated over its prior; and the scatter of a test is that of the other tests, to
    within 20 per cent, lest a wrong model explain its misses by turbulence.  The damping ratio that was stated for
    the rig is scored with the records: still-air decays, which stay, may say another.

    The ceiling is the density that a record has when the shared parameters are known, its own integrated as before:
    its density at the fit to all records, less half the effective number of parameters fitted to it.  Of the null
    model, the verdict and the generic one, that which comes highest in all is what noise allows.  On the records used,
    a model counts by what it would score on a replicate of them: as the ceiling, but less the whole effective number
    of parameters.

    Parameters
    ----------
    diagnosis : Diagnosis
    alike : collection of str
        What the records cannot tell from the verdict: it closes as much by being nearly the same, and is no rival.
    workers : int
        Threads.

    Returns
    -------
    dict
        `shrink` of gap.json: `headline`, median errors of the stable amplitude and mean ones of the damping curves of
        tests left out, before and after, in how many tests they grew, and the `worst` amplitude after; without wind of
        the damping curves of records, of one `test` of those of its records, and of a single `record` of those at its
        large and its small amplitudes; nats that the null model (`before`)
        and the verdict's (`after`) fall short of the ceiling on all records; `fraction`, (before - after)/before, cut
        off at -1 and 1, None where the gap is too small to measure, and its `interval90` by bootstrap over records,
        None for a single one, which says nothing of its like; the same of the records `held_out`, None where none can
        be; `measurable`, on those held out or, without any, on those used; `put_in`, whether what was found has a form
        that goes into the model; `runner_up`, the best effect that is not `alike`, the part of the held-out gap that it
        closes, and its median error of the stable amplitude;
        `stable_amplitude` of every test left out in turn, as predicted by both, with relative errors;
        `stable_amplitude_of_records`, where there is one test, of every record that shows it; `not_foretold`, effects
        of the wind with a value for every test, of which the others say nothing; `damping_discrepancy`, as of that
        function.
    """
    data = diagnosis.data
    parts = folds(data)
    models = [diagnosis.null, diagnosis.final]
    generic = diagnosis.singles[UNKNOWN.name].best if UNKNOWN.name in diagnosis.singles else None
    rivals = {
        name: rival.best
        for name, rival in diagnosis.rivals.items()
        if name in CATALOGUE and name not in {*alike, *diagnosis.found} and rival.best is not None
    }
    runner = max(rivals, key=lambda name: rivals[name].log_evidence, default=None)
    references = [*models, *([generic] if generic is not None and generic is not diagnosis.final else [])]
    learners = [*models, *([rivals[runner]] if runner else [])]
    held = [fold for fold, out in parts if out]
    with ThreadPoolExecutor(workers) as pool:
        known_jobs = [pool.submit(_known, m, [fold for fold, _ in parts]) for m in references]
        left_out_jobs = [[pool.submit(left_out, m, fold) for fold in held] for m in learners]
        known = np.array([job.result() for job in known_jobs])
        predictions = [[job.result() for job in jobs] for jobs in left_out_jobs]
        parts_of_one = () if held else halves(data)
        half_jobs = [[pool.submit(without, m, part) for m in models] for part in parts_of_one]
        pairs = [(null.result(), final.result()) for null, final in half_jobs]
    best = int(np.argmax((known[:, 0] - 0.5 * known[:, 1]).sum(axis=1)))
    ceiling = known[best, 0] - 0.5 * known[best, 1]
    used = ceiling - (known[:2, 0] - known[:2, 1])
    rng = np.random.default_rng(np.random.SeedSequence(0))
    measurable, held_out = bool(used[0].sum() > MEASURABLE_NATS), None
    by_runner: dict[str, float | None] = {"fraction": None, "amplitude_error": None}
    on_used = measurable
    if held:
        mask = np.any(held, axis=0)
        short = np.array([(ceiling - np.sum([scores for _, scores, _ in each], axis=0))[mask] for each in predictions])
        short[1:] = np.where(np.isnan(short[1:]), np.inf, short[1:])  # a filter that loses its way foretells nothing
        learnt = sum(cost for _, _, cost in predictions[0])
        measurable = float(short[0].sum()) - learnt > MEASURABLE_NATS
        names = np.array(data.layout.records)[mask].tolist()
        held_out = {"records": names, **_closed(short[0], short[1], rng if measurable else None)}
        if runner and measurable:
            by_runner["fraction"] = _fraction(short[0], short[2])
    by_test = all(_whole(data, fold) for fold in held)
    # of one test, records are left out one by one: an amplitude is foretold where others show one, too
    shown = [i for i, fold in enumerate(held) if by_test or _shows(data, fold)] if data.layout.wind.any() else []
    shown = shown if by_test or len(shown) > 1 else []
    misstated = any(Term.STRUCTURAL in CATALOGUE[name].terms for name in diagnosis.found if name in CATALOGUE)

    def amplitudes(learner: int) -> list[dict[str, Any]]:
        nulls, others = predictions[0], predictions[learner]
        return [_stable_amplitude(data, held[i], nulls[i][0], others[i][0], misstated) for i in shown]

    stable = amplitudes(1)
    pairs += [(null.optimum, final.optimum) for (null, *_), (final, *_) in zip(*predictions[:2], strict=True)]
    curves = damping_discrepancy(diagnosis.null, diagnosis.final, pairs, parts_of_one)
    if runner and (errors := [one["error_after"] for one in amplitudes(2)]):
        by_runner["amplitude_error"] = float(np.median(errors))
    result: dict[str, Any] = as_json({
        "metric": METRIC, **_closed(used[0], used[1], rng if on_used else None), "held_out": held_out,
        "measurable": measurable, "put_in": diagnosis.final is not diagnosis.null,
        "headline": _headline(data, stable, curves),
        "runner_up": {"effect": runner, **by_runner} if runner else None,
        "not_foretold": _not_foretold(diagnosis) if by_test and shown else [],
        "stable_amplitude": stable if by_test else [], "damping_discrepancy": curves,
        "stable_amplitude_of_records": [] if by_test else stable,
    })  # fmt: skip
    return result


def _known(model: FittedHypothesis, folds: Sequence[np.ndarray]) -> FloatArray:
    """Density of every record, parameters as all records settle them, and parameters spent on it, (2, R)."""
    table = np.zeros((2, len(folds[0])))
    for fold in folds:
        known = posterior_at_mode(model, fold)
        scored = density(known, fold)
        table[0, fold] = scored.shares[fold]
        table[1, fold] = parameters_spent(known, scored, model.covariance) / np.count_nonzero(fold)
    return table


def _closed(before: FloatArray, after: FloatArray, rng: np.random.Generator | None) -> dict[str, Any]:
    """The gap on some records, (R,) each, and how far it shrinks; without a generator it cannot be measured.

    Of a single record there is no interval: all of its resamples are it.
    """
    fraction = interval = None
    if rng is not None:
        fraction = _fraction(before, after)
        if before.size > 1:
            chosen = rng.integers(0, before.size, (_RESAMPLES, before.size))
            b, a = before[chosen].sum(axis=1), after[chosen].sum(axis=1)
            interval = np.quantile(np.clip((b - a)[b > 0.0] / b[b > 0.0], -1.0, 1.0), [0.05, 0.95])
    return {"before": before.sum(), "after": after.sum(), "fraction": fraction, "interval90": interval}


def _fraction(before: FloatArray, after: FloatArray) -> float:
    """Part of a gap that closes, from -1 (made as bad again, or worse) to 1."""
    return float(np.clip((before.sum() - after.sum()) / before.sum(), -1.0, 1.0))


def _whole(data: GapData, fold: np.ndarray) -> bool:
    """Whether what is left out is a whole test in wind."""
    j = data.layout.test[np.argmax(fold)]
    return bool(j >= 0 and np.array_equal(fold, data.layout.test == j))


def _shows(data: GapData, fold: np.ndarray) -> bool:
    """Whether a record shows a stable amplitude: a lock-in record, or a transient that is long enough to settle."""
    layout, r = data.layout, int(np.argmax(fold))
    return bool(layout.direction[r] == 0 or layout.duration[r] * layout.rate[r] >= SETTLED)


def _not_foretold(diagnosis: Diagnosis) -> list[str]:
    """Effects of the wind that have a value for every test: of one left out the others say none."""
    own = {one.effect for one in diagnosis.final.hypothesis.variants if one.scope.extent is Extent.EACH_TEST}
    effects = CATALOGUE | {UNKNOWN.name: UNKNOWN}
    return [name for name in diagnosis.found if name in own and effects[name].belongs is Belongs.WIND]


def _stable_amplitude(
    data: GapData, fold: np.ndarray, null: NormalPosterior, final: NormalPosterior, misstated: bool
) -> dict[str, Any]:
    """The stable amplitude of a test left out, or of a record, as read; the null model goes by a misstated damping."""
    records = np.flatnonzero(fold)
    test = next(t for t in data.campaign.tests if t.name == data.tests[data.layout.test[records[0]]])
    whole = _whole(data, fold)
    stated = test.stable_amplitude if whole else None
    ends = [settled_end(data.cycles[data.layout.records[r]]) for r in records]
    measured = stated.mean if stated else float(np.mean(ends))
    number = float(data.layout.scruton_number[records[0]]) if misstated else None
    before, after = (
        float(np.median([k.hypothesis.stable_amplitude(k.optimum[None], int(r), scruton_number=n, reading=True)[0]
                         for r in records]))
        for k, n in ((null, number), (final, None))
    )  # fmt: skip
    first = int(records[0])
    left_out: dict[str, Any] = {"test": test.name} if whole else {"record": data.layout.records[first]}
    left_out |= {
        "measured": measured, "before": before, "after": after,
        "error_before": abs(before - measured) / measured, "error_after": abs(after - measured) / measured,
        "rig": data.rigs[data.layout.rig[first]],
    }  # fmt: skip
    return left_out | ({"scruton_number": float(data.layout.scruton_number[first])} if whole else {})


def _headline(data: GapData, stable: Sequence[dict[str, Any]], curves: dict[str, Any]) -> dict[str, Any] | None:
    """What is left out in turn, before and after: errors over the tests or records, and in how many they grew."""
    head: dict[str, Any] = {}
    parts, records = curves.get("amplitudes", []), curves.get("records", [])
    if parts:
        head = {"record": parts[0]["record"], "in_wind": bool(data.layout.wind.any())}
    elif records:
        head = {"test": data.tests[next(iter(data.first_in_wind))]} if data.layout.wind.any() else {}
        head["records"] = len(records)
    elif curves["tests"]:
        head = {"tests": len(curves["tests"])}
    if stable:
        errors = (np.array([test[key] for test in stable]) for key in ("error_before", "error_after"))
        before, after = (np.nan_to_num(error, nan=np.inf) for error in errors)  # of an amplitude that is none
        head |= {"amplitudes": len(stable)} if "records" in head else {}
        head |= {
            "amplitude_before": np.median(before), "amplitude_after": np.median(after),
            "amplitude_worse": int(np.sum(after > before)),
        }  # fmt: skip
        if "tests" in head:
            head["worst"] = {"test": stable[int(np.argmax(after))]["test"], "error": float(after.max())}
    if head:
        head |= {f"damping_{end}": curves[f"held_out_{end}"] for end in ("before", "after")}
        head["damping_worse"] = sum(one["after"] > one["before"] for one in parts or records or curves["tests"])
    return head or None


def damping_discrepancy(
    null: FittedHypothesis,
    final: FittedHypothesis,
    left_out: Sequence[tuple[FloatArray, FloatArray]],
    parts: Sequence[np.ndarray] = (),
) -> dict[str, Any]:
    """Mean distance of damping curves from the measured ones over ln(amplitude) and tests, over the relaxation rate.

    The measured curve of a test is that of the verdict's hypothesis with a generic discrepancy of every test by its
    own, fitted in the likelihood of all records; its noise keeps the distance of a right model above zero.  Of one test
    every record in wind stands for a test, over its own amplitudes; without wind every record does, and the rate is
    that of the structural damping.

    `left_out` holds coordinates of the null model and the verdict's, one pair a test (or record) in order, from the
    records of the others; where none can be left out, the distances held out are None.  `tests` of the result has the
    distances held out of each, or `records`.  Of a single record they are pairs of its `parts`, masks of its cycles,
    (N,) of bool, each from the other's, and `amplitudes` has the distances.
    """
    data, layout = final.hypothesis.data, final.hypothesis.data.layout
    still, tests = not layout.wind.any(), list(data.first_in_wind.values())
    wind = np.flatnonzero(layout.wind)
    single = still or (len(tests) == 1 and wind.size > 1)
    scope = Scope(Extent.EACH_RECORD, layout.each(layout.wind != still)) if single else None
    scope = scope or Scope(Extent.EACH_TEST, layout.by_test())
    fitted = final.with_variants(discrepancy("measured", scope), iterations=_ITERATIONS)
    tests = list(range(len(layout.records))) if still else wind.tolist() if single else tests
    of = data.channels.record
    whole = [(r, of == r if single else np.isin(of, np.flatnonzero(layout.test == layout.test[r]))) for r in tests]
    each = [(tests[0], part) for part in parts] or whole

    def measured(places: Sequence[tuple[int, np.ndarray]]) -> list[FloatArray]:
        return [_curve(fitted.hypothesis, fitted.mode, *place) for place in places]

    def distances(
        places: Sequence[tuple[int, np.ndarray]], curves: Sequence[FloatArray],
        pairs: Sequence[tuple[FloatArray, FloatArray]],
    ) -> list[list[float]]:  # fmt: skip
        """Of the null model and the verdict's, at coordinates for every place."""
        return [
            [float(np.mean(np.abs(_curve(fit.hypothesis, pair[i], *place) - curve)) / layout.rate[place[0]])
             for place, curve, pair in zip(places, curves, pairs, strict=True)]
            for i, fit in enumerate((null, final))
        ]  # fmt: skip

    of_whole = measured(whole)
    full = out = distances(whole, of_whole, [(null.mode, final.mode)] * len(whole))
    told = len(left_out) == len(each)
    if told:
        out = distances(each, measured(each) if parts else of_whole, left_out)
    before, after, *held_out = (float(np.mean(some)) for some in (*full, *out))
    kind = "records" if single else "tests"
    result: dict[str, Any] = {"tests": [], "before": before, "after": after}
    result |= dict(zip(("held_out_before", "held_out_after"), held_out if told else (None, None), strict=True))
    result[kind] = []
    if told:
        result["amplitudes" if parts else kind] = [
            {
                **({"record": layout.records[r]} if parts or single else {"test": data.tests[layout.test[r]]}),
                **({"amplitude": amplitudes_in(data, cycles)} if parts else {}),
                "rig": data.rigs[layout.rig[r]], "before": before, "after": after,
            }
            for (r, cycles), before, after in zip(each, *out, strict=True)
        ]  # fmt: skip
    return result


def _curve(hypothesis: Hypothesis, u: FloatArray, record: int, cycles: np.ndarray) -> FloatArray:
    """Damping rate -da/dt/a in a record over the amplitudes that some cycles, (N,) of bool, read [1/s]; steady wind."""
    data = hypothesis.data
    read = data.channels.amplitude[cycles]
    band = np.geomspace(max(np.quantile(read, 0.02), 0.03 * read.max()), read.max(), _BAND)
    table = hypothesis.table(u[None])[:, record]
    table[:, list(map(int, TRENDS))] = 0.0
    row = table[0]
    true = np.array([inverse_reading(y / (1.0 + row[Term.GAIN]), row[Term.CLIP], row[Term.CLIP_SOFT]) for y in band])
    return np.asarray(-amplitude_rates(table, true, data.channels.knots)[0] / true)
