"""`criticise`: what it writes, what it says, and what it refuses."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from scruton.app import criticise as verb
from scruton.app.criticise import criticism_text, verdict
from scruton.cli import main, parser
from scruton.documents import write_document
from scruton.errors import InputError
from scruton.infer.criticism import Criticism, Flag, criticise_tree
from scruton.infer.result_schema import EXAMINED_LIKELIHOOD
from scruton.report.figures import figures_from
from scruton.workspace import digest

FIGURES = {"innovations", "posterior_predictive", "prior_predictive", "what_moved_the_posterior", "influence"}


def criticise(results: Path, *options: object) -> tuple[str, bool, tuple[Path, ...]]:
    """Text, trust and files of the verb."""
    outcome = verb.run(parser().parse_args(["criticise", str(results), *map(str, options)]))
    (text,) = outcome.paths
    files = (path for path in sorted(text.parent.rglob("*")) if path.is_file() and ".scruton" not in path.parts)
    return text.read_text(encoding="utf-8").removesuffix("\n"), outcome.code == 0, tuple(files)


def put_innovations(folder: Path, *, bend: float = 0.0) -> None:
    """Write white innovations into a folder of results, or such as bend with the amplitude."""
    from scruton.infer.store import read_tree

    tree, _ = read_tree(folder)
    amplitude = tree["observed_data"]["amplitude"].to_numpy()
    values = np.random.default_rng(4).standard_normal(amplitude.size)
    values[1:] += bend * ((amplitude[:-1] - amplitude.mean()) / amplitude.std()) ** 2
    tree["innovations"] = xr.DataTree(xr.Dataset({"amplitude": ("cycle", values)}))
    write_tree(tree, folder)


def write_tree(tree: xr.DataTree, folder: Path) -> None:
    """Replace the posterior in a folder of results, as if the fit had given this one."""
    tree.to_netcdf(folder / "posterior.nc", engine="netcdf4")
    summary = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    write_document(folder / "fit.json", summary | {"files": {"posterior.nc": digest(folder / "posterior.nc")}})


@pytest.fixture(scope="module")
def results(small_results: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("criticised") / "fit"
    shutil.copytree(small_results, folder)
    put_innovations(folder)
    return folder


@pytest.fixture(scope="module")
def written(results: Path) -> tuple[str, bool, tuple[Path, ...]]:
    return criticise(results)


def test_a_good_fit_is_let_pass_and_everything_is_written(results: Path, written: tuple[str, bool, Any]) -> None:
    text, ok, paths = written
    assert ok
    verdict = text.splitlines()[1]
    assert verdict in ("Nothing found.", "Nothing found in the checks that could be made.") or "none of them" in verdict
    assert all(path.is_file() and path.is_relative_to(results / "criticism") for path in paths)
    assert {path.stem for path in paths if path.suffix == ".png"} == FIGURES
    assert {path.stem for path in paths if path.suffix == ".svg"} == FIGURES
    content = json.loads((results / "criticism" / "criticism.json").read_text(encoding="utf-8"))
    assert content["ok"]
    frame = pd.read_csv(results / "criticism" / "tables" / "posterior_predictive.csv")
    assert len(frame) == len(content["posterior_predictive"]) == 2 * 5
    assert frame["p"].between(0.0, 1.0).all()
    assert (results / "criticism" / "criticism.txt").read_text(encoding="utf-8") == text + "\n"
    assert not list((results / "criticism").rglob("*.tmp"))


def test_the_fit_itself_is_left_alone(results: Path, written: tuple[str, bool, Any]) -> None:
    assert (results / "posterior.nc").is_file()
    with pytest.raises(InputError, match="the folder of the fit itself"):
        criticise(results, "-o", results, "--force")
    assert (results / "posterior.nc").is_file()


def test_an_earlier_criticism_is_replaced_only_when_asked(
    results: Path, written: tuple[str, bool, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scruton.app.criticise._figures", lambda *_: [])
    with pytest.raises(InputError, match="results of an earlier run"):
        criticise(results)
    shutil.copytree(results / "criticism", tmp_path / "earlier")
    _, _, paths = criticise(results, "-o", tmp_path / "earlier", "--force")
    before, after = (one for files in (written[2], paths) for one in files if one.name == "criticism.json")
    assert after.read_bytes() == before.read_bytes()
    assert not (tmp_path / "earlier" / "figures").exists()


def test_a_wrong_law_is_not_to_be_trusted(small_results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scruton.app.criticise._figures", lambda *_: [])
    shutil.copytree(small_results, tmp_path / "fit")
    put_innovations(tmp_path / "fit", bend=1.5)
    text, ok, _ = criticise(tmp_path / "fit", "-o", tmp_path / "out")
    assert not ok
    assert "NOT TO BE TRUSTED" in text.splitlines()[1]
    assert "the law of damping has another shape" in text
    assert "SERIOUS" in text


def test_a_folder_without_a_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"posterior\.nc: found no such file"):
        criticise(tmp_path)


def test_a_campaign_of_still_air_alone_is_refused(results: Path, tmp_path: Path) -> None:
    from scruton.infer.store import read_tree

    tree, _ = read_tree(results)
    shutil.copy(results / "fit.json", tmp_path)
    write_tree(tree.filter(lambda node: node.name in (None, "rig_posterior")), tmp_path)
    with pytest.raises(InputError, match="without tests in wind"):
        criticise(tmp_path)


def test_a_negative_seed_is_refused(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["criticise", str(results), "--seed", "-1"]) == 2
    assert "--seed" in capsys.readouterr().err


def empty(*flags: Flag, missing: tuple[str, ...] = ()) -> Criticism:
    return Criticism((), (), (), (), (), (), (), missing, flags)


def test_the_verdict_counts() -> None:
    look, serious = Flag("influence", "t, r", "a"), Flag("innovations", "t, r", "b", True)
    assert verdict(empty()) == "Nothing found."
    assert verdict(empty(missing=("x",))) == "Nothing found in the checks that could be made."
    assert verdict(empty(look)) == "1 thing to look at, none of them serious."
    assert verdict(empty(look, serious)).startswith("2 things to look at, 1 of them serious: NOT TO BE TRUSTED")
    assert not empty(look, serious).ok
    text = criticism_text(empty(look, serious, missing=("influence: one record",)), "A campaign")
    assert text.index("SERIOUS, t, r: b") < text.index("t, r: a")
    assert "Not checked\n  influence: one record" in text


def several(tree: xr.DataTree, count: int) -> xr.DataTree:
    """Repeat the only test of a fit under other names, cycles and all."""
    names = [f"test {i + 1}" for i in range(count)]
    found: dict[str, Any] = {}
    for name in ("posterior", "prior", "examined"):
        group = tree[name].to_dataset()
        found[name] = xr.concat([group.assign_coords(test=[one]) for one in names], dim="test")
    likelihood = tree[EXAMINED_LIKELIHOOD].to_dataset()
    pointwise, steady = likelihood[["amplitude"]], likelihood[["steady"]]
    found[EXAMINED_LIKELIHOOD] = xr.merge(
        [
            xr.concat([pointwise] * count, dim="cycle"),
            xr.concat([steady.assign_coords(test=[one]) for one in names], dim="test"),
        ]
    )
    for name in ("posterior_predictive", "observed_data", "innovations"):
        found[name] = xr.concat([tree[name].to_dataset()] * count, dim="cycle")
    constant = tree["constant_data"].to_dataset()
    own = {str(key): (one.dims, np.tile(one.to_numpy(), count if one.dims else 1)) for key, one in constant.items()}
    own = {key: (dims, values if dims else values.item()) for key, (dims, values) in own.items()}
    own["record_test"] = (("cycle",), np.repeat(names, constant.sizes["cycle"]))
    found["constant_data"] = xr.Dataset(own).assign_coords(test=names)
    return xr.DataTree.from_dict({f"/{name}": one for name, one in found.items()})


def test_a_long_campaign_takes_several_pages_and_unique_names(results: Path) -> None:
    from scruton.infer.store import read_tree

    tree, summary = read_tree(results)
    longer = several(tree, 5)
    figures = figures_from("criticism", longer, criticise_tree(longer, summary))
    names = [one.name for one in figures]
    assert len(names) == len(set(names))
    assert {"innovations", "innovations_2", "innovations_3", "what_moved_the_posterior_2"} <= set(names)
    assert all(one.caption and one.alt for one in figures)
