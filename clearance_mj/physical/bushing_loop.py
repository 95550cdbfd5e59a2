"""Forces of a bushing between two sites, compiled."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from ..core.jit import OPTIONS, jit
from .friction_loop import exert_row_force
from .library import doubles, field, integers

__all__ = ["SITE_BUSHING", "apply_bushing"]

SITE_BUSHING = np.dtype([(name, np.int64) for name in ("numeric", "equality", "axes", "site")])
"""Bushings; ``numeric`` is the address of their stiffnesses and dampings in numeric_data"""
_EQUALITY = int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
_DATA, _SCALE = mujoco.mjNEQDATA, 10  # length of an equality's data, and index of its torque scale


@jit(**OPTIONS)
def apply_bushing(head: Any, model: int, data: int, bushing: Any) -> None:
    """Make the solver's rows of an equality exert the forces of a bushing, in the axes of its second site.

    Rows of position are along the world's axes; those of orientation are the vector part of the quaternion in the
    site's axes, times a scale (MuJoCo, ``mj_instantiateEqual``).
    """
    n_rows = integers(data + head.d_nefc, 1)[0]
    kinds, ids = integers(field(data + head.d_efc_type), n_rows), integers(field(data + head.d_efc_id), n_rows)
    row = 0
    while row < n_rows and not (kinds[row] == _EQUALITY and ids[row] == bushing.equality):
        row += 1
    if row == n_rows:
        return
    numbers = doubles(field(model + head.m_numeric_data) + 8 * bushing.numeric, 2 * bushing.axes)
    residual = doubles(field(data + head.d_efc_pos) + 8 * row, bushing.axes)
    speed = doubles(field(data + head.d_efc_vel) + 8 * row, bushing.axes)
    axes = doubles(field(data + head.d_site_xmat) + 72 * bushing.site, 9)
    fx, fy, fz = 0.0, 0.0, 0.0
    for j in range(3):
        x, y, z = axes[j], axes[3 + j], axes[6 + j]
        force = -numbers[j] * (x * residual[0] + y * residual[1] + z * residual[2])
        force -= numbers[bushing.axes + j] * (x * speed[0] + y * speed[1] + z * speed[2])
        fx, fy, fz = fx + force * x, fy + force * y, fz + force * z
    exert_row_force(head, model, data, row, fx)
    exert_row_force(head, model, data, row + 1, fy)
    exert_row_force(head, model, data, row + 2, fz)
    if bushing.axes == 6:
        scale = doubles(field(model + head.m_eq_data) + 8 * _DATA * bushing.equality, _DATA)[_SCALE]
        for j in range(3, 6):
            torque = numbers[j] * residual[j] + numbers[6 + j] * speed[j]
            exert_row_force(head, model, data, row + j, -4.0 * torque / scale**2)
