"""Identification in space: gains of a turning shaft, run-out, unbalance, forces along motions, and a whole bench."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.clearance import along
from clearance_mj.clearance.family import CONTACT_FAMILIES, ROUND_FILLING_FAMILIES
from clearance_mj.clearance.record import clearance_records
from clearance_mj.estimate import Estimates, Parameter
from clearance_mj.identify import update_rig
from clearance_mj.identify.forces.restoring import RestoringForce, restoring_force
from clearance_mj.identify.forces.turning_loads import find_turning_loads
from clearance_mj.identify.laws.case import HOLE, ClearanceWithLaw, hole_of, nominal_of, open_parameters, placed
from clearance_mj.identify.laws.case import forces_along as round_forces_along
from clearance_mj.identify.laws.comparison import along_valley
from clearance_mj.identify.laws.force_fit import fit_force
from clearance_mj.identify.laws.measured_motion import MeasuredMotion, smallest_circle
from clearance_mj.identify.records.prepared import prepare, prepare_turning, prepared
from clearance_mj.identify.records.run_out import run_out
from clearance_mj.identify.structure.priors import priors, rig_with
from clearance_mj.io.dataset import Dataset
from clearance_mj.linear import linear_model
from clearance_mj.rig import Bushing, Contact, Friction, Grease, Spin

from ..study.turning_rig import RIG, RUN_OUT, SHAFT, turning_record

GAP, K, MU, RADIUS = 2e-4, 1e5, 0.1, 0.01


@pytest.mark.parametrize("spin", [0.0, 150.0])
def test_gains_of_a_turning_shaft(spin):
    """A sum over poles is the inverse of the dynamic stiffness with its gyroscopic moments, line by line."""
    tested = RIG.replace(spin=Spin(spin), shaker=dataclasses.replace(RIG.shaker, direction=(0.0, 1.0, 0.0)))
    model = linear_model(RIG, 6)
    omega = 2 * np.pi * np.array([3.0, 40.0, 71.0, 200.0])
    driven, mean = model.driven(tested)
    responses = driven.displacement_gains(model.at_sensors, "base", omega, spin=mean)
    inputs = np.vstack((-model.at_bushings, -model.influence[:, 1])).T
    for w, gains in zip(omega, responses):
        dynamic = np.diag(model.omega**2 - w**2 + 1j * w * model.damping)
        dynamic = dynamic + spin * (1j * w * model.gyroscopic + model.circulatory)
        known = model.at_sensors @ np.linalg.solve(dynamic, inputs)
        np.testing.assert_allclose(gains, known, rtol=1e-9, atol=1e-9 * np.abs(known).max())


def forces_along(place, velocity, out_of_round=(0.0, 0.0), friction=0.0, spin=0.0):
    """Forces of a bushing with a linear contact along a motion (n, 2) of both its ends."""
    wall = {"shape": "oval", "wall": dict(zip(("wide", "across"), out_of_round))} if any(out_of_round) else {}
    bushing = Bushing(
        0.5, GAP, grease=Grease(0.0), contact=Contact(K), radius=RADIUS, length=0.01,
        friction=Friction(friction) if friction else None, **{"shape": "round"} | wall,
    )  # fmt: skip
    law = cm.ContactLaw(cm.clearance.KelvinVoigt(K, 0.0), Grease(0.0))
    records = clearance_records(SimpleNamespace(bushings=(bushing,)), law, 1e-4)
    x, v = (np.ascontiguousarray(np.repeat(each[:, None], 3, axis=1)) for each in (place, velocity))
    return along.forces_along(records, 0, x, v, spin)


def test_forces_on_a_circle():
    """On a circle of radius r the wall pushes with k (r - gap), and rubs with μ of that once its bristles slide."""
    angle, r, rate = np.linspace(0, 2 * np.pi, 629), 1.2 * GAP, 100.0
    normal, along = np.stack((np.cos(angle), np.sin(angle)), axis=1), np.stack((-np.sin(angle), np.cos(angle)), axis=1)
    force = forces_along(r * normal, r * rate * along, friction=MU, spin=30.0)[300:]
    size = K * (r - GAP)
    np.testing.assert_allclose(np.sum(force * normal[300:], axis=1), size, rtol=1e-9)
    np.testing.assert_allclose(np.sum(force * along[300:], axis=1), MU * size, rtol=1e-9)


def test_a_wall_out_of_round_does_no_work():
    """Around a closed way the forces of an elastic wall that is not round do no work: they have a potential."""
    angle = np.linspace(0, 2 * np.pi, 20001)
    place = GAP * np.stack((1.3 * np.cos(angle) + 0.2 * np.sin(2 * angle), 1.25 * np.sin(angle)), axis=1)
    force = forces_along(place, np.zeros_like(place), out_of_round=(0.05 * GAP, -0.03 * GAP))
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(place, axis=0), axis=1)
    assert abs(work.sum()) < 1e-6 * np.abs(work).sum()
    assert np.abs(force - forces_along(place, np.zeros_like(place))).max() > 0.05 * np.abs(force).max()


@pytest.mark.parametrize(("wide", "identified"), [(2.4e-6, False), (2.5e-6, True)])
def test_a_hole_is_oval_where_its_estimates_say_so(wide, identified):
    """x' C^-1 x > 5.99, 95 % of the χ² of two: with a σ of 1 µm each from 2.447 µm on; else it stays round."""
    names = [f"bushings[1].{name}" for name in HOLE]
    parameters = [Parameter(name, "m", 0.0, -1e-4, 1e-4, 1e-5, "linear") for name in names]
    hole = hole_of(Bushing(0.5, GAP, 0.01, Grease(0.0), Contact(K), shape="round"), GAP,
                    Estimates.of(parameters, [wide, 0.0], 1e-12 * np.eye(2)), "bushings[1].")  # fmt: skip
    wall = {"wide": pytest.approx(wide), "across": 0.0}
    assert hole == ({"shape": "oval", "wall": wall} if identified else {"shape": "round", "wall": None})


def test_the_smallest_circle():
    """Of points on an arc that spans more than half of a circle it is that circle."""
    angle = np.linspace(0.0, 1.3 * np.pi, 200)
    inside = np.random.default_rng(0).normal(0, 0.1, (500, 2))
    points = np.concatenate((np.stack((np.cos(angle), np.sin(angle)), axis=1), inside)) * 3.0 + (2.0, -1.0)
    middle, radius = smallest_circle(points)
    np.testing.assert_allclose([*middle, radius], [2.0, -1.0, 3.0], atol=5e-3)


@pytest.fixture(scope="module")
def turning():
    """Records of a shaft that never touches: slow, along y at another speed, and fast, with a run-out once per turn."""
    cases = ("slow", Spin(6.0)), ("ramp_y", Spin(60.0), "y", 1.0, 1), ("ramp_z", Spin(140.0), "z", 1.0, 2)
    return Dataset(RIG, tuple(turning_record(name, "identify", *of) for name, *of in cases))


def test_run_out(turning):
    """What a probe shows of a slowly turning shaft once per turn is its run-out."""
    slow = prepared(turning.records[0])
    harmonics = run_out(slow.turning.angle, slow.displacement)
    np.testing.assert_allclose(np.hypot(*harmonics[[0, len(harmonics) // 2]]), RUN_OUT, rtol=0.02)


def test_unbalance(turning):
    """An unbalance of 1e-4 kg m at 0 rad, found from a prior of another moment and phase."""
    start = RIG.replace(unbalances=(dataclasses.replace(RIG.unbalances[0], moment=3e-4, phase=1.0),))
    (unbalance,) = find_turning_loads(start, prepare_turning(turning), {}).rig.unbalances
    assert unbalance.moment == pytest.approx(1e-4, rel=0.02) and unbalance.phase == pytest.approx(0.0, abs=0.02)


def test_what_the_unbalance_moves_in_the_slow_roll_is_not_lost():
    """A slow roll at 40 of 140 rad/s shows several percent of the unbalance's motion at 140.

    Its moment is found all the same, and the motion given back to the probes.
    """
    slow, fast = (turning_record(name, "identify", *of) for name, *of in
                  (("slow", Spin(40.0)), ("fast", Spin(140.0), "z", 1.0)))  # fmt: skip
    _, less = prepare_turning(Dataset(RIG, (slow, fast)))
    loads = find_turning_loads(RIG, (less,), {})
    assert loads.rig.unbalances[0].moment == pytest.approx(1e-4, rel=0.01)
    whole = prepared(fast)
    angle = whole.turning.angle
    moved = whole.displacement - RUN_OUT * np.array([np.cos(angle), np.sin(angle)])
    assert np.std(loads.with_slow_roll_restored(less, {}).displacement - moved) < 0.1 * np.std(
        less.displacement - moved
    )


def touching_below(bushing, rest, rig, seconds=8.0, fs=2048.0):
    """The restoring force of a wall that hardens, along a random motion that meets it below alone."""
    n = round(seconds * fs)
    lines = np.fft.rfftfreq(n, 1 / fs)
    phases = np.random.default_rng(4).uniform(size=(2, lines.size))
    spectrum = ((lines > 15) & (lines < 60)) * np.exp(2j * np.pi * phases)
    spectrum *= 0.25 * bushing.gap / np.std(np.fft.irfft(spectrum, n))
    x, v = (np.fft.irfft(s, n).T for s in (spectrum, 2j * np.pi * lines * spectrum))
    law = cm.ContactLaw(cm.clearance.Cubic(K, 0.3 * K / bushing.gap**2), Grease(0.0))
    ends = (np.ascontiguousarray(np.repeat(each[:, None], 3, axis=1)) for each in (x, v))
    force = round_forces_along(ClearanceWithLaw(bushing, law, rest), *ends, np.zeros(n), 1 / fs).T
    one, two = np.ones(1), np.ones(2)
    return RestoringForce(
        "below", rig, fs, (0.0, 0.4 * fs), np.arange(n) / fs, x.T, v.T, force, two, two,
        np.repeat(x.T[:, None], 2, axis=1), np.ones(n, dtype=bool), np.array([1.0, 2.0]), np.full((2, 2), 1e-3), one,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.7, 1.3])
def test_a_gap_that_is_touched_on_one_side_alone_is_found_along_its_valley(ratio):
    """From a rig file whose gap is wrong and whose wall below is right, a search ends 7 to 16 % from the gap."""
    gap, rest = 2e-4, np.array([3e-5, -1.2e-4])
    bushing = Bushing(0.56, gap, grease=Grease(0.0), contact=Contact(K), radius=RADIUS, length=0.0, shape="round")
    rig = RIG.replace(spin=None, unbalances=(), bushings=(dataclasses.replace(bushing, gap=ratio * gap),))
    nearer = rest * (1 + (ratio - 1) * gap / math.hypot(*rest))
    known = [p for p in priors(rig) if p.name == "bushings[0].gap"]
    opened = open_parameters(0, nominal_of(rig, 0), known, tuple(nearer))
    motion = MeasuredMotion([touching_below(bushing, tuple(rest), rig)], rig, 0, opened)
    first = fit_force(motion, CONTACT_FAMILIES["linear + cubic"], ROUND_FILLING_FAMILIES["long film"])
    fit = along_valley(first, motion)
    assert abs(first.bushing.gap / gap - 1) > 0.05
    assert fit.bushing.gap == pytest.approx(gap, rel=0.01)
    np.testing.assert_allclose(fit.case.rest, rest, atol=0.01 * gap)


def test_a_gap_may_be_drawn_smaller_than_the_offset_was():
    """The shaft is placed anew: its old offset is not held against the new gap, and its new one stays in it."""
    bushing = Bushing(0.56, 2e-4, grease=Grease(0.0), contact=Contact(K), radius=RADIUS, length=0.0, offset=1.9e-4)
    drawn = placed(bushing, np.array([3e-5, -4e-5]), gap=1.5e-4)
    assert (drawn.gap, drawn.offset_y, drawn.offset) == (1.5e-4, 3e-5, -4e-5)
    beyond = placed(bushing, np.array([0.0, 3e-4]), gap=1.5e-4)
    assert (beyond.offset_y, beyond.offset) == (0.0, pytest.approx(0.999 * 1.5e-4))


def test_an_unbalance_beside_a_known_one(turning):
    """Of 1e-4 kg m at one place, of which the rig file knows 4e-5, 6e-5 are left."""
    known = dataclasses.replace(RIG.unbalances[0], moment=4e-5)
    start = RIG.replace(unbalances=(known, known))
    added, kept = find_turning_loads(start, prepare_turning(turning), {}).rig.unbalances
    assert kept == known
    assert added.moment == pytest.approx(6e-5, rel=0.03) and added.phase == pytest.approx(0.0, abs=0.03)


def test_no_force_where_nothing_touches(turning):
    """Turning, run-out and unbalance leave no force in a clearance that is never used up."""
    for record in prepare(turning):
        force = restoring_force(record, rig=RIG)
        moved = np.std(force.displacement[:, force.valid])
        shaft = 48 * 2.1e11 * math.pi * 0.03**4 / 64 / SHAFT.length**3
        assert np.std(force.force[:, force.valid]) < 0.01 * shaft * moved


def test_a_body_s_polar_inertia_is_at_most_twice_that_about_a_diameter():
    """Drawn beyond that by values that are open both, it ends there."""
    opened = "structure.discs[0].inertia", "structure.discs[0].polar_inertia"
    assert set(opened) <= {p.name for p in priors(RIG)}
    (disc,) = rig_with(RIG, dict(zip(opened, (0.007, 0.016)))).structure.discs
    assert (disc.inertia, disc.polar_inertia) == (0.007, 0.014)


def test_what_is_open_in_space():
    """Cross-axis sensitivity, turned probes, both offsets, supports and friction are open beside the planar numbers."""
    rig = RIG.replace(bushings=(dataclasses.replace(RIG.bushings[0], friction=Friction(0.1)),))
    parameters = {p.name: p for p in priors(rig, 250.0, probes=True)}
    opened = ("sensors[0].direction[2]", "sensors[1].direction[1]", "bushings[0].probe_angle", "bushings[0].offset_y",
              "bushings[0].friction.coefficient", "structure.supports[0].translation", "probes[1].gain")  # fmt: skip
    assert set(opened) <= set(parameters)
    changed = rig_with(rig, {"sensors[0].direction[2]": 0.02, "bushings[0].probe_angle": 0.03})
    assert changed.sensors[0].unit_direction == pytest.approx([0.0, 1.0, 0.02], abs=3e-4)
    assert changed.bushings[0].probe_angle == 0.03


@pytest.mark.slow
def test_a_mass_that_the_rig_file_forgets_is_found_in_space(tmp_path):
    """On foreign physics, of a rotor that rubs, with its size and its place."""
    from experiments.benches.space.bench import make_bench
    from experiments.benches.space.records import write_bench

    bench = make_bench(51, "rotor", structure=["mass"])
    write_bench(bench, tmp_path, short=True, roles=("identify",), kinds=("base", "force"))
    (true,) = bench.structure.masses
    update = update_rig(Dataset.load(tmp_path))
    assert [one.name for one in update.structure.accepted] == ["mass"]
    assert update.rig.masses[-1].mass == pytest.approx(true.mass, rel=0.15)
    assert update.rig.masses[-1].position == pytest.approx(true.position, abs=0.04)


@pytest.mark.slow
def test_clearances_are_where_their_forces_act(tmp_path):
    """On foreign physics: with couples as large as forces allow, one was found 12 mm away, at its prior's end."""
    from experiments.benches.space.bench import make_bench
    from experiments.benches.space.records import write_bench

    bench = make_bench(49, "steering")
    write_bench(bench, tmp_path, roles=("identify",), kinds=("base", "force"))
    estimates = update_rig(Dataset.load(tmp_path), as_drawn=True).estimates
    value, std = (dict(zip(estimates.names, of)) for of in (estimates.value, estimates.std))
    for j, true in enumerate(bench.truth()["bushings"]):
        name = f"bushings[{j}].position"
        assert abs(value[name] - true["position"]) < 2 * std[name] < 4e-3


@pytest.mark.slow
def test_the_shipped_turning_rig():
    """Of foreign physics: gap within 3 %, offsets within 20 µm, viscosity within 5 %, intervals of 3 sigma hold."""
    from experiments.benches.space.shipped import shipped_bench

    (true,) = shipped_bench().truth()["bushings"]
    fit = cm.identify.identify(Dataset.load("data/turning_rig"), "bench")
    (bushing,) = fit.rig.bushings
    known = {p.name: (value, std) for p, value, std in
             zip(fit.estimates.parameters, fit.estimates.value, fit.estimates.varied_std)}  # fmt: skip
    assert bushing.gap == pytest.approx(true["gap"], rel=0.03)
    assert bushing.film.viscosity == pytest.approx(true["viscosity"], rel=0.05)
    assert (bushing.offset_y, bushing.offset) == pytest.approx((true["offset_y"], true["offset_z"]), abs=2e-5)
    for name, value in (("bushings[0].gap", true["gap"]), ("grease viscosity, bushings[0]", true["viscosity"])):
        assert abs(math.log(known[name][0] / value)) < 3 * known[name][1]
