"""bridge.toml, mode shapes and limits: what is read, and what is refused with which words."""

import os
from dataclasses import replace

import numpy as np
import pytest

from scruton.campaign.schema import Motion
from scruton.errors import InputError
from scruton.sizing.bridge import DAMPING, load_bridge
from scruton.sizing.damper_request import DamperRequest
from scruton.sizing.limits import RULES, limit
from scruton.sizing.mode_shape import make_shape, read_shape


@pytest.fixture
def bridge_file(tmp_path):
    def write(text="", **changes):
        lines = {
            "format": "1", "width": '"12 m"', "depth": '"3 m"', "limits": '["jtg"]',
        } | changes  # fmt: skip
        mode = text or '[[modes]]\nname = "V1"\nfrequency = "0.3 Hz"\n'
        path = tmp_path / "bridge.toml"
        path.write_text("\n".join(f"{k} = {v}" for k, v in lines.items() if v) + "\n" + mode, encoding="utf-8")
        return path

    return write


def mode(extra):
    return f'[[modes]]\nname = "V1"\nfrequency = "0.3 Hz"\n{extra}\n'


def test_a_bridge_is_read_in_si_units(bridge_file):
    path = bridge_file(
        mode('mass = "20 +/- 0.4 t/m"\nlength = "400 m"\ndamping_ratio = { median = 0.003, cov = 0.45 }'),
        coherence="{ mean = 0.9, sd = 0.05 }", air_density='"1.2 kg/m^3"',
    )  # fmt: skip
    found = load_bridge(path, Motion.HEAVING)
    one = found.modes[0]
    assert one.mass.mean == pytest.approx(20000.0)
    assert one.mass.sd == pytest.approx(400.0)
    assert one.modal_mass == pytest.approx(20000.0 * 400.0 * 0.5, rel=1e-6)  # of a sine
    u = (np.arange(100_000) + 0.5) / 100_000
    assert np.median(one.damping_ratio.quantile(u)) == pytest.approx(0.003, rel=1e-3)
    assert 0.0 < found.coherence.quantile(u).max() < 1.0
    assert list(found.sha256) == ["bridge.toml"]


def test_what_is_left_out_has_the_defaults_that_are_documented(bridge_file):
    found = load_bridge(bridge_file().parent, Motion.HEAVING)
    one = found.modes[0]
    assert one.damping_ratio == DAMPING
    assert one.damping_ratio.minimum == 0.001
    assert float(one.damping_ratio.quantile(np.array(0.5))) == pytest.approx(0.003, rel=0.02)
    assert one.frequency.sd == pytest.approx(0.006)
    assert one.mass is None
    assert found.coherence.certain


def test_a_frequency_that_is_measured_is_known_better(bridge_file):
    (one,) = load_bridge(bridge_file(mode("measured = true")), Motion.HEAVING).modes
    assert one.frequency.sd == pytest.approx(0.0015)
    found = load_bridge(bridge_file(mode('identified_frequency = "0.296 Hz"')), Motion.HEAVING).modes[0]
    assert (found.frequency.mean, found.frequency.sd) == (0.296, pytest.approx(0.00148))
    assert found.designed == (replace(one.frequency, sd=0.006), DAMPING)
    found = load_bridge(bridge_file(mode("identified_damping_ratio = 0.004")), Motion.HEAVING).modes[0]
    assert found.damping_ratio.sd == pytest.approx(0.0006)
    assert found.frequency.mean == 0.3


def test_a_modal_mass_may_have_an_error(bridge_file):
    (one,) = load_bridge(bridge_file(mode('modal_mass = "4000 +/- 200 t"')), Motion.HEAVING).modes
    assert (one.modal_mass, one.modal_mass_cov) == (pytest.approx(4e6), pytest.approx(0.05))


def test_what_is_asked_of_a_damper(bridge_file):
    text = mode("") + mode("").replace("V1", "V2")
    request = load_bridge(bridge_file(text), Motion.HEAVING).damper
    assert request == DamperRequest()
    assert (request.largest_stroke, request.smallest_mass_ratio, request.kept_detuning) == (1.0, 0.005, 0.02)
    text += (
        '[damper]\nnumber = 2\nend_stop = "0.6 m"\nlargest_mass_ratio = 0.002\nposition = { V1 = 0.4, V2 = [0.2, 0.8] }'
    )
    request = load_bridge(bridge_file(text + '\nstart_acceleration = "20 mm/s^2"'), Motion.HEAVING).damper
    assert (request.largest_stroke, request.smallest_mass_ratio) == (0.6, 0.002)
    assert request.start_acceleration == pytest.approx(0.02)
    assert (request.places("V1"), request.places("V2"), request.places("V3")) == ((0.4, 0.4), (0.2, 0.8), None)


def test_a_bare_damping_ratio_is_never_certain(bridge_file):
    one = load_bridge(bridge_file(mode("damping_ratio = 0.004")), Motion.HEAVING).modes[0].damping_ratio
    assert (one.family, one.mean, one.sd) == ("lognormal", 0.004, pytest.approx(0.0018))
    sure = load_bridge(bridge_file(mode("damping_ratio = { mean = 0.004, cov = 0 }")), Motion.HEAVING)
    assert sure.modes[0].damping_ratio.certain


@pytest.mark.parametrize(
    ("text", "changes", "field", "words"),
    [
        ("", {"width": "12"}, "width", '"12 m"'),
        ("", {"widht": '"12 m"'}, "widht", '"width"'),
        ("", {"format": "2"}, "format", "format = 1"),
        ("", {"limits": '["jgt"]'}, "limits[0]", '"jtg"'),
        ("", {"limits": '["-0.1 m"]'}, "limits[0]", "greater than zero"),
        ("[wind]\n", {}, "modes", "at least one"),
        (mode('mass = "-1 kg/m"'), {}, "modes[0].mass", "greater than zero"),
        (mode('inertia = "1 kg*m^2/m"'), {}, "modes[0].inertia", "mass"),
        (mode('motion = "torsional"'), {}, "modes[0].motion", "heaving"),
        (mode('shape = "none.csv"'), {}, "none.csv", "no such file"),
        (mode("damping_ratio = 1.5"), {}, "damping_ratio", "up to 1"),
        (mode("damping_ratio = { mean = 0.003, median = 0.003 }"), {}, "damping_ratio", "either mean or median"),
        (mode("damping_ratio = { mean = 0.003, cov = -1 }"), {}, "cov", "zero or more"),
        (mode("damping_ratio = { mean = 0.003, minimum = 0.01 }"), {}, "damping_ratio", "minimum below"),
        (mode("lock_in = [11, 8]"), {}, "lock_in", "rising"),
        (mode("lock_in = [true, 8]"), {}, "lock_in", "rising"),
        (mode("half_waves = 0"), {}, "half_waves", "from 1 to 100"),
        (mode("half_waves = 2000"), {}, "half_waves", "from 1 to 100"),
        (mode('shape = "uniform"\nhalf_waves = 2'), {}, "half_waves", "belongs to"),
        (mode("damping_ratio = { mean = 0.003, cov = 1e14 }"), {}, "damping_ratio", "10 times the mean"),
        (mode("damping_ratio = { mean = 0.003, cov = 1e200 }"), {}, "damping_ratio.cov", "wanted a number between"),
        (
            '[[modes]]\nname = "V1"\n',
            {},
            "modes[0].frequency",
            "found nothing; wanted a frequency, such as frequency =",
        ),
        ('[[modes]]\nfrequency = "0.3 Hz"\n', {}, "modes[0].name", "found nothing"),
        ('[[modes]]\nname = "V1"\nfrequency = "1e300 Hz"\n', {}, "modes[0].frequency", "which no measurement has"),
        (mode("half_waves = " + "9" * 400), {}, "half_waves", "a number of 400 digits"),
        (mode("lock_in = [1, " + "9" * 400 + "]"), {}, "lock_in[1]", "a number of 400 digits"),
        (mode("lock_in = [1, nan]"), {}, "lock_in[1]", "not a finite number"),
        (mode("name = []"), {}, "", "TOML"),
        ('[[modes]]\nname = []\nfrequency = "0.3 Hz"\n', {}, "modes[0].name", "a list"),
        (mode("lock_in = 1979-05-27"), {}, "lock_in", "two rising numbers"),
        (mode("damping_ratio = true"), {}, "damping_ratio", "neither a number nor a text"),
        ("modes = 3", {}, "modes", "a list of tables"),
        ("modes = [[]]", {}, "modes", "a list of tables"),
        (mode("") + "[cost]\nfailure = " + "9" * 400, {}, "cost.failure", "a number of 400 digits"),
        ("", {"format": "true"}, "format", "format = 1"),
        ("", {"depth": '"1e300 m"'}, "depth", "which no measurement has"),
        (mode('damping_ratio = { median = 0.003, distribution = "beta" }'), {}, "damping_ratio", "the mean of a beta"),
        (mode('mass = { mean = "20 t/m", minimum = 15 }'), {}, "mass.minimum", "unit"),
        (mode("") + '[wind]\nweibull_scale = "7 m/s"\nweibull_shape = 0.05', {}, "weibull_shape", "between 0.5 and 20"),
        (mode("") + mode(""), {}, "modes", "twice"),
        (mode("") + "[damper]\nrisk = 2", {}, "damper.risk", "between 0.001 and 1"),
        (mode("") + "[damper]\nrisk = 1e-6", {}, "damper.risk", "draws tell no less"),
        (mode("") + "[damper]\nnumber = 0", {}, "damper.number", "1 to 16"),
        (mode("") + "[damper]\nposition = 1.5", {}, "damper.position", "a fraction of the span"),
        (mode("") + "[damper]\nposition = { V9 = 0.5 }", {}, "damper.position", "one of: V1"),
        (mode("") + '[damper]\nrisk_of = "all"', {}, "damper.risk_of", "any"),
        (mode("") + '[damper]\nrisk_of = "any"', {}, "modes[0]", "modal mass"),
        (mode("") + "[damper]\nfrequency_tolerance = 0.7", {}, "damper.frequency_tolerance", "from 0 to 0.5"),
        (mode("") + '[damper]\nend_stop = "0.5 m"\nlargest_stroke = "0.6 m"', {}, "damper.largest_stroke", "end stop"),
        (mode("") + "[damper]\nsmallest_mass_ratio = 0.1", {}, "damper.smallest_mass_ratio", "the largest"),
        (mode("") + "[damper]\nstart_acceleration = 0.02", {}, "damper.start_acceleration", "unit"),
        (mode("measured = 1"), {}, "modes[0].measured", "true or false"),
        (mode("identified_damping_ratio = 2"), {}, "modes[0].identified_damping_ratio", "up to 1"),
        (mode("") + "[cost]\nfailure = -1", {}, "cost.failure", "zero or more"),
        (mode("") + '[wind]\nrose = "r.csv"', {}, "r.csv", "upper speed"),
        (mode(""), {"coherence": "{ mean = 0.9, sd = 0.5 }"}, "coherence", "fits between 0 and 1"),
        (mode(""), {"limits": '["jtg", "0.4 deg"]'}, "limits[1]", "the modes are heaving"),
        (mode(""), {"limits": '["motion-sickness: 2"]'}, "limits[0]", "a share of people, a bare number, up to 1"),
        (mode("") + "[damper]\nnumber = 3\nposition = [0.2, 0.5]", {}, "damper.position", "number = 3"),
        (mode("") + "[damper]\nnumber = 3\nposition = { V1 = [0.2, 0.5] }", {}, "damper.position", "for mode V1"),
        (
            mode("") + '[wind]\nrose = "r.csv"\nweibull_scale = "7 m/s"',
            {},
            "wind.weibull_scale",
            "either a rose or a Weibull distribution",
        ),
    ],
)
def test_bad_input_is_named_with_its_place(bridge_file, text, changes, field, words):
    with pytest.raises(InputError) as caught:
        load_bridge(bridge_file(text, **changes), Motion.HEAVING)
    assert field in str(caught.value)
    assert words in str(caught.value)


def test_a_missing_file_and_broken_toml_are_said(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_bridge(tmp_path / "bridge.toml", Motion.HEAVING)
    (tmp_path / "bridge.toml").write_text("format = ", encoding="utf-8")
    with pytest.raises(InputError, match="TOML"):
        load_bridge(tmp_path, Motion.HEAVING)


@pytest.mark.parametrize("key", ["shape", "rose"])
def test_tables_beside_a_bridge_are_files_of_bounded_size(bridge_file, tmp_path, key):
    os.mkfifo(tmp_path / "x.csv")
    text = mode('shape = "x.csv"') if key == "shape" else mode("") + '[wind]\nrose = "x.csv"'
    with pytest.raises(InputError, match=r"x\.csv: found a pipe"):
        load_bridge(bridge_file(text), Motion.HEAVING)
    (tmp_path / "x.csv").unlink()
    with (tmp_path / "x.csv").open("wb") as file:
        file.truncate(10**9)
    with pytest.raises(InputError, match=r"x\.csv: found a file of 1 GB"):
        load_bridge(bridge_file(text), Motion.HEAVING)


def test_a_shape_is_scaled_and_refined(tmp_path):
    path = tmp_path / "v1.csv"
    x = np.linspace(0.0, 400.0, 21)
    path.write_text("x [m],phi\n" + "\n".join(f"{a},{-7 * np.sin(np.pi * a / 400)}" for a in x), encoding="utf-8")
    shape = read_shape(path)
    assert float(shape.factor(-1.0)) == pytest.approx(4.0 / np.pi, rel=1e-4)
    assert abs(shape.at(0.5)) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0,0\n1,0\n2,0\n3,0\n4,0", "a mode shape of zeros"),
        ("0,0\n1,1\n1,2\n3,0\n4,0", "do not rise"),
        ("0,0\n1,1\n2,nan\n3,0\n4,0", "not finite"),
        ("0,0\n1,1", "at least five rows"),
        ("0,a", "two columns of numbers"),
        ("0,1,2\n1,2,3\n2,3,4\n3,4,5\n4,5,6", "two columns"),
    ],
)
def test_a_shape_that_is_none_is_refused(tmp_path, rows, words):
    path = tmp_path / "shape.csv"
    path.write_text("x,phi\n" + rows, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_shape(path)


def test_a_first_row_of_numbers_is_not_swallowed_as_a_header(tmp_path, bridge_file):
    rows = "0,0\n1,0.7\n2,1\n3,0.7\n4,0\n5,-0.7\n"
    (tmp_path / "s.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(InputError, match="numbers"):
        read_shape(tmp_path / "s.csv")
    (tmp_path / "s.csv").write_text("\ufeffx,phi\n\n" + rows.replace("\n", "\n\n"), encoding="utf-8")
    assert read_shape(tmp_path / "s.csv").at(0.4) == pytest.approx(1.0, abs=0.05)
    (tmp_path / "r.csv").write_text("5,100\n10,200\n", encoding="utf-8")
    with pytest.raises(InputError, match="numbers"):
        load_bridge(bridge_file(mode("") + '[wind]\nrose = "r.csv"'), Motion.HEAVING)
    (tmp_path / "r.csv").write_text("v,h\n5,100\ninf,200\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"r\.csv"):
        load_bridge(bridge_file(mode("") + '[wind]\nrose = "r.csv"'), Motion.HEAVING)


@pytest.mark.parametrize("shape", [0.7, 1.0, 2.0, 3.0])
def test_hours_of_a_weibull_climate_are_its_own(bridge_file, shape):
    text = mode("") + f'[wind]\nweibull_scale = "7 m/s"\nweibull_shape = {shape}\nshare = 0.5'
    wind = load_bridge(bridge_file(text), Motion.HEAVING).wind
    for low, high in ((0.0, 3.0), (6.7, 9.5), (30.0, 80.0), (0.0, 1e6)):
        exact = 0.5 * 8766.0 * (np.exp(-((low / 7.0) ** shape)) - np.exp(-((high / 7.0) ** shape)))
        assert wind.between(low, high) == pytest.approx(exact, rel=1e-3, abs=0.1)


def test_spread_and_minimum_are_as_stated(bridge_file):
    text = 'damping_ratio = { median = 0.003, sd = 0.0015 }\nmass = { mean = "20 t/m", cov = 0.1, minimum = "19 t/m" }'
    one = load_bridge(bridge_file(mode(text)), Motion.HEAVING).modes[0]
    u = (np.arange(400_000) + 0.5) / 400_000
    draws = one.damping_ratio.quantile(u)
    assert np.median(draws) == pytest.approx(0.003, rel=1e-4)
    assert draws.std() == pytest.approx(0.0015, rel=2e-3)
    assert one.mass.quantile(u).min() == pytest.approx(19_000.0, rel=1e-3)


def test_limits_are_those_of_their_codes():
    heaving = {"f": 0.3, "width": 12.0, "depth": 3.0}

    def of(text, motion=Motion.HEAVING):
        return limit(text).amplitude(motion, *heaving.values())

    assert of("jtg") == pytest.approx(0.1333, abs=1e-4)
    assert of("JTG: 0.8") == pytest.approx(0.10667, abs=1e-4)
    assert of("jtg", Motion.TORSIONAL) == pytest.approx(np.deg2rad(4.56 / 3.6))
    assert of("kd") == pytest.approx(0.3333, abs=1e-4)
    assert of("peak-acceleration: 0.5 m/s^2") == pytest.approx(0.5 / (0.6 * np.pi) ** 2)
    assert of("rms-acceleration") == pytest.approx(np.sqrt(2) * 0.315 / (0.6 * np.pi) ** 2)
    assert of("peak-acceleration: 0.05 g_n", Motion.TORSIONAL) == pytest.approx(0.05 * 9.80665 / (0.6 * np.pi) ** 2 / 6)
    assert of("133 mm") == pytest.approx(0.133)
    assert of("0.05") == of("5E-2") == pytest.approx(0.15)
    assert of("0.4°", Motion.TORSIONAL) == pytest.approx(np.deg2rad(0.4))
    assert of("0.4 deg", Motion.TORSIONAL) == pytest.approx(np.deg2rad(0.4))


def test_limits_cross_where_they_should():
    """JTG is stricter than K_D = 30 below 0.75 Hz."""
    for f, first in ((0.5, "jtg"), (0.74, "jtg"), (0.76, "kd"), (1.0, "kd")):
        values = {name: limit(name).amplitude(Motion.HEAVING, f, 12.0, 3.0) for name in ("jtg", "kd")}
        assert min(values, key=values.get) == first


def test_every_rule_cites_a_source():
    assert all(rule.source and rule.title for rule in RULES.values())


@pytest.mark.parametrize(
    ("text", "words"),
    [("foo", "one of"), ("kd: tolerabel", 'or "tolerable"'),
     ("jgt", '"jtg"'), ("0 m", "greater than zero"), ("-0.1 m", "greater than zero"),
     ("jtg: x", "factor"), ("peak-acceleration", "its value"), ("amplitude: 3", "m"), ("0.3 kg", "a length"),
     ("motion-sickness: 1.01", "up to 1"), ("0.1 +/- 0.01 m", "without a standard deviation"),
     ("", "a rule")],
)  # fmt: skip
def test_a_limit_that_is_none_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        limit(text)


def test_a_rule_that_says_nothing_of_a_motion_is_refused():
    with pytest.raises(InputError, match="a rule for it"):
        limit("0.1 m").amplitude(Motion.TORSIONAL, 0.3, 12.0, 3.0)


@pytest.mark.parametrize("position", [np.arange(5) * 5e-324, np.arange(5) * 1e-300, np.array([0, 1e-300, 1, 2, 3.0])])
def test_points_that_coincide_are_no_shape(position):
    with pytest.raises(InputError, match="all but coincide"):
        make_shape(position, np.array([0.0, 1.0, 0.0, -1.0, 0.0]), "x")
