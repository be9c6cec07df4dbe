"""`scruton check`: what a campaign holds, and every warning."""

from argparse import Namespace
from collections.abc import Sequence
from statistics import fmean

from scruton.app.run import Outcome
from scruton.campaign import Campaign, Fluid, Quantity, Record, Test, load_campaign, tests_used
from scruton.campaign.remarks import sentences
from scruton.dynamics import Setting
from scruton.dynamics.identify import Identified, identify
from scruton.envelope import RecordQuality, gather, review, usable
from scruton.envelope.inspection import SET_ASIDE
from scruton.errors import InputError
from scruton.report.document import ALARM, CAUTION, Callout, Table, paragraph
from scruton.report.render_text import render_text
from scruton.report.wording import TERMINAL
from scruton.report.wording import plain_number as number
from scruton.terminal import BAD_INPUT, DONE, line_width


def run(arguments: Namespace) -> Outcome:
    """Read everything, say what was found; a record that cannot be read stops nothing, but is bad input.

    One that shows no motion to measure is set aside with a warning, and bad input where the user is strict.

    InputError if campaign.toml itself cannot be used.
    """
    problems: list[InputError] = []
    campaign = load_campaign(arguments.campaign, problems)
    if arguments.tests is not None:
        campaign = tests_used(campaign, arguments.tests)
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
    quick: dict[str, list[Identified]] = {}
    for found in identify(inspection):
        if isinstance(found, Identified):
            quick.setdefault(found.test, []).append(found)
    tests = tuple(_test_row(campaign, test, quick.get(test.name, [])) for test in campaign.tests)
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
    tables = {
        "rigs": (RIG_HEADER, rigs),
        "tests": ((*TEST_HEADER, f"stable [{unit}]", "lambda [1/s]", "records"), tests),
        "sweeps": (("sweep of rig", "points", "wind speed [m/s]", f"largest [{unit}]"), sweeps),
        "records": ((*RECORD_HEADER[:7], f"amplitude [{unit}]", *RECORD_HEADER[7:]), rows),
    }
    text = render_text(
        [
            paragraph(heading),
            *(Table(name, "", *table, _note(tests) if name == "tests" else "") for name, table in tables.items()),
            *([Callout(ALARM, *unread)] if problems else []),
            *([Callout(CAUTION, counted, tuple(warnings))] if warnings else []),
            *([] if warnings or problems else [paragraph("No warnings.")]),
        ],
        line_width(),
    )
    content = {
        "title": campaign.title,
        **{name: [dict(zip(header, row, strict=True)) for row in table] for name, (header, table) in tables.items()},
        "warnings": warnings,
        "unusable": list(unread[1]),
    }
    remarks = unread[1] if arguments.quiet or arguments.json else ()
    return Outcome(text, remarks=remarks, code=BAD_INPUT if problems else DONE, content=content)


RIG_HEADER = ("rig", "f0 [Hz]", "mass per length", "xi_s [%]", "ring-downs")
TEST_HEADER = ("test", "rig", "U [m/s]", "U/(f0 D)", "Sc", "peak")
RECORD_HEADER = ("record", "of", "kind", "length [s]", "rate [Hz]", "cycles", "f [Hz]", "S/N", "second line")


def _note(tests: Sequence[tuple[str, ...]]) -> str:
    """What is no word of the laboratory's."""
    by_hand = "lambda, and what has a *, are by Eqs. (2) to (8) of each record; `scruton identify` has all of it"
    return by_hand if any(row[-2] != "-" for row in tests) else ""


def _stated(quantity: Quantity | None, factor: float = 1.0) -> str:
    if quantity is None:
        return "-"
    text = number(quantity.mean * factor)
    return text if not quantity.sd else f"{text} +/- {number(quantity.sd * factor, 2)}"


def _test_row(campaign: Campaign, test: Test, quick: "Sequence[Identified]") -> tuple[str, ...]:
    """What is stated of a test; what is not, its Scruton number and stable amplitude, by the paper's own procedure."""
    rig, section = campaign.rig(test.rig), campaign.section
    sc, stable = float("nan"), _stated(test.stable_amplitude)
    if quick:
        sc = quick[0].scruton_number
        if test.stable_amplitude is None:
            stable = f"{number(fmean(row.stable_amplitude for row in quick))} *"
    elif rig.mass and rig.damping_ratio:
        sc = float(
            Setting(
                motion=section.motion, width=section.width, depth=section.depth, mass=rig.mass.mean,
                air_density=test.air_density.mean, wind_speed=test.wind_speed.mean, frequency=rig.frequency.mean,
                wind_frequency=rig.frequency.mean, damping_ratio=rig.damping_ratio.mean,
            ).scruton_number
        )  # fmt: skip
    rates = [row.relaxation_rate for row in quick]
    reduced = test.wind_speed.mean / (rig.frequency.mean * section.depth)
    peak = {True: "yes", False: "no", None: "-"}[test.peak]
    return (
        test.name, test.rig, _stated(test.wind_speed), number(reduced), number(sc), peak,
        stable, TERMINAL.range([min(rates), max(rates)], 3) if rates else "-", str(len(test.records)),
    )  # fmt: skip


def _row(record: Record, owner: str, quality: RecordQuality) -> tuple[str, ...]:
    line = quality.second_line
    return (
        record.name, owner, record.kind.value, number(quality.duration), number(quality.sample_rate),
        str(quality.cycles), number(quality.frequency, 5), TERMINAL.range(quality.amplitude_range, 3),
        number(quality.signal_to_noise, 3),
        "-" if line is None else f"{number(line.frequency)} Hz, {100 * line.relative:.0f} %",
    )  # fmt: skip
