"""The response of a rig to a periodic excitation over frequency."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..core.errors import ExcitationError
from ..core.kinds import checks_kinds
from ..linear.refusals import refuse_across
from ..model import Model
from ..rig import Rig
from .branch import Branch
from .condensed import condensed
from .continuation import Motion, Solver
from .following import farthest, follow, watched
from .resolution import different_ends, pair_of, resolution
from .space.forced import respond
from .stability import samples_of_period

__all__ = ["ends_of_range", "excitation_kind", "follow_response", "follow_response_over_level"]


@checks_kinds
def follow_response(
    model: Model,
    amplitude: complex | Sequence[complex],
    frequency_range: tuple[float, float],
    n_harmonics: int = 21,
    n_samples: int | None = None,
    kind: str | None = None,
    n_modes: int = 8,
    stability: bool = True,
    watch: Callable[[float], None] | None = None,
    progress: bool = False,
) -> Branch:
    """Follow the periodic vibration of a rig from one frequency to another, around folds.

    Condensed harmonic balance: unknown are the harmonics of the displacements at the clearances, in which the laws'
    forces are sampled (alternating frequency-time). The branch begins with the vibration that grows out of rest with
    the level, and ends where it leaves the range of frequencies.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    amplitude : complex or sequence of complex
        Amplitude of the excitation, m/s² or N, or those of its harmonics from the first on.
    frequency_range : tuple of float
        First and last frequency, Hz; downwards too.
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
    watch : callable, optional
        Called with the frequency, Hz, of every point that is found; what it raises ends the search.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        If no next point was found, the branch so far: ``ended`` says where and at which level.

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

    Notes
    -----
    M. Krack and J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019.
    """
    levels = _levels(amplitude)
    start, stop = ends_of_range(frequency_range)
    harmonics, counts = resolution(n_harmonics, n_samples, len(levels), n_modes)
    if model.rig.moves_across:
        ends = 2 * np.pi * start, 2 * np.pi * stop
        of_kind = excitation_kind(model.rig, kind)
        return respond(model, of_kind, levels, ends, harmonics, counts, n_modes, stability, watch, progress)
    system = condensed(model, excitation_kind(model.rig, kind), levels, harmonics, n_modes)

    def found(count: int) -> Branch:
        solver = Solver(system, harmonics, count)
        if stability:
            samples_of_period(solver, 2 * np.pi * min(start, stop))  # refused before a branch is followed there
        motions = solver.branch(2 * np.pi * start, 2 * np.pi * stop)
        return follow(solver, watched(motions, watch), stability, progress)

    return farthest(found, counts)


def excitation_kind(rig: Rig, kind: str | None) -> str:
    """Return the kind of an excitation that was asked for, or the shaker's."""
    kind = rig.shaker.kind if kind is None else kind
    if kind not in ("base", "force"):
        raise ExcitationError(f'kind must be "base" or "force", got {kind!r}')
    return kind


def _levels(amplitude: complex | Sequence[complex]) -> list[complex]:
    try:
        levels = [complex(each) for each in np.atleast_1d(np.asarray(amplitude))]
    except (TypeError, ValueError):
        raise ExcitationError(f"amplitude must be a number or those of several harmonics, got {amplitude!r}") from None
    if not levels or not np.isfinite(levels).all() or not any(levels):
        raise ExcitationError(f"amplitude must be finite and not zero, got {amplitude!r}")
    return levels


def ends_of_range(frequency_range: tuple[float, float]) -> tuple[float, float]:
    """Return both ends of a range of frequencies, Hz, or refuse it."""
    return different_ends(frequency_range, "frequency_range", "frequencies", "Hz")


# The response of a rig at one frequency over the level of a harmonic excitation.


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
    refuse_across(model.rig, "follow_response_over_level")
    start, stop = pair_of(amplitude_range, "amplitude_range", "")
    if not (0 < start < np.inf and 0 < stop < np.inf and start != stop):
        raise ExcitationError(f"amplitude_range must be two different amplitudes > 0, got {start:g} and {stop:g}")
    ExcitationError.require_positive(" Hz", frequency=frequency)
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
