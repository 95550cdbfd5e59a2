"""The vibration of a rig in space as long as no wall is touched, in closed form: rest under weight, and an ellipse."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from ..in_gap import filled, level_of_contact, linear_in_gap, resonances, without_contact
from .condensed import UNBALANCE
from .solver import RoundSolver

ANGLES = 256  # along an ellipse, at which its distance from the wall is found before a parabola refines it
LEAST_BEND = 1e-9  # of the distance: circles around the middle have none


@linear_in_gap.register
def _round_is_linear(solver: RoundSolver) -> bool:
    return bool(solver.system.laws.linear.all())


@without_contact.register
def _round_without_contact(solver: RoundSolver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rest, ellipse = _moved(solver, omega)
    x = np.zeros((*rest.shape, 2 * solver.harmonics + 1))
    x[..., 0], x[..., 1], x[..., 2] = rest, ellipse.real, -ellipse.imag
    z = np.einsum("pr,npk->nrk", solver.system.basis, x)
    return z, x - np.einsum("pr,nrk->npk", solver.system.basis, z)


@filled.register
def _round_filled(solver: RoundSolver, omega: np.ndarray) -> np.ndarray:
    rest, ellipse, gap = _at_ends(solver, omega)
    away = np.linalg.norm(rest[..., None] + _along(ellipse), axis=2) / gap[:, None]
    return np.asarray(_peak(away).max(axis=1))


@level_of_contact.register
def _round_level_of_contact(solver: RoundSolver, omega: np.ndarray) -> np.ndarray:
    """At each angle where |rest + level x ellipse| = gap; 0 where the rest touches already."""
    rest, ellipse, gap = _at_ends(solver, omega)
    way = _along(ellipse)
    square, along = np.sum(way**2, axis=2), np.sum(rest[..., None] * way, axis=2)
    room = (gap**2 - np.sum(rest**2, axis=2))[..., None]
    level = np.full(square.shape, np.inf)
    np.divide(np.sqrt(along**2 + square * np.maximum(room, 0.0)) - along, square, out=level, where=square > 0)
    return np.where(np.any(room[..., 0] <= 0, axis=1), 0.0, -_peak(-level).max(axis=1))


@resonances.register
def _round_resonances(solver: RoundSolver) -> np.ndarray:
    """Where det(K + Ω H - Ω² + i Ω (C + Ω G)) = 0: iΩ of an unbalance, whose frequency is that of the turning."""
    model = solver.system.driven.model
    if solver.system.kind == UNBALANCE and not model.bearings:
        unit, none = np.eye(model.size), np.zeros((model.size, model.size))
        circulatory, gyroscopic = (m if m.size else none for m in (model.circulatory, model.gyroscopic))
        linear = np.block([[none, unit], [-model.stiff(), -circulatory - 1j * model.viscous()]])
        poles = 1j * scipy.linalg.eigvals(linear, scipy.linalg.block_diag(unit, 1j * gyroscopic - unit))
        poles = poles[np.isfinite(poles)]
    else:
        poles = model.poles(solver.spin).value
    return np.asarray(poles[poles.imag > 0])


def _moved(solver: RoundSolver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rests (n, 2 n_points) under the weight, and complex amplitudes of the excitation's one harmonic, m."""
    driven = solver.system.driven
    modes = np.empty((omega.size, 2, driven.model.size), dtype=complex)
    for i, each in enumerate(omega):
        spin = solver.spin_of(each)
        modes[i] = driven.modes(each, spin, driven.force(spin, 1.0, 1.0)[:2])
    moved = modes @ driven.model.at_points.T
    return moved[:, 0].real, moved[:, 1]


def _at_ends(solver: RoundSolver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rests (n, n_ends, 2) from the bushings' middles, complex amplitudes of both ends of each, and reaches (n_ends,).

    Within the reach of the wall, from the middle, nothing touches.
    """
    bushings = solver.system.rig.bushings
    offset = np.repeat([(b.offset_y, b.offset) for b in bushings], 2, axis=0)
    gap = np.repeat([b.wall_model.reach(b.gap) for b in bushings], 2)
    rest, ellipse = (each[:, len(gap) :].reshape(len(each), -1, 2) for each in _moved(solver, omega))
    return rest + offset, ellipse, gap


def _along(ellipse: np.ndarray) -> np.ndarray:
    """Places (..., 2, N) along ellipses of complex amplitudes (..., 2)."""
    return np.real(ellipse[..., None] * np.exp(2j * np.pi * np.arange(ANGLES) / ANGLES))


def _peak(values: np.ndarray) -> np.ndarray:
    """Largest (...) of values (..., N) around a circle, by the parabola through it and its neighbours."""
    at = values.argmax(axis=-1)[..., None]
    left, top, right = (np.take_along_axis(values, (at + d) % ANGLES, axis=-1)[..., 0] for d in (-1, 0, 1))
    bend = 2 * top - left - right
    with np.errstate(invalid="ignore"):
        higher = (right - left) ** 2 / np.maximum(8 * bend, 1e-300)
        return np.asarray(np.where(bend > LEAST_BEND * np.abs(top), top + higher, top))
