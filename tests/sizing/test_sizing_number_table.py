"""Tables of numbers beside a bridge: units of the headings are heeded; what is wrong is named by line and column."""

import pytest

from scruton.campaign.units import SPEED
from scruton.errors import InputError
from scruton.sizing.existing import offers
from scruton.sizing.number_table import read_table


@pytest.fixture
def listed(tmp_path):
    def write(text):
        path = tmp_path / "suppliers.csv"
        path.write_bytes(text.encode())
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        "mass [kg],frequency [Hz],damping ratio\n12000,0.29,0.08\n",
        "mass,frequency,damping\n12000,0.29,0.08\n",
        "mass [t],frequency [mHz],damping ratio [%]\r\n12,290,8\r\n",
        "\ufeffMasse (t),Frequenz (rad/s),D\u00e4mpfung [-]\n\n# a comment\n12, 1.822123737, 0.08\n",
    ],
    ids=["SI", "no units", "other units", "brackets"],
)
def test_a_list_of_dampers_is_read_in_the_units_of_its_headings(listed, text):
    """Tonnes were taken for kilograms."""
    (offer,) = offers(str(listed(text)))
    (damper,) = offer.dampers
    found = (damper.mass, damper.frequency, damper.damping_ratio)
    assert found == pytest.approx((12000.0, 0.29, 0.08))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"found no lines"),
        ("mass,frequency,damping\n", r"found 1 line; wanted one header line"),
        ("12000,0.29,0.08\n13000,0.3,0.1\n", r'line 1: found numbers \("12000,0.29,0.08"\)'),
        ("name,mass,frequency\nA,12000,0.29\n", r'line 2, column 1: found "A"; wanted a number; one header'),
        ("m;f;d\n12000;0.29;0.08\n", r'line 2, column 1: found "12000;0.29;0.08"; .*commas between the columns'),
        ("m,f,d\n\n12000,0.29,0.08\n12000,0.29\n", r"line 4: found 2 numbers, where the line before has 3"),
        (
            "mass [Hz],f,d\n12000,0.29,0.08\n",
            r"header, column 1: found \"mass \[Hz\]\".*unit of a mass, such as \[kg\]",
        ),
        ("m,f,d\n12000,nan,0.08\n", r"row 1, column 2: found nan; wanted a number greater than zero"),
    ],
)
def test_what_is_wrong_is_named_by_line_and_column(listed, text, message):
    with pytest.raises(InputError, match=message):
        offers(str(listed(text)))


def test_a_table_in_another_encoding_is_asked_for_in_utf_8(tmp_path):
    (path := tmp_path / "suppliers.csv").write_bytes("mass,frequency,damping\n12000,0.29,0.08\n".encode("utf-16"))
    with pytest.raises(InputError, match=r"not UTF-8 \(at byte 0\); wanted .* in UTF-8"):
        offers(str(path))


def test_further_columns_and_columns_without_a_unit_stay_as_they_are(listed):
    assert read_table(listed("a [t],b [t]\n1,2\n"), "numbers").tolist() == [[1.0, 2.0]]


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("speed (10 min mean)", 1.0),
        ("speed (10 min)", 1.0),
        ("speed (at 10 m)", 1.0),
        ("speed [km/h] (10 min mean)", 1.0 / 3.6),
        ("speed (10 min mean) [km/h]", 1.0 / 3.6),
        ("speed (km/h)", 1.0 / 3.6),
        ("speed ()", 1.0),
    ],
)
def test_round_brackets_may_hold_a_remark(listed, heading, factor):
    """It was taken for a unit, and refused; and a unit before it must not be lost."""
    path = listed(f"{heading},hours\n36,1\n")
    assert read_table(path, "numbers", (SPEED,))[0] == pytest.approx([36.0 * factor, 1.0])


@pytest.mark.parametrize(
    "heading",
    [
        "speed [10 min mean]", "speed [stone?]", "speed (stone?)", "speed (kg)", "speed (kg m)", "speed (km/h; 10 min)",
        "speed [m/s] (km/h)",
    ],
)  # fmt: skip
def test_what_may_be_a_unit_is_no_remark(listed, heading):
    with pytest.raises(InputError, match=r"header, column 1: .*the unit of a speed, such as \[m/s\]"):
        read_table(listed(f"{heading},hours\n36,1\n"), "numbers", (SPEED,))
