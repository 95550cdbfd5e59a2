"""A simulation by the links engine: chains in MuJoCo, in clearances of one coordinate or two, turning or not.

It begins at the chains' equilibrium under gravity and loads, in MuJoCo's geometry. See links_loop.py for the steps.
"""

from __future__ import annotations

import copy
import functools

import mujoco
import numpy as np

from ..clearance.law import Law
from ..clearance.record import clearance_records, fillings_of
from ..physical import SOLREF_PER_UNIT
from ..rig import Rig
from ..rig.instruments import Kinds
from .base import Engine, SimulationRun, diverged, in_columns
from .energies import NOTHING, OF_RIG, StepRecords, columns_of
from .links_loop import Maps, VelocityPredictor, Views, advance_links
from .links_plant import IN_MUJOCO, LinksPlant
from .modal_loop import PER_INERTIA, RATE, SPIN
from .mujoco_step import check_warnings, contact_rows, refuse_adhesion, warnings_counted
from .plant import driving, hold, rest_in_mujoco, tendon_rows
from .scheme import padded
from .turning import SPIN_STEPS, as_probes, turning_of

__all__ = ["LinksRun"]

DAMPING = OF_RIG.index("damping")


class LinksRun(SimulationRun):
    """A MuJoCo simulation, with its copy of the model."""

    def __init__(self, engine: Engine, rig: Rig, law: Law, kind: Kinds, step: float, plant: LinksPlant):
        self.engine, self.rig, self.step, self.steps, self.plant = engine, rig, step, 0, plant
        self.clearance = clearance_records(rig, law, step)
        refuse_adhesion(engine, self.clearance.bushings)
        self.driving = driving(plant.whole.rows, kind)
        self.model, inertia = _model_with_armature(plant, step)
        self.lighter = 1 / (1 + step / 2 * plant.whole.rayleigh[0])
        order, self.maps = plant.maps.order, _correct_accelerometers(plant, inertia, step)
        constraints = hold(self.model)[:, order]
        self.turning = turning_of(rig)[:, None]
        self.foresight = _foresight(rig, law, plant, inertia, constraints, step)
        self.changes = bool(self.turning[RATE, 0] or self.turning[PER_INERTIA, 0]) and plant.whole.gyroscopic.size > 0
        self.kicked: tuple[float, np.ndarray] | None = None
        self.data = mujoco.MjData(self.model)
        self.model.opt.gravity[1:] = self.lighter * self.driving.gravity
        self.rest = None
        if rig.gravity or rig.loads or rig.spin:
            where = order, plant.statics, self.driving.steady
            self.rest = rest_in_mujoco(plant.whole.rows, law, self.model, self.data, *where)
            self.rest.begin(self.clearance)
        self.columns = len(rig.sensors) + 3 * rig.n_rows + len(rig.bushings) + int(rig.spin is not None)
        self.q_before = self.data.qpos[order]
        model, data = self.model, self.data
        self.views = Views(
            model._address, data._address, model.opt.gravity, model.pair_solref, model.tendon_solref_lim, data.qpos,
            data.qvel, data.qfrc_applied, data.qfrc_constraint, data.qacc,
        )  # fmt: skip

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `SimulationRun.advance`."""
        return self._advance(excitation, NOTHING)

    def _advance(self, excitation: np.ndarray, kept: StepRecords) -> np.ndarray:
        out = np.empty((len(excitation), self.columns))
        excitation, turns = in_columns(excitation), self.rig.spin is not None
        size = SPIN_STEPS if self.changes else max(len(out), 1)
        for start in range(0, len(out), size):
            part = excitation[start : start + size]
            spin = float(self.turning[SPIN, 0] + self.turning[RATE, 0] * len(part) * self.step / 2)
            with warnings_counted():
                failed, bushing = advance_links(
                    self.steps, part, self.step, turns, self.driving, self.lighter, self.views, self.maps,
                    self.foresight, self._coupling(spin), self.turning, self.clearance, self.q_before, kept,
                    SOLREF_PER_UNIT, out, start,
                )  # fmt: skip
            if failed >= 0:
                raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
            records, numbers = self.clearance
            moved = [np.linalg.norm(numbers[r["place"] : r["place"] + r["coordinates"]]) for r in records]
            check_warnings(self.rig, self.data, self.steps * self.step, int(np.argmax(moved)) if moved else 0)
            self.steps += len(part)
        return as_probes(self.rig, out)

    def balanced(self, excitation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate one block, and return its energies; see `SimulationRun.balanced`.

        v₊ = v + h M⁻¹ (b a - Pᵀ f - K q - D v₊ - E v), q₊ = q + h v₊, with an implicit D, the joints' unless the model
        disables it, and an explicit E. So M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = b a - Pᵀ f with C = D + E and
        a mass of h/2 (D - E) more. Reactions of rigid supports are left out, as they do no work.
        """
        order, count, h = self.maps.order, len(excitation), self.step
        q = np.empty((count + 2, order.size))
        q[0], q[1] = self.q_before, self.data.qpos[order]
        energies = np.empty((count, columns_of(len(self.rig.bushings))))
        output = self._advance(excitation, StepRecords(energies, NOTHING.rows, q[2:]))
        mass, damping, stiffness = self.equations
        travel, velocity = (q[2:] - q[:-2]) / 2, np.diff(q, axis=0) / h
        kinetic = np.sum(velocity @ mass * velocity, axis=1) / 2
        energies[:, DAMPING] = np.sum(travel @ damping * travel, axis=1) / h
        energies[:, DAMPING + 1] = (kinetic[1:] + kinetic[:-1]) / 2
        energies[:, DAMPING + 2] = np.sum(q[1:-1] @ stiffness * (q[:-2] + q[2:]), axis=1) / 4
        return output, energies

    def before(self) -> np.ndarray | None:
        """Return the columns at rest; see `SimulationRun.before`."""
        if self.rest is None:
            return None
        at_rest = self.plant.whole.rows.sensor_rows.at_rest(self.data.qpos[self.plant.maps.order])
        row = np.concatenate((at_rest, self.rest.columns(), self.turning[SPIN] if self.rig.spin else []))
        return as_probes(self.rig, row[None])[0]

    def _coupling(self, spin: float) -> np.ndarray:
        """Return gyroscopic moments per velocity at a spin, rad/s, before their kick; (0, 0) for none."""
        if self.kicked is None or self.kicked[0] != spin:
            moments = spin * self.plant.whole.gyroscopic
            if not spin and not self.changes:
                moments = np.zeros((0, 0))
            elif moments.size:
                implicit = np.eye(len(moments)) + moments @ self.foresight.of_force
                moments = np.ascontiguousarray(np.linalg.solve(implicit, moments))
            self.kicked = spin, moments
        return self.kicked[1]

    @functools.cached_property
    def equations(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M, C and K, (nv, nv) each, of the steps; see `balanced`."""
        model, nv, order = self.model, self.model.nv, self.maps.order
        data, mass, rows = mujoco.MjData(model), np.zeros((nv, nv)), tendon_rows(model)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, mass)
        joints, none = np.diag(model.dof_damping), np.zeros((nv, nv))
        explicit = bool(model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        later, now = (none, joints) if explicit else (joints, none)
        now = now + (rows.T * model.tendon_damping) @ rows
        springs = np.diag(model.jnt_stiffness) + (rows.T * model.tendon_stiffness) @ rows
        mass, later, now, springs = (part[np.ix_(order, order)] for part in (mass, later, now, springs))
        now = now + (self.maps.viscous if self.maps.viscous.size else 0.0)
        return mass + self.step / 2 * (later - now), later + now, springs


def _model_with_armature(plant: LinksPlant, step: float) -> tuple[mujoco.MjModel, np.ndarray]:
    """Return the model for a step, s, and its mass matrix (nv, nv) in the order of the coordinates.

    Armatures correct the frequencies of the integrator, and represent joints' dampers that the loop applies
    implicitly, or that are explicit and half a step late, as is damping in proportion to the mass.
    """
    model, whole, order = copy.copy(plant.model), plant.whole, plant.maps.order
    model.opt.timestep = step
    stiffness, damping = plant.model.jnt_stiffness[order], plant.model.dof_damping[order]
    armature = plant.armature * step**2 * stiffness
    if plant.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP:
        armature = armature + step * damping / (2 if plant.explicit else 1)
    model.dof_armature[order] = armature
    heavier = 1 + step / 2 * whole.rayleigh[0]
    for field in ("body_mass", "body_subtreemass", "body_inertia"):
        getattr(model, field)[:] *= heavier
    return model, heavier * whole.mass + np.diag(armature)


def _correct_accelerometers(plant: LinksPlant, inertia: np.ndarray, step: float) -> Maps:
    """Return the maps with accelerometers corrected for dampers that the loop applies implicitly."""
    if plant.explicit or not plant.whole.bends_across:
        return plant.maps
    implicit = np.diag(step * plant.whole.damping)
    at_sensors = plant.maps.at_sensors @ (np.eye(len(inertia)) + np.linalg.solve(inertia - implicit, implicit))
    return plant.maps._replace(at_sensors=np.ascontiguousarray(at_sensors))


def _foresight(
    rig: Rig, law: Law, plant: LinksPlant, inertia: np.ndarray, constraints: np.ndarray, step: float
) -> VelocityPredictor:  # fmt: skip
    """Return the linear model of a step for a mass matrix (nv, nv) and rows (n, nv) of rigid supports."""
    whole, rows, n = plant.whole, plant.maps.at_rows, 3 * rig.n_rows
    films = np.array([filling.is_circulatory for filling in fillings_of(rig, law)], dtype=bool)
    loop_walls = np.array([type(b.wall_model) not in IN_MUJOCO for b in rig.bushings], dtype=bool)
    needed = bool(films.any() or loop_walls.any() or any(b.friction for b in rig.bushings) or whole.gyroscopic.size)
    mobility = whole.free @ np.linalg.solve(whole.free.T @ inertia @ whole.free, whole.free.T)
    half = step / 2 * mobility
    return VelocityPredictor(
        needed=needed, of_position=-half @ whole.whole_stiffness, of_force=half,
        of_velocity=np.eye(whole.size) - half @ whole.dampers, compliance=padded([rows @ mobility @ rows.T]),
        known=np.column_stack((~films, ~loop_walls)),
        contact=contact_rows(rows[rig.n_rows : n], rig.end_rows, constraints),
    )  # fmt: skip
