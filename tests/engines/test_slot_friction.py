"""Friction in slots and stops: Den Hartog's closed form, sticking, a turning shaft in a slot, files and errors.

J. P. Den Hartog, Forced vibrations with combined Coulomb and viscous friction, Trans. ASME 53, 1931, 107-115: a mass on
a spring under P cos ωt and dry friction F moves without stops by x = X cos(ωt - φ) at its turning points, with
X² = (P V/k)² - (F U/k)², V = 1/(1 - r²), U = sin(π/r)/(r (1 + cos(π/r))), r = ω/ω_n, and cos φ = X k/(P V).
"""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.errors import RigError
from clearance_mj.engines import static_equilibrium
from clearance_mj.rig import Bushing, Contact, Friction, Grease, Load, Rig, Sensor, Shaker, Spin
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Support

from .alike import assert_alike, with_bushings

COEFFICIENT, PRESSED = 0.3, 1.1  # N, of which the spring of the pressed mass takes 10 N/m times the deflection
STOP = Bushing(
    "1:Z", 1e-3, 0.0, Grease(0.0), Contact(100.0, 2.0), stops="upper",
    friction=Friction(COEFFICIENT, stiffness=1e4, along="1:Y"),
)  # fmt: skip
MASSES = Rig(
    "pressed", None, (STOP,), (Sensor(1, "1:Y", quantity="displacement"),),
    structure=Matrices(
        mass=np.eye(2).tolist(), stiffness=[[1.0, 0.0], [0.0, 10.0]], damping=[[0.0, 0.0], [0.0, 2.0]],
        dofs=["1:Y", "1:Z"], units="m-kg-s",
    ),
    shaker=Shaker("force", "1:Y"), loads=(Load("1:Z", force=PRESSED),),
)  # fmt: skip
NORMAL = 100 * (PRESSED - 10 * 1e-3) / (100 + 10)  # N, of contact and spring together
SHAFT = Shaft(
    (Section(0.4, 0.016), Section(0.4, 0.012)), (Support(0.0, "clamped"),), (Disc(0.8, 0.2, 1e-4),),
    Material(210e9, 7850.0), (1.0, 1e-5), theory="euler",
)  # fmt: skip


def forced(force, ratio, periods, samples=200, damping=0.0, lag=0.0):
    """The sliding mass' displacement over the last period under force cos(ratio t - lag), and ratio t."""
    rig = with_bushings(MASSES, friction=dataclasses.replace(STOP.friction, damping=damping))
    phase = 2 * np.pi * np.arange(samples * periods) / samples
    fs = samples * ratio / (2 * np.pi)
    response = cm.simulate(rig, cm.Excitation(force * np.cos(phase - lag), fs, "force"), engine="modal")
    assert response.contact_force[0, -1] == pytest.approx(NORMAL, rel=1e-4)
    return response.channels[0][-samples:], phase[:samples]


def den_hartog(ratio):
    """Largest displacement under a force of 1 N, m, and that without friction."""
    friction, gain = COEFFICIENT * NORMAL, 1 / (1 - ratio**2)
    return np.sqrt(gain**2 - (friction * np.sin(np.pi / ratio) / ratio / (1 + np.cos(np.pi / ratio))) ** 2), gain


@pytest.mark.parametrize("ratio", [0.6, 0.8, 1.3])
def test_forced_vibration_with_dry_friction(ratio):
    largest, gain = den_hartog(ratio)
    lag = np.arccos(largest / gain)
    x, phase = forced(1.0, ratio, 80)
    assert x.max() == pytest.approx(largest, rel=5e-3) and x.min() == pytest.approx(-largest, rel=5e-3)
    # The turning point, from a parabola through the largest three samples.
    before, most, after = (x[(x.argmax() + i) % x.size] for i in (-1, 0, 1))
    turn = phase[x.argmax()] + phase[1] * (before - after) / (before - 2 * most + after) / 2
    assert np.degrees((turn - lag + np.pi) % (2 * np.pi) - np.pi) == pytest.approx(0.0, abs=1.0)


def test_static_friction_holds_what_is_weaker():
    """Below μ N the bristles alone bend, as a spring of 1e4 N/m beside that of the mass; beyond, it slides."""
    limit = COEFFICIENT * NORMAL
    held, slides = (forced(ratio * limit, 0.5, 6, damping=150.0, lag=np.pi / 2)[0] for ratio in (0.9, 1.5))
    assert np.abs(held).max() == pytest.approx(0.9 * limit / np.abs(1e4 + 1 - 0.5**2 + 75j), rel=1e-3)
    assert np.abs(slides).max() > 0.1


def turning(**more):
    slot = Bushing(0.6, 3e-4, 0.0, Grease(500.0, 3.0), Contact(5e4, 5.0), friction=Friction(0.2, damping=1.0))
    more = {"structure": SHAFT, "loads": (Load(0.65, force=(0.0, 0.0, -20.0)),)} | more
    return Rig("slot", None, (slot,), (Sensor(1, 0.7, direction=(0.0, 1.0, 0.0)),), **more)


@pytest.mark.parametrize("spin", [30.0, -30.0])
def test_a_turning_shaft_rests_where_its_slot_drags_it(spin):
    """Pressed down, its lower side goes along +y where it turns from y to z: friction μ N holds it back, along -y."""
    rig = turning(spin=Spin(spin))
    rest = static_equilibrium(rig)
    assert rest.contact_force[0] < -1.0
    held = Load(0.6, force=(0.0, np.sign(spin) * 0.2 * rest.contact_force[0], 0.0))
    smooth = with_bushings(rig, friction=None).replace(loads=(*rig.loads, held))
    known = static_equilibrium(smooth).deflection([0.6, 0.8])
    np.testing.assert_allclose(rest.deflection([0.6, 0.8]), known, rtol=1e-6)


@pytest.mark.parametrize("spin", [None, Spin(50.0)])
def test_links_rub_as_modes_do(spin):
    rig = turning(spin=spin, gravity=(0.0, 0.0, -9.81), shaker=Shaker("force", 0.7, direction=(0.0, 0.6, 0.8)))
    push = cm.excitation.random(0.5, 2048.0, seed=1, band=(5, 100), rms=6.0, kind="force")
    modal, links = (cm.energy_balance(rig, push, engine=engine) for engine in ("modal", "links"))
    assert modal.response.contact_share > 0.5 and modal.friction[0, -1] > 0.2 * modal.lost[-1]
    for name in ("channels", "displacement", "contact_force"):
        a, b = getattr(modal.response, name), getattr(links.response, name)
        assert np.sqrt(np.mean((a - b) ** 2) / np.mean(a**2)) < 1e-2, name
    assert modal.imbalance < 1e-3 and links.imbalance < 1e-3
    assert links.friction[0, -1] == pytest.approx(modal.friction[0, -1], rel=1e-2)


def test_lanes_rub_alike():
    push = cm.excitation.random(0.5, 2048.0, seed=1, band=(5, 100), rms=6.0, kind="force")
    rig = turning(shaker=Shaker("force", 0.7, direction=(0.0, 0.6, 0.8)))
    rigs = [with_bushings(rig, friction=Friction(mu, damping=1.0)) for mu in np.linspace(0.1, 0.8, 8)]
    cases = [(rig, cm.ConstantLaw(5e4, 5.0)) for rig in rigs]
    together = cm.engines.simulate_together(cases, push)
    assert np.ptp([each.channels[0].std() for each in together]) > 1e-2 * together[0].channels[0].std()
    for (case, law), in_lanes in zip(cases, together):
        assert_alike(in_lanes, cm.simulate(case, push, law, engine="modal"), 1e-9, ("channels", "contact_force"))


def test_a_file_comes_back(tmp_path):
    for rig in (MASSES, turning(spin=Spin(20.0))):
        rig.save(tmp_path / "rig.toml")
        assert Rig.load(tmp_path / "rig.toml") == rig
    assert 'along = "1:Y"' in (MASSES.save(tmp_path / "m.toml") or (tmp_path / "m.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("change", "words"), [
    ({"friction": Friction(0.1)}, 'bushings[0].friction.along "1:Y": nothing slides along the wall that "1:Z"'),
    ({"friction": Friction(0.1, along="1:Z")}, 'along "1:Z": nothing slides along the wall that "1:Z" meets'),
    ({"friction": Friction(0.1, along="2:Y")}, 'bushings[0].friction.along "2:Y" is no degree of freedom'),
    ({"friction": Friction(0.1, along="1:RX")}, "bushings[0].friction.along"),
    ({"shape": "round", "stops": "both", "radius": 0.01}, "bushings[0].friction.along is of a slot or stop"),
])  # fmt: skip
def test_what_cannot_slide_is_named(change, words):
    with pytest.raises(RigError) as error:
        MASSES.replace(bushings=(dataclasses.replace(STOP, **change),))
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.slow
def test_harmonic_balance_with_dry_friction():
    """Den Hartog's largest displacement, of a branch over frequencies: 1.4 % off with 9 harmonics, 0.3 % with 25."""
    rig = MASSES.replace(sensors=(Sensor(1, "1:Y"),))
    branch = cm.periodic.follow_response(cm.Model(rig), 1.0, (0.7 / 2 / np.pi, 0.8 / 2 / np.pi), 25)
    ratio, order = 2 * np.pi * branch.frequency[-1], np.arange(1, branch.acceleration.shape[-1])
    assert ratio == pytest.approx(0.8)
    harmonics = branch.acceleration[-1, 0, 1:] / -((order * ratio) ** 2)
    x = (harmonics * np.exp(1j * np.outer(2 * np.pi * np.arange(1000) / 1000, order))).sum(axis=1).real
    assert x.max() == pytest.approx(den_hartog(ratio)[0], rel=4e-3)


def test_a_resonance_that_nothing_damps_ends_its_branch():
    """Without the load nothing presses: the free mass alone, whose displacement is P/(k (1 - r²))."""
    branch = cm.periodic.follow_response(cm.Model(MASSES.replace(loads=())), 1.0, (0.1, 0.2))
    assert "grows without bound towards 0.15915" in branch.ended
    assert len(branch.frequency) < 500


def test_angles_and_displacements_do_not_rub_on_each_other():
    teeth = Bushing("@0.8:RX", 1e-3, 0.0, Grease(0.0), Contact(10.0), friction=Friction(0.1, along=0.8))
    with pytest.raises(RigError, match=r'friction.along "0.8": one of it and position "@0.8:RX" is an angle'):
        turning().replace(bushings=(teeth,))
