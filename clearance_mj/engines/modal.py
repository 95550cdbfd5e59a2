"""The modal engine: Eq. 3 on the Ritz model of the structure, compiled.

The structure's uncoupled modes move exactly between two steps; forces of clearances and excitation act as kicks at the
steps (Strang splitting; Deuflhard 1979; Hairer, Lubich & Wanner, Geometric Numerical Integration, XIII). The scheme is
symmetric and of second order, and no mode limits the step. Under steady kicks a mode of frequency ω deflects too
little, by the factor (ωh/2)/tan(ωh/2); modal masses smaller by that factor correct it, so that static deflections are
exact at any step. Damping forces at the clearances act at the velocity in the middle of their kick, so that strong
squeeze films stay stable; so do damping that couples modes and gyroscopic moments, which keeps the energy at any spin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, cast

import numpy as np
from pydantic import Field

from ..clearance.law import Law
from ..clearance.record import clearance_records, laws_of, shared_kinds, side_by_side
from ..core.validation import Positive, Whole
from ..linear import MAX_MODES, linear_model
from ..rig import Rig
from ..rig.instruments import Kinds
from ..signals.sampling import lowpass
from .base import Engine, SeveralRuns, SimulationRun, diverged, in_columns, register
from .energies import NOTHING, StepRecords, columns_of
from .equilibrium import rest_of
from .modal_loop import PER_INERTIA, RATE, SPIN, LaneState, advance, advance_whole
from .scheme import at_spin, linear_part, pack, packed_part, places_of, slide_rows
from .turning import SPIN_STEPS, as_probes, turning_of

__all__ = ["Modal", "ModalRun", "SideBySide", "leaving", "stiffest_contacts"]

SLOWEST = 1e-3  # rad/s, assumed for the time step where nothing has a stiffness, as gears without shafts


@register
class Modal(Engine):
    """Compiled modal engine."""

    name: ClassVar[str] = "modal"
    modes: Annotated[Whole, Field(ge=1, le=MAX_MODES)] = 8
    """modes in the Ritz basis, of each bending plane, to which the static shapes are added"""
    resolution: Annotated[Positive, Field(le=3)] = 1.0
    """largest phase, rad, of the fastest mode or contact in one step"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """Return the step in which the fastest mode, or the stiffest contact, turns by ``resolution`` rad."""
        model, stiffest = linear_model(rig, self.modes), stiffest_contacts(rig, law)
        rows = np.vstack((model.at_bushings, *map(model.sliding, slide_rows(rig))))
        fastest, moved = np.max(model.omega), np.sum(rows**2, axis=1)
        contact = np.sqrt(np.max(stiffest[[*rig.bushing_of_row, *slide_rows(rig)]] * moved, initial=0.0))
        # A kick is less exact than the modes' free motion: keep contacts four times finer.
        return float(self.resolution / max(fastest, 4 * contact, SLOWEST))

    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> SimulationRun:
        """Begin a simulation at rest; see `Engine.start`."""
        return ModalRun(self, rig, law, kind, step)


def stiffest_contacts(rig: Rig, law: Law) -> np.ndarray:
    """Return the largest stiffness (n_bushings,) of contacts or their bristles that time steps must follow, N/m."""
    stiffest, _ = law.largest([b.gap for b in rig.bushings])
    bristles = [(b.friction.stiffness or b.contact.stiffness) if b.friction else 0.0 for b in rig.bushings]
    return np.maximum(stiffest, bristles)


def leaving(q: np.ndarray, flow: np.ndarray) -> np.ndarray:
    """Return the velocities (n,) of modes in equilibrium at q just before the kick; see the module."""
    speed = (1 - flow[0]) * q / np.where(flow[1] == 0, 1.0, flow[1])
    return np.asarray(flow[2] * q + flow[3] * speed)


class ModalRun(SimulationRun):
    """A simulation by the modal engine."""

    def __init__(self, engine: Modal, rig: Rig, law: Law, kind: Kinds, step: float):
        self.engine, self.rig, self.law, self.step = engine, rig, law, step
        self.model = linear_model(rig, engine.modes)
        self.linear, self.coupled = linear_part(rig, engine.modes, kind, step)
        self.clearance = clearance_records(rig, law, step)
        self.rest = rest_of(rig, law, engine.modes)
        q = np.zeros(self.model.size)
        if self.rest:
            self.rest.begin(self.clearance)
            q = self.rest.coordinates
        turning = turning_of(rig)
        self.motion = LaneState(q, leaving(q, self.linear.flow), q, turning)
        depends = self.model.gyroscopic.size or self.model.circulatory.size or self.model.bearings
        self.changes = bool((turning[RATE] or turning[PER_INERTIA]) and depends)
        """True if matrices change with the spin"""
        self.columns = len(rig.sensors) + 3 * rig.n_rows + len(rig.bushings) + int(rig.spin is not None)
        self.alone = SideBySide([self])
        modes = [part.ravel()[: q.size] for part in self.alone.motion[:3]]
        self.motion = LaneState(modes[0], modes[1], modes[2], self.alone.motion.turning[:, 0])
        """state changed by the loop, one number for each mode"""

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `SimulationRun.advance`."""
        return self.alone.advance(excitation)[0]

    def balanced(self, excitation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate one block, and return its energies; see `SimulationRun.balanced`."""
        kept = NOTHING._replace(energies=np.empty((len(excitation), columns_of(len(self.rig.bushings)))))
        return self.alone.advance(excitation, kept)[0], kept.energies

    def before(self) -> np.ndarray | None:
        """Return the columns at rest; see `SimulationRun.before`."""
        return None if self.rest is None else as_probes(self.rig, self.at_rest()[None])[0]

    def at_rest(self) -> np.ndarray:
        """Return the columns of the compiled loop at rest, (columns,)."""
        if self.rest is None:
            return np.zeros(self.columns)
        of_sensors = self.model.sensor_rows.at_rest(self.rest.coordinates)
        return np.concatenate((of_sensors, self.rest.columns(), self.motion.turning[[SPIN]] if self.rig.spin else []))

    def batch_key(self) -> object | None:
        """Return steps, sizes and kinds of laws; None if matrices change with the spin (`SimulationRun.batch_key`)."""
        if self.changes:
            return None
        shapes = tuple(np.shape(part) for part in self.linear[:10])
        return self.step, self.columns, shapes, self.linear.orders.tobytes(), shared_kinds(self.rig, self.law)

    def combine(self, runs: Sequence[SimulationRun]) -> SideBySide:
        """Combine the runs in lanes; see `SimulationRun.combine`."""
        return SideBySide(cast(Sequence[ModalRun], runs))

    def at_spin(self, spin: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the stiffness and damping at a spin, packed."""
        matrices = at_spin(self.model, self.coupled, self.linear.inverse_mass, self.step, spin)
        springs, coupling = (pack([matrix.T if len(matrix) else matrix]) for matrix in matrices)
        return springs, coupling


class SideBySide(SeveralRuns):
    """Runs from their start with equal `ModalRun.batch_key`, under one excitation in lanes; see lanes.py."""

    def __init__(self, runs: Sequence[ModalRun]):
        self.runs, self.steps, self.step, self.lanes = runs, 0, runs[0].step, tuple(range(len(runs)))
        first, self.columns = runs[0], runs[0].columns
        self.turns = first.rig.spin is not None
        self.linear = packed_part([run.linear for run in runs])
        q, v, q_before = (pack([run.motion[i] for run in runs]) for i in range(3))
        self.motion = LaneState(q, v, q_before, np.stack([run.motion.turning for run in runs], axis=-1))
        self.clearance = side_by_side([run.clearance for run in runs], laws_of(first.rig, first.law))
        self.places = places_of(first.rig)

    def advance(self, excitation: np.ndarray, kept: StepRecords = NOTHING) -> np.ndarray:
        """Simulate one block; return the columns of `SimulationRun.advance` for each run: (n_runs, n, columns).

        The records ``kept`` of a single run are filled in.
        """
        driving, run = self.driving(excitation), self.runs[0]
        out = np.empty((self.columns, len(driving), len(self.lanes)))
        size = SPIN_STEPS if run.changes else max(len(driving), 1)
        for start in range(0, len(driving), size):
            part = driving[start : start + size]
            if run.changes:
                spin = float(self.motion.turning[SPIN, 0] + self.motion.turning[RATE, 0] * len(part) * self.step / 2)
                springs, coupling = run.at_spin(spin)
                self.linear = self.linear._replace(springs=springs, coupling=coupling)
            self._check(*advance(self.steps, part, self.step, *self.parts, kept, out, start))
            self.steps += len(part)
        columns = out.T
        for run, rows in zip(self.runs, columns):
            as_probes(run.rig, rows)
        return columns

    @property
    def parts(self) -> tuple[object, ...]:
        """Arguments of the loop other than the excitation."""
        return self.lanes, self.turns, self.linear, self.motion, self.clearance, self.places

    def driving(self, excitation: np.ndarray) -> np.ndarray:
        """Return inputs (n,) or (n, n_inputs) for the loop: (n, n_inputs), with a column of 1 for a constant load."""
        columns = in_columns(excitation)
        loads = len(self.runs[0].linear.input) - columns.shape[1]
        return np.hstack((columns, np.ones((len(columns), loads)))) if loads else columns

    def whole(self, excitation: np.ndarray, factor: int, samples: int, forces: bool = True) -> np.ndarray:
        """Simulate a whole excitation; see `SeveralRuns.whole`."""
        rig = self.runs[0].rig
        columns = self.columns if forces or self.turns else len(rig.sensors) + rig.n_rows
        out = np.empty((len(self.lanes), columns, samples))
        drive, before = self.driving(excitation), np.stack([run.at_rest()[:columns] for run in self.runs], axis=-1)
        self._check(*advance_whole(drive, factor, lowpass(factor), self.step, *self.parts, NOTHING, before, out))
        for run, rows in zip(self.runs, out):
            as_probes(run.rig, rows.T)
        return out

    def _check(self, failed: int, record: int) -> None:
        """Raise a SimulationError if a loop stopped early."""
        if failed >= 0:
            first = self.runs[0]
            lane, bushing = divmod(record, max(len(first.rig.bushings), 1))
            raise diverged(self.runs[lane].rig, first.engine, (self.steps + failed) * self.step, bushing)
