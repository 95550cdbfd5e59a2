"""The vibration within the gaps of linear fillings, in closed form, and where it fills a gap.

It is rest under constant loads and, of each coordinate, a harmonic about it: along y and z an ellipse.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from .condensed import UNBALANCE
from .solver import Solver

__all__ = ["edges", "filled", "level_of_contact", "linear_in_gap", "resonances", "without_contact"]

FINER = 8  # frequencies per one asked for at which contact that begins and ends in between is looked for
AROUND_POLE = np.linspace(-4.0, 4.0, 33)  # frequencies around a resonance, in its half widths
ANGLES = 256  # along an ellipse, at which its distance from the wall is found before a parabola refines it
LEAST_BEND = 1e-9  # of the distance: circles around the middle have none


def linear_in_gap(solver: Solver) -> bool:
    """Return whether one harmonic excites, and fillings alone act as springs and dampers, if no wall is touched."""
    driven = solver.system.driven
    return bool(solver.system.laws.linear.all() and np.sum(_harmonics(driven.drive + driven.unbalance)) == 1)


def without_contact(solver: Solver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vibrations at frequencies, 1/s, if no wall is touched: z (n, r, K) and y (n, n_rows, K), m."""
    rest, ellipse = _moved(solver, omega)
    x, h = np.zeros((*rest.shape, 2 * solver.harmonics + 1)), _excited(solver)
    x[..., 0], x[..., 2 * h - 1], x[..., 2 * h] = rest, ellipse.real, -ellipse.imag
    z = np.einsum("pr,npk->nrk", solver.system.basis, x)
    return z, x - np.einsum("pr,nrk->npk", solver.system.basis, z)


def filled(solver: Solver, omega: np.ndarray) -> np.ndarray:
    """Return the largest share (n,) of the way to a wall that is moved without contact; there is some above 1."""
    rest, ellipse = _moved(solver, omega)
    found = np.zeros(omega.size)
    for rows, wall in _slots(solver):
        away, amplitude = rest[:, rows], np.abs(ellipse[:, rows])
        shares = np.maximum((amplitude + away) / wall[1], (amplitude - away) / -wall[0])
        found = np.maximum(found, shares.max(axis=1))
    for both, offset, reach in _rounds(solver):
        away = np.linalg.norm((rest[:, both] + offset)[..., None] + _along(ellipse[:, both]), axis=2) / reach
        found = np.maximum(found, _peak(away).max(axis=1))
    return found


def level_of_contact(solver: Solver, omega: np.ndarray) -> np.ndarray:
    """Return at which share (n,) of the excitation's level a gap is filled; 0 where the rest touches already."""
    rest, ellipse = _moved(solver, omega)
    found = np.full(omega.size, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for rows, wall in _slots(solver):
            room = np.minimum(wall[1] - rest[:, rows], rest[:, rows] - wall[0])
            level = np.where(room > 0, room / np.abs(ellipse[:, rows]), 0.0)
            found = np.minimum(found, level.min(axis=1))
    for both, offset, reach in _rounds(solver):  # at each angle where |rest + level x ellipse| = reach
        way, away = _along(ellipse[:, both]), rest[:, both] + offset
        square, along = np.sum(way**2, axis=2), np.sum(away[..., None] * way, axis=2)
        room = (reach**2 - np.sum(away**2, axis=2))[..., None]
        level = np.full(square.shape, np.inf)
        np.divide(np.sqrt(along**2 + square * np.maximum(room, 0.0)) - along, square, out=level, where=square > 0)
        at_wall = np.any(room[..., 0] <= 0, axis=1)
        found = np.minimum(found, np.where(at_wall, 0.0, -_peak(-level).max(axis=1)))
    return found


def resonances(solver: Solver) -> np.ndarray:
    """Return the poles, 1/s, near which the vibration without contact is large, those of positive frequency.

    Where det(K + Ω H - ω² + i ω (C + Ω G)) = 0: of what turns with the shaft ω = order Ω.
    """
    system, model = solver.system, solver.system.driven.model
    if system.kind == UNBALANCE and not model.bearings:
        unit, none = np.eye(model.size), np.zeros((model.size, model.size))
        circulatory, gyroscopic = (m if m.size else none for m in (model.circulatory, model.gyroscopic))
        turns = 1 / system.order
        linear = np.block([[none, unit], [-model.stiff(), -turns * circulatory - 1j * model.viscous()]])
        poles = 1j * scipy.linalg.eigvals(linear, scipy.linalg.block_diag(unit, 1j * turns * gyroscopic - unit))
        poles = poles[np.isfinite(poles)]
    else:
        poles = model.poles(solver.at.spin).value
    return np.asarray(poles[poles.imag > 0] / _excited(solver))


def edges(solver: Solver, omega: np.ndarray) -> list[tuple[float, bool]]:
    """Return the frequencies, 1/s, at which the vibration fills a gap, and whether contact lies above each.

    Looked for from the first to the last of increasing frequencies, between them and about the resonances.
    """
    poles = resonances(solver)
    near = (poles.imag - poles.real * AROUND_POLE[:, None]).ravel()
    fine = np.interp(np.arange(FINER * (omega.size - 1) + 1) / FINER, np.arange(omega.size), omega)
    fine = np.unique(np.concatenate((fine, near[(near > omega[0]) & (near < omega[-1])])))
    beyond = filled(solver, fine) - 1
    found = []
    for i in np.flatnonzero(np.diff(beyond > 0)):
        at = brentq(lambda w: filled(solver, np.array([w]))[0] - 1, fine[i], fine[i + 1], xtol=1e-12 * fine[i])
        found.append((float(at), bool(beyond[i + 1] > 0)))
    return found


def _harmonics(drive: np.ndarray) -> np.ndarray:
    """(H + 1,) which harmonics of an excitation (H + 1, n) there are."""
    return np.asarray(np.abs(drive).max(axis=1) > 0)


def _excited(solver: Solver) -> int:
    """Return the number of the one harmonic that excites."""
    driven = solver.system.driven
    return int(np.flatnonzero(_harmonics(driven.drive + driven.unbalance))[0])


def _moved(solver: Solver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rests (n, n_rows) under constant loads, and complex amplitudes of the excitation's one harmonic, m."""
    driven, h = solver.system.driven, _excited(solver)
    if not solver.system.order:  # at one spin: by poles
        model, spin = driven.model, solver.at.spin
        push = driven.force(spin, 0.0, 1.0)[h]
        found = model.responses(driven.points, push[:, None], h * np.asarray(omega), spin)[..., 0]
        sag = driven.points @ np.linalg.solve(model.stiff(spin), driven.weight)
        return np.tile(sag, (len(found), 1)), found
    modes = np.empty((omega.size, 2, driven.model.size), dtype=complex)
    for i, each in enumerate(omega):
        spin = solver.spin_of(each)
        force = driven.force(spin, 1.0, 1.0)
        dynamic = [driven.model.stiff(spin), driven.model.dynamic(h * each, spin)]
        modes[i] = np.linalg.solve(dynamic, force[[0, h], :, None])[:, :, 0]
    moved = modes @ driven.points.T
    return moved[:, 0].real, moved[:, 1]


def _slots(solver: Solver) -> list[tuple[list[int], tuple[float, float]]]:
    """Rows of both ends of each clearance of one coordinate, and its walls, m."""
    laws, rig = solver.system.laws, solver.system.rig
    count = len(rig.bushings)
    return [
        (laws.rows[count + 2 * j : count + 2 * j + 2, 1].tolist(), bushing.walls)
        for j, bushing in enumerate(rig.bushings)
        if not bushing.is_round
    ]


def _rounds(solver: Solver) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Rows (2, 2) of both ends of each round clearance, its offset along y, z, and reach, within which none touches."""
    laws, rig = solver.system.laws, solver.system.rig
    count = len(rig.bushings)
    return [
        (laws.rows[count + 2 * j : count + 2 * j + 2], np.array([b.offset_y, b.offset]), b.wall_model.reach(b.gap))
        for j, b in enumerate(rig.bushings)
        if b.is_round
    ]


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
