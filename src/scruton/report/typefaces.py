"""The typefaces that everything is set in: files of packages that scruton depends on, never those of the machine.

DejaVu Sans comes with matplotlib and holds Latin, Greek, Cyrillic, Arabic, Hebrew and mathematics; Noto Sans CJK
(noto-cjk-sans-otc) Chinese, Japanese and Korean; the others of Noto (manimgx-fonts) the scripts of southern Asia,
Ethiopia and the Caucasus, symbols and emoji. What none of them holds is drawn by the Last Resort font, a frame that
shows which script the letter belongs to.
"""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

SCRIPTS = (
    "Armenian", "Bengali", "Devanagari", "Ethiopic", "Georgian", "Gujarati", "Gurmukhi", "Kannada", "Khmer", "Lao",
    "Malayalam", "Myanmar", "Oriya", "Sinhala", "Tamil", "Telugu", "Thai",
)  # fmt: skip
PLAIN, LAST_RESORT = "DejaVu Sans", "Last Resort High-Efficiency"
# The collection holds the same letters in five regional forms; bridges of this kind are tested in China above all.
CJK, CJK_INDEX = "Noto Sans CJK SC", 2


@dataclass(frozen=True)
class Typeface:
    """One face of a file: family as the file names itself, place in a collection, weight (400 regular, 700 bold)."""

    family: str
    path: Path
    index: int = 0
    weight: int = 400
    style: str = "normal"  # or "oblique"


@cache
def typefaces() -> tuple[Typeface, ...]:
    """Every face, in the order in which they are asked for a letter; only the first family has bold and oblique."""
    plain = _folder("matplotlib") / "mpl-data" / "fonts" / "ttf"
    noto = _folder("manimgx_fonts")
    return (
        Typeface(PLAIN, plain / "DejaVuSans.ttf"),
        Typeface(PLAIN, plain / "DejaVuSans-Bold.ttf", weight=700),
        Typeface(PLAIN, plain / "DejaVuSans-Oblique.ttf", style="oblique"),
        Typeface(PLAIN, plain / "DejaVuSans-BoldOblique.ttf", weight=700, style="oblique"),
        Typeface(CJK, _folder("noto_cjk_sans_otc") / "NotoSansCJK-Regular.ttc", CJK_INDEX),
        *(Typeface(f"Noto Sans {script}", noto / f"NotoSans{script}[wght].ttf") for script in SCRIPTS),
        Typeface("Noto Sans Symbols", noto / "NotoSansSymbols[wght].ttf"),
        Typeface("Noto Emoji", noto / "NotoEmoji[wght].ttf"),
        Typeface(LAST_RESORT, plain / "LastResortHE-Regular.ttf"),
    )


def families() -> tuple[str, ...]:
    """Name of every family, in the order of `typefaces`."""
    return tuple(dict.fromkeys(face.family for face in typefaces()))


def _folder(package: str) -> Path:
    """Folder of a package, which need not be imported for it."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(f"the package {package} is not installed, which scruton depends on for its typefaces")
    return Path(spec.origin).parent


def subsets(text: str) -> Iterator[tuple[str, bytes]]:
    """What a reader's machine may lack of a text: its letters beyond DejaVu Sans, by typeface, in order, each once.

    With each a small OpenType file of these letters alone: the same text gives the same bytes. Letters that no typeface
    holds are left to the reader's machine.
    """
    missing = {letter for letter in set(text) if letter.isprintable()}
    # one face of every family that has pictures of letters
    for face in typefaces():
        if not missing:
            break
        if (face.weight, face.style) != (400, "normal") or face.family == LAST_RESORT:
            continue
        known = _letters(face)
        if face.family != PLAIN and (letters := "".join(sorted(missing & known))):
            yield letters, _subset(face, letters)
        missing -= known


@cache
def _letters(face: Typeface) -> frozenset[str]:
    """Letters that a face holds."""
    from fontTools.ttLib import TTFont

    with TTFont(face.path, fontNumber=face.index, lazy=True) as font:
        return frozenset(map(chr, font.getBestCmap()))


def _subset(face: Typeface, letters: str) -> bytes:
    """A face with these letters alone."""
    from fontTools.subset import Options, Subsetter
    from fontTools.ttLib import TTFont

    options = Options(notdef_outline=True, name_IDs=[], hinting=False, desubroutinize=True)
    options.drop_tables += ["fvar", "gvar", "avar", "HVAR", "MVAR", "STAT"]  # the regular weight is enough
    with TTFont(face.path, fontNumber=face.index, lazy=True, recalcTimestamp=False) as font:
        subsetter = Subsetter(options)
        subsetter.populate(text=letters)
        subsetter.subset(font)
        content = io.BytesIO()
        font.save(content)
    return content.getvalue()
