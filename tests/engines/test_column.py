"""The steering column of models/column.toml: round bushings, teeth under a torque and a stop in one rig, end to end."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.engines import simulate_together, static_equilibrium
from clearance_mj.live import Session
from clearance_mj.live.export import exported
from clearance_mj.live.hear import heard
from clearance_mj.report.animation import write
from clearance_mj.report.clip import clip
from clearance_mj.report.deflection import deflection
from clearance_mj.report.figures import rig_drawing
from clearance_mj.report.scene import Scene
from clearance_mj.report.stage import AXONOMETRIC, DRAWN_TWIST, FLANK, Stage, seen
from clearance_mj.rotors import whirl
from clearance_mj.sound import radiate

from ..conftest import ROOT
from .alike import HISTORIES, assert_alike

COLUMN = cm.Rig.load(ROOT / "models" / "column.toml")
FS, TEETH, STOP = 2048.0, 4, 5  # rows


def shaken(seconds=0.5):
    """The motor's worm and the road at once."""
    worm = cm.excitation.random(seconds, FS, band=(5, 200), rms=40.0, seed=0, kind="force")
    return cm.excitation.together(worm, cm.excitation.random(seconds, FS, band=(5, 200), rms=3.0, seed=1))


@pytest.fixture(scope="module")
def modal():
    return cm.simulate(COLUMN, shaken(), engine="modal")


def test_it_rests_in_its_teeth_under_the_torque():
    """Hands of k_h and teeth of k_t beyond the gap g carry T, the shaft between them twists by T_t/k_s.

    T = k_h θ + T_t, θ = g + T_t/k_t + T_t/k_s, with 1/k_s = Σ L/(G J) of both sections: from the hands to the teeth.
    """
    torque, hands, teeth = COLUMN.loads[0].torque, COLUMN.structure.supports[2].twist, COLUMN.bushings[2]
    shear = 2.1e11 / 2.6
    polar = np.pi / 32 * np.array([0.024**4 - 0.018**4, 0.018**4])
    soft = 1 / teeth.contact.stiffness + np.sum(np.array([0.42, 0.38]) / (shear * polar))
    pressed = (torque - hands * teeth.gap) / (1 + hands * soft)
    rest = static_equilibrium(COLUMN)
    assert rest.contact_force[TEETH] == pytest.approx(pressed, rel=1e-6)
    assert rest.displacement[TEETH] == pytest.approx(teeth.gap + pressed / teeth.contact.stiffness, rel=1e-6)
    assert not rest.contact_force[STOP] and rest.contact_force[1] < -5.0  # the wheel lies in the upper bushing


def test_both_engines_tell_the_same(modal):
    """RMS of every channel, displacement and force over half a second of impacts in all clearances.

    The stop, which is touched for 1 % of the time, moves as the shaft does; its force is that of a few impacts.
    """
    links = cm.simulate(COLUMN, shaken(), engine="links")
    for name in ("channels", "displacement", "contact_force"):
        computed, known = (np.sqrt(np.mean(getattr(of, name) ** 2, axis=1)) for of in (links, modal))
        rows = slice(None) if name != "contact_force" else slice(0, STOP)
        np.testing.assert_allclose(computed[rows], known[rows], rtol=0.02)
    np.testing.assert_allclose(links.contact_share, modal.contact_share, atol=0.01)
    assert 0 < modal.contact_share[3] < 0.05 < modal.contact_share[:3].min()


def test_energy_is_kept_and_side_by_side_it_moves_the_same(modal):
    balance = cm.energy_balance(COLUMN, shaken(), engine="modal")
    assert balance.imbalance < 1e-3 and {impact.bushing for impact in balance.impacts} == {0, 1, 2, 3}
    wider = COLUMN.replace(bushings=(*COLUMN.bushings[:3], dataclasses.replace(COLUMN.bushings[3], gap=2e-4)))
    law = cm.Model(COLUMN).law
    in_lanes, _ = simulate_together([(COLUMN, law), (wider, law)], shaken())
    assert_alike(in_lanes, modal, 1e-10, ("channels", *HISTORIES[1:]))


def test_the_shape_follows_from_the_forces(modal):
    """It passes the bushings and the stop as recorded, along y and z, and begins with the sag under the weight."""
    moved = deflection(COLUMN, modal, [0.1, 0.6, 0.03])
    places = np.vstack((moved[:, :, 0].T, moved[:, :, 1].T, moved[:, 1, 2]))
    np.testing.assert_allclose(places, modal.displacement[[0, 1, 2, 3, STOP]], atol=1e-9)
    assert whirl(COLUMN, modal).names == ["bushing 1, x = 0.1 m", "bushing 2, x = 0.6 m"]


def test_it_is_drawn_and_animated(modal, tmp_path):
    """Tubes and orbits of the round bushings, a slab above for the stop, flanks of the teeth: each where it is."""
    shown = clip(COLUMN, modal, seconds=0.05, slow=20.0)
    stage = Stage(Scene(shown))
    assert np.ptp(stage.picture(3)) > 200 and list(stage.tubes) == [0, 1, 3]
    assert [axis for axis, _ in COLUMN.row_axes] == ["Y", "Z", "Y", "Z", "RX", "Z"]
    np.testing.assert_allclose(COLUMN.row_walls[[0, 4, 5], 1], [1e-4, 7.5e-3, 1.2e-4])
    (below, *_), (above, *_) = stage.tubes[3]
    corners = seen(AXONOMETRIC, 0.03 + 0.008 * np.array([-1, -1, 1, 1]), 0.024 * np.array([-1, 1, 1, -1]),
                   shown.exaggeration * 1.2e-4 + 0.012)  # fmt: skip
    assert not np.isfinite(below.get_xy()[:, 1]).any()
    np.testing.assert_allclose(above.get_xy()[:4], corners.T, atol=1e-12)
    moment = np.argmin(np.abs(shown.trace_time - shown.time[3]))
    turned = np.pi / 2 + DRAWN_TWIST * shown.path[moment, TEETH] / COLUMN.bushings[2].gap
    tip = stage.paths[2].get_xydata()[1]
    np.testing.assert_allclose(tip, seen(AXONOMETRIC, 0.8, *FLANK * 0.009 * np.array([np.cos(turned), np.sin(turned)])))
    write(dataclasses.replace(shown, rate=5.0), tmp_path / "column.gif")
    assert (tmp_path / "column.gif").read_bytes()[:6] == b"GIF89a"
    drawing = rig_drawing(COLUMN)
    words = [text.get_text() for text in drawing.figure.axes[0].texts]
    assert "bushing 3\ngap 7.5 mrad" in words and "bushing 4\ngap 0.12 mm" in words
    assert "bushings are round but for 3, 4" in drawing.caption


def test_it_is_on_the_live_page_and_heard(modal):
    session = Session(cm.Model(COLUMN))
    numbers = session.show(session.setting({"level": 40.0, "duration": 4.0, "fs": FS}))
    described = session.described()
    assert described["rows"] == [
        "clearance 1, x = 0.1 m, y", "clearance 1, x = 0.1 m, z", "clearance 2, x = 0.6 m, y",
        "clearance 2, x = 0.6 m, z", "clearance 3, @0.80:RX (mrad)", "clearance 4, x = 0.03 m",
    ]  # fmt: skip
    assert described["orbits"] == [(0, 1, True), (2, 3, True)]
    assert [row["row"] for row in numbers.facts["clearances"]] == [0, 2, 4, 5]
    assert numbers.facts["clearances"][3]["rattle"] == "touches one wall"
    shaft = numbers.facts["shaft"]  # from the side bushings and stop, from above the bushings
    assert [place[0] for place in shaft["places"]] == [0, 0, 0, 1, 1] and numbers.arrays["pressed"].shape[1] == 5
    assert numbers.arrays["displacement"].shape[0] == COLUMN.n_rows
    assert exported(session.shown)[:2] == b"PK"
    assert heard(session.shown, 3).facts["unit"] == "rad"
    assert radiate(modal, COLUMN, cm.rig.Plate(sensor=3, area=0.05, distance=0.6)).pressure.std() > 0


def test_its_commands(tmp_path, answer):
    given = ROOT / "models" / "column.toml", "--rms", 40, "--out"
    assert answer("simulate", *given, tmp_path / "response.nc", "--duration", 1)
    short = "--duration", 0.5, "--seconds", 0.02, "--slow", 10
    result = answer("animate", *given, tmp_path / "column.gif", *short)
    assert result["renderer"] == "matplotlib" and len(result["peak_contact_force"]) == 4
