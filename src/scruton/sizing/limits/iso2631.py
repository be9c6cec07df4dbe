"""ISO 2631-1, whole-body vibration: weighted r.m.s. acceleration (0.5 to 80 Hz) and motion sickness (0.1 to 0.5 Hz).

Vertical vibration is weighted by W_k, motion sickness by W_f: one cascade of second-order filters with the parameters
of Table 3 of ISO 8041-1:2017.
"""

from math import inf, sqrt

from scruton.campaign.units import Dimension
from scruton.sizing.limits.rule import ACCELERATION, RMS, Rule, displacement, holds_between, of_edge

NOT_UNCOMFORTABLE = 0.315  # m/s^2, weighted r.m.s.: annex C
EXPOSURE = 1200.0  # s, the shortest that the relation of motion sickness is for: walking over a long bridge and back
VOMITING = 1.0 / 3.0  # K_m: per cent of unadapted adults who may vomit, for each m/s^1.5 of the dose

# f1, f2 of the band; f3, f4, Q4 of the transition; f5, Q5, f6, Q6 of the step
W_K = (0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91)
W_F = (0.08, 0.63, inf, 0.25, 0.86, 0.0625, 0.80, 0.10, 0.80)
_BAND = sqrt(0.5)  # Q of the band's filters, Butterworth's


def weighting(frequency: float, parameters: tuple[float, ...]) -> float:
    """Weighting factor |H| at a frequency [Hz]: ISO 8041-1, formulas (1) to (5).

    Parameters
    ----------
    parameters : tuple of float
        `W_K` or `W_F`.
    """
    f1, f2, f3, f4, q4, f5, q5, f6, q6 = parameters

    def second_order(corner: float, quality: float) -> complex:
        s = 1j * frequency / corner
        return 1.0 + s / quality + s**2

    high = (1j * frequency / f1) ** 2 / second_order(f1, _BAND)
    transition = (1.0 + 1j * frequency / f3) / second_order(f4, q4)
    step = second_order(f5, q5) / second_order(f6, q6) * (f5 / f6) ** 2
    return abs(high / second_order(f2, _BAND) * transition * step)


def motion_sickness(frequency: float, amplitude: float, exposure: float = EXPOSURE) -> float:
    """Share of unadapted adults who may vomit, K_m MSDV_z: the dose is the weighted r.m.s. times sqrt(exposure).

    Parameters
    ----------
    amplitude : float
        Of the vertical displacement [m].
    exposure : float
        [s].
    """
    dose = weighting(frequency, W_F) * RMS * amplitude / displacement(frequency, 1.0) * sqrt(exposure)
    return 0.01 * VOMITING * dose


def _weighted(frequency: float, rms: float) -> float:
    return displacement(frequency, rms / RMS) / weighting(frequency, W_K)


_COMFORT = holds_between(0.5, 80.0, 'below, the standard has motion sickness ("motion-sickness")')
_COMFORTABLE = "below 0.315 m/s^2 not uncomfortable"

RULES = (
    Rule(
        "iso2631",
        "ISO 2631-1: weighted r.m.s. acceleration, 0.315 m/s^2 not uncomfortable (torsion: at the edge)",
        f"ISO 2631-1:1997, clause 6 and annex C ({_COMFORTABLE}), 0.5 to 80 Hz; W_k after ISO 8041-1:2017, Table 3",
        "The weighting was read in a public implementation of ISO 8041-1 that meets its annex B; the annex C of "
        "ISO 2631-1 gives what passengers of public transport say, and no limit for bridges.",
        NOT_UNCOMFORTABLE,
        ACCELERATION,
        of_edge(_weighted),
        _COMFORT,
    ),
    Rule(
        "rms-acceleration",
        "Root mean square of the acceleration, unweighted, as in ISO 2631-1 (torsion: at the edge)",
        f"ISO 2631-1:1997, annex C: {_COMFORTABLE} (weighted), 0.5 to 80 Hz",
        "Here unweighted; \"iso2631\" is the standard's own, weighted. For a limit of the project at any frequency "
        "state peak-acceleration, sqrt(2) times the r.m.s.",
        NOT_UNCOMFORTABLE,
        ACCELERATION,
        of_edge(lambda f, rms: displacement(f, rms / RMS)),
        _COMFORT,
    ),
    Rule(
        "motion-sickness",
        "ISO 2631-1: share of people who may vomit within 20 minutes, K_m MSDV_z (torsion: at the edge)",
        "ISO 2631-1:1997, clause 9 and annex D: K_m = 1/3 % per m/s^1.5, W_f (ISO 8041-1:2017, Table 3), 0.1 to 0.5 Hz",
        "The standard names no limit: the share is the project's. K_m and the exposure (20 minutes to 6 hours, with "
        "its square root) are those of common use, to be confirmed in annex D.",
        None,
        Dimension("a share of people, a bare number", "", 0.05),
        of_edge(lambda f, share: share / motion_sickness(f, 1.0)),
        holds_between(0.1, 0.5),
        reading=lambda share: f"{100.0 * share:.2g} % of unadapted adults may vomit within 20 minutes",
        largest=1.0,
    ),
)  # fmt: skip
