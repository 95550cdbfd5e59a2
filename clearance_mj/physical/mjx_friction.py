"""Bristles of joints, tendons and contacts in MJX: the formulas of `friction_loop`, as functions of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from .bristles import BristleSettings, bristles_of
from .elements import find
from .packages import naming_package

with naming_package("functions for MJX", "clearance-mj[mjx]"):
    import jax
    from jax import numpy as jp

__all__ = ["OF_PAIR", "DryFriction", "PairFriction", "dry_friction", "pair_friction"]

OF_PAIR = 7
"""State variables of a pair's bristles: deflection (3), spin angle, rolling angles (3)"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DryFriction:
    """Friction of joints and tendons."""

    force: Any
    """(n,) N m, or N"""
    k: Any
    """(n,) N m/rad, or N/m"""
    c: Any
    names: tuple[str, ...] = field(metadata={"static": True})
    """of the joints, then of the tendons"""
    dofs: tuple[int, ...] = field(metadata={"static": True})
    tendons: tuple[int, ...] = field(metadata={"static": True})

    def rub(self, dx: Any, bristles: Any, step: Any) -> tuple[Any, Any]:
        """Advance bristles (n,) by a step; return them and the data with their forces."""
        dofs, jacobian = np.array(self.dofs, dtype=int), dx._impl.ten_J[np.array(self.tendons, dtype=int)]
        speed = jp.concatenate((dx.qvel[dofs], jacobian @ dx.qvel))
        slips = self.force / self.k
        bristles = jp.clip(bristles + step * speed, -slips, slips)
        force = jp.clip(self.k * bristles + self.c * speed, -self.force, self.force)
        passive = dx.qfrc_passive.at[dofs].add(-force[: len(dofs)]) - force[len(dofs) :] @ jacobian
        return bristles, dx.replace(qfrc_passive=passive)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PairFriction:
    """Friction of pairs of geoms."""

    coefficient: Any
    """(n,)"""
    k: Any
    """(n,) N/m"""
    c: Any
    """(n,) N s/m"""
    torsion: Any
    """(n,) m"""
    rolling: Any
    """(n,) m"""
    names: tuple[str, ...] = field(metadata={"static": True})
    geoms: tuple[tuple[int, int], ...] = field(metadata={"static": True})
    moved: tuple[tuple[tuple[bool, ...], ...], ...] = field(metadata={"static": True})
    """of each pair and geom: True for the velocities that move it"""

    def rub(self, mx: Any, dx: Any, bristles: Any, step: Any) -> tuple[Any, Any]:
        """Advance bristles (n, OF_PAIR) by a step; return them and the data with their forces.

        As `friction_loop.rub`: several points of contact have one bristle at the centre of their pressure, and the last
        step's acceleration compensates the parasitic mass of the contact.
        """
        count = int(np.sum(dx._impl.contact.dim == 1))  # frictionless contacts come first, and so do their rows
        if not count:
            return jp.zeros_like(bristles), dx
        contact, first = dx._impl.contact, int(dx._impl.contact.efc_address[0])
        rows = slice(first, first + count)
        forces = jp.maximum(dx._impl.efc_aref[rows] * dx._impl.efc_D[rows], 0.0)
        geoms, pair_geoms = contact.geom[:count], np.array(self.geoms)
        same = (geoms == pair_geoms[:, None]).all(axis=-1)
        swapped = (geoms == pair_geoms[:, None, ::-1]).all(axis=-1)
        normal_forces = jp.where(same | swapped, forces, 0.0)  # (n, count) N
        normals = jp.where(swapped, -1.0, 1.0)[..., None] * contact.frame[:count, 0]
        total_force = normal_forces.sum(axis=1)
        weights = normal_forces / jp.where(total_force > 0, total_force, 1.0)[:, None]
        normal = (weights[..., None] * normals).sum(axis=1)
        normal = normal / jp.where(total_force > 0, _length(normal), 1.0)[:, None]

        points, bodies = contact.pos[:count], mx.geom_bodyid[pair_geoms]
        spins = dx.cvel[bodies, :3]  # (n, 2, 3)
        origins = dx.subtree_com[mx.body_rootid[bodies]]
        arms = points[None, None] - origins[:, :, None]
        velocities = dx.cvel[bodies, None, 3:] + jp.cross(spins[:, :, None], arms)
        slip, spin = _tangential(velocities[:, 1] - velocities[:, 0], normals), (spins[:, 1] - spins[:, 0])[:, None]
        centre = weights @ points
        offsets = points - centre[:, None]
        square = (weights * (offsets**2).sum(axis=-1)).sum(axis=1)
        arm = (weights * _length(offsets)).sum(axis=1)
        by_points = arm > self.torsion + _ROUNDING * jp.finfo(arm.dtype).eps * jp.abs(centre).max(axis=1)
        orbiting = (weights * (normal[:, None] * jp.cross(offsets, slip)).sum(axis=-1)).sum(axis=1)
        spin_rate = (weights * (normals * spin).sum(axis=-1)).sum(axis=1)
        spin_rate = jp.where(by_points, orbiting / jp.where(by_points, square, 1.0), spin_rate)
        arm, square = jp.where(by_points, arm, self.torsion), jp.where(by_points, square, self.torsion**2)

        largest, rolling = self.coefficient * total_force, self.rolling / self.coefficient
        deflection, force = _bend(bristles[:, :3], largest, self.k, self.c, step, _mean(weights, slip), normal)
        slips = largest * arm / jp.where(square > 0, self.k * square, 1.0)
        angle = jp.clip(bristles[:, 3] + step * spin_rate, -slips, slips)
        torque = jp.clip(square * (self.k * angle + self.c * spin_rate), -largest * arm, largest * arm)
        rolling_angle, braking = _bend(
            bristles[:, 4:], largest * rolling, self.k * rolling**2, self.c * rolling**2, step,
            _mean(weights, _tangential(spin, normals)), normal,
        )  # fmt: skip
        state = jp.concatenate((deflection, angle[:, None], rolling_angle), axis=1) * (total_force > 0)[:, None]

        rate = jp.where(by_points, torque / jp.where(by_points, square, 1.0), 0.0)[:, None, None]
        traction = _tangential(force[:, None] + rate * jp.cross(normal[:, None], offsets), normals)
        couples = _tangential(braking[:, None], normals) + jp.where(by_points, 0.0, torque)[:, None, None] * normals
        resultant, moment = _mean(weights, traction), _mean(weights, couples + jp.cross(offsets, traction))
        passive = jp.zeros_like(dx.qvel)
        for side, sign in ((0, 1.0), (1, -1.0)):
            couple = moment + jp.cross(centre - origins[:, side], resultant)
            generalized = couple @ dx.cdof[:, :3].T + resultant @ dx.cdof[:, 3:].T
            passive += sign * (generalized * np.array(self.moved)[:, side]).sum(axis=0)
        corrected = dx._impl.efc_J[rows] @ dx.qacc_warmstart + forces / dx._impl.efc_D[rows]
        aref = jp.where((same | swapped).any(axis=0), corrected, dx._impl.efc_aref[rows])
        aref = jp.concatenate((dx._impl.efc_aref[:first], aref, dx._impl.efc_aref[first + count :]))
        return state, dx.tree_replace({"qfrc_passive": dx.qfrc_passive + passive, "_impl.efc_aref": aref})


_ROUNDING = 32.0  # times the relative rounding error of a position: closer points count as one


def dry_friction(model: mujoco.MjModel) -> DryFriction:
    """Return the friction of a model's joints and tendons."""
    elements = sorted((e for e in bristles_of(model) if e.kind != "pair"), key=lambda e: e.kind)
    ids = [find(model, e.kind, e.name) for e in elements]
    dofs = tuple(int(model.jnt_dofadr[i]) for i, e in zip(ids, elements) if e.kind == "joint")
    tendons = tuple(i for i, e in zip(ids, elements) if e.kind == "tendon")
    force, k, c = _columns(model, elements, 3)
    return DryFriction(force, k, c, tuple(e.name for e in elements), dofs, tendons)


def pair_friction(model: mujoco.MjModel) -> PairFriction:
    """Return the friction of a model's pairs of geoms."""
    elements = [e for e in bristles_of(model) if e.kind == "pair"]
    pairs = [find(model, "pair", e.name) for e in elements]
    geoms = tuple((int(model.pair_geom1[i]), int(model.pair_geom2[i])) for i in pairs)
    dofs = tuple(tuple(_moving_dofs(model, int(model.geom_bodyid[geom])) for geom in e) for e in geoms)
    names, (coefficient, k, c, torsion, rolling) = tuple(e.name for e in elements), _columns(model, elements, 5)
    return PairFriction(coefficient, k, c, torsion, rolling, names, geoms, dofs)


def _columns(model: mujoco.MjModel, elements: Sequence[BristleSettings], count: int) -> list[Any]:
    """Return the numbers of frictions as arrays (n,), zero where there are fewer."""
    numbers = np.zeros((len(elements), count))
    for row, element in zip(numbers, elements):
        row[: element.size] = model.numeric_data[element.numeric : element.numeric + element.size]
    return [jp.array(column) for column in numbers.T]


def _moving_dofs(model: mujoco.MjModel, body: int) -> tuple[bool, ...]:
    """Return, for each velocity, True if it moves a body."""
    chain = set()
    while body:
        chain.add(body)
        body = int(model.body_parentid[body])
    return tuple(int(owner) in chain for owner in model.dof_bodyid)


def _bend(bristles: Any, largest: Any, k: Any, c: Any, step: Any, speed: Any, normal: Any) -> tuple[Any, Any]:
    """Advance bristles (n, 3) in tangential planes; return them and their force, which is limited by slip."""
    speed = _tangential(speed, normal)
    deflection = _clip_length(_tangential(bristles + step * speed, normal), largest / jp.where(k > 0, k, 1.0))
    return deflection, _clip_length(k[:, None] * deflection + c[:, None] * speed, largest)


def _clip_length(vectors: Any, largest: Any) -> Any:
    """Return vectors (n, 3), shortened to the largest length (n,)."""
    length = _length(vectors)
    longer = length > largest
    return vectors * jp.where(longer, largest / jp.where(longer, length, 1.0), 1.0)[:, None]


def _length(vectors: Any) -> Any:
    """Return lengths (...,) of vectors (..., 3); that of zero has a derivative too."""
    square = (vectors**2).sum(axis=-1)
    return jp.where(square > 0, jp.sqrt(jp.where(square > 0, square, 1.0)), 0.0)


def _tangential(vectors: Any, normals: Any) -> Any:
    return vectors - (vectors * normals).sum(axis=-1, keepdims=True) * normals


def _mean(weights: Any, vectors: Any) -> Any:
    return (weights[..., None] * vectors).sum(axis=1)
