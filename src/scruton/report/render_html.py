"""A document as one HTML file that needs nothing else: no network, pictures and the one script inside."""

import base64
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scruton.report.document import Chart, Document, Picture
from scruton.report.maths import Maths, display, inline
from scruton.report.thresholds import LARGEST_REPORT, LARGEST_SVG_ON_PAGE
from scruton.report.typefaces import Subset, subsets

TEMPLATES = Path(__file__).parent / "templates"
STYLE = "<style>\n"  # no text of a document can look like it: those are escaped


def render_html(document: Document) -> str:
    """Render a page.

    Parameters
    ----------
    document : Document
        As `numbered` gave it.

    Returns
    -------
    str
        The page. Every text of the document is escaped; a policy in its head lets nothing load and no script run but
        its own.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    script = (TEMPLATES / "chart.js").read_text(encoding="utf-8")
    environment.tests["maths"] = lambda value: isinstance(value, Maths)
    environment.filters["inline"] = lambda maths: Markup(inline(maths))
    environment.filters["display"] = lambda maths: Markup(display(maths))
    environment.filters["kind"] = lambda block: type(block).__name__
    environment.filters["data"] = lambda data: Markup(embedded(data))
    charts = any(isinstance(one, Chart) for one in document.blocks())
    context: dict[str, Any] = {
        "document": document,
        "uris": uris(document.pictures()),
        "script": Markup(script) if charts else "",
        "digest": base64.b64encode(hashlib.sha256(f"\n{script}".encode()).digest()).decode() if charts else "",
    }
    return with_typefaces(environment.get_template("report.html.j2").render(context))


def with_typefaces(page: str) -> str:
    """Put the letters into a page that its reader's machine may lack, Chinese above all; its style asks for them."""
    head, style, rest = page.partition(STYLE)
    return head + style + "".join(map(_face, subsets(page))) + rest


def _face(one: Subset) -> str:
    """A rule that gives these letters, and no others, to the family `scruton`."""
    data = base64.b64encode(one.content).decode()
    reach = ",".join(f"U+{ord(letter):X}" for letter in one.letters)
    return f'@font-face{{font-family:scruton;src:url("data:font/otf;base64,{data}");unicode-range:{reach}}}\n'


def embedded(data: Any) -> str:
    """JSON that may stand inside a script element, whatever its texts hold."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text


def uris(pictures: Sequence[Picture], limit: int = LARGEST_REPORT) -> dict[str, str]:
    """Pictures as data URIs by name, empty for those that would make the file too large; the last go first."""
    found, total = {}, 0
    for one in pictures:
        uri = data_uri(one)
        total += len(uri)
        found[one.name] = uri if total <= limit else ""
    return found


def data_uri(one: Picture) -> str:
    """A picture inside the page: its drawing, or its PNG where the drawing is large."""
    if one.svg and (len(one.svg) <= LARGEST_SVG_ON_PAGE or not one.png or len(one.svg) <= len(one.png)):
        kind, content = "image/svg+xml", one.svg
    elif one.png:
        kind, content = "image/png", one.png
    else:
        return ""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
