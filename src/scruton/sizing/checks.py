"""What a required damping is held against: all laws, no law, a line by hand, what was tested."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from scruton.arrays import FloatArray
from scruton.griffin.curves import LawCurves, Start, law_curves, nearest_start, starts
from scruton.griffin.discrepancy import STATED, one_rig, with_discrepancy
from scruton.griffin.law_free import LawFree, StraightLine, law_free, straight_line
from scruton.griffin.thresholds import X_TRUSTED
from scruton.sizing.limits import Limit
from scruton.sizing.model import Draws, ModeModel, unit_cube
from scruton.sizing.thresholds import LARGEST_ADDED

if TYPE_CHECKING:
    import xarray as xr

CONFIDENCES = ("0.50", "0.84", "0.95", "0.99")
ASKED = "0.95"  # the one that is spoken of: in flags, on the first page, in a bridge's decision
LAW_FREE = "law-free"
_FEW = 1 << 12  # draws that tell which test is nearest
Required = Mapping[str, float | None]


@dataclass(frozen=True)
class Reach:
    """How far the setting that a required damping makes lies from what was tested, or that with all that can be added.

    Attributes
    ----------
    scruton_number, extrapolation_index : float
        Median, and the median x of that from the nearest test.
    covered_by, tests : int
        Peak tests whose transients run through the section's amplitude at the limit, and how many there are.
    trusted : bool
        Whether |x| is small and some test covers the amplitude.
    """

    scruton_number: float
    extrapolation_index: float
    covered_by: int
    tests: int
    trusted: bool


@dataclass(frozen=True)
class ByHand:
    """What leads to `required_by_hand`, for who checks it: Sc of the line at the limit, less what the bridge has.

    Attributes
    ----------
    intercept, slope : float
        Of 1/A = intercept + slope Sc through the stable amplitudes, A/D or rad.
    amplitude, scruton_number : float
        Of the section at the limit, the median, and where the line has it.
    damping_ratio : float
        Of the bridge, the median.
    """

    intercept: float
    slope: float
    amplitude: float
    scruton_number: float
    damping_ratio: float


@dataclass(frozen=True)
class Checks:
    """What stands beside the required damping ratios of one limit; see `Risk`."""

    reach: Mapping[str, Reach | None] = field(default_factory=dict)
    required_by_law: Mapping[str, Required] = field(default_factory=dict)
    required_at_discrepancy: Mapping[str, Required] = field(default_factory=dict)
    required_by_hand: float | None = None
    by_hand: ByHand | None = None


@dataclass(frozen=True, eq=False)
class Evidence:
    """What of a fit the required damping is held against, apart from the curve that it comes from.

    Attributes
    ----------
    law_free, line
        What the damping measured in each test says by itself, and the line through 1/A; None where there is none.
    at_discrepancy : mapping
        From one rig: the curve where the discrepancy between settings is known to be so much ("0.10").
    """

    tree: "xr.DataTree"
    law_free: LawFree | None
    line: StraightLine | None
    at_discrepancy: Mapping[str, LawCurves]
    _curves: dict[str, dict[str, LawCurves]] = field(default_factory=dict, repr=False)  # by the nearest test

    @classmethod
    def of(cls, tree: "xr.DataTree", law_n: float | None = None) -> "Evidence":
        """Gather it from the tree of a fit; `law_n` is the one law that is sized under, if it is one alone."""
        stated = STATED if one_rig(tree) else ()
        known = {f"{tau:.2f}": law_curves(with_discrepancy(tree, tau), law_n=law_n) for tau in stated}
        return cls(tree, law_free(tree), straight_line(tree), known)

    def each_law(self, near: float) -> dict[str, LawCurves]:
        """Each law of the card alone; without a curve of its own, from the test nearest to a Scruton number."""
        test = nearest_start(self._starts, near).test
        if test not in self._curves:
            self._curves[test] = self._each_law(near)
        return self._curves[test]

    @cached_property
    def _starts(self) -> list[Start]:
        return starts(self.tree)

    def _each_law(self, near: float) -> dict[str, LawCurves]:
        curves = {}
        for label in map(str, self.tree["laws"]["law"].to_numpy()):
            exponent = label.removeprefix("n=")
            alone = {"law_n": float(exponent), "near": near} if exponent != label else {}
            curves[label] = law_curves(self.tree, **alone)
        return curves

    def checks(
        self, model: ModeModel, limit: float, required: Required, u: FloatArray, needed: Mapping[str, FloatArray]
    ) -> Checks:
        """Hold what a mode requires for a limit [m] or [rad] against all of it, at points of the unit cube.

        They are those that the requirement is from, and `needed` has what the draws need under each law that it rests
        on: numbers that are the same by what they mean are the same.
        """
        draws = model.draws(u)
        reach = {name: reach_of(draws, limit, added) for name, added in required.items()}
        by_law = self._by_law(model, draws, limit, reach, u, needed)
        if self.law_free is not None:
            by_law[LAW_FREE] = required_of(
                replace(draws, law_free=self.law_free, curve=replace(draws.curve, measured=None)).needed(limit)
            )
        stated = {
            tau: required_of(replace(model, laws=known).draws(u).needed(limit))
            for tau, known in self.at_discrepancy.items()
        }
        return Checks(reach, by_law, stated, *(() if self.line is None else _by_hand(draws, limit, self.line)))

    def _by_law(
        self,
        model: ModeModel,
        draws: Draws,
        limit: float,
        reach: Mapping[str, Reach | None],
        u: FloatArray,
        needed: Mapping[str, FloatArray],
    ) -> dict[str, Required]:
        """Required damping by law and confidence, each from the test that is nearest to where this law itself has it.

        It is looked for from where the laws as weighed have it.  Where tests send to one another the largest of their
        answers counts, and more confidence takes no less damping than less does.
        """
        furthest = max((found.scruton_number for found in reach.values() if found), default=0.0)
        by_start: dict[tuple[str, float], Required] = {}

        def asked(label: str, near: float) -> tuple[float, Required]:
            """Scruton number that a law starts from, the nearest to one, and what it requires from there."""
            alone = self.each_law(near)[label]
            place = label, alone.reference
            if place not in by_start:
                known = needed.get(label) if alone.coverage is None or alone.coverage.start is None else None
                needs = replace(model, laws=alone).draws(u).needed(limit) if known is None else known
                by_start[place] = required_of(needs)
            return alone.reference, by_start[place]

        def answer(label: str, name: str, near: float) -> tuple[float, Draws, float | None]:
            start, required = asked(label, near)
            return start, draws, required[name]

        by_law: dict[str, Required] = {}
        for label in self.each_law(furthest):
            row: dict[str, float | None] = {}
            least = 0.0
            for name, found in reach.items():
                near = found.scruton_number if found else furthest
                least = max(least, *_sent_on(partial(answer, label, name), near).values())
                row[name] = least if np.isfinite(least) else None
            by_law[label] = row
        return by_law


def _sent_on(answer: Callable[[float], tuple[float, Draws, float | None]], near: float) -> dict[float, float]:
    """Added damping by the Scruton number of the test that a law starts from, of the tests that send to one another.

    `answer` tells, from the test nearest to a Scruton number, where that test is, the mode's draws, and the damping
    that it requires, None where none suffices.  With that damping another test may be nearer.  One test alone where it
    is its own nearest.
    """
    answers: dict[float, float] = {}
    start, draws, required = answer(near)
    while start not in answers:
        answers[start] = np.inf if required is None else required
        near = float(np.median(draws.scruton_number(min(answers[start], LARGEST_ADDED))))
        start, draws, required = answer(near)
    order = list(answers)
    return {one: answers[one] for one in order[order.index(start) :]}


def from_nearest_test(tree: "xr.DataTree", law_n: float, model: ModeModel, rules: Sequence[Limit]) -> ModeModel:
    """A mode under one law, from the test that is nearest to where the smallest limit has it, at `ASKED`.

    As for the laws that stand beside the required damping, where tests send to one another the largest answer counts.
    """
    bridge, u = model.bridge, unit_cube(_FEW, 0)
    place = (model.mode.frequency.mean, bridge.width, bridge.depth)
    limit = min(rule.amplitude(bridge.motion, *place) for rule in rules)
    found: dict[float, ModeModel] = {}

    def answer(near: float) -> tuple[float, Draws, float | None]:
        laws = law_curves(tree, law_n=law_n, near=near)
        found[laws.reference] = replace(model, laws=laws)
        draws = found[laws.reference].draws(u)
        return laws.reference, draws, required_of(draws.needed(limit))[ASKED]

    answers = _sent_on(answer, float(np.median(model.draws(u).scruton_number(0.0))))
    return found[max(answers, key=answers.__getitem__)]


def required_of(needed: FloatArray) -> dict[str, float | None]:
    """Added damping ratio by confidence, from draws of what is needed; None where it is more than can be added."""
    # Order statistics: what is needed may be infinite.
    points = np.quantile(needed, [float(name) for name in CONFIDENCES], method="inverted_cdf").tolist()
    return {
        name: max(point, 0.0) if point <= LARGEST_ADDED else None
        for name, point in zip(CONFIDENCES, points, strict=True)
    }


def reach_of(draws: Draws, limit: float, added: float | None) -> Reach | None:
    """How far the setting with an added damping ratio lies from what was tested; None where that is not known.

    Where more is required than can be added, which is None, it is that with all that can be.
    """
    added = LARGEST_ADDED if added is None else added
    coverage = draws.curve.coverage
    if coverage is None:
        return None
    sc = float(np.median(draws.scruton_number(np.full((1, 1), added))))
    index = draws.curve.index_of_nearest(sc)
    covered = coverage.tests_at(limit / float(np.median(draws.scale)))
    return Reach(sc, index, covered, coverage.scruton_number.size, abs(index) <= X_TRUSTED and covered > 0)


def _by_hand(draws: Draws, limit: float, line: StraightLine) -> tuple[float, ByHand]:
    """Added damping ratio where the line through 1/A reaches the limit, with the median of all else."""
    amplitude, own = limit / float(np.median(draws.scale)), float(np.median(draws.damping_ratio))
    sc = line.scruton_number(amplitude)
    added = max(sc / float(np.median(draws.factor)) - own, 0.0)
    return added, ByHand(line.intercept, line.slope, amplitude, sc, own)
