"""Truncation error at the clearances of a structure given by modes.

Their flexibility is in series with the contact: one of stiffness k acts as one of k / (1 + k R), so a model without R
has contacts that are too stiff by k R. Where R was not measured it is estimated from how the modes converge: the
truncated ones are assumed to move the clearance as much as the upper half of the known ones on average, at frequencies
that continue their growth, ω_i = a i^q. The sum of φ²/ω² over i > n is then φ² ζ(2q, n + 1) / a², with Hurwitz' zeta
function; q is 2 for bending of shafts and 1 for plates, and limited to this range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.special

from .base import Structure
from .modes import ModalStructure

__all__ = ["Truncation", "find_truncation"]

MIN_MODES = 3  # bending modes from which convergence can be seen
GROWTH = 1.0, 2.0  # exponents with which frequencies grow with the number of the mode: of plates and of shafts


class _Contact(Protocol):
    @property
    def stiffness(self) -> float: ...


class _Clearance(Protocol):
    @property
    def joined(self) -> tuple[float | str, ...]: ...
    @property
    def contact(self) -> _Contact: ...
    @property
    def where(self) -> str: ...


class _Rig(Protocol):
    @property
    def linear(self) -> Structure: ...
    @property
    def bushings(self) -> Sequence[_Clearance]: ...


@dataclass(frozen=True)
class Truncation:
    """Static flexibility at one clearance, m/N, and its missing part."""

    where: str
    """the clearance"""
    kept: float
    """of the modes"""
    residual: float
    """of the residual flexibility that the structure has"""
    missing: float
    """estimated, of the truncated modes; nan where too few modes are known"""
    stiffness_error: float
    """relative error of the datasheet's contact stiffness: k R of the missing part"""


def find_truncation(rig: _Rig) -> tuple[Truncation, ...]:
    """Estimate the truncation error at each clearance of a rig whose structure is given by modes.

    Parameters
    ----------
    rig : Rig
        The rig.

    Returns
    -------
    tuple of Truncation
        One per clearance; none for structures of shafts and matrices, whose static shapes are complete.
    """
    structure = rig.linear
    if not isinstance(structure, ModalStructure):
        return ()
    return tuple(_estimate(structure, clearance) for clearance in rig.bushings)


def _estimate(structure: ModalStructure, clearance: _Clearance) -> Truncation:
    points = clearance.joined
    side = np.array([1.0, -1.0])[: len(points)]
    kept, residual = (float(side @ part @ side) for part in structure.flexibility(points))
    if all(structure.has_residual(point) for point in points):
        missing = 0.0
    else:
        shape = side @ structure.assemble(points, 0).rows(points)[:, : structure.omega.size]
        missing = max(_tail_flexibility(shape, structure.omega) - residual, 0.0)
    return Truncation(clearance.where, kept, residual, missing, clearance.contact.stiffness * missing)


def _tail_flexibility(shape: np.ndarray, omega: np.ndarray) -> float:
    """Estimate the sum of φ²/ω² over the modes that follow the known ones."""
    shape, omega = shape[omega > 0], omega[omega > 0]
    n = omega.size
    if n < MIN_MODES:
        return math.nan
    upper = np.arange(n // 2, n)
    growth = float(np.clip(np.polyfit(np.log(upper + 1), np.log(omega[upper]), 1)[0], *GROWTH))
    first = omega[-1] / n**growth
    return float(np.mean(shape[upper] ** 2) * scipy.special.zeta(2 * growth, n + 1) / first**2)
