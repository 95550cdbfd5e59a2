"""Readers of mass, stiffness and damping matrices: Matrix Market, NumPy and MATLAB files."""

from __future__ import annotations

import io
import math
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TypeAlias

import numpy as np
import scipy.io
import scipy.sparse

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.matlab import arrays
from .dofs import Dofs, dof_table
from .files import is_embedded, opened

__all__ = ["Found", "Matrix", "as_matrix", "read_matrix", "read_model", "write_model"]

Matrix: TypeAlias = np.ndarray | scipy.sparse.csr_array  # Dense or sparse matrix.

VARIABLES = {"mass": ("mass", "M"), "stiffness": ("stiffness", "K"), "damping": ("damping", "C", "D")}
"""Names of each matrix's variable in a file."""
_BODY = re.compile(rb"[^\n]*\n(?:[ \t\r]*(?:%[^\n]*)?\n)*")
"""part of a Matrix Market file before its size and numbers: its first line and comments"""
_NUMERALS = b"0123456789+-.eEnaifNAIF \t\r\n"
SUFFIXES = (".npz", ".mat", ".mtx", ".npy")
WHY = "{} ({})"  # numpy, scipy, zipfile and zlib raise errors of many kinds over damaged files
MAX_UNPACKED = 2**31  # bytes of a compressed MATLAB file: a full matrix of zeros packs well
MAX_ROWS = 1_000_000  # rows of a matrix; ten times what can be reduced in reasonable time


class Found(NamedTuple):
    """Content of one file."""

    matrices: dict[str, Matrix]  #: by name: mass, stiffness, damping
    dofs: Dofs | None


def read_model(name: str) -> Found:
    """Read M, K, C (or mass, stiffness, damping) and the degrees of freedom from a .npz or .mat file.

    The degrees of freedom are texts ``dofs`` such as "12:RX", or numbers ``dofs`` (n, 2) of nodes and directions (1 to
    6), with ``coordinates`` (n, 3) if they are known. A sparse matrix of an .npz file is four variables, as those of
    scipy.sparse.save_npz behind the matrix's name: ``M_data``, ``M_indices``, ``M_indptr``, ``M_shape`` (CSR).
    """
    path = "arrays" if is_embedded(name) else name
    variables = _read_variables(name)
    matrices = {}
    for what, names in VARIABLES.items():
        if present := [name for name in names if name in variables or f"{name}_data" in variables]:
            matrices[what] = as_matrix(f"{path}: {present[0]}", _get_variable(path, variables, present[0]))
    for what in ("mass", "stiffness"):
        if what not in matrices:
            known = ", ".join(sorted(variables)) or "nothing"
            raise ValueError(f"{path}: holds no {what} matrix ({' or '.join(VARIABLES[what])}); it holds {known}")
    return Found(matrices, _read_dofs(path, variables))


def read_matrix(what: str, name: str) -> Matrix:
    """Read a matrix from a file: the only one, or that with the name ``what``."""
    path = Path(name)
    if path.suffix.lower() == ".mtx":
        return as_matrix(str(path), _read_matrix_market(path))
    if path.suffix.lower() == ".npy":
        with naming(f"{path}: not a whole .npy file of numbers", (ValueError, EOFError), ValueError, WHY):
            return as_matrix(str(path), np.load(path, mmap_mode="r"))
    variables = _read_variables(name)
    if {"data", "indices", "indptr", "shape"} <= variables.keys():
        with naming(f"{path}: not a sparse matrix of scipy.sparse.save_npz", Exception, ValueError, WHY):
            saved = scipy.sparse.load_npz(path)
        return as_matrix(str(path), saved)
    held = ", ".join(variables) or "nothing"
    candidates = [n for n in VARIABLES[what] if n in variables or f"{n}_data" in variables] or [*variables]
    if len(candidates) != 1:
        raise ValueError(f"{path}: holds {held}; which is the {what} matrix? Call it {what}")
    return as_matrix(f"{path}: {candidates[0]}", _get_variable(path, variables, candidates[0]))


def write_model(file: BinaryIO, matrices: Mapping[str, Matrix], dofs: Dofs) -> None:
    """Write matrices and degrees of freedom as .npz for `read_model`: the same bytes for the same numbers."""
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


def _read_matrix_market(path: Path) -> Any:
    """Return the matrix of a Matrix Market file, after a check of its declared size."""
    data = path.read_bytes() + b"\n"  # scipy 1.17 reads on behind a number that ends the file
    wrong = ValueError, OverflowError, TypeError, MemoryError
    with naming(f"{path}: not a Matrix Market file that can be used", wrong, ValueError, WHY):
        if strange := _BODY.sub(b"", data, count=1).translate(None, _NUMERALS):  # and behind what is none
            raise ValueError(f"it holds {strange[:10]!r} among the numbers")
        rows, columns, entries, _, field, _ = scipy.io.mminfo(io.BytesIO(data))
        if field == "pattern":
            raise ValueError("it says where numbers are, but not which: field pattern")
        _check_rows(rows, columns)
        if entries > len(data):
            raise ValueError(f"it declares {entries} numbers, which do not follow")
        return scipy.io.mmread(io.BytesIO(data), spmatrix=False)


def _check_rows(rows: int, columns: int) -> None:
    if max(rows, columns) > MAX_ROWS:
        raise ValueError(f"{rows} x {columns}; at most {MAX_ROWS} rows are read")


def _read_variables(name: str) -> dict[str, Any]:
    """Return the variables of a .npz or .mat file, by name."""
    path = Path("arrays.npz" if is_embedded(name) else name)
    if path.suffix.lower() == ".npz":
        with naming(f"{path}: not a whole .npz file of numbers and texts", Exception, ValueError, WHY):
            with opened(name) as stream, zipfile.ZipFile(stream) as file:
                return {member.filename.removesuffix(".npy"): _read_array(file, member) for member in file.infolist()}
    if path.suffix.lower() != ".mat":
        raise ValueError(f"{path}: matrices are read from {', '.join(SUFFIXES)} files")
    data = path.read_bytes()
    wrong = RecordError, ValueError  # ValueError: a shape beyond what numpy can
    with naming(f"{path}: not a whole MATLAB file", wrong, ValueError, WHY):
        if data[124:128] in (b"\x00\x02IM", b"\x02\x00MI"):
            raise ValueError("version 7.3; save it in MATLAB with save(file, '-v7')")
        return arrays(data, MAX_UNPACKED)


def _read_array(file: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """Return an array of a .npz file, after a check of its declared size."""
    with file.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(stream)
        if math.prod(shape) * dtype.itemsize > member.file_size:
            raise ValueError(f"{member.filename} declares {shape} numbers, which do not follow")
    with file.open(member) as stream:
        return np.lib.format.read_array(stream)


def _get_variable(path: str | Path, variables: Mapping[str, Any], name: str) -> Any:
    if name in variables:
        return variables[name]
    data, indices, indptr, shape = (variables.get(f"{name}_{part}") for part in ("data", "indices", "indptr", "shape"))
    if indices is None or indptr is None or shape is None:
        raise ValueError(f"{path}: {name}_data needs {name}_indices, {name}_indptr and {name}_shape beside it")
    parts = f"{name}_data, {name}_indices, {name}_indptr and {name}_shape"
    with naming(f"{path}: {parts} do not fit", Exception, ValueError):
        rows, columns = (int(n) for n in np.asarray(shape).tolist())
        _check_rows(rows, columns)
        return scipy.sparse.csr_array((data, indices, indptr), shape=(rows, columns))


def as_matrix(where: str, value: Any) -> Matrix:
    """Check and return a real square matrix of finite numbers; a triangular one is completed to a symmetric one."""
    if not scipy.sparse.issparse(value):
        try:
            value = np.asarray(value)
        except ValueError:
            raise ValueError(f"{where}: must have as many numbers in every row") from None
        if value.ndim != 2 or value.dtype.kind not in "fiuc":
            raise ValueError(f"{where}: must be a matrix of numbers, got {value.dtype} of shape {value.shape}")
    elif value.format in ("csr", "csc", "bsr"):
        with naming(f"{where}: no matrix that can be used", ValueError, ValueError, WHY):
            _check_rows(*value.shape)
            value.check_format(full_check=True)  # compiled functions trust the indices
            if np.any(np.diff(value.indptr) < 0):  # not checked by scipy where the last one is 0
                raise ValueError("indptr must not fall")
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


def _read_dofs(path: str, variables: Mapping[str, Any]) -> Dofs | None:
    """Return the degrees of freedom in the file of the matrices."""
    if (dofs := variables.get("dofs")) is None:
        return None
    places = variables.get("coordinates")
    if isinstance(dofs, np.ndarray) and dofs.ndim == 2 and dofs.shape[1] == 2 and dofs.dtype.kind in "iuf":
        texts = [f"{node:.0f}:{direction:.0f}" for node, direction in dofs]
    else:
        texts = [str(text).strip() for text in ([dofs] if isinstance(dofs, str) else np.ravel(dofs).tolist())]
    with naming(path, (TypeError, ValueError), ValueError):
        return dof_table(texts, None if places is None else np.asarray(places, dtype=float))
