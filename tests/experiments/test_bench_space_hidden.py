"""Structures of the benches in space that no rig file draws, against closed forms of few degrees of freedom."""

import dataclasses

import numpy as np
import pytest

from clearance_mj import ClearanceError
from clearance_mj.rig import Spin
from experiments.benches.space.bench import ProbePair, Station, make_bench
from experiments.benches.space.hidden import CLASSES, Bend, Coupling, Spring, Structure
from experiments.benches.space.holes import Hole
from experiments.benches.space.make import find_bench, main
from experiments.benches.space.records import FS, simulate
from experiments.benches.space.rigs import KINDS
from experiments.benches.space.shaft import Disc, Rotor, Support
from experiments.benches.structure import Oscillator
from experiments.script import run

from ..refusals import assert_refused

SUPPORTS, MASS, RATIO = 1e5, 1.5, 0.02
HELD = tuple(Support(x, SUPPORTS / 2) for x in (0.0, 1.0))
BLOCK = Rotor(1.0, 0.05, 2e13, 500.0, (Disc(0.5, MASS),), HELD, (RATIO,))
"""A hundred times as stiff as steel, so that it moves as a whole on its supports: it bends by 3e-4 of their motion."""
GREASE = (2e4, 20.0)  # N/m, N s/m
HOUSING = Oscillator(0.15, 100.0, 0.03)
EXTRA, SPRING = Disc(0.5, 0.3), Spring(0.5, 3e4, 15.0)
GRAVITY = 9.81
PARTS = {"housing": "housings", "mass": "masses", "spring": "springs", "bend": "bends", "coupling": "couplings",
         "creep": "creep", "whirl": "friction"}  # fmt: skip
PINS = tuple(Support(x, np.inf) for x in (0.0, 1.0))
JEFFCOTT = Rotor(1.0, 0.01, 2e11, 20.0, (Disc(0.5, 2.0),), PINS, (0.05,))  # almost without mass of its own
SECONDS, DECAY, LINES = 1.0, 10.0, slice(5, 220)  # 1/s, of a window at whose end little is left; Hz


def block(structure):
    """Return a bench whose shaft is the block, in grease within a gap that it never crosses."""
    numbers = 0.5, 0.02, 1.0, 0.0, 0.0, 0.0, 0.0, 0.025, (1.0, 0.0, 0.0, 0.0), 0.0, 1.0
    hole = Hole(*numbers, GREASE[0], squeeze=(GREASE[1], 1e6))
    return dataclasses.replace(
        make_bench(1, "rotor", ()), rotor=BLOCK, holes=(hole,), stations=(Station(0.5, (1.0, 1.0), (0.0, 0.0)),),
        probes=(ProbePair(0.5, 0.0, (1.0, 1.0), ()),), unbalances=(), structure=structure,
    )  # fmt: skip


def spectra(signals):
    """Values at complex frequencies, at which a record that ends counts as it should."""
    time = np.arange(signals.shape[-1]) / FS
    return np.fft.rfft(signals * np.exp(-DECAY * time))[..., LINES]


@pytest.mark.parametrize("structure", [
    Structure(), Structure(housings=(HOUSING,)), Structure(masses=(EXTRA,)), Structure(springs=(SPRING,)),
    Structure((HOUSING,), (EXTRA,), (SPRING,)),
])  # fmt: skip
def test_a_block_in_grease_has_the_transfer_functions_of_block_and_housing(structure):
    """M ẍ + C ẋ + K x = f of x = (block, housing) relative to the base, with the rest under gravity K⁻¹ M g."""
    mass = MASS + BLOCK.mass_per_length + (EXTRA.mass if structure.masses else 0.0)
    spring, dashpot = (SPRING.stiffness, SPRING.damping) if structure.springs else (0.0, 0.0)
    modal = 2 * RATIO * np.sqrt((SUPPORTS + spring) * mass)
    m, between = np.diag([mass, HOUSING.mass]), np.array([[1.0, -1.0], [-1.0, 1.0]])
    k = np.diag([SUPPORTS + spring, HOUSING.stiffness if structure.housings else 1e15]) + GREASE[0] * between
    c = np.diag([modal + dashpot, HOUSING.damping]) + GREASE[1] * between

    time = np.arange(round(SECONDS * FS)) / FS
    pulse = np.exp(-(((time - 0.05) / 2e-3) ** 2))
    nothing = np.zeros_like(pulse)
    moved = simulate(block(structure), np.array([pulse, nothing]), np.array([nothing, pulse]))
    rest = np.linalg.solve(k, -GRAVITY * m.sum(axis=1))
    np.testing.assert_allclose(moved.rest[0], [0.0, rest[0] - rest[1]], rtol=1e-3, atol=1e-12)

    s = DECAY + 2j * np.pi * np.fft.rfftfreq(time.size, 1 / FS)[LINES]
    inverse = np.linalg.inv(m * s[:, None, None] ** 2 + c * s[:, None, None] + k)
    shaken, hit = -(inverse @ m.sum(axis=1)).T, inverse[:, :, 0].T
    along_y, along_z = spectra(moved.displacement[0]) / spectra(pulse)
    for computed, expected in (
        (along_y, shaken[0] - shaken[1]),
        (along_z, hit[0] - hit[1]),
        (spectra(moved.acceleration[0, 0]) / spectra(pulse), 1 + s**2 * shaken[0]),
        (spectra(moved.acceleration[0, 1]) / spectra(pulse), s**2 * hit[0]),
    ):
        assert np.linalg.norm(computed - expected) < 3e-3 * np.linalg.norm(expected)


@pytest.mark.parametrize("kind", KINDS)
def test_a_housing_that_does_not_give_changes_nothing(kind):
    """Of 6e10 N/m it gives by 2e-5 of what a contact of 1e6 N/m does; motion may grow that fifty times."""
    bench, base = make_bench(3, kind), 5.0 * np.random.default_rng(1).standard_normal((2, 256))
    stiff = Structure(housings=tuple(Oscillator(0.15, 1e5, 0.05) for _ in bench.holes))
    benches = bench, dataclasses.replace(bench, structure=stiff)
    without, simulated = (simulate(each, base, spin=Spin(0.3 * bench.top_speed)) for each in benches)
    for name in ("acceleration", "displacement", "rest"):
        expected = getattr(without, name)
        np.testing.assert_allclose(getattr(simulated, name), expected, atol=1e-3 * np.abs(expected).max(), rtol=0)


def test_frequencies_of_a_pinned_shaft_with_a_mass_and_a_spring():
    """Of (K + k φφᵀ) q = ω² (1 + m φφᵀ) q in the closed modes φ of a pinned beam, of which 200 are enough for 1e-3."""
    pinned = Rotor(1.0, 0.005, 2e11, 7800.0, (), PINS, (0.0,))  # hardly shears
    place, mass, stiffness = 0.37, 0.015, 60.0
    n = np.arange(1, 201)
    shape = np.sqrt(2 / pinned.mass_per_length) * np.sin(n * np.pi * place)
    pinned_square = (n * np.pi) ** 4 * pinned.bending_stiffness / pinned.mass_per_length
    for structure, m, k in (
        (Structure(masses=(Disc(place, mass),)), mass, 0.0),
        (Structure(springs=(Spring(place, stiffness, 0.0),)), 0.0, stiffness),
    ):
        at_place = np.outer(shape, shape)
        dynamic = np.linalg.solve(np.eye(n.size) + m * at_place, np.diag(pinned_square) + k * at_place)
        exact = np.sqrt(np.sort(np.linalg.eigvals(dynamic).real)[:3]) / (2 * np.pi)
        np.testing.assert_allclose(structure.shaft(pinned).frequencies(3), exact, rtol=1e-3)


def turned(structure, ratio, times):
    """Amplitudes (forward, backward) of y + i z of a turning Jeffcott rotor's disc at a multiple of its turns."""
    plain, empty = make_bench(1, "rotor", ()), dict.fromkeys(("holes", "stations", "unbalances"), ())
    parts = empty | {"rotor": JEFFCOTT, "probes": (ProbePair(0.5, 0.0, (1.0, 1.0), ()),), "structure": structure}
    bench = dataclasses.replace(plain, rig=plain.rig.replace(gravity=None), **parts)
    speed = ratio * JEFFCOTT.modes().omega[0]
    ((y, z),) = simulate(bench, spin=Spin(speed), size=round(3 * FS)).displacement
    time = np.arange(y.size) / FS
    late, waves = time > 1.5, np.exp(1j * times * speed * np.outer(time, (1, -1)))
    return np.linalg.lstsq(waves[late], (y + 1j * z)[late], rcond=None)[0]


@pytest.mark.parametrize("ratio", [0.3, 0.8, 1.6])
def test_a_bent_jeffcott_rotor(ratio):
    """b/(1 - r² + 2iζr) (Nicholas, Gunter & Allaire, J. Eng. Power 98, 1976), a bow of any shape by its size there."""
    bend = Bend(0.5, 0.2, 2e-5, 0.7)
    known = 2e-5 * np.exp(0.7j) / (1 - ratio**2 + 2j * 0.05 * ratio)
    forward, backward = turned(Structure(bends=(bend,)), ratio, 1)
    assert abs(forward - known) < 0.01 * abs(known) and abs(backward) < 0.01 * abs(known)


@pytest.mark.parametrize("ratio", [0.2, 0.45, 0.9])
def test_a_coupling_on_a_jeffcott_rotor(ratio):
    """A moment M on the end bends the middle by M L²/(16 E I); it turns with ±2 Ω."""
    moments = 0.02 * np.exp(0.4j), 0.005 * np.exp(-1j)
    still = 1 / (16 * JEFFCOTT.bending_stiffness)
    known = [m * still / (1 - 4 * ratio**2 + way * 4j * 0.05 * ratio) for m, way in zip(moments, (1, -1))]
    np.testing.assert_allclose(turned(Structure(couplings=(Coupling(*moments),)), ratio, 2), known, rtol=0.01)


def test_a_speed_creeps_where_it_is_said_to_be_steady():
    creeping = Structure(creep=-0.016).spin(Spin(100.0), 20.0)
    assert creeping.speed_at(np.array([0.0, 10.0, 20.0])) == pytest.approx([100.8, 100.0, 99.2])
    ramp = Spin(10.0, 5.0, 100.0)
    assert Structure(creep=-0.016).spin(ramp, 20.0) is ramp


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["mass", "spring"])
def test_drawn_masses_and_springs_are_seen(kind, name):
    """Rayleigh's quotient of the drawn shaft's first mode is an upper bound, and near."""
    plain, structured = make_bench(2, kind), make_bench(2, kind, structure=[name])
    modes = plain.rotor.modes()
    mass = sum(m.mass * modes.at([m.position])[0, 0] ** 2 for m in structured.structure.masses)
    spring = sum(s.stiffness * modes.at([s.position])[0, 0] ** 2 for s in structured.structure.springs)
    first = modes.omega[0] ** 2
    quotient, square = (first + spring) / (1 + mass), structured.scheme(1e-4).square[0]
    assert 0.98 * quotient < square < quotient * (1 + 1e-9) and abs(square / first - 1) > 0.01


@pytest.mark.parametrize("name", CLASSES)
@pytest.mark.parametrize("kind", KINDS)
def test_all_else_is_drawn_as_without_a_structure(kind, name):
    plain, structured = make_bench(3, kind), find_bench(f"{kind}-3-{name}")
    assert dataclasses.replace(structured, structure=Structure(), name=plain.name) == plain
    assert "structure" not in plain.truth()
    [(part, hidden)] = structured.truth()["structure"].items()
    assert part == PARTS[name]
    if isinstance(hidden, list):
        assert len(hidden) == (len(plain.holes) if name == "housing" else 1)
    assert structured.structure == make_bench(3, kind, (), structure=[name]).structure != make_bench(4, kind).structure


def test_draws_without_a_structure_are_those_of_old():
    """Numbers of the benches before structures could be hidden."""
    old = {
        "steering": (0.00042, 0.00017328400160175088, 218016672859.11578, 0.11831084155204781),
        "rotor": (0.00020070214413877744, 9.459799086805048e-05, 213749892108.1307, 0.1987376442412679),
        "pump": (0.00015619885457005437, 7.25705144194534e-06, 213182845771.72983, 0.14821745250735383),
    }
    for kind, numbers in old.items():
        bench = make_bench(3, kind)
        hole = bench.holes[0]
        drawn = hole.gap, hole.offset_z, bench.rotor.young_modulus, bench.stations[0].position
        assert drawn == pytest.approx(numbers, rel=1e-12)


def test_names_of_structures(capsys, tmp_path):
    assert find_bench("pump-4-housing-mass").structure.masses == find_bench("pump-4-mass").structure.masses
    for name in ("rotor-2-lid", "rotor-2-", "rotor-x-mass", "rotor"):
        assert run(main, None, [name, "--out", str(tmp_path)]) == 2 and "housing" in capsys.readouterr().err
    assert_refused(ClearanceError, "lid", make_bench, 2, "rotor", structure=["lid"])
