"""What a report shows is of the law that predicts, or says of which it is."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from fake_fit import fake_fit, led_by

from scruton.griffin import griffin_band, predict
from scruton.griffin.bands import index_draws
from scruton.report.chapters import Material, compose
from scruton.report.charts import griffin_chart
from scruton.report.document import Picture
from scruton.report.figures.griffin import (
    griffin_by_test,
    griffin_plot,
    law_comparison,
    reciprocal_against_damping,
    reciprocal_plot,
)
from scruton.report.tables import tables


@pytest.fixture(scope="module")
def three():
    return fake_fit(growth=False, sweeps=False)


@pytest.fixture(scope="module")
def idle(three):
    """Where the card's first law, under which single tests were sampled, has no weight."""
    return led_by(three, gompertz=1.0)


def test_the_distance_of_a_chart_is_that_of_the_law_that_predicts(three, idle) -> None:
    """That by the card's first law is nobody's where that law has no weight."""
    design = [predict(idle.tree, scruton_number=6.0, seed=1)]
    data = griffin_chart(idle, design)
    x = {one["symbol"]: one["values"] for one in data["read"]["also"]}["extrapolation index x"]
    assert np.interp(6.0, data["grid"], x) == pytest.approx(design[0].extrapolation_index, rel=0.02)
    own = float(np.median(index_draws(idle.tree, np.array([6.0]), "Sc 1.9")))
    assert abs(own / design[0].extrapolation_index - 1.0) > 0.5, "the laws differ in it"


@pytest.mark.parametrize("weights", [{"paper": 1.0}, {"gompertz": 1.0}])
def test_lines_are_thin_where_the_law_that_predicts_is_far(three, weights) -> None:
    fit = led_by(three, **weights)
    grid = np.linspace(2.0, 80.0, 2000)
    band = griffin_band(fit.tree, grid, "Sc 1.9")
    edge = predict(fit.tree, scruton_number=float(grid[~band.extrapolated][-1]))
    assert edge.extrapolation_indices["Sc 1.9"] == pytest.approx(0.3, abs=0.01)


def captions(fit) -> list[str]:
    figures = [griffin_plot(fit), reciprocal_plot(fit), reciprocal_against_damping(fit), law_comparison(fit)]
    return [figure.caption for figure in (*figures, *griffin_by_test(fit))]


def test_captions_name_the_law_of_single_tests_and_its_weight(three, idle) -> None:
    """They were sampled under the card's first law, of which a band cannot tell that it has no weight."""
    both = led_by(three, paper=0.7, gompertz=0.3)
    for caption in (*captions(both), griffin_chart(both)["key"]):
        assert "the law n = −1 (70 % of the weight in predictions)" in caption
    for caption in (*captions(idle), griffin_chart(idle)["key"]):
        assert "the law n = −1 (0 % of the weight in predictions; n = 0 has 100 %)" in caption


def test_a_curve_without_bound_does_not_press_the_others_flat(three) -> None:
    """One test's curve by the paper's law may have no amplitude at all where others were tested."""
    own = three.tree["posterior"].to_dataset()
    tree = three.tree.copy()
    tree["posterior"] = xr.DataTree(own.assign(relaxation_scruton_number=0.95 * own["scruton_number"]))
    (axes, _) = law_comparison(replace(three, tree=tree)).figure.axes[:2]
    assert axes.get_ylim()[1] <= 1.3 * 2.5 * 0.06551 * 1.01


def test_tests_under_a_law_that_does_not_lead_are_no_support_for_self_similarity(three, idle) -> None:
    def said(fit) -> str:
        pictures = [Picture("griffin_by_test", figure.caption, figure.alt) for figure in griffin_by_test(fit)]
        chapters = compose(Material(fit, tables(fit), pictures=pictures)).chapters
        return " ".join(str(block) for chapter in chapters for block in chapter.blocks)

    claims = ("bears the self-similarity out", "holds a whole Griffin plot")
    holds, does_not = said(three), said(idle)
    assert [words for words in claims if words in holds] == list(claims)
    assert [words for words in claims if words in does_not] == []
    assert "Another law leads in predictions" in does_not
