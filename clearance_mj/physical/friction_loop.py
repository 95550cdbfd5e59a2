"""Dry friction between bodies by bristles that deflect and slip, compiled."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from ..core.jit import OPTIONS, jit
from .library import doubles, field, integers

__all__ = [
    "FRICTION", "OF_FRICTION", "advance_bristle", "apply_friction", "bend_in_plane", "exert_row_force", "is_between",
    "normal_rows",
]  # fmt: skip

OF_FRICTION = 7  # state: deflection (3), angle about the normal, angles rolled (3)
FRICTION = np.dtype(
    [(name, np.int64) for name in ("kind", "numeric", "numbers", "dof", "size", "geom1", "geom2", "law")]
)  # Bristles: address in numeric_data of largest force (of a pair its ratio to the normal force), k, c; their number;
# 1 if the pair follows a law
_SPARSE_FROM = 60  # number of velocities from which MuJoCo's automatic Jacobian is sparse
_ROUNDING = 1e-14  # of a position, relative: closer points count as one
_SPARSE, _AUTO = int(mujoco.mjtJacobian.mjJAC_SPARSE), int(mujoco.mjtJacobian.mjJAC_AUTO)
_TINY = 1e-30  # N, above zero in single precision too
_PYRAMIDAL = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_PYRAMIDAL)


@jit(**OPTIONS)
def is_between(geoms: Any, geom1: int, geom2: int) -> bool:
    """Return True if a contact is between these two geoms, in any order."""
    return (geoms[0] == geom1 and geoms[1] == geom2) or (geoms[0] == geom2 and geoms[1] == geom1)


@jit(**OPTIONS)
def advance_bristle(
    largest: float, k: float, c: float, deflection: float, step: float, speed: float
) -> tuple[float, float]:
    """Return deflection and force of a coordinate's bristle after a step: elastic up to the largest force."""
    slips = largest / k
    deflection = min(max(deflection + step * speed, -slips), slips)
    return deflection, min(max(k * deflection + c * speed, -largest), largest)


@jit(**OPTIONS)
def normal_rows(head: Any, data: int, contact: int, row: int) -> tuple[int, float]:
    """Return the number of constraint rows that press along a contact's normal, and R of an equivalent single row.

    In a pyramidal cone they are the edges, in pairs, whose mean reference is that of the normal alone.
    """
    softness = doubles(field(data + head.d_efc_R), row + 1)[row]
    if integers(field(data + head.d_efc_type), row + 1)[row] != _PYRAMIDAL:
        return 1, softness
    cone, slope = doubles(contact + head.c_mu, 1)[0], doubles(contact + head.c_friction, 1)[0]
    return 2 * (integers(contact + head.c_dim, 1)[0] - 1), softness / (2.0 * cone * cone * (1.0 + slope * slope))


@jit(**OPTIONS)
def _normal_force(head: Any, data: int, friction: Any, contact: int) -> tuple[int, int, float]:
    """Return first row, number of pressing rows and normal force of a contact; zeros if it is of another pair."""
    row = integers(contact + head.c_efc_address, 1)[0]
    if row < 0 or not is_between(integers(contact + head.c_geom, 2), friction.geom1, friction.geom2):
        return 0, 0, 0.0
    rows, softness = normal_rows(head, data, contact, row)
    if friction.law:
        reference = doubles(field(data + head.d_efc_aref) + 8 * row, rows).mean()
    else:  # not from the rows, which may contain friction already
        solref, d = doubles(contact + head.c_solref, 2), doubles(contact + head.c_solimp, 1)[0]
        depth = doubles(field(data + head.d_efc_pos) + 8 * row, 1)[0]
        reference = (solref[1] * doubles(field(data + head.d_efc_vel) + 8 * row, rows).mean() + solref[0] * depth) / d
    return row, rows, max(reference / softness, 0.0)


@jit(**OPTIONS)
def _surface_speed(head: Any, data: int, contact: int, row: int, rows: int, j: int) -> float:
    """Return the speed at which surfaces slip, spin or roll along a contact's coordinate j, 0 to 4.

    From MuJoCo 4 on it includes the surfaces' velocity, such as a conveyor's.
    """
    speeds = doubles(field(data + head.d_efc_vel) + 8 * row, 2 * 5)
    if rows == 1:
        return speeds[1 + j]
    return (speeds[2 * j] - speeds[2 * j + 1]) / (2.0 * doubles(contact + head.c_friction, 5)[j])


@jit(**OPTIONS)
def _exert(
    head: Any, model: int, data: int, contact: int, row: int, rows: int, j: int, normal_force: float, force: float
) -> None:
    """Make the solver exert a force or torque along a contact's coordinate j, in addition to the normal force."""
    if rows == 1:
        exert_row_force(head, model, data, row + 1 + j, force)
    else:
        edge = force / (2.0 * doubles(contact + head.c_friction, 5)[j])
        exert_row_force(head, model, data, row + 2 * j, normal_force / rows + edge)
        exert_row_force(head, model, data, row + 2 * j + 1, normal_force / rows - edge)


@jit(**OPTIONS)
def exert_row_force(head: Any, model: int, data: int, row: int, force: float) -> None:
    """Make the solver's row exert a force; the last step's acceleration compensates the parasitic mass."""
    nv, kind = integers(model + head.m_nv, 1)[0], integers(model + head.m_jacobian, 1)[0]
    jacobian, accelerations = field(data + head.d_efc_J), doubles(field(data + head.d_qacc_warmstart), nv)
    acceleration = 0.0
    if kind == _SPARSE or (kind == _AUTO and nv >= _SPARSE_FROM):
        first = integers(field(data + head.d_efc_J_rowadr), row + 1)[row]
        count = integers(field(data + head.d_efc_J_rownnz), row + 1)[row]
        columns = integers(field(data + head.d_efc_J_colind) + 4 * first, count)
        entries = doubles(jacobian + 8 * first, count)
        for i in range(count):
            acceleration += entries[i] * accelerations[columns[i]]
    else:
        entries = doubles(jacobian + 8 * row * nv, nv)
        for i in range(nv):
            acceleration += entries[i] * accelerations[i]
    reference, softness = doubles(field(data + head.d_efc_aref), row + 1), doubles(field(data + head.d_efc_R), row + 1)
    reference[row] = softness[row] * force + acceleration


@jit(**OPTIONS)
def apply_friction(
    head: Any, model: int, data: int, friction: Any, numbers: np.ndarray, bristles: np.ndarray, step: float
) -> None:
    """Advance the bristles between two geoms in the plane of their contact, and make the solver exert their force.

    Several points of contact have one bristle at the centre of their pressure, and one that resists spin about the
    normal there, with the arm of the points' forces. Each point bears friction in proportion to its normal force.
    """
    contacts, n_contacts = field(data + head.d_contact), integers(data + head.d_ncon, 1)[0]
    torsion = numbers[3] if friction.numbers > 3 else 0.0
    rolling = numbers[4] / numbers[0] if friction.numbers > 4 else 0.0
    spins, rolls = friction.numbers > 3, friction.numbers > 4
    total, spin, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0
    x, y, z, nx, ny, nz, vx, vy, vz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n_contacts):
        contact = contacts + i * head.contact_size
        row, rows, force = _normal_force(head, data, friction, contact)
        if force > 0.0:
            point, frame = doubles(contact + head.c_pos, 3), doubles(contact + head.c_frame, 9)
            total += force
            x, y, z = x + force * point[0], y + force * point[1], z + force * point[2]
            nx, ny, nz = nx + force * frame[0], ny + force * frame[1], nz + force * frame[2]
            a = force * _surface_speed(head, data, contact, row, rows, 0)
            b = force * _surface_speed(head, data, contact, row, rows, 1)
            vx = vx + a * frame[3] + b * frame[6]
            vy = vy + a * frame[4] + b * frame[7]
            vz = vz + a * frame[5] + b * frame[8]
            if spins:
                spin += force * _surface_speed(head, data, contact, row, rows, 2)
            if rolls:
                a = force * _surface_speed(head, data, contact, row, rows, 3)
                b = force * _surface_speed(head, data, contact, row, rows, 4)
                tx = tx + a * frame[3] + b * frame[6]
                ty = ty + a * frame[4] + b * frame[7]
                tz = tz + a * frame[5] + b * frame[8]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:  # no normal force, but contacts that separate fast may still have rows
        bristles[:] = 0.0
        for i in range(n_contacts):
            contact = contacts + i * head.contact_size
            row, rows, _ = _normal_force(head, data, friction, contact)
            if rows == 1:
                rows = integers(contact + head.c_dim, 1)[0]
            for j in range(rows):
                exert_row_force(head, model, data, row + j, 0.0)
        return
    nx, ny, nz = nx / length, ny / length, nz / length
    x, y, z, vx, vy, vz = x / total, y / total, z / total, vx / total, vy / total, vz / total
    arm, square, orbit = 0.0, 0.0, 0.0  # means over points: arm, m, its square, m², orbit speed, m²/s
    for i in range(n_contacts):
        contact = contacts + i * head.contact_size
        row, rows, force = _normal_force(head, data, friction, contact)
        if force > 0.0:
            point, frame = doubles(contact + head.c_pos, 3), doubles(contact + head.c_frame, 9)
            rx, ry, rz = point[0] - x, point[1] - y, point[2] - z
            distance_squared, weight = rx * rx + ry * ry + rz * rz, force / total
            arm, square = arm + weight * np.sqrt(distance_squared), square + weight * distance_squared
            a, b = _surface_speed(head, data, contact, row, rows, 0), _surface_speed(head, data, contact, row, rows, 1)
            ux, uy, uz = a * frame[3] + b * frame[6], a * frame[4] + b * frame[7], a * frame[5] + b * frame[8]
            orbit += weight * (nx * (ry * uz - rz * uy) + ny * (rz * ux - rx * uz) + nz * (rx * uy - ry * ux))
    by_points = arm > torsion + _ROUNDING * max(abs(x), abs(y), abs(z))
    if by_points:
        spin = orbit / square
    else:
        arm, square, spin = torsion, torsion * torsion, spin / total
    largest, k, c = numbers[0] * total, numbers[1], numbers[2]
    bristles[0], bristles[1], bristles[2], fx, fy, fz = bend_in_plane(
        bristles[:3], largest, k, c, step, (vx, vy, vz), (nx, ny, nz)
    )
    torque = 0.0
    if square > 0.0:
        bristles[3], torque = advance_bristle(largest * arm, k * square, c * square, bristles[3], step, spin)
    if rolls:
        rolling_squared = rolling * rolling
        bristles[4], bristles[5], bristles[6], tx, ty, tz = bend_in_plane(
            bristles[4:7], largest * rolling, k * rolling_squared, c * rolling_squared, step,
            (tx / total, ty / total, tz / total), (nx, ny, nz),
        )  # fmt: skip
    for i in range(n_contacts):
        contact = contacts + i * head.contact_size
        row, rows, force = _normal_force(head, data, friction, contact)
        if rows > 0:
            point, frame, weight = doubles(contact + head.c_pos, 3), doubles(contact + head.c_frame, 9), force / total
            rx, ry, rz = point[0] - x, point[1] - y, point[2] - z
            rate = torque / square if by_points else 0.0
            gx, gy, gz = (fx + rate * (ny * rz - nz * ry), fy + rate * (nz * rx - nx * rz),
                          fz + rate * (nx * ry - ny * rx))  # fmt: skip
            for j in range(2):
                a, b, d = frame[3 + 3 * j], frame[4 + 3 * j], frame[5 + 3 * j]
                _exert(head, model, data, contact, row, rows, j, force, -weight * (a * gx + b * gy + d * gz))
                if rolls:
                    _exert(head, model, data, contact, row, rows, 3 + j, force, -weight * (a * tx + b * ty + d * tz))
            if spins:
                _exert(head, model, data, contact, row, rows, 2, force, 0.0 if by_points else -weight * torque)


@jit(**OPTIONS)
def bend_in_plane(
    bristles: Any, largest: float, k: float, c: float, step: float, speed: Any, normal: Any
) -> tuple[float, float, float, float, float, float]:
    """Return deflection and force of bristles in a plane after a step: elastic up to the largest force."""
    nx, ny, nz = normal[0], normal[1], normal[2]
    normal_part = speed[0] * nx + speed[1] * ny + speed[2] * nz
    vx, vy, vz = speed[0] - normal_part * nx, speed[1] - normal_part * ny, speed[2] - normal_part * nz
    bx, by, bz = bristles[0] + step * vx, bristles[1] + step * vy, bristles[2] + step * vz
    normal_part = bx * nx + by * ny + bz * nz
    bx, by, bz = bx - normal_part * nx, by - normal_part * ny, bz - normal_part * nz
    scale = min(1.0, largest / max(k * np.sqrt(bx * bx + by * by + bz * bz), _TINY))
    bx, by, bz = scale * bx, scale * by, scale * bz
    fx, fy, fz = k * bx + c * vx, k * by + c * vy, k * bz + c * vz
    scale = min(1.0, largest / max(np.sqrt(fx * fx + fy * fy + fz * fz), _TINY))
    return bx, by, bz, scale * fx, scale * fy, scale * fz
