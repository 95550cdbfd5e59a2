"""Self-excited whirl of a turning shaft over its speed: oil whirl, dry friction whirl, rotating damping."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core.errors import ClearanceError, RigError
from ..core.kinds import checks_kinds
from ..model import Model
from .branch import Branch
from .condensed import Condensed, condensed
from .continuation import Continuation, PeriodicMotion
from .dynamics import by_stiffness
from .following import farthest, follow, watched
from .onset import first_hopf
from .resolution import different_ends, resolution
from .solver import OperatingPoint, Solver
from .vibrations import turned

__all__ = ["WHIRL", "WhirlOnset", "find_whirl_onset", "follow_whirl", "self_excited"]

NEARBY = 1e-6  # relative step of the difference quotients by frequency and speed
WHIRLS = 2000  # frequencies sampled in the search for backward whirls sustained by friction
LOWEST = 0.1  # of the lowest natural frequency: where it begins
WHIRL = "whirl"
SMALL = 0.02  # of the gap: amplitude of the first whirl beyond its onset


class WhirlSolver(Continuation):
    """Newton's method and continuation of a periodic motion without excitation, along the shaft's speed.

    Unknown are the harmonics of the coordinates and the whirl's frequency, in metres over a frequency of reference.
    The coordinate ``leader`` has no sine in its fundamental.
    """

    def __init__(self, system: Condensed, harmonics: int, samples: int, reference: float):
        self.inner = Solver(system, harmonics, samples)
        self.inner.linear = by_stiffness(system.driven)
        self.inner.take("omega", self.state(0.0))
        self.system, self.harmonics, self.samples, self.rows = system, harmonics, samples, self.inner.rows
        self.grid, self.least, self.leader = self.inner.grid, self.inner.least, 0
        self.laws, self.shape = self.inner.laws, (system.basis.shape[1], 2 * harmonics + 1)
        self.over = self.over_name = "speed"
        self.reference = reference / system.size
        self.size = self.inner.size + 1
        self.jacobian = np.zeros((self.size + 1, self.size + 1))

    def parts(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        """Return frequency, 1/s, and harmonics (r, K) of the coordinates, m, of the unknowns."""
        return float(z[-1]) * self.reference, z[:-1].reshape(self.shape)

    def unknowns(self, omega: float, z: np.ndarray) -> np.ndarray:
        """Return the unknowns of a frequency and harmonics."""
        return np.append(z.ravel(), omega / self.reference)

    def frequency(self, motion: PeriodicMotion) -> float:
        """Return the whirl's angular frequency, 1/s."""
        return self.parts(motion.z)[0]

    def state(self, parameter: float) -> OperatingPoint:
        """Return the state at a speed; its frequency is left at 0."""
        return OperatingPoint(0.0, parameter, 1.0, 0.0, 1.0)

    def walls_at(self, parameter: float) -> None:
        """Leave the walls where they stand: speed does not move them."""

    def all_points(self, motion: PeriodicMotion) -> np.ndarray:
        """Return the harmonics (n_rows, K) of all rows, m."""
        return np.asarray(self.system.basis @ self.parts(motion.z)[1] + motion.y)

    def depth(self, motion: PeriodicMotion) -> float:
        """Return the largest penetration, m, below 0 in the gap."""
        return self.inner.depth(0.0, self.parts(motion.z)[1], motion.y)

    def forced_multipliers(self, values: np.ndarray) -> np.ndarray:
        """Return the Floquet multipliers but the one that is always 1, as the phase of a whirl is free."""
        return np.delete(values, np.abs(values - 1).argmin())

    def _balance(self, speed: float, omega: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        self.inner.equations.fixed[1] = speed
        return self.inner._residual(omega, z, y, diff)

    def _residual(self, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        omega, harmonics = self.parts(z)
        if not omega > 0:
            return np.full(self.size, np.inf), y, y
        residual, force, y_new = self._balance(parameter, omega, harmonics, y, diff)
        if diff:
            inner, full, n = self.inner.jacobian, self.jacobian, self.size - 1
            full[:n, :n] = inner[:n, :n]
            for column, speed, w in ((n, parameter, omega * (1 + NEARBY)), (n + 1, parameter * (1 + NEARBY), omega)):
                difference = self._balance(speed, w, harmonics, y, False)[0] - residual
                full[:n, column] = difference.ravel() / (NEARBY * (parameter if column > n else omega / self.reference))
            full[n:] = 0.0
            full[n, self.leader * harmonics.shape[1] + 2] = 1.0
        return np.append(residual, harmonics[self.leader, 2]), force, y_new

    def solve_onset(
        self, speed: float, omega: float, z: np.ndarray, y: np.ndarray, amplitude: np.ndarray
    ) -> PeriodicMotion | None:
        """Return the whirl of a small amplitude, harmonics (r, K), at its onset, with the tangent to larger ones.

        The speed of that amplitude is solved for; None if Newton's method fails.
        """
        self.leader = int(np.abs(amplitude[:, 1]).argmax())
        row = np.append(self.unknowns(0.0, amplitude), 0.0)
        row /= np.linalg.norm(row)
        whirl = self.solve(speed, self.unknowns(omega, z + amplitude), y, row, self.least)
        if whirl is None:
            return None
        return replace(whirl, tangent=whirl.tangent * (np.sign(whirl.tangent @ row) or 1.0))

    def start(self, speed: float, omega: float, z: np.ndarray, y: np.ndarray) -> PeriodicMotion | None:
        """Return the whirl at a speed, near a guess of frequency and harmonics; None if Newton's method fails."""
        fundamental = z[:, 1] - 1j * z[:, 2]
        self.leader = int(np.abs(fundamental).argmax())
        turn = -np.angle(fundamental[self.leader])
        shifted = turned(z, turn), turned(y, turn)
        row = np.append(np.zeros(self.size), 1.0)
        return self.solve(speed, self.unknowns(omega, shifted[0]), shifted[1], row, self.scale_of(z))


# Guesses of backward whirls sustained by friction in one bushing, as circles; see `rotors.rub`.


def _dry_guesses(system: Condensed, speed: float) -> Iterator[tuple[float, np.ndarray]]:
    """Yield circular whirls at a speed, rad/s, with full annular rub in one bushing, by rising frequency of each.

    Of each the frequency, 1/s, and complex amplitudes (n_rows,), m. A rotating force -k_c (ρ - δ)(1 ± i μ) sustains the
    circle where its receptance has Im h = -μ Re h, Re h < 0; unless both planes are equal the circle is a guess.
    """
    stiffest, _ = system.model.law.largest([bushing.gap for bushing in system.rig.bushings])
    for j, (bushing, contact) in enumerate(zip(system.rig.bushings, stiffest.tolist())):
        if not (bushing.is_round and bushing.friction and bushing.friction.coefficient):
            continue
        for omega in _whirl_frequencies(system, speed, j, bushing.friction.coefficient):
            moved = _backward_response(system, speed, j, omega)
            receptance = _backward_receptance(system, moved, j)
            k_dynamic = -(1 / receptance).real  # k_c (1 - δ/ρ)
            if 0 < k_dynamic < contact:
                radius = bushing.gap / (1 - k_dynamic / contact)
                yield omega, moved * radius / receptance


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
    for omega, whirl in _dry_guesses(system, ends[0]):
        solver = WhirlSolver(system, harmonics, samples, omega)
        place = np.zeros((solver.rows, solver.shape[1]))
        place[:, 1], place[:, 2] = whirl.real, -whirl.imag
        first = solver.start(ends[0], omega, *system.split(place))
        if first is not None and solver.depth(first) > 0:
            return solver.within(first, min(ends), max(ends), ends[1] > ends[0]), solver
    raise ClearanceError(
        f"rig {system.rig.name!r}: friction keeps up no backward whirl at {ends[0]:g} rad/s; give more friction or "
        "less damping"
    )
