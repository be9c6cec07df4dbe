"""`scruton check`: what a campaign holds, and every warning."""

from argparse import Namespace

from scruton.app.run import Outcome
from scruton.campaign import Campaign, Fluid, Quantity, Record, Test, load_campaign
from scruton.campaign.remarks import sentences
from scruton.envelope import RecordQuality, gather, review, usable
from scruton.envelope.inspection import SET_ASIDE
from scruton.errors import InputError
from scruton.report.document import ALARM, CAUTION, Callout, Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL
from scruton.report.wording import plain_number as number
from scruton.terminal import BAD_INPUT


def run(arguments: Namespace) -> Outcome:
    """Read everything, say what was found; a record that cannot be read stops nothing, but is bad input.

    One that shows no motion to measure is set aside with a warning, and bad input where the user is strict.

    InputError if campaign.toml itself cannot be used.
    """
    problems: list[InputError] = []
    campaign = load_campaign(arguments.campaign, problems)
    section, unit = campaign.section, campaign.section.amplitude_unit
    inspection = gather(campaign, problems)
    if arguments.strict and any(remark.kind == SET_ASIDE for remark in inspection.campaign.remarks):
        usable(campaign, strict=True)
    warnings = sentences(review(inspection))
    heading = (
        f"{campaign.title}\n{section.motion.value}, B = {number(section.width)} m, D = {number(section.depth)} m"
        f"{'' if section.fluid is Fluid.AIR else f', in {section.fluid.value}'}; "
        f"{len(campaign.rigs)} rigs, {len(campaign.tests)} tests"
    )
    rigs = tuple(
        (rig.name, _stated(rig.frequency), _stated(rig.mass), _stated(rig.damping_ratio, 100.0), str(len(rig.records)))
        for rig in campaign.rigs
    )
    tests = tuple(_test_row(campaign, test) for test in campaign.tests)
    rows = tuple(
        _row(record, rig.name if test is None else test.name, inspection.qualities[record.name])
        for record, rig, test in inspection.records()
    )
    sweeps = tuple(
        (sweep.rig, str(sweep.wind_speed.size), TERMINAL.range((sweep.wind_speed.min(), sweep.wind_speed.max())),
         TERMINAL.number(sweep.amplitude.max()))
        for sweep in campaign.sweeps
    )  # fmt: skip
    counted = "1 warning" if len(warnings) == 1 else f"{len(warnings)} warnings, worst first"
    unread = (f"{len(problems)} record{'s' * (len(problems) > 1)} cannot be used", tuple(map(str, problems)))
    text = render_text(
        [
            paragraph(heading),
            Table("rigs", "", RIG_HEADER, rigs),
            Table("tests", "", (*TEST_HEADER, f"stable [{unit}]", "records"), tests),
            Table("sweeps", "", ("sweep of rig", "points", "wind speed [m/s]", f"largest [{unit}]"), sweeps),
            Table("records", "", (*RECORD_HEADER[:7], f"amplitude [{unit}]", *RECORD_HEADER[7:]), rows),
            *([Callout(CAUTION, counted, tuple(warnings))] if warnings else []),
            *([] if warnings or problems else [paragraph("No warnings.")]),
            *([Callout(ALARM, *unread)] if problems else []),
        ]
    )  # fmt: skip
    return Outcome(lines=[text], code=BAD_INPUT) if problems else Outcome(text)


RIG_HEADER = ("rig", "f0 [Hz]", "mass per length", "xi_s [%]", "ring-downs")
TEST_HEADER = ("test", "rig", "U [m/s]", "U/(f0 D)", "Sc", "peak")
RECORD_HEADER = ("record", "of", "kind", "length [s]", "rate [Hz]", "cycles", "f [Hz]", "S/N", "second line")


def _stated(quantity: Quantity | None, factor: float = 1.0) -> str:
    if quantity is None:
        return "-"
    text = number(quantity.mean * factor)
    return text if not quantity.sd else f"{text} +/- {number(quantity.sd * factor, 2)}"


def _test_row(campaign: Campaign, test: Test) -> tuple[str, ...]:
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
    return (
        test.name, test.rig, _stated(test.wind_speed), number(reduced), number(sc), peak,
        _stated(test.stable_amplitude), str(len(test.records)),
    )  # fmt: skip


def _row(record: Record, owner: str, quality: RecordQuality) -> tuple[str, ...]:
    line = quality.second_line
    return (
        record.name, owner, record.kind.value, number(quality.duration), number(quality.sample_rate),
        str(quality.cycles), number(quality.frequency, 5), TERMINAL.range(quality.amplitude_range, 3),
        number(quality.signal_to_noise, 3),
        "-" if line is None else f"{number(line.frequency)} Hz, {100 * line.relative:.0f} %",
    )  # fmt: skip
