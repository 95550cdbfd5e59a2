"""The energy balance of a simulation in space: sums of the energies that the modal engine's loop finds in its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError
from .base import Run
from .modal_space import SpatialRun
from .round_energies import OF_BUSHING, OF_END, OF_RIG
from .simulation import Simulation

__all__ = ["spatial_energies"]

STORED = ("kinetic", "strain", "grease", "contact")  # at the steps' times; all others are flows from step to step


class _BalancedRun(Run):
    """A run in space whose energies are kept, at the samples, with the ends' contacts at all steps."""

    def __init__(self, run: SpatialRun, factor: int, bar: tqdm[Any]):
        self.run, self.factor, self.bar, self.steps = run, factor, bar, 0
        names = [*OF_RIG, *(name for _ in range(len(run.rig.bushings)) for name in OF_BUSHING)]
        self.flows = np.array([name not in STORED for name in names])
        self.sums = np.zeros(self.flows.sum())
        self.rows: list[np.ndarray] = []
        self.ends: list[np.ndarray] = []

    def advance(self, excitation: np.ndarray) -> np.ndarray:
        """Simulate one block; see `Run.advance`."""
        output, works = self.run.balanced(excitation)
        of_rig, of_ends = np.split(works, [self.flows.size], axis=1)
        flow = of_rig[:, self.flows]
        sums = self.sums + np.cumsum(flow, axis=0)
        self.sums = sums[-1] if len(sums) else self.sums
        of_rig[:, self.flows] = sums - flow / 2  # half of a step's forces are still to work
        first = -self.steps % self.factor
        self.rows.append(of_rig[first :: self.factor].copy())
        self.ends.append(of_ends)
        self.steps += len(works)
        self.bar.update(len(works))
        return output


def spatial_energies(simulation: Simulation, impact: Callable[..., Any], progress: bool) -> dict[str, Any]:
    """Simulate, and return the fields of an `EnergyBalance`.

    Parameters
    ----------
    simulation : Simulation
        Of a spatial rig, by the modal engine.
    impact : callable
        Makes an impact of its fields.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ClearanceError
        If the engine does not tell its energies in space.
    """
    if not isinstance(simulation.run, SpatialRun):
        raise ClearanceError(f"the {simulation.engine.name} engine does not tell its energies in space; use modal")
    excitation, factor = simulation.excitation, simulation.interpolator.factor
    size, n = excitation.value.shape[-1], len(simulation.rig.bushings)
    with tqdm(total=(size + simulation.interpolator.ahead) * factor, desc="energy", unit="step",
              disable=not progress) as bar:  # fmt: skip
        balanced = simulation.run = _BalancedRun(simulation.run, factor, bar)
        output = np.concatenate([block for _, block in simulation.outputs([excitation])])
    rows = np.concatenate(balanced.rows)[:size].T
    found: dict[str, Any] = dict(zip(OF_RIG, rows))
    found |= dict(zip(OF_BUSHING, np.moveaxis(rows[len(OF_RIG) :].reshape(n, len(OF_BUSHING), -1), 1, 0)))
    for name in STORED:  # above that at rest
        found[name] = found[name] - found[name][..., :1]
    ends = np.concatenate(balanced.ends).reshape(-1, 2 * n, len(OF_END))
    visits = (impact(*visit) for end in range(2 * n) for visit in _impacts(ends[:, end], end, simulation.step))
    impacts = tuple(each for each in visits if each.time + each.duration <= size / excitation.fs)
    return found | {
        "response": simulation.response(excitation.value.T, output), "fs": excitation.fs, "impacts": impacts,
    }  # fmt: skip


def _impacts(end: np.ndarray, number: int, step: float) -> Iterator[tuple[Any, ...]]:
    """Visits of an end, (n, 5) of `OF_END`, to the wall: the fields of `Impact`; times are those of straight lines."""
    depth, push, loss, n_y, n_z = end.T
    inside = np.concatenate(([False], depth > 0, [False]))
    starts, stops = np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(~inside[1:] & inside[:-1])
    for first, after in zip(starts, stops):
        if first == 0 or after == len(depth) or not push[first:after].any():
            continue  # at rest on it before, not over yet, or gone before it pushed
        begin = (first - depth[first] / (depth[first] - depth[first - 1])) * step
        finish = (after - depth[after] / (depth[after] - depth[after - 1])) * step
        axis = "YZ"[int(abs(n_z[first]) >= abs(n_y[first]))]
        sign = "+" if (n_z if axis == "Z" else n_y)[first] > 0 else "-"
        yield (
            float(begin), number // 2, "ab"[number % 2], sign + axis, float(depth[first] - depth[first - 1]) / step,
            float(depth[after - 1] - depth[after]) / step, float(push[first:after].max()),
            float(push[first:after].sum() * step), float(finish - begin), float(loss[first:after].sum()),
        )  # fmt: skip
