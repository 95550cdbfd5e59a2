"""Figures: drawn, labelled with units, inside their canvas, and the same bytes each time."""

import dataclasses
import io
import xml.etree.ElementTree

import matplotlib.image
import numpy as np
import pytest

from clearance_mj.report import figures, rattle_maps, responses, style
from clearance_mj.structure import Spring
from clearance_mj.structure.attached import FixtureMode, Housing, Oscillator, Planes

from ..conftest import TABLE1
from .conftest import assert_drawn_within, assert_units, changed

LEVEL = 4.0
DRAW = {
    "rig": lambda s: figures.rig_drawing(s.dataset.rig), "verdict": figures.agreement,
    "frf_bushings": lambda s: figures.frf_bushings(s, LEVEL), "frf_others": lambda s: figures.frf_others(s, LEVEL),
    "correlation": lambda s: figures.correlation(s, LEVEL), "csac_sensors": lambda s: figures.csac_sensors(s, LEVEL),
    "csf_sensors": lambda s: figures.csf_sensors(s, LEVEL), "contact": figures.contact, "modes": figures.modes,
    "response": lambda s: responses.draw(s.periodic.branches), "rattle_map": lambda s: rattle_maps.draw(s.periodic.map),
}  # fmt: skip


@pytest.fixture(scope="module")
def drawings(study):
    return {name: draw(study) for name, draw in DRAW.items()}


@pytest.mark.parametrize("name", DRAW)
def test_nothing_is_cut_off_at_the_edge_and_axes_have_units(drawings, name):
    assert_drawn_within(matplotlib.image.imread(io.BytesIO(drawings[name].png()))[..., :3])
    assert_units(drawings[name].figure, "1|%|°|Hz|N|m|dB re 1|m/s²|m/s² RMS")


@pytest.mark.parametrize("name", ["frf_bushings", "verdict"])
def test_svg_is_well_formed_and_the_same_each_time(study, name):
    first, second = (DRAW[name](study).svg() for _ in range(2))
    assert first == second and xml.etree.ElementTree.fromstring(first).tag.endswith("svg")


def test_curves_are_the_frfs_of_the_study(study, drawings):
    magnitude = drawings["frf_bushings"].figure.axes[0]
    curves = {(line.get_color(), line.get_linestyle()): line.get_ydata() for line in magnitude.lines}
    decibel = {name: 20 * np.log10(np.abs(frf.functions[1])) for name, frf in study.tests.items()}
    assert np.array_equal(curves[style.TEST, "-"], decibel["level_4_a"])
    assert np.array_equal(curves[style.REPEAT, "-"], decibel["level_4_b"])
    for law, colour in zip(("nominal", "constant"), style.COLOURS):
        expected = 20 * np.log10(np.abs(study.case(law, "links", LEVEL).frf.functions[1]))
        assert np.array_equal(curves[colour, "-"], expected)
    dashed = [colour for colour, style in curves if style == "--"]
    assert dashed == [style.COLOURS[1]], "the other engine is drawn for the best law only"


def test_sensors_are_split_between_the_two_overlays(drawings):
    axes = (drawings[name].figure.axes for name in ("frf_bushings", "frf_others"))
    titles = [[ax.get_title(loc="left") for ax in row if ax.get_title(loc="left")] for row in axes]
    assert titles == [["(a) sensor 2, bushing 1"], ["(a) sensor 1, 0.3 m", "(b) sensor 3, 1 m"]]


def test_what_a_rig_has_beside_its_shaft_is_drawn_or_said():
    housed = tuple(dataclasses.replace(b, housing=Housing(1e5, 0.1)) for b in TABLE1.bushings)
    rig = TABLE1.replace(
        springs=(Spring(0.3, 800.0),), oscillators=(Oscillator(0.7, 0.02, 120.0),), fixture=(FixtureMode(170.0),),
        planes=Planes(0.03, 0.5), bushings=housed,
    )  # fmt: skip
    drawing, plain = figures.rig_drawing(rig), figures.rig_drawing(TABLE1)
    assert "Not drawn: a mode of the fixture at 170 Hz, bushings on housings that give, two bending" in drawing.caption
    assert "Not drawn" not in plain.caption
    assert "on a spring, 120 Hz\n0.02 kg" in [text.get_text() for text in drawing.figure.axes[0].texts]
    lines, fewer = (len(d.figure.axes[0].lines) for d in (drawing, plain))
    assert lines > fewer + 1  # a mass alone is one


def test_a_zero_in_an_frf_does_not_break_the_overlay(study):
    test = study.tests["level_4_a"]
    value = test.value.copy()
    value[..., 5] = 0
    silent = changed(study, tests=study.tests | {"level_4_a": dataclasses.replace(test, value=value)})
    assert np.all(np.isfinite(figures.frf_bushings(silent, LEVEL).figure.axes[0].get_ylim()))


def test_captions_say_synthetic_where_the_test_is(drawings, build):
    shown = [name for name in DRAW if name not in ("rig", "contact", "response", "rattle_map")]
    assert all("synthetic" in drawings[name].caption.lower() for name in shown)
    measured = build(source="bench 3")
    assert not any("synthetic" in DRAW[name](measured).caption.lower() for name in DRAW)
