"""Charts out of figures: their data are the figure's, and what a browser makes of them (slow)."""

import base64
import json
import re
import shutil
import zlib

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D

from clearance_mj.core.drawing import phase
from clearance_mj.report import html
from clearance_mj.report.interactive import chart, decimated, embedded, thinned
from clearance_mj.report.style import Drawing, decibel

from ..contrast import FAINT_TEXTS, contrast

X = np.arange(5.0, 105.0, 0.5)
MARKUP = "law “<b>&</script>”"


def figure() -> Figure:
    """Two sensors; magnitude in dB over phase, a mark at 20 Hz; the second phase is for the chart alone."""
    drawn = Figure(figsize=(7.5, 4), layout="constrained")
    axes = drawn.subplots(2, 2, sharex=True)
    for column, name in zip(axes.T, ("a", "b")):
        for i, label in enumerate((MARKUP, "test")):
            column[0].plot(X, np.sin(X / (3 + i)), "--" if i else "-", color=f"C{i}", label=label)
            column[1].plot(X, 90 * np.cos(X / (3 + i)), color=f"C{i}", label=label)
        column[0].axvline(20, color="r")
        column[0].set_title(f"sensor {name}", loc="left")
        column[1].set(xlabel="Frequency (Hz)")
        column[0].set(xscale="log", xlim=(5, 104.5), ylim=(-2, 2))
    axes[0, 0].set_ylabel("|H|\n(dB re 1)")
    axes[1, 0].set_ylabel("Phase (°)")
    axes[1, 1].set_visible(False)
    drawn.draw_without_rendering()
    return drawn


def arrays(chart_data) -> list[np.ndarray]:
    planes = np.frombuffer(zlib.decompress(base64.b64decode(chart_data["numbers"])), np.uint8).reshape(4, -1)
    numbers = planes.T.copy().view("<f4")[:, 0]
    return [
        numbers[a["at"] : a["at"] + a["n"]] if "at" in a else a["from"] + a["step"] * np.arange(a["n"])
        for a in chart_data["arrays"]
    ]


def test_a_chart_is_the_figure():
    chart_data = chart(figure())
    assert [cell["title"] for cell in chart_data["cells"]] == ["sensor a", "sensor b"]
    for cell in chart_data["cells"]:
        magnitude, phase = cell["panels"]
        assert (magnitude["y"], phase["y"], phase["x"]) == ("|H| (dB re 1)", "Phase (°)", "Frequency (Hz)")
        assert magnitude["x"] == "Frequency (Hz)", "of the panel below"
        assert (magnitude["log"], magnitude["decibel"], phase["decibel"]) == ([True, False], "1", "")
        assert magnitude["limits"] == [[5, 104.5], [-2, 2]]
        assert magnitude["marks"] == [{"x": 20.0, "colour": "#ff0000"}]
        for panel, expected in ((magnitude, np.sin(X / 4)), (phase, 90 * np.cos(X / 4))):
            line = panel["lines"][1]
            np.testing.assert_array_equal(arrays(chart_data)[line["x"]], X)
            np.testing.assert_array_equal(arrays(chart_data)[line["y"]], expected.astype(np.float32))
            assert chart_data["series"][line["series"]]["label"] == "test"
            assert chart_data["series"][line["series"]]["colour"] == "#ff7f0e"
    assert len(chart_data["arrays"]) == 5, "the same numbers are stored once"


def test_a_phase_has_its_value_where_it_wraps():
    angle = np.array([170.0, 179.0, -179.0, -170.0, 175.0])
    shown = phase(np.exp(1j * np.radians(angle)))
    np.testing.assert_array_equal(shown.mask, [False, False, True, False, True])  # a gap in the picture
    drawn = Figure()
    drawn.subplots().plot(X[:5], shown, label="phase")
    (line,) = chart(drawn)["cells"][0]["panels"][0]["lines"]
    np.testing.assert_allclose(arrays(chart(drawn))[line["y"]], angle, rtol=1e-6)


def test_a_shifted_line_is_read_as_its_data_are():
    drawn = Figure()
    ax = drawn.subplots()
    ax.margins(0)
    ax.plot(X, X**2, transform=Affine2D().translate(0, 20) + ax.transData, label="up")
    assert ax.get_ylim() == (5**2 + 20, 104.5**2 + 20)
    (line,) = chart(drawn)["cells"][0]["panels"][0]["lines"]
    assert line["up"] == 20
    np.testing.assert_array_equal(arrays(chart(drawn))[line["y"]], (X**2).astype(np.float32))


def test_a_line_that_steps_back_is_refused():
    drawn = Figure()
    drawn.subplots().plot([0, 1, 0.5], [0, 1, 2], label="loop")
    with pytest.raises(ValueError, match="“loop” steps back"):
        chart(drawn)
    drawn = Figure()
    drawn.subplots().plot([0, 1, 0.5], [0, 1, 2], ".", label="points")
    chart_data = chart(drawn)
    assert [list(values) for values in arrays(chart_data)] == [[0, 0.5, 1], [0, 2, 1]]


def test_decimation_keeps_extremes_and_gaps():
    x = np.arange(10_000.0)
    y = np.sin(x / 50)
    y[5003], y[7001], y[8000] = 9, -9, np.nan
    short_x, short_y = decimated(x, y, 400)
    assert 200 < short_x.size <= 402 and (np.diff(short_x) > 0).all()
    np.testing.assert_array_equal(short_y, y[short_x.astype(int)])
    assert (np.nanmax(short_y), np.nanmin(short_y), np.isnan(short_y).sum()) == (9, -9, 1)
    assert decimated(x, y, 10_000)[0] is x


def test_thinned_points_keep_what_lies_outside():
    x, y = np.random.default_rng(0).standard_normal((2, 50_000))
    y[7], x[8] = 30, -9
    few_x, few_y = thinned(x, y, 400)
    assert 100 < few_x.size <= 400 and (np.diff(few_x) >= 0).all()
    assert (few_y.max(), few_y.min(), few_x[0], few_x[-1]) == (30, y.min(), -9, x.max())
    assert {*zip(few_x, few_y)} <= {*zip(x, y)}


def test_words_with_markup_stay_words():
    text = embedded(figure())
    assert "<" not in text and json.loads(text)["series"][0]["label"] == MARKUP


def page_of(drawing, svg=b"<svg/>"):
    return html.page("t", [html.PageSection("a", "A", html.figure(drawing, 1, svg))])


def test_only_pages_with_charts_have_their_script():
    plain, lively = (page_of(Drawing("p", figure(), "c", "a", chart=chart)) for chart in (False, True))
    assert "uPlot" not in plain and 'type="application/json"' not in plain
    assert lively.count("The MIT License (MIT)") == 1, "as it asks for, in every copy"


# In a browser.

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="module")
def chromium():
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("neither chromium nor google-chrome is installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def opened(chromium):
    """Open a page without network; complaints and requests end the test."""
    contexts, complaints = [], []

    def open_page(path, width=1280, scheme="light", **options):
        options |= {"viewport": {"width": width, "height": 900}, "color_scheme": scheme, "offline": True}
        contexts.append(chromium.new_context(**options))
        page = contexts[-1].new_page()
        page.set_default_timeout(5000)
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "request",
            lambda request: complaints.extend([request.url] * (request.url[:5] not in ("file:", "data:", "blob:"))),
        )
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not complaints


FIGURE = "#figure-frf_bushings_level_4"


@pytest.fixture
def page(folder, opened):
    """The report with a chart in view."""
    page = opened(folder / "report.html")
    panel(page)
    return page


def panel(page, number=0, figure=FIGURE):
    over = page.locator(f"{figure} .u-over").nth(number)
    for _ in range(2):  # the charts above are made when they come near, and have heights of their own
        page.locator(figure).evaluate("figure => figure.scrollIntoView()")
        over.wait_for()
        page.wait_for_timeout(100)
    return over


def described(page, figure=FIGURE) -> tuple[str, dict[str, list[str]]]:
    """Where the cursor is, and what it reads of every curve."""
    rows = page.locator(f"{figure} .chart-read tbody tr").all()
    cells = [row.locator("th, td").all_inner_texts() for row in rows]
    return page.locator(f"{figure} .chart-at").inner_text(), {name: values for name, *values in cells}


def limits(page, figure=FIGURE) -> list[float]:
    """Ends of the frequency axis, the same on all panels; its labels are on a canvas."""
    scales = "document.querySelector(figure).chart.panels.map(panel => panel.plot.scales.x)"
    first, *others = page.evaluate(f"figure => {scales}.map(({{min, max}}) => [min, max])", figure)
    assert others == [first] * 2
    return first


def expected(study, hz) -> dict[str, complex]:
    """FRFs at the sensor in the bushing."""
    at = int(np.argmin(np.abs(study.tests["level_4_a"].frequency - hz)))
    of = {"test": study.tests["level_4_a"], "test, other seed": study.tests["level_4_b"]}
    of |= {f"law “{law}”": study.case(law, "links", 4.0).frf for law in ("nominal", "constant")}
    return {name: frf.functions[1, at] for name, frf in of.items()}


def frequency(words) -> float:
    return float(re.search(r"Frequency (\S+) Hz", words)[1])


@pytest.mark.slow
def test_the_cursor_reads_what_the_data_have(study, page):
    for x in (150, 400, 777):
        panel(page).hover(position={"x": x, "y": 40})
        words, rows = described(page)
        assert words.startswith("(a) sensor 2, bushing 1")
        for name, value in expected(study, frequency(words)).items():
            known = decibel(value), np.degrees(np.angle(value))
            assert [float(cell) for cell in rows[name][:2]] == pytest.approx(known, rel=1e-4), (name, words)
        assert rows["test"][2] == "0.9", "coherence"


@pytest.mark.slow
def test_the_cursor_reads_a_phase_where_it_wraps(study, page):
    test = study.tests["level_4_a"]
    angle = np.degrees(np.angle(test.functions[1]))
    wraps = np.flatnonzero(np.abs(np.diff(angle)) > 180) + 1
    assert wraps.size
    for at in wraps[:3].tolist():
        page.evaluate("([figure, at]) => { const {chart} = document.querySelector(figure);"
                      " chart.point(chart.panels[0], at); }", [FIGURE, at])  # fmt: skip
        words, rows = described(page)
        assert (frequency(words), float(rows["test"][1])) == (test.frequency[at], pytest.approx(angle[at], rel=1e-4))


@pytest.mark.slow
def test_arrow_keys_move_the_cursor_line_by_line(study, page):
    cell = page.locator(f"{FIGURE} .chart-cell")
    cell.focus()
    moves = (1, "Home", 5), (3, "ArrowRight", 6.5), (1, "Shift+ArrowRight", 11.5), (1, "ArrowLeft", 11), (1, "End", 220)
    for times, key, hz in moves:
        for _ in range(times):
            cell.press(key)
        words, rows = described(page)
        assert frequency(words) == hz
        assert float(rows["test"][0]) == pytest.approx(decibel(expected(study, hz)["test"]), rel=1e-4)
    page.wait_for_function("figure => document.querySelector(figure + ' .chart-spoken').textContent", arg=FIGURE)
    assert "220 Hz" in page.locator(f"{FIGURE} .chart-spoken").inner_text()
    cell.press("Home")
    cell.press("+")
    assert limits(page)[1] < 220
    cell.press("0")
    assert limits(page) == [5, 220]


@pytest.mark.slow
def test_tab_reaches_tools_curves_and_chart(page):
    page.locator(f"{FIGURE} .chart-x").focus()
    reached = set()
    for _ in range(14):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.className || document.activeElement.textContent"))
    assert {"chart-y", "chart-in", "chart-whole", "chart-picture", "test", "chart-cell"} <= reached


@pytest.mark.slow
def test_zoom_by_mouse_goes_for_all_panels_and_back(page):
    box = panel(page).bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 4, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, middle, steps=4)
    page.mouse.up()
    ends = 5 * (220 / 5) ** np.array([1 / 4, 1 / 2])
    assert limits(page) == pytest.approx(ends, abs=0.5), "to the next line, 0.5 Hz apart"
    page.mouse.dblclick(box["x"] + 50, middle)
    assert limits(page) == [5, 220]


def drawn(page) -> str:
    page.wait_for_timeout(50)
    return page.evaluate("figure => document.querySelector(figure + ' .uplot canvas').toDataURL()", FIGURE)


@pytest.mark.slow
def test_the_legend_takes_curves_and_sensors_away(page):
    before, button = drawn(page), page.locator(f"{FIGURE} .chart-read button", has_text="law “nominal”")
    button.click()
    assert button.get_attribute("aria-pressed") == "false" and drawn(page) != before
    button.press("Enter")
    assert drawn(page) == before and button.get_attribute("aria-pressed") == "true"
    others = "#figure-frf_others_level_4"
    panel(page, figure=others)
    cells = page.locator(f"{others} .chart-cell")
    assert [cell.is_visible() for cell in cells.all()] == [True, True]
    page.locator(f"{others} .chart-cell-toggle").first.click()
    assert [cell.is_visible() for cell in cells.all()] == [False, True]


@pytest.mark.slow
def test_axes_turn_logarithmic_and_linear(study, page):
    width, read = panel(page).bounding_box()["width"], []
    for _ in range(2):
        panel(page).hover(position={"x": width / 2, "y": 30})
        read.append(frequency(described(page)[0]))
        page.locator(f"{FIGURE} .chart-x").click()
    assert read == pytest.approx([np.sqrt(5 * 220), (5 + 220) / 2], abs=0.51)
    page.locator(f"{FIGURE} .chart-y").click()
    panel(page).hover(position={"x": width / 3, "y": 30})
    words, rows = described(page)
    assert float(rows["test"][0]) == pytest.approx(abs(expected(study, frequency(words))["test"]), rel=1e-4)
    assert "|H| (1)" in page.locator(f"{FIGURE} .chart-read thead").inner_text()


@pytest.mark.slow
@pytest.mark.parametrize("how", ["scripts off", "print"])
def test_the_picture_shows_where_the_chart_cannot(folder, opened, how):
    page = opened(folder / "report.html", java_script_enabled=how == "print")
    picture, box = page.locator(f"{FIGURE} > img"), page.locator(f"{FIGURE} .chart")
    if how == "print":
        panel(page)
        assert box.is_visible() and not picture.is_visible()
        page.emulate_media(media="print")
        assert not box.is_visible()
    picture.scroll_into_view_if_needed()
    assert picture.is_visible() and picture.bounding_box()["height"] > 200


@pytest.mark.slow
def test_markup_in_names_shows_as_text(tmp_path, opened):
    path = tmp_path / "page.html"
    drawing = Drawing("p", figure(), "c", "a", chart=True)
    path.write_text(page_of(drawing, drawing.svg()), encoding="utf-8")
    page = opened(path)
    page.locator(".u-over").first.hover()
    assert described(page, "#figure-p")[1].keys() == {MARKUP, "test"}
    assert page.locator("figure b").count() == 1, "of the figure's number"


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_charts_fit_and_their_curves_stand_out(folder, opened, width, scheme):
    """3 to 1, WCAG 2.2, 1.4.11."""
    page = opened(folder / "report.html", width=width, scheme=scheme)
    panel(page)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.locator(f"{FIGURE} .uplot").first.bounding_box()["width"] <= width
    plot, read = (page.locator(f"{FIGURE} {name}").first.bounding_box() for name in (".uplot", ".chart-read"))
    assert read["y"] >= plot["y"] + plot["height"] or read["y"] + read["height"] <= plot["y"] + 1  # does not cover it
    assert page.evaluate(FAINT_TEXTS) == []
    strokes = page.evaluate(
        "figure => document.querySelector(figure).chart.panels[0].plot.series.slice(1).map(s => s.stroke())", FIGURE
    )
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert len(strokes) == 5 and min(contrast(stroke, paper) for stroke in strokes) >= 3
