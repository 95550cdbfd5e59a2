"""Bristles of joints, tendons and contacts in MJX: the formulas of `friction_loop`, as functions of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from .bristles import Friction, frictions
from .elements import KINDS, find
from .packages import naming_package

with naming_package("functions for MJX", "clearance-mj[mjx]"):
    import jax
    from jax import numpy as jp

__all__ = ["OF_PAIR", "DryFriction", "PairFriction", "dry_friction", "pair_friction"]

OF_PAIR = 7
"""Numbers of a pair's bristles: their deflection, the angle about their normal, those rolled"""


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
        """Bend bristles (n,) by a step; return them and data with the forces that they exert."""
        dofs, lengthening = np.array(self.dofs, dtype=int), dx._impl.ten_J[np.array(self.tendons, dtype=int)]
        speed = jp.concatenate((dx.qvel[dofs], lengthening @ dx.qvel))
        slips = self.force / self.k
        bristles = jp.clip(bristles + step * speed, -slips, slips)
        force = jp.clip(self.k * bristles + self.c * speed, -self.force, self.force)
        passive = dx.qfrc_passive.at[dofs].add(-force[: len(dofs)]) - force[len(dofs) :] @ lengthening
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
    """of each pair and geom: which velocities move it"""

    def rub(self, mx: Any, dx: Any, bristles: Any, step: Any) -> tuple[Any, Any]:
        """Bend bristles (n, OF_PAIR) by a step; return them and data with the forces that they exert.

        As `friction_loop.rub`: several points of contact have one bristle at the centre of their pressure, and the last
        step's acceleration makes up for the parasitic mass of what presses.
        """
        count = int(np.sum(dx._impl.contact.dim == 1))  # these are the first, and so are their rows among the contacts
        if not count:
            return jp.zeros_like(bristles), dx
        contact, first = dx._impl.contact, int(dx._impl.contact.efc_address[0])
        rows = slice(first, first + count)
        wanted = jp.maximum(dx._impl.efc_aref[rows] * dx._impl.efc_D[rows], 0.0)
        geoms, ours = contact.geom[:count], np.array(self.geoms)
        same = (geoms == ours[:, None]).all(axis=-1)
        swapped = (geoms == ours[:, None, ::-1]).all(axis=-1)
        pressing = jp.where(same | swapped, wanted, 0.0)  # (n, count) N
        normals = jp.where(swapped, -1.0, 1.0)[..., None] * contact.frame[:count, 0]
        pressed = pressing.sum(axis=1)
        share = pressing / jp.where(pressed > 0, pressed, 1.0)[:, None]
        normal = (share[..., None] * normals).sum(axis=1)
        normal = normal / jp.where(pressed > 0, _length(normal), 1.0)[:, None]

        places, bodies = contact.pos[:count], mx.geom_bodyid[ours]
        spins = dx.cvel[bodies, :3]  # (n, 2, 3)
        origins = dx.subtree_com[mx.body_rootid[bodies]]
        arms = places[None, None] - origins[:, :, None]
        moving = dx.cvel[bodies, None, 3:] + jp.cross(spins[:, :, None], arms)
        slip, spin = _tangential(moving[:, 1] - moving[:, 0], normals), (spins[:, 1] - spins[:, 0])[:, None]
        centre = share @ places
        away = places - centre[:, None]
        square = (share * (away**2).sum(axis=-1)).sum(axis=1)
        arm = (share * _length(away)).sum(axis=1)
        by_points = arm > self.torsion + _ROUNDING * jp.finfo(arm.dtype).eps * jp.abs(centre).max(axis=1)
        circling = (share * (normal[:, None] * jp.cross(away, slip)).sum(axis=-1)).sum(axis=1)
        turning = (share * (normals * spin).sum(axis=-1)).sum(axis=1)
        turning = jp.where(by_points, circling / jp.where(by_points, square, 1.0), turning)
        arm, square = jp.where(by_points, arm, self.torsion), jp.where(by_points, square, self.torsion**2)

        largest, rolling = self.coefficient * pressed, self.rolling / self.coefficient
        bent, force = _bend(bristles[:, :3], largest, self.k, self.c, step, _mean(share, slip), normal)
        slips = largest * arm / jp.where(square > 0, self.k * square, 1.0)
        angle = jp.clip(bristles[:, 3] + step * turning, -slips, slips)
        torque = jp.clip(square * (self.k * angle + self.c * turning), -largest * arm, largest * arm)
        rolled, braking = _bend(
            bristles[:, 4:], largest * rolling, self.k * rolling**2, self.c * rolling**2, step,
            _mean(share, _tangential(spin, normals)), normal,
        )  # fmt: skip
        now = jp.concatenate((bent, angle[:, None], rolled), axis=1) * (pressed > 0)[:, None]

        around = jp.where(by_points, torque / jp.where(by_points, square, 1.0), 0.0)[:, None, None]
        at_points = _tangential(force[:, None] + around * jp.cross(normal[:, None], away), normals)
        turned = _tangential(braking[:, None], normals) + jp.where(by_points, 0.0, torque)[:, None, None] * normals
        total, about = _mean(share, at_points), _mean(share, turned + jp.cross(away, at_points))
        exerted = jp.zeros_like(dx.qvel)
        for side, sign in ((0, 1.0), (1, -1.0)):
            couple = about + jp.cross(centre - origins[:, side], total)
            each = couple @ dx.cdof[:, :3].T + total @ dx.cdof[:, 3:].T
            exerted += sign * (each * np.array(self.moved)[:, side]).sum(axis=0)
        accelerating = dx._impl.efc_J[rows] @ dx.qacc_warmstart + wanted / dx._impl.efc_D[rows]
        aref = jp.where((same | swapped).any(axis=0), accelerating, dx._impl.efc_aref[rows])
        aref = jp.concatenate((dx._impl.efc_aref[:first], aref, dx._impl.efc_aref[first + count :]))
        changed = {"qfrc_passive": dx.qfrc_passive + exerted, "_impl.efc_aref": aref}
        return now, dx.tree_replace(changed)


_ROUNDING = 32.0  # times the relative error of a place: points that are no further apart are one


def dry_friction(model: mujoco.MjModel) -> DryFriction:
    """Return the friction of a model's joints and tendons."""
    found = sorted((each for each in frictions(model) if each.kind != "pair"), key=lambda each: each.kind)
    places = [find(model, KINDS[each.kind].object, each.name) for each in found]
    dofs = tuple(int(model.jnt_dofadr[i]) for i, each in zip(places, found) if each.kind == "joint")
    tendons = tuple(i for i, each in zip(places, found) if each.kind == "tendon")
    force, k, c = _columns(model, found, 3)
    return DryFriction(force, k, c, tuple(each.name for each in found), dofs, tendons)


def pair_friction(model: mujoco.MjModel) -> PairFriction:
    """Return the friction of a model's pairs of geoms."""
    found = [each for each in frictions(model) if each.kind == "pair"]
    pairs = [find(model, KINDS["pair"].object, each.name) for each in found]
    geoms = tuple((int(model.pair_geom1[i]), int(model.pair_geom2[i])) for i in pairs)
    moved = tuple(tuple(_moving(model, int(model.geom_bodyid[geom])) for geom in each) for each in geoms)
    names, (coefficient, k, c, torsion, rolling) = tuple(each.name for each in found), _columns(model, found, 5)
    return PairFriction(coefficient, k, c, torsion, rolling, names, geoms, moved)


def _columns(model: mujoco.MjModel, found: Sequence[Friction], count: int) -> list[Any]:
    """Return the numbers of frictions as arrays (n,), zero where there are fewer."""
    numbers = np.zeros((len(found), count))
    for row, each in zip(numbers, found):
        row[: each.size] = model.numeric_data[each.numeric : each.numeric + each.size]
    return [jp.array(column) for column in numbers.T]


def _moving(model: mujoco.MjModel, body: int) -> tuple[bool, ...]:
    """Say of each velocity whether it moves a body."""
    chain = set()
    while body:
        chain.add(body)
        body = int(model.body_parentid[body])
    return tuple(int(of) in chain for of in model.dof_bodyid)


def _bend(bristles: Any, largest: Any, k: Any, c: Any, step: Any, speed: Any, normal: Any) -> tuple[Any, Any]:
    """Bend bristles (n, 3) in planes; return them and their force: elastic up to the largest, where they slip."""
    speed = _tangential(speed, normal)
    bent = _no_more(_tangential(bristles + step * speed, normal), largest / jp.where(k > 0, k, 1.0))
    return bent, _no_more(k[:, None] * bent + c[:, None] * speed, largest)


def _no_more(vectors: Any, largest: Any) -> Any:
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


def _mean(share: Any, vectors: Any) -> Any:
    return (share[..., None] * vectors).sum(axis=1)
