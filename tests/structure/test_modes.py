"""Structures given by modes, against the closed form of the cantilever and modes written by pyuff."""

import dataclasses
import re

import numpy as np
import pytest
import pyuff

from clearance_mj import ConstantLaw, ExcitationError, Modal, RigError, linear_model, simulate
from clearance_mj.beam import linear_frf
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker
from clearance_mj.signals.excitation import random
from clearance_mj.structure import ModalStructure
from clearance_mj.structure.beam import cantilever_mode, cantilever_roots, static_deflection
from clearance_mj.structure.mode_files import ModesWarning, phase_collinearity

from ..conftest import TABLE1
from ..refusals import assert_refused
from ..verification.modal_mj import ModalMujoco

X = (0.3, 0.5484, 0.7918, 1.0)
DOFS = ("1:+Z", "2:+Z", "3:-Z", "4:+Z")
SIGNS = np.array([1.0, 1.0, -1.0, 1.0])
BEAM = TABLE1.beam
MASS = BEAM.mass_per_length * BEAM.length


def cantilever(n=6, **changes):
    """Closed-form modes of the bare cantilever at four positions, one of them measured upside down."""
    shapes = SIGNS[:, None] * cantilever_mode(X, n, BEAM.length) / np.sqrt(MASS)
    root = cantilever_roots(n)
    omega = root**2 * np.sqrt(BEAM.bending_stiffness / BEAM.mass_per_length) / BEAM.length**2
    sigma = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
    participation = np.sqrt(MASS) * 2 * sigma / root  # ∫Y dx / l = 2 σ / λ
    fields = {
        "frequencies": tuple(omega / (2 * np.pi)), "damping_ratios": (0.01,), "dofs": DOFS,
        "shapes": tuple(map(tuple, shapes)), "participation": tuple((0.0, 0.0, g) for g in participation),
    }  # fmt: skip
    return ModalStructure(**fields | changes)


def residual(structure):
    """What the modes leave of the closed-form static deflection, m/N."""
    known = SIGNS[:, None] * static_deflection(BEAM, X, X) * SIGNS
    return tuple(map(tuple, known - structure.flexibility(DOFS)[0]))


def rig_of(structure, **changes):
    """A rig with one clearance."""
    bushing = Bushing("3:+Z", 3e-4, 0.0, Grease(0.0), Contact(7.8e3, 4.0))
    sensors = (Sensor(1, "1:+Z"), Sensor(8, "4:+Z"))
    rig = Rig("modes", None, (bushing,), sensors, shaker=Shaker("force", "2:+Z"), structure=structure)
    return dataclasses.replace(rig, **changes)


def test_residual_flexibility_makes_the_static_deflection_exact():
    """Unit force at the clearance and at the shaker, of opposite signs in the file: Roark, table 8.1, case 1a."""
    with_rest = cantilever(2, residual_flexibility=residual(cantilever(2)))
    points = ["1:+Z", "2:+Z", "3:+Z", "4:+Z"]
    error = []
    for structure in (with_rest, cantilever(2)):
        model = linear_model(rig_of(structure))
        got = model.static_deflection(points, np.vstack((model.at_bushings, model.input("force"))))
        error.append(np.abs(got / static_deflection(BEAM, X, (X[2], X[1])) - 1).max())
    assert error[0] < 1e-9 and error[1] > 1e-2  # without it, two modes are too stiff


def test_residual_flexibility_known_under_some_loads():
    """From the columns of a test's references alone; between other points it is the least that agrees with them."""
    rest = np.array(residual(cantilever(2)))
    part = cantilever(2, residual_flexibility=tuple(map(tuple, rest[:, 1:3])), residual_dofs=DOFS[1:3])
    got = part.flexibility(DOFS)[1]
    np.testing.assert_allclose(got[:, 1:3], rest[:, 1:3], rtol=1e-6, atol=1e-9 * rest.max())
    assert np.all(got.diagonal() <= rest.diagonal() * (1 + 1e-9))


def test_modes_of_high_frequency_cost_no_more_than_a_third_of_the_step():
    structure = cantilever(residual_flexibility=residual(cantilever()))
    model = linear_model(rig_of(structure))
    assert model.size == 6 + 2  # one for the clearance, one for the shaker
    assert model.omega[-1] == pytest.approx(3 * structure.omega[-1])


def test_frf_in_the_gap_is_that_of_the_shaft():
    """Ten modes and the residual flexibility against the closed-form shaft with its own, 1 to 200 Hz."""
    eta, omega = BEAM.rayleigh, cantilever(10).omega
    ratios = tuple((eta[0] / omega + eta[1] * omega) / 2)
    structure = cantilever(10, damping_ratios=ratios, residual_flexibility=residual(cantilever(10)))
    modes, positions = rig_of(structure), {f"{i + 1}:+Z": x for i, x in enumerate(X)}
    shaft = TABLE1.replace(
        masses=(), bushings=(dataclasses.replace(modes.bushings[0], position=X[2]),),
        sensors=tuple(Sensor(s.node, positions[s.position]) for s in modes.sensors), shaker=Shaker("force", X[1]),
    )  # fmt: skip
    for kind in ("force", "base"):
        driven = [r.replace(shaker=dataclasses.replace(r.shaker, kind=kind)) for r in (modes, shaft)]
        magnitude, expected = (np.abs(linear_frf(r, np.linspace(1.0, 200.0, 400))) for r in driven)
        assert np.sqrt(np.mean((20 * np.log10(magnitude / expected)) ** 2)) < 0.05


def test_participation_of_lumped_masses():
    """Γ = Φᵀ M r; two masses on springs, by hand."""
    structure = ModalStructure((1.0, 2.0), (), ("1:+X", "2:-Z"), ((0.6, 0.8), (-0.8, 0.6)), dof_masses=(1.0, 1.0))
    influence = structure.assemble(("1:+X",), 2).influence
    np.testing.assert_allclose(influence, [[0.6, 0.0, 0.8], [0.8, 0.0, -0.6]], atol=1e-15)


def test_shaken_base_without_participation():
    rig = rig_of(cantilever(participation=None), shaker=Shaker())
    case = rig, random(0.1, 2048.0, (5, 200), 1.0), ConstantLaw(1e4, 1.0), "modal"
    assert_refused(ExcitationError, r"participation of the modes is not known.*dof_masses", simulate, *case)
    assert_refused(RigError, "participation", linear_frf, rig, [10.0])


def test_engines_run_and_files_keep_it(tmp_path):
    """A rig that was saved and loaded gives the same response; modes in MuJoCo agree."""
    rig = rig_of(cantilever(residual_flexibility=residual(cantilever())))
    rig.save(tmp_path / "rig.toml")
    again = Rig.load(tmp_path / "rig.toml")
    assert again == rig and hash(again.structure) == hash(rig.structure)
    force, law = random(0.15, 2048.0, (5, 200), 4.0, kind="force"), ConstantLaw(7.8e3, 4.0)
    fine = Modal(resolution=0.1)
    runs = ((rig, fine), (again, fine), (rig, ModalMujoco(safety=0.1)))
    first, second, mujoco = (simulate(r, force, law, engine) for r, engine in runs)
    np.testing.assert_array_equal(first.acceleration, second.acceleration)
    assert np.abs(first.contact_force).max() > 0.1
    assert np.sqrt(np.mean((mujoco.displacement - first.displacement) ** 2)) / first.displacement.std() < 0.01


# Files


MASSES = np.array([0.2, 1.0, 3.0, 0.5, 2.0, 0.1])  # Modal masses, kg
NODES, NAMES = np.arange(1, 5), dict.fromkeys(("id1", "id2", "id3", "id4", "id5"), "NONE")
SET_55 = NAMES | {"type": 55, "model_type": 1, "data_ch": 2, "spec_data_type": 8, "n_data_per_node": 3, "load_case": 1}
SET_55["node_nums"] = NODES


def normal_modes(structure, kind, kilogram=1.0):
    """Normal modes as dictionaries of pyuff: shapes that belong to modal masses, in a unit of so many kg."""
    masses = MASSES[: len(structure.frequencies)]
    shapes = SIGNS[:, None] * structure.unit_shapes * np.sqrt(masses)
    for i, (frequency, mass) in enumerate(zip(structure.frequencies, masses / kilogram)):
        along = np.column_stack((np.zeros((4, 2)), shapes[:, i]))
        if kind == 55:
            yield SET_55 | {
                "analysis_type": 2, "data_type": 2, "mode_n": i + 1, "freq": frequency, "modal_m": mass,
                "modal_damp_vis": 0.01, "modal_damp_his": 0.0, "r1": along[:, 0], "r2": along[:, 1], "r3": along[:, 2],
            }  # fmt: skip
        else:
            yield NAMES | {
                "type": 2414, "analysis_dataset_label": i + 1, "analysis_dataset_name": "mode", "dataset_location": 1,
                "model_type": 1, "analysis_type": 2, "data_characteristic": 2, "result_type": 8, "data_type": 2,
                "number_of_data_values_for_the_data_component": 3, "record12_field2": frequency,
                "record12_field4": mass, "record12_field5": 0.01, "node_nums": NODES, "data_at_node": along,
            }  # fmt: skip


def units(length=1.0, force=1.0):
    return pyuff.prepare_164(1, "units", 1, length, force, 1.0, 273.15)


def write(path, sets):
    pyuff.UFF(str(path)).write_sets(list(sets), "overwrite")
    return path


@pytest.mark.parametrize("kind", [55, 2414])
def test_modes_with_modal_masses(tmp_path, kind):
    """Written by pyuff in mm and N, whose unit of mass is 1000 kg."""
    expected = cantilever()
    got = ModalStructure(file=str(write(tmp_path / "m.uff", [units(1e3, 1.0), *normal_modes(expected, kind, 1e3)])))
    assert got.file is None and got.dofs == tuple(f"{i}:+Z" for i in (1, 2, 3, 4))
    np.testing.assert_allclose(got.frequencies, expected.frequencies, rtol=1e-5)
    np.testing.assert_allclose(got.ratios, 0.01)
    np.testing.assert_allclose(np.abs(got.unit_shapes), np.abs(expected.unit_shapes), rtol=1e-4, atol=1e-6)
    points = ["1:+Z", "2:+Z", "3:+Z", "4:+Z"]
    np.testing.assert_allclose(got.flexibility(points)[0], expected.flexibility(points)[0], rtol=1e-4, atol=1e-12)


def test_complex_modes_with_modal_a(tmp_path):
    """A proportionally damped system: ψ of any phase and size, a = 2 j ω_d ψ²/φ² (Ewins, Modal Testing, 2.8)."""
    expected, rng, omega = cantilever(), np.random.default_rng(1), cantilever().omega
    damped = omega * np.sqrt(1 - 0.01**2)
    factor = rng.uniform(0.1, 10, omega.size) * np.exp(2j * np.pi * rng.random(omega.size))
    sets = [units()]
    for i in range(omega.size):
        r3 = (SIGNS * expected.unit_shapes[:, i]) * factor[i]
        eig, modal_a = complex(-0.01 * omega[i], damped[i]), 2j * damped[i] * factor[i] ** 2
        sets.append(SET_55 | {
            "analysis_type": 3, "data_type": 5, "mode_n": i + 1, "eig": eig, "modal_a": modal_a, "modal_b": 0.0,
            "r1": 0 * r3, "r2": 0 * r3, "r3": r3,
        })  # fmt: skip
    got = ModalStructure(file=str(write(tmp_path / "m.uff", sets)))
    np.testing.assert_allclose(np.abs(got.unit_shapes), np.abs(expected.unit_shapes), rtol=1e-4, atol=1e-5)


def test_modes_far_from_real_and_units_that_are_missing(tmp_path):
    """Phase collinearity of (1, j) is 0, of (1, 1 + j/2) it is |1 + (1 + j/2)²|² / (1 + 5/4)²."""
    shape = np.array([[1.0, 1.0], [1j, 1 + 0.5j]])
    np.testing.assert_allclose(phase_collinearity(shape), [0.0, abs(1 + (1 + 0.5j) ** 2) ** 2 / 2.25**2], atol=1e-15)
    (mode, *_) = normal_modes(cantilever(), 55)
    mode |= {"data_type": 5, "r1": np.zeros(4, complex), "r2": np.zeros(4, complex), "r3": np.array([1, 1j, 1, 1j])}
    path = write(tmp_path / "m.uff", [mode])
    with pytest.warns(ModesWarning) as caught:
        ModalStructure(file=str(path))
    assert [str(w.message).partition(": ")[2][:20] for w in caught] == ["has no units (data s", "real parts stand for"]


def test_csv_file_gives_the_same_structure(tmp_path):
    expected = cantilever(residual_flexibility=tuple(r[2:3] for r in residual(cantilever())), residual_dofs=("3:-Z",))
    expected.write_csv(tmp_path / "modes.csv")
    got = ModalStructure(file=str(tmp_path / "modes.csv"))
    np.testing.assert_array_equal(got.unit_shapes, expected.unit_shapes)
    same = ("frequencies", "dofs", "participation", "residual_flexibility", "residual_dofs")
    assert [getattr(got, name) for name in same] == [getattr(expected, name) for name in same]


def test_file_is_found_beside_the_rig_file(tmp_path):
    cantilever().write_csv(tmp_path / "modes.csv")
    rig = rig_of(cantilever())
    rig.save(tmp_path / "whole.toml")
    text = (tmp_path / "whole.toml").read_text().partition("[structure]")[0]
    (tmp_path / "rig.toml").write_text(text + '[structure]\nkind = "modes"\nfile = "modes.csv"\n')
    reloaded = Rig.load(tmp_path / "rig.toml")
    np.testing.assert_array_equal(reloaded.structure.unit_shapes, rig.structure.unit_shapes)
    reloaded.save(tmp_path / "elsewhere" / "rig.toml")  # with the numbers
    assert Rig.load(tmp_path / "elsewhere" / "rig.toml") == reloaded


# What is refused


def test_modes_without_scaling(tmp_path):
    """Modal masses missing in a file, or every shape's largest component 1: one line that says what would help."""
    unscaled = [mode | {"modal_m": 0.0} for mode in normal_modes(cantilever(), 55)]
    path = str(write(tmp_path / "m.uff", [units(), *unscaled]))
    with pytest.raises(RigError, match=r"m\.uff: modes without scaling; give modal_masses .*modes_from_frf.*mode 1"):
        ModalStructure(file=path)
    given = ModalStructure(file=path, modal_masses=tuple(MASSES))
    np.testing.assert_allclose(np.abs(given.unit_shapes), np.abs(cantilever().unit_shapes), rtol=1e-4, atol=1e-6)
    with pytest.raises(RigError, match=r"shapes have a largest component of 1 .*give modal_masses"):
        ModalStructure((1.0, 2.0), (), ("1:+X", "2:+X"), ((1.0, 1.0), (0.5, -1.0)))


@pytest.mark.parametrize(("changes", "message"), [
    ({"frequencies": (2.0, 1.0)}, r"frequencies\[1\] 1 Hz must not be less than the one before"),
    ({"dofs": ("1:+X", "1:-X")}, "dofs row 2: 1:X stands in row 1 already"),
    ({"dofs": ("1:+X", "tip")}, r'dofs\[1\] must be a degree of freedom such as "12:\+Z", got "tip"'),
    ({"shapes": ((1.0, 1.0),)}, "shapes must hold 2 rows"),
    ({"shapes": ((1.0, 1.0), (0.5,))}, r"shapes\[1\] must hold 2 numbers, got 1"),
    ({"shapes": ((0.5, 0.0), (0.7, 0.0))}, "shapes are zero in mode 2"),
    ({"modal_masses": (1.0,)}, "modal_masses must hold 2, one per frequency"),
    ({"damping_ratios": (0.1, 0.1, 0.1)}, "damping_ratios must hold at most 2"),
    ({"residual_dofs": ("1:+X",)}, "residual_dofs needs residual_flexibility"),
    ({"residual_flexibility": ((1e-6, 0.0), (1e-7, 1e-6))}, "residual_flexibility must be symmetric"),
    ({"residual_flexibility": ((1e-6, 0.0), (0.0, -1e-6))}, "residual_flexibility must not be negative"),
    ({"shapes": ()}, "shapes is missing"),
])  # fmt: skip
def test_impossible_modes(changes, message):
    fields = {"frequencies": (1.0, 2.0), "dofs": ("1:+X", "2:+X"), "shapes": ((1.0, 0.8), (0.5, -0.9))}
    assert_refused(RigError, message, ModalStructure, **fields | changes)


@pytest.mark.parametrize(("point", "said"), [
    ("3:+X", "node 3 has Z"),
    ("7:+Z", "the nearest nodes are 3 and 4"),
    ("tip:+Z", "the nearest nodes are"),
    (0.3, 'a text such as "1:Z"'),
])  # fmt: skip
def test_unknown_degree_of_freedom(point, said):
    words = rf'^shaker\.position "{re.escape(str(point))}".*{said}'
    assert_refused(RigError, words, rig_of, cantilever(), shaker=Shaker("force", point))
