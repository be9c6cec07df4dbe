"""Records as delimited text: dialects, and every way to get one wrong."""

import time

import numpy as np
import pandas as pd
import pytest
from campaign_room import DEPTH, DISPLACEMENT, HEAVING, TIME, Room, csv, record
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scruton.errors import InputError

GOOD = csv()
TWO = "time [s],displacement [m]"
LINES = GOOD.splitlines()
OVER_D = DISPLACEMENT / DEPTH


def with_line(number: int, line: str) -> str:
    """Replace one line, counted from 1, of a good file."""
    return "\n".join([*LINES[: number - 1], line, *LINES[number:]]) + "\n"


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + GOOD.encode(),
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.rstrip(),
        GOOD.replace("\n", ",\n"),
        "\n\n" + GOOD.replace("\n", "\n\n"),
        GOOD.replace("time [s],displacement [m]", '"Time [s]","Displacement [m]"'),
        GOOD.replace("time [s],displacement [m]", "time (s), displacement (m)"),
        GOOD.replace("time [s]", "# time [s]"),
        GOOD.replace("time [s],displacement [m]", "time [s],displacement [m],"),
        "\n".join([LINES[0], *(line + "," for line in LINES[1:])]),
        "\n".join([LINES[0] + ",note", *(line + ",text" for line in LINES[1:])]),
        "\n".join(["note," + LINES[0], *("12:00," + line for line in LINES[1:])]),
    ],
    ids=[
        "bom",
        "crlf",
        "cr",
        "no end",
        "trailing",
        "blank",
        "quoted",
        "round",
        "hash",
        "header",
        "rows",
        "note",
        "clock",
    ],
)
def test_plain_files_that_differ_in_form(room: Room, content: str | bytes) -> None:
    found = room.record("r.csv", content)
    np.testing.assert_array_equal(found.time, TIME)
    np.testing.assert_allclose(found.response, OVER_D, rtol=1e-14)
    assert found.time.dtype == found.response.dtype == np.float64


@pytest.mark.parametrize(
    ("file", "content", "lines"),
    [
        ("r.csv", GOOD.replace(",", ";"), ['delimiter = ";"']),
        ("r.txt", GOOD.replace(",", "\t"), ['delimiter = "\\t"']),
        ("r.dat", GOOD.replace(",", "   "), ['delimiter = " "']),
        ("r.dat", "\n".join("  " + line.replace(",", "   ") for line in LINES), ['delimiter = " "']),
        ("r.csv", GOOD.replace(",", ";").replace(".", ","), ['decimal = ","']),
        ("r.csv", GOOD.replace(",", "\t").replace(".", ","), ['decimal = ","', 'delimiter = "\\t"']),
        ("r.csv", 'a 12" pipe\n\n3,4,5,6\n' + GOOD, ["skip_rows = 3"]),
        ("r.csv", GOOD.encode("utf-16"), ['encoding = "utf-16"']),
        ("r.csv", csv("Zeit [s],Weg [m]"), ['columns = { time = "zeit", displacement = "Weg [m]" }']),
        (
            "r.csv",
            "\n".join(LINES[1:]),
            ["columns = { time = 0, displacement = 1 }", 'units = { time = "s", displacement = "m" }'],
        ),
        ("r.csv", GOOD.replace(" [m]", ""), ['units = { displacement = "m" }']),
        ("r.csv", GOOD.replace(" [m]", " [V]"), ['units = { displacement = "m" }']),
        (
            "r.csv",
            csv(TWO + ",amplitude [m]", TIME, DISPLACEMENT, TIME),
            ['columns = { displacement = "displacement" }'],
        ),
        (
            "r.csv",
            "位移记录\n时间 [s],位移 [m]\n".encode("gbk") + "\n".join(LINES[1:]).encode(),
            ['encoding = "gbk"', "skip_rows = 1", 'columns = { time = "时间", displacement = "位移" }'],
        ),
    ],
)
def test_dialects(room: Room, file: str, content: str | bytes, lines: list[str]) -> None:
    found = room.record(file, content, *lines)
    np.testing.assert_array_equal(found.time, TIME)
    np.testing.assert_allclose(found.response, OVER_D, rtol=1e-14)


def test_units_of_the_header(room: Room) -> None:
    found = room.record("r.csv", csv("time [ms],displacement [mm]"))
    np.testing.assert_allclose(found.time, TIME / 1000, rtol=1e-14)
    np.testing.assert_allclose(found.response, OVER_D / 1000, rtol=1e-14)
    np.testing.assert_array_equal(room.record("r.csv", csv("time [s],displacement [A/D]")).response, DISPLACEMENT)


def test_envelopes_extracted_elsewhere(room: Room) -> None:
    found = room.record("r.csv", csv("time [s],amplitude [mm]", TIME, 5.0 - TIME))
    assert found.is_envelope
    np.testing.assert_allclose(found.response, (5.0 - TIME) / 75, rtol=1e-14)
    with pytest.raises(
        InputError, match=r'column "amplitude \[mm\]": found -0.0\d+ at line 6; wanted numbers of zero or more'
    ):
        room.record("r.csv", csv("time [s],amplitude [mm]"))
    late = np.where(TIME == 1.5, -1.0, 5.0 - TIME)
    with pytest.raises(InputError, match=r"found -1 at line 152;"):
        room.record("r.csv", csv("time [s],amplitude [mm]", TIME, late), 'start = "1 s"')


def test_sample_rate_in_place_of_time(room: Room) -> None:
    found = room.record("r.csv", csv("displacement [m]", DISPLACEMENT), 'sample_rate = "100 Hz"')
    np.testing.assert_allclose(found.time, TIME, rtol=1e-14)
    with pytest.raises(InputError, match=r'sample_rate: found 100 without a unit; wanted .*sample_rate = "100 Hz"'):
        room.record("r.csv", csv("displacement [m]", DISPLACEMENT), "sample_rate = 100")
    with pytest.raises(InputError, match=r'time: found no time column; wanted .*sample_rate = "500 Hz"'):
        room.record("r.csv", csv("displacement [m]", DISPLACEMENT))


def test_sample_rate_beside_rounded_time_must_agree_with_it(room: Room) -> None:
    rounded = csv("time [s],displacement [m]", 3.0 + TIME.round(1), DISPLACEMENT)
    with pytest.raises(InputError, match=r"time that does not increase, first at line 3 \(3 s, then 3 s\)"):
        room.record("r.csv", rounded)
    found = room.record("r.csv", rounded.replace(f"{3.0 + TIME[-1].round(1)!r}", "4.99"), 'sample_rate = "100 Hz"')
    np.testing.assert_allclose(found.time, 3.0 + TIME, rtol=1e-14)
    with pytest.raises(InputError, match=r"sample_rate: found 50 Hz, while the file's own time says 100 Hz"):
        room.record("r.csv", GOOD, 'sample_rate = "50 Hz"')


def test_start_and_stop_choose_in_the_files_own_time(room: Room) -> None:
    late = csv("time [s],displacement [m]", 10.0 + TIME, DISPLACEMENT)
    found = room.record("r.csv", late, 'start = "10500 ms"', 'stop = "11 s"')
    np.testing.assert_allclose(found.time[[0, -1]], [10.5, 11.0])
    np.testing.assert_allclose(found.response, OVER_D[50:101], rtol=1e-14)
    assert room.record("r.csv", late, 'stop = "12 s"').time[-1] == 11.99  # within one sample of the end


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (['start = "5 s"'], r'start: found "5 s"; wanted a time in the record r.csv, which goes from 0 s to 1.99 s'),
        (['stop = "-1 s"'], r'stop: found "-1 s"; wanted a time in the record'),
        (['start = "1 s"', 'stop = "0.5 s"'], r"stop: found 0.5 s; wanted a time after the start, 1 s"),
        (['start = "1 s"', 'stop = "1.02 s"'], r"found 3 samples between start and stop; wanted 5 or more"),
        (["start = 1"], r'start: found 1 without a unit; wanted .*start = "1 s"'),
        (['start = "1 m"'], r"not that of a time"),
        (['strat = "1 s"'], r'records\[0\].strat: found a key that is not known; wanted "start"'),
        (['delimiter = ";;"'], r'delimiter: found ";;"; wanted one character'),
        (["delimiter = 1"], r"delimiter: found 1; wanted one character"),
        (['decimal = ";"'], r'decimal: found ";"; wanted "." or ","'),
        (['decimal = ","', 'delimiter = ","'], r"a sign other than the decimal one"),
        (["skip_rows = -1"], r"skip_rows: found -1; wanted how many lines"),
        (["skip_rows = 3000"], r"found nothing after the 3000 lines to skip"),
        (['encoding = "gbkk"'], r'encoding: found "gbkk"; wanted an encoding that Python knows'),
        (['encoding = "base64"'], r'encoding: found "base64"; wanted an encoding'),
        (['columns = { disp = "x" }'], r'columns.disp: found a key that is not known; wanted "displacement"'),
        (['columns = { displacement = "x" }'], r'column "x": found no such column; wanted one of: time, displacement'),
        (["columns = { displacement = 7 }"], r"column 7: found 2 columns; wanted a position counted from 0"),
        (["columns = { displacement = true }"], r"columns.displacement: found true; wanted the name of a column"),
        (["columns = 3"], r"columns: found 3; wanted one table"),
        (
            ['units = { displacement = "kg" }'],
            r'units.displacement: found the unit "kg", which is not that of a length',
        ),
        (["units = { displacement = 1 }"], r"units.displacement: found 1; wanted a unit"),
        (['variables = { displacement = "y" }'], r'variables: found a key that does not go .*"columns"'),
        (['sample_rate = "0 Hz"'], r"sample_rate: .*greater than zero"),
    ],
)
def test_bad_tables_of_records(room: Room, lines: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        room.record("r.csv", GOOD, *lines)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", r"r.csv: found an empty file; wanted a record"),
        ("\n \n", r"found only blank lines; wanted a header line"),
        (LINES[0] + "\n\n", r"found a header and no numbers"),
        ("\n".join(LINES[:2]), r'column "displacement \[m\]": found 1 sample; wanted 5 or more'),
        ("time,displacement\n0,1\n", r'column "displacement": found no unit; wanted .*"displacement \[m\]"'),
        (GOOD.replace(" [s]", ""), r'column "time": found no unit; wanted .*"time \[s\]"'),
        (GOOD.replace("[m]", "[]"), r"found no unit"),
        (GOOD.replace("[m]", "[kg]"), r'found the unit "kg", which is not that of a length; wanted .*\[m\]"'),
        (GOOD.replace("[m]", "[furz]"), r'found the unit "furz", which is not known'),
        (GOOD.replace("[s]", "[m]"), r'column "time \[m\]": found the unit "m", which is not that of a time'),
        ("\n".join(LINES[1:]), r"header: found no header line.*; wanted .*columns by position"),
        (with_line(51, "0.49,abc"), r'line 51, column "displacement \[m\]": found the text "abc"; wanted a number'),
        (with_line(51, "noon,0.1"), r'line 51, column "time \[s\]": found the text "noon"'),
        (with_line(51, "0.49,1_0"), r'found the text "1_0"'),
        (with_line(51, "0.49,0,001"), r"line 51: found 3 columns; wanted 2"),
        (with_line(51, '0.49,"0,001"'), r'found the text "0,001"; wanted .*decimal point, or decimal = ","'),
        ("\n\n" + with_line(51, "0.49,abc"), r'line 53, column "displacement \[m\]"'),
        (with_line(51, "0.49,nan"), r"found 1 value that is no finite number .*, the first at line 51"),
        (with_line(51, "0.49,"), r"found 1 value that is no finite number .*, the first at line 51"),
        (with_line(51, "0.49"), r"found 1 value that is no finite number .*, the first at line 51"),
        (with_line(51, "0.49,-inf\n\n0.495,inf"), r"found 2 values that are no finite number .*, the first at line 51"),
        (with_line(51, "nan,0.1"), r'column "time \[s\]": found 1 value .*line 51'),
        (with_line(51, "0.40,0.1"), r"time that does not increase, first at line 51 \(0.48 s, then 0.4 s\)"),
        (with_line(51, LINES[49]), r"time that does not increase, first at line 51"),
        (with_line(51, '0.49,"0.1'), r"found text that cannot be read"),
        (csv(TWO, TIME, 0 * TIME + 0.1), r"found a constant signal, 0.1 throughout; wanted one that oscillates"),
        (csv(TWO + ",displacement [m]", TIME, TIME, TIME), r"found 2 columns of this name; wanted .*position"),
        (csv(TWO + ",amplitude [m]", TIME, TIME, TIME), r"found both displacement and amplitude"),
        (csv("time [s],rotation [rad]"), r"displacement or amplitude: found no such column among .*rotation"),
        (GOOD.replace(",", ";"), r'or the delimiter, delimiter = ";"'),
        (GOOD.replace(",", "\t"), r'or the delimiter, delimiter = "\\t"'),
        (GOOD.replace(".", ","), r'line 2: found 4 columns under a header of 2; wanted .*decimal = ","'),
        ("时间 [s],位移 [m]\n".encode("gbk"), r'not utf-8 \(at byte 2\); wanted .*encoding = "gbk"'),
        ("Zeit [s],Auslenkung für Brücke [m]\n".encode("latin-1"), r'not utf-8 .*; wanted .*encoding = "latin-1"'),
        (with_line(51, "0.49,nan"), r"wanted numbers throughout: leave such lines out of the file, which makes a gap"),
        (with_line(51, "nan,0.1"), r"wanted numbers throughout: leave such lines out of the file, which makes a gap"),
        (GOOD.encode("utf-16"), r'not utf-8 \(at byte 0\); wanted .*encoding = "utf-16"'),
        (GOOD.encode() + b"1.995,\xff\n", r"found bytes that are not utf-8"),
        (bytes(range(256)), r"found bytes that are not utf-8"),
        (b"time [s],displacement [m]\n\0\0\n", r'line 2, column "time \[s\]": found the text "\?\?"'),
    ],
)
def test_bad_files(room: Room, content: str | bytes, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        room.record("r.csv", content)
    assert caught.value.file.endswith("r.csv")
    assert "\n" not in str(caught.value)


def test_numbers_that_are_missing_outside_the_chosen_part_do_no_harm(room: Room) -> None:
    found = room.record("r.csv", with_line(51, "0.49,nan"), 'start = "1 s"')
    assert len(found.time) == 100


def test_line_of_a_missing_number_behind_blank_lines_and_a_window(room: Room) -> None:
    content = with_line(151, "1.49,nan").replace("\n", "\n\n")
    with pytest.raises(InputError, match="the first at line 301"):
        room.record("r.csv", content, 'start = "1 s"')


def test_unknown_endings(room: Room) -> None:
    with pytest.raises(
        InputError, match=r'found the file ending ".xlsx"; wanted one of .csv, .*save the record as CSV'
    ):
        room.record("r.xlsx", "x")
    assert len(room.record("R.CSV", GOOD).time) == 200


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.floats(-1e9, 1e9), min_size=5, max_size=40).filter(lambda values: np.ptp(values) > 1e-14))
def test_the_fast_parser_reads_what_python_reads(room: Room, values: list[float]) -> None:
    content = csv("displacement [A/D]", np.array(values))
    found = room.record("r.csv", content, 'sample_rate = "10 Hz"')
    wanted = [float(line) for line in content.splitlines()[1:]]
    np.testing.assert_array_equal(found.response, wanted)
    commas = content.replace(".", ",")
    found = room.record("r.csv", commas, 'sample_rate = "10 Hz"\ndelimiter = ";"\ndecimal = ","')  # by pandas
    np.testing.assert_array_equal(found.response, wanted)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(st.binary(max_size=200), st.text('09.,;-+e"#[]() \t\r\nmstimedisplacement', max_size=200).map(str.encode))
)
def test_no_content_breaks_the_reader(room: Room, content: bytes) -> None:
    problems: list[InputError] = []
    room.load(HEAVING + record("r.csv") + '[[tests.records]]\nfile = "r.csv"\nkind = "steady"\nstart = "0 s"\n',
              {"r.csv": content}, problems)  # fmt: skip


@pytest.mark.thorough
def test_a_million_rows(room: Room) -> None:
    count = 1_000_000
    frame = pd.DataFrame({"time [s]": np.arange(count) / 1000, "displacement [m]": np.sin(np.arange(count) / 7)})
    content = frame.to_csv(index=False)
    room.record("warm.csv", GOOD)  # scipy is imported
    room.load(HEAVING + record("big.csv"), {"big.csv": content})
    from scruton.campaign import load_campaign

    start = time.process_time()
    found = load_campaign(room.folder).tests[0].records[0]
    assert time.process_time() - start < 2.0  # about 0.2 s on a quiet core
    np.testing.assert_allclose(found.response, frame["displacement [m]"] / DEPTH, rtol=1e-14)


@pytest.mark.parametrize("delimiter", [" ", "\t", ";", ","])
@pytest.mark.parametrize("leading", ["", "delimiter"])
def test_without_a_header_the_first_row_is_kept(room, delimiter, leading):
    """Whatever parts the numbers, stated or not, and also where every line begins with a delimiter."""
    begin, first = (delimiter, 1) if leading and delimiter != " " else ("", 0)
    content = "".join(
        f"{begin}{t!r}{delimiter}{y!r}\n" for t, y in zip(TIME.tolist(), DISPLACEMENT.tolist(), strict=True)
    )
    lines = [
        f"columns = {{ time = {first}, displacement = {first + 1} }}",
        'units = { time = "s", displacement = "m" }',
    ]
    record = room.record("a.txt", content, *lines)
    assert record.time.size == TIME.size
    assert record.response[0] * DEPTH == pytest.approx(DISPLACEMENT[0])


def test_a_byte_order_mark_read_as_latin_letters_takes_no_row(room):
    content = (
        b"\xef\xbb\xbf"
        + "".join(f"{t!r},{y!r}\n" for t, y in zip(TIME.tolist(), DISPLACEMENT.tolist(), strict=True)).encode()
    )
    lines = ["columns = { time = 0, displacement = 1 }", 'units = { time = "s", displacement = "m" }']
    assert room.record("a.txt", content, *lines, 'encoding = "latin-1"').time.size == TIME.size


def test_lines_without_numbers_may_be_left_out_where_the_file_has_its_times(room: Room) -> None:
    """A record whose times are counted by a stated rate would be shifted by that."""
    whole = room.record("r.csv", GOOD)
    fewer = room.record("r.csv", "\n".join([*LINES[:50], *LINES[51:]]))
    assert len(fewer.time) == len(whole.time) - 1
    with pytest.raises(InputError, match="wanted numbers throughout, or a part of the record that has them"):
        room.record("r.csv", with_line(51, "0.49,nan"), 'sample_rate = "100 Hz"')
