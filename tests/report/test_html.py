"""What the page's elements look like, and what a browser makes of them."""

import html as markup
import math
import re
import shutil

import pytest
from matplotlib.figure import Figure

from clearance_mj.report import html
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.statistics.intervals import Interval

from ..processes import run

TABLE = Table("t", "a < b", (
    Column("Level", "m/s²", "g"), Column("Law & engine"), Column("f", "Hz", ".2f", "Mode 1"),
    Column("MAC", "", ".3f", "Mode 1"),
), ((0.5, "<i>", 9.25, math.nan), (0.5, "b", None, 1.0), (1.0, "c", 9.5, 0.5)))  # fmt: skip


def test_a_cell_is_a_number_a_dash_for_nan_and_empty_for_none():
    text, number = html.table(TABLE), '<td class="number">'
    assert f'<th scope="row" class="number">0.5</th><td>&lt;i&gt;</td>{number}9.25</td>{number}–</td>' in text
    assert f"{number}</td>{number}1.000</td>" in text


def test_an_interval_stands_below_its_value_which_sorts_the_column():
    shown = Table("t", "c", (Column("Law"), Column("FRAC", "", ".2f")), (("a", Interval(0.5, 0.4, 0.75)),))
    assert '<td class="number" data-value="0.5">0.50<span class="interval">0.40–0.75</span></td>' in html.table(shown)
    doubtful = Table("t", "c", shown.columns, (("a", Interval(0.5, 0.4, 0.75, doubtful=True)),))
    assert "0.40–0.75*</span>" in html.table(doubtful)
    negative = Table("t", "c", (shown.columns[0], Column("Off", "dB", ".1f")), (("a", Interval(-4.1, -7.7, -0.5)),))
    assert "-7.7 to -0.5</span>" in html.table(negative)
    without = Table("t", "c", shown.columns, (("a", Interval(0.5)), ("b", Interval(math.nan))))
    assert html.table(without).count("interval") == 0 and ">–</td>" in html.table(without)


def test_words_are_escaped():
    text = html.table(TABLE, "Table <1>.")
    assert "a &lt; b" in text and "Law &amp; engine" in text and "Table &lt;1&gt;." in text and "<i>" not in text


def test_columns_of_a_group_share_a_heading_and_keep_their_place_in_the_row():
    text = html.table(TABLE)
    assert '<th scope="colgroup" colspan="2">Mode 1</th>' in text
    assert text.index('data-column="1"') < text.index("Mode 1</th>") < text.index('data-column="2"')
    assert text.count('rowspan="2"') == 2


def test_a_line_is_drawn_where_the_first_column_changes():
    assert html.table(TABLE, breaks=True).count('<tr class="break">') == 1
    assert "break" not in html.table(TABLE)


def test_formula_sets_symbols_with_an_index():
    assert html.formula("|Σ_f H_t*|² < φ^H") == "|Σ<sub>f</sub> <var>H</var><sub>t</sub>*|² &lt; φ<sup>H</sup>"
    assert html.formula("20 log_10(x)") == "20 log<sub>10</sub>(x)"


def test_a_figure_holds_its_image_and_its_words():
    text = html.figure(Drawing("p", Figure(), "big & bold", 'a "b"'), 3, b"<svg/>")
    assert 'src="data:image/svg+xml;base64,PHN2Zy8+"' in text and 'id="figure-p"' in text
    assert "<b>Figure 3.</b> big &amp; bold" in text and 'alt="a &#34;b&#34;"' in text


def test_the_contents_list_sections_and_their_parts():
    sections = [
        html.PageSection("a", "First & last", html.heading("a-1", "Part <1>")),
        html.PageSection("b", "Second", ""),
    ]
    text = html.page("t", sections)
    contents = text[text.index("<nav") : text.index("</nav>")]
    assert re.findall(r'<a href="#(.*?)">(.*?)</a>', contents) == [
        ("a", "First &amp; last"), ("a-1", "Part &lt;1&gt;"), ("b", "Second")
    ]  # fmt: skip
    assert all(text.count(f'id="{anchor}"') == 1 for anchor in ("a", "a-1", "b"))


# In a browser.

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
QUIET = ("--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync")
browser = pytest.mark.skipif(CHROMIUM is None, reason="neither chromium nor google-chrome is installed")

NUMBERS = (3.0, -20.0, math.nan, 1e-5, 10.0)
MIXED = Table(
    "t", "c", (Column("Name"), Column("x", "m", "g"), Column("share", "", ".1%"), Column("error", "dB", ".2f")),
    tuple(
        (name, x, x / 7, Interval(x, x - 1, x + 1))
        for name, x in zip(("sensor 10", "sensor 9", "Sensor 1", "ä", "a"), NUMBERS)
    ),
)  # fmt: skip


def shown(tmp_path, text) -> str:
    """Open a page in Chromium; return its elements once its scripts have run, refusing anything on the console."""
    path = tmp_path / "page.html"
    path.write_text(text, encoding="utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", *QUIET, f"--user-data-dir={tmp_path / 'user'}"]
    command += ["--enable-logging=stderr", "--virtual-time-budget=5000", "--dump-dom", path.as_uri()]
    done = run(*command, check=True)
    assert not [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return done.stdout


def with_script(text, script) -> str:
    return text.replace("</body>", f"<script>{script}</script>\n</body>")


def first_cells(text) -> list[str]:
    return re.findall(r'<tr(?: class="break")?><th scope="row".*?>(.*?)</th>', text)


@browser
def test_a_complaint_on_the_console_is_noticed(tmp_path):
    with pytest.raises(AssertionError, match="not defined"):
        shown(tmp_path, with_script(html.page("t", []), "undefined_function()"))


@browser
@pytest.mark.parametrize("presses, sign", [(1, 1), (2, -1), (3, 1)])
def test_numbers_sort_as_numbers_and_what_is_missing_comes_last(tmp_path, presses, sign):
    """Column by column: plain numbers, percentages, intervals."""
    expected = [n for _, n in sorted((sign * x, n) for n, x in zip(first_cells(html.table(MIXED)), NUMBERS) if x == x)]
    page = html.page("t", [html.PageSection("a", "A", html.table(MIXED) * 3)])
    press = f"""document.querySelectorAll("table").forEach((table, i) => {{
      for (let n = 0; n < {presses}; n++) table.querySelector(`[data-column="${{i + 1}}"] button`).click(); }})"""
    text = shown(tmp_path, with_script(page, press))
    cells = first_cells(text)
    assert [cells[i : i + 5] for i in (0, 5, 10)] == [[*expected, "Sensor 1"]] * 3
    assert text.count(f'aria-sort="{"ascending" if sign > 0 else "descending"}"') == 3


@browser
def test_words_sort_as_people_sort_them(tmp_path):
    page = html.page("t", [html.PageSection("a", "A", html.table(MIXED))])
    text = shown(tmp_path, with_script(page, "document.querySelector('[data-column=\"0\"] button').click()"))
    assert first_cells(text) == ["a", "ä", "Sensor 1", "sensor 9", "sensor 10"]


@browser
def test_a_link_into_a_folded_part_opens_it(tmp_path):
    folded = '<details id="far"><summary>Far</summary><details id="near"><summary>Near</summary>x</details></details>'
    page = html.page("t", [html.PageSection("a", "A", folded)])
    text = shown(tmp_path, with_script(page, "location.hash = '#near'"))
    assert text.count('open=""') == 2


@browser
@pytest.mark.parametrize("width", [390, 1280])
def test_the_report_fits_a_phone_and_a_desk(folder, tmp_path, width):
    """In a frame of that width, as Chromium's window is never narrower than 500 px; every part is opened first."""
    page = markup.escape((folder / "report.html").read_text(encoding="utf-8"))
    script = """addEventListener("load", () => {
      const page = document.querySelector("iframe").contentDocument;
      page.querySelectorAll("details").forEach(part => part.open = true);
      document.title = [page.documentElement.clientWidth, page.documentElement.scrollWidth]; })"""
    frame = f'<iframe srcdoc="{page}" style="width: {width}px; height: 800px; border: 0"></iframe>'
    text = shown(tmp_path, f"<!DOCTYPE html><title></title><script>{script}</script>{frame}")
    inner, content = map(int, re.search("<title>(.*?),(.*?)</title>", text).groups())
    assert width - 20 <= inner == content
