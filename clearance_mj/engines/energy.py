"""Energy balance of a simulation, and a log of its impacts.

Every engine's coordinates satisfy, step after step and to rounding, the equations that its run tells (`Equations`):
M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = b a - Pᵀ f. Multiplied by the step's travel (q₊ - q₋)/2 they become a
balance of energy without a rest: the kinetic energy ½ v M v of v = (q₊ - q)/h and the strain energy ½ q K q₊ change by
the work of excitation, damping and bushings. What is added here is what the bushings did with their share. The kernel
is run once more along the coordinates, as the engine should have run it: stored is what the springs hold, lost what
dampers and hysteresis take, each by its own formula and none as the remainder. So the residual shows what the engine's
forces and the finite step have made of the law. This is the energy check of explicit dynamics (Belytschko, Liu &
Moran, Nonlinear Finite Elements for Continua and Structures, 2000, section 6.2, with a tolerance of the order of 1 %).

All energies are those of the motion relative to the base plate (Uang & Bertero, Earthq. Eng. Struct. Dyn. 19, 1990):
a shaken base puts in the work of the inertia forces -Γ a on that motion.

What springs hold and hysteresis loses is said by the contact and grease models. Where a contact that cannot pull has
let go, its spring is still compressed and relaxes against its own damper: that is lost too.
A law that changes K with time or amplitude does work on a compressed spring, which has an entry of its own.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from tqdm import tqdm

from ..clearance.kernel import clearance_records
from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..core.errors import ClearanceError
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .base import Engine, Run, default_engine, get_engine, in_columns
from .energy_loop import BushingEnergies, bushing_energies, follow_impacts
from .energy_space import spatial_energies
from .simulation import Simulation

__all__ = ["EnergyBalance", "Impact", "energy_balance"]


@dataclass(frozen=True)
class Impact:
    """One visit of a bushing's end to its wall, from the moment the gap is used up to the moment it opens again.

    Both ends of a bushing are logged for themselves. The force of a contact that cannot pull may end before the visit.
    """

    time: float  #: s, of the first touch
    bushing: int  #: index of the bushing
    end: str  #: "a", nearer to the clamp, or "b"
    side: str  #: "upper" or "lower", or of a round bushing the nearest of "+Y", "-Y", "+Z" and "-Z"
    v_in: float  #: m/s, speed into the wall in the step before the first touch
    v_out: float  #: m/s, speed off the wall in the step that leaves it
    peak_force: float  #: N
    impulse: float  #: N s
    duration: float  #: s
    loss: float  #: J, lost in the contact's damper

    @property
    def restitution(self) -> float:
        """Speed off the wall over speed into it; other forces act meanwhile, so it may exceed 1."""
        return self.v_out / self.v_in


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Energies in J at the samples of an excitation, from rest: what came in, what was lost, what is stored."""

    response: Response
    """what was simulated"""
    fs: float
    """samples per second"""
    input: np.ndarray
    """(n_t,) put in by the excitation"""
    law_work: np.ndarray
    """(n_bushings, n_t) put in by the law where it changed the stiffness of a compressed contact"""
    damping: np.ndarray
    """(n_t,) lost in the shaft's own damping"""
    hysteresis: np.ndarray
    """(n_bushings, n_t) lost in the grease's hysteresis"""
    film: np.ndarray
    """(n_bushings, n_t) lost in the grease's damper or squeeze film"""
    contact_loss: np.ndarray
    """(n_bushings, n_t) lost in contacts"""
    kinetic: np.ndarray
    """(n_t,) of the shaft, relative to the base"""
    strain: np.ndarray
    """(n_t,) of the shaft"""
    grease: np.ndarray
    """(n_bushings, n_t) stored in the grease's springs"""
    contact: np.ndarray
    """(n_bushings, n_t) stored in contacts"""
    impacts: tuple[Impact, ...]
    """in the order of their ends"""
    friction: np.ndarray | None = None
    """(n_bushings, n_t) lost where a shaft in space rubs"""
    weight: np.ndarray | None = None
    """(n_t,) put in by gravity, of a rig in space; stored energies are those above the rest under it"""
    unbalance: np.ndarray | None = None
    """(n_t,) put in by what drives the unbalance of a turning shaft"""
    drive: np.ndarray | None = None
    """(n_t,) put in by what drives a turning shaft against friction and its own damping; a film's drag is not known,
    so that a film that feeds a whirl has a loss below 0"""

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.input.size) / self.fs

    @property
    def put_in(self) -> np.ndarray:
        """(n_t,) J, by the excitation and by the law; in space also by gravity, unbalance and drive."""
        others = [work for work in (self.weight, self.unbalance, self.drive) if work is not None]
        return np.asarray(self.input + self.law_work.sum(axis=0) + sum(others))

    @property
    def lost(self) -> np.ndarray:
        """(n_t,) J, all losses together."""
        rubbed = 0.0 if self.friction is None else self.friction.sum(axis=0)
        return np.asarray(self.damping + (self.hysteresis + self.film + self.contact_loss).sum(axis=0) + rubbed)

    @property
    def stored(self) -> np.ndarray:
        """(n_t,) J, all that shaft, grease and contacts hold."""
        return self.kinetic + self.strain + (self.grease + self.contact).sum(axis=0)

    @property
    def residual(self) -> np.ndarray:
        """(n_t,) J, put in but neither lost nor stored: the error of the simulation."""
        return self.put_in - self.lost - self.stored

    @property
    def imbalance(self) -> float:
        """Largest residual as a share of the largest energy put in; 0 where nothing was put in.

        In space, where gravity and turning take back what they put in, of the largest of all energies.
        """
        most = np.max(self.put_in)
        if self.friction is not None:
            most = max(np.max(np.abs(part)) for part in (self.input, self.put_in, self.lost, self.stored))
        return float(np.max(np.abs(self.residual)) / most) if most > 0 else 0.0

    def columns(self) -> dict[str, np.ndarray]:
        """Return time, energies (numbered where every bushing has its own) and residual by name, each (n_t,)."""
        found = {"time": self.time}
        for name in (f.name for f in fields(self) if f.name not in ("response", "fs", "impacts")):
            value = getattr(self, name)
            if value is None:
                continue
            found |= {name: value} if value.ndim == 1 else {f"{name}[{j}]": v for j, v in enumerate(value)}
        return found | {"residual": self.residual}

    def summary(self) -> dict[str, Any]:
        """Return the energies at the end, the imbalance and what the impacts were like, as plain data."""
        restitution = [impact.restitution for impact in self.impacts]
        count = Counter(impact.bushing for impact in self.impacts)
        return {
            "energy": {name: float(value[-1]) for name, value in self.columns().items() if name != "time"},
            "imbalance": self.imbalance,
            "impacts": [count[j] for j in range(len(self.contact))],
            "median_restitution": float(np.median(restitution)) if restitution else None,
            "peak_force": max((impact.peak_force for impact in self.impacts), default=0.0),
        }


def energy_balance(
    model: Rig | Modelled, excitation: Excitation, law: Law | None = None, engine: str | Engine | None = None,
    progress: bool = False,
) -> EnergyBalance:  # fmt: skip
    """Simulate a model as `simulate` does, and balance its energy and log its impacts step by step.

    Parameters
    ----------
    model, excitation, law, engine
        As in `simulate`.
    progress : bool
        Show a progress bar.

    Returns
    -------
    EnergyBalance
        Energies and impacts; its ``response`` is what `simulate` returns.

    Raises
    ------
    ClearanceError
        As `simulate`, and if the engine does not tell its equations and states.
    """
    rig, law = rig_and_law(model, law)
    simulation = Simulation(rig, excitation, law, get_engine(engine or default_engine(rig)))
    if rig.moves_across:
        return EnergyBalance(**spatial_energies(simulation, Impact, progress))
    factor, n = simulation.interpolator.factor, excitation.value.shape[-1]
    steps = (n + simulation.interpolator.ahead) * factor
    with tqdm(total=steps, desc="energy", unit="step", disable=not progress) as bar:
        balanced = simulation.run = _BalancedRun(simulation.run, rig, law, simulation.step, factor, bar)
        output = np.concatenate([block for _, block in simulation.outputs([excitation])])
    return balanced.result(simulation.response(excitation.value.T, output), excitation.fs, n)


class _BalancedRun(Run):
    """A run that is advanced step by step, and the energies found in its steps."""

    def __init__(self, run: Run, rig: Rig, law: Law, step: float, factor: int, bar: tqdm[Any]):
        self.run, self.step, self.factor, self.bar, self.steps = run, step, factor, bar, 0
        self.scheme, n = run.equations(), len(rig.bushings)
        self.clearance = clearance_records(rig, law, step)
        self.walls = np.array([b.walls for b in rig.bushings]).reshape(n, 2)
        if run.before() is not None:
            raise ClearanceError(
                f"rig {rig.name!r}: energies of planar rigs know no gravity and no loads yet; balance those in space"
            )
        self.q, self.total = np.zeros((2, len(self.scheme.mass))), np.zeros(2 + 4 * n)
        self.visits = np.zeros((2 * n, 6))
        self.rows: list[np.ndarray] = []
        self.impacts: list[Impact] = []

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        m = len(excitation)
        q, impact = np.concatenate((self.q, np.empty((m, self.q.shape[1])))), np.empty((m, len(self.visits)))
        outputs = [self.run.advance(excitation[:0])]
        for i in range(m):
            outputs.append(self.run.advance(excitation[i : i + 1]))
            q[i + 2], impact[i] = self.run.snapshot()
        self._balance(excitation, q, impact)
        self.q, self.steps = q[-2:], self.steps + m
        self.bar.update(m)
        return np.concatenate(outputs)

    def _balance(self, excitation: np.ndarray, q: np.ndarray, impact: np.ndarray) -> None:
        """Add steps with coordinates q, of two steps before the first one on, and speeds of impact."""
        mass, damping, stiffness, shape, points, seen, cross = self.scheme
        h, m, n = self.step, len(excitation), len(self.walls)
        before, now, after = q[:-2], q[1:-1], q[2:]
        travel, velocity = (after - before) / 2, np.diff(q, axis=0) / h
        kinetic = np.sum(velocity @ mass * velocity, axis=1) / 2
        strain = np.sum(now @ stiffness * (before + after), axis=1) / 4
        x = q @ points.T
        speed = (before * seen[0] + now * seen[1] + after * seen[2]) @ points.T
        of_bushings = BushingEnergies(*np.zeros((6, m, n)), *np.zeros((2, m, 2 * n)))
        bushing_energies(self.steps, x, speed, impact, self.clearance, of_bushings)
        self._log_impacts(x[:-1], of_bushings)
        *flows, in_grease, in_contact, _, _ = of_bushings
        work = np.sum(travel @ damping * travel, axis=1) / h
        if cross.size:
            work += np.sum(travel @ cross * now, axis=1)
        put_in = np.sum(in_columns(excitation) * (travel @ shape.T), axis=1)
        flow = np.column_stack((put_in, work, *flows))
        sums = self.total + np.cumsum(flow, axis=0)
        self.total = self.total + flow.sum(axis=0)
        # A step's forces work from half a step before its time to half a step after; half of that is still to come.
        sums[:, : 2 + 2 * n] -= flow[:, : 2 + 2 * n] / 2
        at_time = np.column_stack((sums, (kinetic[1:] + kinetic[:-1]) / 2, strain, in_grease, in_contact))
        self.rows.append(at_time[:: self.factor])

    def _log_impacts(self, x: np.ndarray, found: BushingEnergies) -> None:
        """Log the impacts that end within a block."""
        n = len(self.walls)
        rows = np.empty((n * (x.shape[0] + 1), 9))
        ends = np.ascontiguousarray(x[:, n:])
        count = follow_impacts(self.steps, self.step, ends, found, self.walls, self.visits, rows)
        for end, side, *values in rows[:count].tolist():
            name, of = "upper" if side > 0 else "lower", int(end)
            self.impacts.append(Impact(values[0], of // 2, "ab"[of % 2], name, *values[1:]))

    def result(self, response: Response, fs: float, size: int) -> EnergyBalance:
        """Return the balance of so many samples."""
        n = len(self.walls)
        input_, damping, film, contact_loss, hysteresis, law_work, kinetic, strain, grease, contact = np.split(
            np.concatenate(self.rows)[:size].T, np.cumsum((1, 1, n, n, n, n, 1, 1, n))
        )
        lost = {"damping": damping[0], "hysteresis": hysteresis, "film": film, "contact_loss": contact_loss}
        stored = {"kinetic": kinetic[0], "strain": strain[0], "grease": grease, "contact": contact}
        impacts = tuple(impact for impact in self.impacts if impact.time + impact.duration <= size / fs)
        return EnergyBalance(response, fs, input_[0], law_work, **lost, **stored, impacts=impacts)
