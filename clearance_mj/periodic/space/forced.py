"""Responses of rigs in space to a periodic excitation, and to unbalance over the speed of the shaft."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...core.errors import ExcitationError, RigError
from ...core.kinds import checks_kinds
from ...model import Model
from ...rig import Rig
from ..branch import Branch
from ..continuation import Motion
from ..following import farthest, follow, watched
from ..resolution import different_ends, resolution
from ..stability import samples_of_period
from .condensed import UNBALANCE, round_condensed
from .following import with_first_contacts
from .solver import RoundSolver

__all__ = ["excited_by", "follow_unbalance", "respond", "speeds_of", "steady_spin"]


def respond(
    model: Model, kind: str, levels: Sequence[complex], ends: tuple[float, float], harmonics: int,
    counts: Sequence[int], modes: int, stability: bool, watch: Callable[[float], None] | None, progress: bool,
) -> Branch:  # fmt: skip
    """Follow the response of a rig in space between two frequencies, 1/s; see `follow_response`."""
    spin = steady_spin(model.rig, kind)
    system = round_condensed(model, kind, levels, harmonics, modes, max(ends) if kind == UNBALANCE else spin)

    def found(count: int) -> Branch:
        solver = RoundSolver(system, harmonics, count, spin)
        touched: list[Motion] = []
        if stability:
            samples_of_period(solver, min(ends))  # refused before a branch is followed there
        motions = with_first_contacts(solver, solver.branch(*ends), touched)
        return follow(solver, watched(motions, watch), stability, progress, touched)

    return farthest(found, counts)


def steady_spin(rig: Rig, kind: str) -> float:
    """Return the spin at which a rig is excited, rad/s; 0 under unbalance, whose speed is given beside the rig.

    Raises
    ------
    RigError
        If it is not steady.
    ExcitationError
        If unbalances would act beside an excitation.
    """
    if kind == UNBALANCE:
        return 0.0
    if rig.spin and (rig.spin.rate or rig.spin.inertia):
        raise RigError(
            f"rig {rig.name!r}: a periodic vibration needs a steady speed; leave out spin.rate, spin.until and "
            "spin.inertia"
        )
    if rig.unbalances:
        raise ExcitationError(
            f"rig {rig.name!r}: unbalances at their own speed beside an excitation give no periodic vibration; leave "
            'out [[unbalances]], or use follow_unbalance or, of maps and commands, kind "unbalance"'
        )
    return rig.spin.speed if rig.spin else 0.0


@checks_kinds
def follow_unbalance(
    model: Model,
    speed_range: tuple[float, float],
    n_harmonics: int = 11,
    n_samples: int | None = None,
    n_modes: int = 8,
    stability: bool = True,
    factor: float = 1.0,
    watch: Callable[[float], None] | None = None,
    progress: bool = False,
) -> Branch:
    """Follow how a turning shaft vibrates under its unbalances from one speed to another, around folds.

    The shaft turns once in a period. Gyroscopic moments, damping that turns with the shaft, oil films and the slip of
    its surface follow the speed. The branch begins with the vibration that grows out of rest with the unbalances. What
    the rig's ``spin`` says is not used.

    Parameters
    ----------
    model : Model
        Rig in space with ``unbalances``, and law, a `ConstantLaw` or a `ContactLaw`.
    speed_range : tuple of float
        First and last speed of the shaft, rad/s, > 0; downwards too.
    n_harmonics : int
        Number of harmonics of the motion, H; a circle has one.
    n_samples : int, optional
        Number of samples of a turn, at least 4 H + 1; None: as in `follow_response`.
    n_modes : int
        Modes of each plane, to which static shapes are added.
    stability : bool
        Find Floquet's multipliers of every point, and locate where the stability changes.
    factor : float
        By which all unbalances of the rig are multiplied, > 0: the branch's ``level``.
    watch : callable, optional
        Called with the frequency, Hz, of every point that is found; what it raises ends the search.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        Its frequency is that of turning, ``spin`` the speed. If no next point was found, ``ended`` says where.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, or if not even the first point is found.
    RigError
        If the rig is planar, has no clearance or no unbalances, or in the gap moves without stiffness.
    ExcitationError
        For impossible speeds, or an impossible factor.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    """
    excited_by(model.rig, UNBALANCE)
    ends = speeds_of(speed_range)
    if not 0 < factor < np.inf:
        raise ExcitationError(f"factor of the unbalances must be > 0, got {factor!r}")
    harmonics, counts = resolution(n_harmonics, n_samples, 1, n_modes)
    return respond(model, UNBALANCE, [factor], ends, harmonics, counts, n_modes, stability, watch, progress)


def excited_by(rig: Rig, kind: str | None) -> str:
    """Return what excites a rig: what is asked for, or else its unbalances or, if it has none, its shaker.

    Raises
    ------
    ExcitationError
        For another kind.
    RigError
        If unbalance is asked for of a rig that does not turn, or has none.
    """
    if kind is None:
        return UNBALANCE if rig.unbalances else rig.shaker.kind
    if kind not in ("base", "force", UNBALANCE):
        raise ExcitationError(f'kind must be "base" or "force", or "unbalance" of a shaft in space, got {kind!r}')
    if kind == UNBALANCE and not rig.moves_across:
        raise RigError(f"rig {rig.name!r} is planar and does not turn; give [spin] and round bushings")
    if kind == UNBALANCE and not rig.unbalances:
        raise RigError(f"rig {rig.name!r} has no unbalances; give [[unbalances]] with a position and a moment")
    return kind


def speeds_of(speed_range: tuple[float, float]) -> tuple[float, float]:
    """Return both ends of a range of speeds, rad/s, or refuse it."""
    return different_ends(speed_range, "speed_range", "speeds", "rad/s")
