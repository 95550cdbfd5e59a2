"""The modal engine in space: both bending planes of the rig's structure in round clearances; see modal.py.

Gyroscopic moments act as damping that couples modes does: at the velocity in the middle of the kick of all other
forces, which keeps the energy at any spin. A simulation begins at the static equilibrium under gravity and spin.
"""

from __future__ import annotations

import functools

import numpy as np

from ..clearance.law import Law
from ..clearance.round_kernel import round_records
from ..rig import Rig
from ..rotors.spatial import spatial_model
from .base import Engine, Run, diverged
from .equilibrium import static_equilibrium
from .round_energies import OF_BUSHING, OF_END, OF_RIG
from .round_loop import advance_round
from .round_scheme import SPIN, RoundMotion, RoundShaft
from .turning import SPIN_STEPS, as_probes, turning_of

__all__ = ["SpatialRun", "kicked_damping", "scheme", "stiffest_contacts"]

WORST_CONDITION = 1e15  # of the matrix of a kick's own damping, beyond which nothing is left of the velocities


def stiffest_contacts(rig: Rig, law: Law) -> np.ndarray:
    """Return the largest stiffness (n_bushings,) of contacts or their bristles that time steps must follow, N/m."""
    stiffest, _ = law.largest([b.gap for b in rig.bushings])
    bristles = [(b.friction.stiffness or b.contact.stiffness) if b.friction else 0.0 for b in rig.bushings]
    return np.maximum(stiffest, bristles)


def scheme(omega: np.ndarray, damping: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the exact flow (4, n) of free modes over a step, and the inverse of their masses (n,); see modal.py."""
    half, decay = omega * step / 2, damping / 2
    w = np.emath.sqrt(omega**2 - decay**2)  # imaginary for an overdamped mode
    cos, sin = np.cos(w * step).real, step * np.sinc(w * step / np.pi).real
    flow = np.exp(-decay * step) * np.array([cos + decay * sin, sin, -(omega**2) * sin, cos - decay * sin])
    return flow, np.divide(np.tan(half), half, out=np.ones_like(half), where=half > 0)


def kicked_damping(viscous: np.ndarray, inverse_mass: np.ndarray, step: float) -> np.ndarray:
    """Return the force (n, n) of a viscous matrix per velocity in the middle of all other forces' kick.

    It acts at the velocity in the middle of its own: stable however strong a dashpot is, and without work where the
    matrix is skew, as gyroscopic moments are.
    """
    own = np.eye(len(viscous)) + step / 2 * (viscous * inverse_mass[: len(viscous)])
    if viscous.size and np.linalg.cond(own) > WORST_CONDITION:
        raise np.linalg.LinAlgError("damping beyond what can be inverted")
    return np.ascontiguousarray(np.linalg.solve(own, viscous))


@functools.lru_cache(maxsize=128)
def _shaft(rig: Rig, modes: int, kind: str, step: float) -> tuple[RoundShaft, np.ndarray]:
    """The linear part, and the viscous matrix of the kicks; (0, 0) where the modes' own damping is all."""
    model = spatial_model(rig, modes)
    coupled = model.coupling.size > 0
    viscous = np.diag(model.damping) + model.coupling if coupled else model.coupling
    flow, inverse_mass = scheme(model.omega, np.zeros(model.size) if coupled else model.damping, step)
    points = np.ascontiguousarray(model.at_points)
    shaft = RoundShaft(
        inverse_mass, np.ascontiguousarray(flow), points, np.array([(s.start, s.stop) for s in model.planes]),
        np.ascontiguousarray(model.at_sensors), _moving(model.at_sensors), model.input(kind),
        model.sensors_on_base * float(kind == "base"),
        model.weight, model.unbalance, _compliance(points, inverse_mass), np.ascontiguousarray(model.circulatory),
    )  # fmt: skip
    return shaft, viscous


def _moving(rows: np.ndarray) -> np.ndarray:
    """(n_rows, 2) the first number of each row that is not 0, and the one after the last."""
    places = [np.flatnonzero(row) for row in rows]
    return np.array([(at[0], at[-1] + 1) if at.size else (0, 0) for at in places]).reshape(-1, 2)


def _compliance(points: np.ndarray, inverse_mass: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.einsum("pdn,n,qen->pqde", points, inverse_mass, points))


class SpatialRun(Run):
    """A simulation by the modal engine in space."""

    def __init__(self, engine: Engine, rig: Rig, law: Law, kind: str, step: float, modes: int):
        self.engine, self.rig, self.step, self.steps = engine, rig, step, 0
        self.model = spatial_model(rig, modes)
        self.shaft, self.viscous = _shaft(rig, modes, kind, step)
        self.clearance = round_records(rig, law, step)
        self.rest = static_equilibrium(rig, law, modes)
        self.rest.begin(self.clearance)
        q, flow = self.rest.coordinates.copy(), self.shaft.flow
        leaving = (1 - flow[0]) * q / np.where(flow[1] == 0, 1.0, flow[1])  # after a kick that holds q where it is
        turning, self.drive = turning_of(rig)
        self.motion = RoundMotion(q, flow[2] * q + flow[3] * leaving, q.copy(), turning)
        self.changes = bool(self.drive[0] or self.drive[2]) and self.model.gyroscopic.size > 0
        self.kicked: tuple[float, np.ndarray] | None = None
        self.columns = len(rig.sensors) + 7 * len(rig.bushings) + int(rig.spin is not None)

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        return self._advance(excitation, np.empty((0, 0)))

    def balanced(self, excitation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate one block; return what `advance` does, and the energies (n, columns) of `round_energies`."""
        n = len(self.rig.bushings)
        works = np.empty((excitation.size, len(OF_RIG) + n * (len(OF_BUSHING) + 2 * len(OF_END))))
        return self._advance(excitation, works), works

    def _advance(self, excitation: np.ndarray, works: np.ndarray) -> np.ndarray:
        out = np.empty((self.columns, excitation.size))
        size = SPIN_STEPS if self.changes else max(excitation.size, 1)
        for start in range(0, excitation.size, size):
            part = excitation[start : start + size]
            spin = self.motion.turning[SPIN] + self.drive[0] * part.size * self.step / 2
            failed, bushing = advance_round(
                self.steps, part, self.step, self.shaft, self._coupling(float(spin)), self.drive, self.motion,
                self.clearance, out, start, works,
            )  # fmt: skip
            if failed >= 0:
                raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
            self.steps += part.size
        return as_probes(self.rig, out.T)

    def before(self) -> np.ndarray:
        """Return the rest; see `Run.before`."""
        row = np.concatenate((np.zeros(len(self.rig.sensors)), self.rest.columns()))
        return as_probes(self.rig, np.append(row, self.motion.turning[SPIN] if self.rig.spin else [])[None])[0]

    def _coupling(self, spin: float) -> np.ndarray:
        """Return what couples the velocities of the modes at a spin, rad/s, in the middle of their own kick."""
        if self.kicked is None or self.kicked[0] != spin:
            viscous = self.viscous
            if self.model.gyroscopic.size and (spin or self.changes):
                viscous = (viscous if viscous.size else 0.0) + spin * self.model.gyroscopic
            self.kicked = spin, kicked_damping(viscous, self.shaft.inverse_mass, self.step)
        return self.kicked[1]
