"""The modal engine in space: both bending planes of the rig's structure in round clearances; see modal.py.

Gyroscopic moments act as damping that couples modes does: at the velocity in the middle of the kick of all other
forces, which keeps the energy at any spin. A simulation begins at the static equilibrium under gravity and spin.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from ..clearance.law import Law
from ..clearance.round_kernel import round_records, rounds_side_by_side
from ..linear import LinearModel, linear_model
from ..rig import Rig
from ..rig.instruments import Kinds, each_kind
from ..rig.loads import order_forces
from ..rig.sensing import read_of_inputs
from ..signals.sampling import lowpass
from .base import Engine, Run, diverged, in_columns
from .equilibrium import static_equilibrium
from .round_energies import OF_BUSHING, OF_END, OF_RIG
from .round_lanes import advance_lanes
from .round_loop import advance_round
from .round_scheme import SPIN, RoundMotion, RoundShaft
from .turning import SPIN_STEPS, as_probes, turning_of

__all__ = [
    "SpatialRun",
    "SpatialSideBySide",
    "compliance_of",
    "driven",
    "kicked_damping",
    "leaving",
    "scheme",
    "stiffest_contacts",
]

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


def leaving(q: np.ndarray, flow: np.ndarray) -> np.ndarray:
    """Return the velocities (n,) of modes at rest at q before a kick that holds them there; see modal.py."""
    speed = (1 - flow[0]) * q / np.where(flow[1] == 0, 1.0, flow[1])
    return np.asarray(flow[2] * q + flow[3] * speed)


def driven(model: LinearModel, kinds: Kinds) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (n_inputs, n) on the coordinates per unit of each input, and `read_of_inputs`."""
    push = [model.input(kind, number) for number, kind in enumerate(each_kind(kinds))]
    return np.array(push), read_of_inputs(model.rig, kinds)


@functools.lru_cache(maxsize=128)
def _shaft(rig: Rig, modes: int, kind: Kinds, step: float) -> tuple[RoundShaft, bool]:
    """The linear part, and whether the kicks have all of the damping; else the modes have their own."""
    model = linear_model(rig, modes)
    spin, coupled = rig.spin.speed if rig.spin else 0.0, model.coupling.size > 0 or bool(model.bearings)
    flow, inverse_mass = scheme(model.omega, np.zeros(model.size) if coupled else model.damping, step)
    points = model.at_points.reshape(-1, 2, model.size)
    compliance, sensors = compliance_of(points, np.diag(inverse_mass)), model.sensor_rows
    push, on_base = driven(model, kind)
    shaft = RoundShaft(
        inverse_mass, np.ascontiguousarray(flow), points,
        np.array([(p.span.start, p.span.stop) for p in model.planes if p]),
        sensors.accelerations, _moving(sensors.accelerations), push, on_base, model.weight, model.unbalance,
        np.array([each.order for each in rig.orders]), order_forces(rig.orders, model.directed, model.size), compliance,
        np.ascontiguousarray(model.circulatory), model.springs_at(spin), sensors.readings,
    )  # fmt: skip
    return shaft, coupled


def _moving(rows: np.ndarray) -> np.ndarray:
    """(n_rows, 2) the first number of each row that is not 0, and the one after the last."""
    places = [np.flatnonzero(row) for row in rows]
    return np.array([(at[0], at[-1] + 1) if at.size else (0, 0) for at in places]).reshape(-1, 2)


def compliance_of(points: np.ndarray, mobility: np.ndarray) -> np.ndarray:
    """Return the velocities (n_points, 2, n, 2) of all points per impulse at each; n is even, which loops rely on."""
    found = np.einsum("qem,mn,pdn->pdqe", points, mobility, points)
    return np.pad(found, ((0, 0), (0, 0), (0, len(points) % 2), (0, 0)))


class SpatialRun(Run):
    """A simulation by the modal engine in space."""

    def __init__(self, engine: Engine, rig: Rig, law: Law, kind: Kinds, step: float, modes: int):
        self.engine, self.rig, self.step, self.steps = engine, rig, step, 0
        self.model = linear_model(rig, modes)
        self.shaft, self.coupled = _shaft(rig, modes, kind, step)
        self.clearance = round_records(rig, law, step)
        self.rest = static_equilibrium(rig, law, modes)
        self.rest.begin(self.clearance)
        q = self.rest.coordinates.copy()
        turning, self.drive = turning_of(rig)
        self.motion = RoundMotion(q, leaving(q, self.shaft.flow), q.copy(), turning)
        self.changes = bool(self.drive[0] or self.drive[2]) and (
            self.model.gyroscopic.size > 0 or bool(self.model.bearings)
        )
        self.kicked: tuple[float, np.ndarray] | None = None
        self.columns = len(rig.sensors) + 7 * len(rig.bushings) + int(rig.spin is not None)

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        return self._advance(excitation, np.empty((0, 0)))

    def balanced(self, excitation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate one block; return what `advance` does, and the energies (n, columns) of `round_energies`."""
        n = len(self.rig.bushings)
        works = np.empty((len(excitation), len(OF_RIG) + n * (len(OF_BUSHING) + 2 * len(OF_END))))
        return self._advance(excitation, works), works

    def _advance(self, excitation: np.ndarray, works: np.ndarray) -> np.ndarray:
        count = len(excitation)
        excitation = in_columns(excitation)
        out = np.empty((self.columns, count + 8))  # columns that are not a power of two apart share the cache
        size = SPIN_STEPS if self.changes else max(count, 1)
        for start in range(0, count, size):
            part = excitation[start : start + size]
            spin = self.motion.turning[SPIN] + self.drive[0] * len(part) * self.step / 2
            coupling, shaft = self.coupling(float(spin)), self.shaft
            if self.changes and self.model.bearings:
                shaft = shaft._replace(springs=self.model.springs_at(float(spin)))
            failed, bushing = advance_round(
                self.steps, part, self.step, shaft, coupling, self.drive, self.motion,
                self.clearance, out, start, works,
            )  # fmt: skip
            if failed >= 0:
                raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
            self.steps += len(part)
        return as_probes(self.rig, out[:, :count].T)

    def before(self) -> np.ndarray:
        """Return the rest; see `Run.before`."""
        return as_probes(self.rig, self.at_rest()[None])[0]

    def at_rest(self) -> np.ndarray:
        """Return what the compiled loop finds of the rest, (columns,)."""
        row = np.concatenate((self.model.sensor_rows.at_rest(self.rest.coordinates), self.rest.columns()))
        return np.append(row, self.motion.turning[SPIN] if self.rig.spin else [])

    def alike(self) -> tuple[object, ...]:
        """Return what runs that are advanced side by side have in common."""
        shapes = self.shaft.at_points.shape, self.shaft.at_sensors.shape
        return self.step, self.columns, shapes, self.shaft.orders.shape, self.shaft.spans.tobytes()

    def coupling(self, spin: float) -> np.ndarray:
        """Return what couples the velocities of the modes at a spin, rad/s, in the middle of their own kick."""
        if self.kicked is None or self.kicked[0] != spin:
            model = self.model
            viscous = np.diag(model.damping) + model.coupling_at(spin) if self.coupled else np.zeros((0, 0))
            if model.gyroscopic.size and (spin or self.changes):
                viscous = (viscous if viscous.size else 0.0) + spin * model.gyroscopic
            self.kicked = spin, kicked_damping(viscous, self.shaft.inverse_mass, self.step)
        return self.kicked[1]


class SpatialSideBySide:
    """Runs, from their start, whose `SpatialRun.alike` is the same, under one excitation; see round_lanes.py."""

    def __init__(self, runs: Sequence[SpatialRun]):
        self.runs, self.lanes = runs, tuple(range(len(runs)))
        shafts = [run.shaft for run in runs]
        stacked = {name: _stacked([getattr(shaft, name) for shaft in shafts]) for name in RoundShaft._fields}
        ends = np.stack([shaft.of_sensors for shaft in shafts])
        of_sensors = np.stack([ends[..., 0].min(axis=0), ends[..., 1].max(axis=0)], axis=-1)
        stacked |= {"spans": shafts[0].spans, "of_sensors": of_sensors}
        stacked["compliance"] = np.stack([shaft.compliance for shaft in shafts])
        self.shaft = RoundShaft(**stacked)
        coupling = _stacked([run.coupling(float(run.motion.turning[SPIN])) for run in runs])
        q, v, q_before, turning = (np.stack(part, axis=-1) for part in zip(*(run.motion for run in runs)))
        motion = RoundMotion(q, v, q_before, np.ascontiguousarray(turning.T))
        drive, clearance = np.stack([run.drive for run in runs]), rounds_side_by_side([run.clearance for run in runs])
        self.parts = self.lanes, self.shaft, coupling, drive, motion, clearance

    def whole(self, excitation: np.ndarray, factor: int, samples: int) -> np.ndarray:
        """Simulate a whole excitation; return (n_runs, columns, samples), decimated; as `modal.SideBySide.whole`."""
        first = self.runs[0]
        before = np.stack([run.at_rest() for run in self.runs], axis=-1)
        out, drive = np.empty((len(self.lanes), first.columns, samples)), in_columns(excitation)
        failed, record = advance_lanes(drive, factor, lowpass(factor), first.step, *self.parts, before, out)
        if failed >= 0:
            lane, bushing = divmod(record, max(len(first.rig.bushings), 1))
            raise diverged(self.runs[lane].rig, first.engine, failed * first.step, bushing)
        for run, rows in zip(self.runs, out):
            as_probes(run.rig, rows.T)
        return out


def _stacked(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Parts with the lanes as their last axis; those without size are zeros where others have one."""
    shape = max(part.shape for part in parts)
    return np.ascontiguousarray(np.stack([part if part.size else np.zeros(shape) for part in parts], axis=-1))
