"""Structures given by their matrices, as an FE program exports them."""

from __future__ import annotations

import dataclasses
import functools
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
import scipy.sparse
from pydantic import Field, PlainValidator, WithJsonSchema

from ..core.checks import naming
from ..core.errors import RigError
from ..core.files import replacing
from ..core.validation import NotNegative, Share, Text, checked
from .base import Assembly, StructureOfFiles, register
from .dofs import Dofs, dof_table, read_dofs
from .files import FileName, absolute, content, embedded, is_embedded, opened
from .large import symmetric_factors
from .matrix_files import VARIABLES, Matrix, as_matrix, read_matrix, read_model, write_model
from .reduction import MAX_DENSE

__all__ = ["UNITS", "Matrices"]

UNITS = {
    "m-kg-s": (1.0, 1.0, 1.0),
    "mm-t-s": (1e-3, 1e3, 1.0),
    "mm-kg-ms": (1e-3, 1.0, 1e-3),
    "mm-kg-s": (1e-3, 1.0, 1.0),
    "mm-g-ms": (1e-3, 1e-3, 1e-3),
    "cm-g-s": (1e-2, 1e-3, 1.0),
    "in-lbf-s": (0.0254, 4.4482216152605 / 0.0254, 1.0),
    "ft-lbf-s": (0.3048, 4.4482216152605 / 0.3048, 1.0),
}
"""Systems of units of FE programs: their units of length, mass and time in m, kg and s. Forces are in N for m-kg-s and
mm-t-s, kN for mm-kg-ms, mN for mm-kg-s, N for mm-g-ms, dyn for cm-g-s."""
Units: TypeAlias = Literal["m-kg-s", "mm-t-s", "mm-kg-ms", "mm-kg-s", "mm-g-ms", "cm-g-s", "in-lbf-s", "ft-lbf-s"]
MAX_INLINE = 12  # degrees of freedom up to which arrays are written into the rig file itself

T = TypeVar("T")


def _parse(value: object) -> Any:
    if isinstance(value, str | Path):
        return str(value)
    if isinstance(value, list | tuple | np.ndarray) or scipy.sparse.issparse(value):
        try:
            matrix = as_matrix("", value)
        except (TypeError, ValueError) as error:
            raise ValueError(str(error).lstrip(": ")) from None
        if len(matrix.diagonal()) > MAX_INLINE:
            return matrix
        return tuple(map(tuple, (matrix if isinstance(matrix, np.ndarray) else matrix.toarray()).tolist()))
    raise ValueError(f"must be the name of a file, or rows of numbers, got {value!r}")


def _parse_table(value: object) -> Any:
    if isinstance(value, str | Path):
        return str(value)
    if isinstance(value, list | tuple | np.ndarray) and all(isinstance(text, str) for text in value):
        return tuple(map(str, value))
    raise ValueError(f'must be the name of a CSV file, or a list of texts such as "12:Z", got {value!r}')


_ROWS = {"type": "array", "items": {"type": "array", "items": {"type": "number"}}}
Source: TypeAlias = Annotated[
    str | tuple[tuple[float, ...], ...], PlainValidator(_parse), WithJsonSchema({"anyOf": [{"type": "string"}, _ROWS]})
]  # A matrix: the name of a file, or its rows
Table: TypeAlias = Annotated[
    str | tuple[str, ...],
    PlainValidator(_parse_table),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]  # Degrees of freedom: the name of a CSV file, or texts such as "12:Z"


class _Free(NamedTuple):
    """The free degrees of freedom, in SI units: kg, N/m, N s/m, m, kg m, N m/rad, ..."""

    mass: Matrix
    stiffness: Matrix
    damping: Matrix | None
    cross: Matrix | None  # the skew part of the stiffness
    influence: np.ndarray
    dofs: Dofs  # of all rows, the fixed ones too
    columns: np.ndarray  # (n_all,) column of each in the matrices above; -1 if fixed
    total: float | None  # kg


@register
@checked(RigError, eq=False)
class Matrices(StructureOfFiles):
    """Mass, stiffness and damping matrices, dense or sparse, with a table of their degrees of freedom.

    Give either ``file``, which holds everything, or ``mass`` and ``stiffness``: names of files, or arrays. Arrays of
    more than 12 degrees of freedom become a ``file`` in memory, part of the rig's plain data as a text, which
    `Rig.save` writes next to the rig file; name files where matrices are large. Two are equal if their contents are,
    wherever the files are.
    """

    units: Units | None = None
    """of length, mass (or force) and time in the matrices and coordinates; never guessed, so one must be given"""
    file: FileName | None = dataclasses.field(default=None, repr=False)
    """.npz or .mat with M, K, perhaps C, and dofs"""
    mass: Source | None = None
    """M: file .mtx, .npz, .npy or .mat, or rows of numbers"""
    stiffness: Source | None = None
    """K: the same; it need not be symmetric, such as that of seals and cross-coupled bearings"""
    damping: Source | None = None
    """C: the same; its skew part may be gyroscopic"""
    dofs: Table | None = None
    """CSV file with the columns node, direction and, if known, x, y, z, or texts such as "12:Z", one for each row"""
    fixed: tuple[Text, ...] = ()
    """degrees of freedom ("12:Z") or nodes ("12") that the base holds, of matrices of the free structure"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K, in addition"""
    damping_ratios: tuple[Share, ...] = ()
    """of the modes, in addition; the last one holds for all that follow"""
    reduction: Literal["residual-flexibility", "craig-bampton"] = "residual-flexibility"
    """modes of the structure and static shapes under forces, or fixed-interface modes and static shapes under
    displacements"""
    sha256: Annotated[Text, Field(pattern="^[0-9a-f]{64}$")] | None = None
    """of the files' bytes, one after another; if it is given, changed files raise an error"""
    kind: Literal["matrices"] = "matrices"
    """of structure"""
    files: ClassVar[tuple[str, ...]] = ("file", "mass", "stiffness", "damping", "dofs")

    def __post_init__(self) -> None:
        if self.units is None:
            raise ValueError(
                'units is missing; write "m-kg-s" for matrices in m, kg, N, "mm-t-s" for mm, t, N, or another of '
                + ", ".join([*UNITS][2:])
            )
        has_others = self.stiffness is not None or self.damping is not None
        if (self.file is None) == (self.mass is None) or (self.file is not None and has_others):
            raise ValueError("give either file, or mass and stiffness")
        if self.file is None and self.stiffness is None:
            raise ValueError("stiffness is missing; a structure needs it beside its mass")
        if self.file is None and self.dofs is None:
            raise ValueError('dofs is missing; give a CSV table of node and direction, or a list ["1:X", "1:Z", ...]')
        for name in self._files:
            self._set(name, _call_named(name, absolute, getattr(self, name)))
        if not all(isinstance(getattr(self, name), str | tuple | None) for name in self.files):
            self._embed()
        if self._files:
            self._set("sha256", content([getattr(self, name) for name in self._files], self.sha256))
        _free(self)

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    @property
    def _files(self) -> list[str]:
        """Names of the fields that name files."""
        return [name for name in self.files if isinstance(getattr(self, name), str)]

    def _embed(self) -> None:
        """Embed arrays as a file in memory, so that the structure stays plain data."""
        buffer = io.BytesIO()
        write_model(buffer, *_read(self))
        for name in self.files:
            self._set(name, None)
        self._set("file", embedded(buffer.getvalue()))

    def saved_beside(self, path: Path) -> Matrices:
        """Return the same, with the arrays' file next to the rig file; see `Structure.saved_beside`."""
        if self.file is None or not is_embedded(self.file):
            return self
        target = path.with_name(f"{path.stem}_matrices.npz")
        with replacing(target) as temporary:
            temporary.write_bytes(opened(self.file).read())
        return dataclasses.replace(self, file=str(target))

    def check(self, point: float | str) -> None:
        """Raise a ValueError for a point that is no free degree of freedom; see `Structure.check`."""
        free = _free(self)
        row, _ = free.dofs.find(point)
        if free.columns[row] < 0:
            raise ValueError(f'"{point}" is fixed to the base; a clearance to the base has no "to"')

    @property
    def named_points(self) -> tuple[str, ...]:
        """Free degrees of freedom; see `Structure.named_points`."""
        free = _free(self)
        return tuple(name for name, column in zip(free.dofs.names, free.columns) if column >= 0)

    @property
    def total_mass(self) -> float | None:
        """Largest mass in kg of translation along an axis; see `Structure.total_mass`."""
        return _free(self).total

    def coordinates(self, point: float | str) -> np.ndarray:
        """Return a node's position; see `Structure.coordinates`."""
        dofs = _free(self).dofs
        return np.zeros(3) if dofs.places is None else dofs.places[dofs.find(point)[0]]

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return the matrices of the free degrees of freedom; see `Structure.assemble`."""
        free = _free(self)

        def rows(at: Sequence[float | str]) -> np.ndarray:
            motion = np.zeros((len(at), free.mass.shape[0]))
            for row, point in zip(motion, at):
                index, sign = free.dofs.find(point)
                row[free.columns[index]] = sign
            return motion

        damping = self.rayleigh, self.damping_ratios, free.damping
        return Assembly(
            free.mass, free.stiffness, free.influence, rows, *damping, cross=free.cross, reduction=self.reduction
        )


def _call_named(name: str, function: Callable[[str], T], value: str) -> T:
    """Call a function; the messages of its errors begin with the field's name."""
    with naming(name, ValueError, ValueError, "{} {}"):
        return function(value)


def _read(structure: Matrices) -> tuple[dict[str, Matrix], Dofs]:
    """Return matrices and degrees of freedom as given in files and fields."""
    matrices: dict[str, Matrix] = {}
    dofs: Dofs | None = None
    if structure.file is not None:
        matrices, dofs = _call_named("file", read_model, structure.file)
    for name in VARIABLES:
        source = getattr(structure, name)
        if isinstance(source, str):
            matrices[name] = _call_named(name, functools.partial(read_matrix, name), source)
        elif source is not None:
            matrices[name] = np.array(source) if isinstance(source, tuple) else source
    if isinstance(structure.dofs, str):
        dofs = _call_named("dofs", read_dofs, structure.dofs)
    elif structure.dofs is not None:
        dofs = dof_table(structure.dofs)
    if dofs is None:
        raise ValueError(f"dofs is missing, and {structure.file} holds none; give a CSV table of node and direction")
    for name, matrix in matrices.items():
        if matrix.shape[0] != len(dofs.names):
            size = f"{matrix.shape[0]} x {matrix.shape[0]}"
            raise ValueError(f"{name} is {size}, but there are {len(dofs.names)} degrees of freedom in dofs")
    return matrices, dofs


@functools.lru_cache(maxsize=8)
def _free(structure: Matrices) -> _Free:
    """Read, check, convert to SI units, and remove fixed degrees of freedom."""
    matrices, dofs = _read(structure)
    if structure._files:
        content([getattr(structure, name) for name in structure._files], structure.sha256)
    assert structure.units is not None
    length, kilogram, second = UNITS[structure.units]
    sign = dofs.signs * np.where(dofs.axes < 3, 1.0, length)  # displacements in m, rotations in rad
    per_time = {"mass": kilogram, "stiffness": kilogram / second**2, "damping": kilogram / second}
    in_si: dict[str, Matrix] = {}
    for what, matrix in matrices.items():
        symmetric, skew = parts_of(what, matrix, dofs)
        if skew is not None and what == "stiffness":
            in_si["cross"] = _convert(skew, per_time[what], sign)
        in_si[what] = _convert(matrix if skew is not None and what == "damping" else symmetric, per_time[what], sign)
    dofs = Dofs(dofs.names, np.ones(len(sign)), None if dofs.places is None else dofs.places * length)
    is_free = ~_find_fixed(structure.fixed, dofs)
    if not is_free.any():
        raise ValueError("fixed holds every degree of freedom; nothing is left to move")
    free = {what: matrix[is_free][:, is_free] for what, matrix in in_si.items()}
    check_mass_and_stiffness(free["mass"], free["stiffness"], tuple(np.array(dofs.names)[is_free]))
    rigid = (dofs.axes[:, None] == np.arange(3)).astype(float)
    inertia = in_si["mass"] @ rigid  # the base carries the fixed ones, whose coupling terms count
    masses = np.sum(rigid * inertia, axis=0)
    if free["mass"].shape[0] <= MAX_DENSE:
        free = {what: m if isinstance(m, np.ndarray) else m.toarray() for what, m in free.items()}
    columns = np.where(is_free, np.cumsum(is_free) - 1, -1)
    total = float(masses.max()) or None
    of_free = free["mass"], free["stiffness"], free.get("damping"), free.get("cross")
    return _Free(*of_free, inertia[is_free], dofs, columns, total)


def _convert(matrix: Matrix, factor: float, scale: np.ndarray) -> Matrix:
    if isinstance(matrix, np.ndarray):
        return factor * matrix * np.outer(scale, scale)
    diagonal = scipy.sparse.diags_array(scale)
    return scipy.sparse.csr_array(factor * (diagonal @ matrix @ diagonal))


def _find_fixed(texts: tuple[str, ...], dofs: Dofs) -> np.ndarray:
    """Return True (n,) for fixed degrees of freedom."""
    is_fixed = np.zeros(len(dofs.names), dtype=bool)
    for i, text in enumerate(texts):
        names = [text] if ":" in text else dofs.of_node(text)
        with naming(f"fixed[{i}]", ValueError, ValueError, "{} {}"):
            is_fixed[[dofs.find(name)[0] for name in names or [f"{text}:X"]]] = True
    return is_fixed


# Checks: the mass is symmetric and positive definite, the symmetric part of the stiffness not negative.

ASYMMETRY = 1e-6
"""Of the geometric mean of both diagonal terms: largest difference between the halves by rounding in a file."""


def parts_of(name: str, matrix: Matrix, dofs: Dofs) -> tuple[Matrix, Matrix | None]:
    """Return the symmetric and the skew part of a matrix, None for a skew part within rounding.

    A ValueError names the terms of a mass that is not symmetric.
    """
    difference = scipy.sparse.coo_array(matrix - matrix.T)
    size = np.sqrt(np.abs(matrix.diagonal()))
    floor = 1e-9 * size.max(initial=0.0)
    size = np.maximum(size, floor)
    asymmetry = np.abs(difference.data) / np.maximum(size[difference.row] * size[difference.col], 1e-300)
    symmetric = (matrix + matrix.T) / 2
    if not asymmetry.size or asymmetry.max() <= ASYMMETRY:
        return symmetric, None
    if name == "mass":
        worst = int(np.argmax(asymmetry))
        i, j = int(difference.row[worst]), int(difference.col[worst])
        raise ValueError(
            f"{name} is not symmetric: {matrix[i, j]:g} between {dofs.names[i]} and {dofs.names[j]} (row {i + 1}, "
            f"column {j + 1}), {matrix[j, i]:g} between {dofs.names[j]} and {dofs.names[i]}"
        )
    return symmetric, (matrix - matrix.T) / 2


def check_mass_and_stiffness(mass: Matrix, stiffness: Matrix, names: tuple[str, ...]) -> None:
    """Raise a ValueError for a mass that is not positive or a negative stiffness; it names the degree of freedom.

    A rotation may have no mass, as in lumped mass matrices, if it has a stiffness.
    """
    heavy, stiff = mass.diagonal(), stiffness.diagonal()
    massless = (heavy == 0) & (abs(mass).sum(axis=0) == 0) & np.array([":R" in name for name in names])
    if not np.all(valid := (stiff > 0) | ~massless):
        at = int(np.argmin(valid))
        raise ValueError(
            f"mass of {names[at]} and its stiffness are 0 (row {at + 1}); leave it out, or hold it by fixed"
        )
    if not np.all(valid := (heavy > 0) | massless):
        at = int(np.argmin(valid))
        raise ValueError(
            f"mass of {names[at]} is {heavy[at]:g} (row {at + 1}); needs > 0: give it a mass, export a consistent mass "
            "matrix, or condense it (Guyan) in the FE program"
        )
    if massless.all():
        raise ValueError("mass is 0; needs a translation with a mass")
    rows = np.flatnonzero(~massless)
    if (worst := _indefinite_row(mass[rows][:, rows])) is not None:
        raise ValueError(
            f"mass is not positive definite: some motion of {names[rows[worst]]} has no positive kinetic energy; look "
            "at the coupling terms of that row, and whether the file holds the whole matrix"
        )
    if np.any(stiff < 0):
        at = int(np.argmin(stiff))
        raise ValueError(f"stiffness of {names[at]} is {stiff[at]:g} (row {at + 1}); needs >= 0: check K's sign")
    little = 1e-9 * float(np.max(stiff[rows] / heavy[rows])) or 1.0
    if (worst := _indefinite_row(stiffness + little * mass)) is not None:
        raise ValueError(
            f"stiffness is negative in some motion of {names[worst]}; check the signs of K, and whether the file holds "
            "the whole matrix"
        )


def _indefinite_row(matrix: Matrix) -> int | None:
    """Return the row where a matrix of positive diagonal fails to be positive definite; None if it does not."""
    if isinstance(matrix, np.ndarray):
        scale = 1 / np.sqrt(matrix.diagonal())
        value, vector = np.linalg.eigh(matrix * np.outer(scale, scale))
        return None if value[0] > 1e-14 else int(np.argmax(np.abs(vector[:, 0])))
    factors, scaled, _ = symmetric_factors(matrix)
    if factors is None:
        return int(np.argmin(abs(scaled).sum(axis=0)))
    # By Sylvester's law the pivots on the diagonal have the signs of the eigenvalues.
    pivots = factors.U.diagonal()
    if np.all(pivots > 1e-14) and np.array_equal(factors.perm_r, factors.perm_c):
        return None
    return int(np.argsort(factors.perm_c)[np.argmin(pivots)])
