"""The live page in a browser: what its figures hold, its buttons, keys, two users, and how it looks."""

import json
import zipfile

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw, load_rig_and_law
from clearance_mj.engines import simulate
from clearance_mj.io.dataset import Dataset, write_dataset
from clearance_mj.signals import excitation
from clearance_mj.signals.frf import estimate_frf

from ..conftest import TABLE1
from .browser import CHROMIUM, chromium, opened, served, settled, slide, until

pytest.importorskip("playwright", reason='needs Playwright: pip install "clearance-mj[browser]"')
pytestmark = [
    pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium"),
]  # fmt: skip

LAW = ConstantLaw(7.8e3, 4.0)
MARKUP = "<img src=x onerror=alert(1)> & <b>rig</b>"
MAGNITUDE = "(name) => { const d = live.charts.magnitude.plot.data; return name === 'x' ? d[0] : d[name]; }"


@pytest.fixture(scope="module")
def folder(small_dataset, tmp_path_factory):
    """The small dataset, its rig named with markup, and its law."""
    dataset = Dataset.load(small_dataset)
    path = tmp_path_factory.mktemp("live") / "dataset"
    rig = dataset.rig.replace(name=MARKUP)
    write_dataset(path, rig, [_renamed(record, rig) for record in dataset.records])
    LAW.save(path / "law.json")
    return path


def _renamed(record, rig):
    import dataclasses

    return dataclasses.replace(record, rig=rig, channels=tuple(record.channels))


@pytest.fixture(scope="module")
def address(folder, tmp_path_factory):
    with served(tmp_path_factory.mktemp("address"), folder) as found:
        yield found


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


@pytest.fixture
def page(browser, address):
    found, errors = opened(browser, address)
    yield found
    found.context.close()
    assert errors == []


def shown(page, row):
    return np.array(page.evaluate(MAGNITUDE, row), dtype=float)


def put(page, name, value):
    field = page.locator(f'[id="c-{name}"]')
    field.fill(str(value))
    field.press("Tab")
    settled(page)


def expected(gap, level=2.0):
    import dataclasses

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
    assert "CSAC" in page.inner_text("#at") and page.inner_text("#sensors tbody tr:first-child td:last-child").endswith(
        "dB"
    )
    page.select_option('[id="c-excitation"]', "record: level_4_1")
    settled(page)
    law = load_rig_and_law(folder)[1]
    model = simulate(TABLE1, Dataset.load(folder).records[3].excitation(), law, "modal")
    np.testing.assert_allclose(shown(page, 1), np.abs(estimate_frf(model).value[0, 0]), rtol=1e-6)


def test_memory_of_two_settings(page):
    page.click("#keep-A")
    put(page, "bushings[0].gap", 100)
    page.click("#keep-B")
    put(page, "bushings[0].gap", 800)
    rows = [shown(page, row) for row in (1, 9, 17)]
    for row, gap in zip(rows, (8e-4, 3e-4, 1e-4)):
        np.testing.assert_allclose(row, expected(gap)[0], rtol=1e-6)
    page.click("#back-B")
    settled(page)
    assert page.input_value('[id="c-bushings[0].gap"]') == "100"
    np.testing.assert_allclose(shown(page, 1), expected(1e-4)[0], rtol=1e-6)


def test_export(page, tmp_path):
    put(page, "bushings[0].gap", 200)
    with page.expect_download() as download:
        page.click("#export")
    download.value.save_as(tmp_path / "state.zip")
    with zipfile.ZipFile(tmp_path / "state.zip") as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path / "state")
    rig, law = load_rig_and_law(tmp_path / "state")
    assert rig.bushings[0].gap == 2e-4 and law.table(2).parameters[0].tolist() == [[7.8e3, 4.0], [7.8e3, 4.0]]
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
    slider = page.locator('[id="c-bushings[0].gap"] ~ input[type=range]')
    slider.focus()
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
    reached, wanted = (
        set(),
        page.evaluate("document.querySelectorAll('button:enabled, input:enabled, select, .chart').length"),
    )
    page.evaluate("document.activeElement.blur()")
    for _ in range(wanted + 40):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate("(e => e.id || (e.getAttribute('aria-label') || e.textContent))(document.activeElement)")
        )
    assert {
        "reset",
        "keep-A",
        "export",
        "c-excitation",
        "c-bushings[1].gap",
        "magnitude",
        "history",
        "play",
        "s-7",
        "branch-go",
    } <= reached


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
    assert page.evaluate("document.documentElement.scrollWidth") <= width  # nothing sticks out
    assert page.evaluate(CONTRAST) == []
    page.screenshot(path=tmp_path / f"live_{width}_{scheme}.png", full_page=True)
    assert errors == []
    page.context.close()


# Texts whose contrast with their background is below 4.5 (WCAG 2.2, 1.4.3), disabled controls aside.
CONTRAST = """(() => {
    const rgb = (text) => {
        const m = text.match(/[\\d.]+/g).map(Number);
        return m.length > 3 && m[3] === 0 ? null : m;
    };
    const light = (colour) => {
        const linear = (v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
        const [r, g, b] = colour.slice(0, 3).map((v) => linear(v / 255));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = (e) => {
        for (; e; e = e.parentElement) {
            const colour = rgb(getComputedStyle(e).backgroundColor);
            if (colour) return colour;
        }
        return [255, 255, 255];
    };
    const bad = [];
    const texts = "h1, h2, p, label, th, td, button, select, input, summary, caption, span";
    for (const e of document.querySelectorAll(texts)) {
        const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
        const off = e.matches(":disabled") || e.closest("label:has(input:disabled)") || !e.getClientRects().length;
        if (off || !(own || e.matches("input, select"))) continue;
        const [a, b] = [light(rgb(getComputedStyle(e).color)), light(behind(e))].sort((x, y) => y - x);
        const ratio = (a + 0.05) / (b + 0.05);
        if (ratio < 4.5) bad.push([e.tagName, e.id, e.textContent.slice(0, 30), ratio]);
    }
    return bad;
})()"""
