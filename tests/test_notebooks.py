"""The notebooks run, cell by cell, in the order in which they are read."""

import json
import re
import shutil
from functools import partial
from operator import attrgetter
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import scruton
from tests.conftest import CARD

ROOT = Path(__file__).resolve().parents[1]
BOOKS = ROOT / "docs/notebooks"
ORDER = ("griffin", "damper")  # the second reads what the first wrote
CALLED = re.compile(r"\bscruton((?:\.\w+)+)\(")


def cells(name: str) -> list[str]:
    content = json.loads((BOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert content["nbformat"] == 4
    return ["".join(cell["source"]) for cell in content["cells"] if cell["cell_type"] == "code"]


def run(name: str) -> dict[str, object]:
    """Run every cell in one namespace, as a kernel does."""
    space: dict[str, object] = {"__name__": "__main__"}
    for i, code in enumerate(cells(name)):
        exec(compile(code, f"{name}.ipynb, cell {i}", "exec"), space)
    return space


def test_every_notebook_is_run():
    assert {path.stem for path in BOOKS.glob("*.ipynb")} == set(ORDER)


@pytest.mark.parametrize("name", ORDER)
def test_what_a_notebook_calls_is_there(name):
    called = CALLED.findall("\n".join(cells(name)))
    assert called
    for words in called:
        assert callable(attrgetter(words[1:])(scruton)), words


@pytest.fixture(
    scope="module",
    params=[pytest.param("quick", marks=pytest.mark.thorough), pytest.param("default", marks=pytest.mark.slow)],
)
def left(request, tmp_path_factory):
    """What the notebooks leave in their names, run beside a copy of the example; under a quick card, or as they are."""
    place = tmp_path_factory.mktemp("notebooks")
    (place / "quick.toml").write_text(CARD, encoding="utf-8")
    card = "default" if request.param == "default" else place / "quick.toml"
    shutil.copytree(ROOT / "examples/rectangle-4to1", place / "examples/rectangle-4to1")
    if request.param == "quick":  # and of one mode
        bridge = place / "examples/rectangle-4to1/bridge.toml"
        top, _, second = bridge.read_text(encoding="utf-8").split("[[modes]]")
        bridge.write_text(f"{top}[[modes]]{second}", encoding="utf-8")
    (place / "docs/notebooks").mkdir(parents=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place / "docs/notebooks")
        patch.setattr(plt, "show", lambda *_: None)
        patch.setattr(scruton, "fit", partial(scruton.fit, card=card))
        plt.switch_backend("agg")
        # sizings take the time: of the second notebook, as it is
        spaces = {name: run(name) for name in (ORDER if request.param == "default" else ORDER[:1])}
        plt.close("all")
    return spaces


def test_the_griffin_plot_of_the_notebook_holds_the_truth(left):
    fit, design = left["griffin"]["fit"], left["griffin"]["design"]
    assert fit.converged
    assert left["griffin"]["found"].problems == ()
    low, high = fit.summary["tests"][0]["parameters"]["a_star"]["interval"]["0.95"]
    assert low < 0.0292 < high  # Table 5
    assert 0.01 < design.interval(0.9)[0] < design.median < design.interval(0.9)[1] < 0.05


@pytest.mark.slow
def test_a_stricter_limit_asks_for_more(left):
    if "damper" not in left:
        pytest.skip("run under the default card alone")
    for before, after in zip(left["damper"]["sizing"].modes, left["damper"]["stricter"].modes, strict=True):
        ours, theirs = (one.governing_limit.required["0.95"] for one in (before, after))
        assert ours < theirs
        assert after.governing_limit.limit == pytest.approx(0.05)
