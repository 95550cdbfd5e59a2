"""Maps of rattle over frequency and level, with first contact and jumps, for several gaps."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ClearanceError, ExcitationError, RigError
from ..core.kinds import checks_kinds
from ..core.tasks import run_tasks, workers_to_use
from ..model import Model
from ..rig import Rig
from ..signals import labelled
from ..signals.arrays import ArrayData
from .axes import level_axis
from .excitation import excited_by
from .in_gap import level_of_contact, linear_in_gap
from .map_rows import QUANTITIES, MapLevel, row_of, solver_at
from .resolution import resolution
from .solver import Solver

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Jump", "RattleMap", "increasing", "map_rattle"]

SWEEPS = ("up", "down")
SMALLEST = 1e-9  # m, of a gap: surfaces are rougher
LARGEST = 1e12  # level or frequency: figures cannot show larger ones


class Jump(NamedTuple):
    """A jump of a sweep over frequency to another vibration."""

    gap: int
    """index"""
    level: float
    """m/s² or N, or factor of the rig's unbalances"""
    frequency: float
    """Hz"""
    sweep: str
    """ "up" or "down": the direction of the sweep"""


@dataclass(frozen=True, eq=False, repr=False)
class RattleMap(ArrayData):
    """Vibrations of a rig over gap, level and frequency.

    Arrays of a sweep begin with its direction, up and down in frequency; nan where no vibration is known.
    """

    model: Model
    """rig and law of its clearances"""
    kind: str
    """excitation: "base", "force" or "unbalance" of rotating parts"""
    gap: np.ndarray
    """(n_gaps, n_bushings) m"""
    level: np.ndarray
    """(n_levels,) amplitude of the excitation, m/s² or N; factor of the rig's unbalance"""
    frequency: np.ndarray
    """(n_frequencies,) Hz; of an unbalance turns in a second"""
    vibrations: np.ndarray
    """(n_gaps, n_levels, n_frequencies) number of periodic vibrations, stable or not; 0: unknown"""
    contact_share: np.ndarray
    """(2, n_gaps, n_levels, n_frequencies, n_bushings) fraction of the period in which either end touches"""
    penetration: np.ndarray
    """(2, n_gaps, n_levels, n_frequencies, n_bushings) peak of a period, m"""
    contact_force: np.ndarray
    """(2, n_gaps, n_levels, n_frequencies, n_bushings) peak of a period, of both ends, N"""
    displacement: np.ndarray
    """(2, n_gaps, n_levels, n_frequencies, n_bushings) of the clearances' middles, as `Branch.excursion`, m"""
    acceleration: np.ndarray
    """(2, n_gaps, n_levels, n_frequencies, n_sensors) amplitude at the sensors, m/s²"""
    first_contact: np.ndarray
    """(n_gaps, n_frequencies) level above which an upward sweep in level touches; 0: it rests on a wall"""
    jumps: tuple[Jump, ...]
    """of sweeps over frequency"""
    ended: tuple[str, ...]
    """gap, level and frequency beyond which the continuation failed"""
    responses: tuple[str, ...]
    """degree of freedom of each sensor, such as "3:+Z" """
    clearances: tuple[str, ...]
    """name of each clearance, `Rig.clearance_labels`"""

    @property
    def rattles(self) -> np.ndarray:
        """(n_gaps, n_levels, n_frequencies) True where a sweep in either direction touches a wall."""
        return np.any(self.contact_share > 0, axis=(0, -1))

    @property
    def unknown(self) -> float:
        """Fraction of the map without a known vibration."""
        return float(np.mean(self.vibrations == 0))

    def plot(self, quantity: str = "contact_share", row: int | None = None, sweep: str = "larger") -> Figure:
        """Draw a quantity over frequency and level, a panel for each gap, with first contact and jumps.

        Parameters
        ----------
        quantity : str
            "contact_share", "penetration", "contact_force", "displacement" or "acceleration".
        row : int, optional
            Which clearance or sensor; None: the largest of all.
        sweep : str
            "up" or "down" in frequency, or the "larger" one of both.

        Raises
        ------
        ClearanceError
            For another quantity or sweep, or a row that is not there.
        """
        from ..core.drawing import canvas, key

        values = self._select(quantity, row, sweep)
        count, unit = len(self.gap), QUANTITIES[quantity][1].replace(" s-2", "/s²")
        figure = canvas(4.2, 3 + 4 * count)
        peak = float(np.nanmax(values)) if np.isfinite(values).any() else 1.0
        panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
        for i, axes in enumerate(panels):
            mesh = axes.pcolormesh(
                self.frequency, self.level, values[i], cmap="YlOrRd", vmin=0, vmax=peak or 1.0, shading="nearest"
            )
            self.mark(axes, i)
            if self.level.size > 1:
                axes.set_ylim(self.level[0], self.level[-1])
            axes.set(xlim=(self.frequency[0], self.frequency[-1]), xlabel=level_axis(self.kind).frequency)
            gaps = ", ".join(f"{1e3 * gap:.3g}" for gap in np.unique(self.gap[i]))
            axes.set_title(f"gap {gaps} mm", fontsize=10)
        panels[0].set_ylabel(level_axis(self.kind).level)
        key(figure, panels[0].get_legend_handles_labels()[0])
        name = quantity.replace("_", " ") + ("" if unit == "1" else f" ({unit})")
        figure.colorbar(mesh, ax=list(panels), label=name)
        return figure

    def mark(self, axes: Axes, gap: int) -> None:
        """Mark unknown cells, cells with several vibrations, first contact and jumps on axes.

        Parameters
        ----------
        axes : matplotlib.axes.Axes
            Frequency along x, level along y.
        gap : int
            Number of the gap on the map.
        """
        from matplotlib.colors import ListedColormap

        from ..core.drawing import COLOURS, REPEAT, TEST

        count, cells = self.vibrations[gap], (self.frequency, self.level)
        if not count.all():
            unknown = np.ma.masked_where(count > 0, count)
            axes.pcolormesh(*cells, unknown, cmap=ListedColormap([REPEAT]), shading="nearest")
        if np.any(count > 1) and min(count.shape) > 1:
            axes.contourf(*cells, count, levels=[1.5, 1e9], colors="none", hatches=["//////"])
        axes.plot(self.frequency, self.first_contact[gap], color=TEST, lw=0.9, label="first contact")
        for sweep, marker in zip(SWEEPS, "^v"):
            at = [(jump.frequency, jump.level) for jump in self.jumps if jump.gap == gap and jump.sweep == sweep]
            if at:
                style: dict[str, Any] = {"color": COLOURS[0], "ms": 4.5, "mec": "white", "mew": 0.5}
                axes.plot(*np.transpose(at), marker, label=f"jumps in a sweep {sweep}", **style)

    def _select(self, quantity: str, row: int | None, sweep: str) -> np.ndarray:
        """Return a quantity (n_gaps, n_levels, n_frequencies)."""
        ClearanceError.require_known("quantity", quantity, QUANTITIES)
        values = getattr(self, quantity)
        if row is not None and not 0 <= row < values.shape[-1]:
            raise ClearanceError(f"row must be between 0 and {values.shape[-1] - 1}, got {row}")
        values = values.max(axis=-1) if row is None else values[..., row]
        if sweep == "larger":
            return values.max(axis=0)
        if sweep not in SWEEPS:
            raise ClearanceError(f'sweep must be "up", "down" or "larger", got {sweep!r}')
        return values[SWEEPS.index(sweep)]

    def to_xarray(self) -> xr.Dataset:
        """Return all quantities with labels and units, over (sweep, gaps, level, frequency, clearance or response)."""
        unit = level_axis(self.kind).symbol
        cells = ("gaps", "level", "frequency")
        variables: dict[str, Any] = {
            name: (("sweep", *cells, row), getattr(self, name), units) for name, (row, units) in QUANTITIES.items()
        }
        variables |= {"vibrations": (cells, self.vibrations, "1"), "rattles": (cells, self.rattles, "1")}
        variables["first_contact"] = (("gaps", "frequency"), self.first_contact, unit)
        variables["gap"] = (("gaps", "clearance"), self.gap, "m")
        for name, values, units in zip(Jump._fields, zip(*self.jumps), ("1", unit, "Hz", "1")):
            variables[f"jump_{name}"] = ("jump", np.array(values), units)
        coordinates = {
            "sweep": SWEEPS, "level": self.level, "frequency": self.frequency, "response": self.responses,
            "clearance": self.clearances,
        }  # fmt: skip
        return labelled.dataset("rattle map", variables, coordinates, {"kind": self.kind, "ended": list(self.ended)})


@checks_kinds
def map_rattle(
    model: Model, amplitudes: ArrayLike, frequencies: ArrayLike, gaps: Sequence[float | Sequence[float]] | None = None,
    kind: str | None = None, n_harmonics: int = 21, n_samples: int | None = None, n_modes: int = 8,
    workers: int | None = None, progress: bool = False, executor: Executor | None = None,
) -> RattleMap:  # fmt: skip
    """Map rattle and jumps of a rig over level and frequency of a harmonic excitation, for several gaps.

    At every level of every gap the curve of periodic vibrations is followed over all frequencies, around folds.
    A sweep upwards or downwards stays on it until it folds, then jumps to the next stretch of the curve. Detached
    branches, such as a dry whirl, are not on the map.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    amplitudes : array_like
        Amplitudes (n_levels,) of the excitation, m/s² or N, increasing; of kind "unbalance" factors of the rig's
        unbalances.
    frequencies : array_like
        Frequencies (n_frequencies,) of the excitation, Hz, increasing; of kind "unbalance" the shaft turns once in a
        period, and the rig's ``spin`` is ignored.
    gaps : sequence, optional
        Gaps to compare, m: each one number for all bushings, or one for each; None: the rig's.
    kind : str, optional
        Kind of excitation, "base", "force" or, of rotating parts, "unbalance"; None: unbalance of a rig that has some,
        else that of its shaker.
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
        Executor for the rows of the map instead of new processes; it is not shut down.

    Returns
    -------
    RattleMap
        Unknown vibrations show up in ``unknown`` and ``ended``.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples, modes or workers.
    ExcitationError
        For impossible levels or frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        For an impossible gap, or if the rig has no clearance, or in the gap moves without stiffness; for "unbalance" if
        it does not turn or has none, else if it turns at a speed that is not steady.

    Notes
    -----
    Processes start by importing the calling script: start a map below ``if __name__ == "__main__"``.
    """
    levels, frequencies = increasing(amplitudes, "amplitudes", 1), increasing(frequencies, "frequencies", 2)
    harmonics, counts = resolution(n_harmonics, n_samples, 1, n_modes)
    rig, kind = model.rig, excited_by(model, kind)
    workers = workers_to_use(workers)
    models = [Model(each, model.law) for each in ([rig] if gaps is None else [_with_gap(rig, gap) for gap in gaps])]
    if not models:
        raise ClearanceError("gaps is empty: give at least one")
    settings = 2 * np.pi * float(frequencies[-1]), harmonics, counts[0], n_modes
    solvers = [solver_at(each, kind, 1.0, *settings) for each in models]  # refuses what cannot be
    compute = functools.partial(row_of, kind, frequencies, harmonics, counts, n_modes)
    cases = [MapLevel(i, j, each, float(level)) for i, each in enumerate(models) for j, level in enumerate(levels)]
    shape = (2, len(models), levels.size, frequencies.size)
    widths = {"response": len(rig.sensors), "clearance": len(rig.bushings)}
    arrays = {name: np.full((*shape, widths[row]), np.nan) for name, (row, _) in QUANTITIES.items()}
    vibrations = np.zeros(shape[1:], dtype=int)
    jumps, ended = [], []
    alone = workers == 1 or len(cases) == 1
    words = "rattle map" if progress else ""
    run = run_tasks(compute, cases, 1 if alone else workers, processes=not alone, executor=executor, progress=words)
    for case, row in run:
        vibrations[case.gap, case.row] = row.vibrations
        for name, values in row.arrays.items():
            arrays[name][:, case.gap, case.row] = values
        jumps += [Jump(case.gap, case.level, *jump) for jump in row.jumps]
        ended += [(case.gap, case.level, frequency) for frequency in row.ended]
    gap = np.array([[bushing.gap for bushing in each.rig.bushings] for each in models])
    unit = level_axis(kind).unit
    messages = [
        f"gap {', '.join(f'{1e3 * d:g}' for d in np.unique(gap[i]))} mm, level {level:g} {unit}: no further periodic "
        f"vibration was found beyond {frequency:.6g} Hz"
        for i, level, frequency in sorted(ended)
    ]
    first = [_first_contact(at, levels, frequencies, share) for at, share in zip(solvers, arrays["contact_share"][0])]
    return RattleMap(
        model, kind, gap, levels, frequencies, vibrations, **arrays, first_contact=np.array(first),
        jumps=tuple(sorted(jumps)), ended=tuple(messages), responses=tuple(rig.sensor_labels),
        clearances=tuple(rig.clearance_labels),
    )  # fmt: skip


def _first_contact(solver: Solver, levels: np.ndarray, frequencies: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Return the level (n_frequencies,) of first contact: in closed form, or the lowest of the map that touches."""
    if solver.system.pressed.any():
        return np.zeros(frequencies.size)
    if linear_in_gap(solver):
        return level_of_contact(solver, 2 * np.pi * solver.system.frequency_ratio * frequencies)
    touched = np.any(contact > 0, axis=-1)
    return np.where(touched.any(axis=0), levels[touched.argmax(axis=0)], np.nan)


def increasing(values: ArrayLike, name: str, least: int) -> np.ndarray:
    """Return levels or frequencies as an array; an ExcitationError unless they are enough, possible and increasing."""
    array = np.asarray(values, dtype=float)
    if array.ndim != 1 or array.size < least:
        raise ExcitationError(f"{name} must be {least} or more numbers in a row, got an array of shape {array.shape}")
    if not (array[0] > 0 and array[-1] <= LARGEST and np.all(np.diff(array) > 0)):
        raise ExcitationError(f"{name} must be > 0, at most {LARGEST:g} and increasing")
    return array


def _with_gap(rig: Rig, gap: float | Sequence[float]) -> Rig:
    if any(0 < each < SMALLEST for each in np.ravel(np.asarray(gap, dtype=float))):
        raise RigError(f"each of gaps must be at least {SMALLEST:g} m, got {gap!r}")
    return rig.with_gap(gap)
