"""`[report]` in campaign.toml: whose report it is, and how the house looks."""

import base64
import re
from dataclasses import fields
from datetime import date
from typing import TYPE_CHECKING

from scruton.campaign.schema import TitleBlock
from scruton.campaign.thresholds import LARGEST_LOGO
from scruton.campaign.toml import Field, Table, text
from scruton.errors import InputError

if TYPE_CHECKING:
    from scruton.campaign.files import Files

# First bytes of the pictures that every page and the PDF can show.
_PICTURES = {"png": b"\x89PNG\r\n\x1a\n", "jpeg": b"\xff\xd8\xff", "svg+xml": b"<"}


def _colour(table: Table, key: str) -> str:
    value = table.text(key, 'a colour, such as "#005f87"')
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", value):
        raise table.error(key, f'"{value}"', 'a colour as six hexadecimal digits, such as "#005f87"')
    return value.lower()


def _one_of(*known: str) -> Field:
    """One of these words, or None where it is left out."""
    return Field(lambda table, key: table.choice(key, known), None)


def _date(table: Table, key: str) -> str:
    value = table.values[key]
    if isinstance(value, date):  # of TOML; its day where there is a time of day, too
        return value.strftime("%Y-%m-%d")
    return table.text(key, "a date, such as 2026-11-20, or a text")


def read_title_block(table: Table, files: "Files") -> TitleBlock:
    """Read `[report]` (InputError for whatever is wrong with it, or with the picture that it names)."""

    def logo(table: Table, key: str) -> str:
        path = table.file.parent / table.text(key, "a PNG, JPEG or SVG file")
        content = files.read(path, LARGEST_LOGO)
        kind = next((kind for kind, first in _PICTURES.items() if content.lstrip().startswith(first)), None)
        if kind is None or (kind == "svg+xml" and b"<svg" not in content[:2000]):
            raise InputError(path, "", "a file that is no such picture", "a PNG, JPEG or SVG file")
        return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"

    known = {field.name: text(default="") for field in fields(TitleBlock)}
    known |= {"colour": Field(_colour, ""), "logo": Field(logo, ""), "date": Field(_date, "")}
    known |= {"damping": _one_of("ratio", "decrement"), "scruton_number": _one_of("paper", "eurocode")}
    return TitleBlock(**table.read(known))
