"""Measured records: what independent analyses found must come out again."""

import tomllib

import numpy as np
import pytest

from scruton.campaign.schema import Kind, Record
from scruton.envelope import assess, demodulate, record_cycles, ring_down

pytestmark = pytest.mark.real
MM = 1e-3 / 0.125  # the cylinder's diameter is 0.125 m
CYLINDER = 23.2  # Hz, in still air


@pytest.fixture(scope="module")
def cylinder(shared_data):
    """Records of the cylinder by rig or test: lists of (time, y/D), as its campaign.toml cuts them."""
    import h5py

    folder = shared_data("cylinder-in-wind")
    campaign, found = tomllib.loads((folder / "campaign.toml").read_text()), {}
    for group in campaign["rigs"] + campaign["tests"]:
        for record in group["records"]:
            name, rest = record["variables"]["displacement"].split("[")
            with h5py.File(folder / record["file"]) as file:
                y = np.asarray(file[file[name]["y"][()].ravel()[int(rest.split("]")[0])]]).ravel() / 0.125
            t = np.arange(len(y)) / 1000.0
            begin, end = (float(record.get(k, d).split()[0]) for k, d in (("start", "0 s"), ("stop", "1e9 s")))
            keep = (t >= begin) & (t <= end)
            found.setdefault(group["name"], []).append((t[keep], y[keep]))
    return found


@pytest.mark.parametrize(
    ("rig", "f0", "bands"),
    [
        ("g1", 22.98, {2: (0.99, 0.02), 1: (1.03, 0.03), 0.5: (1.07, 0.11), 0.25: (0.65, 0.16)}),
        ("g2", 22.98, {2: (0.95, 0.02), 1: (0.92, 0.03), 0.5: (0.62, 0.03), 0.25: (0.84, 0.10)}),
        ("e2", 23.35, {2: (1.32, 0.04), 1: (1.26, 0.05), 0.5: (1.13, 0.05), 0.25: (0.77, 0.05)}),
    ],
)
def test_damping_of_the_cylinder_by_band(cylinder, rig, f0, bands):
    edges = np.array([0.25, 0.5, 1.0, 2.0, 4.0]) * MM
    found = ring_down([demodulate(t, y) for t, y in cylinder[rig]], edges=edges, name=rig)
    assert found.frequency == pytest.approx(f0, abs=0.02)
    assert len(found.bands) == 4
    for band in found.bands:
        mean, sd = bands[round(band.lower / MM, 2)]
        # two analyses of the same plucks: within their common scatter
        assert abs(100 * band.damping_ratio - mean) < max(0.03, np.hypot(sd, 100 * band.sd))


def test_the_cylinder_has_another_line_in_still_air(cylinder):
    lines = []
    for t, y in cylinder["e2"]:
        record = Record("e2", "e2", Kind.FREE_DECAY, t, y)
        lines.append(assess(record, record_cycles(record, CYLINDER)).second_line)
    assert np.median([line.frequency for line in lines]) == pytest.approx(36.2, abs=0.5)


def test_lock_in_of_the_cylinder(cylinder):
    for name, amplitude in (("g1 U 15.8", 0.084), ("g2 U 15.8", 0.087), ("e2 U 15.4", 0.066)):
        (t, y) = cylinder[name][0]
        found = demodulate(t, y)
        assert np.sqrt(np.mean(found.amplitude**2)) == pytest.approx(amplitude, rel=0.03)
        assert np.min(found.amplitude / found.standard_error) > 50
        assert len(found.time) > 440


def test_every_record_of_the_cylinder_can_be_assessed(cylinder):
    for name, records in cylinder.items():
        kind = Kind.STEADY if "U" in name else Kind.FREE_DECAY
        for t, y in records:
            record = Record(name, name, kind, t, y)
            quality = assess(record, record_cycles(record, CYLINDER))
            assert 22.0 < quality.frequency < 24.5
            assert not any("clipped" in w or "gap" in w or "uniform" in w for w in quality.warnings)


def test_pendulum_with_dry_friction(shared_data):
    from scipy.io import loadmat

    data = loadmat(shared_data("pendulum-dry-friction") / "cdip_pend_data.mat")
    t, y = data["t"].ravel(), data["theta"].ravel()
    cycles = demodulate(t[t >= 4.2], y[t >= 4.2])
    found = ring_down([cycles])
    a = np.array([0.93, 0.74, 0.56, 0.45, 0.32, 0.23, 0.13, 0.034])
    known = np.array([0.314, 0.294, 0.296, 0.317, 0.377, 0.480, 0.80, 2.79])
    np.testing.assert_allclose(100 * found.structural_damping(a), known, rtol=0.06)
    assert cycles.frequency[0] == pytest.approx(0.869, abs=0.006)
    assert cycles.frequency[90] > 0.92
    # the exact period of a pendulum, T/T0 = 1 + a^2/16 + 11 a^4/3072
    a, f = cycles.amplitude, cycles.frequency
    exact = 1 / (1 + a**2 / 16 + 11 * a**4 / 3072)
    strong = (a > 0.2) & (np.arange(len(a)) > 1)
    np.testing.assert_allclose((f / exact)[strong], np.mean((f / exact)[strong]), rtol=2e-3)
    quality = assess(Record("p", "p", Kind.FREE_DECAY, t[t >= 4.2], y[t >= 4.2]), cycles)
    assert any("frequency drifts" in w for w in quality.warnings)


def test_pendulum_with_air_drag(shared_data):
    rows = np.genfromtxt(shared_data("pendulum-air-drag") / "8047.txt", skip_header=1, delimiter="\t")
    rows = rows[np.all(np.isfinite(rows), axis=1)]
    found = ring_down([demodulate(rows[:, 0], np.arctan2(rows[:, 1], -rows[:, 2]))])
    xi = 100 * found.structural_damping(np.array([0.27, 0.125]))
    np.testing.assert_allclose(xi, [0.306, 0.185], rtol=0.08)


def test_ship_model(shared_data):
    path = shared_data("ship-roll-decay") / "model_test_21338.csv"
    data = np.genfromtxt(path, delimiter=",", names=True)
    keep = data["time"] >= 8.1
    cycles = demodulate(data["time"][keep], data["phi"][keep])
    found = ring_down([cycles])
    a = np.radians([8.6, 6.2, 4.5, 3.4, 2.8, 2.1, 1.6, 1.2])
    known = np.array([0.771, 0.561, 0.466, 0.427, 0.406, 0.439, 0.469, 0.468])
    np.testing.assert_allclose(100 * found.structural_damping(a), known, rtol=0.08)
    assert cycles.frequency[0] == pytest.approx(0.3945, abs=1.5e-3)
    assert np.median(cycles.frequency[-20:]) == pytest.approx(0.392, abs=1e-3)
