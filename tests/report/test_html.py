"""What the page's elements look like."""

import math

from clearance_mj.intervals import Interval
from clearance_mj.report import html
from clearance_mj.report.tables import Column, Table

TABLE = Table(
    "t",
    "a < b",
    (
        Column("Level", "m/s²", "g"),
        Column("Law & engine"),
        Column("f", "Hz", ".2f", "Mode 1"),
        Column("MAC", "", ".3f", "Mode 1"),
    ),
    ((0.5, "<i>", 9.25, math.nan), (0.5, "b", None, 1.0), (1.0, "c", 9.5, 0.5)),
)


def test_a_cell_is_a_number_a_dash_for_nan_and_empty_for_none():
    text = html.table(TABLE)
    assert (
        '<th scope="row" class="number">0.5</th><td>&lt;i&gt;</td><td class="number">9.25</td><td class="number">–</td>'
        in text
    )
    assert '<td class="number"></td><td class="number">1.000</td>' in text


def test_an_interval_stands_below_its_value_which_sorts_the_column():
    shown = Table("t", "c", (Column("Law"), Column("FRAC", "", ".2f")), (("a", Interval(0.5, 0.4, 0.75)),))
    assert '<td class="number" data-value="0.5">0.50<span class="interval">0.40–0.75</span></td>' in html.table(shown)
    doubtful = Table("t", "c", shown.columns, (("a", Interval(0.5, 0.4, 0.75, doubtful=True)),))
    assert "0.40–0.75*</span>" in html.table(doubtful)
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
    picture = html.Picture("p", 3, b"<svg/>", "image/svg+xml", "big & bold", 'a "b"')
    text = html.figure(picture)
    assert 'src="data:image/svg+xml;base64,PHN2Zy8+"' in text and 'id="figure-p"' in text
    assert "<b>Figure 3.</b> big &amp; bold" in text and 'alt="a &quot;b&quot;"' in text
