"""Where the effects of the verdict act: rigs, tests and records, with the size of each as a damping ratio."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from scruton.arrays import FloatArray
from scruton.dynamics.effects import CATALOGUE
from scruton.dynamics.effects.terms import Parameter, Term, Variant
from scruton.dynamics.limit_cycle import amplitude_rates
from scruton.gap.diagnosis import UNSEEN, Diagnosis
from scruton.gap.finding import Finding, Range, amplitudes_of, interval, names_of, time_of
from scruton.gap.hypothesis import Hypothesis, Weighed

# What an effect is seen in; damping for those that are not named.
_QUANTITY = {
    "reduced_velocity_drift": "test",
    "fluid_memory": "branch",
    "vortex_shedding_forcing": "spectrum",
    "stiffness_nonlinearity": "frequency",
    "sensor_gain_error": "signal",
    "sensor_clipping": "signal",
}
_OF_RIG = ("coulomb_friction", "structural_damping_nonlinearity", "structural_damping_error")
_NOTHING = 1e-3  # of the largest place of an effect
_MANY = 6  # records
_UNITS = {
    "damping": "damping ratio",
    "test": "damping ratio",
    "branch": "damping ratio of growth through half the stable amplitude, to first order in the lag",
    "frequency": "relative change of frequency up to the largest amplitude",
    "signal": "relative error of the reading at the largest amplitude",
    "spectrum": "amplitude that the force would add in one radian",
}


@dataclass(frozen=True, eq=False)
class _Scope:
    """An effect in a hypothesis, and the draws about its optimum."""

    name: str
    number: int
    evidence: Weighed

    @property
    def variant(self) -> Variant:
        return self.evidence.hypothesis.variants[self.number]

    @property
    def size(self) -> Parameter:
        return next(p for p in self.variant.parameters if p.name == self.variant.size)


def scope_findings(diagnosis: Diagnosis) -> list[Finding]:
    """One finding for every rig or test that an effect of the verdict acts in.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    list of Finding
        Effects in the order of the verdict, the most significant place of each first.
    """
    found = []
    for name in diagnosis.found:
        number = _number(diagnosis.final, name)
        if name == UNSEEN or number is None:
            continue
        scope = _Scope(name, number, diagnosis.final)
        places = _places(_told_by_rig(scope))
        largest = max((abs(one.excess) for one in places), default=0.0)
        places = [one for one in places if abs(one.excess) > _NOTHING * largest]
        found += sorted(_gathered(places), key=lambda one: -one.significance)
    return found


def _gathered(places: list[Finding]) -> list[Finding]:
    """Of many records, one for each test and sign, the strongest."""
    if len(places) <= _MANY:
        return places
    kinds: dict[tuple[str | None, bool], list[Finding]] = {}
    for one in places:
        kinds.setdefault((one.test or one.rig, one.excess > 0.0), []).append(one)
    found = []
    for several in kinds.values():
        strongest = max(several, key=lambda one: one.significance)
        beside = ", ".join(str(one.record) for one in several if one is not strongest)
        found.append(replace(strongest, detail=f"{strongest.detail}; also {beside}") if beside else strongest)
    return found


def _number(evidence: Weighed, name: str) -> int | None:
    """Place of an effect among the variants of a hypothesis."""
    for i, variant in enumerate(evidence.hypothesis.variants):
        if variant.apply.__module__.rsplit(".", 1)[-1] == name:
            return i
    return None


def _told_by_rig(scope: _Scope) -> tuple[_Scope, np.ndarray]:
    """Give an effect that acts in every rig alike a size of its own in each, to see in which it does.

    Returns
    -------
    scope : _Scope
        With the hypothesis to read sizes from.
    records : (R,) array of bool
        Where the effect acts.
    """
    data = scope.evidence.hypothesis.bare.data
    layout = data.layout
    inside = scope.variant.scope.astype(bool)
    rigs = np.unique(layout.rig[inside])
    if scope.size.size > 1 and not scope.size.log:
        # sizes of their own: those that chance would hardly give among so many
        value, sd = scope.evidence.value(f"{scope.number}:{scope.size.name}")
        acts = np.abs(value) > norm.isf(0.05 / scope.size.size) * sd
        return scope, inside & acts[scope.size.members] & (scope.size.members >= 0)
    if scope.name not in _OF_RIG or rigs.size < 2 or scope.size.log:
        return scope, inside
    members = np.where(inside, np.searchsorted(rigs, layout.rig), -1)
    freed = replace(
        scope.variant,
        parameters=tuple(
            replace(p, members=members) if p.name == scope.size.name else p for p in scope.variant.parameters
        ),
    )
    variants = list(scope.evidence.hypothesis.variants)
    variants[scope.number] = freed
    hypothesis = Hypothesis(scope.evidence.hypothesis.bare, tuple(variants))
    start = hypothesis.start()
    for p in scope.evidence.hypothesis.parameters:
        start[hypothesis.places[p.name]] = scope.evidence.mode[scope.evidence.hypothesis.places[p.name]]
    fit = hypothesis.fit(start)
    together = float(scope.evidence.value(f"{scope.number}:{scope.size.name}")[0][0])
    own = fit.value(f"{scope.number}:{scope.size.name}")[0]
    # Alike is what the evidence chose: only a rig that is nearer to nothing than to the others is left out.
    acts = own / together > 0.5
    if not acts.any():
        return scope, inside
    return _Scope(scope.name, scope.number, fit), inside & acts[members]


def _places(told: tuple[_Scope, np.ndarray]) -> list[Finding]:
    scope, acts = told
    data = scope.evidence.hypothesis.bare.data
    layout = data.layout
    by_rig = scope.name in _OF_RIG or bool(np.any(acts & ~layout.wind))
    groups = layout.rig if by_rig else np.where(layout.wind, layout.test, -1)
    found = []
    for g in np.unique(groups[acts]):
        mine = acts & (groups == g)
        for records in [mine] if scope.name != "wind_speed_drift" else _alone(mine):
            one = _finding(scope, records)
            if one is not None:
                found.append(one)
    return found


def _alone(mine: np.ndarray) -> list[np.ndarray]:
    """Every record of a mask by itself."""
    return [np.arange(mine.size) == r for r in np.flatnonzero(mine)]


def _finding(scope: _Scope, mine: np.ndarray) -> Finding | None:
    data = scope.evidence.hypothesis.bare.data
    layout = data.layout
    in_wind = np.flatnonzero(mine & layout.wind)
    record = int(in_wind[0] if in_wind.size else np.flatnonzero(mine)[0])
    span = amplitudes_of(data, mine)
    at = float(np.clip(layout.reference_amplitude, *span))
    quantity = _QUANTITY.get(scope.name, "damping")
    value, sd = _size(scope, record, at, span)
    if value == 0.0 or not np.isfinite(sd) or not sd > 0.0:
        return None  # without an answer to its parameters: a rig that never reaches the level of clipping, say
    raw, raw_sd = scope.evidence.value(f"{scope.number}:{scope.size.name}")
    member = int(scope.size.members[record])
    significance = abs(value) / sd if scope.size.log else abs(raw[member]) / raw_sd[member]
    rig, test, name = names_of(data, record)
    several, rigwide = np.count_nonzero(mine) > 1, bool(np.any(mine & ~layout.wind))
    where = f" at amplitude {at:.3g}" if quantity in ("damping", "test") else ""
    if scope.name == "wind_speed_drift":
        where += ", end of the record over its start"
    if scope.name == "sensor_clipping":
        table = scope.evidence.hypothesis.table(scope.evidence.mode[None])[0, record]
        soft = table[Term.CLIP_SOFT] > 0.5
        span = _above(span, float(table[Term.CLIP]) * (0.6 if soft else 1.0))
    return Finding(
        quantity, rig, None if rigwide else test, None if several else name, span,
        None if several else time_of(data, record), value, interval(value, sd), float(significance),
        f"{CATALOGUE[scope.name].title.lower()}: {_UNITS[quantity]}{where}", scope.name,
    )  # fmt: skip


def _above(span: Range, level: float) -> Range:
    return (min(max(span[0], level), span[1]), span[1])


def _size(scope: _Scope, record: int, at: float, span: Range) -> tuple[float, float]:
    """What an effect adds in a record, and its standard error, to first order in its own parameters."""
    evidence, number = scope.evidence, scope.number
    hypothesis = evidence.hypothesis
    places = np.concatenate(
        [np.arange(hypothesis.size)[hypothesis.places[f"{number}:{p.name}"]] for p in scope.variant.parameters]
    )
    step = 1e-2 * np.sqrt(np.diag(evidence.covariance))[places]
    moves = np.zeros((places.size, hypothesis.size))
    moves[np.arange(places.size), places] = step
    u = np.concatenate([evidence.mode[None], evidence.mode + moves, evidence.mode - moves])
    others = tuple(v for i, v in enumerate(hypothesis.variants) if i != number)
    without = Hypothesis(hypothesis.bare, others)
    kept = np.concatenate(
        [
            np.arange(hypothesis.size)[where]
            for name, where in hypothesis.places.items()
            if not name.startswith(f"{number}:")
        ]
    )
    amounts = _amounts(scope, hypothesis.table(u)[:, record], without.table(u[:1, kept])[:, record], record, at, span)
    slopes = (amounts[1 : places.size + 1] - amounts[places.size + 1 :]) / (2.0 * step)
    variance = slopes @ evidence.covariance[np.ix_(places, places)] @ slopes
    return float(amounts[0]), float(np.sqrt(max(variance, 0.0)))


def _amounts(scope: _Scope, table: FloatArray, bare: FloatArray, record: int, at: float, span: Range) -> FloatArray:
    """Size of an effect from rows of coefficients with it, (W, COLUMNS), and one without, (1, COLUMNS)."""
    data = scope.evidence.hypothesis.bare.data
    omega, top = data.layout.omega[record], span[1]
    aero, drive, still = (table[:, int(t)] for t in (Term.AERO, Term.DRIVE, Term.STRUCTURAL))
    if scope.name == "wind_speed_drift":
        rise = table[:, int(Term.TREND)] + table[:, int(Term.TREND_SINE)]
        return np.asarray(-rise * (2.0 * drive / at - aero) / omega)
    if scope.name == "fluid_memory":
        # growth through half the stable amplitude, where da/dt = rate a: the wake's amplitude is (1 - lag rate) a
        rate = aero + still
        pull = np.where(table[:, int(Term.LAG_KIND)] > 0.5, 2.0 * rate, -aero)
        return np.asarray(-pull * table[:, int(Term.LAG)] * rate / omega)
    if scope.name == "vortex_shedding_forcing":
        return np.asarray(np.hypot(table[:, int(Term.FORCE_COS)], table[:, int(Term.FORCE_SIN)]) / omega)
    if scope.name == "stiffness_nonlinearity":
        rows = table - bare
        return np.asarray(rows[:, int(Term.STIFFNESS_LINEAR)] * top + rows[:, int(Term.STIFFNESS)] * top**2)
    if scope.name == "sensor_gain_error":
        return np.asarray(table[:, int(Term.GAIN)] - bare[:, int(Term.GAIN)])
    if scope.name == "sensor_clipping":
        return _lost(table, top)
    grid = np.array([at])
    knots = data.channels.knots
    with_it, alone = (-amplitude_rates(np.ascontiguousarray(t), grid, knots)[:, 0] / at for t in (table, bare))
    return np.asarray((with_it - alone) / omega)


def _lost(table: FloatArray, reading: float) -> FloatArray:
    """Part of the amplitude that a saturated reading loses at the largest reading, negative."""
    from scruton.dynamics.reading import readings

    rows = np.ascontiguousarray(table)
    low, high = np.full(len(table), 0.5 * reading), np.full(len(table), 4.0 * reading)
    for _ in range(40):
        middle = 0.5 * (low + high)
        short = readings(rows, middle) < reading
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return np.asarray(reading / (0.5 * (low + high)) - 1.0)
