"""Files of matrices that are damaged or of other programs, and matrices that are refused."""

import re

import numpy as np
import pytest
import scipy.io
import scipy.linalg
import scipy.sparse

import clearance_mj as cm
from clearance_mj import RigError, Shaker
from clearance_mj.structure import Matrices

from ..refusals import assert_refused
from .small_matrices import MASS_2, STIFFNESS_2, cantilever, frequencies, held, small

# What is refused


def refused(**changes):
    return assert_refused(RigError, None, small, **changes)


MECHANISM, ONE = ((1.0, -1.0), (-1.0, 1.0)), ((1.0, 0.0), (0.0, 0.0))
NOT_SYMMETRIC = "mass is not symmetric: 0.9 between 1:X and 2:X (row 1, column 2), 1 between 2:X and 1:X"


REFUSED = {
    "units is missing; write \"m-kg-s\" for matrices in m, kg, N, \"mm-t-s\"": {"units": None},
    'units "mm" is unknown; use m-kg-s': {"units": "mm"},
    "mass of 2:X is 0 (row 2); needs > 0": {"mass": ((1.0, 0.0), (0.0, 0.0))},
    "mass of 1:X is -1 (row 1)": {"mass": ((-1.0, 0.0), (0.0, 1.0))},
    "mass is not positive definite: some motion of": {"mass": ((1.0, 2.0), (2.0, 1.0))},
    "mass of 2:RX and its stiffness are 0 (row 2)": {"mass": ONE, "stiffness": ONE, "dofs": ("1:X", "2:RX")},
    NOT_SYMMETRIC: {"mass": ((3.0, 0.9), (1.0, 2.0))},
    "stiffness of 1:X is -300 (row 1)": {"stiffness": ((-300.0, -100.0), (-100.0, 100.0))},
    "stiffness is negative in some motion of": {"stiffness": ((1.0, -100.0), (-100.0, 1.0))},
    "stiffness is 3 x 3, but there are 2 degrees of freedom in dofs": {"stiffness": np.eye(3)},
    "mass must be square, got 1 x 2": {"mass": ((1.0, 0.0),)},
    "mass the number in row 2, column 2 is not finite": {"mass": ((1.0, 0.0), (0.0, float("nan")))},
    "stiffness is complex": {"stiffness": np.array(STIFFNESS_2) * (1 + 0.02j)},
    "mass must be the name of a file, or rows of numbers": {"mass": 7},
    "dofs row 2: 1:X stands in row 1 already": {"dofs": ("1:X", "1:UX")},
    "dofs row 1: 'tip' is no degree of freedom": {"dofs": ("tip", "1:X")},
    "dofs is missing; give a CSV table": {"dofs": None},
    "stiffness is missing": {"stiffness": None},
    "stiffness must have as many numbers in every row": {"stiffness": [[1.0, 0.0], [1.0]]},
    "give either file, or mass and stiffness": {"mass": None},
    "mass nowhere.mtx: there is no such file": {"mass": "nowhere.mtx"},
    'fixed[0] "3:X" is no degree of freedom of the structure; the nearest nodes are 1 and 2': {"fixed": ("3:X",)},
    'fixed[0] "1:Y" is no degree of freedom of the structure; node 1 has X': {"fixed": ("1:Y",)},
    "fixed holds every degree of freedom": {"fixed": ("1", "2")},
}  # fmt: skip


@pytest.mark.parametrize("message", REFUSED)
def test_impossible_matrices_are_refused_in_one_line(message):
    assert message in refused(**REFUSED[message])


@pytest.mark.parametrize("position, message", [
    ("12:Z", r'sensors\[0\].position "12:Z" is no degree of freedom of the structure; the nearest nodes are 8 and 9'),
    ("9:X", r'sensors\[0\].position "9:X" is no degree of freedom of the structure; node 9 has Z, RY'),
    ("1:Z", r'sensors\[0\].position "1:Z" is fixed to the base'),
    (0.5, r'sensors\[0\].position "0.5" is no degree of freedom, a text such as "1:Z"'),
])  # fmt: skip
def test_points_that_do_not_exist_are_refused(position, message):
    assert_refused(RigError, message, held, cantilever(), (position,))


def test_mechanism_has_modes_but_no_static_deflection():
    model = cm.linear_model(held(small(stiffness=MECHANISM), ("1:X",), shaker=Shaker("force", "1:X")))
    np.testing.assert_allclose(model.omega, [0.0, np.sqrt(1.5)], atol=1e-12)
    words = "can move without bending, so it has no static deflection; add a support"
    assert_refused(RigError, words, model.static_deflection, ["1:X"], model.shapes(["1:X"]))


MARKET = b"%%MatrixMarket matrix "


def damaged(folder, name, content):
    path = folder / name
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("name, content, message", [
    ("M.mtx", b"%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1.0\n", "not a Matrix Market file"),
    ("M.mtx", b"hello", "not a Matrix Market file"),
    ("M.mtx", MARKET + b"coordinate pattern general\n2 2 2\n1 1\n2 2\n", "not a Matrix Market file that can be used"),
    ("M.mtx", MARKET + b"array real general\n99999999 99999999\n1\n", "not a Matrix Market file that can be used (9"),
    ("M.mtx", MARKET + b"array real general\n3 3\n0\n0\n1d5#", "not a Matrix Market file that can be used (it holds"),
    ("M.mtx", MARKET + b"coordinate real symmetric\n3 3 5\n1 1 6E", "not a Matrix Market file that can be used"),
    ("M.npz", b"PK\x03\x04 no archive", "not a whole .npz file"),
    ("M.mat", b"MATLAB 5.0 MAT-file" + b" " * 200, "not a whole MATLAB file"),
    ("M.xls", b"x", "matrices are read from .npz, .mat, .mtx, .npy files"),
])  # fmt: skip
def test_damaged_files_are_refused(tmp_path, name, content, message):
    assert re.search(rf"mass.*{re.escape(name)}: {re.escape(message)}", refused(mass=damaged(tmp_path, name, content)))


@pytest.mark.parametrize("part, value, message", [
    ("indices", [0, 7], "can be used"),
    ("indptr", [0, 2, 0], "indptr must not fall"),
    ("shape", [2, 2**31 - 1], "at most 1000000 rows"),
    ("shape", [1j, 2], "do not fit"),
    ("data", [1.0], "do not fit"),
])  # fmt: skip
def test_damaged_sparse_matrices_are_refused(tmp_path, part, value, message):
    """Compiled functions would follow them anywhere."""
    mass = {"data": [2.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2], "shape": [2, 2]} | {part: value}
    parts = {f"M_{name}": value for name, value in mass.items()}
    np.savez(tmp_path / "a.npz", K=STIFFNESS_2, dofs=["1:X", "2:X"], **parts)
    assert_refused(RigError, rf"a.npz.*{message}", Matrices, file=tmp_path / "a.npz", units="m-kg-s")


@pytest.mark.parametrize("dofs", [["1:X", "2:X"], np.array(["1:X", "2:X"], dtype=object), [[1.0, 1.0], [2.0, 1.0]]])
@pytest.mark.parametrize("packed", [False, True])
def test_matlab_files_of_scipy(tmp_path, dofs, packed):
    """Sparse mass, full stiffness; degrees of freedom as rows of characters, cells, numbers."""
    held = {"M": scipy.sparse.csc_array(np.array(MASS_2)), "K": np.array(STIFFNESS_2), "dofs": dofs}
    scipy.io.savemat(tmp_path / "a.mat", held, do_compression=packed)
    matrices = Matrices(file=tmp_path / "a.mat", units="m-kg-s")
    np.testing.assert_allclose(frequencies(matrices, 2, "1:X"), frequencies(small(), 2, "1:X"), rtol=1e-14)


@pytest.mark.parametrize("table, message", [
    (b"node,direction\n", "d.csv: dofs is empty"),
    (b"node,direction,x,y,z\n\n", "d.csv: dofs is empty"),
    (b"node,direction\n1,X\n2,\xe4\n", "d.csv: dofs row 2: '2:\xe4' is no degree of freedom"),
    (b"node,direction\n1,X\0\n", "d.csv: not a text file"),
])  # fmt: skip
def test_damaged_tables_name_the_file(tmp_path, table, message):
    assert message in refused(dofs=damaged(tmp_path, "d.csv", table))


def test_file_without_a_matrix_names_what_it_holds(tmp_path):
    for arrays, words in (
        ({"dofs": ["1:X", "2:X"]}, r"file .*a.npz: holds no stiffness matrix \(stiffness or K\); it holds M, dofs"),
        ({"K": np.eye(2)}, r"dofs is missing, and .*a.npz holds none"),
    ):
        np.savez(tmp_path / "a.npz", M=np.eye(2), **arrays)
        assert_refused(RigError, words, Matrices, file=tmp_path / "a.npz", units="m-kg-s")
