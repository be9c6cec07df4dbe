"""Formulae written once: one expression gives MathML for the screen, Typst for print and LaTeX to paste."""

from dataclasses import dataclass
from html import escape

_GREEK = {
    "alpha": "α", "beta": "β", "epsilon": "ε", "lambda": "λ", "omega": "ω", "pi": "π", "rho": "ρ", "sigma": "σ",
    "tau": "τ", "xi": "ξ",
}  # fmt: skip
_SIGNS = {  # sign: MathML, Typst, LaTeX
    "=": ("=", "=", "="),
    "+": ("+", "+", "+"),
    "-": ("−", "-", "-"),
    "/": ("/", "\\/", "/"),
    "(": ("(", "(", "("),
    ")": (")", ")", ")"),
    "[": ("[", "[", "["),
    "]": ("]", "]", "]"),
    ",": (",", ",", ","),
    "<": ("<", "<", "<"),
    "|": ("|", "|", "|"),
}


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
    found = [
        _SIGN if one == "-" and (i == 0 or parts[i - 1] in ("=", "(", "[")) else _of(one) for i, one in enumerate(parts)
    ]
    return Maths(
        f"<mrow>{''.join(one.mathml for one in found)}</mrow>",
        " ".join(one.typst for one in found),
        " ".join(one.latex for one in found),
    )


def frac(above: Part, below: Part) -> Maths:
    """A fraction."""
    a, b = _of(above), _of(below)
    return Maths(
        f"<mfrac>{a.mathml}{b.mathml}</mfrac>", f"frac({a.typst}, {b.typst})", rf"\frac{{{a.latex}}}{{{b.latex}}}"
    )


def sub(base: Part, index: Part) -> Maths:
    """A symbol with an index."""
    a, b = _of(base), _of(index)
    return Maths(f"<msub>{a.mathml}{b.mathml}</msub>", f"{a.typst}_({b.typst})", f"{a.latex}_{{{b.latex}}}")


def power(base: Part, exponent: Part) -> Maths:
    """A power."""
    a, b = _of(base), _of(exponent)
    return Maths(f"<msup>{a.mathml}{b.mathml}</msup>", f"{a.typst}^({b.typst})", f"{a.latex}^{{{b.latex}}}")


def star(base: Part) -> Maths:
    """A symbol with an asterisk: a stable amplitude."""
    a = _of(base)
    return Maths(f"<msup>{a.mathml}<mo>*</mo></msup>", f"{a.typst}^(*)", f"{a.latex}^{{*}}")


def prime(base: Part) -> Maths:
    """A symbol with a prime: another setting."""
    a = _of(base)
    return Maths(f"<msup>{a.mathml}<mo>′</mo></msup>", f"{a.typst}'", f"{a.latex}'")


def dot(base: Part) -> Maths:
    """A rate of change."""
    a = _of(base)
    return Maths(f'<mover accent="true">{a.mathml}<mo>˙</mo></mover>', f"dot({a.typst})", rf"\dot{{{a.latex}}}")


def display(maths: Maths) -> str:
    """MathML of a displayed equation, with its LaTeX for whoever copies it."""
    return _math(maths, ' display="block"')


def inline(maths: Maths) -> str:
    """MathML of a formula in a line of text."""
    return _math(maths, "")


def _math(maths: Maths, attributes: str) -> str:
    note = f'<annotation encoding="application/x-tex">{escape(maths.latex)}</annotation>'
    return f"<math{attributes}><semantics><mrow>{maths.mathml}</mrow>{note}</semantics></math>"


def _of(part: Part) -> Maths:
    if isinstance(part, Maths):
        return part
    if part in _SIGNS:
        mathml, typst, latex = _SIGNS[part]
        if part in "[](" or part in ")|":
            # Brackets keep the size they are given: those of the three languages would each grow by rules of their own.
            return Maths(f"<mo>{mathml}</mo>", f"\\{typst}" if part != "|" else "bar.v", latex)
        return Maths(f"<mo>{escape(mathml)}</mo>", typst, latex)
    if part in _GREEK:
        return Maths(f"<mi>{_GREEK[part]}</mi>", part, f"\\{'varepsilon' if part == 'epsilon' else part}")
    if part.replace(".", "").isdigit():
        return Maths(f"<mn>{part}</mn>", part, part)
    if len(part) == 1:
        return Maths(f"<mi>{escape(part)}</mi>", part, part)
    return Maths(f'<mi mathvariant="normal">{escape(part)}</mi>', f'"{part}"', rf"\mathrm{{{part}}}")


def bracket(*parts: Part) -> Maths:
    """Square brackets as high as what they hold."""
    a = row(*parts)
    return Maths(f"<mrow><mo>[</mo>{a.mathml}<mo>]</mo></mrow>", f"lr([{a.typst}])", rf"\left[{a.latex}\right]")


def paren(*parts: Part) -> Maths:
    """Round brackets as high as what they hold."""
    a = row(*parts)
    return Maths(f"<mrow><mo>(</mo>{a.mathml}<mo>)</mo></mrow>", f"lr(({a.typst}))", rf"\left({a.latex}\right)")


def differential(symbol: Part) -> Maths:
    """An upright d and its symbol."""
    a = _of(symbol)
    return Maths(f'<mrow><mi mathvariant="normal">d</mi>{a.mathml}</mrow>', f"dif {a.typst}", rf"\mathrm{{d}}{a.latex}")
