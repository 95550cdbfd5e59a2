"""The vibration within the gaps of greases that are linear there, in closed form, and where it fills a gap.

What differs between planes and space is known by the kind of solver; see `space.in_gap`.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.optimize import brentq

from .condensed import Condensed
from .forces import fill_forces

__all__ = ["edges", "filled", "level_of_contact", "linear_in_gap", "resonances", "without_contact"]

FINER = 8  # frequencies per one asked for at which contact that begins and ends in between is looked for
AROUND_POLE = np.linspace(-4.0, 4.0, 33)  # frequencies around a resonance, in its half widths
LINEAR = 1e-9  # share of a linear grease's force that may be beyond its stiffness and damping of small motions
INNER = 0.9  # share of the gap over which that is checked


@functools.singledispatch
def linear_in_gap(solver: Any) -> bool:
    """Return whether nothing but stiffness and damping of the greases acts as long as no wall is touched."""
    system = solver.system
    if system.laws.memory.any():
        return False
    count, omega = len(system.rig.bushings), float(np.abs(system.in_gap.poles().value).max())
    angle = 2 * np.pi * np.arange(solver.samples) / solver.samples
    way, speed = (np.cos(angle) + np.cos(2 * angle)) / 2, -omega * (np.sin(angle) + 2 * np.sin(2 * angle)) / 2
    size = np.tile([INNER * (b.gap - abs(b.offset)) for b in system.rig.bushings], 3)[:, None]
    force = np.empty((solver.rows, solver.samples))
    basis, rate, project = solver.grid[:3]
    fill_forces(system.laws, size * way, size * speed, omega, basis, rate, project, False, force, solver.slopes)
    known = (system.laws.spring + system.laws.damper * omega) * size[:count, 0]
    return bool(np.all(np.abs(force[:count]) <= LINEAR * np.maximum(known, 1e-300)[:, None]))


@functools.singledispatch
def without_contact(solver: Any, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vibrations at frequencies, 1/s, if no wall is touched: z (n, r, K) and y (n, n_points, K), m."""
    system = solver.system
    of_points = _driven(system, omega)
    x = np.zeros((*of_points.shape, 2 * solver.harmonics + 1))
    x[..., 2 * system.periods - 1], x[..., 2 * system.periods] = of_points.real, -of_points.imag
    z = np.einsum("pr,npk->nrk", system.linear.basis, x)
    return z, x - np.einsum("pr,nrk->npk", system.linear.basis, z)


@functools.singledispatch
def filled(solver: Any, omega: np.ndarray) -> np.ndarray:
    """Return the largest share (n,) of the way to a wall that is moved without contact; there is some above 1."""
    walls = np.abs([bushing.walls for bushing in solver.system.rig.bushings]).min(axis=1)
    return np.max(np.abs(_driven(solver.system, omega)[:, len(walls) :]) / np.repeat(walls, 2), axis=1)


@functools.singledispatch
def level_of_contact(solver: Any, omega: np.ndarray) -> np.ndarray:
    """Return by which share (n,) of the excitation a gap is filled at frequencies, 1/s."""
    return 1 / filled(solver, omega)


@functools.singledispatch
def resonances(solver: Any) -> np.ndarray:
    """Return the poles, 1/s, near which the vibration without contact is large, those of positive frequency."""
    poles = solver.system.linear.poles
    return poles[poles.imag > 0] / solver.system.periods


def _driven(system: Condensed, omega: np.ndarray) -> np.ndarray:
    """Displacements (n, n_points) by the excitation alone, complex amplitudes of its one harmonic, m."""
    linear = system.linear
    turning = 1j * system.periods * np.asarray(omega)[:, None]
    return (1 / (turning - linear.poles)) @ linear.driven * linear.excitation[system.periods]


def edges(solver: Any, omega: np.ndarray) -> list[tuple[float, bool]]:
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
