"""The paper's own quick estimation, without any sampling: one row of its Table 5 from every transient record."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Kind, Record, Rig, Test
from scruton.dynamics.force_model import Y1_epsilon_from_griffin, Y1_from_amplitude, epsilon_from_amplitude
from scruton.dynamics.setting import Setting
from scruton.envelope import FrontEnd, Inspection, front_end
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown

_LOW, _HIGH, _POINTS = 1.0 / 3.0, 2.0, 60  # of the stable amplitude: where the line of 1/A is fitted, and points


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class Identified:
    """What one transient record says by Eqs. (2) to (8) and (17) to (19).

    Attributes
    ----------
    test, record, rig : str
    reduced_velocity, reduced_frequency : float
        U/(f0 D), and K = omega D/U in the wind.
    damping_ratio : float
        Structural damping ratio: of the rig's ring-downs where it has some, else as stated.
    mass_ratio : float
        rho D^2/m, or rho D^4/J.
    scruton_number : float
    stable_amplitude : float
        A/D or rad: as measured, else where the record's own Griffin curve meets the Scruton number.
    measured : bool
        Whether it was.
    slope : float
        d(D/A)/dSc of that curve, or d(1/A)/dSc [1/rad].
    relaxation_rate : float
        lambda [1/s] that the slope means.
    Y1, epsilon : float
    front : FrontEnd
    """

    test: str
    record: str
    rig: str
    reduced_velocity: float
    reduced_frequency: float
    damping_ratio: float
    mass_ratio: float
    scruton_number: float
    stable_amplitude: float
    measured: bool
    slope: float
    relaxation_rate: float
    Y1: float
    epsilon: float
    front: FrontEnd


def identify(inspection: Inspection, trial: str = "second-order exponential") -> Iterator[Identified | InputError]:
    """Go through the transient records that can be used; one that gives no curve gives the reason instead.

    Parameters
    ----------
    inspection : Inspection
        Of a campaign, with its ring-downs.
    trial : str
        Trial function by name and order, as of `scruton.envelope.trial.trial_function`.
    """
    campaign = inspection.campaign
    for record, rig, test in inspection.records():
        if test is None or record.kind is Kind.STEADY:
            continue
        try:
            yield _row(inspection, campaign, record, rig, test, trial)
        except InputError as error:
            yield error
        except ValueError as error:  # of the trial function
            yield InputError(record.path, record.field, str(error), "a transient that a trial function can follow")


def _row(inspection: Inspection, campaign: Campaign, record: Record, rig: Rig, test: Test, trial: str) -> Identified:
    ringdown, section = inspection.ringdowns.get(rig.name), campaign.section
    if ringdown is not None:
        damping = ringdown.damping_ratio
    elif rig.damping_ratio is not None:
        damping = rig.damping_ratio.mean
    else:
        raise InputError(record.path, f"rig {rig.name}", "no structural damping", "a ring-down, or a damping_ratio")
    assert rig.mass is not None
    frequency = inspection.cycles[record.name].reference_frequency
    setting = Setting(
        section.motion, section.width, section.depth, rig.mass.mean, test.air_density.mean, test.wind_speed.mean,
        rig.frequency.mean, frequency, damping,
    )  # fmt: skip
    sc = float(setting.scruton_number)
    front = front_end(
        record, frequency=frequency, still_air_frequency=rig.frequency.mean, damping_ratio=damping,
        mass_damping_factor=sc / damping, trial=trial,
    )  # fmt: skip
    curve_sc, amplitude = front.griffin.scruton_number, front.griffin.amplitude
    order = np.argsort(amplitude)
    amplitude, curve_sc = amplitude[order], curve_sc[order]
    usable = np.isfinite(curve_sc) & (amplitude > 0.0)
    stated = test.stable_amplitude
    stable = stated.mean if stated is not None else _meets(amplitude[usable], curve_sc[usable], sc)
    if stable is None:
        raise InputError(record.path, record.field, "a curve that does not meet the test's Scruton number",
                         "a transient that comes to rest, or the test's stable_amplitude")  # fmt: skip
    slope = _slope(amplitude[usable], curve_sc[usable], stable)
    if slope is None or not slope > 0.0:
        raise InputError(record.path, record.field, "a curve of 1/A that does not rise with Sc", "a growth or a decay")
    product = Y1_epsilon_from_griffin(slope, setting)
    rate = float(setting.omega0) * damping / sc / (slope * stable)
    return Identified(
        test.name, record.name, rig.name, campaign.reduced_velocity(test),
        float(setting.K), damping, float(setting.mass_ratio), sc, stable, stated is not None, slope, rate,
        float(Y1_from_amplitude(product, stable, setting)), float(epsilon_from_amplitude(product, stable, setting)),
        front,
    )  # fmt: skip


def _meets(amplitude: FloatArray, scruton_number: FloatArray, wanted: float) -> float | None:
    """Amplitude, rising, at which a curve takes a value; the largest where there are several."""
    above = scruton_number - wanted
    crossing = np.flatnonzero(above[:-1] * above[1:] <= 0.0)
    if not crossing.size:
        # A transient comes to rest at its stable amplitude and need not cross it.
        nearest = int(np.argmin(np.abs(above)))
        spread = float(np.ptp(scruton_number))
        return float(amplitude[nearest]) if abs(above[nearest]) < 0.05 * spread else None
    i = int(crossing[-1])
    part = above[i] / (above[i] - above[i + 1]) if above[i] != above[i + 1] else 0.0
    return float(amplitude[i] + part * (amplitude[i + 1] - amplitude[i]))


def _slope(amplitude: FloatArray, scruton_number: FloatArray, stable: float) -> float | None:
    """d(1/A)/dSc by least squares, evenly over 1/A near the stable amplitude, as far as the record reaches."""
    low, high = max(_LOW * stable, float(amplitude[0])), min(_HIGH * stable, float(amplitude[-1]))
    if not low < high:
        return None
    inverse = np.linspace(1.0 / high, 1.0 / low, _POINTS)
    at = np.interp(1.0 / inverse, amplitude, scruton_number)
    return float(np.polyfit(at, inverse, 1)[0]) if np.ptp(at) > 0.0 else None
