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
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from ..beam import MOST_MODES, ritz_model
from ..clearance._pointers import OPTIONS, kernel_loop
from ..clearance.kernel import Clearance, clearance_records, contact_step, follow_law, grease_step
from ..clearance.law import Law
from ..rig import Rig
from ..validation import Positive, Whole
from .base import Engine, Equations, Run, diverged, register

__all__ = ["Modal"]


@register
class Modal(Engine):
    """Compiled modal engine."""

    name: ClassVar[str] = "modal"
    modes: Annotated[Whole, Field(ge=1, le=MOST_MODES)] = 8
    """modes in the Ritz basis, to which the static shapes are added"""
    resolution: Annotated[Positive, Field(le=3)] = 1.0
    """largest phase, rad, that the fastest mode or contact may turn in one step"""

    def largest_step(self, rig: Rig, law: Law) -> float:
        """Step in which the fastest mode, or the stiffest contact on the shaft, turns by ``resolution`` rad."""
        model = ritz_model(rig, self.modes)
        stiffest, _ = law.largest([b.gap for b in rig.bushings])
        contact = np.sqrt(np.max(stiffest * np.sum(model.at_bushings**2, axis=1), initial=0.0))
        # A kick is less exact than the modes' own motion: keep contacts four times finer.
        return self.resolution / max(model.omega[-1], 4 * contact)

    def start(self, rig: Rig, law: Law, kind: str, step: float) -> Run:
        """Begin a simulation at rest; see `Engine.start`."""
        return _ModalRun(self, rig, law, kind, step)


class _Shaft(NamedTuple):
    """The linear part of the equations, in modal coordinates."""

    inverse_mass: np.ndarray  # (n,) smaller for high modes, see the module
    flow: np.ndarray  # (4, n) exact motion of the free modes over one step: rows q→q, v→q, q→v, v→v
    at_points: np.ndarray  # (3 n_bushings, n) the bushings' middles (grease), then both ends of each (contact)
    at_sensors: np.ndarray  # (n_sensors, n)
    input: np.ndarray  # (n,) force on the modes per unit of excitation
    base: np.ndarray  # (n_sensors,) what sensors read of the excitation itself: of a shaken base, with which they move
    coupling: np.ndarray  # (n, n) damping between modes; (0, 0) for none


class _Motion(NamedTuple):
    """Modal coordinates, changed in place."""

    q: np.ndarray  # (n,) now
    v: np.ndarray  # (n,) velocity before the kick
    q_before: np.ndarray  # (n,) a step ago


@functools.lru_cache(maxsize=64)
def _shaft(rig: Rig, modes: int, kind: str, step: float) -> _Shaft:
    model = ritz_model(rig, modes)
    half, decay = model.omega * step / 2, model.damping / 2
    w = np.emath.sqrt(model.omega**2 - decay**2)  # imaginary for an overdamped mode
    cos, sin = np.cos(w * step).real, step * np.sinc(w * step / np.pi).real
    flow = np.exp(-decay * step) * np.array([cos + decay * sin, sin, -(model.omega**2) * sin, cos - decay * sin])
    inverse_mass = np.divide(np.tan(half), half, out=np.ones_like(half), where=half > 0)
    on_base = model.sensors_on_base * float(kind == "base")
    return _Shaft(inverse_mass, flow, model.at_points, model.at_sensors, model.input(kind), on_base, model.coupling)


class _ModalRun(Run):
    def __init__(self, engine: Modal, rig: Rig, law: Law, kind: str, step: float):
        self.engine, self.rig, self.step, self.steps = engine, rig, step, 0
        self.shaft = _shaft(rig, engine.modes, kind, step)
        self.motion = _Motion(*np.zeros((3, self.shaft.input.size)))
        self.clearance = clearance_records(rig, law, step)

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        out = np.empty((excitation.size, len(self.shaft.at_sensors) + len(self.shaft.at_points)))
        failed, bushing = _advance(self.steps, excitation, self.step, self.shaft, self.motion, self.clearance, out)
        if failed >= 0:
            raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
        self.steps += excitation.size
        return out

    def equations(self) -> Equations:
        """Return the equations of the steps; see `Run.equations`.

        A mode moves from kick to kick by the flow F: q₊ - (F₀₀ + F₁₁) q + det F q₋ = F₀₁ h f/m.
        """
        shaft, (qq, vq, qv, vv) = self.shaft, self.shaft.flow
        det = qq * vv - vq * qv
        kick = vq * self.step * shaft.inverse_mass
        mass = self.step**2 * (1 + det) / (2 * kick)
        damping, stiffness = self.step * (1 - det) / kick, (1 + det - qq - vv) / kick
        viscous = np.diag(damping) + shaft.coupling if shaft.coupling.size else np.diag(damping)
        speed = np.array([-det, vv - qq, np.ones(det.size)]) / (2 * vq)  # the mean of before and after the kick
        return Equations(np.diag(mass), viscous, np.diag(stiffness), shaft.input, shaft.at_points, speed)

    def snapshot(self) -> tuple[np.ndarray, np.ndarray]:
        """Return modal coordinates and impact speeds; see `Run.snapshot`."""
        return self.motion.q, self.clearance.numbers[: 2 * len(self.rig.bushings)]


@kernel_loop(**OPTIONS)
def _advance(
    steps: int, excitation: np.ndarray, h: float, shaft: _Shaft, motion: _Motion, clearance: Clearance, out: np.ndarray
) -> tuple[int, int]:
    """Advance the state by ``excitation.size`` steps; return (step, bushing) of a divergence, or (-1, -1).

    In the loop, ``compliance`` is the velocity of each point per unit impulse at each other.
    """
    inverse_mass, flow, at_points, at_sensors, shape, base, coupling = shaft
    q, v, q_before = motion
    bushings, states, numbers = clearance
    n, n_bushings, n_sensors, n_points = q.size, bushings.size, at_sensors.shape[0], at_points.shape[0]
    x, w, force = np.zeros(n_points), np.zeros(n_points), np.zeros(n_points)
    elastic, viscous = np.zeros(n_points), np.zeros(n_points)
    total, acceleration, middle = np.zeros(n), np.zeros(n), np.zeros(n)
    compliance = (at_points * inverse_mass) @ at_points.T
    at_input = at_points @ (inverse_mass * shape)
    half, per_step2 = 0.5 * h, 1.0 / (h * h)
    for i in range(excitation.size):
        a = excitation[i]
        for p in range(n_points):
            position, speed = 0.0, 0.0
            for m in range(n):
                position += at_points[p, m] * q[m]
                speed += at_points[p, m] * v[m]
            x[p], w[p], force[p] = position, speed + half * a * at_input[p], 0.0
        for j in range(n_bushings):
            bushing, state = bushings[j], states[j]
            if not abs(x[j]) < 1e3 * bushing.gap + 1.0:
                return i, j
            elastic[j], viscous[j] = grease_step(bushing, state, numbers, x[j])
            follow_law(bushing, state, numbers, x[j], (steps + i) * h)
            for end in range(2):
                p = n_bushings + 2 * j + end
                g, k, c = contact_step(bushing, state, numbers, end, x[p], w[p], False)
                elastic[p], viscous[p] = k * g, c
        for _ in range(2):  # Gauss-Seidel: every force at the velocity that the other forces leave
            for p in range(n_points):
                if elastic[p] == 0.0 and viscous[p] == 0.0:
                    continue
                own = half * compliance[p, p]
                new = (elastic[p] + viscous[p] * (w[p] + own * force[p])) / (1.0 + viscous[p] * own)
                if p >= n_bushings and new * x[p] < 0.0 and not bushings[(p - n_bushings) // 2].adhesion:
                    new = 0.0
                change = new - force[p]
                for r in range(n_points):
                    w[r] -= half * compliance[r, p] * change
                force[p] = new
        for m in range(n):
            total[m] = shape[m] * a
        for p in range(n_points):
            if force[p] != 0.0:
                for m in range(n):
                    total[m] -= at_points[p, m] * force[p]
        if coupling.size:  # at the velocity in the middle of the kick of all other forces
            for m in range(n):
                middle[m] = v[m] + half * inverse_mass[m] * total[m]
            for m in range(n):
                for r in range(n):
                    total[m] -= coupling[m, r] * middle[r]
        for m in range(n):
            kicked = v[m] + h * inverse_mass[m] * total[m]
            v[m] = flow[2, m] * q[m] + flow[3, m] * kicked
            q_after = flow[0, m] * q[m] + flow[1, m] * kicked
            # Force less ω² q would be the same, but a small difference of large numbers for high modes.
            acceleration[m] = (q_after - 2.0 * q[m] + q_before[m]) * per_step2
            q_before[m], q[m] = q[m], q_after
        for s in range(n_sensors):
            value = base[s] * a
            for m in range(n):
                value += at_sensors[s, m] * acceleration[m]
            if not abs(value) < np.inf:  # whatever mode it comes from; without bushings nothing else would stop it
                return i, 0
            out[i, s] = value
        for j in range(n_bushings):
            out[i, n_sensors + j] = x[j]
            out[i, n_sensors + n_bushings + j] = force[n_bushings + 2 * j] + force[n_bushings + 2 * j + 1]
            out[i, n_sensors + 2 * n_bushings + j] = force[j]
    return -1, -1
