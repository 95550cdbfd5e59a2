"""Gears: frequencies and rest in closed form, energies, and a published gear pair with backlash under a mean torque."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import clearance_mj as cm
from clearance_mj.beam import natural_frequencies
from clearance_mj.core.errors import RigError
from clearance_mj.engines import Modal, static_equilibrium
from clearance_mj.report.figures.rig_figure import rig_drawing
from clearance_mj.rig import Bushing, Contact, Grease, Load, Order, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.structure import Gears, Inertia, Spring

from ..refusals import assert_refused

I1, I2, R1, R2, K, GAP = 1.8e-3, 6e-3, 0.0445, 0.08, 1e8, 5e-5
PAIR = Gears((Inertia(1, I1, R1, name="pinion"), Inertia(2, I2, R2)))
TORQUE = 20.0
BALANCED = (Load("1:RX", torque=TORQUE), Load("2:RX", torque=-TORQUE * R2 / R1))
MASS = 1 / (R1**2 / I1 + R2**2 / I2)
"""kg, of the pair along the line of action"""


def mesh(a=1, b=2, stiffness=K, damping=300.0, **more):
    filling = more.pop("grease", Grease(0.0))
    return Bushing(f"{a}:X", more.pop("gap", GAP), 0.0, filling, Contact(stiffness, damping), to=f"{b}:X", **more)


MESHED = (mesh(),)


def gearbox(structure=PAIR, bushings=MESHED, **more):
    sensors = more.pop("sensors", (Sensor(1, "1:RX", quantity="angle"), Sensor(2, "1:RX", quantity="angular velocity")))
    return Rig("gears", None, bushings, sensors, structure=structure, shaker=Shaker("force", "1:RX"), **more)


def still(duration, fs):
    return cm.excitation.still(duration, fs, "force")


def test_a_pair_vibrates_about_its_mesh_and_turns_freely():
    """ω² = k (r1²/I1 + r2²/I2), and 0."""
    meshed = gearbox(bushings=(mesh(grease=Grease(K)),))
    assert_allclose(natural_frequencies(meshed, 2), [0.0, np.sqrt(K / MASS) / (2 * np.pi)], rtol=1e-12)
    held = gearbox(dataclasses.replace(PAIR, springs=(Spring("1:X", K, "2:X"),)), ())
    assert_allclose(natural_frequencies(held, 2), natural_frequencies(meshed, 2), rtol=1e-12)


def test_two_inertias_on_a_shaft():
    """ω² = k (1/I1 + 1/I2); with a spring to the housing and one inertia k/I."""
    shaft = gearbox(Gears((Inertia(1, I1), Inertia(2, I2)), (Spring("1:RX", 4e3, "2:RX"),)), ())
    assert_allclose(natural_frequencies(shaft, 2), [0.0, np.sqrt(4e3 * (1 / I1 + 1 / I2)) / (2 * np.pi)], rtol=1e-12)
    held = gearbox(Gears((Inertia(1, I1),), (Spring("1:RX", 4e3),)), ())
    assert_allclose(natural_frequencies(held, 1), np.sqrt(4e3 / I1) / (2 * np.pi), rtol=1e-12)


def test_an_idler_with_two_meshes():
    """Displacements along the line of action have masses I/r²: a chain of three with two springs."""
    inertia, radius = np.array([2e-3, 5e-4, 8e-3]), np.array([0.05, 0.03, 0.09])
    box = Gears(tuple(Inertia(i + 1, j, r) for i, (j, r) in enumerate(zip(inertia, radius))))
    bushings = (mesh(1, 2, 1e8, grease=Grease(1e8)), mesh(2, 3, 6e7, grease=Grease(6e7)))
    chain = np.array([[1e8, -1e8, 0], [-1e8, 1.6e8, -6e7], [0, -6e7, 6e7]])
    known = np.sqrt(np.linalg.eigvals(chain * (radius**2 / inertia)[:, None]).real.clip(0))
    assert_allclose(natural_frequencies(gearbox(box, bushings), 3), np.sort(known) / (2 * np.pi), rtol=1e-9, atol=1e-3)
    loads = (Load("1:RX", torque=TORQUE), Load("3:RX", torque=-TORQUE * 0.09 / 0.05))
    rest = static_equilibrium(gearbox(box, (mesh(1, 2, 1e8), mesh(2, 3, 6e7)), loads=loads))
    force = TORQUE / 0.05
    assert_allclose(rest.displacement, GAP + force / np.array([1e8, 6e7]), rtol=1e-9)
    assert_allclose(rest.contact_force, force, rtol=1e-9)


@pytest.mark.parametrize("backwards", [1, -1])
def test_a_mean_torque_presses_the_flank(backwards):
    """By T/(r k), at rest and in a simulation, which stays there."""
    pair = gearbox(loads=tuple(dataclasses.replace(load, torque=backwards * load.torque) for load in BALANCED))
    known = backwards * (GAP + TORQUE / (R1 * K))
    assert_allclose(static_equilibrium(pair).displacement, known, rtol=1e-12)
    response = cm.simulate(pair, still(0.02, 1e4))
    assert response.provenance["engine"] == "modal" and response.contact_share[0] == 1.0
    assert_allclose(response.displacement[0], known, rtol=1e-8)
    assert_allclose(response.contact_force[0], backwards * TORQUE / R1, rtol=1e-6)


def test_a_torque_without_a_brake_turns_the_gears_on_together():
    """The flank drives the other gear's inertia, and both gain speed evenly from the first step on."""
    pair = gearbox(loads=BALANCED[:1])
    speeding = TORQUE / R1 / (I1 / R1**2 + I2 / R2**2)  # m/s² of base circles
    assert_allclose(static_equilibrium(pair).contact_force, speeding * I2 / R2**2, rtol=1e-9)
    response = cm.simulate(pair, still(0.02, 1e4))
    assert_allclose(response.displacement[0], GAP + speeding * I2 / R2**2 / K, rtol=1e-6)
    assert_allclose(response.channels[1], speeding / R1 * response.time, rtol=0, atol=1e-3 * response.channels[1].max())


def push(torque, duration, fs):
    """A torque that rises and falls as sin² of half a period of the duration, N m, then as long again none."""
    time = np.arange(round(2 * duration * fs)) / fs
    value = np.where(time < duration, torque * np.sin(np.pi * time / duration) ** 2, 0.0)
    return time, cm.Excitation(value, fs, "force")


def test_free_gears_turn_on_under_a_torque():
    """In the backlash a torque moves its own gear alone, I θ̈ = T(t); a drag to the housing takes θ̇ c from it."""
    time, torque = push(0.01, 0.04, 1e4)
    during, turns = time < 0.04, 2 * np.pi * time / 0.04
    read = [("1:RX", "angle"), ("1:RX", "angular velocity"), ("1:RX", "acceleration"), ("1:-X", "acceleration")]
    sensors = tuple(Sensor(i, at, quantity=what) for i, (at, what) in enumerate([*read, ("2:X", "velocity")], 1))
    free = gearbox(bushings=(mesh(gap=1.0),), sensors=sensors)
    angle, speed, turned, moved, other = cm.simulate(free, torque).channels
    known = 0.01 / (2 * I1) * (time**2 / 2 - (1 - np.cos(turns)) * (0.04 / (2 * np.pi)) ** 2)
    assert_allclose(angle[during], known[during], rtol=0, atol=1e-4 * np.max(angle))
    assert_allclose(speed[~during][5:], 0.01 * 0.04 / (2 * I1), rtol=1e-5)
    assert_allclose(turned[during], torque.value[during] / I1, rtol=0, atol=1e-3 * np.max(turned))
    assert_allclose(moved, -R1 * turned, rtol=1e-9, atol=1e-12)
    assert not other.any()
    dragged = gearbox(Gears((Inertia(1, I1, R1, drag=0.5),)), ())
    a, b, w = 0.5 / I1, 0.01 / (2 * I1), 2 * np.pi / 0.04  # ẏ + a y = b (1 - cos ωt), from 0
    fade = np.exp(-a * time)
    known = b / a * (1 - fade) - b * (a * np.cos(turns) + w * np.sin(turns) - a * fade) / (a**2 + w**2)
    slowed = cm.simulate(dragged, torque).channels[1]
    assert_allclose(slowed[during], known[during], rtol=0, atol=1e-3 * np.max(known[during]))


def test_the_whole_turns_on_at_constant_speed():
    """The momentum along the line of action, Σ I θ̇/r, is the impulse that the pinion was given over its radius."""
    sensors = tuple(Sensor(i, f"{i}:RX", quantity="angular velocity") for i in (1, 2))
    time, torque = push(5.0, 0.002, 4e4)
    speeds = cm.simulate(gearbox(sensors=sensors), torque).channels
    assert_allclose(((I1 / R1) * speeds[0] + (I2 / R2) * speeds[1])[time > 0.003], 5.0 * 0.001 / R1, rtol=1e-5)


@pytest.mark.parametrize("loads", [(), BALANCED])
def test_energies_close(loads):
    """To the error of the step, in rattle under an order, from flank to flank."""
    inertias = Inertia(1, I1, R1, 0.05), Inertia(2, I2, R2, 0.02), Inertia(3, 0.01)
    turning = {"spin": Spin(100.0), "orders": (Order("1:RX", 6.0, torque=30.0),)}
    box = gearbox(Gears(inertias, (Spring("2:RX", 2e4, "3:RX", 0.1),)), loads=loads, **turning)
    balance = cm.energy_balance(box, still(0.2, 4e4), engine=Modal(resolution=0.3))
    assert balance.imbalance < 1e-3
    assert {impact.side for impact in balance.impacts} == {"upper", "lower"}


def test_energies_of_a_mesh_that_stiffens_and_softens():
    """What the change of stiffness puts in, the mesh's damping takes out once the vibration is periodic."""
    pair = gearbox(loads=BALANCED, spin=Spin(2 * np.pi * 512 / 28))  # a mesh period is 128 samples
    balance = cm.energy_balance(pair, still(0.25, 65536.0), cm.clearance.mesh_law(pair, 28, 1.6))
    put_in, lost = (part[0, 120 * 128] - part[0, 40 * 128] for part in (balance.law_work, balance.contact_loss))
    assert balance.imbalance < 1e-3 and put_in == pytest.approx(lost, rel=1e-3)


ZETA, MEAN, RIPPLE, NATURAL = 0.05, 0.1, 0.05, 1e3  # rad/s, of the pair about its mesh
EXACT = {1.0: (0.895288, 1.269254), 0.6: (0.261210, 1.476520)}
"""Least and largest x of the upper branch over ω: periods joined from the closed form of each piece, to 1e-6"""


@pytest.mark.parametrize("omega", EXACT)
def test_the_gear_pair_of_kahraman_and_singh(omega):
    """x'' + 2ζ x' + f(x) = F_m + F_a cos ωt (J. Sound Vib. 142, 1990), run down from ω = 1 on the upper branch."""
    k = MASS * NATURAL**2
    torque = MEAN * k * GAP * R1
    ripple = RIPPLE * k * GAP * I1 / (MASS * R1)  # on the pinion alone, whose inertia takes a share
    order, spans = 5.0, {1.0: 0.0, 0.6: 2.0}
    begin, until = NATURAL / order, omega * NATURAL / order
    ramp = {"rate": (until - begin) / spans[omega], "until": until} if omega < 1 else {}
    meshed = mesh(stiffness=k, damping=0.0, grease=Grease(0.0, 2 * ZETA * MASS * NATURAL))
    loads = Load("1:RX", torque=torque), Load("2:RX", torque=-torque * R2 / R1)
    turning = {"spin": Spin(begin, **ramp), "orders": (Order("1:RX", order, torque=ripple),)}
    pair = gearbox(bushings=(meshed,), loads=loads, **turning)
    response = cm.simulate(pair, still(spans[omega] + 0.5, 4e4))
    assert response.spin[-1] * order == pytest.approx(omega * NATURAL)
    x = response.displacement[0, -round(4e4 * 20 * np.pi / (omega * NATURAL)) :] / GAP
    assert_allclose([x.min(), x.max()], EXACT[omega], rtol=0, atol=1e-4)


def test_a_mesh_of_one_and_two_pairs():
    """Free vibration from the step of stiffness on: a march of m ẍ + c ẋ + k(t) (x - gap) = F to 1e-9."""
    pair = gearbox(loads=BALANCED, spin=Spin(150.0))
    law = cm.clearance.mesh_law(pair, 28, 1.6)
    response = cm.simulate(pair, still(0.02, 2e5), law, Modal(resolution=0.3))
    period, force, time = 2 * np.pi / (28 * 150.0), TORQUE / R1, np.arange(4000) / 2e5

    def stiffness(t):
        return np.interp(t / period, [-0.01, 0.01, 0.59, 0.61], [1, 2, 2, 1], period=1) * K / 1.6

    def moved(t, state):
        x, v = state
        push = max(stiffness(t) * (x - GAP) + 300.0 * v, 0.0) if x > GAP else 0.0
        return v, (force - push) / MASS

    start, options = (GAP + force / stiffness(0.0), 0.0), {"rtol": 1e-9, "atol": 1e-13, "max_step": period / 400}
    known = solve_ivp(moved, (0, time[-1]), start, t_eval=time, **options).y[0]
    assert np.ptp(known) > 2e-6
    assert_allclose(response.displacement[0], known, rtol=0, atol=5e-3 * np.ptp(known))


def test_meshes_side_by_side():
    """Lanes with periods of their own are the cases one by one."""
    rigs = (gearbox(loads=BALANCED, spin=Spin(speed)) for speed in (90.0, 120.0, 150.0, 170.0))
    cases = [(rig, cm.clearance.mesh_law(rig, 28, 1.6)) for rig in rigs]
    for (rig, law), together in zip(cases, cm.engines.simulate_together(cases, still(0.02, 2e4))):
        assert_allclose(together.displacement, cm.simulate(rig, still(0.02, 2e4), law).displacement, rtol=1e-9)


def test_files_and_labels(tmp_path):
    structure = Gears((Inertia(1, I1, R1, 0.01, "pinion"), Inertia(7, I2, R2)), (Spring("7:RX", 1e3, damping=0.2),))
    box = gearbox(structure, (mesh(1, 7), mesh(7, 1, gap=1e-3)), loads=(Load("7:-RX", torque=2.0),), spin=Spin(90.0))
    box.save(file := tmp_path / "box.toml")
    assert Rig.load(file) == box and 'kind = "gears"' in file.read_text(encoding="utf-8")
    assert box.clearance_labels == ["1:X to 7:X", "7:X to 1:X"] and box.probe_labels == ["301:+X", "302:+X"]
    assert structure.named_points == ("1:RX", "1:X", "7:RX", "7:X") and not box.moves_across
    assert_allclose(cm.linear.linear_model(box).at_bushings[0], -cm.linear.linear_model(box).at_bushings[1])


def test_a_drawing_to_scale():
    """Gears in mesh touch with their base circles, what is on one shaft stands at one height."""
    train = Gears((*PAIR.inertias, Inertia(3, I1, 0.03), Inertia(4, 0.1)), (Spring("2:RX", 1e4, "3:RX"),))
    box = gearbox(train, (mesh(), mesh(2, 1), Bushing("3:RX", 1e-2, 0.0, Grease(0.0), Contact(1e4), to="4:RX")))
    drawing = rig_drawing(box)
    assert "4 inertias, 3 clearances" in drawing.alt
    boxes = [patch.get_bbox() for patch in drawing.figure.axes[0].patches[:4]]
    assert_allclose([b.height / 2 for b in boxes], [R1, R2, 0.03, 0.7 * (R1 + R2 + 0.03) / 3], rtol=1e-12)
    middle = np.array([(b.x0, b.y0 + b.height / 2) for b in boxes])
    assert_allclose(middle[:, 1], [0.0, *[-R1 - R2] * 3], atol=1e-15)
    assert len({*np.round(middle[1:, 0], 9)}) == 3 and middle[0, 0] == middle[1, 0]


@pytest.mark.parametrize(("make", "words"), [
    (lambda: gearbox(bushings=(mesh(1, 9),)), 'bushings[0].to "9:X" is of no inertia; the nodes are 1, 2'),
    (lambda: gearbox(Gears((Inertia(1, I1, R1), Inertia(2, I2)))), '"2:X" needs inertias[1].base_radius, m, of a'),
    (lambda: gearbox(loads=(Load("1:Z", force=1.0),)), '"1:Z" is no motion of gears: "1:RX" is the angle of an'),
    (lambda: gearbox(loads=(Load(0.3, torque=1.0),)), '"0.3" is no motion of gears'),
    (lambda: Gears((Inertia(1, I1), Inertia(1, I2))), "inertias[1].node 1 is used twice; each inertia needs"),
    (lambda: Gears(PAIR.inertias, (Spring("1:RX", 1.0, "2:X"),)), "one is an angle, one a length; give two alike"),
    (lambda: Gears(PAIR.inertias, (Spring("1:RX", 1.0, "1:RX"),)), "springs[0].to is the spring's own position"),
    (lambda: Gears(PAIR.inertias, (Spring("3:RX", 1.0),)), 'springs[0].position "3:RX" is of no inertia'),
    (lambda: Gears((Inertia(1, -1.0),)), "polar_inertia must be > 0, got -1"),
    (lambda: gearbox(gravity=(0.0, 0.0, -9.81)), "gravity: nothing of gears moves across their axes; leave it out"),
    (lambda: gearbox(spin=Spin(9.0), unbalances=(Unbalance("1:RX", 1e-3),)), "unbalances: nothing of gears moves"),
    (lambda: gearbox(orders=(Order("1:RX", 2.0, torque=1.0),)), "orders act on a shaft that turns; give [spin]"),
    (lambda: gearbox(bushings=(mesh(shape="round"),)), "a round clearance moves along Y and Z"),
])  # fmt: skip
def test_refusals(make, words):
    assert words in assert_refused(RigError, None, make)


def test_a_base_moves_no_gears():
    words = 'a base moves no gears; drive them by a force, kind = "force" and'
    shaken = gearbox().replace(shaker=Shaker())
    assert_refused(cm.ClearanceError, words, cm.simulate, shaken, cm.excitation.still(0.1, 1e4))
