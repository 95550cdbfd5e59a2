"""The response of a rig at one frequency over the level of a harmonic excitation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..core.errors import ExcitationError
from ..core.kinds import checks_kinds
from ..model import Model
from ..rig.dimensions import planar
from .branch import Branch
from .condensed import condensed
from .continuation import Motion, Solver
from .following import farthest, follow
from .forced import excitation_kind
from .resolution import pair_of, resolution

__all__ = ["follow_response_over_level"]


@checks_kinds
def follow_response_over_level(
    model: Model,
    frequency: float,
    amplitude_range: tuple[float, float],
    n_harmonics: int = 21,
    n_samples: int | None = None,
    kind: str | None = None,
    n_modes: int = 8,
    stability: bool = True,
    progress: bool = False,
) -> Branch:
    """Follow the periodic vibration of a rig at one frequency from one level to another, around folds.

    As `follow_response`, with amplitude and frequency exchanged: folds are the amplitudes at which a rig jumps that is
    driven louder and louder, or softer again.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    frequency : float
        Frequency of the excitation, Hz.
    amplitude_range : tuple of float
        First and last amplitude of the excitation, m/s² or N; downwards too.
    n_harmonics : int
        Number of harmonics of the motion, H.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    kind : str, optional
        Kind of excitation, "base" or "force"; None: that of the rig's shaker.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    stability : bool
        Find Floquet's multipliers of every point, and locate where the stability changes.
    progress : bool
        Show a progress bar.

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
    planar(model.rig, "follow_response_over_level")
    start, stop = pair_of(amplitude_range, "amplitude_range", "")
    if not (0 < start < np.inf and 0 < stop < np.inf and start != stop):
        raise ExcitationError(f"amplitude_range must be two different amplitudes > 0, got {start:g} and {stop:g}")
    if not 0 < frequency < np.inf:
        raise ExcitationError(f"frequency must be > 0 Hz, got {frequency!r}")
    harmonics, counts = resolution(n_harmonics, n_samples, 1, n_modes)
    system = condensed(model, excitation_kind(model.rig, kind), [start], harmonics, n_modes)

    def found(count: int) -> Branch:
        solver = Solver(system, harmonics, count)
        return follow(solver, _louder(solver, 2 * np.pi * frequency, stop / start), stability, progress)

    return farthest(found, counts)


def _louder(solver: Solver, omega: float, stop: float) -> Iterator[Motion]:
    """Motions at shares of the level from 1 to another one."""
    first = solver.first(omega)
    solver.over_level(omega)
    motion = solver.solved_at(1.0, first.z, first.y, first.scale)
    yield from solver.within(motion, min(1.0, stop), max(1.0, stop), stop > 1.0)
