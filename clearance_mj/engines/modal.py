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
from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np

from ..beam import MOST_MODES, ritz_model
from ..clearance.contact import instantaneous
from ..clearance.gap import gap
from ..clearance.grease import grease_step, grease_table
from ..clearance.law import table_values
from .base import Engine, Equations, Run, check_setting, diverged, register, stiffest_contact

__all__ = ["Modal"]


@register
@dataclass(frozen=True)
class Modal(Engine):
    """Compiled modal engine.

    Parameters
    ----------
    modes : int
        Cantilever modes in the Ritz basis, to which the static shapes are added.
    resolution : float
        Largest phase, in rad, that the fastest mode or contact may turn in one step.
    """

    name: ClassVar[str] = "modal"
    modes: int = 8
    resolution: float = 1.0

    def __post_init__(self):
        check_setting(
            self,
            "modes",
            isinstance(self.modes, int) and 1 <= self.modes <= MOST_MODES,
            f"must be a whole number from 1 to {MOST_MODES}",
        )
        check_setting(self, "resolution", 0 < self.resolution <= 3, "must be in 0..3, above 0")

    def largest_step(self, rig, law):
        """Step in which the fastest mode, or the stiffest contact on the shaft, turns by ``resolution`` rad."""
        model = ritz_model(rig, self.modes)
        stiffest = stiffest_contact(rig, law.table(len(rig.bushings)))
        at = model.shapes([b.position for b in rig.bushings])
        contact = np.sqrt(np.max(stiffest * np.sum(at**2, axis=1), initial=0.0))
        # A kick is less exact than the modes' own motion: keep contacts four times finer.
        return self.resolution / max(model.omega[-1], 4 * contact)

    def start(self, rig, law, kind, step):
        """Begin a simulation at rest; see `Engine.start`."""
        return _ModalRun(self, rig, law, kind, step)


@functools.lru_cache(maxsize=64)
def _system(rig, modes, kind):
    """Arrays of the rig's equations that do not depend on law or step."""
    model = ritz_model(rig, modes)
    points = [b.position for b in rig.bushings] + [end for b in rig.bushings for end in b.ends]
    at_points = np.ascontiguousarray(model.shapes(points)).reshape(-1, model.size)
    at_sensors = np.ascontiguousarray(model.shapes([s.position for s in rig.sensors]))
    base = kind == "base"
    drive = -model.participation if base else model.shapes([rig.shaker.position])[0]
    gaps = np.array([b.gap for b in rig.bushings])
    return model, at_points, at_sensors, drive, float(base), gaps


@functools.lru_cache(maxsize=64)
def _flow(rig, modes, step):
    """Exact motion of the free modes over one step: rows q→q, v→q, q→v, v→v."""
    model = ritz_model(rig, modes)
    decay = model.damping / 2
    w = np.emath.sqrt(model.omega**2 - decay**2)  # imaginary for an overdamped mode
    cos, sin = np.cos(w * step).real, (np.sin(w * step) / w).real
    return np.exp(-decay * step) * np.array([cos + decay * sin, sin, -(model.omega**2) * sin, cos - decay * sin])


class _ModalRun(Run):
    def __init__(self, engine, rig, law, kind, step):
        self.engine, self.rig, self.step, self.steps = engine, rig, step, 0
        model, *self.system = _system(rig, engine.modes, kind)
        n, n_bushings = model.size, len(rig.bushings)
        half = model.omega * step / 2
        inverse_mass = np.tan(half) / half
        self.linear = (inverse_mass, _flow(rig, engine.modes, step))
        self.grease, self.law = grease_table(rig, law), law.table(n_bushings)
        self.state = tuple(np.zeros(m) for m in (n, n, n, n_bushings, n_bushings, n_bushings, 2 * n_bushings))

    def advance(self, drive):
        out = np.empty((drive.size, self.system[1].shape[0] + 3 * len(self.rig.bushings)))
        arguments = (self.steps, self.step, drive, *self.linear, *self.system, self.grease, self.law, *self.state, out)
        failed, bushing = _advance(*arguments)
        if failed >= 0:
            raise diverged(self.rig, self.engine, (self.steps + failed) * self.step, bushing)
        self.steps += drive.size
        return out

    def equations(self):
        """Return the equations of the steps; see `Run.equations`.

        A mode moves from kick to kick by the flow F: q₊ - (F₀₀ + F₁₁) q + det F q₋ = F₀₁ h f/m.
        """
        inverse_mass, (qq, vq, qv, vv) = self.linear
        at_points, _, drive, *_ = self.system
        det = qq * vv - vq * qv
        kick = vq * self.step * inverse_mass
        mass = self.step**2 * (1 + det) / (2 * kick)
        damping, stiffness = self.step * (1 - det) / kick, (1 + det - qq - vv) / kick
        speed = np.array([-det, vv - qq, np.ones(det.size)]) / (2 * vq)  # the mean of before and after the kick
        return Equations(np.diag(mass), np.diag(damping), np.diag(stiffness), drive, at_points, speed)

    def snapshot(self):
        """Return coordinates, Bouc-Wen states, envelopes and impact speeds; see `Run.snapshot`."""
        q, _, _, z, envelope, _, impact = self.state
        return q, z, envelope, impact


@numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"})
def _advance(
    steps, h, drive, inverse_mass, flow, at_points, at_sensors, drive_shape, base, gaps,
    grease, law, q, v, q_before, z, envelope, previous, impact, out,
):  # fmt: skip
    """Advance the state by ``drive.size`` steps; return (step, bushing) of a divergence, or (-1, -1).

    Rows of ``at_points``: the bushings' middles, where grease acts, then their two ends each, where contact acts.
    In the loop, ``compliance`` is the velocity of each point per unit impulse at each other.
    """
    n, n_bushings, n_sensors = q.size, gaps.size, at_sensors.shape[0]
    n_points = at_points.shape[0]
    x, w, force = np.zeros(n_points), np.zeros(n_points), np.zeros(n_points)
    elastic, viscous = np.zeros(n_points), np.zeros(n_points)
    total, acceleration = np.zeros(n), np.zeros(n)
    compliance = (at_points * inverse_mass) @ at_points.T
    at_drive = at_points @ (inverse_mass * drive_shape)
    release = np.exp(-h / law.release) if law.by_amplitude else 0.0
    half, per_step2 = 0.5 * h, 1.0 / (h * h)
    for i in range(drive.size):
        a = drive[i]
        for p in range(n_points):
            position, speed = 0.0, 0.0
            for m in range(n):
                position += at_points[p, m] * q[m]
                speed += at_points[p, m] * v[m]
            x[p], w[p], force[p] = position, speed + half * a * at_drive[p], 0.0
        for j in range(n_bushings):
            if not abs(x[j]) < 1e3 * gaps[j] + 1.0:
                return i, j
            z[j], elastic[j], viscous[j] = grease_step(grease[j], x[j], x[j] - previous[j], z[j])
            previous[j] = x[j]
            envelope[j] = max(abs(x[j]), envelope[j] * release)
            k_now, c_now = table_values(law, j, envelope[j] if law.by_amplitude else (steps + i) * h)
            for end in range(2):
                p = n_bushings + 2 * j + end
                g = gap(x[p], gaps[j])
                if g == 0.0:
                    impact[2 * j + end], elastic[p], viscous[p] = 0.0, 0.0, 0.0
                    continue
                if impact[2 * j + end] == 0.0:
                    impact[2 * j + end] = max(w[p] if g > 0.0 else -w[p], 1e-12)
                k, c = instantaneous(k_now, c_now, law.exponent[j], law.kappa[j], abs(g), impact[2 * j + end])
                elastic[p], viscous[p] = 0.5 * k * g, 0.5 * c  # each end carries half of the bushing's k and c
        for _ in range(2):  # Gauss-Seidel: every force at the velocity that the other forces leave
            for p in range(n_points):
                if elastic[p] == 0.0 and viscous[p] == 0.0:
                    continue
                own = half * compliance[p, p]
                new = (elastic[p] + viscous[p] * (w[p] + own * force[p])) / (1.0 + viscous[p] * own)
                if p >= n_bushings and new * x[p] < 0.0 and not law.adhesion[(p - n_bushings) // 2]:
                    new = 0.0
                change = new - force[p]
                for r in range(n_points):
                    w[r] -= half * compliance[r, p] * change
                force[p] = new
        for m in range(n):
            total[m] = drive_shape[m] * a
        for p in range(n_points):
            if force[p] != 0.0:
                for m in range(n):
                    total[m] -= at_points[p, m] * force[p]
        for m in range(n):
            kicked = v[m] + h * inverse_mass[m] * total[m]
            v[m] = flow[2, m] * q[m] + flow[3, m] * kicked
            q_after = flow[0, m] * q[m] + flow[1, m] * kicked
            # Force less ω² q would be the same, but a small difference of large numbers for high modes.
            acceleration[m] = (q_after - 2.0 * q[m] + q_before[m]) * per_step2
            q_before[m], q[m] = q[m], q_after
        for s in range(n_sensors):
            value = base * a
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
