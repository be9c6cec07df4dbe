"""Names, numbers and units as a reader of the report, or of the terminal, meets them."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from scruton.report.thresholds import RISK_DRAWS, SMALLEST_WRITTEN

PARAMETERS = {
    "a_star": "stable amplitude a*",
    "relaxation_rate": "relaxation rate λ",
    "amplitude_scatter": "scatter of the amplitude from turbulence",
    "gust_scatter": "scatter of the stable amplitude from slow gusts",
    "gust_time": "correlation time of the gusts",
    "departure_scale": "departure of the drift from the law, one e-fold from the stable amplitude",
    "set_point_scatter": "scatter of the stable amplitude from record to record",
    "noise_factor": "factor on the standard errors of the cycles",
    "scruton_number": "Scruton number Sc",
    "relaxation_scruton_number": "Scruton number that one λ is worth",
    "mass_damping_factor": "Sc per unit of damping ratio",
    "Y1": "Y₁",
    "epsilon": "ε",
    "law_exponent": "exponent n of the law",
    "stable_amplitude": "stable amplitude a*",
    "relaxation_ratio": "relaxation ratio λ/ω₀",
    "still_air_scatter": "scatter of the amplitude in still air",
    "rate_gap": "b − d",
    "trial_residual": "standard deviation of the residual",
    "trial_residual_rate": "rate of the residual",
    "mass_factor": "factor of the mass",
    "reference_amplitude": "stable amplitude of the shared curve",
    "reference_relaxation_ratio": "relaxation ratio of the shared curve",
    "discrepancy_amplitude": "discrepancy of the amplitude τ",
    "discrepancy_relaxation": "discrepancy of the relaxation κ",
    "residual_sd": "standard deviation of the residual",
    "residual_rate": "rate of the residual",
    "residual": "standard deviation of the residual",
}

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

_UNITS = {"kg/m^3": "kg/m³", "kg m^2/m": "kg m²/m", "1/lambda": "1/λ", "-": "", "deg": "°", "1/deg": "1/°"}


def unit_text(unit: str) -> str:
    """A unit with its powers raised; empty where there is none."""
    return _UNITS.get(unit, unit)


def number(value: Any, digits: int = 4) -> str:
    """Write a number with so many significant digits, without exponents where a reader would stumble over them."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0 or (isinstance(value, int) and abs(value) < 10**7):
        return str(value).replace("-", "−") if value else "0"
    size = math.floor(math.log10(abs(value)))
    if size >= 7 or size < -5:
        mantissa = f"{value / 10.0**size:.{digits - 1}f}"
        return f"{mantissa} × 10{str(size).translate(_RAISED)}".replace("-", "−")
    return f"{value:.{max(0, digits - 1 - size)}f}".replace("-", "−")


def stated(value: float | None, _digits: int = 6) -> str:
    """Write a number as somebody stated it: up to six digits, none of them padding."""
    return "–" if value is None or math.isnan(value) else f"{value:.6g}".replace("-", "−")


def column(values: Sequence[float], digits: int = 4) -> list[str]:
    """Write the numbers of a column with one number of decimals, no more than the most precise of them needs."""
    sizes = [abs(value) for value in values if math.isfinite(value) and value != 0]
    if not sizes or min(sizes) < 1e-6 or max(sizes) >= 1e7:
        return [number(value, digits) for value in values]
    rounded = [float(f"{size:.{digits}g}") for size in sizes]
    decimals = max(len(f"{value:.10f}".rstrip("0").partition(".")[2]) for value in rounded)
    return [f"{value:.{decimals}f}".replace("-", "−") if math.isfinite(value) else number(value) for value in values]


def rounded(values: Sequence[float]) -> list[str] | None:
    """Write numbers with the digits that their spread is worth, all with as many decimals; None where there is none.

    The last digit is at most a thirtieth of the spread; what is no zero is not written as one.  More than four
    significant digits are beyond any laboratory, however narrow an interval; but both ends of it are told apart.  What
    is not finite is infinite.
    """
    finite = [value for value in values if math.isfinite(value)]
    spread, largest = (max(finite) - min(finite), max(map(abs, finite))) if finite else (0.0, 0.0)
    if spread <= 1e-9 * largest:
        return None
    if largest < 1e-4:
        return [number(value, 3) if math.isfinite(value) else "∞" for value in values]
    size = math.floor(math.log10(largest))
    apart = math.ceil(-math.log10(spread))
    decimals = max(0, min(math.ceil(-math.log10(spread / 30.0)), max(3 - size, apart)))
    return [_with_decimals(value, decimals) if math.isfinite(value) else "∞" for value in values]


def listed(values: Iterable[float], digits: int = 6) -> list[float | None]:
    """Numbers of a chart as its JSON has them; None for what is none."""
    return [float(f"{value:.{digits}g}") if math.isfinite(value) else None for value in values]


def _with_decimals(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    if not float(text) and abs(value) >= SMALLEST_WRITTEN:
        text = f"{value:.1g}"
    return text.replace("-", "−")


def estimate(entry: Mapping[str, Any], scale: float = 1.0, level: str = "0.90") -> tuple[str, str]:
    """Median and interval of a summary entry, with the digits that the interval's width is worth.

    A bound that is missing is infinite; a quantity without any spread is "as stated".
    """
    return PAGE.spread(entry, scale, level)


def money(value: float | None) -> str:
    """An amount to the two digits that a risk study knows it by; "no bound" where there is none."""
    if value is None or not math.isfinite(value):
        return "no bound"
    rounded = float(f"{value:.2g}")
    return f"{rounded / 1e6:.3g} million" if abs(rounded) >= 1e6 else f"{rounded:,.0f}"


def law_text(label: str) -> str:
    """The label of a law ("n=-1") as it is read."""
    return label.replace("n=", "n = ").replace("-", "−")


def limit_text(entry: Mapping[str, Any]) -> str:
    """A limit of sizing.json as a reader meets it."""
    from scruton.sizing.limits.rule import limit_words

    return limit_words(entry["rule"], entry["title"])


def with_error(value: float, error: float) -> str:
    """A number with its standard error: both to the error's first digit, which is where the number is known to."""
    decimals = _decimals_of(error)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "−")


def to_error(value: float, error: float) -> str:
    """A number to the first digit of its standard error, which stands elsewhere; at least one that is not nought.

    >>> to_error(0.00614, 0.001), to_error(0.00014, 0.001)
    ('0.006', '0.0001')
    """
    text = f"{value:.{_decimals_of(error)}f}"
    return text.replace("-", "−") if float(text) else number(value, 1)


def _decimals_of(error: float) -> int:
    return max(0, -math.floor(math.log10(float(f"{error:.1g}"))))


def percent(value: float, digits: int = 3) -> str:
    """Write a fraction in per cent."""
    return f"{number(100.0 * value, digits)} %"


def counted(probability: float) -> str:
    """Write a probability that was counted on draws, in per cent with the digits that its standard error leaves."""
    error = 100.0 * math.sqrt(max(probability * (1.0 - probability), 1.0 / RISK_DRAWS) / RISK_DRAWS)
    return f"{100.0 * probability:.{max(0, -math.floor(math.log10(error)))}f} %"


def how_many(things: int, word: str) -> str:
    """So many of what a word names: "1 rig", "3 rigs"."""
    return f"{things} {word}{'' if things == 1 else 's'}"


def share(value: float) -> str:
    """Write a fraction in whole per cent."""
    return f"{100.0 * value:.0f} %".replace("-", "−")


def plain_number(value: float | None, digits: int = 4) -> str:
    """Write a number for the terminal: significant digits, a dash for one that is missing."""
    if value is None or not math.isfinite(value):
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e6 else text


class Notation(NamedTuple):
    """How the same table is written for one sort of reader."""

    number: Callable[..., str]  # with so many significant digits
    missing: str
    between: str  # the bounds of a range
    unit: Callable[[str], str]
    plain: bool = False  # ASCII alone

    def range(self, bounds: Sequence[float | None] | None, digits: int = 4) -> str:
        """Both bounds of a range."""
        return self.missing if bounds is None else self.between.join(self.number(bound, digits) for bound in bounds)

    def spread(self, entry: Mapping[str, Any], factor: float = 1.0, level: str = "0.90") -> tuple[str, str]:
        """Median and interval of a summary entry, with the digits that the interval's width is worth.

        A bound that is missing is infinite; a quantity without any spread is "as stated".
        """
        return self.interval(entry["median"], *entry["interval"][level], factor=factor)

    def interval(
        self, median: float | None, low: float | None, high: float | None, *, factor: float = 1.0
    ) -> tuple[str, str]:
        """The same of the three numbers."""
        values = [math.nan if value is None else value * factor for value in (median, low, high)]
        texts = rounded(values)
        if texts is None and math.isnan(values[0]):
            return self.missing, self.missing
        if texts is None:
            return self.number(values[0]), "as stated"
        if self.plain:
            texts = [text.replace("−", "-").replace("∞", self.missing) for text in texts]
        return texts[0], self.between.join(texts[1:])


PAGE = Notation(number, "–", " to ", unit_text)
TERMINAL = Notation(plain_number, "-", " .. ", str, plain=True)
