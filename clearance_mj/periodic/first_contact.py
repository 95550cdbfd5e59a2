"""First contact: the level of it over frequency, and the motions at which contact begins or ends along a branch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from tqdm import tqdm

from ..core.errors import ExcitationError
from ..core.kinds import checks_kinds
from ..model import Model
from .continuation import NoConvergence, PeriodicMotion, difference
from .excitation import excitation_kind
from .in_gap import level_of_contact, linear_in_gap
from .map_rows import solver_at
from .resolution import resolution
from .solver import Solver
from .two_parameter import Curve

__all__ = ["find_first_contact", "with_first_contacts"]

GRAZES = 2e-4  # of a gap
EXACT = 1e-7  # of a step: accuracy of the beginning of contact


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
    if (motion_at_wall := _grazing(solver, before, after)) is None:
        raise NoConvergence(after.parameter)
    return motion_at_wall.parameter


def with_first_contacts(
    solver: Solver, motions: Iterator[PeriodicMotion], contacts: list[PeriodicMotion]
) -> Iterator[PeriodicMotion]:
    """Yield consecutive motions, and those where contact begins or ends, which are appended to a list, too."""
    pending, depth_before = list[PeriodicMotion](), 0.0  # what grazes may be the motion before
    try:
        for motion in motions:
            depth = solver.depth(motion.parameter, motion.z, motion.y)
            if pending and (depth_before > 0) != (depth > 0):
                if (between := _grazing(solver, pending[0], motion)) is not None:
                    contacts.append(between)
                    pending += [between] if between is not pending[0] and between is not motion else []
            yield from pending
            pending, depth_before = [motion], depth
    except NoConvergence:
        yield from pending
        raise
    yield from pending


def _grazing(solver: Solver, before: PeriodicMotion, after: PeriodicMotion) -> PeriodicMotion | None:
    """Return the motion that grazes a wall, between one with contact and one without."""
    chord = difference(before, after)
    length = float(np.linalg.norm(chord))
    known = {share: (solver.depth(at.parameter, at.z, at.y), at) for share, at in ((0.0, before), (1.0, after))}

    def depth(fraction: float) -> float:
        if fraction not in known:
            if (motion := solver.ahead(before, fraction * length, chord / length)) is None:
                raise ArithmeticError
            known[fraction] = solver.depth(motion.parameter, motion.z, motion.y), motion
        return known[fraction][0]

    try:
        return known[brentq(depth, 0.0, 1.0, xtol=EXACT)][1]
    except (ArithmeticError, KeyError):  # at a corner nothing lies in between
        nearest, motion = min(known.values(), key=lambda each: abs(each[0]))
        return motion if abs(nearest) < GRAZES * solver.system.size else None
