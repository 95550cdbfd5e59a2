"""The loop both MuJoCo engines run: before every step the law's softness, grease and excitation, then mj_step.

The loop is compiled and calls ``mj_step`` of the MuJoCo library directly, with views of the model's and data's own
arrays: writing parameters before every step then costs next to nothing, many simulations run on threads without the
interpreter lock, and results do not depend on the number of threads.
"""

from __future__ import annotations

import copy
import ctypes
import threading
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import llvmlite.binding
import mujoco
import numba
import numpy as np
import scipy.linalg

from ..clearance.contact import instantaneous
from ..clearance.gap import gap
from ..clearance.grease import DAMPING, FILM_LIMIT, INVERSE_FILM, STIFFNESS, grease_step, grease_table
from ..clearance.law import table_values
from ..errors import SimulationError
from .base import Equations, Run, diverged, needs_no_adhesion, place, stiffest_contact
from .softness import IMPEDANCE, INVERSE_INERTIA

__all__ = ["MujocoRun", "Plant", "set_solver", "stable_step"]


ARMATURE = 1 / 7
"""Inertia added to each joint, as a share of its stiffness times the step squared

The Euler integrator turns a mode of frequency ω too fast, by the share (ωh)²/24; an armature of a h² times the
stiffness slows it by a (ωh)²/2, and lets the stable step grow by 1/√(1 - 4a). At a = 1/12 no error of second order is
left, as in Numerov's method; at 1/6 it is Euler's with the other sign, and the step √3 times as long. Statics do not
change.
"""


def set_solver(spec: mujoco.MjSpec):
    """Set integrator and solver as exact contact softness wants them.

    With an impedance of 1e-4 and a known inverse inertia, the regularisation of the contacts is far greater than
    their coupling: each force follows from its own row alone, and the projected Gauss-Seidel solver finds it in one
    sweep, at a third of Newton's cost. Joint springs are explicit and joint dampers implicit in the Euler integrator.

    Parameters
    ----------
    spec : MjSpec
        The model, changed in place.
    """
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.solver = mujoco.mjtSolver.mjSOL_PGS
    spec.option.iterations = 3
    spec.option.gravity = [0, 0, 0]
    # No islands to look for, and a simulation that goes wrong must stop, not start again.
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_AUTORESET)


def _library() -> ctypes.CDLL:
    """The MuJoCo library that the Python module has loaded."""
    folder = Path(mujoco.__file__).parent
    found = [p for p in folder.iterdir() if p.name.startswith(("libmujoco", "mujoco.dll"))]
    return ctypes.CDLL(str(found[0]))


# The compiled loop is cached between sessions, so it knows mj_step by name and not by address.
_LIBRARY = _library()
llvmlite.binding.add_symbol("mj_step", ctypes.cast(_LIBRARY.mj_step, ctypes.c_void_p).value)
_mj_step = numba.types.ExternalFunction("mj_step", numba.types.void(numba.types.intp, numba.types.intp))


def stable_step(mass, stiffness, at_points, rig, law, armature=ARMATURE) -> float:
    """Longest stable step of the Euler integrator with every contact and film at its hardest.

    Springs are explicit, so h < 2/ω_max; the bushings' dampers are explicit too, which shortens it to
    2 / (δ + √(δ² + ω²)) with 2δ the largest eigenvalue of M⁻¹C.

    Parameters
    ----------
    mass : ndarray, shape (nv, nv)
        Of the shaft alone, without armatures.
    stiffness : ndarray, shape (nv,)
        Of the joints.
    at_points : ndarray, shape (3 n_bushings, nv)
        As in `Plant`.
    rig : Rig
        The rig.
    law : Law
        The clearance's law.
    armature : float
        As in `Plant`.

    Returns
    -------
    float
        s.
    """
    grease, table, n_bushings = grease_table(rig, law), law.table(len(rig.bushings)), len(rig.bushings)
    film = grease[:, DAMPING] / np.where(grease[:, INVERSE_FILM] > 0, grease[:, FILM_LIMIT], 1.0) ** 2
    k = np.concatenate((grease[:, STIFFNESS], np.repeat(stiffest_contact(rig, table) / 2, 2)))
    c = np.concatenate((film, np.repeat(table.c.max(axis=0, initial=0.0).reshape(n_bushings) / 2, 2)))
    springs, dampers = np.diag(stiffness) + (at_points.T * k) @ at_points, (at_points.T * c) @ at_points
    step = 0.0
    for _ in range(20):  # from below: what is missing falls to the share 4 armature, or less, each time
        inertia = mass + np.diag(armature * step**2 * stiffness)
        decay = _largest_eigenvalue(dampers, inertia) / 2
        step = 2 / (decay + np.sqrt(decay**2 + _largest_eigenvalue(springs, inertia)))
    return float(step)


def _largest_eigenvalue(matrix, mass):
    return scipy.linalg.eigh(matrix, mass, eigvals_only=True, subset_by_index=[mass.shape[0] - 1] * 2)[0]


@contextmanager
def _warnings_counted():
    """Let MuJoCo count its warnings, which a run looks at, instead of writing a log into the working folder."""
    global _counting
    with _COUNTING:
        if not _counting:
            _HANDLER.value, _PREVIOUS.value = ctypes.cast(_ignore.ctypes, ctypes.c_void_p).value, _HANDLER.value
        _counting += 1
    try:
        yield
    finally:
        with _COUNTING:
            _counting -= 1
            if not _counting:
                _HANDLER.value = _PREVIOUS.value


@numba.cfunc(numba.types.void(numba.types.voidptr))
def _ignore(message):
    pass


_HANDLER = ctypes.c_void_p.in_dll(_LIBRARY, "mju_user_warning")
_PREVIOUS = ctypes.c_void_p()
_COUNTING, _counting = threading.Lock(), 0


@dataclass(frozen=True, eq=False)
class Plant:
    """A rig as a MuJoCo model, and the linear maps between its coordinates and the rig's points.

    Shared by simulations, which copy the model.
    """

    model: mujoco.MjModel
    """compiled, not to be changed"""
    at_points: np.ndarray
    """(3 n_bushings, nv) displacement of the bushings' middles, then of their two ends each, per coordinate"""
    at_shaker: np.ndarray
    """(nv,) displacement of the shaker's point per coordinate; zeros for a shaken base"""
    viscous: np.ndarray
    """(nv, nv) mass-proportional damping; (0, 0) where the model has all of its damping"""
    readout: np.ndarray
    """(n_sensors, nv) acceleration of the sensors, relative to the base, per coordinate's"""
    softness: str
    """field of mjModel that holds the solref of the contacts"""
    rows: np.ndarray
    """(2 n_bushings, n) rows of ``softness`` that belong to each bushing end; -1 for none"""
    armature: float = ARMATURE
    """inertia of each joint, as a share of its stiffness times the step squared"""


class MujocoRun(Run):
    """A MuJoCo simulation under way, with a model of its own.

    Parameters
    ----------
    engine, rig, law, kind, step
        As `Engine.start` takes them.
    plant : Plant
        The rig's model.
    """

    def __init__(self, engine, rig, law, kind, step, plant: Plant):
        n_bushings = len(rig.bushings)
        self.engine, self.rig, self.plant, self.steps = engine, rig, plant, 0
        self.law, self.grease = law.table(n_bushings), grease_table(rig, law)
        needs_no_adhesion(self.law, engine)
        self.model = copy.copy(plant.model)
        self.model.opt.timestep = self.step = step
        self.model.dof_armature[:] = plant.armature * step**2 * plant.model.jnt_stiffness
        # Mass-proportional damping is explicit, half a step late; so much more mass makes up for it.
        self.heavier = 1 + step / 2 * rig.beam.rayleigh[0] if plant.viscous.size else 1.0
        for field in ("body_mass", "body_subtreemass", "body_inertia"):
            getattr(self.model, field)[:] *= self.heavier
        self.data = mujoco.MjData(self.model)
        ends = plant.at_points[n_bushings:]
        # The contact forces are what the solver's joint forces come from; a bushing's is the sum over its ends.
        self.from_constraint = -np.linalg.pinv(ends.T).reshape(n_bushings, 2, self.model.nv).sum(axis=1)
        self.state = tuple(np.zeros(n) for n in (n_bushings, n_bushings, n_bushings, 2 * n_bushings))
        self.gaps = np.array([b.gap for b in rig.bushings])
        self.base = kind == "base"
        model, data = self.model, self.data
        self.views = (model.opt.gravity, getattr(model, plant.softness), data.qpos, data.qvel)
        self.views += (data.qfrc_applied, data.qfrc_constraint, data.qacc)

    def advance(self, drive):
        """Simulate one block; see `Run.advance`."""
        plant, n_bushings = self.plant, len(self.rig.bushings)
        out = np.empty((drive.size, plant.readout.shape[0] + 3 * n_bushings))
        with _warnings_counted():
            failed, bushing = _advance(
                *(self.model._address, self.data._address, self.views, self.steps, self.step, drive),
                *(self.base, self.heavier),
                *(plant.at_points, plant.at_shaker, plant.viscous, plant.readout, plant.rows),
                *(self.from_constraint, self.gaps, self.grease, self.law, self.state, out),
            )
        if failed >= 0:
            raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
        self._check_warnings()
        self.steps += drive.size
        return out

    def equations(self):
        """Return the equations of the steps; see `Run.equations`.

        v₊ = v + h M⁻¹ (b a - Pᵀ f - K q - D v₊ - E v), q₊ = q + h v₊, with the joints' D and the plant's viscous E.
        """
        model, nv = copy.copy(self.model), self.model.nv
        model.opt.gravity[:] = 0, 0, -1 / self.heavier
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        mass = np.zeros((nv, nv))
        mujoco.mj_fullM(model, data, mass)
        implicit, explicit = np.diag(model.dof_damping), np.zeros((nv, nv))
        if self.plant.viscous.size:
            explicit = self.plant.viscous
        mass += self.step / 2 * (implicit - explicit)
        drive = -data.qfrc_bias if self.base else self.plant.at_shaker
        speed = np.outer((-1, 1, 0), np.ones(nv)) / self.step
        stiffness = np.diag(model.jnt_stiffness)
        return Equations(mass, implicit + explicit, stiffness, drive, self.plant.at_points, speed)

    def snapshot(self):
        """Return coordinates, Bouc-Wen states, envelopes and impact speeds; see `Run.snapshot`."""
        z, envelope, _, impact = self.state
        return self.data.qpos, z, envelope, impact

    def _check_warnings(self):
        for index in np.flatnonzero(self.data.warning.number):
            name = mujoco.mjtWarning(int(index)).name
            largest = int(np.argmax(np.abs(self.state[2]))) if self.rig.bushings else 0
            raise SimulationError(
                f"rig {self.rig.name!r}: MuJoCo's solver warned {name} between t = {self.steps * self.step:.6f} s and "
                f"{self.data.time:.6f} s, the largest motion {place(self.rig, largest)}"
            )


@numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"})
def _advance(
    model, data, views, steps, h, drive, base, heavier, at_points, at_shaker, viscous, readout, rows,
    from_constraint, gaps, grease, law, state, out,
):  # fmt: skip
    """Advance the state by ``drive.size`` steps; return (step, bushing) of a divergence, or (-1, -1)."""
    gravity, softness, qpos, qvel, applied, constraint, acceleration = views
    z, envelope, previous, impact = state
    nv, n_bushings, n_sensors = qvel.size, gaps.size, readout.shape[0]
    grease_force, displacement = np.zeros(n_bushings), np.zeros(n_bushings)
    release = np.exp(-h / law.release) if law.by_amplitude else 0.0
    hardness = 0.5 * (1.0 - IMPEDANCE) * INVERSE_INERTIA  # each end carries half of the bushing's k and c
    for i in range(drive.size):
        a = drive[i]
        if base:
            gravity[2] = -a / heavier
            applied[:] = 0.0
        else:
            for m in range(nv):
                applied[m] = at_shaker[m] * a
        for m in range(viscous.shape[0]):
            total = 0.0
            for r in range(nv):
                total += viscous[m, r] * qvel[r]
            applied[m] -= total
        for j in range(n_bushings):
            x, speed = _point(at_points, j, qpos, qvel)
            if not abs(x) < 1e3 * gaps[j] + 1.0:
                return i, j
            z[j], elastic, film = grease_step(grease[j], x, x - previous[j], z[j])
            previous[j] = displacement[j] = x
            grease_force[j] = elastic + film * speed
            for m in range(nv):
                applied[m] -= at_points[j, m] * grease_force[j]
            envelope[j] = max(abs(x), envelope[j] * release)
            k, c = table_values(law, j, envelope[j] if law.by_amplitude else (steps + i) * h)
            for end in range(2 * j, 2 * j + 2):
                k_end, c_end = k, c
                if law.exponent[j] != 1.0 or law.kappa[j] != 0.0:
                    x, speed = _point(at_points, n_bushings + end, qpos, qvel)
                    g = gap(x, gaps[j])
                    if g == 0.0:
                        impact[end] = 0.0
                    elif impact[end] == 0.0:
                        impact[end] = max(speed if g > 0.0 else -speed, 1e-12)
                    k_end, c_end = instantaneous(k, c, law.exponent[j], law.kappa[j], abs(g), impact[end])
                for side in range(rows.shape[1]):
                    row = rows[end, side]
                    if row >= 0:
                        softness[row, 0] = -hardness * max(k_end, 1e-9)  # zero would mean MuJoCo's default
                        softness[row, 1] = -hardness * c_end
        _mj_step(model, data)
        for s in range(n_sensors):
            value = a if base else 0.0
            for m in range(nv):
                value += readout[s, m] * acceleration[m]
            if not abs(value) < np.inf:  # without bushings nothing else would stop it
                return i, 0
            out[i, s] = value
        for j in range(n_bushings):
            contact = 0.0
            for m in range(nv):
                contact += from_constraint[j, m] * constraint[m]
            out[i, n_sensors + j] = displacement[j]
            out[i, n_sensors + n_bushings + j] = contact
            out[i, n_sensors + 2 * n_bushings + j] = grease_force[j]
    return -1, -1


@numba.njit(cache=True, nogil=True, inline="always")
def _point(at_points, p, qpos, qvel):
    x, speed = 0.0, 0.0
    for m in range(qpos.size):
        x += at_points[p, m] * qpos[m]
        speed += at_points[p, m] * qvel[m]
    return x, speed
