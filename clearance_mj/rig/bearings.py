"""Bearings and seals: stiffness and damping between two directions, constant or over the spin.

Films, tilting pads and seals that others have linearised act on a shaft with -K r - C ṙ, r = (y, z). K and C need not
be symmetric: a cross-coupled stiffness k_yz = -k_zy > 0 drives whirl in the sense of the spin.
"""

from __future__ import annotations

import functools
from typing import Annotated, Any, NamedTuple, TypeAlias

import numpy as np
import scipy.interpolate
from pydantic import BeforeValidator, Field, WithJsonSchema

from ..core.errors import RigError
from ..core.validation import Number, Text, checked, seldom
from ..structure import Point
from ..structure.base import along_axis

__all__ = ["Bearing", "Coefficients"]


def _as_rows(value: Any) -> Any:
    """Return one number of both directions, or a 2 x 2 matrix, as the one row of a table."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return [[value, 0.0, 0.0, value]]
    if isinstance(value, list | tuple) and [len(row) for row in value if isinstance(row, list | tuple)] == [2, 2]:
        return [[*value[0], *value[1]]]
    return value


_Row: TypeAlias = tuple[Number, Number, Number, Number]
_Table: TypeAlias = Annotated[
    tuple[_Row, ...], Field(min_length=1), BeforeValidator(_as_rows),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "array"}}]}),
]  # fmt: skip


class Coefficients(NamedTuple):
    """Coefficients of a bearing at one spin."""

    stiffness: np.ndarray  #: (2, 2) N/m: force along y and z, against displacement along y and z
    damping: np.ndarray  #: (2, 2) N s/m


@checked(RigError)
class Bearing:
    """A bearing or a seal between a shaft and the base, linear, in both directions across the shaft."""

    position: Point
    """m along the shaft, or a degree of freedom across it such as "12:+Z" """
    stiffness: _Table = ((0.0, 0.0, 0.0, 0.0),)
    """N/m: a number, a matrix [[yy, yz], [zy, zz]], or a row [yy, yz, zy, zz] for each of ``spin``"""
    damping: _Table = ((0.0, 0.0, 0.0, 0.0),)
    """N s/m, likewise"""
    spin: tuple[Number, ...] = seldom(default=())
    """rad/s, rising: of the rows; between them a curve without overshoot; none: they hold at every spin"""
    name: Text = seldom(default="")
    """for people"""

    def __post_init__(self) -> None:
        rows = max(len(self.spin), 1)
        for name in ("stiffness", "damping"):
            if len(values := getattr(self, name)) not in {1, rows}:
                raise ValueError(
                    f"{name} has {len(values)} rows and spin {len(self.spin)} speeds; give one row for each"
                )
        if np.any(np.diff(self.spin) <= 0):
            raise ValueError("spin must rise from row to row")
        if not np.any(self.stiffness) and not np.any(self.damping):
            raise ValueError("holds nothing; give stiffness or damping, or a table of both")

    @property
    def stiffest(self) -> tuple[float, float]:
        """Largest stiffness along y and along z, N/m, for the computation of a shaft's modes; 0 if negative."""
        yy, _, _, zz = np.max(self.stiffness, axis=0, initial=0.0)
        return float(yy), float(zz)

    def springs_to_base(self, axes: str) -> tuple[tuple[float | str, float], ...]:
        """Return points and stiffnesses, N/m, of springs of `stiffest` to the base.

        Parameters
        ----------
        axes : str
            "Y", "Z" or "YZ".
        """
        return tuple((along_axis(self.position, axis), self.stiffest["YZ".index(axis)]) for axis in axes)

    @property
    def is_isotropic(self) -> bool:
        """True if it is the same in every direction across the shaft: a circular orbit stays one."""
        yy, yz, zy, zz = np.vstack((self.stiffness, self.damping)).T
        return bool(np.array_equal(yy, zz) and np.array_equal(yz, -zy))

    def at(self, spin: float) -> Coefficients:
        """Return stiffness and damping at a spin.

        Parameters
        ----------
        spin : float
            Ω, rad/s.

        Raises
        ------
        RigError
            If the bearing's table does not reach so far.
        """
        if self.spin and not self.spin[0] <= spin <= self.spin[-1]:
            raise RigError(
                f"the bearing at {self.position} is known from {self.spin[0]:g} to {self.spin[-1]:g} rad/s, not at "
                f"{spin:g} rad/s; extend its table, or ask for spins within it"
            )
        return Coefficients(*(_between(self.spin, rows, spin) for rows in (self.stiffness, self.damping)))


def _between(speeds: tuple[float, ...], rows: tuple[_Row, ...], spin: float) -> np.ndarray:
    """Return (2, 2) coefficients at a spin, between rows by Fritsch & Butland's cubics (1984)."""
    return np.reshape(rows[0] if len(rows) == 1 else _curve(speeds, rows)(spin), (2, 2))


@functools.lru_cache(maxsize=128)
def _curve(speeds: tuple[float, ...], rows: tuple[_Row, ...]) -> scipy.interpolate.PchipInterpolator:
    return scipy.interpolate.PchipInterpolator(speeds, rows)
