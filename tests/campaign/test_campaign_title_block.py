"""[report] in campaign.toml: whose report it is."""

import base64
from pathlib import Path

import pytest

from scruton.campaign import load_campaign
from scruton.errors import InputError

EXAMPLE = Path(__file__).parents[2] / "examples" / "pylon"
LOGO = b'<svg xmlns="http://www.w3.org/2000/svg" width="2" height="1"/>'


def campaign(folder: Path, report: str, logo: bytes = LOGO):
    for file in EXAMPLE.iterdir():
        if file.is_file():
            (folder / file.name).symlink_to(file)
    text = (EXAMPLE / "campaign.toml").read_text()
    (folder / "campaign.toml").unlink()
    (folder / "campaign.toml").write_text(f"{text}\n[report]\n{report}\n")
    (folder / "logo.svg").write_bytes(logo)
    return load_campaign(folder)


def test_what_is_stated_stands_in_its_order_and_nothing_else(tmp_path):
    block = campaign(tmp_path, 'date = "2026-11-20"\nclient = "Road administration"\ncolour = "#005F87"').title_block
    assert block.lines == [("Client", "Road administration"), ("Date", "2026-11-20")]
    assert block.colour == "#005f87"


@pytest.mark.parametrize("date", ["2026-11-20", "2026-11-20T08:00:00Z", '"2026-11-20"'])
def test_a_date_may_be_one_of_toml(tmp_path, date):
    assert campaign(tmp_path, f"date = {date}").title_block.lines == [("Date", "2026-11-20")]


@pytest.mark.parametrize("date", ["20261120", "08:00:00", '""'])
def test_what_is_no_date_is_refused(tmp_path, date):
    with pytest.raises(InputError, match=r"report\.date: found .*wanted a date, such as 2026-11-20"):
        campaign(tmp_path, f"date = {date}")


def test_the_logo_travels_with_the_campaign(tmp_path):
    read = campaign(tmp_path, 'logo = "logo.svg"')
    kind, _, content = read.title_block.logo.partition(",")
    assert kind == "data:image/svg+xml;base64"
    assert base64.b64decode(content) == LOGO
    assert "logo.svg" in read.sha256


def test_a_campaign_without_one_has_an_empty_block():
    assert load_campaign(EXAMPLE).title_block.lines == []


@pytest.mark.parametrize(
    ("report", "field"),
    [
        ('colour = "blue"', "report.colour"),
        ("project = 3", "report.project"),
        ('cleint = "x"', "cleint"),
        ('logo = "campaign.toml"', "no such picture"),
        ('logo = "absent.png"', "absent.png"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, report, field):
    with pytest.raises(InputError) as caught:
        campaign(tmp_path, report)
    assert field in str(caught.value)


def test_conventions_are_those_of_files_unless_others_are_stated(tmp_path):
    assert load_campaign(EXAMPLE).conventions == {}
    stated = campaign(tmp_path, 'damping = "decrement"\nscruton_number = "eurocode"')
    factor = stated.section.width / stated.section.depth
    assert stated.conventions == {
        "damping": "decrement", "scruton_number": "eurocode", "scruton_factor": pytest.approx(factor),
    }  # fmt: skip
    assert stated.title_block.lines == []


@pytest.mark.parametrize(
    ("line", "field", "wanted"),
    [
        ('damping = "percent"', "report.damping", "ratio, decrement"),
        ('scruton_number = "euro"', "report.scruton_number", "eurocode"),
        ("damping = 1", "report.damping", "ratio, decrement"),
    ],
)
def test_an_unknown_convention_is_refused(tmp_path, line, field, wanted):
    with pytest.raises(InputError, match=field) as raised:
        campaign(tmp_path, line)
    assert wanted in str(raised.value)
