"""Natural frequencies of shafts from their exact dynamic stiffness; no code of the package, no discretisation.

Between its nodes a shaft obeys w' = θ + V/κGA, θ' = M/EI, M' = -V - ρI ω² θ, V' = -ρA ω² w (Timoshenko, 1921; with
1/κGA = ρI = 0, Euler and Bernoulli's), which a matrix exponential integrates. The number of frequencies below ω is that
of negative eigenvalues of the stiffness of pieces whose own frequencies, held at both ends, are above (Wittrick &
Williams, Q. J. Mech. Appl. Math. 24, 1971). Frequencies are found by bisection.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg

WAVE = 2.0  # rad of bending or shear wave in a piece; held at both ends, its first frequency is at 4.73 or π


class Piece(NamedTuple):
    """A uniform piece between two nodes."""

    length: float
    bending: float
    mass: float  #: per length
    softness: float = 0.0  #: 1/κGA
    rotary: float = 0.0  #: ρI


def round_piece(length, diameter, bore=0.0, young=210e9, density=7850.0, nu=None):
    """A round piece or a tube; with Poisson's ratio, Timoshenko's with Cowper's coefficient for a solid section."""
    area, second = math.pi * (diameter**2 - bore**2) / 4, math.pi * (diameter**4 - bore**4) / 64
    if nu is None:
        return Piece(length, young * second, density * area)
    coefficient, shear_modulus = 6 * (1 + nu) / (7 + 6 * nu), young / (2 * (1 + nu))
    return Piece(length, young * second, density * area, 1 / (coefficient * shear_modulus * area), density * second)


def frequencies(chains, n, fixed=(), springs=(), masses=(), joints=()):
    """First n circular frequencies, 1/s; those of rigid bodies come out as almost 0.

    ``chains``: lists of pieces, one for each shaft; their nodes are counted through. ``fixed``: coordinates without
    motion, 2 i for the deflection of node i and 2 i + 1 for its rotation; ``springs`` and ``masses``: (coordinate,
    value); ``joints``: (coordinate, coordinate, spring).
    """
    size = 2 * sum(len(chain) + 1 for chain in chains)
    free = np.setdiff1d(np.arange(size), fixed)

    def below(omega):
        matrix, inside, first = np.zeros((len(omega), size, size)), 0, 0
        for chain in chains:
            for piece in chain:
                piece_matrix, more = _condensed(piece, omega)
                matrix[:, first : first + 4, first : first + 4] += piece_matrix
                inside, first = inside + more, first + 2
            first += 2
        for at, value in springs:
            matrix[:, at, at] += value
        for at, value in masses:
            matrix[:, at, at] -= value * omega**2
        for one, other, value in joints:
            for i, j, sign in ((one, one, 1), (other, other, 1), (one, other, -1), (other, one, -1)):
                matrix[:, i, j] += sign * value
        return inside + _negative(matrix[:, free[:, None], free])

    high = 1.0
    while below(np.array([high]))[0] < n:
        high *= 2
    low, high = np.full(n, 1e-6), np.full(n, high)
    for _ in range(60):
        middle = (low + high) / 2
        enough = below(middle) >= np.arange(1, n + 1)
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return (low + high) / 2


def _condensed(piece, omega):
    """Stiffness (n, 4, 4) of a piece at its ends, and how many frequencies it has below ω when they are held."""
    fastest = omega.max()
    bending = np.sqrt(fastest) * (piece.mass / piece.bending) ** 0.25
    shear = fastest * np.sqrt(max(piece.mass * piece.softness, piece.rotary / piece.bending))
    parts = math.ceil(piece.length * max(bending, shear) / WAVE)
    part = _stiffness(piece._replace(length=piece.length / parts), omega)
    whole = np.zeros((len(omega), 2 * parts + 2, 2 * parts + 2))
    for i in range(0, 2 * parts, 2):
        whole[:, i : i + 4, i : i + 4] += part
    ends, inner = np.r_[0, 1, 2 * parts, 2 * parts + 1], np.arange(2, 2 * parts)
    across, held = whole[:, inner[:, None], ends], whole[:, inner[:, None], inner]
    condensed = whole[:, ends[:, None], ends] - across.transpose(0, 2, 1) @ np.linalg.solve(held, across)
    return condensed, _negative(held)


def _stiffness(piece, omega):
    """(n, 4, 4) forces and moments at both ends of a piece per deflection and rotation of them, at ω (n,)."""
    h, rigidity = piece.length, piece.bending
    rate = np.zeros((len(omega), 4, 4))  # of w/h, θ, M h/EI, V h²/EI along x/h
    rate[:, 0, 1] = rate[:, 1, 2] = 1.0
    rate[:, 0, 3] = rigidity * piece.softness / h**2
    rate[:, 2, 3], rate[:, 2, 1] = -1.0, -piece.rotary * omega**2 * h**2 / rigidity
    rate[:, 3, 0] = -piece.mass * omega**2 * h**4 / rigidity
    across = scipy.linalg.expm(rate)
    flip = np.array([[0.0, 1.0], [1.0, 0.0]])  # force before moment, as deflection stands before rotation
    motion, by_load = across[:, :2, :2], across[:, :2, 2:] @ flip
    load, carried = flip @ across[:, 2:, :2], flip @ across[:, 2:, 2:] @ flip
    to_start = -np.linalg.solve(by_load, motion)
    to_end = np.linalg.inv(by_load)
    rows = (np.concatenate((-to_start, -to_end), -1), np.concatenate((load + carried @ to_start, carried @ to_end), -1))
    size = np.array([1 / h, 1.0, 1 / h, 1.0])
    return rigidity / h * size[:, None] * np.concatenate(rows, -2) * size


def _negative(matrix):
    """Number of negative eigenvalues of each."""
    if not matrix.shape[-1]:
        return np.zeros(len(matrix), dtype=int)
    scale = np.sqrt(np.abs(np.diagonal(matrix, axis1=1, axis2=2)))
    return np.sum(np.linalg.eigvalsh(matrix / (scale[:, :, None] * scale[:, None])) < 0, axis=1)
