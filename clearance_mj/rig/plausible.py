"""Numbers of a rig file that were meant in another unit: millimetres where the file takes metres."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from os import PathLike

from ..core.errors import RigError
from ..structure import Structure
from ..structure.base import is_rotation, parse_place
from ..structure.shaft import Shaft
from .clearance import Bushing

__all__ = ["ImplausibleRig", "check_units", "warn_of_units"]

MAX_MASS = 1e7  # kg of a shaft: ten times the heaviest rotors and girders; mm for m makes 1e9 times of any mass
MAX_THICKNESS = 5.0  # of a shaft's length; what is thicker is a disc
MAX_SLENDERNESS = 3e4  # length over thickness: a wire of 0.1 mm may be 3 m long, a drill string 3 km


class ImplausibleRig(RigError, UserWarning):
    """A rig that nobody builds: a warning in Python, where odd rigs may be wanted; the command line refuses it."""


def check_units(linear: Structure, bushings: Sequence[Bushing]) -> None:
    """Refuse shafts that nobody builds, and bushings wider than a round shaft in them, with the unit that was meant.

    Raises
    ------
    ImplausibleRig
        If a shaft's mass or proportions, or a gap, are those of a file in millimetres.
    """
    for shaft in linear.shafts:
        _check_shaft(shaft)
    for i, bushing in enumerate(bushings):
        if parse_place(bushing.position) and not is_rotation(bushing.position):
            number, x = linear.place(bushing.position)
            _check_gap(i, bushing, linear.shafts[number], x)


def warn_of_units(path: str | PathLike[str], linear: Structure, bushings: Sequence[Bushing]) -> None:
    """Warn of dimensions in a rig file that `check_units` refuses."""
    try:
        check_units(linear, bushings)
    except ImplausibleRig as error:
        warnings.warn(ImplausibleRig(f"{path}: {error}"), stacklevel=3)


def _check_shaft(shaft: Shaft) -> None:
    thickness, length, mass = max(map(_thickness, shaft.sections)), shaft.length, shaft.total_mass
    size = max(length, thickness)
    name = f'shaft "{shaft.name}"' if shaft.name else "a shaft"
    absurd = mass > MAX_MASS or not 1 / MAX_THICKNESS < length / thickness < MAX_SLENDERNESS
    if absurd and size > 1:  # what is smaller was not meant in mm
        weight = f"{mass / 1e3:,.0f} t" if mass >= 1e4 else f"{mass:.3g} kg"
        raise ImplausibleRig(
            f"{name} {length:g} m long and {thickness:g} m thick weighs {weight}: lengths are in metres, "
            f"and {size:g} mm is {size / 1e3:g}"
        )


def _check_gap(i: int, bushing: Bushing, shaft: Shaft, x: float) -> None:
    section = next((s for s, end in zip(shaft.sections, shaft.edges[1:]) if x <= end), shaft.sections[-1])
    radius = max(section.diameter) / 2 if section.diameter else math.inf
    if bushing.gap > radius:
        raise ImplausibleRig(
            f"bushings[{i}].gap {bushing.gap:g} m is wider than the shaft's radius, {radius:g} m, at {bushing.where}: "
            f"gaps are radial, in metres, and {bushing.gap:g} mm is {bushing.gap / 1e3:g}"
        )


def _thickness(section: object) -> float:
    sizes = [getattr(section, name) for name in ("diameter", "width", "height")]
    return max(max(size) for size in sizes if size)
