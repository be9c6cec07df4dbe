"""`scruton check`: what a campaign holds, and every warning."""

from argparse import Namespace

import numpy as np

from scruton.app.run import Outcome
from scruton.campaign import Campaign, Fluid, Quantity, Record, Rig, Test, load_campaign
from scruton.campaign.remarks import sentences
from scruton.envelope import RecordQuality, gather, review
from scruton.errors import InputError
from scruton.report.text import bullets, number, table
from scruton.terminal import BAD_INPUT


def run(arguments: Namespace) -> Outcome:
    """Read everything, say what was found; a record that cannot be read stops nothing, but is bad input.

    Raises
    ------
    InputError
        If campaign.toml itself cannot be used.
    """
    problems: list[InputError] = []
    campaign = load_campaign(arguments.campaign, problems)
    inspection = gather(campaign, problems)
    rows = [
        _row(record, rig.name if test is None else test.name, inspection.qualities[record.name])
        for record, rig, test in inspection.records()
    ]
    warnings = sentences(review(inspection))
    unit = campaign.section.amplitude_unit
    parts = [_heading(campaign), table(RIG_HEADER, [_rig_row(rig) for rig in campaign.rigs])]
    if campaign.tests:
        parts.append(
            table((*TEST_HEADER, f"stable [{unit}]", "records"), [_test_row(campaign, t) for t in campaign.tests])
        )
    if campaign.sweeps:
        sweeps = [
            [one.rig, str(one.wind_speed.size), f"{number(one.wind_speed.min())} .. {number(one.wind_speed.max())}",
             number(float(one.amplitude.max()))]
            for one in campaign.sweeps
        ]  # fmt: skip
        parts.append(table(["sweep of rig", "points", "wind speed [m/s]", f"largest [{unit}]"], sweeps))
    if rows:
        parts.append(table((*RECORD_HEADER[:7], f"amplitude [{unit}]", *RECORD_HEADER[7:]), rows))
    counted = "1 warning" if len(warnings) == 1 else f"{len(warnings)} warnings, worst first"
    parts.append(f"{counted}\n{bullets(warnings)}" if warnings else "No warnings.")
    if problems:
        parts.append(f"{len(problems)} records cannot be used\n" + bullets([str(one) for one in problems]))
    text = "\n\n".join(parts)
    return Outcome(lines=[text], code=BAD_INPUT) if problems else Outcome(text)


RIG_HEADER = ("rig", "f0 [Hz]", "mass per length", "xi_s [%]", "ring-downs")
TEST_HEADER = ("test", "rig", "U [m/s]", "U/(f0 D)", "Sc", "peak")
RECORD_HEADER = ("record", "of", "kind", "length [s]", "rate [Hz]", "cycles", "f [Hz]", "S/N", "second line")


def _heading(campaign: Campaign) -> str:
    section = campaign.section
    return (
        f"{campaign.title}\n{section.motion.value}, B = {number(section.width)} m, D = {number(section.depth)} m"
        f"{'' if section.fluid is Fluid.AIR else f', in {section.fluid.value}'}; "
        f"{len(campaign.rigs)} rigs, {len(campaign.tests)} tests"
    )


def _stated(quantity: Quantity | None, factor: float = 1.0) -> str:
    if quantity is None:
        return "-"
    text = number(quantity.mean * factor)
    return text if not quantity.sd else f"{text} +/- {number(quantity.sd * factor, 2)}"


def _rig_row(rig: Rig) -> list[str]:
    return [
        rig.name,
        _stated(rig.frequency),
        _stated(rig.mass),
        _stated(rig.damping_ratio, 100.0),
        str(len(rig.records)),
    ]


def _test_row(campaign: Campaign, test: Test) -> list[str]:
    from scruton.dynamics import Setting

    rig, section = campaign.rig(test.rig), campaign.section
    sc = float("nan")
    if rig.mass and rig.damping_ratio:
        sc = float(
            Setting(
                motion=section.motion, width=section.width, depth=section.depth, mass=rig.mass.mean,
                air_density=test.air_density.mean, wind_speed=test.wind_speed.mean, frequency=rig.frequency.mean,
                wind_frequency=rig.frequency.mean, damping_ratio=rig.damping_ratio.mean,
            ).scruton_number
        )  # fmt: skip
    reduced = test.wind_speed.mean / (rig.frequency.mean * section.depth)
    peak = {True: "yes", False: "no", None: "-"}[test.peak]
    return [
        test.name, test.rig, _stated(test.wind_speed), number(reduced), number(sc), peak,
        _stated(test.stable_amplitude), str(len(test.records)),
    ]  # fmt: skip


def _row(record: Record, owner: str, quality: RecordQuality) -> list[str]:
    low, high = quality.amplitude_range
    line = quality.second_line
    return [
        record.name, owner, record.kind.value, number(quality.duration), number(quality.sample_rate),
        str(quality.cycles), number(quality.frequency, 5), f"{number(low, 3)} .. {number(high, 3)}",
        "-" if not np.isfinite(quality.signal_to_noise) else number(quality.signal_to_noise, 3),
        "-" if line is None else f"{number(line.frequency)} Hz, {100 * line.relative:.0f} %",
    ]  # fmt: skip
