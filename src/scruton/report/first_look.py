"""The first look at a campaign, before any sampling: tables for the terminal, and a page with the records, too."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from statistics import fmean

from scruton.campaign import Fluid, Quantity, Record, Rig, Test
from scruton.campaign.schema import Motion
from scruton.dynamics import Setting
from scruton.dynamics.first_look import Check
from scruton.dynamics.identify import Identified
from scruton.envelope import RecordQuality
from scruton.report.conventions import (
    DAMPING,
    SCRUTON,
    conventions,
    damping_symbol,
    decrements,
    scruton_note,
    shown_in,
)
from scruton.report.document import ALARM, CAUTION, Block, Callout, Chapter, Document, Table, numbered, paragraph
from scruton.report.first_look_charts import griffin_pictures, record_pictures, ring_down_pictures
from scruton.report.wording import PAGE, TERMINAL, Notation, how_many, percent, unit_text, with_error
from scruton.report.wording import plain_number as number

TEST_HEADER = ("test", "rig", "U [m/s]", "U/(f0 D)", "Sc", "peak")
BY_HAND = ("lambda [1/s]", "Y1", "epsilon")  # of the quick estimation, the range over the records of a test
_ON_A_PAGE = ("test", "rig", "U [m/s]", "U/(f₀ D)", "Sc", "peak", "λ [1/s]", "Y₁", "ε")  # the same in type
_AGREE = 1.05  # ratio of the stable amplitudes of one test's records, below which their mean stands for them
RECORD_HEADER = ("record", "of", "kind", "length [s]", "rate [Hz]", "cycles", "f [Hz]", "S/N", "second line")
_CAPTIONS = {
    "rigs": "Rigs, as stated, and damping by their ring-downs", "tests": "Tests in wind",
    "sweeps": "Sweeps of the wind speed", "records": "Records",
}  # fmt: skip


def overview(found: Check, *, in_files: bool = False) -> list[Block]:
    """What was read, and every warning, for a terminal; `in_files` with numbers as files hold them, for scripts."""
    campaign, section = found.campaign, found.campaign.section
    heading = (
        f"{campaign.title}\n{section.motion.value}, B = {number(section.width)} m, D = {number(section.depth)} m"
        f"{'' if section.fluid is Fluid.AIR else f', in {section.fluid.value}'}; "
        f"{how_many(len(campaign.rigs), 'rig')}, {how_many(len(campaign.tests), 'test')}"
    )
    shown = {} if in_files else {"conventions": campaign.conventions}
    with conventions(shown):
        tables = _tables(found, TERMINAL, 1.0 if in_files else None)
    return [paragraph(heading), *tables, *_warnings(found)]


def first_look(found: Check) -> Document:
    """The page: what to worry about, the quick estimation, every record with its window, ring-downs, and the tables."""
    with conventions(found.campaign):
        return _page(found)


def _page(found: Check) -> Document:
    campaign = found.campaign
    tables = [replace(table, caption=_CAPTIONS[table.name]) for table in _tables(found, PAGE, None)]
    return numbered(
        Document(
            title=campaign.title or "Untitled campaign",
            about="A first look, before any sampling: what was recorded, and the quick estimation from each transient",
            source=campaign.source,
            chapters=[
                Chapter("warnings", "What to look at first", _warnings(found)),
                Chapter("estimation", "Quick estimation", [*griffin_pictures(found), *_estimation(found)]),
                Chapter("records", "Records", [*_how_to(found), *record_pictures(found)]),
                Chapter("structural", "Structural damping by amplitude", ring_down_pictures(found)),
                Chapter("campaign", "What the campaign says", tables),
            ],
            generator="scruton check",
            title_block=campaign.title_block.lines,
            colour=campaign.title_block.colour,
            logo=campaign.title_block.logo,
        )
    )


def _warnings(found: Check) -> list[Block]:
    boxes: list[Block] = []
    if found.problems:
        head = f"{len(found.problems)} record{'s' * (len(found.problems) > 1)} cannot be used"
        boxes.append(Callout(ALARM, head, tuple(map(str, found.problems))))
    if found.warnings:
        count = len(found.warnings)
        head = "1 warning" if count == 1 else f"{count} warnings, worst first"
        boxes.append(Callout(CAUTION, head, found.warnings))
    return boxes or [paragraph("No warnings.")]


def _how_to(found: Check) -> Iterator[Block]:
    if found.qualities:
        yield paragraph(
            "Drag the edges of the window, or move them by the keys of the two sliders: the lines to paste into the "
            "record’s table of campaign.toml stand below. Cycles outside of the window that was read are not shown."
        )


def _estimation(found: Check) -> Iterator[Block]:
    (factor, unit), (per, percent) = shown_in(found.campaign.section.amplitude_unit), shown_in(DAMPING)
    times = shown_in(SCRUTON)[0]
    rows = [
        (
            row.record, row.test, PAGE.number(per * row.damping_ratio), PAGE.number(times * row.scruton_number),
            f"{PAGE.number(factor * row.stable_amplitude, 3)}{'' if row.measured else ' *'}",
            PAGE.number(row.relaxation_rate, 3), PAGE.number(row.slope / (factor * times), 3), PAGE.number(row.Y1, 3),
            PAGE.number(row.epsilon, 3),
        )
        for row in found.identified
    ]  # fmt: skip
    if not rows:
        yield paragraph("No growth or decay in wind gives a Griffin curve by the paper’s own procedure.")
        return
    yield Table(
        "quick",
        f"Eqs. (2) to (8) and (16) to (20), record by record; a* in {unit_text(unit)}",
        ("record", "test", f"{damping_symbol()} [{percent or '-'}]", "Sc", "a*", "λ [1/s]", "d(1/a*)/dSc", "Y₁", "ε"),
        rows,
        "No uncertainty is told here: a fit tells it. *: where the record’s own curve meets its Scruton number. "
        + scruton_note(heaving=found.campaign.section.motion is Motion.HEAVING),
        (False, False, *[True] * 7),
    )


def _tables(found: Check, notation: Notation, as_in_files: float | None) -> list[Table]:
    campaign, files = found.campaign, found.campaign.section.amplitude_unit
    factor, shown = (as_in_files, files) if as_in_files else shown_in(files)
    unit, per = notation.unit(shown), shown_in(DAMPING)[0]
    quick: dict[str, list[Identified]] = {}
    for row in found.identified:
        quick.setdefault(row.test, []).append(row)
    rigs = tuple(
        (
            rig.name,
            _stated(rig.frequency, notation),
            _stated(rig.mass, notation),
            _stated(rig.damping_ratio, notation, per),
            _measured(found, rig, notation, per, exact=bool(as_in_files)),
            str(_used(found, rig.records)),
        )
        for rig in campaign.rigs
    )
    tests = tuple(
        _test_row(found, test, quick.get(test.name, []), notation, factor, exact=bool(as_in_files))
        for test in campaign.tests
    )
    rows = tuple(
        _row(record, rig.name if test is None else test.name, found.qualities[record.name], notation, factor)
        for record, rig, test in found.inspection.records()
    )
    sweeps = tuple(
        (sweep.rig, str(sweep.wind_speed.size), notation.range((sweep.wind_speed.min(), sweep.wind_speed.max())),
         notation.number(factor * sweep.amplitude.max()))
        for sweep in campaign.sweeps
    )  # fmt: skip
    note = _note(tests, notation)
    test_header, by_hand = (TEST_HEADER, BY_HAND) if notation.plain else (_ON_A_PAGE[:6], _ON_A_PAGE[6:])
    return [
        Table("rigs", "", _rig_header(campaign.section.motion, notation), rigs),
        Table("tests", "", (*test_header, f"stable [{unit}]", *by_hand, "records"), tests, note),
        Table("sweeps", "", ("sweep of rig", "points", "wind speed [m/s]", f"largest [{unit}]"), sweeps),
        Table("records", "", (*RECORD_HEADER[:7], f"amplitude [{unit}]", *RECORD_HEADER[7:]), rows),
    ]


def _rig_header(motion: Motion, notation: Notation) -> tuple[str, ...]:
    mass = "mass [kg/m]" if motion is Motion.HEAVING else f"inertia [{notation.unit('kg m^2/m')}]"
    name, unit = ("delta_s", "-") if decrements() else ("xi_s", "%")
    name, f0 = (name, "f0") if notation.plain else (damping_symbol(), "f₀")
    return "rig", f"{f0} [Hz]", mass, f"{name} [{unit}]", f"{name} measured [{unit}]", "ring-downs"


def _measured(found: Check, rig: Rig, notation: Notation, per: float, *, exact: bool) -> str:
    """Structural damping that the ring-downs of a rig show, to the first digit of its standard error for people."""
    ringdown = found.inspection.ringdowns.get(rig.name)
    if ringdown is None:
        return "-"
    value, error = per * ringdown.damping_ratio, per * ringdown.damping_ratio_sd
    if exact:
        return _stated(Quantity(value, error), notation)
    if not error > 10.0 ** (math.floor(math.log10(abs(value))) - 3):  # less than a digit of those that are shown
        return f"{value:#.4g}"
    text = with_error(value, error)
    return text.replace("±", "+/-") if notation.plain else text


def _used(found: Check, records: Sequence[Record]) -> int:
    """How many records are not set aside."""
    return sum(record.name in found.qualities for record in records)


def _note(tests: Sequence[tuple[str, ...]], notation: Notation) -> str:
    """What is no word of the laboratory's."""
    where = "Eqs. (2) to (8) and (17) to (19) of each record"
    by_hand = f"lambda, Y1, epsilon, and what has a *, are by {where}; `scruton identify` has all of it"
    if not notation.plain:
        by_hand = f"λ, Y₁, ε, and what has a *, are by {where}, as in the quick estimation."
    return by_hand if any(row[-2] not in "-–" for row in tests) else ""


def _stated(quantity: Quantity | None, notation: Notation, factor: float = 1.0) -> str:
    if quantity is None:
        return "-"
    text, sign = number(quantity.mean * factor), "+/-" if notation.plain else "±"
    return text if not quantity.sd else f"{text} {sign} {number(quantity.sd * factor, 2)}"


def _test_row(
    found: Check, test: Test, quick: Sequence[Identified], notation: Notation, factor: float, *, exact: bool
) -> tuple[str, ...]:
    """What is stated of a test; what is not, its Scruton number and stable amplitude, by the paper's own procedure."""
    rig, section = found.campaign.rig(test.rig), found.campaign.section
    sc, stable = float("nan"), _stated(test.stable_amplitude, notation, factor)
    if quick:
        sc = quick[0].scruton_number
        if test.stable_amplitude is None:
            ends = [factor * row.stable_amplitude for row in quick]
            # of records that agree one number, of others what each says
            stable = (
                f"{number(fmean(ends)) if max(ends) < _AGREE * min(ends) else _span(ends, notation, exact=exact)} *"
            )
    elif rig.mass and rig.damping_ratio:
        sc = float(
            Setting(
                motion=section.motion, width=section.width, depth=section.depth, mass=rig.mass.mean,
                air_density=test.air_density.mean, wind_speed=test.wind_speed.mean, frequency=rig.frequency.mean,
                wind_frequency=rig.frequency.mean, damping_ratio=rig.damping_ratio.mean,
            ).scruton_number
        )  # fmt: skip
    by_hand = ([getattr(row, name) for row in quick] for name in ("relaxation_rate", "Y1", "epsilon"))
    reduced = found.campaign.reduced_velocity(test)
    settled = any(other.rig == test.rig and other.name in found.peaks for other in found.campaign.tests)
    peak = "yes" if test.name in found.peaks else "no" if settled or test.peak is False else "-"
    return (
        test.name, test.rig, _stated(test.wind_speed, notation), number(reduced), number(shown_in(SCRUTON)[0] * sc),
        peak, stable, *(_span(of, notation, exact=exact) for of in by_hand), str(_used(found, test.records)),
    )  # fmt: skip


def _span(values: Sequence[float], notation: Notation, *, exact: bool) -> str:
    """From the least to the largest; for people one number where they are shown alike."""
    if not values:
        return "-"
    low, high = (notation.number(value, 3) for value in (min(values), max(values)))
    return low if low == high and not exact else f"{low}{notation.between}{high}"


def _row(record: Record, owner: str, quality: RecordQuality, notation: Notation, factor: float) -> tuple[str, ...]:
    line, ends = quality.second_line, [factor * end for end in quality.amplitude_range]
    return (
        record.name, owner, record.kind.value, number(quality.duration), number(quality.sample_rate),
        str(quality.cycles), number(quality.frequency, 5), notation.range(ends, 3),
        number(quality.signal_to_noise, 3),
        "-" if line is None else f"{number(line.frequency)} Hz, {percent(line.relative, 1)}",
    )  # fmt: skip
