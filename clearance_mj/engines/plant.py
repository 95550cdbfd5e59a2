"""What both MuJoCo engines share of their models: solver options, stable step, and the maps to the rig's points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
import scipy.linalg

from ..clearance.kernel import greases_of
from ..clearance.law import Law
from ..rig import Rig

__all__ = ["ARMATURE", "Maps", "Plant", "set_solver", "stable_step"]

ARMATURE = 1 / 7
"""Inertia added to each joint, as a share of its stiffness times the step squared

The Euler integrator turns a mode of frequency ω too fast, by the share (ωh)²/24; an armature of a h² times the
stiffness slows it by a (ωh)²/2, and lets the stable step grow by 1/√(1 - 4a). At a = 1/12 no error of second order is
left, as in Numerov's method; at 1/6 it is Euler's with the other sign, and the step √3 times as long. Statics do not
change.
"""


def set_solver(spec: mujoco.MjSpec) -> None:
    """Set integrator and solver as exact contact softness wants them.

    With an impedance of 1e-4 and a known inverse inertia, the regularisation of the contacts is far greater than
    their coupling: each force follows from its own row alone, and the projected Gauss-Seidel solver finds it in one
    sweep, at a third of Newton's cost. Joint springs are explicit and joint dampers implicit in the Euler integrator.
    """
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.solver = mujoco.mjtSolver.mjSOL_PGS
    spec.option.iterations = 3
    spec.option.gravity = [0, 0, 0]
    # No islands to look for, and a simulation that goes wrong must stop, not start again.
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_AUTORESET)


class Maps(NamedTuple):
    """Linear maps between a MuJoCo model's coordinates and the rig's points."""

    at_points: np.ndarray  # (3 n_bushings, nv) displacement of the bushings' middles, then both ends of each
    at_shaker: np.ndarray  # (nv,) displacement of the shaker's point per coordinate; zeros for a shaken base
    viscous: np.ndarray  # (nv, nv) damping that the model's joints do not have; (0, 0) where they have all
    output: np.ndarray  # (n_sensors, nv) acceleration of the sensors, relative to the base, per coordinate's
    on_base: np.ndarray  # (n_sensors,) what they read per unit acceleration of the base itself
    rows: np.ndarray  # (2 n_bushings, n) rows of the contacts' solref that belong to each bushing end; -1 for none


@dataclass(frozen=True, eq=False)
class Plant:
    """A rig as a MuJoCo model. Shared by simulations, which copy the model."""

    model: mujoco.MjModel  # compiled, not to be changed
    maps: Maps  # between its coordinates and the rig's points
    softness: str  # field of mjModel that holds the solref of the contacts
    armature: float = ARMATURE  # inertia of each joint, as a share of its stiffness times the step squared


def stable_step(
    mass: np.ndarray, stiffness: np.ndarray, at_points: np.ndarray, rig: Rig, law: Law, armature: float = ARMATURE
) -> float:
    """Longest stable step, s, of the Euler integrator with every contact and film at its hardest.

    Springs are explicit, so h < 2/ω_max; the bushings' dampers are explicit too, which shortens it to
    2 / (δ + √(δ² + ω²)) with 2δ the largest eigenvalue of M⁻¹C. The mass (nv, nv) is without armatures.
    """
    grease = np.array([g.largest() for g in greases_of(rig, law)]).reshape(-1, 2)
    contact_k, contact_c = law.largest([b.gap for b in rig.bushings])
    k = np.concatenate((grease[:, 0], np.repeat(contact_k / 2, 2)))
    c = np.concatenate((grease[:, 1], np.repeat(contact_c / 2, 2)))
    springs, dampers = np.diag(stiffness) + (at_points.T * k) @ at_points, (at_points.T * c) @ at_points
    step = 0.0
    for _ in range(20):  # from below: what is missing falls to the share 4 armature, or less, each time
        inertia = mass + np.diag(armature * step**2 * stiffness)
        decay = _largest_eigenvalue(dampers, inertia) / 2
        step = 2 / (decay + np.sqrt(decay**2 + _largest_eigenvalue(springs, inertia)))
    return float(step)


def _largest_eigenvalue(matrix: np.ndarray, mass: np.ndarray) -> float:
    return scipy.linalg.eigh(matrix, mass, eigvals_only=True, subset_by_index=[mass.shape[0] - 1] * 2)[0]
