"""Linear structures: matrices in some coordinates, and the displacements of points in them.

A point is a number, m along a shaft, or a text: a degree of freedom such as "12:+Z" or "tip:+Z" (node or name of a
place, direction), or "inner@0.4", 0.4 m along the shaft called inner. On a shaft, too, a direction may follow:
"inner@0.4:RX", or "@0.4:RX" where there is but one, is the rotation about the shaft's axis there.
"""

from __future__ import annotations

import dataclasses
import math
import re
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, TypeAlias, TypeVar

import numpy as np
from pydantic import PlainValidator, WithJsonSchema

from ..core.checks import AXES
from ..core.errors import RigError
from ..core.files import replacing
from ..core.plain_numbers import with_number
from ..core.validation import from_plain, to_plain
from .files import is_embedded

__all__ = [
    "AXES", "POINT_SCHEMA", "SHAFT_NAME", "Assembly", "PlaneCoupling", "Point", "Rows", "Structure", "StructureOfFiles",
    "along_axis", "check_point", "dof_vector", "in_other_plane", "is_rotation", "moved", "parse_direction", "parse_dof",
    "parse_place", "ratios_of_modes", "rocked",
]  # fmt: skip

_DOF = re.compile(r"([0-9]{1,9}|[A-Za-z_][\w.-]*):([+-]?)(R?[XYZ])")
SHAFT_NAME = r"\w[\w -]*"  # Pattern of the name of one of several shafts.
_PLACE = re.compile(
    rf"({SHAFT_NAME}|(?=@[^:]+:))@([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{{1,3}})?)(?::([+-]?)(R?[XYZ]))?"
)
_CURVED_PLACE = re.compile(_PLACE.pattern.replace("R?[XYZ]", "[RK]?[XYZ]"))  # curvatures are of sensors alone
_SWAPPED = {"Y": ("Z", 1), "Z": ("Y", 1), "RY": ("RZ", -1), "RZ": ("RY", -1), "KY": ("KZ", 1), "KZ": ("KY", 1)}


def check_point(value: object) -> float | str:
    """Return a point, or raise a ValueError that says what one is."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ValueError(f"must be finite, got {number}")
        return number
    if isinstance(value, str) and (_DOF.fullmatch(value) or _PLACE.fullmatch(value)):
        return value
    shown = repr(value)
    raise ValueError(
        'must be a number, m along the shaft, or a text: a degree of freedom "12:+Z" or a shaft\'s "inner@0.4" or '
        f'"@0.4:RX", got {shown if len(shown) < 100 else f"{shown[:80]} ..."}'
    )


POINT_SCHEMA = {
    "anyOf": [{"type": "number"}, {"type": "string", "pattern": rf"^({_DOF.pattern})$|^({_PLACE.pattern})$"}]
}
Point: TypeAlias = Annotated[float | str, PlainValidator(check_point), WithJsonSchema(POINT_SCHEMA)]
"""A number, m along the shaft; or a degree of freedom "12:+Z"; or a position on one of several shafts "inner@0.4", or a
direction there, "@0.4:RX" """


Made = TypeVar("Made", bound="type[Structure]")


def register(structure: Made) -> Made:
    """Register a structure for ``[structure] kind = "..."`` of rig files; a decorator of classes with a field ``kind``.

    Parameters
    ----------
    structure : type
        A `checked` subclass of `Structure`; the default of its field ``kind`` is its name.
    """
    Structure.known[structure.kind] = structure  # type: ignore[attr-defined]
    return structure


Rows: TypeAlias = Callable[[Sequence[float | str]], np.ndarray]


def parse_dof(point: float | str) -> tuple[int | str, str, int] | None:
    """Return the node, axis (of `AXES`) and sign of a degree of freedom such as "12:-RZ"; None for another point."""
    if not isinstance(point, str) or not (match := _DOF.fullmatch(point)):
        return None
    return int(match[1]) if match[1].isdigit() else match[1], match[3], -1 if match[2] == "-" else 1


def parse_place(point: float | str) -> tuple[str, float] | None:
    """Return shaft's name ("" for an only one) and position, m, of a point on a shaft; None for another point."""
    if not isinstance(point, str):
        return "", float(point)
    match = _CURVED_PLACE.fullmatch(point)
    return (match[1], float(match[2])) if match else None


def parse_direction(point: float | str) -> tuple[str, int] | None:
    """Return axis and sign of a point that names them, such as "12:-RZ" or "@0.4:RX"; None for a position alone.

    In addition to `AXES`, the axis of a point on a shaft may be KY or KZ, the curvature 1/m of its deflection along
    y or z, or KX, its twist per length, rad/m.
    """
    match = (_DOF.fullmatch(point) or _CURVED_PLACE.fullmatch(point)) if isinstance(point, str) else None
    if match is None or match.groups()[-1] is None:
        return None
    sign, axis = match.groups()[-2:]
    return axis, -1 if sign == "-" else 1


def is_rotation(point: float | str) -> bool:
    """Return True if a point's motion is an angle, rad."""
    return (parse_direction(point) or "Z")[0].startswith("R")


def in_other_plane(point: float | str) -> float | str:
    """Return a point as `Structure.in_other_plane` names it: y is the direction of vibration there.

    A position alone stays; RX becomes X, as the twist belongs to the structure that moves along z.
    """
    place, direction = parse_place(point), parse_direction(point)
    if place is None or direction is None:
        return point
    axis, sign = _SWAPPED.get(direction[0], ("X", 1))
    return f"{place[0]}@{place[1]!r}:{'-' if sign * direction[1] < 0 else ''}{axis}"


def along_axis(point: float | str, axis: str) -> float | str:
    """Return the degree of freedom of a point's node along another axis; the point itself if it is on a shaft."""
    dof = parse_dof(point)
    return point if dof is None else f"{dof[0]}:{axis}"


def dof_vector(point: float | str) -> np.ndarray:
    """Return (3,) unit vector of a translation, zeros for a rotation; shafts vibrate along Z."""
    axis, sign = parse_direction(point) or ("Z", 1)
    return np.array([sign * float(axis == other) for other in AXES[:3]])


def rocked(point: float | str, about: float = 0.0) -> float:
    """Return the motion of a point of the base along its axis per rad, where the base rocks about a position, m.

    It is 0 for degrees of freedom, whose positions along a shaft are not known.
    """
    place, (axis, sign) = parse_place(point), parse_direction(point) or ("Z", 1)
    return sign * {"Z": place[1] - about, "RY": -1.0}.get(axis, 0.0) if place else 0.0


def moved(point: float | str, distance: float) -> float | str:
    """Return a point shifted by a distance, m, along its shaft; a degree of freedom is unchanged."""
    place = parse_place(point)
    return with_number(point, place[1] + distance) if place else point


def ratios_of_modes(ratios: Sequence[float], n: int) -> np.ndarray:
    """Return (n,) damping ratios of modes: the last one holds for all that follow, none for none."""
    return np.array(ratios or (0.0,))[np.minimum(np.arange(n), max(len(ratios) - 1, 0))]


class PlaneCoupling(NamedTuple):
    """Coupling of the two bending planes of a turning shaft: the same rows hold in each plane."""

    polar: np.ndarray
    """(n_p, n) P: slopes times the root of their polar inertia, so that PᵀP q̇ Ω is the gyroscopic moment"""
    strain: np.ndarray
    """(n_s, n) S: strains of the shaft of unit energy, so that SᵀS is its stiffness without that of supports"""


@dataclass(frozen=True, eq=False)
class Assembly:
    """M q̈ + C q̇ + K q = P f - (M R) a: a linear structure in coordinates q of any kind, relative to its base.

    The damping is the sum of its four fields.
    """

    mass: Any
    """(n, n) M: an array or a scipy.sparse matrix"""
    stiffness: Any
    """(n, n) K: the same, symmetric; singular for a structure that can move without bending"""
    influence: np.ndarray
    """(n, 3) M R: inertia forces per unit acceleration of the base along X, Y and Z"""
    rows: Rows
    """displacements (n_points, n) of points per coordinate, along their own directions"""
    rayleigh: tuple[float, float] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): η1 M + η2 K"""
    ratios: tuple[float, ...] = ()
    """damping ratios of the modes, the last one for all that follow"""
    viscous: Any = None
    """(n, n) further damping, N s/m, perhaps not symmetric"""
    rocking: np.ndarray | None = None
    """(n,) inertia forces per unit angular acceleration of the base about x = 0; None where positions are not known"""
    turning: Callable[[], PlaneCoupling] | None = None
    """returns the coupling of the planes of a turning shaft; None where the structure does not know it"""
    reduced: bool = False
    """True if the coordinates are few already: Ritz functions or modes"""
    reduction: Literal["residual-flexibility", "craig-bampton"] = "residual-flexibility"
    """method of reduction: free modes and static shapes under forces, or fixed-interface modes and static shapes
    under displacements of the points"""
    cross: Any = None
    """(n, n) skew part of a stiffness that is not symmetric, N/m, in addition to K; None for none"""


class Structure(ABC):
    """A linear structure. Subclasses are frozen, `checked` data; `register` makes one known by its ``kind``."""

    known: ClassVar[dict[str, type[Structure]]] = {}
    """kinds that a rig file's [structure] may have"""
    files: ClassVar[tuple[str, ...]] = ()
    """fields that hold the name of a file, from the working folder; rig files name it from their own folder"""
    is_torsional: ClassVar[bool] = False
    """True if all coordinates are angles about the axes of rotation, or motions of teeth: a spin couples none"""

    @abstractmethod
    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return the structure's matrices.

        Parameters
        ----------
        points : tuple of Point
            Points where forces, masses and clearances act: shapes may have kinks there.
        modes : int
            Number of modes, for structures whose coordinates are modes.
        """

    @abstractmethod
    def check(self, point: float | str) -> None:
        """Raise a ValueError that says which points are valid if the structure has no such point.

        Parameters
        ----------
        point : Point
            The point to check. The message follows the field's name: "sensors[2].position ...".
        """

    def copied(self, folder: Path) -> Self:
        """Return the same structure, read from copies of its files.

        Parameters
        ----------
        folder : Path
            Folder of the copies; made if there are any.
        """
        data, copied_names = to_plain(self), set[str]()
        for field in self.files:
            if isinstance(name := getattr(self, field), str) and not is_embedded(name):
                filename = Path(name).name
                copy = folder / (f"{field}_{filename}" if filename in copied_names else filename)
                copied_names.add(filename)
                with replacing(copy) as temporary:
                    shutil.copyfile(name, temporary)
                data[field] = str(copy)
        return from_plain(type(self), data, "structure", RigError) if copied_names else self

    def saved_beside(self, path: Path) -> Self:
        """Return the same structure, with data that is only in memory saved next to a rig file.

        Parameters
        ----------
        path : Path
            The rig file.
        """
        return self

    def refusal(self, kind: str) -> str:
        """Return why an excitation's effect on the structure is not known, and a remedy; "" where it is known.

        Parameters
        ----------
        kind : str
            Kind of the excitation, "base" or "force".
        """
        return ""

    @property
    def named_points(self) -> tuple[str, ...]:
        """Its degrees of freedom, for examples; none where points are positions on shafts."""
        return ()

    @property
    def shafts(self) -> tuple[Any, ...]:
        """The `Shaft` or shafts that it is made of, for drawings and chains of links; none for matrices and modes."""
        return ()

    @property
    def in_other_plane(self) -> Structure | None:
        """The structure as it moves along y, of shafts, which know one plane; None where its points have directions."""
        return None

    @property
    def span(self) -> tuple[float, float]:
        """Start of its first shaft and end of its last one, m."""
        return min(shaft.start for shaft in self.shafts), max(shaft.end for shaft in self.shafts)

    def place(self, point: float | str) -> tuple[int, float]:
        """Return the number of the shaft that a point is on, and its position there, m.

        Parameters
        ----------
        point : Point
            Point that `check` takes, of a structure of shafts.
        """
        name, x = parse_place(point) or ("", 0.0)
        return next((i for i, shaft in enumerate(self.shafts) if shaft.name == name), 0), x

    @property
    def total_mass(self) -> float | None:
        """Mass in kg; None where a structure does not know it."""
        return None

    def coordinates(self, point: float | str) -> np.ndarray:
        """Return the position of a point, m (3,); zeros where it is not known.

        Parameters
        ----------
        point : Point
            Point that `check` takes.
        """
        place = parse_place(point)
        return np.array([place[1] if place else 0.0, 0.0, 0.0])


class StructureOfFiles(Structure):
    """A structure that keeps names of files, of fields in `files`: two are equal if all other fields are."""

    def _values(self) -> tuple[object, ...]:
        names = (f.name for f in dataclasses.fields(self))  # type: ignore[arg-type]
        return tuple(value for n in names if not (isinstance(value := getattr(self, n), str) and n in self.files))

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if isinstance(other, type(self)) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())
