"""Linear models of rigs with slots and round clearances: a shaft that bends in both planes, twists and turns.

Twist and bending of a circular shaft are uncoupled, so that closed forms of each hold. Sources: Blevins, Formulas for
Natural Frequency and Mode Shape, 1979, tables 8-1 and 8-16; Gere & Timoshenko, Mechanics of Materials, 1997.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from clearance_mj import RigError, linear_model
from clearance_mj.rig import Bushing, Contact, Grease, Load, Rig, Sensor, Spin, Unbalance
from clearance_mj.rotors import turning_shaft, unbalance_response
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Shafts, Support
from clearance_mj.structure.attached import Housing

LENGTH, DIAMETER, STEEL = 1.2, 0.03, Material(210e9, 7850.0)
SHEAR = STEEL.young_modulus / (2 * (1 + STEEL.poisson_ratio))
POLAR, SECOND, AREA = np.pi * DIAMETER**4 / 32, np.pi * DIAMETER**4 / 64, np.pi * DIAMETER**2 / 4
RIGID = STEEL.young_modulus * SECOND
SHAFT = Shaft((Section(LENGTH, DIAMETER),), (Support(0.0, "clamped"),), material=STEEL, theory="euler")
AT = 0.9  # of the round bushing


def clearance(position, stiffness=0.0, length=0.0, **more):
    return Bushing(position, 1e-3, length, Grease(stiffness, 2.0), Contact(1e5), **more)


ROUND = clearance(AT, length=0.02, shape="round")
TEETH = clearance(f"@{LENGTH}:RX")
UPRIGHT, ACROSS = clearance(0.5, length=0.01), clearance("@0.7:-Y", length=0.01)


def rig(*bushings, structure=SHAFT, **more):
    sensors = (Sensor(1, LENGTH), Sensor(2, "@0.6:RX", quantity="angle"))
    return Rig("both", None, bushings, sensors, structure=structure, **more)


def test_rows_stand_in_their_own_planes():
    """Each is what `moved` and `directed` say of its point; ends are half of the length before and behind it."""
    model = linear_model(rig(UPRIGHT, ROUND, TEETH, ACROSS), 12)
    y, z = model.moved([AT, 0.5])[0], model.moved([0.5])[0, 1]
    known = np.vstack((z, y, model.directed([TEETH.position, ACROSS.position], np.zeros(3))))
    assert_allclose(model.at_bushings, known, rtol=1e-12)
    assert_allclose(model.at_bushings[4], -model.moved([0.7])[0, 0], rtol=1e-12)
    ends = [model.moved([x])[0] for x in (AT - 0.01, AT + 0.01)]
    assert_allclose(model.at_ends[2:6], np.vstack(ends), rtol=1e-12)  # end by end, y before z
    assert_allclose(model.ends_by_row[1:3], np.swapaxes(ends, 0, 1), rtol=1e-12)
    assert_allclose(model.at_ends[8:], -np.array([model.moved([x])[0, 0] for x in (0.695, 0.705)]), rtol=1e-12)
    assert model.at_points.shape == (15, model.size)
    assert_allclose(model.at_probes({}), model.at_bushings, rtol=1e-12)


def test_static_deflection_under_weight_force_and_torque():
    """F x² (3 L - x)/6EI and q x² (6 L² - 4 L x + x²)/24EI of a cantilever, T x/GJ of its twist."""
    force, torque = 40.0, 7.0
    loads = (Load(LENGTH, force=(0.0, force, 0.0)), Load(f"@{LENGTH}:RX", torque=torque))
    model = linear_model(rig(UPRIGHT, ROUND, TEETH, ACROSS, loads=loads, gravity=(0.0, 0.0, -9.81)), 12)
    q = np.linalg.solve(model.stiff(), model.weight)
    weight = -9.81 * STEEL.density * AREA

    def along_y(x):
        return force * x**2 * (3 * LENGTH - x) / (6 * RIGID)

    def along_z(x):
        return weight * x**2 * (6 * LENGTH**2 - 4 * LENGTH * x + x**2) / (24 * RIGID)

    twist = torque * LENGTH / (SHEAR * POLAR)
    known = [along_z(0.5), along_y(AT), along_z(AT), twist, -along_y(0.7)]
    assert_allclose(model.at_bushings @ q, known, rtol=1e-8)
    assert_allclose(model.at_sensors @ q, [along_z(LENGTH), twist / 2], rtol=1e-8)


def test_natural_frequencies_of_bending_and_twist():
    """λ² √(EI/ρA)/L² in both planes, and (2n - 1) π/2L √(G/ρ) once."""
    model = linear_model(rig(ROUND, TEETH), 12)
    of_y, of_z = model.plane_sizes
    roots = [brentq(lambda k: np.cos(k) * np.cosh(k) + 1, *ends, xtol=1e-14) for ends in ((1, 3), (4, 6), (7, 9))]
    bending = np.square(roots) * np.sqrt(RIGID / (STEEL.density * AREA)) / LENGTH**2
    twist = (2 * np.arange(1, 3) - 1) * np.pi / 2 / LENGTH * np.sqrt(SHEAR / STEEL.density)
    assert_allclose(model.omega[:3], bending, rtol=1e-8)
    along_z = model.omega[of_y:]
    assert len(along_z) == of_z and not model.at_bushings[2, :of_y].any()
    assert all(np.abs(along_z / known - 1).min() < 1e-8 for known in (*bending, *twist))


def test_a_filling_that_holds_the_twist():
    """x cot x = -k L/GJ with x = ω L √(ρ/G), of a shaft on a torsion spring; a disc on a light one: √(k_t/J)."""
    stiffness = 500.0
    model = linear_model(rig(ROUND, dataclasses.replace(TEETH, grease=Grease(stiffness))), 12, grease=True)
    ratio = stiffness * LENGTH / (SHEAR * POLAR)
    known = brentq(lambda x: x * np.cos(x) + ratio * np.sin(x), 1.0, 3.0, xtol=1e-14)
    known *= np.sqrt(SHEAR / STEEL.density) / LENGTH
    assert np.abs(model.omega / known - 1).min() < 1e-8
    filled = linear_model(rig(ROUND, TEETH), 12).filled([0.0, stiffness], [0.0, 0.0])
    assert np.abs(np.sqrt(np.linalg.eigvalsh(filled.stiff())) / known - 1).min() < 1e-4  # in modes of the free end
    inertia, light = 4e-3, dataclasses.replace(STEEL, density=1e-3)
    disc = dataclasses.replace(SHAFT, material=light, discs=(Disc(LENGTH, 5.0, inertia / 2, polar_inertia=inertia),))
    omega = linear_model(rig(ROUND, TEETH, structure=disc), 12).omega
    assert np.abs(omega / np.sqrt(SHEAR * POLAR / LENGTH / inertia) - 1).min() < 1e-8


@pytest.mark.parametrize("spin", [0.0, 400.0])
def test_twist_and_whirl_do_not_know_each_other(spin):
    """Poles of a turning shaft with teeth are those without them, and those of its twist at rest."""
    inertia = {"polar_inertia": 0.08}
    structure = dataclasses.replace(SHAFT, discs=(Disc(0.8, 10.0, 0.05, **inertia),), rayleigh=(1.0, 1e-6))
    n, turning = 60, {"structure": structure, "spin": Spin(spin)}  # so many that nothing is left out
    teeth = dataclasses.replace(TEETH, position="@0.33:RX")
    slots = UPRIGHT, teeth, ACROSS
    alone, mixed = (linear_model(rig(ROUND, *others, **turning), n) for others in ((), slots))
    still = linear_model(rig(teeth, structure=structure), n)
    twists = np.abs(still.at_bushings[0]) > 1e-9 * np.abs(still.at_bushings).max()
    omega, damping = still.omega[twists][:3], still.damping[twists][:3]
    of_twist = -damping / 2 + 1j * np.sqrt(omega**2 - damping**2 / 4)
    known = np.concatenate((sorted(alone.poles(spin).value, key=np.abs)[:12], of_twist))
    poles = mixed.poles(spin).value
    for pole in known:
        assert np.abs(poles / pole - 1).min() < 1e-8
    if spin:
        assert np.ptp(np.abs(sorted(alone.poles(spin).value, key=np.abs)[:4])) > 1.0  # forward and backward whirl


def test_the_unbalance_response_leaves_angles_out():
    """Probes of round clearances and slots across the shaft are in µm; those of teeth and of twist are none."""
    turning = rig(ROUND, TEETH, ACROSS, spin=Spin(50.0), unbalances=(Unbalance(0.8, 1e-4),))
    curves = unbalance_response(turning, np.linspace(10.0, 60.0, 6))
    assert list(curves.planes) == ["1:+Z", "301:+Y", "301:+Z", "302:-Y"]
    model = turning_shaft(turning, 16).model
    force = 30.0**2 * (model.unbalance[0] - 1j * model.unbalance[1])
    rows = np.vstack((model.moved([LENGTH])[0, 1], model.at_bushings[[0, 1, 3]]))
    known = rows @ np.linalg.solve(model.dynamic(30.0, 30.0), force)
    assert_allclose(curves.motion[:, np.flatnonzero(np.isclose(curves.speed, 30.0))[0]], known, rtol=1e-9)


def test_a_slot_between_two_shafts_takes_their_relative_motion():
    """Of the first less that of the second one along its direction; the two shafts of one diameter move alike."""
    upper = dataclasses.replace(SHAFT, name="a"), dataclasses.replace(SHAFT, name="b")
    between = clearance("a@0.7:-Y", length=0.01, to="b@0.6:-Y"), clearance("a@0.9", to="b@0.9", shape="round")
    both = Rig("two", None, between, (Sensor(1, "a@1.0"),), structure=Shafts(upper))
    model = linear_model(both, 12)
    y = model.moved(["a@0.7", "b@0.6"])[:, 0]
    assert_allclose(model.at_bushings[0], y[1] - y[0], rtol=1e-12)
    assert_allclose(model.at_bushings[1:], np.subtract(*model.moved(["a@0.9", "b@0.9"])), rtol=1e-12)
    with pytest.raises(RigError, match=r"bushings\[0\].to is along Z, and position along Y; give one direction"):
        both.replace(bushings=(dataclasses.replace(between[0], to="b@0.6"),))


def test_a_housing_gives_along_the_slot_that_it_holds():
    """Under a steady push against the housing both give: 1/k of the shaft and 1/k of the housing's spring."""
    soft = Housing(2e4, 0.5)
    for slot in (UPRIGHT, ACROSS):
        bare, model = (linear_model(rig(ROUND, s), 12) for s in (slot, dataclasses.replace(slot, housing=soft)))
        gives = [m.at_bushings[2] @ np.linalg.solve(m.stiff(), m.at_bushings[2]) for m in (bare, model)]
        assert_allclose(gives[1] - gives[0], 1 / soft.stiffness, rtol=1e-6)


def test_matrices_have_rows_of_any_direction():
    """Three masses of their own on springs: P M⁻¹ Pᵀ of a round clearance along y and z, and of a slot along -x."""
    mass, stiffness = np.diag([2.0, 3.0, 4.0]).tolist(), np.diag([1e3, 2e3, 3e3]).tolist()
    structure = Matrices(mass=mass, stiffness=stiffness, dofs=("1:Y", "1:Z", "2:X"), units="m-kg-s")
    bushings = clearance("1:Z", 10.0, shape="round"), clearance("2:-X", 20.0)
    both = Rig("matrices", None, bushings, (Sensor(1, "1:Z"),), structure=structure)
    rows = linear_model(both, 6).at_bushings
    assert_allclose(rows @ rows.T, np.diag([1 / 2.0, 1 / 3.0, 1 / 4.0]), atol=1e-12)
    assert rows[2].sum() * linear_model(both, 6).directed(["2:X"], np.zeros(3)).sum() < 0.0
    held = linear_model(both, 6, grease=True)
    assert_allclose(held.omega**2, np.sort([1010 / 2.0, 2010 / 3.0, 3020 / 4.0]), rtol=1e-12)
