"""Guesses of backward whirls that friction in one bushing keeps up, as circles; see `rotors.rub`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from .condensed import RoundCondensed

__all__ = ["DryGuess", "dry_guesses"]

WHIRLS = 2000  # frequencies between which they are searched
LOWEST = 0.1  # of the lowest natural frequency


class DryGuess(NamedTuple):
    """A backward circle."""

    omega: float  #: 1/s
    whirl: np.ndarray  #: (2 n_points,) complex amplitudes, m


def dry_guesses(system: RoundCondensed, speed: float) -> list[DryGuess]:
    """Return whirls at a speed, rad/s, of a shaft that slides all around one bushing, by rising frequency of each.

    A force -k_c (ρ - δ)(1 ± i μ) that turns with the circle keeps it up where the receptance against it has
    Im h = -μ Re h, Re h < 0; with fewer than two planes alike the circle is a guess.
    """
    found, bushings = [], system.rig.bushings
    stiffest, _ = system.model.law.largest([bushing.gap for bushing in bushings])
    for j, (bushing, contact) in enumerate(zip(bushings, stiffest.tolist())):
        if bushing.friction is None or not bushing.friction.coefficient:
            continue
        for omega in _frequencies(system, speed, j, bushing.friction.coefficient):
            moved = _moved(system, speed, j, omega)
            against = -(1 / _receptance(moved, j)).real  # k_c (1 - δ/ρ)
            if 0 < against < contact:
                radius = bushing.gap / (1 - against / contact)
                found.append(DryGuess(omega, moved * radius / _receptance(moved, j)))
    return found


def _moved(system: RoundCondensed, speed: float, j: int, omega: float) -> np.ndarray:
    """Return amplitudes (2 n_points,) per force that turns backward at bushing j: 1 along y, i along z, of e^(iωt)."""
    model, count = system.driven.model, len(system.rig.bushings)
    points = model.at_points
    ends = [2 * (count + 2 * j), 2 * (count + 2 * j + 1)]
    rows = (points[ends[0] : ends[0] + 2] + points[ends[1] : ends[1] + 2]) / 2
    return np.asarray(points @ np.linalg.solve(model.dynamic(omega, speed), rows.T @ np.array([1.0, 1j])))


def _receptance(moved: np.ndarray, j: int) -> complex:
    """Return the backward circle of bushing j in what moves."""
    return complex(moved[2 * j] - 1j * moved[2 * j + 1]) / 2


def _frequencies(system: RoundCondensed, speed: float, j: int, friction: float) -> list[float]:
    squares = np.linalg.eigvalsh(system.driven.model.elastic(speed))
    fastest = 2 * np.sqrt(max(system.stiffest, squares[0]) + squares[0])
    grid = np.geomspace(LOWEST * np.sqrt(squares[0]), fastest, WHIRLS)
    sense = 1.0 if speed > 0 else -1.0

    def driven(omega: float) -> float:
        found = _receptance(_moved(system, speed, j, omega), j)
        return found.imag - sense * friction * found.real  # of e^(iωt): the conjugate of that of y + i z

    value = np.array([driven(omega) for omega in grid])
    between = np.flatnonzero(value[1:] * value[:-1] < 0)
    return [float(brentq(driven, grid[i], grid[i + 1])) for i in between]
