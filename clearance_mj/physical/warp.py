"""Friction and drives in MuJoCo Warp, MuJoCo's engine for thousands of worlds on a GPU, which runs on a CPU too.

Contacts, limits and backlash of constant stiffness and damping do not need this module: MuJoCo Warp follows the solver
parameters of the compiled model. `put_model` gives its model callbacks that do what a `Softener` does on a CPU:
``passive`` advances bristles, ``act_dyn`` drives. Their state is, as on a CPU, in ``userdata`` and ``act`` of each
world, so ``mujoco_warp`` makes, steps, captures, copies and resets data as always.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np

from ..core.errors import ModelError
from .accelerators import frictionless_copy
from .bristles import BristleSettings
from .drives import DRIVE, PlacedDrive
from .friction_loop import OF_FRICTION
from .packages import naming_package
from .softener import ActiveParts, drive_places, friction_places, reserved

with naming_package("callbacks for MuJoCo Warp", "clearance-mj[warp]"):
    import mujoco_warp as mjw
    import warp as wp

    from .warp_kernels import Bristles, Drive, DrivePlace, FrictionPlace, bend_all, link, rub_all, turn_all

__all__ = ["WarpParameters", "put_model"]


@dataclass(frozen=True)
class WarpParameters:
    """Parameters of friction and drives, arrays of structures on the device: (1, n), or (nworld, n) if worlds differ.

    ``numbers = parameters.drives.numpy()`` is a structured array, ``numbers["gap"][:, 0] = gaps`` changes the first
    drive in it, and ``parameters.drives.assign(numbers)`` brings it back.
    """

    frictions: Any
    """largest, N m or N (of a pair its ratio to the normal force), k and c, and of pairs torsion and rolling, m"""
    drives: Any
    """with the fields of `drives.DRIVE`"""
    hysteresis: Any
    """(1 or nworld, n, m) stiffness and force of the drives' elements, zero where a drive has fewer than others"""
    friction_names: tuple[str, ...]
    """such as "joint elbow" or "pair foot - floor"; in the order of ``frictions``"""
    drive_names: tuple[str, ...]


def put_model(model: mujoco.MjModel, nworld: int = 1, **options: Any) -> tuple[Any, WarpParameters]:
    """Return a compiled model for MuJoCo Warp, in which friction and drives act, and their parameters.

    Data are of ``mujoco_warp.make_data(model, ...)`` or ``put_data(model, data, ...)`` with the compiled model itself;
    bristles and drives start from ``data.userdata`` and ``data.act``. Steps are ``mujoco_warp.step(m, d)``. Forces of
    friction are among ``qfrc_passive``, those of drives are ``actuator_force``; `drive_state` reads ``d.act.numpy()``.
    The callbacks ``passive`` and ``act_dyn`` are in use.

    Parameters
    ----------
    model : mujoco.MjModel
        Compiled with `compile`; not changed.
    nworld : int
        Number of worlds whose parameters may differ; 1: all have the same.
    **options
        Of ``mujoco_warp.put_model``, such as ``batch_sizes={"pair_solref": nworld}`` for contacts that differ.

    Returns
    -------
    tuple
        A ``mujoco_warp.Model`` and its `WarpParameters`.

    Raises
    ------
    ModelError
        For laws, bushings, integrator RK4, friction of contacts with ``discrete``, drives of a model whose actuation
        is disabled or that has disabled groups of actuators, and models that were compiled without `compile`.
    """
    pressing_model = frictionless_copy(model, "MuJoCo Warp")
    parts = ActiveParts.of(model)  # no laws and bushings, which the copy refuses
    bristles, placed = parts.bristles, parts.drives
    discrete = getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", None)
    if model.opt.integrator == discrete and any(b.kind == "pair" for b in bristles):
        raise ModelError("integrator discrete changes the rows of contacts with friction; use Euler or implicitfast")
    if model.opt.disableactuator and placed:
        raise ModelError("MuJoCo Warp knows no disabled groups of actuators; set actuatorgroupdisable to none")
    size = 2 + OF_FRICTION * len(bristles) if bristles else 0
    room = reserved(model, size, parts)
    parameters = _parameters(model, bristles, placed, nworld)
    for drive in placed:  # MuJoCo Warp 4.0.0 does not integrate "user" dynamics
        pressing_model.actuator_dyntype[drive.actuator] = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
    m = mjw.put_model(pressing_model, **options)
    if bristles:
        table = _to_device(friction_places(model, bristles), FrictionPlace)
        m.callback.passive = partial(_apply_friction, parameters, table, (room.first, size))
    if placed:
        m.callback.act_dyn = partial(_advance_drives, parameters, _to_device(drive_places(model, placed), DrivePlace))
    return m, parameters


def _parameters(
    model: mujoco.MjModel, bristles: Sequence[BristleSettings], placed: Sequence[PlacedDrive], nworld: int
) -> WarpParameters:
    """Return the parameters of a model, the same for all worlds."""
    friction_data = np.zeros((nworld, len(bristles)), Bristles.numpy_dtype())
    for i, friction in enumerate(bristles):
        numbers = model.numeric_data[friction.numeric :][: friction.size]
        for name, value in zip(friction_data.dtype.names or (), numbers):
            friction_data[name][:, i] = value
    drive_data = np.zeros((nworld, len(placed)), DRIVE)
    hysteresis = np.zeros((nworld, len(placed), max((drive.hysteresis for drive in placed), default=0), 2))
    for i, drive in enumerate(placed):
        drive_data[:, i], hysteresis[:, i, : drive.hysteresis] = drive.numbers(model), drive.hysteresis_elements(model)
    return WarpParameters(
        _to_device(friction_data, Bristles), _to_device(drive_data, Drive), wp.array(hysteresis, dtype=wp.vec2),
        tuple(f"{b.kind} {b.name}" for b in bristles), tuple(drive.name for drive in placed),
    )  # fmt: skip


def _to_device(records: np.ndarray, structure: Any) -> Any:
    """Return a structured array on the device."""
    return wp.array(records.astype(structure.numpy_dtype()), dtype=structure)


def _apply_friction(parameters: WarpParameters, table: Any, room: tuple[int, int], m: Any, d: Any) -> None:
    """Advance the bristles of every world and apply their forces."""
    if d.userdata.shape[1] < room[0] + 2 * room[1]:
        raise ModelError("data have no room for bristles; make them with the compiled model itself")
    heads, next_contact = wp.empty((d.nworld, len(table)), dtype=int), wp.empty(d.naconmax, dtype=int)
    steps = wp.empty(d.nworld, dtype=float)
    wp.launch(
        bend_all, d.nworld, [m.opt.timestep, d.time, table, parameters.frictions, *room, d.qvel, d.ten_velocity,
        d.ten_J, m.ten_J_colind], [d.userdata, d.qfrc_passive, heads, steps],
    )  # fmt: skip
    contact = d.contact
    wp.launch(
        link, d.naconmax, [d.nacon, contact.worldid, contact.geom, contact.efc_address, table, heads], [next_contact]
    )
    wp.launch(
        rub_all, (d.nworld, len(table)), [
            table, parameters.frictions, room[0], steps, heads, next_contact, contact.pos, contact.frame, contact.geom,
            contact.efc_address, contact.surfacevel, m.flg_surfacevel, m.geom_bodyid, m.body_weldid, m.body_rootid,
            m.body_dofadr, m.body_dofnum, m.dof_parentid, m.body_isdofancestor, d.subtree_com, d.cvel, d.cdof,
            d.qacc_warmstart, m.is_sparse, d.efc.J, d.efc.J_rownnz, d.efc.J_rowadr, d.efc.J_colind, d.efc.D,
        ], [d.efc.aref, d.userdata, d.qfrc_passive],
    )  # fmt: skip


def _advance_drives(parameters: WarpParameters, table: Any, m: Any, d: Any) -> None:
    """Advance the drives of every world."""
    clamped = not m.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    wp.launch(
        turn_all, (d.nworld, len(table)), [
            m.opt.timestep, table, parameters.drives, parameters.hysteresis, clamped, m.actuator_gear,
            m.actuator_ctrllimited, m.actuator_ctrlrange, m.actuator_actrange, m.actuator_dynprm, m.actuator_gainprm,
            m.actuator_biasprm, m.actuator_forcerange, d.act, d.ctrl, d.actuator_length, d.actuator_velocity,
        ], [d.act_dot, d.actuator_force],
    )  # fmt: skip
