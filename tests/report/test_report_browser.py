"""The report in a real browser: no errors, no requests, charts that answer to slider, keys and pointer."""

import re
from collections.abc import Iterator

import numpy as np
import pytest
from browser import Browser, chromium, opened
from fake_fit import fake_fit
from fake_parts import GAP, sizing

from scruton.documents import as_json
from scruton.griffin import predict
from scruton.report.chapters import Material, compose
from scruton.report.charts import damper_chart, griffin_chart, risk_chart
from scruton.report.document import Picture
from scruton.report.render_html import render_html
from scruton.report.tables import tables
from scruton.sizing.damper_table import DamperTable

pytestmark = pytest.mark.skipif(chromium() is None, reason="no chromium here")

TITLE = """</script><script>alert('1')</script> "B/D" & 矩形断面 ξₛ → λ 🌉"""
DESIGN = 30.0
DOT = b'<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10"><rect width="10" height="10"/></svg>'


# Of some steepness in every direction.
AXES = (np.array([0.5, 1.0, 2.0]), np.exp(np.linspace(-0.12, 0.12, 9)), np.array([0.5, 1.0, 2.0]))
_GRID = np.meshgrid(*map(np.log, AXES), indexing="ij")
TABLE = DamperTable(
    *AXES, 1.0 / (1.0 + np.exp(3.0 + 2.0 * _GRID[0] - 300.0 * _GRID[1] ** 2 + 0.5 * _GRID[2])),
    0.4 * np.exp(-0.3 * _GRID[0] - 0.5 * _GRID[2]), 0.01, 0.02, 48,
)  # fmt: skip


@pytest.fixture(scope="module")
def fit():
    return fake_fit(growth=False, sweeps=False, names=[TITLE, "Sc 21.7", "Sc 78.1"])


@pytest.fixture(scope="module")
def page(fit, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    folder = tmp_path_factory.mktemp("browser")
    campaign = type(fit.campaign)(**(vars(fit.campaign) | {"title": TITLE}))
    titled = type(fit)(**(vars(fit) | {"campaign": campaign}))
    design = [predict(fit.tree, scruton_number=DESIGN, seed=1)]
    content = sizing()
    charts = {
        "griffin": griffin_chart(titled, design),
        "risk": risk_chart(content["modes"][0], content["modes"][0]["limits"][0]["curve"], "probability"),
        "damper": damper_chart(
            content["modes"][0]
            | {"name": "V1", "damper": content["modes"][0]["damper"] | {"mass": 2500.0}, "damper_table": as_json(TABLE)}
        ),
    }
    pictures = [Picture(name, "caption", "alternative", DOT, b"", one) for name, one in charts.items()]
    material = Material(titled, tables(titled), pictures, design, gap=GAP, sizing=content)
    path = folder / "report.html"
    path.write_text(render_html(compose(material)), encoding="utf-8")
    with opened(path, folder / "profile") as browser:
        yield browser


def answer(page: Browser, name: str = "griffin") -> str:
    return page.value(f"document.querySelector('#figure-{name} output').textContent")


def test_it_opens_without_errors_and_asks_for_nothing(page: Browser) -> None:
    assert page.complaints() == []
    asked = [one for one in page.requests() if not one.startswith("data:")]
    assert len(asked) == 1, asked
    assert asked[0].startswith("file://")


def test_the_title_is_text(page: Browser) -> None:
    assert page.value("document.title") == TITLE
    assert page.value("document.querySelector('h1').textContent") == TITLE
    assert page.value("document.scripts.length") == 4, "three charts' numbers and the one script"
    labels = page.value("[...document.querySelectorAll('.tool svg text')].map((one) => one.textContent)")
    assert TITLE in labels, "the name of a test in the chart"


def test_names_are_drawn_with_the_letters_that_the_page_carries(page: Browser) -> None:
    loaded = "document.fonts.ready && [...document.fonts].map((one) => [one.family, one.status, one.unicodeRange])"
    fonts = page.value(loaded)
    assert {(family, status) for family, status, _ in fonts} == {("scruton", "loaded")}
    assert any(f"U+{ord('矩'):x}" in reach.lower().replace("u+", "U+") for _, _, reach in fonts)


def test_it_begins_at_the_design_and_says_what_predict_says(page: Browser, fit) -> None:
    one = predict(fit.tree, scruton_number=DESIGN, seed=1)
    low, high = one.interval(0.90)
    said = answer(page)
    assert said.startswith("Sc = 30: stable amplitude ")
    numbers = [float(one) for one in re.findall(r"[\d.]+", said.partition(":")[2])]
    del numbers[1]  # of "90 % interval"
    np.testing.assert_allclose(numbers[:3], [one.median, low, high], rtol=0.01)


def test_the_slider_moves_the_reading_by_keyboard(page: Browser) -> None:
    before = answer(page)
    assert (
        page.value("document.querySelector('#range-figure-griffin').labels[0].textContent") == "Design Scruton number"
    )
    page.value("document.querySelector('#range-figure-griffin').focus()")
    for _ in range(5):
        page.press("ArrowRight", 39)
    after = answer(page)
    assert after != before
    assert float(after.split()[2].rstrip(":")) > 30.0
    assert page.value("document.activeElement.getAttribute('aria-valuetext')") == after, "what a screen reader says"
    page.press("Home", 36)
    assert answer(page).startswith("Sc = 0:")


def test_an_exact_number_may_be_typed(page: Browser) -> None:
    field = "document.querySelector('#figure-griffin input[type=number]')"
    page.value(f"{field}.value = '12.5'; {field}.dispatchEvent(new Event('input'))")
    assert answer(page).startswith("Sc = 12.5:")
    assert float(page.value("document.querySelector('#range-figure-griffin').value")) == pytest.approx(12.5, abs=0.2)
    page.value(f"{field}.value = '150'; {field}.dispatchEvent(new Event('input'))")
    assert answer(page).startswith("Sc = 150 lies outside of this plot"), "no other number takes its place"
    marks = "[...document.querySelectorAll('#figure-griffin svg circle')].at(-1).getAttribute('visibility')"
    assert page.value(marks) == "hidden"
    page.value(f"{field}.value = '30'; {field}.dispatchEvent(new Event('input'))")
    assert page.value(marks) == "visible"


def test_the_pointer_reads_the_curve(page: Browser) -> None:
    page.value("document.querySelector('#figure-griffin').scrollIntoView()")
    box = page.value("(() => { const b = document.querySelector('#figure-griffin svg').getBoundingClientRect();"
                     " return [b.left, b.top, b.width, b.height]; })()")  # fmt: skip
    page.point(box[0] + 0.5 * box[2], box[1] + 0.5 * box[3])
    under = page.value("document.querySelector('#figure-griffin .under').textContent")
    assert under.startswith("Under the pointer: Sc = ")
    page.point(box[0] + 0.7 * box[2], box[1] + 0.5 * box[3])
    assert page.value("document.querySelector('#figure-griffin .under').textContent") != under


def test_the_risk_curve_answers_in_per_cent(page: Browser) -> None:
    assert answer(page, "risk").startswith("Added damping [%] = 0: probability 80 %")
    page.value("document.querySelector('#range-figure-risk').focus()")
    page.press("End", 35)
    said = answer(page, "risk")
    assert "= 0.4: probability 5 %" in said
    assert "Sc = 35" in said


def test_sliders_read_the_table_as_python_does(page: Browser) -> None:
    tool = "document.querySelector('#figure-damper .tool')"
    said = f"{tool}.querySelector('output[role=status]').textContent"
    assert page.value(f"{tool}.querySelectorAll('input[type=range]').length") == 4
    assert page.value(f"{tool}.querySelectorAll('label').length") == 4
    factors = {"mass": 1.3, "tuning": 0.97, "damping": 0.8, "detuning": 1.02}
    for name, factor in factors.items():
        slider = f"document.getElementById('{name}-figure-damper')"
        page.value(
            f"{slider}.step = 'any'; {slider}.value = {np.log(factor)}; {slider}.dispatchEvent(new Event('input'))"
        )
    risk, stroke = TABLE.at(1.3, 0.97 / 1.02, 0.8)
    numbers = [float(one) for one in re.findall(r"[\d.]+\d", page.value(said))]
    assert numbers[0] == pytest.approx(100.0 * float(risk), rel=0.05)
    assert any(one == pytest.approx(float(stroke), rel=0.05) for one in numbers)
    assert "+2.0 %" in page.value(f"{tool}.querySelector('.four').textContent")
    assert "off by 1 %" in page.value(f"{tool}.textContent"), "how far the table is off is said"


def test_a_picture_opens_large_by_key_and_by_pointer(page: Browser) -> None:
    is_open = "document.querySelector('dialog').open"
    page.value("document.querySelector('#figure-damper button.zoom').focus()")
    key = {"key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13}
    page.send("Input.dispatchKeyEvent", type="keyDown", text="\r", **key)
    page.send("Input.dispatchKeyEvent", type="keyUp", **key)
    assert page.value(is_open)
    assert page.value("document.querySelector('dialog img').alt") == "alternative"
    page.value("document.querySelector('dialog img').click()")
    assert page.value("document.querySelector('dialog').className") == "close-up"
    page.press("Escape", 27)
    assert not page.value(is_open)
    label = page.value("document.querySelector('#figure-damper button.zoom').getAttribute('aria-label')")
    assert label.startswith("Enlarge")


@pytest.mark.parametrize(("scheme", "dark"), [("light", False), ("dark", True)])
def test_it_follows_the_reader_s_light(page: Browser, scheme: str, dark: bool) -> None:
    page.send("Emulation.setEmulatedMedia", media="", features=[{"name": "prefers-color-scheme", "value": scheme}])
    paper = page.value("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(20, 20, 20)") is dark
    assert ("invert" in page.value("getComputedStyle(document.querySelector('.tool svg')).filter")) is dark
    page.send("Emulation.setEmulatedMedia", media="print", features=[{"name": "prefers-color-scheme", "value": scheme}])
    assert page.value("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)", "paper stays white"
    page.send("Emulation.setEmulatedMedia", media="", features=[])


def test_contents_stay_in_view_on_a_wide_page(page: Browser) -> None:
    page.send("Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False)
    page.value("window.scrollTo(0, 1500)")
    box = "document.querySelector('{}').getBoundingClientRect().{}".format
    assert 0 <= page.value(box("nav", "top")) < 900
    assert page.value(box("main", "left")) >= page.value(box("nav", "right")), "beside the text"
    page.send("Emulation.clearDeviceMetricsOverride")


def test_readings_are_announced(page: Browser) -> None:
    live = "document.querySelector('#figure-griffin output')"
    assert page.value(f"{live}.getAttribute('aria-live')") == "polite"
    assert page.value(f"{live}.getAttribute('role')") == "status"
    assert page.value("document.querySelector('#figure-griffin svg').getAttribute('aria-label')")


def test_on_paper_the_picture_takes_the_place_of_the_chart(page: Browser) -> None:
    shown = "getComputedStyle(document.querySelector('#figure-griffin {}')).display"
    assert page.value(shown.format(".zoom")) == "none"
    page.send("Emulation.setEmulatedMedia", media="print")
    assert page.value(shown.format(".zoom")) == "block"
    assert page.value(shown.format(".tool")) == "none"
    page.send("Emulation.setEmulatedMedia", media="")


def test_nothing_sticks_out_of_a_narrow_page(page: Browser) -> None:
    page.send("Emulation.setDeviceMetricsOverride", width=360, height=800, deviceScaleFactor=1, mobile=True)
    assert page.value("document.documentElement.scrollWidth") <= 360
    page.send("Emulation.clearDeviceMetricsOverride")


def test_letters_of_a_chart_keep_their_size_and_nothing_hides_text_where_the_page_grows_narrow(page: Browser) -> None:
    chart = "document.querySelector('#figure-griffin .tool')"
    size = f"Math.min(...[...{chart}.querySelectorAll('svg text')].map((one) => one.getBoundingClientRect().height))"
    field = f"{chart}.querySelector('input[type=number]')"
    page.value(f"{field}.value = '12.5'; {field}.dispatchEvent(new Event('input'))")
    wide, before = page.value(f"{chart}.querySelector('svg').viewBox.baseVal.width"), answer(page)
    page.send("Emulation.setDeviceMetricsOverride", width=390, height=800, deviceScaleFactor=1, mobile=False)
    page.value("window.dispatchEvent(new Event('resize'))")
    assert page.value(f"{chart}.querySelector('svg').viewBox.baseVal.width") < wide, "drawn anew"
    assert page.value(size) > 11.0, "px"
    assert answer(page) == before, "at the number that was chosen"
    assert page.value("getComputedStyle(document.querySelector('.back')).position") == "sticky", "a line of its own"
    page.send("Emulation.clearDeviceMetricsOverride")
    page.value("window.dispatchEvent(new Event('resize'))")


def test_a_chart_has_a_caption_of_its_own_and_a_picture_that_of_the_picture(page: Browser) -> None:
    shown = "document.querySelector('#figure-{} figcaption').innerText"
    assert "to be read off" in page.value(shown.format("griffin"))
    assert "caption" not in page.value(shown.format("griffin"))
    assert page.value(shown.format("damper")).endswith("caption"), "its picture stays"
    page.send("Emulation.setEmulatedMedia", media="print")
    assert page.value(shown.format("griffin")).endswith("caption")
    page.send("Emulation.setEmulatedMedia", media="")


def test_at_the_end_there_is_still_nothing_to_complain_of(page: Browser) -> None:
    assert page.complaints() == []
