"""The modal engine: Eq. 3 on the Ritz model of the shaft, compiled.

The shaft's uncoupled modes move exactly between two steps; bushing and excitation forces act as kicks at the steps
(Strang splitting; Deuflhard 1979; Hairer, Lubich & Wanner, Geometric Numerical Integration, XIII). The scheme is
symmetric and of second order, and no mode limits the step. Under steady kicks a mode of frequency ω deflects by
(ωh/2)/tan(ωh/2) of what it should; modal masses smaller by that factor undo it, so that static deflections are exact
at any step. Damping forces at the bushings are taken at the velocity in the middle of their own kick, so that strong
squeeze films stay stable.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from ..clearance.kernel import clearance_records, greases_of, side_by_side
from ..clearance.lane_contacts import lane_contacts
from ..clearance.lane_greases import lane_greases
from ..clearance.law import Law
from ..core.validation import Positive, Whole
from ..linear import MAX_MODES, linear_model
from ..rig import Rig
from ..rig.instruments import Kinds
from ..signals.sampling import lowpass
from .base import Engine, Equations, Run, diverged, in_columns, register
from .equilibrium import rest_of
from .modal_loop import Motion, Shaft, advance, advance_whole
from .modal_space import SpatialRun, driven, kicked_damping, leaving, scheme, stiffest_contacts

__all__ = ["Modal", "ModalRun", "SideBySide"]


@register
class Modal(Engine):
    """Compiled modal engine."""

    name: ClassVar[str] = "modal"
    modes: Annotated[Whole, Field(ge=1, le=MAX_MODES)] = 8
    """modes in the Ritz basis, to which the static shapes are added"""
    resolution: Annotated[Positive, Field(le=3)] = 1.0
    """largest phase, rad, that the fastest mode or contact may turn in one step"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """Step in which the fastest mode, or the stiffest contact on the shaft, turns by ``resolution`` rad."""
        model, stiffest = linear_model(rig, self.modes), stiffest_contacts(rig, law)
        fastest, moved = np.max(model.omega), np.sum(model.at_bushings**2, axis=1).reshape(-1, rig.n_coordinates)
        contact = np.sqrt(np.max(stiffest * np.max(moved, axis=1), initial=0.0))
        # A kick is less exact than the modes' own motion: keep contacts four times finer.
        return float(self.resolution / max(fastest, 4 * contact))

    def start(self, rig: Rig, law: Law, kind: Kinds, step: float) -> Run:
        """Begin a simulation at rest; see `Engine.start`."""
        if rig.moves_across:
            return SpatialRun(self, rig, law, kind, step, self.modes)
        return ModalRun(self, rig, law, kind, step)


@functools.lru_cache(maxsize=128)
def _shaft(rig: Rig, modes: int, kind: Kinds, step: float) -> Shaft:
    model = linear_model(rig, modes)
    flow, inverse_mass = scheme(model.omega, np.zeros(model.size) if model.coupling.size else model.damping, step)
    viscous = model.viscous() if model.coupling.size else model.coupling
    kicked = kicked_damping(viscous, inverse_mass, step)
    sensors, points, (push, on_base) = model.sensor_rows, model.at_points, driven(model, kind)
    if model.weight.any():  # f₀ is one more input, whose signal is 1
        push, on_base = np.vstack((push, model.weight)), np.vstack((on_base, np.zeros(len(rig.sensors))))
    light = points * inverse_mass
    at_input = np.array([light @ each for each in push])
    return Shaft(
        inverse_mass, flow, points, sensors.accelerations, push, on_base, kicked, light @ points.T, at_input,
        model.springs, sensors.readings,
    )  # fmt: skip


class ModalRun(Run):
    """A simulation by the modal engine."""

    def __init__(self, engine: Modal, rig: Rig, law: Law, kind: Kinds, step: float):
        self.engine, self.rig, self.step = engine, rig, step
        self.shaft, self.clearance = _shaft(rig, engine.modes, kind, step), clearance_records(rig, law, step)
        self.greases, self.contacts = greases_of(rig, law), law.table(len(rig.bushings)).kinds
        self.rest, model = rest_of(rig, law, engine.modes), linear_model(rig, engine.modes)
        self.sensors = model.sensor_rows
        q = np.zeros(len(self.shaft.inverse_mass))
        if self.rest:
            self.rest.begin(self.clearance)
            q = self.rest.coordinates
        self.motion = Motion(q, leaving(q, self.shaft.flow), q)
        self.alone = SideBySide([self])

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        return self.alone.advance(excitation)[0]

    def before(self) -> np.ndarray | None:
        """Return the rest; see `Run.before`."""
        if self.rest is None:
            return None
        return np.append(self.sensors.at_rest(self.rest.coordinates), self.rest.columns())

    def alike(self) -> tuple[object, ...]:
        """Return what runs that are advanced side by side have in common."""
        return self.step, tuple(part.shape for part in self.shaft)

    def equations(self) -> Equations:
        """Return the equations of the steps; see `Run.equations`.

        A mode moves from kick to kick by the flow F: q₊ - (F₀₀ + F₁₁) q + det F q₋ = F₀₁ h f/m.
        """
        shaft, (qq, vq, qv, vv) = self.shaft, self.shaft.flow
        det = qq * vv - vq * qv
        kick = vq * self.step * shaft.inverse_mass
        mass = self.step**2 * (1 + det) / (2 * kick)
        damping, stiffness = self.step * (1 - det) / kick, (1 + det - qq - vv) / kick
        viscous = np.diag(damping)
        if shaft.coupling.size:  # at the mean velocity (q₊ - q₋)/(2 F₀₁): nothing else damps
            half_kick = self.step / 2 * shaft.inverse_mass[:, None] * shaft.coupling
            viscous = shaft.coupling @ np.linalg.inv(np.eye(det.size) - half_kick) * (self.step / vq)
        speed = np.array([-det, vv - qq, np.ones(det.size)]) / (2 * vq)  # the mean of before and after the kick
        return Equations(np.diag(mass), viscous, np.diag(stiffness), shaft.input, shaft.at_points, speed, shaft.springs)

    def snapshot(self) -> tuple[np.ndarray, np.ndarray]:
        """Return modal coordinates and impact speeds; see `Run.snapshot`."""
        return self.alone.motion.q[:, 0], self.alone.clearance.numbers[: 2 * len(self.rig.bushings)]


class SideBySide(Run):
    """Runs, from their start, of the same step and size under one excitation, advanced together; see lanes.py."""

    def __init__(self, runs: Sequence[ModalRun]):
        self.runs, self.steps, self.step, self.lanes = runs, 0, runs[0].step, tuple(range(len(runs)))
        shaft = Shaft(*(np.ascontiguousarray(np.stack(part, axis=-1)) for part in zip(*(run.shaft for run in runs))))
        self.columns = len(shaft.at_sensors) + 4 * len(runs[0].rig.bushings)
        self.motion = Motion(*(np.stack(part, axis=-1) for part in zip(*(run.motion for run in runs))))
        self.clearance = side_by_side([run.clearance for run in runs])
        self.before_start = np.zeros((self.columns, len(runs)))
        for lane, run in enumerate(runs):
            self.before_start[:, lane] = 0.0 if (before := run.before()) is None else before
        offsets = np.array([[b.offset for b in run.rig.bushings] for run in runs])
        greases = lane_greases([run.greases for run in runs], offsets, [run.clearance for run in runs])
        contacts = lane_contacts([run.contacts for run in runs], [run.clearance for run in runs])
        self.parts = self.lanes, shaft, self.motion, self.clearance, greases, contacts

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`, whose columns each run has here: (n_runs, n, columns)."""
        out = np.empty((self.columns, len(excitation), len(self.lanes)))
        self._go_on(*advance(self.steps, self.driving(excitation), self.step, *self.parts, out, 0))
        self.steps += len(excitation)
        return out.T

    def driving(self, excitation: np.ndarray) -> np.ndarray:
        """Return inputs (n,) or (n, n_inputs) as the loop takes them: (n, n_inputs), with 1 for a constant load."""
        columns = in_columns(excitation)
        loads = len(self.runs[0].shaft.input) - columns.shape[1]
        return np.hstack((columns, np.ones((len(columns), loads)))) if loads else columns

    def whole(self, excitation: np.ndarray, factor: int, samples: int, forces: bool = True) -> np.ndarray:
        """Simulate a whole excitation; return (n_runs, columns, samples): what `Run.advance` returns, decimated.

        Every sample stands for a factor of steps; the excitation goes on for as long as the last one's filter looks
        ahead. Without ``forces`` their columns and those of contact are left out.
        """
        left_out = 0 if forces else 3 * len(self.runs[0].rig.bushings)
        out = np.empty((len(self.lanes), self.columns - left_out, samples))
        drive, before = self.driving(excitation), self.before_start[: out.shape[1]]
        self._go_on(*advance_whole(drive, factor, lowpass(factor), self.step, *self.parts, before, out))
        return out

    def _go_on(self, failed: int, record: int) -> None:
        """Raise a SimulationError if a loop stopped early."""
        if failed >= 0:
            first = self.runs[0]
            lane, bushing = divmod(record, max(len(first.rig.bushings), 1))
            raise diverged(self.runs[lane].rig, first.engine, (self.steps + failed) * self.step, bushing)
