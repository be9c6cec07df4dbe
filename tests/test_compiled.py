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


def test_a_kernel_is_compiled_anew_when_what_it_takes_from_elsewhere_changes_and_only_then(run):
    """What it gives, and how often it was found on disk."""
    assert run(2.0) == (2.0, 0)
    assert run(2.0) == (2.0, 1)
    assert run(3.0) == (3.0, 0)
    assert run(3.0) == (3.0, 1)
