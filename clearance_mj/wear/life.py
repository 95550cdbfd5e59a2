"""Life of clearances: gaps over hours under steady operation, jumps, and the time at which a limit is reached."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..model import Model
from ..signals.arrays import ArrayData
from .growth import clearances_of
from .hours import REACHED, Moment, wear_on
from .operation import Operation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["ACCURACY", "LONGEST", "Life", "WearJump", "gap_limits", "predict_life"]

ACCURACY = 2e-3  # of the growth in a step, relative
LONGEST = 1e6  # h, more than a century: a longer life counts as endless
MAX_STEPS = 5000
CURVE = 400  # points of a drawn curve


@dataclass(frozen=True)
class WearJump:
    """A jump of a wearing machine's vibration."""

    hours: float
    """h"""
    gap: tuple[float, ...]
    """m, of each bushing"""
    before: tuple[float, ...]
    """W, rubbing of each bushing on the branch that ends"""
    after: tuple[float, ...]
    """W, rubbing of each bushing in the vibration that follows"""

    def __str__(self) -> str:
        j = int(np.argmax(np.abs(np.subtract(self.after, self.before))))
        return (
            f"at {self.hours:.4g} h, gap {1e3 * self.gap[j]:.5g} mm of bushings[{j}], the vibration jumps: rubbing "
            f"{self.before[j]:.3g} W to {self.after[j]:.3g} W"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Life(ArrayData):
    """Gaps of a machine over the hours that it runs."""

    model: Model
    """at the begin"""
    operation: Operation
    """operation of the machine"""
    limit: np.ndarray
    """(n_bushings,) gaps at which it ends, m; infinite where there is none"""
    hours: np.ndarray
    """(n,) h, from 0 on; at a jump twice the same up to the time within which it is located"""
    gap: np.ndarray
    """(n, n_bushings) m"""
    offset: np.ndarray
    """(n, n_bushings, 2) from the bushing's middle to the unloaded shaft along y and z, m"""
    rate: np.ndarray
    """(n, n_bushings) of the gap, m/h"""
    rubbing: np.ndarray
    """(n, n_bushings) mean of normal force times slip speed, W"""
    error: np.ndarray
    """(n, n_bushings) its standard error, W; 0 for periodic vibrations"""
    jumps: tuple[WearJump, ...]
    """in their order"""
    ended: str
    """reason for the prediction's end: "limit", "hours" or "no rubbing\""""

    @property
    def life(self) -> float:
        """Hours to the first gap that reaches its limit; infinite if none did."""
        return float(self.hours[-1]) if self.ended == "limit" else np.inf

    @property
    def at_limit(self) -> tuple[int, ...]:
        """Numbers of the bushings that have reached their limits."""
        return tuple(np.flatnonzero(self.gap[-1] >= self.limit * (1 - 2 * REACHED)).tolist())

    def gap_at(self, hours: float | np.ndarray) -> np.ndarray:
        """Return gaps (..., n_bushings) at times, m, interpolated between the steps by cubics through gaps and rates.

        Parameters
        ----------
        hours : float or ndarray
            h; the last gap holds beyond the end.
        """
        from scipy.interpolate import CubicHermiteSpline

        is_last = np.append(np.diff(self.hours) > 0, True)
        if np.sum(is_last) == 1:
            return np.broadcast_to(self.gap[-1], (*np.shape(hours), self.gap.shape[1]))
        spline = CubicHermiteSpline(self.hours[is_last], self.gap[is_last], self.rate[is_last])
        return np.asarray(spline(np.clip(hours, 0.0, self.hours[-1])))

    def words(self) -> list[str]:
        """Return sentences on the life, jumps, and the reason for the prediction's end."""
        names = self.model.rig.clearance_labels
        lines = [str(jump) for jump in self.jumps]
        if self.ended == "limit":
            which = " and ".join(f"{names[j]} ({1e3 * self.limit[j]:.4g} mm)" for j in self.at_limit)
            return [*lines, f"life {self.life:.4g} h: the gap of {which} reaches its limit"]
        gaps = ", ".join(f"{1e3 * gap:.4g}" for gap in self.gap[-1])
        if self.ended == "no rubbing":
            return [*lines, f"from {self.hours[-1]:.4g} h on nothing rubs: it does not wear further, gaps {gaps} mm"]
        return [*lines, f"after {self.hours[-1]:.4g} h no limit is reached, gaps {gaps} mm"]

    def rows(self) -> list[dict[str, float]]:
        """Return a row of plain data for each time and bushing, SI units and hours."""
        return [
            {
                "hours": float(hours), "bushing": j, "gap_m": float(self.gap[i, j]),
                "offset_y_m": float(self.offset[i, j, 0]), "offset_m": float(self.offset[i, j, 1]),
                "rate_m_per_h": float(self.rate[i, j]), "rubbing_w": float(self.rubbing[i, j]),
                "rubbing_error_w": float(self.error[i, j]),
            }
            for i, hours in enumerate(self.hours)
            for j in range(self.gap.shape[1])
        ]  # fmt: skip

    def plot(self) -> Figure:
        """Draw gaps over hours, with limits and jumps."""
        from ..core.drawing import canvas

        figure = canvas(3.4)
        self.draw_on(figure.subplots())
        return figure

    def draw_on(self, axes: Axes) -> None:
        """Draw gaps over hours on axes.

        Parameters
        ----------
        axes : Axes
            The axes.
        """
        from ..core.drawing import ALARM, COLOURS, tidy

        hours = np.linspace(0.0, self.hours[-1], CURVE)
        gaps = 1e3 * self.gap_at(hours)
        for j, name in enumerate(self.model.rig.clearance_labels):
            colour = COLOURS[j % len(COLOURS)]
            axes.plot(hours, gaps[:, j], color=colour, label=f"gap of {name}")
            if np.isfinite(self.limit[j]):
                axes.axhline(1e3 * self.limit[j], color=colour, lw=0.8, ls="--", label=f"limit of {name}")
        for i, jump in enumerate(self.jumps):
            axes.axvline(jump.hours, color=ALARM, lw=1.0, label=None if i else "jump")
        tidy(axes, "", "Gap (mm)", "Time in operation (h)")
        axes.legend(frameon=False, fontsize="small")


def gap_limits(model: Model, limit: float | str | Mapping[str, float | str]) -> np.ndarray:
    """Return the gaps (n_bushings,) at which a machine's life ends, m; infinite where none is given.

    Parameters
    ----------
    model : Model
        Model with the bushings.
    limit : float, str or mapping
        Of every bushing that wears, or by bushing as in `Rig.with_gap`: m, with a unit such as "0.5 mm", or a factor of
        its gap such as "x2".

    Raises
    ------
    ClearanceError
        If a limit is not above the gap.
    """
    rig = model.rig
    limits = np.full(len(rig.bushings), np.inf)
    for j, (bushing, wide) in enumerate(zip(rig.bushings, rig.with_gap(limit).bushings)):
        has_limit = wide.gap != bushing.gap if isinstance(limit, Mapping) else bushing.wear
        if has_limit:
            limits[j] = wide.gap
        if limits[j] <= bushing.gap:
            raise ClearanceError(
                f"gap limit {wide.gap:g} m of bushings[{j}] ({bushing.where}) must be above its gap, {bushing.gap:g} m"
            )
    return limits


@checks_kinds
def predict_life(
    model: Model, operation: Operation, limit: float | str | Mapping[str, float | str], hours: float = LONGEST,
    accuracy: float = ACCURACY, progress: bool = False,
) -> Life:  # fmt: skip
    """Predict the growth of a machine's gaps in operation, and the time at which the first one reaches its limit.

    The rate of wear at a gap is Archard's, of the vibration at that gap; gaps are integrated over hours. Hours are
    those in this operation.

    Parameters
    ----------
    model : Model
        Rig, whose bushings have a coefficient ``wear``, and law.
    operation : Operation
        Operation: a `Sine`, or `Marched` under a random excitation, a record or self-excited.
    limit : float, str or mapping
        Gap at which life ends, of every bushing that wears or by bushing: m, "0.5 mm", or "x2" of its gap.
    hours : float
        Time at which the prediction ends, h.
    accuracy : float
        Largest error of the growth in a step, relative, beyond the random error of a marched rubbing.
    progress : bool
        Show a progress bar over the way to the limit.

    Returns
    -------
    Life

    Raises
    ------
    RigError
        If no bushing wears, or one that does lacks its length or the shaft's radius.
    LawError
        For a law over time.
    ClearanceError
        If a limit is not above its gap, or no vibration converges.
    """
    limits = gap_limits(model, limit)
    if not 0 < hours < np.inf:
        raise ClearanceError(f"hours must be > 0 h and finite, got {hours!r}")
    if not 0 < accuracy < 1:
        raise ClearanceError(f"accuracy must be between 0 and 1, got {accuracy!r}")
    start = clearances_of(model.rig)[:, 0]
    moments: list[Moment] = []
    with tqdm(total=100.0, desc="wear", unit="%", disable=not progress, bar_format="{l_bar}{bar}| {elapsed}") as bar:
        for moment in wear_on(operation.source(model), model, limits, hours, accuracy):
            moments.append(moment)
            gap = clearances_of(moment.model.rig)[:, 0]
            fraction = max(float(np.max((gap - start) / (limits - start))), moment.hours / hours)
            bar.update(100 * min(fraction, 1.0) - bar.n)
            if len(moments) > MAX_STEPS:
                raise ClearanceError(
                    f"after {MAX_STEPS} steps and {moment.hours:g} h the wear still changes too quickly; "
                    "average it over a longer excitation, or give a larger accuracy"
                )
    return _make_life(model, operation, limits, moments)


def _make_life(model: Model, operation: Operation, limits: np.ndarray, moments: list[Moment]) -> Life:
    clearances = np.array([clearances_of(moment.model.rig) for moment in moments])
    jumps = tuple(
        WearJump(m.hours, tuple(c[:, 0].tolist()), tuple(m.fell_from.power.tolist()), tuple(m.vibration.power.tolist()))
        for m, c in zip(moments, clearances)
        if m.fell_from is not None
    )
    last = moments[-1]
    reached = bool(np.any(clearances[-1, :, 0] >= limits * (1 - 2 * REACHED)))
    ended = "limit" if reached else "hours" if last.rate.any() else "no rubbing"
    return Life(
        model, operation, limits, np.array([m.hours for m in moments]), clearances[:, :, 0], clearances[:, :, 1:],
        np.array([m.rate[:, 0] for m in moments]), np.array([m.vibration.power for m in moments]),
        np.array([m.vibration.error for m in moments]), jumps, ended,
    )  # fmt: skip
