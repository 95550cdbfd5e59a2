"""Drawings and animations of rigs that are no uniform cantilevers, against the numbers of the rigs."""

import dataclasses

import numpy as np
import pytest
from matplotlib.patches import Polygon

from clearance_mj import ClearanceError, ConstantLaw, Grease, Shaker, simulate
from clearance_mj.report import animation
from clearance_mj.report.clip import clip
from clearance_mj.report.deflection import deflection
from clearance_mj.report.figures import rig_drawing
from clearance_mj.report.outline import outline
from clearance_mj.report.scene import Scene
from clearance_mj.rig import AppliedForce
from clearance_mj.signals.excitation import random
from clearance_mj.structure import Spring

from ..structures import chain, stepped, two_shafts

LAW = ConstantLaw(8e3, 5.0)
FS = 8192.0


def lines_of(axes):
    return [np.column_stack(line.get_data()) for line in axes.lines]


def ends_at(axes, x, low, high):
    """Whether a line ends at a position, between two heights."""
    return any(abs(end[0] - x) < 1e-9 and low <= end[1] <= high for line in lines_of(axes) for end in line[[0, -1]])


def test_outline_has_steps_tapers_and_bores():
    x, half, bore = outline(two_shafts().structure.parts[1])
    assert (x.tolist(), half.tolist(), bore.tolist()) == ([0.25, 0.95], [0.015] * 2, [0.012] * 2)
    x, half, _ = outline(stepped().structure)
    np.testing.assert_allclose(x, [0, 0.4, 0.4, 0.6, 0.6, 1.1])
    np.testing.assert_allclose(half, [0.005, 0.005, 0.005, 0.006, 0.006, 0.006])


def test_drawing_of_a_stepped_shaft():
    """Its outline is to scale, twice as its half heights; a triangle stands under each pin."""
    (axes,) = rig_drawing(stepped()).figure.axes
    corners = [patch.get_xy() for patch in axes.patches if isinstance(patch, Polygon)]
    (shaft,) = [xy for xy in corners if np.ptp(xy[:, 0]) > 1.0]
    thick = {x: np.ptp(shaft[np.abs(shaft[:, 0] - x) < 1e-9, 1]) for x in (0.0, 1.1)}
    assert thick[0.0] / thick[1.1] == pytest.approx(10 / 12)
    assert sorted(xy[0, 0] for xy in corners if len(xy) == 4) == [0.0, 1.1]
    words = [text.get_text() for text in axes.texts]
    assert "500 N/m\n2 N s/m" in words and "wheel\n0.3 kg" in words and "boss\n0.2 kg" in words


def test_drawing_of_two_shafts():
    """The bushing between them hangs on the lower shaft, the other one stands on the plate."""
    rig = two_shafts()
    springs = (*rig.structure.springs, Spring("outer@0.6", 1e3))
    rig = rig.replace(structure=dataclasses.replace(rig.structure, springs=springs))
    rig = rig.replace(shaker=Shaker("force", "inner@0.9", also=(AppliedForce("outer@0.5", -0.5),)))
    (axes,) = rig_drawing(rig).figure.axes
    assert ends_at(axes, 0.8, 0.1, 0.2) and not ends_at(axes, 0.8, -2.0, -1.0)
    assert ends_at(axes, 0.55, -1.2, -1.1)
    assert {"inner", "outer", "× -0.5", "shaker force"} <= set([text.get_text() for text in axes.texts])
    assert "inner diameter 24 mm" in rig_drawing(rig).caption


def test_scheme_of_a_structure_without_shafts():
    """The clearance between masses 2 and 1 ends at the place of mass 1, the other one on the plate."""
    drawing = rig_drawing(chain(shaker=Shaker("force", "1:+Z", also=(AppliedForce("3:+Z", 2.0),))))
    (axes,) = drawing.figure.axes
    at = {text.get_text(): text.get_position()[0] for text in axes.texts}
    assert {"1:Z", "2:Z", "3:Z", "shaker force × 2"} <= set(at)
    assert ends_at(axes, at["1:Z"], 0.0, 0.0) and ends_at(axes, at["3:Z"], -1.5, -1.3)
    assert "2 clearances, 3 sensors" in drawing.alt and drawing.png()[:4] == b"\x89PNG"


@pytest.mark.parametrize("make, point", [(stepped, 0.55), (stepped, 1.0), (two_shafts, "outer@0.5")])
def test_the_shape_is_the_engines_own(make, point):
    """A bushing that never touches records the displacement anywhere; dashpots couple the modes of both rigs."""
    rig = make()
    probe = dataclasses.replace(rig.bushings[0], position=point, to=None, gap=0.5, length=0.0, grease=Grease(0.0))
    probed = rig.replace(bushings=(*rig.bushings, probe))
    law = ConstantLaw([8e3, 8e3, 0.0], [5.0, 5.0, 0.0])
    response = simulate(probed, random(1.0, FS, rms=8.0, seed=3), law, "modal")
    fields = {name: getattr(response, name)[:2] for name in ("displacement", "contact_force", "grease_force")}
    shape = deflection(rig, dataclasses.replace(response, **fields), [point])[:, 0]
    assert np.abs(response.contact_force[:2]).max(axis=1).min() > 0.5
    assert (shape - response.displacement[2]).std() < 0.01 * response.displacement[:2].std()


def test_animation_of_two_shafts(tmp_path):
    """A bushing of the inner shaft moves with the outer one; shafts are as far apart as half the picture."""
    rig = two_shafts()
    shown = clip(rig, simulate(rig, random(1.0, FS, rms=8.0, seed=3), LAW, "modal"), seconds=0.02, slow=20.0)
    scene = Scene(shown)
    assert scene.level[0] - scene.level[1] == pytest.approx(scene.half_height)
    carried, gap = shown.lift_at("outer@0.8")[:, 1], rig.bushings[0].gap
    moved = shown.lift_at("inner@0.8")[:, 1] - carried
    upper = scene.level[0] + shown.exaggeration * (carried + np.maximum(moved, gap)) + 0.004
    np.testing.assert_allclose(scene.halves()[:, 0, 1], upper, atol=1e-12)
    assert animation.write(shown, tmp_path / "a.gif", "matplotlib", progress=False) == ""
    assert (tmp_path / "a.gif").read_bytes()[:6] == b"GIF89a"


def test_without_shafts_there_is_no_shape():
    rig = chain()
    response = simulate(rig, random(0.5, 2048.0, rms=3.0, seed=3), LAW, "modal")
    with pytest.raises(ClearanceError, match="'chain': its structure has no shaft whose shape could be shown"):
        clip(rig, response, seconds=0.02, slow=20.0)
