"""Forces in the clearances in one step of an engine: fillings, contacts and friction; compiled.

Clearances have flat rows: a slot has one row for its middle and one for each end, a round one two, along y and z. A
force at a row changes the velocity of every row by the compliance, velocity per unit impulse: forces are solved for at
the velocity in the middle of the kick, ``half`` the step after its begin, sweep by sweep. Numbers are plain, or those
of all lanes, see lanes.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..clearance.kernel import (
    answered,
    depth_in,
    film_force,
    follow_law,
    forget,
    friction_force,
    friction_limit,
    limit_bristles,
    press,
    touch,
)  # fmt: skip
from ..clearance.lanes import all_below, any_below, larger, signed, smaller, where_above
from ..clearance.record import ClearanceRecord
from ..clearance.registers import load, packed, spread, store
from ..core.jit import inlined

__all__ = [
    "BRISTLES", "DEPTH", "ELASTIC", "ENDS", "FILLED", "NORMAL", "N_Y", "N_Z", "RUBBED", "VISCOUS", "fill_all",
    "find_contacts", "follow_contacts", "sweep", "torque_of_friction",
]  # fmt: skip

DEPTH, N_Y, N_Z, ELASTIC, VISCOUS, BRISTLES, NORMAL, RUBBED, LIMIT, REDUCTION = range(10)
"""Columns of each end: depth, m (of one coordinate with the sign of its wall), the wall's normal; elastic force, N,
damping, N s/m, bristles' deflection, m; normal force, friction and its limit, N, as of `sweep`; reduction by damping"""
ENDS = 10
FILLED = 7  # numbers of a filling: those of `answered`, then the reduction of the force by its damping
MIDDLE, OF_ENDS = 0, 1  # columns of a clearance's rows: its middle, then y and z of both ends


@inlined
def find_contacts(
    bushings: np.ndarray, numbers: np.ndarray, places: np.ndarray, x: np.ndarray, lanes: tuple[int, ...],
    ends: np.ndarray, acts: np.ndarray, pushed: np.ndarray,
) -> int:  # fmt: skip
    """Detect touching ends, in any lane, and rows with forces; return a clearance beyond its limit, or -1.

    ``places``: (n_bushings, 5) rows of the middle, then y and z of both ends; of a slot sliding replaces y.
    """
    pushed[:] = False
    for j in range(bushings.size):
        bushing, middle = bushings[j], places[j, MIDDLE]
        distance = abs(load(x, middle, lanes))
        pushed[middle] = True
        if bushing.coordinates == 2:
            distance = distance + abs(load(x, middle + 1, lanes))
            pushed[middle + 1] = True
        if not all_below(distance, load(numbers, bushing.limit, lanes)):
            return j
        for end in range(2):
            c, y, z = 2 * j + end, places[j, OF_ENDS + 2 * end], places[j, OF_ENDS + 2 * end + 1]
            if bushing.touching == 1:
                g = depth_in(bushing, numbers, load(x, z, lanes), lanes)
                store(ends, ENDS * c + DEPTH, g, lanes)
                acts[c] = any_below(0.0 - abs(g), 0.0)
            else:
                depth, n_y, n_z = touch(bushing, numbers, load(x, y, lanes), load(x, z, lanes), lanes)
                store(ends, ENDS * c + DEPTH, depth, lanes)
                store(ends, ENDS * c + N_Y, n_y, lanes)
                store(ends, ENDS * c + N_Z, n_z, lanes)
                acts[c] = any_below(0.0 - depth, 0.0)
                pushed[y] = pushed[y] or acts[c]
            pushed[z] = pushed[z] or acts[c]
            if not acts[c]:
                forget(bushing, numbers, end, lanes)
    return -1


@inlined
def fill_all(
    bushings: np.ndarray, numbers: np.ndarray, places: np.ndarray, x: np.ndarray, spin: Any, time: float,
    compliance: np.ndarray, half: float, lanes: tuple[int, ...], filled: np.ndarray,
) -> None:  # fmt: skip
    """Move the fillings to the clearances' displacements, and update laws to a time, s."""
    stride = compliance.shape[1]
    for j in range(bushings.size):
        bushing, row = bushings[j], places[j, MIDDLE]
        if bushing.coordinates == 1:
            film_force(bushing, numbers, (load(x, row, lanes),), spin, lanes)
            mobility = half * load(compliance, row * stride + row, lanes)
            damping = answered(bushing, numbers, 1, lanes)
            store(filled, FILLED * j, answered(bushing, numbers, 0, lanes), lanes)
            store(filled, FILLED * j + 1, damping, lanes)
            store(filled, FILLED * j + 6, 1.0 / (1.0 + damping * mobility), lanes)
        else:
            film_force(bushing, numbers, (load(x, row, lanes), load(x, row + 1, lanes)), spin, lanes)
            for k in range(6):
                store(filled, FILLED * j + k, answered(bushing, numbers, k, lanes), lanes)
        follow_law(bushing, numbers, time, lanes)


@inlined
def follow_contacts(
    bushings: np.ndarray, numbers: np.ndarray, places: np.ndarray, x: np.ndarray, w: np.ndarray, spin: Any,
    acts: np.ndarray, compliance: np.ndarray, half: float, lanes: tuple[int, ...], ends: np.ndarray,
) -> None:  # fmt: skip
    """Evaluate the contacts of all touching ends at velocities w of all rows, m/s."""
    stride, none = compliance.shape[1], spread(0.0, lanes)
    for c in range(2 * bushings.size):
        if not acts[c]:
            continue
        j, end = c // 2, c % 2
        bushing, y, z = bushings[j], places[j, OF_ENDS + 2 * end], places[j, OF_ENDS + 2 * end + 1]
        depth = load(ends, ENDS * c + DEPTH, lanes)
        if bushing.touching == 1:
            k, damping = press(bushing, numbers, end, depth, load(w, z, lanes), lanes)
            damping = where_above(damping, abs(depth))
            mobility = half * load(compliance, z * stride + z, lanes)
            store(ends, ENDS * c + N_Z, signed(none + 1.0, depth), lanes)
            store(ends, ENDS * c + REDUCTION, 1.0 / (1.0 + damping * mobility), lanes)
        else:
            k, damping, bristles = friction_force(
                bushing, numbers, end, depth, load(ends, ENDS * c + N_Y, lanes), load(ends, ENDS * c + N_Z, lanes),
                load(x, y, lanes), load(x, z, lanes), load(w, y, lanes), load(w, z, lanes), spin, lanes,
            )  # fmt: skip
            store(ends, ENDS * c + BRISTLES, bristles, lanes)
        store(ends, ENDS * c + ELASTIC, k * depth, lanes)
        store(ends, ENDS * c + VISCOUS, damping, lanes)
        store(ends, ENDS * c + NORMAL, none, lanes)
        store(ends, ENDS * c + RUBBED, none, lanes)


@inlined
def _set_force(
    compliance: np.ndarray, half: float, row: int, new: Any, pushed: np.ndarray, w: np.ndarray, force: np.ndarray,
    lanes: tuple[int, ...],
) -> None:  # fmt: skip
    """Set the force at a row, N, against the displacement, and update velocities."""
    side = packed(lanes)
    change, rows = half * (new - load(force, row, lanes)), compliance.shape[1] * len(lanes) // len(side)
    store(force, row, new, lanes)
    for r in range(rows):
        if len(lanes) == 1 or pushed[r]:
            store(w, r, load(w, r, side) - load(compliance, row * rows + r, side) * change, side)


@inlined
def _add_forces(
    compliance: np.ndarray, half: float, row_y: int, row_z: int, y: Any, z: Any, pushed: np.ndarray, w: np.ndarray,
    force: np.ndarray, lanes: tuple[int, ...],
) -> None:  # fmt: skip
    """Change the forces at two rows by y and z, N, and update velocities."""
    side = packed(lanes)
    half_y, half_z, rows = half * y, half * z, compliance.shape[1] * len(lanes) // len(side)
    store(force, row_y, load(force, row_y, lanes) + y, lanes)
    store(force, row_z, load(force, row_z, lanes) + z, lanes)
    for r in range(rows):
        if len(lanes) == 1 or pushed[r]:
            change = load(compliance, row_y * rows + r, side) * half_y
            change = change + load(compliance, row_z * rows + r, side) * half_z
            store(w, r, load(w, r, side) - change, side)


@inlined
def _mobility(compliance: np.ndarray, row_y: int, row_z: int, y: Any, z: Any, lanes: tuple[int, ...]) -> Any:
    """Return the velocity along a direction per unit impulse along it."""
    stride = compliance.shape[1]
    yy, yz = load(compliance, row_y * stride + row_y, lanes), load(compliance, row_y * stride + row_z, lanes)
    zy, zz = load(compliance, row_z * stride + row_y, lanes), load(compliance, row_z * stride + row_z, lanes)
    return yy * y * y + (yz + zy) * y * z + zz * z * z


@inlined
def sweep(
    bushings: np.ndarray, numbers: np.ndarray, places: np.ndarray, compliance: np.ndarray, half: float, spin: Any,
    acts: np.ndarray, pushed: np.ndarray, known: np.ndarray, filled: np.ndarray, ends: np.ndarray, w: np.ndarray,
    force: np.ndarray, lanes: tuple[int, ...],
) -> None:  # fmt: skip
    """Solve for every force at the velocity under all others: a Gauss-Seidel sweep over all clearances.

    ``known``: (n_bushings, 2) True where the forces of the filling, and the contacts' normal forces, are known.
    """
    for j in range(bushings.size):
        row = places[j, MIDDLE]
        if known[j, 0]:
            continue
        if bushings[j].coordinates == 1:
            factor = load(filled, FILLED * j + 6, lanes)
            new = _implicit_force(
                load(filled, FILLED * j, lanes), load(filled, FILLED * j + 1, lanes), factor, compliance, half, row, w,
                force, lanes,
            )  # fmt: skip
            _set_force(compliance, half, row, new, pushed, w, force, lanes)
        else:
            _solve_filling(filled, j, compliance, half, row, pushed, w, force, lanes)
    for c in range(2 * bushings.size):
        if not acts[c]:
            continue
        j, end = c // 2, c % 2
        bushing, y, z = bushings[j], places[j, OF_ENDS + 2 * end], places[j, OF_ENDS + 2 * end + 1]
        if bushing.touching == 1:
            if known[j, 1]:
                continue
            side = load(ends, ENDS * c + N_Z, lanes)
            new = _implicit_force(
                load(ends, ENDS * c + ELASTIC, lanes), load(ends, ENDS * c + VISCOUS, lanes),
                load(ends, ENDS * c + REDUCTION, lanes), compliance, half, z, w, force, lanes,
            )  # fmt: skip
            if not bushing.adhesion:
                new = side * larger(side * new, 0.0)
            store(ends, ENDS * c + NORMAL, side * new, lanes)
            _set_force(compliance, half, z, new, pushed, w, force, lanes)
        else:
            if not known[j, 1]:
                _solve_normal(bushing, ends, c, compliance, half, y, z, pushed, w, force, lanes)
            if bushing.rubs:
                _solve_friction(bushing, numbers, ends, c, compliance, half, y, z, spin, pushed, w, force, lanes)


@inlined
def _implicit_force(
    elastic: Any, damping: Any, factor: Any, compliance: np.ndarray, half: float, row: int, w: np.ndarray,
    force: np.ndarray, lanes: tuple[int, ...],
) -> Any:  # fmt: skip
    """Return the force of a spring and a damper at the velocity that includes its effect, N."""
    mobility = half * load(compliance, row * compliance.shape[1] + row, lanes)
    free = load(w, row, lanes) + mobility * load(force, row, lanes)
    return (elastic + damping * free) * factor


@inlined
def _solve_filling(
    filled: np.ndarray, j: int, compliance: np.ndarray, half: float, row: int, pushed: np.ndarray, w: np.ndarray,
    force: np.ndarray, lanes: tuple[int, ...],
) -> None:  # fmt: skip
    """Solve for the force of a filling along y and z at the velocity that includes its effect."""
    stride, k = compliance.shape[1], FILLED * j
    f_y, f_z, yy = load(filled, k, lanes), load(filled, k + 1, lanes), load(filled, k + 2, lanes)
    yz, zy, zz = load(filled, k + 3, lanes), load(filled, k + 4, lanes), load(filled, k + 5, lanes)
    y_by_y = half * load(compliance, row * stride + row, lanes)
    z_by_y = half * load(compliance, row * stride + row + 1, lanes)
    y_by_z = half * load(compliance, (row + 1) * stride + row, lanes)
    z_by_z = half * load(compliance, (row + 1) * stride + row + 1, lanes)
    now_y, now_z = load(force, row, lanes), load(force, row + 1, lanes)
    free_y = load(w, row, lanes) + y_by_y * now_y + y_by_z * now_z
    free_z = load(w, row + 1, lanes) + z_by_y * now_y + z_by_z * now_z
    a, b = 1.0 + yy * y_by_y + yz * z_by_y, yy * y_by_z + yz * z_by_z
    c, d = zy * y_by_y + zz * z_by_y, 1.0 + zy * y_by_z + zz * z_by_z
    y, z = f_y + yy * free_y + yz * free_z, f_z + zy * free_y + zz * free_z
    scale = 1.0 / (a * d - b * c)
    new_y, new_z = (d * y - b * z) * scale, (a * z - c * y) * scale
    _add_forces(compliance, half, row, row + 1, new_y - now_y, new_z - now_z, pushed, w, force, lanes)


@inlined
def _solve_normal(
    bushing: ClearanceRecord, ends: np.ndarray, c: int, compliance: np.ndarray, half: float, row_y: int, row_z: int,
    pushed: np.ndarray, w: np.ndarray, force: np.ndarray, lanes: tuple[int, ...],
) -> None:  # fmt: skip
    """Solve for the normal force of a contact of two coordinates at the velocity that includes its effect."""
    y, z = load(ends, ENDS * c + N_Y, lanes), load(ends, ENDS * c + N_Z, lanes)
    damping, now = load(ends, ENDS * c + VISCOUS, lanes), load(ends, ENDS * c + NORMAL, lanes)
    mobility = half * _mobility(compliance, row_y, row_z, y, z, lanes)
    free = y * load(w, row_y, lanes) + z * load(w, row_z, lanes) + mobility * now
    normal = (load(ends, ENDS * c + ELASTIC, lanes) + damping * free) / (1.0 + damping * mobility)
    if not bushing.adhesion:
        normal = larger(normal, 0.0)
    store(ends, ENDS * c + NORMAL, normal, lanes)
    change = normal - now
    _add_forces(compliance, half, row_y, row_z, change * y, change * z, pushed, w, force, lanes)


@inlined
def _solve_friction(
    bushing: ClearanceRecord, numbers: np.ndarray, ends: np.ndarray, c: int, compliance: np.ndarray, half: float,
    row_y: int, row_z: int, spin: Any, pushed: np.ndarray, w: np.ndarray, force: np.ndarray, lanes: tuple[int, ...],
) -> None:  # fmt: skip
    """Solve for the friction of a contact under its normal force at the velocity that includes its effect."""
    y, z = 0.0 - load(ends, ENDS * c + N_Z, lanes), load(ends, ENDS * c + N_Y, lanes)
    stiffness, damping = load(numbers, bushing.friction + 1, lanes), load(numbers, bushing.friction + 2, lanes)
    now, normal = load(ends, ENDS * c + RUBBED, lanes), larger(load(ends, ENDS * c + NORMAL, lanes), 0.0)
    mobility = half * _mobility(compliance, row_y, row_z, y, z, lanes)
    free = y * load(w, row_y, lanes) + z * load(w, row_z, lanes) + mobility * now
    free = free + load(numbers, bushing.friction + 5, lanes) * spin
    rubbed = (stiffness * load(ends, ENDS * c + BRISTLES, lanes) + damping * free) / (1.0 + damping * mobility)
    limit = friction_limit(bushing, numbers, normal, free - mobility * rubbed, lanes)
    rubbed = smaller(larger(rubbed, 0.0 - limit), limit)
    store(ends, ENDS * c + LIMIT, limit, lanes)
    store(ends, ENDS * c + RUBBED, rubbed, lanes)
    change = rubbed - now
    _add_forces(compliance, half, row_y, row_z, change * y, change * z, pushed, w, force, lanes)


@inlined
def torque_of_friction(
    bushings: np.ndarray, numbers: np.ndarray, acts: np.ndarray, ends: np.ndarray, lanes: tuple[int, ...]
) -> Any:
    """Slip bristles beyond their limit; return the torque of friction on the shaft, N m."""
    torque = spread(0.0, lanes)
    for c in range(2 * bushings.size):
        bushing = bushings[c // 2]
        if acts[c] and bushing.rubs:
            torque = torque + load(numbers, bushing.friction + 5, lanes) * load(ends, ENDS * c + RUBBED, lanes)
            limit_bristles(bushing, numbers, c % 2, load(ends, ENDS * c + LIMIT, lanes), lanes)
    return torque
