"""Maps of the impacts in a rig over constant load, level and frequency: teeth in contact, parting and rattling."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..core.tasks import run_tasks, workers_to_use
from ..model import Model
from ..rig import Load, Rig
from ..signals import labelled
from ..signals.arrays import ArrayData
from .axes import level_axis
from .condensed import UNBALANCE
from .excitation import excited_by
from .level_branches import WAYS, LevelBranch, level_branches
from .map_rows import solver_at
from .rattle_maps import increasing
from .resolution import resolution

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["IMPACTS", "ImpactMap", "map_impacts"]

IMPACTS = ("without contact", "in contact", "single-sided impacts", "double-sided impacts")
"""Classes of vibrations: numbers 0 to 3 of `ImpactMap.impacts`."""
COLOURS = ("#ffffff", "#d9e6f2", "#f4a582", "#b2182b")  # of the classes, on figures
TASKS = 8  # least number for each process, if there are so many branches


@dataclass(frozen=True, eq=False, repr=False)
class ImpactMap(ArrayData):
    """Class of the impacts in a rig over factors of its constant loads, level and frequency.

    Arrays of a sweep begin with its direction, up from rest and down in level.
    """

    model: Model
    """rig and law of its clearances"""
    kind: str
    """excitation: "base", "force" or "unbalance\""""
    load: np.ndarray
    """(n_loads,) factor of the rig's constant loads"""
    level: np.ndarray
    """(n_levels,) amplitude of the excitation, m/s², N or N m; factor of unbalances and orders"""
    frequency: np.ndarray
    """(n_frequencies,) Hz; of rotating excitations turns in a second"""
    vibrations: np.ndarray
    """(n_loads, n_levels, n_frequencies) number of periodic vibrations, stable or not; 0: unknown"""
    impacts: np.ndarray
    """(2, n_loads, n_levels, n_frequencies) number of `IMPACTS`, the hardest of all clearances; -1: unknown"""
    contact_force: np.ndarray
    """(2, n_loads, n_levels, n_frequencies) peak of a period, of all clearances, N; nan: unknown"""
    onset: np.ndarray
    """(n_loads, n_frequencies) level above which a sweep from rest has impacts; infinite if none has"""

    @property
    def unknown(self) -> float:
        """Fraction of the map without a known vibration."""
        return float(np.mean(self.vibrations == 0))

    def plot(self, sweep: str = "up") -> Figure:
        """Draw the impacts over level and load, or over level and frequency, a panel for each load.

        Parameters
        ----------
        sweep : str
            "up" or "down" in level.

        Raises
        ------
        ClearanceError
            For another sweep.
        """
        from matplotlib.colors import ListedColormap
        from matplotlib.patches import Patch

        from ..core.drawing import REPEAT, canvas

        ClearanceError.require_known("sweep", sweep, ("up", "down"))
        shown = self.impacts[("up", "down").index(sweep)]
        over_load = self.frequency.size == 1
        x, classes = self.load if over_load else self.frequency, ListedColormap([REPEAT, *COLOURS])
        cells = [shown[:, :, 0].T] if over_load else list(shown)
        figure = canvas(4.2, 3.4 + 3.4 * len(cells))
        panels = figure.subplots(1, len(cells), sharey=True, squeeze=False)[0]
        for i, (axes, values) in enumerate(zip(panels, cells)):
            axes.pcolormesh(
                x, self.level, values, cmap=classes, vmin=-1.5, vmax=3.5, shading="nearest", rasterized=True
            )
            axes.plot(x, self.onset[:, 0] if over_load else self.onset[i], color="black", lw=0.9)
            axes.set_ylim(self.level[0], self.level[-1])
            at = f"at {self.frequency[0]:.6g} Hz" if over_load else f"loads × {self.load[i]:g}"
            axes.set_title(at, fontsize=10)
            axes.set_xlabel("constant loads over the rig's" if over_load else level_axis(self.kind).frequency)
        orders = self.kind == UNBALANCE and not self.model.rig.unbalances
        panels[0].set_ylabel("orders over the rig's" if orders else level_axis(self.kind).level)
        names = [i for i in range(len(IMPACTS)) if np.any(shown == i)]
        handles = [Patch(facecolor=COLOURS[i], edgecolor="0.6", lw=0.4, label=IMPACTS[i]) for i in names]
        if np.any(shown < 0):
            handles.append(Patch(facecolor=REPEAT, lw=0, label="none was found"))
        figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=9, frameon=False)
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return all quantities with labels and units, over (sweep, load, level, frequency)."""
        cells, unit = ("load", "level", "frequency"), level_axis(self.kind).symbol
        variables = {
            "vibrations": (cells, self.vibrations, "1"),
            "impacts": (("sweep", *cells), self.impacts, "1"),
            "contact_force": (("sweep", *cells), self.contact_force, "N"),
            "onset": (("load", "frequency"), self.onset, unit),
        }
        coordinates = {"sweep": ("up", "down"), "load": self.load, "level": self.level, "frequency": self.frequency}
        return labelled.dataset("impact map", variables, coordinates, {"kind": self.kind})


class _Case(NamedTuple):
    """Task for a worker: some frequencies at one load."""

    load: int
    frequencies: range
    model: Model


@checks_kinds
def map_impacts(
    model: Model, amplitudes: ArrayLike, frequencies: ArrayLike, loads: Sequence[float] = (1.0,),
    kind: str | None = None, n_harmonics: int = 21, n_samples: int | None = None, n_modes: int = 8,
    workers: int | None = None, progress: bool = False, executor: Executor | None = None,
) -> ImpactMap:  # fmt: skip
    """Classify the impacts in a rig over factors of its constant loads, level and frequency.

    With one frequency and many loads it is the rattle map of gears over mean torque and ripple, with one load that over
    speed and ripple. At every load and frequency the branch that grows out of rest is followed over the level, around
    folds; a sweep in level jumps where it folds. Detached branches are not on the map.

    Parameters
    ----------
    model : Model
        Rig and law of its clearances.
    amplitudes : array_like
        Amplitudes (n_levels,) of the excitation, m/s², N or N m, increasing; of kind "unbalance" factors of
        unbalances and orders.
    frequencies : array_like
        Frequencies (n_frequencies,) of the excitation, Hz, increasing; of kind "unbalance" turns in a second.
    loads : sequence of float
        Factors of the rig's constant loads, weight too, increasing.
    kind : str, optional
        Kind of excitation, "base", "force" or "unbalance" of what turns with the shaft; None: unbalance of a rig that
        has unbalances or orders, else that of its shaker.
    n_harmonics : int
        Number of harmonics of the motion, H.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    workers : int, optional
        Number of processes on this machine; default: one for each core. 1: this process alone.
    progress : bool
        Show a progress bar with the time left.
    executor : concurrent.futures.Executor, optional
        Executor for parts of the map instead of new processes; it is not shut down.

    Returns
    -------
    ImpactMap
        Unknown vibrations show up in ``unknown`` and as -1 in ``impacts``.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples, modes or workers.
    ExcitationError
        For impossible levels, frequencies or loads, or a rig without a position for a force.
    LawError
        For a law over amplitude, or one over time that does not turn with the shaft.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness and no loads press it against walls; for
        "unbalance" if nothing turns, else if it turns at a speed that is not steady.

    Notes
    -----
    Processes start by importing the calling script: start a map below ``if __name__ == "__main__"``.
    """
    levels, frequencies = increasing(amplitudes, "amplitudes", 1), increasing(frequencies, "frequencies", 1)
    factors, kind = increasing(loads, "loads", 1), excited_by(model, kind)
    harmonics, samples = resolution(n_harmonics, n_samples, 1, n_modes)
    workers = workers_to_use(workers)
    omega = 2 * np.pi * frequencies
    models = [Model(_with_loads(model.rig, float(share)), model.law) for share in factors]
    for loaded in models:
        solver_at(loaded, kind, 1.0, float(omega[-1]), harmonics, samples[0], n_modes)  # refuses what cannot be
    chunk = max(1, omega.size * factors.size // (TASKS * workers))
    chunks = [range(omega.size)[j : j + chunk] for j in range(0, omega.size, chunk)]
    cases = [_Case(i, numbers, each) for i, each in enumerate(models) for numbers in chunks]
    compute = functools.partial(_compute, kind, omega, levels, harmonics, samples, n_modes)
    shape = factors.size, levels.size, omega.size
    vibrations, impacts = np.zeros(shape, dtype=int), np.zeros((2, *shape), dtype=int)
    force, onset = np.full((2, *shape), np.nan), np.full((factors.size, omega.size), np.nan)
    alone = workers == 1 or len(cases) == 1
    words = "impact map" if progress else ""
    run = run_tasks(compute, cases, 1 if alone else workers, processes=not alone, executor=executor, progress=words)
    for case, parts in run:
        for j, (count, walls, peak, begins) in zip(case.frequencies, parts):
            vibrations[case.load, :, j], impacts[:, case.load, :, j] = count, walls
            force[:, case.load, :, j], onset[case.load, j] = peak, begins
    return ImpactMap(model, kind, factors, levels, frequencies, vibrations, impacts, force, onset)


def _with_loads(rig: Rig, factor: float) -> Rig:
    def scaled(load: Load) -> Load:
        if load.torque is not None:
            return dataclasses.replace(load, torque=factor * load.torque)
        force = factor * np.asarray(load.force)
        return dataclasses.replace(load, force=tuple(force.tolist()) if force.ndim else float(force))

    gravity = rig.gravity and tuple(factor * g for g in rig.gravity)
    return rig.replace(loads=tuple(map(scaled, rig.loads)), gravity=gravity)


def _compute(
    kind: str, omega: np.ndarray, levels: np.ndarray, harmonics: int, samples: Sequence[int], modes: int, case: _Case
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, float]]:
    """Return number, impacts (2, n_levels), forces (2, n_levels) and the onset level of impacts, at each frequency."""
    remaining, branches = list(case.frequencies), dict[int, LevelBranch]()
    for count in samples:
        solver = solver_at(case.model, kind, 1.0, float(omega[-1]), harmonics, count, modes)
        of_motion = solver.system.frequency_ratio * omega[remaining]
        for i, branch in zip(remaining, level_branches(solver, of_motion, levels[-1], (*WAYS, "contact_force"))):
            if i not in branches or branch.level.max() > branches[i].level.max():
                branches[i] = branch
        remaining = [i for i in remaining if not branches[i].complete]
        if not remaining:
            break
    return [_classify(branch, levels) for _, branch in sorted(branches.items())]


def _classify(branch: LevelBranch, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    lift, other, force = branch.values
    depth, lifts, double, peaks = np.moveaxis(branch.sweeps(levels, np.array([branch.depth, lift, other, force])), 1, 0)
    impacts = np.where(depth <= 0, 0, np.where(double > 0, 3, np.where(lifts > 0, 2, 1)))
    impacts[np.isnan(depth)] = -1
    return branch.crossings(levels)[0], impacts, peaks, branch.level_from_rest(np.minimum(branch.depth, lift))
