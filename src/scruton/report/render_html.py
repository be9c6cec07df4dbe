"""A document as one HTML file that needs nothing else: no network, pictures and the one script inside."""

import base64
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scruton.report.document import Document, Picture
from scruton.report.maths import Maths, display, mathml
from scruton.report.thresholds import LARGEST_REPORT, LARGEST_SVG_ON_PAGE
from scruton.report.typefaces import subsets

TEMPLATES = Path(__file__).parent / "templates"
ZOOM = "zoom.js"  # of every page with a picture
STYLE = "<style>\n"  # no text of a document can look like it: those are escaped


def page(template: str, tests: Any = (), filters: Any = (), **context: Any) -> str:
    """Fill a template: every text is escaped, and letters that its reader's machine may lack are put into the page."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.tests.update(tests)
    environment.filters.update(filters)
    filled = environment.get_template(template).render(context)
    head, style, rest = filled.partition(STYLE)
    faces = (
        f'@font-face{{font-family:scruton;src:url("data:font/otf;base64,{base64.b64encode(content).decode()}");'
        f"unicode-range:{','.join(f'U+{ord(letter):X}' for letter in letters)}}}\n"
        for letters, content in subsets(filled)
    )
    return head + style + "".join(faces) + rest


def render_html(document: Document, charts: str = "chart.js") -> str:
    """Render a page from a numbered document: a policy in its head lets nothing load, no script run but its own.

    `charts` is the script that draws what its pictures answer with.
    """
    from markupsafe import Markup

    pictures = document.every(Picture)
    used = [*([ZOOM] if pictures else []), *([charts] if any(picture.chart for picture in pictures) else [])]
    script = "".join((TEMPLATES / name).read_text(encoding="utf-8") for name in used)
    return page(
        "report.html.j2",
        tests={"maths": lambda value: isinstance(value, Maths)},
        filters={
            "inline": lambda maths: Markup(mathml(maths)),
            "display": lambda maths: Markup(display(maths)),
            "kind": lambda block: type(block).__name__,
            "data": lambda data: Markup(embedded(data)),
        },
        document=document,
        uris=uris(pictures),
        script=Markup(script),
        digest=script and base64.b64encode(hashlib.sha256(f"\n{script}".encode()).digest()).decode(),
    )


def embedded(data: Any) -> str:
    """JSON that may stand inside a script element, whatever its texts hold."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text


def uris(pictures: Sequence[Picture], limit: int = LARGEST_REPORT) -> dict[str, str]:
    """Pictures as data URIs by name, empty for those that would make the file too large; the last go first."""
    by_name, total = {}, 0
    for picture in pictures:
        uri = data_uri(picture)
        total += len(uri)
        by_name[picture.name] = uri if total <= limit else ""
    return by_name


def data_uri(image: Picture) -> str:
    """A picture inside the page: its drawing, or its PNG where the drawing is large."""
    drawing = image.svg and (len(image.svg) <= LARGEST_SVG_ON_PAGE or not image.png or len(image.svg) <= len(image.png))
    kind, content = ("image/svg+xml", image.svg) if drawing else ("image/png", image.png)
    return f"data:{kind};base64,{base64.b64encode(content).decode()}" if content else ""
