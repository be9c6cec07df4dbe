"""What an effect is: an entry of the catalogue that says of itself all that others need to know."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from scruton.arrays import FloatArray
from scruton.dynamics.effects.terms import Belongs, IntArray, Layout, Term, compact

Values = Mapping[str, FloatArray]
Apply = Callable[[FloatArray, Values, Layout], None]


class Extent(StrEnum):
    """Over what the values of a parameter extend."""

    EVERYWHERE = "everywhere"
    IN_WIND = "in wind"
    ONE_RIG = "one rig"
    ONE_RIG_IN_WIND = "one rig, in wind"
    ALL_RIGS_BUT_ONE = "all rigs but one"
    EACH_RIG = "each rig"
    ONE_TEST = "one test"
    EACH_TEST = "each test"
    ONE_RECORD = "one record"
    EACH_RECORD = "each record"
    EACH_RECORD_OF_ONE_TEST = "each record of one test"
    SOME_RECORDS = "some records, each by its own"
    SOME_TESTS = "some tests, each by its own"
    GROUPS = "groups of records"


SOME = Extent.SOME_RECORDS, Extent.SOME_TESTS  # what is chosen by what is seen there
# Extents that make sense of one rig or test alone, too; the others need several.
_OF_ANY = (Extent.EVERYWHERE, Extent.IN_WIND, Extent.ONE_RIG_IN_WIND, Extent.EACH_TEST)


@dataclass(frozen=True, eq=False)
class Scope:
    """The records in which an effect acts, and which of them share a value.

    Attributes
    ----------
    extent : Extent
    members : (R,) array of int
        Which value each record takes; -1: the effect does not act there.
    words : str
        The same for people.
    number : int
        Of the rig, test or record in the layout, where it is one; else -1.
    weight : float
        Prior probability among the scopes of an effect, before normalisation.
    """

    extent: Extent
    members: IntArray
    words: str = ""
    number: int = -1
    weight: float = 1.0

    @property
    def records(self) -> IntArray:
        """Whether the effect acts in each record, (R,) of bool."""
        inside: IntArray = self.members >= 0
        return inside


def in_wind(layout: Layout) -> Scope:
    """Every record in wind, with one value."""
    return Scope(Extent.IN_WIND, layout.in_wind())


def scopes(layout: Layout, shares: Mapping[Extent, tuple[float, str]], *, wind: bool = False) -> list[Scope]:
    """Scopes that a campaign allows; those of one rig, test or record only where there are several.

    Parameters
    ----------
    layout : Layout
    shares : mapping
        Weight and words of every extent; the weight is divided among the rigs, tests or records.
    wind : bool
        Only rigs and records in wind.
    """
    inside = layout.wind if wind else np.ones(len(layout.records), dtype=bool)
    rigs, tests = np.unique(layout.rig[inside]).tolist(), np.unique(layout.test[layout.wind]).tolist()
    records, several = np.flatnonzero(inside).tolist(), [i for i in tests if np.count_nonzero(layout.test == i) > 1]
    windy = [i for i in rigs if np.any(layout.wind & (layout.rig == i))]
    # How many rigs, tests or records there are, and what makes the members of every case, by its number; -1: of all.
    cases: dict[Extent, tuple[int, Callable[[], dict[int, IntArray]]]] = {
        Extent.EVERYWHERE: (1, lambda: {-1: layout.everywhere()}),
        Extent.IN_WIND: (1, lambda: {-1: layout.in_wind()}),
        Extent.ONE_RIG: (len(rigs), lambda: {i: layout.only(layout.rig == i) for i in rigs}),
        Extent.ONE_RIG_IN_WIND: (len(rigs), lambda: {i: layout.only(layout.wind & (layout.rig == i)) for i in windy}),
        Extent.ALL_RIGS_BUT_ONE: (len(rigs), lambda: {i: layout.only(layout.rig != i) for i in rigs}),
        Extent.EACH_RIG: (len(rigs), lambda: {-1: layout.by_rig()}),
        Extent.ONE_TEST: (len(tests), lambda: {i: layout.only(layout.test == i) for i in tests}),
        Extent.EACH_TEST: (len(tests), lambda: {-1: layout.by_test()}),
        Extent.ONE_RECORD: (len(records), lambda: {r: layout.only(np.arange(len(inside)) == r) for r in records}),
        Extent.EACH_RECORD: (len(records), lambda: {-1: layout.each(inside)}),
        Extent.EACH_RECORD_OF_ONE_TEST: (len(tests), lambda: {i: layout.each(layout.test == i) for i in several}),
        # of all that might be meant: see `Variant.within`
        Extent.SOME_RECORDS: (len(records) - 2, lambda: {-1: layout.each(inside)}),
        Extent.SOME_TESTS: (len(tests) - 1, lambda: {-1: layout.by_test()}),
    }
    return [
        Scope(extent, members, words, number, weight if number < 0 else weight / cases[extent][0])
        for extent, (weight, words) in shares.items()
        if extent in _OF_ANY or cases[extent][0] > 1
        for number, members in cases[extent][1]().items()
    ]


@dataclass(frozen=True, eq=False)
class Parameter:
    """A parameter of a variant or of the null model, with a normal prior in its sampled coordinate.

    Attributes
    ----------
    name : str
    location, scale : float or (size,) array
        Of the normal prior; of the logarithm where `log`.
    members : (R,) array of int
        Which of its values each record takes; -1: none (the value is zero there).
    log : bool
        Sampled by its logarithm: positive.
    positive : bool
        A normal prior cut at zero; counted by the mass of the posterior above it.
    unit : str
    starts : tuple of float
        Values in the sampled coordinate from which the search begins.
    owner : int or None
        Place of its variant in a hypothesis; None in the null model.
    """

    name: str
    location: float | FloatArray
    scale: float | FloatArray
    members: IntArray
    log: bool = False
    positive: bool = False
    unit: str = "-"
    starts: tuple[float, ...] = (0.0,)
    owner: int | None = None

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.members.max(initial=-1)) + 1

    @property
    def key(self) -> tuple[int | None, str]:
        """What tells it from every other parameter of a hypothesis."""
        return self.owner, self.name


@dataclass(frozen=True, eq=False)
class Variant:
    """One concrete form of an effect in one scope.

    Attributes
    ----------
    form : str
        For people; `{scope}` in it stands for the words of the scope.
    parameters : tuple of Parameter
    apply : callable
        Adds to a table of coefficients, (W, R, COLUMNS), in place, from values by name, (W, R) each.
    scope : Scope
    weight : float
        Prior probability within its effect, before normalisation.
    size : str
        Name of the parameter that tells how large the effect is; the first by default.
    scan : str
        Name of a parameter in which the likelihood has many optima: a grid is searched before the climb.
    read_at : float
        Amplitude at which its size is read, over the reference amplitude: another one where nothing is added there.
    seen : float
        Log likelihood ratio of what the records show of it beside amplitude, phase and third harmonic [nats].
    effect : str
        Name of the effect that it is a form of, set by that effect; empty for none of the catalogue.
    refines : str
        Form, in the same scope, that it is with further parameters; empty for none.
    """

    form: str
    parameters: tuple[Parameter, ...]
    apply: Apply
    scope: Scope
    weight: float = 1.0
    size: str = ""
    scan: str = ""
    read_at: float = 1.0
    seen: float = 0.0
    effect: str = ""
    refines: str = ""

    def __post_init__(self) -> None:
        if not self.size and self.parameters:
            object.__setattr__(self, "size", self.parameters[0].name)

    def within(self, records: IntArray, share: float = 1.0) -> "Variant":
        """The same in some of its records, (R,) of bool, alone; with a share of its weight."""
        scope = replace(self.scope, members=compact(np.where(records, self.scope.members, -1)))
        parameters = (replace(p, members=compact(np.where(records, p.members, -1))) for p in self.parameters)
        return replace(self, parameters=tuple(parameters), scope=scope, weight=share * self.weight)

    @property
    def label(self) -> str:
        """Form and scope for people."""
        return self.form.format(scope=self.scope.words)

    @property
    def identity(self) -> tuple[str, str, Extent, int]:
        """Effect, form and scope: the same variant in another layout has the same."""
        return self.effect, self.form, self.scope.extent, self.scope.number

    @property
    def plain(self) -> tuple[str, str, Extent, int]:
        """Identity of the variant that it refines."""
        return self.effect, self.refines, self.scope.extent, self.scope.number

    def does_what(self, other: "Variant") -> bool:
        """Whether it is another's equation with the same priors in the same records, of whatever effect and weight."""
        if self.apply is not other.apply or len(self.parameters) != len(other.parameters):
            return False
        return all(
            mine.name == its.name
            and np.array_equal(mine.members, its.members)
            and np.array_equal(mine.location, its.location)
            and np.array_equal(mine.scale, its.scale)
            for mine, its in zip(self.parameters, other.parameters, strict=True)
        )


@dataclass(frozen=True, eq=False)
class Station:
    """Where the size of an effect is read: one record, at one amplitude.

    Attributes
    ----------
    amplitude, largest : float
        At which a damping is read, and the largest of the record; A/D or rad.
    omega : float
        Natural circular frequency [rad/s].
    damping : callable
        Damping rate -da/dt/a [1/s] at the amplitude, (W,), of rows of coefficients, (W, COLUMNS).
    reading : callable
        What the sensor shows of amplitudes, (W,), one for each row of coefficients.
    """

    amplitude: float
    largest: float
    omega: float
    damping: Callable[[FloatArray], FloatArray]
    reading: Callable[[FloatArray, FloatArray], FloatArray]


Read = Callable[[FloatArray, FloatArray, Station], FloatArray]
Span = tuple[float, float]


@dataclass(frozen=True)
class Size:
    """How large an effect is in one record.

    Attributes
    ----------
    quantity : {"damping", "frequency", "spectrum", "branch", "test", "signal"}
        What it is seen in.
    unit : str
        What the number is, for people; `{at}` in it stands for the amplitude.
    read : callable
        The number, (W,), from rows of coefficients with the effect, (W, COLUMNS), one without, (1, COLUMNS), and the
        station.
    span : callable, optional
        The part of the record's amplitudes in which it acts, from a row of coefficients; all of them by default.
    """

    quantity: str
    unit: str
    read: Read
    span: Callable[[FloatArray, Span], Span] | None = None


def added_damping(rows: FloatArray, without: FloatArray, station: Station) -> FloatArray:
    """Damping ratio that an effect adds at an amplitude, (W,)."""
    return (station.damping(rows) - station.damping(without)) / station.omega


DAMPING_RATIO = Size("damping", "damping ratio at amplitude {at}", added_damping)


@dataclass(frozen=True, eq=False)
class Effect:
    """One entry of the catalogue.

    Attributes
    ----------
    name, title : str
        `docs/effects.md` says under the name what it is, where that is written, and what it does to the records.
    channel : {"amplitude", "frequency", "signal", "spectrum"}
        What it is seen in above all.
    belongs : Belongs
        Whose it is: of what is the wind's a bridge has its share.
    terms : tuple of Term
        Columns of the table of coefficients that it writes.
    size : Size
    forms : callable
        Makes the variants that a layout allows; those that act in no record are left out.
    """

    name: str
    title: str
    channel: str
    belongs: Belongs
    terms: tuple[Term, ...]
    size: Size
    forms: Callable[[Layout], Sequence[Variant]] = field(repr=False)

    def variants(self, layout: Layout) -> tuple[Variant, ...]:
        """The variants that a layout allows and that act in some record, each with the name of this effect."""
        return tuple(replace(v, effect=self.name) for v in self.forms(layout) if v.scope.records.any())


DAMPING = "of the relaxation damping"
REFERENCE = "of the reference amplitude"
DRIVE = "of the drive"
REPEATED = "of the relaxation damping, from record to record"
FREQUENCY = "of the frequency"
AMPLITUDE = "A/D or rad"
FACTOR = "ln of a factor"
TENTHS = "tenths of the frequency"


def size_prior(
    name: str, members: IntArray, *, scale: float = 0.3, positive: bool = False, unit: str = DAMPING
) -> Parameter:
    """Size of an effect: its damping at the reference amplitude over the reference relaxation rate, N(0, scale^2)."""
    starts = (0.1,) if positive else (0.0,)
    return Parameter(name, 0.0, scale, members, positive=positive, starts=starts, unit=unit)


def sized(
    form: str, apply: Apply, scope: Scope, *names: str, weight: float | None = None, scale: float = 0.3,
    positive: bool = False, unit: str = DAMPING,
) -> Variant:  # fmt: skip
    """A variant whose parameters are sizes (see `size_prior`), "size" by default; weighed as its scope if not told."""
    priors = (size_prior(name, scope.members, scale=scale, positive=positive, unit=unit) for name in names or ("size",))
    return Variant(form, tuple(priors), apply, scope, scope.weight if weight is None else weight)


def add(table: FloatArray, term: int, value: FloatArray) -> None:
    """Add to one coefficient of all records; value is (W, R)."""
    table[:, :, int(term)] += value


# Powers of the amplitude that a damping goes with, and a change of the frequency; shares of a whole have no unit.
POWERS: dict[int, int] = {
    Term.STRUCTURAL_LINEAR: 1, Term.STRUCTURAL_SQUARE: 2, Term.AERO_LINEAR: 1, Term.AERO_SQUARE: 2, Term.AERO_FOURTH: 4,
}  # fmt: skip
BENDS: dict[int, int] = {Term.STIFFNESS_LINEAR: 1, Term.STIFFNESS: 2, Term.STIFFNESS_FOURTH: 4}
# Of the wind in a record.
TRENDS = (
    Term.TREND, Term.TREND_SINE, Term.TREND_ARCH, Term.TREND_SETTLING,
    Term.TREND_DRIVE, Term.TREND_DRIVE_ARCH, Term.TREND_DRIVE_SETTLING,
)  # fmt: skip
_SHARES = (*TRENDS, Term.GAIN, Term.JUMP, Term.FREQUENCY_TREND)
_BEND = 0.1  # the prior of the relative change of frequency up to the largest amplitude is N(0, (0.3 times this)^2)


def bend_at(rows: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Relative change of the frequency at amplitudes (A/D or rad), from rows of coefficients (..., COLUMNS)."""
    return np.asarray(sum(rows[..., int(term)] * amplitude**power for term, power in BENDS.items()))


def half_a_record(layout: Layout) -> tuple[float, float]:
    """Prior of the logarithm of a time constant [s] that no relaxation has, in which a wake that remembers follows."""
    return float(np.log(0.5 * np.median(layout.duration))), 0.35


def adding(**terms: int) -> Apply:
    """An `apply` that adds parameters, by name, to coefficients, each in the unit that `size_prior` is meant in."""

    def apply(table: FloatArray, values: Values, layout: Layout) -> None:
        for name, term in terms.items():
            value = values[name]
            if term in BENDS:
                value = _BEND * value / float(layout.largest.max()) ** BENDS[term]
            elif term not in _SHARES:
                value = value * layout.rate / layout.reference_amplitude ** POWERS.get(term, 0)
            add(table, term, value)

    return apply
