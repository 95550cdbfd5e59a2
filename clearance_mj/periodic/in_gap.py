"""The vibration within the gaps of linear fillings, in closed form, and the frequencies at which it fills a gap.

It is the static equilibrium and, for each coordinate, a harmonic about it: along y and z an ellipse.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from .condensed import UNBALANCE
from .solver import Solver

__all__ = ["edges", "gap_ratio", "level_of_contact", "linear_in_gap", "resonances", "without_contact"]

FINER = 8  # frequencies per given one at which contact that begins and ends in between is sought
AROUND_POLE = np.linspace(-4.0, 4.0, 33)  # frequencies around a resonance, in its half widths
ANGLES = 256  # along an ellipse, for its distance from the wall before a parabola refines it
LEAST_BEND = 1e-9  # of the distance: circles around the middle have none


def linear_in_gap(solver: Solver) -> bool:
    """Return True if the excitation has one harmonic, and fillings are linear springs and dampers in the gap."""
    return bool(solver.system.laws.linear.all() and _excited_harmonics(solver).size == 1)


def without_contact(solver: Solver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vibrations at frequencies, 1/s, if no wall is touched: z (n, r, K) and y (n, n_rows, K), m."""
    equilibrium, ellipse = _response(solver, omega)
    x, h = np.zeros((*equilibrium.shape, 2 * solver.harmonics + 1)), _excited_harmonics(solver)[0]
    x[..., 0], x[..., 2 * h - 1], x[..., 2 * h] = equilibrium, ellipse.real, -ellipse.imag
    z = np.einsum("pr,npk->nrk", solver.system.basis, x)
    return z, x - np.einsum("pr,nrk->npk", solver.system.basis, z)


def gap_ratio(solver: Solver, omega: np.ndarray) -> np.ndarray:
    """Return the largest ratio (n,) of contact-free displacement to a wall's distance; above 1 there is contact."""
    static, ellipse = _response(solver, omega)
    ratio = np.zeros(omega.size)
    for rows, wall in _slot_rows(solver):
        r, amplitude = static[:, rows], np.abs(ellipse[:, rows])
        ratios = np.maximum((amplitude + r) / wall[1], (amplitude - r) / -wall[0])
        ratio = np.maximum(ratio, ratios.max(axis=1))
    for pair, offset, reach in _round_rows(solver):
        r = np.linalg.norm((static[:, pair] + offset)[..., None] + _ellipse_points(ellipse[:, pair]), axis=2) / reach
        ratio = np.maximum(ratio, _refined_maximum(r).max(axis=1))
    return ratio


def level_of_contact(solver: Solver, omega: np.ndarray) -> np.ndarray:
    """Return the factor (n,) of the excitation's level at which a gap is filled; 0 where the equilibrium touches."""
    equilibrium, ellipse = _response(solver, omega)
    lowest = np.full(omega.size, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for rows, wall in _slot_rows(solver):
            margin = np.minimum(wall[1] - equilibrium[:, rows], equilibrium[:, rows] - wall[0])
            level = np.where(margin > 0, margin / np.abs(ellipse[:, rows]), 0.0)
            lowest = np.minimum(lowest, level.min(axis=1))
    for pair, offset, reach in _round_rows(solver):  # at each angle where |rest + level x ellipse| = reach
        path, centre = _ellipse_points(ellipse[:, pair]), equilibrium[:, pair] + offset
        square, dot = np.sum(path**2, axis=2), np.sum(centre[..., None] * path, axis=2)
        margin = (reach**2 - np.sum(centre**2, axis=2))[..., None]
        level = np.full(square.shape, np.inf)
        np.divide(np.sqrt(dot**2 + square * np.maximum(margin, 0.0)) - dot, square, out=level, where=square > 0)
        at_wall = np.any(margin[..., 0] <= 0, axis=1)
        lowest = np.minimum(lowest, np.where(at_wall, 0.0, -_refined_maximum(-level).max(axis=1)))
    return lowest


def resonances(solver: Solver) -> np.ndarray:
    """Return the poles, 1/s, near which the vibration without contact is large, those of positive frequency.

    Where det(K + Ω H - ω² + i ω (C + Ω G)) = 0: for rotating excitations ω = order Ω.
    """
    system, model = solver.system, solver.system.driven.model
    if system.kind == UNBALANCE and not model.bearings:
        unit, zero = np.eye(model.size), np.zeros((model.size, model.size))
        circulatory, gyroscopic = (m if m.size else zero for m in (model.circulatory, model.gyroscopic))
        turns = 1 / system.order
        pencil = np.block([[zero, unit], [-model.stiff(), -turns * circulatory - 1j * model.viscous()]])
        poles = 1j * scipy.linalg.eigvals(pencil, scipy.linalg.block_diag(unit, 1j * turns * gyroscopic - unit))
        poles = poles[np.isfinite(poles)]
    else:
        poles = model.poles(solver.at.spin).value
    return np.asarray(poles[poles.imag > 0] / _excited_harmonics(solver)[0])


def edges(solver: Solver, omega: np.ndarray) -> list[tuple[float, bool]]:
    """Return the frequencies, 1/s, at which the vibration fills a gap, and True for those with contact above.

    The search covers the range of increasing frequencies, refined between them and about the resonances.
    """
    poles = resonances(solver)
    near = (poles.imag - poles.real * AROUND_POLE[:, None]).ravel()
    fine = np.interp(np.arange(FINER * (omega.size - 1) + 1) / FINER, np.arange(omega.size), omega)
    fine = np.unique(np.concatenate((fine, near[(near > omega[0]) & (near < omega[-1])])))
    beyond = gap_ratio(solver, fine) - 1
    crossings = []
    for i in np.flatnonzero(np.diff(beyond > 0)):
        at = brentq(lambda w: gap_ratio(solver, np.array([w]))[0] - 1, fine[i], fine[i + 1], xtol=1e-12 * fine[i])
        crossings.append((float(at), bool(beyond[i + 1] > 0)))
    return crossings


def _excited_harmonics(solver: Solver) -> np.ndarray:
    """Return the numbers of the excitation's harmonics that are not zero."""
    driven = solver.system.driven
    return np.flatnonzero((driven.drive + driven.unbalance).any(axis=1))


def _response(solver: Solver, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return equilibria (n, n_rows) under constant loads, and complex amplitudes of the excitation's harmonic, m."""
    driven, h = solver.system.driven, _excited_harmonics(solver)[0]
    if not solver.system.order:  # at one spin: by poles
        model, spin = driven.model, solver.at.spin
        excitation = driven.force(spin, 0.0, 1.0)[h]
        amplitude = model.responses(driven.points, excitation[:, None], h * np.asarray(omega), spin)[..., 0]
        sag = driven.points @ np.linalg.solve(model.stiff(spin), driven.weight)
        return np.tile(sag, (len(amplitude), 1)), amplitude
    modes = np.empty((omega.size, 2, driven.model.size), dtype=complex)
    for i, w in enumerate(omega):
        spin = solver.spin_of(w)
        force = driven.force(spin, 1.0, 1.0)
        dynamic = [driven.model.stiff(spin), driven.model.dynamic(h * w, spin)]
        modes[i] = np.linalg.solve(dynamic, force[[0, h], :, None])[:, :, 0]
    moved = modes @ driven.points.T
    return moved[:, 0].real, moved[:, 1]


def _slot_rows(solver: Solver) -> list[tuple[list[int], tuple[float, float]]]:
    """Return rows of both ends of each clearance of one coordinate, and its walls, m."""
    laws, bushings = solver.system.laws, solver.system.rig.bushings
    return [(laws.rows_of(j)[1:, 1].tolist(), b.walls) for j, b in enumerate(bushings) if not b.is_round]


def _round_rows(solver: Solver) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Return rows (2, 2) of both ends of each round clearance, its offset along y, z, and contact-free radius, m."""
    laws = solver.system.laws
    return [
        (laws.rows_of(j)[1:], np.array([b.offset_y, b.offset]), b.wall_model.reach(b.gap))
        for j, b in enumerate(solver.system.rig.bushings)
        if b.is_round
    ]


def _ellipse_points(ellipse: np.ndarray) -> np.ndarray:
    """Return points (..., 2, N) along ellipses of complex amplitudes (..., 2)."""
    return np.real(ellipse[..., None] * np.exp(2j * np.pi * np.arange(ANGLES) / ANGLES))


def _refined_maximum(values: np.ndarray) -> np.ndarray:
    """Return the maximum (...) of values (..., N) around a circle, by the parabola through it and its neighbours."""
    at = values.argmax(axis=-1)[..., None]
    left, top, right = (np.take_along_axis(values, (at + d) % ANGLES, axis=-1)[..., 0] for d in (-1, 0, 1))
    bend = 2 * top - left - right
    with np.errstate(invalid="ignore"):
        higher = (right - left) ** 2 / np.maximum(8 * bend, 1e-300)
        return np.asarray(np.where(bend > LEAST_BEND * np.abs(top), top + higher, top))
