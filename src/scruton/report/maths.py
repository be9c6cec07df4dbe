"""Formulae written once: one expression gives MathML for the screen, Typst for print and LaTeX to paste."""

from collections.abc import Callable
from dataclasses import dataclass
from html import escape

_GREEK = {
    "alpha": "α", "beta": "β", "epsilon": "ε", "lambda": "λ", "omega": "ω", "pi": "π", "rho": "ρ", "sigma": "σ",
    "tau": "τ", "xi": "ξ",
}  # fmt: skip


@dataclass(frozen=True)
class Maths:
    """A formula in three languages that say the same."""

    mathml: str
    typst: str
    latex: str


Part = Maths | str
_SIGN = Maths('<mo form="prefix">−</mo>', "-", "-")  # of a negative number, which stands close to it


def row(*parts: Part) -> Maths:
    """Parts one after the other; a string is a sign, a number, a Greek name, a letter or an upright word."""
    formulae = [
        _SIGN if p == "-" and (i == 0 or parts[i - 1] in ("=", "(", "[")) else _of(p) for i, p in enumerate(parts)
    ]
    return Maths(
        f"<mrow>{''.join(formula.mathml for formula in formulae)}</mrow>",
        " ".join(formula.typst for formula in formulae),
        " ".join(formula.latex for formula in formulae),
    )


def _form(mathml: str, typst: str, latex: str, *, fence: bool = False) -> Callable[..., Maths]:
    """A construction of one part or two, or around a whole row, from its form in each language."""

    def formed(*parts: Part) -> Maths:
        of = [row(*parts)] if fence else [_of(part) for part in parts]
        return Maths(
            mathml.format(*(formula.mathml for formula in of)),
            typst.format(*(formula.typst for formula in of)),
            latex.format(*(formula.latex for formula in of)),
        )

    return formed


frac = _form("<mfrac>{}{}</mfrac>", "frac({}, {})", r"\frac{{{}}}{{{}}}")
sub = _form("<msub>{}{}</msub>", "{}_({})", "{}_{{{}}}")
power = _form("<msup>{}{}</msup>", "{}^({})", "{}^{{{}}}")
star = _form("<msup>{}<mo>*</mo></msup>", "{}^(*)", "{}^{{*}}")  # a stable amplitude
prime = _form("<msup>{}<mo>′</mo></msup>", "{}'", "{}'")  # another setting
dot = _form('<mover accent="true">{}<mo>˙</mo></mover>', "dot({})", r"\dot{{{}}}")  # a rate of change
differential = _form('<mrow><mi mathvariant="normal">d</mi>{}</mrow>', "dif {}", r"\mathrm{{d}}{}")
# Brackets as high as what they hold.
bracket = _form("<mrow><mo>[</mo>{}<mo>]</mo></mrow>", "lr([{}])", r"\left[{}\right]", fence=True)
paren = _form("<mrow><mo>(</mo>{}<mo>)</mo></mrow>", "lr(({}))", r"\left({}\right)", fence=True)


def mathml(maths: Maths, attributes: str = "") -> str:
    """MathML of a formula in a line of text, with its LaTeX for whoever copies it."""
    note = f'<annotation encoding="application/x-tex">{escape(maths.latex)}</annotation>'
    return f"<math{attributes}><semantics><mrow>{maths.mathml}</mrow>{note}</semantics></math>"


def display(maths: Maths) -> str:
    """MathML of a displayed equation."""
    return mathml(maths, ' display="block"')


def _of(part: Part) -> Maths:
    if isinstance(part, Maths):
        return part
    if part in "[]()|":
        # Brackets keep the size they are given: those of the three languages would each grow by rules of their own.
        return Maths(f"<mo>{part}</mo>", f"\\{part}" if part != "|" else "bar.v", part)
    if part in "=+-/,<":
        return Maths(f"<mo>{escape(part.replace('-', '−'))}</mo>", part.replace("/", "\\/"), part)
    if part in _GREEK:
        return Maths(f"<mi>{_GREEK[part]}</mi>", part, f"\\{'varepsilon' if part == 'epsilon' else part}")
    if part.replace(".", "").isdigit():
        return Maths(f"<mn>{part}</mn>", part, part)
    if len(part) == 1:
        return Maths(f"<mi>{escape(part)}</mi>", part, part)
    return Maths(f'<mi mathvariant="normal">{escape(part)}</mi>', f'"{part}"', rf"\mathrm{{{part}}}")
