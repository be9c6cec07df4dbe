"""Kernels on disk: what they were compiled from is what they are."""

import os
import subprocess
import sys

import pytest

KERNEL = """
from scruton.compiled import njit
from part import FACTOR

@njit(cache=True)
def scaled(x):
    return FACTOR * x
"""
RUN = """
from pathlib import Path
import scruton.compiled
scruton.compiled._SHARED = Path("shared")
import kernel
print(kernel.scaled(1.0), sum(kernel.scaled.stats.cache_hits.values()))
"""


@pytest.fixture(params=["shared", "."])
def run(tmp_path, request):
    """Write the constant that the kernel takes from elsewhere, and run the kernel."""
    (tmp_path / "shared").mkdir()
    (tmp_path / "kernel.py").write_text(KERNEL)

    def run(factor):
        (tmp_path / request.param / "part.py").write_text(f"FACTOR = {factor}\n")
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join([request.param, *sys.path]),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        environment.pop("NUMBA_CACHE_DIR", None)
        done = subprocess.run(
            [sys.executable, "-c", RUN], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
        value, hits = done.stdout.split()
        return float(value), int(hits)

    return run


@pytest.mark.thorough
def test_a_kernel_is_compiled_anew_when_what_it_takes_from_elsewhere_changes_and_only_then(run):
    """What it gives, and how often it was found on disk."""
    assert run(2.0) == (2.0, 0)
    assert run(2.0) == (2.0, 1)
    assert run(3.0) == (3.0, 0)
    assert run(3.0) == (3.0, 1)


FILTER = """
import numpy as np
from scruton.dynamics.cycles import EnvelopeData
from scruton.dynamics.likelihood import Wind, log_likelihood
rng, size = np.random.default_rng(0), 400
time = 0.125 * np.arange(size)
amplitude = 0.03 * (1.0 - np.exp(-0.5 * time)) + 0.002 + 1e-4 * rng.standard_normal(size)
gap, one = np.r_[-1.0, np.zeros(size - 1)], np.ones(size)
data = EnvelopeData(amplitude, 1e-4 * one, gap, 0.125 * one, time, np.full(size, "growth"))
walkers = [middle * np.exp(0.2 * rng.standard_normal(64)) for middle in (0.03, 0.5, 1e-4, 1.0, 2e-4, 0.2, 2e-4, 0.1)]
for n in (-1.0, 0.0, 1.0, 2.0):
    print(log_likelihood(data, *walkers[:4], Wind(*walkers[4:]), n=n).tobytes().hex())
"""


@pytest.mark.slow
def test_a_filter_says_the_same_to_the_last_digit_just_compiled_and_from_disk(tmp_path):
    """A first run and a second one are the same bytes only so: a search makes of a last digit a tenth of a nat."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_CACHE_DIR": str(tmp_path)}
    runs = [
        subprocess.run([sys.executable, "-c", FILTER], env=environment, capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert list(tmp_path.rglob("*.nbc"))
    assert runs[0].stdout.split() == runs[1].stdout.split()
