"""Common parts of engines in space: initial rotation of a shaft, and readings of displacement probes."""

from __future__ import annotations

import numpy as np

from ..rig import Rig

__all__ = ["SPIN_STEPS", "as_probes", "turning_of"]

SPIN_STEPS = 64  # steps for which gyroscopic moments are those of one speed while the spin changes


def turning_of(rig: Rig) -> np.ndarray:
    """Return the rotation at the start, (5,): spin, rad/s, angle, rad, rate and end of a ramp, 1/inertia.

    The rate is in rad/s², the end in s; 1/inertia, 1/(kg m²), is that of a shaft that friction slows down, 0 where the
    drive holds the speed.
    """
    spin = rig.spin
    if spin is None:
        return np.array([0.0, 0.0, 0.0, np.inf, 0.0])
    return np.array([spin.speed, spin.angle, spin.rate, spin.ramp_end, 1 / spin.inertia if spin.inertia else 0.0])


def as_probes(rig: Rig, rows: np.ndarray) -> np.ndarray:
    """Rotate displacements in the columns of `Run.advance` to the probes' axes, in place; return the columns."""
    for bushing, places in zip(rig.bushings, rig.clearance_rows):
        if bushing.probe_angle and bushing.n_coordinates == 2:
            y, z = (rows[:, len(rig.sensors) + row] for row in (places.start, places.start + 1))
            cos, sin = np.cos(bushing.probe_angle), np.sin(bushing.probe_angle)
            y[:], z[:] = cos * y + sin * z, cos * z - sin * y
    return rows
