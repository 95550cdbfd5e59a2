"""Self-excited whirl of a turning shaft over its speed: oil whirl, dry friction whirl, rotating damping."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core.errors import ClearanceError, RigError
from ..core.kinds import checks_kinds
from ..model import Model
from .branch import Branch
from .condensed import Condensed, condensed
from .continuation import PeriodicMotion
from .following import farthest, follow, watched
from .onset import first_hopf
from .resolution import different_ends, resolution
from .vibrations import turned
from .whirl import WhirlSolver

__all__ = ["WHIRL", "WhirlOnset", "find_whirl_onset", "follow_whirl", "self_excited"]

# Guesses of backward whirls sustained by friction in one bushing, as circles; see `rotors.rub`.


WHIRLS = 2000  # frequencies sampled in the search
LOWEST = 0.1  # of the lowest natural frequency


class DryGuess(NamedTuple):
    """A circular backward whirl."""

    omega: float  #: 1/s
    whirl: np.ndarray  #: (n_rows,) complex amplitudes, m


def dry_guesses(system: Condensed, speed: float) -> list[DryGuess]:
    """Return circular whirls at a speed, rad/s, with full annular rub in one bushing, by rising frequency of each.

    A rotating force -k_c (ρ - δ)(1 ± i μ) sustains the circle where its receptance has Im h = -μ Re h, Re h < 0;
    unless both planes are equal the circle is a guess.
    """
    guesses, bushings = [], system.rig.bushings
    stiffest, _ = system.model.law.largest([bushing.gap for bushing in bushings])
    for j, (bushing, contact) in enumerate(zip(bushings, stiffest.tolist())):
        if not (bushing.is_round and bushing.friction and bushing.friction.coefficient):
            continue
        for omega in _whirl_frequencies(system, speed, j, bushing.friction.coefficient):
            moved = _backward_response(system, speed, j, omega)
            receptance = _backward_receptance(system, moved, j)
            k_dynamic = -(1 / receptance).real  # k_c (1 - δ/ρ)
            if 0 < k_dynamic < contact:
                radius = bushing.gap / (1 - k_dynamic / contact)
                guesses.append(DryGuess(omega, moved * radius / receptance))
    return guesses


def _backward_response(system: Condensed, speed: float, j: int, omega: float) -> np.ndarray:
    """Return amplitudes (n_rows,) per backward rotating force at bushing j: 1 along y, i along z, of e^(iωt)."""
    model, points, laws = system.driven.model, system.driven.points, system.laws
    rows = points[laws.rows_of(j)[1:]].sum(axis=0) / 2
    return np.asarray(points @ np.linalg.solve(model.dynamic(omega, speed), rows.T @ np.array([1.0, 1j])))


def _backward_receptance(system: Condensed, moved: np.ndarray, j: int) -> complex:
    """Return the backward circular component of the response at bushing j."""
    y, z = moved[system.rig.clearance_rows[j]]
    return complex(y - 1j * z) / 2


def _whirl_frequencies(system: Condensed, speed: float, j: int, friction: float) -> list[float]:
    squares = np.linalg.eigvalsh(system.driven.model.elastic(speed))
    fastest = 2 * np.sqrt(max(system.stiffest, squares[0]) + squares[0])
    grid = np.geomspace(LOWEST * np.sqrt(squares[0]), fastest, WHIRLS)
    sense = 1.0 if speed > 0 else -1.0

    def driven(omega: float) -> float:
        h = _backward_receptance(system, _backward_response(system, speed, j, omega), j)
        return h.imag - sense * friction * h.real  # of e^(iωt): the conjugate of that of y + i z

    value = np.array([driven(omega) for omega in grid])
    between = np.flatnonzero(value[1:] * value[:-1] < 0)
    return [float(brentq(driven, grid[i], grid[i + 1])) for i in between]


WHIRL = "whirl"
SMALL = 0.02  # of the gap: amplitude of the first whirl beyond its onset


class WhirlOnset(NamedTuple):
    """Onset of self-excited whirl."""

    speed: float  #: rad/s
    frequency: float  #: Hz, of the whirl that begins


@checks_kinds
def find_whirl_onset(model: Model, speed_range: tuple[float, float], n_modes: int = 8) -> WhirlOnset:
    """Find the onset speed of a shaft's self-excited whirl about its equilibrium under gravity, films included.

    Parameters
    ----------
    model : Model
        Rig with ``spin``, and law, a `ConstantLaw` or a `ContactLaw`.
    speed_range : tuple of float
        Speeds of the shaft, rad/s, > 0: the first onset from the one to the other is returned.
    n_modes : int
        Modes of each plane, to which static shapes are added.

    Raises
    ------
    ClearanceError
        If no whirl begins between the speeds, or the shaft comes to rest at none of them.
    RigError
        If the rig has no spin, no motion across z, or no clearance.
    ExcitationError
        For impossible speeds.
    """
    ends = different_ends(speed_range, "speed_range", "speeds", "rad/s")
    onset = first_hopf(self_excited(model, 1, n_modes, ends), ends)
    return WhirlOnset(onset.speed, onset.value.imag / (2 * np.pi))


def self_excited(model: Model, harmonics: int, modes: int, ends: tuple[float, float]) -> Condensed:
    """Return a turning shaft without excitation, condensed to its clearances; RigError if it does not turn."""
    rig = model.rig
    if not rig.moves_across or rig.spin is None:
        raise RigError(f"rig {rig.name!r} does not turn, so nothing whirls; give [spin] and round bushings")
    return condensed(model, WHIRL, [], harmonics, modes, speed=max(ends))


@checks_kinds
def follow_whirl(
    model: Model, speed_range: tuple[float, float], begin: str = "rest", n_harmonics: int = 11,
    n_samples: int | None = None, n_modes: int = 8, stability: bool = True,
    watch: Callable[[float], None] | None = None, progress: bool = False,
) -> Branch:  # fmt: skip
    """Follow a self-excited whirl over the speed of the shaft; its frequency is an unknown.

    Unbalances do not act. The branch begins where the equilibrium loses its stability, as in oil and with rotating
    damping, or with a backward whirl sustained by friction, which does not grow out of rest.

    Parameters
    ----------
    model : Model
        Rig with ``spin``, and law, a `ConstantLaw` or a `ContactLaw`.
    speed_range : tuple of float
        Speeds of the shaft, rad/s, > 0. A whirl out of rest begins at the first onset from the one to the other and is
        followed as it grows; a dry one begins at the first speed.
    begin : str
        "rest" or "dry".
    n_harmonics : int
        Number of harmonics of the motion, H; a circle has one.
    n_samples : int, optional
        Number of samples of a whirl, at least 4 H + 1; None: as in `follow_response`.
    n_modes : int
        Modes of each plane, to which static shapes are added.
    stability : bool
        Compute the Floquet multipliers of every point but the one that is always 1, and locate changes of stability.
    watch : callable, optional
        Called with the speed, rad/s, of every point; an exception that it raises ends the search.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        ``over`` is "speed", ``frequency`` the whirl's, ``spin`` the shaft's speed.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, another ``begin``, or without a whirl.
    RigError
        If the rig has no spin, no motion across z, or no clearance.
    ExcitationError
        For impossible speeds.
    """
    if begin not in ("rest", "dry"):
        raise ClearanceError(f'begin must be "rest" or "dry", got {begin!r}')
    ends = different_ends(speed_range, "speed_range", "speeds", "rad/s")
    harmonics, counts = resolution(n_harmonics, n_samples, 1, n_modes)
    system = self_excited(model, harmonics, n_modes, ends)

    def follow_with(count: int) -> Branch:
        motions, solver = (_start_at_onset if begin == "rest" else _start_dry)(system, harmonics, count, ends)
        return follow(solver, watched(motions, watch, 1.0), stability, progress)

    return farthest(follow_with, counts)


def _start_at_onset(
    system: Condensed, harmonics: int, samples: int, ends: tuple[float, float]
) -> tuple[Iterator[PeriodicMotion], WhirlSolver]:
    onset = first_hopf(system, ends)
    omega = onset.value.imag
    solver = WhirlSolver(system, harmonics, samples, omega)
    rest, amplitude = np.zeros((2, solver.rows, solver.shape[1]))
    rest[:, :1] = onset.place
    middles = onset.shape[: system.rig.n_rows]
    whirl = onset.shape * np.exp(-1j * np.angle(onset.shape[np.abs(onset.shape).argmax()])) / np.abs(middles).max()
    whirl *= SMALL * system.size
    amplitude[:, 1], amplitude[:, 2] = whirl.real, -whirl.imag
    z, small = system.basis.T @ rest, system.basis.T @ amplitude
    remainder = rest + amplitude - system.basis @ (z + small)
    fundamental = small[:, 1] - 1j * small[:, 2]
    phase = np.angle(fundamental[np.abs(fundamental).argmax()])
    small, remainder = turned(small, -phase), turned(remainder, -phase)
    if (first := solver.solve_onset(onset.speed, omega, z, remainder, small)) is None:
        raise ClearanceError(
            f"rig {system.rig.name!r}: the whirl that begins at {onset.speed:.6g} rad/s was not found; give more "
            "harmonics"
        )
    return solver.onwards(first, min(ends), max(ends)), solver


def _start_dry(
    system: Condensed, harmonics: int, samples: int, ends: tuple[float, float]
) -> tuple[Iterator[PeriodicMotion], WhirlSolver]:
    for guess in dry_guesses(system, ends[0]):
        solver = WhirlSolver(system, harmonics, samples, guess.omega)
        place = np.zeros((solver.rows, solver.shape[1]))
        place[:, 1], place[:, 2] = guess.whirl.real, -guess.whirl.imag
        first = solver.start(ends[0], guess.omega, *system.split(place))
        if first is not None and solver.depth(first) > 0:
            return solver.within(first, min(ends), max(ends), ends[1] > ends[0]), solver
    raise ClearanceError(
        f"rig {system.rig.name!r}: friction keeps up no backward whirl at {ends[0]:g} rad/s; give more friction or "
        "less damping"
    )
