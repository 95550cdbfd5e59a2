"""Phase portraits, sections and waterfalls: of motions whose states are known, and of the command that draws them."""

import io

import matplotlib.image
import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.core.output_folder import WORK
from clearance_mj.report import figures, motion, style, waterfall

from ..conftest import ROOT
from .conftest import assert_drawn_within, assert_units

FILE = ROOT / "models" / "table1_rig.toml"
RIG = cm.Rig.load(FILE)
FS, HZ = 1024.0, 7.3
TIME = np.arange(4096) / FS


def response(displacement, acceleration=None) -> cm.Response:
    """A response of the shipped rig, with two bushings and eight sensors."""
    acceleration = np.zeros((8, TIME.size)) if acceleration is None else acceleration
    return cm.Response(FS, np.zeros(TIME.size), acceleration, displacement)


def swinging(order) -> cm.Response:
    """Both bushings swing with a subharmonic: a sin(ωt/order) + b cos(ωt), b = 1 and 2 tenths of a mm."""
    turn = 2 * np.pi * HZ * TIME
    return response(3e-4 * np.sin(turn / order) + np.array([[1e-4], [2e-4]]) * np.cos(turn))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_subharmonic_motion_has_as_many_states_as_its_order(order):
    """At t = k/f: x = a sin(2πk/order) + b and v = a ω/order cos(2πk/order)."""
    section = motion.stroboscopic(swinging(order), HZ, drop=1.0)
    assert section.shape == (2, 22, 2)  # periods 8 to 29 end within 1 to 4 s less a sample
    phase = 2 * np.pi * np.arange(8, 30)[:, None] / order
    np.testing.assert_allclose(section[0], 3e-4 * np.sin(phase) + [1e-4, 2e-4], atol=1e-9)
    velocity = 3e-4 * 2 * np.pi * HZ / order * np.cos(phase)
    np.testing.assert_allclose(section[1], np.broadcast_to(velocity, (22, 2)), atol=2e-6)
    assert len(np.unique((section[..., 0] / [[3e-4], [3e-4 * 2 * np.pi * HZ]]).round(3), axis=1).T) == order


def test_turning_points_are_where_the_velocity_is_zero():
    """x = a cos(ωt + 0.3) turns at ±a, by turns; two turns a period."""
    turning = motion.turning_points(response(2e-4 * np.cos(2 * np.pi * HZ * TIME + 0.3) * [[1], [1]]), 0, drop=0.5)
    assert len(turning) == pytest.approx(2 * HZ * (TIME[-1] - 0.5), abs=1)
    np.testing.assert_allclose(np.abs(turning), 2e-4, rtol=1e-5)
    assert np.all(turning[1:] * turning[:-1] < 0)


def test_what_has_no_displacements_or_no_period_is_refused():
    with pytest.raises(cm.RecordError, match="no displacements"):
        motion.turning_points(cm.Response(FS, TIME, np.zeros((8, TIME.size))), 0)
    with pytest.raises(cm.RecordError, match=r"no period of 0\.1 Hz"):
        motion.stroboscopic(swinging(1), 0.1)


@pytest.fixture(scope="module")
def drawings():
    noise = np.random.default_rng(0).standard_normal
    random = {level: response(1e-4 * level * noise((2, TIME.size)), noise((8, TIME.size))) for level in (1.0, 2.0, 4.0)}
    sines = {level: swinging(order) for order, level in enumerate((1.0, 2.0, 4.0), 1)}
    frequency = np.linspace(5, 220, 200)
    frfs = {level: cm.FRF(frequency, np.full((8, 200), 1 / level + 0j)) for level in random}
    return {"phase, random": motion.phase_portraits(RIG, random), "phase, sine": motion.phase_portraits(RIG, sines, HZ),
            "section, random": motion.poincare_sections(RIG, random),
            "section, sine": motion.poincare_sections(RIG, sines, HZ),
            "waterfall, FRFs": waterfall.frf_waterfall(RIG, frfs),
            "waterfall, spectra": waterfall.spectrum_waterfall(RIG, random)}  # fmt: skip


@pytest.mark.parametrize("name", ["phase, random", "phase, sine", "section, random", "section, sine", "waterfall, FRFs",
                                  "waterfall, spectra"])  # fmt: skip
def test_nothing_is_cut_off_and_axes_have_units(drawings, name):
    assert_drawn_within(matplotlib.image.imread(io.BytesIO(drawings[name].png()))[..., :3])
    assert_units(drawings[name].figure, "mm|mm/s|Hz|dB re 1")


def test_there_is_a_panel_for_each_bushing_and_level_with_its_gap(drawings):
    panels = drawings["phase, sine"].figure.axes
    assert len(panels) == 6
    for ax in panels:
        gaps = [line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == "--"]
        assert gaps == pytest.approx([-0.3, 0.3])


def heights(line) -> np.ndarray:
    """Where a line stands on its axes: its transform shifts it."""
    return (line.get_transform() - line.axes.transData).transform(line.get_xydata())[:, 1]


def test_each_level_of_a_waterfall_stands_a_step_above_the_one_before(drawings):
    """1/level: 0, -6.02 and -12.04 dB; 20 dB more at each."""
    first = drawings["waterfall, FRFs"].figure.axes[0]
    assert first.get_title(loc="left") == "sensor 6, bushing 1"
    assert [heights(line)[0] for line in first.lines] == pytest.approx([0.0, 20 - 6.0206, 40 - 12.0412], abs=1e-4)


def test_a_spectrum_shows_the_sines_rms_over_the_excitations():
    """A sine of 3 m/s² amplitude on a line, at level 2: 20 log10(3/√2/2) = 0.51 dB."""
    acceleration = 3 * np.sin(2 * np.pi * 32.0 * TIME) * np.ones((8, 1))
    drawing = waterfall.spectrum_waterfall(RIG, {2.0: response(np.zeros((2, TIME.size)), acceleration)})
    line = drawing.figure.axes[0].lines[0]
    assert line.get_ydata().max() == pytest.approx(20 * np.log10(3 / np.sqrt(2) / 2), abs=0.01)
    assert line.get_xdata()[np.argmax(line.get_ydata())] == 32.0


def test_the_studys_waterfall_shows_test_and_best_law_at_every_level(study):
    drawing = figures.study_waterfall(study)
    lines = drawing.figure.axes[0].lines
    assert [line.get_color() for line in lines] == [style.TEST, style.COLOURS[1]] * 2
    for i, level in enumerate((1.0, 4.0)):
        test = 20 * np.log10(np.abs(study.tests[f"level_{level:g}_a"].functions[1]))
        np.testing.assert_allclose(heights(lines[2 * i]), test + 20 * i)
        np.testing.assert_allclose(lines[2 * i].get_ydata(), test)
    assert "synthetic" in drawing.caption and "constant" in drawing.figure.legends[0].get_texts()[1].get_text()


def test_the_command_draws_three_figures_and_refuses_what_it_cannot_draw(tmp_path, answer, refused):
    short = ["motion", FILE, "--engine", "modal", "--quiet", "--levels", "1,5", "--fs", "2048", "--out", tmp_path]
    for more in (["--duration", "4"], ["--duration", "2", "--sine", "12"]):
        result = answer(*short, *more)
        names = ["motion.json", "phase_portraits.png", "poincare_sections.png", "waterfall.png"]
        assert sorted(p.name for p in tmp_path.iterdir() if p.name != WORK) == names
        assert result["peak_displacement"]["5"][1] > 3e-4 > result["peak_displacement"]["1"][0]
    assert refused(*short, "--drop", "99") and refused(*short, "--sine", "5000")
    with pytest.raises(SystemExit, match="2"):
        main([*map(str, short), "--levels", "1,-2"])


def test_the_animation_command_writes_a_gif_and_says_what_it_shows(tmp_path, answer, refused):
    short = ["animate", FILE, "--engine", "modal", "--renderer", "matplotlib", "--quiet", "--duration", "1"]
    short += ["--seconds", "0.01", "--slow", "20", "--out", tmp_path / "a.gif"]
    result = answer(*short)
    assert (tmp_path / "a.gif").read_bytes()[:6] == b"GIF89a"
    assert result["pictures"] == 4 and result["renderer"] == "matplotlib" and max(result["peak_contact_force"]) > 0
    assert result["end"] - result["start"] == pytest.approx(0.01, abs=1e-3)
    assert refused(*short, "--start", "3")
