"""What notebooks show of rigs, laws, records and FRFs: words, figures, both on light and dark pages."""

import dataclasses
import io
import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.colors import ListedColormap
from PIL import Image

import clearance_mj as cm
from clearance_mj.clearance import HuntCrossley, MaxwellSlip
from clearance_mj.core.drawing import canvas, envelope
from clearance_mj.core.overview import Overview

from ..processes import run
from ..refusals import assert_refused

F = np.arange(5.0, 100.0)
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def frf(n=3, **fields):
    """Accelerances 1, 2, ... with one line of 40 at 20 Hz in the second."""
    value = np.repeat(np.arange(1.0, n + 1)[:, None], F.size, axis=1).astype(complex)
    value[1, F == 20] = 40j
    return cm.FRF(F, value, np.full(value.shape, 0.75), **fields)


def response(**fields):
    """Ten seconds at 1 kHz: base acceleration of 2 m/s² RMS, contact for a fifth of the time at the second bushing."""
    time = np.arange(10000) / 1000
    sine = np.sin(2 * np.pi * 10 * time)
    force = np.vstack((0 * time, np.where(time < 2, -30.0, 0.0)))
    given = {"displacement": 1e-3 * np.vstack((sine, 2 * sine)), "contact_force": force, "contact_share": [0.0, 0.2]}
    return cm.Response(1000.0, 8**0.5 * sine, np.vstack((sine, 7 * sine)), band=(5.0, 220.0), **given | fields)


class Cells(HTMLParser):
    """Tags that are open, which must close in order, and the texts of a page."""

    def __init__(self, markup):
        super().__init__()
        self.open, self.texts = [], []
        self.feed(markup)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        assert tag in ("div", "strong", "table", "tr", "th", "td")
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def test_a_rig_shows_its_frequencies_and_gaps(rig):
    first = rig.bushings[0]
    rig = rig.replace(name='a <b>rig</b> & "more"\x1b[31m', bushings=(dataclasses.replace(first, gap=2.5e-4),))
    lowest = [f"{hz:.4g}" for hz in cm.beam.natural_frequencies(rig, 4)]
    text = repr(rig)
    assert text.startswith('Rig “a <b>rig</b> & "more"\\x1b[31m”\n') and "\x1b" not in text  # a terminal obeys \x1b
    assert f"natural frequencies  {', '.join(lowest)} Hz in the gaps" in text
    shown = Cells(rig._repr_html_()).texts
    assert shown[0] == f"Rig “{rig.name}”"
    assert shown[shown.index("gap (mm)") + 3 :][:3] == [rig.probe_labels[0], first.where, "0.25"]


def test_a_rig_whose_frequencies_cannot_be_found_still_shows(rig):
    rig = rig.replace(beam=dataclasses.replace(rig.beam, young_modulus=1e-300))
    with pytest.raises(cm.RigError, match="too small"), np.errstate(all="ignore"):
        rig.reduction(20, grease=True)
    assert "natural frequencies" not in repr(rig) and "sensors    8" in repr(rig)


@pytest.mark.parametrize(("law", "parts"), [
    (cm.ConstantLaw([7e3, 8e3], 4.0), ["1        7000     4          the rig's", "2        8000"]),
    (cm.TimeLaw([0, 1.5], [1e3, 2e3], [3, 3]), ["over time  0 to 1.5 s, 2 rows", "each     1000 to 2000  3 "]),
    (cm.AmplitudeLaw([1e-4, 5e-4], [1, 2], [3, 4], grease=cm.Grease(4e3)), ["0.1 to 0.5 mm", "stiffness 4000"]),
    (cm.ConstantLaw(1.0, 2.0, MaxwellSlip((12.00686037476169, 2.0), (1 / 3, 1.0))),
     ["springs [12.01, 2], forces [0.3333, 1]"]),
    (cm.ContactLaw(HuntCrossley(1e6, 0.8)), ["hunt-crossley: stiffness 1e+06, restitution 0.8 "]),
])  # fmt: skip
def test_a_law_shows_its_numbers(law, parts):
    assert repr(law).startswith(f"Law, {law.kind}\n")
    assert all(part in repr(law) for part in parts), repr(law)
    assert len(Cells(law._repr_html_()).texts) > 6


def test_signals_show_sizes_units_and_peaks():
    text = repr(frf(responses=("3:+Z", "4:+Z", "9:-Y"), quantity="acceleration/force"))
    assert text.split("\n") == [
        "FRF of 3 responses to 100:+Z", "  quantity   acceleration/force, m/s²/N",
        "  lines      95: 5 to 99 Hz, 1 Hz apart", "  responses  3:+Z, 4:+Z, 9:-Y", "  largest    40 at 20 Hz, 4:+Z",
        "  coherence  median 0.750",
    ]  # fmt: skip
    text = repr(response(provenance={"rig": {"name": "mine"}, "engine": "modal"}))
    assert text.startswith("Response of 2 sensors, 10 s at 1000 Hz\n")
    assert "base acceleration at 100:+Z, 2 m/s² RMS, 5 to 220 Hz" in text
    assert "2 rows, up to 2 mm" in text and "up to 30 N" in text and "0 %, 20 % of the time" in text
    assert text.endswith("rig mine, engine modal")


def test_a_comparison_shows_its_means_and_modes():
    comparison = cm.compare(frf(), frf())
    assert "RMSE 0 dB, MRE 0, FRAC 1.000" in repr(comparison)
    modes = comparison.per_mode.reindex(range(2)).assign(mode=[1, 2], test_hz=[20.0, np.nan])
    rows = repr(dataclasses.replace(comparison, per_mode=modes)).split("\n")[-2:]  # the empty row is left out
    assert rows[0].split()[:3] == ["mode", "test", "(Hz)"] and rows[1].split() == ["1", "20.00", *"–––––"]


def test_a_dataset_shows_its_records(small_dataset):
    dataset = cm.Dataset.load(small_dataset)
    shown = repr(dataset).split("\n")
    assert shown[0] == f"Dataset of rig “{dataset.rig.name}”" and str(small_dataset)[:80] in shown[2]
    assert shown[-len(dataset.records)].split() == "ramp identify 6 m/s² 20 s 2048 Hz 5 to 220 Hz random".split()
    assert not any(record.opened for record in dataset.records)  # nothing is read to show it
    assert repr(dataset.records[0]).startswith(f"Record “ramp” of rig “{dataset.rig.name}”\n")


def test_many_rows_and_long_words_are_cut():
    shown = Overview("title", {"none": "", "long": "x" * 500}, [("a",), ("y" * 500,)])
    assert max(map(len, shown.text().split("\n"))) < 120 and "none" not in shown.html()
    assert max(map(len, Cells(shown.html()).texts)) <= 100


def test_an_frf_draws_what_it_holds():
    one, other = frf(), frf()
    figure = one.plot([1], model=other)
    (cell,) = figure.subfigs
    magnitude, angle, coherence = cell.axes
    for line in magnitude.lines:
        np.testing.assert_array_equal(line.get_xdata(), F)
        np.testing.assert_allclose(line.get_ydata(), 20 * np.log10(np.where(F == 20, 40, 2)))
    assert angle.lines[0].get_ydata()[np.flatnonzero(F == 20)[0]] == 90  # of 40j
    assert set(coherence.lines[0].get_ydata()) == {0.75}
    assert [text.get_text() for text in figure.legends[0].texts] == ["this FRF", "model"]
    assert magnitude.get_ylabel().endswith("(dB re 1)") and coherence.get_xlabel() == "Frequency (Hz)"
    assert len(one.plot().subfigs) == 4  # three functions in two lines of two
    assert_refused(cm.RecordError, r"rows must be between 0 and 2, got \[3\]", one.plot, [3])
    with pytest.raises(cm.RecordError, match=r"model is acceleration/force at 1:\+Z"):
        one.plot(model=frf(quantity="acceleration/force"))


def test_a_response_draws_every_history():
    shown = response()
    axes = shown.plot([1], (2.0, 2.5)).axes
    labels = ["Base acc. (m/s²)", "Acceleration (m/s²)", "Displacement (mm)", "Contact force (N)"]
    assert [ax.get_ylabel() for ax in axes] == labels and axes[-1].get_xlabel() == "Time (s)"
    (line,) = axes[1].lines
    np.testing.assert_array_equal(line.get_ydata(), shown.acceleration[1, 2000:2501])
    np.testing.assert_allclose(axes[2].lines[1].get_ydata(), 1e3 * shown.displacement[1, 2000:2501])
    assert axes[3].get_xlim() == (2.0, 2.5)
    assert len(response(displacement=None, contact_force=None, kind="force").plot().axes) == 2
    with pytest.raises(cm.RecordError, match=r"no sample from 20 to 30 s; the response ends at 9\.999 s"):
        shown.plot(time=(20, 30))


def test_a_long_history_keeps_its_peaks():
    time = np.arange(1_000_003) / 1000
    value = np.zeros(time.size)
    value[[7, 123_456, 1_000_002]] = 5.0, -3.0, 4.0
    at, shown = envelope(time, value)
    assert shown.size < 2100 and at.size == shown.size and np.all(np.diff(at) >= 0)
    assert sorted(shown[shown != 0]) == [-3.0, 4.0, 5.0]
    assert abs(at[np.argmin(shown)] - time[123_456]) < 1.001  # s, a stretch
    np.testing.assert_array_equal(envelope(time[:2000], value[:2000])[1], value[:2000])


def test_a_comparison_draws_its_measures():
    comparison = cm.compare(frf(), dataclasses.replace(frf(), value=2 * frf().value))
    upper, lower = comparison.plot().subfigs
    np.testing.assert_array_equal(upper.axes[0].lines[1].get_ydata(), comparison.csf)
    widths = [bar.get_width() for bar in lower.axes[0].patches]
    np.testing.assert_allclose(widths, 20 * np.log10(2))  # dB at every sensor: twice the test


def test_a_law_draws_its_cycles(rig):
    gap, law = rig.bushings[0].gap, cm.ConstantLaw(8e3, 0.0, grease=cm.Grease(stiffness=4e3))
    force, k, c = law.plot(rig).axes[:3]
    x, f = force.lines[0].get_data()  # the largest cycle comes first: 2.5 gaps; without damping two straight lines
    expected = 4e3 * 1e-3 * x + 8e3 * 1e-3 * np.sign(x) * np.maximum(abs(x) - 1e3 * gap, 0)
    np.testing.assert_allclose(f, expected, atol=1e-6)
    assert max(x) == pytest.approx(2.5e3 * gap) and set(k.lines[0].get_ydata()) == {8e3}
    assert [line.get_xdata()[0] for line in force.lines[3:]] == pytest.approx([-1e3 * gap, 1e3 * gap])
    assert c.get_xlabel() == "" and law.plot(rig, [2e-4], 50.0).axes[3].get_xlabel() == "Displacement (mm)"
    times = cm.TimeLaw([0, 1], [1e3, 2e3], [3, 4]).plot(rig).axes
    assert times[-1].get_xlabel() == "Time (s)" and list(times[1].lines[0].get_ydata()) == [3, 4]
    assert_refused(cm.LawError, "has no bushings", law.plot, rig.replace(bushings=()))
    assert_refused(cm.LawError, r"must be > 0, got \[-0.001\] m", law.plot, rig, [-1e-3])


def test_contact_models_draw_their_equivalents(rig):
    law = cm.ContactLaw(HuntCrossley(1e6, 0.8))
    _, k, c = law.plot(rig, frequency=20.0).axes[:3]
    x, omega = k.lines[0].get_xdata() / 1e3, np.full(len(rig.bushings), 2 * np.pi * 20)
    for ax, expected in zip((k, c), law.over_amplitude([b.gap for b in rig.bushings], x, omega)):
        np.testing.assert_allclose(ax.lines[0].get_ydata(), expected[:, 0], rtol=1e-12)


def page_figure():
    figure = canvas(1.5, 3)
    ax = figure.subplots()
    ax.plot([0, 1], color="#000000")
    ax.plot([1, 0], color="#882255")
    ax.bar([0.5], [0.5], color="none", edgecolor="#000000", hatch="//")
    ax.pcolormesh([0, 0.1], [0, 0.1], [[1.0]], cmap=ListedColormap(["#123456"]))
    return figure


def test_a_figure_takes_colours_and_background_of_the_page():
    markup = page_figure()._repr_html_()
    hatches = re.findall(r"<pattern.*?</pattern>", markup, re.DOTALL)
    outside = re.sub(r"<pattern.*?</pattern>", "", markup, flags=re.DOTALL)
    assert hatches and "<style" not in markup and "http" not in re.sub(r'xmlns\S*="[^"]*"', "", markup)
    assert "#000000" not in outside and "#ffffff" not in outside
    assert re.search(r'fill: #123456"', outside)  # of a scale: as it is
    assert "stroke: #882255; stroke: color-mix(in srgb, #882255 70%, currentColor)" in outside
    assert Image.open(io.BytesIO(page_figure()._repr_png_())).convert("RGB").getpixel((0, 0)) == (255, 255, 255)


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
@pytest.mark.parametrize(("background", "text"), [((255, 255, 255), (0, 0, 0)), ((17, 17, 17), (255, 255, 255))])
def test_figures_are_readable_on_light_and_dark_pages(rig, tmp_path, background, text):
    look = f"margin:0;background:rgb{background};color:rgb{text}"
    body = rig._repr_html_() + page_figure()._repr_html_()
    (tmp_path / "page.html").write_text(f'<!doctype html><meta charset="utf-8"><body style="{look}">{body}', "utf-8")
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--window-size=800,600", f"--user-data-dir={tmp_path}")
    done = run(BROWSER, *options, f"--screenshot={tmp_path / 'page.png'}", (tmp_path / "page.html").as_uri())
    assert done.returncode == 0, done.stderr
    pixels = np.asarray(Image.open(tmp_path / "page.png").convert("RGB")).reshape(-1, 3)
    colours, counts = np.unique(pixels, axis=0, return_counts=True)
    assert tuple(colours[counts.argmax()]) == background and counts.max() > 0.8 * counts.sum()
    shares = {tuple(colour): count / counts.sum() for colour, count in zip(colours.tolist(), counts)}
    assert shares.get(text, 0) > 0.002  # words, axes and the black line
    mixed = 0.7 * np.array([0x88, 0x22, 0x55]) + 0.3 * np.array(text)
    assert (np.abs(pixels - mixed).max(axis=1) < 3).sum() > 20  # wine red, lighter on the dark page
