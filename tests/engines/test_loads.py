"""Several inputs at once, constant loads, and orders of the spin, against closed forms and sums of each alone."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.clearance import MaxwellSlip
from clearance_mj.core.errors import ExcitationError, RecordError, RigError, SimulationError
from clearance_mj.engines import Modal, simulate_together, static_equilibrium
from clearance_mj.io.formats import to_channels
from clearance_mj.report.deflection import deflection
from clearance_mj.rig import Bushing, Contact, Grease, Load, Order, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.signals.excitation_data import Excitation
from clearance_mj.signals.response import Response
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Support

from .alike import HISTORIES

TABLE1 = Rig.load("models/table1_rig.toml")
BEAM = TABLE1.beam
PUSHED = Shaker("force", 0.3, node=201)
OPEN = cm.ConstantLaw(0.0, 0.0, grease=Grease(500.0, 2.0))
LIGHT = Modal(modes=1)  # of a shaft without mass
STILL = cm.excitation.still(0.25, 2048.0)


def noise(seed, kind="base", rms=1.0):
    return cm.excitation.random(0.25, 2048.0, band=(5, 220), rms=rms, seed=seed, kind=kind)


def of_shape(motion, rig):
    """A rig whose clearances are slots, or round ones in space."""
    return rig.with_shape("round") if motion == "spatial" else rig


def moving(motion, **changes):
    return of_shape(motion, TABLE1).replace(**changes)


def histories(response):
    return np.vstack((response.acceleration, response.displacement, response.grease_force))


def added(rig, excitations, engine="modal"):
    """Response to all inputs at once, and the sum of those to each alone."""
    together = cm.excitation.together
    silent = [dataclasses.replace(each, value=0 * each.value) for each in excitations]
    both = cm.simulate(rig, together(*excitations), OPEN, engine)
    alone = [together(*silent[:i], each, *silent[i + 1 :]) for i, each in enumerate(excitations)]
    return both, sum(histories(cm.simulate(rig, each, OPEN, engine)) for each in alone)


@pytest.mark.parametrize(("engine", "within"), [("modal", 1e-12), ("links", 1e-5)])
@pytest.mark.parametrize("motion", ["planar", "spatial"])
def test_two_inputs_do_what_the_sum_of_each_does(motion, engine, within):
    """Exactly where the structure is linear; chains of links turn by angles."""
    both, summed = added(moving(motion, shakers=(PUSHED,)), (noise(1), noise(2, "force", 0.3)), engine)
    assert both.references == ("100:+Z", "201:+Z") and both.kinds == ("base", "force") and both.kind == "mixed"
    for computed, expected in zip(histories(both), summed):
        assert_allclose(computed, expected, rtol=0, atol=within * np.abs(summed).max())


def test_a_base_moves_along_y_and_z_at_once():
    both, summed = added(moving("spatial", shakers=(Shaker(direction=(0.0, 1.0, 0.0)),)), (noise(1), noise(2)))
    assert both.references == ("100:+Z", "100:+Y") and both.kind == "base"
    assert_allclose(histories(both), summed, rtol=0, atol=1e-12 * np.abs(summed).max())
    along_z = cm.simulate(moving("spatial"), noise(1), OPEN, "modal")
    assert_allclose(both.displacement[1::2], along_z.displacement[1::2], rtol=0, atol=1e-15)


@pytest.mark.parametrize("motion", ["planar", "spatial"])
def test_energies_count_the_work_of_all_inputs(motion):
    drive = cm.excitation.together(noise(1, rms=6.0), noise(2, "force"))
    balance = cm.energy_balance(moving(motion, shakers=(PUSHED,)), drive, engine="modal")
    assert balance.imbalance < 1e-4 and balance.input[-1] > 0


def test_sensors_read_the_velocity_of_a_base_along_both_axes():
    """A vibrometer and a probe that stand on the ground see the base move: each input counts."""
    sensors = tuple(Sensor(1, 0.3, quantity=q, direction=(0.0, 1.0, 1.0)) for q in ("velocity", "displacement"))
    rig = moving("spatial", shakers=(Shaker(direction=(0.0, 1.0, 0.0)),), sensors=sensors)
    parts = noise(1), noise(2)
    silent = [dataclasses.replace(each, value=0 * each.value) for each in parts]
    cases = parts, (parts[0], silent[1]), (silent[0], parts[1])
    both, one, other = (cm.simulate(rig, cm.excitation.together(*each), OPEN, "modal").channels for each in cases)
    assert_allclose(both, one + other, rtol=0, atol=1e-12 * np.abs(both).max())
    assert np.ptp(one - other) > 0.01 * np.ptp(both)


def test_one_of_two_inputs_is_that_input_alone():
    rig = TABLE1.replace(shakers=(PUSHED,))
    both = cm.simulate(rig, cm.excitation.together(noise(1, rms=0.0), noise(2, "force")), engine="modal")
    alone = cm.simulate(TABLE1.replace(shaker=PUSHED), noise(2, "force"), engine="modal")
    assert_allclose(both.displacement, alone.displacement, rtol=0, atol=1e-12)


@pytest.mark.parametrize("motion", ["planar", "spatial"])
def test_lanes_take_all_inputs_and_loads(motion):
    rig = moving(motion, shakers=(PUSHED,), loads=(Load(0.6, force=-2.0),), gravity=(0.0, 0.0, -9.81))
    law = cm.ContactLaw(cm.clearance.Cubic(8e3, 1e11), grease=MaxwellSlip((3e3, 1e3), (0.2, 0.4), 1e3, 3.0))
    drive = cm.excitation.together(noise(1), noise(2, "force"))
    alone = cm.simulate(rig, drive, law, "modal")
    for each in simulate_together([(rig, law)] * 3, drive):
        assert_allclose(histories(each), histories(alone), rtol=0, atol=1e-9 * np.abs(histories(alone)).max())


def held(motion, position, force):
    """A cantilever with a load, whose bushing is too wide to be met."""
    bushing = Bushing(0.5 * BEAM.length, 1.0, 0.0, Grease(0.0), Contact(1.0))
    return of_shape(motion, TABLE1.replace(masses=(), bushings=(bushing,), loads=(Load(position, "belt", force),)))


@pytest.mark.parametrize("engine", ["modal", "links"])
@pytest.mark.parametrize("motion", ["planar", "spatial"])
def test_a_cantilever_is_bent_by_a_load_at_its_tip_and_stays_there(motion, engine):
    """F L³/3EI at the tip, 5/16 of it at half the length (Roark, table 8.1, case 1a)."""
    rig, length = held(motion, BEAM.length, -0.05), BEAM.length
    tip = -0.05 * length**3 / (3 * BEAM.bending_stiffness)
    assert_allclose(static_equilibrium(rig).deflection([length, length / 2])[:, 1], [tip, 5 / 16 * tip], rtol=1e-9)
    response = cm.simulate(rig, STILL, cm.ConstantLaw(1.0, 0.0, grease=Grease(0.0)), engine)
    assert_allclose(response.displacement[-1], 5 / 16 * tip, rtol=1e-9 if engine == "modal" else 1e-3)
    assert np.ptp(response.displacement[-1]) < 1e-7 * abs(tip)
    assert np.abs(response.acceleration).max() < 1e-6


@pytest.mark.parametrize("motion", ["planar", "spatial"])
def test_a_shaft_is_pressed_against_a_wall(motion):
    """A cantilever of stiffness 3EI/L³ at its tip and a contact k share the load there: k (x - g) + k_s x = F."""
    gap, k = 1e-4, 2e4
    spring = 3 * BEAM.bending_stiffness / BEAM.length**3
    force = spring * gap + 1.0
    bushing = Bushing(BEAM.length, gap, 0.0, Grease(0.0), Contact(k))
    rig = of_shape(motion, held("planar", BEAM.length, force).replace(bushings=(bushing,)))
    x = (force + k * gap) / (k + spring)
    rest = static_equilibrium(rig)
    assert_allclose(rest.displacement[-1], x, rtol=1e-9)
    assert_allclose(rest.contact_force[-1], k * (x - gap), rtol=1e-9)
    response = cm.simulate(rig, STILL, cm.ConstantLaw(k, 0.0), "modal")
    assert_allclose(response.displacement[-1], x, rtol=1e-9)
    assert response.contact_share == 1.0


def test_a_slot_rests_where_a_round_clearance_does():
    plane = TABLE1.replace(loads=(Load(0.5, "belt", -3.0),), gravity=(0.0, 0.0, -9.81))
    slots, rounds = (static_equilibrium(of_shape(motion, plane)) for motion in ("planar", "spatial"))
    moved = [cm.simulate(of_shape(m, plane), noise(1), engine="modal").displacement for m in ("planar", "spatial")]
    pairs = [(getattr(slots, name), getattr(rounds, name)) for name in HISTORIES[1:]]
    for of_slots, of_rounds in (*pairs, moved):
        assert_allclose(of_slots, of_rounds[1::2], rtol=0, atol=1e-9 * np.abs(of_rounds[1::2]).max())


def at_rest(rig, points):
    """How far points have moved in their own directions before anything else moves."""
    rest = static_equilibrium(rig)
    return rest.model.shapes(points) @ rest.coordinates


def test_a_torque_twists_a_shaft():
    """T x/(G J) up to where it acts, and no further."""
    shaft = Shaft((Section(1.0, 0.02),), (Support(0.0, "clamped"),), (), Material(2.1e11, 7850.0), theory="euler")
    given = {"structure": shaft, "loads": (Load(0.6, "gear", torque=5.0),), "shaker": Shaker("force", 0.5)}
    rig = Rig("twisted", None, (), (Sensor(1, "@1.0:RX"),), **given)
    twist = 5.0 * 0.6 / (2.1e11 / 2.6 * np.pi * 0.02**4 / 32)
    assert_allclose(at_rest(rig, ["@0.3:RX", "@0.6:RX", "@1.0:-RX", 1.0]), [twist / 2, twist, -twist, 0.0], rtol=1e-9)
    response = cm.simulate(rig, cm.excitation.still(0.1, 2048.0, "force"))
    assert response.provenance["engine"] == "modal" and np.abs(response.acceleration).max() < 1e-6


def lumped(dofs, k, **changes):
    """Bodies of 2 kg, or 0.3 kg m², on springs."""
    n = len(dofs)
    mass = np.diag([0.3 if ":R" in dof else 2.0 for dof in dofs])
    matrices = Matrices(units="m-kg-s", mass=mass, stiffness=np.eye(n) * k, dofs=dofs)
    given = {"sensors": (Sensor(1, dofs[0]),), "shaker": Shaker("force", dofs[0])} | changes
    return Rig("lumped", None, (), structure=matrices, **given)


def test_a_mass_sags_on_its_spring_and_a_torque_twists_one():
    """m g/k and T/k; both are there before anything moves, and stay."""
    assert_allclose(at_rest(lumped(["1:Z"], 500.0, gravity=(0.0, 0.0, -9.81)), ["1:Z"]), -2.0 * 9.81 / 500.0)
    for position in ("1:Z", "1:RX"):
        loads = Load(position, "gear", torque=4.0), Load("1:Z", force=(0.0, 0.0, 3.0))
        rig = lumped(["1:Z", "1:RX"], 500.0, loads=loads)
        assert_allclose(at_rest(rig, ["1:Z", "1:RX"]), [3 / 500, 4 / 500], rtol=1e-12)
        response = cm.simulate(rig, cm.excitation.still(0.2, 512.0, "force"), engine="modal")
        assert np.abs(response.acceleration).max() < 1e-9


def jeffcott(**changes):
    """A disc in the middle of a light shaft on rigid bearings."""
    pins, light = (Support(0.0, "pinned"), Support(1.0, "pinned")), Material(2.1e11, 1.0)
    shaft = Shaft((Section(1.0, 0.02),), pins, (Disc(0.5, 3.0),), light, (20.0, 0.0), theory="euler")
    bushing = Bushing(0.5, 1.0, 0.0, Grease(0.0), Contact(1.0), shape="round")
    given = {"spin": Spin(60.0), "shaker": Shaker("force", 0.5)} | changes
    return Rig("jeffcott", None, (bushing,), (Sensor(1, 0.5),), structure=shaft, **given)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("side_by_side", [False, True])
def test_an_order_turns_a_rotor_at_a_multiple_of_its_spin(side_by_side, way):
    """A force F that turns at ±2 Ω: r = F/m / |ω² - (2Ω)² ± 2iΩ η|, with damping η M."""
    rig, spin, force = jeffcott(orders=(Order(0.5, 2.0 * way, 0.3, phase=0.4),)), 60.0, 0.3
    gain = 1 / (3.0 * (48 * 2.1e11 * np.pi * 0.02**4 / 64 / 3.0 - 4 * spin**2 + 2j * way * spin * 20.0))
    still = cm.excitation.still(1.5, 2048.0, "force")
    law = cm.clearance.nominal_law(rig)
    together = simulate_together([(rig, law)] * 2, still, LIGHT) if side_by_side else ()
    response = together[1] if side_by_side else cm.simulate(rig, still, law, LIGHT)
    late = response.time > 1.0
    r = response.displacement[0] + 1j * response.displacement[1]
    expected = force * gain * np.exp(1j * (2 * way * spin * response.time + 0.4))
    assert_allclose(r[late], expected[late], rtol=0, atol=2e-3 * force * abs(gain))


def test_harmonic_balance_turns_an_order_against_the_spin():
    """What is along z has the other sign, and along y none, where nothing touches."""
    rigs = [jeffcott(orders=(Order(0.5, order, 0.3, phase=0.2 * order),)) for order in (2.0, -2.0)]
    branches = [cm.periodic.follow_unbalance(cm.Model(r, cm.clearance.nominal_law(r)), (50.0, 60.0), 15) for r in rigs]
    with_spin, against = (each.clearance_displacement[-1] for each in branches)
    assert_allclose(against, with_spin * [[1.0], [-1.0]], rtol=0, atol=1e-6 * np.abs(with_spin).max())


def test_an_order_of_one_is_an_unbalance_of_a_steady_spin():
    turned = jeffcott(unbalances=(Unbalance(0.5, 1e-4, 0.7),))
    driven = jeffcott(orders=(Order(0.5, 1.0, 1e-4 * 60.0**2, phase=0.7),))
    still = cm.excitation.still(0.3, 2048.0, "force")
    one, other = (cm.simulate(rig, still, engine=LIGHT).displacement for rig in (turned, driven))
    assert_allclose(one, other, rtol=0, atol=1e-12 * np.abs(one).max())
    balances = [cm.energy_balance(rig, still, engine=LIGHT) for rig in (turned, driven)]
    assert_allclose(*(balance.unbalance for balance in balances), rtol=0, atol=1e-9 * balances[0].unbalance.max())
    assert balances[1].imbalance < 1e-6


@pytest.mark.parametrize(("change", "message"), [
    (lambda: static_equilibrium(TABLE1.replace(loads=(Load(0.5, "belt", (1.0, 0.0, 0.0)),))), "it moves no"),
    (lambda: Load("@0.5:Y", force=(1.0, 0.0, 0.0)), "force .* stands beside the direction of"),
    (lambda: lumped(["1:Z"], 1.0, loads=(Load("1:Z", torque=1.0),)), r"loads\[0\].torque"),
    (lambda: lumped(["1:Z"], 1.0, loads=(Load("1:Z", force=(1.0, 0.0, 0.0)),)), r'loads\[0\].force "1:X" is no'),
    (lambda: Load(0.5), "force is missing; give one"),
    (lambda: Load(0.5, force=1.0, torque=1.0), "torque stands beside force; give one"),
    (lambda: Load(0.5, force=0.0), "force must not be zero"),
    (lambda: TABLE1.replace(shakers=(Shaker(),)), r"shakers\[0\] is at 100:\+Z as another input; give it a node"),
    (lambda: TABLE1.replace(shakers=(Shaker("force", 0.5, node=3),)), r"shakers\[0\].node 3 is a sensor's"),
    (lambda: TABLE1.replace(orders=(Order(0.5, 2.0, 1.0),)), r"orders act on a shaft that turns"),
    (lambda: jeffcott(spin=None, orders=(Order(0.5, 2.0, 1.0),)), r"orders act on a shaft that turns"),
    (lambda: cm.simulate(jeffcott(orders=(Order(0.5, 2.0, 1.0),)), STILL, engine="links"), "links knows no orders"),
])  # fmt: skip
def test_what_acts_on_nothing_is_refused_in_one_line(change, message):
    with pytest.raises(RigError, match=message) as error:
        change()
    assert "\n" not in str(error.value)


def test_an_excitation_has_a_signal_for_each_input():
    rig, three = TABLE1.replace(shakers=(PUSHED,)), cm.excitation.together(*map(noise, (1, 2, 3)))
    with pytest.raises(ExcitationError, match=r"has 2 inputs, the excitation 3; give one signal for each"):
        cm.simulate(rig, three)
    alone, first = cm.simulate(TABLE1, noise(1), engine="modal"), cm.simulate(rig, noise(1), engine="modal")
    assert first.references == ("100:+Z",)  # the other one rests
    assert_allclose(first.displacement, alone.displacement, rtol=0, atol=1e-3 * np.abs(alone.displacement).max())
    with pytest.raises(ExcitationError, match=r"fs 1024.0: must be that of the first one, 2048 Hz"):
        cm.excitation.together(noise(1), cm.excitation.still(0.25, 1024.0))


def test_what_nothing_holds_has_no_rest():
    free = lumped(["1:Z"], 0.0, loads=(Load("1:Z", force=1.0),))
    with pytest.raises(SimulationError, match="no static equilibrium"):
        cm.simulate(free, cm.excitation.still(0.1, 512.0, "force"), engine="modal")


def test_energies_of_a_slot_under_weight_close():
    """Put in is what is lost and stored, to the error of the step: 1e-3 of the largest energy."""
    drive = cm.excitation.random(0.5, 2048.0, band=(5, 220), rms=4.0, seed=1)
    for engine in ("modal", "links"):
        balance = cm.energy_balance(TABLE1.replace(gravity=(0.0, 0.0, -9.81)), drive, engine=engine)
        assert balance.imbalance < 1e-3 and np.ptp(balance.weight) > 0


def test_frfs_of_two_inputs_at_once_are_told_apart(tmp_path):
    """Channels 2 u₁ - 3 u₂ and u₂ have just these gains; files keep every reference."""
    drive = cm.excitation.together(cm.excitation.random(4.0, 512.0, seed=1), cm.excitation.random(4.0, 512.0, seed=2))
    channels = np.array([[2.0, -3.0], [0.0, 1.0]]) @ drive.value
    record = Response(512.0, drive.value, channels, kinds=drive.kinds, responses=("1:+Z", "2:+Z"),
                      references=("100:+Z", "101:+Z"))  # fmt: skip
    frf = cm.estimate_frf(record, resolution=2.0, band=(10.0, 200.0))
    assert frf.references == ("100:+Z", "101:+Z")
    assert_allclose(frf.value, np.broadcast_to([[[2.0], [-3.0]], [[0.0], [1.0]]], frf.value.shape), atol=1e-9)
    with pytest.raises(RecordError, match='need estimator "H1"'):
        cm.estimate_frf(record, "H2")
    with pytest.raises(RecordError, match="no quantity in common"):
        cm.estimate_frf(dataclasses.replace(record, kinds=("base", "force")))
    with pytest.raises(RecordError, match=r"several inputs, 100:\+Z, 101:\+Z; needs one"):
        _ = record.only_input
    again = Response.from_xarray(record.to_xarray())
    assert (again.references, again.kinds) == (record.references, record.kinds)
    assert_allclose(again.excitation, record.excitation)
    assert [channel.label for channel in to_channels(record)] == ["100:+Z", "101:+Z", "1:+Z", "2:+Z"]
    assert_allclose(Excitation.from_xarray(drive.to_xarray()).value, drive.value)
    record.plot()


def test_a_sum_of_loads_is_drawn_where_the_shaft_rests():
    rig, tip = held("planar", BEAM.length, -0.05), -0.05 * BEAM.length**3 / (3 * BEAM.bending_stiffness)
    response = cm.simulate(rig, STILL, cm.ConstantLaw(1.0, 0.0, grease=Grease(0.0)), "modal")
    assert_allclose(deflection(rig, response, [BEAM.length])[[0, -1], 0], tip, rtol=1e-6)


def test_orders_beside_an_excitation_are_no_periodic_vibration():
    with pytest.raises(ExcitationError, match="orders at their own speed"):
        cm.periodic.follow_response(cm.Model(jeffcott(orders=(Order(0.5, 2.0, 1.0),))), 1.0, (8.0, 11.0))


def test_a_file_has_shakers_loads_and_orders(tmp_path):
    text = """name = "loaded"
beam = {length = 1.0, diameter = 0.01, young_modulus = 2.1e11, density = 7850.0}
sensors = [{node = 1, position = 0.5}]
bushings = [{position = 0.6, gap = 1e-4, length = 0.01, shape = "round", contact.stiffness = 1e5, grease.stiffness = 0}]
spin = {speed = 10.0}
shakers = [{kind = "force", position = 0.5}, {direction = [0.0, 1.0, 0.0]}]
loads = [{name = "belt", position = 0.4, force = [0.0, 3.0, -4.0]}]
orders = [{position = 0.7, order = 2, force = 0.5}]
"""
    path, again = tmp_path / "rig.toml", tmp_path / "again.toml"
    path.write_text(text, encoding="utf-8")
    rig = Rig.load(path)
    assert [each.kind for each in rig.inputs] == ["force", "base"] and rig.shaker.position == 0.5
    assert rig.loads == (Load(0.4, "belt", (0.0, 3.0, -4.0)),) and rig.orders == (Order(0.7, 2.0, 0.5),)
    rig.save(again)
    assert Rig.load(again) == rig
    assert not {"shakers", "loads", "orders"} & set(TABLE1.to_dict())


def test_modal_settings_do_not_change_a_rest():
    rest = [static_equilibrium(held("planar", 0.77, 0.1), n_modes=n).deflection([0.77])[0, 1] for n in (3, 12)]
    assert_allclose(*rest, rtol=1e-10)


def test_a_torque_is_simulated_by_modes_where_no_engine_is_named():
    """As any rig whose points name directions; links twist the beam by T x/(GJ) too, where they are asked for."""
    short = cm.excitation.random(0.05, 2048.0, seed=0)
    angle = Sensor(9, "@0.5:RX", quantity="angle")
    rig = TABLE1.replace(loads=(Load(0.5, torque=5.0),), sensors=(*TABLE1.sensors, angle))
    assert cm.simulate(rig, short).provenance["engine"] == "modal"
    shear, polar = BEAM.young_modulus / 2.6, np.pi * BEAM.diameter**4 / 32
    assert_allclose(cm.simulate(rig, short, engine="links").channels[-1], 5.0 * 0.5 / (shear * polar), rtol=1e-9)
