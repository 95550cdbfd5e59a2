"""The response of a rig at one frequency over the level of a harmonic excitation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..clearance.law import Law
from ..core.errors import ExcitationError
from ..rig import Rig
from .branch import Branch
from .condensed import condensed
from .continuation import Motion, NoConvergence, Solver
from .following import farthest, follow
from .forced import excitation_kind, resolution

__all__ = ["response_over_level"]


def response_over_level(
    rig: Rig,
    law: Law,
    frequency: float,
    levels: tuple[float, float],
    harmonics: int = 21,
    samples: int | None = None,
    kind: str | None = None,
    modes: int = 8,
    stability: bool = True,
) -> Branch:
    """Follow the periodic vibration of a rig at one frequency from one level to another, around folds.

    As `response`, with level and frequency exchanged: folds are the levels at which a rig jumps that is driven louder
    and louder, or softer again.

    Parameters
    ----------
    rig : Rig
        The rig.
    law : Law
        What acts in its clearances: a `ConstantLaw` or a `ContactLaw`.
    frequency : float
        Of the excitation, Hz.
    levels : tuple of float
        Amplitudes of the excitation, from and to, m/s² or N; downwards too.
    harmonics : int
        Of the motion.
    samples : int, optional
        Of a period; None: the power of two from 12 times the harmonics on, and four times as many where vibrations
        end early with them.
    kind : str, optional
        "base" or "force"; None: as the rig's shaker.
    modes : int
        Of the Ritz basis, as in the modal engine.
    stability : bool
        Find Floquet's multipliers of every point, and locate where the stability changes.

    Returns
    -------
    Branch
        Its ``over`` is "level". It begins with the vibration that grows out of rest with the level. If no next point
        was found, the branch so far: ``ended`` says where and at which level.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, or if not even the first point is found.
    ExcitationError
        For impossible levels or frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    try:
        start, stop = map(float, levels)
    except (TypeError, ValueError):
        raise ExcitationError(f"levels are a pair (from, to), got {levels!r}") from None
    if not (0 < start < np.inf and 0 < stop < np.inf and start != stop):
        raise ExcitationError(f"levels must be two different ones > 0, got {start:g} and {stop:g}")
    if not 0 < frequency < np.inf:
        raise ExcitationError(f"frequency must be > 0 Hz, got {frequency!r}")
    harmonics, counts = resolution(harmonics, samples, 1, modes)
    system = condensed(rig, law, excitation_kind(rig, kind), [start], harmonics, modes)

    def found(count: int) -> Branch:
        solver = Solver(system, harmonics, count)
        return follow(solver, _louder(solver, 2 * np.pi * frequency, stop / start), stability)

    return farthest(found, counts)


def _louder(solver: Solver, omega: float, stop: float) -> Iterator[Motion]:
    """Motions at shares of the level from 1 to another one."""
    first = solver.first(omega)
    solver.over_level(omega)
    motion = solver.solve(1.0, first.z, first.y, np.append(np.zeros(solver.size), 1.0), first.scale)
    if motion is None:
        raise NoConvergence(1.0)
    yield from solver.within(motion, min(1.0, stop), max(1.0, stop), stop > 1.0)
