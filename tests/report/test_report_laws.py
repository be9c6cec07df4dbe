"""What a report shows is of the law that predicts, or says of which it is."""

import numpy as np
import pytest
from fake_fit import fake_fit, led_by

from scruton.griffin import griffin_band, predict
from scruton.griffin.bands import index_draws
from scruton.report.charts import griffin_chart


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
