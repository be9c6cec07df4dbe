"""campaign.toml: its structure, its values, its units, its text."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import tomli_w
from numpy.random import Generator

from tests.fuzz.case import ACCEPTED, ANY, REFUSED, Case, Run
from tests.fuzz.damage import HUGE, STRANGE, UNITS, get, leaves, one, put, spell, spoil_bytes, spoil_tree
from tests.fuzz.stock import Stock

BLAMES = ("campaign.toml", "case/", "case:")
CHECK = ("check", "case")
# Spellings of one quantity: a unit, and how many of it are one of the unit in the stock.
SAME = {
    "m": (("m", 1.0), ("cm", 100.0), ("mm", 1000.0), ("metre", 1.0), ("inch", 1 / 0.0254), ("ft", 1 / 0.3048)),
    "Hz": (("Hz", 1.0), ("1/s", 1.0), ("rad/s", 6.283185307179586), ("rpm", 60.0), ("mHz", 1000.0), ("1/min", 60.0)),
    "kg/m": (("kg/m", 1.0), ("g/m", 1000.0), ("g/mm", 1.0), ("N*s^2/m^2", 1.0), ("kg m^-1", 1.0)),
    "kg*m^2/m": (("kg*m^2/m", 1.0), ("kg m**2/m", 1.0), ("kg*m", 1.0), ("g*m", 1000.0)),
    "kg/m^3": (("kg/m^3", 1.0), ("kg/m**3", 1.0), ("g/l", 1.0), ("g/m^3", 1000.0), ("kg m^-3", 1.0)),
    "m/s": (("m/s", 1.0), ("km/h", 3.6), ("cm/s", 100.0), ("knot", 3600 / 1852)),
}


def write(folder: Path, content: Any) -> None:
    (folder / "campaign.toml").write_bytes(tomli_w.dumps(content).encode("utf-8", errors="surrogatepass"))


def start(rng: Generator, folder: Path, stock: Stock) -> tuple[str, Path, dict[str, Any]]:
    """Copy one of the two campaigns into the case."""
    motion = one(rng, ("heaving", "torsional"))
    return motion, folder / "case", stock.campaign(motion, folder / "case")


INTACT = 15  # one case in so many is not spoiled, and has to be accepted


def structure(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """Tables and keys dropped, renamed, doubled, retyped, nested, moved."""
    motion, place, content = start(rng, folder, stock)
    if number % INTACT == 0:
        write(place, content)
        return Case(f"campaign.toml ({motion}): intact", CHECK, ACCEPTED)
    about = []
    for _ in range(1 if number % 3 else 2):
        what, content = spoil_tree(rng, content)
        about.append(what)
    write(place, content)
    return Case(f"campaign.toml ({motion}): {'; '.join(about)}", CHECK, blames=BLAMES)


def values(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """A strange value in the place of a good one, or in the place of a quantity's number."""
    motion, place, content = start(rng, folder, stock)
    if number % INTACT == 0:
        write(place, content)
        return Case(f"campaign.toml ({motion}): intact", CHECK, ACCEPTED)
    where = one(rng, leaves(content))
    value = STRANGE[number % len(STRANGE)]
    old = get(content, where)
    if isinstance(old, str) and old[0].isdigit() and rng.random() < 0.5:
        text = one(
            rng, ("0", "-1", "nan", "inf", "1e300", "-1e300", "1e-300", "1e400", str(HUGE), "", "7,5", "1e", "--1")
        )
        value = f"{text} {old.split(' ', 1)[-1]}"
    write(place, put(content, where, value))
    blames = (*BLAMES, value) if where[-1] == "file" and isinstance(value, str) else BLAMES
    return Case(f"campaign.toml ({motion}): {spell(where)} = {str(value)[:40]!r}", CHECK, blames=blames)


def units(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """A strange unit; or the same quantity spelled otherwise, which must be read as the same."""
    motion, place, content = start(rng, folder, stock)
    where = one(rng, [at for at in leaves(content) if _has_unit(get(content, at))])
    size, unit = get(content, where).split(" ", 1)
    if number % 3 == 0:
        spelled, factor = one(rng, SAME[unit])
        text = one(rng, ("{:.12g} {}", " {:.12e}  {} ", "+{:.14g} {}")).format(float(size) * factor, spelled)
        write(place, put(content, where, text))
        return Case(
            f"campaign.toml ({motion}): {spell(where)} in {spelled}", CHECK, ACCEPTED, demand=_same(stock, motion)
        )
    spelled = UNITS[number % len(UNITS)]
    text = one(rng, ("{} {}", "{}{}", "{0} {1} +/- 0.1 {1}", "{0} +/- 1e400 {1}")).format(size, spelled)
    allowed = REFUSED if spelled in ("", "degC", "m/0", "kg", "bit", "USD", "__import__('os')") else ANY
    write(place, put(content, where, text))
    return Case(f"campaign.toml ({motion}): {spell(where)} = {text[:40]!r}", CHECK, allowed, BLAMES)


def _has_unit(value: object) -> bool:
    return isinstance(value, str) and value.partition(" ")[2] in SAME


def _same(stock: Stock, motion: str) -> Callable[[Run], str]:
    def demand(run: Run) -> str:
        import scruton

        ours, theirs = (scruton.load_campaign(at) for at in (run.folder / "case", stock.path(motion)))
        for one_of, other in (
            (ours.section, theirs.section),
            *zip((*ours.rigs, *ours.tests), (*theirs.rigs, *theirs.tests), strict=True),
        ):
            for name in ("width", "depth", "mass", "frequency", "air_density", "wind_speed"):
                found, wanted = (getattr(x, name, None) for x in (one_of, other))
                found, wanted = (getattr(x, "mean", x) for x in (found, wanted))
                if found is not None and abs(found / wanted - 1.0) > 1e-6:
                    return f"intact quantity misread\n{name}: {found} for {wanted}"
        return ""

    return demand


def text(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """Bytes flipped, cut, other encodings and line ends, lines of 20 MB."""
    motion, place, _ = start(rng, folder, stock)
    path = place / "campaign.toml"
    data = path.read_bytes()
    if number % 2:
        about, data = spoil_bytes(rng, data)
        allowed = ANY
    else:
        about, spoiled, allowed = TEXTS[number // 2 % len(TEXTS)]
        data = spoiled(data, rng)
    path.write_bytes(data)
    return Case(f"campaign.toml ({motion}): text, {about}", CHECK, allowed, BLAMES)


def _lines(data: bytes, rng: Generator, how: str) -> bytes:
    lines = data.splitlines(keepends=True)
    here, there = (int(i) for i in rng.integers(len(lines), size=2))
    if how == "drop":
        del lines[here]
    elif how == "double":
        lines.insert(there, lines[here])
    else:
        lines[here], lines[there] = lines[there], lines[here]
    return b"".join(lines)


TEXTS: tuple[tuple[str, Callable[[bytes, Generator], bytes], frozenset[int]], ...] = (
    ("with a byte-order mark", lambda d, _: b"\xef\xbb\xbf" + d, ACCEPTED),
    ("with CR LF", lambda d, _: d.replace(b"\n", b"\r\n"), ACCEPTED),
    ("with CR alone", lambda d, _: d.replace(b"\n", b"\r"), REFUSED),
    ("in UTF-16", lambda d, _: d.decode().encode("utf-16"), REFUSED),
    ("a line dropped", lambda d, r: _lines(d, r, "drop"), ANY),
    ("in Latin-1 with an umlaut", lambda d, _: d.replace(b"simulated", "gemäß".encode("latin-1")), REFUSED),
    ("a line of 20 MB", lambda d, _: d.replace(b"simulated", b"x" * 20_000_000), ANY),
    ("a line doubled", lambda d, r: _lines(d, r, "double"), ANY),
    ("a comment of 20 MB", lambda d, _: b"#" + b"x" * 20_000_000 + b"\n" + d, ANY),
    ("an integer of 5,000 digits", lambda d, _: d.replace(b"format = 1", b"format = " + b"1" * 5000), REFUSED),
    ("an integer of 400 digits", lambda d, _: d.replace(b"format = 1", b"format = " + b"1" * 400), REFUSED),
    ("two lines swapped", lambda d, r: _lines(d, r, "swap"), ANY),
    ("deep nesting", lambda d, _: b"x = " + b"[" * 5000 + b"]" * 5000 + b"\n" + d, REFUSED),
    ("deep tables", lambda d, _: d + b"[" + b"a." * 3000 + b"a]\n", REFUSED),
    ("empty", lambda _d, _r: b"", REFUSED),
    ("nothing but NUL", lambda _d, _r: bytes(1000), REFUSED),
    ("random bytes", lambda _d, r: r.bytes(3000), REFUSED),
    ("10,000 tests", lambda d, _: d + b'[[tests]]\nname = "x"\n' * 10_000, REFUSED),
    (
        "ESC in a title",
        lambda d, _: d.replace(b"simulated", b"\\u001b[31mred\\u001b[0m").replace(b"Fuzz, ", b"\\u001b[31m"),
        ANY,
    ),
    ("ESC in a name", lambda d, _: d.replace(b"light in wind", b"\\u001b[31mlight"), ANY),
    ("a raw ESC", lambda d, _: d.replace(b"simulated", b"\x1b[31m"), REFUSED),
    ("Chinese names", lambda d, _: d.replace(b'"light', '"輕'.encode()).replace("輕-".encode(), b"light-"), ANY),
    ("a date for a depth", lambda d, _: d.replace(b'depth = "', b'depth = 2024-02-29 #"'), REFUSED),
)
