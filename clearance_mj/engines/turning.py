"""What engines in space share beside their loops: how a shaft begins to turn, and what displacement probes read."""

from __future__ import annotations

import numpy as np

from ..rig import Rig

__all__ = ["SPIN_STEPS", "as_probes", "turning_of"]

SPIN_STEPS = 64  # steps for which gyroscopic moments are those of one speed while the spin changes


def turning_of(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Return the spin, rad/s, and angle, rad, at the start (2,), and what changes the spin (3,).

    That is the rate of a ramp, rad/s², the time at which it ends, s, and 1/inertia, 1/(kg m²), of a shaft that friction
    slows down, 0 where the drive holds the speed.
    """
    spin = rig.spin
    if spin is None:
        return np.zeros(2), np.array([0.0, np.inf, 0.0])
    free = 1 / spin.inertia if spin.inertia else 0.0
    return np.array([spin.speed, spin.angle]), np.array([spin.rate, spin.ramp_end, free])


def as_probes(rig: Rig, rows: np.ndarray) -> np.ndarray:
    """Return what `Run.advance` returns with the displacements that probes read, which may be turned from y and z."""
    turned = np.array([b.probe_angle for b in rig.bushings])
    if turned.any():
        first = len(rig.sensors)
        y, z = (rows[:, first + i : first + 2 * len(rig.bushings) : 2] for i in (0, 1))
        cos, sin = np.cos(turned), np.sin(turned)
        y[:], z[:] = cos * y + sin * z, cos * z - sin * y
    return rows
