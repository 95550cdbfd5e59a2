"""The live page in a browser: what its figures hold, its buttons, keys, two users, and how it looks."""

import dataclasses
import json
import zipfile

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Dataset, Model, estimate_frf, excitation, simulate, write_dataset

from ..conftest import ROOT, TABLE1
from ..contrast import FAINT_TEXTS, contrast
from .browser import CHROMIUM, chromium, opened, served, settled, slide, until

pytest.importorskip("playwright", reason='needs Playwright: pip install "clearance-mj[browser]"')
pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")]

LAW = ConstantLaw(7.8e3, 4.0)
MARKUP = "<img src=x onerror=alert(1)> & <b>rig</b>"
MAGNITUDE = "(name) => { const d = live.charts.magnitude.plot.data; return name === 'x' ? d[0] : d[name]; }"


@pytest.fixture(scope="module")
def folder(small_dataset, tmp_path_factory):
    """The small dataset, its rig named with markup, and its law."""
    dataset = Dataset.load(small_dataset)
    path = tmp_path_factory.mktemp("live") / "dataset"
    rig = dataset.rig.replace(name=MARKUP)
    write_dataset(path, rig, [dataclasses.replace(r, rig=rig, channels=tuple(r.channels)) for r in dataset.records])
    LAW.save(path / "law.json")
    return path


@pytest.fixture(scope="module")
def address(folder, tmp_path_factory):
    with served(tmp_path_factory.mktemp("address"), folder) as url:
        yield url


@pytest.fixture(scope="module")
def browser():
    with chromium() as chrome:
        yield chrome


@pytest.fixture
def page(browser, address):
    loaded, errors = opened(browser, address)
    yield loaded
    loaded.context.close()
    assert errors == []


def shown(page, row):
    return np.array(page.evaluate(MAGNITUDE, row), dtype=float)


def put(page, name, value):
    field = page.locator(f'[id="c-{name}"]')
    field.fill(str(value))
    field.press("Tab")
    settled(page)


def expected(gap, level=2.0):
    first, *others = TABLE1.bushings
    rig = TABLE1.replace(bushings=(dataclasses.replace(first, gap=gap), *others))
    return np.abs(estimate_frf(simulate(rig, excitation.random(10, 2048.0, rms=level), LAW, "modal")).value[:, 0])


def test_moving_the_gap_shows_the_frf_of_simulate(page):
    np.testing.assert_allclose(shown(page, 8), expected(3e-4)[7], rtol=1e-6)
    put(page, "bushings[0].gap", 120)
    np.testing.assert_allclose(shown(page, 1), expected(1.2e-4)[0], rtol=1e-6)
    np.testing.assert_allclose(shown(page, 8), expected(1.2e-4)[7], rtol=1e-6)
    slide(page, "bushings[0].gap", 500)  # the middle: the identified gap
    settled(page)
    np.testing.assert_allclose(shown(page, 8), expected(3e-4)[7], rtol=1e-6)
    put(page, "level", 5)
    page.click("#reset")
    settled(page)
    np.testing.assert_allclose(shown(page, 8), expected(3e-4)[7], rtol=1e-6)


def test_names_with_markup_are_text(page):
    assert page.inner_text("#rig") == MARKUP and page.locator("#rig *").count() == 0


def test_overlay_of_a_record(page, folder):
    page.select_option("#record", "level_4_1")
    settled(page)
    test = np.abs(estimate_frf(Dataset.load(folder).records[3].response()).value[:, 0])
    np.testing.assert_allclose(shown(page, 9), test[0], rtol=1e-6)
    assert "CSAC" in page.inner_text("#at")
    assert page.inner_text("#sensors tbody tr:first-child td:last-child").endswith("dB")
    page.select_option('[id="c-excitation"]', "record: level_4_1")
    settled(page)
    model = simulate(TABLE1, Dataset.load(folder).records[3].excitation(), Model.load(folder).law, "modal")
    np.testing.assert_allclose(shown(page, 1), np.abs(estimate_frf(model).value[0, 0]), rtol=1e-6)


def test_memory_of_two_settings(page):
    page.click("#keep-A")
    put(page, "bushings[0].gap", 100)
    page.click("#keep-B")
    put(page, "bushings[0].gap", 800)
    for row, gap in zip([shown(page, row) for row in (1, 9, 17)], (8e-4, 3e-4, 1e-4)):
        np.testing.assert_allclose(row, expected(gap)[0], rtol=1e-6)
    page.click("#back-B")
    settled(page)
    assert page.input_value('[id="c-bushings[0].gap"]') == "100"
    np.testing.assert_allclose(shown(page, 1), expected(1e-4)[0], rtol=1e-6)


def test_a_and_b_are_heard_at_one_full_scale(page):
    page.click("#keep-A")
    page.wait_for_selector("#hear-A:enabled")
    put(page, "bushings[0].gap", 100)
    page.click("#keep-B")
    page.wait_for_selector("#hear-B:enabled")
    said = []
    for slot in "AB":
        page.click(f"#hear-{slot}")
        said.append(page.inner_text("#status"))
    first, second = (words.partition(" peak")[0] for words in said)
    assert second == "B" + first[1:]
    peaks = page.evaluate("[...'AB'].map((s) => Math.max(...live.state.memory[s].sound.samples.map(Math.abs)))")
    assert float(said[0].partition("full scale ")[2].split()[0]) == pytest.approx(max(peaks), rel=0.01)


def test_export(page, tmp_path):
    page.select_option("#record", "level_4_1")
    put(page, "bushings[0].gap", 200)
    with page.expect_download() as download:
        page.click("#export")
    download.value.save_as(tmp_path / "state.zip")
    with zipfile.ZipFile(tmp_path / "state.zip") as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path / "state")
    assert "test, same colours" in (tmp_path / "state" / "frf.svg").read_text()
    model = Model.load(tmp_path / "state")
    assert model.rig.bushings[0].gap == 2e-4
    assert model.law.table(2).parameters[0].tolist() == [[7.8e3, 4.0], [7.8e3, 4.0]]
    assert json.loads((tmp_path / "state" / "setting.json").read_text())["engine"] == "modal"


def test_two_clients_do_not_disturb_each_other(browser, address, page):
    other, errors = opened(browser, address)
    before = shown(page, 1)
    put(other, "bushings[0].gap", 60)
    for level in (1, 3, 8):
        slide(other, "level", 100 * level)
    slide(page, "seed", 500)
    settled(page)
    assert np.abs(shown(page, 1) - before).max() > 0
    slide(page, "seed", 0)
    settled(page)
    settled(other)
    np.testing.assert_array_equal(shown(page, 1), before)
    assert page.input_value('[id="c-bushings[0].gap"]') == "300" and errors == []
    other.context.close()


def test_divergence_is_said_and_the_page_goes_on(page):
    before = shown(page, 1)
    put(page, "level", "1e200")
    assert "diverged" in page.inner_text("#problem") and page.is_visible("#problem")
    np.testing.assert_array_equal(shown(page, 1), before)
    put(page, "bushings[0].offset", 900)
    assert "beyond the gap" in page.inner_text("#problem")
    page.click("#reset")
    settled(page)
    assert not page.is_visible("#problem")
    np.testing.assert_array_equal(shown(page, 1), before)


def test_keyboard(page):
    page.locator('[id="c-bushings[0].gap"] ~ input[type=range]').focus()
    for _ in range(50):
        page.keyboard.press("ArrowLeft")
    settled(page)
    gap = float(page.input_value('[id="c-bushings[0].gap"]')) * 1e-6
    assert gap == pytest.approx(3e-4 * 10 ** (-50 / 500), rel=1e-3)
    np.testing.assert_allclose(shown(page, 1), expected(gap)[0], rtol=1e-6)
    page.locator("#magnitude").focus()
    page.keyboard.press("ArrowRight")
    first = page.inner_text("#at")
    page.keyboard.press("ArrowRight")
    assert "Hz" in first and page.inner_text("#at") != first
    x, at = shown(page, "x"), page.evaluate("live.charts.magnitude.plot.cursor.idx")
    assert page.evaluate("live.charts.phase.plot.cursor.idx") == at
    said = float(page.inner_text("#sensors tbody tr:first-child td:nth-child(2)"))
    assert said == pytest.approx(shown(page, 1)[at], rel=1e-3) and f"{x[at]:g} Hz" in page.inner_text("#at")
    page.keyboard.press("+")
    low, high = page.evaluate("(() => { const s = live.charts.magnitude.plot.scales.x; return [s.min, s.max]; })()")
    assert high - low == pytest.approx((x[-1] - x[0]) / 2, rel=0.01)
    page.keyboard.press("0")
    assert page.evaluate("live.charts.magnitude.plot.scales.x.max") == x[-1]
    # everything that can be pressed or moved is reached by Tab
    wanted = page.evaluate("document.querySelectorAll('button:enabled, input:enabled, select, .chart').length")
    reached, name = set(), "(e => e.id || (e.getAttribute('aria-label') || e.textContent))(document.activeElement)"
    page.evaluate("document.activeElement.blur()")
    for _ in range(wanted + 40):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(name))
    named = "reset keep-A export c-excitation c-bushings[1].gap magnitude history play s-7 branch-go"
    assert set(named.split()) <= reached


def stepped(page):
    """Step a sine at 2.83 m/s² through 41.75, 42.45 and 43.15 Hz and back."""
    for name, value in (("branch-low", 41.75), ("branch-high", 43.15), ("steps-count", 3), ("steps-hold", 3)):
        page.fill(f"#{name}", str(value))
    page.click("#steps-go")
    until(page, "Boolean(live.state.steps)")


def test_a_stepped_sine_is_drawn_over_the_branch(page):
    stepped(page)
    words = page.inner_text("#steps-words")
    assert "2.828 m/s² amplitude" in words and "at 42.45 Hz" in words  # between the folds at 42.30 and 42.75 Hz
    page.click("#branch-go")
    until(page, "Boolean(live.state.branch)")
    labels = page.evaluate("live.charts.branch.plot.series.slice(1).map((s) => s.label)")
    assert len(labels) == 3 * 8 and len(set(labels)) == 8
    up, down = (np.array(page.evaluate(f"Array.from(live.state.steps.{way}.slice(0, 3))")) for way in ("up", "down"))
    assert np.abs(up / down - 1).argmax() == 1 and up[1] > 1.05 * down[1]


def test_an_orbit_is_drawn_where_a_clearance_has_two_directions(browser, page, tmp_path):
    assert not page.is_visible("#orbits")
    with served(tmp_path, ROOT / "models" / "pump_frame.toml") as address:
        other, errors = opened(browser, address)
        assert other.is_visible("#orbit canvas") and "no shaft" in other.inner_text("#shaft-words")
        x, y = np.array(other.evaluate("live.charts.orbit.plot.data[2]"))
        drawn = np.array(other.evaluate("live.charts.portrait.plot.data.slice(1).map((d) => d[0])"))
        np.testing.assert_array_equal((x, y), drawn)
        box = other.locator("#orbit .u-over").bounding_box()
        assert box["width"] == pytest.approx(box["height"], rel=0.02) and errors == []
        other.context.close()


def test_phases_of_another_grid_go_the_shorter_way_round(page):
    on_grid = page.evaluate("Array.from(onGrid([1, 1.5, 2], [1, 2], [170, -170], true))")
    assert on_grid[0] == 170 and abs(on_grid[1]) == 180 and on_grid[2] == -170


def test_branch_with_progress_and_cancel(page):
    page.fill("#branch-low", "20")
    page.click("#branch-go")
    until(page, "Boolean(live.state.branch)")
    assert "fold at 42.7" in page.inner_text("#branch-words")  # docs/periodic.md: 2.83 m/s² of the Table-1 rig
    page.fill("#sweep-count", "200")
    page.click("#sweep-go")
    assert page.is_visible("#sweep-progress")
    page.click("#sweep-go ~ .cancel")
    until(page, "!live.state.busy")
    assert page.inner_text("#sweep-words") == "Cancelled." and page.is_enabled("#branch-go")


@pytest.mark.parametrize("width", [390, 1280, 1920])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_looks(browser, address, tmp_path, width, scheme):
    page, errors = opened(browser, address, viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.select_option("#record", "level_1_1")
    settled(page)
    stepped(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width  # nothing sticks out
    assert page.evaluate(FAINT_TEXTS) == []
    assert [stroke for stroke in page.evaluate(STROKES) if contrast(*stroke) < 3] == []  # 1.4.11
    page.screenshot(path=tmp_path / f"live_{width}_{scheme}.png", full_page=True)
    assert errors == []
    page.context.close()


# Pairs of colours: curves, marks of sensors and borders of what can be pressed, with what is behind them.
STROKES = """(() => {
    const paper = getComputedStyle(document.body).backgroundColor, found = [];
    const context = document.createElement("canvas").getContext("2d");
    const rgb = (colour) => Object.assign(context, { fillStyle: colour }).fillStyle
        .replace(/^#(..)(..)(..)$/, (_, ...c) => `rgb(${c.slice(0, 3).map((v) => parseInt(v, 16)).join(", ")})`);
    for (const chart of Object.values(live.charts))
        for (const series of chart.plot ? chart.plot.series.slice(1) : [])
            if (series.label !== "ends") found.push([rgb(series.stroke()), paper]);
    for (const name of ["--soft", "--link", "--warn"]) found.push([rgb(ink(name)), paper]);
    for (const e of document.querySelectorAll("input[type=number], select, button:enabled"))
        if (e.getClientRects().length) found.push([getComputedStyle(e).borderTopColor, paper]);
    for (const e of document.querySelectorAll(".swatch")) found.push([getComputedStyle(e).backgroundColor, paper]);
    return found;
})()"""
