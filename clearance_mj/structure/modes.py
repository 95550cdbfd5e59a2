"""A structure given by its modes, from a modal test or a finite element program.

Truncated modes make a structure too stiff under a point force. Their residual flexibility R, where it is
known, becomes further modes at one high frequency Ω: R = S Sᵀ = Σ u uᵀ / Ω² with u = Ω S (MacNeal 1971; Rubin 1975), no
more of them than there are loads. At ω they deflect by R / (1 - ω²/Ω²): with Ω of three times the highest frequency by
3 % of R more at half of that, where the modes left out, most of R those just above, have more still. The engines' step
need not be shorter than a third of what the modes ask for.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
import pydantic
from pydantic import AfterValidator, Field

from ..core.checks import naming
from ..core.errors import RigError
from ..core.files import write_text
from ..core.validation import NotNegative, Number, Positive, Share, Text, checked
from .base import Assembly, Structure, dof_vector, parse_dof, ratios_of_modes, register
from .dofs import Dofs, dof_table
from .mode_files import DAMPING, FREQUENCY, MODAL_MASS, PARTICIPATION, RESIDUAL, read_mode_file

__all__ = ["ModalStructure", "flexibility_root"]

OMEGA_RATIO = 3.0  # frequency Ω of the residual modes over the highest retained one
MAX_MODES = 60  # modes that are all retained; of more, the lowest and the others' static shapes at the loads
LARGEST_SHAPE = 1e30  # 1/sqrt(kg), far above any structure's mode shape
NEGATIVE = 1e-3
"""Of the largest eigenvalue of a residual flexibility: negative eigenvalues and asymmetry within rounding."""
ZERO_EIGENVALUE = 1e-9  # of the largest eigenvalue: smaller ones count as zero


def _dof(value: str) -> str:
    if parse_dof(value) is None:
        raise ValueError(f'must be a degree of freedom such as "12:+Z", got "{value}"')
    return value


Dof: TypeAlias = Annotated[Text, AfterValidator(_dof)]
Rows: TypeAlias = tuple[tuple[Number, ...], ...]
_SCHEMA = {"anyOf": [{"required": ["file"]}, {"required": ["frequencies", "dofs", "shapes"]}]}


@register
@checked(RigError, schema=_SCHEMA)
class ModalStructure(Structure):
    """A structure given by natural frequencies, damping and shapes at named degrees of freedom.

    Without ``modal_masses`` the shapes are of unit modal mass.
    """

    files: ClassVar[tuple[str, ...]] = ("file",)

    frequencies: tuple[Annotated[NotNegative, Field(le=1e9)], ...] = ()
    """(n,) Hz, undamped, rising; 0 of a rigid body"""
    damping_ratios: tuple[Share, ...] = ()
    """damping ratios; the last one holds for all that follow, none for none"""
    dofs: tuple[Dof, ...] = ()
    """degree of freedom of each row of ``shapes``, such as "12:+Z" """
    shapes: Rows = ()
    """(n_dofs, n) a row per degree of freedom, 1/sqrt(kg) at unit modal mass; of any size with ``modal_masses``"""
    modal_masses: tuple[Positive, ...] | None = None
    """(n,) kg, where the shapes are scaled otherwise, for example to a largest displacement of 1"""
    participation: tuple[tuple[Number, Number, Number], ...] | None = None
    """(n, 3) per mode: sqrt(kg) along X, Y and Z at unit modal mass, for excitation by the base"""
    dof_masses: tuple[NotNegative, ...] | None = None
    """(n_dofs,) kg that move with each degree of freedom, from which participation is computed"""
    residual_flexibility: Rows | None = None
    """(n_dofs, n_residual_dofs) m/N of the truncated modes: under a unit force at each of ``residual_dofs``"""
    residual_dofs: tuple[Dof, ...] | None = None
    """degree of freedom of each column of ``residual_flexibility``; None: all, as in ``dofs``"""
    file: Text | None = None
    """universal file (55, 2414) or CSV file, which is read into the other fields"""
    kind: Literal["modes"] = "modes"
    """of structure"""

    @pydantic.model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any) -> Any:
        """Read the fields from the file, where there is one; fields given in addition have precedence."""
        if not isinstance(data, dict) or not isinstance(data.get("file"), str):
            return data
        given = {name: value for name, value in data.items() if name != "file" and value is not None}
        return read_mode_file(Path(data["file"]), scaled="modal_masses" in given) | given

    def __post_init__(self) -> None:
        n, rows = len(self.frequencies), len(self.dofs)
        for name in ("frequencies", "dofs", "shapes"):
            if not getattr(self, name):
                raise ValueError(f"{name} is missing; give frequencies, damping_ratios, dofs and shapes, or a file")
        for i, (low, high) in enumerate(zip(self.frequencies, self.frequencies[1:])):
            if high < low:
                raise ValueError(f"frequencies[{i + 1}] {high:g} Hz must not be less than the one before, {low:g} Hz")
        dof_table(self.dofs)
        if len(self.damping_ratios) > n:
            raise ValueError(
                f"damping_ratios must hold at most {n} ratios, one per frequency, got {len(self.damping_ratios)}"
            )
        self._check_size("shapes", self.shapes, rows, n)
        for name, length, of in (("modal_masses", n, "frequency"), ("participation", n, "frequency"),
                                 ("dof_masses", rows, "degree of freedom")):  # fmt: skip
            value = getattr(self, name)
            if value is not None and len(value) != length:
                raise ValueError(f"{name} must hold {length}, one per {of}, got {len(value)}")
        if not np.any(self.shapes, axis=0).all():
            raise ValueError(f"shapes are zero in mode {int(np.argmin(np.any(self.shapes, axis=0))) + 1}")
        if (size := np.abs(self.unit_shapes).max()) > LARGEST_SHAPE:
            raise ValueError(f"shapes reach {size:.3g} 1/sqrt(kg) at unit modal mass, needs <= {LARGEST_SHAPE:g}")
        if n > 1 and self.modal_masses is None and np.all(np.abs(self.shapes).max(axis=0) == 1):
            raise ValueError(
                "shapes have a largest component of 1 in every mode, so their scaling is not known; give modal_masses "
                "(kg), or shapes of unit modal mass (1/sqrt(kg)) as modes_from_frf makes them of FRFs"
            )
        if self.residual_flexibility is None and self.residual_dofs is not None:
            raise ValueError("residual_dofs needs residual_flexibility")
        if self.residual_flexibility is not None:
            self._check_residual()

    @staticmethod
    def _check_size(name: str, value: Rows, rows: int, columns: int) -> None:
        if len(value) != rows:
            raise ValueError(f"{name} must hold {rows} rows, one per degree of freedom, got {len(value)}")
        for i, row in enumerate(value):
            if len(row) != columns:
                raise ValueError(f"{name}[{i}] must hold {columns} numbers, got {len(row)}")

    def _check_residual(self) -> None:
        assert self.residual_flexibility is not None
        self._check_size("residual_flexibility", self.residual_flexibility, len(self.dofs), len(self._residual_at))
        for i, dof in enumerate(self._residual_at):
            with naming(f"residual_dofs[{i}]", ValueError, ValueError, "{} {}"):
                self.check(dof)
        at_loads = self._rows(self._residual_at, np.array(self.residual_flexibility))
        if np.abs(at_loads - at_loads.T).max() > NEGATIVE * np.abs(at_loads).max(initial=0.0):
            raise ValueError("residual_flexibility must be symmetric, as it is between points of one structure")
        value = np.linalg.eigvalsh(at_loads)
        if value[0] < -NEGATIVE * value[-1]:
            raise ValueError(
                f"residual_flexibility must not be negative; its least eigenvalue is {value[0]:.3g} m/N, its largest "
                f"{value[-1]:.3g} m/N"
            )

    @functools.cached_property
    def _table(self) -> Dofs:
        return dof_table(self.dofs)

    @property
    def named_points(self) -> tuple[str, ...]:
        """Degrees of freedom of the shapes; see `Structure.named_points`."""
        return self.dofs

    def check(self, point: float | str) -> None:
        """Raise a ValueError for a point that is not among ``dofs``, with the nearest ones; see `Structure.check`."""
        self._table.find(point)

    def _rows(self, points: Sequence[float | str], values: np.ndarray) -> np.ndarray:
        """Return the rows at points of values given per degree of freedom."""
        rows = [sign * values[row] for row, sign in map(self._table.find, points)]
        return np.reshape(rows, (len(rows), values.shape[1]))

    @functools.cached_property
    def omega(self) -> np.ndarray:
        """(n,) natural circular frequencies, 1/s."""
        return 2 * np.pi * np.array(self.frequencies)

    @functools.cached_property
    def ratios(self) -> np.ndarray:
        """(n,) damping ratios."""
        return ratios_of_modes(self.damping_ratios, self.omega.size)

    @functools.cached_property
    def unit_shapes(self) -> np.ndarray:
        """(n_dofs, n) shapes of unit modal mass, 1/sqrt(kg)."""
        return np.array(self.shapes) / np.sqrt(self.modal_masses or np.ones(self.omega.size))

    @property
    def _residual_at(self) -> tuple[str, ...]:
        return self.dofs if self.residual_dofs is None else self.residual_dofs

    @functools.cached_property
    def residual_root(self) -> np.ndarray:
        """(n_dofs, r) S in sqrt(m/N), R = S Sᵀ: exact at ``residual_dofs``, elsewhere of minimum norm."""
        if self.residual_flexibility is None:
            return np.zeros((len(self.dofs), 0))
        columns = np.array(self.residual_flexibility)
        return flexibility_root(columns, self._rows(self._residual_at, columns))

    def flexibility(self, points: Sequence[float | str]) -> tuple[np.ndarray, np.ndarray]:
        """Return the static flexibility of the modes, and the residual one, each (n_points, n_points) in m/N.

        Parameters
        ----------
        points : sequence of Point
            Degrees of freedom; a mode of 0 Hz is left out.
        """
        bending = self.omega > 0
        shapes = self._rows(points, self.unit_shapes[:, bending]) / self.omega[bending]
        residual = self._rows(points, self.residual_root)
        return shapes @ shapes.T, residual @ residual.T

    def has_residual(self, point: float | str) -> bool:
        """Return True if the residual flexibility of a point itself is known.

        Parameters
        ----------
        point : Point
            Degree of freedom.
        """
        known = self._residual_at if self.residual_flexibility else ()
        return self._table.find(point)[0] in [self._table.find(at)[0] for at in known]

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return the modes as coordinates, with modes of high frequency that carry the residual flexibility."""
        root = self._root_at(points)
        high = OMEGA_RATIO * self.omega[-1] if self.omega[-1] else 1.0
        values = np.hstack((self.unit_shapes, high * root))
        omega = np.append(self.omega, np.full(root.shape[1], high))
        viscous = np.diag(2 * np.append(self.ratios, np.full(root.shape[1], self.ratios[-1])) * omega)
        return Assembly(
            np.eye(omega.size), np.diag(omega**2), self._influence(values), lambda at: self._rows(at, values),
            viscous=viscous, reduced=len(self.frequencies) <= MAX_MODES,
        )  # fmt: skip

    def _root_at(self, points: Sequence[float | str]) -> np.ndarray:
        """Return S with as few columns as loads, which is exact for these."""
        root = self.residual_root
        at = self._rows(list(dict.fromkeys(points)), root)
        return root if len(at) >= root.shape[1] else flexibility_root(root @ at.T, at @ at.T)

    def write_csv(self, path: str | Path) -> None:
        """Write the modes as a table, which ``file`` may name: a row per quantity and degree of freedom.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        flexibility = self.residual_flexibility or [()] * len(self.dofs)
        residual = self._residual_at if self.residual_flexibility else ()
        names = (f"mode {i + 1}" for i in range(self.omega.size))
        rows: list[tuple[Any, ...]] = [("dof", *names, *(f"{RESIDUAL}{dof} [m/N]" for dof in residual))]
        rows += [(FREQUENCY, *self.frequencies), (DAMPING, *self.ratios), (MODAL_MASS, *np.ones(self.omega.size))]
        rows += [(name, *row) for name, row in zip(PARTICIPATION, zip(*self.participation or ()))]
        rows += [(dof, *shape, *more) for dof, shape, more in zip(self.dofs, self.unit_shapes, flexibility)]
        cells = ([cell if isinstance(cell, str) else f"{cell:.17g}" for cell in row] for row in rows)
        write_text(path, "".join(",".join(row) + "\n" for row in cells))

    def refusal(self, kind: str) -> str:
        """Return why the base cannot be shaken where the participation is not known; see `Structure.refusal`."""
        if kind != "base" or self.participation is not None or self.dof_masses is not None:
            return ""
        return (
            "the participation of the modes is not known, so the base cannot be shaken; give participation (sqrt(kg)) "
            'or dof_masses (kg) of the structure, or excite it by a force: shaker.kind = "force"'
        )

    def _influence(self, values: np.ndarray) -> np.ndarray:
        """Return the influence (n, 3) of the modes and the residual ones; 0 where it is not known."""
        influence = np.zeros((values.shape[1], 3))
        if self.dof_masses is not None:
            directions = np.array([dof_vector(dof) for dof in self.dofs])
            influence = values.T @ (np.array(self.dof_masses)[:, None] * directions)
        if self.participation is not None:
            influence[: self.omega.size] = self.participation
        return influence


def flexibility_root(columns: np.ndarray, own: np.ndarray, floor: float = 0.0) -> np.ndarray:
    """Return S with S Sᵀ = columns own⁻¹ columnsᵀ, the minimum-norm symmetric matrix with these columns.

    Parameters
    ----------
    columns : ndarray, shape (n, r)
        Deflections under unit loads.
    own : ndarray, shape (r, r)
        Deflections at the loads.
    floor : float
        Eigenvalues of ``own`` below this count as zero.
    """
    value, vector = np.linalg.eigh((own + own.T) / 2)
    positive = value > max(ZERO_EIGENVALUE * value.max(initial=0.0), floor)
    return columns @ (vector[:, positive] / np.sqrt(value[positive]))
