"""The linear part of the modal engine's equations, packed for its compiled loop: of one case, or of several."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..linear import LinearModel, linear_model
from ..rig import Rig
from ..rig.instruments import Kinds, input_kinds
from ..rig.loads import order_forces
from ..rig.sensing import input_readings
from .modal_loop import ModalEquations

__all__ = [
    "at_spin", "driven", "free_flow", "kicked_damping", "linear_part", "moving", "pack", "packed_part", "padded",
    "places_of", "slide_rows",
]  # fmt: skip

FOUR = 4  # modes, or rows, of one case that are packed
WORST_CONDITION = 1e15  # of the matrix of a kick's implicit damping, beyond which velocities have no correct digits


def free_flow(omega: np.ndarray, damping: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the exact flow (4, n) of free modes over a step, and the inverse of their masses (n,); see modal.py."""
    half, decay = omega * step / 2, damping / 2
    w = np.emath.sqrt(omega**2 - decay**2)  # imaginary for an overdamped mode
    cos, sin = np.cos(w * step).real, step * np.sinc(w * step / np.pi).real
    flow = np.exp(-decay * step) * np.array([cos + decay * sin, sin, -(omega**2) * sin, cos - decay * sin])
    return flow, np.divide(np.tan(half), half, out=np.ones_like(half), where=half > 0)


def kicked_damping(viscous: np.ndarray, inverse_mass: np.ndarray, step: float) -> np.ndarray:
    """Return the force (n, n) of a viscous matrix per velocity in the middle of all other forces' kick.

    It acts at the velocity in the middle of its kick: stable however strong a dashpot is, and without work where the
    matrix is skew, as gyroscopic moments are.
    """
    implicit = np.eye(len(viscous)) + step / 2 * (viscous * inverse_mass[: len(viscous)])
    if viscous.size and np.linalg.cond(implicit) > WORST_CONDITION:
        raise np.linalg.LinAlgError("damping beyond what can be inverted")
    return np.linalg.solve(implicit, viscous)


def driven(model: LinearModel, kinds: Kinds) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (n_inputs, n) on the coordinates per unit of each input, and `input_readings`."""
    push = [model.input(kind, number) for number, kind in enumerate(input_kinds(kinds))]
    return np.array(push), input_readings(model.rig, kinds)


def slide_rows(rig: Rig) -> dict[int, int]:
    """Return the rows, after all others, of sliding along clearances of one coordinate that rub, by clearance."""
    rubbing = [j for j, b in enumerate(rig.bushings) if b.sliding_point is not None]
    return {j: 3 * rig.n_rows + i for i, j in enumerate(rubbing)}


def places_of(rig: Rig) -> np.ndarray:
    """Return the rows (n_bushings, 5) of each clearance's middle, then along y and z of both ends, as of `interact`."""
    places, slides = np.zeros((len(rig.bushings), 5), dtype=int), slide_rows(rig)
    for j, (bushing, rows) in enumerate(zip(rig.bushings, rig.clearance_rows)):
        size = bushing.n_coordinates
        places[j, 0] = rows.start
        for end in range(2):
            first = rig.n_rows + 2 * rows.start + size * end
            places[j, 1 + 2 * end : 3 + 2 * end] = (first, first + 1) if size == 2 else (slides.get(j, first), first)
    return places


def at_rows(model: LinearModel) -> np.ndarray:
    """Return the motion (n_rows, n) of all clearances' rows, and of sliding along them, per coordinate."""
    return np.vstack((model.at_points, *(model.sliding(j) for j in slide_rows(model.rig))))


@functools.lru_cache(maxsize=128)
def linear_part(rig: Rig, modes: int, kind: Kinds, step: float) -> tuple[ModalEquations, bool]:
    """Return the linear part, not packed, at the initial spin, and True if the kicks have all of the damping.

    Else the modes have it. Inputs are those of the excitation, and a constant one of loads if there are any.
    """
    model = linear_model(rig, modes)
    coupled = model.coupling.size > 0 or bool(model.bearings)
    flow, inverse_mass = free_flow(model.omega, np.zeros(model.size) if coupled else model.damping, step)
    rows, sensors, (push, on_base) = at_rows(model), model.sensor_rows, driven(model, kind)
    if model.weight.any():  # f₀ is one more input, whose signal is 1
        push, on_base = np.vstack((push, model.weight)), np.vstack((on_base, np.zeros(len(rig.sensors))))
    turning = np.zeros((0, model.size))
    if rig.unbalances or rig.orders:
        turning = np.vstack((model.unbalance, order_forces(rig.orders, model.directed, model.size)))
    spin = rig.spin.speed if rig.spin else 0.0
    linear = ModalEquations(
        inverse_mass, flow, push, len(input_kinds(kind)), turning, np.array([each.order for each in rig.orders]), rows,
        moving(rows), np.zeros((0, 5), dtype=int), (rows * inverse_mass) @ rows.T, sensors.accelerations,
        moving(sensors.accelerations), on_base,
        *at_spin(model, coupled, inverse_mass, step, spin), sensors.readings,
    )  # fmt: skip
    return linear, coupled


def at_spin(
    model: LinearModel, coupled: bool, inverse_mass: np.ndarray, step: float, spin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness (n, n) beyond that of the modes, and the damping that couples them, at a spin, rad/s."""
    springs = model.springs_at(spin)
    if spin and model.circulatory.size:
        springs = (springs if springs.size else 0.0) + spin * model.circulatory
    none = np.zeros((0, model.size))
    viscous = np.diag(model.damping) + model.coupling_at(spin) if coupled else none
    if spin and model.gyroscopic.size:
        viscous = (viscous if viscous.size else 0.0) + spin * model.gyroscopic
    kicked = kicked_damping(viscous, inverse_mass, step) if viscous.size else none
    return springs if springs.size else none, kicked


def moving(rows: np.ndarray) -> np.ndarray:
    """Return the span of the non-zero numbers of each row: the first, and the one after the last, (n_rows, 2)."""
    places = [np.flatnonzero(row) for row in rows]
    return np.array([(at[0], at[-1] + 1) if at.size else (0, 0) for at in places], dtype=int).reshape(-1, 2)


def packed_part(parts: Sequence[ModalEquations]) -> ModalEquations:
    """Pack the linear parts of one case or several for the loop."""
    packed: dict[str, Any] = {"n_excited": parts[0].n_excited}
    for name in ("inverse_mass", "flow", "input", "turning", "at_rows", "at_sensors", "readings"):
        packed[name] = pack([getattr(part, name) for part in parts])
    for name in ("springs", "coupling"):  # by columns; zeros in cases without
        matrices = [getattr(part, name) for part in parts]
        size = max(len(matrix) for matrix in matrices)
        n = matrices[0].shape[1]
        packed[name] = pack([matrix.T if len(matrix) and size else np.zeros((size, n)) for matrix in matrices])
    packed["orders"] = parts[0].orders.astype(float)
    packed["base"] = np.stack([part.base for part in parts], axis=-1)
    for name in ("spans", "of_sensors"):
        low, high = (np.stack([getattr(part, name)[:, i] for part in parts]) for i in (0, 1))
        spans = np.column_stack((low.min(axis=0), high.max(axis=0))).reshape(-1, 2)
        packed[name] = spans if len(parts) > 1 else np.column_stack((spans[:, 0] // FOUR, -(-spans[:, 1] // FOUR)))
    packed["groups"], packed["of_sensors"] = _groups(packed["spans"]), _groups(packed["of_sensors"])
    packed["compliance"] = padded([part.compliance for part in parts])
    return ModalEquations(**packed)


def _groups(spans: np.ndarray) -> np.ndarray:
    """Return (n, 5) three rows with the same span, its first mode and the one after the last; the last row repeats."""
    groups = []
    for start, stop in np.unique(spans, axis=0):
        rows = np.flatnonzero((spans == (start, stop)).all(axis=1))
        rows = np.append(rows, [rows[-1]] * (-len(rows) % 3))
        groups += [(*three, start, stop) for three in rows.reshape(-1, 3)]
    return np.array(groups, dtype=int).reshape(-1, 5)


def pack(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays (..., n) with the lanes as their last axis; a single one in packs of four, padded with zeros."""
    if len(parts) > 1:
        return np.ascontiguousarray(np.stack(parts, axis=-1))
    (rows,) = parts
    padded_rows = np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, -rows.shape[-1] % FOUR)])
    return np.ascontiguousarray(padded_rows.reshape(*rows.shape[:-1], padded_rows.shape[-1] // FOUR, FOUR))


def padded(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays (..., n) of rows with the lanes as their last axis; n of a single one is a multiple of four."""
    packs = pack(parts)
    return packs if len(parts) > 1 else packs.reshape(*packs.shape[:-2], packs.shape[-2] * FOUR, 1)
