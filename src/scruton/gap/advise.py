"""What these data cannot tell, and the cheapest record that would."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.aerodynamic import SAME_SPEED
from scruton.dynamics.effects.effect import Variant
from scruton.dynamics.reading import readings
from scruton.gap import thresholds
from scruton.gap.blocks import by_channel
from scruton.gap.data import GapData
from scruton.gap.diagnosis import NONE, UNKNOWN, Diagnosis
from scruton.gap.further_record import FurtherRecord, separation
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.lines import SecondLine
from scruton.gap.meaning import WIND, is_step, known_by_contradictions, known_by_lines, lines_words, strange_lines
from scruton.gap.speeds import DRIFT, SETTING
from scruton.gap.thresholds import BLIND, COSTS, FAR_MORE_PROBABLE, WANTED

_USUAL = "20 % of the relaxation damping"


def confusions(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """Effects that these data cannot tell apart, the verdict's group first, then those of further effects.

    An effect joins the verdict where the verdict's signature at its fitted size - what it moves in the innovations,
    whitened - has less than two standard deviations left after projection on the null model's parameters and the
    effect's, where its evidence is as good to within some nats, or where the verdict is not ten times as probable.
    An unknown that sets in at one moment joins the wind, whose step would leave the same.
    A further effect's group holds what it is not ten times as probable as in its place.  Other pairs are looked at with
    20 per cent of the relaxation damping.  The group of `none` holds what could be there at that size without being
    seen, too.
    """
    verdict, weights = diagnosis.verdict, diagnosis.log_weights
    space = _Tangent(diagnosis.null.hypothesis, diagnosis.null.mode)
    typical = _typical(diagnosis)
    signatures = {name: _signature(diagnosis.null, space, variant) for name, variant in typical.items()}
    seen = {name: space.left(signature) for name, signature in signatures.items()}
    first = [verdict]
    if verdict == NONE:
        first += [name for name, sigma in seen.items() if sigma < BLIND]
    elif verdict != UNKNOWN:
        first += [name for group in diagnosis.groups[:1] for name in group if name != verdict]
        known = {*first, *diagnosis.found}
        near = [
            name
            for name, gain in weights.items()
            if name in CATALOGUE and name not in known and gain > weights[verdict] - thresholds.FAR_BEHIND
        ]
        first += _near_signature(diagnosis, near, typical) if near else []
    elif is_step(diagnosis):
        first.append(WIND)
    if verdict != UNKNOWN:
        first += _as_likely(diagnosis.probability, verdict, {*first, *diagnosis.found})
    beside = [(name, *_as_likely(p, name, diagnosis.found)) for name, p in diagnosis.beside.items()]
    groups: list[set[str]] = []
    known = {*first, *diagnosis.found}
    rest = [name for name in signatures if name not in known and seen[name] >= BLIND]
    for i, name in enumerate(rest):
        for other in rest[i + 1 :]:
            former, latter = signatures[name], signatures[other]
            if min(space.left(former, latter), space.left(latter, former)) < BLIND:
                joined = {name, other}.union(*(group for group in groups if group & {name, other}))
                groups = [*(group for group in groups if not group & joined), joined]
    untold = (group for group in beside if len(group) > 1)
    return (tuple(first), *untold, *(tuple(sorted(group)) for group in groups))


def _as_likely(probability: Mapping[str, float], leader: str, known: Collection[str]) -> list[str]:
    """Further effects of the catalogue that one is not far more probable than, the most probable first."""
    least = probability[leader] / FAR_MORE_PROBABLE
    likely = [name for name, one in probability.items() if name in CATALOGUE and name not in known and one > least]
    return sorted(likely, key=lambda name: -probability[name])


def _near_signature(diagnosis: Diagnosis, names: Sequence[str], typical: Mapping[str, Variant]) -> list[str]:
    """Effects that can mimic the verdict's signature at its fitted size, the others found in place."""
    final = diagnosis.final
    others = Hypothesis(final.hypothesis.null, final.hypothesis.variants[:-1])
    v, s = final.hypothesis.innovations(final.mode[None])
    without, _ = others.innovations(final.mode[None, : others.size])
    root = 1.0 / np.sqrt(s[0])
    mimics = []
    for name in names:
        best = diagnosis.rivals[name].variant if name in diagnosis.rivals else None
        if (variant := best or typical.get(name)) is None:
            continue
        larger = others.extended(variant)
        values = _usual(variant) if any(p.log for p in variant.parameters) else {}
        tangent = _Tangent(larger, larger.start_from(final.mode[: others.size], values), root)
        if tangent.left((without[0] - v[0]) * root) < BLIND:
            mimics.append(name)
    return mimics


class _Tangent:
    """Whitened derivatives of a hypothesis by coordinate at a point, and what of a signature they cannot mimic."""

    def __init__(self, hypothesis: Hypothesis, u: FloatArray, root: FloatArray | None = None) -> None:
        self.v, s, told = hypothesis.derivatives(u)
        self.root = np.sqrt(1.0 / s) if root is None else root
        self.j = np.zeros((hypothesis.size, self.root.size))
        j = by_channel(self.j)
        for block, (slopes, _) in zip(hypothesis.blocks, told, strict=True):
            j[block.where, :, block.cycles] = by_channel(slopes * block.of(self.root))
        self.fisher = self.j @ self.j.T
        self.fisher += np.diag(1.0 / hypothesis.prior[1] ** 2)

    def left(self, signature: FloatArray, other: FloatArray | None = None) -> float:
        """Length of a signature, parameters of the hypothesis and some size of another signature projected out."""
        squared = self._off(signature, signature)
        if other is not None:
            squared -= self._off(signature, other) ** 2 / max(self._off(other, other), 1e-12)
        return float(np.sqrt(max(squared, 0.0)))

    @np.errstate(all="ignore")  # where a filter loses its way at the usual size, nothing is mimicked
    def _off(self, a: FloatArray, b: FloatArray) -> float:
        return float(a @ b - (self.j @ a) @ np.linalg.solve(self.fisher, self.j @ b))


def _signature(base: FittedHypothesis, tangent: _Tangent, variant: Variant) -> FloatArray:
    """What an effect of the usual size moves, whitened."""
    larger = base.hypothesis.extended(variant)
    v, _ = larger.innovations(larger.start_from(base.mode, _usual(variant))[None])
    return np.asarray((v[0] - tangent.v) * tangent.root)


def _usual(variant: Variant) -> dict[str, FloatArray]:
    """Values at which a variant's size is 20 per cent; of shapes, where their search begins."""
    values = [p.starts[len(p.starts) // 2] for p in variant.parameters]
    values[0] = values[0] if variant.parameters[0].log else thresholds.USUAL_SIZE
    return {p.name: np.full(p.size, value) for p, value in zip(variant.parameters, values, strict=True)}


def _typical(diagnosis: Diagnosis) -> dict[str, Variant]:
    """The likeliest variant of every effect that can act in these records."""
    every = {name: effect.variants(diagnosis.data.layout) for name, effect in CATALOGUE.items()}
    return {name: max(variants, key=lambda variant: variant.weight) for name, variants in every.items() if variants}


def advise(diagnosis: Diagnosis) -> list[str]:
    """Name the cheapest extra record that would tell the verdict from its nearest rivals.

    Every record that could be taken is imagined as the verdict expects it: still-air decays, growths and decays of the
    tests that are there, releases from farther out, other Scruton numbers.  How far it would lie from what a rival
    predicts, whose parameters may bend as far as all other records allow, adds to how far the rival lies behind
    already; a static calibration settles gains and saturation.  Where nothing is found, it is the effects that are
    nearly as probable, as they were fitted, and the least visible ones, at 20 per cent of the relaxation damping, that
    are to be told from none.
    """
    records = list(_records(diagnosis))
    verdict, null = diagnosis.verdict, diagnosis.null
    lines: dict[str, str] = {}
    if verdict == NONE:
        doubts = _doubts(diagnosis, records)
        lines |= doubts
        space, typical = _Tangent(null.hypothesis, null.mode), _typical(diagnosis)
        seen = {name: space.left(_signature(null, space, variant)) for name, variant in typical.items()}
        for name in sorted(seen, key=lambda name: seen[name])[: thresholds.MOST_RIVALS]:
            if seen[name] < WANTED and name not in doubts:
                larger = null.hypothesis.extended(typical[name])
                truth = larger, larger.start_from(null.mode, _usual(typical[name]))
                lines[name] = _line(f"{name} of {_USUAL}", NONE, seen[name], truth, null, records)
        return (
            [line for line in lines.values() if line]
            or _told_by_none(NONE, lines)
            or [f"an effect of {_USUAL} would be seen in these records, whichever of the catalogue"]
        )
    near = _near(diagnosis)
    truth = diagnosis.final.hypothesis, diagnosis.final.mode
    for name, fit in near:
        now = _behind(diagnosis, name)
        if now < WANTED:
            lines[name] = _line(verdict, name, now, truth, fit, records)
    found = [*lines.values(), *_beside(diagnosis, records)]
    if found := [*_speeds(diagnosis), *_again(diagnosis), *(line for line in found if line)]:
        return found
    if diagnosis.probability[verdict] < thresholds.SETTLED:
        # told apart by the numbers, and yet not sure: forms, not noise, are what is in doubt
        return [f"a repeat of {_strongest(diagnosis)} would tell whether what is seen there comes again"]
    if untold := _told_by_none(verdict, lines):
        return untold
    if not near:
        return [f"no rival of {verdict} is near: no further record is needed to name it"]
    return [
        f"{verdict} is told from its nearest rival {near[0][0]} by {_behind(diagnosis, near[0][0]):.0f} sigma: "
        "no further record is needed to name it"
    ]


def _told_by_none(verdict: str, lines: Mapping[str, str]) -> list[str]:
    """That no record would tell the verdict from its rivals, where there is nothing else to be said."""
    untold = [name for name, line in lines.items() if not line]
    return [f"no single further record would tell {verdict} from {' or '.join(untold)}"] if untold else []


def _doubts(diagnosis: Diagnosis, records: list[FurtherRecord]) -> dict[str, str]:
    """Where nothing is found and that is not settled: what tells the effects that are nearly as probable from none."""
    if diagnosis.probability[NONE] >= thresholds.SETTLED:
        return {}
    lines = {}
    for name in _as_likely(diagnosis.probability, NONE, ())[: thresholds.MOST_RIVALS]:
        if name in diagnosis.rivals and (fit := diagnosis.rivals[name].best) is not None:
            now, truth = _behind(diagnosis, name), (fit.hypothesis, fit.mode)
            lines[name] = _line(f"{name} as fitted", NONE, now, truth, diagnosis.null, records)
    return lines


def _beside(diagnosis: Diagnosis, records: list[FurtherRecord]) -> list[str]:
    """Of further effects that are not settled, what tells each from what else would stand in its place."""
    truth, lines = (diagnosis.final.hypothesis, diagnosis.final.mode), []
    for name, place in diagnosis.places.items():
        if diagnosis.also[name] >= thresholds.SETTLED:
            continue
        others = {one: c.best for one, c in place.candidates.items() if one != name and c.best is not None}
        # with none of them the place is empty
        rival, fit = max({NONE: place.base, **others}.items(), key=lambda pair: pair[1].log_evidence)
        own = place.candidates[name].log_evidence
        now = float(np.sqrt(2.0 * max(own - fit.log_evidence, 0.0)))
        line = _line(f"{name} beside {diagnosis.verdict}", rival, now, truth, fit, records) if now < WANTED else ""
        lines.append(line or f"a repeat of {_strongest(diagnosis)} would tell whether {name} comes again")
    return lines


def _behind(diagnosis: Diagnosis, name: str) -> float:
    """Standard deviations by which a rival's evidence lies behind the verdict's already."""
    nats = diagnosis.log_weights[diagnosis.verdict] - diagnosis.log_weights[name]
    return float(np.sqrt(2.0 * max(nats, 0.0)))


def _speeds(diagnosis: Diagnosis) -> list[str]:
    """Of tests that differ, whether it is the reduced velocity or the setting: one rig at the others' speeds tells."""
    layout, tests = diagnosis.data.layout, diagnosis.data.first_in_wind
    rigs = {int(layout.rig[record]) for record in tests.values()}
    if not {DRIFT, SETTING} & set(diagnosis.found) or len(rigs) < 2:
        return []
    told = diagnosis.at_other_speeds
    if len(told) == 2 and abs(told[DRIFT] - told[SETTING]) > thresholds.ALIKE_NATS:
        return []
    middle = diagnosis.data.middle
    own = float(layout.reduced_velocity[middle])
    speeds = layout.reduced_velocity[layout.wind]
    low, high = float(speeds.min()), float(speeds.max())
    if high - low <= SAME_SPEED * high:
        return []  # nothing can follow a speed that does not change
    # between the peak tests, where what follows the speed is known; of one at an end, the other end and half way
    first, second = (0.5 * (low + high) if abs(own - end) < 0.25 * (high - low) else end for end in (low, high))
    return [
        f"{diagnosis.data.rigs[layout.rig[middle]]} at two more wind speeds, U/(f D) = {first:.3g} and {second:.3g} "
        f"(now {own:.3g}), a growth and a decay at each, as tests of their own: where Y1 and epsilon are there what "
        "the peak tests of the other rigs let expect they follow the reduced velocity, where they stay those of this "
        "rig tests differ from setting to setting"
    ]


def _again(diagnosis: Diagnosis) -> list[str]:
    """Of an unknown cause, whether it is the section's or one run's; of a line, whether a mode's or hum."""
    if diagnosis.verdict != UNKNOWN:
        return []
    again = (
        f"a repeat of {_strongest(diagnosis)}, over the same amplitudes: if the excess comes again it belongs to the "
        "section or the rig, if not to that run; a longer lock-in record, or a second one at another turbulence, would "
        "tell what comes and goes from what depends on the amplitude"
    )
    lines, against = strange_lines(diagnosis), diagnosis.contradictions
    known = known_by_lines(diagnosis) or known_by_contradictions(diagnosis)
    return [
        *([] if known else [again]),
        *(_of_a_line(lines, diagnosis.data) if lines else ()),
        *(f"{one.look}: {one.words}" for one in against[:1]),
    ]


def _of_a_line(lines: Sequence[SecondLine], data: GapData) -> list[str]:
    """Whether the foremost line beside the response is a mode's or hum, and how to do without it."""
    return [
        f"a record with a second sensor elsewhere on the section, of what moves at {lines_words(lines, data)}: another "
        "mode has a shape of its own there, hum has none and stays when the section is held still",
        "the same records with a `band` about the response in campaign.toml: the rest can be diagnosed without it",
    ]


def _strongest(diagnosis: Diagnosis) -> str:
    """The record in which the verdict's hypothesis and the null model differ most, or the null model misses most."""
    layout = diagnosis.data.layout
    (v, s), (w, _) = (fit.hypothesis.innovations(fit.mode[None]) for fit in (diagnosis.null, diagnosis.final))
    size = diagnosis.data.channels.size
    away = ((v - w)[0, :size]) ** 2 / s[0, :size]
    if not away.any():
        away = v[0, :size] ** 2 / s[0, :size] - 1.0
    each = [float(away[diagnosis.data.channels.record == r].sum()) for r in range(len(layout.records))]
    return layout.records[int(np.argmax(each))]


def _near(diagnosis: Diagnosis) -> list[tuple[str, FittedHypothesis]]:
    """Rivals that were fitted, the nearest first."""
    best = {name: candidate.best for name, candidate in diagnosis.rivals.items() if name not in diagnosis.found}
    if len(diagnosis.found) == 1:
        best[NONE] = diagnosis.null
    ranked = sorted(diagnosis.log_weights.items(), key=lambda pair: -pair[1])
    fitted = [(name, fit) for name, gain in ranked if np.isfinite(gain) and (fit := best.get(name)) is not None]
    return fitted[: thresholds.MOST_RIVALS]


def _line(
    verdict: str,
    rival: str,
    now: float,
    truth: tuple[Hypothesis, FloatArray],
    other: FittedHypothesis,
    records: list[FurtherRecord],
) -> str:
    """The advice against one rival; empty where no record can be imagined that would tell it."""
    options = []
    for record in records:
        with suppress(LookupError, np.linalg.LinAlgError):
            more = separation(truth, other, record)
            options.append((float(np.hypot(now, more)), record.cost, record.text))
    largest = other.hypothesis.data.layout.largest
    tables = (hypothesis.table(u[None])[0] for hypothesis, u in (truth, (other.hypothesis, other.mode)))
    expected, predicted = (readings(table, largest) / largest for table in tables)
    more = float(np.max(np.abs(expected - predicted)) / thresholds.CALIBRATION_ERROR)
    if more > BLIND:
        options.append((float(np.hypot(now, more)), COSTS["calibration"], "a static calibration of every channel"))
    if not options:
        return ""
    enough = [option for option in options if option[0] >= WANTED]
    sigma, _, text = min(enough, key=lambda option: (option[1], -option[0])) if enough else max(options)
    if sigma < now + 0.5:
        return ""
    return f"{text} would tell {verdict} from {rival} by {sigma:.0f} sigma ({now:.1f} now)"


def _records(diagnosis: Diagnosis) -> Iterator[FurtherRecord]:
    """Records that could be taken in this campaign."""
    data, layout = diagnosis.data, diagnosis.data.layout
    written = data.campaign.section.motion.amplitude_text
    for i in np.unique(layout.rig):
        records = np.flatnonzero(layout.rig == i)
        still = records[~layout.wind[records]]
        start = float(layout.largest[records].max())
        cycles = int(np.clip(3.0 / (2.0 * np.pi * data.nominal_damping[records[0]]), 20, 300))
        template = int(still[0] if still.size else records[0])
        again = "another" if still.size else "a"
        text = f"{again} free decay of {data.rigs[i]} in still air from {written(start)}"
        yield FurtherRecord(text, COSTS["still"], template, True, start, cycles)
    stable = {}
    for j, r in data.first_in_wind.items():
        a = float(diagnosis.final.hypothesis.stable_amplitude(diagnosis.final.mode[None], r)[0])
        if not (0.0 < a < np.inf):
            continue
        stable[j] = a
        cycles = int(np.median(layout.duration[layout.test == j]) * layout.omega[r] / (2.0 * np.pi))
        cycles = int(np.clip(cycles, 20, 400))
        for what, factor, cost in (("growth", 0.1, "repeat"), ("decay", 2.0, "repeat"), ("decay", 3.0, "far")):
            from_where = f"{written(factor * a)} ({factor:g} times the stable amplitude)"
            text = f"another {what} of {data.tests[j]} from {from_where}"
            yield FurtherRecord(text, COSTS[cost], r, False, factor * a, cycles)
    if stable:
        r = data.middle
        tested = np.unique(layout.scruton_number[layout.wind])
        a = stable.get(int(layout.test[r]), layout.reference_amplitude)
        cycles = int(np.clip(layout.duration[r] * layout.omega[r] / (2.0 * np.pi), 20, 400))
        # less damping than the barest rig has cannot be made
        for sc in (*np.sqrt(tested[:-1] * tested[1:]), 1.6 * tested[-1]):
            text = f"a growth at another Scruton number, {sc:.3g},"
            factor = float(sc / layout.scruton_number[r])
            yield FurtherRecord(text, COSTS["scruton"], r, False, 0.1 * a, cycles, factor)
