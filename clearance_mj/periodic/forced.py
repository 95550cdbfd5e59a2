"""The response of a rig to a periodic excitation over frequency, level, loads, gaps or spin."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..core.errors import ClearanceError, ExcitationError
from ..core.kinds import checks_kinds
from ..model import Model
from .branch import Branch
from .condensed import UNBALANCE, Condensed, condensed
from .continuation import PeriodicMotion
from .coverage import turned_back
from .excitation import excitation_kind, excited_by, levels_of, steady_spin
from .first_contact import with_first_contacts
from .following import farthest, follow, watched
from .resolution import different_ends, ends_of_range, pair_of, resolution
from .solver import Solver
from .stability import samples_of_period
from .starts import Start

__all__ = ["follow_response", "follow_response_over", "follow_response_over_level", "follow_unbalance"]

OVER = {"load": ("loads", "times those of the rig"), "gap": ("gaps", "times those of the rig"),
        "spin": ("speeds", "rad/s")}  # fmt: skip
"""Parameters of a branch at one frequency and level, with their names in messages and units."""


@checks_kinds
def follow_response(
    model: Model, amplitude: complex | Sequence[complex], frequency_range: tuple[float, float], n_harmonics: int = 21,
    n_samples: int | None = None, kind: str | None = None, n_modes: int = 8, stability: bool = True,
    watch: Callable[[float], None] | None = None, progress: bool = False,
) -> Branch:  # fmt: skip
    """Follow the periodic vibration of a rig from one frequency to another, around folds.

    Condensed harmonic balance: unknown are the harmonics of the displacements at the clearances, in which the laws'
    forces are sampled (alternating frequency-time). The branch begins with the vibration that grows out of rest with
    the level, and ends where it leaves the range of frequencies. If that does not converge, or ends or turns back in
    the first tenth of the range, another one is sought with fewer harmonics, then from nearby frequencies, by up to
    5 %, then from the modal engine's time integration.

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
        Compute the Floquet multipliers of every point, and locate where the stability changes.
    watch : callable, optional
        Called with the frequency, Hz, of every point; an exception that it raises ends the search.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        If the continuation fails, the branch so far: ``ended`` says where and at which level; or, if it turned back
        and left the range where it began, which part of the range it does not cover.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, or if not even the first point converges.
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
    levels, of_kind = levels_of(amplitude), excitation_kind(model.rig, kind)
    start, stop = ends_of_range(frequency_range)
    harmonics, counts = resolution(n_harmonics, n_samples, len(levels), n_modes)
    ends = 2 * np.pi * start, 2 * np.pi * stop
    return _continue(model, of_kind, levels, ends, harmonics, counts, n_modes, stability, watch, progress)


def _continue(
    model: Model, kind: str, levels: Sequence[complex], ends: tuple[float, float], harmonics: int,
    counts: Sequence[int], modes: int, stability: bool, watch: Callable[[float], None] | None, progress: bool,
) -> Branch:  # fmt: skip
    """Follow the response of a rig between two frequencies of its excitation, 1/s, or speeds of rotating parts."""
    spin = steady_spin(model.rig, kind)
    fastest = max(ends) if kind == UNBALANCE else spin
    system = condensed(model, kind, levels, harmonics, modes, speed=fastest)
    start, stop = (system.frequency_ratio * end for end in ends)

    def follow_with(count: int) -> Branch:
        solver = Solver(system, harmonics, count, spin)
        contacts: list[PeriodicMotion] = []
        if stability:
            samples_of_period(solver, min(start, stop))  # refused before a branch is followed there
        start_search = Start(solver, start, stop, lambda h: fewer(h, count))
        motions = with_first_contacts(solver, start_search.motions(), contacts)
        return follow(solver, watched(motions, watch), stability, progress, contacts)

    def fewer(h: int, count: int) -> Solver:
        return Solver(condensed(model, kind, levels, h, modes, speed=fastest), h, count, spin)

    return turned_back(farthest(follow_with, counts), ends[1] / (2 * np.pi))


# The response of a rig at one frequency over the level of a harmonic excitation, or over another number.


@checks_kinds
def follow_response_over_level(
    model: Model, frequency: float, amplitude_range: tuple[float, float], n_harmonics: int = 21,
    n_samples: int | None = None, kind: str | None = None, n_modes: int = 8, stability: bool = True,
    progress: bool = False,
) -> Branch:  # fmt: skip
    """Follow the periodic vibration of a rig at one frequency from one level to another, around folds.

    As `follow_response`, with amplitude and frequency exchanged: folds are the amplitudes at which a rig jumps that is
    driven louder and louder, or softer again.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    frequency : float
        Frequency of the excitation, Hz; of kind "unbalance" turns in a second.
    amplitude_range : tuple of float
        First and last amplitude of the excitation, m/s² or N, or factor of the unbalances; downwards too.
    n_harmonics : int
        Number of harmonics of the motion, H.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    kind : str, optional
        Kind of excitation, "base", "force" or "unbalance"; None: that of the rig's shaker.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    stability : bool
        Compute the Floquet multipliers of every point, and locate where the stability changes.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        Its ``over`` is "level". It begins with the vibration that grows out of rest with the level. If the
        continuation fails, the branch so far: ``ended`` says where and at which level, or which part a branch leaves
        out that turned back.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, or if not even the first point converges.
    ExcitationError
        For impossible levels or frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    start, stop = pair_of(amplitude_range, "amplitude_range", "")
    if not (0 < start < np.inf and 0 < stop < np.inf and start != stop):
        raise ExcitationError(f"amplitude_range must be two different amplitudes > 0, got {start:g} and {stop:g}")
    setting = BranchSettings(n_harmonics, n_samples, n_modes, stability, progress)
    return turned_back(_continue_over(model, "level", (1.0, stop / start), frequency, [start], kind, setting), stop)


@checks_kinds
def follow_response_over(
    model: Model, over: str, values: tuple[float, float], frequency: float, amplitude: complex | Sequence[complex],
    n_harmonics: int = 21, n_samples: int | None = None, kind: str | None = None, n_modes: int = 8,
    stability: bool = True, progress: bool = False,
) -> Branch:  # fmt: skip
    """Follow the periodic vibration of a rig at one frequency and level over its loads, gaps or spin, around folds.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    over : str
        "load": factor of all constant loads, weight too; "gap": factor of all gaps; "spin", rad/s.
    values : tuple of float
        First and last value, > 0; downwards too.
    frequency : float
        Frequency of the excitation, Hz; of kind "unbalance" turns in a second.
    amplitude : complex or sequence of complex
        As `follow_response` takes it; of kind "unbalance" the factor of the unbalances.
    n_harmonics : int
        Number of harmonics of the motion, H.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    kind : str, optional
        Kind of excitation, "base", "force" or "unbalance"; None: that of the rig's shaker.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    stability : bool
        Compute the Floquet multipliers of every point, and locate where the stability changes.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        Its ``share`` are the factors of loads or gaps, its ``spin`` the speeds. It begins with the vibration that grows
        out of rest with the level. If the continuation fails, the branch so far: ``ended`` says where, or which part
        a branch leaves out that turned back.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, if not even the first point converges, for another
        ``over`` or one that nothing of the rig depends on, or where a filling's dependence on the gap is not known.
    ExcitationError
        For impossible values, levels or frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    ClearanceError.require_known("over", over, OVER)
    ends = different_ends(values, "values", *OVER[over])
    if over == "spin" and kind == UNBALANCE:
        raise ExcitationError("an unbalance turns with the spin; use follow_unbalance")
    setting = BranchSettings(n_harmonics, n_samples, n_modes, stability, progress)
    return turned_back(_continue_over(model, over, ends, frequency, levels_of(amplitude), kind, setting), ends[1])


class BranchSettings(NamedTuple):
    """Numerical settings of a branch, as the public calls take them."""

    harmonics: int
    samples: int | None
    modes: int
    stability: bool
    progress: bool


def _continue_over(
    model: Model, over: str, ends: tuple[float, float], frequency: float, levels: Sequence[complex], kind: str | None,
    setting: BranchSettings,
) -> Branch:  # fmt: skip
    """Follow the response at one frequency over a field of an `OperatingPoint`: a factor of the rig, or the spin."""
    ExcitationError.require_positive(" Hz", frequency=frequency)
    harmonics, counts = resolution(setting.harmonics, setting.samples, len(levels), setting.modes)
    kind = excited_by(model, kind) if kind == UNBALANCE else excitation_kind(model.rig, kind)
    spin = steady_spin(model.rig, kind) if over != "spin" else ends[0]
    fastest = {"spin": max(ends)}.get(over, 2 * np.pi * frequency if kind == UNBALANCE else spin)
    system = condensed(model, kind, levels, harmonics, setting.modes, speed=fastest)
    _require_dependence(system, over)

    def motions(solver: Solver) -> Iterator[PeriodicMotion]:
        """Yield motions from the one that grows out of rest with the level at the first value."""
        omega = 2 * np.pi * frequency * (system.order or 1.0)
        solver.take("omega", solver.at._replace(**{over: ends[0]}))
        first = solver.first(omega)
        solver.raise_over(over, omega)
        motion = solver.solved_at(ends[0], first.z, first.y, first.scale)
        yield from solver.within(motion, min(ends), max(ends), ends[1] > ends[0])

    def follow_with(count: int) -> Branch:
        solver = Solver(system, harmonics, count, spin)
        contacts: list[PeriodicMotion] = []
        with_contacts = with_first_contacts(solver, motions(solver), contacts)
        return follow(solver, with_contacts, setting.stability, setting.progress, contacts)

    return farthest(follow_with, counts)


def _require_dependence(system: Condensed, over: str) -> None:
    """Raise ClearanceError for loads or a spin on which no vibration of the rig depends."""
    rig, driven = system.rig, system.driven
    if over == "load" and not driven.weight.any():
        raise ClearanceError(f"rig {rig.name!r} has no constant loads; give gravity or [[loads]]")
    turns = driven.turns or any(bushing.film or bushing.friction for bushing in rig.bushings)
    if over == "spin" and not (rig.moves_across and turns):
        raise ClearanceError(
            f"rig {rig.name!r}: no vibration depends on the spin; give [spin] and polar inertia, oil or friction"
        )


@checks_kinds
def follow_unbalance(
    model: Model, speed_range: tuple[float, float], n_harmonics: int = 11, n_samples: int | None = None,
    n_modes: int = 8, stability: bool = True, factor: float = 1.0, watch: Callable[[float], None] | None = None,
    progress: bool = False,
) -> Branch:  # fmt: skip
    """Follow the vibration of a shaft or gears under rotating excitations from one speed to another, around folds.

    Under unbalances the shaft turns once in a period; orders, and a law over time such as that of a mesh, which turns
    with the rig's ``spin``, have the shortest one that all of them share. Gyroscopic moments, damping that turns with
    the shaft, oil films and the slip of its surface follow the speed. The branch begins with the vibration that grows
    out of rest with the excitation. The rig's ``spin`` is not used otherwise.

    Parameters
    ----------
    model : Model
        Rig with ``unbalances`` or ``orders``, and law, a `ConstantLaw`, a `ContactLaw` or a `TimeLaw` with a period.
    speed_range : tuple of float
        First and last speed of the shaft, rad/s, > 0; downwards too.
    n_harmonics : int
        Number of harmonics of the motion, H; a circle has one.
    n_samples : int, optional
        Number of samples of a turn, at least 4 H + 1; None: as in `follow_response`.
    n_modes : int
        Modes of each plane, to which static shapes are added.
    stability : bool
        Compute the Floquet multipliers of every point, and locate where the stability changes.
    factor : float
        By which all unbalances and orders of the rig are multiplied, > 0: the branch's ``level``.
    watch : callable, optional
        Called with the frequency, Hz, of every point; an exception that it raises ends the search.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        Its frequency is that of turning, ``spin`` the speed. If the continuation fails, ``ended`` says where.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, or if not even the first point converges.
    RigError
        If the rig does not turn, has no clearance or no unbalances and orders, or in the gap moves without stiffness.
    ExcitationError
        For impossible speeds, or an impossible factor.
    LawError
        For a law over amplitude, one over time that does not turn with the shaft, or one that does not fit the rig.
    """
    excited_by(model, UNBALANCE)
    ends = different_ends(speed_range, "speed_range", "speeds", "rad/s")
    if not 0 < factor < np.inf:
        raise ExcitationError(f"factor of the unbalances must be > 0, got {factor!r}")
    harmonics, counts = resolution(n_harmonics, n_samples, 1, n_modes)
    return _continue(model, UNBALANCE, [factor], ends, harmonics, counts, n_modes, stability, watch, progress)
