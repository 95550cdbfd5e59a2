"""The level of first contact over frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from ..core.errors import ExcitationError
from ..core.kinds import checks_kinds
from ..linear.refusals import refuse_across
from ..model import Model
from .condensed import condensed
from .continuation import Motion, NoConvergence, Solver
from .forced import excitation_kind
from .in_gap import level_of_contact, linear_in_gap
from .resolution import resolution
from .two_parameter import Curve

__all__ = ["find_first_contact"]

BISECTIONS = 60  # of the step in which a gap is filled, at most


@checks_kinds
def find_first_contact(
    model: Model,
    frequencies: ArrayLike,
    kind: str | None = None,
    n_harmonics: int = 21,
    n_samples: int | None = None,
    n_modes: int = 8,
    progress: bool = False,
) -> Curve:
    """Find the level at which a wall is first touched, over frequency.

    In closed form where greases are linear in the gap; others are followed over the level until a gap is filled.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    frequencies : array_like
        (n,) Hz.
    kind : str, optional
        Kind of excitation, "base" or "force"; None: that of the rig's shaker.
    n_harmonics : int
        Number of harmonics of the motion, H.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Curve
        Its ``over`` is "level"; nan where no vibration fills a gap, ``ended`` says at which frequency first.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes.
    ExcitationError
        For impossible frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    refuse_across(model.rig, "find_first_contact")
    frequency = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if frequency.ndim != 1 or not frequency.size or not np.all((frequency > 0) & (frequency < np.inf)):
        raise ExcitationError("frequencies must be numbers > 0 Hz")
    harmonics, (samples, *_) = resolution(n_harmonics, n_samples, 1, n_modes)
    kind = excitation_kind(model.rig, kind)
    solver = Solver(condensed(model, kind, [1.0], harmonics, n_modes), harmonics, samples)
    omega = 2 * np.pi * frequency
    if linear_in_gap(solver):
        return Curve("first contact", "level", kind, frequency, level_of_contact(solver, omega), "")
    level = np.full(omega.size, np.nan)
    ended = ""
    for i, each in enumerate(tqdm(omega, desc="first contact", unit="frequency", disable=not progress)):
        try:
            level[i] = _level_of_contact(solver, float(each))
        except NoConvergence as failed:
            where = f"{frequency[i]:.6g} Hz and level {failed.args[0]:g}"
            ended = ended or f"no further periodic vibration was found beyond {where}"
    return Curve("first contact", "level", kind, frequency, level, ended)


def _level_of_contact(solver: Solver, omega: float) -> float:
    """The level at which a vibration that grows out of rest fills a gap."""
    left, moved = solver.over_level(omega)
    walls = np.repeat(np.abs([bushing.walls for bushing in solver.system.rig.bushings]).min(axis=1), 2)

    def reach(motion: Motion) -> float:
        return float(np.max(np.abs(solver.ends(motion)) / walls[:, None]))

    linear = solver.system.linear.basis @ -left + moved
    count = len(solver.system.rig.bushings)
    least = 0.1 / float(np.max(np.abs(linear[count:] @ solver.grid.basis.T) / walls[:, None]))
    scale = max(least * float(np.linalg.norm(left)), solver.least)
    motion = solver.solved_at(least, -least * left, least * moved, scale)
    before = after = motion
    for after in solver.within(motion, 1e-3 * least, 1e6 * least):
        if reach(after) > 1:
            break
        before = after
    else:
        raise NoConvergence(before.omega)
    low, high = 0.0, 1.0
    way = (after.z - before.z, after.omega - before.omega)
    for _ in range(BISECTIONS):
        length = (low + high) / 2
        at = before.omega + length * way[1]
        found = solver.solved_at(at, before.z + length * way[0], before.y, before.scale)
        low, high = (low, length) if reach(found) > 1 else (length, high)
        if (high - low) * abs(way[1]) < 1e-9 * at:
            break
    return float(before.omega + (low + high) / 2 * way[1])
