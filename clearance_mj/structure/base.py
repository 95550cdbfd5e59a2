"""What a linear structure is: matrices in some coordinates, and what any of its points does in them.

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
    "AXES",
    "POINT_SCHEMA",
    "SHAFT_NAME",
    "Assembly",
    "Point",
    "Rows",
    "Structure",
    "StructureOfFiles",
    "Turning",
    "along_axis",
    "check_point",
    "dof_vector",
    "in_other_plane",
    "is_rotation",
    "moved",
    "parse_direction",
    "parse_dof",
    "parse_place",
    "ratios_of_modes",
    "rocked",
]

_DOF = re.compile(r"([0-9]{1,9}|[A-Za-z_][\w.-]*):([+-]?)(R?[XYZ])")
SHAFT_NAME = r"\w[\w -]*"  # Pattern of the name of one of several shafts.
_PLACE = re.compile(
    rf"({SHAFT_NAME}|(?=@[^:]+:))@([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{{1,3}})?)(?::([+-]?)(R?[XYZ]))?"
)
_CURVED_PLACE = re.compile(_PLACE.pattern.replace("R?[XYZ]", "[RK]?[XYZ]"))  # curvatures are of sensors alone
_SWAPPED = {"Y": ("Z", 1), "Z": ("Y", 1), "RY": ("RZ", -1), "RZ": ("RY", -1), "KY": ("KZ", 1), "KZ": ("KY", 1)}


def check_point(value: object) -> float | str:
    """Return a point, or say what one is."""
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
        f'must be a number, m along the shaft, or a text: a degree of freedom "12:+Z" or a shaft\'s "inner@0.4" or '
        f'"@0.4:RX", '
        f"got {shown if len(shown) < 100 else f'{shown[:80]} ...'}"
    )


POINT_SCHEMA = {
    "anyOf": [{"type": "number"}, {"type": "string", "pattern": rf"^({_DOF.pattern})$|^({_PLACE.pattern})$"}]
}
Point: TypeAlias = Annotated[float | str, PlainValidator(check_point), WithJsonSchema(POINT_SCHEMA)]
"""A number, m along the shaft; or a degree of freedom "12:+Z"; or a position on one of several shafts "inner@0.4", or a
direction there, "@0.4:RX" """


Made = TypeVar("Made", bound="type[Structure]")


def register(structure: Made) -> Made:
    """Let rig files say ``[structure] kind = "..."``; a decorator for classes with a field ``kind``.

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
    found = _DOF.fullmatch(point) if isinstance(point, str) else None
    return (
        (int(found[1]) if found[1].isdigit() else found[1], found[3], -1 if found[2] == "-" else 1) if found else None
    )


def parse_place(point: float | str) -> tuple[str, float] | None:
    """Name of the shaft ("" where there is but one) and position, m, of a point on a shaft; None for another point."""
    if not isinstance(point, str):
        return "", float(point)
    found = _CURVED_PLACE.fullmatch(point)
    return (found[1], float(found[2])) if found else None


def parse_direction(point: float | str) -> tuple[str, int] | None:
    """Return axis and sign of a point that names them, such as "12:-RZ" or "@0.4:RX"; None for a position alone.

    Beside those of `AXES`, the axis of a point on a shaft may be KY or KZ, the curvature 1/m of its deflection along
    y or z, or KX, its twist per length, rad/m.
    """
    found = (_DOF.fullmatch(point) or _CURVED_PLACE.fullmatch(point)) if isinstance(point, str) else None
    if found is None or found.groups()[-1] is None:
        return None
    sign, axis = found.groups()[-2:]
    return axis, -1 if sign == "-" else 1


def is_rotation(point: float | str) -> bool:
    """Return whether a point's motion is an angle, rad."""
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
    """Return the degree of freedom along an axis of a node of which a point names another one; else the point."""
    dof = parse_dof(point)
    return point if dof is None else f"{dof[0]}:{axis}"


def dof_vector(point: float | str) -> np.ndarray:
    """Return (3,) unit vector of a translation, zeros for a rotation; shafts vibrate along Z."""
    axis, sign = parse_direction(point) or ("Z", 1)
    return np.array([sign * float(axis == other) for other in AXES[:3]])


def rocked(point: float | str, about: float = 0.0) -> float:
    """Return how far a point of the base moves per rad, along its axis, where the base rocks about a position, m.

    That is 0 of degrees of freedom, whose places along a shaft are not known.
    """
    place, (axis, sign) = parse_place(point), parse_direction(point) or ("Z", 1)
    return sign * {"Z": place[1] - about, "RY": -1.0}.get(axis, 0.0) if place else 0.0


def moved(point: float | str, distance: float) -> float | str:
    """Return a point some way, m, along its shaft; a degree of freedom stays what it is."""
    place = parse_place(point)
    return with_number(point, place[1] + distance) if place else point


def ratios_of_modes(ratios: Sequence[float], n: int) -> np.ndarray:
    """Return (n,) damping ratios of modes: the last one holds for all that follow, none for none."""
    return np.array(ratios or (0.0,))[np.minimum(np.arange(n), max(len(ratios) - 1, 0))]


class Turning(NamedTuple):
    """What couples the two bending planes of a shaft that turns: the same rows hold in each plane."""

    polar: np.ndarray
    """(n_p, n) P: slopes times the root of the polar inertia that has them, so that PᵀP q̇ Ω is the gyroscopic moment"""
    strain: np.ndarray
    """(n_s, n) S: strains of the shaft of unit energy, so that SᵀS is its own stiffness, without that of supports"""


@dataclass(frozen=True, eq=False)
class Assembly:
    """M q̈ + C q̇ + K q = P f - (M R) a: a linear structure in coordinates q of any kind, relative to its base.

    The damping is the sum of what its four fields say.
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
    """(n,) inertia forces per unit angular acceleration of the base about x = 0; None where places are not known"""
    turning: Callable[[], Turning] | None = None
    """finds what couples the planes of a shaft that turns; None where the structure does not tell it"""
    reduced: bool = False
    """whether the coordinates are few already: Ritz functions or modes"""
    reduction: Literal["residual-flexibility", "craig-bampton"] = "residual-flexibility"
    """how many coordinates become few: free modes and static shapes under forces, or held modes and static shapes
    under displacements of the points"""
    cross: Any = None
    """(n, n) skew part of a stiffness that is not symmetric, N/m, beside K; None for none"""


class Structure(ABC):
    """What is linear in a rig. Subclasses are frozen, `checked` data; `register` makes one known by its ``kind``."""

    known: ClassVar[dict[str, type[Structure]]] = {}
    """kinds that a rig file's [structure] may have"""
    files: ClassVar[tuple[str, ...]] = ()
    """fields that hold the name of a file, from the working folder; rig files name it from their own folder"""
    is_torsional: ClassVar[bool] = False
    """whether all that moves are angles about axes of turning, and ways of teeth: a spin couples none of them"""

    @abstractmethod
    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return the structure's matrices.

        Parameters
        ----------
        points : tuple of Point
            Points where forces, masses and clearances act: the coordinates must be able to kink there.
        modes : int
            Number of modes that are wanted, for structures whose coordinates are modes.
        """

    @abstractmethod
    def check(self, point: float | str) -> None:
        """Raise a ValueError, which says what would be right, if the structure has no such point.

        Parameters
        ----------
        point : Point
            What may be none of its points. The text follows the field's name: "sensors[2].position ...".
        """

    def copied(self, folder: Path) -> Self:
        """Return the same structure, read from copies of its files.

        Parameters
        ----------
        folder : Path
            Folder of the copies; made if there are any.
        """
        data, taken = to_plain(self), set[str]()
        for field in self.files:
            if isinstance(name := getattr(self, field), str) and not is_embedded(name):
                own = Path(name).name
                copy = folder / (f"{field}_{own}" if own in taken else own)
                taken.add(own)
                with replacing(copy) as temporary:
                    shutil.copyfile(name, temporary)
                data[field] = str(copy)
        return from_plain(type(self), data, "structure", RigError) if taken else self

    def saved_beside(self, path: Path) -> Self:
        """Return the same structure, what it has only in memory read from a file beside a rig file.

        Parameters
        ----------
        path : Path
            The rig file.
        """
        return self

    def refusal(self, kind: str) -> str:
        """Return why an excitation's effect on the structure is not known, and what would help; "" where it is.

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
        """Where the first of its shafts begins and the last one ends, m."""
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
        """Mass in kg; None where a structure does not tell it."""
        return None

    def coordinates(self, point: float | str) -> np.ndarray:
        """Return where a point is, m (3,); zeros where nothing is known of it.

        Parameters
        ----------
        point : Point
            Point that `check` takes.
        """
        place = parse_place(point)
        return np.array([place[1] if place else 0.0, 0.0, 0.0])


class StructureOfFiles(Structure):
    """A structure that keeps names of files, of fields in `files`: two are equal if all but these names is."""

    def _values(self) -> tuple[object, ...]:
        names = (f.name for f in dataclasses.fields(self))  # type: ignore[arg-type]
        return tuple(value for n in names if not (isinstance(value := getattr(self, n), str) and n in self.files))

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if isinstance(other, type(self)) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())
