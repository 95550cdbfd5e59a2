"""Curves over two parameters: first contact over frequency and level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..clearance.law import Law
from ..errors import ExcitationError
from ..rig import Rig
from ..signals import _labelled as labelled
from ..signals.arrays import ArrayData, read_only
from .condensed import condensed
from .continuation import Motion, NoConvergence, Solver
from .forced import excitation_kind, resolution
from .in_gap import filled, linear_in_gap

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Curve", "first_contact"]

BISECTIONS = 60


@dataclass(frozen=True, eq=False, repr=False)
class Curve(ArrayData):
    """A curve over frequency and level."""

    what: str
    """ "first contact" """
    over: str
    """ "level": the parameter beside the frequency"""
    kind: str
    """ "base" or "force": what the excitation is"""
    frequency: np.ndarray
    """(n,) Hz"""
    value: np.ndarray
    """(n,) level, m/s² or N"""
    ended: str
    """at which frequency and level no vibration was found first: "" if there is none"""

    def __post_init__(self) -> None:
        self._set(frequency=read_only(self.frequency), value=read_only(self.value))

    @property
    def _unit(self) -> str:
        return "m/s²" if self.kind == "base" else "N"

    def plot(self) -> Figure:
        """Draw level over frequency."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6, 4.5), layout="constrained")
        axes = figure.subplots()
        axes.plot(self.frequency, self.value, label=self.what)
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel(f"{self.over} ({self._unit})")
        axes.legend()
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return frequency and level over ``point``."""
        unit = self._unit.replace("m/s²", "m s-2")
        variables = {"frequency": ("point", self.frequency, "Hz"), self.over: ("point", self.value, unit)}
        return labelled.dataset(
            "curve", variables, {}, {"what": self.what, "kind": self.kind, "ended": self.ended}
        )  # fmt: skip


def first_contact(
    rig: Rig,
    law: Law,
    frequencies: ArrayLike,
    kind: str | None = None,
    harmonics: int = 21,
    samples: int | None = None,
    modes: int = 8,
) -> Curve:
    """Find the level at which a wall is first touched, over frequency.

    In closed form where greases are linear in the gap; others are followed over the level until a gap is filled.

    Parameters
    ----------
    rig : Rig
        The rig.
    law : Law
        What acts in its clearances.
    frequencies : array_like
        (n,) Hz.
    kind : str, optional
        "base" or "force"; None: as the rig's shaker.
    harmonics : int
        Of the motion.
    samples : int, optional
        Of a period; None: the power of two from 12 times the harmonics on.
    modes : int
        Of the Ritz basis, as in the modal engine.

    Returns
    -------
    Curve
        Its ``over`` is "level"; nan where no vibration fills a gap, ``ended`` says at which frequency first.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes.
    ExcitationError
        For impossible frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    frequency = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if frequency.ndim != 1 or not frequency.size or not np.all((frequency > 0) & (frequency < np.inf)):
        raise ExcitationError("frequencies must be numbers > 0 Hz")
    harmonics, samples = resolution(harmonics, samples, 1, modes)
    kind = excitation_kind(rig, kind)
    solver = Solver(condensed(rig, law, kind, [1.0], harmonics, modes), harmonics, samples)
    omega = 2 * np.pi * frequency
    if linear_in_gap(solver):
        return Curve("first contact", "level", kind, frequency, 1 / filled(solver.system, omega), "")
    level = np.full(omega.size, np.nan)
    ended = ""
    for i, each in enumerate(omega):
        try:
            level[i] = _level_of_contact(solver, float(each))
        except NoConvergence as failed:
            where = f"{frequency[i]:.6g} Hz and level {failed.args[0]:g}"
            ended = ended or f"no further periodic vibration was found beyond {where}"
    return Curve("first contact", "level", kind, frequency, level, ended)


def _level_of_contact(solver: Solver, omega: float) -> float:
    """The level at which a vibration that grows out of rest fills a gap."""
    left, moved = solver.over_level(omega)
    walls = np.repeat(np.abs([bushing.walls for bushing in solver.system.rig.bushings]).min(axis=1), 2)

    def reach(motion: Motion) -> float:
        return float(np.max(np.abs(_ends(solver, motion)) / walls[:, None]))

    row = np.append(np.zeros(solver.size), 1.0)
    linear = solver.system.linear.basis @ -left + moved
    count = len(solver.system.rig.bushings)
    least = 0.1 / float(np.max(np.abs(linear[count:] @ solver.grid.basis.T) / walls[:, None]))
    scale = max(least * float(np.linalg.norm(left)), solver.least)
    motion = solver.solve(least, -least * left, least * moved, row, scale)
    if motion is None:
        raise NoConvergence(least)
    before = after = motion
    for after in solver.within(motion, 1e-3 * least, 1e6 * least):
        if reach(after) > 1:
            break
        before = after
    else:
        raise NoConvergence(before.omega)
    low, high = 0.0, 1.0
    way = (after.z - before.z, after.omega - before.omega)
    for _ in range(BISECTIONS):
        length = (low + high) / 2
        at = before.omega + length * way[1]
        found = solver.solve(at, before.z + length * way[0], before.y, row, before.scale)
        if found is None:
            raise NoConvergence(at)
        low, high = (low, length) if reach(found) > 1 else (length, high)
        if (high - low) * abs(way[1]) < 1e-9 * at:
            break
    return float(before.omega + (low + high) / 2 * way[1])


def _ends(solver: Solver, motion: Motion) -> np.ndarray:
    place = (solver.system.linear.basis @ motion.z + motion.y) @ solver.grid.basis.T
    return place[len(solver.system.rig.bushings) :]
