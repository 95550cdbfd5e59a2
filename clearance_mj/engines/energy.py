"""Energy balance of a simulation, and a log of its impacts.

Every engine's coordinates satisfy, step after step and to rounding, discrete equations:
M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/(2h) + K q = b a - Pᵀ f. Multiplied by the step's travel (q₊ - q₋)/2 they become an
exact balance of energy: the kinetic energy ½ v M v of v = (q₊ - q)/h and the strain energy ½ q K q₊ change by
the work of excitation, damping and clearances. The clearances' work is split in each step: stored in springs, lost in
dampers and hysteresis, each by its formula and none as the remainder. So the residual shows the error of the engine's
forces and of the finite step. This is the energy check of explicit dynamics
(Belytschko, Liu & Moran, Nonlinear Finite Elements for Continua and Structures, 2000, section 6.2, with a tolerance of
the order of 1 %).

All energies are those of the motion relative to the base plate (Uang & Bertero, Earthq. Eng. Struct. Dyn. 19, 1990):
a shaken base does the work of the inertia forces -Γ a on that motion.

Energies of springs and hysteresis come from the contact and grease models. Where a contact that cannot pull has let
go, its spring is still compressed and relaxes against its damper: that is lost too.
A law that changes K with time or amplitude does work on a compressed spring, which has an entry of its own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from tqdm import tqdm

from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .base import Engine, SimulationRun, default_engine, get_engine
from .energies import OF_CLEARANCE, OF_END, OF_RIG
from .simulation import Simulation

__all__ = ["EnergyBalance", "Impact", "energy_balance"]

STORED = ("kinetic", "strain", "grease", "contact")  # at the steps' times; all others are flows from step to step


@dataclass(frozen=True)
class Impact:
    """One contact of a bushing's end with its wall, from the closing of the gap to its opening.

    Both ends of a bushing are logged separately. The force of a contact that cannot pull may end before.
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
    """Energies in J at the samples of an excitation, from rest: put in, lost and stored."""

    response: Response
    """of the simulation"""
    fs: float
    """samples per second"""
    input: np.ndarray
    """(n_t,) put in by the excitation"""
    law_work: np.ndarray
    """(n_bushings, n_t) put in by the law where it changed the stiffness of a compressed contact"""
    damping: np.ndarray
    """(n_t,) lost in the shaft's damping"""
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
    """(n_t,) put in by the drive of a turning shaft's unbalance"""
    drive: np.ndarray | None = None
    """(n_t,) put in by cross stiffness, and by the drive of a turning shaft against friction and its damping; a film's
    drag is not known, so that a film that feeds a whirl has a loss below 0"""

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
        """(n_t,) J, in shaft, grease and contacts."""
        return self.kinetic + self.strain + (self.grease + self.contact).sum(axis=0)

    @property
    def residual(self) -> np.ndarray:
        """(n_t,) J, put in but neither lost nor stored: the error of the simulation."""
        return self.put_in - self.lost - self.stored

    @property
    def imbalance(self) -> float:
        """Largest residual over the largest energy put in; 0 where nothing was put in.

        In space, where gravity and rotation also take out energy, over the largest of all energies.
        """
        largest = np.max(self.put_in)
        if self.friction is not None:
            largest = max(np.max(np.abs(part)) for part in (self.input, self.put_in, self.lost, self.stored))
        return float(np.max(np.abs(self.residual)) / largest) if largest > 0 else 0.0

    def columns(self) -> dict[str, np.ndarray]:
        """Return time, energies (numbered by bushing) and residual by name, each (n_t,)."""
        columns = {"time": self.time}
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                columns |= {name: value} if value.ndim == 1 else {f"{name}[{j}]": v for j, v in enumerate(value)}
        return columns | {"residual": self.residual}

    def summary(self) -> dict[str, Any]:
        """Return the energies at the end, the imbalance and statistics of the impacts, as plain data."""
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
        Energies and impacts; its ``response`` is that of `simulate`.

    Raises
    ------
    ClearanceError
        As `simulate`, and if the engine does not report its energies.
    """
    rig, law = rig_and_law(model, law)
    simulation = Simulation(rig, excitation, law, get_engine(engine or default_engine(rig)))
    size, n, factor = excitation.value.shape[-1], len(rig.bushings), simulation.interpolator.factor
    steps = (size + simulation.interpolator.ahead) * factor
    with tqdm(total=steps, desc="energy", unit="step", disable=not progress) as bar:
        balanced = simulation.run = _BalancedRun(simulation.run, n, factor, bar)
        output = np.concatenate([block for _, block in simulation.outputs([excitation])])
    rows = np.concatenate(balanced.rows)[:size].T
    energies: dict[str, Any] = dict(zip(OF_RIG, rows))
    of_clearances = rows[len(OF_RIG) :].reshape(n, len(OF_CLEARANCE), rows.shape[1])
    energies |= dict(zip(OF_CLEARANCE, np.moveaxis(of_clearances, 1, 0)))
    for name in STORED[1:] if balanced.before() is not None else ():  # above that at rest
        energies[name] = energies[name] - energies[name][..., :1]
    if not rig.moves_across:
        energies |= {name: None for name in ("weight", "unbalance", "drive") if not energies[name].any()}
    if not any(bushing.friction for bushing in rig.bushings) and not rig.moves_across:
        energies["friction"] = None
    ends = np.concatenate(balanced.ends)
    ends = ends.reshape(len(ends), 2 * n, len(OF_END))
    visits = (visit for c in range(2 * n) for visit in _find_impacts(ends[:, c], c, rig, simulation.step))
    finished = [each for each in visits if each.time + each.duration <= size / excitation.fs]
    impacts = tuple(sorted(finished, key=lambda each: each.time + each.duration))
    response = simulation.response(excitation.value.T, output)
    return EnergyBalance(response, excitation.fs, impacts=impacts, **energies)


class _BalancedRun(SimulationRun):
    """A run that records energies at the samples, and the ends' contacts at all steps."""

    def __init__(self, run: SimulationRun, n_bushings: int, factor: int, bar: tqdm[Any]):
        self.run, self.factor, self.bar, self.steps = run, factor, bar, 0
        names = [*OF_RIG, *(name for _ in range(n_bushings) for name in OF_CLEARANCE)]
        self.stored, self.sums = np.array([name in STORED for name in names]), np.zeros(len(names))
        # A step's forces work from half a step before its time to half a step after; slipping and laws are over then.
        self.to_come = np.array([0.0 if name in ("hysteresis", "law_work") else 0.5 for name in names])
        self.rows: list[np.ndarray] = []
        self.ends: list[np.ndarray] = []

    def before(self) -> np.ndarray | None:
        """Return the rest; see `SimulationRun.before`."""
        return self.run.before()

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `SimulationRun.advance`."""
        output, works = self.run.balanced(excitation)
        of_rig = works[:, : self.stored.size]
        at_samples = np.arange(-self.steps % self.factor, len(works), self.factor)
        if len(works):
            # Flows up to each sample, and after the last one.
            pieces = np.add.reduceat(of_rig, np.append(0, at_samples[at_samples < len(works) - 1] + 1))
            sums = self.sums + np.cumsum(pieces, axis=0)
            self.sums = sums[-1]
            rows = of_rig[at_samples]
            self.rows.append(np.where(self.stored, rows, sums[: len(rows)] - self.to_come * rows))
        self.ends.append(works[:, self.stored.size :].copy())
        self.steps += len(works)
        self.bar.update(len(works))
        return output


def _find_impacts(end: np.ndarray, number: int, rig: Rig, step: float) -> Iterator[Impact]:
    """Yield the contacts of an end, (n, 5) of `OF_END`; times are interpolated linearly between its depths."""
    depth, push, loss, n_y, n_z = end.T
    bushing = rig.bushings[number // 2]
    inside = np.concatenate(([False], depth > 0, [False]))
    starts, stops = np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(~inside[1:] & inside[:-1])
    for first, after in zip(starts, stops):
        if first == 0 or after == len(depth) or not push[first:after].any():
            continue  # at rest on it before, not over yet, or ended without a force
        begin = (first - depth[first] / (depth[first] - depth[first - 1])) * step
        finish = (after - depth[after] / (depth[after] - depth[after - 1])) * step
        axis = "YZ"[int(abs(n_z[first]) >= abs(n_y[first]))]
        is_above = (n_z if axis == "Z" else n_y)[first] > 0
        side = ("+" if is_above else "-") + axis if bushing.is_round else "upper" if is_above else "lower"
        yield Impact(
            float(begin), number // 2, "ab"[number % 2], side, float(depth[first] - depth[first - 1]) / step,
            float(depth[after - 1] - depth[after]) / step, float(push[first:after].max()),
            float(push[first:after].sum() * step), float(finish - begin), float(loss[first:after].sum()),
        )  # fmt: skip
