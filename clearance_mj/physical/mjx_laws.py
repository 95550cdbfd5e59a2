"""Limits whose k and c follow an amplitude or time in MJX: tables as arrays, evaluated as in `softener_loop`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from ..clearance.contacts.kelvin_voigt import KelvinVoigt
from .elements import SoftElement, find, requested_softness
from .packages import naming_package

with naming_package("functions for MJX", "clearance-mj[mjx]"):
    import jax
    from jax import numpy as jp

__all__ = ["TabulatedLaws", "can_be_tabulated", "tabulated_laws"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TabulatedLaws:
    """Stiffness and damping of limits over amplitude or time: linear between rows, constant beyond the ends."""

    abscissa: tuple[Any, ...]
    """of each an array (n_rows,), rising: amplitude, m or rad, or time, s"""
    k: tuple[Any, ...]
    """(n_rows,) N/m, or N m/rad"""
    c: tuple[Any, ...]
    release: Any
    """(n,) s, time constant with which an amplitude falls after a peak"""
    period: Any
    """(n,) s, after which time begins again; 0 where it does not"""
    names: tuple[str, ...] = field(metadata={"static": True})
    """of the joints and tendons"""
    places: tuple[tuple[bool, int, int, bool, bool], ...] = field(metadata={"static": True})
    """of each: True for a tendon; its index; its limit's row relative to the first one of contacts, below 0; True for a
    law over amplitude; True if its only wall is the upper one, as of a tendon between two sites"""

    def follow(self, mx: Any, dx: Any, reached: Any, step: Any) -> tuple[Any, Any]:
        """Advance by a step; return the amplitudes (n,) and the data with the limits' forces."""
        addresses, aref, amplitudes = dx._impl.contact.efc_address, dx._impl.efc_aref, []
        contacts = int(addresses[0]) if len(addresses) else aref.shape[0]  # the rows of limits are just before
        for i, (tendon, index, row, by_amplitude, from_zero) in enumerate(self.places):
            if tendon:
                x, speed, walls = dx.ten_length[index], dx._impl.ten_J[index] @ dx.qvel, mx.tendon_range[index]
            else:
                x, speed, walls = dx.qpos[mx.jnt_qposadr[index]], dx.qvel[mx.jnt_dofadr[index]], mx.jnt_range[index]
            middle = 0.0 if from_zero else walls.mean()
            amplitude = jp.maximum(jp.abs(x - middle), reached[i] * jp.exp(-step / self.release[i]))
            amplitudes.append(amplitude)
            period = jp.where(self.period[i] > 0, self.period[i], jp.inf)
            abscissa = amplitude if by_amplitude else jp.where(self.period[i] > 0, dx.time % period, dx.time)
            k, c = (jp.interp(abscissa, self.abscissa[i], values[i]) for values in (self.k, self.c))
            depth = jp.maximum(x - walls[1], 0.0 if from_zero else walls[0] - x)
            approach_speed = jp.where(x > middle, speed, -speed)
            force = jp.where(depth > 0, jp.maximum(k * depth + c * approach_speed, 0.0), 0.0)
            if not mx.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_LIMIT:
                aref = aref.at[contacts + row].set(force / dx._impl.efc_D[contacts + row])
        return jp.stack(amplitudes), dx.tree_replace({"_impl.efc_aref": aref})


def tabulated_laws(model: mujoco.MjModel) -> TabulatedLaws:
    """Return the laws of a model's limits."""
    elements = [element for element in requested_softness(model) if element.softness.law]
    tables = [element.softness.law.table(1) for element in elements]  # type: ignore[union-attr]
    ball = model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)  # limits of ball joints come first in MJX
    limited = np.concatenate((model.jnt_limited * ball, model.jnt_limited * ~ball, model.tendon_limited)).astype(int)
    rows, locations = np.cumsum(limited) - 1 - limited.sum(), []
    for (kind, name, _), table in zip(elements, tables):
        index = find(model, kind, name)
        row = int(rows[index + (2 if kind == "tendon" else 1) * model.njnt])
        spatial = kind == "tendon" and model.wrap_type[model.tendon_adr[index]] != int(mujoco.mjtWrap.mjWRAP_JOINT)
        from_zero = bool(spatial and model.tendon_range[index, 0] == 0)
        locations.append((kind == "tendon", index, row, bool(table.by_amplitude), from_zero))
    return TabulatedLaws(
        tuple(jp.array(table.abscissa) for table in tables), tuple(jp.array(t.parameters[:, 0, 0]) for t in tables),
        tuple(jp.array(t.parameters[:, 0, 1]) for t in tables), jp.array([t.release or 1.0 for t in tables]),
        jp.array([t.period for t in tables]), tuple(element.name for element in elements), tuple(locations),
    )  # fmt: skip


def can_be_tabulated(model: mujoco.MjModel, element: SoftElement) -> bool:
    """Return True for a law that is a table of k and c alone, of the limit of a tendon, hinge or slide."""
    kind, name, softness = element
    law = softness.law
    if kind == "pair" or law is None or law.grease is not None or law.table(1).kinds != (KelvinVoigt,):
        return False
    return kind == "tendon" or model.jnt_type[find(model, kind, name)] != int(mujoco.mjtJoint.mjJNT_BALL)
