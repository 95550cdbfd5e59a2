"""Where the energy of a simulation goes, and a log of its impacts.

Every engine's coordinates satisfy, step after step and to rounding, the equations that its run tells (`Equations`):
M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = b a - Pᵀ f. Multiplied by the step's travel (q₊ - q₋)/2 they become a
balance of energy without a rest: the kinetic energy ½ v M v of v = (q₊ - q)/h and the strain energy ½ q K q₊ change by
the work of drive, damping and bushings. What the ledger adds is what the bushings did with their share. It evaluates
the law at the coordinates, as the engine should have: stored is what the springs hold, lost what dampers and
hysteresis take, each by its own formula and none as the remainder. So the residual shows what the engine's forces and
the finite step have made of the law. This is the energy check of explicit dynamics (Belytschko, Liu & Moran, Nonlinear
Finite Elements for Continua and Structures, 2000, section 6.2, with a tolerance of the order of 1 %).

All energies are those of the motion relative to the base plate (Uang & Bertero, Earthq. Eng. Struct. Dyn. 19, 1990):
a shaken base puts in the work of the inertia forces -Γ a on that motion.

Grease: the Bouc-Wen spring holds (1-λ) k z²/(2A) and loses (1-λ) k/A |z|ⁿ (β |z ẋ| + γ z ẋ), which is never negative
for -β ≤ γ ≤ β (Erlicher & Point, C. R. Mécanique 332, 2004). Contact: the spring holds K δⁿ⁺¹/(n+1). Where a contact
that cannot pull has let go, its spring is still compressed by δ and relaxes against its own damper: that is lost too.
A law that changes K with time or amplitude does work on a compressed spring, which has an entry of its own.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields

import numba
import numpy as np
from tqdm import tqdm

from ..clearance.contact import contact_force, instantaneous
from ..clearance.gap import gap
from ..clearance.grease import (
    BETA,
    DAMPING,
    ELASTIC,
    EXPONENT,
    FILM_LIMIT,
    GAMMA,
    INVERSE_FILM,
    STIFFNESS,
    A,
    film_damping,
    grease_table,
)
from ..clearance.law import Law, table_values
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .base import Run, _Simulation, get_engine

__all__ = ["Impact", "Ledger", "keep_ledger"]

SIDE, BEGIN, V_IN, PEAK, IMPULSE, LOST = range(6)


@dataclass(frozen=True)
class Impact:
    """One visit of a bushing's end to its wall, from the moment the gap is used up to the moment it opens again.

    Both ends of a bushing are logged for themselves. The force of a contact that cannot pull may end before the visit.
    """

    time: float
    """s, of the first touch"""
    bushing: int
    """index of the bushing"""
    end: str
    """ "a", nearer to the clamp, or "b" """
    side: str
    """ "upper" or "lower" """
    v_in: float
    """m/s, speed into the wall in the step before the first touch"""
    v_out: float
    """m/s, speed off the wall in the step that leaves it"""
    peak_force: float
    """N"""
    impulse: float
    """N s"""
    duration: float
    """s"""
    loss: float
    """J, lost in the contact's damper"""

    @property
    def restitution(self) -> float:
        """Speed off the wall over speed into it; other forces act meanwhile, so it may exceed 1."""
        return self.v_out / self.v_in


@dataclass(frozen=True, eq=False)
class Ledger:
    """Energies in J at the samples of an excitation, from rest: what came in, what was lost, what is stored."""

    fs: float
    """samples per second"""
    input: np.ndarray
    """(n_t,) put in by the excitation"""
    law_work: np.ndarray
    """(n_t, n_bushings) put in by the law where it changed the stiffness of a compressed contact"""
    damping: np.ndarray
    """(n_t,) lost in the shaft's own damping"""
    hysteresis: np.ndarray
    """(n_t, n_bushings) lost in the grease's Bouc-Wen hysteresis"""
    film: np.ndarray
    """(n_t, n_bushings) lost in the grease's damper or squeeze film"""
    contact_loss: np.ndarray
    """(n_t, n_bushings) lost in contacts"""
    kinetic: np.ndarray
    """(n_t,) of the shaft, relative to the base"""
    strain: np.ndarray
    """(n_t,) of the shaft"""
    grease: np.ndarray
    """(n_t, n_bushings) stored in the grease's springs"""
    contact: np.ndarray
    """(n_t, n_bushings) stored in contacts"""
    impacts: tuple[Impact, ...]
    """in the order of their ends"""

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.input.size) / self.fs

    @property
    def put_in(self) -> np.ndarray:
        """(n_t,) J, by the excitation and by the law."""
        return self.input + self.law_work.sum(axis=1)

    @property
    def lost(self) -> np.ndarray:
        """(n_t,) J, all losses together."""
        return self.damping + (self.hysteresis + self.film + self.contact_loss).sum(axis=1)

    @property
    def stored(self) -> np.ndarray:
        """(n_t,) J, all that shaft, grease and contacts hold."""
        return self.kinetic + self.strain + (self.grease + self.contact).sum(axis=1)

    @property
    def residual(self) -> np.ndarray:
        """(n_t,) J, put in but neither lost nor stored: the error of the simulation."""
        return self.put_in - self.lost - self.stored

    @property
    def imbalance(self) -> float:
        """Largest residual as a share of the largest energy put in; 0 where nothing was put in."""
        most = np.max(self.put_in)
        return float(np.max(np.abs(self.residual)) / most) if most > 0 else 0.0

    def columns(self) -> dict[str, np.ndarray]:
        """Return time, energies (numbered where every bushing has its own) and residual by name, each (n_t,)."""
        found = {"time": self.time}
        for name in (f.name for f in fields(self) if f.name not in ("fs", "impacts")):
            value = getattr(self, name)
            found |= {name: value} if value.ndim == 1 else {f"{name}[{j}]": v for j, v in enumerate(value.T)}
        return found | {"residual": self.residual}

    def summary(self) -> dict:
        """Return the energies at the end, the imbalance and what the impacts were like, as plain data."""
        restitution = [impact.restitution for impact in self.impacts]
        count = Counter(impact.bushing for impact in self.impacts)
        return {
            "energy": {name: float(value[-1]) for name, value in self.columns().items() if name != "time"},
            "imbalance": self.imbalance,
            "impacts": [count[j] for j in range(self.contact.shape[1])],
            "median_restitution": float(np.median(restitution)) if restitution else None,
            "peak_force": max((impact.peak_force for impact in self.impacts), default=0.0),
        }


def keep_ledger(
    rig: Rig, excitation: Excitation, law: Law, engine="links", progress: str | None = None
) -> tuple[Response, Ledger]:
    """Simulate a rig as `simulate` does, look at it after every step, and keep account of its energy and impacts.

    Parameters
    ----------
    rig, excitation, law, engine
        As in `simulate`.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Response
        That of `simulate`.
    Ledger
        Its energies and impacts.

    Raises
    ------
    ClearanceError
        As `simulate`, and if the engine does not tell its equations and states.
    """
    simulation = _Simulation(rig, excitation, law, get_engine(engine))
    factor, n = simulation.interpolator.factor, excitation.value.size
    steps = (n + simulation.interpolator.ahead) * factor
    with tqdm(total=steps, desc=progress, unit="step", disable=progress is None) as bar:
        books = _Books(simulation.run, rig, law, simulation.step, factor, bar)
        simulation.run = books
        output = np.concatenate([block for _, block in simulation.outputs([excitation])])
    return simulation.response(excitation.value, output), books.close(excitation.fs, n)


class _Books(Run):
    """A run that is advanced step by step, and what was booked of it."""

    def __init__(self, run, rig, law, step, factor, bar):
        self.run, self.step, self.factor, self.bar, self.steps = run, step, factor, bar, 0
        self.scheme, n = run.equations(), len(rig.bushings)
        self.rules = np.array([b.gap for b in rig.bushings]), grease_table(rig, law), law.table(n)
        self.n_bushings, size = n, self.scheme.drive.size
        self.q, self.z, self.stiffness = np.zeros((2, size)), np.zeros((1, n)), np.zeros(n)
        self.under_way, self.total = np.zeros((2 * n, 6)), np.zeros(2 + 4 * n)
        self.rows, self.impacts = [], []

    def advance(self, drive):
        """Simulate one block; see `Run.advance`."""
        m, n = drive.size, self.n_bushings
        q, z = (np.concatenate((old, np.empty((m, old.shape[1])))) for old in (self.q, self.z))
        envelope, impact = np.empty((m, n)), np.empty((m, 2 * n))
        outputs = [self.run.advance(drive[:0])]
        for i in range(m):
            outputs.append(self.run.advance(drive[i : i + 1]))
            q[i + 2], z[i + 1], envelope[i], impact[i] = self.run.snapshot()
        self._book(drive, q, z, envelope, impact)
        self.q, self.z, self.steps = q[-2:], z[-1:], self.steps + m
        self.bar.update(m)
        return np.concatenate(outputs)

    def _book(self, drive, q, z, envelope, impact):
        """Book steps with coordinates q, of two steps before the first one on, and what the bushings remember."""
        mass, damping, stiffness, shape, points, seen = self.scheme
        h, m, n = self.step, drive.size, self.n_bushings
        before, now, after = q[:-2], q[1:-1], q[2:]
        travel, velocity = (after - before) / 2, np.diff(q, axis=0) / h
        kinetic = np.sum(velocity @ mass * velocity, axis=1) / 2
        strain = np.sum(now @ stiffness * (before + after), axis=1) / 4
        x = q @ points.T
        speed = (before * seen[0] + now * seen[1] + after * seen[2]) @ points.T
        flow, stored, force = np.zeros((4, m, n)), np.zeros((2, m, n)), np.zeros((2, m, 2 * n))
        _bushings(self.steps, h, x, speed, z, envelope, impact, *self.rules, self.stiffness, flow, stored, force)
        self._log(x[:-1], force)
        work = np.sum(travel @ damping * travel, axis=1) / h
        flow = np.column_stack((drive * (travel @ shape), work, *flow))
        booked = self.total + np.cumsum(flow, axis=0)
        self.total = self.total + flow.sum(axis=0)
        # A step's forces work from half a step before its time to half a step after; half of that is still to come.
        booked[:, : 2 + 2 * n] -= flow[:, : 2 + 2 * n] / 2
        at_time = np.column_stack((booked, (kinetic[1:] + kinetic[:-1]) / 2, strain, *stored))
        self.rows.append(at_time[:: self.factor])

    def _log(self, x, force):
        """Log the impacts that end within a block."""
        n = self.n_bushings
        rows = np.empty((n * (x.shape[0] + 1), 9))
        count = _impacts(self.steps, self.step, x[:, n:], force, self.rules[0], self.under_way, rows)
        for end, side, *values in rows[:count].tolist():
            name, of = "upper" if side > 0 else "lower", int(end)
            self.impacts.append(Impact(values[0], of // 2, "ab"[of % 2], name, *values[1:]))

    def close(self, fs, size) -> Ledger:
        """Return the ledger of so many samples."""
        n = self.n_bushings
        rows = np.concatenate(self.rows)[:size]
        input_, damping, film, contact_loss, hysteresis, law_work, kinetic, strain, grease, contact = np.split(
            rows, np.cumsum((1, 1, n, n, n, n, 1, 1, n)), axis=1
        )
        lost = {"damping": damping[:, 0], "hysteresis": hysteresis, "film": film, "contact_loss": contact_loss}
        stored = {"kinetic": kinetic[:, 0], "strain": strain[:, 0], "grease": grease, "contact": contact}
        impacts = tuple(impact for impact in self.impacts if impact.time + impact.duration <= size / fs)
        return Ledger(fs, input_[:, 0], law_work, **lost, **stored, impacts=impacts)


@numba.njit(cache=True, nogil=True)
def _bushings(steps, h, x, speed, z, envelope, impact, gaps, grease, law, stiffness, flow, stored, force):
    """Book what grease and contacts do in consecutive steps, of which x begins one step early and ends one late.

    Fills ``flow`` (film, contact loss, hysteresis, work of the law), ``stored`` (grease, contact) and ``force``
    (push and loss of every bushing end); ``stiffness`` is the contacts' in the step before.
    """
    film, contact_loss, hysteresis, law_work = flow
    in_grease, in_contact = stored
    push, loss = force
    n = gaps.size
    for i in range(envelope.shape[0]):
        for j in range(n):
            row, at, dx = grease[j], x[i + 1, j], x[i + 1, j] - x[i, j]
            c = film_damping(at, row[DAMPING], row[INVERSE_FILM], row[FILM_LIMIT])
            film[i, j] = c * speed[i, j] * (x[i + 2, j] - x[i, j]) / 2
            spring, zm = (1 - row[ELASTIC]) * row[STIFFNESS] / row[A], (z[i, j] + z[i + 1, j]) / 2
            hysteresis[i, j] = spring * abs(zm) ** row[EXPONENT] * (row[GAMMA] * zm * dx + row[BETA] * abs(zm * dx))
            in_grease[i, j] = (row[ELASTIC] * row[STIFFNESS] * at**2 + spring * z[i + 1, j] ** 2) / 2
            k, c = table_values(law, j, envelope[i, j] if law.by_amplitude else (steps + i) * h)
            power = law.exponent[j] + 1
            for end in range(2 * j, 2 * j + 2):  # each carries half of the bushing's k and c
                p = n + end
                g, g_before = gap(x[i + 1, p], gaps[j]), gap(x[i, p], gaps[j])
                if g == 0.0:
                    continue
                depth, side = abs(g), np.sign(g)
                law_work[i, j] += (k - stiffness[j]) / 2 * max(g * g_before, 0.0) ** (power / 2) / power
                in_contact[i, j] += k / 2 * depth**power / power
                k_now, c_now = instantaneous(k, c, law.exponent[j], law.kappa[j], depth, impact[i, end])
                push[i, end] = contact_force(k_now / 2, c_now / 2, depth, side * speed[i, p], law.adhesion[j])
                damper = push[i, end] - k_now / 2 * depth
                loss[i, end] = damper * side * (x[i + 2, p] - x[i, p]) / 2
                contact_loss[i, j] += loss[i, end]
            stiffness[j] = k


@numba.njit(cache=True, nogil=True)
def _impacts(steps, h, x, force, gaps, under_way, rows):
    """Follow every bushing end through consecutive steps, of which x begins one early; return the number of ``rows``.

    ``under_way``: each end's visit to a wall so far, with side 0 in the gap.
    """
    count = 0
    for i in range(force.shape[1]):
        for end in range(x.shape[1]):
            visit, d, was, now = under_way[end], gaps[end // 2], x[i, end], x[i + 1, end]
            side = visit[SIDE] if visit[SIDE] else np.sign(now)
            # Signed depths; time and speed of the passage from one to the other are those of a straight line.
            was, now = side * was - d, side * now - d
            if now > 0.0 and visit[SIDE] == 0.0:
                visit[SIDE], visit[BEGIN], visit[V_IN] = side, (steps + i - now / (now - was)) * h, (now - was) / h
            elif now <= 0.0 and visit[SIDE]:
                if visit[IMPULSE] > 0.0:
                    duration = (steps + i - now / (now - was)) * h - visit[BEGIN]
                    begun, pushed = (end, side, visit[BEGIN], visit[V_IN]), (visit[PEAK], visit[IMPULSE])
                    rows[count] = np.array((*begun, (was - now) / h, *pushed, duration, visit[LOST]))
                    count += 1
                visit[:] = 0.0
            if visit[SIDE]:
                visit[PEAK] = max(visit[PEAK], force[0, i, end])
                visit[IMPULSE] += force[0, i, end] * h
                visit[LOST] += force[1, i, end]
    return count
