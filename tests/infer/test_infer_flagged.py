"""Tests whose records contradict each other are said to."""

from types import SimpleNamespace

import numpy as np
import pytest

from scruton.infer.flagged import set_apart


@pytest.mark.parametrize(("scatter", "said"), [(0.03, True), (0.008, False)])
def test_records_that_stand_apart_are_said_to(scatter, said):
    draws = scatter * np.random.default_rng(1).lognormal(0.0, 0.25, (64, 16))
    result = SimpleNamespace(
        test=SimpleNamespace(name="A"),
        posterior=SimpleNamespace(data=SimpleNamespace(size=100)),
        derived={"set_point_scatter": draws},
    )
    flags = set_apart([result])
    assert [flag.startswith("test A: its records stand at amplitudes that scatter by 3 %") for flag in flags] == [
        True
    ] * said
