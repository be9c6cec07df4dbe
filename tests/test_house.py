"""The house stays in order: files that a reader can hold in the head, short signatures, no circle of files."""

import ast
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src"
LINES, PARAMETERS = 400, 8

FILES = {".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): path
         for path in sorted((SOURCE / "scruton").rglob("*.py"))}  # fmt: skip


def parsed(text: str) -> ast.Module:
    """The program without what only the type checker reads."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            node.body = [ast.Pass()]
    return tree


def imported(text: str) -> set[str]:
    """Modules of the package that a file imports, inside functions, too."""
    found = set()
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in FILES else node.module for name in whole}
    return found & set(FILES)


def circle(texts: Mapping[str, str]) -> list[str]:
    """Names of files that import each other in a circle; none where there is no such circle."""
    try:
        list(TopologicalSorter({name: imported(text) - {name} for name, text in texts.items()}).static_order())
    except CycleError as error:
        return list(error.args[1])
    return []


def crowded(text: str) -> Iterator[str]:
    """Names of functions with too many parameters, but for compiled kernels."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and "njit" not in "".join(map(ast.unparse, node.decorator_list)):
            own = node.args
            count = sum(one.arg not in ("self", "cls") for one in (*own.posonlyargs, *own.args, *own.kwonlyargs))
            if count > PARAMETERS:
                yield node.name


def texts() -> dict[str, str]:
    return {name: path.read_text(encoding="utf-8") for name, path in FILES.items()}


def test_files_import_in_no_circle() -> None:
    assert circle(texts()) == []


def test_a_circle_would_be_seen() -> None:
    lines = "def later():\n    from scruton.{} import x\n"
    there, back = "app.predict", "app.options"
    assert circle({f"scruton.{there}": lines.format(back), f"scruton.{back}": lines.format(there)})


@pytest.mark.parametrize("name", FILES)
def test_a_file_can_be_held_in_the_head(name: str) -> None:
    text = FILES[name].read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LINES
    assert list(crowded(text)) == []


def test_a_long_signature_would_be_seen() -> None:
    arguments = ", ".join("abcdefghi")
    assert list(crowded(f"def f({arguments}): ...")) == ["f"]
    assert list(crowded(f"@njit(cache=True)\ndef f({arguments}): ...")) == []


def powers(text: str) -> Iterator[str]:
    """Whole powers in compiled kernels: a product or a call of pow, as the order of compilation has it."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and "njit" in "".join(map(ast.unparse, node.decorator_list)):
            found = (part for part in ast.walk(node) if isinstance(part, ast.BinOp) and isinstance(part.op, ast.Pow))
            yield from (f"{node.name}: {ast.unparse(one)}" for one in found if isinstance(one.right, ast.Constant))


@pytest.mark.parametrize("name", FILES)
def test_kernels_write_squares_as_products(name: str) -> None:
    assert list(powers(FILES[name].read_text(encoding="utf-8"))) == []


def test_a_square_would_be_seen() -> None:
    assert list(powers("@njit\ndef f(x):\n    return x ** 2")) == ["f: x ** 2"]
