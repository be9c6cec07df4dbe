"""What a campaign states, held against what can be: slips of the pen that no signal has to be processed to see."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import combinations

import numpy as np

from scruton.campaign.bounded import relative_to
from scruton.campaign.quantity import Quantity
from scruton.campaign.remarks import Remark, Severity
from scruton.campaign.schema import Campaign, Fluid, Motion, Record, Rig, Test
from scruton.campaign.spelling import figure
from scruton.campaign.thresholds import FAR, LARGEST_SD, OVERLAP
from scruton.said import Said, Value, damping, said


@dataclass(frozen=True)
class Range:
    """Numbers that somebody may have measured, both bounds included; `why` says what lies outside.

    `write` is how such a number is written, where it has no unit of its own.
    """

    low: float
    high: float
    unit: str
    why: str
    write: Callable[[float], Value] | None = None

    @property
    def bounds(self) -> Said:
        """From where to where, in words."""
        if self.write is not None:
            return said(self.write(self.low), " to ", self.write(self.high))
        return said(f"{self.low:g} to {self.high:g}{self.in_unit}")

    @property
    def in_unit(self) -> str:
        """The unit as it stands behind a number."""
        return f" {self.unit}" if self.unit else ""


# What was ever tested, with room to spare.  The paper's sections have B/D of 4 to 12, U/(f0 D) of 8 to 13 and 100 to
# 300 times the density of air; flat plates, cables and cylinders in water lie farther out.
SLENDERNESS = Range(0.2, 50.0, "", "no deck or cylinder is so; a width in another unit than the depth is")
DEPTH = Range(0.001, 10.0, "m", "no section model is so deep; one in another unit is")
DENSITY = {
    Fluid.AIR: Range(0.8, 1.5, "kg/m^3", 'that is not air near the ground; of water, [section] says fluid = "water"'),
    Fluid.WATER: Range(950.0, 1050.0, "kg/m^3", "that is not water, fresh or salt"),
}
REDUCED_VELOCITY = Range(1.0, 60.0, "", "vortices shed at 1/St, 4 to 20 for every section known, and lock in around it")
# Mass over that of the fluid which the section displaces: foam to lead, and the frame and arms that move along.
HEAVINESS = {
    Fluid.AIR: Range(5.0, 3e4, "", "lighter than foam or heavier than lead with its frame"),
    Fluid.WATER: Range(0.1, 100.0, "", "lighter than any float or heavier than lead with its frame"),
}
DAMPING = Range(
    1e-4, 0.1, "", "no structure has so little or so much; a percentage is a hundred times its ratio", write=damping
)
AMPLITUDE = {
    Motion.HEAVING: Range(0.0, 0.5, "A/D", "vortices drive no deck so far; a length in another unit looks so"),
    Motion.TORSIONAL: Range(0.0, 0.35, "rad", "vortices turn no deck so far (20 deg); degrees read as radians look so"),
}


def implausible(campaign: Campaign) -> list[Remark]:
    """Remark on everything that `campaign.toml` and its tables state and that can hardly be.

    The remarks are in no order; `scruton.campaign.remarks.sentences` ranks and folds.
    """
    return [*campaign.remarks, *(remark for check in CHECKS for remark in check(campaign))]


def damping_flag(damping_ratio: float) -> str:
    """Say of a design damping ratio that no structure has it; empty of one that some structure may have."""
    if damping_ratio <= DAMPING.high:
        return ""
    return _outside(damping_ratio, DAMPING, "the design damping")


def outside(value: float, wanted: Range, kind: str, of: str, name: str, what: str) -> Iterator[Remark]:
    """Remark where `value`, which is `what`, lies outside the range wanted (nothing where it is NaN)."""
    if wanted.low <= value <= wanted.high or math.isnan(value):
        return
    excess = wanted.low / max(value, 1e-300) if value < wanted.low else value / wanted.high
    number = "{}" if wanted.write is None else replace(wanted.write(value), text="{}", value=None)
    alike = said(f"{what} is ", number, f"{wanted.in_unit}, outside ", wanted.bounds, f" ({wanted.why}),")
    yield Remark(
        Severity.SERIOUS if excess >= FAR else Severity.DOUBT, kind, of, name,
        said(_outside(value, wanted, what), "."), alike, value, excess,
    )  # fmt: skip


def _outside(value: float, wanted: Range, what: str) -> Said:
    number = f"{figure(value) if value >= 100.0 else f'{value:.3g}'}{wanted.in_unit}"
    written = number if wanted.write is None else wanted.write(value)
    return said(f"{what} is ", written, ", outside ", wanted.bounds, f" ({wanted.why})")


def _out_of_range(campaign: Campaign) -> Iterator[Remark]:
    section = campaign.section
    density, amplitude = DENSITY[section.fluid], AMPLITUDE[section.motion]
    yield from outside(section.width / section.depth, SLENDERNESS, "slenderness", "", "section", "B/D")
    yield from outside(section.depth, DEPTH, "depth", "", "section", "the depth D")
    for test in campaign.tests:
        about = ("test", test.name)
        reduced = campaign.reduced_velocity(test)
        yield from outside(test.air_density.mean, density, "density", *about, "the air density")
        yield from outside(reduced, REDUCED_VELOCITY, "reduced velocity", *about, "U/(f0 D)")
        if test.stable_amplitude is not None:
            stable = test.stable_amplitude.mean
            yield from outside(stable, amplitude, "amplitude", *about, "the stable amplitude stated")
    for sweep in campaign.sweeps:
        about = ("sweep of rig", sweep.rig)
        # a sweep may begin in still air; its fastest point must be a wind
        fastest = float(np.max(sweep.wind_speed)) / (campaign.rig(sweep.rig).frequency.mean * section.depth)
        yield from outside(sweep.air_density.mean, density, "density", *about, "the air density")
        yield from outside(fastest, REDUCED_VELOCITY, "reduced velocity", *about, "the largest U/(f0 D)")
        yield from outside(float(np.max(sweep.amplitude)), amplitude, "amplitude", *about, "the largest amplitude")
    for rig in campaign.rigs:
        air = next((test.air_density.mean for test in campaign.tests if test.rig == rig.name), math.nan)
        # a density that is no fluid's is remarked on by itself, and says nothing of the mass
        if rig.mass is not None and density.low <= air <= density.high:
            what = "mass" if section.motion is Motion.HEAVING else "inertia"
            what = f"the {what} over that of the fluid displaced"
            yield from outside(heaviness(campaign, rig, air), HEAVINESS[section.fluid], "mass", "rig", rig.name, what)
        if rig.damping_ratio is not None:
            ratio = rig.damping_ratio.mean
            yield from outside(ratio, DAMPING, "damping stated", "rig", rig.name, "the damping stated")


def heaviness(campaign: Campaign, rig: Rig, density: float) -> float:
    """Mass (or inertia) of a rig over that of the fluid, of this density [kg/m^3], which a B by D section displaces."""
    section = campaign.section
    displaced = density * section.width * section.depth
    if section.motion is Motion.TORSIONAL:
        displaced *= (section.width**2 + section.depth**2) / 12.0
    return math.nan if rig.mass is None else rig.mass.mean / displaced


def _uncertainty(campaign: Campaign) -> Iterator[Remark]:
    of_rigs, of_tests = ("mass", "frequency", "damping_ratio"), ("air_density", "wind_speed", "stable_amplitude")
    stated: list[tuple[str, Rig | Test, str]] = [("rig", rig, what) for rig in campaign.rigs for what in of_rigs]
    stated += [("test", test, what) for test in campaign.tests for what in of_tests]
    for of, owner, what in stated:
        quantity: Quantity | None = getattr(owner, what)
        if quantity is not None and quantity.relative_sd > LARGEST_SD:
            share, most = 100.0 * quantity.relative_sd, f"{100.0 * LARGEST_SD:.0f} %"
            sd_of = f"the standard deviation of the {what.replace('_', ' ')} is"
            yield Remark(
                Severity.DOUBT, "uncertainty", of, owner.name,
                f"{sd_of} {share:.3g} % of its mean, above {most}; an interval or a percentage is none.",
                f"{sd_of} {{}} % of its mean, above {most},",
                share, share / (100.0 * LARGEST_SD),
            )  # fmt: skip


def _sweeps(campaign: Campaign) -> Iterator[Remark]:
    for sweep in campaign.sweeps:
        text = "the sweep has one point, which tells no range of lock-in" if sweep.amplitude.size < 2 else ""
        text = text if np.any(sweep.amplitude > 0.0) else "every amplitude of the sweep is zero"
        if text:
            yield Remark(Severity.DOUBT, "sweep", "sweep of rig", sweep.rig, f"{text}.", text)


def _duplicates(campaign: Campaign) -> Iterator[Remark]:
    """Remark on records that share samples: the same file under two names, overlapping windows, or copied numbers."""
    owned = [(f"test {test.name}" if test else f"rig {rig.name}", record) for record, rig, test in campaign.records()]
    sha256_of = campaign.sha256 or {}
    digests = {}
    for _, record in owned:  # of the file, by its path where they are not known, and of the samples
        digest = sha256_of.get(relative_to(record.path, campaign.path.parent), str(record.path))
        digests[id(record)] = digest, sha256(record.response.tobytes()).hexdigest()
    for (owner, first), (other_owner, second) in combinations(owned, 2):
        shared = _shared(first, second, digests[id(first)], digests[id(second)])
        if shared:
            where = f"both in {owner}" if owner == other_owner else f"in {owner} and in {other_owner}"
            yield Remark(
                Severity.SERIOUS, "duplicate", "record", f"{first.name} and {second.name}",
                f"{shared}, {where}; what is measured once counts twice.", "samples that another record holds",
            )  # fmt: skip


def _shared(first: Record, second: Record, digests: tuple[str, str], others: tuple[str, str]) -> str:
    """What two records share, in words; empty where they share nothing."""
    if digests[0] == others[0] and first.path != second.path:
        return "the same bytes"
    if digests[1] == others[1]:
        return "the same samples"
    if first.path != second.path:
        return ""
    begin, end = max(first.time[0], second.time[0]), min(first.time[-1], second.time[-1])
    former, latter = (
        record.response[np.searchsorted(record.time, begin, "left") : np.searchsorted(record.time, end, "right")]
        for record in (first, second)
    )
    if len(former) < OVERLAP or not np.array_equal(former, latter):  # other columns of one file share its times alone
        return ""
    return f"{len(former)} samples of one file ({begin:.4g} s to {end:.4g} s)"


CHECKS: tuple[Callable[[Campaign], Iterator[Remark]], ...] = (_out_of_range, _uncertainty, _sweeps, _duplicates)
