"""Animations: the shaft's shape against the engine's own records, the pictures against what they show."""

import dataclasses
import shutil
import stat

import numpy as np
import pytest
from PIL import Image

import clearance_mj as cm
from clearance_mj.report import animation
from clearance_mj.report.clip import clip as cut
from clearance_mj.report.deflection import deflection
from clearance_mj.report.rendering import Stroke, View, render
from clearance_mj.report.scene import Scene
from clearance_mj.report.stage import ACROSS, DPI, STEEL, Stage

from ..conftest import ROOT

RIG = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
LAW = cm.ConstantLaw(2e4, 5.0)
FS = 8192.0


def noise():
    return cm.excitation.random(1.0, FS, rms=8.0, seed=3)


@pytest.fixture(scope="module")
def response():
    return cm.simulate(RIG, noise(), LAW, "modal")


@pytest.fixture(scope="module")
def shown(response):
    return cut(RIG, response, seconds=0.02, slow=20.0)


@pytest.mark.parametrize("engine", ["modal", "links"])
@pytest.mark.parametrize("k, c, grease", [(2e4, 5.0, RIG.bushings[0].grease), (2e5, 2.0, cm.Grease(200.0, 0.2))])
@pytest.mark.parametrize("position", [0.3, 0.67, 0.95])
def test_the_shape_is_the_engines_own(engine, k, c, grease, position):
    """A bushing that never touches records the displacement anywhere; the shape is told without it."""
    probe = dataclasses.replace(RIG.bushings[0], position=position, gap=0.5, grease=cm.Grease(0.0))
    rig = dataclasses.replace(RIG, bushings=(*RIG.bushings, probe))
    law = cm.ConstantLaw([k, k, 0.0], [c, c, 0.0], grease=(grease, grease, cm.Grease(0.0)))
    probed = cm.simulate(rig, noise(), law, engine)
    fields = {name: getattr(probed, name)[:2] for name in ("displacement", "contact_force", "grease_force")}
    shape, tip = deflection(RIG, dataclasses.replace(probed, **fields), [position, RIG.beam.length]).T
    touches = np.abs(probed.contact_force).max(axis=1)
    assert touches[:2].min() > 5 and touches[2] < 1e-3 * touches.max()  # links infers them from joint forces
    assert (shape - probed.displacement[2]).std() < 0.01 * tip.std()


def test_the_shape_passes_through_the_recorded_displacements(response):
    shape = deflection(RIG, response, [b.position for b in RIG.bushings])
    np.testing.assert_allclose(shape, response.displacement.T, atol=1e-7)


def test_the_shape_moves_as_the_accelerometers_say(response):
    """Below 220 Hz, where what the anti-alias filter took from the contact forces does not matter."""
    shape = deflection(RIG, response, [s.position for s in RIG.sensors])
    accelerations = np.gradient(np.gradient(shape, 1 / FS, axis=0), 1 / FS, axis=0) + response.excitation[:, None]
    frequency = np.fft.rfftfreq(len(shape), 1 / FS)
    spectrum_, recorded = (np.fft.rfft(a, axis=0)[frequency < 220] for a in (accelerations, response.acceleration.T))
    assert np.linalg.norm(spectrum_ - recorded) < 0.03 * np.linalg.norm(recorded)


def test_a_shaft_without_clearance_forces_hangs_as_a_cantilever_in_steady_acceleration():
    """Statics of a uniform load and a load at the tip (Roark, table 8.1), downwards, reached after a slow start."""
    time = np.arange(round(30 * 512.0)) / 512.0
    base, zero = np.minimum(time / 20, 1.0), np.zeros((2, time.size))
    length, stiffness = RIG.beam.length, RIG.beam.bending_stiffness
    uniform, mass = RIG.beam.mass_per_length, RIG.point_masses[0].mass

    def hangs(x):
        tip = mass * x**2 * (3 * length - x) / 6
        return -(uniform * x**2 * (6 * length**2 - 4 * length * x + x**2) / 24 + tip) / stiffness

    recorded = np.outer([hangs(b.position) for b in RIG.bushings], base)
    response = cm.Response(512.0, base, np.zeros((8, time.size)), recorded, zero, zero)
    x = np.array([0.3, 0.95, 1.0])
    np.testing.assert_allclose(deflection(RIG, response, x)[-1], hangs(x), rtol=2e-3)


def test_a_test_record_is_refused():
    record = cm.Response(FS, np.zeros(8), np.zeros((8, 8)), np.zeros((2, 8)))
    with pytest.raises(cm.RecordError, match="which only simulated"):
        deflection(RIG, record, [0.5])


def test_the_strongest_contact_is_in_the_middle(response):
    peak = np.unravel_index(np.argmax(np.abs(response.contact_force)), response.contact_force.shape)[1] / FS
    clip = cut(RIG, response, seconds=0.02, slow=20.0)
    assert clip.time[[0, -1]].mean() == pytest.approx(peak, abs=2 / FS)
    assert np.abs(clip.trace).max() == np.abs(response.contact_force).max()
    assert clip.time.size == 8 and clip.time[-1] - clip.time[0] == pytest.approx(0.02, abs=1 / FS)


@pytest.mark.parametrize("change, words", [
    ({"seconds": 1.2}, "cannot be shown of a response of 1 s"), ({"start": 0.99}, "it must be in 0 to 0.98 s"),
    ({"slow": 1e4}, "4000 pictures"), ({"seconds": 1e308}, "inf pictures"), ({"slow": 0.0}, "slow 0: must be above 0"),
    ({"exaggeration": 1e5}, r"exaggeration 100000: must be [\d.]+ to \d+"),
    ({"exaggeration": -1.0}, r"exaggeration -1: must be [\d.]+ to \d+"),
    ({"exaggeration": 1e-308}, r"exaggeration 1e-308: must be [\d.]+ to \d+"),
])  # fmt: skip
def test_what_cannot_be_shown_is_refused(response, change, words):
    with pytest.raises(cm.ClearanceError, match=words):
        cut(RIG, response, **{"seconds": 0.02, "slow": 20.0} | change)


def test_a_gif_holds_every_picture_and_says_its_time(shown, tmp_path):
    assert animation.write(shown, tmp_path / "a.gif", "matplotlib", progress=False) == ""
    with Image.open(tmp_path / "a.gif") as gif:
        assert gif.n_frames == 8 and gif.info["duration"] == 50 and gif.info["loop"] == 0
        pictures = [np.asarray(gif.convert("RGB")) for i in range(8) if gif.seek(i) is None]
    changes = [np.any(a != b, axis=2).mean() for a, b in zip(pictures, pictures[1:])]
    assert all(0.001 < change < 0.2 for change in changes), "some of each picture moves, most stands still"
    border = np.concatenate([pictures[0][[0, -1]].reshape(-1, 3), pictures[0][:, [0, -1]].reshape(-1, 3)])
    assert border.min() > 245, "something reaches the edge"


def test_the_drawn_shaft_lies_where_it_is(shown):
    scene = Scene(shown)
    stage = Stage(scene)
    steel = np.array([int(STEEL[i : i + 2], 16) for i in (1, 3, 5)])
    for i in (0, 4):
        rows, columns = np.nonzero(np.abs(stage.picture(i).astype(int) - steel).max(axis=2) < 3)
        pixels = np.column_stack((columns, stage.picture(i).shape[0] - 1 - rows))
        x, millimetres = stage.above.transData.inverted().transform(pixels).T
        inside = (x > 0.05) & (x < 0.45)
        expected = 1e3 * np.interp(x[inside], shown.position, shown.lift[i, 1])
        one_pixel = stage.millimetres((scene.right - scene.left) / (ACROSS * DPI))
        thickness = stage.millimetres(scene.radius)
        assert inside.sum() > 200
        assert np.abs(millimetres[inside] - expected).max() < thickness + 1.5 * one_pixel


def test_arrows_are_as_long_as_the_force_and_point_at_the_shaft(shown):
    scene = Scene(shown)
    tail, tip = np.moveaxis(scene.arrows()[..., 1], -1, 0)
    np.testing.assert_allclose(tail - tip, scene.per_newton * shown.force, atol=1e-15)
    strongest = np.unravel_index(np.argmax(np.abs(shown.force)), shown.force.shape)
    at = RIG.bushings[strongest[1]].position
    drawn = shown.exaggeration * np.interp(at, shown.position, shown.lift[strongest[0], 1])
    assert abs(tail[strongest]) > abs(tip[strongest]) > abs(drawn)


RENDERS = not render("<mujoco/>", [View((0, 0, 0), 1.0, 90.0, 0.0, 45.0, 0.01, (32, 32))])[1]
gl = pytest.mark.skipif(not RENDERS, reason="MuJoCo has no GL library here")


@gl
def test_strokes_are_drawn_to_scale():
    """Ends of a vertical arrow, capsule and box, seen from far away: 100 pixels are 1 m."""
    view = View((0.0, 0.0, 0.0), 1000.0, 90.0, 0.0, np.degrees(2 * np.arctan(0.5e-3)), 0.0, (300, 100))
    red = (1.0, 0.0, 0.0)
    ends = np.zeros((3, 1, 1, 2, 3))
    ends[..., 0, 2], ends[..., 1, 2], ends[..., 0] = -0.3, 0.4, np.array([-1.0, 0.0, 1.0])[:, None, None, None]
    ends[2, ..., 0, 0], ends[2, ..., 1, 0] = 0.9, 1.1
    strokes = [Stroke(shape, 0.02, red, at) for shape, at in zip(("arrow", "capsule", "box"), ends)]
    (image,), reason = render('<mujoco><statistic extent="1000"/></mujoco>', [view], strokes)
    assert reason == ""
    for column, slack in ((50, 2), (150, 4), (250, 2)):
        patch = image[:, column - 5 : column + 5].astype(int)
        rows = np.nonzero((patch[..., 0] > patch[..., 1] + 40).any(axis=1))[0]
        assert rows[0] == pytest.approx(10, abs=slack) and rows[-1] == pytest.approx(80, abs=slack)


@gl
def test_mujoco_draws_the_shaft_where_matplotlib_does(shown):
    """Both to one scale: dark steel along the shaft's line, in the same pixels of the panel."""
    scene = Scene(shown)
    images, reason = animation._rendered(scene, progress=False)
    assert reason == "" and len(images) == 8
    height, width, _ = images[4].shape
    x = np.linspace(0.1, 0.45, 30)
    lift = shown.exaggeration * np.interp(x, shown.position, shown.lift[4, 1])
    columns = ((x - scene.left) / (scene.right - scene.left) * width).astype(int)
    for row, column in zip(((1 - lift / scene.half_height) / 2 * height).astype(int), columns):
        assert np.any(images[4][row - 2 : row + 3, column] < 200)
        assert np.all(images[4][[row - 15, row + 15], column] > 230)


def test_without_gl_matplotlib_draws_and_says_so(shown, tmp_path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    assert "nonsense" in animation.write(shown, tmp_path / "a.gif", "auto", progress=False)
    assert (tmp_path / "a.gif").read_bytes()[:6] == b"GIF89a"
    with pytest.raises(cm.ClearanceError, match=r"nonsense.*renderer matplotlib needs none"):
        animation.write(shown, tmp_path / "b.gif", "mujoco", progress=False)
    assert not (tmp_path / "b.gif").exists()


@pytest.mark.parametrize("name, renderer, words", [
    ("a.mp4", "matplotlib", "needs the program ffmpeg"), ("a.avi", "matplotlib", r"\.gif or \.mp4"),
    ("a.gif", "crayon", "renderer"),
])  # fmt: skip
def test_mp4_needs_ffmpeg_and_other_files_are_refused(shown, tmp_path, monkeypatch, name, renderer, words):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(cm.ClearanceError, match=words):
        animation.write(shown, tmp_path / name, renderer, progress=False)


def test_ffmpeg_that_fails_leaves_the_old_file_and_its_complaint(shown, tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho no codec >&2\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IEXEC)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    (tmp_path / "a.mp4").write_bytes(b"old")
    with pytest.raises(cm.ClearanceError, match="no codec"):
        animation.write(shown, tmp_path / "a.mp4", "matplotlib", progress=False)
    assert (tmp_path / "a.mp4").read_bytes() == b"old"


@pytest.mark.skipif(not shutil.which("ffmpeg"), reason="ffmpeg is not installed")
def test_an_mp4_is_written(shown, tmp_path):
    animation.write(shown, tmp_path / "a.mp4", "matplotlib", progress=False)
    assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"
