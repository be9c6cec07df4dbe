"""What the process of a command does not import, and what it can still import; in how many threads it works."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scruton.cli import main
from scruton.spared import ONE_THREAD, _Sparing

PROGRAM = """
import sys
from scruton.spared import serve_dask, spare
spare()
spare()
import emcee, numpy as np, xarray as xr
tree = xr.DataTree(xr.Dataset({"a": ("x", np.zeros(2))}))
tree["a"].to_numpy()
tree.to_netcdf(sys.argv[1], engine="netcdf4")
assert not {"scipy.stats", "dask.base", "distributed", "h5py", "pint"} & set(sys.modules)
assert float(xr.load_datatree(sys.argv[1], engine="netcdf4")["a"].sum()) == 0.0
serve_dask()
import dask.array, h5py, pint, scipy.stats
assert scipy.stats.norm.cdf(0.0) == 0.5
"""


def test_a_command_spares_what_it_has_no_use_for_and_whoever_asks_else_is_served(tmp_path):
    subprocess.run([sys.executable, "-c", PROGRAM, str(tmp_path / "a.nc")], check=True)


THREADS = """
from scruton.spared import spare
spare()
import numpy
print(open("/proc/self/status").read().partition("Threads:")[2].split()[0])
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="threads are counted where /proc is")
@pytest.mark.parametrize("asked", ["", "2"])
def test_linear_algebra_takes_one_thread_unless_more_are_asked_for(asked):
    others = {key: value for key, value in os.environ.items() if key not in ONE_THREAD}
    environment = others | ({"OPENBLAS_NUM_THREADS": asked} if asked else {})
    run = subprocess.run([sys.executable, "-c", THREADS], env=environment, capture_output=True, text=True, check=True)
    assert int(run.stdout) == min(int(asked or 1), os.cpu_count() or 1)


def test_in_somebody_elses_python_nothing_is_spared():
    with pytest.raises(SystemExit):
        main(["--version"])
    assert _Sparing not in sys.meta_path
