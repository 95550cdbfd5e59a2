"""How bristles bend and slip between bodies, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from ..core.jit import OPTIONS, jit
from .library import doubles, external, field, integers

__all__ = ["FRICTION", "OF_FRICTION", "bend", "between", "rub"]

OF_FRICTION = 13  # numbers of memory: the bristles' deflection, force, torque, the point where they act, and the last:
SPIN = 12  # the angle by which the bristles of a pair are turned about their normal
FRICTION = np.dtype(
    [(name, np.int64) for name in ("kind", "numeric", "torsion", "dof", "size", "geom1", "geom2", "body1", "body2")]
)  # Bristles; where in the custom numbers the largest force is (for pairs its ratio to the normal force), k and c
_apply_force = external("mj_applyFT", *(types.intp,) * 5, types.int32, types.intp)


@jit(**OPTIONS)
def between(geoms: np.ndarray, geom1: int, geom2: int) -> bool:
    """Whether two geoms of a contact are two others, in any order."""
    return (geoms[0] == geom1 and geoms[1] == geom2) or (geoms[0] == geom2 and geoms[1] == geom1)


@jit(**OPTIONS)
def bend(numbers: np.ndarray, bristles: np.ndarray, step: float, speed: float) -> float:
    """Bend the bristles of a coordinate and return their force: elastic up to the largest, where they slip."""
    largest, k, c = numbers[0], numbers[1], numbers[2]
    slips = largest / k
    bristles[0] = min(max(bristles[0] + step * speed, -slips), slips)
    return min(max(k * bristles[0] + c * speed, -largest), largest)


@jit(**OPTIONS)
def rub(
    head: Any, model: int, data: int, friction: Any, numbers: np.ndarray, bristles: np.ndarray, here: int, step: float
) -> None:
    """Bend the bristles between two bodies in the plane of their contact, and let their force act on both.

    Several points of contact have one bristle at the centre of their pressure, and one that resists spin about the
    normal there, with the arm of the points' forces.
    """
    contacts, n_contacts = field(data + head.d_contact), integers(data + head.d_ncon, 1)[0]
    wanted, softness = field(data + head.d_efc_aref), field(data + head.d_efc_R)
    pressed, body1, body2 = 0.0, friction.body1, friction.body2
    x, y, z, nx, ny, nz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sx, sy, sz, spin = 0.0, 0.0, 0.0, 0.0  # of surfaces that move themselves, such as a conveyor's
    for i in range(n_contacts):
        contact = contacts + i * head.contact_size
        geoms, r = integers(contact + head.c_geom, 2), integers(contact + head.c_efc_address, 1)[0]
        if r >= 0 and between(geoms, friction.geom1, friction.geom2):
            force = max(doubles(wanted + 8 * r, 1)[0] / doubles(softness + 8 * r, 1)[0], 0.0)
            place, frame = doubles(contact + head.c_pos, 3), doubles(contact + head.c_frame, 9)
            pressed += force
            x, y, z = x + force * place[0], y + force * place[1], z + force * place[2]
            nx, ny, nz = nx + force * frame[0], ny + force * frame[1], nz + force * frame[2]
            if geoms[0] != friction.geom1:
                body1, body2 = friction.body2, friction.body1
            if head.c_surfacevel >= 0:
                moves = doubles(contact + head.c_surfacevel, 3)
                sx += force * (moves[0] * frame[3] + moves[1] * frame[6])
                sy += force * (moves[0] * frame[4] + moves[1] * frame[7])
                sz += force * (moves[0] * frame[5] + moves[1] * frame[8])
                spin += force * moves[2]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        bristles[:6], bristles[SPIN] = 0.0, 0.0
        return
    nx, ny, nz = nx / length, ny / length, nz / length
    x, y, z = x / pressed, y / pressed, z / pressed
    ux, uy, uz, ox, oy, oz = _velocity(head, model, data, body1, x, y, z)
    vx, vy, vz, wx, wy, wz = _velocity(head, model, data, body2, x, y, z)
    vx, vy, vz = vx - ux + sx / pressed, vy - uy + sy / pressed, vz - uz + sz / pressed
    along = vx * nx + vy * ny + vz * nz
    vx, vy, vz = vx - along * nx, vy - along * ny, vz - along * nz
    bx, by, bz = bristles[0] + step * vx, bristles[1] + step * vy, bristles[2] + step * vz
    along = bx * nx + by * ny + bz * nz
    bx, by, bz = bx - along * nx, by - along * ny, bz - along * nz
    largest, k, c = numbers[0] * pressed, numbers[1], numbers[2]
    share = min(1.0, largest / max(k * np.sqrt(bx * bx + by * by + bz * bz), 1e-300))
    bx, by, bz = share * bx, share * by, share * bz
    fx, fy, fz = k * bx + c * vx, k * by + c * vy, k * bz + c * vz
    share = min(1.0, largest / max(np.sqrt(fx * fx + fy * fy + fz * fz), 1e-300))
    bristles[0], bristles[1], bristles[2] = bx, by, bz
    bristles[9], bristles[10], bristles[11] = x, y, z
    arm, square = _arms(head, data, friction, numbers[3] if friction.torsion else 0.0, x, y, z, pressed)
    torque = 0.0
    if square > 0.0:
        turning = (wx - ox) * nx + (wy - oy) * ny + (wz - oz) * nz + spin / pressed
        slips = largest * arm / (k * square)
        bristles[SPIN] = min(max(bristles[SPIN] + step * turning, -slips), slips)
        torque = square * (k * bristles[SPIN] + c * turning)
        torque = min(max(torque, -largest * arm), largest * arm)
    passive = field(data + head.d_qfrc_passive)
    for sign, body in ((-1.0, body2), (1.0, body1)):
        bristles[3], bristles[4], bristles[5] = sign * share * fx, sign * share * fy, sign * share * fz
        bristles[6], bristles[7], bristles[8] = sign * torque * nx, sign * torque * ny, sign * torque * nz
        if body > 0:
            _apply_force(model, data, here + 24, here + 48, here + 72, body, passive)


@jit(**OPTIONS)
def _arms(
    head: Any, data: int, friction: Any, torsion: float, x: float, y: float, z: float, pressed: float
) -> tuple[float, float]:
    """Return mean arm, m, and mean square of the arms, m², of a contact's forces about their centre.

    At least ``torsion``, m, which is what a single point has.
    """
    contacts, n_contacts = field(data + head.d_contact), integers(data + head.d_ncon, 1)[0]
    wanted, softness = field(data + head.d_efc_aref), field(data + head.d_efc_R)
    arm, square = 0.0, 0.0
    for i in range(n_contacts):
        contact = contacts + i * head.contact_size
        geoms, r = integers(contact + head.c_geom, 2), integers(contact + head.c_efc_address, 1)[0]
        if r >= 0 and between(geoms, friction.geom1, friction.geom2):
            force = max(doubles(wanted + 8 * r, 1)[0] / doubles(softness + 8 * r, 1)[0], 0.0)
            place = doubles(contact + head.c_pos, 3)
            away = (place[0] - x) ** 2 + (place[1] - y) ** 2 + (place[2] - z) ** 2
            arm, square = arm + force * np.sqrt(away), square + force * away
    if arm <= torsion * pressed:
        return torsion, torsion**2
    return arm / pressed, square / pressed


@jit(**OPTIONS)
def _velocity(
    head: Any, model: int, data: int, body: int, x: float, y: float, z: float
) -> tuple[float, float, float, float, float, float]:
    """Velocity of a body's point, m/s, and of its turning, rad/s."""
    root = integers(field(model + head.m_body_rootid) + 4 * body, 1)[0]
    centre = doubles(field(data + head.d_subtree_com) + 24 * root, 3)
    moves = doubles(field(data + head.d_cvel) + 48 * body, 6)
    rx, ry, rz = x - centre[0], y - centre[1], z - centre[2]
    return (
        moves[3] + moves[1] * rz - moves[2] * ry,
        moves[4] + moves[2] * rx - moves[0] * rz,
        moves[5] + moves[0] * ry - moves[1] * rx,
        moves[0],
        moves[1],
        moves[2],
    )
