"""Points whose relative motion clearances limit and probes read, where housings or the base's feet move."""

from __future__ import annotations

from ..core.plain_numbers import with_number
from ..structure.attached import foot, housing_of
from ..structure.base import along_axis, in_other_plane, parse_direction, parse_place
from .clearance import Bushing

__all__ = ["joined_points", "moved_points", "probe_point"]

_Points = tuple[float | str, ...]


def joined_points(number: int, bushing: Bushing, points: _Points, feet_move: bool) -> _Points:
    """Return a point and the one that it moves against, left out where that is a base that does not move.

    Parameters
    ----------
    number : int
        The bushing's, from 0.
    bushing : Bushing
        The bushing.
    points : tuple of Point
        In its middle or at an end of it; the second is that of the part that it is on.
    feet_move : bool
        True if the base moves below the rig, as a fixture with modes does.
    """
    if len(points) > 1:
        return points
    if bushing.housing:
        return (*points, housing_of(number))
    return (*points, foot(points[0])) if feet_move else points


def moved_points(bushing: Bushing, points: _Points) -> list[tuple[str, _Points]]:
    """Return for each row of a clearance the axis, "Y" or "Z", of the plane that moves it, and its points there.

    Parameters
    ----------
    bushing : Bushing
        The bushing.
    points : tuple of Point
        As of `joined_points`. Those on shafts are named as `base.in_other_plane` does in the plane along y.
    """
    if bushing.is_round:
        return [(axis, tuple(along_axis(point, axis) for point in points)) for axis in "YZ"]
    across = parse_place(bushing.position) and (parse_direction(bushing.position) or "Z")[0] in ("Y", "RZ")
    return [("Y", tuple(map(in_other_plane, points))) if across else ("Z", points)]


def probe_point(number: int, bushing: Bushing, place: float | None, feet_move: bool) -> _Points:
    """Return the point that a bushing's displacement probe looks at, and the one that the probe is fixed to.

    Parameters
    ----------
    number : int
        The bushing's, from 0.
    bushing : Bushing
        The bushing.
    place : float, optional
        m, along the shaft; the clearance's middle if it is None.
    feet_move : bool
        True if the base moves below the rig.
    """
    middle = bushing.joined
    fixed_to = joined_points(number, bushing, middle, feet_move)[1:]
    if bushing.housing and bushing.housing.probe == "base":
        fixed_to = (foot(middle[0]),) if feet_move else ()
    return (middle[0] if place is None else with_number(middle[0], place), *fixed_to)
