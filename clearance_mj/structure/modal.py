"""A structure with point masses and springs, reduced to modes and static shapes."""

from __future__ import annotations

import functools
from typing import NamedTuple, TypeAlias

import numpy as np

from .base import LinearModel, Rows, Structure, dof_vector, ratios_of_modes
from .reduction import reduced

__all__ = ["Reduction", "reduction"]

COUPLING = 1e-12  # of the largest damping: damping between modes that rounding explains
_Loads: TypeAlias = tuple[tuple[float | str, float], ...]  # points, each with a factor


class Reduction(NamedTuple):
    """A structure with point masses, reduced to modes and static shapes; fields as of `beam.ModalModel`."""

    omega: np.ndarray
    damping: np.ndarray
    coupling: np.ndarray
    influence: np.ndarray  # (n_coordinates, 3) as of `LinearModel`, with the point masses
    rows: Rows
    transform: np.ndarray  # (n_coordinates, n)


@functools.lru_cache(maxsize=16)  # a large structure's holds megabytes
def reduction(
    structure: Structure,
    joined: tuple[tuple[float | str, ...], ...],
    masses: _Loads,
    forces: _Loads,
    springs: tuple[float, ...],
    modes: int,
) -> Reduction:
    """Reduce a structure with masses, and springs at its clearances, which join one point to the base or two points."""
    points = [point for pair in joined for point in pair] + [point for point, _ in (*masses, *forces)]
    linear = structure.assemble(tuple(dict.fromkeys(points)), modes)
    rows = linear.rows
    clearances = [rows(pair[:1])[0] - (rows(pair[1:])[0] if len(pair) > 1 else 0.0) for pair in joined]
    loads = clearances + [factor * rows([point])[0] for point, factor in forces]
    held, influence = [], linear.influence.copy()
    for point, mass in masses:
        at = rows([point])[0]
        held.append((mass, at))
        influence += mass * np.outer(at, dof_vector(point))
    found = reduced(linear, held, [*zip(springs, clearances)], loads, modes)
    transform = found.shapes
    if structure.shafts:
        last = structure.shafts[-1]
        tip = rows([f"{last.name}@{last.end!r}" if last.name else last.end])[0] @ transform
        transform = transform * np.where(tip < 0, -1.0, 1.0)
    return Reduction(found.omega, *_damping(linear, found.omega, transform), influence, rows, transform)


def _damping(linear: LinearModel, omega: np.ndarray, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Damping of each mode, and what couples them."""
    eta1, eta2 = linear.rayleigh
    damping = eta1 + eta2 * omega**2
    damping = damping + 2 * omega * ratios_of_modes(linear.ratios, omega.size)
    if linear.viscous is None:
        return damping, np.zeros((0, 0))
    viscous = shapes.T @ (linear.viscous @ shapes)
    damping = damping + viscous.diagonal()
    viscous = (viscous + viscous.T) / 2 - np.diag(viscous.diagonal())
    return damping, viscous if np.any(np.abs(viscous) > COUPLING * damping.max(initial=0.0)) else np.zeros((0, 0))
