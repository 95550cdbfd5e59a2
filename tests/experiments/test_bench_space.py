"""The virtual benches in space against closed forms, and their datasets as the package reads them."""

import dataclasses
import tomllib

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Spin
from experiments import script
from experiments.benches import film
from experiments.benches.space import motion, physics, table
from experiments.benches.space.bench import IGNORANCES, make_bench
from experiments.benches.space.holes import Hole, as_arrays
from experiments.benches.space.make import main
from experiments.benches.space.plans import Plan, plans
from experiments.benches.space.records import FS, keyphasor, measure_channels, simulate, turned, write_bench
from experiments.benches.space.rigs import KINDS
from experiments.benches.space.shaft import Disc, Rotor, Support, shape_rows

STEP = 1 / 32768
RIGID = np.inf
CANTILEVER = Rotor(1.0, 0.01, 2e11, 7800.0, (), (Support(0.0, np.inf, np.inf),), (0.0,))
PINNED = CANTILEVER.replace(supports=(Support(0.0, RIGID), Support(1.0, RIGID)))
JEFFCOTT = PINNED.replace(density=20.0, discs=(Disc(0.5, 2.0),), damping=(0.05,))  # a shaft almost without mass
STIFFNESS, MASS = 48 * JEFFCOTT.bending_stiffness, 2.0 + 17 / 35 * JEFFCOTT.mass_per_length
OMEGA = np.sqrt(STIFFNESS / MASS)
BLOCK = Rotor(0.1, 0.05, 2e11, 7850.0, (Disc(0.05, 1.0),), (Support(0.0, 500.0), Support(0.1, 500.0)), (0.0,))
"""Rigid, on springs that hardly hold it."""
BLOCK_MASS, SPRINGS = 1.0 + 0.1 * BLOCK.mass_per_length, 1000.0


def hole(position, gap=1.0, **changes):
    nothing = Hole(position, 0.0, gap, 0.0, 0.0, 0.0, 0.0, 0.005, (1.0, 0.0, 0.0, 0.0), 0.0, 1.0)
    return dataclasses.replace(nothing, **changes)


def run(rotor, holes=(), load=None, probes=(), spin=0.0, seconds=1.0, force=None, start=None, unbalance=True):
    """March with the spin held; return (n_probes, 2, n_t) displacements and the end's state."""
    bushings, load = as_arrays(holes), load or motion.Load()
    ends = np.array([(h.position - h.length / 2, h.position + h.length / 2) for h in holes]).reshape(-1, 2)
    scheme = motion.scheme(rotor, ends, load, [], probes, STEP)
    inputs = np.zeros((round(seconds / STEP), 7))
    inputs[:, motion.SPIN] = spin
    angle = spin * STEP * np.arange(len(inputs))
    if unbalance:
        inputs[:, motion.WHIRL_Y], inputs[:, motion.WHIRL_Z] = motion.whirl(angle, np.full_like(angle, spin), 0 * angle)
    for axis, value in (force or {}).items():
        inputs[: len(value), motion.FORCE_Y + axis] = value
    state = start or motion.unloaded(scheme, bushings)
    out = np.empty((len(inputs), 2 * len(probes)))
    assert motion.march(scheme, state, bushings, inputs, out) == len(inputs)
    return out.T.reshape(len(probes), 2, -1), state


def lines(signal, count):
    """Frequencies in rad/s, > 0 forward, of the largest lines of y + i z, between the lines of its spectrum."""
    spectrum = np.abs(np.fft.fft(signal * scipy.signal.windows.blackmanharris(signal.size)))
    peaks = []
    for _ in range(count):
        k = int(np.argmax(spectrum))
        a, b, c = np.log(spectrum[[k - 1, k, (k + 1) % signal.size]])
        peaks.append(k + 0.5 * (a - c) / (a - 2 * b + c))
        spectrum[[i % signal.size for i in range(k - 12, k + 13)]] = 1e-300
    turns = np.array(peaks)
    return 2 * np.pi * np.where(turns > signal.size / 2, turns - signal.size, turns) / (signal.size * STEP)


def test_frequencies_of_a_cantilever_and_of_a_pinned_beam():
    """Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1, of shafts too slender to shear."""
    cantilever, pinned = CANTILEVER.replace(diameter=0.005), PINNED.replace(diameter=0.005)
    of_beam = np.sqrt(cantilever.bending_stiffness / cantilever.mass_per_length) / (2 * np.pi)
    for shaft, roots in ((cantilever, [1.875104, 4.694091, 7.854757]), (pinned, np.pi * np.arange(1, 4))):
        np.testing.assert_allclose(shaft.frequencies(3), of_beam * np.square(roots), rtol=1e-3)


def test_shear_and_rotary_inertia_of_a_pinned_shaft():
    """Timoshenko: (ρI/κGA) ω⁴ - (1 + (I/A)(1 + E/κG) k²) ω² + (EI/ρA) k⁴ = 0, k = n π/L, E/κG = 2.7945 for ν = 0.29.

    A beam without shear would be 8 % too high in the third mode.
    """
    thick = PINNED.replace(diameter=0.1)
    k, gyration, ratio = np.pi * np.arange(1, 4), 0.1**2 / 16, 2 * 1.29 * (7 + 12 * 0.29 + 4 * 0.29**2) / (6 * 1.29**2)
    squared = thick.bending_stiffness / thick.mass_per_length
    a, b = thick.density * gyration * ratio / thick.young_modulus, 1 + gyration * (1 + ratio) * k**2
    exact = np.sqrt((b - np.sqrt(b**2 - 4 * a * squared * k**4)) / (2 * a)) / (2 * np.pi)
    np.testing.assert_allclose(thick.frequencies(3), exact, rtol=2e-4)


def test_a_sheared_shaft_between_its_nodes():
    """A cantilever under a force F at its end: F (3 L x² - x³)/(6 E I) + F x/(κ G A), at nodes and between them."""
    thick = CANTILEVER.replace(diameter=0.1, supports=(Support(0.0, RIGID, RIGID),))
    x, _, stiffness, free = thick.matrices()
    bent = np.zeros(free.size)
    bent[free] = np.linalg.solve(stiffness[np.ix_(free, free)], np.eye(free.size)[-2][free])
    at = np.array([0.1234, 0.5, 0.777, 1.0])
    shear = 2 * 1.29 * (7 + 12 * 0.29 + 4 * 0.29**2) / (6 * 1.29**2) / (thick.young_modulus * np.pi * 0.1**2 / 4)
    exact = (3 * at**2 - at**3) / (6 * thick.bending_stiffness) + shear * at
    np.testing.assert_allclose(shape_rows(x, thick.sheared(np.diff(x)), at) @ bent, exact, rtol=1e-7)


def test_sag_and_where_the_shaft_rests():
    """5 w L⁴/(384 E I) + w L²/(8 κ G A) in the middle of a pinned beam under w = ρ A g; E/κG = 2.79."""
    weight, gyration = PINNED.mass_per_length * 9.81, 0.01**2 / 16  # A = I / gyration
    exact = weight * (5 / 384 + 2.79 * gyration / 8) / PINNED.bending_stiffness
    assert PINNED.sag([0.5])[0] == pytest.approx(exact, rel=1e-4)
    bench = make_bench(1, "steering", ignorance=())
    free = dataclasses.replace(bench, holes=tuple(hole(h.position, length=h.length) for h in bench.holes))
    rest = simulate(free, size=100).rest
    np.testing.assert_allclose(rest[:, 1], -free.rotor.sag([p.position for p in free.probes]), rtol=2e-3)
    np.testing.assert_allclose(rest[:, 0], 0.0, atol=1e-9)


@pytest.mark.parametrize("spin", [100.0, 300.0])
def test_gyroscopic_pairs_of_an_overhung_disc(spin):
    """K = EI [[12, -6], [-6, 4]], M = diag(m, J) and a little of the shaft, G = Jp on the slope, L = 1."""
    mass, inertia, polar = 2.0, 0.02, 0.036
    overhung = CANTILEVER.replace(density=20.0, discs=(Disc(1.0, mass, inertia, polar),))
    k = CANTILEVER.bending_stiffness * np.array([[12.0, -6.0], [-6.0, 4.0]])
    m = np.diag([mass, inertia]) + overhung.mass_per_length / 420 * np.array([[156.0, -22.0], [-22.0, 4.0]])
    gyroscopic = np.linalg.solve(m, np.diag([0.0, spin * polar]))  # λ² M = K + λ Ω G
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(m, k), gyroscopic]])
    exact, kick = np.sort(np.linalg.eigvals(system).real), np.full(10, 50.0)
    (path,), _ = run(overhung, load=motion.Load(hammer=1.0), probes=[1.0], spin=spin, seconds=8.0, force={0: kick})
    np.testing.assert_allclose(np.sort(lines(np.diff(path[0] + 1j * path[1]), 4)), exact, rtol=1e-3, atol=0.02)


@pytest.mark.parametrize("ratio", [0.5, 1.4])
def test_unbalance_of_a_jeffcott_rotor(ratio):
    """r = u ω² / (k - m ω² + i c ω), as seen from the unbalance."""
    spin, moment = ratio * OMEGA, 1e-5
    load = motion.Load(unbalances=((0.5, moment * np.exp(0.7j)),))
    (path,), _ = run(JEFFCOTT, load=load, probes=[0.5], spin=spin, seconds=4.0)
    angle = spin * STEP * np.arange(path.shape[1])
    orbit = ((path[0] + 1j * path[1]) * np.exp(-1j * angle))[-1000:]
    exact = moment * np.exp(0.7j) * spin**2 / (STIFFNESS - MASS * spin**2 + 2j * 0.05 * OMEGA * MASS * spin)
    np.testing.assert_allclose(orbit, exact, rtol=2e-3)


@pytest.mark.parametrize("friction", [0.0, 0.03])
def test_synchronous_rub(friction):
    """[(k+k_c-mω²) r - k_c δ]² + [(cω+μ k_c) r - μ k_c δ]² = (m e ω²)² with k_c = 20 k, e = 0.2 δ, ζ = 0.05, ω = ω_n.

    Of μ = 0.1 this is no motion that lasts: by Routh's criterion it is unstable about its circle from μ = 0.06 on.
    """
    gap, turn = 1e-3, 2 * np.pi / OMEGA
    load = motion.Load(unbalances=((0.5, MASS * 0.2 * gap),))
    smooth = hole(0.5, gap, contact=(20 * STIFFNESS, 0.0, 0.0, 0.0), bristle=20 * STIFFNESS)
    _, state = run(JEFFCOTT, [smooth], load, [0.5], OMEGA, 40 * turn)
    rubbing = dataclasses.replace(smooth, friction=friction)
    (path,), _ = run(JEFFCOTT, [rubbing], load, [0.5], OMEGA, 100 * turn, start=state)

    def over(r):
        return (20 * (r - 1)) ** 2 + (0.1 * r + 20 * friction * (r - 1)) ** 2 - 0.04

    radius = scipy.optimize.brentq(over, 1.0, 1.1)
    if not friction:
        assert radius == pytest.approx(1.008635, abs=2e-6)
    np.testing.assert_allclose(np.hypot(*path)[-3000:] / gap - 1, radius - 1, rtol=0.01)


def test_a_block_slides_in_its_bushing():
    """√(g/δ): 49.8 Hz for a radial clearance of 0.1 mm, and a little more by the springs that hold it."""
    gap = 1e-4
    bushing = hole(0.05, gap, offset_z=-gap, contact=(2e8, 0.0, 0.0, 5e3))
    load = motion.Load((0.0, -9.81), 0.05)
    _, state = run(BLOCK, [bushing], load, [0.05], seconds=0.2)
    (path,), _ = run(BLOCK, [bushing], load, [0.05], seconds=2.0, force={0: np.full(10, 5.0)}, start=state)
    frequency = np.abs(lines(path[0] - path[0].mean(), 1)[0]) / (2 * np.pi)
    assert np.abs(path[0]).max() < 0.1 * gap
    assert frequency == pytest.approx(np.sqrt(9.81 / gap + SPRINGS / BLOCK_MASS) / (2 * np.pi), rel=5e-3)


def test_a_journal_finds_its_place_in_the_oil(tmp_path, monkeypatch):
    """Under a load and turning it rests where Reynolds' equation carries the load, seen at that eccentricity alone."""
    for name, value in {"FOLDER": tmp_path, "ECCENTRICITIES": 11, "ANGLES": 9}.items():
        monkeypatch.setattr(table, name, value)
    radius, length, gap, viscosity, spin = 0.025, 0.0125, 1e-4, 0.02, 200.0
    oil = hole(0.05, gap, length=length, radius=radius, viscosity=viscosity, contact=(1e7, 0.0, 0.0, 0.0))
    (path,), _ = run(BLOCK, [oil], motion.Load((0.0, -9.81)), [0.05], spin, 1.5)
    y, z = path[:, -1]
    e = np.hypot(y, z) / gap
    assert 0.1 < e < 0.95
    np.testing.assert_allclose(path[:, -3000:].T, [[y, z]] * 3000, atol=1e-3 * gap)
    outwards, along = film.force(film.grid(e, 0.25), 0.0)
    scale = 12 * viscosity * radius * length * (radius / gap) ** 2 * e * spin / 2
    pushed = scale * (outwards + 1j * along) * (y + 1j * z) / np.hypot(y, z)
    weight = 9.81 * BLOCK_MASS
    assert pushed - SPRINGS * (y + 1j * z) == pytest.approx(1j * weight, abs=0.01 * weight)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_energy_never_grows(friction):
    """Of a shaft that bounces in an oval bushing: dry friction takes it away, and nothing else does."""
    gap, k = 2e-4, 2e5
    shape = {"oval": 0.05, "axis": 0.4, "length": 0.02, "offset_y": 3e-5, "offset_z": -6e-5}
    wall = hole(0.7, gap, contact=(k, 0.0, 0.0, 0.0), friction=friction, bristle=0.7 * k, **shape)
    bushings, shaft = as_arrays([wall]), CANTILEVER.replace(density=7800.0)
    scheme = motion.scheme(shaft, np.array([[0.69, 0.71]]), motion.Load(hammer=1.0), [], [0.7], STEP)
    state = motion.unloaded(scheme, bushings)
    inputs, out = np.zeros((1, 7)), np.empty((1, 2))
    energy = []
    for i in range(6000):
        inputs[0, motion.FORCE_Y : motion.FORCE_Z + 1] = 10.0 * (i < 60), 25.0 * (600 < i < 660)
        assert motion.march(scheme, state, bushings, inputs, out)
        if i < 660:
            continue
        stored = 0.5 * np.sum(state.v**2) + 0.5 * np.sum(scheme.square * state.q**2)
        y, z = state.place + np.array([[3e-5], [-6e-5]])
        depth = np.maximum(np.hypot(y, z) - gap * (1 + 0.05 * np.cos(2 * (np.arctan2(z, y) - 0.4))), 0.0)
        stored += 0.25 * k * np.sum(depth**2) + 0.25 * 0.7 * k * np.sum(state.bristle**2)
        energy.append(stored)
    energy = np.array(energy)
    assert np.all(energy <= np.minimum.accumulate(energy) + 5e-3 * energy[0])
    left = energy[-1] / energy[0]
    assert (left > 0.99) if friction == 0 else (left < 0.9), left


def test_slip_elements_have_no_axis_and_lose_what_a_slider_loses():
    """Rotated motion gives the rotated force; a cycle of amplitude a along a line loses 4 k d (a - d)."""
    k, d, a = 1e3, 1e-4, 5e-4
    bushings = as_arrays([hole(0.0, slip=((k,), (d,)))])
    path = a * np.exp(0j) * np.sin(np.linspace(0, 4 * np.pi, 2001))

    def forces(path):
        before, after, values = np.zeros((1, 1, 2)), np.zeros((1, 1, 2)), []
        for was, now in zip(path[:-1], path[1:]):
            to, step = np.zeros((1, 10)), now - was
            at = now.real, now.imag, 0.0, 0.0, step.real, step.imag
            physics.grease(bushings.numbers, bushings.slip, 0, *at, before, after, to, 0)
            before[:] = after
            values.append(complex(*to[0, :2]))
        return np.array(values)

    lost = np.sum(forces(path)[1000:].real * np.diff(path)[1000:].real)
    assert lost == pytest.approx(4 * k * d * (a - d), rel=0.01)
    bent = path + 1j * a * np.cos(np.linspace(0, 7, path.size))
    turn = np.exp(1.1j)
    np.testing.assert_allclose(forces(bent * turn), forces(bent) * turn, atol=1e-12)


def test_forces_and_their_derivatives():
    """The contact's force is the gradient of its energy, and all derivatives are those of the forces."""
    wall = hole(0.0, 1e-4, oval=0.06, axis=0.5, contact=(1e6, 1e14, 1.5, 20.0), friction=0.3, bristle=5e5)
    wall = dataclasses.replace(wall, offset_y=0.0, elastic=100.0, slip=((2e3,), (1e-5,)), squeeze=(3.0, 1.5e-4))
    numbers, elements, _ = as_arrays([wall])
    before, after = np.zeros((1, 1, 2)), np.zeros((1, 1, 2))
    reynolds = np.random.default_rng(1).normal(size=(2, 1, 1)) + np.zeros((2, 5, 9))
    reynolds += 0.1 * np.arange(5)[:, None]

    def total(at, what):
        y, z, vy, vz = at
        to = np.zeros((1, 10))
        if what == "contact":
            physics.contact(numbers, 0, y, z, vy, vz, y - 1e-4, z - 4e-5, 1e-7, 1e-6, to, 0)
        elif what == "grease":
            physics.grease(numbers, elements, 0, y, z, vy, vz, y - 8e-5, z - 2e-5, before, after, to, 0)
        else:
            oil = numbers.copy()
            oil[0, physics.FILM] = 30.0
            physics.film(oil, reynolds, 0, 0.4 * y, 0.5 * z, vy, vz, 150.0, to, 0)
        return to[0]

    at, small = np.array([1.02e-4, 4.5e-5, 0.03, -0.02]), np.array([1e-10, 1e-10, 1e-6, 1e-6])
    scales = {"film": np.array([0.4, 0.5])}
    for what in ("contact", "grease", "film"):
        jacobian = total(at, what)[2:].reshape(2, 2, 2)
        for i in range(4):
            step = small[i] * np.eye(4)[i]
            slope = (total(at + step, what) - total(at - step, what))[:2] / (2 * small[i])
            factor = scales.get(what, np.ones(2))[i] if i < 2 else 1.0
            size = 1e-4 * np.abs(jacobian[i // 2]).max()
            np.testing.assert_allclose(jacobian[i // 2, :, i % 2] * factor, slope, atol=size)


def test_the_mark_passes_at_the_angle_zero():
    spin, time = Spin(100.0, 20.0, 150.0), np.arange(8192) / FS
    angle = turned(spin, time)
    level = keyphasor(angle)
    up = np.flatnonzero((level[:-1] < 2.5) & (level[1:] >= 2.5))
    crossed = angle[up] + (2.5 - level[up]) / (level[up + 1] - level[up]) * (angle[up + 1] - angle[up])
    np.testing.assert_allclose(crossed / (2 * np.pi), np.round(crossed / (2 * np.pi)), atol=2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_drawn_for_one_ignorance_does_not_depend_on_the_others(kind):
    everything, alone, exact = (make_bench(5, kind, of) for of in (IGNORANCES, ["linear"], ()))
    assert everything.rotor == alone.rotor != exact.rotor
    assert [h.gap for h in exact.holes] == [b.gap for b in exact.rig.bushings]
    for hole_, bushing in zip(everything.holes, everything.rig.bushings):
        assert np.hypot(hole_.offset_y, hole_.offset_z) < hole_.narrowest
        assert 0.6 * bushing.gap <= hole_.gap <= 1.4 * bushing.gap


def test_a_dataset_is_read_by_the_package(tmp_path):
    bench = make_bench(3, "rotor")
    write_bench(bench, tmp_path, short=True, roles=("orbit",))
    dataset = Dataset.load(tmp_path)
    assert len(dataset.records) == 3
    record = dataset.records[1]
    response, turning = record.response(), record.turning()
    assert response.displacement.shape == (2, record.size)
    assert turning.mean_speed == pytest.approx(record.spin.speed, rel=1e-3)
    assert tomllib.loads((tmp_path / "truth.toml").read_text("utf-8"))["bushings"][0]["gap"] == bench.holes[0].gap


def test_channels_of_a_shaken_shaft():
    bench = make_bench(4, "steering")
    plan = next(p for p in plans(bench, short=True) if p.name == "hammer_y")
    shorter = dataclasses.replace(plan.excitation, value=plan.excitation.value[:1024])
    plan = dataclasses.replace(plan, excitation=shorter, size=1024)
    assert isinstance(plan, Plan)
    channels = measure_channels(bench, plan, np.random.default_rng(1))
    labels = [f"{c.node}:{c.direction}" for c in channels]
    assert labels == ["200:+Y", *bench.rig.sensor_labels, *bench.rig.probe_labels, "400:S"]
    assert all(np.isfinite(c.value).all() for c in channels)


def test_an_unknown_bench_is_refused(capsys, tmp_path):
    assert script.run(main, None, ["lathe-1", "--out", str(tmp_path / "lathe")]) == 2
    assert "steering" in capsys.readouterr().err
