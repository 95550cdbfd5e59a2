"""The shape of a shaft in space out of forces at its bushings: beside what the engine itself found elsewhere."""

import dataclasses

import numpy as np
import pytest
from PIL import Image

import clearance_mj as cm
from clearance_mj.report.animation import write
from clearance_mj.report.clip import clip
from clearance_mj.report.deflection import deflection
from clearance_mj.report.figures import rig_drawing
from clearance_mj.report.scene import Scene
from clearance_mj.report.stage import AXONOMETRIC, Stage, seen
from clearance_mj.rig import Friction, Spin, Unbalance
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

FS = 4096.0
# A gap of 1 m: nothing but a place that is recorded.
WATCHED = cm.Bushing(0.35, 1.0, 0.0, cm.Grease(0.0), cm.Contact(1.0), shape="round")


def rotor(*bushings, spin=None):
    """A rotor whose disc whirls, and rubs in the bushings, while its weight bends it."""
    supports = Support(0.0, "pinned"), Support(1.0, "pinned")
    disc = Disc(0.35, 3.0, 0.01, polar_inertia=0.02)
    shaft = Shaft((Section(1.0, (0.02, 0.02)),), supports, (disc,), Material(2.1e11, 7800.0), (4.0, 1e-6))
    return cm.Rig(
        "rotor", None, bushings, (cm.Sensor(1, 0.35),), structure=shaft, gravity=(0.0, 0.0, -9.81),
        spin=spin or Spin(140.0, 40.0, 160.0), unbalances=(Unbalance(0.35, 3e-4, 0.7),),
    )  # fmt: skip


RUBBED = cm.Bushing(
    0.6, 2e-4, 0.02, cm.Grease(1e3, 5.0), cm.Contact(2e5, 50.0), offset=1e-4, friction=Friction(0.05), shape="round"
)


@pytest.fixture(scope="module")
def simulated():
    """A response of the rubbing rotor, and the disc's motion as the engine had it."""
    response = cm.simulate(rotor(RUBBED, WATCHED), cm.excitation.still(1.0, FS), engine="modal")
    parts = {name: getattr(response, name)[:2] for name in ("displacement", "contact_force", "grease_force")}
    seen = dataclasses.replace(response, **parts, contact_share=response.contact_share[:1])
    return rotor(RUBBED), seen, response.displacement[2:]


def test_the_shape_is_the_engines_own(simulated):
    """Within 1 % (RMS), as in the plane; the bushing's own place is exact."""
    rig, response, disc = simulated
    assert response.contact_share[0] > 0.1
    shape = deflection(rig, response, [0.35, 0.6])
    assert np.sqrt(np.mean((shape[:, :, 0].T - disc) ** 2)) < 0.01 * np.sqrt(np.mean(disc**2))
    np.testing.assert_allclose(shape[:, :, 1].T, response.displacement, atol=1e-12)


def test_it_begins_with_the_sag(simulated):
    """At rest the disc hangs by the static deflection under its weight, the grease's spring included."""
    rig, response, disc = simulated
    shape = deflection(rig, response, [0.35])
    np.testing.assert_allclose(shape[0, :, 0], disc[:, 0], atol=1e-7)
    assert shape[0, 1, 0] < -5e-5


def test_a_clip_is_cut_as_asked(simulated):
    rig, response, _ = simulated
    shown = clip(rig, response, start=0.5, seconds=0.1, slow=50.0, exaggeration=200.0)
    assert shown.time.size == 100 and shown.time[[0, -1]] == pytest.approx([0.5, 0.6], abs=1 / FS)
    assert (shown.lift.shape, shown.path.shape) == ((100, 2, shown.position.size), (len(shown.trace), 2))
    first = round(0.5 * FS)
    np.testing.assert_allclose(shown.path[0], response.displacement[:, first] + [0.0, 1e-4], atol=1e-12)
    np.testing.assert_allclose(shown.lift_at(0.6)[0], response.displacement[:, first], atol=2e-8)  # between points
    np.testing.assert_allclose(shown.trace[0, 0], np.hypot(*response.contact_force[:, first]))
    np.testing.assert_allclose(shown.angle, rig.spin.angle_at(shown.time), atol=1e-3)
    with pytest.raises(cm.ClearanceError, match="exaggeration 1e"):
        clip(rig, response, exaggeration=1e9)


def test_a_picture_shows_shaft_tube_and_trail_where_they_are(simulated):
    """In the view x goes right, y to the eye and z up; the shaft's axis lies where its exaggerated place is."""
    rig, response, _ = simulated
    shown = clip(rig, response, start=0.5, seconds=0.1, slow=5.0, exaggeration=200.0)
    stage = Stage(Scene(shown))
    picture = stage.picture(4)
    assert picture.shape[2] == 3 and np.ptp(picture) > 200
    place = seen(AXONOMETRIC, 0.6, *(200.0 * shown.lift_at(0.6)[4]))
    axis = [(xy[:, i] + xy[:, -1 - i]) / 2 for xy in _outlines(stage) for i in range(xy.shape[1] // 2)]
    assert np.min(np.hypot(*(np.array(axis).T - place[:, None]))) < 0.007  # half the distance of the line's points
    dot = stage.trails[0][1].get_data()
    moment = np.argmin(np.abs(shown.trace_time - shown.time[4]))
    np.testing.assert_allclose(np.ravel(dot), 1e6 * shown.path[moment], rtol=1e-9)
    rings = stage.tubes[0][0][1].get_data()  # of the half behind: bore of the gap and the shaft, about the middle
    middle = seen(AXONOMETRIC, 0.6, 0.0, -200.0 * 1e-4)
    height = np.nanmax(rings[1]) - middle[1]
    assert height == pytest.approx((200.0 * 2e-4 + 0.01) * np.cos(np.radians(14.0)), rel=0.2)
    assert "200 times larger" in stage.above.get_title("right")
    with pytest.raises(cm.ClearanceError, match="renderer mujoco draws planar rigs"):
        write(shown, "whirl.gif", "mujoco")


def _outlines(stage):
    return [body.get_xy()[:-1].T for _, body in stage.bodies]


def test_the_animation_of_the_command_line_is_a_picture_after_the_other(tmp_path, answer):
    rotor(RUBBED).save(tmp_path / "rotor.toml")
    given = ["--rms", 0, "--duration", 0.5, "--seconds", 0.05, "--slow", 10, "--out", tmp_path / "whirl.gif"]
    result = answer("animate", tmp_path / "rotor.toml", *given)
    assert (result["pictures"], result["renderer"]) == (10, "matplotlib")
    with Image.open(tmp_path / "whirl.gif") as image:
        assert (image.n_frames, image.size[0]) == (10, 720)
        first = np.array(image.convert("RGB"), dtype=float)
        image.seek(5)
        assert np.abs(np.array(image.convert("RGB"), dtype=float) - first).max() > 100  # it moves


def test_the_drawing_of_a_rig_in_space_has_weight_spin_and_unbalance():
    drawing = rig_drawing(rotor(RUBBED))
    (ax,) = drawing.figure.axes
    words = [text.get_text() for text in ax.texts]
    assert "g" in words and "1337 to 1528\nrev/min" in words  # 140 and 160 rad/s
    assert "unbalance" in words
    (place,) = [line.get_xdata()[0] for line in ax.get_lines() if line.get_color() == "#d55e00"]
    assert place == 0.35
    for said in ("gravity (0, 0, -9.81) m/s²", "1337 rev/min", "unbalance 300 g mm", "friction"):
        assert said in drawing.caption
    plane = rotor(RUBBED).replace(gravity=None, spin=None, unbalances=(), bushings=(WATCHED,)).with_shape(None)
    assert "rev/min" not in rig_drawing(plane).caption and "gravity" not in rig_drawing(plane).caption
