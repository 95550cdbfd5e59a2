"""Rubbing of a vibration: the mean of normal force times slip speed at both ends of every bushing.

Archard (J. Appl. Phys. 24, 1953, 981): the volume worn off is V = K ∫ N |v_slip| dt, whatever the pressure. A vibration
adds K times the mean of N |v_slip|, its rubbing, W, to it per second.

The shaft's surface slips at radius R: along the shaft with the tilt towards the point of contact,
v_x = R n·dθ/dt, with θ the slope of the shaft within the bushing, (x_b - x_a)/L between its ends; and around,
v_t = ṙ·t + R Ω with t = x × n. Where it moves along z alone it tilts only.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.errors import RigError
from ..rig import Rig
from ..rig.dimensions import shaft_radius

__all__ = ["MOMENTS", "footprints", "in_space", "rubbing"]

MOMENTS = 6
"""Means of N|v| times 1, n_y, n_z, n_y², n_z² and n_y n_z, with n the direction of contact"""


def footprints(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Return radius and length (n_bushings,) of each bushing's rubbing surface, m; nan without a coefficient of wear.

    Parameters
    ----------
    rig : Rig
        The rig.

    Raises
    ------
    RigError
        If no bushing has a coefficient of wear, or one that has lacks a length or a radius.
    """
    if not any(bushing.wear for bushing in rig.bushings):
        raise RigError(
            f"rig {rig.name!r}: no bushing has a coefficient of wear above 0; give bushings[0].wear in m²/N, such as "
            "1e-15 (1e-6 mm³/(N m))"
        )
    radius, length = np.full((2, len(rig.bushings)), math.nan)
    for j, bushing in enumerate(rig.bushings):
        if not bushing.wear:
            continue
        radius[j], length[j] = shaft_radius(rig, j), bushing.length
        if not length[j]:
            raise RigError(f"bushings[{j}] ({bushing.where}): wear needs the bushing's length, over which it spreads")
        if not radius[j]:
            raise RigError(f"bushings[{j}] ({bushing.where}): wear needs bushings[{j}].radius, where the shaft slips")
    return radius, length


def rubbing(
    rig: Rig, place: np.ndarray, speed: np.ndarray, normal: np.ndarray, spin: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the rubbing (n_bushings, 2, `MOMENTS`) of both ends of every clearance, W: N m/s.

    Parameters
    ----------
    rig : Rig
        The rig.
    place, speed : ndarray, shape (2 n_bushings, 2, n)
        Displacement along y and z from the unloaded place, m, and velocity, m/s, of both ends of every bushing, evenly
        sampled; that of a slot is along z, see `in_space`.
    normal : ndarray, shape (2 n_bushings, n)
        Normal force of each, N.
    spin : ndarray, shape (n,), or float
        Spin of the shaft, rad/s.
    """
    radius, length = footprints(rig)
    moments = np.zeros((len(rig.bushings), 2, MOMENTS))
    for j, bushing in enumerate(rig.bushings):
        if not bushing.wear:
            continue
        tilting = (speed[2 * j + 1] - speed[2 * j]) / length[j]
        middle = np.array([[bushing.offset_y], [bushing.offset]])
        for end in range(2):
            at = 2 * j + end
            if not normal[at].any():
                continue
            r = place[at] + middle
            y, z = r / np.maximum(np.hypot(*r), 1e-300)
            around = y * speed[at, 1] - z * speed[at, 0] + radius[j] * spin
            rubs = np.maximum(normal[at], 0.0) * np.hypot(around, radius[j] * (y * tilting[0] + z * tilting[1]))
            moments[j, end] = np.mean(rubs * np.array([np.ones_like(y), y, z, y * y, z * z, y * z]), axis=1)
    return moments


def in_space(rig: Rig, ends: np.ndarray) -> np.ndarray:
    """Return rows of clearances' ends (2 n_rows, n) as (2 n_bushings, 2, n) along y and z.

    Parameters
    ----------
    rig : Rig
        The rig.
    ends : ndarray, shape (2 n_rows, n)
        Rows such as displacements, end by end of each clearance.
    """
    spatial = np.zeros((2 * len(rig.bushings), 2, ends.shape[1]))
    for j, rows in enumerate(rig.clearance_rows):
        size = rows.stop - rows.start
        spatial[2 * j : 2 * j + 2, -size:] = ends[2 * rows.start : 2 * rows.stop].reshape(2, size, -1)
    return spatial
