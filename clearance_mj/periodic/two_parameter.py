"""Curves of special points over two parameters: folds, first contact, period doublings and onset of whirl."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..core.plain_numbers import find_numbers, get_number, replace_numbers
from ..model import Model
from ..rig.tolerance import unit_of
from ..signals import labelled
from ..signals.arrays import ArrayData
from .axes import level_axis
from .branch import Branch, SpecialPoint
from .condensed import Condensed
from .continuation import MAX_POINTS, NoConvergence, PeriodicMotion, difference
from .dynamics import by_stiffness
from .following import resumed, solver_of
from .onset import first_hopf
from .resolution import different_ends
from .solver import OperatingPoint, Solver
from .special_points import SpecialMotions, WhirlOnsets
from .stability import FOLD
from .whirling import WHIRL, self_excited

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Curve", "follow_folds", "follow_special", "follow_whirl_onset"]

UNITS = {"gap": "m", "load": "× loads", "spin": "rad/s"}
RECENT = 5  # number of motions that give the curve's direction


@dataclass(frozen=True, eq=False, repr=False)
class Curve(ArrayData):
    """A curve over two parameters, in the order in which its points follow each other."""

    what: str
    """kind of a `SpecialPoint`, or "onset of whirl" """
    over: str
    """ "level", "gap", "load", "spin" or the path of a number of the model: the second parameter"""
    kind: str
    """excitation: "base", "force" or "unbalance"; "whirl" without excitation"""
    frequency: np.ndarray
    """(n,) Hz"""
    value: np.ndarray
    """(n,) level, as `Branch.level`; gap of the first clearance, m, the others in the same ratio; factor of the loads;
    spin, rad/s; or the number, in SI units"""
    ended: str
    """why the curve ends before its last value: "" if it does not"""
    speed: np.ndarray | None = None
    """(n,) of the shaft, rad/s, at onsets of whirl"""

    @property
    def turns(self) -> np.ndarray:
        """Indices of points at which the value turns: of a curve of folds the cusps, where two folds meet."""
        step = np.diff(self.value)
        return np.flatnonzero(step[1:] * step[:-1] < 0) + 1

    @property
    def unit(self) -> str:
        """Unit of the value."""
        if self.over == "level":
            return level_axis(self.kind).unit
        try:
            return UNITS.get(self.over) or unit_of(self.over)
        except ValueError:
            return ""

    def plot(self) -> Figure:
        """Draw the value over frequency or speed; turns of a curve of folds are marked."""
        from ..core.drawing import canvas

        figure = canvas(4.5, 6)
        axes = figure.subplots()
        x = self.frequency if self.speed is None else self.speed
        axes.plot(x, self.value, label=self.what)
        if self.what == FOLD and self.turns.size:
            axes.plot(x[self.turns], self.value[self.turns], "o", color="k", mfc="w", label="cusp")
        unit = f" ({self.unit})" if self.unit else ""
        axes.set(xlabel="frequency (Hz)" if self.speed is None else "speed (rad/s)", ylabel=self.over + unit)
        axes.legend(frameon=False)
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return frequency, value under the name of its parameter and, at onsets of whirl, speed over ``point``."""
        unit = self.unit.replace("m/s²", "m s-2")
        variables = {"frequency": ("point", self.frequency, "Hz"), self.over: ("point", self.value, unit),
                     "speed": ("point", self.speed, "rad s-1")}  # fmt: skip
        return labelled.dataset("curve", variables, {}, {"what": self.what, "kind": self.kind, "ended": self.ended})


@checks_kinds
def follow_folds(branch: Branch, point: SpecialPoint, to: float, over: str = "level", progress: bool = False) -> Curve:
    """Follow a fold over level or gap: the curve of jumps.

    It passes cusps, where two folds meet and below which nothing jumps, and goes on with the other fold.

    Parameters
    ----------
    branch : Branch
        Branch over frequency or level.
    point : SpecialPoint
        A fold of it.
    to : float
        Last level, m/s² or N, or gap of the first clearance, m; the curve also ends where it returns to its first
        value.
    over : str
        "level" or "gap"; the gaps of all clearances keep their ratio.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Curve
        If the continuation fails, the curve so far: ``ended`` says where.

    Raises
    ------
    ClearanceError
        If the point is no fold of the branch, or at an impossible last value.
    """
    if over not in ("level", "gap"):
        raise ClearanceError(f'over must be "level" or "gap", got {over!r}')
    if point not in branch.special or point.kind != FOLD:
        raise ClearanceError("point must be a fold of the branch, one of branch.special")
    return follow_special(branch, point, to, over, progress)


@checks_kinds
def follow_special(
    branch: Branch, point: SpecialPoint, to: float, over: str = "level", progress: bool = False
) -> Curve:  # fmt: skip
    """Follow a special point of a branch over a second parameter.

    Parameters
    ----------
    branch : Branch
        Branch over frequency or level.
    point : SpecialPoint
        One of ``branch.special``, of any kind.
    to : float
        Last value of the parameter, in its unit; the curve also ends where it returns to its first value.
    over : str
        "level", "gap" of the first clearance, the others in the same ratio, "load", a factor of all constant loads,
        "spin", which the excitation does not follow, or the path of a number of the rig, such as "bushings[0].offset",
        or of the law, such as "law.contact.stiffness".
    progress : bool
        Show a progress bar.

    Returns
    -------
    Curve
        If the continuation fails, the curve so far: ``ended`` says where.

    Raises
    ------
    ClearanceError
        If the branch has no such point, or is a whirl; for an unknown parameter or an impossible last value.
    """
    if point not in branch.special:
        raise ClearanceError("point must be one of branch.special")
    if branch.kind == WHIRL:
        raise ClearanceError("a whirl that nothing excites has no frequency to follow its special points over")
    solver, omega, z, y = resumed(branch, point.index)
    first, solver_at = _solvers(branch, point, over, solver)
    _require_other_value(to, first, over, point.kind)
    follower = SpecialMotions(point.kind, lambda share: solver_at(first + (share - 1) * (to - first)), omega, z, y)
    motions, ended = _follow(follower, follower.start(omega, z, y), point.kind, progress)
    turns = solver.system.periods / (solver.system.order or 1.0) / (2 * np.pi)
    frequency = np.array([follower.frequency(motion) for motion in motions]) * turns
    value = first + (np.array([m.parameter for m in motions]) - 1) * (to - first)
    ended = ended and f"{ended} beyond {frequency[-1]:.6g} Hz and {over} {value[-1]:g}"
    return Curve(point.kind, over, branch.kind, frequency, value, ended)


@checks_kinds
def follow_whirl_onset(
    model: Model, speed_range: tuple[float, float], to: float, over: str = "gap", n_modes: int = 8,
    progress: bool = False,
) -> Curve:  # fmt: skip
    """Follow the onset speed of a shaft's self-excited whirl over a second parameter.

    Parameters
    ----------
    model : Model
        As in `find_whirl_onset`.
    speed_range : tuple of float
        Speeds of the shaft, rad/s, > 0: the first onset between them is followed, also beyond them.
    to : float
        Last value of the parameter, in its unit.
    over : str
        "gap" of the first clearance, the others in the same ratio, "load" or a path, as in `follow_special`.
    n_modes : int
        Modes of each plane, to which static shapes are added.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Curve
        Its ``frequency`` is the whirl's, ``speed`` the shaft's. If the continuation fails, ``ended`` says where.

    Raises
    ------
    ClearanceError
        If no whirl begins between the speeds; for an unknown parameter or an impossible last value.
    RigError
        If the rig is planar or has no spin or no clearance.
    ExcitationError
        For impossible speeds.
    """
    ends = different_ends(speed_range, "speed_range", "speeds", "rad/s")
    system = self_excited(model, 1, n_modes, ends)
    first_value, model_at = (1.0, None) if over == "load" else _models(model, over)
    _require_other_value(to, first_value, over, "onset of whirl")

    def system_at(share: float) -> Condensed:
        value = first_value + (share - 1) * (to - first_value)
        if model_at is not None:
            return self_excited(model_at(value), 1, n_modes, ends)
        return system._replace(driven=system.driven._replace(weight=value * system.driven.weight))

    speed, follower = first_hopf(system, ends).speed, WhirlOnsets(functools.lru_cache(8)(system_at))
    first = follower.solve(1.0, np.array([speed]), np.zeros(0), np.array([0.0, 1.0]), speed)
    motions, ended = _follow(follower, first, "onset of whirl", progress)
    factors, speeds = np.array([m.parameter for m in motions]), np.array([m.z[0] for m in motions])
    whirls = np.array([follower.growth(*each).imag for each in zip(factors, speeds)]) / (2 * np.pi)
    value = first_value + (factors - 1) * (to - first_value)
    ended = ended and f"{ended} beyond {speeds[-1]:.6g} rad/s and {over} {value[-1]:g}"
    return Curve("onset of whirl", over, WHIRL, whirls, value, ended, speeds)


def _require_other_value(to: float, first_value: float, over: str, what: str) -> None:
    positive = over in ("level", "gap", "load", "spin")
    if not (-np.inf < to < np.inf and to != first_value and (to > 0 or not positive)):
        number = "> 0 and another" if positive else "another"
        raise ClearanceError(f"to must be {number} {over} than that of the {what}, {first_value:g}; got {to!r}")


def _follow(
    follower: SpecialMotions | WhirlOnsets, first: PeriodicMotion | None, what: str, progress: bool
) -> tuple[list[PeriodicMotion], str]:  # fmt: skip
    """Return motions from a parameter of 1 to 2, or back to 1, and why they end before."""
    if first is None:
        raise ClearanceError(f"the {what} is not found again; locate it with more samples")
    motions: list[PeriodicMotion] = []
    after: Iterator[PeriodicMotion] = follower.within(first, 1.0, 2.0)
    try:
        for _ in tqdm(range(MAX_POINTS), desc=what, unit="point", disable=not progress):
            if (motion := next(after, None)) is None:
                break
            if len(motions) > 1:
                follower.direction = _direction(motions)
            if motions and difference(motions[-1], motion) @ follower.direction < 0:  # a fall back, not a turn
                if (beyond := follower.across_wall(motions[-1])) is None:
                    raise NoConvergence(motion.parameter)
                after = follower.onwards(motion := beyond, 1.0, 2.0)
                next(after)
            motions.append(motion)
            if len(motions) > 1 and motion.parameter in (1.0, 2.0):  # located there, beyond a jump
                break
    except NoConvergence:
        return motions, f"no further {what} was found"
    return motions, ""


def _direction(motions: Sequence[PeriodicMotion]) -> np.ndarray:
    """Return the direction of the last motions: tangents are unreliable where the test function has steps."""
    chord = difference(motions[max(0, len(motions) - RECENT)], motions[-1])
    return np.asarray(chord / np.linalg.norm(chord))


def _solvers(branch: Branch, point: SpecialPoint, over: str, solver: Solver) -> tuple[float, Callable[[float], Solver]]:
    """Return the second parameter's value at a special point, and a function for solvers over frequency at others."""
    if over not in OperatingPoint._fields:
        first_value, model_at = _models(branch.model, over)
        levels, system = list(branch.level[point.index]), solver.system

        def anew(value: float) -> Solver:
            of_value = replace(branch, model=model_at(value))
            fresh = solver_of(of_value, levels, solver.harmonics, system.periods, solver.samples)
            system_then = fresh.system._replace(basis=system.basis, owner=system.owner)
            return Solver(system_then, solver.harmonics, solver.samples, fresh.at.spin)

        return first_value, functools.lru_cache(8)(anew)
    if over == "omega" or (over == "spin" and (solver.system.order or not solver.at.spin)):
        raise ClearanceError(f"over {over!r}: the excitation has another frequency, or the shaft does not turn")
    first_value = {"level": point.level, "gap": branch.model.rig.bushings[0].gap, "spin": solver.at.spin}.get(over, 1.0)
    unit = 1.0 if over == "spin" else first_value
    if over == "spin":
        solver.linear = by_stiffness(solver.system.driven)

    def at(value: float) -> Solver:
        state = solver.at._replace(**{over: value / unit})
        if state != solver.at:
            solver.take("omega", state)
        return solver

    return first_value, at


def _models(model: Model, over: str) -> tuple[float, Callable[[float], Model]]:
    """Return a number of a model, and a function for the model at another value; a datasheet's law follows the rig."""
    if over == "gap":
        gaps = np.array([bushing.gap for bushing in model.rig.bushings])
        return float(gaps[0]), lambda value: model.with_gap((gaps * (value / gaps[0])).tolist())
    part, path = ("law", over.removeprefix("law.")) if over.startswith("law.") else ("rig", over)
    data, follows = model.to_dict(), model == Model(model.rig)
    if part == "rig" and "contact" in path and not follows:
        raise ClearanceError(f"over {over}: has no effect beside the model's law; give law. instead")
    keys = [(part, *key) for key in find_numbers(data[part], path)]

    def at(value: float) -> Model:
        changed = Model.from_dict(replace_numbers(data, dict.fromkeys(keys, float(value))), model.rig)
        return Model(changed.rig) if follows and part == "rig" else changed

    return get_number(data, keys[0]) or 0.0, at
