"""A simulation by the links engine in space: both planes of the chains in MuJoCo, turning, in round clearances.

It begins where the chains rest under gravity, in MuJoCo's own geometry. See mujoco_round.py for the steps.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from ..clearance.law import Law
from ..clearance.round_kernel import fillings_of, round_records
from ..physical import SOLREF_PER_UNIT
from ..rig import Rig
from ..rig.instruments import Kinds
from .base import Engine, Run, diverged, in_columns
from .linkage import Linkage
from .links_plant import LinksPlant, SpaceMaps
from .modal_space import compliance_of
from .mujoco_round import Foresight, RoundViews, advance_links
from .mujoco_step import check_warnings, contact_rows, refuse_adhesion, warnings_counted
from .plant import driving, hold, rest_in_mujoco
from .round_scheme import SPIN
from .turning import SPIN_STEPS, as_probes, turning_of

__all__ = ["SpatialMujocoRun"]


class SpatialMujocoRun(Run):
    """A MuJoCo simulation in space, with a model of its own."""

    def __init__(self, engine: Engine, rig: Rig, law: Law, kind: Kinds, step: float, plant: LinksPlant):
        self.engine, self.rig, self.step, self.steps, self.whole = engine, rig, step, 0, plant.whole
        self.clearance = round_records(rig, law, step)
        refuse_adhesion(engine, self.clearance.bushings)
        rows = plant.whole.rows
        self.driving = driving(rows, kind)
        self.model, inertia = _heavier(plant, step)
        self.lighter = 1 / (1 + step / 2 * plant.whole.rayleigh[0])
        self.maps = _before_dampers(plant, inertia, step)
        held = hold(self.model)[:, self.maps.order]
        self.turning, self.drive = turning_of(rig)
        self.foresight = _foresight(rig, law, plant, inertia, held, step)
        self.changes = bool(self.drive[0] or self.drive[2]) and self.whole.gyroscopic.size > 0
        self.kicked: tuple[float, np.ndarray] | None = None
        self.data = mujoco.MjData(self.model)
        self.model.opt.gravity[1:] = self.lighter * self.driving.gravity
        where = self.maps.order, plant.statics, self.driving.steady
        self.rest = rest_in_mujoco(rows, law, self.model, self.data, *where)
        self.rest.begin(self.clearance)
        self.columns = len(rig.sensors) + 7 * len(rig.bushings) + int(rig.spin is not None)
        model, data = self.model, self.data
        self.views = RoundViews(
            model._address, data._address, model.opt.gravity, model.tendon_solref_lim, data.qpos, data.qvel,
            data.qfrc_applied, data.qfrc_constraint, data.qacc,
        )  # fmt: skip

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        out = np.empty((len(excitation), self.columns))
        excitation = in_columns(excitation)
        size = SPIN_STEPS if self.changes else max(len(out), 1)
        for start in range(0, len(out), size):
            part = excitation[start : start + size]
            spin = self.turning[SPIN] + self.drive[0] * len(part) * self.step / 2
            with warnings_counted():
                failed, bushing = advance_links(
                    self.steps, part, self.step, self.driving, self.lighter, self.views, self.maps, self.foresight,
                    self._coupling(float(spin)), self.drive, self.turning, self.clearance, SOLREF_PER_UNIT, out, start,
                )  # fmt: skip
            if failed >= 0:
                raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
            moved = np.hypot(self.clearance.states["y"], self.clearance.states["z"])
            check_warnings(self.rig, self.data, self.steps * self.step, int(np.argmax(moved)) if moved.size else 0)
            self.steps += len(part)
        return as_probes(self.rig, out)

    def before(self) -> np.ndarray:
        """Return the rest; see `Run.before`."""
        at_rest = self.whole.rows.sensor_rows.at_rest(self.data.qpos[self.maps.order])
        row = np.concatenate((at_rest, self.rest.columns()))
        return as_probes(self.rig, np.append(row, self.turning[SPIN] if self.rig.spin else [])[None])[0]

    def _coupling(self, spin: float) -> np.ndarray:
        """Return gyroscopic moments per velocity at a spin, rad/s, before their own kick; (0, 0) for none."""
        if self.kicked is None or self.kicked[0] != spin:
            moments = spin * self.whole.gyroscopic
            if not spin and not self.changes:
                moments = np.zeros((0, 0))
            elif moments.size:
                own = np.eye(len(moments)) + moments @ self.foresight.of_force
                moments = np.ascontiguousarray(np.linalg.solve(own, moments))
            self.kicked = spin, moments
        return self.kicked[1]


def _heavier(plant: LinksPlant, step: float) -> tuple[mujoco.MjModel, np.ndarray]:
    """A model for a step, s, and its mass matrix (nv, nv) in the order of the coordinates.

    Armatures correct the frequencies of the integrator, and stand for joints' dampers that are implicit or, where they
    are explicit, half a step late. So are those of damping in proportion to the mass.
    """
    model, whole, order = copy.copy(plant.model), plant.whole, plant.maps.order
    model.opt.timestep = step
    late = step * whole.damping / (2 if plant.explicit else 1)
    armature = plant.armature * step**2 * whole.stiffness + late
    model.dof_armature[order] = armature
    heavier = 1 + step / 2 * whole.rayleigh[0]
    for field in ("body_mass", "body_subtreemass", "body_inertia"):
        getattr(model, field)[:] *= heavier
    return model, heavier * whole.mass + np.diag(armature)


def _before_dampers(plant: LinksPlant, inertia: np.ndarray, step: float) -> SpaceMaps:
    """The maps with sensors that read accelerations before implicit dampers change them, as in the plane."""
    maps = plant.in_space
    if plant.explicit:
        return maps
    implicit = np.diag(step * plant.whole.damping)
    at_sensors = maps.at_sensors @ (np.eye(len(inertia)) + np.linalg.solve(inertia - implicit, implicit))
    return maps._replace(at_sensors=np.ascontiguousarray(at_sensors))


def _foresight(
    rig: Rig, law: Law, plant: LinksPlant, inertia: np.ndarray, held: np.ndarray, step: float
) -> Foresight:  # fmt: skip
    """The linear model of a step with a mass matrix (nv, nv) and rows (n, nv) of what rigid supports hold."""
    whole, points = plant.whole, plant.in_space.at_points
    free = whole.free
    mobility = free @ np.linalg.solve(free.T @ inertia @ free, free.T)
    half = step / 2 * mobility
    films = np.array([g.turned for g in fillings_of(rig, law)], dtype=bool)
    rubs = any(b.friction and b.friction.coefficient for b in rig.bushings)
    return Foresight(
        needed=bool(films.any() or rubs or whole.gyroscopic.size),
        of_position=-half @ whole.whole_stiffness,
        of_velocity=np.eye(whole.size) - half @ whole.dampers,
        of_force=half,
        compliance=compliance_of(points, mobility),
        films=films,
        contact=_contact_rows(whole, held),
    )


def _contact_rows(whole: Linkage, held: np.ndarray) -> np.ndarray:
    """(n_bushings, 2, nv) contact forces along y and z per joint force of the solver's; (0, 2, nv) if not distinct."""
    n = len(whole.rig.bushings)
    found, ends = np.zeros((n, 2, whole.size)), whole.at_points[2 * n :].reshape(-1, 2, whole.size)
    for d, part in enumerate(whole.spans):
        rows = contact_rows(ends[:, d, part], held[held[:, part].any(axis=1)][:, part])
        if len(rows) != n:
            return np.zeros((0, 2, whole.size))
        found[:, d, part] = rows
    return found
