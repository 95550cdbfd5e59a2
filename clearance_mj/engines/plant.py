"""Common parts of a rig's MuJoCo models: solver options, stable step, and the maps to the rig's points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
import scipy.linalg

from ..clearance.law import Law
from ..clearance.record import fillings_of
from ..linear import RigRows
from ..physical.elements import store_softness
from ..physical.softness import Softness
from ..rig import Bushing, Rig
from ..rig.instruments import Kinds, input_kinds
from ..rig.loads import load_force
from ..rig.sensing import input_readings
from .equilibrium import ChainModes, Equilibrium, equilibrium_of

__all__ = [
    "ARMATURE", "ITERATIONS", "Driving", "Statics", "driving", "hold", "rest_in_mujoco", "set_solver", "settling",
    "soften", "stable_step", "stable_step_with", "tendon_rows",
]  # fmt: skip

ARMATURE = 1 / 7
"""Inertia added to each joint, over its stiffness times the step squared

The Euler integrator turns a mode of frequency ω too fast, relatively by (ωh)²/24; an armature of a h² times the
stiffness slows it by a (ωh)²/2, and lets the stable step grow by 1/√(1 - 4a). At a = 1/12 no error of second order
remains, as in Numerov's method; at 1/6 it is Euler's with the other sign, and the step √3 times as long. Statics do not
change.
"""

STIFF_ROOT = 1 / 3
"""The same for springs at a shaft's left end that are stiffer than its first hinge

From 1/4 on a spring is stable at any step, so the nearly rigid clamp of a bench does not shorten it. The deflection of
such a spring is small, and at the frequency ω too large by (ωh)²/3.
"""

ITERATIONS = 3  # Sweeps of the solver, of which the first is nearly exact.
REST_SWEEPS = 7  # for an equilibrium in MuJoCo's geometry: each reduces the error by the square of the slope, some 1e-3
RIGID = 1e-14  # of the largest stiffness per mass: below it a mode's stiffness is 0 up to rounding
NO_WALL = 1e3  # m, limit of a tendon where a bushing has no wall
RIGID_INVERSE_INERTIA = 1e-8  # 1/kg, written over MuJoCo's for rigid supports, whose softness is 1e-4 of it
SETTLING_STEPS = 10.0  # steps, time constant of the decay of a rigid support's rounding errors


def set_solver(spec: mujoco.MjSpec) -> None:
    """Set integrator and solver for exact contact softness.

    With an impedance of 1e-4 and a known inverse inertia, the regularisation of the contacts is far greater than
    their coupling: each force follows from its own row alone, and the projected Gauss-Seidel solver needs one
    sweep, at a third of Newton's cost. Joint springs are explicit and joint dampers implicit in the Euler integrator.
    """
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.solver = mujoco.mjtSolver.mjSOL_PGS
    spec.option.iterations = ITERATIONS
    spec.option.gravity = [0, 0, 0]
    # No search for islands, and a diverging simulation must stop, not restart.
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_AUTORESET)


def soften(spec: mujoco.MjSpec, kind: str, name: str, bushing: Bushing) -> None:
    """Set the datasheet's stiffness and damping at one of a bushing's two ends, which have half of each."""
    store_softness(spec, kind, [name], Softness(bushing.contact.stiffness / 2, bushing.contact.damping / 2))


def settling(step: float) -> tuple[float, float]:
    """Return the solref of rigid supports, which have no stiffness: their errors decay critically damped."""
    return -1 / (SETTLING_STEPS * step) ** 2, -2 / (SETTLING_STEPS * step)


def hold(model: mujoco.MjModel) -> np.ndarray:
    """Make a model's tendon equalities exact for its time step; return their rows (n, nv).

    A support's row may be replaced by any combination of all. With rows that are orthogonal in the inverse of the mass
    matrix every reaction follows from its own row, so that the projected Gauss-Seidel solver needs one sweep. A
    very small inverse inertia makes them almost rigid.
    """
    rows = tendon_rows(model)[model.eq_obj1id]
    if not len(rows):
        return rows
    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    rows = np.linalg.solve(np.linalg.cholesky(rows @ np.linalg.solve(mass, rows.T)), rows)
    for tendon, row in zip(model.eq_obj1id, rows):
        wraps = slice(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
        model.wrap_prm[wraps] = row[model.jnt_dofadr[model.wrap_objid[wraps]]]
    model.tendon_invweight0[model.eq_obj1id] = RIGID_INVERSE_INERTIA
    model.eq_solref[:] = settling(model.opt.timestep)
    return rows


def tendon_rows(model: mujoco.MjModel) -> np.ndarray:
    """Return (ntendon, nv) lengths of a model's fixed tendons per coordinate; zeros for spatial ones."""
    rows = np.zeros((model.ntendon, model.nv))
    for row, first, count in zip(rows, model.tendon_adr, model.tendon_num):
        if model.wrap_type[first] == int(mujoco.mjtWrap.mjWRAP_JOINT):  # else a spatial tendon
            wraps = slice(first, first + count)
            row[model.jnt_dofadr[model.wrap_objid[wraps]]] = model.wrap_prm[wraps]
    return rows


class Driving(NamedTuple):
    """External excitation of a MuJoCo model."""

    lift: np.ndarray  # (n_inputs, 2) gravity along y and z equivalent to each unit of a moving base; 0 for a force
    push: np.ndarray  # (n_inputs, nv) force on the coordinates per N of each; 0 for a base
    on_base: np.ndarray  # (n_inputs, n_sensors) as of `input_readings`
    gravity: np.ndarray  # (2,) m/s² along y and z
    steady: np.ndarray  # (nv,) force of the rig's loads on the coordinates


def driving(rows: RigRows, kinds: Kinds) -> Driving:
    """Return the excitation of a model whose coordinates move the rig's points by rows."""
    rig, kinds = rows.rig, input_kinds(kinds)
    push = [rows.push(i) if kind == "force" else np.zeros(rows.size) for i, kind in enumerate(kinds)]
    lift = [-shaker.unit_direction[1:] * float(kind == "base") for shaker, kind in zip(rig.inputs, kinds)]
    steady, gravity = load_force(rig.name, rig.loads, rows.directed, rows.size), (rig.gravity or (0.0, 0.0, 0.0))[1:]
    return Driving(np.array(lift), np.array(push), input_readings(rig, kinds), np.array(gravity), steady)


class Statics(NamedTuple):
    """Linear matrices of a model at rest."""

    mass: np.ndarray  # (nv, nv)
    stiffness: np.ndarray  # (nv, nv)
    free: np.ndarray  # (nv, n) basis of the motions that supports allow
    circulatory: np.ndarray  # (nv, nv) H; (0, 0) if there is none
    at_points: np.ndarray  # (rows, nv) as of `at_rows`


def rest_in_mujoco(
    rows: RigRows, law: Law, model: mujoco.MjModel, data: mujoco.MjData, order: np.ndarray, statics: Statics,
    steady: np.ndarray,
) -> Equilibrium:  # fmt: skip
    """Move the data to the static equilibrium, in MuJoCo's geometry, under the model's gravity; return it.

    It is computed in all natural modes. ``order``: (nv,) MuJoCo's number of each coordinate of all other arguments;
    ``steady``: (nv,) force of the loads.
    """
    mass, stiffness, free, skew, at_points = statics
    square, shapes = scipy.linalg.eigh(free.T @ stiffness @ free, free.T @ mass @ free)
    omega, shapes = np.sqrt(np.where(square < RIGID * square[-1], 0.0, np.abs(square))), free @ shapes
    material, loaded = (shapes.T @ skew @ shapes if skew.size else skew, rows.rig.gravity or rows.rig.loads)
    for _ in range(REST_SWEEPS):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        load = shapes.T @ ((data.qfrc_passive - data.qfrc_bias)[order] + steady + stiffness @ data.qpos[order])
        modes = ChainModes(omega, material, load, at_points @ shapes, lambda points: rows.moved(points) @ shapes)
        rest = equilibrium_of(rows.rig, law, modes)
        if loaded:
            data.qpos[order] = shapes @ rest.coordinates
    return rest


def stable_step(
    mass: np.ndarray, joints: np.ndarray, at_points: np.ndarray, rig: Rig, law: Law,
    armature: float | np.ndarray = ARMATURE,
) -> float:  # fmt: skip
    """Return the longest stable step, s, of the Euler integrator with every contact and film at its stiffest.

    Springs are explicit, so h < 2/ω_max; the bushings' dampers are explicit too, which shortens it to
    2 / (δ + √(δ² + ω²)) with 2δ the largest eigenvalue of M⁻¹C. The mass (nv, nv) is without armatures, which are
    ``armature`` times the joints' stiffness (nv,).
    """
    contacts = np.transpose(law.largest([b.gap for b in rig.bushings]))
    grease = [g.largest() for g in fillings_of(rig, law)]
    return stable_step_with(mass, joints, at_points, grease, contacts, armature)


def stable_step_with(
    mass: np.ndarray, joints: np.ndarray, at_points: np.ndarray, grease: Sequence[tuple[float, float]],
    contacts: np.ndarray, armature: float | np.ndarray, other: tuple[np.ndarray, np.ndarray] | None = None,
    free: np.ndarray | None = None,
) -> float:  # fmt: skip
    """Return the step of `stable_step` from stiffness and damping of fillings and contacts, (n_bushings, 2) each.

    ``other`` is stiffness and damping beyond that of joints, each (nv, nv), and ``free`` (nv, n) a basis of the motions
    that supports allow.
    """
    k, c = np.concatenate((np.reshape(grease, (-1, 2)), np.repeat(contacts / 2, 2, axis=0))).T
    springs, dampers = np.diag(joints) + (at_points.T * k) @ at_points, (at_points.T * c) @ at_points
    if other:
        springs, dampers = springs + other[0], dampers + other[1]
    carrier = np.diag(armature * joints)
    if free is not None:
        mass, carrier, springs, dampers = (free.T @ m @ free for m in (mass, carrier, springs, dampers))
    step = 0.0
    for _ in range(40):  # from below: the remainder shrinks by 4/7, or less, each time
        inertia = mass + step**2 * carrier
        decay = _largest_eigenvalue(dampers, inertia) / 2
        step = 2 / (decay + np.sqrt(decay**2 + _largest_eigenvalue(springs, inertia)))
    return float(step)


def _largest_eigenvalue(matrix: np.ndarray, mass: np.ndarray) -> float:
    return scipy.linalg.eigh(matrix, mass, eigvals_only=True, subset_by_index=[mass.shape[0] - 1] * 2)[0]
