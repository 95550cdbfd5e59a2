"""The loop of rigs in a plane in MuJoCo: before every step the law's softness, grease and excitation, then mj_step.

The loop is compiled and calls ``mj_step`` of the MuJoCo library directly, with views of the model's and data's own
arrays: writing parameters before every step then costs next to nothing, many simulations run on threads without the
interpreter lock, and results do not depend on the number of threads.
"""

from __future__ import annotations

import copy
from typing import NamedTuple

import mujoco
import numpy as np

from ..clearance.follower import contact_force
from ..clearance.kernel import Clearance, clearance_records, contact_step, follow_law, grease_step
from ..clearance.law import Law
from ..core.jit import OPTIONS, jit
from ..physical import SOLREF_PER_UNIT
from ..rig import Rig
from ..rig.instruments import Kinds
from .base import Engine, Equations, Run, diverged, in_columns
from .mujoco_step import check_warnings, contact_rows, mj_step, refuse_adhesion, warnings_counted
from .plant import Driving, Maps, Plant, driving, hold, rest_in_mujoco, tendon_rows

__all__ = ["MujocoRun"]


class _Views(NamedTuple):
    """Arrays of a MuJoCo model and its data, and where these are."""

    model: int  # address
    data: int  # address
    gravity: np.ndarray  # (3,)
    pair_softness: np.ndarray  # (n, 2) solref of the pairs of geoms
    limit_softness: np.ndarray  # (n, 2) solref of the tendons' limits
    position: np.ndarray  # (nv,)
    velocity: np.ndarray  # (nv,)
    applied: np.ndarray  # (nv,) forces
    constraint: np.ndarray  # (nv,) forces of the contacts
    acceleration: np.ndarray  # (nv,)
    from_constraint: np.ndarray  # (n_bushings, nv) contact forces of the bushings, per the constraint's; or (0, nv)


class MujocoRun(Run):
    """A MuJoCo simulation, with a model of its own."""

    def __init__(self, engine: Engine, rig: Rig, law: Law, kind: Kinds, step: float, plant: Plant):
        n_bushings = len(rig.bushings)
        self.engine, self.rig, self.maps, self.step, self.steps = engine, rig, plant.maps, step, 0
        self.clearance = clearance_records(rig, law, step)
        refuse_adhesion(engine, self.clearance.bushings)
        self.model = copy.copy(plant.model)
        self.model.opt.timestep = step
        self.model.dof_armature[:] = plant.armature * step**2 * plant.model.jnt_stiffness
        # Explicit dampers of joints act half a step late; so much more inertia makes up for it.
        self.explicit = bool(plant.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        if self.explicit:
            self.model.dof_armature[:] += step / 2 * plant.model.dof_damping
        # The same of damping in proportion to the mass.
        self.heavier = 1 + step / 2 * plant.decay
        for field in ("body_mass", "body_subtreemass", "body_inertia"):
            getattr(self.model, field)[:] *= self.heavier
        given = driving(plant.rows, kind)
        self.driving = given._replace(lift=given.lift / self.heavier, gravity=given.gravity / self.heavier)
        from_constraint = contact_rows(plant.maps.at_points[n_bushings:], hold(self.model))
        self.data = mujoco.MjData(self.model)
        self.rest, self.sensors = None, plant.rows.sensor_rows
        if rig.gravity or rig.loads:
            self.model.opt.gravity[2] = self.driving.gravity[1]
            where = np.arange(self.model.nv), plant.statics, given.steady
            self.rest = rest_in_mujoco(plant.rows, law, self.model, self.data, *where)
            self.rest.begin(self.clearance)
        model, data = self.model, self.data
        self.views = _Views(
            model._address, data._address, model.opt.gravity, model.pair_solref, model.tendon_solref_lim, data.qpos,
            data.qvel, data.qfrc_applied, data.qfrc_constraint, data.qacc, from_constraint,
        )  # fmt: skip

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        out = np.empty((len(excitation), len(self.maps.output) + 4 * len(self.rig.bushings)))
        models = self.driving, self.views, self.maps, self.clearance
        with warnings_counted():
            failed, bushing = _advance(self.steps, in_columns(excitation), *models, SOLREF_PER_UNIT, out)
        if failed >= 0:
            raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
        largest = int(np.argmax(np.abs(self.clearance.states["displacement"]))) if self.rig.bushings else 0
        check_warnings(self.rig, self.data, self.steps * self.step, largest)
        self.steps += len(excitation)
        return out

    def before(self) -> np.ndarray | None:
        """Return the rest; see `Run.before`."""
        return None if self.rest is None else np.append(self.sensors.at_rest(self.data.qpos), self.rest.columns())

    def equations(self) -> Equations:
        """Return the equations of the steps; see `Run.equations`.

        v₊ = v + h M⁻¹ (b a - Pᵀ f - K q - D v₊ - E v), q₊ = q + h v₊, with an implicit D, the joints' unless the model
        disables it, and an explicit E. Reactions of rigid supports are left out, as they do no work.
        """
        model, nv = copy.copy(self.model), self.model.nv
        model.opt.gravity[:] = 0, 0, 1
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        mass = np.zeros((nv, nv))
        mujoco.mj_fullM(model, data, mass)
        joints, rows = np.diag(model.dof_damping), tendon_rows(model)
        implicit, explicit = (np.zeros((nv, nv)), joints) if self.explicit else (joints, np.zeros((nv, nv)))
        explicit = explicit + (rows.T * model.tendon_damping) @ rows
        if self.maps.viscous.size:
            explicit = explicit + self.maps.viscous
        mass += self.step / 2 * (implicit - explicit)
        lift, push, _, gravity, steady = self.driving
        shape = push - np.outer(lift[:, 1], data.qfrc_bias)
        if self.rest:
            shape = np.vstack((shape, steady - gravity[1] * data.qfrc_bias))
        speed = np.outer((-1, 1, 0), np.ones(nv)) / self.step
        stiffness = np.diag(model.jnt_stiffness) + (rows.T * model.tendon_stiffness) @ rows
        return Equations(mass, implicit + explicit, stiffness, shape, self.maps.at_points, speed)

    def snapshot(self) -> tuple[np.ndarray, np.ndarray]:
        """Return joint coordinates and impact speeds; see `Run.snapshot`."""
        return self.data.qpos, self.clearance.numbers[: 2 * len(self.rig.bushings)]


@jit(**OPTIONS)
def _advance(
    steps: int, excitation: np.ndarray, driven: Driving, views: _Views, maps: Maps, clearance: Clearance,
    per_unit: float, out: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Advance by the steps of the excitation (n, n_inputs); return (step, bushing) of a divergence, or (-1, -1)."""
    model, data, gravity, of_pairs, of_limits, qpos, qvel, applied, constraint, acceleration, from_constraint = views
    at_points, viscous, output, pairs, limits, readings = maps
    lift, pushed, on_base, weight, steady = driven
    bushings, states, numbers = clearance
    nv, n_bushings, n_sensors, n_inputs = qvel.size, bushings.size, output.shape[0], excitation.shape[1]
    (grease_force, push, touches), read = np.zeros((3, n_bushings)), np.zeros(n_sensors)
    distinct = from_constraint.shape[0] == n_bushings  # else the forces are those that the law asks for
    for i in range(excitation.shape[0]):
        gravity[2], applied[:] = weight[1], steady
        for r in range(n_inputs):
            gravity[2] += lift[r, 1] * excitation[i, r]
            for m in range(nv):
                applied[m] += pushed[r, m] * excitation[i, r]
        for m in range(viscous.shape[0]):
            total = 0.0
            for r in range(nv):
                total += viscous[m, r] * qvel[r]
            applied[m] -= total
        for j in range(n_bushings):
            bushing, state = bushings[j], states[j]
            x, speed = _point(at_points, j, qpos, qvel)
            if not abs(x) < 1e3 * bushing.gap + 1.0:
                return i, j
            elastic, film = grease_step(bushing, state, numbers, x)
            grease_force[j] = elastic + film * speed
            for m in range(nv):
                applied[m] -= at_points[j, m] * grease_force[j]
            follow_law(bushing, state, numbers, x, (steps + i) * bushing.step)
            push[j] = touches[j] = 0.0
            for end in range(2):
                x, speed = _point(at_points, n_bushings + 2 * j + end, qpos, qvel)
                g, k, c = contact_step(bushing, state, numbers, end, x, speed, True)
                if g != 0.0:
                    touches[j] = 1.0
                push[j] += np.sign(g) * contact_force(k, c, abs(g), np.sign(g) * speed, False)
                k = max(k, 0.5e-9)  # zero would mean MuJoCo's default
                for side in range(pairs.shape[1]):
                    row = pairs[2 * j + end, side]
                    if row >= 0:
                        of_pairs[row, 0], of_pairs[row, 1] = per_unit * k, per_unit * c
                row = limits[2 * j + end]
                if row >= 0:
                    of_limits[row, 0], of_limits[row, 1] = per_unit * k, per_unit * c
        for s in range(readings.shape[0]):
            read[s] = 0.0
            for m in range(nv):
                read[s] += readings[s, 0, m] * qpos[m] + 0.5 * readings[s, 1, m] * qvel[m]
        mj_step(model, data)
        for s in range(n_sensors):
            value = 0.0
            for r in range(n_inputs):
                value += on_base[r, s] * excitation[i, r]
            for m in range(nv):
                value += output[s, m] * acceleration[m]
            if not abs(value) < np.inf:  # without bushings nothing else would stop it
                return i, 0
            out[i, s] = value
        for s in range(readings.shape[0]):  # at the mean of the velocities before and after: (q₊ - q₋)/(2h)
            for m in range(nv):
                read[s] += 0.5 * readings[s, 1, m] * qvel[m]
            out[i, s] += read[s]
        for j in range(n_bushings):
            if distinct:
                push[j] = 0.0
                for m in range(nv):
                    push[j] += from_constraint[j, m] * constraint[m]
            out[i, n_sensors + j] = states[j].displacement
            out[i, n_sensors + n_bushings + j] = push[j]
            out[i, n_sensors + 2 * n_bushings + j] = grease_force[j]
            out[i, n_sensors + 3 * n_bushings + j] = touches[j]
    return -1, -1


@jit(inline="always")
def _point(at_points: np.ndarray, p: int, qpos: np.ndarray, qvel: np.ndarray) -> tuple[float, float]:
    x, speed = 0.0, 0.0
    for m in range(qpos.size):
        x += at_points[p, m] * qpos[m]
        speed += at_points[p, m] * qvel[m]
    return x, speed
