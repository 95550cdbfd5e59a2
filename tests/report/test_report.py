"""The report as a whole: files, and a page that stands alone."""

import csv
import re
from html.parser import HTMLParser

import matplotlib.image
import pandas as pd
import pytest
from matplotlib.figure import Figure

from clearance_mj.report import ReportWriter, html, registered_sections, section, write_report, writer
from clearance_mj.report.sections import SECTIONS
from clearance_mj.report.style import Drawing

from .conftest import changed

VOID = {"img", "meta", "br", "hr", "link"}


class Page(HTMLParser):
    """Reads a page, refusing tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.text = [], [], []
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, f"</{tag}> in the wrong place, line {self.getpos()[0]}"

    def handle_data(self, data):
        self.text.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def page(folder):
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_every_figure_is_there_and_not_blank(folder):
    names = {path.stem for path in (folder / "figures").glob("*.png")}
    kinds = ("frf_bushings", "frf_others", "correlation", "csac_sensors", "csf_sensors")
    singles = "rig verdict waterfall contact modes response rattle_map".split()
    assert names == {*singles, *(f"{k}_level_{v}" for k in kinds for v in (1, 4))}
    for path in (folder / "figures").glob("*.png"):
        image = matplotlib.image.imread(path)
        assert image.shape[1] == 1125 and image[..., :3].std() > 0.02


def test_every_table_is_there(folder, study):
    names = {path.stem for path in (folder / "tables").glob("*.csv")}
    known = {"verdict", "natural_frequencies", "sensors", "contact", "parameters", "engines", "laws", "records"}
    assert names == known | {"sensor_means", "seeds", "seed_scatter", "improvements", "response", "rattle_map"}
    with (folder / "tables" / "verdict.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["rmse_db"]) for row in rows] == [row["rmse_db"] for row in study.rows()]


def test_every_image_is_inside_the_page_and_has_words(page):
    images = page.all("img")
    assert len(images) == 17
    assert all(image["src"].startswith("data:image/") and len(image["alt"]) > 20 for image in images)
    assert {i["src"][:18] for i in images} == {"data:image/svg+xml", "data:image/png;bas"}


def test_nothing_comes_from_outside(folder, page):
    text = re.sub(r"base64,[A-Za-z0-9+/=]+", "", (folder / "report.html").read_text(encoding="utf-8"))
    text = text.replace("/*! https://github.com/leeoniya/uPlot (v1.6.32) */", "")
    assert not re.search(r"https?://|@import|url\(|\bfetch\(|\bimport\(|XMLHttpRequest|WebSocket", text)
    assert not page.all("link") and not page.all("iframe")
    assert not any("src" in script for script in page.all("script"))


def test_every_anchor_leads_somewhere(page):
    targets = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    links = [a["href"] for a in page.all("a")]
    assert len(targets) == len(set(targets))
    assert len(links) > 8 and all(link[0] == "#" and link[1:] in targets for link in links)


def test_the_main_level_is_open_and_the_others_are_folded(page, study):
    folded = [a["id"] for a in page.all("details") if "level" in a["id"]]
    assert study.main_level == 4 and folded == ["frf-level-1", "correlation-level-1"]
    assert "summary-modal" in [a["id"] for a in page.all("details")]


def test_figures_are_numbered_in_the_order_of_the_page(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert [int(n) for n in re.findall(r"<b>Figure (\d+)\.</b>", text)] == list(range(1, 18))


def test_the_page_says_what_it_is(page):
    text = " ".join(page.text)
    assert "SYNTHETIC." in text and "virtual test rig, not measured" in text
    assert "“small <rig>”" in text and "random & loud" in text
    assert "Used to identify: ramp. Kept back to validate: level_1_a, level_1_b, level_4_a, level_4_b." in text
    assert "clearance-mj study DATASET --engines links,modal" in text and "python -m experiments.testrig" in text


@pytest.mark.slow
def test_measured_records_are_not_called_synthetic(build, tmp_path):
    write_report(build(floors=(), source="bench 3"), tmp_path, progress=False)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "synthetic" not in text.lower() and "Source of the records: bench 3." in text
    assert '<td class="number">–</td>' in text, "no repeatability, so RMSE over it has no value"
    assert "there are no intervals" in text and '<span class="interval">' not in text


def test_a_study_that_ends_with_its_base_law_shows_no_improvements(study, tmp_path):
    """Law "constant" is the base; here it is the last."""
    turned = changed(study, laws=study.laws[::-1])
    shown = [SECTIONS["tables"].write(of, ReportWriter(tmp_path)) for of in (study, turned)]
    assert ["What the better laws gain" in text for text in shown] == [False, True]


def test_a_section_is_one_function_and_one_registration(study, tmp_path, monkeypatch):
    """It stands where it says, with its figure numbered, its CSV file and its words."""
    for name in dict(registered_sections()).keys() - {"about", "tables", "definitions"}:
        monkeypatch.delitem(SECTIONS, name)

    @section("energy", "Energy <balance>", place=15)
    def energy(study, writer):
        figure = Figure()
        figure.subplots().plot([0, 1])
        writer.csv("energy", pd.DataFrame({"level": study.levels}))
        return writer.figure(Drawing("energy", figure, "Work & loss.", "A line.")) + html.heading("loss", "Loss")

    try:
        write_report(study, tmp_path, progress=False)
    finally:
        del SECTIONS["energy"]
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '<a href="#energy">2. Energy &lt;balance&gt;</a>' in text and '<li><a href="#loss">Loss</a></li>' in text
    assert "<b>Figure 2.</b> Work &amp; loss." in text
    assert (tmp_path / "tables" / "energy.csv").read_text() == "level\n1.0\n4.0\n"


def test_a_large_svg_gives_way_to_the_png(tmp_path, monkeypatch):
    figure = Figure()
    figure.subplots()
    drawing = Drawing("large", figure, "", "")
    assert "data:image/svg+xml;" in ReportWriter(tmp_path).figure(drawing)
    monkeypatch.setattr(writer, "SVG_LIMIT", 10)
    assert "data:image/png;" in ReportWriter(tmp_path).figure(drawing)
