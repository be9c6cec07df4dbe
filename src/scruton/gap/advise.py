"""What these data cannot tell, and the cheapest record that would."""

from collections.abc import Iterator

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.effect import Variant
from scruton.dynamics.reading import readings
from scruton.gap.diagnosis import NONE, UNSEEN, Diagnosis
from scruton.gap.further_record import FurtherRecord, separation
from scruton.gap.hypothesis import FittedHypothesis, Hypothesis
from scruton.gap.predict import stable_amplitude
from scruton.gap.thresholds import BLIND, CALIBRATION_ERROR, COSTS, FAR_BEHIND, MOST_RIVALS, USUAL_SIZE, WANTED


def confusions(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """Effects that these data cannot tell apart, the verdict's group first.

    An effect joins the verdict where the verdict's signature at its fitted size - what it moves in the innovations,
    whitened - has less than two standard deviations left after projection on the bare parameters and the effect's, or
    where its evidence is as good to within some nats.  Other pairs are looked at with 20 per cent of the relaxation
    damping.  The group of `none` holds what could be there at that size without being seen.
    """
    verdict = diagnosis.verdict
    space = _Projector(diagnosis.null)
    tried = [(name, variant) for name in CATALOGUE if (variant := _typical(diagnosis, name)) is not None]
    signatures = {name: space.signature(variant) for name, variant in tried}
    seen = {name: space.left(s) for name, s in signatures.items()}
    if verdict == NONE:
        first = [NONE, *(name for name, sigma in seen.items() if sigma < BLIND)]
    elif verdict == UNSEEN:
        first = [UNSEEN]
    else:
        first = list(diagnosis.groups[0]) if diagnosis.groups else [verdict]
        first = [verdict, *(name for name in first if name != verdict)]
        near = [
            name
            for name, gain in diagnosis.log_weights.items()
            if name in CATALOGUE and name not in {*first, *diagnosis.found} and
            gain > diagnosis.log_weights[verdict] - FAR_BEHIND
        ]  # fmt: skip
        if near:
            own = _Fitted(diagnosis)
            first += [name for name in near if (v := _variant(diagnosis, name)) and own.left_after(v) < BLIND]
    groups = [set(first)]
    rest = [name for name in signatures if name not in first and seen[name] >= BLIND]
    for i, name in enumerate(rest):
        for other in rest[i + 1 :]:
            if min(space.left(signatures[name], signatures[other]), space.left(signatures[other], signatures[name])) \
                    < BLIND:  # fmt: skip
                joined = {name, other}.union(*(g for g in groups[1:] if g & {name, other}))
                groups = [groups[0], *(g for g in groups[1:] if not g & joined), joined]
    return (tuple(first), *(tuple(sorted(g)) for g in groups[1:]))


class _Projector:
    """Whitened innovations of a hypothesis at its optimum, and what of a signature its parameters cannot mimic."""

    def __init__(self, base: FittedHypothesis) -> None:
        self.base, self.hypothesis = base, base.hypothesis
        self.v, log_s, jv, _ = self.hypothesis.derivatives(base.mode)
        self.root = np.exp(-0.5 * log_s)
        self.j, self.fisher = _tangent(self.hypothesis, jv, self.root)
        self.fisher += np.diag(1.0 / self.hypothesis.prior[1] ** 2)

    def signature(self, variant: Variant) -> FloatArray:
        """What an effect of the usual size moves, whitened."""
        larger = self.hypothesis.extended(variant)
        u = larger.start_from(self.base.mode, _usual(variant))
        v, _ = larger.innovations(u[None])
        found: FloatArray = (v[0] - self.v) * self.root
        return found

    def left(self, signature: FloatArray, other: FloatArray | None = None) -> float:
        """Length of a signature, parameters of the hypothesis and some size of another signature projected out."""
        own = self._off(signature, signature)
        if other is None:
            return float(np.sqrt(max(own, 0.0)))
        cross, length = self._off(signature, other), self._off(other, other)
        return float(np.sqrt(max(own - cross**2 / max(length, 1e-12), 0.0)))

    def _off(self, a: FloatArray, b: FloatArray) -> float:
        return float(a @ b - (self.j @ a) @ np.linalg.solve(self.fisher, self.j @ b))


class _Fitted:
    """The verdict's signature at its fitted size."""

    def __init__(self, diagnosis: Diagnosis) -> None:
        final = diagnosis.final
        self.final = final
        others = Hypothesis(final.hypothesis.null, final.hypothesis.variants[:-1])
        v, s = final.hypothesis.innovations(final.mode[None])
        without, _ = others.innovations(final.mode[None, : others.size])
        self.others, self.root = others, 1.0 / np.sqrt(s[0])
        self.signature = (without[0] - v[0]) * self.root

    def left_after(self, variant: Variant) -> float:
        """What of it the other parameters and those of a variant cannot mimic."""
        larger = self.others.extended(variant)
        values = _usual(variant) if any(p.log for p in variant.parameters) else {}
        u = larger.start_from(self.final.mode[: self.others.size], values)
        _, _, jv, _ = larger.derivatives(u)
        j, fisher = _tangent(larger, jv, self.root)
        fisher += np.diag(1.0 / larger.prior[1] ** 2)
        pull = j @ self.signature
        return float(np.sqrt(max(self.signature @ self.signature - pull @ np.linalg.solve(fisher, pull), 0.0)))


def _tangent(hypothesis: Hypothesis, jv: FloatArray, root: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Whitened derivatives by coordinate, (d, 3 N), and their products."""
    j = np.zeros((hypothesis.size, root.size))
    for cycles, rows, where in hypothesis.blocks:
        j[np.ix_(where, cycles)] = jv[np.ix_(rows, cycles)] * root[cycles]
    return j, j @ j.T


def _usual(variant: Variant) -> dict[str, FloatArray]:
    """Values at which a variant's size is 20 per cent; of shapes, where their search begins."""
    found = {}
    for i, p in enumerate(variant.parameters):
        value = USUAL_SIZE if i == 0 and not p.log else p.starts[len(p.starts) // 2]
        found[p.name] = np.full(p.size, value)
    return found


def _typical(diagnosis: Diagnosis, name: str) -> Variant | None:
    variants = CATALOGUE[name].variants(diagnosis.data.layout)
    return max(variants, key=lambda one: one.weight, default=None)


def _variant(diagnosis: Diagnosis, name: str) -> Variant | None:
    best = diagnosis.rivals[name].variant if name in diagnosis.rivals else None
    return best or _typical(diagnosis, name)


def advise(diagnosis: Diagnosis) -> list[str]:
    """Name the cheapest extra record that would tell the verdict from its nearest rivals.

    Every record that could be taken is imagined as the verdict expects it: still-air decays, growths and decays of the
    tests that are there, releases from farther out, other Scruton numbers.  How far it would lie from what a rival
    predicts, whose parameters may bend as far as all other records allow, adds to how far the rival lies behind
    already; a static calibration settles gains and saturation.  Without a verdict, it is the least visible effects, at
    20 per cent of the relaxation damping, that are to be told from none.

    Returns
    -------
    list of str
    """
    records = list(_records(diagnosis))
    verdict = diagnosis.verdict
    lines = []
    if verdict == NONE:
        space = _Projector(diagnosis.null)
        seen = []
        for name in CATALOGUE:
            variant = _typical(diagnosis, name)
            if variant is not None:
                seen.append((space.left(space.signature(variant)), name, variant))
        for now, name, variant in sorted(seen, key=lambda one: one[0])[:MOST_RIVALS]:
            if now < WANTED:
                larger = diagnosis.null.hypothesis.extended(variant)
                truth = larger, larger.start_from(diagnosis.null.mode, _usual(variant))
                lines.append(
                    _line(f"{name} of 20 % of the relaxation damping", NONE, now, truth, diagnosis.null, records)
                )
        return [x for x in lines if x] or [
            "an effect of 20 % of the relaxation damping would be seen in these records, whichever of the catalogue"
        ]
    truth = diagnosis.final.hypothesis, diagnosis.final.mode
    for name, evidence in _near(diagnosis):
        behind = max(diagnosis.log_weights[verdict] - diagnosis.log_weights[name], 0.0)
        now = float(np.sqrt(2.0 * behind))
        if now >= WANTED:
            continue
        lines.append(_line(verdict, name, now, truth, evidence, records))
    if lines:
        return [x for x in lines if x]
    near = _near(diagnosis)
    if not near:
        return [f"no rival of {verdict} is near: no further record is needed to name it"]
    behind = diagnosis.log_weights[verdict] - diagnosis.log_weights[near[0][0]]
    return [
        f"{verdict} is told from its nearest rival {near[0][0]} by {np.sqrt(2.0 * behind):.0f} sigma: "
        "no further record is needed to name it"
    ]


def _near(diagnosis: Diagnosis) -> list[tuple[str, FittedHypothesis]]:
    """Rivals that were fitted, the nearest first."""
    found = []
    for name, gain in sorted(diagnosis.log_weights.items(), key=lambda pair: -pair[1]):
        if name in (diagnosis.verdict, *diagnosis.found) or not np.isfinite(gain):
            continue
        best = diagnosis.rivals[name].best if name in diagnosis.rivals else None
        if name == NONE and len(diagnosis.found) == 1:
            best = diagnosis.null
        if best is not None:
            found.append((name, best))
    return found[:MOST_RIVALS]


def _line(
    verdict: str,
    rival: str,
    now: float,
    truth: tuple[Hypothesis, FloatArray],
    other: FittedHypothesis,
    records: list[FurtherRecord],
) -> str:
    """The advice against one rival."""
    options = []
    for record in records:
        try:
            more = separation(truth, (other.hypothesis, other.mode, other.covariance), record)
        except (LookupError, np.linalg.LinAlgError):
            continue
        if np.isfinite(more):
            options.append((float(np.hypot(now, more)), record.cost, record.text))
    more = _by_calibration(truth, other)
    if more > BLIND:
        options.append((float(np.hypot(now, more)), COSTS["calibration"], "a static calibration of every channel"))
    if not options:
        return ""
    enough = [one for one in options if one[0] >= WANTED]
    sigma, _, text = min(enough, key=lambda one: (one[1], -one[0])) if enough else max(options)
    if sigma < now + 0.5:
        return f"no single further record would tell {verdict} from {rival} ({now:.1f} sigma now)"
    return f"{text} would tell {verdict} from {rival} by {sigma:.0f} sigma ({now:.1f} now)"


def _by_calibration(truth: tuple[Hypothesis, FloatArray], other: FittedHypothesis) -> float:
    """Standard deviations by which a static calibration to half a per cent would tell two hypotheses apart."""
    found = []
    for hypothesis, u in (truth, (other.hypothesis, other.mode)):
        largest = hypothesis.data.layout.largest
        table = hypothesis.table(u[None])[0].copy()
        found.append(readings(table, largest) / largest)
    return float(np.max(np.abs(found[0] - found[1])) / CALIBRATION_ERROR)


def _records(diagnosis: Diagnosis) -> Iterator[FurtherRecord]:
    """Records that could be taken in this campaign."""
    data = diagnosis.data
    layout = data.layout
    unit = "A/D" if data.campaign.section.motion.value == "heaving" else "rad"
    for i in np.unique(layout.rig):
        mine = np.flatnonzero(layout.rig == i)
        still = mine[~layout.wind[mine]]
        start = float(layout.largest[mine].max())
        cycles = int(np.clip(3.0 / (2.0 * np.pi * data.nominal_damping[mine[0]]), 20, 300))
        template = int(still[0] if still.size else mine[0])
        again = "another" if still.size else "a"
        text = f"{again} free decay of {data.rigs[i]} in still air from {start:.3g} {unit}"
        yield FurtherRecord(text, COSTS["still"], template, True, start, cycles)
    settled = {}
    for j in np.unique(layout.test[layout.wind]):
        r = int(np.flatnonzero(layout.test == j)[0])
        a = float(stable_amplitude(diagnosis.final.hypothesis, diagnosis.final.mode[None], r)[0])
        if not (0.0 < a < np.inf):
            continue
        settled[int(j)] = a
        cycles = int(np.median(layout.duration[layout.test == j]) * layout.omega[r] / (2.0 * np.pi))
        cycles = int(np.clip(cycles, 20, 400))
        for what, factor, cost in (("growth", 0.1, "repeat"), ("decay", 2.0, "repeat"), ("decay", 3.0, "far")):
            from_where = f"{factor * a:.3g} {unit} ({factor:g} times the stable amplitude)"
            text = f"another {what} of {data.tests[j]} from {from_where}"
            yield FurtherRecord(text, COSTS[cost], r, False, factor * a, cycles)
    if settled:
        r = data.middle
        tested = np.unique(layout.scruton_number[layout.wind])
        numbers = [0.6 * tested[0], *np.sqrt(tested[:-1] * tested[1:]), 1.6 * tested[-1]]
        a = settled.get(int(layout.test[r]), layout.reference_amplitude)
        cycles = int(np.clip(layout.duration[r] * layout.omega[r] / (2.0 * np.pi), 20, 400))
        for sc in numbers:
            factor = float(sc / layout.scruton_number[r])
            text = f"a growth at another Scruton number, {sc:.3g},"
            yield FurtherRecord(text, COSTS["scruton"], r, False, 0.1 * a, cycles, factor)
