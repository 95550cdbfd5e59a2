"""A structure with point masses and springs, reduced to modes and static shapes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from .attached import Attached, assemble, with_masses
from .base import PlaneCoupling, Rows, Structure
from .reduction import modal_damping, reduced, vibration_modes

__all__ = ["Reduction", "reduction"]

SKEW = 1e-9  # of the largest damping: skew parts within rounding
COUPLING = 1e-12  # of the largest damping: damping between modes within rounding
NOTHING = Attached()
_Loads: TypeAlias = tuple[tuple[float | str, float], ...]  # points, each with a factor


class Reduction(NamedTuple):
    """A structure with point masses, reduced to modes and static shapes; fields as of `linear.LinearModel`."""

    omega: np.ndarray
    damping: np.ndarray
    coupling: np.ndarray
    influence: np.ndarray  # (n_q, 3) as of `Assembly`, with the point masses
    rows: Rows
    transform: np.ndarray  # (n_q, n)
    turning: Callable[[], PlaneCoupling] | None = None  # in the coordinates, as of `Assembly`
    springs: np.ndarray = np.zeros((0, 0))  # skew part of the stiffness


@functools.lru_cache(maxsize=16)  # a large structure's holds megabytes
def reduction(
    structure: Structure, joined: tuple[tuple[float | str, ...], ...], masses: _Loads, forces: _Loads,
    springs: tuple[float, ...], modes: int, attached: Attached = NOTHING, supports: _Loads = (),
) -> Reduction:  # fmt: skip
    """Reduce a structure with masses, and with springs at its clearances, between two points or a point and the base.

    ``supports`` are springs from points to the base.
    """
    if attached:
        acting = [tuple(zip(pair, (1.0, -1.0))) for pair in joined]
        acting += [((point, factor),) for point, factor in (*forces, *((point, 1.0) for point, _ in supports))]
        combined = assemble(structure, attached, masses, acting, modes)
        clearances = [np.array([1.0, -1.0])[: len(pair)] @ combined.rows(pair) for pair in joined]
        spring_rows = [*zip(springs, clearances), *((k, combined.rows([point])[0]) for point, k in supports)]
        stiffness = combined.stiffness + sum(k * np.outer(row, row) for k, row in spring_rows)
        omega, shapes = vibration_modes(combined.mass, stiffness)
        transform = _orient(structure, combined.rows, shapes)
        viscous, cross = (transform.T @ matrix @ transform for matrix in (combined.viscous, combined.cross))
        return Reduction(
            omega, *_split_damping(viscous), combined.influence, combined.rows, transform, combined.turning,
            cross if combined.cross.any() else np.zeros((0, 0)),
        )  # fmt: skip
    points = [point for pair in joined for point in pair] + [point for point, _ in (*masses, *forces, *supports)]
    linear = structure.assemble(tuple(dict.fromkeys(points)), modes)
    rows = linear.rows
    clearances = [rows(pair[:1])[0] - (rows(pair[1:])[0] if len(pair) > 1 else 0.0) for pair in joined]
    held_at = [rows([point])[0] for point, _ in supports]
    loads = clearances + [factor * rows([point])[0] for point, factor in forces] + held_at
    added, influence = with_masses(linear, masses)
    basis = reduced(linear, added, [*zip(springs, clearances), *zip((k for _, k in supports), held_at)], loads, modes)
    transform = _orient(structure, rows, basis.shapes)
    cross = np.zeros((0, 0)) if linear.cross is None else transform.T @ (linear.cross @ transform)
    damping = _split_damping(modal_damping(linear, basis.omega, transform))
    return Reduction(basis.omega, *damping, influence, rows, transform, linear.turning, cross)


def _orient(structure: Structure, rows: Rows, transform: np.ndarray) -> np.ndarray:
    """Return shapes of a shaft with the sign that makes them positive at its last position."""
    if not structure.shafts:
        return transform
    last = structure.shafts[-1]
    tip = rows([f"{last.name}@{last.end!r}" if last.name else last.end])[0] @ transform
    return np.asarray(transform * np.where(tip < 0, -1.0, 1.0))


def _split_damping(viscous: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the damping of each mode, and the coupling part of a damping matrix."""
    damping = viscous.diagonal().copy()
    skew, largest = (viscous - viscous.T) / 2, np.abs(viscous).max(initial=0.0)
    coupling = (viscous + viscous.T) / 2 - np.diag(damping)
    if np.any(np.abs(skew) > SKEW * largest):
        coupling += skew
    return damping, coupling if np.any(np.abs(coupling) > COUPLING * damping.max(initial=0.0)) else np.zeros((0, 0))
