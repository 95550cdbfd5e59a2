"""The level of first contact over frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from ..core.errors import ExcitationError
from ..core.kinds import checks_kinds
from ..model import Model
from .continuation import NoConvergence
from .excitation import excitation_kind
from .first_contacts import grazing
from .in_gap import level_of_contact, linear_in_gap
from .map_rows import solver_at
from .resolution import resolution
from .solver import Solver
from .two_parameter import Curve

__all__ = ["find_first_contact"]


@checks_kinds
def find_first_contact(
    model: Model, frequencies: ArrayLike, kind: str | None = None, n_harmonics: int = 21, n_samples: int | None = None,
    n_modes: int = 8, progress: bool = False,
) -> Curve:  # fmt: skip
    """Find the level at which a wall is first touched, over frequency.

    In closed form where greases are linear in the gap; others are continued over the level until a gap is filled.

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
    frequency = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if frequency.ndim != 1 or not frequency.size or not np.all((frequency > 0) & (frequency < np.inf)):
        raise ExcitationError("frequencies must be numbers > 0 Hz")
    harmonics, (samples, *_) = resolution(n_harmonics, n_samples, 1, n_modes)
    kind, omega = excitation_kind(model.rig, kind), 2 * np.pi * frequency
    solver = solver_at(model, kind, 1.0, float(omega.max()), harmonics, samples, n_modes)
    if linear_in_gap(solver):
        return Curve("first contact", "level", kind, frequency, level_of_contact(solver, omega), "")
    level = np.full(omega.size, np.nan)
    ended = ""
    for i, w in enumerate(tqdm(omega, desc="first contact", unit="frequency", disable=not progress)):
        try:
            level[i] = _level_of_contact(solver, float(w))
        except NoConvergence as error:
            where = f"{frequency[i]:.6g} Hz and level {error.args[0]:g}"
            ended = ended or f"no further periodic vibration was found beyond {where}"
    return Curve("first contact", "level", kind, frequency, level, ended)


def _level_of_contact(solver: Solver, omega: float) -> float:
    """Return the level at which a vibration that grows out of rest fills a gap."""
    motion = solver.growing(omega)
    if solver.touches(motion):
        return 0.0
    before = after = motion
    for after in solver.within(motion, 1e-3 * motion.parameter, 1e6 * motion.parameter):
        if solver.touches(after):
            break
        before = after
    else:
        raise NoConvergence(before.parameter)
    if (motion_at_wall := grazing(solver, before, after)) is None:
        raise NoConvergence(after.parameter)
    return motion_at_wall.parameter
