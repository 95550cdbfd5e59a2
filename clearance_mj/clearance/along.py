"""Forces of filling, contact and friction in a given motion of a clearance; compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.jit import OPTIONS, inlined, jit
from .kernel import (
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
from .lanes import any_below, larger, signed, smaller, where_above
from .record import Clearance, ClearanceRecord, WithBushings, WithTable, clearance_records
from .registers import load, spread
from .vectors import of_one_or_two, plus

__all__ = ["cycle_force", "force_at", "forces_along"]

PLAIN = (0,)
PHASES = 2000  # instants of a cycle
CYCLES = 3  # of which the last is periodic


def _end_force_one(bushing: Any, numbers: Any, end: Any, r: Any, v: Any, spin: Any, lanes: Any) -> Any:
    if bushing.touching == 2:
        return (_wall_force(bushing, numbers, end, 0.0 * r[0], r[0], 0.0 * v[0], v[0], spin, lanes)[1],)
    return (_slot_force(bushing, numbers, end, r[0], v[0], lanes),)


def _end_force_two(bushing: Any, numbers: Any, end: Any, r: Any, v: Any, spin: Any, lanes: Any) -> Any:
    return _wall_force(bushing, numbers, end, r[0], r[1], v[0], v[1], spin, lanes)


_end_force = of_one_or_two(_end_force_one, _end_force_two)


@inlined
def _slot_force(
    bushing: ClearanceRecord, numbers: np.ndarray, end: int, x: Any, speed: Any, lanes: tuple[int, ...]
) -> Any:
    """Return the force of an end against its displacement, N."""
    g = depth_in(bushing, numbers, x, lanes)
    if not any_below(0.0 - abs(g), 0.0):
        forget(bushing, numbers, end, lanes)
        return spread(0.0, lanes)
    k, c = press(bushing, numbers, end, g, speed, lanes)
    force = k * abs(g) + c * signed(speed, g)
    if not bushing.adhesion:
        force = larger(force, 0.0)
    return signed(where_above(force, abs(g)), g)


@inlined
def _wall_force(
    bushing: ClearanceRecord, numbers: np.ndarray, end: int, y: Any, z: Any, speed_y: Any, speed_z: Any, spin: Any,
    lanes: tuple[int, ...],
) -> Any:  # fmt: skip
    """Return the force of an end along y and z against its displacement, N."""
    depth, n_y, n_z = touch(bushing, numbers, y, z, lanes)
    if not any_below(0.0 - depth, 0.0):
        forget(bushing, numbers, end, lanes)
        return spread(0.0, lanes), spread(0.0, lanes)
    k, c, bristles = friction_force(bushing, numbers, end, depth, n_y, n_z, y, z, speed_y, speed_z, spin, lanes)
    normal = k * depth + c * (n_y * speed_y + n_z * speed_z)
    if not bushing.adhesion:
        normal = larger(normal, 0.0)
    if not bushing.rubs:
        return n_y * normal, n_z * normal
    sliding = n_y * speed_z - n_z * speed_y + load(numbers, bushing.friction + 5, lanes) * spin
    stiffness, damping = load(numbers, bushing.friction + 1, lanes), load(numbers, bushing.friction + 2, lanes)
    limit = friction_limit(bushing, numbers, larger(normal, 0.0), sliding, lanes)
    limit_bristles(bushing, numbers, end, limit, lanes)
    friction = smaller(larger(stiffness * bristles + damping * sliding, 0.0 - limit), limit)
    return n_y * normal - n_z * friction, n_z * normal + n_y * friction


def _filling_force_one(bushing: Any, numbers: Any, v: Any, lanes: Any) -> Any:
    return (answered(bushing, numbers, 0, lanes) + answered(bushing, numbers, 1, lanes) * v[0],)


def _filling_force_two(bushing: Any, numbers: Any, v: Any, lanes: Any) -> Any:
    f_y, f_z, yy, yz = (
        answered(bushing, numbers, 0, lanes), answered(bushing, numbers, 1, lanes),
        answered(bushing, numbers, 2, lanes), answered(bushing, numbers, 3, lanes),
    )  # fmt: skip
    zy, zz = answered(bushing, numbers, 4, lanes), answered(bushing, numbers, 5, lanes)
    return f_y + yy * v[0] + yz * v[1], f_z + zy * v[0] + zz * v[1]


_filling_force = of_one_or_two(_filling_force_one, _filling_force_two)


@inlined
def force_at(
    bushing: ClearanceRecord, numbers: np.ndarray, time: float, r: Any, v: Any, r_a: Any, v_a: Any, r_b: Any, v_b: Any,
    spin: Any, lanes: tuple[int, ...],
) -> Any:  # fmt: skip
    """Return the force of a clearance, N, a vector, in the next step: its middle is at r, its ends at r_a and r_b.

    Displacements are vectors from the unloaded shaft, m, with velocities v, v_a and v_b, m/s; the spin is in rad/s.
    """
    film_force(bushing, numbers, r, spin, lanes)
    force = _filling_force(bushing, numbers, v, lanes)
    follow_law(bushing, numbers, time, lanes)
    force = plus(force, _end_force(bushing, numbers, 0, r_a, v_a, spin, lanes))
    return plus(force, _end_force(bushing, numbers, 1, r_b, v_b, spin, lanes))


_vector = of_one_or_two(
    lambda like, rows, i, p: (rows[i, p, 0],), lambda like, rows, i, p: (rows[i, p, 0], rows[i, p, 1])
)


def _store_one(force: Any, out: Any, i: Any) -> None:
    out[i, 0] = force[0]


def _store_two(force: Any, out: Any, i: Any) -> None:
    out[i, 0] = force[0]
    out[i, 1] = force[1]


_store = of_one_or_two(_store_one, _store_two)


@jit(**OPTIONS)
def _fill_forces(
    like: tuple[float, ...], bushings: np.ndarray, numbers: np.ndarray, j: int, x: np.ndarray, v: np.ndarray,
    spin: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    bushing = bushings[j]
    for i in range(out.shape[0]):
        force = force_at(
            bushing, numbers, i * bushing.step, _vector(like, x, i, 0), _vector(like, v, i, 0), _vector(like, x, i, 1),
            _vector(like, v, i, 1), _vector(like, x, i, 2), _vector(like, v, i, 2), spin[i], PLAIN,
        )  # fmt: skip
        _store(force, out, i)


def forces_along(
    clearance: Clearance, j: int, x: np.ndarray, v: np.ndarray, spin: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the forces (n_t, d) of clearance j against its displacement, N, along a motion of d coordinates.

    Parameters
    ----------
    clearance : Clearance
        Records with the motion's step, from rest; their state is advanced.
    j : int
        Index of the clearance.
    x, v : ndarray, shape (n_t, 3, d)
        Displacements from the unloaded shaft, m, and velocities, m/s, of the middle and both ends.
    spin : float or ndarray, shape (n_t,)
        rad/s.
    """
    out = np.empty((len(x), x.shape[2]))
    spins = np.ascontiguousarray(np.broadcast_to(np.asarray(spin, dtype=float), len(x)))
    _fill_forces((0.0,) * x.shape[2], *clearance, j, x, v, spins, out)
    return out


def cycle_force(
    rig: WithBushings, law: WithTable, amplitude: np.ndarray, frequency: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement, m, and force, N, (n_bushings, PHASES + 1) of a harmonic cycle, the shaft parallel to itself.

    The amplitude is (n_bushings,) in m, the frequency in Hz; positive forces act against positive displacements. Round
    clearances are moved along z.
    """
    phase = 2 * np.pi * np.arange(CYCLES * PHASES + 1) / PHASES
    records, cycles = clearance_records(rig, law, 1 / (frequency * PHASES)), []
    for j, (bushing, largest) in enumerate(zip(rig.bushings, amplitude)):
        x, v = np.zeros((2, phase.size, 3, bushing.n_coordinates))
        x[:, :, -1] = largest * np.sin(phase)[:, None]
        v[:, :, -1] = 2 * np.pi * frequency * largest * np.cos(phase)[:, None]
        cycles.append((x[:, 0, -1], forces_along(records, j, x, v)[:, -1]))
    displacement, force = (np.array(part)[:, -PHASES - 1 :] for part in zip(*cycles))
    return displacement, force
