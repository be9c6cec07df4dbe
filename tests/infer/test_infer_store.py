"""Results come back from disk as they went there: the same fit, for every table, figure and verb."""

import json
import sys
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import scruton
from scruton.campaign import load_campaign
from scruton.errors import InputError
from scruton.griffin import predict
from scruton.infer.cards import ModelCard, load_card
from scruton.infer.fit import fit_campaign
from scruton.infer.result_schema import MODEL, SCHEMA, dataset, faults
from scruton.infer.store import POSTERIOR, SUMMARY, pack, read_draws, read_tree, unpack, write_fit
from scruton.infer.stored import Stored
from scruton.report.figures import all_figures, save
from scruton.report.figures.griffin import griffin_plot
from scruton.report.figures.records import record_figures
from scruton.report.tables import tables
from tests.report.fake_fit import fake_fit


def same(one, other, where="it"):
    """Whether two values are equal, dataclasses field by field and arrays number by number."""
    if is_dataclass(one):
        assert type(one) is type(other), where
        for field in fields(one):
            same(getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}")
    elif isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other, err_msg=where)
    elif isinstance(one, tuple):
        assert len(one) == len(other), where
        for i, pair in enumerate(zip(one, other, strict=True)):
            same(*pair, f"{where}[{i}]")
    elif isinstance(one, partial):
        assert (one.func, one.args, one.keywords) == (other.func, other.args, other.keywords), where
    elif isinstance(one, Path):
        assert one.name == other.name, where
    elif isinstance(one, float) and np.isnan(one):
        assert np.isnan(other), where
    else:
        assert one == other, where


@pytest.fixture(scope="module")
def written(small_campaign, tmp_path_factory):
    """A fit under two laws as it was made, and its folder."""
    card = replace(load_card(), laws=(-1.0, 2.0), law_weights=(0.8, 0.2))
    card = replace(card, sampler=replace(card.sampler, ensembles=2, walkers=64, draws=16, min_ess=100, max_rhat=1.1))
    fit = fit_campaign(load_campaign(small_campaign), card, seed=3, asked={"command": "fit"})
    folder = tmp_path_factory.mktemp("written")
    write_fit(fit, folder)
    return fit, folder


@pytest.fixture(scope="module")
def both(written):
    fit, folder = written
    return fit, scruton.load_fit(folder)


def test_a_fit_comes_back_whole(both):
    fit, back = both
    assert back.tree.identical(fit.tree)
    assert back.summary == json.loads(json.dumps(fit.summary)) | {k: back.summary[k] for k in ("files", "checksum")}
    pd.testing.assert_frame_equal(back.convergence, fit.convergence)
    assert (back.flags, back.converged) == (fit.flags, fit.converged)
    same(back.campaign, fit.campaign)
    assert back.card == fit.card
    for name in ("cycles", "ringdowns", "front_ends"):
        ours, theirs = getattr(fit, name), getattr(back, name)
        assert list(ours) == list(theirs)
        for key in ours:
            same(ours[key], theirs[key], f"{name}[{key}]")


def few_figures(fit):
    """Of the draws, of the records, of the front ends; drawing all of them is what takes the time."""
    return [griffin_plot(fit), *record_figures(fit)]


def test_the_file_is_that_of_xarray(written, tmp_path):
    """Which takes longer over it: the same groups, variables, attributes, and how each variable is kept."""
    fit, folder = written
    fit.tree.to_netcdf(tmp_path / "theirs.nc", engine="netcdf4")
    theirs, ours = (xr.load_datatree(path) for path in (tmp_path / "theirs.nc", folder / POSTERIOR))
    xr.testing.assert_identical(theirs, ours)
    for place in theirs.groups:
        for name, variable in theirs[place].variables.items():
            one, other = (dict(each.encoding) for each in (variable, ours[place].variables[name]))
            assert repr(one | {"source": ""}) == repr(other | {"source": ""}), name


@pytest.mark.parametrize("drawn_by", [few_figures, pytest.param(all_figures, marks=pytest.mark.slow)])
def test_tables_and_figures_are_the_same(both, tmp_path, drawn_by):
    fit, back = both
    ours, theirs = tables(fit), tables(back)
    assert list(ours) == list(theirs)
    for name, frame in ours.items():
        pd.testing.assert_frame_equal(theirs[name], frame)
    drawn = {}
    for where, one in (("made", fit), ("loaded", back)):
        figures = list(drawn_by(one))
        paths = [path for figure in figures for path in save(figure, tmp_path / where, formats=("svg",))]
        drawn[where] = {path.name: path.read_bytes() for path in paths}, [figure.caption for figure in figures]
    assert drawn["made"][0]
    assert drawn["made"] == drawn["loaded"]


def test_nothing_of_the_laboratory_is_read_again(written, monkeypatch):
    _, folder = written

    def refuse(*_):
        raise AssertionError("an envelope was computed")

    monkeypatch.setattr("scruton.infer.front.record_cycles", refuse)
    monkeypatch.setattr("scruton.campaign.load.load_campaign", refuse)
    back = scruton.load_fit(folder)
    assert list(back.cycles), "envelopes are computed when they are asked for, not before"
    with pytest.raises(AssertionError, match="computed"):
        next(iter(back.cycles.values()))


def test_where_the_campaign_lay_is_not_kept(both, small_campaign):
    fit, back = both
    assert str(small_campaign) not in fit.tree["inputs"]["document"].item()
    assert {str(record.path) for test in back.campaign.tests for record in test.records} == {"growth.csv", "decay.csv"}


def test_an_earlier_fit_is_refused_by_name(written, tmp_path):
    fit, _ = written
    groups = {f"/{name}": node.to_dataset() for name, node in fit.tree.children.items() if name != "inputs"}
    write_fit(replace(fit, tree=xr.DataTree.from_dict(groups)), tmp_path)
    read_tree(tmp_path)  # what needs the draws alone still works
    with pytest.raises(InputError, match=f"{POSTERIOR}.*do not hold the campaign"):
        scruton.load_fit(tmp_path)


def test_a_tree_of_another_layout_is_refused(written, tmp_path):
    fit, _ = written
    groups = {f"/{name}": node.to_dataset() for name, node in fit.tree.children.items()}
    groups["/laws"] = groups["/laws"].drop_vars("weight")
    write_fit(replace(fit, tree=xr.DataTree.from_dict(groups)), tmp_path)
    assert (tmp_path / SUMMARY).is_file()
    with pytest.raises(InputError, match="group laws lacks weight"):
        read_tree(tmp_path)
    drawn = Stored(tmp_path / POSTERIOR, partial(InputError, POSTERIOR, "", wanted=""))
    with pytest.raises(InputError, match="group laws lacks weight"):
        drawn["laws"]


def test_draws_looked_up_are_those_of_the_tree(written):
    tree, _ = read_tree(written[1])
    drawn = Stored(written[1] / POSTERIOR, partial(InputError, POSTERIOR, "", wanted=""))
    for group, node in tree.children.items():
        if group == MODEL:
            continue
        assert drawn[group].sizes == dict(node.sizes)
        assert drawn[group].attrs.keys() == node.attrs.keys()
        assert all(np.all(drawn[group].attrs[key] == value) for key, value in node.attrs.items())
        for name, values in node.variables.items():
            found = drawn[group][name]
            assert found.dims == values.dims, name
            assert found.to_numpy().dtype.kind in (values.dtype.kind, "O"), name
            assert np.array_equal(found.to_numpy(), values.to_numpy(), equal_nan=values.dtype.kind == "f"), name
    (name,) = tree["posterior"]["test"].to_numpy()
    for of in (tree, drawn):
        assert of["posterior"]["a_star"].sel(test=name).dims == ("chain", "draw")
        assert of["posterior"]["a_star"].sel(test=[name]).isel(chain=0).dims == ("draw", "test")
        assert float(of["constant_data"]["wind_speed"].sel(test=name)) == pytest.approx(5.036)
        assert bool(of["constant_data"]["peak"].sel(test=name))
        assert "law_free" in of
        assert "gremlins" not in of


def test_a_prediction_reads_its_draws_without_xarray(tmp_path, monkeypatch):
    write_fit(fake_fit(growth=False, sweeps=False), tmp_path)
    whole = predict(read_tree(tmp_path)[0], scruton_number=30.0, seed=1)
    monkeypatch.setitem(sys.modules, "xarray", None)
    looked_up = predict(read_draws(tmp_path)[0], scruton_number=30.0, seed=1)
    assert whole.to_json() == looked_up.to_json()
    assert np.array_equal(whole.draws, looked_up.draws)


# --- the layout -------------------------------------------------------------------------------------------------------


def test_what_is_written_is_laid_out_as_the_table_says(both):
    tree = both[0].tree
    assert not faults(tree)
    for group, node in tree.children.items():
        assert set(node.data_vars) <= {one.name for one in SCHEMA[group]}, group


def test_the_table_names_a_variable_once():
    for group, variables in SCHEMA.items():
        names = [one.name for one in variables]
        assert len(names) == len(set(names)), group


def test_an_unknown_variable_cannot_be_written():
    with pytest.raises(KeyError, match="a_stir"):
        dataset("posterior", {"a_stir": np.zeros((2, 3, 1))})


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda one: one.drop_vars("Y1"), "group campaign_posterior lacks Y1"),
        (lambda one: one.assign(n=one["n"].astype(int)), "campaign_posterior/n is int64"),
        (lambda one: one.assign(n=one["n"].transpose("draw", "chain", "law")), "campaign_posterior/n is float64 by"),
    ],
)
def test_a_fault_of_the_layout_is_named(both, change, fault):
    tree = both[0].tree.copy()
    tree["campaign_posterior"] = xr.DataTree(change(tree["campaign_posterior"].to_dataset()))
    assert [one.startswith(fault) for one in faults(tree)] == [True]


# --- dataclasses as data ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["default", "free-exponent", "stacking"])
def test_a_card_comes_back_as_it_was_resolved(name):
    card = load_card(name)
    back = unpack(*pack(Path(), card=card), card=ModelCard)["card"]
    assert back == card
    assert (back.sha256, back.exponent) == (card.sha256, card.exponent)
    assert [one.reason for one in back.priors.values()] == [one.reason for one in card.priors.values()]


def test_what_is_not_there_is_an_error():
    document, numbers = pack(Path(), card=load_card())
    with pytest.raises(KeyError, match="campaign"):
        unpack(document, numbers, campaign=ModelCard)
