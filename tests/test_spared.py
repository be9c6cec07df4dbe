"""What the process of a command does not import, and what it can still import."""

import subprocess
import sys

import pytest

from scruton.cli import main
from scruton.spared import _Sparing

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


def test_in_somebody_elses_python_nothing_is_spared():
    with pytest.raises(SystemExit):
        main(["--version"])
    assert _Sparing not in sys.meta_path
