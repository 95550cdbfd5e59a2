"""Mass, stiffness and damping matrices out of Matrix Market, NumPy and MATLAB files."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TypeAlias

import numpy as np
import scipy.io
import scipy.sparse

from .dofs import Dofs, dof_table
from .files import is_embedded, opened

__all__ = ["Found", "Matrix", "as_matrix", "read_matrix", "read_model", "write_model"]

Matrix: TypeAlias = np.ndarray | scipy.sparse.csr_array
"""Dense or sparse"""

NAMES = {"mass": ("mass", "M"), "stiffness": ("stiffness", "K"), "damping": ("damping", "C", "D")}
"""Variables in which a file holds each matrix"""
SUFFIXES = (".npz", ".mat", ".mtx", ".npy")


class Found(NamedTuple):
    """What one file holds."""

    matrices: dict[str, Matrix]
    """by what they are: mass, stiffness, damping"""
    dofs: Dofs | None


def read_model(name: str) -> Found:
    """Read M, K, C (or mass, stiffness, damping) and the degrees of freedom from a .npz or .mat file.

    The degrees of freedom are texts ``dofs`` such as "12:RX", or numbers ``dofs`` (n, 2) of nodes and directions (1 to
    6), with ``coordinates`` (n, 3) if they are known. A sparse matrix of an .npz file is four variables, as those of
    scipy.sparse.save_npz behind the matrix's name: ``M_data``, ``M_indices``, ``M_indptr``, ``M_shape`` (CSR).
    """
    path = "arrays" if is_embedded(name) else name
    variables = _variables(name)
    matrices = {}
    for what, names in NAMES.items():
        found = [name for name in names if name in variables or f"{name}_data" in variables]
        if found:
            matrices[what] = as_matrix(f"{path}: {found[0]}", _variable(variables, found[0]))
    for what in ("mass", "stiffness"):
        if what not in matrices:
            known = ", ".join(sorted(variables)) or "nothing"
            raise ValueError(f"{path}: holds no {what} matrix ({' or '.join(NAMES[what])}); it holds {known}")
    return Found(matrices, _dofs(path, variables))


def read_matrix(what: str, name: str) -> Matrix:
    """Read the matrix that a file holds: the only one, or that with the name of ``what`` it is."""
    path = Path(name)
    if path.suffix.lower() == ".mtx":
        try:
            return as_matrix(str(path), scipy.io.mmread(path, spmatrix=False))
        except (ValueError, OverflowError) as error:
            raise ValueError(f"{path}: not a Matrix Market file ({error})") from None
    if path.suffix.lower() == ".npy":
        return as_matrix(str(path), np.load(path))
    variables = _variables(name)
    if {"data", "indices", "indptr", "shape"} <= variables.keys():
        return as_matrix(str(path), scipy.sparse.load_npz(path))
    held = ", ".join(variables) or "nothing"
    named = [n for n in NAMES[what] if n in variables or f"{n}_data" in variables] or [*variables]
    if len(named) != 1:
        raise ValueError(f"{path}: holds {held}; which is the {what} matrix? Call it {what}")
    return as_matrix(f"{path}: {named[0]}", _variable(variables, named[0]))


def write_model(file: BinaryIO, matrices: Mapping[str, Matrix], dofs: Dofs) -> None:
    """Write what `read_model` reads, as .npz: the same bytes for the same numbers."""
    variables: dict[str, Any] = {}
    for what, matrix in matrices.items():
        if isinstance(matrix, np.ndarray):
            variables[what] = matrix
        else:
            parts = {"data": matrix.data, "indices": matrix.indices, "indptr": matrix.indptr, "shape": matrix.shape}
            variables |= {f"{what}_{part}": np.asarray(value) for part, value in parts.items()}
    signed = [f"{name.replace(':', ':-' if sign < 0 else ':')}" for name, sign in zip(dofs.names, dofs.signs)]
    variables["dofs"] = np.array(signed)
    if dofs.places is not None:
        variables["coordinates"] = dofs.places
    np.savez_compressed(file, **variables)


def _variables(name: str) -> dict[str, Any]:
    """What a .npz or .mat file holds, by name."""
    path = Path("arrays.npz" if is_embedded(name) else name)
    if path.suffix.lower() == ".npz":
        try:
            with opened(name) as stream, np.load(stream) as file:
                return dict(file)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise ValueError(f"{path}: not a whole .npz file of numbers and texts ({error})") from None
    if path.suffix.lower() != ".mat":
        raise ValueError(f"{path}: matrices are read from {', '.join(SUFFIXES)} files")
    try:
        return {k: v for k, v in scipy.io.loadmat(path).items() if not k.startswith("__")}
    except NotImplementedError:
        raise ValueError(f"{path}: is a MATLAB file of version 7.3; save it with save(file, '-v7')") from None
    except Exception as error:  # scipy raises errors of many kinds over damaged files
        raise ValueError(f"{path}: not a whole MATLAB file ({error})") from None


def _variable(variables: Mapping[str, Any], name: str) -> Any:
    if name in variables:
        return variables[name]
    data, indices, indptr, shape = (variables.get(f"{name}_{part}") for part in ("data", "indices", "indptr", "shape"))
    if indices is None or indptr is None or shape is None:
        raise ValueError(f"{name}_data needs {name}_indices, {name}_indptr and {name}_shape beside it")
    return scipy.sparse.csr_array((data, indices, indptr), shape=tuple(shape))


def as_matrix(where: str, value: Any) -> Matrix:
    """A real square matrix of finite numbers; of a triangular one, which is half of a symmetric one, the whole."""
    if not scipy.sparse.issparse(value):
        value = np.asarray(value)
        if value.ndim != 2 or value.dtype.kind not in "fiuc":
            raise ValueError(f"{where}: must be a matrix of numbers, got {value.dtype} of shape {value.shape}")
    if value.shape[0] != value.shape[1] or not value.shape[0]:
        raise ValueError(f"{where}: must be square, got {value.shape[0]} x {value.shape[1]}")
    if value.dtype.kind == "c":
        raise ValueError(f"{where}: is complex; give stiffness without damping, and damping by damping_ratios or C")
    if not scipy.sparse.issparse(value):
        value = value.astype(float)
        if not np.isfinite(value).all():
            row, column = np.argwhere(~np.isfinite(value))[0] + 1
            raise ValueError(f"{where}: the number in row {row}, column {column} is not finite")
        half = np.tril(value, -1), np.triu(value, 1)
        return value + sum(part.T for part in half) if sum(part.any() for part in half) == 1 else value
    value = scipy.sparse.csr_array(value).astype(float)
    value.sum_duplicates()
    value.eliminate_zeros()
    if not np.isfinite(value.data).all():
        entries = value.tocoo()
        first = int(np.argmin(np.isfinite(entries.data)))
        raise ValueError(
            f"{where}: the number in row {entries.row[first] + 1}, column {entries.col[first] + 1} is not finite"
        )
    lower, upper = scipy.sparse.tril(value, -1), scipy.sparse.triu(value, 1)
    return scipy.sparse.csr_array(value + lower.T + upper.T) if (lower.nnz == 0) != (upper.nnz == 0) else value


def _dofs(path: str, variables: Mapping[str, Any]) -> Dofs | None:
    """Degrees of freedom that stand in the file of the matrices."""
    found = variables.get("dofs")
    if found is None:
        return None
    found = np.asarray(found)
    places = variables.get("coordinates")
    if found.ndim == 2 and found.shape[1] == 2 and found.dtype.kind in "iuf":
        texts = [f"{node:.0f}:{direction:.0f}" for node, direction in found]
    else:
        texts = [re.sub(r"[\[\]']", "", str(text)).strip() for text in found.ravel()]  # MATLAB's cells hold arrays
    try:
        return dof_table(texts, None if places is None else np.asarray(places, dtype=float))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
