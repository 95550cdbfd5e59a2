"""Structures from matrices: files of every kind and unit, base motion, supports, and every input that is refused."""

import csv
import hashlib
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.linalg
import scipy.sparse

import clearance_mj as cm
from clearance_mj import Bushing, Contact, Grease, PointMass, Rig, RigError, Sensor, Shaker
from clearance_mj.structure import Matrices
from experiments.space_frame import export, pump_frame

from ..refusals import assert_refused
from . import small_matrices
from .small_matrices import MASS_2, MOVES, STIFFNESS_2, cantilever, frequencies, held, hermite, in_millimetres, small

MODELS = Path(__file__).parents[2] / "models"


# Where matrices come from


def files_of(folder, kind, mass, stiffness):
    """Write matrices in a kind of file; return the fields of the structure."""
    dofs = folder / "dofs.csv"
    with dofs.open("w", newline="") as file:
        csv.writer(file).writerows([["node", "direction"], *(name.split(":") for name in MOVES)])
    if kind == "mtx":
        scipy.io.mmwrite(folder / "M.mtx", scipy.sparse.coo_array(mass), symmetry="symmetric")
        scipy.io.mmwrite(folder / "K.mtx", scipy.sparse.coo_array(stiffness), symmetry="general", precision=17)
        return {"mass": folder / "M.mtx", "stiffness": folder / "K.mtx", "dofs": dofs}
    if kind == "lower half":
        scipy.sparse.save_npz(folder / "M.npz", scipy.sparse.csr_array(np.tril(mass)))
        np.save(folder / "K.npy", stiffness)
        return {"mass": folder / "M.npz", "stiffness": folder / "K.npy", "dofs": dofs}
    if kind == "npz":
        sparse = scipy.sparse.csr_array(mass)
        parts = {f"M_{part}": getattr(sparse, part) for part in ("data", "indices", "indptr", "shape")}
        np.savez(folder / "all.npz", K=stiffness, dofs=np.array(MOVES), **parts)
    elif kind == "mat":
        variables = {"M": scipy.sparse.csc_matrix(mass), "K": stiffness, "dofs": np.array(MOVES, dtype=object)}
        scipy.io.savemat(folder / "all.mat", variables)
    elif kind == "mat with numbers":
        numbers = [[int(name.split(":")[0]), 3 if ":Z" in name else 5] for name in MOVES]
        scipy.io.savemat(folder / "all.mat", {"mass": mass, "stiffness": stiffness, "dofs": numbers})
    return {"file": folder / ("all.npz" if kind == "npz" else "all.mat")}


@pytest.mark.parametrize("kind", ["mtx", "lower half", "npz", "mat", "mat with numbers"])
def test_files_of_every_kind_hold_the_same_cantilever(tmp_path, kind):
    structure = Matrices(**files_of(tmp_path, kind, *hermite()), units="m-kg-s", fixed=("1",))
    mass, stiffness = (matrix[2:, 2:] for matrix in hermite())
    exact = np.sqrt(scipy.linalg.eigvalsh(stiffness, mass)) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(structure), exact[:4], rtol=1e-9)


UNITS = [("mm-t-s", 1e3, 1e3), ("mm-kg-ms", 1.0, 1e6), ("mm-kg-s", 1.0, 1.0), ("mm-g-ms", 1e-3, 1e3)]


@pytest.mark.parametrize("units, mass, stiffness", UNITS)
def test_units_of_fe_programs(units, mass, stiffness):
    """1 t/mm² ... of rotary inertia, 1 t mm/s² = 1 N: kg, N/m and rad from each system."""
    m, k = hermite()
    structure = cantilever(mass=in_millimetres(m, mass), stiffness=in_millimetres(k, stiffness), units=units)
    np.testing.assert_allclose(frequencies(structure), frequencies(cantilever()), rtol=1e-10)
    assert structure.total_mass == pytest.approx(small_matrices.LINE_MASS * small_matrices.LENGTH)
    model = cm.linear_model(held(structure, shaker=Shaker("force", "9:Z")))
    compliance = model.static_deflection(["9:Z", "9:RY"], model.shapes(["9:Z"]))[:, 0]
    np.testing.assert_allclose(compliance * small_matrices.BENDING, [1 / 3, 1 / 2], rtol=1e-8)  # l³/3EI and l²/2EI


def test_inches_and_pounds():
    """A 386.09 lbf weight is 1 lbf s²/in, 175.13 kg; 1 lbf/in is 175.13 N/m."""
    structure = small(units="in-lbf-s")
    np.testing.assert_allclose(frequencies(structure, 1, "1:X"), frequencies(small(), 1, "1:X"), rtol=1e-12)
    assert structure.total_mass == pytest.approx(3 * 175.126835, rel=1e-8)


def test_directions_may_be_called_as_programs_call_them():
    names = ["1:UX", "1:2", "1:-Z", "2:ROTX", "2:RY", "2:6"]
    structure = Matrices(mass=np.eye(6), stiffness=np.diag(np.arange(1.0, 7.0)), dofs=names, units="m-kg-s")
    for point in ("1:X", "1:Y", "1:Z", "2:RX", "2:+RY", "2:-RZ"):
        structure.check(point)
    rows = structure.assemble((), 8).rows(["1:X", "1:Z", "2:-RZ"])
    np.testing.assert_array_equal(rows[:, [0, 2, 5]], [[1, 0, 0], [0, 1, 0], [0, 0, -1]])


def test_places_of_nodes(tmp_path):
    (tmp_path / "dofs.csv").write_text("node;direction;x;y;z\n1;X;0;0;0\n7;X;250;0;10\n", encoding="utf-8")
    structure = small(dofs=tmp_path / "dofs.csv", units="mm-t-s")
    np.testing.assert_allclose(structure.coordinates("7:+X"), [0.25, 0.0, 0.01])


# Rig files, copies, other processes


def rig_of(structure):
    bushing = Bushing("9:Z", 1e-4, 0.0, Grease(10.0, 0.1), Contact(1e4, 1.0))
    return Rig("matrices", None, (bushing,), (Sensor(1, "9:+Z"),), (PointMass("5:Z", 0.1),), structure=structure)


@pytest.mark.parametrize("kind", ["mtx", "npz", "memory"])
def test_rig_comes_back_from_its_file_and_its_plain_data(tmp_path, kind):
    if kind == "memory":
        structure = cantilever(damping_ratios=(0.01,))
        assert structure.file not in repr(structure)
    else:
        files = files_of(tmp_path, kind, *hermite())
        structure = Matrices(**files, units="m-kg-s", fixed=("1",), damping_ratios=(0.01,))
    rig = rig_of(structure)
    assert Rig.from_dict(json.loads(json.dumps(rig.to_dict()))) == rig
    assert pickle.loads(pickle.dumps(rig)) == rig
    (tmp_path / "rigs").mkdir()
    rig.save(tmp_path / "rigs" / "rig.toml")
    text = (tmp_path / "rigs" / "rig.toml").read_text(encoding="utf-8")
    assert str(tmp_path) not in text
    read = Rig.load(tmp_path / "rigs" / "rig.toml")
    assert read == rig and hash(read) == hash(rig) and read.content() == rig.content()
    if kind == "memory":
        assert Path(read.structure.file) == tmp_path / "rigs" / "rig_matrices.npz"


def test_arrays_of_lumped_models_stand_in_the_rig_itself(tmp_path):
    rig = held(small(mass=np.array(MASS_2), stiffness=scipy.sparse.csr_array(np.array(STIFFNESS_2))), ("1:X",))
    assert rig.to_dict()["structure"]["mass"] == [[2.0, 0.0], [0.0, 1.0]]
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig == held(small(), ("1:X",))
    assert rig != held(small(mass=((2.0, 0.0), (0.0, 1.1))), ("1:X",))


def test_equal_arrays_make_equal_structures_and_other_ones_do_not():
    _, stiffness = hermite()
    assert cantilever() == cantilever() and hash(cantilever()) == hash(cantilever())
    assert cantilever() != cantilever(stiffness=1.001 * stiffness)
    assert cantilever() != cantilever(fixed=("1", "9:Z"))


def test_a_file_that_changed_is_refused(tmp_path):
    structure = Matrices(**files_of(tmp_path, "npz", *hermite()), units="m-kg-s", fixed=("1",))
    assert structure.sha256 == hashlib.sha256((tmp_path / "all.npz").read_bytes()).hexdigest()
    held(structure).save(tmp_path / "rig.toml")
    mass, stiffness = hermite()
    files_of(tmp_path, "npz", mass, 2 * stiffness)
    changed = r"rig.toml: structure.sha256 is not that of .*all.npz, which changed .*take sha256 out"
    assert_refused(RigError, changed, Rig.load, tmp_path / "rig.toml")
    again = Matrices(file=tmp_path / "all.npz", units="m-kg-s", fixed=("1",))
    np.testing.assert_allclose(frequencies(again), np.sqrt(2) * frequencies(cantilever()), rtol=1e-9)


# Base motion and supports


def test_free_matrices_with_fixed_nodes_are_shaken_as_clamped_ones_in_relative_coordinates():
    """Absolute motion of the free matrices on a prescribed support: M_ff ü_f + K_ff u_f = -M_fs ü_s - K_fs u_s.

    The library solves for u_f - (rigid translation); the two agree at any frequency, coupling of masses included.
    """
    mass, stiffness = hermite()
    rig = held(cantilever(), ("9:Z", "4:Z"))
    frequency = np.array([3.0, 20.0, 61.0])
    model = cm.linear_model(rig, 30)
    relative = model.responses(model.at_sensors, -model.participation[:, None], 2 * np.pi * frequency)[:, :, 0]
    absolute = 1 - (2 * np.pi * frequency[:, None]) ** 2 * relative  # per unit base acceleration
    for f, in_coordinates in zip(frequency, absolute):
        dynamic = stiffness - (2 * np.pi * f) ** 2 * mass
        expected = np.linalg.solve(dynamic[2:, 2:], -dynamic[2:, 0])  # node 1 moves by 1 along Z and does not turn
        np.testing.assert_allclose(in_coordinates, expected[[14, 4]], rtol=1e-8)


def test_base_moves_in_any_direction():
    names = ("1:X", "1:Y", "1:Z", "1:RX")
    mass = np.diag([2.0, 3.0, 4.0, 0.5])
    mass[1, 3] = mass[3, 1] = 0.3
    influence = Matrices(mass=mass, stiffness=np.eye(4), dofs=names, units="m-kg-s").assemble((), 4).influence
    np.testing.assert_array_equal(influence, [[2, 0, 0], [0, 3, 0], [0, 0, 4], [0, 0.3, 0]])


def test_massless_rotations_follow_statically():
    """Lumped masses, as many programs write them, against the exact condensation of the rotations (Guyan)."""
    mass, stiffness = hermite(24)
    lumped = np.diag(np.where(np.arange(len(mass)) % 2, 0.0, mass[::2, ::2].sum(axis=1).repeat(2)))
    names = [f"{node}:{axis}" for node in range(1, 26) for axis in ("Z", "RY")]
    structure = Matrices(mass=lumped, stiffness=stiffness, dofs=names, units="m-kg-s", fixed=("1",))
    z, r = np.arange(2, 50, 2), np.arange(3, 50, 2)
    zz, zr, rz, rr = (stiffness[np.ix_(i, j)] for i in (z, r) for j in (z, r))
    omega2 = scipy.linalg.eigvalsh(zz - zr @ np.linalg.solve(rr, rz), lumped[np.ix_(z, z)])
    np.testing.assert_allclose(frequencies(structure, 6), np.sqrt(omega2[:6]) / (2 * np.pi), rtol=1e-9)


def test_damping_matrix_ratios_and_rayleigh_add_up():
    """Modes of the two masses on springs: K has the same eigenvectors as M⁻¹K, so C = 0.1 M + 0.01 K stays modal."""
    viscous = 0.1 * np.array(MASS_2) + 0.01 * np.array(STIFFNESS_2)
    rig = held(small(damping=viscous, rayleigh=(0.2, 0.0), damping_ratios=(0.02, 0.03)), ("1:X",))
    model = cm.linear_model(rig)
    np.testing.assert_allclose(model.damping, 0.3 + 0.01 * model.omega**2 + 2 * np.array([0.02, 0.03]) * model.omega)
    assert not model.coupling.size


def test_free_frame_in_twelve_digits():
    """Rounding in the files makes some rigid motions a little negative; scipy's eigenvalues are those of the file."""
    folder = MODELS / "pump_frame"
    free = Matrices(mass=folder / "M.mtx", stiffness=folder / "K.mtx", dofs=folder / "dofs.csv", units="mm-t-s")
    mass, stiffness = (scipy.io.mmread(folder / name).toarray() for name in ("M.mtx", "K.mtx"))
    squares = scipy.linalg.eigvalsh(stiffness, mass)
    assert squares[0] < 0
    hz = frequencies(free, 10, "18:Z")
    assert np.all(hz[:6] < 0.01)
    np.testing.assert_allclose(hz[6:], np.sqrt(squares[6:10]) / (2 * np.pi), rtol=1e-6)


def test_the_shipped_frame_is_what_its_script_writes(tmp_path):
    frame, _ = pump_frame()
    export(frame, tmp_path / "pump_frame")
    for name in ("M.mtx", "K.mtx", "dofs.csv"):
        shipped = (MODELS / "pump_frame" / name).read_text(encoding="utf-8")
        assert (tmp_path / "pump_frame" / name).read_text(encoding="utf-8") == shipped
    rig = Rig.load(MODELS / "pump_frame.toml")
    keep = slice(24, None)  # the feet are nodes 1 to 4
    mass, stiffness = (matrix.toarray()[keep, keep] for matrix in frame.matrices())
    expected = np.sqrt(scipy.linalg.eigvalsh(stiffness, mass)[:6]) / (2 * np.pi)
    np.testing.assert_allclose(cm.beam.natural_frequencies(rig, 6), expected, rtol=1e-6)
