"""The vibration within the gaps of greases that are linear there, in closed form, and where it fills a gap."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from .condensed import Condensed
from .continuation import Solver
from .forces import fill_forces

__all__ = ["driven", "edges", "filled", "linear_in_gap"]

FINER = 8  # frequencies per one asked for at which contact that begins and ends in between is looked for
AROUND_POLE = np.linspace(-4.0, 4.0, 33)  # frequencies around a resonance, in its half widths
LINEAR = 1e-9  # share of a linear grease's force that may be beyond its stiffness and damping of small motions
INNER = 0.9  # share of the gap over which that is checked


def linear_in_gap(solver: Solver) -> bool:
    """Return whether nothing but stiffness and damping of the greases acts as long as no wall is touched."""
    system = solver.system
    if system.laws.memory.any():
        return False
    count, omega = len(system.rig.bushings), float(np.abs(system.poles.values).max())
    angle = 2 * np.pi * np.arange(solver.samples) / solver.samples
    way, speed = (np.cos(angle) + np.cos(2 * angle)) / 2, -omega * (np.sin(angle) + 2 * np.sin(2 * angle)) / 2
    size = np.tile([INNER * (b.gap - abs(b.offset)) for b in system.rig.bushings], 3)[:, None]
    force = np.empty((solver.points, solver.samples))
    basis, rate, project = solver.grid[:3]
    fill_forces(system.laws, size * way, size * speed, omega, basis, rate, project, False, force, solver.slopes)
    known = (system.laws.spring + system.laws.damper * omega) * size[:count, 0]
    return bool(np.all(np.abs(force[:count]) <= LINEAR * np.maximum(known, 1e-300)[:, None]))


def driven(system: Condensed, omega: np.ndarray) -> np.ndarray:
    """Return displacements (n, n_points) by the excitation alone, complex amplitudes of its one harmonic, m."""
    linear = system.linear
    turning = 1j * system.periods * np.asarray(omega)[:, None]
    return (1 / (turning - linear.poles)) @ linear.driven * linear.excitation[system.periods]


def filled(system: Condensed, omega: np.ndarray) -> np.ndarray:
    """Return the largest share (n,) of the way to a wall that is moved by the excitation alone; contact is above 1."""
    walls = np.abs([bushing.walls for bushing in system.rig.bushings]).min(axis=1)
    count = len(walls)
    return np.max(np.abs(driven(system, omega)[:, count:]) / np.repeat(walls, 2), axis=1)


def edges(system: Condensed, omega: np.ndarray) -> list[tuple[float, bool]]:
    """Return the frequencies, 1/s, at which the vibration fills a gap, and whether contact lies above each.

    Looked for from the first to the last of increasing frequencies, between them and about the resonances.
    """
    poles = system.linear.poles[system.linear.poles.imag > 0] / system.periods
    near = (poles.imag - poles.real * AROUND_POLE[:, None]).ravel()
    fine = np.interp(np.arange(FINER * (omega.size - 1) + 1) / FINER, np.arange(omega.size), omega)
    fine = np.unique(np.concatenate((fine, near[(near > omega[0]) & (near < omega[-1])])))
    beyond = filled(system, fine) - 1
    found = []
    for i in np.flatnonzero(np.diff(beyond > 0)):
        at = brentq(lambda w: filled(system, np.array([w]))[0] - 1, fine[i], fine[i + 1], xtol=1e-12 * fine[i])
        found.append((float(at), bool(beyond[i + 1] > 0)))
    return found
