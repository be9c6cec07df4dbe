"""The regimes in which the bands are put to the test: what is measured, under which noise, and with which priors.

Twelve span what laboratories do; two more ask whether the data betray another law than the paper's, and six whether
the bands hold where the wind is not steady.  The others are outside the family, or off its curve: there the records are
fitted with the card as it is, and what it says of tested settings, of new ones and of rigs left out is scored.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase

import numpy as np

from scruton.campaign.schema import Kind, Motion, Section
from scruton.errors import InputError
from scruton.infer.cards import ModelCard
from scruton.stats.priors import Prior

GROWTH, DECAY, BOTH = (Kind.GROWTH,), (Kind.DECAY,), (Kind.GROWTH, Kind.DECAY)
_MODEL = 2  # of the truths that a regime means: with another, campaigns of both are no sample of one
ALL_LAWS = (-1.0, 0.0, 1.0, 2.0)
ALL_LAW_WEIGHTS = (0.7, 0.1, 0.1, 0.1)

# A 4:1 rectangle: heaving mass [kg/m] and torsional inertia [kg m^2/m], frequency [Hz], wind.
WIDTH, DEPTH = 0.3, 0.075
MASS = {Motion.HEAVING: 7.292, Motion.TORSIONAL: 0.06}
FREQUENCY = {Motion.HEAVING: 7.87, Motion.TORSIONAL: 10.0}
REDUCED_VELOCITY = 8.5
AIR_DENSITY = 1.22
CYLINDER_MASS = 1.335  # kg/m, of a circular cylinder of the same depth: rho D^2/2m is Feng's, 0.00257

# Narrower than the shipped card's: its widest truths relax within a cycle or not within any record, where neither the
# slow-amplitude theory nor the experiment has a meaning.
_WHY = "calibration: truths that a slow-amplitude theory and a record of at most 250 cycles can mean"
_STABLE = {Motion.HEAVING: 0.05, Motion.TORSIONAL: 0.03}
_STABLE_LOG_SD = 0.7


@dataclass(frozen=True)
class Regime:
    """One kind of campaign.

    Attributes
    ----------
    name, title : str
    motion : Motion
    scruton_numbers : tuple of float
        As stated, one a rig; every rig has one test.
    kinds : tuple of Kind
        Records of every test in wind: transients, and lock-in without release.
    turbulence : float
        Scatter of the amplitude over the stable amplitude; the truth of `amplitude_scatter`.
    gust_scatter, set_point_scatter : float
        Scatter of the stable amplitude that slow gusts make, and from record to record, over it.
    gust_time : (float, float)
        Least and largest correlation time of the gusts, in relaxation times; every test draws one, log-uniformly.
    sensor_noise : float
        Standard deviation of a sample over the stable amplitude.
    damping_sd, mass_sd, density_sd : float
        Relative uncertainties as stated; zero is none.
    ring_downs : int
        Free decays in still air of every rig.
    relaxation : (float, float)
        Median and log sd of the prior of lambda/omega0.
    priors : mapping
        Further lognormal priors (median, log sd) that replace the card's.
    n : float
        The true law.
    laws : tuple of float
        Laws that the fit weighs.
    outside : bool
        Whether the truth is outside the family or off its curve: the fit has the card as it is.
    miss : float, optional
        Sd of ln(amplitude) and of ln(strength of the wind) by which rigs miss the curve; drawn from the prior if None.
    disturbances : mapping
        Fields of `scruton.simulate.Disturbances` with the range that each campaign draws them from, in units of the
        middle rig's stable amplitude or relaxation rate.
    wake : str
        Wake oscillator that moves the rigs, one of `scruton.calibrate.wake.WAKES`; none if empty.
    """

    name: str
    title: str
    motion: Motion = Motion.HEAVING
    scruton_numbers: tuple[float, ...] = (22.0,)
    kinds: tuple[Kind, ...] = BOTH
    turbulence: float = 0.01
    gust_scatter: float = 0.0
    set_point_scatter: float = 0.0
    gust_time: tuple[float, float] = (0.3, 10.0)
    sensor_noise: float = 0.005
    damping_sd: float = 0.1
    mass_sd: float = 0.0
    density_sd: float = 0.0
    ring_downs: int = 0
    relaxation: tuple[float, float] = (0.014, 0.5)
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    n: float = -1.0
    laws: tuple[float, ...] = (-1.0,)
    outside: bool = False
    miss: float | None = None
    disturbances: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    wake: str = ""

    @property
    def digest(self) -> str:
        """What tells this definition of the regime from another: campaigns of both are no sample of one."""
        return hashlib.sha256(f"{self!r} {_MODEL}".encode()).hexdigest()[:16]

    @property
    def width(self) -> float:
        """B [m]: that of the rectangle, or of the circular cylinder that wake oscillators are of."""
        return DEPTH if self.wake else WIDTH

    @property
    def mass(self) -> float:
        """Of every rig as stated, kg/m or kg m^2/m."""
        return CYLINDER_MASS if self.wake else MASS[self.motion]

    @property
    def section(self) -> Section:
        """The body."""
        return Section(self.motion, self.width, DEPTH)

    @property
    def weighs_laws(self) -> bool:
        """Whether the regime asks for the law, or for what is predicted without knowing it, not for parameters."""
        return self.outside or len(self.laws) > 1

    @property
    def remembers(self) -> bool:
        """Whether the air has a past that no relaxation rate describes."""
        return "memory_time" in self.disturbances

    @property
    def noise(self) -> dict[str, float]:
        """What is true of a test's noise, by parameter of the model; zero where there is none."""
        return {
            "amplitude_scatter": self.turbulence,
            "noise_factor": 1.0,
            "gust_scatter": self.gust_scatter,
            "gust_time": float(np.sqrt(np.prod(self.gust_time))) if self.gust_scatter else 0.0,
            "set_point_scatter": self.set_point_scatter,
        }

    @property
    def overrides(self) -> dict[str, tuple[float, float]]:
        """Lognormal priors (median, log sd) that replace the card's, by parameter."""
        return {
            "stable_amplitude": (_STABLE[self.motion], _STABLE_LOG_SD),
            "relaxation_ratio": self.relaxation,
            **self.priors,
        }

    def card(self, base: ModelCard) -> ModelCard:
        """Return the card that truths are drawn from and records are fitted with."""
        priors = dict(base.priors)
        for name, (median, log_sd) in self.overrides.items():
            unit = base.prior(name, self.motion).unit
            for key in (name, f"{name}.{self.motion.value}"):
                if key in priors:
                    priors[key] = Prior(name, "lognormal", median, log_sd, unit, _WHY)
        weights: tuple[float, ...] = (1.0,)
        if self.weighs_laws:
            weights = base.law_weights if base.laws == self.laws else ALL_LAW_WEIGHTS
        text = f"{base.text}\n# calibration regime {self.name}: {self.overrides!r}, n = {self.laws!r}\n"
        return replace(
            base, name=f"{base.name}, {self.name}", laws=self.laws, law_weights=weights, priors=priors, text=text
        )


_TORSIONAL = {"motion": Motion.TORSIONAL, "scruton_numbers": (0.9,), "relaxation": (0.012, 0.5)}

TWELVE = (
    Regime(
        "sensor-noise", "sensor noise of 1 % alone, no turbulence",
        turbulence=0.0, sensor_noise=0.01, priors={"amplitude_scatter": (0.001, 1.5)},
    ),
    Regime("turbulence-1", "turbulence: 1 % scatter of the amplitude"),
    Regime("turbulence-3", "turbulence: 3 % scatter of the amplitude", turbulence=0.03),
    Regime("growth", "one growth record", kinds=GROWTH),
    Regime("decay", "one decay record", kinds=DECAY),
    Regime("torsional", "torsional motion", **_TORSIONAL),  # type: ignore[arg-type]
    Regime("torsional-growth-3", "torsional, growth alone, 3 % scatter",
           kinds=GROWTH, turbulence=0.03, **_TORSIONAL),  # type: ignore[arg-type]
    Regime("low-sc", "low Scruton number", scruton_numbers=(2.0,), relaxation=(0.006, 0.5)),
    Regime("high-sc", "high Scruton number", scruton_numbers=(60.0,), relaxation=(0.028, 0.35)),
    Regime(
        "ring-downs", "damping from three ring-downs, stated to 30 %; mass and density to 1 %",
        damping_sd=0.3, mass_sd=0.01, density_sd=0.01, ring_downs=3,
    ),
    Regime(
        "three-tests", "three rigs at Sc 5, 20 and 50; mass and density to 1 %",
        scruton_numbers=(5.0, 20.0, 50.0), relaxation=(0.012, 0.5), mass_sd=0.01, density_sd=0.01,
    ),
    Regime(
        "three-tests-torsional-3", "three torsional rigs at Sc 0.5, 1 and 2, 3 % scatter",
        motion=Motion.TORSIONAL, scruton_numbers=(0.5, 1.0, 2.0), relaxation=(0.012, 0.5), turbulence=0.03,
    ),
)  # fmt: skip

_TWO_SC = {"scruton_numbers": (10.0, 25.0), "relaxation": (0.014, 0.5), "laws": ALL_LAWS}
LAW_REGIMES = (
    Regime("van-der-pol", "force of Ehsan and Scanlan (n = 2), two rigs", n=2.0, **_TWO_SC),  # type: ignore[arg-type]
    Regime("paper-two-sc", "the paper's law, two rigs", **_TWO_SC),  # type: ignore[arg-type]
)

WIND_REGIMES = (
    *(
        Regime(f"gusts-{k}", f"slow gusts: {k} % scatter of the stable amplitude, no turbulence",
               turbulence=0.0, gust_scatter=0.01 * k)
        for k in (1, 2, 3)
    ),
    Regime("gusts-and-turbulence", "slow gusts of 2 % and turbulence of 1 %", gust_scatter=0.02),
    Regime("set-point-1", "set-points: 1 % scatter of the stable amplitude from record to record",
           set_point_scatter=0.01),
)  # fmt: skip

_THREE, _SIX = (10.0, 20.0, 40.0), (5.0, 10.0, 15.0, 20.0, 30.0, 40.0)


def _outside() -> tuple[Regime, ...]:
    """Truths outside the family or off its curve, with three rigs, six rigs and one."""
    first = Regime("", "", scruton_numbers=_THREE, laws=ALL_LAWS, outside=True, miss=0.0)
    laws = [
        replace(first, name=f"law-{'minus-1' if n < 0.0 else f'{n:g}'}", title=f"law n = {n:g}", n=n)
        for n in (-1.0, 0.0, 0.5, 1.0, 2.0)
    ]
    added: dict[str, tuple[str, dict[str, tuple[float, float]]]] = {
        "bump": (
            "a bump in aerodynamic damping",
            {"bump_amplitude": (0.3, 0.7), "bump_width": (0.1, 0.2), "bump_rate": (0.2, 0.5)},
        ),
        "coherence-loss": ("the second term lost at small amplitude", {"coherence_amplitude": (0.15, 0.5)}),
        "memory": ("aerodynamic damping of an amplitude that is past", {"memory_time": (0.3, 3.0)}),
    }
    disturbed = [replace(first, name=name, title=title, disturbances=d) for name, (title, d) in added.items()]
    wakes = [
        replace(first, name=f"wake-{wake}", title=f"wake oscillator: {wake}", wake=wake, turbulence=0.005)
        for wake in ("facchinetti", "tamura-matsui", "hartlen-currie")
    ]
    three = [*laws, *disturbed, *wakes]
    one = [
        replace(regime, name=f"{regime.name}-one-rig", title=f"{regime.title}, one rig", scruton_numbers=_THREE[1:2])
        for regime in three
    ]
    off = [
        replace(
            first,
            name=f"off-{100 * miss:g}-{word}",
            title=f"rigs miss the curve by {100 * miss:g} %: {word}",
            scruton_numbers=numbers,
            miss=miss,
        )
        for word, numbers in (("three", _THREE), ("six", _SIX), ("one", _THREE[1:2]))
        for miss in (0.0, 0.05, 0.1, 0.2)
        if miss or word == "six"  # law-minus-1 has three rigs, and one, on the curve
    ]
    return (*three, *one, *off)


OUTSIDE_REGIMES = _outside()

STEADY_REGIMES = (
    Regime("steady-set-point-1", "a decay and a lock-in record; 1 % scatter of the stable amplitude between them",
           kinds=(Kind.DECAY, Kind.STEADY), set_point_scatter=0.01),
)  # fmt: skip

# Their order is part of every seed: more come at the end.
REGIMES: Mapping[str, Regime] = {
    regime.name: regime for regime in (*TWELVE, *LAW_REGIMES, *WIND_REGIMES, *OUTSIDE_REGIMES, *STEADY_REGIMES)
}


def chosen(names: Sequence[str] | None) -> tuple[Regime, ...]:
    """Return the regimes called `names`, ``law-*`` being all that begin so; all that need no other package if None.

    Raises
    ------
    InputError
        A name that no regime has.
    """
    for name in names or ():
        if not any(fnmatchcase(known, name) for known in REGIMES):
            raise InputError("calibration", "regimes", f"'{name}'", f"some of: {', '.join(REGIMES)}")
    if names is None:
        return tuple(regime for regime in REGIMES.values() if not regime.wake)
    return tuple(regime for regime in REGIMES.values() if any(fnmatchcase(regime.name, name) for name in names))
