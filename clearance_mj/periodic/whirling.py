"""Whirl that a turning shaft keeps up by itself, followed over its speed: in oil, by friction, by turning damping."""

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
from .continuation import Motion
from .following import farthest, follow, watched
from .onset import first_hopf
from .resolution import different_ends, resolution
from .vibrations import turned
from .whirl import WhirlSolver

__all__ = ["WHIRL", "WhirlOnset", "find_whirl_onset", "follow_whirl", "self_excited"]

# Guesses of backward whirls that friction in one bushing keeps up, as circles; see `rotors.rub`.


WHIRLS = 2000  # frequencies between which they are searched
LOWEST = 0.1  # of the lowest natural frequency


class DryGuess(NamedTuple):
    """A backward circle."""

    omega: float  #: 1/s
    whirl: np.ndarray  #: (n_rows,) complex amplitudes, m


def dry_guesses(system: Condensed, speed: float) -> list[DryGuess]:
    """Return whirls at a speed, rad/s, of a shaft that slides all around one bushing, by rising frequency of each.

    A force -k_c (ρ - δ)(1 ± i μ) that turns with the circle keeps it up where the receptance against it has
    Im h = -μ Re h, Re h < 0; with fewer than two planes alike the circle is a guess.
    """
    found, bushings = [], system.rig.bushings
    stiffest, _ = system.model.law.largest([bushing.gap for bushing in bushings])
    for j, (bushing, contact) in enumerate(zip(bushings, stiffest.tolist())):
        if not (bushing.is_round and bushing.friction and bushing.friction.coefficient):
            continue
        for omega in _frequencies(system, speed, j, bushing.friction.coefficient):
            moved = _moved(system, speed, j, omega)
            receptance = _receptance(system, moved, j)
            against = -(1 / receptance).real  # k_c (1 - δ/ρ)
            if 0 < against < contact:
                radius = bushing.gap / (1 - against / contact)
                found.append(DryGuess(omega, moved * radius / receptance))
    return found


def _moved(system: Condensed, speed: float, j: int, omega: float) -> np.ndarray:
    """Return amplitudes (n_rows,) per force that turns backward at bushing j: 1 along y, i along z, of e^(iωt)."""
    model, points, laws = system.driven.model, system.driven.points, system.laws
    first = len(system.rig.bushings) + 2 * j
    rows = (points[laws.rows[first]] + points[laws.rows[first + 1]]) / 2
    return np.asarray(points @ np.linalg.solve(model.dynamic(omega, speed), rows.T @ np.array([1.0, 1j])))


def _receptance(system: Condensed, moved: np.ndarray, j: int) -> complex:
    """Return the backward circle of bushing j in what moves."""
    y, z = moved[system.rig.clearance_rows[j]]
    return complex(y - 1j * z) / 2


def _frequencies(system: Condensed, speed: float, j: int, friction: float) -> list[float]:
    squares = np.linalg.eigvalsh(system.driven.model.elastic(speed))
    fastest = 2 * np.sqrt(max(system.stiffest, squares[0]) + squares[0])
    grid = np.geomspace(LOWEST * np.sqrt(squares[0]), fastest, WHIRLS)
    sense = 1.0 if speed > 0 else -1.0

    def driven(omega: float) -> float:
        found = _receptance(system, _moved(system, speed, j, omega), j)
        return found.imag - sense * friction * found.real  # of e^(iωt): the conjugate of that of y + i z

    value = np.array([driven(omega) for omega in grid])
    between = np.flatnonzero(value[1:] * value[:-1] < 0)
    return [float(brentq(driven, grid[i], grid[i + 1])) for i in between]


WHIRL = "whirl"
BEGINNINGS = ("rest", "dry")
SMALL = 0.02  # of the gap: the first whirl beyond the speed at which it begins


class WhirlOnset(NamedTuple):
    """Where rest gives way to whirl as a shaft turns faster."""

    speed: float  #: rad/s
    frequency: float  #: Hz, of the whirl that begins


@checks_kinds
def find_whirl_onset(model: Model, speed_range: tuple[float, float], n_modes: int = 8) -> WhirlOnset:
    """Find the speed at which a turning shaft begins to whirl by itself about its rest under gravity, films included.

    Parameters
    ----------
    model : Model
        Rig with ``spin``, and law, a `ConstantLaw` or a `ContactLaw`.
    speed_range : tuple of float
        Speeds of the shaft, rad/s, > 0: the first onset from the one to the other is found.
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
    found = first_hopf(self_excited(model, 1, n_modes, ends), ends)
    return WhirlOnset(found.speed, found.omega / (2 * np.pi))


def self_excited(model: Model, harmonics: int, modes: int, ends: tuple[float, float]) -> Condensed:
    """Return a turning shaft that nothing excites, condensed to its clearances; a RigError if it does not turn."""
    rig = model.rig
    if not rig.moves_across or rig.spin is None:
        raise RigError(f"rig {rig.name!r} does not turn, so nothing whirls; give [spin] and round bushings")
    return condensed(model, WHIRL, [], harmonics, modes, speed=max(ends))


@checks_kinds
def follow_whirl(
    model: Model,
    speed_range: tuple[float, float],
    begin: str = "rest",
    n_harmonics: int = 11,
    n_samples: int | None = None,
    n_modes: int = 8,
    stability: bool = True,
    watch: Callable[[float], None] | None = None,
    progress: bool = False,
) -> Branch:
    """Follow a whirl that nothing excites over the speed of the shaft; its frequency is found with it.

    Unbalances do not act. The branch begins where rest loses its stability, as in oil and with damping that turns, or
    with a backward whirl that friction keeps up, which no rest leads to.

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
        Find Floquet's multipliers of every point but the one that is always 1, and where the stability changes.
    watch : callable, optional
        Called with the speed, rad/s, of every point that is found; what it raises ends the search.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Branch
        ``over`` is "speed", ``frequency`` the whirl's, ``spin`` the shaft's speed.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes, another ``begin``, or if no whirl is found.
    RigError
        If the rig has no spin, no motion across z, or no clearance.
    ExcitationError
        For impossible speeds.
    """
    if begin not in BEGINNINGS:
        raise ClearanceError(f'begin must be "rest" or "dry", got {begin!r}')
    ends = different_ends(speed_range, "speed_range", "speeds", "rad/s")
    harmonics, counts = resolution(n_harmonics, n_samples, 1, n_modes)
    system = self_excited(model, harmonics, n_modes, ends)

    def found(count: int) -> Branch:
        motions, solver = (_out_of_rest if begin == "rest" else _dry)(system, harmonics, count, ends)
        return follow(solver, watched(motions, watch, 1.0), stability, progress)

    return farthest(found, counts)


def _out_of_rest(
    system: Condensed, harmonics: int, samples: int, ends: tuple[float, float]
) -> tuple[Iterator[Motion], WhirlSolver]:
    onset = first_hopf(system, ends)
    solver = WhirlSolver(system, harmonics, samples, onset.omega)
    rest, amplitude = np.zeros((2, solver.rows, solver.shape[1]))
    rest[:, :1] = onset.rest
    middles = onset.shape[: system.rig.n_rows]
    whirl = onset.shape * np.exp(-1j * np.angle(onset.shape[np.abs(onset.shape).argmax()])) / np.abs(middles).max()
    whirl *= SMALL * system.size
    amplitude[:, 1], amplitude[:, 2] = whirl.real, -whirl.imag
    z, small = system.basis.T @ rest, system.basis.T @ amplitude
    beside = rest + amplitude - system.basis @ (z + small)
    lead = np.angle(small[:, 1] - 1j * small[:, 2])[np.abs(small[:, 1] - 1j * small[:, 2]).argmax()]
    small, beside = turned(small, -lead), turned(beside, -lead)
    if (first := solver.grown(onset.speed, onset.omega, z, beside, small)) is None:
        raise ClearanceError(
            f"rig {system.rig.name!r}: the whirl that begins at {onset.speed:.6g} rad/s was not found; give more "
            "harmonics"
        )
    return solver.onwards(first, min(ends), max(ends)), solver


def _dry(
    system: Condensed, harmonics: int, samples: int, ends: tuple[float, float]
) -> tuple[Iterator[Motion], WhirlSolver]:
    for guess in dry_guesses(system, ends[0]):
        solver = WhirlSolver(system, harmonics, samples, guess.omega)
        place = np.zeros((solver.rows, solver.shape[1]))
        place[:, 1], place[:, 2] = guess.whirl.real, -guess.whirl.imag
        z = system.basis.T @ place
        first = solver.start(ends[0], guess.omega, z, place - system.basis @ z)
        if first is not None and solver.depth(first) > 0:
            return solver.within(first, min(ends), max(ends), ends[1] > ends[0]), solver
    raise ClearanceError(
        f"rig {system.rig.name!r}: friction keeps up no backward whirl at {ends[0]:g} rad/s; give more friction or "
        "less damping"
    )
