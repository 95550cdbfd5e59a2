"""The twin of a machine in operation: gap, oil and rubs along a record of probes and keyphasor, window by window.

Everything but gap and viscosity is as the orbits had it that the twin begins from. A window refines what is believed of
these, widened by a random walk; a change of either beyond what the windows' covariances explain is an alarm. So is a
rub: forces that neither the known law nor the shaft explains, as no window had them while the twin learned.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import RecordError
from ...core.kinds import checks_kinds
from ...estimate.beliefs import Belief
from ...io.dataset import Record
from ..follow.alarms import Alarm
from ..follow.changes import Changes, fused, refined
from ..records.prepared import prepared
from .forces import ForceMaker, forces_in
from .found import OrbitFit
from .problem import LawProblem, acts_without_contact, places_of, real
from .windows import LENGTH, Window, windows_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["OrbitAlarm", "OrbitTwin", "follow_orbits"]

HOP = 0.75  # s, from one window to the next
WALK = {"gap": 2e-3, "viscosity": 5e-3}  # of their logarithms over a second, standard deviation
WINDOW_STD, CHANGE_STD = 0.05, 0.5  # of a logarithm: how far a window may be off the last one, and after a change
UNITS = {"gap": (1e6, "µm"), "viscosity": (1e3, "mPa s")}  # as shown
THRESHOLD, SIGNIFICANCE = {"gap": 0.03, "viscosity": 0.1}, 4.0
"""Relative changes that matter, and standard deviations beyond them from which on a change counts"""
LEARNED = 6  # windows from which on it is known how much is missed in health
BEYOND, RISE = 6.0, 1.5  # standard deviations of what is missed in health, and factor on it, beyond which is a rub
MIN_WINDOWS = 4  # that show a change before it counts, so that gap and viscosity are told apart
BLOCK = 200  # successive residuals that may be correlated
IN_A_ROW = 3  # windows that show a rub before it counts: two hold what was before a sudden change and what is after
MAX_MOVE = 1.5  # standard deviations of a window: one that ends farther off is refined again from a wider belief


@dataclass(frozen=True)
class OrbitAlarm(Alarm):
    """A change that a record shows: of "gap" or "viscosity", or a "rub".

    Before and after are, of a rub, the contact force that laws explain and the largest one that nothing explains, N.
    """

    @property
    def shown_in(self) -> tuple[float, str]:
        """Number of the unit in which the quantity is shown in an SI unit, and its label."""
        return UNITS[self.quantity]

    def __str__(self) -> str:
        if self.quantity == "rub":
            return f"{self.time:.4g} s: bushings[{self.bushing}] rubs since {self.since:.4g} s, with {self.after:.3g} N"
        return super().__str__()


@dataclass(frozen=True, eq=False)
class OrbitTwin:
    """What is known of a machine's clearances over time, each value from what was measured by then."""

    record: str
    """name"""
    time: np.ndarray
    """(n,) s, ends of the windows"""
    names: tuple[str, ...]
    """of what is tracked, such as "bushings[0].gap" and "bushings[0].viscosity" """
    mean: np.ndarray
    """(n, n_names) logarithms of the values, SI"""
    std: np.ndarray
    """(n, n_names) their standard deviations"""
    missed: np.ndarray
    """(n, n_bushings) RMS of what laws and rig miss, over its expected error"""
    alarms: tuple[OrbitAlarm, ...]
    """in the order of time"""

    def value(self, name: str) -> np.ndarray:
        """Return the most likely values (n,) of what is tracked, SI unit.

        Parameters
        ----------
        name : str
            One of `names`.
        """
        return np.exp(self.mean[:, self.names.index(name)])

    def rows(self) -> list[dict[str, float]]:
        """Return a row of plain data for each window, SI units, with standard deviations of the logarithms."""
        found = []
        for i, time in enumerate(self.time.tolist()):
            row = {"time_s": time}
            for k, name in enumerate(self.names):
                row |= {name: float(np.exp(self.mean[i, k])), f"{name} std": float(self.std[i, k])}
            found.append(row | {f"bushings[{j}] missed": float(m) for j, m in enumerate(self.missed[i])})
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        alarms = [vars(a) | {"words": str(a)} for a in self.alarms]
        return {"record": self.record, "windows": self.rows(), "alarms": alarms}

    def plot(self) -> Figure:
        """Draw what is tracked over time with its 95 % band, below what laws and rig miss; vertical lines: alarms."""
        from ...core.drawing import COLOURS, canvas, tidy

        n = len(self.names)
        figure = canvas(1.9 * (n + 1))
        *own, last = figure.subplots(n + 1, 1, sharex=True, squeeze=False)[:, 0]
        for name, mean, std, axes in zip(self.names, self.mean.T, self.std.T, own):
            bushing, _, quantity = name.partition(".")
            factor, unit = UNITS[quantity]
            low, middle, high = (factor * np.exp(mean + k * std) for k in (-1.96, 0.0, 1.96))
            axes.fill_between(self.time, low, high, color=COLOURS[0], alpha=0.25, lw=0, label="95 % band")
            axes.plot(self.time, middle, color=COLOURS[0], label="most likely")
            tidy(axes, bushing, f"{quantity} ({unit})")
            _mark(axes, [a for a in self.alarms if (f"bushings[{a.bushing}]", a.quantity) == (bushing, quantity)])
            axes.legend(fontsize="small")
        for j, missed in enumerate(self.missed.T):
            last.plot(self.time, missed, color=COLOURS[j % len(COLOURS)], label=f"bushings[{j}]")
        tidy(last, "What laws and rig do not explain", "over expected", "Time (s)")
        _mark(last, [a for a in self.alarms if a.quantity == "rub"])
        last.legend(fontsize="small")
        return figure


def _mark(axes: Axes, alarms: Sequence[OrbitAlarm]) -> None:
    from ...core.drawing import ALARM

    for alarm in alarms:
        axes.axvline(alarm.time, color=ALARM, lw=1.0)
        axes.annotate(
            f" {alarm.quantity}", (alarm.time, 0.9), xycoords=("data", "axes fraction"), color=ALARM, fontsize="small"
        )


@checks_kinds
def follow_orbits(record: Record, found: OrbitFit) -> OrbitTwin:
    """Follow gaps and oil films along a record of a machine in operation, with alarms where they change or rub.

    Parameters
    ----------
    record : Record
        Two probes in each bushing and a keyphasor, of a shaft that unbalance alone excites.
    found : OrbitFit
        What earlier orbits of the machine told, see `orbits`.

    Returns
    -------
    OrbitTwin

    Raises
    ------
    RecordError
        If the record lacks probes or is shorter than the twin learns from.
    """
    if record.missing_probes:
        number, label = record.missing_probes[0]
        raise RecordError(f'record "{record.name}": bushings[{number}] has no displacement probe at {label}')
    whole = prepared(record)
    shortest = LENGTH + LEARNED * HOP
    if whole.turning is None or whole.duration < shortest:
        raise RecordError(
            f'record "{record.name}": lasts {whole.duration:.4g} s; a twin learns from {shortest:.3g} s of turning'
        )
    return OrbitFollower(found).run(record.name, windows_of(whole, LENGTH, HOP))


class OrbitFollower:
    """The twin's state, fed window by window, from a record or a live stream.

    Parameters
    ----------
    found : OrbitFit
        What earlier orbits told.
    """

    def __init__(self, found: OrbitFit) -> None:
        self.found, self.places = found, places_of(found.drawn)
        self.values = dict(zip(found.estimates.names, found.estimates.value.tolist()))
        own = {p.name: p for p in found.estimates.parameters}
        first = f"bushings[{self.places[0].number}].gap"
        split = list(own).index(first)
        self.uncertain, self.own = list(own.values())[:split], list(own.values())[split:]
        self.touching = any(c.touches for c in found.clearances)
        tracked = [(c, p) for c, p in zip(found.clearances, self.places) if c.seen]
        self.names = [f"bushings[{p.number}].gap" for _, p in tracked]
        self.names += [f"bushings[{p.number}].grease viscosity" for _, p in tracked if p.filling.round_only]
        self.told = tuple(name.replace("grease ", "") for name in self.names)
        self.kinds = [name.rpartition(".")[2] for name in self.told]
        at = [found.estimates.names.index(name) for name in self.names]
        covariance = found.estimates.covariance[np.ix_(at, at)]
        mean = np.log([self.values[name] for name in self.names]) if at else np.zeros(0)
        self.belief = Belief(mean, covariance + 1e-8 * np.eye(len(at)))
        self.changes = Changes(self.belief, np.full(len(at), CHANGE_STD)) if at else None
        self.maker: ForceMaker | None = None
        self.health: list[np.ndarray] = []
        self.rubbing, self.rubs = np.zeros((2, len(self.places)), dtype=int)

    def run(self, name: str, windows: Sequence[Window]) -> OrbitTwin:
        """Return what all windows of a record tell."""
        *histories, alarms = zip(*(self.take(window) for window in windows))
        time, mean, std, missed = map(np.array, histories)
        return OrbitTwin(name, time, self.told, mean, std, missed, tuple(itertools.chain(*alarms)))

    def take(self, window: Window) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, list[OrbitAlarm]]:
        """Return end, mean, standard deviation, what is missed and alarms of a window.

        Parameters
        ----------
        window : Window
            The next one.
        """
        if self.maker is None:
            frequency = np.fft.rfftfreq(window.size, 1 / window.fs)
            omega = 2 * np.pi * frequency[frequency <= self.found.bands.force]
            self.maker = ForceMaker(self.found.drawn, self.uncertain, omega)
        forces = forces_in(
            self.found.drawn, [window], self.uncertain, self.values, self.found.bands, maker=self.maker
        )  # fmt: skip
        filling = self.places[0].filling
        law = [p for p in self.own if self.touching or acts_without_contact(p.name, filling)]
        problem = LawProblem(forces, self.places, law, self.touching)
        base = np.array([self.values[name] for name in problem.names])
        at = [problem.names.index(name) for name in self.names]

        def misses(points: np.ndarray) -> np.ndarray:
            found = []
            for point in points:
                moved = base.copy()
                moved[at] = np.exp(point)
                found.append(real(problem.misses(moved)))
            return np.array(found)

        end = window.start + window.size / window.fs
        own, alarms = self._refined(misses, end) if self.names else (self.belief.mean, [])
        left = misses(own[None])[0].reshape(-1, len(self.places), 4)
        missed = np.sqrt(np.mean(left**2, axis=(0, 2)))
        peaks = np.abs(left).max(axis=(0, 2))
        alarms += self._rubs(np.array([missed, peaks]), forces.over_time(), end)
        return end, self.belief.mean, self.belief.std, missed, alarms

    def _refined(self, misses: Any, end: float) -> tuple[np.ndarray, list[OrbitAlarm]]:
        """Refine the belief; return what the window alone has found, and alarms."""
        assert self.changes is not None
        found, observation = refined(self.belief, misses, BLOCK, WINDOW_STD, CHANGE_STD, MAX_MOVE)
        walked = self.belief.drifted([WALK[k] * math.sqrt(HOP) for k in self.kinds])
        self.belief = fused(walked, observation, self.changes.add(walked, observation))
        thresholds = np.log1p([THRESHOLD[k] for k in self.kinds])
        likeliest = self.changes.likeliest(np.eye(len(self.kinds)), thresholds)
        if likeliest is None or likeliest[1] < SIGNIFICANCE or likeliest[0].windows < MIN_WINDOWS:
            return found.belief.mean, []
        change = likeliest[0]
        number, kind = int(self.names[change.kind].split("[")[1].split("]")[0]), self.kinds[change.kind]
        before = float(np.exp(change.before[change.kind]))
        self.belief = change.after.drifted(WINDOW_STD)
        self.changes = Changes(self.belief, np.full(len(self.kinds), CHANGE_STD))
        since = end - (change.windows - 1) * HOP - LENGTH
        return found.belief.mean, [OrbitAlarm(end, since, number, kind, before, before * math.exp(change.size))]

    def _rubs(self, missed: np.ndarray, force: np.ndarray, end: float) -> list[OrbitAlarm]:
        """Alarms of forces that nothing explains: missed (2, n_bushings), RMS and largest of all lines."""
        if len(self.health) < LEARNED:
            self.health.append(missed)
            return []
        known = np.array(self.health)
        limit = np.maximum(known.mean(axis=0) + BEYOND * known.std(axis=0, ddof=1), RISE * known.max(axis=0))
        self.rubbing = np.where(np.any(missed > limit, axis=0), self.rubbing + 1, 0)
        alarms = []
        for j in np.flatnonzero((self.rubbing == IN_A_ROW) & (self.rubs == 0)):
            largest = float(np.hypot(*force[0, :, 2 * j : 2 * j + 2].T).max())
            alarms.append(OrbitAlarm(end, end - LENGTH - (IN_A_ROW - 1) * HOP, int(j), "rub", 0.0, largest))
        self.rubs = np.where(self.rubbing >= IN_A_ROW, 1, np.where(self.rubbing == 0, 0, self.rubs))
        return alarms
